"""Commands and axis positions: inverse of each other, and what tool-centre-point control means."""

from __future__ import annotations

import numpy as np
import pytest

from compensate.machines_at_random import TOPOLOGIES, perfect
from ncfix.compensate.plan.findings import PoseError
from ncfix.compensate.plan.kinematics import (
    affine_tip,
    commands_from_joints,
    joints_from_commands,
    linear_columns,
    moves_as_one,
    solve,
)
from ncfix.diagnostics import RefusedError
from ncfix.machine import Axis, Machine

N = 500
ROUNDING = 1e-10
"""mm: a thousand roundings of numbers of 1000 mm in double precision."""
TILTED = (0.0, -np.sqrt(0.5), np.sqrt(0.5))


@pytest.fixture(params=TOPOLOGIES.values(), ids=list(TOPOLOGIES))
def machine(request: pytest.FixtureRequest) -> Machine:
    return perfect(request.param, TILTED)


def poses(machine: Machine, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    q = rng.uniform(-250, 250, (N, len(machine.axes)))
    q[:, machine.rotary] = rng.uniform(-3, 3, (N, int(machine.rotary.sum())))
    return q


def test_without_tcp_a_command_is_the_axis_positions(machine: Machine) -> None:
    q = poses(machine)
    assert joints_from_commands(machine, q, np.zeros(N, dtype=bool), 100.0) is q
    assert commands_from_joints(machine, q, np.zeros(N, dtype=bool), 100.0) is q


def test_both_ways_are_inverse(machine: Machine) -> None:
    q, lengths = poses(machine), np.random.default_rng(1).uniform(0, 200, N)
    tcp = np.arange(N) % 3 > 0
    commands = commands_from_joints(machine, q, tcp, lengths)
    np.testing.assert_allclose(joints_from_commands(machine, commands, tcp, lengths), q, rtol=0, atol=ROUNDING)
    assert (commands[:, machine.rotary] == q[:, machine.rotary]).all()
    assert (commands[~tcp] == q[~tcp]).all()


def test_with_rotary_axes_at_zero_a_tcp_program_means_the_same_with_the_tool_length_applied(machine: Machine) -> None:
    commands = np.where(machine.rotary, 0.0, poses(machine))
    q = joints_from_commands(machine, commands, np.ones(N, dtype=bool), 80.0)
    np.testing.assert_allclose(machine.tip(q, 80.0), machine.tip(commands, 0.0), rtol=0, atol=ROUNDING)
    z = linear_columns(machine)[2]
    np.testing.assert_allclose(q[:, z] - commands[:, z], 80.0, atol=ROUNDING)


def test_leading_axes_straight_back_finds_what_solving_for_them_does(machine: Machine) -> None:
    if not moves_as_one(machine):
        pytest.skip("a rotary axis turns some of X, Y and Z only")
    q, lengths = poses(machine, 5), np.random.default_rng(6).uniform(0, 200, N)
    x, y, z = linear_columns(machine).tolist()
    wanted = machine.tip(poses(machine, 7), lengths)
    maps, offset = affine_tip(machine, q, lengths)
    solved = solve(maps, wanted - offset)
    np.testing.assert_allclose(machine.xyz_for_tip(q, (x, y, z), wanted, lengths), solved, rtol=0, atol=ROUNDING)


def test_the_tip_stays_when_rotary_axes_turn(machine: Machine) -> None:
    """That is what tool-centre-point control is for."""
    commands = poses(machine)
    commands[:, linear_columns(machine)] = [30.0, -40.0, 55.0]
    q = joints_from_commands(machine, commands, np.ones(N, dtype=bool), 120.0)
    tips = machine.tip(q, 120.0)
    np.testing.assert_allclose(tips, np.broadcast_to(tips[0], tips.shape), rtol=0, atol=ROUNDING)


def test_a_further_linear_axis_keeps_its_command() -> None:
    """A quill W along Z: X Y Z do the work."""
    axes = (*perfect("w C F X Y Z t").axes, Axis("W", False, False, (0.0, 0.0, 1.0)))
    machine = Machine("", "w C F X Y Z W t", axes)
    commands = poses(machine)
    q = joints_from_commands(machine, commands, np.ones(N, dtype=bool), 50.0)
    assert (q[:, 4] == commands[:, 4]).all()
    back = commands_from_joints(machine, q, np.ones(N, dtype=bool), 50.0)
    np.testing.assert_allclose(back, commands, rtol=0, atol=ROUNDING)


def test_parallel_linear_axes_are_refused_with_the_rows() -> None:
    """X under the rotary table turns into Y's direction at C = 90 degrees."""
    machine = perfect("w X C F Y Z t")
    commands = np.zeros((3, 4))
    commands[:, machine.axis_names.index("C")] = [0.0, np.pi / 2, 1.0]
    with pytest.raises(PoseError) as raised:
        joints_from_commands(machine, commands, np.ones(3, dtype=bool), 0.0)
    assert raised.value.code == "NCF402"
    assert raised.value.rows.tolist() == [False, True, False]


def test_a_machine_without_three_linear_axes_is_refused() -> None:
    lathe = Machine("lathe", "w C F X Z t", tuple(axis for axis in perfect("w C F X Y Z t").axes if axis.name != "Y"))
    with pytest.raises(RefusedError) as raised:
        linear_columns(lathe)
    assert raised.value.code == "NCF401"
