"""Poses chosen by exchange, so that a rival that is refitted to them still errs as much as possible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.measure.measurement import Array

COUNT = 12
"""Poses that are chosen."""
PASSES = 4
STARTS = 60
CLIMBED = 3
"""Of so many random dozens, so many are improved."""
LITTLE = 1.02
"""A pass that gains less is the last one."""


@dataclass(frozen=True, repr=False)
class Contest:
    """One name against another that imitates it: information of the old rows, and the blocks of every pose on offer.

    matrix, vector, square  inner products of what may be refitted, of that with the signal, of the signal
    columns (n, r, k), signal (n, r)  of the poses on offer
    """

    matrix: Array
    vector: Array
    square: float
    columns: Array
    signal: Array

    def told(self, rows: Sequence[int]) -> float:
        """What of the signal the refitted rival cannot imitate with these poses too, squared noise units."""
        matrix, vector, square = self.summed(rows)
        return square - float(vector @ np.linalg.solve(matrix, vector))

    def summed(self, rows: Sequence[int]) -> tuple[Array, Array, float]:
        """Inner products of old rows and these."""
        own = self.columns[list(rows)].reshape(-1, self.columns.shape[2])
        seen = self.signal[list(rows)].ravel()
        return self.matrix + own.T @ own, self.vector + own.T @ seen, self.square + float(seen @ seen)

    def told_with(self, rows: Sequence[int]) -> Array:
        """The same with these poses and one more, for every pose on offer, (n,): a block of rows added to a fit."""
        matrix, vector, square = self.summed(rows)
        count, height, width = self.columns.shape
        solved = np.linalg.solve(matrix, np.column_stack([vector, self.columns.reshape(-1, width).T]))
        missed = self.signal - self.columns @ solved[:, 0]
        spread = np.eye(height) + self.columns @ solved[:, 1:].reshape(width, count, height).transpose(1, 0, 2)
        gain = np.einsum("nr,nr->n", missed, np.linalg.solve(spread, missed[:, :, None])[:, :, 0])
        found: Array = square - float(vector @ solved[:, 0]) + gain
        return found


def exchanged(contests: Sequence[Contest], count: int) -> tuple[list[int], float]:
    """Start with many random dozens, keep the best, and exchange one pose after another as long as that helps."""
    random = np.random.default_rng(0)
    starts = [random.permutation(count)[:COUNT].tolist() for _ in range(STARTS)]
    starts.sort(key=lambda rows: -min(each.told(rows) for each in contests))
    best = [climbed(contests, rows) for rows in starts[:CLIMBED]]
    return max(best, key=lambda found: found[1])


def climbed(contests: Sequence[Contest], chosen: list[int]) -> tuple[list[int], float]:
    """Every pose in turn replaced by the one on offer that helps most in the worst contest."""
    value = min(each.told(chosen) for each in contests)
    for _ in range(PASSES):
        before = value
        for place in range(len(chosen)):
            rest = [*chosen[:place], *chosen[place + 1 :]]
            told = np.min([each.told_with(rest) for each in contests], axis=0)
            told[rest] = -np.inf
            best = int(told.argmax())
            if told[best] > value:
                chosen, value = [*chosen[:place], best, *chosen[place + 1 :]], float(told[best])
        if value < LITTLE * before:
            break
    return chosen, value
