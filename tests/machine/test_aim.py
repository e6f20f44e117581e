"""The tip on its route and Newton's method: the same results in all ways, and whatever else is worked out with them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from conftest import require_core, some
from machine import chains
from ncfix import core
from ncfix.machine import Effect, Machine, State, load, loads
from ncfix.machine.basis import Periodic, Polynomial
from ncfix.machine.piecewise import PiecewiseLinear, Spline

SHIPPED = ("angle_head", "dmu50", "three_axis", "wCAYFXZSt", "wCBXFZYSt")
TABLE_TABLE = "w C B F X Y Z S t"
ELSEWHERE = ("w C F X Y Z B S t", "w F X Y Z C B S t", "w B X F Y C Z S t", "w C B X F Y Z S t")
"""The same machine with its rotary axes elsewhere: behind X, Y and Z, before them, and between them."""
NM = 1e-6


def linear(machine: Machine) -> tuple[int, int, int]:
    x, y, z = (machine.axis_names.index(name) for name in "XYZ")
    return x, y, z


def poses(machine: Machine, n: int) -> np.ndarray:
    rng = np.random.default_rng(n)
    return rng.uniform(-1, 1, (n, len(machine.axes))) * np.where(machine.rotary, 2.0, 300.0)


def shipped(root: Path) -> list[Machine]:
    found = [load(root / "examples" / "machines" / f"{name}.toml") for name in SHIPPED]
    five = (root / "benchmarks" / "five_axis.toml").read_text(encoding="utf-8")
    elsewhere = [loads(five.replace(TABLE_TABLE, order)) for order in (TABLE_TABLE, *ELSEWHERE)]
    return [*found, *elsewhere, with_curves(found[1]), *(thinned(each, k) for each in found for k in range(5))]


def thinned(machine: Machine, first: int) -> Machine:
    """With one in five of its errors: few of the numbers of its small motions are other than zero."""
    return replace(machine, effects=machine.effects[first::5])


def with_curves(machine: Machine) -> Machine:
    """With effects that their bases work out themselves: of a rotary axis, of a linear one, and of two signals."""
    rotary = next(axis.name for axis in machine.axes if axis.rotary)
    table = PiecewiseLinear((-90.0, -10.0, 30.0, 90.0))
    spline = Spline((-300.0, -300.0, -300.0, -300.0, 0.0, 300.0, 300.0, 300.0, 300.0))
    effects = (
        Effect(f"EX{rotary}", (0.0, 0.01, -0.01, 0.02), table),
        Effect("EAX", (1e-5, 2e-5, -3e-5, 0.0, 1e-5), spline),
        Effect("EYY", (0.002, 0.001), Periodic((1,), 10.0)),
        Effect("EZX", (1e-5,), Polynomial((1,)), times="Y"),
    )
    return replace(machine, effects=(*machine.effects, *effects))


def state(machine: Machine, n: int) -> State:
    return State(np.linspace(20, 90, n), 1, dict.fromkeys(machine.inputs, 1.5))


def part(given: State, rows: slice) -> State:
    return State(np.asarray(given.tool_length)[rows], given.direction, given.inputs)


def test_the_tip_gets_there(root: Path) -> None:
    for machine in shipped(root):
        q, given = poses(machine, 200), state(machine, 200)
        aim = machine.aim(q, linear(machine), given)
        assert aim.arrived.all()
        at = q.copy()
        at[:, linear(machine)] = aim.place
        meant = machine.tip(q, given.tool_length)
        assert np.abs(machine.actual_tip(at, given) - meant).max() < NM
        gap = machine.actual_tip(q, given) - meant
        np.testing.assert_allclose(aim.off, np.linalg.norm(gap, axis=1), rtol=0, atol=1e-12)
        beyond = meant + np.array([0.05, -0.02, 0.01])
        at[:, linear(machine)] = machine.aim(q, linear(machine), given, beyond).place
        assert np.abs(machine.actual_tip(at, given) - beyond).max() < NM


def test_a_pose_alone_is_a_pose_among_many(root: Path) -> None:
    for machine in shipped(root):
        n = 5000
        q, given = poses(machine, n), state(machine, n)
        tips, aim = machine.actual_tip(q, given), machine.aim(q, linear(machine), given)
        for rows in (slice(0, 1), slice(1, 3), slice(4090, 4100), slice(n - 7, n)):
            alone = machine.aim(q[rows], linear(machine), part(given, rows))
            assert np.array_equal(machine.actual_tip(q[rows], part(given, rows)), tips[rows])
            assert np.array_equal(alone.place, aim.place[rows])


def test_compiled_and_plain(root: Path) -> None:
    require_core()
    for machine in shipped(root):
        q, given = poses(machine, 1000), state(machine, 1000)
        q[17, 0] = np.nan
        plain = machine.actual_tip(q, given), machine.aim(q, linear(machine), given)
        core.use("compiled")
        compiled = machine.actual_tip(q, given), machine.aim(q, linear(machine), given)
        core.use("plain")
        assert np.array_equal(plain[0], compiled[0], equal_nan=True)
        for name in ("place", "arrived", "off"):
            assert np.array_equal(getattr(plain[1], name), getattr(compiled[1], name), equal_nan=True), name
        assert not plain[1].arrived[17]
        assert plain[1].arrived.sum() == 999


@pytest.mark.parametrize("seed", range(some(12)))
def test_routes_of_random_chains(seed: int) -> None:
    """With reference points off the axes, errors of 50 um or of 15 mm; without a route they go along the chain."""
    rng = np.random.default_rng(seed)
    machine = chains.random_errors(rng, chains.random_chain(rng, 5), 300.0 if seed % 3 == 0 else 1.0)
    q = chains.random_positions(rng, machine, 50)
    tips, exact = machine.actual_tip(q, State(50.0)), machine.actual(q, State(50.0))[:, :3, 3]
    np.testing.assert_allclose(tips, exact, rtol=0, atol=1e-9)


def test_small_motions_that_are_not_small(root: Path) -> None:
    """An angle of 0.2 rad is beyond the power series: those poses go along the chain."""
    machine = load(root / "examples" / "machines" / "dmu50.toml")
    machine = replace(machine, effects=(*machine.effects, Effect("EAX", (1e-3,), Polynomial((1,)))))
    q = poses(machine, 100)
    tips, exact = machine.actual_tip(q, State(50.0)), machine.actual(q, State(50.0))[:, :3, 3]
    np.testing.assert_allclose(tips, exact, rtol=0, atol=1e-9)
    assert (np.abs(q[:, machine.axis_names.index("X")]) > 100).any()


def test_sines_do_not_depend_on_their_neighbours() -> None:
    """What the equality of all ways rests on: numpy's sine of a number is the same wherever the number stands."""
    angles = np.random.default_rng(0).uniform(-7, 7, 4099)
    many = np.sin(angles)
    for begin, end in ((0, 1), (1, 4), (3, 12), (4090, 4099)):
        assert np.array_equal(np.sin(angles[begin:end]), many[begin:end])
    assert all(np.sin(angles[k : k + 1])[0] == many[k] for k in range(0, 4099, 7))
    assert np.array_equal(np.sin(np.repeat(angles, 3)[::3]), many)
