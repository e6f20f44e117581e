"""Every program of the corpus that LinuxCNC's interpreter accepts is followed, and nothing in it is lost."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ncfix.control.moves import MotionKind, Rule, Trace
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.text.reader import read

AXES = tuple("XYZABCUVW")
SETUP = Setup(tools={number: Tool(0.0) for number in range(100)}, assume_zero=True)
EXPECTED = 243


@pytest.fixture(scope="module")
def traces(shared: Callable[[str], Path]) -> dict[str, Trace]:
    """File -> trace, for the programs that the manifest says are accepted."""
    corpus = shared("corpus")
    rows = csv.DictReader((corpus / "manifest.csv").read_text(encoding="utf-8").splitlines())
    chosen = [row["file"] for row in rows if row["rs274_rc"] == "0" and row["dialect"] in ("linuxcnc", "iso", "grbl")]
    return {name: followed(corpus / name) for name in chosen}


def followed(path: Path) -> Trace:
    """A file of the corpus, with its subprograms beside it."""

    def resolve(name: str) -> bytes | None:
        found = [file for file in (path.parent / name, path.parent / f"{name}.ngc") if file.is_file()]
        return found[0].read_bytes() if found else None

    return trace(read(path.read_bytes(), str(path)), SETUP, AXES, frozenset("ABC"), resolve)


def test_all_are_followed(traces: dict[str, Trace]) -> None:
    assert len(traces) == EXPECTED
    assert sum(len(one.moves) > 0 for one in traces.values()) > 100


def test_hardly_anything_is_refused(traces: dict[str, Trace]) -> None:
    reasons: Counter[str] = Counter()
    total = 0
    for one in traces.values():
        total += len(one.moves)
        refused = one.moves.reason[one.moves.rule == Rule.REFUSE]
        reasons.update(one.moves.reasons[index] for index in refused)
    print(f"{total} motions; refused: {dict(reasons)}")
    assert sum(reasons.values()) < 0.001 * total


def test_what_may_be_corrected_is_known(traces: dict[str, Trace]) -> None:
    for name, one in traces.items():
        moves = one.moves
        free = moves.rule == Rule.CORRECT
        assert not np.isnan(moves.end[free]).any(), name
        cut = free & ((moves.kind == MotionKind.FEED) | (moves.kind == MotionKind.ARC))
        assert not np.isnan(moves.start[cut]).any(), name
        arcs = moves.kind == MotionKind.ARC
        assert not np.isnan(moves.centre[arcs]).any(), name
        assert np.isnan(moves.centre[~arcs]).all(), name
        assert (moves.reason[free] == 0).all(), name
        assert (moves.reason[~free] != 0).all(), name


def test_arcs_lead_from_start_to_end(traces: dict[str, Trace]) -> None:
    """The sweep about the centre leads from start to end, to the closure that a control allows (0.1 mm in inches)."""
    for name, one in traces.items():
        moves = one.moves
        arcs = np.flatnonzero(moves.kind == MotionKind.ARC)
        arm, goal = (moves.start[arcs, :3] - moves.centre[arcs]), (moves.end[arcs, :3] - moves.centre[arcs])
        normal, angle = moves.normal[arcs], moves.sweep[arcs, None]
        height = np.sum(normal * arm, axis=1, keepdims=True)
        turned = arm * np.cos(angle) + np.cross(normal, arm) * np.sin(angle) + normal * height * (1 - np.cos(angle))
        flat = goal - turned
        flat -= normal * np.sum(normal * flat, axis=1, keepdims=True)
        radius = np.linalg.norm(arm, axis=1)
        assert (np.linalg.norm(flat, axis=1) <= 0.1 + 1e-3 * radius).all(), name


def test_frames_lead_from_the_written_numbers_to_the_ends(
    traces: dict[str, Trace], shared: Callable[[str], Path]
) -> None:
    """Where a block of an absolute motion says X, the end in its frame has that X."""
    for name in ("linuxcnc/LinuxCNC__702e2c_plasmatest.ngc",):
        moves = traces[name].moves
        column = read((shared("corpus") / name).read_bytes(), name).column("X")[moves.block]
        rows = np.flatnonzero(~np.isnan(column) & ~moves.incremental & (moves.rule == Rule.CORRECT))
        frames = [moves.frames[index] for index in moves.frame[rows]]
        ends = zip(moves.end[rows], frames, strict=True)
        found = [((end - frame.offset)[:3] @ frame.rotation)[0] / frame.unit for end, frame in ends]
        assert len(found) > 100
        assert np.allclose(found, column[rows], atol=1e-9)
