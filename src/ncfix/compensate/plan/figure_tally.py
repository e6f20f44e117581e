"""Tip errors before and after a correction: samples along a path, and the figures (max, rms) over all of them."""

from __future__ import annotations

import numpy as np

from ncfix.arrays import Array, Index
from ncfix.values import frozen


@frozen
class Figures:
    """Tip errors along a path.

    max       largest, mm
    rms       root mean square, weighted by length of way, mm
    move      the motion with the largest error, -1 if there is none
    fraction  the fraction of that motion
    """

    max: float
    rms: float
    move: int
    fraction: float


@frozen
class PathError:
    """Tip errors before and after a correction.

    before, after  figures over all sampled motions
    samples        number of samples
    way            length of path that the samples represent, mm
    """

    before: Figures
    after: Figures
    samples: int
    way: float = 0.0


@frozen
class PathSamples:
    """Samples on a path, flat: motion, fraction, tip error before and after, mm, and the length each represents, mm."""

    move: Index
    fraction: Array
    before: Array
    after: Array
    weight: Array


def _early(at: tuple[float, int, float]) -> tuple[float, int, float]:
    """Sort key of (error, motion, fraction): of equal errors, the first on the path is the largest."""
    error, move, fraction = at
    return error, -move, -fraction


class FigureTally:
    """Adds up samples batch by batch to figures.

    squares  sum of squares times way, mm^3, before and after
    at       largest error, mm, with its motion and fraction, before and after
    """

    def __init__(self) -> None:
        self.squares = [0.0, 0.0]
        self.at: list[tuple[float, int, float]] = [(0.0, -1, 0.0), (0.0, -1, 0.0)]
        self.way = 0.0
        self.samples = 0

    def add(self, part: PathSamples) -> None:
        """Add a batch of samples, except those with an unknown error (NaN)."""
        weight = np.where(np.isfinite(part.before) & np.isfinite(part.after), part.weight, 0.0)
        self.way += float(weight.sum())
        self.samples += int(np.count_nonzero(np.isfinite(part.after)))
        for side, error in enumerate((part.before, part.after)):
            known = np.nan_to_num(error)
            self.squares[side] += float((weight * known**2).sum())
            best = int(known.argmax())
            there = float(known[best]), int(part.move[best]), float(part.fraction[best])
            self.at[side] = max(self.at[side], there, key=_early)

    def take(self, way: float, samples: int, squares: list[float], most: list[tuple[float, int, float]]) -> None:
        """Add sums made elsewhere; `squares` and `most` before and after, as in `squares` and `at`."""
        self.way += way
        self.samples += samples
        self.squares = [own + more for own, more in zip(self.squares, squares, strict=True)]
        self.at = [max(own, other, key=_early) for own, other in zip(self.at, most, strict=True)]

    def result(self) -> PathError:
        """The figures of all batches."""
        before, after = (
            Figures(value, float(np.sqrt(squares / self.way)) if self.way else 0.0, move, fraction)
            for (value, move, fraction), squares in zip(self.at, self.squares, strict=True)
        )
        return PathError(before, after, self.samples, self.way)
