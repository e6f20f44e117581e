"""What is refused, and what has to be left for it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import MotionKind
from ncfix.control.setup import Setup, Tool
from ncfix.machine import Machine, load
from ncfix.text.reader import read
from ncfix.writer.pieces import BEYOND_TRAVEL, PINNED

ZERO = dict.fromkeys("XYZ", 0.0)
SETUP = Setup(work_offsets={"G54": ZERO}, initial=ZERO, assume_zero=True)


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/three_axis.toml"))


def loop_to(end: float, step: float, machine: Machine) -> tuple[dict[int, str], np.ndarray]:
    """A loop of increments that ends there along X: what is refused, and where the corrected program leads."""
    start = end - 3 * step
    text = f"G21 G90 G94 F500 G54\nG0 X0 Y90 Z-40\nG1 X{start}\no1 repeat [3]\nG91 G1 X{step}\no1 endrepeat\nM2\n"
    program = read(text.encode(), "part.ngc", "linuxcnc")
    fixed = fix_program(program, machine, SETUP, FixOptions(tolerance_um=50.0, figures=False))
    moves = follow(read(fixed.text, "part.ngc", "linuxcnc"), machine, SETUP).trace.moves
    return {each.line: each.reason for each in fixed.report.refused}, moves.end[moves.kind != MotionKind.DWELL]


def test_a_refused_increment_begins_where_the_corrected_program_has_led(machine: Machine) -> None:
    refused, ends = loop_to(250.0, 100.0, machine)
    assert refused == {5: "the block is executed from several states that need different corrections"}
    assert abs(ends[1, 0] + 50.0) > 0.0005
    np.testing.assert_allclose(np.diff(ends[1:, 0]), 100.0, atol=1e-9)


@pytest.mark.parametrize("side", [-1, 1])
def test_but_never_beyond_the_travel(machine: Machine, side: int) -> None:
    """The correction where the loop begins leads outwards where it ends: so it begins where it began."""
    refused, ends = loop_to(side * 400.0, side * 230.0, machine)
    assert refused[3] == f"{BEYOND_TRAVEL} (line 5)"
    assert 5 in refused
    assert ends[:, 0].tolist()[1:] == [side * x for x in (-290.0, -60.0, 170.0, 400.0)]


def test_what_leads_to_an_arc_that_cannot_be_written_is_left_as_it_was(root: Path) -> None:
    """The circle would have to be split, and has no time of its own; begun a micrometre aside it would be none."""
    text = b"G90 G94 F500.\nG0 X10. Y10. Z5.\nG1 X20. Y10.\nG93\nG2 X20. Y10. I105. J0.\nG94\nM30\n"
    setup = Setup(assume_zero=True, no_point="calculator")
    machine = load(root / "examples" / "machines" / "three_axis.toml")
    fixed = fix_program(read(text, "circle", "fanuc"), machine, setup, FixOptions(tolerance_um=1.0))
    assert [(each.line, PINNED in each.reason) for each in fixed.report.refused] == [(3, True), (5, False)]
    assert b"G1 X20. Y10.\nG93\nG2 X20. Y10. I105. J0.\n" in fixed.text


NO_HOLE_YET = "G21 G17 G90 G94 G98 G54\nT1 M6\nG0 X0. Y0.\nG43 H1 Z25.\nG81 Z-3. R1. F100. {}0\n"
CALLED = {
    "haas": NO_HOLE_YET.format("L") + "M97 P1000 L2\nG80\nM30\nN1000 X10. Y10.\nG91 X5. L3\nG90\nM99\n",
    "fanuc": NO_HOLE_YET.format("K") + "M98 P1000 L2\nG80\nM30\nO1000\nX10. Y10.\nG91 X5. K3\nG90\nM99\n",
}


@pytest.mark.parametrize("dialect", CALLED)
def test_attempts_that_refuse_and_correct_by_turns_come_to_an_end(dialect: str, machine: Machine) -> None:
    """The level and the depth that the second call finds are those that the first one left, corrected or not."""
    program = read(CALLED[dialect].encode(), "part.nc", dialect)
    setup = replace(SETUP, no_point="calculator", tools={1: Tool(100.0)})
    fixed = fix_program(program, machine, setup, FixOptions(figures=False))
    assert fixed.changed
    assert [each.line for each in fixed.report.refused][-1] > 8
