"""The best that sums of functions of two axes can do against the largest error, and the proof that nothing does better.

The least-squares fit leaves most in the corners of the space. Fitting again and again with weights that grow where much
is left (C. L. Lawson, 1961) evens that out. It also bounds what is possible: whatever the weights, no function of the
kind leaves less at the worst than the weighted root mean square that the weighted fit leaves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from ncfix.tables.grid import Array

ROUNDS = 40
SWEEPS = 2
"""Times that all pairs are fitted in a round."""
FIRST = 4
NEAR = 1.04
"""The largest error left may be so much above the bound."""
BASE = 0.05
"""Share of the weights that stays even."""


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
    left = values
    best, bound = Remainder(nodes, turns, values, 0.0), 0.0
    for number in range(ROUNDS):
        for _ in range(FIRST if number == 0 else SWEEPS):
            for others in pairs:
                left = left - _mean(left, weights, others)
        bound = max(bound, _proven(left, weights, pairs))
        found = Remainder(nodes, turns, left, bound)
        if number == 0 or found.largest * found.rms < best.largest * best.rms:
            best = found
        grown = weights * np.linalg.norm(left, axis=-1)
        if best.largest <= max(NEAR * bound, enough) or not grown.any():
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


def _mean(left: Array, weights: Array, others: tuple[int, ...]) -> Array:
    share = weights.sum(axis=others, keepdims=True)[..., None]
    found: Array = (left * weights[..., None]).sum(axis=others, keepdims=True) / share
    return found


def _proven(left: Array, weights: Array, pairs: Sequence[tuple[int, ...]]) -> float:
    """The least that can be left at the worst: what a measure sees that is blind to all functions of pairs.

    Means over even weights commute, so that one pass takes all of those out of the measure.
    """
    measure = weights[..., None] * left
    for others in pairs:
        measure = measure - measure.mean(axis=others, keepdims=True)
    total = float(np.linalg.norm(measure, axis=-1).sum())
    return float((measure * left).sum()) / total if total else 0.0
