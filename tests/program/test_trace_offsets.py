"""Offsets of every kind, against positions worked out by hand. None of them moves the machine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from ncfix.control.setup import Tool
from ncfix.diagnostics import SourceError
from ncfix_iso.rs274.motion import AFTER_REFERENCE
from program.tracing import KNOWN, ZERO, ends, follow, last, reasons

HALF = math.sqrt(0.5)


def test_work_offsets_come_from_the_setup() -> None:
    offsets = {"G54": {**ZERO, "X": 10.0, "B": 90.0}, "G59.3": {**ZERO, "Z": -5.0}}
    followed = follow("G0 X1 Y1 B10\nG59.3 X1 Z1", axes="XYZB", work_offsets=offsets)
    assert ends(followed) == [[11, 1, 0, 100], [1, 1, -4, 100]]


@pytest.mark.parametrize(("dialect", "text"), [("linuxcnc", "M6\nG43 G0 X1 Z5"), ("siemens", "G54\nM6\nG0 X1 Z5")])
def test_a_tool_change_without_a_tool_is_to_the_one_that_the_setup_calls_0(dialect: str, text: str) -> None:
    followed = follow(text, dialect=dialect, tools={0: Tool(3.0, 0.0)})
    assert reasons(followed) == [""]


def test_frames_lead_from_numbers_to_commands() -> None:
    followed = follow("G10 L2 P1 X1 R30\nG92 X5\nG43.1 Z7\nG20\nG0 X2 Y3 Z4", axes="XYZ")
    moves = followed.moves
    frame = moves.frames[moves.frame[-1]]
    program = np.array([2.0, 3.0, 4.0])
    assert np.allclose(frame.offset + frame.rotation @ (frame.unit * program), moves.end[-1])
    assert frame.unit == 25.4


@pytest.mark.parametrize("code", ["G54", "G55", "G59", "G59.1", "G59.3"])
def test_g10_l2_sets_any_system(code: str) -> None:
    number = {"G54": 1, "G55": 2, "G59": 6, "G59.1": 7, "G59.3": 9}[code]
    assert last(follow(f"G10 L2 P{number} X7\n{code} G0 X1"))[0] == 8.0


def test_g10_p0_is_the_system_in_force_and_words_that_are_absent_stay() -> None:
    assert last(follow("G55\nG10 L2 P0 X7 Y8\nG10 L2 P0 X9\nG0 X1 Y1"))[:2] == [10, 9]


def test_g10_l20_calls_the_position_by_the_words() -> None:
    assert ends(follow("G0 X10 Y10\nG10 L20 P1 X1\nG0 X0 Y0")) == [[10, 10, 0], [9, 0, 0]]
    assert last(follow("G0 X10\nG10 L20 P2 X1\nG55 G0 X0"))[0] == 9.0


def test_g10_r_turns_and_a_word_alone_keeps_the_other_axis_in_the_turned_frame() -> None:
    followed = follow("G0 X1\nG10 L2 P1 R90\nG0 X2\nG0 Y1\nG91 X1")
    assert np.allclose(followed.moves.end[:, :2], [[1, 0], [1, 2], [-1, 2], [-1, 3]])


def test_g10_l20_in_a_turned_frame() -> None:
    followed = follow("G10 L2 P1 R45\nG0 X10\nG10 L20 P1 X0 Y0\nG0 X1")
    assert np.allclose(followed.moves.end[-1, :2], [11 * HALF, 11 * HALF])


def test_g92_and_its_kin() -> None:
    text = "G0 X5 Y5\nG92 X1 Y2\nG0 X0\nG92.2\nG0 X0\nG92.3\nG0 X0\nG52 X3\nX0\nG92.1\nX0"
    assert ends(follow(text)) == [[5, 5, 0], [4, 5, 0], [0, 5, 0], [4, 5, 0], [3, 5, 0], [0, 5, 0]]


def test_g92_shifts_all_systems() -> None:
    assert last(follow("G0 X5\nG92 X0\nG55 G0 X1"))[0] == 6.0


def test_g92_under_a_turned_frame_is_turned() -> None:
    followed = follow("G10 L2 P1 R90\nG0 X10 Y0\nG92 X0\nG0 X1")
    assert np.allclose(followed.moves.end[-1, :2], [0, 11])


# -- tool lengths -----------------------------------------------------------------------------------------------------

TOOLS = {1: Tool(100.0), 2: Tool(50.0), 3: Tool(None)}


def test_length_offsets() -> None:
    text = "T1 M6 G43\nG0 Z0\nG43 H2 Z0\nG43.1 Z7\nG0 Z0\nG49 Z0\nG43.2 H1\nZ0\nG43.2 H2\nZ0"
    moves = follow(text, tools=TOOLS).moves
    assert moves.end[:, 2].tolist() == [100, 50, 7, 0, 100, 150]
    assert moves.tool_length.tolist()[:3] == [100, 50, 7]
    assert moves.tool.tolist()[:2] == [1, 2]


def test_length_offsets_move_nothing_by_themselves() -> None:
    assert ends(follow("G0 X1 Z5\nG43 H1\nG0 X2", tools=TOOLS)) == [[1, 0, 5], [2, 0, 5]]


def test_h0_is_the_tool_in_the_spindle_for_linuxcnc_and_none_for_others() -> None:
    text = "T1 M6\nG43 H0\nG0 Z0"
    assert last(follow(text, tools=TOOLS))[2] == 100.0
    assert last(follow(text, tools=TOOLS, dialect="iso"))[2] == 0.0


def test_g44_subtracts() -> None:
    assert last(follow("G44 H1\nG0 Z0", tools=TOOLS, dialect="iso"))[2] == -100.0


def test_g10_sets_lengths() -> None:
    text = "T1 M6\nG10 L1 P1 Z10\nG43 G0 Z0\nG10 L10 P1 Z3\nG43 Z0"
    assert [row[2] for row in ends(follow(text, tools=TOOLS))] == [10, 7]


def test_tool_length_is_that_of_the_spindle_without_an_offset() -> None:
    moves = follow("G0 X1\nT1 M6\nX2\nM61 Q2\nX3\nT3 M6\nX4\nT9 M6\nX5", tools=TOOLS).moves
    assert moves.tool.tolist() == [0, 1, 2, 3, 9]
    assert np.array_equal(moves.tool_length, [np.nan, 100, 50, np.nan, np.nan], equal_nan=True)


def test_after_an_offset_of_nothing_the_tool_is_as_long_as_without_one() -> None:
    """G43 H0 with an empty spindle, and G43.1 Z0, are used to end an offset; the next tool has its length."""
    for none in ("G49", "G43 H0", "G43.1 Z0"):
        moves = follow(f"{none}\nT1 M6\nG0 X1 Y1 Z1\nT3 M6\nG0 X2 Y2 Z2", tools={0: Tool(0.0), **TOOLS}).moves
        assert np.array_equal(moves.tool_length, [100, np.nan], equal_nan=True)
    iso = follow("T1 M6\nG43 H2\nG0 X1. Y1. Z1.\nH0\nX2. Y2. Z2.", tools=TOOLS, dialect="fanuc").moves
    assert (iso.tool_length.tolist(), iso.end[:, 2].tolist()) == ([50, 100], [51, 2])


def test_an_offset_that_is_assumed_to_be_zero_is_one() -> None:
    """What is lacking is said once: the length of the tool of the offset, not that of the spindle as well."""
    followed = follow("T2 M6\nG43 H1\nG0 X1. Y1. Z1.", dialect="fanuc", tools={}, assume_zero=True)
    assert (followed.moves.tool.tolist(), followed.moves.tool_length.tolist()) == ([1], [0.0])
    assert followed.assumed.count("length of tool 1") == 1


# -- rotation of ISO controls -----------------------------------------------------------------------------------------


def test_g68_turns_about_a_point_until_g69() -> None:
    text = "G0 X10 Y0\nG68 X10 Y10 R90\nG0 X20 Y10\nG1 X20 Y20 F100\nG69\nG0 X1 Y1"
    followed = follow(text, dialect="iso")
    assert np.allclose(followed.moves.end[:, :2], [[10, 0], [10, 20], [0, 20], [1, 1]])
    assert reasons(followed) == ["", "", "", ""]


def test_g68_in_other_planes() -> None:
    followed = follow("G18 G68 X0 Z0 R90\nG0 X0 Z1", dialect="iso")
    assert np.allclose(followed.moves.end[-1], [1, 0, 0])


# -- tool-centre-point control ----------------------------------------------------------------------------------------


def test_tcp_on_and_off_while_nothing_is_turned() -> None:
    followed = follow("G0 Z150\nG43.4 H1\nG0 Z40\nG49\nG0 X1", axes="XYZBC", tools=TOOLS, dialect="iso")
    assert [row[2] for row in ends(followed)] == [150, 40, 140]
    assert followed.moves.start[1, 2] == 50.0
    assert followed.moves.tcp.tolist() == [False, True, False]
    assert followed.moves.tool_length.tolist()[1] == 100.0


def test_tcp_on_while_turned_leaves_the_start_unknown_and_the_end_known() -> None:
    text = "G0 X0 Y0 Z150 B30 C0\nG43.4 H1 X1 Y2 Z3 B30 C0\nG1 X2 F100"
    followed = follow(text, axes="XYZBC", tools=TOOLS, dialect="iso")
    assert np.isnan(followed.moves.start[1, :3]).all()
    assert np.allclose(ends(followed)[1:], [[1, 2, 3, 30, 0], [2, 2, 3, 30, 0]])
    assert reasons(followed) == ["", "", ""]
    unknown = follow("G0 X0 Y0 Z150 B30 C0\nG43.4 H1\nG1 X1 F1", axes="XYZBC", tools=TOOLS, dialect="iso")
    assert "kinematics" in reasons(unknown)[1]


def test_tcp_from_the_start() -> None:
    followed = follow("T1 M6 G43\nG0 Z3", axes="XYZBC", tools=TOOLS, tcp=True)
    assert followed.moves.tcp.all()
    assert last(followed)[2] == 3.0
    assert followed.moves.tool_length[0] == 100.0


def test_tool_vectors_are_refused() -> None:
    followed = follow("G43.5 H1\nG1 X1 I0 J0 K1 F100", axes="XYZBC", tools=TOOLS, dialect="iso")
    assert "G43.5" in reasons(followed)[0]


@pytest.mark.parametrize(
    "text",
    [
        "G10 L3 P1 X1",
        "G10 L2 P10 X1",
        "G10 L20 P1 R5",
        "G10 L1 X1",
        "G92",
        "G52",
        "G43.2",
        "G43 H-1",
        "M61",
        "G10 L2 P1.5",
    ],
)
def test_impossible_words(text: str) -> None:
    with pytest.raises(SourceError) as caught:
        follow(text, setup=KNOWN)
    assert caught.value.code in ("NCF210", "NCF221", "NCF222", "NCF224")


def test_an_axis_whose_datum_a_reset_does_not_move_stays_where_the_program_has_brought_it() -> None:
    followed = follow("G0 X1 Y2 Z3\nG92 X0\nG1 X4 F1\nG92.1\nG1 Z1\nG1 X2")
    assert followed.moves.placed[-2].tolist() == [False, True, True]
    assert followed.moves.placed[-1].tolist() == [True, True, True]


@pytest.mark.parametrize(
    ("text", "of_the_tip", "length"),
    [
        ("T1 M6", True, 80.0),
        ("T1 M6\nG43.4", True, 80.0),
        ("T1 M6\nG43 H2", True, 50.0),
        ("T1 M6\nG43.4 H2", True, 50.0),
        ("T1 M6\nG43.4 H2", False, 50.0),
    ],
)
def test_under_tcp_a_control_leads_the_tip_of_the_tool_that_it_knows_of(text: str, of_the_tip: bool, length: float):
    """Without an offset it leads the spindle reference, unless the setup says that X, Y and Z are those of the tip."""
    tools = {1: Tool(80.0), 2: Tool(50.0)}
    moves = follow(f"{text}\nG1 X1. F9.", axes="XYZBC", dialect="fanuc", tcp=of_the_tip, tools=tools).moves
    assert moves.tcp[-1]
    assert moves.length_under_tcp[-1] == length


@pytest.mark.parametrize(
    ("change", "placed"),
    [("", [True] * 3), ("G43 H2", [True, True, False]), ("G92 Y5", [True] * 3), ("G55", [True, False, False])],
)
def test_behind_a_change_of_what_numbers_count_from_axes_have_to_be_named_again(change: str, placed: list[bool]):
    """A tool length counts along Z: until a block names Z, it gets no word. A shift in numbers changes nothing."""
    moves = follow(f"G1 X1 Y1 Z1 F9\n{change}\nX2", tools={2: Tool(50.0)}).moves
    assert moves.placed[-1].tolist() == placed


NUMBERED = {number: Tool(10.0 * number, 3.0) for number in range(5)}


@pytest.mark.parametrize(
    ("text", "heights"),
    [
        ("G43 H1 G0 Z5\nH2\nZ6\nZ7 H0", [15, 26, 7]),
        ("G43 H2 G0 Z5\nH2 Z6\nG49 Z7\nH0 Z8", [25, 26, 7, 8]),
        ("G0 Z5\nG0 Z6\nG43 H2 Z7", [5, 6, 27]),
    ],
)
def test_h_alone_is_another_length_where_one_is_in_force(text: str, heights: list[float]) -> None:
    found = follow(text, dialect="iso", tools=NUMBERED)
    assert [row[2] for row in ends(found)] == heights
    assert set(reasons(found)) == {""}


@pytest.mark.parametrize("text", ["H2 G0 Z5", "G43 H1 Z3\nG91 Z1 H2", "G44 H1 Z3\nH2 Z4"])
def test_h_alone_is_doubtful_elsewhere_until_g43(text: str) -> None:
    found = reasons(follow(f"G0 X1 Y1\n{text}\nX2\nG90 G43 H1 Z5\nX3", dialect="iso", tools=NUMBERED))
    assert ["H without G43" in reason for reason in found[-4:]] == [True, True, False, False]


@pytest.mark.parametrize(
    ("text", "reason"), [("G43.1 H1 Z5.", "along the tilted tool"), ("G1 G41.1 F100", "turns an axis along the path")]
)
def test_words_show_what_a_code_of_linuxcnc_means_elsewhere(text: str, reason: str) -> None:
    assert reason in reasons(follow(f"G0 X1\n{text}\nX2", dialect="iso", tools=NUMBERED))[-1]


@pytest.mark.parametrize(
    ("dialect", "doubtful"), [("fanuc", []), ("haas", []), ("mitsubishi", [1, 3, 6]), ("iso", [1, 3, 6])]
)
def test_g52_is_of_all_work_offsets_or_of_one(dialect: str, doubtful: list[int]) -> None:
    """Where both would be the same there is no doubt."""
    text = "G52 X1.\nG0 X1.\nG55 X1.\nG52 X1.\nX1.\nG56 X1.\nG55 X1.\nG52 X0.\nX1.\nG54 X1."
    offsets = {f"G{code}": ZERO for code in (54, 55, 56)}
    found = reasons(follow(text, axes="X", dialect=dialect, work_offsets=offsets))
    assert [n for n, reason in enumerate(found) if "(G52)" in reason] == doubtful


@pytest.mark.parametrize("dialect", ["iso", "fanuc", "mitsubishi"])
def test_g52_in_g91_may_be_added_to_the_shift_in_force(dialect: str) -> None:
    setup: dict[str, Any] = {"dialect": dialect, "no_point": "calculator"}
    assert reasons(follow("G21 G91 G52 X5.\nG90 G0 X1.", **setup)) == [""]
    assert reasons(follow("G21 G52 X3.\nG91 G52 Y5.\nG90 G0 X1. Y1.", **setup)) == [""]
    assert "G52" in reasons(follow("G21 G52 X3.\nG91 G52 X5.\nG90 G0 X1.", **setup))[0]


@pytest.mark.parametrize("dialect", ["iso", "fanuc"])
@pytest.mark.parametrize(
    ("text", "known"),
    [
        *(("G5 P10000", True), ("G5 P3", True), ("G5", True), ("G5 P10000 X0 Y0", False), ("G25", True)),
        *(("G25 X0", False), ("G11", True), ("G11 X0 Y0", False), ("G23", True), ("G23 X0 Y0 I5 J5", False)),
        *(("G103", True), ("G103 P1", True), ("G103 X0 Z0 R5.", False)),
    ],
)
def test_codes_that_some_controls_know_without_words_of_axes(dialect: str, text: str, known: bool) -> None:
    found = reasons(follow(f"G21 G0 X1.\n{text}\nX2.", dialect=dialect, no_point="calculator"))
    assert (found[-1] == "") is known


@pytest.mark.parametrize("dialect", ["iso", "fanuc", "haas", "mitsubishi"])
@pytest.mark.parametrize("kind", ["P10001", "P10999 L2", "P10000", "P11000", "P[#500]"])
def test_high_speed_cycles_whose_data_are_in_variables_move_axes(dialect: str, kind: str) -> None:
    setup: dict[str, Any] = {"dialect": dialect, "no_point": "calculator"}
    found = reasons(follow(f"G21 G0 X1. Y1. Z1.\nG5 {kind}\nX2. Y2. Z2.\nX3.", **setup))
    if kind in ("P10000", "P11000"):
        assert found == [""] * 3
    elif kind == "P[#500]":
        assert found[0] == ""
        assert all("P of G5" in each for each in found[1:])
    else:
        assert [each[:32] for each in found] == ["", "high-speed cycle machining (G5 P", "", ""]
        cut = reasons(follow(f"G21 G0 X1. Y1. Z1.\nG5 {kind}\nG1 X2. F9.", **setup))
        assert "the control generates" in cut[-1]


@pytest.mark.parametrize("dialect", ["iso", "fanuc", "haas"])
@pytest.mark.parametrize("which", ["", " P2", " P3", " P4", " P[#500]"])
def test_where_the_third_reference_point_lies_is_not_known(dialect: str, which: str) -> None:
    places = {"G28": dict.fromkeys("XYZ", 0.0), "G30": dict.fromkeys("XYZ", 100.0)}
    text = f"G21 G0 X1. Y1. Z1.\nG91 G30{which} Z0\nG90 G1 X2. F9.\nX3. Y2. Z1."
    found = reasons(follow(text, dialect=dialect, no_point="calculator", references=places))
    assert found[1].startswith("reference point") or "G30" in found[1]
    assert found[2] == ("" if which in ("", " P2") else AFTER_REFERENCE.format("Z"))


def test_a_figure_that_is_copied_moves_all_axes() -> None:
    """G72.1 of Fanuc turns what a subprogram makes; in a text that nothing else tells from ISO, too."""
    found = reasons(follow("G21 G0 X1. Y1. Z1.\nG72.1 P9 L3 R30.\nG1 X2. Z2. F9.\nY2.", dialect="iso"))
    assert "turning cycle" in found[1]
    assert "the axis Y after a turning cycle" in found[2]


def test_the_first_work_offset_is_in_force_at_the_start() -> None:
    assert ends(follow("G0 X[#5220]")) == [[1.0, 0.0, 0.0]]


def test_in_a_turned_frame_an_axis_without_a_word_stands_where_another_tool_length_has_left_it() -> None:
    tools = {1: Tool(50.0), 2: Tool(80.0)}
    found = follow("G10 L2 P1 R90\nG43 H1\nG0 X0 Y0 Z10\nG43 H2\nG1 X5 F100", tools=tools)
    assert ends(found) == [[0.0, 0.0, 60.0], [0.0, 5.0, 60.0]]


@pytest.mark.parametrize("code", ["G28.1", "G30.1"])
def test_a_place_that_is_kept_is_one_to_go_to_elsewhere(code: str) -> None:
    assert set(reasons(follow(f"G0 X1\n{code}\nX2", dialect="iso"))) == {""}
    assert code in reasons(follow(f"G0 X1\n{code} X2\nX3", dialect="iso"))[-1]
    assert set(reasons(follow(f"G0 X1\n{code} X2\nX3"))) == {""}


@pytest.mark.parametrize("dialect", ["iso", "fanuc"])
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("G0 X20. Y20.\nG92 X5. Y5.\nG92.1 X0\nX1. Y6.", [[20, 20, 0], [1, 21, 0]]),
        ("G0 X20. Y20.\nG92 X5. Y5.\nG52 X3.\nG92.1 X0. Y0. Z0.\nX1. Y6.", [[20, 20, 0], [1, 6, 0]]),
    ],
)
def test_a_preset_takes_the_shifts_away(dialect: str, text: str, expected: list[list[float]]) -> None:
    found = follow(f"G21\n{text}", dialect=dialect, no_point="calculator")
    assert ends(found) == expected
    assert set(reasons(found)) == {""}


@pytest.mark.parametrize("dialect", ["iso", "fanuc"])
@pytest.mark.parametrize("text", ["G92.1 X5.", "G43 H2 Z5.\nG92.1 X0", "G41 D1 X5. Y5. F9.\nG92.1 X0"])
def test_a_preset_that_is_not_followed(dialect: str, text: str) -> None:
    found = follow(f"G21 G0 X1.\n{text}\nX2. Y2.", dialect=dialect, no_point="calculator", tools=NUMBERED)
    assert "G92.1" in reasons(found)[-1]
