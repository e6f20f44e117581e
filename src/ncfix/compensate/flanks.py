"""Where an axis turns round, the side of its play that it is on is not known to the micrometre of its way.

A corrected program takes up the play of an axis where the program turns it round, by a step of some micrometres. Seen
from its text alone, the axis turns round where its rounded numbers do, and during the step it is on neither side. So
close to a turn both sides are possible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.curve import Curve, Samples
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
    """A path with axes that turn round on the other side of their play, where they may be.

    samples  (j,) the samples of the path at which it is another
    points   (j, 3) mm, where it is then
    motions  (n,) the motions on which it is
    curve    the path with all of these on the other side
    """

    samples: Index
    points: Array
    motions: Mask
    curve: Curve

    @classmethod
    def of(cls, done: Intent, actual: Curve) -> Flank | None:
        """Of a path on the real machine; None if no axis turns round."""
        if not matters(done.machine):
            return None
        at = Samples.of(actual)
        rows = actual.rows[at.piece]
        fraction = (1 - at.share) * actual.start[at.piece] + at.share * actual.stop[at.piece]
        turning = uncertain(done, rows, fraction)
        samples = np.flatnonzero(turning.any(axis=1))
        if not samples.size:
            return None
        motions = np.zeros((len(done.moves), turning.shape[1]), dtype=bool)
        np.logical_or.at(motions, rows, turning)
        curve = Curve.of(done, lambda rows, fraction: other_side(done, rows, fraction, motions[rows]))
        points = other_side(done, rows[samples], fraction[samples], turning[samples])
        return cls(samples, points, some(motions), curve)

    def there(self, search: Search, found: Nearest) -> Array:
        """The gaps (k,) from what is made to what is meant, with this path at its samples where that is nearer."""
        expected = search.curve.way(found.piece, found.share)[self.samples]
        other = search.around(self.points, expected)
        gap = found.gap.copy()
        gap[self.samples] = np.minimum(gap[self.samples], other.gap)
        return gap

    def back(self, near: float, points: Array, found: Nearest) -> Array:
        """The gaps (k,) from points (k, 3) of what is meant to what is made, with this path where that is nearer."""
        curve = self.curve
        beside = [curve.rows[np.clip(found.piece + way, 0, len(curve) - 1)] for way in (-1, 0, 1)]
        rows = np.flatnonzero(np.logical_or.reduce([self.motions[each] for each in beside]) & (found.gap > near))
        expected = curve.way(found.piece, found.share)[rows]
        other = Search(curve, near).around(points[rows], expected)
        gap = found.gap.copy()
        gap[rows] = np.minimum(gap[rows], other.gap)
        return gap


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
