"""Corrected Fanuc programs against a second control and a second model of the machine.

`NCFIX_FANUC=300 pytest tests/differential/test_fanuc_control.py` judges as many programs.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

from conftest import FULL
from differential import errors, fanuc
from differential.fanuc_programs import Author
from differential.sinumerik import tips
from differential.sinumerik_frames import Floats
from differential.sinumerik_motions import Path as Way
from differential.test_siemens import apart
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat, fix_program
from ncfix.control.setup import Setup, Tool
from ncfix.machine import load
from ncfix.text.reader import read

PROGRAMS = int(os.environ.get("NCFIX_FANUC", "3" if FULL else "2"))
FIRST = int(os.environ.get("NCFIX_SEED", "0"))
OFFSETS = {54: (0.0, 0.0, 60.0), 55: (5.0, -7.0, 70.0)}
EXTENDED = {1: (2.5, -4.0, 55.0), 2: (-3.0, 4.0, 65.0)}
LENGTHS = {1: 80.0, 2: 95.0}
START = {"X": 0.0, "Y": 0.0, "Z": 290.0, "A": 0.0, "C": 0.0}
SETUP = Setup(
    work_offsets={f"G{n}": dict(zip("XYZ", shift, strict=True)) for n, shift in OFFSETS.items()}
    | {f"G54.1P{n}": dict(zip("XYZ", shift, strict=True)) for n, shift in EXTENDED.items()},
    tools={number: Tool(length, 3.0) for number, length in LENGTHS.items()},
    initial=START,
)
MACHINE = "examples/machines/wCAYFXZSt.toml"
AT_ENDS = 0.35e-3
"""mm: rounding of three linear axes, of a vector, and what half a step of a rotary axis moves the tip by."""
CIRCLE = 0.5e-3
"""mm: so far beside its place a full circle may end, since it has to end where it starts."""
ON_THE_WAY = 1.6e-3
"""mm: the tolerance asked for, rounding, and the chords of the samples."""
TURNED = 0.2
"""Degrees that a rotary axis may be corrected by."""


def judged(text: str, root: Path, strategy: str, flat: bool = False) -> tuple[dict[str, float], int]:
    """The worst distance of ends, holes and ways from where they should be, mm, and how many motions were judged."""
    text = fanuc.marked(text)
    program = read(text.encode(), "part.nc", "fanuc")
    options = FixOptions(strategy=strategy, figures=False, flatten=flat)
    fixed = (fix_flat if flat else fix_program)(program, load(str(root / MACHINE)), SETUP, options)
    left = {refusal.line for refusal in fixed.report.refused}
    left |= {note.place.line for note in fixed.report.warnings if note.place and "must not be split" in note.text}
    for each in fixed.report.left:
        left |= {line for first, last in each.stretches for line in range(first, last + 1)}
    model = errors.load(root / MACHINE)
    meant, done = (by_mark(model, each, actual=n == 1) for n, each in enumerate((text, fixed.text.decode())))
    assert list(meant) == list(done)
    worst, count, fresh = {"rapid": 0.0, "cut": 0.0, "hole": 0.0, "way": 0.0}, 0, True
    for mark, (ways, points) in meant.items():
        kind, line = ways[0].sort, ways[0].line
        if kind == "fixed" or line in left:
            fresh = True  # what follows may begin where nothing was corrected
            continue
        turned = (ways[-1].q[-1] - done[mark][0][-1].q[-1])[3:]
        assert np.abs((turned + 180.0) % 360.0 - 180.0).max() < TURNED, f"line {line}"
        worst[kind] = max(worst[kind], float(np.linalg.norm(points[-1] - done[mark][1][-1])))
        if kind == "cut" and not fresh:
            worst["way"] = max(worst["way"], apart(points, done[mark][1][1:]), apart(done[mark][1], points[1:]))
        fresh, count = kind == "hole", count + 1
    return worst, count


def by_mark(model: errors.Machine, text: str, actual: bool) -> dict[tuple[int, int], tuple[list[Way], Floats]]:
    """The motions of a program and the way of the tip (n, 3), by the mark they belong to, in order of execution."""
    base = np.array([START[letter] for letter in "XYZ"])
    control = fanuc.Control(
        model, base=base, turned={"A": 0.0, "C": 0.0}, offsets=OFFSETS, tools=LENGTHS, extended=EXTENDED
    )
    ways = control.run(text)
    pairs = zip(ways, tips(model, ways, actual), strict=True)
    groups = [list(group) for _, group in groupby(pairs, key=lambda pair: pair[0].mark)]
    return {
        (place, group[0][0].mark[0]): ([way for way, _ in group], np.concatenate([tip for _, tip in group]))
        for place, group in enumerate(groups)
    }


def study(root: Path, strategy: str, flat: bool, seeds: range) -> tuple[dict[str, float], int, list[str]]:
    """The worst of many programs, how many motions, and the programs with which something is wrong."""
    most, motions, wrong = {"rapid": 0.0, "cut": 0.0, "hole": 0.0, "way": 0.0}, 0, []
    for seed in seeds:
        worst, count = judged(Author(seed, flat).program(), root, strategy, flat)
        ends = max(worst["rapid"], worst["hole"], worst["cut"] - CIRCLE)
        if ends > AT_ENDS or worst["way"] > ON_THE_WAY:
            wrong.append(f"program {seed}: {worst}")
        most, motions = {kind: max(value, worst[kind]) for kind, value in most.items()}, motions + count
    return most, motions, wrong


@pytest.mark.parametrize(
    ("strategy", "flat"), [("rotary-then-linear", False), ("full", False), ("rotary-then-linear", True)]
)
def test_corrected_programs_do_what_was_meant(
    strategy: str, flat: bool, root: Path, figures: Callable[[str], None]
) -> None:
    count = PROGRAMS // 2 if flat else PROGRAMS
    most, motions, wrong = study(root, strategy, flat, range(FIRST, FIRST + count))
    said = ", ".join(f"{kind} {value * 1e3:.3f} um" for kind, value in most.items())
    how = f"{strategy}{', --flatten' if flat else ''}"
    figures(f"fanuc, second control, {how}: {count} programs, {motions} motions, worst {said}")
    assert not wrong


def test_the_judge_tells_what_is_wrong(root: Path) -> None:
    """A program that is left as it is is off by some micrometres everywhere."""
    model = errors.load(root / MACHINE)
    text = fanuc.marked(Author(1).program())
    meant, real = (by_mark(model, text, actual) for actual in (False, True))
    assert all(np.linalg.norm(meant[mark][1][-1] - real[mark][1][-1]) > 1e-3 for mark in meant)
