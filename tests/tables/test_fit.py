"""Least squares over the neighbourhood of nodes: what tables can say is kept, the rest comes as near as it can."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.tables.grid import Grid, between, fitted, hats, projector

NODES = np.array([-10.0, -4.0, 1.0, 12.0])


def test_weights_add_up_to_one_and_are_held_beyond_the_ends() -> None:
    weights = hats(np.array([-99.0, -10.0, -7.0, 0.0, 12.0, 99.0]), NODES)
    assert weights.sum(axis=1) == pytest.approx(np.ones(6))
    assert weights[0].tolist() == [1, 0, 0, 0]
    assert weights[2].tolist() == [0.5, 0.5, 0, 0]


def test_what_is_linear_between_nodes_is_kept() -> None:
    values = np.array([3.0, -1.0, 4.0, 1.5])
    places = between(NODES)
    assert projector(places, NODES) @ np.interp(places, NODES, values) == pytest.approx(values, abs=1e-12)


def test_a_grid_is_fitted_as_all_its_nodes_together_would_be() -> None:
    """One axis after another gives what one large system of all nodes gives."""
    nodes = (np.array([0.0, 1.0, 3.0]), np.array([-1.0, 2.0]))
    places = tuple(between(line) for line in nodes)
    mesh = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1)
    values = np.sin(mesh[..., :1]) * np.exp(mesh[..., 1:] / 3)
    both = np.einsum("ai,bj->abij", hats(places[0], nodes[0]), hats(places[1], nodes[1])).reshape(values.size, -1)
    expected, *_ = np.linalg.lstsq(both, values.reshape(-1), rcond=None)
    assert fitted(values, places, nodes).reshape(-1) == pytest.approx(expected, abs=1e-10)


def test_a_parabola_is_left_with_half_of_what_its_chords_leave() -> None:
    nodes = np.linspace(0.0, 4.0, 9)
    fine = np.linspace(0.0, 4.0, 801)
    chord = np.interp(fine, nodes, nodes**2) - fine**2
    fit = projector(between(nodes, 16), nodes) @ between(nodes, 16) ** 2
    grid = Grid(("X",), (nodes,), ("X",), fit[:, None])
    inside = np.abs(grid.at(fine[:, None])[:, 0] - fine**2)[100:-100]
    assert chord.max() == pytest.approx(0.5**2 / 4, rel=1e-6)  # h^2 f'' / 8
    assert inside.max() < 0.7 * chord.max()
