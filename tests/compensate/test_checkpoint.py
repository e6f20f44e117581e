"""Parts of other processes are passed over where little is to be known of them, and nothing is different for it."""

from __future__ import annotations

import io
from dataclasses import dataclass, field, fields
from pathlib import Path

import numpy as np
import pytest

from compensate.test_plain import AMONG, winding
from compensate.test_stream import OPTIONS, SETUP, program, streamed
from conftest import FULL, some
from ncfix.compensate.driver import PartCorrector
from ncfix.compensate.following import Task
from ncfix.compensate.parts import MachineParts, Part
from ncfix.compensate.workers import PartCheckpoint, ReadAhead, WorkShare
from ncfix.control.moves import Moves
from ncfix.control.trace import TABLES
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine, load
from ncfix.text.dialect import get

SIZE = 1200


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(root / "benchmarks" / "five_axis.toml")


@dataclass
class Telling(WorkShare):
    """Has all parts, and keeps what it would tell of them."""

    received: dict[int, PartCheckpoint | None] = field(default_factory=dict)

    def has(self, number: int) -> bool:
        return True

    def announce(self, number: int, checkpoint: PartCheckpoint | None) -> None:
        self.received[number] = checkpoint

    def checkpoint(self, number: int) -> PartCheckpoint | None:
        return None


@dataclass
class Hearing(WorkShare):
    """Has no part, and has received of all."""

    received: dict[int, PartCheckpoint | None] = field(default_factory=dict)

    def has(self, number: int) -> bool:
        return False

    def checkpoint(self, number: int) -> PartCheckpoint | None:
        return self.received[number]


def gone_through(source: bytes, machine: Machine, dialect: str, share: WorkShare) -> tuple[MachineParts, list[Part]]:
    task = Task(machine, SETUP, OPTIONS, None, "p.nc", get(dialect), SIZE)
    parts = PartCorrector(task, ReadAhead(io.BytesIO(source).read)).parts
    parts.share = share
    return parts, [continued.part for continued in parts]


def assert_same_motions(found: Moves, expected: Moves) -> None:
    assert len(found) == len(expected)
    for each in fields(Moves):
        one, other = getattr(found, each.name), getattr(expected, each.name)
        if each.name not in TABLES | {"frame", "reason"}:
            assert (one is None) == (other is None), each.name
            assert one is None or np.array_equal(one, other, equal_nan=one.dtype.kind == "f"), each.name
    assert [found.reasons[k] for k in found.reason] == [expected.reasons[k] for k in expected.reason]
    for mine, theirs in zip(found.frame, expected.frame, strict=True):
        assert np.array_equal(found.frames[mine].offset, expected.frames[theirs].offset)


@pytest.mark.parametrize("dialect", ["linuxcnc", "iso"])
@pytest.mark.parametrize("seed", range(some(12)))
def test_a_control_goes_on_as_if_it_had_followed_what_was_passed_over(
    seed: int, dialect: str, machine: Machine
) -> None:
    source = (
        program(seed, 500, 0.02 * (seed % 3)) if seed % 2 else winding(seed, 500, 0.02, (*AMONG, "#100=7.5\nF650."))
    )
    telling = Telling(2)
    reference, expected = gone_through(source, machine, dialect, telling)
    units, found = gone_through(source, machine, dialect, Hearing(2, received=telling.received))
    assert sum(each is not None for each in telling.received.values()) >= 1
    assert len(found) == len(expected)
    for mine, theirs in zip(found, expected, strict=True):
        place = theirs.program
        if mine.checkpoint is None:
            assert mine.program.source == place.source
            assert_same_motions(mine.moves, theirs.moves)
        assert mine.program.line(len(mine.program) - 1) == place.line(len(place) - 1)
        assert mine.moves.end[-1].tolist() == theirs.moves.end[-1].tolist()
    for name in ("blocks", "count", "rest", "notes", "assumed"):
        assert getattr(units, name) == getattr(reference, name), name
    assert units.follower.messages == reference.follower.messages


@pytest.mark.parametrize("dialect", ["linuxcnc", "iso"])
def test_all_that_a_control_keeps_can_be_compared(dialect: str, machine: Machine) -> None:
    follower = Task(machine, SETUP, OPTIONS, None, "p.nc", get(dialect), SIZE).follower()
    kept = follower.control.lasting()
    assert kept is not None
    assert " object at 0x" not in kept
    assert "lambda" not in kept


@pytest.mark.parametrize("jobs", [2, 3])
def test_processes_pass_over_parts_of_each_other(jobs: int, machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    """Counted in the first process."""
    passed, resume = [], MachineParts._passed

    def counted(self: MachineParts, checkpoint: PartCheckpoint, text: bytes) -> object:
        passed.append(checkpoint.blocks)
        return resume(self, checkpoint, text)

    monkeypatch.setattr(MachineParts, "_passed", counted)
    for seed in range(3 if FULL else 1):
        source = winding(seed, 400, 0.01, (*AMONG, "#100=1.5"))
        expected = streamed(source, machine, 2000)
        passed.clear()
        assert streamed(source, machine, 2000, jobs=jobs) == expected
        assert len(passed) >= 2


def test_an_error_in_a_part_that_others_would_pass_over_is_told(machine: Machine) -> None:
    source = winding(0, 300).replace(b"N2500 G1", b"N2500 G1 X1 X2")
    for jobs in (1, 2, 3):
        with pytest.raises(NcfixError, match="X"):
            streamed(source, machine, 2000, jobs=jobs)
