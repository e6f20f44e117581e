"""Two programs on one machine: does the second one cut what the first one means?

The paths are compared as curves in the workpiece, so this knows nothing of how the second program was made: from every
sample of the real path of the second program to the nearest point of the intended path of the first, and back, so that
nothing may be missing. Nearest is looked for near the same length of path, so that the next pass of a cut, a hair's
breadth beside it, is not taken for the one that is meant.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.flanks import other_side, uncertain
from ncfix.compensate.intent import Intent
from ncfix.compensate.rows import some
from ncfix.compensate.simulation import TipError, actual_tip, batches, samples
from ncfix.diagnostics import DifferenceError
from ncfix.machine import Machine, State
from ncfix.program.moves import Kind, Moves

NEIGHBOURS = 3
"""Samples round which the nearest point is looked for."""
STEPS = 4
"""Most Newton steps towards it; each squares what is missing to it on a smooth path."""
CLOSE = 1e-6
"""mm: a step along the path that makes no difference to the distance."""
INSTANT = 1e-5
"""Fraction of a motion over which its direction is taken."""
ALONG = 0.02
"""A point that is so much shorter or longer along the path counts as this share of that farther away."""
UNLIKE = 0.02
"""Paths whose lengths differ by more than this share are not the same cut."""

Tip = Callable[[Index, Array], Array]


@dataclass(frozen=True, slots=True)
class Curve:
    """A path as samples, and as a function.

    rows, fraction  (k,) where it was sampled
    points          (k, 3) mm
    length          (k,) mm of path up to there
    tip             (rows, fraction) -> points
    drawn           (n,) the motions of which more than the end belongs to the path
    """

    rows: Index
    fraction: Array
    points: Array
    length: Array
    tip: Tip
    drawn: Mask

    @classmethod
    def of(cls, intent: Intent, tip: Tip) -> Curve:
        """The path of a program, by a function that gives the tip."""
        rows, fraction = samples(intent)
        parts = [tip(rows[part], fraction[part]) for part in batches(len(rows))]
        points = np.concatenate(parts) if parts else np.empty((0, 3))
        step = np.linalg.norm(np.diff(points, axis=0), axis=1) * (np.diff(rows) == 0)
        length = np.concatenate([[0.0], np.cumsum(step)])[: len(rows)]
        return cls(rows, fraction, points, length, tip, intent.moves.kind != Kind.CYCLE)

    @property
    def total(self) -> float:
        """Its length, mm."""
        return float(self.length[-1]) if len(self.length) else 0.0


def compare(machine: Machine, original: Moves, other: Moves, state: State = State()) -> tuple[TipError, TipError]:  # noqa: B008
    """How far `other` on this machine is from what `original` means: along `other`, and along `original`.

    The first has motions of `other` in `rows`, the second those of `original`. Raises `DifferenceError` NCF420 if the
    two are not the same cut at all.
    """
    meant, done = Intent(machine, original, state), Intent(machine, other, state)
    intended, actual = Curve.of(meant, meant.tip), _as_made(done)
    _check_alike(intended, actual)
    there, back = _there(intended, actual), _back(intended, actual)
    flank = Flank.of(done, actual)
    return (there, back) if flank is None else (flank.there(there, intended), flank.back(back, intended))


def error_of(machine: Machine, moves: Moves, state: State = State()) -> TipError:  # noqa: B008
    """How far a program on this machine is from what it means, along what is made: in the measure of `compare`."""
    intent = Intent(machine, moves, state)
    intended, actual = Curve.of(intent, intent.tip), _as_made(intent)
    there, flank = _there(intended, actual), Flank.of(intent, actual)
    return there if flank is None else flank.there(there, intended)


def _as_made(done: Intent) -> Curve:
    """The path of a program on the real machine."""
    return Curve.of(done, lambda rows, fraction: actual_tip(done, rows, fraction))


def _there(intended: Curve, actual: Curve) -> TipError:
    """From what is made to what is meant."""
    return TipError(actual.rows, actual.fraction, nearest(intended, actual), actual.points)


def _back(intended: Curve, actual: Curve) -> TipError:
    """From what is meant to what is made."""
    return TipError(intended.rows, intended.fraction, intended.points, nearest(actual, intended))


@dataclass(frozen=True, slots=True)
class Flank:
    """A path with axes that turn round on the other side of their play, where they may be.

    curve    the path
    samples  (j,) those at which it is another
    motions  (n,) those on which it is
    """

    curve: Curve
    samples: Index
    motions: Mask

    @classmethod
    def of(cls, done: Intent, actual: Curve) -> Flank | None:
        """Of a path on the real machine; None if no axis turns round."""
        turning = uncertain(done, actual.rows, actual.fraction)
        samples = np.flatnonzero(turning.any(axis=1))
        if not samples.size:
            return None
        motions = np.zeros((len(done.moves), turning.shape[1]), dtype=bool)
        np.logical_or.at(motions, actual.rows, turning)

        def tip(rows: Index, fraction: Array) -> Array:
            return other_side(done, rows, fraction, motions[rows])

        points = actual.points.copy()
        points[samples] = other_side(done, actual.rows[samples], actual.fraction[samples], turning[samples])
        return cls(replace(actual, points=points, tip=tip), samples, some(motions))

    def there(self, error: TipError, intended: Curve) -> TipError:
        """The error from what is made to what is meant, with this path at its samples where that is nearer."""
        near = Neighbours.of(intended, self.curve)
        return _nearer(error, self.samples, near.nearest(self.samples), self.curve.points[self.samples])

    def back(self, error: TipError, intended: Curve) -> TipError:
        """The error from what is meant to what is made, with this path where its motions are nearer."""
        near = Neighbours.of(self.curve, intended)
        samples = np.flatnonzero(self.motions[self.curve.rows[near.found]].any(axis=1))
        return _nearer(error, samples, error.intended[samples], near.nearest(samples))


def _nearer(error: TipError, samples: Index, intended: Array, actual: Array) -> TipError:
    """The error with other pairs of points at some samples, where they are nearer to one another."""
    better = np.linalg.norm(actual - intended, axis=1) < error.size[samples]
    points = error.intended.copy(), error.actual.copy()
    points[0][samples[better]], points[1][samples[better]] = intended[better], actual[better]
    return TipError(error.rows, error.fraction, *points)


def _check_alike(intended: Curve, actual: Curve) -> None:
    longer = max(intended.total, actual.total)
    if (len(intended.rows) == 0) != (len(actual.rows) == 0) or abs(intended.total - actual.total) > UNLIKE * longer:
        text = f"the two programs do not cut the same: {intended.total:.3f} mm and {actual.total:.3f} mm of path"
        raise DifferenceError.of("NCF420", text, hint="give the original program first, then the corrected one")


@dataclass(frozen=True, slots=True)
class Neighbours:
    """The samples of a path near which the nearest points to those of another one are looked for.

    wanted  (k, 4) the samples of the other one, with the length of path up to them
    found   (k, c) the samples nearest to them
    """

    curve: Curve
    wanted: Array
    found: Index

    @classmethod
    def of(cls, curve: Curve, other: Curve) -> Neighbours:
        """Of `curve`, for the samples of `other`."""
        from scipy.spatial import KDTree

        scale = curve.total / other.total if other.total else 1.0
        wanted = np.column_stack([other.points, ALONG * scale * other.length])
        tree = KDTree(np.column_stack([curve.points, ALONG * curve.length]))
        _, found = tree.query(wanted, k=min(NEIGHBOURS, len(curve.rows)))
        return cls(curve, wanted, np.asarray(found).reshape(len(wanted), -1))

    def nearest(self, samples: Index) -> Array:
        """The points of the path that are nearest to samples (j,) of the other one, (j, 3) mm."""
        parts = [samples[part] for part in batches(len(samples))]
        return np.concatenate(
            [np.empty((0, 3)), *(_closest(self.curve, self.found[part], self.wanted[part]) for part in parts)]
        )


def nearest(curve: Curve, other: Curve) -> Array:
    """The points of `curve` that are nearest to the samples of `other`, (k, 3) mm."""
    if not len(other.rows):
        return np.empty((0, 3))
    return Neighbours.of(curve, other).nearest(np.arange(len(other.rows)))


def _closest(curve: Curve, found: Index, wanted: Array) -> Array:
    """The points nearest to `wanted` (k, 4) on the motions of the samples `found` (k, c), (k, 3)."""
    candidates = np.stack([_on_motion(curve, column, wanted[:, :3]) for column in found.T])
    distance = np.linalg.norm(candidates - wanted, axis=-1)
    best: Array = candidates[np.argmin(distance, axis=0), np.arange(len(wanted)), :3]
    return best


def _on_motion(curve: Curve, sample: Index, points: Array) -> Array:
    """The nearest point to `points` (k, 3) on the motions of samples (k,), by Newton's method from there.

    With the length of path up to it as fourth coordinate, like those of the tree: (k, 4).
    """
    rows, fraction = curve.rows[sample], curve.fraction[sample]
    at = curve.points[sample]
    for _ in range(STEPS):
        low, high = np.maximum(fraction - INSTANT, 0.0), np.minimum(fraction + INSTANT, 1.0)
        slope = (curve.tip(rows, high) - curve.tip(rows, low)) / (high - low)[:, None]
        square = np.einsum("ij,ij->i", slope, slope)
        ahead = np.einsum("ij,ij->i", points - at, slope) / np.where(square > 0, square, 1.0)
        further = np.clip(fraction + curve.drawn[rows] * ahead, 0.0, 1.0)
        step = np.abs(further - fraction) * np.sqrt(square)
        fraction, at = further, curve.tip(rows, further)
        if step.max(initial=0.0) < CLOSE:
            break
    way = np.linalg.norm(at - curve.points[sample], axis=1) * np.sign(fraction - curve.fraction[sample])
    return np.column_stack([at, ALONG * (curve.length[sample] + way)])
