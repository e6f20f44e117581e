"""Rewritten programs as "table": the contract, the pose by pose correction, and what is not read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.control.setup import Setup
from ncfix.diagnostics import ConfigError, UsageError
from ncfix.machine import load
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import random_poses, ranges_of
from ncfix.testing import check_control, single_error
from ncfix.text.reader import read

CONTROL = get_control("gcode")


def test_the_contract() -> None:
    check_control(CONTROL)


def test_poses_are_corrected_as_the_words_of_the_program_are(root: Path) -> None:
    """A program of rapids to 40 poses, fixed, read and traced again: the same positions, digit for digit."""
    machine = load(root / "examples" / "machines" / "wCBXFZYSt.toml")
    options = CONTROL.settings({"strategy": "position"})
    tables = CONTROL.read(CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.001, options)).files)
    unit = np.array([axis.unit for axis in machine.axes])
    q = np.round(random_poses(0.9 * ranges_of(machine), 40) / unit, 3)
    lines = ["G0 " + " ".join(f"{n}{v:.3f}" for n, v in zip(machine.axis_names, row, strict=True)) for row in q]
    source = "\n".join(["G21 G90 G49", *lines, "M2", ""]).encode()
    setup = Setup(assume_zero=True)
    program = read(source, "poses.ngc", "linuxcnc")
    fixed = fix_program(program, machine, setup, FixOptions(strategy="position", allow_refused=True))
    assert not fixed.report.refused
    moves = follow(read(fixed.text, "poses.ngc", "linuxcnc"), machine, setup).trace.moves
    ways = np.sign(np.diff(q, axis=0))  # from where the first one comes is not known
    expected = q[1:] * unit + tables.at(machine.axis_names, q[1:] * unit, ways)
    assert moves.end[1:] == pytest.approx(expected, abs=machine.least_increment[0] * 0.51)


def test_what_is_not_a_strategy_is_refused() -> None:
    request = Request(single_error("EXX"), np.zeros((3, 2)), 0.0, 0.001, {"strategy": "magic"})
    with pytest.raises(UsageError) as caught:
        CONTROL.write(request)
    assert caught.value.code == "NCF411"


@pytest.mark.parametrize(("name", "content"), [("fix.toml", b"strategy = 1"), ("machine.toml", b"ncfix = 2")])
def test_broken_files(name: str, content: bytes) -> None:
    machine = single_error("EXX")
    made = dict(CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.001)).files)
    assert not CONTROL.lint(made)
    assert CONTROL.lint({**made, name: content})
    with pytest.raises(ConfigError):
        CONTROL.read({**made, name: content})
