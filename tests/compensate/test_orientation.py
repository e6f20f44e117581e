"""The strategy `full`: the tool direction where it can be had, nothing wild where it cannot, and the tip always."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from compensate.machines_at_random import TOPOLOGIES, perfect, random_machine
from ncfix.compensate.plan.strategies import Full, PoseSequence, damped
from ncfix.machine import Effect, Machine, State

NANOMETRE = 1e-6
SETTLED = 2e-9
"""rad; the strategy settles rotary corrections to 1e-9."""
LIMIT = np.deg2rad(0.05)


def tilt(machine: Machine, q: np.ndarray, wanted: np.ndarray, state: State) -> np.ndarray:
    """The angle between actual and intended tool direction, rad."""
    tool = np.asarray(machine.tool.direction)
    actual = machine.actual(q, state)[:, :3, :3] @ tool
    meant = machine.nominal(wanted, state.tool_length)[:, :3, :3] @ tool
    return np.linalg.norm(np.cross(actual, meant), axis=1)


def off(machine: Machine, q: np.ndarray, wanted: np.ndarray, state: State) -> np.ndarray:
    gap = machine.actual(q, state)[:, :3, 3] - machine.nominal(wanted, state.tool_length)[:, :3, 3]
    return np.linalg.norm(gap, axis=1)


@pytest.mark.parametrize("kind", ["table-table", "table-head", "head-head"])
def test_far_from_the_poles_the_tool_direction_is_exact(kind: str) -> None:
    rng = np.random.default_rng(1)
    machine = random_machine(rng, TOPOLOGIES[kind], micrometres=30.0, microradians=20.0)
    q = rng.uniform(-200, 200, (1000, 5))
    q[:, machine.axis_names.index("B")] = rng.uniform(1.2, 1.8, 1000)
    q[:, machine.axis_names.index("C")] = rng.uniform(-3, 3, 1000)
    state = State(100.0)
    result = Full().solve(machine, q, state)
    assert result.oriented.all()
    assert tilt(machine, q, q, state).max() > 20e-6
    assert tilt(machine, result.q, q, state).max() < SETTLED
    assert off(machine, result.q, q, state).max() < NANOMETRE


def tilting(size: float) -> Machine:
    """A table-table machine whose spindle is tilted sideways and whose table wobbles."""
    effects = (Effect("EA0S", (size,)), Effect("EBX", (size / 2,)), Effect("EXX", (0.02,)))
    return perfect(TOPOLOGIES["table-table"]).replace(effects=effects)


def sweep() -> tuple[np.ndarray, np.ndarray]:
    """B from 1e-6 to 10 degrees in each of 360 directions of C, (n, 5), and B."""
    b = np.concatenate([[0.0], np.deg2rad(np.geomspace(1e-6, 10, 60))])
    c = np.deg2rad(np.arange(360.0))
    grid_b, grid_c = (grid.ravel() for grid in np.meshgrid(b, c, indexing="ij"))
    return np.stack([grid_c, grid_b, 0 * grid_b + 50, 0 * grid_b - 30, 0 * grid_b + 80], axis=1), grid_b


def test_near_the_pole_nothing_runs_away(capsys: pytest.CaptureFixture[str]) -> None:
    """Hazard 4: no NaN, no correction above the limit, the tip exact, and it says where the direction is not held.

    An undamped correction of 20 urad would need 6.6 degrees of C at B = 0.01 degree.
    """
    machine, state = tilting(20e-6), State(100.0)
    q, b = sweep()
    result = Full().solve(machine, q, state)
    turn = (result.q - q)[:, machine.rotary]
    assert np.isfinite(result.q).all()
    assert np.abs(turn).max() <= LIMIT
    assert off(machine, result.q, q, state).max() < NANOMETRE
    assert not result.oriented[b < np.deg2rad(0.5)].any()
    assert result.oriented[b > np.deg2rad(5)].all()
    assert tilt(machine, result.q, q, state)[result.oriented].max() < SETTLED
    assert (tilt(machine, result.q, q, state) <= tilt(machine, q, q, state) + SETTLED).all()
    with capsys.disabled():
        print(f"\nlargest rotary correction near the pole: {np.rad2deg(np.abs(turn).max()):.4f} degree", end="")


def test_the_correction_is_continuous_into_the_pole() -> None:
    """Halving the steps of B halves the steps of the correction; in the pole the correction of C has faded to 0."""
    machine, state = tilting(50e-6), State(100.0)
    jumps = []
    for count in (400, 800):
        b = np.linspace(0.0, 0.2, count)
        q = np.stack([0.7 + 0 * b, b, 50 + 0 * b, 0 * b, 0 * b], axis=1)
        turn = (Full().solve(machine, q, state).q - q)[:, :2]
        jumps.append(np.abs(np.diff(turn, axis=0)).max())
    assert jumps[1] < 0.6 * jumps[0]
    assert abs(turn[0, 0]) < 1e-12


@pytest.mark.parametrize("size", [20e-6, 200e-6, 2e-3])
def test_no_error_makes_a_correction_above_the_limit(size: float) -> None:
    machine = tilting(size)
    q, _ = sweep()
    for most in (LIMIT, 1e-4):
        turn = (Full(most=most).solve(machine, q, State(100.0)).q - q)[:, machine.rotary]
        assert np.abs(turn).max() <= most


def test_damping_is_least_squares_where_nothing_is_singular() -> None:
    rng = np.random.default_rng(2)
    tilts, error = rng.normal(size=(200, 2, 2)), 1e-5 * rng.normal(size=(200, 2))
    turn, free = damped(tilts, error, LIMIT)
    expected = -np.linalg.solve(tilts, error[..., None])[..., 0]
    np.testing.assert_allclose(turn[free], expected[free], rtol=1e-9, atol=1e-15)
    assert free.mean() > 0.9


def test_three_rotary_axes_take_the_shortest_way_and_one_does_what_it_can() -> None:
    rng = np.random.default_rng(3)
    tilts, error = rng.normal(size=(50, 2, 3)), 1e-5 * rng.normal(size=(50, 2))
    turn, free = damped(tilts, error, LIMIT)
    expected = np.array([-np.linalg.pinv(a) @ e for a, e in zip(tilts, error, strict=True)])
    np.testing.assert_allclose(turn[free], expected[free], rtol=1e-8, atol=1e-15)
    single, _ = damped(tilts[:, :, :1], error, LIMIT)
    best = -np.einsum("ni,ni->n", tilts[:, :, 0], error) / (tilts[:, :, 0] ** 2).sum(axis=1)
    away = np.linalg.norm(tilts[:, :, 0], axis=1) > 0.2
    np.testing.assert_allclose(single[away, 0], best[away], rtol=1e-9, atol=1e-15)


def test_the_correction_changes_no_faster_along_a_path_than_allowed() -> None:
    """Through the pole, where the direction of the correction turns round."""
    machine, state = tilting(50e-6), State(100.0)
    b = np.linspace(-0.3, 0.3, 601)
    q = np.stack([0 * b, b, 50 + 0 * b, 20 + 0 * b, 0 * b], axis=1)
    strategy = Full(per_mm=0.0, per_rad=1e-4)
    way = np.concatenate([[0.0], np.abs(np.diff(b))])
    none = np.zeros(len(b), dtype=bool)
    path = PoseSequence(np.zeros(len(b)), way, none, none, np.zeros((len(b), 2)))
    free, held = (strategy.solve(machine, q, state, given) for given in (None, path))
    rate = np.abs(np.diff((held.q - q)[:, :2], axis=0)).max(axis=1) / way[1:]
    assert np.abs(np.diff((free.q - q)[:, :2], axis=0)).max() / way[1] > 1e-2
    assert rate.max() <= 1e-4 * (1 + 1e-6)
    assert off(machine, held.q, q, state).max() < NANOMETRE
    assert not held.oriented.all()


def test_a_machine_without_rotary_axes_is_corrected_in_position() -> None:
    machine = random_machine(np.random.default_rng(4), TOPOLOGIES["three-axis"])
    q = np.random.default_rng(5).uniform(-100, 100, (50, 3))
    result = Full().solve(machine, q, State(50.0))
    assert off(machine, result.q, q, State(50.0)).max() < NANOMETRE
    assert not result.oriented.any()


def test_an_axis_at_the_end_of_its_travel_is_held_there() -> None:
    """B from 0 to 120 degrees; at 0 it would have to go below, at -1e-3 the program itself does."""
    machine = tilting(-20e-6)
    b = machine.axis_names.index("B")
    stop = dataclasses.replace(machine.axes[b], range=(0.0, 2.0))
    machine = machine.replace(axes=(*machine.axes[:b], stop, *machine.axes[b + 1 :]))
    q = np.zeros((360 * 3, 5))
    q[:, machine.axis_names.index("C")] = np.tile(np.deg2rad(np.arange(360.0)), 3)
    q[:, b] = np.repeat([0.0, 1e-5, -1e-3], 360)
    result = Full().solve(machine, q, State(100.0))
    assert (result.q[:720, b] >= 0.0).all()
    assert (result.q[720:, b] >= -1e-3).all()
    assert (result.q[:360, b] == 0.0).all()
    assert off(machine, result.q, q, State(100.0)).max() < NANOMETRE
    assert not result.oriented.any()
