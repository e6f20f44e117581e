"""Canned cycles: one motion per hole, and where the control stands after it."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.control.moves import MotionKind, Rule
from ncfix.diagnostics import SourceError
from program.tracing import ends, follow, last


def holes(text: str, **given: object) -> list[list[float]]:
    """The bottoms of the holes."""
    followed = follow(f"F100 G0 Z10\n{text}", **given)  # type: ignore[arg-type]
    rows = zip(followed.moves.kind, ends(followed), strict=True)
    return [end for kind, end in rows if kind == MotionKind.CYCLE]


@pytest.mark.parametrize(
    "code", ["G81", "G82 P1", "G83 Q1", "G73 Q1", "G85", "G89 P1", "M3 G86 P1", "M3 G84", "M4 G74", "M3 G88 P1"]
)
def test_every_cycle_drills(code: str) -> None:
    assert holes(f"{code} X1 Y2 Z-3 R2\nX5") == [[1, 2, -3], [5, 2, -3]]


def test_after_a_hole_the_tool_is_at_r_or_where_it_began() -> None:
    text = "F100 G0 Z10\n{} G81 X1 Z-3 R2\nG80\nG0 X9"
    assert last(follow(text.format("G98"))) == [9, 0, 10]
    assert last(follow(text.format("G99"))) == [9, 0, 2]
    assert last(follow("F100 G98 G81 X1 Z-3 R2\nG80\nG0 X9")) == [9, 0, 2]


def test_linuxcnc_begins_with_g99_and_iso_controls_with_g98() -> None:
    text = "F100 G0 Z10\nG81 X1 Z-3 R2\nG80\nG0 X9"
    assert last(follow(text))[2] == 2.0
    assert last(follow(text, dialect="iso"))[2] == 10.0


def test_the_next_motion_starts_above_the_hole() -> None:
    moves = follow("F100 G0 Z10\nG99 G81 X1 Z-3 R2\nX2").moves
    assert moves.start[2].tolist() == [1, 0, 2]
    assert moves.modal[1:].tolist() == [810, 810]
    assert (moves.rule == Rule.CORRECT).all()


def test_r_and_depth_stay_in_force_and_change_singly() -> None:
    assert holes("G81 X1 Z-3 R2\nX2\nX3 Z-4\nX4 R1\nX5") == [[1, 0, -3], [2, 0, -3], [3, 0, -4], [4, 0, -4], [5, 0, -4]]


def test_increments_and_repeats() -> None:
    assert holes("G91 G81 X1 Y1 R-2 Z-1 L3\nX1") == [[1, 1, 7], [2, 2, 7], [3, 3, 7], [4, 3, 7]]


def test_holes_by_radius_and_angle() -> None:
    """As `rs274` has them: in G91 every repeat adds the angle and the radius, and X and Y stand at the last hole."""
    circle = holes("X4 Y0\nG81 ^90 Z-3 R2\n^180\n@2\nG91 ^90 @1 R0 L2\nG80\nG90 G81 X9 Z-3 R2")
    expected = [[0, 4, -3], [-4, 0, -3], [-2, 0, -3], [0, -3, 7], [4, 0, 7], [9, 0, -3]]
    assert np.allclose(circle, expected, atol=1e-9)


def test_incremental_r_counts_from_where_the_series_began() -> None:
    """LinuxCNC 2.9: also where G99 has left the tool lower."""
    assert holes("G99 G90 G81 X1 R2 Z-1\nG91 X1\nG90 X1") == [[1, 0, -1], [2, 0, 11], [1, 0, -1]]


def test_repeats_in_place() -> None:
    assert holes("G81 X1 Z-3 R2 L2") == [[1, 0, -3], [1, 0, -3]]


def test_k_repeats_on_iso_controls() -> None:
    assert len(holes("G91 G81 X1 R-2 Z-1 K4", dialect="iso")) == 4
    assert holes("G81 X1 R-2 Z-3 K0\nX2", dialect="iso") == [[2, 0, -3]]


def test_other_planes() -> None:
    assert holes("G18 G81 X1 Z3 Y-1 R1") == [[1, -1, 3]]
    assert holes("G19 G81 Y1 Z3 X-1 R1") == [[-1, 1, 3]]


def test_offsets_and_rotation() -> None:
    found = holes("G10 L2 P1 X10 Z100 R90\nG81 X1 Y0 Z-1 R2\nX5 Y3")
    assert np.allclose(found, [[10, 1, 99], [7, 5, 99]])


def test_g80_ends_the_cycle() -> None:
    with pytest.raises(SourceError) as caught:
        follow("F100 G81 X1 Z-1 R1\nG80\nX5")
    assert caught.value.code == "NCF221"


def test_on_iso_controls_the_code_before_the_cycle_comes_back() -> None:
    moves = follow("F100 G0 Z10\nG81 X1 Z-1 R1\nG80\nX5", dialect="iso").moves
    assert moves.kind[-1] == MotionKind.RAPID


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("G81 X1 Z-1", "NCF226"),
        ("G81 X1 R1", "NCF226"),
        ("G82 X1 Z-1 R1", "NCF226"),
        ("G83 X1 Z-1 R1", "NCF226"),
        ("G83 X1 Z-1 R1 Q0", "NCF226"),
        ("G87 X1 Z-1 R1", "NCF226"),
        ("G81 X1 Z2 R1", "NCF226"),
        ("G81 X1 A5 Z-1 R1", "NCF226"),
        ("G81 X1 Z-1 R1 L0", "NCF226"),
        ("G41 D1 G81 X1 Z-1 R1", "NCF226"),
        ("G93 G81 X1 Z-1 R1", "NCF225"),
        ("G94 G81 X1 Z-1 R1", "NCF225"),
        ("G81 X1 Z-1 R1\nG83 X2 Z-1 Q1", "NCF226"),
        ("G81", "NCF221"),
    ],
)
def test_what_linuxcnc_refuses_is_refused(text: str, code: str) -> None:
    with pytest.raises(SourceError) as caught:
        follow(f"F100\n{text}", axes="XYZA")
    assert caught.value.code == code
