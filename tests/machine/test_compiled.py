"""The compiled core does what the plain way does, to the last bit."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

from conftest import some
from machine import chains
from ncfix import core
from ncfix.machine import Effect, Machine, State, load
from ncfix.machine.piecewise import Spline

pytestmark = pytest.mark.usefixtures("plain_form")

SHIPPED = ("angle_head", "dmu50", "three_axis", "wCAYFXZSt", "wCBXFZYSt")


def both(machine: Machine, q: np.ndarray, state: State) -> list[tuple[np.ndarray, ...]]:
    results = []
    for compiled in (False, True):
        core.use("compiled" if compiled else "plain")
        found = machine.tip(q, state.tool_length), machine.actual_tip(q, state), machine.actual(q, state)
        results.append((*found, machine.nominal(q, state.tool_length)))
    return results


def poses(machine: Machine, n: int) -> np.ndarray:
    rng = np.random.default_rng(n)
    return rng.uniform(-1, 1, (n, len(machine.axes))) * np.where(machine.rotary, 2.0, 300.0)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_machines(name: str, root: Path) -> None:
    machine = load(root / "examples" / "machines" / f"{name}.toml")
    inputs = dict.fromkeys(machine.inputs, 1.5)
    for n in (1, 7, 5000):
        state = State(np.linspace(20, 90, n), 1, inputs)
        for plain, compiled in zip(*both(machine, poses(machine, n), state), strict=True):
            assert np.array_equal(plain, compiled)


def test_a_machine_goes_to_other_processes_after_it_was_used(root: Path) -> None:
    core.use("compiled")
    machine = load(root / "examples" / "machines" / "dmu50.toml")
    q, state = poses(machine, 7), State(50.0)
    before = machine.actual_tip(q, state)
    for other in (pickle.loads(pickle.dumps(machine)), copy.deepcopy(machine)):
        assert np.array_equal(other.actual_tip(q, state), before)


@pytest.mark.parametrize("name", SHIPPED)
@pytest.mark.parametrize("compiled", [False, True])
def test_gaps_are_the_difference_of_tips(name: str, compiled: bool, root: Path) -> None:
    core.use("compiled" if compiled else "plain")
    machine, n = load(root / "examples" / "machines" / f"{name}.toml"), 5000
    meant, state = poses(machine, n), State(np.linspace(20, 90, n), 1, dict.fromkeys(machine.inputs, 1.5))
    turned = meant + 1e-5
    shifted = np.where(machine.rotary, meant, turned)
    for each in (machine, machine.replace(effects=())):
        found = each.gaps(meant, (meant, shifted, turned), state)
        for q, gap in zip((meant, shifted, turned), found, strict=True):
            assert np.array_equal(gap, each.actual_tip(q, state) - each.tip(meant, state.tool_length))
        assert np.array_equal(each.gaps(shifted, (turned,), state, each.tip(meant, state.tool_length)), [found[2]])


@pytest.mark.parametrize("name", SHIPPED)
def test_axes_led_to_a_point(name: str, root: Path) -> None:
    machine = load(root / "examples" / "machines" / f"{name}.toml")
    q, lengths = poses(machine, 300), np.linspace(20, 90, 300)
    axes = tuple(machine.axis_names.index(axis) for axis in "XYZ")
    found = []
    for compiled in (False, True):
        core.use("compiled" if compiled else "plain")
        found.append(machine.xyz_for_tip(q, axes, poses(machine, 301)[:300, :3], lengths))
    assert np.array_equal(*found)


@pytest.mark.parametrize("seed", range(some(6)))
def test_random_chains(seed: int) -> None:
    rng = np.random.default_rng(seed)
    machine = chains.random_errors(rng, chains.random_chain(rng, 4), 1e-4)
    for plain, compiled in zip(*both(machine, poses(machine, 300), State(50.0)), strict=True):
        assert np.array_equal(plain, compiled)


def test_curves_that_come_transposed() -> None:
    knots = (*[-400.0] * 3, *np.linspace(-400, 400, 8).tolist(), *[400.0] * 3)
    curve = tuple((1e-5 * np.sin(np.arange(len(knots) - 4))).tolist())
    machine = chains.random_chain(np.random.default_rng(3), 4)
    effects = [Effect(f"E{c}{axis}", curve, Spline(knots, 3)) for axis in machine.axis_names for c in "XYZABC"]
    bent = machine.replace(effects=tuple(effects))
    for plain, compiled in zip(*both(bent, poses(machine, 300), State(50.0)), strict=True):
        assert np.array_equal(plain, compiled)
