"""What must not be guessed in Klartext: each of these was once taken for something it may not be."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ncfix.control.moves import Rule
from ncfix.control.setup import Tool
from ncfix.diagnostics import SourceError
from ncfix.machine import loads
from ncfix_heidenhain.klartext.arc_text import is_relied_on
from program.klartext.test_following import reasons
from program.klartext.test_writing import lines
from program.klartext.tnc import KNOWN, ends, fixed, follow


def test_turns_are_taken_off_before_the_motion() -> None:
    moves = follow("L C+538 F100\nL C+180 M94", "XYZC").moves
    assert np.degrees(moves.end[-1, 3] - moves.start[-1, 3]) == pytest.approx(2)


def test_after_short_ways_past_a_turn_an_axis_may_count_from_elsewhere() -> None:
    body = "L C+350 F100\nM126\nL C+{}\nM127\nL C+20\nL C+30"
    assert reasons(body.format(10), "XYZC") == []
    assert "depends on a machine parameter" in reasons(body.format(370), "XYZC")[0]
    assert len(reasons(body.format(370), "XYZC")) == 1


def test_increments_in_machine_coordinates_lead_somewhere_else() -> None:
    moves = follow("L Z+50 FMAX M91\nL IZ+20 FMAX M91\nL X+5 F100\nL Z+3 FMAX").moves
    assert moves.rule.tolist() == [Rule.PASS, Rule.PASS, Rule.REFUSE, Rule.CORRECT]


@pytest.mark.parametrize("number", [204, 220, 221, 251])
def test_cycles_that_do_more_than_a_hole_at_a_position(number: int) -> None:
    body = f"CYCL DEF 200 D Q200=2 Q201=-15 Q203=+1 Q204=10\nL Z+50 FMAX\nCYCL DEF {number} C Q249=5\nL X+5 M99\nL Y+5"
    assert reasons(body)


def test_a_called_program_has_ql_parameters_of_its_own() -> None:
    sub = "BEGIN PGM SUB MM\nQL1 = 99\nQ2 = 7\nEND PGM SUB MM"
    assert ends("QL1 = 5\nCALL PGM SUB\nL X+QL1 Y+Q2 F100", files={"SUB.H": sub}) == [[5, 7, 0]]
    assert reasons("CALL PGM SUB\nL X+QL1 F100", files={"SUB.H": sub})


@pytest.mark.parametrize("line", ["TRANS DATUM SOMEHOW", "PLANE SPATIAL SPA+30 SOMEHOW", "TOOL CALL 5 Z LATER"])
def test_lines_that_are_not_understood_and_may_change_coordinates(line: str) -> None:
    assert "may change coordinates" in reasons(f"L X+1 F100\n{line}\nL X+5 Y+5 Z+5 FMAX\nL X+6")[-1]


@pytest.mark.parametrize("line", ["FUNCTION MODE TURN", "FN 17: SYSWRITE ID 10 NR1 = +5", "FN 25: PRESET = X/+10/0"])
def test_statements_that_may_change_coordinates(line: str) -> None:
    assert "may change coordinates" in reasons(f"L X+1 F100\n{line}\nL X+5 Y+5 Z+5 FMAX\nL X+6")[-1]


def test_lines_that_are_not_understood_and_may_jump() -> None:
    with pytest.raises(SourceError, match="an unknown line decides"):
        follow('L X+1 F100\nFN 9: IF Q5 IS UNDEFINED GOTO LBL "END"\nL X+5\nLBL "END"')


def test_lines_that_are_not_understood_and_set_a_parameter() -> None:
    assert reasons("Q5 = 1\nQ5 = TONUMB ( SRC_QS5 )\nL X+Q5 F100\nL X+1 FMAX") != []


def test_a_remark_between_a_line_and_its_corner_changes_nothing() -> None:
    found = lines("L X+0 Y+0 Z+0 FMAX\nL X+100 F500\n; now round\n* - section\nRND R5\n\nL Y+150\nL X+0")
    assert "Z" not in found[1]
    assert "Z" not in found[6]


def test_a_turn_in_a_plane_is_not_split() -> None:
    body = "FUNCTION TCPM F TCP AXIS POS PATHCTRL {}\nL X+1 C+30 F100\nL X+5\nFUNCTION RESET TCPM"
    assert follow(body.format("VECTOR"), "XYZC").moves.whole.tolist() == [True, False]
    assert follow(body.format("AXIS"), "XYZC").moves.whole.tolist() == [False, False]


def test_a_motion_whose_time_is_given_is_not_split() -> None:
    held = follow("L X+1 F100\nL X+5 FT2\nL X+9 FU0.1\nL X+1 FMAXT5").moves.whole.tolist()
    assert held == [False, True, False, True]


def test_increments_of_parameters_say_the_same_from_a_corrected_place() -> None:
    found = lines("L X+100 Y+100 Z+0 FMAX\nQ3 = 2.5\nL IX-Q3 IY+Q3 F100\nL X+0")
    words = found[2].split()
    assert all(abs(abs(float(word[2:])) - 2.5) < 0.001 for word in words[1:3] if "Q" not in word)


@pytest.mark.parametrize(
    ("text", "relied_on"),
    [
        ("CC X+1 Y+2\nC X+1 Y+3 DR+", False),
        ("5 C X+1 Y+1 DR+", True),
        ("CR X+5 R3 DR+\nEND PGM A MM", False),
        ("CC X+1\nLP PR+5 PA+3", True),
        ("CC\nLP PR+5 PA+3", False),
        ("CC IX+1 IY+2\n", False),
        ("FN 0: Q1 = 1\nFN 9: IF +1 EQU +1 GOTO LBL 5", True),
        ("LBL 1\nCC X+1 Y+1", False),
        ("LBL 0\n", True),
        ("CALL LBL 3\n", True),
        ("12 CYCL DEF 7.0\n CC X+Q1 Y+Q2", False),
    ],
)
def test_what_relies_on_a_pole(text: str, relied_on: bool) -> None:
    assert is_relied_on(("LP PA+3\nCR X+1 R5 DR+\n" + text).encode(), 20) == relied_on


@pytest.mark.parametrize("text", ["LBL 0\n", "CALL LBL 3\n", "FN 9: IF +1 EQU +1 GOTO LBL 5\nCT X+1\nCYCL CALL\n"])
def test_where_nothing_counts_from_a_pole_none_is_relied_on(text: str) -> None:
    assert not is_relied_on(("CR X+1 R5 DR+\n" + text).encode(), 12)
    assert is_relied_on(("CR X+1 R5 DR+\n" + text + "CALL PGM OTHER").encode(), 12)


@pytest.mark.parametrize(
    "event",
    ["L Z+250 FMAX M91", "TOOL CALL 3 Z", "CYCL DEF 247 PRESET Q339=+1", "PLANE SPATIAL SPA+0 SPB+0 SPC+0 STAY"],
)
def test_no_axis_is_named_that_the_program_leaves_where_offsets_have_put_it(event: str) -> None:
    """Were a preset or a tool length another on the machine, an added Z would lead the tool there at rapid."""
    setup = replace(KNOWN, tools={0: Tool(0.0), 3: Tool(50.0)})
    body = f"L X+100 Y+100 Z+90 FMAX\n{event}\nL X+50 Y+20 FMAX\nL Z+20 FMAX\nL X+60 F500"
    text = fixed(body, setup=setup).text.decode().splitlines()
    away, down, cut = (line for line in text[-4:-1])
    assert {word[0] for word in away.split()} == {"L", "X", "Y", "F"}
    assert {word[0] for word in down.split()} == {"L", "Z", "F"}
    assert cut.startswith("L X+60.")


def test_at_the_start_only_axes_that_are_named_are_moved() -> None:
    found = fixed("L Z+90 FMAX\nL X+50 Y+20 FMAX\nL X+60 F500", setup=replace(KNOWN, initial={}))
    assert "L Z+90 FMAX" in found.text.decode().splitlines()
    assert found.report.refused == ()


def test_an_axis_that_was_left_at_a_machine_position() -> None:
    body = "L X+100 Y+100 Z+90 FMAX\nL Z+0 FMAX M91\nL X+50 F500\nCR X+60 Y+110 R+10 DR+\nL Z+20 FMAX"
    report = fixed(body).report
    assert report.refused == ()
    assert report.passed == 1
    assert not any("Z" in line for line in lines(body) if line.startswith(("L X+50", "CR ")))
    assert "Z gets no word in 2 motions" in next(w.text for w in report.warnings if w.code == "NCF439")


def test_a_free_contour_begins_where_it_was_meant_to() -> None:
    body = "L X+100 Y+100 Z+0 FMAX\nL X+50 Y+20 Z+0 RL F500\nFC DR- R18 CLSD+ CCX+20 CCY+30\nFLT\nL X+5 Y+5 Z+0 R0 FMAX"
    report = fixed(body).report
    assert [refusal.line for refusal in report.refused] == [3, 4, 5]
    assert "FK" in report.refused[1].reason
    assert "starts from its end" in report.refused[0].reason


def test_what_a_line_that_is_not_understood_names_may_have_changed() -> None:
    assert "Q parameter" in reasons("Q1 = 5\nTABDATA READ Q1 = CORR COLUMN 3\nL X+Q1 Y+5 Z+5 FMAX")[-1]


@pytest.mark.parametrize(
    "line", ['DECLARE STRING QS2 = "X"', "GLOBAL DEF 100 GENERAL Q200=+2", "BLK FORM CYLINDER Z D9"]
)
def test_statements_that_move_nothing(line: str) -> None:
    assert reasons(f"L X+1 F100\n{line}\nL Y+5") == []


@pytest.mark.parametrize("frame", ["CYCL DEF 7.0 D\nCYCL DEF 7.1 X+3", "CYCL DEF 10.0 R\nCYCL DEF 10.1 ROT+30"])
@pytest.mark.parametrize("use", ["LP PR+10 PA+0 Z+0", "C X+0 Y+10 DR+", "CP IPA+90 DR+"])
def test_a_pole_of_another_datum(frame: str, use: str) -> None:
    body = f"L X+10 Y+0 Z+0 F100\nCC X+0 Y+0\n{frame}\nL X+10 Y+0 Z+0\n{use}"
    assert "before the datum was shifted" in reasons(body)[0]
    assert reasons(body.replace("CC X+0 Y+0\n", "").replace(use, f"CC X+0 Y+0\n{use}")) == []


@pytest.mark.parametrize(("number", "reason"), [(800, "for turning"), (331, "is of the machine builder")])
def test_cycles_that_act_where_they_are_defined(number: int, reason: str) -> None:
    assert reason in reasons(f"L X+1 F100\nCYCL DEF {number} NAME\nL X+5")[0]


def test_increments_of_more_than_half_a_turn_are_not_led_by_a_guess() -> None:
    moves = follow("L C+0 F100\nM126\nL IC+170\nL IC-300\nL C+10", "XYZC").moves
    assert moves.rule.tolist() == [Rule.CORRECT, Rule.CORRECT, Rule.REFUSE, Rule.CORRECT]


@pytest.mark.parametrize("on", ["M128", "FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS"])
def test_a_datum_of_a_rotary_axis_may_turn_the_coordinates_of_the_tip(on: str) -> None:
    body = "L X+0 Y+0 Z+9 B+0 C+0 FMAX\nTRANS DATUM AXIS C+30\nL X+1 F100\n"
    body += f"{on}\nL X+2 Y+0 Z+9\nTRANS DATUM RESET\nL X+3 Y+0 Z+9 FMAX"
    moves = follow(body, "XYZBC").moves
    assert moves.rule.tolist() == [Rule.CORRECT, Rule.CORRECT, Rule.REFUSE, Rule.CORRECT]
    assert "turn with that datum" in moves.reasons[int(moves.reason[2])]


@pytest.mark.parametrize(
    ("block", "refused"),
    [
        ("FUNCTION MODE MILL", False),
        ('FUNCTION MODE MILL "HEAD 2"', True),
        ("CYCL DEF 1032 GRINDING WHL LENGTH COMPENSATION Q1012=+1", True),
        ("CYCL DEF 238 MEASURE MACHINE STATUS Q570=+0", True),
        ("CYCL DEF 239 ASCERTAIN THE LOAD Q570=+0", False),
    ],
)
def test_what_may_change_the_machine_or_the_tool(block: str, refused: bool) -> None:
    assert bool(reasons(f"L X+0 Y+0 Z+9 FMAX\n{block}\nL X+1 F100")) is refused


def test_a_rotary_axis_that_stays_where_it_is_does_not_turn_under_a_plane() -> None:
    body = "L X+0 Y+0 Z+9 B+0 C+0 FMAX\nPLANE SPATIAL SPA+0 SPB+0 SPC+0 STAY\nL X+1 Y+1 Z+9 C+0 F100\nL X+2 C+1"
    moves = follow(body, "XYZBC").moves
    assert moves.rule.tolist() == [Rule.CORRECT, Rule.CORRECT, Rule.REFUSE]


def test_beside_a_contour_no_word_moves_the_tool_in_its_plane() -> None:
    """The least way in the plane would be offset by the radius; and after R0 the tool stands beside the contour."""
    body = "L X+0 Y+0 Z+9 R0 FMAX\nL X+100 Y+30 RL F250\nL Z-5\nL X+300\nL Z+90 R0 FMAX\nL X+20 FMAX\nL X-30 Y+0 FMAX"
    _, _, down, _, up, aside, away = lines(body)
    assert not set("XY") & set(down + up.replace("FMAX", ""))
    assert "Y" not in aside
    assert "X-" in away


def test_an_axis_that_is_led_nowhere_known_in_machine_coordinates_says_why() -> None:
    """Under M128 all of X Y Z are unknown then; of Z the program has said more than that the kinematics are."""
    body = "L X+0 Y+0 Z+50 C+30 FMAX M128\nL Z+5 FMAX M92\nL X+1 Y+1 F100"
    moves = follow(body, "XYZC").moves
    assert moves.reasons[moves.reason[-1]].startswith("the position of the axis Z after M92 depends on the M92 datum")


def test_m92_counts_from_the_zero_point_of_the_setup() -> None:
    body = "L X+0 Y+0 Z+5 C+0 FMAX\nL Z+10 C+20 FMAX M92\nL X+1 Y+1 FMAX\nL Z-1 F100"
    moves = follow(body, "XYZC", references={"M92": {"Z": 200.0, "C": -50.0}}).moves
    assert moves.end[1:3, 2:].tolist() == [[210.0, pytest.approx(np.radians(-30.0))]] * 2


def test_a_plane_that_turns_axes_from_an_unknown_place_says_why_that_is_unknown() -> None:
    body = "L X+0 Y+0 Z+5 FMAX\nL A+0 C+0 FMAX M92\nPLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN FMAX\nL X+1 Y+1 Z+0 F100"
    moves = follow(body, "XYZAC").moves
    assert moves.reasons[moves.reason[-1]].startswith("the position of the axis A after M92 depends on the M92 datum")


@pytest.mark.parametrize(
    ("travel", "sign", "sure"),
    [("[-100, 170]", "+", True), ("[-200, 200]", "-", False), ("[0, 360]", "+", False), ("[0, 360]", "-", True)],
)
def test_where_travel_leaves_one_way_a_plane_turns_axes_from_an_unknown_place(
    root: Path, travel: str, sign: str, sure: bool
) -> None:
    """A+30 C+0 or A-30 C+180; C may have two places for it, a turn apart."""
    text = (root / "examples/machines/wCAYFXZSt.toml").read_text()
    machine = loads(re.sub(r"(\[axis.C\]\n.*\n.*\n)", rf"\1range = {travel}\n", text))
    body = (
        "L X+0 Y+0 Z+5 FMAX\nL A+0 C+0 FMAX M92\nPLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN FMAX SEQ{}\nL X+1 Y+1 Z+0 F100"
    )
    assert bool(fixed(body.format(sign), machine).report.refused) is not sure


def test_a_scale_that_is_known_at_run_time_is_no_scale_of_zero() -> None:
    assert "only at run time" in reasons("CYCL DEF 11.0 S\nCYCL DEF 11.1 SCL+Q150\nL X+1 F100")[-1]
    assert "zero or negative" in reasons("CYCL DEF 11.0 S\nCYCL DEF 11.1 SCL0\nL X+1 F100")[-1]


def test_m140_beside_words_of_axes() -> None:
    found = reasons("L X+1 F100\nL X+5 M140 MB+50\nL X+6 Y+0 Z+5 FMAX\nL X+7 F100")
    assert len(found) == 1
    assert "M140" in found[0]
    assert reasons("L X+1 F100\nL M140 MB+50\nL X+6 Y+0 Z+5 FMAX\nL X+7 F100") == []


@pytest.mark.parametrize(
    ("call", "sure"), [("TOOL CALL S500", False), ("TOOL CALL F500 DR+0.1", False), ("TOOL CALL DL+2", True)]
)
def test_an_oversize_may_end_where_no_tool_is_named(call: str, sure: bool) -> None:
    found = reasons(f"TOOL CALL 5 Z DL+1\nL X+1 Y+0 Z+5 FMAX\n{call}\nL X+5 F100\nTOOL CALL 5 Z\nL X+6 Y+0 Z+5 FMAX")
    assert ["DL" in why for why in found] == ([] if sure else [True])
    assert reasons("TOOL CALL 5 Z\nL X+1 Y+0 Z+5 FMAX\nTOOL CALL S500\nL X+5 F100") == []


def test_a_block_behind_a_formula_with_a_remark_is_not_passed_over() -> None:
    assert "this line is unknown" in reasons("Q1 = 4 + 5 ; note ~\nL X+1 F100\nL X+2 Y+2 Z+2 FMAX")[0]
    assert reasons("Q1 = 4 + 5 ; note ~\n goes on\nL X+2 Y+2 Z+2 FMAX") == []
    with pytest.raises(SourceError, match="an unknown line decides"):
        follow("L X+1 F100\n; note ~\nCALL LBL 1\nL X+2")


def test_a_pole_in_machine_coordinates_is_not_followed() -> None:
    with pytest.raises(SourceError, match="no pole"):
        follow("CC X+10 Y+0 M91\nC X+20 Y+0 DR+ F100")


@pytest.mark.parametrize("depth", ["+0", "-0"])
def test_a_cycle_without_depth_is_not_executed(depth: str) -> None:
    cycle = f"CYCL DEF 200 D Q200=2 Q201={depth} Q203=+1 Q204=10"
    found = reasons(f"{cycle}\nL X+5 Y+0 Z+50 FMAX M99\nL X+6 FMAX\nL X+7 F100\nL Z+60 FMAX\nL X+8 F100")
    assert "depth of the cycle is zero" in found[0]
    assert all("hole of unknown depth" in why for why in found[1:])
