"""A thousand random chains: the fast engine against pytransform3d, against `derive`, and first order against exact.

A chain has 2 to 7 joints, prismatic and revolute, on both branches in any order. With pytransform3d any directions
and all 12 errors of every joint are compared, as composed exactly; the derived formulas have six errors, and at most
four revolute joints, as no machine tool has more and formulas of more have some hundred thousand terms.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from machine import chains, oracle
from ncfix.machine import Machine, State
from ncfix.machine.symbolic import derive
from ncfix.machine.symbolic.printing import compiled

LENGTH, POSES = 120.0, 5
REVOLUTE = 4
"""How many revolute joints a chain has at most that is compared with `derive`."""
LARGER = 20.0
"""Errors of 1 mm and 2 mrad: what is left of second order is well above rounding, and of third well below second."""


@dataclass(frozen=True)
class Agreement:
    """One chain. Deviations are the largest over the poses, relative to the largest value over them.

    composed   actual tip, against pytransform3d; turned: entries of the actual rotation, absolute
    nominal    nominal tip, against `derive`
    first      tip error of first order against `derive`, rotated: angles
    ratio      how much smaller exact minus first order is when the errors are halved: 4 for a second order
    """

    joints: int
    revolute: int
    composed: float
    turned: float
    nominal: float
    first: float
    rotated: float
    ratio: float


def compare(seed: int) -> Agreement:
    """One chain by all ways."""
    rng = np.random.default_rng(seed)
    joints = 2 + seed % 6
    composed, turned = against_oracle(rng, chains.random_errors(rng, chains.random_chain(rng, joints), 1.0))
    machine = chains.near_axes(rng, chains.random_chain(rng, joints))
    while machine.rotary.sum() > REVOLUTE:
        machine = chains.near_axes(rng, chains.random_chain(rng, joints))
    machine = chains.a_few_errors(rng, machine)
    parts = against_formulas(rng, machine)
    return Agreement(joints, int(machine.rotary.sum()), composed, turned, *parts, remainder(rng, machine))


def against_oracle(rng: chains.Rng, machine: Machine) -> tuple[float, float]:
    """The exact composition, tip and rotation."""
    q = chains.random_positions(rng, machine, POSES)
    expected = np.array([oracle.actual(machine, pose, LENGTH) for pose in q])
    found = machine.actual(q, State(LENGTH))
    return relative(found[:, :3, 3], expected[:, :3, 3]), float(np.abs(found - expected)[:, :3, :3].max())


def against_formulas(rng: chains.Rng, machine: Machine) -> tuple[float, float, float]:
    """Nominal tip, and the first-order error: the joints' Jacobians times the joints' errors."""
    q = chains.random_positions(rng, machine, POSES)
    values = chains.arguments(machine, q)
    nominal, error = compiled(derive(machine, include="machine"))
    tip = nominal(**{name: values[name] for name in machine.axis_names}, tool_length=LENGTH)[:, :3]
    first = error(**values, tool_length=LENGTH)
    expected = np.einsum("nijk,njk->ni", machine.jacobians(q, LENGTH).joints, machine.joint_errors(q, State(LENGTH)))
    return (
        relative(machine.tip(q, LENGTH), tip),
        relative(expected[:, :3], first[:, :3]),
        relative(expected[:, 3:], first[:, 3:]),
    )


def remainder(rng: chains.Rng, machine: Machine) -> float:
    """By how much exact minus first order shrinks with errors of half the size; NaN if it is rounding."""
    q, left = chains.random_positions(rng, machine, POSES), []
    for size in (LARGER, LARGER / 2):
        scaled = (replace(e, coefficients=tuple(size * c for c in e.coefficients)) for e in machine.effects)
        bigger = machine.replace(effects=tuple(scaled))
        twists = np.einsum("nijk,njk->ni", bigger.jacobians(q, LENGTH).joints, bigger.joint_errors(q, State(LENGTH)))
        left.append(float(np.linalg.norm(bigger.error(q, State(LENGTH)) - twists)))
    return left[0] / left[1] if left[1] > 1e-9 else float("nan")


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    """The largest deviation over the largest value."""
    size = float(np.abs(expected).max())
    deviation = float(np.abs(found - expected).max())
    return deviation / size if size > 0 else deviation


def table(seeds: Iterable[int]) -> str:
    """The agreement of many chains by their number of joints."""
    every = []
    for seed in seeds:
        every.append(compare(seed))
        if seed % 50 == 49:
            print(f"{seed + 1} chains", file=sys.stderr, flush=True)
    head = (
        "| joints | chains | tip, pytransform3d | rotation | tip, `derive` | error, `derive` | its angles | "
        "exact minus first order, errors halved |\n|---|---|---|---|---|---|---|---|"
    )
    groups = [[each for each in every if each.joints == joints] for joints in range(2, 8)]
    return "\n".join([head, *(_row(group, str(group[0].joints)) for group in groups if group), _row(every, "all")])


def _row(group: list[Agreement], name: str) -> str:
    names = ("composed", "turned", "nominal", "first", "rotated")
    worst = [f"{max(getattr(each, name) for each in group):.1e}" for name in names]
    ratios = np.array([each.ratio for each in group if np.isfinite(each.ratio)])
    shrunk = f"1 / {np.median(ratios):.3f} ({ratios.min():.3f} to {ratios.max():.3f})" if ratios.size else "-"
    return f"| {name} | {len(group)} | {' | '.join(worst)} | {shrunk} |"
