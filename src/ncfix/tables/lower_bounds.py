"""Lower bounds of the largest error that any tables of a kind can leave, which tell whether a better fit is possible.

Tables are functions of some axes. If the correction changes while these axes stand still, the best value is the middle:
half the largest distance between two corrections remains, whatever the tables contain.

For sums of functions of two axes, `least_worst` finds a fit of small largest error, with a lower bound. A least-squares
fit leaves most in the corners of the space. Iteratively reweighted fits, with weights that grow with the error (C. L.
Lawson, 1961), even that out. They also give the bound: for any weights, the largest error of every function of the kind
is at least the weighted root mean square error of the weighted fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, reduce
from itertools import combinations, pairwise
from math import comb
from string import ascii_letters
from typing import Any

import numpy as np

from ncfix.arrays import Array, Index
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
from ncfix.tables.grid import hats, on_full_grid, spline_weights
from ncfix.tables.volume import Volume, even_line
from ncfix.values import frozen

ROUNDS = 40
SWEEPS = 2
"""Number of sweeps over all pairs in a round."""
FIRST = 4
"""Number of sweeps over all pairs in the first round."""
CLOSE_RATIO = 1.04
"""Ratio of the largest error to the bound at which the iteration ends."""
BASE = 0.05
"""Share of the weights that stays uniform."""
PLACES, OTHERS = 96, 96
"""Number of positions of the axes that are looked up, and of poses of the other axes at each."""
FINE = 16
"""Number of positions in each cell of a line."""
LINES = 4
"""Number of lines along an axis, besides those in the corners."""
NODES = 7
"""Number of positions of each axis on a full grid."""


@frozen
class Remainder:
    """The remainder of a function on a full grid after subtraction of functions of pairs of axes.

    nodes   positions along every axis
    turns   for each axis, whether it repeats after a turn
    values  (*counts, n_outputs) the remainder
    bound   lower bound of the largest remainder, at the nodes, for any functions of pairs
    """

    nodes: Sequence[Array]
    turns: Sequence[bool]
    values: Array
    bound: float

    @property
    def rms(self) -> float:
        """Root mean square over the space of the length over all outputs; end nodes count half."""
        return float(np.sqrt((_shares(self.values.shape[:-1], self.turns)[..., None] * self.values**2).sum()))

    @property
    def largest(self) -> float:
        """Largest length over all outputs at any node."""
        return float(np.linalg.norm(self.values, axis=-1).max())

    def along(self, axis: int, positions: Array, places: Index) -> Array:
        """Values (n, m, n_outputs) at positions (n,) of one axis, by splines, and nodes `places` (m, n_axes) else."""
        values = np.moveaxis(self.values, axis, 0)
        weights = spline_weights(self.nodes[axis], positions, 2 * np.pi if self.turns[axis] else None)
        curve = (weights @ values.reshape(len(values), -1)).reshape(len(positions), *values.shape[1:])
        return curve[(slice(None), *np.delete(places, axis, axis=1).T)]


def least_worst(
    nodes: Sequence[Array], turns: Sequence[bool], values: Array, enough: float, together: int = 2
) -> Remainder:
    """The remainder of values (*counts, n_outputs) with functions of pairs of small largest error.

    Among the fits of all rounds the one with the smallest product of largest error and rms is chosen.

    enough    largest error at which the least-squares fit is kept
    together  1: sums of functions of one axis each, instead of two
    """
    grid = values.shape[:-1]
    sets = list(combinations(range(len(grid)), min(together, len(grid))))
    weights = even = _shares(grid, turns)
    best, bound, worst, least = values, 0.0, np.inf, np.inf
    left = np.ascontiguousarray(np.moveaxis(values, -1, 0))
    for number in range(ROUNDS):
        functions, sums = _fitted(left, weights, sets, FIRST if number == 0 else SWEEPS)
        left = left - _together(functions)
        bound = max(bound, _proven(left, weights, sums))
        squares = (left**2).sum(axis=0)
        largest = float(np.sqrt(squares.max()))
        product = largest * float(np.sqrt((even * squares).sum()))
        if number == 0 or product < least:
            best, worst, least = np.moveaxis(left, 0, -1), largest, product
        grown = weights * np.sqrt(squares)
        if worst <= max(CLOSE_RATIO * bound, enough) or not grown.any():
            break
        weights = (1 - BASE) * grown / grown.sum() + BASE * even
    return Remainder(nodes, turns, np.ascontiguousarray(best), bound)


Axes = tuple[int, ...]
"""Axes of the grid on which something depends, in order."""


class _Sums:
    """Sums of values on a full grid (..., *counts) over all but some axes, each computed from a larger one; cached."""

    def __init__(self, values: Array, axes: int) -> None:
        self.known = {tuple(range(axes)): values}
        self.axes, self.before = axes, values.ndim - axes

    def over(self, subset: Axes) -> Array:
        """The sum as a function of the axes of `subset`; the other axes have length one."""
        if subset not in self.known:
            gone = max(axis for axis in range(self.axes) if axis not in subset)
            larger = self.over(tuple(sorted((*subset, gone))))
            self.known[subset] = larger.sum(axis=self.before + gone, keepdims=True)
        return self.known[subset]


Functions = dict[Axes, Array]
"""Functions of some axes each, (n_outputs, *counts) with one place along the others."""


def _fitted(left: Array, weights: Array, sets: Sequence[Axes], sweeps: int) -> tuple[Functions, Functions]:
    """Functions of the sets of axes, fitted to `left` (n_outputs, *counts) by weighted least squares; and the weighted
    sums of the residual over the other axes of each set.

    Each function in turn is fitted to the residual of the others, in `sweeps` sweeps. This needs only the weighted sums
    of `left` over all but the axes of each set, and of the weights over all but the axes of each two sets.
    """
    totals, sums = _Sums(weights, weights.ndim), _Sums(weights * left, weights.ndim)
    ends = np.cumsum([0, *(totals.over(subset).size for subset in sets)]).tolist()
    places = [slice(*each) for each in pairwise(ends)]
    wanted = np.concatenate([sums.over(subset).reshape(len(left), -1) for subset in sets], axis=1)
    found = np.zeros_like(wanted)
    shared = [_shared(totals, sets, places, subset, ends[-1]) for subset in sets]
    for number in list(range(len(sets))) * sweeps:
        place = places[number]
        change = wanted[:, place] / totals.over(sets[number]).ravel()
        found[:, place] += change
        wanted -= change @ shared[number]
    both = [
        {subset: values[:, place].reshape(sums.over(subset).shape) for subset, place in zip(sets, places, strict=True)}
        for values in (found, wanted)
    ]
    return both[0], both[1]


def _shared(totals: _Sums, sets: Sequence[Axes], places: Sequence[slice], subset: Axes, count: int) -> Array:
    """Common weight of each place of the set `subset` with each place of all sets, (n_subset, count)."""
    shape = totals.over(subset).shape
    found = np.zeros((np.prod(shape), count))
    for other, place in zip(sets, places, strict=True):
        both, subscripts, without = _union(subset, other, totals.axes)
        total = totals.over(both)
        block = found[:, place].reshape([total.shape[axis] for axis in (*subset, *other)])
        np.einsum(subscripts, block)[...] = total[without]
    return found


@cache
def _union(one: Axes, other: Axes, axes: int) -> tuple[Axes, str, tuple[Any, ...]]:
    """The union of two sets of axes; the einsum subscripts of the block over both; an index that drops other axes."""
    both = tuple(sorted({*one, *other}))
    first, second, union = ("".join(ascii_letters[axis] for axis in each) for each in (one, other, both))
    return both, f"{first}{second}->{union}", tuple(slice(None) if axis in both else 0 for axis in range(axes))


def _together(functions: Functions) -> Array:
    """The sum of functions of some axes each; grouped by the last axis, so that most additions are of small arrays."""
    total: Array = np.zeros(())
    for last in sorted({subset[-1:] for subset in functions}):
        group = [functions[subset] for subset in sorted(functions) if subset[-1:] == last]
        total = total + reduce(np.add, group)
    return total


def _shares(counts: Sequence[int], turns: Sequence[bool]) -> Array:
    """Share of the space of each node, (*counts), with sum 1."""
    shares = np.ones(())
    for count, turn in zip(counts, turns, strict=True):
        line = np.ones(count)
        if not turn and count > 1:
            line[[0, -1]] = 0.5
        shares = np.multiply.outer(shares, line / line.sum())
    return shares


def _proven(left: Array, weights: Array, sums: Functions) -> float:
    """Lower bound of the largest error, by a signed measure that is orthogonal to all functions of the sets of axes.

    sums  sums of `weights * left` over all axes but those of each set

    The measure is `weights * left` less its parts that depend on the axes of a set, by inclusion and exclusion.
    """
    axes, order = weights.ndim, len(next(iter(sums)))
    seen: Functions = {}
    for subset, values in sums.items():
        for size in range(order + 1):
            share = (-1) ** (order - size) * (comb(axes - size - 1, order - size) if size < order else 1)
            for fewer in combinations(subset, size):
                others = tuple(1 + axis for axis in subset if axis not in fewer)
                if share and fewer not in seen:
                    count = np.prod([weights.shape[axis] for axis in range(axes) if axis not in fewer])
                    seen[fewer] = values.sum(axis=others, keepdims=True) * (share / count)
    measure = weights * left - _together(seen)
    total = float(np.sqrt((measure**2).sum(axis=0)).sum())
    return float((measure * left).sum()) / total if total else 0.0


def least_of_functions(machine: Machine, space: Array, tool_length: float, inputs: Sequence[str], ways: bool) -> Least:
    """The bound for tables over the axes `inputs` only; `ways`: backlash is compensated separately."""
    chosen = [name in inputs for name in machine.axis_names]
    q = _mixed(space, np.array(chosen))
    direction = np.zeros_like(q) if ways else random_ways(len(space), len(q), seed=32)
    found = exact_correction(machine, q, State(tool_length, direction))[:, linear_axes(machine)]
    pairs = (np.linalg.norm(each[:, None] - each[None], axis=-1) for each in found.reshape(PLACES, OTHERS, 3))
    value = max(float(distances.max()) / 2 for distances in pairs)
    return Least(value, f"the correction varies by plus or minus this at one position of {' '.join(inputs)}")


def least_of_own_axis(machine: Machine, space: Array, tool_length: float) -> Least:
    """The bound for a table of each axis over itself, one for each direction."""
    values = {}
    for axis in linear_axes(machine):
        q = _mixed(space, np.arange(len(space)) == axis)
        own = _correction(machine, q, tool_length)[:, axis].reshape(PLACES, OTHERS)
        values[machine.axis_names[axis]] = float(np.ptp(own, axis=1).max()) / 2
    name = max(values, key=lambda name: values[name])
    return Least(values[name], f"the correction of {name} varies by plus or minus this at one position of {name}")


def least_of_sums(machine: Machine, space: Array, tool_length: float) -> Least:
    """The bound for sums of functions of one axis each, with rotary axes corrected for their own errors."""
    lines = [np.linspace(low, high, NODES) for low, high in space.tolist()]
    values = on_full_grid(lambda q: _correction(machine, q, tool_length)[:, linear_axes(machine)], lines)
    left = least_worst(lines, [False] * len(lines), values, 0.0, together=1)
    return Least(
        left.bound, "a part of the correction of this size cannot be written as a sum of functions of one axis"
    )


def least_of_even_nodes(volume: Volume, index: int, count: int) -> Least:
    """The bound for `count` evenly spaced nodes along one input, whatever the nodes of the others.

    Along a line such a table is piecewise linear; its values of least largest error are a linear programme.
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
    return Least(best, f"{count} equidistant points along {volume.inputs[index]} cannot follow the curvature better")


def _correction(machine: Machine, q: Array, tool_length: float) -> Array:
    """The exact correction (n, n_axes) with rotary axes corrected for their own angular positioning errors."""
    state = State(tool_length)
    return exact_correction(machine, q, state, own_rotary_correction(machine, q, state))


def _mixed(space: Array, chosen: Array) -> Array:
    """Poses (PLACES * OTHERS, n_axes): each position of the chosen axes with many of the others, corners first."""
    standing = np.concatenate([corners(space), even_poses(space, PLACES)])[:PLACES]
    varied = np.concatenate([corners(space), even_poses(space, OTHERS)])[:OTHERS]
    return np.where(chosen, standing[:, None], varied[None]).reshape(-1, len(space))


def _nearest(places: Array, curve: Array, nodes: Array) -> float:
    """Smallest possible largest deviation of a piecewise linear function over the nodes from a curve."""
    from scipy.optimize import linprog

    weights, one = hats(places, nodes), np.ones((len(places), 1))
    rows = np.block([[weights, -one], [-weights, -one]])
    cost = np.append(np.zeros(len(nodes)), 1.0)
    limits = [(None, None)] * len(nodes) + [(0.0, None)]
    found = linprog(cost, A_ub=rows, b_ub=np.concatenate([curve, -curve]), bounds=limits)
    return float(found.fun) if found.success else 0.0
