"""The least that any tables of a kind can leave at the worst: whether a better fit is worth looking for.

Tables hold functions of some axes. Where these stand still and the correction changes all the same, the best that they
can do is to lie in the middle: half of the largest distance between two corrections is left, whatever is in them.

Of sums of functions of two axes, `least_worst` finds the best against the largest error, and proves that nothing does
better. The least-squares fit leaves most in the corners of the space. Fitting again and again with weights that grow
where much is left (C. L. Lawson, 1961) evens that out. It also bounds what is possible: whatever the weights, no
function of the kind leaves less at the worst than the weighted root mean square that the weighted fit leaves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import linprog

from ncfix.lazy_dataclass import dataclass
from ncfix.machine import Machine, State
from ncfix.tables.control import Least
from ncfix.tables.correction import (
    corners,
    even_poses,
    exact_correction,
    linear_axes,
    own_rotary_correction,
    poses_along,
    random_ways,
)
from ncfix.tables.grid import Array, hats, on_full_grid
from ncfix.tables.volume import Volume, even_line

ROUNDS = 40
SWEEPS = 2
"""Times that all pairs are fitted in a round."""
FIRST = 4
NEAR = 1.04
"""The largest error left may be so much above the bound."""
BASE = 0.05
"""Share of the weights that stays even."""
PLACES, OTHERS = 96, 96
"""Positions of the axes that are looked up, and poses of the others at each."""
FINE = 16
"""Places in each cell of a line."""
LINES = 4
"""Lines along an axis, besides those in the corners."""
NODES = 7
"""Positions of each axis on a full grid."""


@dataclass(frozen=True, slots=True)
class Remainder:
    """What functions of pairs of axes leave of a function on a full grid.

    nodes   positions along every axis
    turns   which axes repeat after a turn
    values  (*counts, n_outputs): the function less the functions of pairs
    bound   the least that any functions of pairs can leave at the worst of the nodes
    """

    nodes: Sequence[Array]
    turns: Sequence[bool]
    values: Array
    bound: float

    @property
    def rms(self) -> float:
        """Over the space, of the length over all outputs: nodes at its ends stand for half as much as others."""
        return float(np.sqrt((_shares(self.values.shape[:-1], self.turns)[..., None] * self.values**2).sum()))

    @property
    def largest(self) -> float:
        """At the worst of the nodes."""
        return float(np.linalg.norm(self.values, axis=-1).max())

    def along(self, axis: int, positions: Array, places: NDArray[np.intp]) -> Array:
        """At positions (n,) of one axis and nodes `places` (m, n_axes) of the others, by splines: (n, m, n_outputs)."""
        line, values = self.nodes[axis], np.moveaxis(self.values, axis, 0)
        if self.turns[axis]:
            line, values = np.append(line, line[0] + 2 * np.pi), np.concatenate([values, values[:1]])
            positions = line[0] + np.mod(positions - line[0], 2 * np.pi)
        curve = CubicSpline(line, values, bc_type="periodic" if self.turns[axis] else "not-a-knot")(positions)
        found: Array = curve[(slice(None), *np.delete(places, axis, axis=1).T)]
        return found


def least_worst(
    nodes: Sequence[Array], turns: Sequence[bool], values: Array, enough: float, together: int = 2
) -> Remainder:
    """What is left of values (*counts, n_outputs) by those functions of pairs that leave little at the worst.

    Of all that are tried those for which the product of the largest error and the rms is smallest: what lowers one by
    raising the other as much is no gain.

    enough    as much may be left at the worst by the least-squares fit, which is then kept
    together  1: sums of functions of one axis each, instead of two
    """
    axes = values.ndim - 1
    pairs = [
        tuple(axis for axis in range(axes) if axis not in pair)
        for pair in combinations(range(axes), min(together, axes))
    ]
    weights = even = _shares(values.shape[:-1], turns)
    best, bound, worst, least = Remainder(nodes, turns, values, 0.0), 0.0, np.inf, np.inf
    left, weighted = values.copy(), np.empty_like(values)
    for number in range(ROUNDS):
        totals = [weights.sum(axis=others, keepdims=True)[..., None] for others in pairs]
        each = np.repeat(weights[..., None], values.shape[-1], axis=-1)
        for _ in range(FIRST if number == 0 else SWEEPS):
            for others, total in zip(pairs, totals, strict=True):
                np.multiply(left, each, out=weighted)
                left -= weighted.sum(axis=others, keepdims=True) / total
        bound = max(bound, _proven(left, each, pairs))
        found = Remainder(nodes, turns, left, bound)
        largest = found.largest
        product = largest * found.rms
        if number == 0 or product < least:
            best, worst, least = replace(found, values=left.copy()), largest, product
        grown = weights * np.linalg.norm(left, axis=-1)
        if worst <= max(NEAR * bound, enough) or not grown.any():
            break
        weights = (1 - BASE) * grown / grown.sum() + BASE * even
    return replace(best, bound=bound)


def _shares(counts: Sequence[int], turns: Sequence[bool]) -> Array:
    """How much of the space each node stands for, (*counts); 1 in all."""
    shares = np.ones(())
    for count, turn in zip(counts, turns, strict=True):
        line = np.ones(count)
        if not turn and count > 1:
            line[[0, -1]] = 0.5
        shares = np.multiply.outer(shares, line / line.sum())
    return shares


def _proven(left: Array, weights: Array, pairs: Sequence[tuple[int, ...]]) -> float:
    """The least that can be left at the worst: what a measure sees that is blind to all functions of pairs.

    weights  as `left`, for each output

    Means over even weights commute, so that one pass takes all of those out of the measure.
    """
    measure = weights * left
    for others in pairs:
        measure -= measure.mean(axis=others, keepdims=True)
    total = float(np.linalg.norm(measure, axis=-1).sum())
    return float((measure * left).sum()) / total if total else 0.0


def least_of_functions(machine: Machine, space: Array, tool_length: float, inputs: Sequence[str], ways: bool) -> Least:
    """Tables over the axes `inputs` alone; `ways`: play of the axes is taken off besides."""
    chosen = [name in inputs for name in machine.axis_names]
    q = _mixed(space, np.array(chosen))
    direction = np.zeros_like(q) if ways else random_ways(len(space), len(q), seed=32)
    found = exact_correction(machine, q, State(tool_length, direction))[:, linear_axes(machine)]
    pairs = (np.linalg.norm(each[:, None] - each[None], axis=-1) for each in found.reshape(PLACES, OTHERS, 3))
    value = max(float(distances.max()) / 2 for distances in pairs)
    return Least(value, f"the correction changes by so much either way where {' '.join(inputs)} stand still")


def least_of_own_axis(machine: Machine, space: Array, tool_length: float) -> Least:
    """A table of each axis over itself, for each way apart."""
    values = {}
    for axis in linear_axes(machine):
        q = _mixed(space, np.arange(len(space)) == axis)
        own = _correction(machine, q, tool_length)[:, axis].reshape(PLACES, OTHERS)
        values[machine.axis_names[axis]] = float(np.ptp(own, axis=1).max()) / 2
    name = max(values, key=lambda name: values[name])
    return Least(values[name], f"the correction of {name} changes by so much either way where {name} stands")


def least_of_sums(machine: Machine, space: Array, tool_length: float) -> Least:
    """Sums of functions of one axis each, with the rotary axes turned right by their own errors."""
    lines = [np.linspace(low, high, NODES) for low, high in space.tolist()]
    values = on_full_grid(lambda q: _correction(machine, q, tool_length)[:, linear_axes(machine)], lines)
    left = least_worst(lines, [False] * len(lines), values, 0.0, together=1)
    return Least(left.bound, "a weighting of the correction that no function of one axis sees has so much of it")


def least_of_even_nodes(volume: Volume, index: int, count: int) -> Least:
    """Evenly spaced nodes along one input, from one end of the range to the other, whatever the others have.

    Along a line such a table is straight between them; which values come nearest at the worst is a linear programme.
    """
    low, high = volume.covered[index].tolist()
    unit = volume.units[index]
    nodes = even_line(low / unit, high / unit, count, volume.anchor(index)) * unit
    fine = np.linspace(low, high, FINE * (count - 1) + 1)
    starts = np.concatenate([corners(volume.ranges), even_poses(volume.ranges, LINES)])
    starts[:, index] = low
    best = 0.0
    for start in np.unique(starts, axis=0):
        line = volume.exact(poses_along(index, fine, start[None]))
        best = max(best, *(_nearest(fine, curve, nodes) for curve in line.T))
    return Least(best, f"{count} even points along {volume.inputs[index]} follow its bending no better")


def _correction(machine: Machine, q: Array, tool_length: float) -> Array:
    """The exact correction where the rotary axes are turned right by their own errors, (n, n_axes)."""
    state = State(tool_length)
    return exact_correction(machine, q, state, own_rotary_correction(machine, q, state))


def _mixed(space: Array, chosen: Array) -> Array:
    """Positions of the axes that are chosen, each with many of the others, ends first: (PLACES * OTHERS, n_axes)."""
    kept = np.concatenate([corners(space), even_poses(space, PLACES)])[:PLACES]
    varied = np.concatenate([corners(space), even_poses(space, OTHERS)])[:OTHERS]
    q: Array = np.where(chosen, kept[:, None], varied[None]).reshape(-1, len(space))
    return q


def _nearest(places: Array, curve: Array, nodes: Array) -> float:
    """The least by which a function that is straight between nodes misses a curve at the worst."""
    weights, one = hats(places, nodes), np.ones((len(places), 1))
    rows = np.block([[weights, -one], [-weights, -one]])
    cost = np.append(np.zeros(len(nodes)), 1.0)
    limits = [(None, None)] * len(nodes) + [(0.0, None)]
    found = linprog(cost, A_ub=rows, b_ub=np.concatenate([curve, -curve]), bounds=limits)
    return float(found.fun) if found.success else 0.0
