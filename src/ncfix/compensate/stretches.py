"""How motions are divided into stretches so short that a parabola is near enough to the path of the tip on each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.budget import DENSITY
from ncfix.compensate.coverage import at_measured_places
from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.intent import Intent
from ncfix.compensate.ragged import owners
from ncfix.compensate.rows import every, finite, picked, some
from ncfix.compensate.sampling import MOST, MOST_SHOWN, arc_radii, bends, even, merged, reach, reversals, with_kinks
from ncfix.control.moves import Kind

ROUND, TWISTED = 1e-6, 2e-5
"""mm; so far a parabola may be from a circle on which the tip goes, and from a path on which it goes on besides."""
QUARTIC, CUBIC = 1 / 512, 3**0.5 / 72
"""A parabola through begin, middle and end of an arc of angle a and radius r is r a^4 / 512 from it, along it up to
r a^3 sqrt(3) / 216, which does not matter. A way b besides, by another axis, adds no more than b a^2 sqrt(3) / 72: the
third derivative of a point that turns and is moved is -a^2 times the first, and at most 3 a^2 b."""
JUMP = 1e-6
"""Fraction of a motion on both sides of a kink or jump of the errors where a parabola ends."""


@dataclass(frozen=True, slots=True)
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
        known = finite(moves.end) & moves.cuts & ~at_measured_places(moves)
        hole = moves.kind == Kind.CYCLE
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

    def taken(self, which: Index) -> Stretches:
        """Some of them."""
        return Stretches(self.rows[which], self.start[which], self.stop[which], self.opens[which])

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
    found: Array = np.ceil(count)
    return found


def _opening(intent: Intent, rows: Index, start: Array) -> Mask:
    """(k,) stretches of motions that may begin elsewhere than the one before ends."""
    opens: Mask = start == 0
    opens |= intent.moves.kind[rows] == Kind.CYCLE
    if not len(rows) or intent.arrival is not None:
        return opens
    moves = intent.moves
    next_one = np.flatnonzero(opens[1:]) + 1
    row, before = rows[next_one], rows[next_one - 1]
    same = every(picked(moves.start, row) == picked(moves.end, before)) & (moves.tcp[row] == moves.tcp[before])
    same &= (moves.tool_length[row] == moves.tool_length[before]) & (moves.kind[row] != Kind.CYCLE)
    opens[next_one[same]] = False
    return opens
