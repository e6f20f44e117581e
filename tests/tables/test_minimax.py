"""What sums of functions of two axes can do against the largest error, and the bound below which they cannot go."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.arrays import Array
from ncfix.tables.lower_bounds import least_worst

LINES = [np.linspace(-1, 1, 6), np.linspace(-1, 1, 5), np.linspace(0, 1, 7)]
X, Y, Z = np.meshgrid(*LINES, indexing="ij")
TURNS = [False] * 3


def test_what_pairs_can_say_is_said_wholly() -> None:
    found = least_worst(LINES, TURNS, (X * Y + np.sin(Z) * X + Z**2)[..., None], 0.0)
    assert found.largest < 1e-12  # rounding
    assert found.bound < 1e-12


def test_of_a_product_of_three_the_corners_say_how_much_is_left() -> None:
    """x y z over [-1, 1]^2 x [0, 1]: the eight corners, signs in turn, give 1/2, and x y / 2 leaves that."""
    found = least_worst(LINES, TURNS, (X * Y * Z)[..., None], 0.0)
    assert found.bound <= 0.5 + 1e-12
    assert found.bound == pytest.approx(0.5, rel=0.05)
    assert found.largest == pytest.approx(0.5, abs=1e-12)  # rounding


@pytest.mark.parametrize("seed", range(3))
def test_no_functions_of_pairs_go_below_the_bound(seed: int) -> None:
    """Whatever is added of functions of pairs, the largest error stays above it."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(*X.shape, 2)) * np.exp(2 * X * Y * Z)[..., None]
    found = least_worst(LINES, TURNS, values, 0.0)
    assert 0 < found.bound <= found.largest
    for _ in range(20):
        assert np.linalg.norm(found.values + 0.2 * _pairs(rng), axis=-1).max() >= found.bound


def _pairs(rng: np.random.Generator) -> Array:
    sides = [rng.normal(size=(*(1 if axis == gone else n for axis, n in enumerate(X.shape)), 2)) for gone in range(3)]
    total: Array = sides[0] + sides[1] + sides[2]
    return total


def test_the_largest_error_is_lower_than_that_of_least_squares() -> None:
    values = (X * Y * np.exp(2 * Z))[..., None]
    squares = least_worst(LINES, TURNS, values, np.inf)
    found = least_worst(LINES, TURNS, values, 0.0)
    assert found.largest < 0.9 * squares.largest
    assert found.largest <= 1.1 * found.bound


def test_between_nodes_it_is_a_spline_that_repeats_with_the_turn() -> None:
    """cos c x y, c over a turn without its end: a quarter of a step further it is what the cosine is there."""
    turn = 2 * np.pi * np.arange(12) / 12
    c, x, y = np.meshgrid(turn, LINES[0], LINES[1], indexing="ij")
    found = least_worst([turn, *LINES[:2]], [True, False, False], (np.cos(c) * x * y)[..., None], np.inf)
    places = np.array([[0, 5, 4], [0, 0, 4]])
    at = found.along(0, np.array([turn[3] + 0.13, turn[11] + 0.13]), places)[..., 0]
    expected = np.cos([turn[3] + 0.13, turn[11] + 0.13])[:, None] * [1.0, -1.0]
    assert at == pytest.approx(expected, abs=2e-3)
