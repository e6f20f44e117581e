"""Beside a contour that the control offsets, a motion without a way in the plane makes none when it is corrected."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import Moves
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.machine import Machine, load
from ncfix.text.reader import read

SETUP = Setup(assume_zero=True, no_point="calculator", tools={number: Tool(80.0, 3.0) for number in (0, 1)})
ALIKE = "X40. Y5.\nX40. Z-10.\nX40. Y5. Z-90.\nG91 X0. Z20.\nG90 Z-30.\nX40. Y5.\nY40.\nG40 X60.\n"
"""In the second to the sixth of these motions nothing goes in the plane."""
KLARTEXT = "L X+40 Y+5\nL X+40 Z-10\nL X+40 Y+5 Z-90\nL IX+0 IZ+20\nL Z-30\nL X+40 Y+5\nL Y+40\nL X+60 R0\n"
TEXTS = {
    "siemens": "G710 G17 G90 G94\nT1 D1 M6\nG54\nG0 X0 Y0 Z50 A0 C0\nG1 G41 X10 Y5 F500\n" + ALIKE + "M30\n",
    "siemens, turned": "G710 G17 G90 G94\nT1 D1 M6\nG54\nROT RPL=30\nG0 X0 Y0 Z50 A0 C0\nG1 G41 X10 Y5 F500\n"
    + ALIKE.replace("G40 X60.", "G40 X60. Y40.")
    + "M30\n",
    "heidenhain": "BEGIN PGM 1 MM\nTOOL CALL 1 Z S1000\nL X+0 Y+0 Z+50 A+0 C+0 R0 FMAX\nL X+10 Y+5 RL F500\n"
    + KLARTEXT
    + "END PGM 1 MM\n",
} | dict.fromkeys(
    ("fanuc", "haas", "iso", "linuxcnc"),
    "G21 G17 G90 G94\nT1 M6\nG43 H1\nG0 X0. Y0. Z50. A0. C0.\nG1 G41 D1 X10. Y5. F500.\n" + ALIKE + "M30\n",
)


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/wCAYFXZSt.toml"))


def both(text: str, dialect: str, machine: Machine) -> tuple[Moves, Moves]:
    """The motions of a program and of what it is corrected to, which has as many."""
    program = read(text.encode(), "part", dialect)
    fixed = fix_program(program, machine, SETUP, FixOptions(figures=False))
    assert not fixed.report.refused
    before, after = (follow(each, machine, SETUP).trace.moves for each in (program, read(fixed.text, "part", dialect)))
    assert len(before) == len(after)
    return before, after


@pytest.mark.parametrize("name", TEXTS)
def test_a_motion_without_a_way_in_the_plane_makes_none(name: str, machine: Machine) -> None:
    before, after = both(TEXTS[name], name.split(",")[0], machine)
    plane = [before.axes.index(letter) for letter in "XY"]
    rows = slice(-7, -2)
    assert np.all(np.abs(before.end - before.start)[rows, plane] < 1e-9)
    assert np.all(np.abs(after.end - after.start)[rows, plane] < 1e-9)
    assert np.abs(after.end - before.end)[rows, before.axes.index("Z")].min() > 0
    assert np.abs(after.end - before.end)[-2, plane[1]] > 0


@pytest.mark.parametrize("name", ["iso", "fanuc", "siemens", "heidenhain"])
def test_both_lanes_agree(name: str, machine: Machine) -> None:
    """Many blocks at once, and one by one."""
    line, other = ("L X+{} Y+5 Z+{}\n", "M8\n") if name == "heidenhain" else ("X{}. Y5. Z{}.\n", "M8\n")
    blocks = [line.format(10 + n // 3, n % 20) for n in range(60)]
    head, tail = TEXTS[name].split(ALIKE if name != "heidenhain" else KLARTEXT)
    many, single = (both(head + between.join(blocks) + tail, name, machine)[0] for between in ("", other))
    assert np.array_equal(many.resting, single.resting)
    assert 20 < many.resting.any(axis=1).sum() < 60


@pytest.mark.parametrize(
    ("dialect", "text", "radius"),
    [
        ("fanuc", "G43 H1 Z9. D7\nG41 G1 X10. Y10. F100.\nX20.\nG40 X30.\nM30\n", 6.0),
        ("fanuc", "D7\nG41 D1 G1 X10. Y10. F100.\nX20.\nG40 X30.\nM30\n", 5.0),
        ("fanuc", "G43 H1 Z9.\nG41 G1 X10. Y10. F100.\nX20.\nG40 X30.\nM30\n", None),
        ("fanuc", "D#500\nG41 G1 X10. Y10. F100.\nX20.\nG40 X30.\nM30\n", None),
        ("siemens", "T1 D1\nM6\nOFFN=0.5\nG41 G1 X10 Y10 F100\nX20\nG40 X30\nM30\n", 5.5),
        ("siemens", "T1 D1\nM6\nOFFN=$AA_IW[X]\nG41 G1 X10 Y10 F100\nX20\nG40 X30\nM30\n", None),
        ("linuxcnc", "T1 M6\nG41 G1 X10 Y10 F100\nX20\nG40 X30\nM2\n", 5.0),
        ("linuxcnc", "T1 M6\nG42.1 D8 G1 X10 Y10 F100\nX20\nG40 X30\nM2\n", -4.0),
        ("siemens", "T1 D1\nM6\nMIRROR X0\nG41 G1 X10 Y10 F100\nX20\nG40 X30\nM30\n", -5.0),
        ("siemens", "T1 D1\nM6\nMIRROR X0 Y0\nG41 G1 X10 Y10 F100\nX20\nG40 X30\nM30\n", 5.0),
        ("fanuc", "G51.1 X0.\nG42 D1 G1 X10. Y10. F100.\nX20.\nG40 X30.\nM30\n", 5.0),
    ],
)
def test_the_radius_of_contours(dialect: str, text: str, radius: float | None) -> None:
    """What contours are offset by is what D, the tool or an allowance says, whichever block says it; mirrored, too."""
    setup = Setup(assume_zero=True, no_point="calculator", tools={1: Tool(100.0, 5.0), 7: Tool(0.0, 6.0)})
    program = read(
        ("G21 G90 G17 G0 X0. Y0. Z9.\n" if dialect != "siemens" else "G0 X0 Y0 Z9\n").encode() + text.encode(),
        "part",
        dialect,
    )
    moves = trace(program, setup, tuple("XYZ"), frozenset()).moves
    offsets = moves.beside[moves.beside != 0]
    assert len(offsets) == 2
    assert np.isnan(offsets).all() if radius is None else np.allclose(offsets, radius)
