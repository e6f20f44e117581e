"""Where an axis turns round, the side of its play that it is on is not known to the micrometre of its way.

A corrected program takes up the play of an axis where the program turns it round, by a step of some micrometres. Seen
from its text alone, the axis turns round where its rounded numbers do, and during the step it is on neither side. So
close to a turn both sides are possible.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ncfix.compensate.curve import Curve, Samples, arc_lengths
from ncfix.compensate.direction import Signs, matters
from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.intent import Intent
from ncfix.compensate.nearest import Nearest, Search
from ncfix.compensate.rows import some
from ncfix.machine import State

NEAR = 0.01
"""mm or rad; so close to its turn an axis may be on either side of its play."""
WINDOW = 24
"""Samples on both sides of a turn that are looked at."""


@dataclass(frozen=True, slots=True)
class Flank:
    """A path of k parabolas with axes that turn round on the other side of their play, where they may be.

    turned  (k, 3) whether it may be another where each begins, half-way, and where it ends
    points  (k, 3, 3) mm, where it is there then
    motion  (k,) whether an axis turns round on the motion
    curve   the path with all axes that turn round on a motion on the other side, all along it
    """

    turned: Mask
    points: Array
    motion: Mask
    curve: Curve

    @classmethod
    def of(cls, done: Intent, actual: Curve) -> Flank | None:
        """Of a path on the real machine; None if it does not depend on the side."""
        if not matters(done.machine):
            return None
        at = Samples.of(actual)
        rows, place = actual.rows[at.piece], (2 * at.share).astype(np.intp)
        fraction = (1 - at.share) * actual.start[at.piece] + at.share * actual.stop[at.piece]
        turning = uncertain(done, rows, fraction)
        motions = np.zeros((len(done.moves), turning.shape[1]), dtype=bool)
        np.logical_or.at(motions, rows, turning)
        some_turn, motion = np.flatnonzero(some(turning)), some(motions)[actual.rows]
        turned, points = np.zeros((len(actual), 3), dtype=bool), np.zeros((len(actual), 3, 3))
        turned[at.piece[some_turn], place[some_turn]] = True
        points[turned] = other_side(done, rows[some_turn], fraction[some_turn], turning[some_turn])
        return cls(turned, points, motion, _all_aside(done, actual, motions, motion))

    def taken(self, which: slice) -> Flank:
        """That of some of the parabolas."""
        return Flank(self.turned[which], self.points[which], self.motion[which], self.curve.taken(which))

    def and_then(self, other: Flank) -> Flank:
        """That of two parts of a path that follow each other."""
        turned = np.concatenate([self.turned, other.turned])
        points, motion = np.concatenate([self.points, other.points]), np.concatenate([self.motion, other.motion])
        return Flank(turned, points, motion, self.curve.and_then(other.curve))

    def there(self, search: Search, samples: Samples, found: Nearest) -> Array:
        """The gaps (k,) from samples of what is made to what is meant, with this path where that is nearer."""
        place = (2 * samples.share).astype(np.intp)
        turned = np.flatnonzero(self.turned[samples.piece, place])
        expected = search.curve.way(found.piece, found.share)[turned]
        other = search.around(self.points[samples.piece[turned], place[turned]], expected)
        gap = found.gap.copy()
        gap[turned] = np.minimum(gap[turned], other.gap)
        return gap

    def back(self, near: float, points: Array, found: Nearest) -> Array:
        """The gaps (k,) from points (k, 3) of what is meant to what is made, with this path where that is nearer."""
        beside = [self.motion.take(found.piece + way, mode="clip") for way in (-1, 0, 1)]
        rows = np.flatnonzero(np.logical_or.reduce(beside) & (found.gap > near))
        other = Search(self.curve, near).around(points[rows], self.curve.way(found.piece, found.share)[rows])
        gap = found.gap.copy()
        gap[rows] = np.minimum(gap[rows], other.gap)
        return gap


def _all_aside(done: Intent, actual: Curve, motions: Mask, motion: Mask) -> Curve:
    """The path with axes `motions` (n, n_axes) on the other side of their play on some of its parabolas (k,)."""
    which = np.flatnonzero(motion)
    rows, columns = actual.rows[which], {}
    half = (actual.start + actual.stop) / 2
    for name, fraction in (("begin", actual.start), ("middle", half), ("end", actual.stop)):
        columns[name] = getattr(actual, name).copy()
        columns[name][which] = other_side(done, rows, fraction[which], motions[rows])
    opens = actual.opens | motion | np.append(False, motion[:-1])
    return replace(actual, **columns, opens=opens, ways=arc_lengths(**columns))


def uncertain(intent: Intent, rows: Index, fraction: Array) -> Mask:
    """(k, n_axes) at samples in order: the axis has just turned round, or is about to."""
    q = intent.joints_at(rows, fraction)
    found = np.zeros(q.shape, dtype=bool)
    if not matters(intent.machine) or len(rows) < 2:
        return found
    ways = intent.direction(rows, fraction)
    for axis in range(q.shape[1]):
        turns = np.flatnonzero(np.diff(ways[:, axis]) != 0)
        around = np.clip(turns[:, None] + np.arange(1 - WINDOW, WINDOW + 1), 0, len(rows) - 1)
        near = np.abs(q[around, axis] - q[turns, axis, None]) <= NEAR
        found[around[near], axis] = True
    return found


def other_side(intent: Intent, rows: Index, fraction: Array, turned: Mask) -> Array:
    """The tip of the real machine with axes `turned` (k, n_axes) on the other side of their play, (k, 3) mm."""
    ways = np.asarray(intent.direction(rows, fraction))
    flipped: Signs = np.where(turned, -ways, ways).astype(np.int8)
    state = intent.states(rows, fraction)
    return np.asarray(
        intent.machine.actual_tip(intent.joints_at(rows, fraction), State(state.tool_length, flipped, state.inputs))
    )
