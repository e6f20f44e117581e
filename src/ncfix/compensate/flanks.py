"""Where the bodies of axes are that turn round, on a machine with play.

A body stays where it is until its play is taken up, and then it follows. A corrected program takes it up in a step of
some micrometres, and turns axes round by less than that all the time, as it corrects.

Errors that change as an axis turns round, and are no play of its own, change at once. Seen from a corrected text alone,
the axis turns round where its rounded numbers do; so close to a turn both sides are possible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.compensate.curve import Curve, Samples
from ncfix.compensate.direction import Signs, carried, matters, signs
from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.intent import Intent
from ncfix.compensate.nearest import Nearest, Search
from ncfix.compensate.rows import some
from ncfix.machine import State

NEAR = 0.01
"""mm or rad; so close to its turn an axis may be on either side of its play."""
WINDOW = 24
"""Samples on both sides of a turn that are looked at."""
ROUNDED = 0.1
"""Share of a play that a step may leave."""
LATERAL = 1e-5
"""mm or rad: an axis with less play is off across its way, if at all, where it turns round."""
TINY = 1e-12
"""mm or rad: no play."""


@dataclass(frozen=True, slots=True)
class Flank:
    """A path of k parabolas, and where the tip is besides, where axes turn round: as each begins, half-way, as it ends.

    moved  (k, 3, 3) mm: how far it is from the path, with the bodies of axes where their play leaves them
    aside  (k, 3, 3) mm: to the other side, of axes that turn just there and have no play to take up; 0 of others
    """

    moved: NDArray[np.float32]
    aside: NDArray[np.float32]

    @classmethod
    def of(cls, done: Intent, actual: Curve) -> tuple[Flank, Signs] | None:
        """Of a path on the real machine; None if it does not depend on the side.

        Also the sides on which the bodies of axes are after each motion, (n, n_axes).
        """
        if not matters(done.machine):
            return None
        at = Samples.of(actual)
        turning = Turning.of(done, actual, at)
        sides = np.where(done.moves.cuts[:, None], 0, signs(done.moves.end - done.moves.start)).astype(np.int8)
        moved = np.zeros((len(actual), 3, 3), dtype=np.float32)
        aside = np.zeros_like(moved)
        place = (2 * at.share).astype(np.intp)
        for axis in range(sides.shape[1]) if len(turning.rows) else ():  # a path without a cut has no sides
            side, lost = turning.side(axis)
            near = turning.near(axis) & (lost < LATERAL)
            sides[turning.rows, axis] = np.sign(side)
            part = (1 - side * turning.ways[:, axis]) / 2
            which = np.flatnonzero((near | (part > 0)) & (turning.ways[:, axis] != 0))
            way = turning.other_side(which, axis) - at.points[which]
            free = near[which, None]
            aside[at.piece[which], place[which]] += np.where(free, way, 0.0)
            moved[at.piece[which], place[which]] += np.where(free, 0.0, part[which, None] * way)
        joined = np.flatnonzero(~actual.opens[1:]) + 1
        moved[joined, 0], aside[joined, 0] = moved[joined - 1, 2], aside[joined - 1, 2]
        return cls(moved, aside), carried(np.vstack((turning.came_first, sides)))[1:]

    def taken(self, which: slice) -> Flank:
        """That of some of the parabolas."""
        return Flank(self.moved[which], self.aside[which])

    def and_then(self, other: Flank) -> Flank:
        """That of two parts of a path that follow each other."""
        return Flank(np.concatenate([self.moved, other.moved]), np.concatenate([self.aside, other.aside]))

    def there(self, search: Search, samples: Samples, found: Nearest) -> Array:
        """The gaps (k,) from samples of what is made where between both sides it is nearest, to what is meant."""
        return self._lessened(search, samples.points, found, (samples.piece, samples.share), 1.0)

    def back(self, search: Search, points: Array, found: Nearest) -> Array:
        """The gaps (k,) from points (k, 3) of what is meant to what is made where between both sides it is nearest."""
        gap = self._lessened(search, points, found, (found.piece, found.share), -1.0)
        far = np.flatnonzero(gap > search.near)
        if far.size:  # of a place beside it
            for way in (-1, 1):
                piece = np.clip(found.piece[far] + way, 0, len(self.moved) - 1)
                share = np.full(len(far), 0.5 - way / 2)
                near = self._lessened(search, points[far], Nearest(piece, share, gap[far]), (piece, share), -1.0)
                gap[far] = np.minimum(gap[far], near)
        return gap

    def _lessened(
        self, search: Search, points: Array, found: Nearest, where: tuple[Index, Array], sense: float
    ) -> Array:
        """The gaps (k,) from points (k, 3) to a curve, moved as it is at shares of parabolas, in a sense."""
        gap, at = found.gap.copy(), (where[0], np.rint(2 * where[1]).astype(np.intp))
        moved, aside = (sense * each[at].astype(np.float64) for each in (self.moved, self.aside))
        rows = np.flatnonzero(some((moved != 0) | (aside != 0)))
        if not rows.size:
            return gap
        nearest, points, aside = found.taken(rows), points[rows] + moved[rows], aside[rows]
        nearest = search.around(points, nearest.way(search.curve))
        gap[rows] = np.minimum(nearest.gap, search.around(points + aside, nearest.way(search.curve)).gap)
        return gap


@dataclass(frozen=True, slots=True)
class Turning:
    """Samples of a path in order, and which way the axes go there.

    rows, fraction  (k,) motions, and how far each is done
    opens           (k,) where cuts begin, maybe behind motions of which there is no sample
    q               (k, n_axes) mm and rad
    ways            (k, n_axes) the way in which each axis goes
    came            (k, n_axes) the way in which each came to where the motion begins
    """

    intent: Intent
    rows: Index
    fraction: Array
    opens: Mask
    q: Array
    ways: Signs
    came: Signs

    @classmethod
    def of(cls, intent: Intent, actual: Curve, at: Samples) -> Turning:
        """At samples of a path."""
        assert intent.arrival is not None
        rows = actual.rows[at.piece]
        fraction = (1 - at.share) * actual.start[at.piece] + at.share * actual.stop[at.piece]
        first = np.broadcast_to(np.asarray(intent.state.direction, dtype=np.int8), intent.arrival.shape[1:])
        ways, came = np.asarray(intent.direction(rows, fraction)), np.vstack((first, intent.arrival))[rows]
        return cls(intent, rows, fraction, at.share == 0, intent.joints_at(rows, fraction), ways, came)

    @property
    def came_first(self) -> Signs:
        """The way in which each axis came to the first motion, (n_axes,)."""
        direction = np.asarray(self.intent.state.direction, dtype=np.int8)
        first: Signs = np.broadcast_to(direction, (self.q.shape[1],))
        return first

    def near(self, axis: int) -> Mask:
        """(k,) an axis has just turned round, or is about to."""
        turned, q = self._turned(axis), self.q[:, axis]
        turns = np.concatenate([np.flatnonzero(turned & ~self.opens) - 1, np.flatnonzero(turned & self.opens)])
        around = np.clip(turns[:, None] + np.arange(1 - WINDOW, WINDOW + 1), 0, len(q) - 1)
        found = np.zeros(len(q), dtype=bool)
        found[around[np.abs(q[around] - q[turns, None]) <= NEAR]] = True
        return found

    def _turned(self, axis: int) -> Mask:
        """(k,) an axis goes another way than before."""
        ways = self.ways[:, axis]
        turned: Mask = (np.diff(ways, prepend=ways[:1]) != 0) | (self.opens & (self.came[:, axis] != ways))
        return turned

    def side(self, axis: int) -> tuple[Array, Array]:
        """(k,) where the body of an axis is between the sides of its play, -1 to 1: it follows when that is taken up.

        Between samples it is taken up at once by motions of which there are none. Also the play, (k,) mm or rad.
        """
        ways, gone = self.ways[:, axis].astype(np.float64), self._gone(axis)
        fresh = self._fresh(axis)
        events = np.union1d(np.flatnonzero(self._turned(axis) | fresh), [0])
        base = np.where(self.opens[events], gone[events], gone[np.maximum(events - 1, 0)])
        lost, begun = self._lost(events, axis), np.empty(len(events))
        rate = 2 / np.maximum(lost, TINY)
        side = float(self.came[0, axis])
        before = 0.0
        for k, (event, at) in enumerate(zip(events.tolist(), base.tolist(), strict=True)):
            if k:
                side = min(1.0, max(-1.0, side + ways[events[k - 1]] * rate[k - 1] * (at - before)))
            if fresh[event]:
                side = float(self.came[event, axis])
            begun[k], before = side, at
        last = np.searchsorted(events, np.arange(len(gone)), side="right") - 1
        found: Array = np.clip(begun[last] + ways * rate[last] * (gone - base[last]), -1.0, 1.0)
        return found, lost[last]

    def _gone(self, axis: int) -> Array:
        """(k,) how far an axis has gone, to and fro."""
        return np.cumsum(np.abs(np.diff(self.q[:, axis], prepend=self.q[:1, axis])))

    def _fresh(self, axis: int) -> Mask:
        """(k,) first samples behind motions without any, in which the axis has moved."""
        moves = self.intent.moves
        moved = (signs(moves.end[:, axis] - moves.start[:, axis]) != 0) & ~moves.cuts
        count = np.concatenate([[0], np.cumsum(moved)])[self.rows]
        fresh: Mask = np.diff(count, prepend=0) > 0
        return fresh

    def _lost(self, which: Index, axis: int) -> Array:
        """How far an axis goes at samples (m,) until play is taken up, (m,) mm or rad; less what steps may leave.

        0 where the body is ahead of the axis on both ways, as no play does: a control may that takes up too much.
        """
        here = self.intent.machine.actual_tip(self.q[which], self.intent.states(self.rows[which], self.fraction[which]))
        lengths = self.intent.lengths(self.rows[which])
        along = self.intent.machine.axis_jacobian(self.q[which], lengths)[:, :3, axis]
        way = self.other_side(which, axis) - here
        square = np.einsum("ki,ki->k", along, along)
        ahead = np.einsum("ki,ki->k", along, way) * self.ways[which, axis] / np.where(square > 0, square, np.inf)
        lost: Array = (1 - ROUNDED) * np.maximum(ahead, 0.0)
        return lost

    def other_side(self, which: Index, axis: int) -> Array:
        """The tip of the real machine at samples (m,) with an axis on the other side of its play, (m, 3) mm."""
        ways = self.ways[which].copy()
        ways[:, axis] *= -1
        state = self.intent.states(self.rows[which], self.fraction[which])
        tip: Array = self.intent.machine.actual_tip(self.q[which], State(state.tool_length, ways, state.inputs))
        return tip
