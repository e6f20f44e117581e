"""The path of a tool tip as a curve: parabolas through three of its points each, near enough to it everywhere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, cast

import numpy as np

from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.ragged import owners, places, slices
from ncfix.compensate.rows import finite, picked
from ncfix.compensate.simulation import BATCH
from ncfix.compensate.stretches import Stretches

Tip = Callable[[Index, Array], Array]

ROUNDING = 1e-9
"""mm: what begins no farther from where the one before ends begins there."""


@dataclass(frozen=True)
class Curve:
    """k parabolas in the order in which they are gone along; a hole is one that has no length.

    rows                (k,) the motion that each belongs to
    start, stop         (k,) the fractions of the motion from which to which it goes
    begin, middle, end  (k, 3) mm: where it begins, half-way, and ends
    opens               (k,) it does not begin where the one before ends
    ways                (k,) mm, how long it is
    first               mm, the way along the whole path to the first of them
    """

    rows: Index
    start: Array
    stop: Array
    begin: Array
    middle: Array
    end: Array
    opens: Mask
    ways: Array
    first: float = 0.0

    @classmethod
    def through(cls, stretches: Stretches, tip: Tip) -> Curve:
        """Along stretches of motions, by a function that gives the tip; where it has none is left out."""
        rows, start, stop = stretches.rows, stretches.start, stretches.stop
        fresh = np.flatnonzero(stretches.opens)
        at = np.concatenate([rows, rows, rows[fresh]])
        fraction = np.concatenate([(start + stop) / 2, stop, start[fresh]])
        points = np.concatenate([tip(at[part], fraction[part]) for part in slices(len(at), BATCH)])
        middle, end = points[: len(rows)], points[len(rows) : 2 * len(rows)]
        begin = np.empty_like(end)
        begin[1:] = end[:-1]
        begin[fresh] = points[2 * len(rows) :]
        there, opens = finite(begin) & finite(middle) & finite(end), stretches.opens.copy()
        later = fresh[fresh > 0]
        opens[later] = distance(begin[later], end[later - 1]) > ROUNDING
        opens[1:] |= ~there[:-1]
        curve = cls(rows, start, stop, begin, middle, end, opens, arc_lengths(begin, middle, end))
        return curve if there.all() else curve.taken(there)

    def __len__(self) -> int:
        return len(self.rows)

    @cached_property
    def gaps(self) -> Array:
        """The way from the end of the one before to its begin, (k,) mm."""
        gaps = np.zeros(len(self))
        at = np.flatnonzero(self.opens[1:]) + 1
        gaps[at] = distance(self.end[at - 1], self.begin[at])
        return gaps

    @cached_property
    def lengths(self) -> Array:
        """The way to the begin of each, straight over what lies between cuts, (k,) mm."""
        lengths: Array = self.first + np.cumsum(self.ways + self.gaps) - self.ways
        return lengths

    @property
    def total(self) -> float:
        """The length of what is cut, mm."""
        return float(self.ways.sum())

    @cached_property
    def slope(self) -> Array:
        """(k, 3) mm: how the point at share u of a parabola moves with u where it begins."""
        return 4 * self.middle - 3 * self.begin - self.end

    @cached_property
    def bend(self) -> Array:
        """(k, 3) mm: the point is `begin + u * slope + u^2 * bend`."""
        return 2 * (self.begin + self.end - 2 * self.middle)

    @cached_property
    def turns(self) -> Array:
        """How much the path has turned, from below, where each begins and where it ends, (2, k) rad."""
        enters, leaves = _unit(self.slope), _unit(self.slope + 2 * self.bend)
        inside = distance(enters, leaves)
        corner = np.zeros(len(self))
        corner[1:] = np.where(self.opens[1:], np.pi, distance(enters[1:], leaves[:-1]))
        at_begin = np.cumsum(corner + inside) - inside
        return np.stack([at_begin, at_begin + inside])

    @cached_property
    def parabolas(self) -> Array:
        """Begin, slope and bend of each, (9, k) mm."""
        return np.ascontiguousarray(np.hstack([self.begin, self.slope, self.bend]).T)

    @cached_property
    def lying(self) -> Index:
        """Those that have a length, ascending."""
        return np.flatnonzero(self.ways > 0)

    @cached_property
    def upto(self) -> Index:
        """How many have a length up to each and with it, (k,)."""
        return np.cumsum(self.ways > 0)

    def place(self, lengths: Array) -> Index:
        """The parabola in which a way along the path (n,) mm ends, (n,)."""
        return np.maximum(np.searchsorted(self.lengths, lengths, side="right") - 1, 0)

    def way(self, piece: Index, share: Array) -> Array:
        """The way along the path to shares (n,) of parabolas (n,), mm."""
        way: Array = self.lengths[piece] + share * self.ways[piece]
        return way

    def point(self, piece: Index, share: Array) -> Array:
        """The points at shares (n,) of parabolas (n,), (n, 3) mm."""
        at = share[:, None]
        found: Array = self.begin[piece] + at * (self.slope[piece] + at * self.bend[piece])
        return found

    def and_then(self, other: Curve) -> Curve:
        """This path, and then another one."""
        both = {name: np.concatenate([getattr(each, name) for each in (self, other)]) for name in COLUMNS}
        curve: Curve = replace(self, **cast(Any, both))
        if len(self) and len(other):
            curve.opens[len(self)] = distance(self.end[-1:], other.begin[:1])[0] > ROUNDING
        return curve

    def taken(self, which: Mask | slice) -> Curve:
        """Some of the parabolas."""
        return replace(self, **{name: getattr(self, name)[which] for name in COLUMNS})


COLUMNS = [each.name for each in fields(Curve) if each.name != "first"]
"""The fields of a curve that have a row for each parabola."""


@dataclass(frozen=True, slots=True)
class Samples:
    """Points of a curve at which it is looked at: half-way and at the end of each parabola, and where a cut begins.

    piece   (k,) the parabola, ascending
    share   (k,) 0, 0.5 or 1
    points  (k, 3) mm
    weight  (k,) mm of the path that it stands for, by Simpson's rule
    """

    piece: Index
    share: Array
    points: Array
    weight: Array

    @classmethod
    def of(cls, curve: Curve, after: float = 0.0) -> Samples:
        """Of a curve, at the end of which another parabola goes on that is so long, mm."""
        hole = curve.ways == 0
        counts = np.where(hole, 1, 2 + curve.opens)
        piece = owners(counts)
        share = 1 - (counts[piece] - 1 - places(counts)) / 2
        points = np.where((share == 1)[:, None], picked(curve.end, piece), picked(curve.middle, piece))
        begin = np.flatnonzero(share == 0)
        points[begin] = curve.begin[piece[begin]]
        weight = np.where(share == 0.5, 4, 1) * curve.ways[piece] / 6
        joined = np.flatnonzero(~curve.opens[1:])
        last = np.cumsum(counts) - 1
        weight[last[joined]] += curve.ways[joined + 1] / 6
        weight[-1:] += after / 6
        return cls(piece, share, points, weight)

    def and_more(self, other: Samples) -> Samples:
        """These, and then others."""
        names = ("piece", "share", "points", "weight")
        return Samples(*(np.concatenate([getattr(each, name) for each in (self, other)]) for name in names))


def arc_lengths(begin: Array, middle: Array, end: Array) -> Array:
    """Of parabolas through points (k, 3), (k,) mm: by Simpson's rule, as it were, from one chord and from two."""
    halves = distance(begin, middle) + distance(middle, end)
    lengths: Array = (4 * halves - distance(begin, end)) / 3
    return lengths


def distance(one: Array, other: Array) -> Array:
    """How far points (n, 3) are from others, (n,)."""
    return length(one - other)


def length(vectors: Array) -> Array:
    """The lengths of vectors (n, 3), (n,)."""
    found: Array = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    return found


def _unit(vectors: Array) -> Array:
    """Vectors (n, 3) of length 1; those without length stay."""
    size = length(vectors)
    unit: Array = vectors / np.where(size > 0, size, 1.0)[:, None]
    return unit
