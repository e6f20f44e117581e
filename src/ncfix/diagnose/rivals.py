"""Effects without a name, as rivals of those with one: any smooth field of the pose, any course of time, anything that
one axis may do.

The first two are Gaussian processes of three independent components at the tool tip, along the base or the workpiece;
the last are all six errors of a joint at once, by its own position, its direction, another axis, or time. They hold
more than any name does and pay for it in the evidence; where such a rival explains the data better all the same, the
effect is not in the catalogue.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from ncfix.diagnose.catalogue import Candidate, shapes
from ncfix.diagnose.catalogue.candidate import LETTERS, TURNS, Reach, weighed, zero
from ncfix.diagnose.groups import Group, apart
from ncfix.diagnose.view import View
from ncfix.machine import Effect
from ncfix.machine.axis import Axis
from ncfix.machine.effect import SPINDLE
from ncfix.machine.smooth import Backlash, Fourier, Polynomial
from ncfix.measure.measurement import Array
from ncfix.measure.solve import orthonormal, without

UNNAMED = "unnamed"
"""Family of the rivals."""
POSE = Candidate("unknown by pose", "something that depends on where the axes are", "", UNNAMED, (), ())
TIME = Candidate("unknown by time", "something that happens in the course of time", "", UNNAMED, (), ())
WAY = Candidate("unknown by way", "something that depends on from where the axes came", "", UNNAMED, (), ())
POSE_LENGTHS = (0.8, 1.6)
"""Of half the travel of every axis at once."""
PAIR_LENGTH = 0.7
"""The same where two axes at a time matter."""
TIME_LENGTHS = (300.0, 1500.0)
"""s"""
LASTING = 3600.0
"""s: how long a step or a walk in time is remembered."""
FULL = 270.0
"""degree: an axis that turned further is taken for one that turns round and round."""
MOST = 50
"""Functions of pose or time that are kept, the smoothest."""
KEPT = 0.01
"""Share of squares that may be dropped."""
BEND = 0.4
"""Length of the bends of what a joint may do, of half its travel; of what time does, `SLOW`."""
SLOW = 0.3
WAVES = (1.0, 0.7, 0.5, 0.3, 0.2, 0.2)
"""Variances of the waves a turn."""
HELD = 0.8
"""Share of an error's squares, beside what is free, that makes it the same as a name."""
PLAY = (1.0, 1.0, 0.5, 0.3)
Part = tuple[str, dict[str, Any], Array]
"""Component, options of the effect, and the loading of its coefficients."""


def unnamed(owner: Candidate) -> bool:
    """Whether it is a rival."""
    return owner.family == UNNAMED


def rivals(view: View, named: Sequence[Group]) -> tuple[Group, ...]:
    """All of them, several forms each; none where the data do not show the tool tip.

    What a constant that the machine file lacks would show is left to that: a rival has no part in it.
    """
    tip = view.design([Effect(f"E{letter}{SPINDLE}", (0.0,)) for letter in LETTERS]) / 1e3
    if not np.abs(tip).max() > 0:
        return ()
    found = [_at_tip(view, owner, way, kernel) for way in _frames(view, tip) for owner, kernel in _kernels(view)]
    found += _of_joints(view)
    seen = _not_in_catalogue(view, [group for group in found if group is not None], named)
    if not any(group.owner.constant for group in named):
        return tuple(seen)
    columns = apart(view, np.concatenate([group.columns for group in seen], axis=1), named)
    ends = np.cumsum([group.columns.shape[1] for group in seen])[:-1]
    return tuple(replace(group, columns=own) for group, own in zip(seen, np.split(columns, ends, axis=1), strict=True))


def _not_in_catalogue(view: View, found: Sequence[Group], named: Sequence[Group]) -> list[Group]:
    """Without the single errors that a name holds already: those are that name with another shape."""
    basis = orthonormal(view.base / view.relative[:, None])
    own: dict[str, list[Array]] = {}
    for group in named:
        left = without(basis, group.columns / view.relative[:, None])
        span = orthonormal(left)
        for name in {effect.name for effect in group.owner.effects}:
            own.setdefault(name, []).append(span)
    return [group for group in found if not _held(without(basis, group.columns / view.relative[:, None]), group, own)]


def _held(left: Array, group: Group, spans: Mapping[str, Sequence[Array]]) -> bool:
    names = [effect.name for effect in group.owner.effects]
    held = [((span.T @ left) ** 2).sum() for name in names for span in spans.get(name, ())]
    return bool(max(held, default=0.0) > HELD * (left**2).sum())


def _frames(view: View, tip: Array) -> tuple[Array, ...]:
    """What a shift of the tip along base axes, and along those of the workpiece, shows, (m, 3) each."""
    if not any(axis.rotary and axis.workpiece_side for axis in view.machine.axes):
        return (tip,)
    turned = np.concatenate(
        [each.machine.nominal(each.q, each.state.tool_length) for each in view.problem.observations]
    )
    own = turned[np.maximum(view.row, 0), :3, :3]
    return tip, np.einsum("mj,mkj->mk", tip, own)


def _kernels(view: View) -> Iterator[tuple[Candidate, Array]]:
    """Covariances of rows, (n, n)."""
    u = scaled(view)
    for length in POSE_LENGTHS:
        yield POSE, _smooth(u, length)
    single = [_smooth(u[:, [k]], PAIR_LENGTH) for k in range(u.shape[1])]
    if len(single) > 1:
        yield POSE, sum((a * b for a, b in combinations(single, 2)), np.zeros_like(single[0]))
    time = view.column("time_s")
    if np.ptp(time) > 0:
        for length in TIME_LENGTHS:
            yield TIME, _smooth(time[:, None], length)
        yield TIME, np.exp(-np.abs(time[:, None] - time) / LASTING)
    sides = _sides(view)
    if sides.shape[1]:
        yield WAY, (sides @ sides.T) * (1 + sum(single, np.zeros_like(single[0])))


def _smooth(u: Array, length: float) -> Array:
    apart = ((u[:, None] - u) ** 2).sum(axis=-1)
    kernel: Array = np.exp(-0.5 * apart / length**2)
    return kernel


def _sides(view: View) -> Array:
    """Directions from which the axes came, those that changed, (n, k)."""
    names = [f"dir_{axis.name}" for axis in view.machine.axes if f"dir_{axis.name}" in view.reach.columns]
    return np.stack([view.column(name) for name in names], axis=-1) if names else np.zeros((view.count, 0))


def scaled(view: View) -> Array:
    """The axes that moved, -1 ... 1 each; full turns as points of a circle, (n, k)."""
    columns = []
    for index, axis in enumerate(view.machine.axes):
        values = view.q[:, index]
        if not view.reach.moved(axis):
            continue
        low, high = float(values.min()), float(values.max())
        if axis.rotary and high - low > 1.5 * np.pi:
            columns += [np.cos(values), np.sin(values)]
        else:
            columns.append((2 * values - low - high) / (high - low))
    return np.stack(columns, axis=-1) if columns else np.zeros((view.count, 1))


def functions(kernel: Array, most: int = MOST) -> Array:
    """Functions (n, k) whose inner products are nearly this covariance."""
    squares, vectors = np.linalg.eigh(kernel)
    squares, vectors = squares[::-1][:most], vectors[:, ::-1][:, :most]
    kept = squares > 1e-6 * squares[0]
    found: Array = vectors[:, kept] * np.sqrt(squares[kept])
    return found


def _at_tip(view: View, owner: Candidate, way: Array, kernel: Array) -> Group | None:
    """Three independent components."""
    own = functions(kernel)[np.maximum(view.row, 0)]
    return _group(view, owner, [way[:, [k]] * own for k in range(way.shape[1])])


def _moved(reach: Reach) -> tuple[Axis, ...]:
    return (*reach.linear, *reach.rotary)


def _sorts(reach: Reach, axis: Axis) -> Iterator[tuple[str, list[list[Part]]]]:
    """What each component may do: by position, direction, another axis, time."""
    names = [f"E{letter}{axis.name}" for letter in LETTERS + TURNS]
    options, loading = _curve(reach, axis)
    yield "its position", [[(name, options, loading)] for name in names]
    if f"dir_{axis.name}" in reach.columns:
        play = {"basis": Backlash(degree=(0, 1, 2, 3)), **reach.scaled(axis)}
        yield "its direction", [[(name, play, weighed(PLAY))] for name in names]
    others = [other for other in _moved(reach) if other is not axis]
    for other in others:
        yield f"its position and {other.name}", [[(name, options | reach.factor(other), loading)] for name in names]
    driven = _driven(reach)
    if driven:
        product: tuple[dict[str, Any], ...] = (reach.factor(axis), {})
        parts = [[(name, each | more, size) for each, size in driven for more in product] for name in names]
        yield "time, heat or load", parts


def _curve(reach: Reach, axis: Axis) -> tuple[dict[str, Any], Array]:
    if axis.rotary and np.ptp(reach.spans[axis.name]) > FULL:
        return {"basis": Fourier(order=tuple(range(1, len(WAVES) + 1)))}, weighed(np.repeat(WAVES, 2))
    return {"basis": shapes.spline(), **reach.scaled(axis)}, shapes.smooth(BEND)


def _driven(reach: Reach) -> list[tuple[dict[str, Any], Array]]:
    """Time, temperatures and load as options of effects."""
    found: list[tuple[dict[str, Any], Array]] = []
    if "time_s" in reach.columns:
        first, last = reach.clock
        middle = {"center": (first + last) / 2, "scale": (last - first) / 2}
        found.append(({"basis": shapes.spline(), "input": "time_s", **middle}, shapes.smooth(SLOW)))
    for name in (*reach.sensors, *(["load_kg"] if "load_kg" in reach.columns else [])):
        origin, unit = (reach.warmth[name][0], 5.0) if name in reach.warmth else (0.0, 100.0)
        options = {"basis": Polynomial(degree=(1,)), "input": name, "center": origin, "scale": unit}
        found.append((options, np.eye(1)))
    return found


def _of_joints(view: View) -> Iterator[Group | None]:
    """Of every joint, by all it may depend on: its six errors with the same share each, and each alone."""
    sorts = [(axis, *sort) for axis in _moved(view.reach) for sort in _sorts(view.reach, axis)]
    parts = [part for _, _, components in sorts for component in components for part in component]
    designs = _designs(view, [Effect(name, (), **options) for name, options, _ in parts])
    shown = iter([design @ loading for design, (_, _, loading) in zip(designs, parts, strict=True)])
    for axis, what, components in sorts:
        own = [np.concatenate([next(shown) for _ in component], axis=1) for component in components]
        yield _group(view, _something(axis, f"something of {axis.name}", what), own)
        for component, part in zip(components, own, strict=True):
            name = component[0][0]
            yield _group(view, replace(_something(axis, name, what), effects=(Effect(name, (0.0,)),)), [part])


def _designs(view: View, effects: Sequence[Effect]) -> list[Array]:
    """What each effect's coefficients show."""
    ends = np.cumsum([effect.basis.size for effect in effects])
    return np.split(view.design(zero(effects)), ends[:-1], axis=1)


def _something(axis: Axis, error: str, what: str) -> Candidate:
    title = f"{error} by {what} that has no name in the catalogue"
    return Candidate(f"unknown of {axis.name}", title, axis.name, UNNAMED, (), ())


def _group(view: View, owner: Candidate, parts: Sequence[Array]) -> Group | None:
    """The parts with the same share each, at a size of 1 um together, with as few columns as they need."""
    sizes = [view.rms(np.linalg.norm(part, axis=1)) for part in parts]
    columns = [part / size for part, size in zip(parts, sizes, strict=True) if size > 0]
    if not columns:
        return None
    whole = np.concatenate(columns, axis=1) / np.sqrt(len(columns))
    squares, vectors = np.linalg.eigh(whole.T @ whole)
    kept = np.cumsum(squares) > KEPT * squares.sum()
    return Group(owner, np.zeros((0, int(kept.sum()))), whole @ vectors[:, kept])
