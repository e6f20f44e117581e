"""Tip errors before and after a correction: of places on a path, and what is added up of all of them."""

from __future__ import annotations

import numpy as np

from ncfix.arrays import Array, Index
from ncfix.values import frozen


@frozen
class Figures:
    """Tip errors along a path.

    max       mm
    rms       mm, by length of way
    move      the motion in which the largest is, -1 if there is none
    fraction  where on it
    """

    max: float
    rms: float
    move: int
    fraction: float


@frozen
class PathError:
    """Before and after a correction.

    before, after             figures over all motions looked at
    samples                   how many places were looked at
    way                       mm that they stand for
    """

    before: Figures
    after: Figures
    samples: int
    way: float = 0.0


@frozen
class PathSamples:
    """Places on a path, flat: motion, fraction, tip error before and after (mm), share of the way (mm)."""

    move: Index
    fraction: Array
    before: Array
    after: Array
    weight: Array


def _early(at: tuple[float, int, float]) -> tuple[float, int, float]:
    """Orders errors (mm) in motions and at fractions of these: of equal ones the first on the path is the largest."""
    error, move, fraction = at
    return error, -move, -fraction


class FigureTally:
    """Figures gathered batch by batch."""

    def __init__(self) -> None:
        self.squares = [0.0, 0.0]
        self.at: list[tuple[float, int, float]] = [(0.0, -1, 0.0), (0.0, -1, 0.0)]
        self.way = 0.0
        self.samples = 0

    def add(self, part: PathSamples) -> None:
        """Take in a batch; places at which an error is not known do not count."""
        self.way += float(part.weight.sum())
        self.samples += int(np.count_nonzero(np.isfinite(part.after)))
        for side, error in enumerate((part.before, part.after)):
            known = np.nan_to_num(error)
            self.squares[side] += float((part.weight * known**2).sum())
            best = int(known.argmax())
            there = float(known[best]), int(part.move[best]), float(part.fraction[best])
            self.at[side] = max(self.at[side], there, key=_early)

    def take(self, way: float, samples: int, squares: list[float], most: list[tuple[float, int, float]]) -> None:
        """Take in what was added up elsewhere; of both sides way times squares and the most: mm, motion, fraction."""
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
