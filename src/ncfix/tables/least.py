"""The least that any tables of a kind can leave at the worst: whether a better fit is worth looking for.

Tables hold functions of some axes. Where these stand still and the correction changes all the same, the best that they
can do is to lie in the middle: half of the largest distance between two corrections is left, whatever is in them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linprog

from ncfix.machine import Machine, State
from ncfix.tables.control import Least
from ncfix.tables.exact import exact_correction, linear_axes, own_rotary_error
from ncfix.tables.fit import hats
from ncfix.tables.grid import Array
from ncfix.tables.minimax import least_worst
from ncfix.tables.poses import corners, even_poses, random_ways
from ncfix.tables.volume import Volume, even_line

PLACES, OTHERS = 96, 96
"""Positions of the axes that are looked up, and poses of the others at each."""
FINE = 16
"""Places in each cell of a line."""
LINES = 4
"""Lines along an axis, besides those in the corners."""
NODES = 7
"""Positions of each axis on a full grid."""


def of_functions(machine: Machine, space: Array, tool_length: float, inputs: Sequence[str], ways: bool) -> Least:
    """Tables over the axes `inputs` alone; `ways`: play of the axes is taken off besides."""
    chosen = [name in inputs for name in machine.axis_names]
    q = _mixed(space, np.array(chosen))
    direction = np.zeros_like(q) if ways else random_ways(len(space), len(q), seed=32)
    found = exact_correction(machine, q, State(tool_length, direction))[:, linear_axes(machine)]
    value = max(_half_apart(each) for each in found.reshape(PLACES, OTHERS, 3))
    return Least(value, f"the correction changes by so much either way where {' '.join(inputs)} stand still")


def of_own_axis(machine: Machine, space: Array, tool_length: float) -> Least:
    """A table of each axis over itself, for each way apart."""
    values = {}
    for axis in linear_axes(machine):
        q = _mixed(space, np.arange(len(space)) == axis)
        state = State(tool_length)
        turned = np.zeros_like(q)
        for other in np.flatnonzero(machine.rotary).tolist():
            turned[:, other] = -own_rotary_error(machine, q, state, other)
        own = exact_correction(machine, q, state, turned)[:, axis].reshape(PLACES, OTHERS)
        values[machine.axis_names[axis]] = float(np.ptp(own, axis=1).max()) / 2
    axis_name = max(values, key=lambda name: values[name])
    return Least(
        values[axis_name], f"the correction of {axis_name} changes by so much either way where {axis_name} stands"
    )


def of_sums(machine: Machine, space: Array, tool_length: float) -> Least:
    """Sums of functions of one axis each, with the rotary axes turned right by their own errors."""
    lines = [np.linspace(low, high, NODES) for low, high in space.tolist()]
    q = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))
    state = State(tool_length)
    turned = np.zeros_like(q)
    for axis in np.flatnonzero(machine.rotary).tolist():
        turned[:, axis] = -own_rotary_error(machine, q, state, axis)
    values = exact_correction(machine, q, state, turned)[:, linear_axes(machine)]
    left = least_worst(lines, [False] * len(lines), values.reshape(*map(len, lines), 3), 0.0, together=1)
    return Least(left.bound, "a weighting of the correction that no function of one axis sees has so much of it")


def of_even_nodes(volume: Volume, index: int, count: int) -> Least:
    """Evenly spaced nodes along one input, from one end of the range to the other, whatever the others have.

    Along a line such a table is straight between them; which values come nearest at the worst is a linear programme.
    """
    low, high = volume.covered[index].tolist()
    anchor = volume.anchors[index] if volume.anchors else None
    unit = volume.units[index]
    nodes = even_line(low / unit, high / unit, count, anchor) * unit
    fine = np.linspace(low, high, FINE * (count - 1) + 1)
    starts = np.concatenate([corners(volume.ranges), even_poses(volume.ranges, LINES)])
    starts[:, index] = low
    best = 0.0
    for start in np.unique(starts, axis=0):
        line = np.repeat(start[None], len(fine), axis=0)
        line[:, index] = fine
        best = max(best, *(_nearest(fine, curve, nodes) for curve in volume.exact(line).T))
    return Least(best, f"{count} even points along {volume.inputs[index]} follow its bending no better")


def _mixed(space: Array, chosen: Array) -> Array:
    """Positions of the axes that are chosen, each with many of the others, ends first: (PLACES * OTHERS, n_axes)."""
    kept = np.concatenate([corners(space), even_poses(space, PLACES)])[:PLACES]
    varied = np.concatenate([corners(space), even_poses(space, OTHERS)])[:OTHERS]
    q: Array = np.where(chosen, kept[:, None], varied[None]).reshape(-1, len(space))
    return q


def _half_apart(points: Array) -> float:
    """Half of the largest distance between two of the points (n, 3)."""
    return float(np.linalg.norm(points[:, None] - points[None], axis=-1).max()) / 2


def _nearest(places: Array, curve: Array, nodes: Array) -> float:
    """The least by which a function that is straight between nodes misses a curve at the worst."""
    weights, one = hats(places, nodes), np.ones((len(places), 1))
    rows = np.block([[weights, -one], [-weights, -one]])
    cost = np.append(np.zeros(len(nodes)), 1.0)
    limits = [(None, None)] * len(nodes) + [(0.0, None)]
    found = linprog(cost, A_ub=rows, b_ub=np.concatenate([curve, -curve]), bounds=limits)
    return float(found.fun) if found.success else 0.0
