"""Lines and arcs in command space, against a control of the tests' own."""

from __future__ import annotations

import numpy as np
import pytest

from compensate.machines_at_random import TOPOLOGIES, perfect
from compensate.motions import Arc, interpolated, motions
from ncfix.compensate.plan.segments import Segments, sweep_between

MACHINE = perfect(TOPOLOGIES["table-table"])
XYZ = [2, 3, 4]
FUZZ = 1e-11
"""mm: some roundings of numbers of 100 mm."""
NORMALS = [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 0, -1), (1, 2, 3)]


@pytest.mark.parametrize("normal", NORMALS)
@pytest.mark.parametrize("sweep", [0.3, -2.0, 4.5, 2 * np.pi, -2 * np.pi, 15.0])
@pytest.mark.parametrize("rise", [0.0, 7.0])
def test_arcs_are_those_of_the_reference_control(normal: tuple[int, ...], sweep: float, rise: float) -> None:
    arc = Arc((10.0, -5.0, 3.0), normal, sweep, rise, (0.2, -0.1))
    moves = motions(MACHINE, (0.1, 0.2, 30, 40, 50), [arc])
    segments = Segments.of_moves(moves, np.array(XYZ))
    f = np.linspace(0, 1, 50)
    given = {"normal": moves.normal[0], "centre": moves.centre[0], "sweep": sweep}
    expected = interpolated(moves.start[0], moves.end[0], XYZ, given, f)
    np.testing.assert_allclose(segments.at(np.zeros(50, dtype=np.intp), f), expected, rtol=0, atol=FUZZ)


def test_ends_are_met_exactly() -> None:
    moves = motions(MACHINE, (0.1, 0.2, 30, 40, 50), [(1.0, 2.0, 3.3, 4.4, 5.5)])
    segments = Segments.of_moves(moves, np.array(XYZ))
    rows = np.zeros(2, dtype=np.intp)
    np.testing.assert_array_equal(segments.at(rows, np.array([0.0, 1.0])), [moves.start[0], moves.end[0]])


def test_radii_that_differ_change_linearly() -> None:
    """What a control does within its closure allowance: r from 10 to 10.01."""
    moves = motions(MACHINE, (0, 0, 10, 0, 0), [Arc((0, 0, 0), (0, 0, 1), np.pi / 2)])
    moves.end[0, 2:4] = [0.0, 10.01]
    at = Segments.of_moves(moves, np.array(XYZ)).at(np.zeros(3, dtype=np.intp), np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(np.linalg.norm(at[:, 2:], axis=1), [10.0, 10.005, 10.01], atol=FUZZ)


@pytest.mark.parametrize("like", [0.4, -3.0, 2 * np.pi + 0.4, -20.0])
def test_the_sweep_keeps_its_turns_when_ends_move_a_little(like: float) -> None:
    rng = np.random.default_rng(0)
    normal = np.array([[0.0, 0.6, 0.8]])
    spoke = np.cross(normal, [[1.0, 1.0, 0.0]])
    end = np.cos(like) * spoke + np.sin(like) * np.cross(normal, spoke)
    nudge = 1e-3 * rng.normal(size=(1, 3))
    found = sweep_between(spoke + 3 * normal, end + nudge, np.zeros((1, 3)), normal, np.array([like]))
    assert abs(found[0] - like) < 5e-3
