"""Straight motions against positions worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ncfix.control.moves import MotionKind, Rule
from program.tracing import ends, follow, last, reasons


def test_words_that_are_absent_leave_their_axes() -> None:
    assert ends(follow("G0 X1 Y2\nZ3\nG1 X4 F100")) == [[1, 2, 0], [1, 2, 3], [4, 2, 3]]


def test_increments_add_up() -> None:
    moves = follow("G0 X1 Y1\nG91 X1\nX0.1 Y-2\nG90 X7").moves
    assert np.allclose(moves.end[:, :2], [[1, 1], [2, 1], [2.1, -1], [7, -1]])
    assert moves.incremental.tolist() == [False, True, True, False]


@pytest.mark.parametrize(("code", "unit"), [("G70", 25.4), ("G71", 1.0), ("G70 G90", 25.4), ("G71 G17 F100", 1.0)])
def test_iso_units_may_be_those_of_din_66025(code: str, unit: float) -> None:
    assert follow(f"G20\n{code}\nG1 X2 F10\n{code} X1", dialect="iso").moves.end[:, 0].tolist() == [2 * unit, unit]
    assert "turning cycle" in reasons(follow(f"{code.split()[0]} X1 P10 Q20", dialect="linuxcnc"))[0]


def test_inches_are_millimetres_and_degrees_radians() -> None:
    moves = follow("G20\nG1 X1 B90 F10", axes="XYZB").moves
    assert moves.end[0].tolist() == [25.4, 0.0, 0.0, math.pi / 2]
    assert moves.feed[0] == 254.0
    assert moves.rotary.tolist() == [False, False, False, True]


def test_every_motion_starts_where_the_one_before_ended() -> None:
    moves = follow("G0 X1\nG1 Y2 F100\nG2 X3 Y2 I1\nG91 G0 Z5\nG90 G53 G0 Z0\nG28 X5").moves
    assert np.array_equal(moves.start[1:], moves.end[:-1])


def test_kinds_codes_and_programmed_axes() -> None:
    moves = follow("G0 X1 Y1\nG1 Z-1 F100\nG3 X0 Y2 I-1 J0\nX0 Y0 R5").moves
    assert moves.kind.tolist() == [MotionKind.RAPID, MotionKind.FEED, MotionKind.ARC, MotionKind.ARC]
    assert moves.modal.tolist() == [0, 10, 30, 30]
    assert moves.programmed.tolist() == [
        [True, True, False],
        [False, False, True],
        [True, True, False],
        [True] * 2 + [False],
    ]
    assert moves.block.tolist() == [0, 1, 2, 3]


def test_blocks_without_axis_words_are_no_motions() -> None:
    assert len(follow("G0\nG1 F100\n(nothing)\n\nN10\nS100 M3\nG17 G40").moves) == 0


def test_diameters_count_half() -> None:
    moves = follow("G7\nG0 X10\nG91 X2\nG8 X1").moves
    assert moves.end[:, 0].tolist() == [5.0, 6.0, 7.0]
    assert [moves.frames[index].diameter for index in moves.frame] == [True, True, False]


def test_polar_words() -> None:
    moves = follow("G0 @10 ^30\n^90\n@5\nG91 ^90").moves
    assert np.allclose(moves.end[:, :2], [[5 * math.sqrt(3), 5], [0, 10], [0, 5], [-5, 0]])
    assert moves.programmed[:, :2].all()


def test_machine_coordinates_are_passed() -> None:
    followed = follow("G10 L2 P1 X100 Z50\nG0 X1 Z1\nG53 G0 Z0\nX2")
    assert ends(followed) == [[101, 0, 51], [101, 0, 0], [102, 0, 0]]
    assert reasons(followed) == ["", "machine coordinates (G53)", ""]
    assert followed.moves.rule.tolist() == [Rule.CORRECT, Rule.PASS, Rule.CORRECT]


def test_reference_points_go_by_way_of_the_words() -> None:
    references = {"G28": {"X": 10.0, "Y": 20.0, "Z": 30.0}, "G30": {"X": 1.0, "Y": 2.0, "Z": 3.0}}
    followed = follow("G0 X1 Y1 Z1\nG28 Z5\nG91 G30 X0 Y0\nG28", references=references)
    assert ends(followed) == [[1, 1, 1], [1, 1, 5], [1, 1, 30], [1, 2, 30], [10, 20, 30]]
    assert set(reasons(followed)[1:]) == {"reference point (G28)", "reference point (G30)"}


def test_reference_points_can_be_set() -> None:
    assert last(follow("G0 X3 Y4\nG28.1\nG0 X0 Y0\nG28")) == [3, 4, 0]


def test_dwell_moves_nothing() -> None:
    followed = follow("G0 X1\nG4 P2.5\nX2")
    assert followed.moves.kind.tolist() == [MotionKind.RAPID, MotionKind.DWELL, MotionKind.RAPID]
    assert followed.moves.rule[1] == Rule.PASS
    assert np.array_equal(followed.moves.start[1], followed.moves.end[1])


def test_inverse_time_and_feed_per_revolution() -> None:
    moves = follow("S100\nG93 G1 X1 F2\nX2 F4\nG95 X3 F0.2\nG94 X4 F300").moves
    assert moves.feed_mode.tolist() == [93, 93, 95, 94]
    assert moves.feed.tolist() == [2.0, 4.0, 0.2, 300.0]


def test_feed_is_not_known_until_it_is_set() -> None:
    assert np.isnan(follow("G0 X1").moves.feed[0])


@pytest.mark.parametrize(
    ("text", "reason", "end"),
    [
        ("F9 G5 X1 Y2 I1 J0 P0 Q-1", "spline (G5)", [1, 2, 0]),
        ("F9 G5.1 X1 Y2 I1 J0", "spline (G5.1)", [1, 2, 0]),
        ("F9 G5.2 X1 Y2 P1", "spline (G5.2)", [1, 2, 0]),
        ("S1 M3 G33 Z-5 K1", "threading (G33)", [0, 0, -5]),
        ("S1 M3 G33.1 Z-5 K1", "rigid tapping (G33.1)", [0, 0, -5]),
        ("S1 M3 G76 P1 Z-20 I-1 J0.1 K0.5", "threading cycle (G76)", [0, 0, -20]),
    ],
)
def test_what_is_followed_only_as_far_as_its_end_is_refused(text: str, reason: str, end: list[float]) -> None:
    followed = follow(text)
    assert reasons(followed) == [reason]
    assert followed.moves.rule[0] == Rule.REFUSE
    assert last(followed) == end


def test_after_rigid_tapping_the_tool_is_where_it_was() -> None:
    assert last(follow("S1 M3 G0 Z2\nG33.1 Z-5 K1\nG0 X1")) == [1, 0, 2]


def test_cutter_compensation_is_marked_and_the_programmed_contour_followed() -> None:
    moves = follow("F100 G41 D2\nG1 X10\nY10\nG40 X0\nX5").moves
    assert moves.whole.tolist() == [True, True, True, False]
    assert moves.end[:, :2].tolist() == [[10, 0], [10, 10], [0, 10], [5, 10]]
    assert (moves.rule == Rule.CORRECT).all()


def test_across_the_plane_of_an_offset_contour_axes_of_the_plane_get_no_word() -> None:
    moves = follow("F100 G1 X0 Y0 Z5\nG41 D2 X10\nZ1\nY10\nG40 Z5\nX0\nX0 Y0\nZ9").moves
    plane = moves.wordless[:, [moves.axes.index(letter) for letter in "XY"]].tolist()
    assert plane == [
        [False, False],
        [False, False],
        [True, True],
        [False, False],
        [True, True],
        [False, True],
        [False, False],
        [False, False],
    ]


def test_blocks_run_again_give_rows_again() -> None:
    moves = follow("o1 repeat [3]\nG91 G0 X1\no1 endrepeat").moves
    assert moves.block.tolist() == [1, 1, 1]
    assert moves.end[:, 0].tolist() == [1, 2, 3]
