"""Rigid motions against pytransform3d and sympy."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pytransform3d.rotations import compact_axis_angle_from_matrix, matrix_from_compact_axis_angle
from pytransform3d.transformations import invert_transform, transform_from_exponential_coordinates

from ncfix.machine import se3

vectors = arrays(np.float64, (4, 3), elements=st.floats(-3, 3, allow_subnormal=False))
twists = arrays(np.float64, (4, 6), elements=st.floats(-3, 3, allow_subnormal=False))


@given(vectors)
def test_rotations(vector: np.ndarray) -> None:
    expected = np.array([matrix_from_compact_axis_angle(each) for each in vector])
    np.testing.assert_allclose(se3.rotation(vector), expected, atol=1e-14)


def test_the_printed_example_of_a_rotation() -> None:
    """Ellingsdalen 2021, section 2: w = (0, .866, .5), 30 degrees, three printed digits, .8995 cut off."""
    turned = se3.rotation(np.deg2rad(30) * np.array([0.0, 0.866, 0.5]))
    expected = [[0.866, -0.250, 0.433], [0.250, 0.967, 0.058], [-0.433, 0.058, 0.899]]
    np.testing.assert_allclose(turned, expected, atol=6e-4)


@pytest.mark.parametrize(
    "angle", [0.0, 1e-15, 1e-9, 1e-4, 0.03, 0.0316, 0.0317, 1.0, 3.1, np.pi - 1e-5, np.pi - 1e-9, np.pi]
)
def test_rotation_vectors_come_back_over_the_whole_half_turn(angle: float) -> None:
    axis = np.array([0.6, -0.64, 0.48])
    back = se3.rotation_vector(se3.rotation(angle * axis))
    assert np.abs(back - angle * axis).max() <= 1e-7 * (angle > 3.14) + 1e-15 + 1e-15 * angle
    np.testing.assert_allclose(se3.rotation(back), se3.rotation(angle * axis), atol=1e-14)


@given(vectors)
def test_rotation_vectors_against_the_oracle(vector: np.ndarray) -> None:
    matrices = se3.rotation(vector)
    for matrix, mine in zip(matrices, se3.rotation_vector(matrices), strict=True):
        theirs = compact_axis_angle_from_matrix(matrix)
        np.testing.assert_allclose(se3.rotation(mine), matrix_from_compact_axis_angle(theirs), atol=2e-7)


def test_the_factors_of_rodrigues_formulas() -> None:
    for squared in (0.0, 1e-12, 1e-5, 0.0199, 0.0201, 0.5, 9.0):
        a = sympy.sqrt(sympy.Float(squared, 40))
        exact = [1, sympy.Rational(1, 2), sympy.Rational(1, 6)]
        if squared:
            exact = [sympy.sin(a) / a, (1 - sympy.cos(a)) / a**2, (a - sympy.sin(a)) / a**3]
        for alone in (np.array([squared]), np.array([squared, 4.0])):
            factors = (*se3.rotation_factors(alone), se3.screw_factor(alone))
            got = [float(each[0]) for each in factors]
            np.testing.assert_allclose(got, [float(each) for each in exact], rtol=3e-14)


@given(twists)
def test_screws(twist: np.ndarray) -> None:
    expected = [transform_from_exponential_coordinates(np.roll(each, 3)) for each in twist]
    np.testing.assert_allclose(se3.exp(twist), expected, atol=1e-11)


@given(twists)
def test_inverse_undoes(twist: np.ndarray) -> None:
    motion = se3.exp(twist)
    np.testing.assert_allclose(se3.inverse(motion), [invert_transform(each) for each in motion], atol=1e-14)
    np.testing.assert_allclose(motion @ se3.inverse(motion), np.broadcast_to(np.eye(4), (4, 4, 4)), atol=1e-14)


def test_a_turn_leaves_its_axis_where_it_is() -> None:
    point, direction = np.array([10.0, 20.0, 30.0]), np.array([0.0, 0.6, 0.8])
    motion = se3.turn(1.1 * direction, point)
    np.testing.assert_allclose(
        se3.apply(motion, point + np.outer([0, 5], direction)), point + np.outer([0, 5], direction)
    )


def test_skew_is_the_vector_product() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 5, 3))
    np.testing.assert_allclose((se3.skew(a) @ b[..., None])[..., 0], np.cross(a, b), atol=1e-15)
