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

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow
from ncfix.control.moves import Moves, Rule
from ncfix.control.setup import Setup, Tool
from ncfix.machine import Machine, load
from ncfix.text.reader import read

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
    assert np.array(moves.rule)[moves.cutting].tolist() == [Rule.CORRECT] * int(moves.cutting.sum())
    ends = [in_plane(moves, program.line, line) for line in cuts]
    np.testing.assert_allclose(ends, [[10, 5, 0], [20, 5, 0]], atol=1e-9)
    assert not lacking(moves).any(), "both cuts may be corrected along X, Y and Z"
    report = fix_program(program, machine, SETUP, FixOptions()).report
    assert not report.refused
    assert float(report.error_after_um["max"] or 0) < 0.2


def lacking(moves: Moves) -> NDArray[np.bool_]:
    """Of the motions that cut: which of X, Y and Z must get no word."""
    return moves.wordless[moves.cutting][:, [moves.axes.index(letter) for letter in "XYZ"]]


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
    assert rules[plunge] == Rule.REFUSE  # X and Y have not been said since, and it cuts


def test_the_end_of_a_tilt_that_has_not_begun_asks_for_nothing(machine: Machine) -> None:
    setup = Setup(work_offsets={"PRESET1": dict.fromkeys("XYZAC", 0.0)}, tools={1: Tool(60.0, 3.0)})
    moves = follow(read(KLARTEXT.encode(), "a.h", "heidenhain"), machine, setup).trace.moves
    assert moves.rule.tolist() == [Rule.PASS] * 2 + [Rule.CORRECT] * 4


SQUARE = FANUC.format(approach="G43 H1 Z40.\nG0 X10. Y5.")


def rule_of(text: str, line: str, machine: Machine) -> int:
    """The rule of the one block that reads so."""
    program = read(text.encode(), "o1.nc", "fanuc")
    moves = follow(program, machine, SETUP).trace.moves
    number = text.split("\n").index(line) + 1
    (rule,) = [rule for block, rule in zip(moves.block, moves.rule, strict=True) if program.line(int(block)) == number]
    return int(rule)


@pytest.mark.parametrize("angle", ["30.", "90."])
@pytest.mark.parametrize("leads_off", ["G91 G28 Z0.\nG90", "G31 Z-5. F100."])
def test_what_leads_the_tool_off_in_a_plane_leaves_its_height_unknown(
    leads_off: str, angle: str, machine: Machine
) -> None:
    text = SQUARE.replace("J30.", f"J{angle}").replace("\nG69\nG49", f"\n{leads_off}\nG0 X12.\nG1 X30.\nG69\nG49")
    assert rule_of(text, "G0 X12.", machine) == Rule.PASS
    assert rule_of(text, "G1 X30.", machine) == Rule.REFUSE


@pytest.mark.parametrize("between", ["G4 P1.", "G0 C0."])
def test_what_moves_no_axis_of_the_plane_leaves_known_what_was(between: str, machine: Machine) -> None:
    """By 90 degrees the plane's Z is the machine's Y: a word of the plane's Y must not pass for it."""
    text = FANUC.format(approach=f"G0 X10. Y5.\n{between}\nG43 H1\nG0 Y6.\nG1 X12. F200.\nG0 Z40.")
    text = text.replace("J30.", "J90.")
    assert rule_of(text, "G0 Y6.", machine) == Rule.PASS
    assert rule_of(text, "G1 X12. F200.", machine) == Rule.REFUSE
    assert rule_of(text, "G0 Z40.", machine) == Rule.CORRECT


def test_a_hole_above_which_the_height_is_not_known_leaves_it_so_in_a_plane(machine: Machine) -> None:
    text = FANUC.format(approach="G43 H1\nG98 G81 X10. Y5. Z-5. R2. F100.\nG80\nG0 X5. Y6.\nG1 X12. F200.")
    assert rule_of(text.replace("J30.", "J90."), "G1 X12. F200.", machine) == Rule.REFUSE


def test_an_axis_of_which_two_turned_ones_are_made_leaves_both_unknown(machine: Machine) -> None:
    text = (
        "O1\nG21 G90 G17 G54 G69\nT1 M6\nG0 X0. Y0. Z10. A0. C0.\nG68 X0. Y0. R30.\nG0 X10. Y10.\nG91 G28 X0.\nG90\n"
        "G0 X12.\nG1 X20. F100.\nG0 X5. Y5.\nG1 X7.\nG69\nM30\n"
    )
    assert rule_of(text, "G1 X20. F100.", machine) == Rule.REFUSE
    assert rule_of(text, "G1 X7.", machine) == Rule.CORRECT


OBLIQUE = {
    "fanuc": FANUC.format(approach="G0 X10.\nG4 P1.\nY5.\nG43 H1 Z40.").replace("I0. J30.", "I20. J30."),
    "siemens": SIEMENS.replace(",57,0,0,0,30,0,0,", ",27,0,0,0,0,25,30,").replace("G0 X10 Y5 M8", "G0 X10\nG4 F1\nY5"),
}


@pytest.mark.parametrize("dialect", OBLIQUE)
def test_a_plane_that_is_turned_about_two_axes_may_be_approached_axis_by_axis(dialect: str, machine: Machine) -> None:
    """Then every axis of the machine is made of all of the plane, and none is known before the last of them."""
    program = read(OBLIQUE[dialect].encode(), "o1.nc", dialect)
    moves = follow(program, machine, SETUP).trace.moves
    assert np.array(moves.rule)[moves.cutting].tolist() == [Rule.CORRECT] * int(moves.cutting.sum())
    assert not lacking(moves).any()
