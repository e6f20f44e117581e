"""The path of a tool tip as a curve of parabolas, each through three of its points.

Motions are divided into stretches so short that a parabola fits the path of the tip on each of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import cached_property
from typing import Any, cast

import numpy as np

from ncfix.arrays import Array, Index, Mask, every, finite, owners, picked, places, slices, some
from ncfix.compensate.account import at_measured_places
from ncfix.compensate.figures.simulation import BATCH
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.sampling import (
    DENSITY,
    MOST,
    MOST_SHOWN,
    arc_radii,
    bends,
    even,
    merged,
    reach,
    reversals,
    with_kinks,
)
from ncfix.control.moves import MotionKind
from ncfix.values import frozen

ROUND, TWISTED = 1e-6, 2e-5
"""Largest deviation, mm, of a parabola from a circle of the tip, and from a circle with further motion added to it."""
QUARTIC, CUBIC = 1 / 512, 3**0.5 / 72
"""A parabola through begin, middle and end of an arc of angle a and radius r deviates from it by r a^4 / 512; its error
along the arc, up to r a^3 sqrt(3) / 216, does not matter. A further way b by another axis adds at most b a^2 sqrt(3) /
72: the third derivative of a point that turns and moves is -a^2 times the first, and at most 3 a^2 b."""
JUMP = 1e-6
"""Fraction of a motion between a kink or jump of the errors and the ends of the parabolas before and behind it."""


@frozen
class Stretches:
    """The k stretches, in order, into which the motions of a program that cut are divided.

    rows         (k,) the motion
    start, stop  (k,) the fractions of the motion at which the stretch begins and ends
    opens        (k,) the stretch may begin elsewhere than the one before it ends
    """

    rows: Index
    start: Array
    stop: Array
    opens: Mask

    @classmethod
    def of(cls, intent: Intent) -> Stretches:
        """The stretches of all motions of a program that cut."""
        moves = intent.moves
        known = finite(moves.end) & moves.cutting & ~at_measured_places(moves)
        hole = moves.kind == MotionKind.CYCLE
        along = np.flatnonzero(known & ~hole & finite(moves.start))
        counts, between = with_kinks(intent, intent.segments, along, *_evenly(intent, along), JUMP)
        turning = reversals(intent, along, *_with_ends(counts, between))
        if turning[0].size:
            sides = [(turning[0], np.clip(turning[1] + side, 0.0, 1.0)) for side in (-JUMP, JUMP)]
            counts, between = merged(len(along), (owners(counts), between), *sides)
        pieces = counts + 1
        owner, ends = owners(pieces), np.ones(int(pieces.sum()))
        last = np.cumsum(pieces) - 1
        ends[np.delete(np.arange(len(ends)), last)] = between
        starts = np.concatenate([[0.0], ends[:-1]])[: len(ends)]
        starts[last - pieces + 1] = 0.0
        at_end = np.flatnonzero(known & hole)
        rows = np.concatenate([along[owner], at_end])
        order = np.argsort(rows, kind="stable")
        ones = np.ones(len(at_end))
        rows, start = rows[order], np.concatenate([starts, ones])[order]
        return cls(rows, start, np.concatenate([ends, ones])[order], _opening(intent, rows, start))

    def divided(self, which: Index, fraction: Array) -> Stretches:
        """The stretches, with stretches `which` (m,) divided at fractions (m,) of their motions."""
        inside = np.flatnonzero((fraction > self.start[which]) & (fraction < self.stop[which]))
        owner = np.concatenate([np.arange(len(self.rows)), which[inside]])
        start = np.concatenate([self.start, fraction[inside]])
        order = np.lexsort((start, owner))
        owner, start = owner[order], start[order]
        again = np.diff(owner, prepend=-1) == 0
        stop = self.stop[owner]
        stop[:-1] = np.where(again[1:], start[1:], stop[:-1])
        return Stretches(self.rows[owner], start, stop, self.opens[owner] & ~again)


def _with_ends(counts: Index, between: Array) -> tuple[Index, Array]:
    """Flat fractions inside motions with both ends added: counts (k,), and fractions."""
    each = np.arange(len(counts))
    return merged(len(counts), (owners(counts), between), (each, np.zeros(len(counts))), (each, np.ones(len(counts))))


def _evenly(intent: Intent, rows: Index) -> tuple[Index, Array]:
    """Even fractions between which parabolas fit the path: counts (k,) and flat fractions, without the ends."""
    often = bends(intent, rows)
    often[DENSITY * often >= MOST] = 0.0
    counts = np.maximum(np.ceil(DENSITY / 2 * often), _round_axes(intent, rows))
    found = np.clip(counts, 1, MOST_SHOWN).astype(np.intp) - 1
    return found, even(found)


def _round_axes(intent: Intent, rows: Index) -> Array:
    """(k,) number of parabolas that are needed for the turns of the tip in motions `rows` (k,)."""
    moves, machine = intent.moves, intent.machine
    angle, radius, besides = (np.zeros(len(rows)) for _ in range(3))
    way = picked(moves.end, rows) - picked(moves.start, rows)
    arcs = np.flatnonzero(intent.segments.arc[rows])
    if arcs.size:
        angle[arcs], radius[arcs] = np.abs(moves.sweep[rows[arcs]]), arc_radii(intent, rows[arcs])
        besides[arcs] = np.abs(np.einsum("ij,ij->i", way[arcs[:, None], intent.columns], moves.normal[rows[arcs]]))
    turned = np.abs(way[:, machine.rotary])
    swung = np.flatnonzero(some(turned > 0) & ~moves.tcp[rows])
    if swung.size:
        turned = turned[swung]
        radius[swung] = np.maximum(radius[swung], reach(intent, rows[swung]))
        besides[swung] += radius[swung] * (angle[swung] + turned.sum(axis=1) - turned.max(axis=1))
        besides[swung] += np.abs(way[swung][:, ~machine.rotary]).sum(axis=1)
        angle[swung] += turned.sum(axis=1)
    squared = angle**2
    count = np.maximum(
        np.cbrt(CUBIC * besides * squared / TWISTED), np.sqrt(squared * np.sqrt(QUARTIC * radius / ROUND))
    )
    return np.ceil(count)


def _opening(intent: Intent, rows: Index, start: Array) -> Mask:
    """(k,) whether a stretch may begin elsewhere than the one before it ends."""
    opens: Mask = start == 0
    opens |= intent.moves.kind[rows] == MotionKind.CYCLE
    if not len(rows) or intent.arrival is not None:
        return opens
    moves = intent.moves
    next_one = np.flatnonzero(opens[1:]) + 1
    row, before = rows[next_one], rows[next_one - 1]
    same = every(picked(moves.start, row) == picked(moves.end, before)) & (moves.tcp[row] == moves.tcp[before])
    same &= (moves.tool_length[row] == moves.tool_length[before]) & (moves.kind[row] != MotionKind.CYCLE)
    same &= moves.beside_tip[row] == moves.beside_tip[before]
    opens[next_one[same]] = False
    return opens


Tip = Callable[[Index, Array], Array]

ROUNDING = 1e-9
"""Gap, mm, up to which a parabola begins where the one before it ends."""


@frozen(slots=False)
class Curve:
    """A path as k parabolas in order. A drilled hole is a parabola of length 0.

    rows                (k,) the motion of each parabola
    start, stop         (k,) the fractions of the motion at which it begins and ends
    begin, middle, end  (k, 3) its points at parameter 0, 0.5 and 1, mm
    opens               (k,) it does not begin where the one before it ends
    ways                (k,) its length, mm
    first               the length of the whole path up to the first parabola, mm
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
        """The curve along stretches of motions; stretches at which `tip` returns NaN are left out."""
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
        """(k,) the gap between the end of the parabola before and the start of each, mm."""
        gaps = np.zeros(len(self))
        at = np.flatnonzero(self.opens[1:]) + 1
        gaps[at] = distance(self.end[at - 1], self.begin[at])
        return gaps

    @cached_property
    def lengths(self) -> Array:
        """(k,) the length of the path up to the start of each parabola, with straight lines over gaps, mm."""
        return self.first + np.cumsum(self.ways + self.gaps) - self.ways

    @property
    def total(self) -> float:
        """The length of all parabolas, without gaps, mm."""
        return float(self.ways.sum())

    @cached_property
    def slope(self) -> Array:
        """(k, 3) derivative of the point by the parameter u at the start of each parabola, mm; see `bend`."""
        return 4 * self.middle - 3 * self.begin - self.end

    @cached_property
    def bend(self) -> Array:
        """(k, 3) mm: the point is `begin + u * slope + u^2 * bend`."""
        return 2 * (self.begin + self.end - 2 * self.middle)

    @cached_property
    def turns(self) -> Array:
        """(2, k) lower bound of the turn of the path up to the start, and up to the end, of each parabola, rad."""
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
        """The numbers of the parabolas with a length above 0, ascending."""
        return np.flatnonzero(self.ways > 0)

    @cached_property
    def upto(self) -> Index:
        """(k,) the number of parabolas with a length up to and including each."""
        return np.cumsum(self.ways > 0)

    def place(self, lengths: Array) -> Index:
        """(n,) the parabola at lengths (n,) of the path, mm."""
        return np.maximum(np.searchsorted(self.lengths, lengths, side="right") - 1, 0)

    def way(self, piece: Index, share: Array) -> Array:
        """(n,) the length of the path up to shares (n,) of parabolas `piece` (n,), mm."""
        return self.lengths[piece] + share * self.ways[piece]

    def point(self, piece: Index, share: Array) -> Array:
        """(n, 3) the points at shares (n,) of parabolas `piece` (n,), mm."""
        at = share[:, None]
        return self.begin[piece] + at * (self.slope[piece] + at * self.bend[piece])

    def and_then(self, other: Curve) -> Curve:
        """This path, continued by another one."""
        both = {name: np.concatenate([getattr(each, name) for each in (self, other)]) for name in COLUMNS}
        curve: Curve = replace(self, **cast(Any, both))
        if len(self) and len(other):
            curve.opens[len(self)] = distance(self.end[-1:], other.begin[:1])[0] > ROUNDING
        return curve

    def taken(self, which: Mask | slice) -> Curve:
        """The parabolas `which`."""
        return replace(self, **{name: getattr(self, name)[which] for name in COLUMNS})


COLUMNS = [each.name for each in fields(Curve) if each.name != "first"]
"""The fields of a curve with a row for each parabola."""


@frozen
class CurvePoints:
    """Sample points of a curve: the middle and the end of each parabola, and the start of each cut.

    piece   (k,) the parabola, ascending
    share   (k,) its parameter: 0, 0.5 or 1
    points  (k, 3) mm
    weight  (k,) the length of path for which it stands, mm, by Simpson's rule
    """

    piece: Index
    share: Array
    points: Array
    weight: Array

    @classmethod
    def of(cls, curve: Curve, after: float = 0.0) -> CurvePoints:
        """The sample points of a curve; `after`: length, mm, of the parabola that continues it (0: none)."""
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


def arc_lengths(begin: Array, middle: Array, end: Array) -> Array:
    """(k,) lengths of parabolas through points (k, 3), mm, extrapolated from one chord and from two chords."""
    halves = distance(begin, middle) + distance(middle, end)
    return (4 * halves - distance(begin, end)) / 3


def distance(one: Array, other: Array) -> Array:
    """(n,) distances between points (n, 3)."""
    return length(one - other)


def length(vectors: Array) -> Array:
    """(n,) lengths of vectors (n, 3)."""
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def _unit(vectors: Array) -> Array:
    """(n, 3) the vectors divided by their lengths; zero vectors stay."""
    size = length(vectors)
    return vectors / np.where(size > 0, size, 1.0)[:, None]
