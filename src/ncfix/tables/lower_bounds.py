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


@frozen
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

    def along(self, axis: int, positions: Array, places: Index) -> Array:
        """At positions (n,) of one axis and nodes `places` (m, n_axes) of the others, by splines: (n, m, n_outputs)."""
        values = np.moveaxis(self.values, axis, 0)
        weights = spline_weights(self.nodes[axis], positions, 2 * np.pi if self.turns[axis] else None)
        curve = (weights @ values.reshape(len(values), -1)).reshape(len(positions), *values.shape[1:])
        return curve[(slice(None), *np.delete(places, axis, axis=1).T)]


def least_worst(
    nodes: Sequence[Array], turns: Sequence[bool], values: Array, enough: float, together: int = 2
) -> Remainder:
    """What is left of values (*counts, n_outputs) by those functions of pairs that leave little at the worst.

    Of all that are tried those for which the product of the largest error and the rms is smallest: what lowers one by
    raising the other as much is no gain.

    enough    as much may be left at the worst by the least-squares fit, which is then kept
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
        if worst <= max(NEAR * bound, enough) or not grown.any():
            break
        weights = (1 - BASE) * grown / grown.sum() + BASE * even
    return Remainder(nodes, turns, np.ascontiguousarray(best), bound)


Axes = tuple[int, ...]
"""Axes of the grid on which something depends, in order."""


class _Sums:
    """Sums of values on a full grid (..., *counts) over all but some axes, each worked out from the next larger one."""

    def __init__(self, values: Array, axes: int) -> None:
        self.known = {tuple(range(axes)): values}
        self.axes, self.before = axes, values.ndim - axes

    def over(self, subset: Axes) -> Array:
        """The sums that depend on the axes of `subset`; the others are left with one place."""
        if subset not in self.known:
            gone = max(axis for axis in range(self.axes) if axis not in subset)
            larger = self.over(tuple(sorted((*subset, gone))))
            self.known[subset] = larger.sum(axis=self.before + gone, keepdims=True)
        return self.known[subset]


Functions = dict[Axes, Array]
"""Functions of some axes each, (n_outputs, *counts) with one place along the others."""


def _fitted(left: Array, weights: Array, sets: Sequence[Axes], sweeps: int) -> tuple[Functions, Functions]:
    """Functions of some sets of axes each whose sum is near `left` (n_outputs, *counts) in the weighted mean square.

    And the weighted sums, over the other axes, of what they leave.

    One after the other is fitted to what the others leave, so many times. For that no more is needed of the grid than
    the weighted sums of `left` over all but the axes of each set, and of the weights over all but those of each two.
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
    """The weight that places of the set `subset` have in common with places of all sets, (n_subset, count)."""
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
    """The axes of both sets; how the part of a block that they have in common is named; an index without others."""
    both = tuple(sorted({*one, *other}))
    first, second, union = ("".join(ascii_letters[axis] for axis in each) for each in (one, other, both))
    return both, f"{first}{second}->{union}", tuple(slice(None) if axis in both else 0 for axis in range(axes))


def _together(functions: Functions) -> Array:
    """The sum of functions of some axes each, those that end with one axis first: most sums are over few axes."""
    total: Array = np.zeros(())
    for last in sorted({subset[-1:] for subset in functions}):
        group = [functions[subset] for subset in sorted(functions) if subset[-1:] == last]
        total = total + reduce(np.add, group)
    return total


def _shares(counts: Sequence[int], turns: Sequence[bool]) -> Array:
    """How much of the space each node stands for, (*counts); 1 in all."""
    shares = np.ones(())
    for count, turn in zip(counts, turns, strict=True):
        line = np.ones(count)
        if not turn and count > 1:
            line[[0, -1]] = 0.5
        shares = np.multiply.outer(shares, line / line.sum())
    return shares


def _proven(left: Array, weights: Array, sums: Functions) -> float:
    """The least that can be left at the worst: what a measure sees that is blind to functions of some sets of axes.

    sums  of `weights * left` over all axes but those of each set

    Taken out of the measure is what depends on the axes of a set: means over the others, less what is in several.
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
    standing = np.concatenate([corners(space), even_poses(space, PLACES)])[:PLACES]
    varied = np.concatenate([corners(space), even_poses(space, OTHERS)])[:OTHERS]
    return np.where(chosen, standing[:, None], varied[None]).reshape(-1, len(space))


def _nearest(places: Array, curve: Array, nodes: Array) -> float:
    """The least by which a function that is straight between nodes misses a curve at the worst."""
    from scipy.optimize import linprog

    weights, one = hats(places, nodes), np.ones((len(places), 1))
    rows = np.block([[weights, -one], [-weights, -one]])
    cost = np.append(np.zeros(len(nodes)), 1.0)
    limits = [(None, None)] * len(nodes) + [(0.0, None)]
    found = linprog(cost, A_ub=rows, b_ub=np.concatenate([curve, -curve]), bounds=limits)
    return float(found.fun) if found.success else 0.0
