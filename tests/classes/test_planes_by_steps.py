"""Tilted planes as CAM posts approach them: X and Y of the plane first, the tool length and Z after them.

The machine stands where its reference point is, which the setup does not give. Worked by hand on wCAYFXZSt, all offsets
zero: a plane turned by 30 degrees about X has (x, y, z) at X = x, Y = y cos 30 - z sin 30, Z = y sin 30 + z cos 30.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ncfix.compensate.fix import FixOptions, fix_program
from ncfix.compensate.following import follow
from ncfix.machine import Machine, load
from ncfix.program.moves import Moves, Rule
from ncfix.program.reader import read
from ncfix.program.setup import Setup, Tool

SETUP = Setup(
    work_offsets={"G54": dict.fromkeys("XYZAC", 0.0)},
    tools={1: Tool(60.0, 3.0)},
    initial=dict.fromkeys("XYAC", 0.0),
)
FANUC = """O1
G21 G90 G17 G54 G69
T1 M6
G91 G28 Z0
G90 G0 A0. C0.
G68.2 X0. Y0. Z0. I0. J30. K0.
G53.1
{approach}
G1 Z0. F200.
X20.
G69
G49
G91 G28 Z0.
M30
"""
SIEMENS = """T1 D1 M6
G17 G90 G54 G71
CYCLE800()
SUPA G0 Z290 D0
D1
CYCLE800(1,"TABLE",200000,57,0,0,0,30,0,0,0,0,0,-1,100,1)
G0 X10 Y5 M8
Z40
G1 Z0 F200
X20
G0 Z60
CYCLE800()
SUPA G0 Z290 D0
M30
"""
KLARTEXT = """0 BEGIN PGM A MM
1 PLANE RESET STAY
2 L Z+290 R0 FMAX M91
3 TOOL CALL 1 Z S1000
4 CYCL DEF 247 DATUM SETTING Q339=+1
5 L A+0 C+0 R0 FMAX
6 L X+10 Y+5 R0 FMAX M3
7 L Z+40 FMAX
8 L Z+0 F200
9 L X+20
10 M30
11 END PGM A MM
"""
APPROACHES = {
    "the length after the place": "G0 X10. Y5.\nG43 H1 Z40.",
    "the length before the place": "G43 H1 Z40.\nG0 X10. Y5.",
    "the place axis by axis": "G0 X10.\nY5.\nG43 H1\nZ40.",
}
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def machine() -> Machine:
    return load(str(ROOT / "examples/machines/wCAYFXZSt.toml"))


def check(text: str, name: str, dialect: str, machine: Machine, cuts: tuple[int, int]) -> None:
    program = read(text.encode(), name, dialect)
    moves = follow(program, machine, SETUP).trace.moves
    assert np.array(moves.rule)[moves.cuts].tolist() == [Rule.CORRECT] * int(moves.cuts.sum())
    ends = [in_plane(moves, program.line, line) for line in cuts]
    np.testing.assert_allclose(ends, [[10, 5, 0], [20, 5, 0]], atol=1e-9)
    assert not lacking(moves).any(), "both cuts may be corrected along X, Y and Z"
    report = fix_program(program, machine, SETUP, FixOptions()).report
    assert not report.refused
    assert float(report.error_after_um["max"] or 0) < 0.2


def lacking(moves: Moves) -> NDArray[np.bool_]:
    """Of the motions that cut: which of X, Y and Z must get no word."""
    return moves.wordless[moves.cuts][:, [moves.axes.index(letter) for letter in "XYZ"]]


def in_plane(moves: Moves, line: object, wanted: int) -> list[float]:
    """Where the motion of a line ends, in the plane."""
    (row,) = [i for i, block in enumerate(moves.block.tolist()) if line(block) == wanted]  # type: ignore[operator]
    x, y, z = (moves.end[row, moves.axes.index(letter)] for letter in "XYZ")
    cosine, sine = np.cos(np.pi / 6), np.sin(np.pi / 6)
    return [x, y * cosine + z * sine, -y * sine + z * cosine]


@pytest.mark.parametrize("approach", APPROACHES)
def test_a_plane_of_g68_2(approach: str, machine: Machine) -> None:
    text = FANUC.format(approach=APPROACHES[approach])
    first = text.split("\n").index("G1 Z0. F200.") + 1
    check(text, "o1.nc", "fanuc", machine, (first, first + 1))


def test_a_plane_of_cycle800(machine: Machine) -> None:
    check(SIEMENS, "a.mpf", "siemens", machine, (9, 10))


def test_another_length_moves_x_and_y_of_a_plane_to_which_the_tool_is_not_square(machine: Machine) -> None:
    text = FANUC.format(approach="G0 X10. Y5.\nG43 H1 Z40.").replace("G53.1\n", "")
    known = replace(SETUP, references={"G28": {"Z": 290.0}})
    program = read(text.encode(), "o1.nc", "fanuc")
    moves = follow(program, machine, known).trace.moves
    plunge = text.split("\n").index("G1 Z0. F200.") + 1
    rules = {program.line(block): rule for block, rule in zip(moves.block.tolist(), moves.rule.tolist(), strict=True)}
    assert rules[plunge] == Rule.PASS


def test_the_end_of_a_tilt_that_has_not_begun_asks_for_nothing(machine: Machine) -> None:
    setup = Setup(work_offsets={"PRESET1": dict.fromkeys("XYZAC", 0.0)}, tools={1: Tool(60.0, 3.0)})
    moves = follow(read(KLARTEXT.encode(), "a.h", "heidenhain"), machine, setup).trace.moves
    assert moves.rule.tolist() == [Rule.PASS] * 2 + [Rule.CORRECT] * 4
