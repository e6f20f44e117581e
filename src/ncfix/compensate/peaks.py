"""Where a path is too far from the other one between two places at which it is near enough.

The distance changes by no more than the way, and has a peak where the nearest point leaps along the other path. The way
between two such places is halved until one is found that is too far, or until there can be none.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ncfix.compensate.curve import Curve, Samples
from ncfix.compensate.findings import Array, Index
from ncfix.compensate.nearest import Nearest, Search

HALVINGS = 24
"""How often a way is halved at most: to some nanometres of the longest."""


@dataclass(frozen=True, slots=True)
class Between:
    """Ways (n,) along parabolas, and what is nearest to where they begin and end.

    piece             (n,) the parabola
    low, high         (n,) the shares of it from which to which they go
    before, behind    what is nearest to both ends
    """

    piece: Index
    low: Array
    high: Array
    before: Nearest
    behind: Nearest

    def taken(self, which: Index) -> Between:
        """Some of them."""
        ends = (each.taken(which) for each in (self.before, self.behind))
        return Between(self.piece[which], self.low[which], self.high[which], *ends)

    def leaping(self, search: Search, path: Curve) -> Between:
        """Those on which there may be a peak beyond what is near enough."""
        way, near = path.ways[self.piece] * (self.high - self.low), search.near
        begin, end = (search.curve.way(each.piece, each.share) for each in (self.before, self.behind))
        within = (self.before.gap <= near) & (self.behind.gap <= near)
        peaks = within & (self.before.gap + self.behind.gap + way > 2 * near)
        return self.taken(np.flatnonzero(peaks & (np.abs(end - begin - way) > near)))

    def middle(self, search: Search, path: Curve) -> Nearest:
        """What is nearest to the middle of each: seen from the begin or from the end, whichever is nearer."""
        points = path.point(self.piece, (self.low + self.high) / 2)
        half = path.ways[self.piece] * (self.high - self.low) / 2
        found, other = (
            search.around(points, search.curve.way(each.piece, each.share) + way)
            for each, way in ((self.before, half), (self.behind, -half))
        )
        nearer = np.flatnonzero(other.gap < found.gap)
        found.put(nearer, other.taken(nearer))
        return found

    def halves(self, middle: Nearest) -> Between:
        """Both halves of each, by what is nearest to its middle."""
        piece, half = np.tile(self.piece, 2), (self.low + self.high) / 2
        low, high = np.append(self.low, half), np.append(half, self.high)
        return Between(piece, low, high, self.before.and_more(middle), middle.and_more(self.behind))


def over_peaks(
    search: Search, path: Curve, samples: Samples, before: Nearest, found: Nearest
) -> Iterator[tuple[Samples, Nearest]]:
    """More samples of a path, where there are peaks between those that there are, and what is nearest to them.

    samples, found  (n,) those that there are
    before          (n,) what is nearest to the place before each sample
    """
    joined = np.flatnonzero((samples.share > 0) & (path.ways[samples.piece] > 0))
    share = samples.share[joined]
    left = Between(samples.piece[joined], share - 0.5, share, before.taken(joined), found.taken(joined))
    for _ in range(HALVINGS):
        left = left.leaping(search, path)
        if not len(left.piece):
            return
        half = (left.low + left.high) / 2
        middle = left.middle(search, path)
        yield Samples(left.piece, half, path.point(left.piece, half), np.zeros(len(half))), middle
        left = left.halves(middle)
