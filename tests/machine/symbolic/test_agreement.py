"""The symbolic formulas against the fast engine, an independent chain (pytransform3d), and each other's remainder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pytransform3d.rotations import compact_axis_angle_from_matrix

from conftest import some
from machine import chains, oracle
from machine.chains import a_few_errors, arguments, near_axes
from ncfix.machine import Axis, Machine, State
from ncfix.machine.symbolic import derive
from ncfix.machine.symbolic.printing import compiled

RELATIVE = 1e-12
"""Both sides are a few dozen products in double precision."""
LENGTH = 120.0
CHAINS, LONGEST = some(24), 5
"""How many random chains, of how many joints at most; tests/validation/random_chains.py compares a thousand."""
REACH = 1000.0
"""mm: the size of a chain with points, strokes and a tool of a few hundred mm each."""


def large(machine: Machine, values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: values[name] for name in machine.axis_names}


@pytest.mark.parametrize("seed", range(CHAINS))
def test_random_chains_agree_with_the_fast_engine(seed: int) -> None:
    """Nominal pose, and first order: the joints' Jacobians times the joints' errors."""
    rng = np.random.default_rng(seed)
    joints = 2 + seed % (LONGEST - 1)
    machine = a_few_errors(rng, near_axes(rng, chains.random_chain(rng, joints)))
    q = chains.random_positions(rng, machine, 20)
    values = arguments(machine, q)
    nominal, error = compiled(derive(machine, include="machine"))
    pose = machine.nominal(q, LENGTH)
    found = nominal(**large(machine, values), tool_length=LENGTH)
    np.testing.assert_allclose(found[:, :3], pose[:, :3, 3], rtol=0, atol=REACH * RELATIVE)
    np.testing.assert_allclose(found[:, 3:], pose[:, :3, :3] @ machine.tool.direction, rtol=0, atol=10 * RELATIVE)
    expected = np.einsum("nijk,njk->ni", machine.jacobians(q, LENGTH).joints, machine.joint_errors(q, State(LENGTH)))
    first = error(**values, tool_length=LENGTH)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(first[:, :3], expected[:, :3], rtol=0, atol=10 * RELATIVE * scale)
    np.testing.assert_allclose(first[:, 3:], expected[:, 3:], rtol=0, atol=10 * RELATIVE * largest_angle(values))


def largest_angle(values: dict[str, np.ndarray]) -> float:
    """The largest error angle in play, rad."""
    return float(
        max([1e-9, *(np.abs(value).max() for name, value in values.items() if name[:2] in ("EA", "EB", "EC"))])
    )


@pytest.mark.parametrize("frame", [False, True])
@pytest.mark.parametrize("seed", range(some(3)))
def test_error_axes_and_moving_error_frames(seed: int, frame: bool) -> None:
    rng = np.random.default_rng(seed)
    plain = near_axes(rng, chains.random_chain(rng, 3))
    tilted = (1.0, 0.0, 0.0), (0.0, 0.5**0.5, 0.5**0.5), (0.0, -(0.5**0.5), 0.5**0.5)
    axes = tuple(
        Axis(a.name, a.rotary, a.workpiece_side, a.direction, a.point, error_axes=tilted, moving_frame=frame)
        for a in plain.axes
    )
    machine = a_few_errors(rng, plain.replace(axes=axes), 10)
    q = chains.random_positions(rng, machine, 10)
    _, error = compiled(derive(machine, include="machine"))
    expected = np.einsum("nijk,njk->ni", machine.jacobians(q, LENGTH).joints, machine.joint_errors(q, State(LENGTH)))
    found = error(**arguments(machine, q), tool_length=LENGTH)
    np.testing.assert_allclose(found, expected, rtol=0, atol=10 * RELATIVE * np.abs(expected).max())


@pytest.mark.parametrize("topology", ["w C B F X Y Z t", "w C F X Y Z B t", "w X F Y Z C A t", "w Y X F Z t"])
def test_every_column_equals_the_jacobian_of_its_joint(topology: str) -> None:
    """All error motions of the four kinds of machine at once."""
    machine = chains.four_kinds()[topology]
    rng = np.random.default_rng(7)
    q = chains.random_positions(rng, machine, 5)
    jacobian = machine.jacobians(q, LENGTH).joints
    derivation = derive(machine, include="motions")
    _, error = compiled(derivation)
    positions = {axis.name: q[:, i] for i, axis in enumerate(machine.axes)}
    for joint, axis in enumerate(machine.axes):
        for k, component in enumerate("XYZABC"):
            column = error(**positions, tool_length=LENGTH, **{f"E{component}{axis.name}": 1.0})
            np.testing.assert_allclose(column, jacobian[:, :, joint, k], rtol=0, atol=REACH * RELATIVE)


@pytest.mark.parametrize("seed", range(some(3)))
def test_first_order_equals_numeric_differentiation_of_an_independent_chain(seed: int) -> None:
    """Central differences of fourth order of the oracle's exact composition: good to 1e-9."""
    rng = np.random.default_rng(seed)
    machine = a_few_errors(rng, near_axes(rng, chains.random_chain(rng, 4)), 8)
    q = chains.random_positions(rng, machine, 1)
    _, error = compiled(derive(machine, include="machine"))
    values = arguments(machine, q)
    for effect in machine.effects:

        def along(t: float, effect=effect) -> np.ndarray:
            scaled = tuple(t * c for c in np.atleast_1d(effect.coefficients) / values[effect.name][0])
            alone = machine.replace(effects=(replace(effect, coefficients=scaled),))
            return six(oracle.actual(alone, q[0], LENGTH), oracle.nominal(machine, q[0], LENGTH))

        h = 1e-3
        slope = (8 * (along(h) - along(-h)) - (along(2 * h) - along(-2 * h))) / (12 * h)
        found = error(**large(machine, values), tool_length=LENGTH, **{effect.name: 1.0})[0]
        np.testing.assert_allclose(found, slope, rtol=0, atol=1e-9 * max(1.0, np.abs(slope).max()))


def six(actual: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """Actual minus nominal as shift and rotation vector."""
    turn = actual[:3, :3] @ nominal[:3, :3].T
    return np.concatenate([actual[:3, 3] - nominal[:3, 3], compact_axis_angle_from_matrix(turn)])


@pytest.mark.parametrize("seed", range(some(4)))
def test_second_order_explains_the_remainder(seed: int) -> None:
    """Exact minus first order shrinks with the square of the errors, exact minus second order with the cube."""
    rng = np.random.default_rng(seed)
    machine = a_few_errors(rng, near_axes(rng, chains.random_chain(rng, 4)), 8)
    q = chains.random_positions(rng, machine, 10)
    functions = [compiled(derive(machine, order, include="machine"))[1] for order in (1, 2)]
    left = np.empty((2, 2))
    for column, size in enumerate((40.0, 20.0)):
        bigger = machine.replace(
            effects=tuple(
                replace(effect, coefficients=tuple(size * c for c in effect.coefficients)) for effect in machine.effects
            )
        )
        exact = bigger.error(q, State(LENGTH))
        values = arguments(bigger, q)
        left[:, column] = [np.abs(exact - f(**values, tool_length=LENGTH)).max() for f in functions]
    ratio = left[:, 0] / left[:, 1]
    assert ratio[0] == pytest.approx(4, rel=0.1)
    assert ratio[1] == pytest.approx(8, rel=0.2)
    assert left[1, 0] < 0.05 * left[0, 0]
