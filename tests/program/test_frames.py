"""Frames: a stack is the product of its parts, and the forms of tilted planes say the same plane."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

from ncfix.control.coordinates import PLANES, Rotation
from ncfix.control.frames import (
    Affine,
    FrameStack,
    euler,
    from_points,
    from_vectors,
    handed,
    mirrored,
    projected,
    shifted,
    spatial,
    turned,
    turned_about,
    turned_in,
)


def matrix(frame: Affine) -> np.ndarray:
    """A frame as a matrix (4, 4) on X Y Z 1."""
    found = np.eye(4)
    found[:3, :3] = frame.scale * np.array(frame.rotation)
    found[:3, 3] = frame.shift[:3]
    return found


def test_a_stack_is_the_product_of_its_parts_from_outside_in() -> None:
    turn = turned({"Z": 30.0, "X": 20.0})
    stack = FrameStack(
        ("datum", "plane", "rotation", "scaling"),
        datum=shifted({0: 10.0, 2: -3.0, 5: 0.5}),
        plane=Affine((1.0, 2.0, 3.0) + (0.0,) * 6, turn.rotation, unknown={1: "why"}),
        rotation=turned_about(turned({"Z": 90.0}).rotation, (5.0, 5.0, 0.0) + (0.0,) * 6),
        scaling=Affine(scale=2.0),
        local=shifted({0: 99.0}),
    )
    parts = (stack.datum, stack.plane, stack.rotation, stack.scaling)
    assert matrix(stack.whole) == pytest.approx(np.linalg.multi_dot([matrix(part) for part in parts]))
    assert stack.whole.shift[5] == 0.5
    assert stack.whole.unknown == {0: "why"}  # Y of the plane is X behind the turn
    assert pickle.loads(pickle.dumps(stack)) == stack


def test_a_turn_about_a_point_leaves_it_where_it_is() -> None:
    frame = turned_about(turned({"Z": 37.0}).rotation, (4.0, -2.0, 1.0) + (0.0,) * 6)
    assert matrix(frame) @ [4, -2, 1, 1] == pytest.approx([4, -2, 1, 1])


def test_each_mirrored_axis_changes_the_hand() -> None:
    assert [handed(mirrored(letters)) for letters in ("", "X", "XY", "XYZ")] == [1.0, -1.0, 1.0, -1.0]


def test_the_forms_of_a_tilted_plane_agree() -> None:
    tilt = math.radians(25.0)
    x, normal = (1.0, 0.0, 0.0), (0.0, -math.sin(tilt), math.cos(tilt))
    along_y = (0.0, math.cos(tilt), math.sin(tilt))
    forms: list[Rotation | None] = [
        euler(0.0, 25.0, 0.0),
        spatial({"X": 25.0}),
        turned({"X": 25.0}, "XYZ").rotation,
        projected(0.0, 25.0, 0.0),
        from_vectors(x, normal),
        from_points((0.0, 0.0, 0.0), x, along_y),
    ]
    for form in forms:
        assert np.array(form) == pytest.approx(np.column_stack([x, along_y, normal]), abs=1e-12)
    assert from_vectors(x, (2.0, 0.0, 0.0)) is None
    assert spatial({"X": 10.0, "Z": 20.0}) != turned({"X": 10.0, "Z": 20.0}, "XZ").rotation


def test_what_is_not_known_of_an_outer_frame_turns_with_the_inner_one() -> None:
    """A work offset that is not known along X hides the numbers of Y in a frame that is turned by 90 degrees."""
    outer, turn = Affine(unknown={0: "why", 4: "C"}), turned_in(PLANES[170], 90.0)
    assert outer.then(turn).unknown == {1: "why", 4: "C"}
    assert outer.then(turned_in(PLANES[170], 30.0)).unknown == {0: "why", 1: "why", 4: "C"}
