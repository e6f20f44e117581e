"""Backlash along a path: where the moved bodies of axes are between the two sides of their play.

When an axis reverses, its body stays until the axis has moved by the play; then it follows. The state is carried from
reversal to reversal: a corrected program takes up the play in a step of some micrometres, and its corrections reverse
axes by less than the play all the time.

Errors that depend on the direction of an axis but are no play along it change at once at a reversal. Seen from the
corrected text alone, such an axis reverses where its rounded numbers do; close to a reversal both sides are possible.
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
"""Play along an axis, mm or rad, below which a change at its reversal counts as no play."""


@frozen
class Runs:
    """The k runs of an axis along a path, in order; in each run it moves in one direction, or rests.

    begin  (k,) where the run begins: number of the leg's begin (2 i) or end (2 i + 1), i the leg
    place  (k,) the same as row of the motion plus fraction of it
    q      (k,) position of the axis there, mm or rad
    size   (k,) way of the axis in the run, mm or rad
    way    (k,) direction of the axis in the run, -1, 0 or 1
    lost   (k,) lost motion: way until the play is taken up after a reversal, mm or rad; 0 without play
    side   (k,) place of the body between the sides of the play at the start of the run, -1 to 1
    """

    begin: Index
    place: Array
    q: Array
    size: Array
    way: Signs
    lost: Array
    side: Array

    def at(self, rows: Index, fraction: Array) -> Index:
        """(n,) the runs at fractions (n,) of motions `rows` (n,); where two runs meet, the one of that motion."""
        place = rows + fraction
        after = np.where(fraction == 0, np.searchsorted(self.place, place, "right"), np.searchsorted(self.place, place))
        return np.maximum(after - 1, 0)

    def sides(self, run: Index, q: Array) -> Array:
        """(n,) place of the body between the sides of the play, -1 to 1, at axis positions q (n,) of runs (n,)."""
        lost, way = self.lost[run], self.way[run]
        followed = self.side[run] + 2 * way * np.abs(q - self.q[run]) / np.where(lost > 0, lost, np.inf)
        return np.where(lost > 0, np.clip(followed, -1.0, 1.0), way)

    @property
    def takes_up(self) -> tuple[Index, Array]:
        """(n,) the runs in which the play is fully taken up, and (n,) the way of the axis until then, mm or rad."""
        needed = self.lost * (1 - self.way * self.side) / 2
        run = np.flatnonzero((self.way != 0) & (needed > REST) & (needed < self.size - REST))
        return run, needed[run]


@frozen
class BacklashBodies:
    """The bodies of all axes with direction-dependent errors, along a program.

    A leg is a stretch of a motion that cuts, or the whole of any other motion.

    stretches  the stretches of the motions that cut
    legs       all k legs, in order
    own        (k,) the stretch that a leg is; -1: none
    q          (2, k, n_axes) axis positions at the begins and ends of legs, mm and rad
    first      (n_axes,) places of the bodies between the sides of the play at the first begin, -1 to 1
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
        """The bodies along the stretches of a program; `first` (n_axes,) as above, None: 0, not known."""
        legs, own = _legs(intent, stretches)
        q = np.stack([intent.joints_at(legs.rows, each) for each in (legs.start, legs.stop)])
        known = np.flatnonzero(finite(q[0]) & finite(q[1]))
        first = np.zeros(len(intent.machine.axes)) if first is None else first
        bodies = cls(intent, stretches, taken(legs, known), own[known], q[:, known], first, {})
        if len(known):
            bodies.runs.update((axis, bodies._runs(axis)) for axis in intent.machine.directed)
        return bodies

    def came(self, row: int) -> Signs:
        """(n_axes,) direction in which each axis came to the start of motion `row`."""
        assert self.intent.came is not None
        return self.intent.came[row]

    def _runs(self, axis: int) -> Runs:
        places = self.q[:, :, axis].T.ravel()  # begin and end of each leg in turn; it may also move between legs
        ways = carried(np.append(self.came(0)[axis], signs(np.diff(places)))[:, None])[1:, 0]
        begin = np.flatnonzero(np.diff(ways, prepend=2))
        q, way, legs = places[begin], ways[begin], self.legs
        size, lost = np.abs(np.append(q[1:], places[-1]) - q), self._lost(begin, axis, way)
        place = legs.rows[begin // 2].astype(np.float64) + np.where(
            begin % 2, legs.stop[begin // 2], legs.start[begin // 2]
        )
        return Runs(begin, place, q, size, way, lost, self._followed(way, size, lost, axis))

    def _followed(self, way: Signs, size: Array, lost: Array, axis: int) -> Array:
        """(k,) places of a body, -1 to 1, at the begins of runs (k,)."""
        sides, side = np.empty(len(way)), float(self.first[axis])
        far = np.where(lost > 0, 2 * size / np.where(lost > 0, lost, 1.0), 2.0) * way
        for run, to in enumerate(far.tolist()):
            sides[run] = side
            side = min(1.0, max(-1.0, side + to))
        return sides

    def _lost(self, begin: Index, axis: int, way: Signs) -> Array:
        """(m,) lost motion of an axis at begins or ends of legs (m,), mm or rad; `way` (m,): its direction there.

        0 if the body is ahead of the axis in both directions. That is no play, but a control that overcompensates it.
        """
        q, leg = self.q[begin % 2, begin // 2], (begin + 1) // 2
        rows, inside = self.legs.rows[leg], (self.legs.start[leg] + self.legs.stop[leg]) / 2
        following, opposite = (self.tip_on_side(rows, inside, q, axis, each) for each in (way, -way))
        along = self.intent.machine.axis_jacobian(q, self.intent.lengths(rows))[:, :3, axis]
        square = np.einsum("ki,ki->k", along, along)
        ahead = np.einsum("ki,ki->k", along, opposite - following) * way / np.where(square > 0, square, np.inf)
        return np.where(ahead > LATERAL, ahead, 0.0)

    # -- the tip with backlash ----------------------------------------------------------------------------------------

    def divided(self) -> Stretches:
        """The stretches, divided also at the places where the play of an axis has been taken up."""
        places = [self._taken_up(axis) for axis in self.runs]
        if not any(len(which) for which, _ in places):
            return self.stretches
        return self.stretches.divided(*map(np.concatenate, zip(*places, strict=True)))

    def _taken_up(self, axis: int) -> tuple[Index, Array]:
        """(m,) stretches in which the play of an axis has been taken up, and the fractions of their motions there."""
        runs, places = self.runs[axis], self.q[:, :, axis].T.ravel()
        gone = np.cumsum(np.abs(np.diff(places, prepend=places[:1])))
        run, far = runs.takes_up
        at = np.searchsorted(gone, gone[runs.begin[run]] + far)
        leg, target = at // 2, runs.q[run] + runs.way[run] * far
        off = np.abs(self.q[:, leg, axis] - target).min(axis=0)  # else it is where a leg begins or ends
        inside = np.flatnonzero((at % 2 == 1) & (self.own[leg] >= 0) & (off > REST))
        return self.own[leg[inside]], self._reaching(leg[inside], axis, target[inside])

    def _reaching(self, which: Index, axis: int, target: Array) -> Array:
        """(m,) the fractions of motions at which an axis reaches positions `target` (m,) in legs `which` (m,)."""
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
        """(k, 3) actual tip at fractions of motions, mm, with the bodies at their places between the sides."""
        q, states = self.intent.joints_at(rows, fraction), self.intent.states(rows, fraction)
        on_side: Array = self.intent.machine.actual_tip(q, states)
        tip, ways = on_side.copy(), np.asarray(states.direction)
        for axis, runs in self.runs.items():
            way, run = ways[:, axis], runs.at(rows, fraction)
            away = np.where(runs.lost[run] > 0, np.abs(way - runs.sides(run, q[:, axis])) / 2, 0.0)
            which = np.flatnonzero(away * way)
            if which.size:
                other = self.tip_on_side(rows[which], fraction[which], q[which], axis, -way[which])
                tip[which] += away[which, None] * (other - on_side[which])
        return tip

    def tip_on_side(self, rows: Index, fraction: Array, q: Array, axis: int, side: Signs) -> Array:
        """(k, 3) actual tip at axis positions q (k, n_axes), mm, with `axis` on `side` (k,) of its play.

        All other axes are on the sides that they have at `fraction` (k,) of motions `rows` (k,).
        """
        states = self.intent.states(rows, fraction)
        ways = np.array(states.direction)
        ways[:, axis] = side
        return self.intent.machine.actual_tip(q, State(states.tool_length, ways, states.inputs))

    def before(self, row: int) -> Array:
        """(n_axes,) places of the bodies, -1 to 1, at the start of motion `row`."""
        sides, leg = self.first.copy(), int(np.searchsorted(self.legs.rows, row))
        at = np.array([min(2 * leg, 2 * len(self.legs.rows) - 1)])
        for axis, runs in self.runs.items():
            run = np.maximum(np.searchsorted(runs.begin, at) - 1, 0)
            sides[axis] = runs.sides(run, self.q[at % 2, at // 2, axis])[0] if leg else self.first[axis]
        return sides


def _legs(intent: Intent, stretches: Stretches) -> tuple[Stretches, Index]:
    """The legs of a program, and (k,) the stretch that each is; -1: none."""
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
"""Distance of an axis from its reversal, mm or rad, within which it may be on either side."""
WINDOW = 24
"""Number of samples on each side of a reversal that are examined."""


@frozen
class Flank:
    """The other possible place of the tip near reversals, on a path of k parabolas.

    aside  (k, 3, 3) vector, mm, from the tip to its place with the reversing axes on their other side, at the start,
           middle and end of each parabola; 0 away from reversals, and for axes with play to take up
    """

    aside: NDArray[np.float32]

    @classmethod
    def of(cls, bodies: BacklashBodies, actual: Curve) -> Flank:
        """The other places of the tip along the path `actual` of the real machine."""
        at, aside = CurvePoints.of(actual), np.zeros((len(actual), 3, 3), dtype=np.float32)
        rows, place = actual.rows[at.piece], (2 * at.share).astype(np.intp)
        fraction = (1 - at.share) * actual.start[at.piece] + at.share * actual.stop[at.piece]
        q = bodies.intent.joints_at(rows, fraction)
        for axis, runs in bodies.runs.items() if len(rows) else ():
            which = _near(runs, rows + fraction, q[:, axis])
            near = (rows[which], fraction[which], q[which], axis)
            way = bodies.intent.direction(rows[which], fraction[which])[:, axis]
            aside[at.piece[which], place[which]] += bodies.tip_on_side(*near, -way) - bodies.tip_on_side(*near, way)
        joined = np.flatnonzero(~actual.opens[1:]) + 1
        aside[joined, 0] = aside[joined - 1, 2]
        return cls(aside)

    def there(self, search: Search, path: Curve, samples: CurvePoints, found: Nearest) -> Array:
        """(k,) the gaps from samples of the actual path, on the side that is nearer, to the intended one, mm."""
        return self._lessened(search, samples.points, found, path, (samples.piece, samples.share), 1.0)

    def back(self, search: Search, points: Array, found: Nearest) -> Array:
        """(k,) the gaps from points (k, 3) of the intended path to the actual one, on the side that is nearer, mm."""
        gap = self._lessened(search, points, found, search.curve, (found.piece, found.share), -1.0)
        far = np.flatnonzero(gap > search.near)
        if far.size:  # try the neighbouring parabolas, too
            for way in (-1, 1):
                piece = np.clip(found.piece[far] + way, 0, len(self.aside) - 1)
                where = piece, np.full(len(far), 0.5 - way / 2)
                nearest = Nearest(*where, gap[far])
                gap[far] = self._lessened(search, points[far], nearest, search.curve, where, -1.0)
        return gap

    def _lessened(
        self, search: Search, points: Array, found: Nearest, path: Curve, where: tuple[Index, Array], sense: float
    ) -> Array:
        """(k,) the gaps from points (k, 3) to the curve, or to it moved by `sense` times `aside`, if smaller, mm.

        path, where  the path with the reversals, and (k,) its parabolas and shares of them at the points
        """
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
    """The samples (k,) at which an axis without play is close to one of its reversals.

    place  (k,) row of the motion plus fraction of it, ascending
    q      (k,) position of the axis, mm or rad
    """
    turns = np.flatnonzero((runs.side != runs.way) & (runs.lost == 0))
    last = np.searchsorted(place, runs.place[turns], side="right") - 1
    around = np.clip(last[:, None] + np.arange(1 - WINDOW, WINDOW + 1), 0, len(q) - 1)
    found = np.zeros(len(q), dtype=bool)
    found[around[np.abs(q[around] - runs.q[turns, None]) <= NEAR]] = True
    return np.flatnonzero(found)
