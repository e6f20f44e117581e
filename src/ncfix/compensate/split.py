"""Splitting motions at the fewest places: from each emitted point as far as a straight piece stays within tolerance.

Each motion has a fine grid of nodes with the exactly corrected command of each. A straight piece from node a to node b
is judged at the nodes between them: there the tip is off by the difference between the command on the piece and the
exact command, times how the tip follows commands; the error model need not be evaluated again. Differences are of the
order of the tolerance, so what is left out is smaller by the gradient of the errors (under a thousandth).

Going as far as possible from each point gives the fewest pieces that can be had with ends on the exact path. All
motions are worked on at once, and all stretches of those with very many nodes: a round tries one end for each of them.
The first one tried is as far as the piece before went, then ends ever farther on from there, or back, until the
farthest is between two that were tried; then the gap is halved.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from ncfix import fast
from ncfix.compensate.plan.arrays import Array, Index, Mask, largest, offsets, owners, places

STRETCH = 1024
"""Nodes of a motion after which a piece ends in any case."""


class Cuttable(Protocol):
    """Motions with nodes between which there may be pieces."""

    @property
    def counts(self) -> Index:
        """(g,) nodes of each motion, its start and end included; at least 2."""

    def deviations(self, first: Index, last: Index) -> Array:
        """The largest deviation of pieces from nodes `first` to nodes `last` (flat indices), (p,) mm."""

    def shape(self, first: Index, last: Index) -> tuple[Mask, Array]:
        """Which pieces are arcs (p,), and their centres (p, 3)."""


@dataclass(frozen=True)
class Grid:
    """Nodes of motions, flat, all nodes of a motion next to each other.

    counts    (g,) nodes of each motion, its start and end included; at least 2
    fraction  (k,) ascending from 0 to 1 in each motion
    command   (k, n_axes) exactly corrected command; at the start where the machine really stands
    follow    (k or 1, 3, n_axes) how the tip follows the command there, mm per mm and mm per rad
    """

    counts: Index
    fraction: Array
    command: Array
    follow: Array

    def deviations(self, first: Index, last: Index) -> Array:
        """The largest deviation of straight pieces from nodes `first` to nodes `last` (flat indices), (p,) mm."""
        inner, fraction, (commands, follows) = last - first - 1, self.fraction, self._columns
        begun, ended = np.repeat(first, inner), np.repeat(last, inner)
        node = begun + 1 + places(inner)
        share = (fraction[node] - fraction[begun]) / (fraction[ended] - fraction[begun])
        start = commands.take(begun, axis=1)
        short = start + share * (commands.take(ended, axis=1) - start) - commands.take(node, axis=1)
        off = np.zeros((3, len(node)))
        for axis, row, follow in follows:
            off[row] += (follow[node] if len(follow) > 1 else follow) * short[axis]
        square: Array = largest(off[0] * off[0] + off[1] * off[1] + off[2] * off[2], inner)
        return np.sqrt(square)

    @cached_property
    def _columns(self) -> tuple[Array, list[tuple[int, int, Array]]]:
        """Commands (n_axes, k), and axis, direction and how the tip follows (k or 1,), wherever it follows at all."""
        axes, rows = np.nonzero(self.follow.any(axis=0).T)
        follows = [(j, i, self.follow[:, i, j].copy()) for j, i in zip(axes.tolist(), rows.tolist(), strict=True)]
        return np.ascontiguousarray(self.command.T), follows

    def shape(self, first: Index, last: Index) -> tuple[Mask, Array]:
        """No piece is an arc."""
        return np.zeros(len(first), dtype=bool), np.full((len(first), 3), np.nan)


def fewest(grid: Cuttable, tolerance: float) -> tuple[Mask, Array]:
    """Which nodes end a piece (k,), and the largest deviation of each motion's pieces (g,) mm.

    A piece from one node to the next is always allowed: it has no nodes between.
    """
    if fast.engaged() and isinstance(grid, Grid):
        from ncfix.compensate import kernels

        nodes, motions = np.zeros(len(grid.fraction), dtype=bool), np.zeros(len(grid.counts))
        follow = np.ascontiguousarray(grid.follow)
        kernels.fewest(grid.counts, grid.fraction, grid.command, follow, tolerance, nodes, motions)
        return nodes, motions
    stretches, at, stop = _stretches(grid.counts)
    ends = np.zeros(int(grid.counts.sum()), dtype=bool)
    worst = np.zeros(len(at))
    near, far, reached = at + 1, stop + 1, np.zeros(len(at))
    usual = np.ones(len(at), dtype=np.intp)
    step, fresh = usual.copy(), np.ones(len(at), dtype=bool)
    active = np.arange(len(at))
    while active.size:
        trial = _next_trial(at[active], near[active], far[active], stop[active], step[active])
        settled = (trial <= near[active]) | (near[active] >= stop[active])
        trying, trial = active[~settled], trial[~settled]
        off = grid.deviations(at[trying], trial)
        good = off <= tolerance
        near[trying[good]], reached[trying[good]] = trial[good], off[good]
        far[trying[~good]] = trial[~good]
        step[trying] = np.where(fresh[trying], 1, 2 * step[trying])
        fresh[trying] = False
        done = active[settled]
        ends[near[done]] = True
        worst[done] = np.maximum(worst[done], reached[done])
        usual[done] = np.maximum(near[done] - at[done] - 1, 1)
        at[done], reached[done], far[done], step[done], fresh[done] = near[done], 0.0, stop[done] + 1, usual[done], True
        near[done] = np.minimum(at[done] + 1, stop[done])
        active = active[at[active] < stop[active]]
    return ends, largest(worst, stretches)


def _stretches(counts: Index) -> tuple[Index, Index, Index]:
    """How many stretches motions with `counts` (g,) nodes have; the first and the last node of each stretch."""
    many = np.maximum((counts - 1) // STRETCH, 1)
    begin = offsets(counts)[:-1][owners(many)] + places(many) * STRETCH
    end = begin + STRETCH
    end[offsets(many)[1:] - 1] = offsets(counts)[1:] - 1
    return many, begin, end


def _next_trial(at: Index, near: Index, far: Index, stop: Index, step: Index) -> Index:
    """The next end to be tried, where `near` is good and `far` is not, or has not been tried if it is behind `stop`."""
    half = (near + far) // 2
    back = np.where(near > at + 1, half, np.maximum(far - step, half))
    trial: Index = np.where(far > stop, np.minimum(near + step, stop), back)
    return trial
