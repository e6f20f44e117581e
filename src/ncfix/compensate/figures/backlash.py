"""Where the bodies of axes are along a path, on a machine with play.

As an axis turns round its body stays, until the axis has gone as far as the play; then it follows. That goes on from
turn to turn: a corrected program takes up the play in a step of some micrometres, and turns axes round by less than it
all the time, as it corrects.

Errors that change as an axis turns round, and are no play of its own, change at once. Seen from a corrected text alone,
such an axis turns round where its rounded numbers do; so close to a turn both sides are possible.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array, Index, Signs, finite, some, taken
from ncfix.compensate.figures.curve import Curve, CurvePoints, Stretches, length
from ncfix.compensate.figures.nearest import Nearest, Search
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.kinematics import REST, carried, signs
from ncfix.compensate.plan.sampling import BISECTIONS
from ncfix.machine import State
from ncfix.values import frozen

LATERAL = 1e-5
"""mm or rad: an axis with less play is off across its way, if at all, where it turns round."""


@frozen
class Runs:
    """An axis along a path: k runs in order; on each it goes one way, or rests.

    begin  (k,) where each begins: the number of a begin or end of a leg, counted in turn
    place  (k,) where that is: the row of the motion, and how far it is done
    q      (k,) where the axis is there, mm or rad
    size   (k,) how far it goes, mm or rad
    way    (k,) the way in which it goes
    lost   (k,) how far it has to go until its play is taken up; 0 without play
    side   (k,) where its body is between the sides of the play as the run begins, -1 to 1
    """

    begin: Index
    place: Array
    q: Array
    size: Array
    way: Signs
    lost: Array
    side: Array

    def at(self, rows: Index, fraction: Array) -> Index:
        """The runs in which fractions of motions (n,) are, (n,); where two meet, the one of that motion."""
        place = rows + fraction
        after = np.where(fraction == 0, np.searchsorted(self.place, place, "right"), np.searchsorted(self.place, place))
        return np.maximum(after - 1, 0)

    def sides(self, run: Index, q: Array) -> Array:
        """Where the body is with the axis at positions (n,) of runs (n,), (n,) -1 to 1."""
        lost, way = self.lost[run], self.way[run]
        followed = self.side[run] + 2 * way * np.abs(q - self.q[run]) / np.where(lost > 0, lost, np.inf)
        return np.where(lost > 0, np.clip(followed, -1.0, 1.0), way)

    @property
    def takes_up(self) -> tuple[Index, Array]:
        """Runs (n,) in which play is taken up, and how far the axis has gone there, (n,) mm or rad."""
        needed = self.lost * (1 - self.way * self.side) / 2
        run = np.flatnonzero((self.way != 0) & (needed > REST) & (needed < self.size - REST))
        return run, needed[run]


@frozen
class BacklashBodies:
    """The bodies of the axes on which errors depend on the direction, along a program.

    A leg is a stretch of a motion that cuts, or all of a motion of another sort.

    stretches  of the program
    legs       k of them, in order
    own        (k,) which stretch each is; -1: none
    q          (2, k, n_axes) where the axes are as legs begin and end, mm and rad
    first      (n_axes,) where the bodies are as the first begins, -1 to 1
    runs       column of an axis -> its runs
    """

    intent: Intent
    stretches: Stretches
    legs: Stretches
    own: Index
    q: Array
    first: Array
    runs: dict[int, Runs]

    @classmethod
    def of(cls, intent: Intent, stretches: Stretches, first: Array | None) -> BacklashBodies:
        """Along the stretches of a program; `first` as above, 0 where that is not known."""
        legs, own = _legs(intent, stretches)
        q = np.stack([intent.joints_at(legs.rows, each) for each in (legs.start, legs.stop)])
        known = np.flatnonzero(finite(q[0]) & finite(q[1]))
        first = np.zeros(len(intent.machine.axes)) if first is None else first
        bodies = cls(intent, stretches, taken(legs, known), own[known], q[:, known], first, {})
        if len(known):
            bodies.runs.update((axis, bodies._runs(axis)) for axis in intent.machine.directed)
        return bodies

    def came(self, row: int) -> Signs:
        """(n_axes,) the way in which each axis came to the begin of a motion."""
        assert self.intent.came is not None
        return self.intent.came[row]

    def _runs(self, axis: int) -> Runs:
        places = self.q[:, :, axis].T.ravel()  # begin and end of each leg in turn: between two, it may have moved, too
        ways = carried(np.append(self.came(0)[axis], signs(np.diff(places)))[:, None])[1:, 0]
        begin = np.flatnonzero(np.diff(ways, prepend=2))
        q, way, legs = places[begin], ways[begin], self.legs
        size, lost = np.abs(np.append(q[1:], places[-1]) - q), self._lost(begin, axis, way)
        place = legs.rows[begin // 2].astype(np.float64) + np.where(
            begin % 2, legs.stop[begin // 2], legs.start[begin // 2]
        )
        return Runs(begin, place, q, size, way, lost, self._followed(way, size, lost, axis))

    def _followed(self, way: Signs, size: Array, lost: Array, axis: int) -> Array:
        """Where a body is as runs (k,) begin, (k,)."""
        sides, side = np.empty(len(way)), float(self.first[axis])
        far = np.where(lost > 0, 2 * size / np.where(lost > 0, lost, 1.0), 2.0) * way
        for run, to in enumerate(far.tolist()):
            sides[run] = side
            side = min(1.0, max(-1.0, side + to))
        return sides

    def _lost(self, begin: Index, axis: int, way: Signs) -> Array:
        """How far an axis goes from begins or ends of legs (m,) until play is taken up, (m,) mm or rad.

        0 where the body is ahead of the axis on both ways, as no play does: a control may that takes up too much.
        """
        q, leg = self.q[begin % 2, begin // 2], (begin + 1) // 2
        rows, inside = self.legs.rows[leg], (self.legs.start[leg] + self.legs.stop[leg]) / 2
        here, there = (self.tip_on_side(rows, inside, q, axis, each) for each in (way, -way))
        along = self.intent.machine.axis_jacobian(q, self.intent.lengths(rows))[:, :3, axis]
        square = np.einsum("ki,ki->k", along, along)
        ahead = np.einsum("ki,ki->k", along, there - here) * way / np.where(square > 0, square, np.inf)
        return np.where(ahead > LATERAL, ahead, 0.0)

    # -- what follows from it -----------------------------------------------------------------------------------------

    def divided(self) -> Stretches:
        """The stretches, also divided where play has been taken up."""
        places = [self._taken_up(axis) for axis in self.runs]
        if not any(len(which) for which, _ in places):
            return self.stretches
        return self.stretches.divided(*map(np.concatenate, zip(*places, strict=True)))

    def _taken_up(self, axis: int) -> tuple[Index, Array]:
        """Where the play of an axis has been taken up: stretches (m,), and the fractions of their motions."""
        runs, places = self.runs[axis], self.q[:, :, axis].T.ravel()
        gone = np.cumsum(np.abs(np.diff(places, prepend=places[:1])))
        run, far = runs.takes_up
        at = np.searchsorted(gone, gone[runs.begin[run]] + far)
        leg, target = at // 2, runs.q[run] + runs.way[run] * far
        off = np.abs(self.q[:, leg, axis] - target).min(axis=0)  # else it is where a leg begins or ends
        inside = np.flatnonzero((at % 2 == 1) & (self.own[leg] >= 0) & (off > REST))
        return self.own[leg[inside]], self._reaching(leg[inside], axis, target[inside])

    def _reaching(self, which: Index, axis: int, target: Array) -> Array:
        """The fractions of motions at which, in legs (m,), an axis is at positions (m,), (m,)."""
        legs, (begin, end) = self.legs, self.q[:, which, axis]
        low, high = legs.start[which], legs.stop[which]
        share = (target - begin) / np.where(end != begin, end - begin, 1.0)
        found: Array = low + np.clip(share, 0.0, 1.0) * (high - low)
        bent = np.flatnonzero(self.intent.curved[legs.rows[which]])
        if bent.size:
            rows, up, low, high = legs.rows[which[bent]], (end > begin)[bent], low[bent], high[bent]
            for _ in range(BISECTIONS):
                middle = (low + high) / 2
                short = (self.intent.joints_at(rows, middle)[:, axis] < target[bent]) == up
                low, high = np.where(short, middle, low), np.where(short, high, middle)
            found[bent] = (low + high) / 2
        return found

    def tip(self, rows: Index, fraction: Array) -> Array:
        """Where the tip is at fractions of motions done as programmed, with the bodies where they are, (k, 3) mm."""
        q, states = self.intent.joints_at(rows, fraction), self.intent.states(rows, fraction)
        here: Array = self.intent.machine.actual_tip(q, states)
        tip, ways = here.copy(), np.asarray(states.direction)
        for axis, runs in self.runs.items():
            way, run = ways[:, axis], runs.at(rows, fraction)
            away = np.where(runs.lost[run] > 0, np.abs(way - runs.sides(run, q[:, axis])) / 2, 0.0)
            which = np.flatnonzero(away * way)
            if which.size:
                other = self.tip_on_side(rows[which], fraction[which], q[which], axis, -way[which])
                tip[which] += away[which, None] * (other - here[which])
        return tip

    def tip_on_side(self, rows: Index, fraction: Array, q: Array, axis: int, side: Signs) -> Array:
        """Where the tip is at positions (k, n_axes), with an axis on a side of its play (k,), (k, 3) mm.

        All other axes are on the sides that they have at fractions of motions.
        """
        states = self.intent.states(rows, fraction)
        ways = np.array(states.direction)
        ways[:, axis] = side
        return self.intent.machine.actual_tip(q, State(states.tool_length, ways, states.inputs))

    def before(self, row: int) -> Array:
        """Where the bodies are as a motion begins, (n_axes,)."""
        found, leg = self.first.copy(), int(np.searchsorted(self.legs.rows, row))
        at = np.array([min(2 * leg, 2 * len(self.legs.rows) - 1)])
        for axis, runs in self.runs.items():
            run = np.maximum(np.searchsorted(runs.begin, at) - 1, 0)
            found[axis] = runs.sides(run, self.q[at % 2, at // 2, axis])[0] if leg else self.first[axis]
        return found


def _legs(intent: Intent, stretches: Stretches) -> tuple[Stretches, Index]:
    """The legs of a program, and which stretch each is; -1: none."""
    along = np.flatnonzero(stretches.stop > stretches.start)
    other = finite(intent.moves.start) & finite(intent.moves.end)
    other[stretches.rows[along]] = False
    rest = np.flatnonzero(other)
    nothing, all_of_it = np.zeros(len(rest)), np.ones(len(rest))
    rows = np.concatenate([stretches.rows[along], rest])
    start, stop = np.append(stretches.start[along], nothing), np.append(stretches.stop[along], all_of_it)
    order = np.argsort(rows, kind="stable")
    own = np.append(along, np.full(len(rest), -1))
    return taken(Stretches(rows, start, stop, start == 0), order), own[order]


NEAR = 0.01
"""mm or rad; so close to its turn an axis may be on either side."""
WINDOW = 24
"""Samples on both sides of a turn that are looked at."""


@frozen
class Flank:
    """A path of k parabolas, and where the tip may be besides: as each begins, half-way, as it ends.

    aside  (k, 3, 3) mm: to the other side, of axes that turn just there and have no play to take up; 0 of others
    """

    aside: NDArray[np.float32]

    @classmethod
    def of(cls, bodies: BacklashBodies, actual: Curve) -> Flank:
        """Of a path on the real machine."""
        at, aside = CurvePoints.of(actual), np.zeros((len(actual), 3, 3), dtype=np.float32)
        rows, place = actual.rows[at.piece], (2 * at.share).astype(np.intp)
        fraction = (1 - at.share) * actual.start[at.piece] + at.share * actual.stop[at.piece]
        q = bodies.intent.joints_at(rows, fraction)
        for axis, runs in bodies.runs.items() if len(rows) else ():  # of a path that cuts
            which = _near(runs, rows + fraction, q[:, axis])
            here = (rows[which], fraction[which], q[which], axis)
            way = bodies.intent.direction(rows[which], fraction[which])[:, axis]
            aside[at.piece[which], place[which]] += bodies.tip_on_side(*here, -way) - bodies.tip_on_side(*here, way)
        joined = np.flatnonzero(~actual.opens[1:]) + 1
        aside[joined, 0] = aside[joined - 1, 2]
        return cls(aside)

    def there(self, search: Search, path: Curve, samples: CurvePoints, found: Nearest) -> Array:
        """The gaps (k,) from samples of what is made, on the side on which it is nearer, to what is meant."""
        return self._lessened(search, samples.points, found, path, (samples.piece, samples.share), 1.0)

    def back(self, search: Search, points: Array, found: Nearest) -> Array:
        """The gaps (k,) from points (k, 3) of what is meant to what is made, on the side on which it is nearer."""
        gap = self._lessened(search, points, found, search.curve, (found.piece, found.share), -1.0)
        far = np.flatnonzero(gap > search.near)
        if far.size:  # of a place beside it
            for way in (-1, 1):
                piece = np.clip(found.piece[far] + way, 0, len(self.aside) - 1)
                where = piece, np.full(len(far), 0.5 - way / 2)
                nearest = Nearest(*where, gap[far])
                gap[far] = self._lessened(search, points[far], nearest, search.curve, where, -1.0)
        return gap

    def _lessened(
        self, search: Search, points: Array, found: Nearest, path: Curve, where: tuple[Index, Array], sense: float
    ) -> Array:
        """The gaps (k,) from points (k, 3) to a curve, or to it moved as a path may be at shares of parabolas."""
        (piece, share), gap = where, found.gap.copy()
        sample = np.rint(2 * share).astype(np.intp)
        aside = sense * self.aside[piece, sample].astype(np.float64)
        rows = np.flatnonzero(some(aside != 0))
        off = np.abs(share[rows] - sample[rows] / 2) * path.ways[piece[rows]]
        rows = rows[off <= NEAR + length(aside[rows])]
        if rows.size:
            nearest = search.around(points[rows] + aside[rows], taken(found, rows).way(search.curve))
            gap[rows] = np.minimum(gap[rows], nearest.gap)
        return gap


def _near(runs: Runs, place: Array, q: Array) -> Index:
    """Of samples (k,) in order, at places of a program, with an axis at positions, those close to where it turns."""
    turns = np.flatnonzero((runs.side != runs.way) & (runs.lost == 0))
    last = np.searchsorted(place, runs.place[turns], side="right") - 1
    around = np.clip(last[:, None] + np.arange(1 - WINDOW, WINDOW + 1), 0, len(q) - 1)
    found = np.zeros(len(q), dtype=bool)
    found[around[np.abs(q[around] - runs.q[turns, None]) <= NEAR]] = True
    return np.flatnonzero(found)
