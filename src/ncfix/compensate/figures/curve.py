"""The path of a tool tip as a curve: parabolas through three of its points each, near enough to it everywhere.

Motions are divided into stretches so short that a parabola is near enough to the path of the tip on each.
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
"""mm; so far a parabola may be from a circle on which the tip goes, and from a path on which it goes on besides."""
QUARTIC, CUBIC = 1 / 512, 3**0.5 / 72
"""A parabola through begin, middle and end of an arc of angle a and radius r is r a^4 / 512 from it, along it up to
r a^3 sqrt(3) / 216, which does not matter. A way b besides, by another axis, adds no more than b a^2 sqrt(3) / 72: the
third derivative of a point that turns and is moved is -a^2 times the first, and at most 3 a^2 b."""
JUMP = 1e-6
"""Fraction of a motion on both sides of a kink or jump of the errors where a parabola ends."""


@frozen
class Stretches:
    """Of the motions of a program that cut, k stretches in order.

    rows         (k,) the motion
    start, stop  (k,) the fractions of it from which to which each goes
    opens        (k,) it may begin elsewhere than the one before ends
    """

    rows: Index
    start: Array
    stop: Array
    opens: Mask

    @classmethod
    def of(cls, intent: Intent) -> Stretches:
        """Of a program."""
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
        """These, some of them (m,) divided at fractions (m,) of their motions."""
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
    """Fractions inside of motions and those of both ends: counts (k,), and flat."""
    each = np.arange(len(counts))
    return merged(len(counts), (owners(counts), between), (each, np.zeros(len(counts))), (each, np.ones(len(counts))))


def _evenly(intent: Intent, rows: Index) -> tuple[Index, Array]:
    """Fractions between which parabolas are near enough to the path: counts (k,) and flat fractions, ends left out."""
    often = bends(intent, rows)
    often[DENSITY * often >= MOST] = 0.0
    counts = np.maximum(np.ceil(DENSITY / 2 * often), _round_axes(intent, rows))
    found = np.clip(counts, 1, MOST_SHOWN).astype(np.intp) - 1
    return found, even(found)


def _round_axes(intent: Intent, rows: Index) -> Array:
    """How many parabolas it takes for motions (k,) that lead the tip round an axis, (k,)."""
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
    """(k,) stretches of motions that may begin elsewhere than the one before ends."""
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
"""mm: what begins no farther from where the one before ends begins there."""


@frozen(slots=False)
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
        return self.first + np.cumsum(self.ways + self.gaps) - self.ways

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
        """The pieces that have a length, ascending."""
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
        return self.lengths[piece] + share * self.ways[piece]

    def point(self, piece: Index, share: Array) -> Array:
        """The points at shares (n,) of parabolas (n,), (n, 3) mm."""
        at = share[:, None]
        return self.begin[piece] + at * (self.slope[piece] + at * self.bend[piece])

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


@frozen
class CurvePoints:
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
    def of(cls, curve: Curve, after: float = 0.0) -> CurvePoints:
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


def arc_lengths(begin: Array, middle: Array, end: Array) -> Array:
    """Of parabolas through points (k, 3), (k,) mm: by Simpson's rule, as it were, from one chord and from two."""
    halves = distance(begin, middle) + distance(middle, end)
    return (4 * halves - distance(begin, end)) / 3


def distance(one: Array, other: Array) -> Array:
    """How far points (n, 3) are from others, (n,)."""
    return length(one - other)


def length(vectors: Array) -> Array:
    """The lengths of vectors (n, 3), (n,)."""
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


def _unit(vectors: Array) -> Array:
    """Vectors (n, 3) of length 1; those without length stay."""
    size = length(vectors)
    return vectors / np.where(size > 0, size, 1.0)[:, None]
