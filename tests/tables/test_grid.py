"""Grids between, on and beyond their nodes; sums, products and directions of tables."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.grid import Grid, spline_weights

EIGHT = np.arange(24.0).reshape(2, 2, 2, 3) ** 1.5
CUBE = Grid(("X", "Y", "Z"), (np.array([0.0, 10.0]),) * 3, ("X", "Y", "Z"), EIGHT)
part = st.floats(0, 1)


def line(values: list[float], modulo: bool = False) -> Grid:
    return Grid(("X",), (np.arange(len(values), dtype=float),), ("X",), np.array(values)[:, None], (modulo,))


@given(part, part, part)
def test_the_published_formula_of_eight_vertices(x: float, y: float, z: float) -> None:
    """Fanuc A-79351E, p. 3: vertices P1 ... P8 with P1-P2 along X, P1-P4 along Y, P1-P5 along Z."""
    c1, c2, c3, c4 = EIGHT[0, 0, 0], EIGHT[1, 0, 0], EIGHT[1, 1, 0], EIGHT[0, 1, 0]
    c5, c6, c7, c8 = EIGHT[0, 0, 1], EIGHT[1, 0, 1], EIGHT[1, 1, 1], EIGHT[0, 1, 1]
    below = c1 * (1 - x) * (1 - y) + c2 * x * (1 - y) + c3 * x * y + c4 * (1 - x) * y
    above = c5 * (1 - x) * (1 - y) + c6 * x * (1 - y) + c7 * x * y + c8 * (1 - x) * y
    expected = below * (1 - z) + above * z
    found = CUBE.at(np.array([[10 * x, 10 * y, 10 * z]]))[0]
    assert found == pytest.approx(expected, abs=1e-10)  # rounding of eight products of numbers up to 110


def test_nodes_are_met_exactly() -> None:
    corners = np.array([[x, y, z] for x in (0, 10) for y in (0, 10) for z in (0, 10)], dtype=float)
    assert (CUBE.at(corners) == EIGHT.reshape(8, 3)).all()


def test_ends_are_held_and_modulo_repeats() -> None:
    at = np.array([[-5.0], [0.5], [2.0], [2.5], [7.0]])
    assert line([1, 3, 5]).at(at)[:, 0].tolist() == [1, 2, 5, 5, 5]
    assert line([1, 3, 1], modulo=True).at(at)[:, 0].tolist() == [3, 2, 1, 2, 3]


def test_one_node_is_a_constant() -> None:
    one = Grid(("X",), (np.array([3.0]),), ("Y",), np.array([[7.0]]))
    assert one.at(np.array([[-1.0], [9.0]])).tolist() == [[7], [7]]


def test_a_sum_a_product_and_a_direction_pair() -> None:
    double = Grid(("Y",), (np.array([0.0, 1.0]),), ("X",), np.array([[0.0], [2.0]]))
    plain, forward, reverse = line([1, 3]), line([8, 8]), line([2, 2])
    pair = (Term((forward,), ("X", 1)), Term((reverse,), ("X", -1)))
    tables = Compensation((Term((plain,)), Term((plain, double)), *pair))
    q = np.array([[0.5, 0.5]] * 3)
    ways = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 0.0]])
    assert tables.at(("X", "Y"), q, ways).tolist() == [[12, 0], [6, 0], [9, 0]]


@pytest.mark.parametrize("nodes", [[0.0, 0.0], [1.0, 0.0]])
def test_nodes_must_ascend(nodes: list[float]) -> None:
    with pytest.raises(ValueError, match="ascend"):
        Grid(("X",), (np.array(nodes),), ("X",), np.zeros((2, 1)))


def test_shapes_must_fit() -> None:
    with pytest.raises(ValueError, match="shape"):
        Grid(("X",), (np.array([0.0, 1.0]),), ("X",), np.zeros((3, 1)))
    with pytest.raises(ValueError, match="3 inputs"):
        CUBE.at(np.zeros((4, 2)))


@pytest.mark.parametrize("turn", [None, 7.0])
@pytest.mark.parametrize("count", range(2, 9))
def test_splines_are_those_of_scipy(count: int, turn: float | None) -> None:
    rng = np.random.default_rng(count)
    nodes, values = np.sort(rng.uniform(0, 6, count)), rng.normal(size=(count, 3))
    places = rng.uniform(-3, 9, 40)
    line, curve = nodes, values
    if turn:
        line, curve = np.append(nodes, nodes[0] + turn), np.concatenate([values, values[:1]])
    expected = CubicSpline(line, curve, bc_type="periodic" if turn else "not-a-knot")(places)
    assert spline_weights(nodes, places, turn) @ values == pytest.approx(expected, rel=1e-9, abs=1e-9)
