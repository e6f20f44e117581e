"""What a program cannot know: it is asked for, all at once, or motions are refused; nothing is guessed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ncfix.control import control
from ncfix.control.moves import Rule, Trace
from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import UsageError
from program.tracing import KNOWN, NOTHING, ZERO, ends, follow, reasons

G54 = {"G54": ZERO}


def lacking(text: str, axes: str = "XYZ", **given: object) -> list[tuple[str, str]]:
    """Code and text of everything that is missing."""
    with pytest.raises(UsageError) as caught:
        follow(text, axes, NOTHING, **given)  # type: ignore[arg-type]
    return [(message.code, message.text) for message in caught.value.messages]


def rules(followed: Trace) -> list[int]:
    return list(followed.moves.rule.tolist())


# -- what has to be given ---------------------------------------------------------------------------------------------


def test_everything_that_is_missing_is_named_at_once() -> None:
    found = lacking("T4 M6\nG43\nG0 X1 Y1\nG43 H12\nG55 G0 X2\nZ5")
    assert found == [
        ("NCF202", "length of tool 4 is used but not given"),
        ("NCF201", "work offset G54 is used but not given"),
        ("NCF203", "start position of Z matters but not given"),
        ("NCF202", "length of tool 12 is used but not given"),
        ("NCF201", "work offset G55 is used but not given"),
    ]


def test_a_program_of_another_machine_is_not_followed_to_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(control, "BLOCKS_AFTER_MISSING_AXIS", 10)
    offset, axis = (
        ("NCF201", "work offset {} is used but not given"),
        "the program moves the axis A, and the machine has only X Y Z",
    )
    first = [
        ("NCF206", axis),
        (offset[0], offset[1].format("G54")),
        ("NCF203", "start position of Z matters but not given"),
    ]
    assert lacking("G0 X1 Y1 A2\n" + 9 * "X2\n" + "G55 X3\n") == [*first, (offset[0], offset[1].format("G55"))]
    assert lacking("G0 X1 Y1 A2\n" + 10 * "X2\n" + "G55 X3\n") == first


def test_each_comes_with_its_option_and_place() -> None:
    with pytest.raises(UsageError) as caught:
        follow("G0 X1 Y1\nG43 H12 Z1", "XYZ", NOTHING)
    assert str(caught.value) == "\n".join(
        [
            "part.ngc:1: NCF201: work offset G54 is used but not given",
            "    G0 X1 Y1",
            "  hint: --offset G54=x,y,z or --assume-zero",
            "part.ngc:1: NCF203: start position of Z matters but not given",
            "    G0 X1 Y1",
            "  hint: --initial Z=... or --assume-zero",
            "part.ngc:2: NCF202: length of tool 12 is used but not given",
            "    G43 H12 Z1",
            "  hint: --tool 12=LENGTH or --assume-zero",
        ]
    )


def test_a_rapid_to_all_axes_needs_no_start_position() -> None:
    followed = follow("G0 X1 Y2 Z3\nG1 X2 F1", "XYZ", Setup(work_offsets=G54))
    assert rules(followed) == [Rule.CORRECT, Rule.CORRECT]
    assert np.isnan(followed.moves.start[0]).all()
    assert ends(followed)[0] == [1, 2, 3]


def test_a_cut_needs_its_start_position() -> None:
    found = lacking("F1 G1 X1 Y2 Z3", work_offsets=G54)
    assert found == [("NCF203", f"start position of {axis} matters but not given") for axis in "XYZ"]
    assert [text for _, text in lacking("F1 G2 X1 Y1 I1", work_offsets=G54)] == [
        f"start position of {axis} matters but not given" for axis in "XYZ"
    ]


def test_increments_need_their_start_position_and_no_offset() -> None:
    assert lacking("G91 G0 X1 Y1 Z1") == [
        ("NCF203", f"start position of {axis} matters but not given") for axis in "XYZ"
    ]
    followed = follow("G91 G0 X1", "XYZ", Setup(initial={"X": 5.0, "Y": 6.0, "Z": 7.0}))
    assert ends(followed) == [[6, 6, 7]]


def test_machine_coordinates_need_nothing() -> None:
    followed = follow("G53 G0 Z0\nG53 G0 X0 Y0", "XYZ", NOTHING)
    assert rules(followed) == [Rule.PASS, Rule.PASS]
    assert np.array_equal(followed.moves.end, [[np.nan, np.nan, 0], [0, 0, 0]], equal_nan=True)


def test_an_offset_that_the_program_sets_is_given() -> None:
    followed = follow("G10 L2 P1 X1 Y2 Z3\nG0 X0 Y0 Z0", "XYZ", NOTHING)
    assert ends(followed) == [[1, 2, 3]]
    assert lacking("G10 L2 P1 X1\nG0 X0 Y0 Z0") == [("NCF201", "work offset G54 is used but not given")]


def test_a_parameter_that_holds_an_offset_is_asked_for() -> None:
    assert lacking("#1=#5221") == [("NCF201", "work offset G54 is used but not given")]
    assert lacking("#1=#5161")[0][0] == "NCF204"


def test_a_position_that_is_read_is_asked_for() -> None:
    assert lacking("#1=#<_z>") == [("NCF203", "start position of Z matters but not given")]


def test_axes_that_the_machine_lacks_are_named_once() -> None:
    with pytest.raises(UsageError) as caught:
        follow("G0 X1 A2 Z3\nA5 B6")
    assert [
        (message.code, message.place.line, message.place.column) for message in caught.value.messages if message.place
    ] == [
        ("NCF206", 1, 7),
        ("NCF206", 2, 4),
    ]


@pytest.mark.parametrize(("dialect", "also"), [("iso", " If U V W are increments"), ("linuxcnc", "")])
def test_u_v_w_may_be_increments_to_controls_of_lathes(dialect: str, also: str) -> None:
    with pytest.raises(UsageError) as caught:
        follow("G0 X1 U2", dialect=dialect)
    assert caught.value.messages[0].hint.startswith("is it the right machine file?" + also)
    assert bool(also) == ("increments" in caught.value.messages[0].hint)


# -- assume_zero ------------------------------------------------------------------------------------------------------


def test_what_is_assumed_is_zero_and_listed_once() -> None:
    followed = follow("G21 T4 M6 G43\nG0 X1 Y1\nG55 X2\nG54 X1\nG28", "XYZ", NOTHING, assume_zero=True)
    assert followed.assumed == (
        "length of tool 4",
        "work offset G54",
        "start position of Z",
        "work offset G55",
        "reference point G28",
    )
    assert [message.code for message in followed.messages] == ["NCF205"] * 5
    assert ends(followed) == [[1, 1, 0], [2, 1, 0], [1, 1, 0], [0, 0, 0]]


def test_nothing_is_assumed_that_is_not_used() -> None:
    assert follow("T4 M6\nG0 X1 Y1 Z1", "XYZ", NOTHING, assume_zero=True).assumed == ("work offset G54",)


# -- known only at run time -------------------------------------------------------------------------------------------


def test_reference_points_that_are_not_given_leave_their_axes_unknown() -> None:
    setup = Setup(work_offsets=G54, initial=ZERO)
    followed = follow("G0 X1 Y1 Z1\nG28 Z5\nG0 X2\nG1 Y3 F1\nG0 Z4\nG1 X5", "XYZ", setup)
    assert rules(followed) == [Rule.CORRECT, Rule.PASS, Rule.PASS, Rule.PASS, Rule.REFUSE, Rule.CORRECT, Rule.CORRECT]
    assert reasons(followed)[3] == "the position of the axis Z after the approach to the reference point is not given"
    assert np.isnan(followed.moves.end[3, 2])
    assert np.isnan(followed.moves.start[5, 2])


def test_a_rapid_that_says_nothing_of_axes_that_are_not_known_passes_and_counts_for_those_it_names() -> None:
    setup = Setup(work_offsets=G54, initial=ZERO)
    followed = follow("G28 Z5\nG0 X1 Y1\nG0 Z4\nG91 G0 X2\nG90 G28 Z5\nG91 G0 Z1", "XYZ", setup)
    assert rules(followed)[2:5] == [Rule.PASS, Rule.CORRECT, Rule.CORRECT]
    assert rules(followed)[-1] == Rule.REFUSE
    assert followed.moves.end[3].tolist() == [1, 1, 4]
    assert not followed.moves.wordless[3].any()


def test_after_probing_only_what_is_named_anew_is_known() -> None:
    followed = follow("F1 G38.2 Z-5\nG0 X1\nG91 G0 Z1\nG90 G0 Z5\nG1 X2")
    assert rules(followed) == [Rule.PASS, Rule.PASS, Rule.REFUSE, Rule.CORRECT, Rule.CORRECT]
    assert reasons(followed)[:2] == ["probing", "the position of the axis Z after probing is known only at run time"]


@pytest.mark.parametrize("setting", ["G92 Z0", "G10 L20 P1 Z0", "G10 L2 P1 Z#5063"])
def test_an_offset_that_was_probed_is_known_only_at_run_time(setting: str) -> None:
    followed = follow(f"F1 G38.2 Z-5\n{setting}\nG0 X1 Y1 Z5\nG1 X2")
    assert rules(followed)[1:] == [Rule.REFUSE, Rule.REFUSE]
    assert "offset of the axis Z is known only at run time" in reasons(followed)[1]


def test_a_word_computed_from_a_probed_value() -> None:
    followed = follow("F1 G38.2 Z-5\nG0 Z10\nG0 X[#5063+1]\nG0 X3")
    assert rules(followed)[1:] == [Rule.CORRECT, Rule.REFUSE, Rule.CORRECT]
    assert "run time" in reasons(followed)[2]


def test_marks_follow_assignments_and_arguments_and_go_with_new_values() -> None:
    text = "F1 G38.2 Z-5\nG0 Z10\n#1=#5063\n#<a>=[#1*2]\no1 sub\nG0 X#1\no1 endsub\no1 call [#<a>]\n#1=4\nG0 X#1"
    assert rules(follow(text))[2:] == [Rule.REFUSE, Rule.CORRECT]


def test_a_branch_that_depends_on_a_probed_value_makes_everything_after_it_uncertain() -> None:
    followed = follow("F1 G38.2 Z-5\nG0 Z5\no1 if [#5070 eq 1]\nG0 X1\no1 endif\nG0 X2 Y2 Z2")
    assert rules(followed) == [Rule.PASS, Rule.CORRECT, Rule.REFUSE, Rule.REFUSE]
    assert "run time" in reasons(followed)[-1]


def test_inputs_are_known_only_at_run_time() -> None:
    assert rules(follow("M66 P0 L0\nG0 X#5399\nX1")) == [Rule.REFUSE, Rule.CORRECT]


def test_a_length_that_was_measured() -> None:
    followed = follow("F1 G38.2 Z-5\nG10 L1 P1 Z#5063\nG43 H1\nG0 X1 Y1 Z1")
    assert rules(followed)[-1] == Rule.REFUSE


def test_an_arc_about_a_probed_centre() -> None:
    followed = follow("F1 G38.2 Z-5\nG0 Z5\nG2 X2 I[#5061+1]")
    assert rules(followed)[-1] == Rule.REFUSE


# -- codes of ISO controls --------------------------------------------------------------------------------------------


def test_harmless_codes_are_passed_over_and_unknown_ones_make_motions_refused() -> None:
    followed = follow("G21 G5 P10000\nG8 P1\nG9 G1 X1 F1\nG187 P2\nM88\nX2\nG234 H1\nX3", dialect="iso")
    assert rules(followed) == [Rule.CORRECT, Rule.CORRECT, Rule.REFUSE]
    assert reasons(followed)[-1] == "G234 is not known, and may move axes or change coordinates"
    assert [message.code for message in followed.messages] == ["NCF228"]


@pytest.mark.parametrize(
    ("on", "off"),
    [("G16", "G15"), ("G51 X0 Y0 P2", "G50"), ("G51.1 X0", "G50.1 X0"), ("G68.2 X0 Y0 Z0 I0 J30 K0", "G69")],
)
def test_coordinates_that_are_not_followed_are_refused_until_they_end(on: str, off: str) -> None:
    followed = follow(f"G0 X1 Y1 Z1\n{on}\nG1 X2 F1\n{off}\nG0 X3 Y3 Z3\nG1 X4", dialect="iso")
    assert rules(followed) == [Rule.CORRECT, Rule.REFUSE, Rule.CORRECT, Rule.CORRECT]
    assert np.isnan(followed.moves.start[2]).all()


@pytest.mark.parametrize("word", ["G10 L2 P0 X5", "G10 L2 X5", "G91 G10 L2 P1 X5"])
def test_offsets_that_controls_set_in_different_ways_are_refused(word: str) -> None:
    assert "G10 L2 sets depends on the control" in reasons(follow(f"{word}\nG90 G0 X1", dialect="iso"))[-1]


@pytest.mark.parametrize("word", ["G5 X5 Y5 I1 J1 P1 Q1", "G5.1 X5 Y5 I1 J1"])
def test_splines_are_no_smoothing(word: str) -> None:
    followed = follow(f"G1 X1 F1\n{word}\nG0 X3 Y3 Z3", dialect="iso")
    assert rules(followed) == [Rule.CORRECT, Rule.REFUSE, Rule.REFUSE]


@pytest.mark.parametrize("dialect", ["iso", "fanuc", "haas", "mitsubishi"])
def test_smoothing_names_axes_and_moves_none(dialect: str) -> None:
    followed = follow("G0 X1. Y2. Z3.\nG05.1 Q3 X0 Y0 Z0\nG0 X4.\nG5.1 Q0", dialect=dialect)
    assert ends(followed) == [[1, 2, 3], [4, 2, 3]]


def test_probing_leaves_alone_what_it_does_not_move() -> None:
    text = "G38.2 Z-5 F1\nG0 Z1\nG0 X5 Y5"
    assert reasons(follow(text, axes="XYZB", setup=Setup(assume_zero=True))) == ["probing", "", ""]
    turned = follow("G10 L2 P1 R30\nG38.2 X-5 F1\nG0 Z1\nG0 X5", setup=Setup(assume_zero=True))
    assert "after probing" in reasons(turned)[-1]


def test_skip_signals_are_probing() -> None:
    assert reasons(follow("G31 Z-5 F1\nG0 Z1", dialect="iso")) == ["probing", ""]


def test_commands_to_grbl_lose_the_position() -> None:
    followed = follow("G0 X1 Y1 Z1\n$H\nG0 X2\nG0 X1 Y1 Z1\nG1 X5 F1", dialect="iso")
    assert rules(followed) == [Rule.CORRECT, Rule.PASS, Rule.CORRECT, Rule.CORRECT]


def test_axis_words_before_any_code_end_where_g0_and_g1_both_would() -> None:
    followed = follow("G43 H1 Z50.\nX1 Y1\nG0 X2\nY2", dialect="iso", tools={1: Tool(length=100.0)})
    assert rules(followed) == [Rule.CORRECT, Rule.CORRECT, Rule.CORRECT, Rule.CORRECT]
    assert ends(followed)[1] == [1, 1, 150]


def test_further_work_offsets() -> None:
    followed = follow("G54.1 P2\nG0 X1 Y1 Z1", dialect="iso", work_offsets={"G54.1P2": {"X": 10.0}})
    assert ends(followed) == [[11, 1, 1]]
    with pytest.raises(UsageError) as caught:
        follow("G54.1 P3\nG0 X1", dialect="iso")
    assert caught.value.messages[0].text == "work offset G54.1P3 is used but not given"


@pytest.mark.parametrize("setting", ["G10 L20 P1 X0", "G10 L10 P1 R50.", "G10 L1 P1 Z50.", "G10 L2 P1 R30."])
def test_what_g10_sets_that_controls_take_otherwise_is_refused_in_iso(setting: str) -> None:
    found = follow(f"G0 X1. Y1. Z1.\n{setting}\nG0 X2.", dialect="iso")
    assert "depends on the control" in reasons(found)[-1]


def test_g10_l11_asks_for_the_fixture_offset_that_it_measures_from() -> None:
    with pytest.raises(UsageError) as caught:
        follow("G0 X1 Y1 Z1\nG10 L11 P1 Z5", work_offsets={"G54": ZERO})
    assert caught.value.messages[0].text == "work offset G59.3 is used but not given"


def test_a_length_from_an_offset_that_was_probed_is_known_at_run_time_only() -> None:
    text = "T1 M6\nG0 X0 Y0 Z5\nF10 G38.2 Z-10\nG10 L20 P1 Z0\nG53 G0 Z0\nG10 L10 P1 Z5\nG43 H1\nG55 G0 X1 Y1 Z1"
    assert reasons(follow(text))[-1] == "the program measures the length of tool 1 at run time"


def test_a_code_of_the_builder_that_the_setup_declares_changes_nothing() -> None:
    text = "G0 X1 Y1 Z1\nG131 R2\nX2\nG131 X5\nX3"
    declared = follow(text, dialect="iso", passed_codes=frozenset({1310}))
    assert rules(declared)[:2] == [Rule.CORRECT, Rule.CORRECT]
    assert rules(declared)[2:] == [Rule.REFUSE, Rule.REFUSE]
    assert rules(follow(text, dialect="iso"))[1] == Rule.REFUSE
    hints = [message.hint for message in declared.messages if message.code == "NCF228"]
    assert len(hints) == 1
    assert "a block of their own" in hints[0]


def test_a_length_in_the_block_of_such_a_code_may_be_its_own() -> None:
    setup = replace(KNOWN, tools={1: Tool(50.0), 2: Tool(70.0)}, passed_codes=frozenset({1310}))
    text = "G43 H1 G0 X1. Y1. Z1.\nG131 H2\nG0 Z2."
    assert rules(follow(text, "XYZ", setup, dialect="fanuc")) == [Rule.CORRECT, Rule.REFUSE]


def test_machine_coordinates_need_no_motion_code_on_iso_controls() -> None:
    followed = follow("G53 Z0\nX1\nG0 X1", dialect="iso")
    assert rules(followed) == [Rule.PASS, Rule.CORRECT, Rule.CORRECT]


def test_a_rapid_behind_what_is_not_followed_is_refused_and_does_not_pass() -> None:
    setup = Setup(work_offsets=G54, initial=ZERO)
    assert rules(follow("G131\nG28 Z5\nG0 X1 Y1", "XYZ", setup, dialect="iso"))[-1] == Rule.REFUSE
    assert rules(follow("G28 Z5\nG51 X0 Y0 P2\nG0 X1 Y1\nG50", "XYZ", setup, dialect="iso"))[-1] == Rule.REFUSE


def test_a_word_known_only_at_run_time_never_passes_in_a_turned_frame() -> None:
    text = "G31 Z50. F100.\nG68 X0. Y0. R30.\nG0 X#5061 Y1.\nX#5061 Y5.\nZ50.\nG1 X3. F100."
    assert rules(follow(text, dialect="fanuc")) == [Rule.PASS, Rule.REFUSE, Rule.REFUSE, Rule.PASS, Rule.REFUSE]
