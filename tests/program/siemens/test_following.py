"""Where SINUMERIK programs lead, worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate.following import kinematics_of
from ncfix.control.moves import MotionKind, Rule, TcpState
from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import SourceError, UsageError
from ncfix.machine.file import load
from program.siemens.following import KNOWN, ZERO, follow
from program.tracing import ends, last, reasons


def xs(text: str, **given: object) -> list[float]:
    """X of the ends of the motions."""
    return [row[0] for row in ends(follow(text, **given))]  # type: ignore[arg-type]


# -- words ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "end"),
    [
        ("G0X10Y-20.5Z.5", [10, -20.5, 0.5]),
        ("G0 X=10 Y=-20.5", [10, -20.5, 0]),
        ("G0 X10\nX=IC(5) Y=IC(-2)", [15, -2, 0]),
        ("G91 G0 X10\nX5 Y=AC(3)", [15, 3, 0]),
        ("R1=3 R2=R1*2\nG0 X=R1+R2 Y=POT(R1) Z=SQRT(16)", [9, 9, 4]),
        ("DEF REAL DEEP=-2, WIDE\nG0 Z=DEEP X=WIDE Y=SIN(30)", [0, 0.5, -2]),
        ("DEF INT NUM\nNUM=2.5\nG0 X=NUM", [3, 0, 0]),
        ("R[1+1]=7\nG0 X=R2 Y=R[2]", [7, 7, 0]),
        ("G700 G0 X1", [25.4, 0, 0]),
        ("G70 G0 X1\nG71 X2", [2, 0, 0]),
        ("DIAMON\nG0 X10", [5, 0, 0]),
        ("G0 X10 ; X99\n;X98", [10, 0, 0]),
    ],
)
def test_words(text: str, end: list[float]) -> None:
    assert last(follow(text)) == pytest.approx(end)


@pytest.mark.parametrize(("value", "end"), [(1, 10), (2, 5), (3, 5)])
def test_machine_data_say_whether_x_is_a_diameter_at_the_start(value: float, end: float) -> None:
    given = {"$MC_GCODE_RESET_VALUES[28]": value}
    found = follow("G96 S100 M4\nG0 X10\nDIAMOF\nX10", variables=given)
    assert [row[0] for row in ends(found)] == [end, 10]
    assert reasons(found) == ["", ""]


@pytest.mark.parametrize(
    ("word", "angle"), [("DC(350)", -10), ("DC(10)", 10), ("ACP(350)", 350), ("ACN(10)", -350), ("IC(30)", 30)]
)
def test_rotary_axes_turn_as_they_are_told(word: str, angle: float) -> None:
    assert last(follow(f"G0 C={word}", "XYZC"))[3] == pytest.approx(angle)


def test_after_a_full_turn_angles_count_from_zero() -> None:
    moves = follow("G0 C=DC(350)\nG0 C10", "XYZC").moves
    assert math.degrees(moves.start[1, 3]) == pytest.approx(350)
    assert math.degrees(moves.end[1, 3]) == pytest.approx(10)


# -- control structures -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("R1=1\nIF R1==1\nG0 X1\nELSE\nG0 X2\nENDIF", [1]),
        ("R1=2\nIF R1==1\nG0 X1\nELSE\nG0 X2\nENDIF\nG0 X3", [2, 3]),
        ("R1=3\nWHILE R1>0\nG0 X=R1\nR1=R1-1\nENDWHILE", [3, 2, 1]),
        ("FOR R1=1 TO 3\nG0 X=R1\nENDFOR\nG0 X9", [1, 2, 3, 9]),
        ("R1=0\nREPEAT\nR1=R1+1\nG0 X=R1\nUNTIL R1>=2", [1, 2]),
        ("R1=0\nLOOP\nR1=R1+1\nIF R1==3 GOTOF OUT\nG0 X=R1\nENDLOOP\nOUT: G0 X9", [1, 2, 9]),
        ("GOTOF N30\nN20 G0 X2\nN30 G0 X3", [3]),
        ("R1=2\nCASE R1 OF 1 GOTOF AA 2 GOTOF BB DEFAULT GOTOF CC\nAA: G0 X1\nBB: G0 X2\nCC: G0 X3", [2, 3]),
        ("MARK: G91 G0 X1\nREPEATB MARK P=2\nG0 X10", [1, 2, 3, 13]),
        ("G91\nAA: G0 X1\nBB: X2\nREPEAT AA BB P=2", [1, 3, 4, 6, 7, 9]),
    ],
)
def test_control_structures(text: str, found: list[float]) -> None:
    assert xs(text) == pytest.approx(found)


def test_subprograms_take_arguments_and_give_results() -> None:
    files = {"SUB1": "PROC SUB1(REAL WIDE, VAR REAL BACK)\nG0 X=WIDE\nBACK=WIDE*2\nM17\n"}
    followed = follow("DEF REAL MINE\nSUB1(5,MINE)\nG0 X=MINE", files=files)
    assert [row[0] for row in ends(followed)] == [5, 10]
    assert followed.moves.rule.tolist() == [Rule.REFUSE, Rule.CORRECT]


def test_subprograms_may_follow_in_the_text() -> None:
    text = "%_N_A_MPF\nSUB1(7)\nL5 P2\nM30\n%_N_SUB1_SPF\nPROC SUB1(REAL WIDE)\nG0 X=WIDE\nRET\n"
    followed = follow(text + "%_N_L5_SPF\nG91 G0 X1\nM17\n")
    assert [row[0] for row in ends(followed)] == [7, 8, 9]
    assert (followed.moves.rule == Rule.CORRECT).all()


def test_save_brings_modal_codes_back() -> None:
    files = {"SUB1": "PROC SUB1 SAVE\nG91\nM17", "SUB2": "PROC SUB2\nG91\nM17"}
    assert xs("G0 X5\nSUB1\nG0 X1", files=files)[-1] == 1
    assert xs("G0 X5\nSUB2\nG0 X1", files=files)[-1] == 6


@pytest.mark.parametrize(
    ("inside", "before", "after", "end"),
    [
        ("G18 G0 X1", "G1", "X1 Y2 Z3", [1, 2, 103]),
        ("G0 X1", "G1", "X1 Y2 Z3", [1, 2, 103]),
        ("G700 G91", "G1", "X1 Y2 Z3", [1, 2, 103]),
        ("G18 G1 X1", "G2", "X8 Y4 I3.5 J0", [8, 4, 103]),
    ],
)
def test_save_brings_back_plane_unit_and_motion(inside: str, before: str, after: str, end: list[float]) -> None:
    text = f"G17 G90 G710 T1 D1 F100\nG0 X4 Y4 Z3\n{before} X4 Y4 I4\nSUB1\n{after}"
    text = text if before == "G2" else text.replace(" I4", "")
    given = {"tools": {1: Tool(length=100.0)}, "variables": {"$SC_TOOL_LENGTH_CONST": 0}}
    found = follow(f"{text}\nM30\n%_N_SUB1_SPF\nPROC SUB1 SAVE\n{inside}\nM17", **given)
    assert found.moves.end[-1].tolist() == pytest.approx(end)
    assert found.moves.kind[-1] == {"G1": MotionKind.FEED, "G2": MotionKind.ARC}[before]


@pytest.mark.parametrize("end", ["PROC SUB1 SAVE\nG41 G1 X9 F100\nX19", "PROC SUB1\nG41 G1 X9 F100\nX19\nG40 G90 G0"])
def test_save_ends_the_contour_of_a_subprogram(end: str) -> None:
    found = follow(f"G0 X1 Y1 Z1\nSUB1\nG0 Z5\nM30\n%_N_SUB1_SPF\n{end}\nM17")
    assert found.moves.placed is not None
    assert found.moves.placed[-1].tolist() == [False, False, True]  # X and Y stand beside the contour


def test_the_feed_of_another_kind_does_not_outlast_save() -> None:
    found = follow("G94 G1 X1 Y1 Z1 F100\nSUB1\nX2\nM30\n%_N_SUB1_SPF\nPROC SUB1 SAVE\nG95 X9 F0.2\nM17")
    assert found.moves.feed.tolist() == pytest.approx([100, 0.2, math.nan], nan_ok=True)


def test_tapping_with_g63_lasts_for_its_block() -> None:
    found = follow("G0 X1 Y1 Z1\nG63 Z-5 F100\nG63 Z1\nX2\nG1 G63 Z-5\nZ1")
    refused = [Rule.REFUSE if line in (1, 2, 4) else Rule.CORRECT for line in range(6)]
    assert found.moves.rule.tolist() == refused
    assert found.moves.kind[[3, 5]].tolist() == [MotionKind.RAPID, MotionKind.FEED]


# -- what is known only at run time -----------------------------------------------------------------------------------


def test_a_branch_decided_at_run_time_refuses_what_may_be_executed() -> None:
    text = "G0 X0\nAGAIN: G0 X1\nG0 X2\nIF NOBODY_KNOWS==1 GOTOF OUT\nG0 X3\nGOTOB AGAIN\nOUT: G0 X4"
    moves = follow(text).moves
    refused = {int(block) for block in moves.block[moves.rule == Rule.REFUSE]}
    assert refused == {1, 2, 4, 6}


def test_a_variable_that_nobody_knows_makes_its_motions_refused() -> None:
    followed = follow("G0 X=$AA_IW[X] Y1\nG0 X5")
    assert followed.moves.rule.tolist() == [Rule.REFUSE, Rule.CORRECT]
    assert "known only at run time" in reasons(followed)[0]


@pytest.mark.parametrize(
    "branch",
    [
        'IF NOBODY_KNOWS==1\nMSG("x")\nR5=1\nELSE\nR5=2\nENDIF',
        "IF NOBODY_KNOWS==1 GOTOF DOWN\nR5=1\nDOWN: R6=1",
        "IF NOBODY_KNOWS==1\nIF R1==2\nR5=1\nENDIF\nM8\nENDIF",
    ],
)
def test_a_branch_without_motions_needs_no_decision(branch: str) -> None:
    followed = follow(f"R5=0\nG0 X1\n{branch}\nG0 X2\nG0 X=R5")
    assert followed.moves.rule.tolist() == [Rule.CORRECT, Rule.CORRECT, Rule.REFUSE]


def test_the_tool_in_the_spindle_at_the_start_has_its_length() -> None:
    setup = Setup(work_offsets=KNOWN.work_offsets, tools={0: Tool(50.0)}, initial=ZERO)
    assert last(follow("G0 Z1", setup=setup))[2] == 51
    assert last(follow("D0\nG0 Z1", setup=setup))[2] == 1
    with pytest.raises(UsageError, match="tool that is in the spindle at the start"):
        follow("G0 Z1", setup=Setup(work_offsets=KNOWN.work_offsets, initial=ZERO))


def test_comparisons_without_brackets_are_not_guessed() -> None:
    followed = follow("R1=1\nIF R1==1 AND R2==2\nG0 X1\nENDIF\nG0 X2")
    assert (followed.moves.rule == Rule.REFUSE).all()


def test_a_block_that_nobody_understands_refuses_what_follows() -> None:
    followed = follow('G71 G0 X1\nCGTECH_MACRO "x" 5\nG0 X2')
    assert followed.moves.rule.tolist() == [Rule.CORRECT, Rule.REFUSE]
    assert [message.code for message in followed.messages] == ["NCF250"]


def test_a_cycle_that_nobody_knows_leaves_axes_anywhere() -> None:
    followed = follow("G71 G0 X1 Y1 Z1\nHEAD_CLEAN\nG0 X2\nG0 Y2 Z2\nG1 X3 F100")
    assert followed.moves.rule.tolist() == [Rule.CORRECT, Rule.PASS, Rule.CORRECT, Rule.CORRECT]
    assert [message.code for message in followed.messages] == ["NCF252"]


def test_a_rapid_passes_behind_such_a_cycle_only_where_the_program_says_that_it_is_one() -> None:
    followed = follow("G0 X1 Y1 Z1\nHEAD_CLEAN\nX2\nG0 X3")
    assert followed.moves.rule.tolist() == [Rule.CORRECT, Rule.REFUSE, Rule.PASS]


# -- arcs -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "centre", "sweep", "end"),
    [
        ("G2 X10 Y0 I5 J0", (5, 0, 0), -180, (10, 0)),
        ("G3 X10 Y0 I=AC(5) J=AC(0)", (5, 0, 0), 180, (10, 0)),
        ("G2 X10 Y0 CR=5", (5, 0, 0), -180, (10, 0)),
        ("G3 X10 Y0 CR=-10", (5, -8.660254, 0), 300, (10, 0)),
        ("G3 I5 J0", (5, 0, 0), 360, (0, 0)),
        ("G3 I5 J0 TURN=2", (5, 0, 0), 1080, (0, 0)),
        ("G3 X10 AR=90", (5, 5, 0), 90, (10, 0)),
        ("G3 I0 J5 AR=90", (0, 5, 0), 90, (5, 5)),
        ("CIP X10 Y0 I1=5 J1=5", (5, 0, 0), 180, (10, 0)),
        ("CIP X10 Y0 I1=5 J1=-5", (5, 0, 0), 180, (10, 0)),
    ],
)
def test_arcs(text: str, centre: tuple[float, ...], sweep: float, end: tuple[float, ...]) -> None:
    moves = follow("F100\n" + text).moves
    assert moves.rule.tolist() == [Rule.CORRECT]
    assert moves.centre[0] == pytest.approx(centre, abs=1e-6)
    assert math.degrees(moves.sweep[0]) == pytest.approx(sweep)
    assert moves.end[0, :2] == pytest.approx(end, abs=1e-9)


@pytest.mark.parametrize("text", ["G2 X10 Y0 I4 J0", "G2 X10 Y0", "G2 X10 CR=4", "CIP X10 I1=5", "G3 X5 AR=400"])
def test_impossible_arcs_are_errors(text: str) -> None:
    with pytest.raises(SourceError) as caught:
        follow("F100\n" + text)
    assert caught.value.messages[0].code == "NCF220"


def test_in_a_mirrored_frame_arcs_run_the_other_way() -> None:
    moves = follow("MIRROR X0\nG3 X10 Y0 CR=5 F100").moves
    turn = moves.sweep[0] * moves.normal[0, 2]
    assert moves.end[0, 0] == pytest.approx(-10)
    assert turn == pytest.approx(-math.pi)


# -- frames -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "end"),
    [
        ("TRANS X10\nG0 X1", [11, 0]),
        ("TRANS X10\nATRANS X5 Y1\nG0 X1 Y1", [16, 2]),
        ("TRANS X10\nTRANS Y5\nG0 X1 Y1", [1, 6]),
        ("TRANS X10\nTRANS\nG0 X1", [1, 0]),
        ("ROT RPL=90\nG0 X1 Y0", [0, 1]),
        ("ROT Z90\nG0 X1 Y0", [0, 1]),
        ("TRANS X10\nAROT RPL=90\nG0 X1 Y0", [10, 1]),
        ("ROT RPL=90\nATRANS X10\nG0 X1 Y0", [0, 11]),
        ("SCALE X2 Y2 Z2\nG0 X1 Y1", [2, 2]),
        ("MIRROR X0\nG0 X1 Y1", [-1, 1]),
        ("G54 G0 X1 Y1", [101, 1]),
        ("G54\nTRANS X10\nG0 X1 Y1", [111, 1]),
        ("G505 G0 X1", [1, 0]),
        ("G54\nG500 G0 X1 Y0", [1, 0]),
        ("G54 G0 SUPA X1 Y0", [1, 0]),
        ("G54\nG53 G0 X1 Y0", [1, 0]),
        ("G54\nG153 G0 X1 Y0", [1, 0]),
        ("G111 X5 Y5\nG0 AP=90 RP=2", [5, 7]),
        ("G0 X5 Y5\nG110 X0 Y0\nG0 AP=0 RP=2", [7, 5]),
    ],
)
def test_frames(text: str, end: list[float]) -> None:
    offsets = {**KNOWN.work_offsets, "G54": {**ZERO, "X": 100.0}}
    assert last(follow(text, work_offsets=offsets))[:2] == pytest.approx(end)


def test_a_scale_that_differs_from_axis_to_axis_is_refused() -> None:
    followed = follow("SCALE X2\nG0 X1\nSCALE\nG0 X1 Y1 Z1")
    assert followed.moves.rule.tolist() == [Rule.REFUSE, Rule.CORRECT]


@pytest.mark.parametrize(("tool_off", "end"), [(None, None), (0.0, 100), (1.0, 0), (2.0, None)])
def test_machine_data_say_whether_the_tool_length_stays_on_in_machine_coordinates(
    tool_off: float | None, end: float | None
) -> None:
    given = {} if tool_off is None else {"$MN_G53_TOOLCORR": tool_off}
    setup = Setup(work_offsets=KNOWN.work_offsets, tools={5: Tool(100.0)}, initial=ZERO, variables=given)
    followed = follow("T5 M6\nG54 G0 Z0\nSUPA Z0\nSUPA X1 Y1\nG1 F9 X2\nZ0\nD0\nSUPA Z0\nG1 X3", setup=setup)
    heights = [100, end, end, end, 100, 0, 0]
    assert [row[2] for row in ends(followed)] == pytest.approx(
        [math.nan if z is None else z for z in heights], nan_ok=True
    )
    cut = Rule.CORRECT if end is not None else Rule.REFUSE
    assert followed.moves.rule.tolist() == [Rule.CORRECT, Rule.PASS, Rule.PASS, cut, cut, Rule.PASS, Rule.CORRECT]
    assert all("$MN_G53_TOOLCORR" in why for why in reasons(followed)[3:5] if why)


@pytest.mark.parametrize("name", ["angle_head", "wCAYFXZSt"])
@pytest.mark.parametrize(("tilt", "words"), [(0, "X5 Y6"), (30, "X5 Y6 Z7"), (30, "Z7"), (30, "A0"), (30, "Z7 D0")])
def test_machine_coordinates_mean_the_tip_of_the_tool_or_of_one_without_length(
    name: str, tilt: float, words: str
) -> None:
    machine = load(f"examples/machines/{name}.toml")
    axes, kinematics = "".join(machine.axis_names), kinematics_of(machine)
    text = f"T1 D1\nTRAORI\nG0 X10 Y20 Z30 A{tilt} C0\nSUPA {words}"

    def end(**given: float) -> np.ndarray:
        setup = replace(KNOWN, tools={1: Tool(100.0)}, variables={"$MN_G53_TOOLCORR": given["tool_off"]})
        return follow(text, axes, setup, kinematics=kinematics).moves.end[-1]

    tip, without = end(tool_off=0.0), end(tool_off=1.0)
    length = 0.0 if "D0" in words else 100.0
    reference = kinematics(without.tolist(), TcpState(True, length), TcpState(True, 0.0))
    for word in words.split():
        if word[0] in "XYZ":
            column = axes.index(word[0])
            assert [tip[column], reference[column]] == pytest.approx([float(word[1:])] * 2)
    alike = np.isclose(tip, without)
    assert alike.all() == (tilt == 0 or "D0" in words)
    assert (alike == ~np.isnan(end(tool_off=2.0))).all()


def test_an_arc_that_goes_on_from_an_unknown_place_is_refused_for_that() -> None:
    words = reasons(follow("G74 Z0\nG0 X0 Y0\nG1 X9 F99\nCT X12 Y5\nG1 Z0\nCT X20"))
    assert ["the axis Z after a reference" in why for why in words] == [False, True, True, True, True, False]
    assert "the direction at the end" in words[-1]


def test_what_a_line_by_its_angle_leaves_out_is_not_known() -> None:
    followed = follow("G54 G0 X0 Y0 Z0\nG1 ANG=30 X40 F100\nX50\nX60 Y5\nX70")
    assert followed.moves.rule.tolist() == [Rule.CORRECT, Rule.REFUSE, Rule.REFUSE, Rule.REFUSE, Rule.CORRECT]


def test_a_name_of_digits_is_a_number_where_no_tool_has_that_name() -> None:
    followed = follow('T="5" M6\nG54 G0 X1 Y1 Z1', tools={5: Tool(80.0)})
    assert ends(followed) == [[1, 1, 81]]


def test_what_is_not_given_is_asked_for() -> None:
    with pytest.raises(UsageError) as caught:
        follow('T="DRILL 8.5" M6\nG54 G0 X1 Y1 Z1', setup=Setup(initial=ZERO))
    texts = [message.text for message in caught.value.messages]
    assert texts == ["length of tool DRILL 8.5 is used but not given", "work offset G54 is used but not given"]


def test_a_frame_over_a_transformation_is_refused() -> None:
    text = "TRANS X1\nTRAORI\nG0 X1 Y1 Z1"
    assert "was in force at TRAORI" in reasons(follow(text))[0]
    assert not any(reasons(follow(f"{text}\nTRANS X1\nG0 X1 Y1 Z1"))[1:])
    assert not any(reasons(follow(text, variables={"$MN_FRAME_GEOAX_CHANGE_MODE": 1.0})))
    assert not any(reasons(follow("G54\nTRAORI\nTRANS X1\nG0 X1 Y1 Z1\nTRANS\nTRAFOOF")))


def test_a_work_offset_over_a_transformation_is_said() -> None:
    offsets = {"G54": ZERO | {"X": 5.0}, "G500": ZERO}
    for text, count in (("G54\nTRAORI", 1), ("TRAORI\nG54", 0), ("TRAORI\nTRAFOOF\nG54", 0), ("G500\nTRAORI", 0)):
        codes = [message.code for message in follow(f"{text}\nG0 X1 Y1 Z1\nX2", work_offsets=offsets).messages]
        assert codes.count("NCF255") == count


@pytest.mark.parametrize(("text", "count"), [("SUPA G0 Z9", 0), ("SUPA G0 Z9\nG0 X1 Y1 Z1", 1)])
def test_machine_coordinates_do_not_ask_for_the_work_offset(text: str, count: int) -> None:
    """SUPA leaves all frames out; the first motion that does not is where it matters."""
    messages = follow(f"G54\nTRAORI\nTRAFOOF\n{text}", work_offsets={"G54": ZERO | {"X": 5.0}}).messages
    assert [message.code for message in messages].count("NCF255") == count


def test_a_modal_cycle_drills_behind_machine_positions_too() -> None:
    """The position passes; the hole is at a place that is not corrected, and is refused."""
    text = "G0 Z9\nMCALL CYCLE81(5,0,1,-2)\nSUPA G0 X3\nMCALL\nG0 X4"
    assert xs(text) == pytest.approx([0, 3, 3, 4])
    moves = follow(text).moves
    assert moves.rule.tolist() == [Rule.CORRECT, Rule.PASS, Rule.REFUSE, Rule.CORRECT]
    assert moves.end[2, 2] == pytest.approx(-2)
    assert moves.end[3, 2] == pytest.approx(5)


def test_an_axis_that_the_machine_lacks_is_named() -> None:
    with pytest.raises(UsageError, match="axis C1"):
        follow("G0 X1 C1=DC(5)")


@pytest.mark.parametrize(("metric", "basic"), [(None, 1.0), (1.0, 1.0), (0.0, 25.4)])
def test_lengths_by_g70_leave_feeds_in_the_unit_of_the_machine(metric: float | None, basic: float) -> None:
    given = {} if metric is None else {"$MN_SCALING_SYSTEM_IS_METRIC": metric}
    text = "G71 G1 X1 F100\nG70 X1\nG71 X2\nG700 F20 X1\nG70 X2\nF30 X3\nG710 F400 X1"
    feeds = follow(text, variables=given).moves.feed.tolist()
    kept = 20 * 25.4 if basic != 1.0 else math.nan
    expected = [100 * basic, 100 * basic, 100 * basic, 20 * 25.4, kept, 30 * basic, 400]
    assert feeds == pytest.approx(expected, nan_ok=True)


def test_dwells_take_f_as_their_time() -> None:
    moves = follow("G1 X1 F100\nG4 F3\nX2").moves
    assert moves.feed[-1] == pytest.approx(100)


def test_plain_blocks_go_through_the_fast_lane_with_the_same_result() -> None:
    body = "".join(f"N{10 * i} G1 X{i * 0.5:.3f} Y{i * i * 0.01:.3f} F{1000 + i}\n" for i in range(60))
    fast = follow("G54\n" + body).moves
    slow = follow("G54\n" + body.replace(" F", " R1=1 F")).moves
    assert np.array_equal(fast.end, slow.end)
    assert np.array_equal(fast.feed, slow.feed)
    assert np.array_equal(fast.programmed, slow.programmed)


def test_ct_goes_on_from_the_last_of_many_motions_that_went_at_once() -> None:
    plain = "".join(f"X{n} Y{n % 3}\n" for n in range(400))
    turn = 2 * math.atan2(1 * 50 + 2 * 101, 1 * 101 - 2 * 50)
    found = follow(f"G0 X-5 Y0\nG1 F100\n{plain}SUB1\n", files={"SUB1": "CT X500 Y50\nM17\n"}).moves
    assert found.sweep[-1] == pytest.approx(turn)
    for between in ("", "F200\n", "A3\n" * 30, "X399 Y0\n" * 20):
        known = follow(f"G0 X-5 Y0 A3\nG1 F100\n{plain}{between}CT X500 Y50\n", axes="XYZA").moves
        assert known.sweep[-1] == pytest.approx(turn)
    lost = follow(
        f"G0 X-5 Y0\nG1 F100\n{plain}{''.join(f'A{n}' + chr(10) for n in range(40))}CT X500 Y50\n", axes="XYZA"
    )
    assert "direction" in lost.moves.reasons[lost.moves.reason[-1]]


@pytest.mark.parametrize("change", ["T2\nM6", "T2 M=6", "T1=2\nM06", "T=2 M=06 ;M6"])
def test_ways_to_change_the_tool(change: str) -> None:
    setup = replace(KNOWN, tools={1: Tool(10.0, 1.0), 2: Tool(25.0, 1.0)})
    heights = follow(f"G54 T1 M=6\nG0 Z0\n{change}\nG0 Z0 T1\nZ1", setup=setup).moves.end[:, 2]
    assert heights.tolist() == [10.0, 25.0, 26.0]


def test_a_program_named_by_a_text_is_executed_as_often_as_it_says() -> None:
    followed = follow(
        'CALL "/_N_WKS_DIR/_N_SUB_SPF" P2\nEXTCALL("SUB.SPF")\nX1', files={"SUB": "G91 G0 X2\nG90\nM17\n"}
    )
    assert followed.moves.end[:, 0].tolist() == [2.0, 4.0, 6.0, 1.0]


@pytest.mark.parametrize(
    ("value", "meant"),
    [
        ('STRLEN("ABC")', 3.0),
        ('INDEX("MILL_10","_")', 4.0),
        ('RINDEX("A.B.C",".")', 3.0),
        ('MATCH("MILL_10","10")', 5.0),
        ('NUMBER(SUBSTR("MILL_10",5,2))', 10.0),
        ('ISNUMBER("X")', 0.0),
        ('STRLEN(TOUPPER("ab")<<TOLOWER("CD"))', 4.0),
        ("ROW[1,0]", 3.0),
        ("ROW[0,1]", 9.0),
        ("ALL[2]", 7.0),
        ("FEW[2]", 0.0),
    ],
)
def test_texts_and_arrays(value: str, meant: float) -> None:
    arrays = "DEF REAL ROW[2,2]=(1,2,3,4)\nROW[0,1]=9\nDEF INT ALL[3]=REP(7)\nDEF REAL FEW[4]\nFEW[0]=REP(5,2)\n"
    assert follow(f"{arrays}G0 X={value}").moves.end[0, 0] == meant


# -- tools ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("call", ["T1\nL6", "T1 L6", "T1\nG0 SUPA Z300\nL6"])
def test_a_number_that_is_not_at_hand_may_be_what_changes_the_tool(call: str) -> None:
    """Then a T that follows may only make the next tool ready, and which length counts is not certain."""
    followed = follow(f"{call}\nD1\nG0 X0 Y0 Z50\nG1 X5 F100\nT2\nX9\nG0 SUPA Z300\nL6\nD1\nG0 X0 Y0 Z50\nX1")
    known = [(rule, row[0]) for rule, row in zip(followed.moves.rule, ends(followed), strict=True) if rule != Rule.PASS]
    assert known == [(Rule.CORRECT, x) for x in (0, 5)] + [(Rule.REFUSE, 9)] + [(Rule.CORRECT, x) for x in (0, 1)]
    assert any("T alone" in reason for reason in reasons(followed))


def test_a_number_that_is_not_at_hand_is_called_after_its_block() -> None:
    followed = follow("T1 D1\nG0 X0 Y0 Z50\nX5 Y5 Z5 L900\nG1 X6 F100")
    assert followed.moves.rule.tolist() == [Rule.CORRECT, Rule.CORRECT, Rule.REFUSE]


# -- what is not at hand ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "block",
    [
        "MYPROBE(R1)",
        "MYPROBE(1,LIST)",
        "MYPROBE(,,GAP)",
        "OK=CALCDAT(LIST,3,GAP)",
        "IF MEASURE(R1)==5\nENDIF",
        "IF $A_IN[1]\nR2=MEASURE(GAP)\nENDIF",
        'READ(ERR,"/_N_X",1,1,GAP)',
        "GETSELT(R1)",
        "R2=INTERSEC(LIST,1,GAP)",
    ],
)
def test_variables_that_something_else_may_set_are_not_known_behind_it(block: str) -> None:
    text = f"DEF REAL LIST[3]\nDEF REAL GAP\nR1=5\n{block}\nG0 X1 Y1 Z1\nG1 F100 X=R1 Y=GAP Z=LIST[0]"
    found = follow(text).moves
    assert found.rule[-1] == Rule.REFUSE


def test_variables_that_are_handed_over_by_value_stay_known() -> None:
    found = follow('R1=5 R2=6\nMSG("AT "<<R1)\nWRITE(R3,"F",R1)\nSETAL(R1)\nMYPROBE(R1+1,2*R2)\nG0 X=R1 Y=R2 Z1')
    assert ends(found) == [[5, 6, 1]]


@pytest.mark.parametrize(
    "block",
    [
        "SETTCOR(LIST,3,0,0,1)",
        'R1=ADDFRAME(TURN,"$P_PFRAME")',
        'CUTMODK="HEAD"',
        'TCA("DRILL",1)',
        "E_HEAD(54,1)",
        "AXCTSWE(CT1)",
        "DEFINE MILL AS G1 X5",
    ],
)
def test_statements_that_change_coordinates_or_tools_in_ways_that_are_not_followed(block: str) -> None:
    found = follow(f"{block}\nG54 G0 X1 Y1 Z1\nG1 X5 F100").moves
    assert set(found.rule.tolist()) == {Rule.REFUSE}


@pytest.mark.parametrize("names", ["G1 CSPLINE", "G0 POLY", "G33 G1", "CT G2", "BSPLINE CIP"])
def test_two_motions_in_one_block_exclude_one_another(names: str) -> None:
    with pytest.raises(SourceError, match="exclude one another"):
        follow(f"G0 X0 Y0 Z0\n{names} X5 F100")


def test_rapids_with_another_length_in_a_swivelled_plane_may_name_its_axes_one_after_another(root: Path) -> None:
    machine = load(root / "examples" / "machines" / "wCAYFXZSt.toml")
    text = 'T1 M6 D1\nSUPA G0 Z0 D0\nCYCLE800(1,"TABLE",200000,57,0,0,0,-30,0,0,0,0,0,-1)\nG0 X0 Y0 D1\nZ20\nG1 X5 F100'
    setup = replace(KNOWN, tools={1: Tool(50.0)})
    moves = follow(text, "".join(machine.axis_names), setup, kinematics=kinematics_of(machine)).moves
    assert moves.rule.tolist()[2:] == [Rule.PASS, Rule.CORRECT, Rule.CORRECT]


@pytest.mark.parametrize(
    ("parameters", "arguments", "x"),
    [
        ("REAL FAR=7", "", 7),
        ("REAL FAR=7", "2", 2),
        ("REAL FAR", "", 0),
        ("INT FAR", "2.6", 3),
        ("BOOL FAR", "5", 1),
        ("REAL WIDE=1.5EX1, REAL FAR=WIDE", "", math.nan),
    ],
)
def test_parameters_that_a_call_leaves_out_have_the_value_of_their_procedure(
    parameters: str, arguments: str, x: float
) -> None:
    text = f"SUB1({arguments})\nM30\n%_N_SUB1_SPF\nPROC SUB1({parameters})\nG0 X=FAR Y1 Z1\nM17\n"
    assert last(follow(text))[0] == pytest.approx(x, nan_ok=True)


def test_an_array_is_handed_over_with_its_elements_and_comes_back_changed() -> None:
    head = (
        "DEF REAL LIST[2]=(2,3)\nSUB1(LIST)\nG0 X=LIST[0] Y=LIST[1] Z1\nM30\n%_N_SUB1_SPF\nPROC SUB1(VAR REAL ROW[2])\n"
    )
    assert last(follow(head + "ROW[0]=ROW[0]*ROW[1]\nM17\n")) == [6, 3, 1]
    known = follow(head + "ROW[R99]=5\nM17\n")
    assert known.moves.rule.tolist() == [Rule.REFUSE]
    assert last(follow("SUB1(_LIST)\nM30\n%_N_SUB1_SPF\nPROC SUB1(VAR REAL ROW[])\nG0 X=ROW[1] Y1 Z1\nM17\n"))[0] != 0


@pytest.mark.parametrize(
    ("jump", "places"),
    [
        ('R1=2\nGOTOF "MARK"<<R1', [2]),
        ('GOTOF "MARK"<<1', [1, 2]),
        ('DEF STRING[9] WHERE="MARK2"\nGOTOF WHERE', [2]),
        ('DEF STRING[9] WHERE="MARK"\nGOTOF WHERE<<(1+1)', [2]),
        ("IF R1==R1 GOTOF MARK2", [math.nan, math.nan]),
        ('GOTOF "MARK"<<$AC_TIME', [math.nan, math.nan]),
    ],
)
def test_labels_may_be_put_together(jump: str, places: list[float]) -> None:
    assert xs(f"{jump}\nMARK1: G0 X1 Y1 Z1\nMARK2: G0 X2") == pytest.approx(places, nan_ok=True)


def test_a_label_that_nobody_has_is_named_as_it_was_put_together() -> None:
    with pytest.raises(SourceError, match="there is no label MARK7 further down"):
        follow('GOTOF "MARK"<<7\nG0 X5')


@pytest.mark.parametrize("words", ["A3=0 B3=0 C3=1 A10", "A2=5 B2=3 C10", "A3=0.1 C3=1 A2=3", "C=IC(5) B3=0.1 C3=1"])
def test_a_direction_of_the_tool_that_is_given_in_two_ways(words: str, root: Path) -> None:
    machine = load(root / "examples" / "machines" / "wCAYFXZSt.toml")
    text = f"TRAORI G54 ORIEULER\nG0 X0 Y0 Z9 A0 C0\nG1 X5 {words} F100"
    found = follow(text, "".join(machine.axis_names), kinematics=kinematics_of(machine))
    assert reasons(found) == ["", "the program gives the tool direction in more than one way"]


def test_a_motion_along_the_tool_leads_nobody_knows_where() -> None:
    found = follow("G0 X1 Y1 Z1\nMOVT=IC(5)\nG1 X2 F100\nG0 X1 Y1 Z1").moves
    assert found.rule.tolist() == [Rule.CORRECT, Rule.REFUSE, Rule.REFUSE, Rule.CORRECT]


@pytest.mark.parametrize("turn", ["G1 X5 C20 F100", "G0 A0", "SUPA G0 A0 C0", "C=IC(1)"])
def test_a_swivelled_plane_does_not_turn_with_the_rotary_axes(turn: str, root: Path) -> None:
    machine = load(root / "examples" / "machines" / "wCAYFXZSt.toml")
    plane = 'CYCLE800(1,"TABLE",200000,57,0,0,0,-30,0,0,0,0,0,-1)\nG0 X0 Y0 Z9\n'
    text = f"G54 G0 X0 Y0 Z9 A0 C0\n{plane}G1 X5 A=IC(0) F100\n{turn}\nG0 X5 Y5 Z5\n{plane}G1 X7 F100"
    rules = follow(text, "".join(machine.axis_names), kinematics=kinematics_of(machine)).moves.rule.tolist()
    turned = Rule.PASS if "SUPA" in turn else Rule.REFUSE
    assert rules[2:] == [Rule.CORRECT, Rule.CORRECT, turned, Rule.REFUSE, Rule.PASS, Rule.CORRECT, Rule.CORRECT]


def test_a_plane_that_a_subprogram_with_save_swivels_may_stay() -> None:
    body = 'CYCLE800(1,"T",0,57,5,0,0,0,0,0,0,0,0,0)\nM17\n'
    found = follow(f"G0 X1 Y1 Z1\nSUB1\nG0 X1 Y1 Z1\nM30\n%_N_SUB1_SPF\nPROC SUB1 SAVE\n{body}", "XYZAC")
    assert found.moves.rule.tolist() == [Rule.CORRECT, Rule.REFUSE]


def test_a_plane_in_inches_has_its_zero_point_in_inches(root: Path) -> None:
    machine = load(root / "examples" / "machines" / "wCAYFXZSt.toml")
    ends_of = [
        follow(
            f'{unit}\nCYCLE800(1,"T",200000,57,{before},0,30,0,{after},-1)\nG0 X0 Y0 Z0',
            "".join(machine.axis_names),
            kinematics=kinematics_of(machine),
        ).moves.end[-1]
        for unit, before, after in (("G700", "1,2,3", "0,0,1"), ("G710", "25.4,50.8,76.2", "0,0,25.4"))
    ]
    assert ends_of[0] == pytest.approx(ends_of[1])


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("angles", ["-95,0,20", "30,40,0", "0,75,0", "95,0,20"])
def test_a_plane_lies_the_same_wherever_the_axes_stood_before(root: Path, direction: int, angles: str) -> None:
    """_DIR says which of the two ways is taken by the sign of the tilting axis, within its travel."""
    machine = load(root / "examples" / "machines" / "wCAYFXZSt.toml")
    where = [
        follow(
            f'G0 X0 Y0 Z9 A{start} C0\nCYCLE800(1,"T",200000,57,0,0,0,{angles},0,0,0,{direction})\nG0 X0 Y0 Z0',
            "".join(machine.axis_names),
            kinematics=kinematics_of(machine),
        ).moves.end[-1][machine.axis_names.index("A")]
        for start in (0, 100, -100, direction, -direction)
    ]
    assert where == pytest.approx([where[0]] * len(where))
    assert 0.0 < direction * where[0] <= math.radians(120.0)


@pytest.mark.parametrize(
    "branch",
    [
        "IF R99==0 GOTOF LATER\nTRANS X9\nLATER: {}",
        "IF R99\nTRANS X9\nENDIF\n{}",
        "CASE(R99) OF 1 GOTOF LATER\nLATER: {}",
    ],
)
@pytest.mark.parametrize("call", ["SUB1", "SUB2", 'CALL "SUB1"', "G4 F1\nSUB1 P2", 'EXTCALL("SUB" << 1)'])
@pytest.mark.parametrize("first", [True, False])
def test_what_was_followed_and_may_be_called_again_behind_a_branch_is_refused(
    branch: str, call: str, first: bool
) -> None:
    """The subprogram was executed where everything was known; behind the branch nobody knows from where it is."""
    main = f"%_N_MAIN_MPF\nG0 X0 Y0 Z9\nSUB1\n{branch.format(call)}\nM30\n"
    called = "%_N_SUB1_SPF\nG0 X5 Y5 Z5\nG1 X9 F100\nM17\n%_N_SUB2_SPF\nSUB1\nM17\n%_N_SUB3_SPF\nG1 X7\nM17\n"
    moves = follow(called + main if first else main + called).moves
    texts = (called + main if first else main + called).splitlines()
    rules = {texts[block]: {*moves.rule[moves.block == block].tolist()} for block in set(moves.block.tolist())}
    assert rules["G0 X0 Y0 Z9"] == {Rule.CORRECT}
    assert rules["G0 X5 Y5 Z5"] == rules["G1 X9 F100"] == {Rule.REFUSE}
    assert 'variables."R99"' in moves.reasons[moves.reason[-1]]


@pytest.mark.parametrize("kind", ["SPF", "CYC", "INI"])
def test_an_archive_is_followed_from_its_main_program(kind: str) -> None:
    """Controls archive programs by their names: a subprogram may stand before the program that calls it."""
    moves = follow(f"%_N_PART_{kind}\nG1 X5 F100\nM17\n%_N_WHOLE_MPF\nG0 X0 Y0 Z0\nG1 X1 F100\nPART\nM30\n").moves
    assert moves.block.tolist() == [4, 5, 1]
    assert set(moves.rule.tolist()) == {Rule.CORRECT}


def test_a_tool_that_is_taken_as_zero_is_so_without_its_edge_too() -> None:
    """It was asked for by its name; without a length it would be asked for again, by the number that it has here."""
    found = follow('T="MILL" M6\nG0 X0 Y0 Z9 D1\nG0 X1 D0\nG1 X2 F100', assume_zero=True)
    assert found.assumed == ("length of tool MILL",)
    assert found.moves.tool_length.tolist() == [0.0, 0.0, 0.0]
