"""What a block does comes in a fixed order, not in the order written (LinuxCNC, "Order of execution")."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.control.moves import FeedMode, MotionKind
from program.tracing import ends, follow, last


def test_feed_mode_comes_before_feed() -> None:
    moves = follow("F7 G93 G1 X1 G21").moves
    assert moves.feed_mode[0] == FeedMode.INVERSE_TIME
    assert moves.feed[0] == 7.0


def test_feed_comes_before_motion_and_units_after_feed() -> None:
    """F is taken in the unit in force before the block; what it means once that is inch differs from axis to axis."""
    moves = follow("G1 X1 F100 G20\nX2 F10").moves
    assert np.isnan(moves.feed[0])
    assert moves.feed[1] == 254.0
    assert moves.end[0, 0] == 25.4


def test_tool_change_comes_before_length_offset() -> None:
    setup_tools = follow("T3 M6 G43 G0 Z0").moves
    assert setup_tools.tool[0] == 3


def test_dwell_comes_before_motion() -> None:
    moves = follow("G0 X0\nG4 P1 G0 X5").moves
    assert [int(kind) for kind in moves.kind] == [MotionKind.RAPID, MotionKind.DWELL, MotionKind.RAPID]
    assert moves.end[1, 0] == 0.0
    assert moves.end[2, 0] == 5.0


def test_plane_comes_before_arc() -> None:
    moves = follow("F100 G2 X2 Z0 I1 K0 G18").moves
    assert moves.normal[0].tolist() == [0.0, 1.0, 0.0]


def test_length_offset_comes_before_motion() -> None:
    assert last(follow("G10 L1 P1 Z100\nG0 Z5 G43 H1")) == [0.0, 0.0, 105.0]


def test_coordinate_system_comes_before_motion() -> None:
    assert last(follow("G10 L2 P2 X10\nG0 X1 G55"))[0] == 11.0


def test_distance_mode_comes_before_motion() -> None:
    assert last(follow("G0 X5\nX1 G91"))[0] == 6.0


def test_retract_mode_comes_before_cycle() -> None:
    follow_up = ends(follow("F100 G0 Z10\nG81 X1 Z-1 R2 G98\nG80\nG0 X5"))
    assert follow_up[-1] == [5.0, 0.0, 10.0]


def test_reference_offsets_come_before_motion() -> None:
    """G92.1 acts before the motion of its block."""
    assert last(follow("G92 X-10\nG92.1 G0 X1"))[0] == 1.0


def test_stop_comes_last() -> None:
    assert ends(follow("G0 X1\nM2 G0 X2\nG0 X3")) == [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]


@pytest.mark.parametrize("words", ["G91 G20 G0 X1 Y2", "X1 G0 Y2 G20 G91", "Y2 G20 X1 G91 G0"])
def test_the_order_written_means_nothing(words: str) -> None:
    assert np.allclose(last(follow(f"G0 X10 Y10\n{words}")), [35.4, 60.8, 0.0])
