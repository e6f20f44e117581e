"""Jacobians, joint errors and design matrices against finite differences and the exact model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import some
from machine import chains
from ncfix.machine import Effect, Machine, State, se3
from ncfix.machine.basis import Backlash, Fourier, Polynomial
from ncfix.machine.piecewise import PiecewiseLinear

seeds = st.integers(0, 10**6)


def pose_difference(high: np.ndarray, low: np.ndarray) -> np.ndarray:
    """[dx dy dz rx ry rz] from one pose to another, (..., 6)."""
    turn = se3.rotation_vector(high[..., :3, :3] @ np.swapaxes(low[..., :3, :3], -1, -2))
    return np.concatenate([high[..., :3, 3] - low[..., :3, 3], turn], axis=-1)


@settings(max_examples=some(30), deadline=None)
@given(seed=seeds, joints=st.integers(1, 7))
def test_axis_jacobians_are_central_differences(seed: int, joints: int) -> None:
    rng = np.random.default_rng(seed)
    machine = chains.random_chain(rng, joints)
    q, length, h = chains.random_positions(rng, machine, 3), rng.uniform(0, 300, 3), 1e-5
    jacobian = machine.jacobians(q, length).axes
    for k in range(joints):
        step = h * np.eye(joints)[k]
        difference = pose_difference(machine.nominal(q + step, length), machine.nominal(q - step, length)) / (2 * h)
        np.testing.assert_allclose(jacobian[..., k], difference, atol=1e-6)
    np.testing.assert_array_equal(machine.axis_jacobian(q, length), jacobian)


@settings(max_examples=some(30), deadline=None)
@given(seed=seeds, joints=st.integers(1, 6))
def test_joint_jacobians_are_differences_of_the_exact_model(seed: int, joints: int) -> None:
    """Each component of each joint, and of the spindle, as a constant error of +-h."""
    rng = np.random.default_rng(seed)
    machine = moving_frames(rng, chains.random_chain(rng, joints))
    q, h = chains.random_positions(rng, machine, 2), 1e-6
    jacobian = machine.jacobians(q, 120.0).joints
    for index, joint in enumerate((*machine.axis_names, "S")):
        for k, component in enumerate("XYZABC"):
            high, low = (
                machine.replace(effects=(Effect(f"E{component}{joint}", (sign * h,)),)).actual(q, State(120.0))
                for sign in (1, -1)
            )
            np.testing.assert_allclose(jacobian[:, :, index, k], pose_difference(high, low) / (2 * h), atol=1e-5)


def moving_frames(rng: np.random.Generator, machine: Machine) -> Machine:
    """Tilted error axes for all, turning with the axis for some."""
    axes = tuple(
        replace(
            axis,
            error_axes=tuple(map(tuple, se3.rotation(rng.normal(size=3)).tolist())),
            moving_frame=bool(rng.integers(2)),
        )
        for axis in machine.axes
    )
    return machine.replace(axes=axes)


@settings(max_examples=some(30), deadline=None)
@given(seed=seeds, joints=st.integers(1, 6))
def test_first_order_differs_from_exact_by_second_order(seed: int, joints: int) -> None:
    """All kinds of effects with their own reference points, carried or not: halving the errors quarters the gap."""
    rng = np.random.default_rng(seed)
    machine = chains.random_errors(rng, moving_frames(rng, chains.random_chain(rng, joints)))
    q = chains.random_positions(rng, machine, 3)
    gaps = []
    for share in (1.0, 0.5):
        effects = tuple(replace(e, coefficients=tuple(share * c for c in e.coefficients)) for e in machine.effects)
        part = machine.replace(effects=effects)
        first = np.einsum("nijk,njk->ni", part.jacobians(q, 100.0).joints, part.joint_errors(q, State(100.0)))
        gaps.append(np.abs(part.error(q, State(100.0)) - first).max())
        assert gaps[-1] < 1e-2 * np.abs(first).max()
    assert gaps[1] < 0.3 * gaps[0]


@settings(max_examples=some(20), deadline=None)
@given(seed=seeds)
def test_the_design_matrix_times_the_coefficients_is_the_first_order_error(seed: int) -> None:
    rng = np.random.default_rng(seed)
    machine = chains.random_errors(rng, chains.random_chain(rng, 5))
    q = chains.random_positions(rng, machine, 4)
    state = State(50.0, rng.choice([-1, 1], (4, 5)))
    first = np.einsum("nijk,njk->ni", machine.jacobians(q, 50.0).joints, machine.joint_errors(q, state))
    coefficients = np.concatenate([effect.coefficients for effect in machine.effects])
    np.testing.assert_allclose(machine.design(q, state) @ coefficients, first, atol=1e-13)


def test_the_design_matrix_of_effects_that_the_machine_does_not_have_yet() -> None:
    machine = chains.four_kinds()["w C B F X Y Z t"]
    rng = np.random.default_rng(0)
    q = chains.random_positions(rng, machine, 6).reshape(2, 3, 5)
    state = State(80.0, np.where(q > 0, 1, -1), {"temp_spindle": np.array([10.0, 20.0, 30.0])})
    wanted = (
        Effect("EXX", (0.0, 0.0), Backlash((0, 1))),
        Effect("EAC", (0.0,) * 4, Fourier((1, 2))),
        Effect("EZS", (0.0,), Polynomial((1,)), input="temp_spindle", scale=10.0),
        Effect("EAZ", (0.0,), Polynomial((1,)), times="Y"),
        Effect("EZY", (0.0,) * 3, PiecewiseLinear((-300.0, 0.0, 300.0))),
    )
    design = machine.design(q, state, wanted)
    assert design.shape == (2, 3, 6, 2 + 4 + 1 + 1 + 3)
    h, column = 1e-7, 0
    for effect in wanted:
        for k in range(effect.basis.size):
            high, low = (
                machine.replace(effects=(replace(effect, coefficients=tuple(sign * h * np.eye(effect.basis.size)[k])),))
                for sign in (1, -1)
            )
            difference = pose_difference(high.actual(q, state), low.actual(q, state)) / (2 * h)
            np.testing.assert_allclose(
                design[..., column], difference, atol=2e-6 * (1 + np.abs(design[..., column]).max())
            )
            column += 1


def test_effects_that_are_zero_need_no_inputs_but_their_design_does() -> None:
    from ncfix.diagnostics import UsageError

    effect = Effect("EZS", (0.0,), Polynomial((1,)), input="temp_spindle")
    machine = chains.four_kinds()["w Y X F Z t"].replace(effects=(effect,))
    assert (machine.error(np.zeros(3)) == 0).all()
    with pytest.raises(UsageError, match="temp_spindle"):
        machine.design(np.zeros(3))
