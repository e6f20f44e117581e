"""A program followed on a machine: its kinematics under tool-centre-point control, and the conditions it runs under."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow, kinematics_of
from ncfix.control.moves import MotionKind, Rule, TcpState
from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import UsageError
from ncfix.machine import load, loads
from ncfix.text.reader import read

ROTARY_TABLE = """
ncfix = 1
name = "table"
topology = "w C F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0] }
axis.Y = { type = "linear", direction = [0, 1, 0] }
axis.Z = { type = "linear", direction = [0, 0, 1] }
axis.C = { type = "rotary", direction = [0, 0, -1], point = [0, 0, 0] }
tool = { direction = [0, 0, 1], point = [0, 0, 0] }
"""
GROWTH = """
[[effect]]
name = "EZS"
basis = "polynomial"
input = "temp_spindle"
center = 20.0
degree = [1]
coefficients = [0.004]
"""
SETUP = Setup(assume_zero=True, tools={0: Tool(0.0), 1: Tool(100.0)})


def test_switching_tcp_off_with_the_table_turned_is_followed() -> None:
    """At C = 90 the point (10, 0) of the part stands at (0, -10) of a table that turns about -z."""
    program = read(b"G90 G0 G43.4 H1 X10. Y0. Z5. C90.\nG49\nG0 Z200.\nM2\n", "a.nc", "iso")
    moves = follow(program, loads(ROTARY_TABLE), SETUP).trace.moves
    x, y, z = (moves.axes.index(letter) for letter in "XYZ")
    assert (moves.rule == Rule.CORRECT).all()
    # exact arithmetic but for cos 90 degrees, 6e-17, times 10 mm and the 256 mm probes of the affine map
    np.testing.assert_allclose(moves.end[-1, [x, y, z]], [0.0, -10.0, 200.0], atol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 90.0, 30.0])
@pytest.mark.parametrize("dialect", ["iso", "fanuc"])
@pytest.mark.parametrize(
    "block", ["G53 G0 X30.", "G53 G0 Y-15.", "G53 G0 Z200.", "G53 G0 X5. Z150.", "G28 Z5.", "G28 X10."]
)
def test_axes_that_machine_coordinates_do_not_name_stand_still_under_tcp(
    block: str, dialect: str, angle: float
) -> None:
    """A motion in machine coordinates moves the axes that it names, however the numbers of the tip change with it."""
    text = f"G21 G90 G0 G43.4 H1 X10. Y0. Z5. C{angle}\n{block}\nM2\n"
    machine = loads(ROTARY_TABLE)
    moves = follow(read(text.encode(), "a.nc", dialect), machine, SETUP).trace.moves
    kinematics, on, off = kinematics_of(machine), TcpState(True, 100.0), TcpState(False, 0.0)
    assert kinematics is not None
    start, end = np.array(kinematics(moves.end[0].tolist(), on, off)), moves.end[-1]
    assert moves.tcp[[0, -1]].tolist() == [True, False]  # said in axes of the machine
    named = [letter in block for letter in moves.axes]
    # affine maps of 256 mm probes in double precision
    np.testing.assert_allclose(end[~np.array(named)], start[~np.array(named)], atol=1e-9)
    words = {word[0]: float(word[1:]) for word in block.split() if word[0] in "XYZ"}
    wanted = [0.0 if "G28" in block else words[letter] for letter in moves.axes if letter in words]
    np.testing.assert_allclose(end[named], wanted, atol=1e-9)


@pytest.mark.parametrize(("tool_off", "tool"), [(0.0, 100.0), (1.0, 0.0)])
@pytest.mark.parametrize("block", ["SUPA G0 Z240", "G53 G0 X20", "G153 G1 Y-15 Z200 F500"])
def test_axes_that_machine_coordinates_do_not_name_stand_still_in_a_swivelled_plane(
    root: Path, block: str, tool_off: float, tool: float
) -> None:
    swivel = 'CYCLE800(1,"T",0,57,0,0,0,10,15,5,0,0,0,-1)'
    text = f"G90 G710\nT1 D1\nG0 X0 Y0 Z200 A0 C0\n{swivel}\nG0 X10 Y20 Z30\n{block}\nM30\n"
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    program = read(text.encode(), "a.mpf", "siemens")
    moves = follow(program, machine, replace(SETUP, variables={"$MN_G53_TOOLCORR": tool_off})).trace.moves
    kinematics, on, off = kinematics_of(machine), TcpState(True, 100.0), TcpState(False, 0.0)
    assert kinematics is not None
    assert moves.rule[-1] == Rule.PASS
    unsure = np.isnan(follow(program, machine, SETUP).trace.moves.end[-1]).any()
    assert unsure == ("Z" in block)
    start, end = np.array(kinematics(moves.end[-2].tolist(), on, off)), moves.end[-1]
    assert not moves.tcp[-1]  # said in axes of the machine
    words = {word[0]: float(word[1:]) for word in block.split()[2:] if word[0] in "XYZ"}
    wanted = [
        words.get(axis, place) + tool * (axis == "Z" and axis in words)
        for axis, place in zip(moves.axes, start, strict=True)
    ]
    # affine maps of 256 mm probes in double precision
    np.testing.assert_allclose(end, wanted, atol=1e-9)


def test_kinematics_say_a_command_there_and_back() -> None:
    convert = kinematics_of(loads(ROTARY_TABLE))
    assert convert is not None
    on, off = TcpState(True, 80.0), TcpState(False, 80.0)
    command = [0.7, 12.0, -7.0, 30.0]
    np.testing.assert_allclose(convert(convert(command, on, off), off, on), command, atol=1e-9)


def test_a_machine_without_three_linear_axes_has_no_such_kinematics() -> None:
    text = ROTARY_TABLE.replace("F X Y Z", "F X Z").replace('axis.Y = { type = "linear", direction = [0, 1, 0] }\n', "")
    assert kinematics_of(loads(text)) is None


def test_conditions_of_the_setup_reach_the_error_model() -> None:
    machine = loads(ROTARY_TABLE + GROWTH)
    program = read(b"G90 G21\nG0 X0 Y0 Z5 C0\nM2\n", "a.nc", "iso")
    warm = fix_program(program, machine, replace(SETUP, inputs={"temp_spindle": 25.0}))
    assert b"Z4.98 C0\n" in warm.text
    cool = fix_program(program, machine, replace(SETUP, inputs={"temp_spindle": 20.0}))
    assert cool.text == program.source
    with pytest.raises(UsageError, match="temp_spindle"):
        fix_program(program, machine, SETUP)


TILTING_GUIDE = """
[[effect]]
name = "EBX"
basis = "polynomial"
degree = [1]
coefficients = [1e-7]
"""


@pytest.mark.parametrize(("code", "length"), [("G43", -300.0), ("G44", 100.0)])
def test_an_offset_below_zero_is_no_length_where_the_errors_depend_on_it(code: str, length: float) -> None:
    """A distance by which the tool was touched off would turn the lever of the tool round."""
    program = read(b"G21 G90 G54\nT1 M6\n%b H1\nG0 X10. Y0. Z10.\nM30\n" % code.encode(), "a.nc", "fanuc")
    setup = Setup(assume_zero=True, tools={1: Tool(length)})
    with pytest.raises(UsageError, match="that is not the length of the tool"):
        follow(program, loads(ROTARY_TABLE + TILTING_GUIDE), setup)
    assert follow(program, loads(ROTARY_TABLE), setup).trace.moves.tool_length[-1] == -abs(length)


def test_a_stamp_fits_on_a_line_of_any_control_whatever_was_assumed() -> None:
    tools = "".join(f"T{number} M6\nG43 H{number}\nG0 X{number}. Y1. Z1.\n" for number in range(1, 41))
    program = read(f"G21 G90 G54\n{tools}M30\n".encode(), "a.nc", "iso")
    stretched = TILTING_GUIDE.replace("EBX", "EXX").replace("1e-7", "1e-3")
    machine = loads(ROTARY_TABLE + stretched)
    stamp = next(line for line in fix_program(program, machine, SETUP).text.splitlines() if b"ncfix" in line)
    assert b"work offset G54" in stamp
    assert len(stamp) <= 250


LOST = {
    "M92 in a tilted plane": (
        "a.h",
        "heidenhain",
        "BEGIN PGM A MM\nTOOL CALL 1 Z S1000\nL X+10 Y+20 Z+100 A+0 C+0 R0 FMAX\nPLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN "
        "FMAX\nL X+1 Y+2 Z+100 R0 FMAX\nL Z-50 R0 FMAX M92\nL X+0 R0 FMAX\nL Z+10 R0 F500\nEND PGM A MM",
    ),
    "a turn of a plane whose way is not known, under M128": (
        "a.h",
        "heidenhain",
        "BEGIN PGM A MM\nTOOL CALL 1 Z S1000\nL X+10 Y+20 Z+100 A+0 C+0 R0 FMAX\nM128\nPLANE SPATIAL SPA+30 SPB+0 "
        "SPC+30 TURN FMAX\nL X+10 Y+20 Z+100 R0 FMAX\nPLANE SPATIAL SPA+0 SPB+0 SPC+0 TURN FMAX\nL A+0 C+0 R0 FMAX\n"
        "L X+0 R0 FMAX\nL Z+0 R0 F500\nEND PGM A MM",
    ),
    "a fixed point of a linear axis in a swivelled plane": (
        "a.mpf",
        "siemens",
        'G71 G90 G17\nT1 M6 D1\nG0 X10 Y20 Z100 A0 C0\nCYCLE800(0,"T",0,57,0,0,0,0,0,0,0,0,0,1)\nG0 X10 Y20 Z100\n'
        "G0 C90\nG75 X1=0\nG0 X10\nG1 Z50 F500\nM30",
    ),
    "a fixed point of a rotary axis in a swivelled plane": (
        "a.mpf",
        "siemens",
        'G71 G90 G17\nT1 M6 D1\nG0 X10 Y20 Z100 A0 C0\nCYCLE800(0,"T",0,57,0,0,0,30,0,0,0,0,0,1)\nG0 X10 Y20 Z100 C45\n'
        "G75 C1=0\nG0 C0\nG1 Z50 F500\nM30",
    ),
    "increments in machine coordinates under G43.4": (
        "a.nc",
        "fanuc",
        "G21 G90 G0 G43.4 H1 X10. Y0. Z5. A12. C20.\nG91 G53 X3.\nG90 G1 Z4. F100.\nM30",
    ),
}


@pytest.mark.parametrize("name", LOST)
def test_where_an_axis_of_the_machine_is_lost_the_tip_is(root: Path, name: str) -> None:
    path, dialect, text = LOST[name]
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    setup = replace(SETUP, initial={"Z": 290.0}, no_point="calculator")
    moves = follow(read(f"{text}\n".encode(), path, dialect), machine, setup).trace.moves
    assert moves.rule[moves.kind == MotionKind.FEED].tolist() == [Rule.REFUSE]
    tip = [moves.axes.index(letter) for letter in "XYZ"]
    assert np.isnan(moves.end[-2 if dialect != "fanuc" else -1, tip]).any()


@pytest.mark.parametrize(("mode", "far"), [("G70", 25.4), ("G71", 1.0)])
def test_increments_in_machine_coordinates_have_the_unit_of_the_program(mode: str, far: float) -> None:
    text = f"{mode} G90\nG0 X1 Y1 Z1 C0\nG91 SUPA Z1\nM30\n"
    moves = follow(read(text.encode(), "a.mpf", "siemens"), loads(ROTARY_TABLE), SETUP).trace.moves
    z = moves.axes.index("Z")
    assert moves.end[-1, z] - moves.end[-2, z] == pytest.approx(far)


def test_g10_l20_under_tcp_counts_from_the_tip() -> None:
    text = "G21 G90 G54 G43 H1 G0 X10. Y0. Z5. C0.\nG10 L20 P1 Z0.\nG0 Z7.\nM2\n"
    setup = replace(SETUP, tcp=True)
    moves = follow(read(text.encode(), "a.ngc", "linuxcnc"), loads(ROTARY_TABLE), setup).trace.moves
    z = moves.axes.index("Z")
    assert moves.end[-1, z] - moves.end[-2, z] == pytest.approx(7.0)


TOOL_OF_RUN_TIME = {
    "linuxcnc": "G21 G54 G0 X0 Y0 Z50\nG38.2 Z0 F100\nG90 T[ROUND[#5063]] M6\n{}G1 X10 F100\nM2\n",
    "fanuc": "%\nO1\nG21 G54 G90 G0 X0. Y0. Z50.\nT#500 M6\n{}G1 X10. F100.\nM30\n%\n",
    "siemens": "G54 G0 X0 Y0 Z50\nT=R99 M6\n{}G1 X10 F100\nM30\n",
}


@pytest.mark.parametrize(
    ("dialect", "length"),
    [
        *(("linuxcnc", length) for length in ("", "G43 Z60\n", "#1=#5400\nG43 H#1 Z60\n")),
        *(("fanuc", length) for length in ("", "G43 Z60.\n", "#1=#4120\nG43 H#1 Z60.\n")),
        *(("siemens", length) for length in ("", "D1\n")),
    ],
)
def test_a_tool_known_only_at_run_time_has_no_length(dialect: str, length: str) -> None:
    text = TOOL_OF_RUN_TIME[dialect].format(length)
    setup = replace(SETUP, no_point="calculator")
    moves = follow(read(text.encode(), "a", dialect), loads(ROTARY_TABLE), setup).trace.moves
    assert moves.rule[-1] == Rule.REFUSE
    assert "known only at run time" in moves.reasons[moves.reason[-1]]


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc"])
def test_a_length_that_is_named_is_known_with_any_tool(dialect: str) -> None:
    text = TOOL_OF_RUN_TIME[dialect].format("G43 H1\nG0 X0. Y0. Z60.\n")
    setup = replace(SETUP, no_point="calculator")
    moves = follow(read(text.encode(), "a", dialect), loads(ROTARY_TABLE), setup).trace.moves
    assert moves.rule[-1] == Rule.CORRECT
    assert moves.tool_length[-1] == 100.0


def test_a_length_that_is_defined_at_run_time_is_asked_for() -> None:
    text = "BEGIN PGM A MM\nTOOL DEF 7 L+Q1601 R+2\nTOOL CALL 7 Z S100\nL X+0 Y+0 Z+50 FMAX\nEND PGM A MM\n"
    with pytest.raises(UsageError, match="length of tool 7"):
        follow(read(text.encode(), "a.h", "heidenhain"), loads(ROTARY_TABLE), Setup(work_offsets={"PRESET": {}}))


def test_an_axis_of_the_machine_hides_those_of_the_frame_that_it_has_a_part_in() -> None:
    """G74 leads Z to a place that is not known: X and Y of a frame that is turned about Z do not depend on it."""
    text = "G54 G0 X0 Y0 Z50 C0\n{}\nG74 Z1=0\nG1 X10 Y5 F200\nG1 X20\nM30\n"
    for frame, sure in (("ROT Z30", True), ("MIRROR X0", True), ("ROT X30", False)):
        program = read(text.format(frame).encode(), "a.mpf", "siemens")
        moves = follow(program, loads(ROTARY_TABLE), SETUP).trace.moves
        known = ~np.isnan(moves.end[-1])
        assert known[[moves.axes.index(letter) for letter in "XY"]].tolist() == [True, sure]


@pytest.mark.parametrize("first", ["TRAORI", 'CYCLE800(1,"T",0,57,0,0,0,10,20,0,0,0,0,-1)'])
def test_with_d0_the_spindle_reference_is_led_and_the_tip_is_corrected(root: Path, first: str) -> None:
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    text = f"G54 G71 T1 D1 M6\nG0 X0 Y0 Z80 A0 C0\n{first}\nD0\nG0 X0 Y0 Z75\nG1 X5 Y5 Z70 F500\nM30\n"
    moves = follow(read(text.encode(), "a.mpf", "siemens"), machine, SETUP).trace.moves
    assert moves.rule[-1] == Rule.CORRECT
    assert (moves.tcp[-1], moves.tool_length[-1], moves.length_under_tcp[-1]) == (True, 100.0, 0.0)


KEPT = {
    "heidenhain": (
        "BEGIN PGM U MM\nTOOL CALL 1 Z S1000\nL X+10 Y+5 Z+250 R0 FMAX\nL B+0 C+0 FMAX\nM128\n"
        "L X+1 Y+2 Z+60 B+12 C+20 F1000\nL X+22.183 Y-12.737 Z+60 R0 FMAX\nL Z+50 F800\nL Y-15 R0 FMAX M91\n"
        "L Z+14.91 F700\nEND PGM U MM\n"
    ),
    "fanuc": (
        "%\nO1 (U)\nG21 G90 G54 T1 M6\nG43 H1 G0 X10. Y5. Z250. B0. C0.\nG43.4 H1\n"
        "G1 X1. Y2. Z60. B12. C20. F1000.\nG0 X22.183 Y-12.737 Z60.\nG1 Z50. F800.\nG53 G0 Y-15.\n"
        "G1 Z14.91 F700.\nM30\n%\n"
    ),
}


def test_an_axis_that_machine_coordinates_leave_where_it_is_keeps_its_correction(root: Path) -> None:
    """On this machine a head turns the tool, so that X of the tip stands still while Y of the machine moves."""
    machine = load(str(root / "tests/goldens/machines/head.toml"))
    setup = Setup(assume_zero=True, tools={1: Tool(80.0)}, no_point="calculator")
    left = []
    for dialect, text in KEPT.items():
        fixed = fix_program(read(text.encode(), "a", dialect), machine, setup, FixOptions(strategy="position"))
        left.append({each.axis: each.most for each in fixed.report.left if each.last >= 9})
    klartext, fanuc = left
    assert klartext["X"] == pytest.approx(fanuc["X"], abs=0.3e-3)  # digits of the control, two tenths each
