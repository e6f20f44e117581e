"""Frames that a program sets where the machine stands, one after another: each moves with the one before it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.control.setup import Setup, Tool
from ncfix.machine import load
from ncfix.text.reader import read

SETUP = Setup(assume_zero=True, tools={0: Tool(80.0, 3.0), 1: Tool(80.0, 3.0)})
HEAD = "G21 G90 G17 G94\nT1 M6\nG54 G43 H1\nG0 X10. Y20. Z60. A5. C10.\n"
TAIL = "G0 A5. C10. X5. Y5. Z40.\nG53.1\nG0 X1. Y2. Z30.\nM30\n"


@pytest.mark.parametrize("count", [1, 6])
def test_the_last_motion_goes_where_it_should_in_the_machine(count: int, root: Path) -> None:
    """The tools of a machine with errors: what is corrected is of the size of the errors, however many frames."""
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    frames = "".join(f"G0 X0. Y0. Z30.\nG92 X{n + 1}. Y{-n}. Z2{n}.\n" for n in range(count))
    program = read((HEAD + frames + TAIL).encode(), "part.nc", "fanuc")
    fixed = fix_program(program, machine, SETUP, FixOptions(figures=False))
    assert not fixed.report.refused
    before, after = (follow(each, machine, SETUP).trace.moves for each in (program, read(fixed.text, "part", "fanuc")))
    off = np.abs(after.end - before.end)[-1]
    assert 1e-4 < off.max() < 0.05
