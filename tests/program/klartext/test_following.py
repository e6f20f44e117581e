"""Where Klartext programs lead, worked out by hand from the manuals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ncfix.control.moves import MotionKind, Rule
from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import SourceError, UsageError
from program.klartext.tnc import KNOWN, ends, follow


def reasons(body: str, axes: str = "XYZ", **more: object) -> list[str]:
    moves = follow(body, axes, **more).moves  # type: ignore[arg-type]
    return [moves.reasons[index] for index in moves.reason[moves.rule == Rule.REFUSE]]


def test_straight_lines_absolute_and_incremental() -> None:
    assert ends("L X+10 Y+20 FMAX\nL IX+5 Z-1 F100\nIY-3") == [[10, 20, 0], [15, 20, -1], [15, 17, -1]]


def test_rapids_last_for_their_block() -> None:
    moves = follow("L X+1 F100\nL X+2 FMAX\nL X+3").moves
    assert moves.kind.tolist() == [MotionKind.FEED, MotionKind.RAPID, MotionKind.FEED]
    assert moves.feed.tolist() == [100, 100, 100]


def test_the_feed_of_a_corner_holds_for_the_corner() -> None:
    moves = follow("L X+1 F100\nRND R0.2 F20\nL Y+5\nCHF 0.1 F30\nL X+3\nL X+4 F50").moves
    assert moves.feed.tolist() == [100, 100, 100, 50]


def test_feeds_per_revolution() -> None:
    moves = follow("L X+1 F100\nL X+2 F0.3 M136\nL X+3 F0.2\nL X+4 F0.1 M137\nL X+5 F50\nL X+6 FU0.4\nL X+7 F60").moves
    assert moves.feed.tolist() == [100, 0.3, 0.2, 0.1, 50, 0.4, 60]
    assert moves.feed_mode.tolist() == [94, 95, 95, 95, 94, 95, 94]


def test_inches() -> None:
    assert ends("L X+1 F10", unit="INCH") == [[25.4, 0, 0]]


def test_tool_length_and_preset_are_added() -> None:
    setup = Setup(
        work_offsets={"PRESET": {"X": 1.0, "Z": 2.0}}, tools={4: Tool(50.0)}, initial=dict.fromkeys("XYZ", 0.0)
    )
    assert ends("TOOL CALL 4 Z S1000 DL+0.5\nL X+10 Z+3 FMAX", setup=setup) == [[11, 0, 55.5]]
    assert ends("TOOL DEF 7 L+30 R+4\nTOOL CALL 7 Z\nL Z+3 FMAX", setup=setup) == [[0, 0, 35]]


def test_a_tool_of_run_time_may_be_any_tool_that_the_program_has_defined() -> None:
    ask = "FN 18: SYSREAD Q1 = ID20 NR1\n"
    with pytest.raises(UsageError, match="length of tool 7 is used but not given"):
        follow(f"TOOL DEF 7 L+30\n{ask}TOOL DEF Q1 L+40\nTOOL CALL 7 Z\nL Z+3 FMAX", setup=Setup())
    setup = Setup(work_offsets={"PRESET": {}}, initial=dict.fromkeys("XYZ", 0.0))
    text = f"{ask}TOOL DEF Q1 L+40\nTOOL DEF 7 L+30\nTOOL CALL 7 Z\nL Z+3 FMAX"
    assert ends(text, setup=setup) == [[0, 0, 33]]


def test_what_is_not_given_is_asked_for() -> None:
    with pytest.raises(UsageError) as error:
        follow("TOOL CALL 4 Z\nL X+1 Y+1 Z+1 FMAX\nCYCL DEF 247 PRESET Q339=+3\nL X+2", setup=Setup())
    assert [message.text for message in error.value.messages] == [
        "length of tool 4 is used but not given",
        "the active preset is used but not given",
        "preset 3 is used but not given",
    ]


def test_presets() -> None:
    assert ends("CYCL DEF 247 PRESET ~\n Q339=+1\nL X+1 FMAX") == [[6, 0, 0]]


def test_machine_coordinates_pass() -> None:
    moves = follow("CYCL DEF 7.0 SHIFT\nCYCL DEF 7.1 X+50\nL X+1 Z+2 FMAX M91\nL Y+1").moves
    assert moves.rule.tolist() == [Rule.PASS, Rule.CORRECT]
    assert moves.end.tolist() == [[1, 0, 2], [1, 1, 2]]


@pytest.mark.parametrize(
    ("arc", "end", "centre", "degrees"),
    [
        ("CC X+0 Y+0\nC X+0 Y+10 DR+", (0, 10, 0), (0, 0, 0), 90),
        ("CC X+0 Y+0\nC X+0 Y+10 DR-", (0, 10, 0), (0, 0, 0), -270),
        ("CC X+0 Y+0\nC X+10 Y+0 DR+", (10, 0, 0), (0, 0, 0), 360),
        ("CC IX-10 IY+0\nC IX-10 IY+10 DR+", (0, 10, 0), (0, 0, 0), 90),
        ("CR X+0 Y+10 R+10 DR+", (0, 10, 0), (0, 0, 0), 90),
        ("CR X+0 Y+10 R-10 DR+", (0, 10, 0), (10, 10, 0), 270),
        ("CR X+0 Y+10 R+10 DR-", (0, 10, 0), (10, 10, 0), -90),
        ("CC X+0 Y+0\nCP PA+90 DR+", (0, 10, 0), (0, 0, 0), 90),
        ("CC X+0 Y+0\nCP IPA+450 IZ-3 DR+", (0, 10, -3), (0, 0, 0), 450),
        ("CC X+0 Y+0\nCP IPA-54 DR-", (5.877853, -8.09017, 0), (0, 0, 0), -54),
        ("L X+10 Y-5\nL Y+0\nCT X+0 Y+10", (0, 10, 0), (0, 0, 0), 90),
    ],
)
def test_arcs(arc: str, end: tuple[float, ...], centre: tuple[float, ...], degrees: float) -> None:
    moves = follow("L X+10 Y+0 Z+0 F500\n" + arc).moves
    assert moves.end[-1] == pytest.approx(end, abs=1e-6)
    assert moves.centre[-1] == pytest.approx(centre, abs=1e-6)
    assert math.degrees(moves.sweep[-1]) * moves.normal[-1][2] == pytest.approx(degrees)


def test_arcs_in_other_planes_turn_about_the_third_axis() -> None:
    moves = follow("L X+0 Y+0 Z+10 F500\nCC X+0 Z+0\nC X+10 Z+0 DR+\nCC Y+0 Z+0\nL X0 Y+10 Z0\nC Y+0 Z+10 DR+").moves
    assert moves.normal[[1, 3]].tolist() == [[0, 1, 0], [1, 0, 0]]
    assert np.degrees(moves.sweep[[1, 3]]) == pytest.approx([90, 90])


def test_polar_lines_keep_what_they_do_not_say() -> None:
    body = "CC X+50 Y+50\nLP PR+30 PA+0 FMAX\nLP PA+60 F100\nLP IPA+30\nLP PR+10"
    assert ends(body) == [[80, 50, 0], [65, 75.980762, 0], [50, 80, 0], [50, 60, 0]]


def test_a_pole_keeps_the_coordinate_that_is_left_out() -> None:
    assert ends("CC X+1 Y+2\nCC Y+5\nLP PR+1 PA+0") == [[2, 5, 0]]


def test_labels_are_called_repeated_and_jumped_to() -> None:
    body = "L X+0 F100\nCALL LBL 5\nLBL 1\nL IX+1\nCALL LBL 1 REP 2/2\nFN 9: IF +Q1 EQU +0 GOTO LBL 9\n"
    body += "LBL 5\nL IY+1\nLBL 0\nLBL 9"
    assert ends("Q1 = 0\n" + body)[-1] == [3, 1, 0]


def test_formulas() -> None:
    body = "Q1 = 3\nFN 1: Q2 = +Q1 + +4\nFN 4: Q3 = +9 DIV +Q1\nQ4 = SQRT ( Q2 + 2 ) - 2 ^ 2 / 4\nFN 8: Q5 = +3 LEN +4"
    assert ends(body + "\nL X+Q4 Y-Q5 Z+Q3") == [[2, -5, 3]]


@pytest.mark.parametrize("angle", ["+4 ANG-Q1", "+4 ANG -Q1", "+4 ANG -4", "+4 ANG-4"])
def test_the_angle_of_two_sides(angle: str) -> None:
    assert ends(f"Q1 = 4\nFN 13: Q2 = {angle}\nL X+Q2") == [[pytest.approx(135.0), 0, 0]]


def test_called_programs_are_followed() -> None:
    moves = follow(
        "L X+5 F100\nCALL PGM TNC:\\SUB.H\nL Y+2", files={"SUB.H": "BEGIN PGM SUB MM\nL IX+1\nEND PGM SUB MM"}
    ).moves
    assert moves.end[:, :2].tolist() == [[5, 0], [6, 0], [6, 2]]
    assert moves.rule.tolist() == [Rule.CORRECT, Rule.REFUSE, Rule.CORRECT]


@pytest.mark.parametrize(
    ("body", "end"),
    [
        ("CYCL DEF 7.0 D\nCYCL DEF 7.1 X+10\nCYCL DEF 7.2 IY+5\nL X+1 Y+1", [11, 6, 0]),
        ("CYCL DEF 7.0 D\nCYCL DEF 7.1 X+10\nCYCL DEF 10.0 R\nCYCL DEF 10.1 ROT+90\nL X+1 Y+2 Z+0", [8, 1, 0]),
        ("CYCL DEF 8.0 M\nCYCL DEF 8.1 X\nL X+1 Y+2 Z+0", [-1, 2, 0]),
        ("CYCL DEF 11.0 S\nCYCL DEF 11.1 SCL 0.5\nL X+4 Y+2 Z+0", [2, 1, 0]),
        ("TRANS DATUM AXIS X+3 Z-1\nL X+1 Z+1", [4, 0, 0]),
        ("TRANS DATUM AXIS X+3\nTRANS DATUM RESET\nL X+1", [1, 0, 0]),
        ("PLANE SPATIAL SPA+90 SPB+0 SPC+0 STAY\nL X+1 Y+2 Z+3", [1, -3, 2]),
        ("PLANE EULER EULPR+90 EULNU+90 EULROT+0 STAY\nL X+1 Y+2 Z+3", [3, 1, 2]),
        ("PLANE VECTOR BX1 BY0 BZ0 NX0 NY-1 NZ0 STAY\nL X+1 Y+2 Z+3", [1, -3, 2]),
        ("PLANE POINTS P1X+0 P1Y+0 P1Z+0 P2X+9 P2Y+0 P2Z+0 P3X+0 P3Y+0 P3Z+5 STAY\nL X+1 Y+2 Z+3", [1, -3, 2]),
        ("PLANE SPATIAL SPA+45 SPB+0 SPC+0 STAY\nPLANE RELATIV SPA+45 STAY\nL X+1 Y+2 Z+3", [1, -3, 2]),
        ("PLANE SPATIAL SPA+90 SPB+0 SPC+0 STAY\nCYCL DEF 7.0 D\nCYCL DEF 7.1 Z+10\nL X+1 Y+2 Z+3", [1, -13, 2]),
        ("PLANE SPATIAL SPA+90 SPB+0 SPC+0 STAY\nPLANE RESET STAY\nL X+1 Y+2 Z+3", [1, 2, 3]),
        ("CYCL DEF 19.0 W\nCYCL DEF 19.1 A+90\nL X+1 Y+2 Z+3", [1, -3, 2]),
    ],
)
def test_frames(body: str, end: list[float]) -> None:
    assert ends(body) == [end]


@pytest.mark.parametrize(
    "words", ["DWELL TIME10", "DWELL REV5.8", "AFC CTRL", "AFC CUT BEGIN TIME3 LOAD80", "AFC CUT END"]
)
def test_functions_that_only_wait_or_mind_the_feed_are_passed_over(words: str) -> None:
    assert reasons(f"FUNCTION {words}\nL X+1 Y+1 Z+1") == []


def test_a_tool_that_is_called_by_name_is_asked_for_as_one_by_number_is() -> None:
    called = 'TOOL CALL "Drill" Z\nL X+1'
    with pytest.raises(UsageError) as caught:
        follow(called)
    assert [message.hint for message in caught.value.messages] == ['--tool "Drill"=LENGTH or --assume-zero']
    assert follow(called, assume_zero=True).assumed == ("length of tool Drill",)
    assert follow(called, named_tools={"DRILL": Tool(80.0)}).messages == ()


def test_a_name_of_digits_is_a_number_where_no_tool_has_that_name() -> None:
    assert follow('TOOL CALL "5" Z\nL X+1', tools={5: Tool(80.0)}).messages == ()


@pytest.mark.parametrize("dwell", ["V.ZEIT 0.5", "V.ZEIT0,5", "DWELL 0.5", "V.IDO5", "TEMPO. 1"])
def test_cycles_call_their_numbers_by_words_of_many_languages(dwell: str) -> None:
    """`V.` is no axis, and `T.` no tool: an address has a number behind it."""
    found = follow(f"CYCL DEF 9.0 VERWEILZEIT\nCYCL DEF 9 .1 {dwell}\nL X+1 Y.5 Z-,5")
    assert [move for move in found.moves.reasons if move] == []
    assert found.moves.end[-1].tolist()[:3] == [1.0, 0.5, -0.5]


def test_projection_angles_are_spatial_angles_where_one_is_zero() -> None:
    by_angle = ends("PLANE SPATIAL SPA+0 SPB+30 SPC+0 STAY\nL X+1 Y+2 Z+3")
    assert ends("PLANE PROJECTED PROPR+30 PROMIN+0 ROT+0 STAY\nL X+1 Y+2 Z+3") == by_angle


def test_mirrored_arcs_turn_the_other_way() -> None:
    moves = follow("CYCL DEF 8.0 M\nCYCL DEF 8.1 X\nL X+10 Y+0 F100\nCC X+0 Y+0\nC X+0 Y+10 DR+").moves
    assert np.degrees(moves.sweep[-1]) * moves.normal[-1][2] == pytest.approx(-90)


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("CYCL DEF 10.0 R\nCYCL DEF 10.1 ROT+30\nCYCL DEF 7.0 D\nCYCL DEF 7.1 X+1\nL X+1 Y+0 Z+0", "datum shift while"),
        ("CYCL DEF 8.0 M\nCYCL DEF 8.1 X\nCYCL DEF 10.0 R\nCYCL DEF 10.1 ROT+30\nL X+1 Y+0 Z+0", "mirror and rotation"),
        ("CYCL DEF 26.0 S\nCYCL DEF 26.1 X 0.5 Y 1\nL X+1", "single axes"),
        ("CYCL DEF 7.0 D\nCYCL DEF 7.1 #5\nL X+1", "from a datum table"),
        ("CYCL DEF 22 ROUGH-OUT Q10=5\nL X+1 Y+1 M99", "cycle 22 makes a path"),
        ("L X+Q1", "known only at run time"),
        ("FC DR+ R5 X+10", "free contour"),
        ("TOOL CALL 1 Y\nL X+1", "tool axis is Y"),
        ("L X+1 F100\nG91 G28 Z0", "not Klartext"),
        ("LN X1 Y2 Z3 TX0 TY0 TZ1", "calculates the rotary axes"),
        ("CC X+0 Y+0\nL X+10 Y+0 F1\nC X+0 Y+10.1 DR+", "does not close"),
        ("FUNCTION TCPM F TCP AXIS SPAT PATHCTRL AXIS\nL X+1", "spatial angles"),
        ("M114\nL X+1", "M114"),
        ("M104\nL X+1", "the datum that was set last"),
        ("CYCL DEF 291 COUPLG.TURNG.INTERP. Q560=1\nL X+1", "cycle 291 may change coordinates"),
        ("TRANS ROTATION ABOUT+5\nL X+1", "TRANS ROTATION"),
        ("TRANS MIRRORPGM A\nL X+1", "TRANS MIRROR"),
    ],
)
def test_what_is_not_sure_is_refused(body: str, reason: str) -> None:
    assert reason in reasons(body)[-1]


def test_a_surface_normal_turns_the_tool_under_m128_only() -> None:
    """TNC7 manual, face milling: without TX TY TZ, M128 holds the tool normal to the surface."""
    normal = "L A0 C0 F100\n%sLN X1 Y2 Z3 %sNX0 NY0.6 NZ0.8"
    assert "normal to the surface" in reasons(normal % ("M128\n", ""), "XYZAC")[-1]
    assert reasons(normal % ("", ""), "XYZAC") == []
    assert reasons(normal % ("M128\n", "A5 C9 "), "XYZAC") == []


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ("C X+1 Y+1 DR+", "NCF271"),
        ("LP PR+1 PA+0", "NCF271"),
        ("CYCL CALL", "NCF272"),
        ("PLANE VECTOR BX1 BY0 BZ0 NX1 NY0 NZ0 STAY", "NCF273"),
        ("CALL LBL 7", "NCF276"),
        ("FN 9: IF +Q5 EQU +1 GOTO LBL 1\nLBL 1", "NCF277"),
        ("FN 14: ERROR= 1005", "NCF278"),
        ("CALL PGM NONE", "NCF231"),
        ("LBL 1\nL IX+1\nFN 9: IF +0 EQU +0 GOTO LBL 1", "NCF233"),
        ("CC X+0 Y+0\nC X+1 Y+1", "NCF220"),
        ("Q1 = 1 / 0", "NCF210"),
    ],
)
def test_where_the_control_would_stop(body: str, code: str) -> None:
    from ncfix.control.trace import trace
    from ncfix.text.reader import read
    from program.klartext.tnc import program

    with pytest.raises(SourceError) as error:
        trace(read(program(body), "t.h"), replace(KNOWN, most_blocks=1000), ("X", "Y", "Z"), frozenset())
    assert error.value.code == code
    assert error.value.messages[0].place is not None
    assert error.value.messages[0].place.line >= 2


@pytest.mark.parametrize(
    ("set_by", "hint"),
    [
        ("", 'give its value as variables."Q5" in the setup file'),
        ("Q5 = Q9 + 1", 'give its value as variables."Q9" in the setup file'),
        ("Q5 = Q5 + 1", 'give its value as variables."Q5" in the setup file'),
        ("FN 18: SYSREAD Q5 = ID990 NR6", "the program reads or measures it"),
        ("FN 18: SYSREAD Q9 = ID990 NR6\nQ5 = Q9 + 1", "the program reads or measures it"),
        ("TOOL CALL 5 Z\nQ5 = Q108 * 2", "Q108 is the tool radius"),
    ],
)
def test_what_decides_a_jump_is_named_by_what_it_comes_from(set_by: str, hint: str) -> None:
    with pytest.raises(SourceError) as error:
        follow(f"{set_by}\nFN 9: IF +Q5 EQU +1 GOTO LBL 1\nLBL 1", tools={5: Tool(80.0)})
    assert error.value.messages[0].hint.startswith(hint)


def test_holes() -> None:
    body = "CYCL DEF 200 D Q200=2 Q201=-15 Q203=+1 Q204=10\nL Z+50 FMAX\nL X+10 Y+20 FMAX M99\n"
    body += "L IX+5 M89\nL IX+5\nL IX+5 M99\nL IX+5"
    moves = follow(body).moves
    assert moves.kind.tolist() == [
        MotionKind.RAPID,
        MotionKind.CYCLE,
        MotionKind.CYCLE,
        MotionKind.CYCLE,
        MotionKind.CYCLE,
        MotionKind.FEED,
    ]
    assert moves.end[1:5].tolist() == [[10, 20, -14], [15, 20, -14], [20, 20, -14], [25, 20, -14]]
    assert moves.start[2].tolist() == [10, 20, 11]
    assert moves.end[5].tolist() == [30, 20, 11]


@pytest.mark.parametrize("number", [1, 2, 17])
@pytest.mark.parametrize(
    ("gap", "depth"), [("ABST 2", "TIEFE -10"), ("ODSTEP 2", "GLEBOKOSC-10"), ("DIST. -2", "PROF. -10,0"), ("2", "-Q1")]
)
def test_old_cycles_in_the_words_of_any_language(number: int, gap: str, depth: str) -> None:
    body = (
        f"Q1 = 10\nCYCL DEF {number}.0 P\nCYCL DEF {number}.1 {gap}\nCYCL DEF {number}.2 {depth}\nL Z+5 FMAX\nL X+1 M99"
    )
    assert ends(body)[-1] == [1, 0, -7]
    assert "run time" in reasons(body.replace(depth, "TIEFE"))[0]


def test_holes_of_old_cycles_count_from_where_they_begin() -> None:
    body = "CYCL DEF 1.0 P\nCYCL DEF 1.1 SETUP 2\nCYCL DEF 1.2 DEPTH -10\nL Z+5 FMAX\nL X+1 M99\nL X+2 M99"
    assert ends(body)[1:] == [[1, 0, -7], [2, 0, -7]]


@pytest.mark.parametrize(
    "words",
    [
        "4.3 ZUSTLG3 F90\nCYCL DEF 4.4 X40\nCYCL DEF 4.5 Y20\nCYCL DEF 4.6 F150 DR- RADIUS 4",
        "5.4 RADIUS 20\nCYCL DEF 5.5 DR+",
    ],
)
def test_old_pockets_are_corrected_where_they_are_called(words: str) -> None:
    number = words[0]
    head = f"CYCL DEF {number}.0 P\nCYCL DEF {number}.1 ABST1\nCYCL DEF {number}.2 TIEFE-7\nCYCL DEF {words}"
    moves = follow(f"{head}\nL X+5 Y+6 Z+1 FMAX\nCYCL CALL M3").moves
    assert moves.rule.tolist() == [Rule.CORRECT, Rule.CORRECT]
    assert moves.end[-1].tolist() == [5, 6, -7]


def test_a_cycle_may_be_called_without_a_position() -> None:
    moves = follow("CYCL DEF 200 D Q200=2 Q201=-15 Q203=+1 Q204=10\nL X+1 Y+1 Z+20 FMAX\nCYCL CALL").moves
    assert moves.rule.tolist() == [Rule.CORRECT, Rule.CORRECT]
    assert moves.end[-1].tolist() == [1, 1, -14]


def test_tool_centre_point_control_begins_at_once_and_ends_after_its_block() -> None:
    moves = follow("TOOL CALL 2 Z\nL X+1 F100 M128 F50\nL X+2 M129\nL X+3", "XYZBC").moves
    assert moves.tcp.tolist() == [True, True, False]
    assert moves.feed.tolist() == [100, 100, 100]


def test_function_tcpm_is_tool_centre_point_control() -> None:
    body = "FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS\nL X+1\nFUNCTION RESET TCPM\nL X+2"
    assert follow(body, "XYZBC").moves.tcp.tolist() == [True, False]


def test_the_shorter_way_round() -> None:
    moves = follow("L C+350 F100\nM126\nL C+10\nM127\nL C+350", "XYZC").moves
    assert np.degrees(moves.end[:, 3] - moves.start[:, 3]) == pytest.approx([350, 20, 340])


def test_after_a_retract_rapids_pass_and_feeds_are_refused() -> None:
    moves = follow("L M140 MB MAX\nL X+1 FMAX\nL X+2 F100\nL Z+5 FMAX\nL X+3").moves
    assert moves.rule.tolist() == [Rule.PASS, Rule.PASS, Rule.REFUSE, Rule.CORRECT, Rule.CORRECT]


def test_codes_that_end_something_act_at_the_end_of_their_block() -> None:
    moves = follow("L C+350 F100\nM126\nL C+10 M127\nL C+350", "XYZC").moves
    turns = np.degrees(moves.end[:, 3] - moves.start[:, 3])
    assert turns[1] == pytest.approx(20.0)
    assert moves.whole.tolist() == [False, True, False]
    rules = follow("M144\nL X+1 F100 M145\nL X+2 FMAX").moves.rule.tolist()
    assert rules == [Rule.REFUSE, Rule.CORRECT]


def test_corners_are_left_to_the_control_and_not_split() -> None:
    moves = follow("L X+10 F100\nRND R2\nL Y+10\nL X+0").moves
    assert moves.whole.tolist() == [True, True, False]
    assert moves.end[:, :2].tolist() == [[10, 0], [10, 10], [0, 10]]


def test_approach_and_departure() -> None:
    body = "APPR LT X+10 Y+5 LEN15 R0 F100\nL X+20\nDEP LT LEN10 F200\nL Z+5 R0 FMAX"
    moves = follow(body).moves
    assert moves.end.tolist() == [[10, 5, 0], [20, 5, 0], [30, 5, 0], [30, 5, 5]]
    assert moves.rule.tolist() == [Rule.CORRECT, Rule.CORRECT, Rule.PASS, Rule.CORRECT]
    assert moves.whole.tolist() == [True, False, False, False]


def test_beside_the_contour_a_departure_ends_where_the_radius_of_the_tool_leads() -> None:
    moves = follow("APPR LT X+10 Y+5 LEN15 RR F100\nL X+20\nDEP LT LEN10 F200\nL Z+5 R0 FMAX\nL X+0 Y+0 FMAX").moves
    assert np.isnan(moves.end[2, :2]).all()
    assert moves.rule.tolist() == [Rule.CORRECT, Rule.CORRECT, Rule.PASS, Rule.PASS, Rule.CORRECT]


def test_skipped_blocks_are_executed_unless_asked() -> None:
    assert ends("/5 L X+1\nL Y+1") == [[1, 0, 0], [1, 1, 0]]
    assert ends("/5 L X+1\nL Y+1", block_skip=True) == [[0, 1, 0]]


def test_the_height_of_a_called_position_shifts_the_depths() -> None:
    body = (
        "CYCL DEF 200 D Q200=2 Q201=-15 Q203=+1 Q204=10\nL Z+50 FMAX\nCYCL CALL POS X+10 Y+20 Z+5 FMAX M3\nL X+1 FMAX"
    )
    assert ends(body)[1:] == [[10, 20, -9], [1, 20, 16]]


def test_only_what_the_control_puts_in_is_known_at_run_time() -> None:
    body = "Q1 = 3\nFN 18: SYSREAD Q2 = ID50 NR1 IDXQ1\nL X+Q1\nL Y+Q2"
    assert len(reasons(body)) == 1
    assert len(reasons("FN 23: Q20 = CDATA Q30\nL X+Q22 FMAX")) == 1


def test_feeds_of_inch_programs_are_tenths_per_minute_and_inches_per_revolution() -> None:
    body = "TOOL CALL 1 Z F50\nL X+1 F100\nL X+2 FU2\nL X+3 F30\nL X+4 F AUTO\nL X+5 F3 M136"
    moves = follow(body, unit="INCH").moves
    assert moves.feed.tolist() == pytest.approx([254.0, 50.8, 76.2, 127.0, 76.2])
    assert moves.feed_mode.tolist() == [94, 95, 94, 94, 95]
