"""Statements and M codes that change what later blocks mean, or that only look as if they did."""

from __future__ import annotations

import pytest

from ncfix.control.moves import MotionKind, Rule
from ncfix.control.setup import Setup
from ncfix.diagnostics import SourceError
from ncfix_heidenhain.klartext.layout import axis_numbers
from program.klartext.tnc import KNOWN, ends, fixed, follow


def fates(body: str, axes: str = "XYZ", setup: Setup = KNOWN) -> list[tuple[int, str]]:
    """The rule of each motion, and why."""
    moves = follow(body, axes, setup=setup).moves
    return [(int(rule), moves.reasons[reason]) for rule, reason in zip(moves.rule, moves.reason, strict=True)]


@pytest.mark.parametrize("code", ["M118 X1 Y1 Z1", "M120 LA5", "M124 T0.01", "M103 F20"])
def test_words_of_an_m_code_are_no_words_of_the_motion(code: str) -> None:
    assert ends(f"L X+50 F100 {code}") == [[50, 0, 0]]
    line = fixed(f"L X+0 Y+0 Z+0 F100\nL X+50 F100 {code}").text.decode().splitlines()[-2]
    assert line.startswith("L X+50.0")
    assert line.endswith(code)


@pytest.mark.parametrize("block", ["L X+1 X+2", "L X+1 IX+2", "LP PR+5 IPR+1", "L Z-1 Y+2 Z-3"])
def test_an_axis_that_is_said_twice_is_an_error_of_the_block(block: str) -> None:
    assert "not Klartext" in fates(f"CC X+0 Y+0\nL X+5 Y+5 Z+5 FMAX\n{block}")[-1][1]


@pytest.mark.parametrize(
    "block", ["CR X+10 Y+40 DR+ R+45 R-45", "CTP PR+20 IPA-60 R+25 R-25", "APPR CT X+10 Y+40 CCA90 R+5 CCA45 RL"]
)
def test_a_size_of_an_arc_that_is_said_twice_is_an_error_of_the_block(block: str) -> None:
    assert "not Klartext" in fates(f"L X+8 Y+20 Z+3 FMAX\nCC X+30 Y+20\nL X+10 F200\n{block}")[-1][1]


def test_m94_and_m138_name_axes_without_numbers() -> None:
    assert ends("L C+370 FMAX\nL C+380 M94 C FMAX", "XYZC")[-1] == [0, 0, 0, 380]
    assert fates("L X+1 Y+1 Z+1 M138 C FMAX\nL X+2\nM138\nL X+3 Y+1 Z+1 FMAX", "XYZBC")[1:] == [
        (Rule.REFUSE, "M138: the control includes only some of the rotary axes"),
        (Rule.CORRECT, ""),
    ]
    assert [rule for rule, _ in fates("L X+1 Y+1 Z+1 M138 B C FMAX", "XYZBC")] == [Rule.CORRECT]
    assert ends("L C+370 FMAX\nM94 C\nL C+20 F100", "XYZC")[-1] == [0, 0, 0, 20]
    assert fates("M138 B C\nL X+1 Y+1 Z+1 FMAX", "XYZBC") == [(Rule.CORRECT, "")]


@pytest.mark.parametrize("element", ["FLT", "FCT DR- R15 CCX+5 CCY+7", "FL X+5 Y+5", "FC DR- R18 CLSD+ CCX+2 CCY+3"])
def test_elements_of_free_contours_leave_the_tool_axis_where_it_is(element: str) -> None:
    moves = follow(f"L X+1 Y+1 Z+5 F100\nFPOL X+1 Y+1\n{element}\nFSELECT2\nL X+9 Y+9 FMAX").moves
    assert moves.rule.tolist() == [Rule.CORRECT, Rule.REFUSE, Rule.CORRECT]
    assert moves.end[-1].tolist() == [9, 9, 5]


@pytest.mark.parametrize(
    "before",
    ["DEP CT CCA90 R+5", "TCH PROBE 0.0 PLANE Q5 X-", "L M140 MB MAX", "PLANE SPATIAL SPA+0 SPB+0 SPC+0 MOVE DIST5"],
)
def test_a_rapid_from_where_the_control_has_led_the_tool_is_passed(before: str) -> None:
    found = fates(f"L X+1 Y+1 Z+5 F100\n{before}\nL Y+8 FMAX\nL X+1 Y+1 Z+1 FMAX")
    assert found[-2] == (Rule.PASS, "a rapid from a position that the control calculates")
    assert found[-1] == (Rule.CORRECT, "")


@pytest.mark.parametrize(
    ("number", "said"), [(31, True), (481, True), (483, True), (583, True), (482, False), (421, False)]
)
def test_that_a_tool_is_measured_is_said(number: int, said: bool) -> None:
    found = follow(f"L X+1 Y+1 Z+5 FMAX\nTCH PROBE {number}\nL X+1 Y+1 Z+1 FMAX")
    assert [message.code for message in found.messages] == (["NCF281"] if said else [])
    assert found.moves.rule.tolist()[-1] == Rule.CORRECT


def test_a_pattern_of_a_code_is_no_block_that_does_nothing() -> None:
    hole = "CYCL DEF 200 ~\n Q200=2 ~\n Q201=-5 ~\n Q203=+0 ~\n Q204=50"
    found = fates(f"L X+1 Y+1 Z+5 FMAX\n{hole}\nCYCL DEF 224 ~\n Q216=+50\nL X+1 Y+1 Z+1 FMAX")
    assert found[1] == (Rule.REFUSE, "cycle 224 moves the axes at its definition")


def test_probing_cycles_that_set_a_datum() -> None:
    start = "L X+1 Y+1 Z+5 F100\n"
    (rule, reason) = fates(start + "TCH PROBE 413 DATUM OUTSIDE CIRCLE ~\n Q321=+5\nL X+1 Y+1 Z+1 FMAX")[-1]
    assert rule == Rule.REFUSE
    assert "TCH PROBE 413 sets the datum" in reason
    assert fates(start + "TCH PROBE 510\nL X+1 Y+1 Z+1 FMAX")[-1][0] == Rule.REFUSE
    assert fates(start + "TCH PROBE 421 MEASURE HOLE ~\n Q321=+5\nL X+1 Y+1 Z+1 FMAX")[-1] == (Rule.CORRECT, "")
    again = "TCH PROBE 413 DATUM ~\n Q321=+5\nCYCL DEF 247 PRESET Q339=+1\nL X+1 Y+1 Z+1 FMAX"
    assert fates(start + again)[-1] == (Rule.CORRECT, "")


@pytest.mark.parametrize(
    ("function", "cycle"),
    [
        ("TRANS MIRROR AXIS X", "CYCL DEF 8.0 M\nCYCL DEF 8.1 X"),
        ("TRANS ROTATION ROT-30", "CYCL DEF 10.0 R\nCYCL DEF 10.1 ROT-30"),
        ("TRANS ROTATION ROT-10\nTRANS ROTATION IROT-20", "CYCL DEF 10.0 R\nCYCL DEF 10.1 ROT-30"),
        ("TRANS SCALE SCL0,5", "CYCL DEF 11.0 S\nCYCL DEF 11.1 SCL 0,5"),
        ("TRANS SCALE SCL3\nTRANS SCALE RESET", ""),
        ("TRANS MIRROR AXIS X Y\nTRANS MIRROR RESET", ""),
        ("TRANS ROTATION ROT+5\nTRANS ROTATION RESET", ""),
    ],
)
def test_trans_functions_do_what_the_cycles_do(function: str, cycle: str) -> None:
    assert ends(f"{function}\nL X+10 Y+20 Z+5") == ends(f"{cycle}\nL X+10 Y+20 Z+5")


def test_trans_functions_and_cycles_of_a_kind_are_not_mixed() -> None:
    body = "CYCL DEF 10.0 R\nCYCL DEF 10.1 ROT-30\nTRANS ROTATION RESET\nL X+10 Y+20 Z+5"
    assert "how the control combines them is not certain" in fates(body)[-1][1]


def test_a_table_of_datums_by_trans() -> None:
    found = fates("L X+0 Y+0 Z+9 FMAX\nTRANS DATUM TABLE TABLINE7\nL X+1 FMAX\nTRANS DATUM RESET\nL X+1 FMAX")
    assert "is from a datum table" in found[1][1]
    assert found[2][0] == Rule.CORRECT


POCKET = "CYCL DEF 251 POCKET ~\n Q218=+60 ~\n Q201=-20 ~\n Q200=+2 ~\n Q203=+5 ~\n Q204=+50"


def test_spatial_angles_of_tcpm_leave_the_rotary_axes_where_the_control_works_out() -> None:
    body = "L X+0 Y+0 Z+90 B+0 C+0 FMAX\nFUNCTION TCPM F TCP AXIS SPAT PATHCTRL AXIS\nL X+5 Y+5 Z+50 A+10 B+20 C+0 F100"
    body += "\nFUNCTION RESET TCPM\nL Z+80 FMAX\nL X+0 Y+0 Z+80 B+0 C+0 FMAX\nL X+1 F100"
    found = fates(body, "XYZBC")
    assert found[1] == (Rule.REFUSE, "FUNCTION TCPM AXIS SPAT: A B C are spatial angles, not positions of axes")
    assert [rule for rule, _ in found[2:]] == [Rule.PASS, Rule.CORRECT, Rule.CORRECT]


def test_a_row_of_the_preset_table_by_its_function() -> None:
    assert ends("PRESET SELECT #1\nL X+1 Y+1 Z+1 FMAX") == ends("CYCL DEF 247 P Q339=+1\nL X+1 Y+1 Z+1 FMAX")
    tilted = "CYCL DEF 10.0 R\nCYCL DEF 10.1 ROT+5\nPRESET SELECT #1\nL X+1 Y+1 Z+1 FMAX"
    assert "PRESET SELECT" in fates(tilted)[-1][1]
    for row in ("#1 KEEP TRANS", "#Q1"):
        assert "PRESET SELECT" in fates(f"PRESET SELECT {row}\nL X+1 Y+1 Z+1 FMAX")[-1][1]


SUB = "BEGIN PGM S MM\nL X+5 FMAX\nEND PGM S MM\n"


def test_a_program_that_was_selected_is_called() -> None:
    found = ends('L X+1 Y+1 Z+1 FMAX\nSEL PGM "TNC:\\S.H"\nCALL SELECTED PGM\nL Y+9 FMAX', files={"S.H": SUB})
    assert found == [[1, 1, 1], [5, 1, 1], [5, 9, 1]]
    for choice in ("SEL PGM QS1\n", ""):
        assert (
            "which program is called is known only at run time"
            in fates(f"L X+1 Y+1 Z+1 FMAX\n{choice}CALL SELECTED PGM\nL Y+9 FMAX")[-1][1]
        )


def test_the_choice_of_a_table_changes_nothing_yet() -> None:
    found = fates('L X+1 Y+1 Z+1 FMAX\nSEL TABLE "TNC:\\A.D"\nL Y+9 FMAX\nCYCL DEF 7.0 D\nCYCL DEF 7.1 #3\nL X+5')
    assert [rule for rule, _ in found] == [Rule.CORRECT, Rule.CORRECT, Rule.REFUSE]


@pytest.mark.parametrize(
    ("probing", "parameter"),
    [
        ("TCH PROBE 0.0 REF. PLANE Q5 X-", "Q5"),
        ("TCH PROBE 1.0 POLAR DATUM Q5", "Q5"),
        ("TCH PROBE 3.0 MEASURING\nTCH PROBE 3.1 Q3", "Q5"),
        ("TCH PROBE 421 HOLE ~\n Q321=+5", "Q151"),
    ],
)
def test_what_a_probing_cycle_leaves_in_parameters_is_known_at_run_time(probing: str, parameter: str) -> None:
    body = f"{parameter} = 7\nL X+1 Y+1 Z+1 FMAX\n{probing}\nL X+{parameter} Y+1 Z+1 FMAX"
    assert "Q parameter that is known only at run time" in fates(body)[-1][1]


def test_a_called_program_does_not_end_by_m30() -> None:
    sub = "BEGIN PGM S MM\nL X+5 FMAX M30\nL X+7 FMAX\nEND PGM S MM\n"
    moves = follow("L X+1 Y+1 Z+1 FMAX\nCALL PGM S\nL X+9 FMAX", files={"S.h": sub}).moves
    assert "which the manuals do not allow" in moves.reasons[moves.reason[-1]]


def test_a_pocket_is_corrected_at_its_place_and_bottom_which_is_said() -> None:
    trace = follow(f"L X+1 Y+1 Z+90 FMAX\n{POCKET}\nL X+50 Y+40 FMAX M99\nL X+80 FMAX M99\nL X+5 Y+6 FMAX")
    moves = trace.moves
    assert moves.kind.tolist() == [MotionKind.RAPID, MotionKind.CYCLE, MotionKind.CYCLE, MotionKind.RAPID]
    assert moves.rule.tolist() == [Rule.CORRECT, Rule.CORRECT, Rule.REFUSE, Rule.CORRECT]
    assert moves.end[1].tolist() == [50, 40, -15]
    assert moves.end[3].tolist() == [5, 6, 55]
    assert [message.code for message in trace.messages] == ["NCF280"]


def test_bore_milling_comes_back_to_its_place_and_is_said_to_be_moved_as_a_whole() -> None:
    bore = POCKET.replace("251 POCKET", "208 BORE MILLING").replace("Q218=+60", "Q335=+25")
    trace = follow(f"L X+1 Y+1 Z+90 FMAX\n{bore}\nL X+50 Y+40 FMAX M99\nL X+80 FMAX M99")
    assert trace.moves.rule.tolist() == [Rule.CORRECT] * 3
    assert [message.code for message in trace.messages] == ["NCF280"]


@pytest.mark.parametrize(
    "frame", ["CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+30", "CYCL DEF 7.0 DATUM\nCYCL DEF 7.1 X+5"]
)
def test_where_the_tool_stands_after_a_pocket_is_not_known_in_any_frame(frame: str) -> None:
    found = fates(f"L X+1 Y+1 Z+90 FMAX\n{frame}\n{POCKET}\nL X+50 Y+40 FMAX M99\nL X+60 FMAX M99")
    assert [rule for rule, _ in found[1:]] == [Rule.CORRECT, Rule.REFUSE]
    assert "after a cycle with a path of its own is not known" in found[2][1]


def test_a_pocket_is_written_as_a_hole_is() -> None:
    lines = fixed(f"L X+1 Y+1 Z+90 FMAX\n{POCKET}\nL X+150 Y+140 FMAX M99").text.decode().splitlines()
    at = next(k for k, line in enumerate(lines) if "M99" in line)
    assert lines[at].startswith("L X+150.0")
    assert lines[at - 1].startswith("FN 1: Q203 = +Q203 + ")
    assert lines[at + 1].startswith("FN 2: Q203 = +Q203 - ")


@pytest.mark.parametrize("call", ["L X+50 Y+40 FMAX M99", "CYCL CALL POS X+50 Y+40 Z+0 FMAX"])
def test_a_cycle_begins_with_a_rapid_so_it_does_not_matter_where_from(call: str) -> None:
    drilling = POCKET.replace("251", "200")
    assert fates(f"L X+1 Y+1 Z+90 FMAX\n{drilling}\nTCH PROBE 0.0 PLANE Q5 X-\n{call}")[-1] == (Rule.CORRECT, "")


def test_the_depth_of_an_old_cycle_counts_from_a_height_that_has_to_be_known() -> None:
    drilling = "CYCL DEF 1.0 PECKING\nCYCL DEF 1.1 SET UP 2\nCYCL DEF 1.2 DEPTH -8"
    found = fates(f"L X+1 Y+1 Z+90 FMAX\n{drilling}\nTCH PROBE 0.0 PLANE Q5 X-\nL X+50 Y+40 FMAX M99")
    assert found[-1] == (Rule.REFUSE, "the position of the axis Z after a probing cycle is known only at run time")


def test_statements_that_move_nothing() -> None:
    body = 'FUNCTION FEED DWELL TIME0.5\nMONITORING HEATMAP START AS "A"\nSECTION MONITORING STOP\nL X+5 FMAX'
    moves = follow(body).moves
    assert moves.kind.tolist() == [MotionKind.RAPID]
    assert moves.rule.tolist() == [Rule.CORRECT]


@pytest.mark.parametrize(
    "line", ["WHILE Q1 < 5", "FOR Q1 = 1 TO 5", "IF Q1 < 5", "ELSE", "END WHILE", "BREAK", "CALL BLOCK"]
)
def test_lines_that_may_lead_elsewhere_and_are_not_followed_stop(line: str) -> None:
    with pytest.raises(SourceError, match="NCF236: an unknown line decides"):
        follow(f"L X+1 Y+1 Z+1 FMAX\n{line}\nL X+2")


@pytest.mark.parametrize(("shift", "rule"), [("0", Rule.CORRECT), ("5", Rule.REFUSE)])
def test_m142_deletes_transformations(shift: str, rule: Rule) -> None:
    found = fates(f"L X+1 Y+1 Z+1 FMAX\nCYCL DEF 7.0\nCYCL DEF 7.1 X+{shift}\nL M142\nL X+2 Y+2 Z+2 FMAX")
    assert found[-1][0] == rule


def test_a_pole_with_one_coordinate_and_none_before_is_not_known() -> None:
    assert ends("L X+5 Y+5 Z+0 FMAX\nCC X+1 Y+2\nCC X+0\nLP PR+5 PA+0 F100")[-1] == [5, 2, 0]
    with pytest.raises(SourceError, match="NCF271"):
        follow("L X+5 Y+5 Z+0 FMAX\nCC X+0\nLP PR+5 PA+0 F100")


def test_corrections_of_a_table_end() -> None:
    assert fates("L X+0 Y+0 Z+0 FMAX\nFUNCTION CORRDATA RESET\nL X+5 F100")[-1] == (Rule.CORRECT, "")
    begun = fates("L X+0 Y+0 Z+0 FMAX\nFUNCTION CORRDATA TCS #1\nFUNCTION CORRDATA RESET\nL X+5 F100")[-1]
    assert begun[0] == Rule.REFUSE


def test_decimal_commas_of_words_in_lower_case() -> None:
    assert axis_numbers(b"1 l x+1,5 y-2.5 z+3") == (1, 1)
