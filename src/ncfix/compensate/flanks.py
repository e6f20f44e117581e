"""Where the tip may be besides, close to where axes turn round whose errors change at once.

Seen from a corrected text alone, an axis turns round where its rounded numbers do; so close to a turn both sides are
possible. Axes with play do not jump: see `bodies`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.compensate.bodies import Bodies, Runs
from ncfix.compensate.curve import Curve, Samples, length
from ncfix.compensate.findings import Array, Index
from ncfix.compensate.nearest import Nearest, Search
from ncfix.compensate.rows import some

NEAR = 0.01
"""mm or rad; so close to its turn an axis may be on either side."""
WINDOW = 24
"""Samples on both sides of a turn that are looked at."""


@dataclass(frozen=True, slots=True)
class Flank:
    """A path of k parabolas, and where the tip may be besides: as each begins, half-way, as it ends.

    aside  (k, 3, 3) mm: to the other side, of axes that turn just there and have no play to take up; 0 of others
    """

    aside: NDArray[np.float32]

    @classmethod
    def of(cls, bodies: Bodies, actual: Curve) -> Flank:
        """Of a path on the real machine."""
        at, aside = Samples.of(actual), np.zeros((len(actual), 3, 3), dtype=np.float32)
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

    def taken(self, which: slice) -> Flank:
        """That of some of the parabolas."""
        return Flank(self.aside[which])

    def and_then(self, other: Flank) -> Flank:
        """That of two parts of a path that follow each other."""
        return Flank(np.concatenate([self.aside, other.aside]))

    def there(self, search: Search, path: Curve, samples: Samples, found: Nearest) -> Array:
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
            nearest = search.around(points[rows] + aside[rows], found.taken(rows).way(search.curve))
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
