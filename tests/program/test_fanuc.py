"""What Fanuc's codes and numbers mean, where they differ from LinuxCNC's."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow as follow_on
from ncfix.compensate.following import kinematics_of
from ncfix.compensate.plan.intent import Intent
from ncfix.control.moves import Rule
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.diagnostics import SourceError, UsageError
from ncfix.machine import State, load, loads
from ncfix.text.dialect import detect
from ncfix.text.reader import read
from ncfix.text.tree import Opaque, Word
from program.lanes import assert_read_right
from program.tracing import KNOWN, ends, follow, last, reasons

# -- reading ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "%O1234(PART)",
        "O1234(A(NESTED)COMMENT)",
        ":77",
        "<PART.NC>",
        "/2N10G0X5",
        "N10/G0X5.",
        "G0G90X53.839Y129.142C0.0",
        "X - [ #21 + #4 ]",
        "g1 x#1 y-#2 f[#9*2]",
        "IF[[#1EQ1]AND[#2NE3]]GOTO100",
        "IF [#1 GT 2] THEN #3=4",
        "#[#1+2]=ROUND[#5*2]MOD3-[#3+1]/2",
        "G65P9010A1.B-2.I1.J2.K3.I4.",
        "G1X5.,R2.",
        "DPRNT[X#1[43]Y#2[43]]",
        "POPEN",
        "M98<NAME>",
        "X1.5;",
        "G68.2X1.Y2.Z3.I0J30.K0",
        "TOOLCHANGE 5",
    ],
)
def test_blocks_of_the_family_can_be_read(text: str) -> None:
    assert_read_right(read(f"{text}\n".encode(), dialect="fanuc"))


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("G0X", "NCF114"),
        ("G0X1.Y2", ""),
        ("X1.5.2", "NCF115"),
        ("#1=[2+3", "NCF113"),
        ("(OPEN", "NCF111"),
        ("X1.X2.", "NCF117"),
        ("0 BEGIN PGM 1 MM", "NCF103"),
        ("DEF REAL A", "NCF103"),
        ("o100 sub", "NCF103"),
        ('CGTECH_MACRO "A" "B"', "NCF103"),
        ("G15 H1", "NCF103"),
        ("CALL OO88", "NCF103"),
        ("G62 X1 Y0", "NCF103"),
        ("G62 X1. Y0.", ""),
        ("G62 G1 X1 Y1", ""),
        ("G62 X0 Y0", ""),
        ("N5 G50S1600 (LIMIT)", "NCF103"),
        ("G73 P10 Q20 U0.4 W0.1", "NCF103"),
    ],
)
def test_what_is_not_of_the_family_is_refused_by_line(text: str, code: str) -> None:
    if not code:
        read(f"{text}\n".encode(), dialect="fanuc")
        return
    with pytest.raises(SourceError) as caught:
        read(f"G0Z5.\n{text}\n".encode(), dialect="fanuc")
    assert caught.value.messages[0].code == code
    assert caught.value.messages[0].place is not None
    assert caught.value.messages[0].place.line == 2


def test_numbers_with_and_without_a_point_have_templates_of_their_own() -> None:
    program = read(b"G0X1.\nG0X1\nG0X2\n", dialect="fanuc")
    assert program.template.tolist() == [0, 1, 1]


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        (b"N10IF[#1EQ2]GOTO5\n", "fanuc"),
        (b"N5G65P9010A1.\n", "fanuc"),
        (b"G43.4H1X0.\n", "fanuc"),
        (b"G68.2X0Y0Z0I0J0K0\n", "fanuc"),
        (b"G1X5.,R2.\nY3.\n", "fanuc"),
        (b"(X5,R2)\nG1X5.\n", "iso"),
        (b"G187P1\n", "haas"),
        (b"G154 P3\nG0X1.\n", "haas"),
        (b"O100 IF [#1 GT 2]\nO100 ENDIF\n", "linuxcnc"),
        (b"(IF [1] GOTO 5)\nG0X1\n", "iso"),
        (b"N5 #1=#2/2\n", "fanuc"),
        (b"#4 = 8. / 2. (RADIUS)\n", "fanuc"),
        (b"#1=-5 #2=[#1+3]\n#3=5 (6-2)\n", "iso"),
    ],
)
def test_detection(source: bytes, expected: str) -> None:
    assert detect(source, "part.nc").name == expected


def test_a_word_e_may_stand_close_to_the_one_before() -> None:
    words = read(b"G187P3E.01\n", dialect="haas").items_of(0)
    assert [word.address for word in words if isinstance(word, Word)] == ["G", "P", "E"]


@pytest.mark.parametrize(
    ("dialect", "reason"), [("fanuc", "without axis words"), ("mitsubishi", "without axis words"), ("haas", "")]
)
def test_a_reference_point_for_no_axis_or_for_all(dialect: str, reason: str) -> None:
    found = reasons(follow("G0X1.Y1.Z1.\nG28\nG1X2.F100.\nG0X3.Y3.Z3.\nX4.", dialect=dialect))
    assert reason in found[2]
    assert found[-1] == ""


def test_a_command_that_is_not_known_is_kept_and_refuses_what_follows() -> None:
    program = read(b"G0X1.\nTOOLCHANGE 5\nG0X2.\nM30\n", dialect="fanuc")
    assert isinstance(program.items_of(1)[0], Opaque)
    found = trace(program, KNOWN, ("X", "Y", "Z"), frozenset())
    assert reasons(found) == ["", "the command TOOLCHANGE is unknown and may move axes or change coordinates"]


# -- the decimal point ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "no_point", "expected"),
    [
        ("G0X50Y50.", "IS-B", [0.05, 50, 0]),
        ("G0X50Y50.", "IS-A", [0.5, 50, 0]),
        ("G0X50Y50.", "IS-C", [0.005, 50, 0]),
        ("G0X50Y50.", "calculator", [50, 50, 0]),
        ("G20G0X50Y1.", "IS-B", [0.127, 25.4, 0]),
        ("G0X[50]Y#1", "IS-B", [50, 0, 0]),
        ("#1=50\nG0X#1", "IS-B", [50, 0, 0]),
        ("G91G0X500\nX500", "IS-B", [1, 0, 0]),
        ("F100.G2X10.Y0I5000J0", "IS-B", [10, 0, 0]),
        ("F100G81X1.Y1.Z-1000R2000K1", "IS-B", [1, 1, -1]),
        ("G52X1000\nG0X0.", "IS-B", [1, 0, 0]),
        ("G65P1A5\nM30\nO1\nG0X#1\nM99", "IS-B", [0.005, 0, 0]),
        ("G65P1D5\nM30\nO1\nG0X#7\nM99", "IS-B", [5, 0, 0]),
    ],
)
def test_numbers_without_a_point(text: str, no_point: str, expected: list[float]) -> None:
    found = follow(text, dialect="fanuc", no_point=no_point)
    assert last(found) == [pytest.approx(value, abs=1e-9) for value in expected]


@pytest.mark.parametrize("block", ["G05.1 Q1 R3", "G90 G5.1 Q1 R5", "G332 R1", "G8 P1"])
def test_levels_without_a_point_are_no_lengths(block: str) -> None:
    assert last(follow(f"{block}\nG0 X1. Y0. Z0.", dialect="fanuc", no_point="")) == [1, 0, 0]


@pytest.mark.parametrize("block", ["G81 R2 Z-5.", "G2 X1. R5 F100.", "G68 X0. Y0. R30"])
def test_lengths_and_angles_of_r_without_a_point_are_asked_for(block: str) -> None:
    with pytest.raises(UsageError, match="has no decimal point"):
        follow(f"G0 X0. Y0. Z0.\n{block}", dialect="fanuc", no_point="")


@pytest.mark.parametrize("no_point", ["IS-B", "calculator"])
def test_many_blocks_mean_what_single_ones_do(no_point: str) -> None:
    """Stretches of plain motions are taken many at once; not where their numbers count increments."""
    lines = [f"X{n * 10}Y{n}.5" for n in range(1, 60)]
    found = ends(follow("G1F100.\n" + "\n".join(lines), dialect="fanuc", no_point=no_point))
    size = 0.001 if no_point == "IS-B" else 1.0
    assert found == [[pytest.approx(n * 10 * size), pytest.approx(n + 0.5), 0] for n in range(1, 60)]


def test_polar_words_and_macro_calls_come_block_by_block() -> None:
    lines = "\n".join(f"X10.Y{n}." for n in range(0, 90, 3))
    found = ends(follow(f"G1F100.\nG16\n{lines}", dialect="fanuc"))
    assert [math.hypot(x, y) for x, y, _ in found] == pytest.approx([10.0] * 30)
    lines = "\n".join(f"X{n}." for n in range(1, 31))
    called = follow(f"G1F100.\nG66P7\n{lines}\nG67\nM30\nO7\nG91Z1.\nG90\nM99", dialect="fanuc")
    assert last(called)[2] == 30


def test_rotary_words_count_their_own_increments() -> None:
    assert last(follow("G0A90500X1000", "XYZA", dialect="fanuc", no_point="IS-B")) == pytest.approx([1, 0, 0, 90.5])


def test_it_is_asked_what_they_mean() -> None:
    with pytest.raises(UsageError) as caught:
        follow("G0X0Y0\nG0X50", dialect="fanuc")
    message = caught.value.messages[0]
    assert (message.code, message.place.line if message.place else 0) == ("NCF240", 2)
    assert "--no-point" in message.hint
    follow("G0X0Y0\nG28Z0\nG4P500\nT5M6\nS1000M3\nG1X1.F100\nG54.1P2", dialect="fanuc", assume_zero=True)


SHIFTED = """
name = "m"
topology = "w F X Y Z t"
[axis.X]
type = "linear"
direction = [1, 0, 0]
[axis.Y]
type = "linear"
direction = [0, 1, 0]
[axis.Z]
type = "linear"
direction = [0, 0, 1]
[tool]
direction = [0, 0, 1]
point = [0, 0, 0]
[[effect]]
name = "EXX"
basis = "constant"
coefficients = [0.0124]
"""


@pytest.mark.parametrize(
    ("text", "no_point", "expected"),
    [
        ("G0X50.Y5.Z5.", "IS-B", "G0X49.988Y5.Z5."),
        ("G0X50000Y5.Z5.", "IS-B", "G0X49988Y5.Z5."),
        ("G0X50Y5.Z5.", "calculator", "G0X49.988Y5.Z5."),
        ("G0X50.Y5.Z5.", "", "G0X49.988Y5.Z5."),
        ("G20G0X500000Y1.Z1.", "IS-B", "G20G0X499995Y1.Z1."),
        ("G0Y5.Z5.X+0050.", "", "G0Y5.Z5.X+0049.988"),
    ],
)
def test_the_point_of_each_word_is_kept(text: str, no_point: str, expected: str) -> None:
    program = read(f"{text}\nM30\n".encode(), "part", "fanuc")
    setup = Setup(no_point=no_point, assume_zero=True)
    fixed = fix_program(program, loads(SHIFTED), setup, FixOptions())
    assert expected in fixed.text.decode()


# -- codes ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("G90G81X1.Y1.Z-5.R2.F50.\nG91X10.K3", [[1, 1, -5], [11, 1, -5], [21, 1, -5], [31, 1, -5]]),
        ("G0Z10.\nG91G81X1.Z-5.R-8.L2F50.", [[0, 0, 10], [1, 0, -3], [2, 0, -3]]),
        ("G81X1.Z-5.R2.K0F50.\nX3.", [[3, 0, -5]]),
        ("G99G81X1.Z-5.R2.F50.\nX3.\nG80\nG0X0.", [[1, 0, -5], [3, 0, -5], [0, 0, 2]]),
        ("G0Z9.\nG98G76X1.Z-5.R2.Q.1F50.\nG80\nG0X0.", [[0, 0, 9], [1, 0, -5], [0, 0, 9]]),
        ("G0Z9.\nG99G76X1.Z-5.R2.Q.1F50.\nX3.\nG84.2X4.", [[0, 0, 9], [1, 0, -5], [3, 0, -5], [4, 0, -5]]),
        ("G10L2P1X5.\nG0X1.", [[6, 0, 0]]),
        ("G10L2P1X5.\nG91G10L2P1X1.\nG90G0X1.", [[7, 0, 0]]),
        ("G10L20P3X5.\nG54.1P3\nG0X1.", [[6, 0, 0]]),
        ("G10L20P3X5.\nG10L20P3Y2.\nG91G10L20P3Y1.\nG90G54.1P3\nG0X1.Y1.", [[6, 4, 0]]),
        ("G43H3Z0\nG49\nG0X#4111Z0", [[0, 0, 0], [3, 0, 0]]),  # H stays in force
        ("G10L10P4R80.\nG43H4\nG0Z0.", [[0, 0, 80]]),
        ("G4X1.\nG0X2.", [[0, 0, 0], [2, 0, 0]]),
        ("T3T5M6\nG0X#4120\nT7\nX#4120", [[3, 0, 0], [7, 0, 0]]),
        ("G0X#4008Y#4010Z#4014", [[49, 98, 54]]),  # what is in force at the start
        ("G0X5.\nG92X0.\nX1.", [[5, 0, 0], [6, 0, 0]]),
        ("G68X0Y0R90.\nG0X1.Y0.\nG69\nX2.Y1.", [[0, 1, 0], [2, 1, 0]]),
        ("G17G16\nG0X10.Y90.\nY180.\nX20.\nG15\nX1.", [[0, 10, 0], [-10, 0, 0], [-20, 0, 0], [1, 0, 0]]),
        ("G0X10.\nG4U1.\nX11.", [[10, 0, 0], [10, 0, 0], [11, 0, 0]]),
        ("G16G0X10.Y90.\nG15", [[0, 10, 0]]),
        ("G16G0X10.Y0\nG91Y90.\nY90.\nG90X5.", [[10, 0, 0], [0, 10, 0], [-10, 0, 0], [-5, 0, 0]]),
        (
            "G0Z9.\nG16G81X10.Y0Z-5.R2.F50.\nG91Y90.K2\nG90X20.\nG15G80",
            [[0, 0, 9], [10, 0, -5], [0, 10, -5], [-10, 0, -5], [-20, 0, -5]],
        ),
        ("G0G18G16Z10.X90.\nG15X1.", [[10, 0, 0], [1, 0, 0]]),
        ("G40.1G50.2\nG5.4Q1\nG54.4P0\nG54.2P0\nG0X1.", [[1, 0, 0]]),
        ("G5.1Q1\nG8P1\nG0X1.\nG5.1Q0", [[1, 0, 0]]),
        ("G0X1.Y2.Z3.\nG5.1Q2X0Y0Z0\nX4.\nG5.1Q0", [[1, 2, 3], [4, 2, 3]]),
    ],
)
def test_codes(text: str, expected: list[list[float]]) -> None:
    found = follow(text, dialect="fanuc", no_point="calculator", assume_zero=True)
    assert ends(found) == [[pytest.approx(value, abs=1e-9) for value in row] for row in expected]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("G16\nG0X10.Y0.", "polar coordinates (G16)"),
        ("G51X0Y0P2.\nG0X1.", "scaling (G51)"),
        ("G68.3\nG0X1.", "tilted plane (G68.3)"),
        ("G68.2P2Q1X1.\nG0X1.", "tilted plane (G68.2)"),
        ("G68X0Y0Z0I0J0K1.R30.\nG0X1.", "tilted plane"),
        ("G43.5H1\nG0X1.I0J0K1.", "needs the kinematics of a machine"),
        ("G43.5H1\nG2X1.R5.", "an arc or a cycle is programmed while"),
        ("G43.5H1Q2.\nG0X1.", "inclines the tool from its vector"),
        ("G68.2P2Q0X1.\nG0X1.", "tilted plane (G68.2)"),
        ("G68.2P2Q1X0Y0Z0\nG0X1.", "are not complete"),
        ("G68.2P3Q1I1.\nG68.2P3Q2I1.K1.\nG0X1.", "tilted plane (G68.2)"),
        ("G68.2P4I10.\nG0X1.", "tilted plane (G68.2)"),
        ("G254\nG0X1.", "not known"),
        ("G10L50\nG0X1.", "parameters of the control"),
        ("G0X0Y0\nG68X0Y0R90.\nG52X5.\nG0X1.Y1.", "what G52 does while coordinates are rotated"),
        ("G0X0Y0\nG68X0Y0R90.\nG55\nG0X1.Y1.\nG69\nX1.Y1.", "a shift of the origin in rotated coordinates"),
        ("G51.1X0\nG92X5.\nG0X1.Y1.", "what G92 does while coordinates are rotated"),
        ("G68.2X0Y0Z0I0J0K30.\nG54.1P1\nG0X1.Y1.", "what G54.1 does while coordinates are rotated"),
        ("G68X0Y0R90.\nG10L2P1X5.\nG0X1.Y1.", "what G10 does while coordinates are rotated"),
        ("G10L10P1Z5.\nG0X1.", "sets a tool with other words"),
        ("G54.4P1\nG0X1.", "the workpiece setting error compensation (G54.4)"),
        ("G54.2P2\nG0X1.", "the dynamic offset of the rotary table (G54.2)"),
        ("G10L2P0X1.\nG0X1.", "external work offset"),
        ("G66.1P1\nM30\nO1\nM99", ""),
        ("G12.1\nG0X1.", "polar interpolation (G12.1)"),
        ("G1X5.,A45.F100.", "given by its angle"),
        ("G107\nG0X1.", "G107"),
    ],
)
def test_what_is_not_followed_is_refused(text: str, reason: str) -> None:
    found = follow(text, dialect="fanuc", no_point="calculator", assume_zero=True)
    assert all(reason in why for why in reasons(found)[-1:])


def test_tables_get_no_words_while_g254_of_haas_counts_from_where_they_stand(root: Path) -> None:
    """`full` corrects them where the program turns them; a word under G254 would turn them again."""
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    turns = "G0 A-30. C90.\nG254\nG0 X10. Y10.\nG43 Z60. H1\nG1 Z30. F500.\nX20.\nG0 Z60.\nG255\n"
    text = f"G21 G90 G94 G17 G54\nT1 M6\n{turns}G0 A0. C0.\nG0 X0. Y0. Z90.\nM30\n"
    setup = Setup(work_offsets={"G54": {"Z": 60.0}}, initial=dict.fromkeys("XYAC", 0.0) | {"Z": 290.0})
    setup = replace(setup, tools={1: Tool(80.0)})
    fixed = fix_program(read(text.encode(), "part", "haas"), machine, setup, FixOptions(strategy="full"))
    under = fixed.text.decode().partition("G254")[2].partition("G255")[0]
    assert "A-30." not in fixed.text.decode().split()
    assert not {"A", "C"} & set(under)
    again = follow_on(read(fixed.text, "part", "haas"), machine, setup).trace.moves
    assert not fixed.report.refused
    assert (again.rule != Rule.REFUSE).all()


def test_g53_in_increments_is_passed_and_loses_its_axes() -> None:
    found = follow("G91\nG53G0Z0.\nG90G0X1.Y1.\nZ5.", dialect="fanuc")
    assert reasons(found)[0] == "machine coordinates (G53)"
    assert "G53 in incremental coordinates" in reasons(found)[1]
    assert reasons(found)[2] == ""


@pytest.mark.parametrize(
    ("dialect", "block"),
    [
        ("haas", "G70I20.J45.L4"),
        ("haas", "G72I5.J0L3"),
        ("mitsubishi", "G34X0Y0I20.J0K6"),
        ("mitsubishi", "G37.1X0Y0I9.P3J9.K3"),
    ],
)
def test_rows_of_holes_that_the_control_makes_up_are_refused(dialect: str, block: str) -> None:
    text = f"G0X0Y0Z9.\nG81Z-5.R2.F100.L0\n{block}\nG80\nG0X5.Y5.Z9."
    why = reasons(follow(text, dialect=dialect, no_point="calculator", assume_zero=True))
    assert why[0] == why[-1] == ""
    assert all(each.startswith(("holes", "a grid of holes")) for each in why[1:-1])
    assert len(why) > 2


@pytest.mark.parametrize(
    ("text", "dialect", "held"),
    [
        ("G1X5.F9.M98P2\nX9.\nM30\nO2\nM8\nM99", "fanuc", [True, False]),
        ("G1X5.F9.M98P2\nX9.\nM30\nO2\nM8\nM99", "iso", [True, False]),
        ("G1X5.F9.M97P2\nX9.\nM30\nN2M8\nM99", "haas", [True, False]),
        ("G66P2\nG1X5.F9.\nG67\nX9.\nM30\nO2\nG91Y1.\nG90M99", "fanuc", [True, False, False]),
        ("G1X5.F9.M99P3\nN3X9.\nM30", "fanuc", [True, False]),
        ("G1X5.F9.\nX9.M99", "fanuc", [False, False]),
        ("G1X5.F9.\nG60X9.\nX1.", "fanuc", [False, True, False]),
        ("G1X5.F9.\nG2X9.I2.P1M62\nG2X5.I-2.P1\nG1X9.M62P1", "linuxcnc", [False, True, False, False]),
    ],
)
def test_a_motion_behind_which_something_is_called_is_not_split(text: str, dialect: str, held: list[bool]) -> None:
    found = follow(f"G21G90\n{text}", dialect=dialect, no_point="calculator", assume_zero=True)
    assert found.moves.whole.tolist() == held


def test_additional_work_offsets_of_haas() -> None:
    setup = Setup(work_offsets={"G54.1P3": {"X": 5.0, "Y": 0.0, "Z": 0.0}}, initial=dict.fromkeys("XYZ", 0.0))
    assert last(follow("G154P3\nG0X1.", setup=setup, dialect="haas")) == [6, 0, 0]
    assert last(follow("G112\nG0X1.", setup=setup, dialect="haas")) == [6, 0, 0]
    assert last(follow("M97P50L2\nM30\nN50G91G0X1.\nM99", dialect="haas")) == [2, 0, 0]


# -- tilted planes ----------------------------------------------------------------------------------------------------


def test_a_tilted_plane_is_a_frame_in_the_workpiece() -> None:
    found = follow(
        "G68.2X10.Y0.Z5.I0.J90.K0.\nG0X1.Y2.Z3.\nG69\nG0X0.Y0.Z0.", "XYZAC", dialect="fanuc", no_point="IS-B"
    )
    assert ends(found)[0][:3] == pytest.approx([11, -3, 7])
    assert found.moves.tcp.tolist() == [True, False]
    assert ends(found)[1][:3] == pytest.approx([0, 0, 0])


def test_roll_pitch_and_yaw() -> None:
    found = follow("G68.2P1X0.Y0.Z0.I90.J0.K90.\nG0X1.Y2.Z3.", "XYZAC", dialect="fanuc", no_point="IS-B")
    assert ends(found)[0][:3] == pytest.approx([3, 1, 2])
    found = follow("G68.2P1Q321X0.Y0.Z0.I90.J0.K90.\nG0X1.Y2.Z3.", "XYZAC", dialect="fanuc", no_point="IS-B")
    assert ends(found)[0][:3] == pytest.approx([-2, -3, 1])


def test_angles_count_their_own_increments() -> None:
    found = follow("G20\nG68X0Y0R90000\nG0X1.Y0", dialect="fanuc", no_point="IS-B")
    assert last(found) == pytest.approx([0, 25.4, 0])
    found = follow("G20\nG16\nG0X1.Y90000\nG15", dialect="fanuc", no_point="IS-B")
    assert last(found) == pytest.approx([0, 25.4, 0])


@pytest.mark.parametrize("name", ["wCAYFXZSt", "wCBXFZYSt", "dmu50"])
@pytest.mark.parametrize("angles", [(0.0, 30.0, 0.0), (40.0, 20.0, 0.0), (10.0, 0.0, 0.0)])
def test_g53_1_turns_the_tool_square_to_the_plane(root: Path, name: str, angles: tuple[float, float, float]) -> None:
    """The tool axis of the machine, by its own kinematics, is Z of the frame after G53.1."""
    machine = load(str(root / f"examples/machines/{name}.toml"))
    first, second, third = angles
    text = f"G54G0X0.Y0.Z0.\nG68.2X1.Y2.Z3.I{first}J{second}K{third}\nG53.1\nG0X0.Y0.Z9.\nM30\n"
    setup = Setup(assume_zero=True, no_point="IS-B")
    rotary = frozenset(axis.name for axis in machine.axes if axis.rotary)
    program = read(text.encode(), "part", "fanuc")
    moves = trace(program, setup, machine.axis_names, rotary, kinematics=kinematics_of(machine)).moves
    turned, plane = moves.end[1], moves.frames[moves.frame[2]].rotation
    assert moves.reasons[moves.reason[1]] == "tool axis alignment (G53.1)"
    pose = machine.nominal(np.where(machine.rotary, turned, 0.0))
    zero = machine.nominal(np.zeros(len(turned)))
    axis = pose[:3, :3] @ zero[:3, :3].T @ np.array([0.0, 0.0, 1.0])
    assert axis == pytest.approx(plane[:, 2], abs=1e-8)
    assert math.isclose(float(np.linalg.det(plane)), 1.0)


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "mitsubishi"])
@pytest.mark.parametrize("code", ["G53.1", "G53.6"])
@pytest.mark.parametrize("word", ["", "P0", "P1", "P2", "P#500"])
def test_a_way_that_is_chosen_by_p_is_not_guessed(root: Path, dialect: str, code: str, word: str) -> None:
    """What P chooses among the ways to stand square to the plane differs from control to control."""
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    text = f"G21G54G43H1G0X0.Y0.Z90.A0.C0.\nG68.2X1.Y2.Z3.I0.J30.K0.\n{code}{word}\nG1X0.Y0.Z9.F100.\nM30\n"
    setup = Setup(assume_zero=True, no_point="IS-B", tools={1: Tool(80.0)})
    trace = follow_on(read(text.encode(), "part", dialect), machine, setup).trace
    known = word in ("", "P0")
    assert (trace.moves.rule[-1] == Rule.CORRECT) == known
    assert known or "in which direction P of" in trace.moves.reasons[trace.moves.reason[-1]]
    assert ("NCF243" in [message.code for message in trace.messages]) == known


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "mitsubishi"])
def test_x_y_z_stand_still_while_the_program_turns_axes_in_a_tilted_plane(root: Path, dialect: str) -> None:
    """Unless G43.4 leads the tip. A turned block got words of X Y Z, which would have led them along."""
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    lines = [
        "G21G54G43H1G0X0.Y0.Z90.A0.C0.",
        "G68.2X1.Y2.Z3.I0.J30.K0.",
        "G0A30.",
        "X0.Y0.Z9.",
        *(
            "G1A40.F100.",
            "X1.",
            "A30.",
            "X1.Y1.Z9.",
            "A30.X2.",
            "A31.X3.",
            "G0A30.",
            "X4.Y4.Z9.",
            "G43.4H1X5.Y5.Z9.A31.",
        ),
        "M30",
    ]
    setup = Setup(assume_zero=True, no_point="IS-B", tools={1: Tool(80.0)})
    moves = follow_on(read("\n".join(lines).encode(), "part", dialect), machine, setup).trace.moves
    passed, refused = (np.flatnonzero(moves.rule == rule) for rule in (Rule.PASS, Rule.REFUSE))
    assert [int(block) for block in moves.block[passed]] == [2, 4, 6, 10]
    assert [int(block) for block in moves.block[refused]] == [5, 9]
    intent = Intent(machine, moves, State())
    for row in passed[:3]:
        begin, end = (intent.joints(np.array([row]), at[row : row + 1])[0] for at in (moves.start, moves.end))
        np.testing.assert_allclose(begin[~machine.rotary], end[~machine.rotary], atol=1e-9)


@pytest.mark.parametrize(("length", "led"), [("", 0.0), ("G43H1", 80.0), ("G43H0", 0.0)])
def test_a_tilted_plane_is_led_by_the_length_in_force(root: Path, length: str, led: float) -> None:
    """Without one the control leads the gauge point along the plane; the tip, 80 mm away, is what is corrected."""
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    lines = [
        "G21G54G0X0.Y0.Z90.A0.C0.",
        "T1M6",
        "G68.2X1.Y2.Z3.I0.J30.K0.",
        "G53.1",
        "G0X0.Y0.",
        f"{length}G1Z9.F500.",
        "M30",
    ]
    setup = Setup(assume_zero=True, no_point="IS-B", tools={1: Tool(80.0)})
    program = read("\n".join(lines).encode(), "part", "fanuc")
    moves = follow_on(program, machine, setup).trace.moves
    assert moves.rule[-1] == Rule.CORRECT
    assert (moves.tcp[-1], moves.tool_length[-1], moves.length_under_tcp[-1]) == (True, 80.0, led)
    at = Intent(machine, moves, State()).joints(np.array([len(moves) - 1]), moves.end[-1:])[0]
    z = moves.frames[moves.frame[-1]].rotation[:, 2]
    tip, gauge = machine.tip(at, 80.0), machine.tip(at, 0.0)
    np.testing.assert_allclose(gauge - tip, 80.0 * z, atol=1e-9)
    np.testing.assert_allclose((tip if led else gauge) @ z, np.array([1.0, 2.0, 3.0]) @ z + 9.0, atol=1e-9)


# -- the corpus -------------------------------------------------------------------------------------------------------


def test_programs_of_the_world(shared: Callable[[str], Path], figures: Callable[[str], None]) -> None:
    """Every block means what the grammar says; what cannot be read is of another family, but for one file."""
    readable, foreign, unreadable = 0, 0, []
    for path in sorted((shared("corpus") / "fanuc").iterdir()):
        try:
            assert_read_right(read(path.read_bytes(), path.name, "fanuc"))
            readable += 1
        except SourceError as error:
            foreign += error.messages[0].code == "NCF103"
            unreadable += [str(error)] if error.messages[0].code != "NCF103" else []
    figures(f"corpus, fanuc: {readable} read, {foreign} of another family, {len(unreadable)} unreadable")
    assert len(unreadable) <= 1
    assert readable > 20


def test_it_is_said_when_a_program_does_not_say_its_unit() -> None:
    assert [m.code for m in follow("G0X1.", dialect="fanuc").messages] == ["NCF215"]
    assert not follow("G21G0X1.", dialect="fanuc").messages


def test_tools_named_by_h() -> None:
    setup = Setup(tools={3: Tool(50.0)}, initial=dict.fromkeys("XYZ", 0.0), work_offsets=KNOWN.work_offsets)
    assert last(follow("G0G43H3Z10.", setup=setup, dialect="fanuc")) == [0, 0, 60]


@pytest.mark.parametrize(
    ("lines", "end"),
    [
        ("G68.2 X10. Y0 Z0 I0 J30. K0\nG68 X0 Y0 R90.\nG1 X10. Y0 Z0 F100", (10, 5 * math.sqrt(3), 5)),
        ("G68 X5. Y5. R90.\nG68.2 X10. Y0 Z0 I0 J30. K0\nG1 X0 Y10. Z0 F100", (10, 5 * math.sqrt(3), 5)),
    ],
)
def test_a_rotation_turns_in_the_tilted_plane_and_ends_with_the_next_plane(
    lines: str, end: tuple[float, float, float]
) -> None:
    found = last(follow(f"G0 X0 Y0 Z0\n{lines}", "XYZBC", dialect="fanuc"))
    assert found[:3] == pytest.approx(end, abs=1e-9)


@pytest.mark.parametrize(("angle", "known"), [("0.", True), ("30.", False)])
def test_machine_coordinates_under_tcp_without_kinematics(angle: str, known: bool) -> None:
    """Where axes stand that the tip says nothing of is not put down as if the tip's place were theirs."""
    text = f"%\nO1\nG21 G90 G94 G54\nG43.4 H1\nG0 X10. Y0. Z50. A{angle}\nG53 G0 X0. Y0. Z400. A0.\nM30\n%\n"
    setup = Setup(assume_zero=True, tools={1: Tool(100.0)})
    moves = trace(read(text.encode(), "p.nc", "fanuc"), setup, ("X", "Y", "Z", "A"), frozenset("A")).moves
    assert moves.tcp.tolist() == [True, not known]
    assert moves.start[1, 2] == (150.0 if known else 50.0)
    assert moves.end[1, 2] == (400.0 if known else 300.0)
