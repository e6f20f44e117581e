"""Whatever depends smoothly on pose or time, or on from where the axes came: rivals at the tool tip.

Gaussian processes of three independent components, along the tool, the base or the workpiece.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from ncfix.diagnose.catalogue import Candidate
from ncfix.diagnose.catalogue.candidate import LETTERS
from ncfix.diagnose.groups import Group
from ncfix.diagnose.view import View
from ncfix.machine import Effect
from ncfix.machine.axes import SPINDLE
from ncfix.measure.geometry import base_from_workpiece
from ncfix.measure.measurement import Array

UNNAMED = "unnamed"
"""Family of the rivals."""
POSE = Candidate("unknown by pose", "something that depends on where the axes are", "", UNNAMED, (), ())
TIME = Candidate("unknown by time", "something that happens in the course of time", "", UNNAMED, (), ())
WAY = Candidate("unknown by way", "something that depends on from where the axes came", "", UNNAMED, (), ())
POSE_LENGTHS = (0.8, 1.6)
"""Of half the travel of every axis at once."""
PAIR_LENGTH = 0.7
"""The same where two axes at a time matter."""
JERK = 300.0
"""s: over which a course of time bends that no warmth has."""
TIME_LENGTHS = (1200.0, 2400.0, 7200.0)
"""s: over which it bends, with kinks, as thermal effects of the catalogue do: a rival may do what they may."""
LASTING = 3600.0
"""s: how long a step or a walk in time is remembered."""
MOST = 50
"""Functions of pose or time that are kept, the smoothest."""
KEPT = 0.01
"""Share of squares that may be dropped."""
SLOWLY = 1.0
"""Of half the travel of an axis, and of the time: over which the shape of an effect may differ from the catalogue's."""
SMOOTHEST = 16
"""Functions of them that are kept."""


def fields(view: View) -> Iterator[Group | None]:
    """All of them; none where the data do not show the tool tip."""
    tip = view.design([Effect(f"E{letter}{SPINDLE}", (0.0,)) for letter in LETTERS]) / 1e3
    if np.abs(tip).max() > 0:
        for way in frames_of(view, tip):
            for owner, kernel in _kernels(view):
                yield _at_tip(view, owner, way, kernel)


def frames_of(view: View, tip: Array) -> tuple[Array, ...]:
    """What a shift of the tip along axes of the tool, of the base and of the workpiece shows, (m, 3) each.

    Those that are one are there once: tool and base where nothing turns the tool, base and workpiece where nothing
    turns the workpiece.
    """
    sides = [axis.workpiece_side for axis in view.machine.axes if axis.rotary]
    found, row = [tip], np.maximum(view.row, 0)
    observed = view.problem.observations
    turned = np.concatenate([each.machine.nominal(each.q, each.state.tool_length)[:, :3, :3] for each in observed])
    if not all(sides):
        found.append(np.einsum("mj,mkj->mk", tip, (base_from_workpiece(view.machine, view.q) @ turned)[row]))
    if any(sides):
        found.append(np.einsum("mj,mkj->mk", tip, turned[row]))
    return tuple(found)


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
        yield TIME, _smooth(time[:, None], JERK)
        for length in TIME_LENGTHS:
            apart = np.sqrt(3) * np.abs(time[:, None] - time) / length
            yield TIME, (1 + apart) * np.exp(-apart)
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
        low, high = float(values.min()), float(values.max())
        if not view.reach.moved(axis) or high == low:  # of a length both ends count for the reach, one is the row's
            continue
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


def slow(view: View) -> Array:
    """Smooth functions of each axis and of the time, of variance one together, (m, k)."""
    time = view.column("time_s")
    signals = [*scaled(view).T, *([2 * (time - time.mean()) / np.ptp(time)] if np.ptp(time) > 0 else [])]
    kernel = sum(np.exp(-0.5 * (u[:, None] - u) ** 2 / SLOWLY**2) for u in signals) / len(signals)
    return functions(np.asarray(kernel), SMOOTHEST)[np.maximum(view.row, 0)]


def _at_tip(view: View, owner: Candidate, way: Array, kernel: Array) -> Group | None:
    """Three independent components."""
    own = functions(kernel)[np.maximum(view.row, 0)]
    return together(view, owner, [way[:, [k]] * own for k in range(way.shape[1])])


def together(view: View, owner: Candidate, parts: Sequence[Array]) -> Group | None:
    """The parts with the same share each, at a size of 1 um together, with as few columns as they need."""
    sizes = [view.rms(np.linalg.norm(part, axis=1)) for part in parts]
    columns = [part / size for part, size in zip(parts, sizes, strict=True) if size > 0]
    if not columns:
        return None
    whole = np.concatenate(columns, axis=1) / np.sqrt(len(columns))
    squares, vectors = np.linalg.eigh(whole.T @ whole)
    kept = np.cumsum(squares) > KEPT * squares.sum()
    return Group(owner, np.zeros((0, int(kept.sum()))), whole @ vectors[:, kept])
