"""Motions under TCP that are said to stay within the travels do so wherever they are looked at."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate.plan.kinematics import joints_from_commands
from ncfix.compensate.plan.segments import Segments, arcs_within, skew, surely_within
from ncfix.machine import Machine, load

LENGTH = 120.0
LOOKS = 41


@pytest.mark.parametrize(
    "name", ["benchmarks/five_axis.toml", "examples/machines/dmu50.toml", "examples/machines/angle_head.toml"]
)
@pytest.mark.parametrize("turn", [0.001, 0.03, 0.5])
def test_what_surely_stays_within_does(name: str, turn: float, root: Path) -> None:
    machine = load(root / name)
    begin, way = some_commands(machine, turn)
    looks = [joints_from_commands(machine, begin + f * way, np.ones(len(way), bool), LENGTH) for f in fractions()]
    tight = ranged(machine, looks[0], looks[-1])
    within = surely_within(tight, looks[0], looks[-1], LENGTH)
    low, high = tight.ranges.T
    seen = np.array([((q >= low) & (q <= high)).all(axis=1) for q in looks]).all(axis=0)
    assert seen[within].all()
    assert within.mean() < 1
    assert within.any() or turn > 0.1


def test_arcs_that_are_said_to_stay_within_the_travels_do(root: Path) -> None:
    machine, arcs = load(root / "benchmarks/five_axis.toml"), some_arcs(load(root / "benchmarks/five_axis.toml"))
    looks = [arcs.at(np.arange(len(arcs)), np.full(len(arcs), f)) for f in fractions()]
    tight = ranged(machine, looks[0], looks[-1])
    within, (low, high) = arcs_within(tight, arcs), tight.ranges.T
    seen = np.array([((q >= low - 1e-9) & (q <= high + 1e-9)).all(axis=1) for q in looks]).all(axis=0)
    assert seen[within].all()
    assert within.any()
    assert (seen[: len(arcs) // 2] & ~within[: len(arcs) // 2]).mean() < 0.1  # of small arcs few are looked at in vain


def test_an_arc_of_which_a_number_is_not_known_is_looked_at(root: Path) -> None:
    machine = load(root / "benchmarks/five_axis.toml")
    for name in ("start", "end", "centre"):
        arcs = some_arcs(machine)
        getattr(arcs, name)[:, 0] = np.nan
        assert not arcs_within(machine, arcs).any(), name


def some_arcs(machine: Machine) -> Segments:
    """Arcs about some directions, the first half of them small, with rotary axes and radii that change on the way."""
    rng, n = np.random.default_rng(4), 400
    start, way = some_commands(machine, 0.5)
    normal = rng.normal(size=(n, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    off = rng.uniform(-1, 1, (n, 3)) * np.repeat((3.0, 60.0), n // 2)[:, None]
    columns = np.array([machine.axis_names.index(letter) for letter in "XYZ"])
    centre = start[:, columns] + off
    return Segments(start, start + way, np.ones(n, bool), centre, normal, rng.uniform(-7, 7, n), columns)


def fractions() -> np.ndarray:
    return np.linspace(0.0, 1.0, LOOKS)


def some_commands(machine: Machine, turn: float) -> tuple[np.ndarray, np.ndarray]:
    rng, rotary = np.random.default_rng(3), machine.rotary
    begin = np.where(rotary, rng.uniform(0.1, 1.0, (400, 5)), rng.uniform(0, 200, (400, 5)))
    return begin, np.where(rotary, rng.uniform(-turn, turn, (400, 5)), rng.uniform(-3, 3, (400, 5)))


def ranged(machine: Machine, *positions: np.ndarray) -> Machine:
    """The machine with travels in which most of the positions are, but not all."""
    axes = []
    for axis, column in zip(machine.axes, np.concatenate(positions).T, strict=True):
        travel = (
            (-np.inf, np.inf) if axis.rotary else (float(np.quantile(column, 0.1)), float(np.quantile(column, 0.9)))
        )
        axes.append(axis.__class__(axis.name, axis.rotary, axis.workpiece_side, axis.direction, axis.point, travel))
    return machine.replace(axes=tuple(axes))


def test_linear_axes_on_top_of_rotary_ones_are_looked_at(root: Path) -> None:
    machine = load(root / "benchmarks/five_axis.toml")
    assert skew(machine) == pytest.approx(1.0)
    assert skew(machine.replace(axes=(*machine.axes[3:4], *machine.axes[:3], *machine.axes[4:]))) is not None
    turned = [axis.__class__(axis.name, axis.rotary, False, axis.direction, axis.point) for axis in machine.axes]
    assert skew(machine.replace(axes=tuple(turned))) is None
