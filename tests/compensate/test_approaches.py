"""The level R of canned cycles: corrected with each hole, and never lower than where LinuxCNC would then stay."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from compensate.side import compared
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import MotionKind, Moves
from ncfix.control.setup import Setup, Tool
from ncfix.machine import Machine, load
from ncfix.text.reader import read

ZERO = dict.fromkeys("XYZACB", 0.0)
SETUP = Setup(
    work_offsets={"G54": ZERO, "G55": ZERO | {"Z": -7.0}},
    tools={0: Tool(60.0, 3.0), 1: Tool(60.0, 3.0)},
    initial=ZERO | {"Z": 200.0},
    no_point="calculator",
)
OPTIONS = FixOptions(figures=False)
HEAD = "G21 G90 G17 G40 G49 G80 G94 G54\nG0 X0. Y0. Z50.\n"
HOLES = "X10. Y5. Z-4. R2. F100.\nX140.\nY145.\nX80. Y60. Z-12. R5.\nX-150.\nG80\n"
HALF = 0.0005 + 1e-9


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/three_axis.toml"))


def fixed(text: str, machine: Machine, dialect: str) -> tuple[str, Moves, Moves]:
    """The corrected program, and the motions of both."""
    program = read(text.encode(), "part", dialect)
    result = fix_program(program, machine, SETUP, OPTIONS)
    assert not result.report.refused
    again = read(result.text, "part", dialect)
    before, after = (follow(each, machine, SETUP).trace.moves for each in (program, again))
    return result.text.decode(), before, after


def heights_off(before: Moves, after: Moves, machine: Machine) -> np.ndarray:
    """How far the tip is from where it should be at R of each hole, along Z, mm."""
    meant, done = (moves.approach[moves.kind == MotionKind.CYCLE] for moves in (before, after))
    return machine.actual_tip(done)[:, 2] - machine.tip(meant, 0.0)[:, 2]


@pytest.mark.parametrize("dialect", ["linuxcnc", "iso", "fanuc"])
@pytest.mark.parametrize("retract", ["G98", "G99"])
def test_every_hole_has_its_own_level(machine: Machine, dialect: str, retract: str) -> None:
    text, before, after = fixed(f"{HEAD}{retract} G81 {HOLES}G0 X0. Y0.\nG1 Z0. F300.\nX90.\nM2\n", machine, dialect)
    assert np.abs(heights_off(before, after, machine)).max() <= HALF
    assert np.ptp([float(value) for value in re.findall(r"R([\d.]+)", text)][:3]) > 0
    _, there, back = compared(machine, before, after)
    assert max(there.max, back.max) <= 0.001


def test_a_level_in_inches_and_in_another_offset(machine: Machine) -> None:
    text = f"{HEAD}G55\nG0 Z2.\nG99 G81 {HOLES}G20\nG99 G81 X1. Y1. Z-1. R.1\nX5.\nG80\nG0 Z2.\nM2\n"
    _, before, after = fixed(text, machine, "fanuc")
    off = np.abs(heights_off(before, after, machine))
    assert off[:-2].max() <= HALF
    assert off[-2:].max() <= 0.5 * 1e-4 * 25.4 + 1e-9, "half an inch digit of the control"


def test_least_increments_count(machine: Machine) -> None:
    setup = Setup(SETUP.work_offsets, SETUP.tools, SETUP.initial, no_point="IS-B")
    program = read(
        b"G21 G90 G17 G94 G54\nG0 X0 Y0 Z50000\nG99 G81 X150000 Y145000 Z-4000 R2000 F100\nM2\n", "p", "fanuc"
    )
    text = fix_program(program, machine, setup, OPTIONS).text.decode()
    assert "R1999" in text


def test_linuxcnc_still_goes_up_before_it_goes_over(machine: Machine) -> None:
    """Behind G99 it does if it stands no higher than R: an R that sinks by a hair would lead through the clamp."""
    holes = "".join(f"G99 G81 X{x} Y0 Z-3 R2\nG98 X{-x} Y{y}\n" for x, y in ((150, 100), (-150, 20), (80, -90)))
    _, before, after = fixed(f"{HEAD}F100 {holes}G80\nM2\n", machine, "linuxcnc")
    stood, level = after.start[:, 2], after.approach[:, 2]
    there = before.start[:, 2] == before.approach[:, 2]
    assert there.sum() == 3
    assert (stood[there] <= level[there] + 1e-9).all()


def test_the_level_in_a_tilted_plane(root: Path) -> None:
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    holes = "G99 G81 X5. Y5. Z-4. R2. F100.\nX40.\nG80\nG0 Z60.\nG69\n"
    text = "G21 G90 G17 G94 G54\nG0 Z150. X0. Y0. A0. C0.\nG43 H1\nG68.2 X0. Y0. Z0. I0. J30. K0.\nG53.1\nG0 Z60.\n"
    _, before, after = fixed(f"{text}G0 X5. Y5.\n{holes}M2\n", machine, "fanuc")
    shift = (after.approach - before.approach)[before.kind == MotionKind.CYCLE]
    assert (np.abs(shift) > 0.0005).any()
    assert (np.abs(shift) < 0.1).all()
