"""The nearest point of a curve, looked for near the same length of path.

A point of another path is followed down to where it is nearest, from where this path is as long as that one is there.
Where that is farther away than is of no interest, and the path turns so much near by that it might come back nearer to
the point, all of it is looked at that could be nearer.

Between the samples of a path more are taken in two cases:

- Where it goes on over a hole of the other one, between two cuts of it, however short that is. A straight cut is looked
  at where it begins, half-way and where it ends; a hole in between is not seen there.
- Where it may be too far from the other one between two places at which it is near enough. The distance changes by no
  more than the way, and has a peak where the nearest point leaps along the other path. The way between two such places
  is halved until one is found that is too far, or until there can be none.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ncfix import core
from ncfix.arrays import Array, Index, Mask, batches, owners, picked, places, ranges, stacked, taken
from ncfix.compensate.figures.curve import Curve, CurvePoints, length
from ncfix.control.trace import NotInPartsError
from ncfix.values import frozen, mutable

ALONG = 0.02
"""A point that is so much shorter or longer along the path counts as this share of that farther away."""
STEPS = 6
"""Most Newton steps on a parabola; each squares what is missing."""
CLOSE = 1e-6
"""mm: a step along the path that makes no difference to the distance."""
HOPS = 40
"""Most parabolas on which a nearest point is looked for one after the other."""
STRAIGHT = 0.1
"""rad: a path that turns by less leads no nearer to a point than 1 - cos of it, half a per cent, of its distance."""
INSIDE = 1e-6
"""Share of a parabola: from its end another nearest point may be found than from the begin of the next one."""
SUDDEN = 0.5
"""mm by which one path is longer than the other on the way of these: there is something wrong, and it is looked for."""
FEWEST = 16
"""Points for which the difference is taken as the same at last."""
PAIRS = 1 << 18
"""Points and parabolas that are looked at together."""


class NearestNotHereError(NotInPartsError):
    """The nearest point may lie on a part of the path that is not at hand."""


@frozen
class Nearest:
    """Where a curve is nearest to points.

    piece  (n,) the parabola, and `share` (n,) of it
    gap    (n,) mm
    """

    piece: Index
    share: Array
    gap: Array

    def shifted(self, by: int) -> Nearest:
        """These places, with the parabolas counted from elsewhere."""
        return replace(self, piece=self.piece + by)

    def way(self, curve: Curve) -> Array:
        """The ways along the curve to there, (n,) mm; so far inside of the parabolas that rounding shows no others."""
        return curve.way(self.piece, np.clip(self.share, INSIDE, 1 - INSIDE))

    def put(self, which: Index, other: Nearest) -> None:
        """Take for some of the points what is there instead."""
        self.piece[which], self.share[which], self.gap[which] = other.piece, other.share, other.gap


@mutable
class Search:
    """Looks for the nearest points of a curve.

    curve   the curve, or the part of it that is at hand
    near    mm; of distances below nobody needs to know whether another point is nearer
    ahead   how much farther one is along the curve than along the other path, mm, by what was found last
    begins, ends  there is nothing before the part at hand, or behind it
    """

    curve: Curve
    near: float
    ahead: float = 0.0
    begins: bool = True
    ends: bool = True

    def all(self, points: Array, lengths: Array, groups: Index) -> Nearest:
        """For points (n, 3) of another path, in order, at lengths (n,) of it. Raises `NearestNotHereError`.

        groups  where others begin for which the difference of the two lengths of path is taken as the same, at first
        """
        parts = zip(np.split(points, groups), np.split(lengths, groups), strict=True)
        return stacked([each for part in parts for each in self._together(*part)])

    def _together(self, points: Array, lengths: Array) -> list[Nearest]:
        """For points of a short way; of ever shorter ones where one path suddenly is longer than the other.

        How much longer it is, is seen at the last of them that is near enough, or at the nearest one if none is.
        """
        found, half = self.around(points, lengths + self.ahead, lengths), len(points) // 2
        sure = np.flatnonzero(found.gap[half:] <= self.near)
        surest = half + int(sure[-1] if sure.size else np.argmin(found.gap[half:]))
        ahead = float(self.curve.way(found.piece, found.share)[surest] - lengths[surest])
        if abs(ahead - self.ahead) > SUDDEN and half >= FEWEST:
            return self._together(points[:half], lengths[:half]) + self._together(points[half:], lengths[half:])
        self.ahead = ahead
        return [found]

    def around(self, points: Array, expected: Array, lengths: Array | None = None) -> Nearest:
        """For points (n, 3), near the lengths (n,) of the curve at which they are expected.

        Raises `NearestNotHereError`.

        lengths  (n,) of the other path to the points, if they are in order along it
        """
        found = self._downhill(points, expected)
        far = np.flatnonzero(found.gap > self.near)
        if far.size and lengths is not None:
            expected = self._beside(expected, lengths, found)
            found.put(far, self._downhill(points[far], expected[far]))
            far = far[found.gap[far] > self.near]
        if far.size:
            self._everywhere(points, expected, found, far)
        return found

    def _beside(self, expected: Array, lengths: Array, found: Nearest) -> Array:
        """The lengths (n,) at which points are expected by what is near enough to those before and behind them.

        One path gets longer than the other with every step that takes up play.
        """
        ahead = self.curve.way(found.piece, found.share) - lengths
        sure = np.flatnonzero((found.gap <= self.near) & (np.abs(ahead - self.ahead) <= SUDDEN))
        if not sure.size:
            return expected
        return lengths + np.interp(np.arange(len(lengths)), sure, ahead[sure])

    def _downhill(self, points: Array, expected: Array) -> Nearest:
        down = self._down_compiled if core.engaged() else self._down
        return down(np.ascontiguousarray(points.T), expected)

    def _down(self, points: Array, expected: Array) -> Nearest:
        """The nearest points that are reached without going away from `points` (3, n)."""
        piece, lying = self.curve.place(expected), self.curve.lying
        size = self.curve.ways[piece]
        share = np.clip((expected - self.curve.lengths[piece]) / np.where(size > 0, size, 1.0), 0.0, 1.0)
        share, gap, push = _newton(self.curve, points, piece, share)
        push += CLOSE * self._at_gap(piece, share) * (gap > self.near)
        found = Nearest(piece, share, gap)
        rows, step_by_step = np.flatnonzero(push), np.zeros(len(expected), dtype=bool)
        for _ in range(HOPS if lying.size else 0):
            if not rows.size:
                break
            new = self._hop(found.piece[rows], push[rows], step_by_step[rows])
            entered = np.where(push[rows] > 0, 0.0, 1.0)
            tried, way, further = _newton(self.curve, points.take(rows, axis=1), new, entered)
            better = way < found.gap[rows]
            found.put(rows[better], Nearest(new[better], tried[better], way[better]))
            push[rows[better]] = further[better]
            again = ~better & ~step_by_step[rows]
            step_by_step[rows] = ~better
            rows = rows[(better & (further != 0)) | again]
        return found

    def _down_compiled(self, points: Array, expected: Array) -> Nearest:
        """As `_down`."""
        from ncfix.core import nearest

        n, path = len(expected), self.curve
        found = Nearest(np.empty(n, dtype=np.intp), np.empty(n), np.empty(n))
        opens = path.opens.view(np.uint8)
        columns = nearest.CurveColumns(path.parabolas, path.lengths, path.ways, opens, path.upto, path.lying)
        columns.down(points, expected, self.near, CLOSE, STEPS, HOPS, found.piece, found.share, found.gap)
        return found

    def _at_gap(self, piece: Index, share: Array) -> Array:
        """1 where a cut ends, -1 where one begins, 0 elsewhere, (n,)."""
        opens = self.curve.opens
        ends = (share == 1) & opens.take(piece + 1, mode="clip")
        return 1.0 * ends - ((share == 0) & opens[piece])

    def _hop(self, piece: Index, push: Array, one: Mask) -> Index:
        """Where to look next: as far along as the point lies, or on the very next parabola that has a length."""
        curve = self.curve
        ahead, size = push > 0, curve.ways[piece]
        end = curve.lengths[piece] + np.where(ahead, size, 0.0)
        at = curve.upto[curve.place(end + np.where(one, 0.0, push))] - 1
        after = curve.upto[piece]
        at = np.where(ahead, np.maximum(at, after), np.minimum(at, after - (size > 0) - 1))
        return curve.lying[np.clip(at, 0, len(curve.lying) - 1)]

    # -- where the path turns -----------------------------------------------------------------------------------------

    def _everywhere(self, points: Array, expected: Array, found: Nearest, far: Index) -> None:
        """Look at all that could be nearer to points `far` (k,) than what was found, where the path turns near by."""
        curve, (low, high) = self.curve, self._range(expected, found, far)
        first, last = curve.place(low), curve.place(high)
        first, last = np.minimum(first, found.piece[far]), np.maximum(last, found.piece[far])
        turning = np.flatnonzero(curve.turns[1][last] - curve.turns[0][first] > STRAIGHT)
        rows, first, counts = far[turning], first[turning], (last - first + 1)[turning]
        for some in batches(counts, PAIRS):
            self._among(points, expected, found, rows[some], (first[some], counts[some]))
        if self._lacks(low, high) and self._lacks(*self._range(expected, found, far)):
            raise NearestNotHereError

    def _range(self, expected: Array, found: Nearest, which: Index) -> tuple[Array, Array]:
        """The ways along the curve between which there may be a nearer point, (k,) mm."""
        way = self._cost(expected, found, which) / ALONG
        return expected[which] - way, expected[which] + way

    def _cost(self, expected: Array, found: Nearest, which: Index) -> Array:
        """The measure in which a point is nearest, mm: its distance, and how far it is from where it was expected."""
        off = self.curve.way(found.piece[which], found.share[which]) - expected[which]
        return np.hypot(found.gap[which], ALONG * off)

    def _lacks(self, low: Array, high: Array) -> bool:
        """Whether some of these ways along the curve are not at hand."""
        curve = self.curve
        before = not self.begins and low.min() < curve.lengths[0]
        return bool(before or (not self.ends and high.max() > curve.lengths[-1] + curve.ways[-1]))

    def _among(self, points: Array, expected: Array, found: Nearest, rows: Index, where: tuple[Index, Index]) -> None:
        """Look at runs of parabolas for points `rows` (k,): the first of each, and how many."""
        (first, counts), cost = where, self._cost(expected, found, rows)
        owner, piece = owners(counts), ranges(first, counts)
        share, least = _on_chords(self.curve, picked(points, rows[owner]), piece)
        way = np.clip(expected[rows[owner]], self.curve.lengths[piece], self.curve.way(piece, np.ones(len(piece))))
        hopeful = np.flatnonzero(np.hypot(least, ALONG * (way - expected[rows[owner]])) < cost[owner])
        owner, piece = owner[hopeful], piece[hopeful]
        here = np.ascontiguousarray(picked(points, rows[owner]).T)
        share, gap, _ = _newton(self.curve, here, piece, share[hopeful])
        costs = np.hypot(gap, ALONG * (self.curve.way(piece, share) - expected[rows[owner]]))
        order = np.lexsort((costs, owner))
        best = order[np.diff(owner[order], prepend=-1) != 0]
        best = best[costs[best] < cost[owner[best]]]
        found.put(rows[owner[best]], Nearest(piece[best], share[best], gap[best]))


def _newton(curve: Curve, points: Array, piece: Index, share: Array) -> tuple[Array, Array, Array]:
    """The nearest points to `points` (3, n) on parabolas (n,), from shares (n,) of them.

    Returns the shares, the distances, and how far beyond their ends the way to the points goes on: mm, negative before
    their begin, 0 if it ends on them.
    """
    begin, slope, bend = curve.parabolas.take(piece, axis=1).reshape(3, 3, -1)
    points = points - begin
    for step in range(STEPS + 1):
        left, along = points - share * (slope + share * bend), slope + 2 * share * bend
        square = _dot(along, along)
        size = np.sqrt(square)
        ahead = _dot(left, along) / np.where(size > 0, size, 1.0)
        outside = ((share == 1) & (ahead > 0)) | ((share == 0) & (ahead < 0))
        moving = (np.abs(ahead) > CLOSE) & ~outside
        if step == STEPS or not moving.any():
            break
        bowed = square - 2 * _dot(left, bend)
        bowed = np.where(bowed > square / 4, bowed, np.where(moving, square, 1.0))
        share = np.where(moving, np.clip(share + ahead * size / bowed, 0.0, 1.0), share)
    return share, np.sqrt(_dot(left, left)), np.where(outside, ahead, 0.0)


def _dot(one: Array, other: Array) -> Array:
    """The products (n,) of vectors (3, n)."""
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def _on_chords(curve: Curve, points: Array, piece: Index) -> tuple[Array, Array]:
    """The shares of the chords of parabolas (n,) that are nearest to points (n, 3), and how near these are at most."""
    begin = picked(curve.begin, piece)
    chord, gap = picked(curve.end, piece) - begin, points - begin
    square = np.einsum("ij,ij->i", chord, chord)
    share = np.clip(np.einsum("ij,ij->i", gap, chord) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    return share, length(gap - share[:, None] * chord) - length(picked(curve.bend, piece)) / 4


def over_holes(
    search: Search, path: Curve, samples: CurvePoints, before: Index, found: Nearest
) -> tuple[CurvePoints, Nearest]:
    """More samples of a path, where it goes over holes of the other one, and what is nearest to them.

    samples, found  (n,) those that there are
    before  (n,) the parabola of the other one that is nearest to the place before each sample
    """
    rows, middles = _crossed(search, samples, before, found.piece)
    piece, share = samples.piece[rows], _shares_beside(path, samples, rows, middles)
    points = path.point(piece, share)
    back = (samples.share[rows] - share) * path.ways[piece]
    more = search.around(points, search.curve.way(found.piece, found.share)[rows] - back)
    return CurvePoints(piece, share, points, np.zeros(len(rows))), more


def _crossed(search: Search, samples: CurvePoints, before: Index, behind: Index) -> tuple[Index, Array]:
    """Samples (k,) before which holes are gone over, from parabolas (n,) to others (n,), and the middles (k, 3)."""
    curve = search.curve
    holes = np.flatnonzero(curve.gaps > search.near)
    passed = np.searchsorted(holes, np.stack([before, behind]), side="right")
    low = passed.min(axis=0)
    counts = np.where(samples.share > 0, passed.max(axis=0) - low, 0)
    rows = owners(counts)
    hole = holes[low[rows] + places(counts)]
    return rows, (curve.end[hole - 1] + curve.begin[hole]) / 2


def _shares_beside(path: Curve, samples: CurvePoints, rows: Index, points: Array) -> Array:
    """The shares of the parabolas that are beside points (k, 3), in the half of each before a sample (k,)."""
    piece, share = samples.piece[rows], samples.share[rows]
    begin = path.point(piece, share - 0.5)
    chord = samples.points[rows] - begin
    square = np.einsum("ij,ij->i", chord, chord)
    along = np.einsum("ij,ij->i", points - begin, chord) / np.where(square > 0, square, 1.0)
    return share - 0.5 + np.clip(along, 0.0, 1.0) / 2


HALVINGS = 24
"""How often a way is halved at most: to some nanometres of the longest."""


@frozen
class NearestInterval:
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

    def leaping(self, search: Search, path: Curve) -> NearestInterval:
        """The intervals on which there may be a peak beyond what is near enough."""
        way, near = path.ways[self.piece] * (self.high - self.low), search.near
        begin, end = (search.curve.way(each.piece, each.share) for each in (self.before, self.behind))
        within = (self.before.gap <= near) & (self.behind.gap <= near)
        peaks = within & (self.before.gap + self.behind.gap + way > 2 * near)
        return taken(self, np.flatnonzero(peaks & (np.abs(end - begin - way) > near)))

    def middle(self, search: Search, path: Curve) -> Nearest:
        """What is nearest to the middle of each: seen from the begin or from the end, whichever is nearer."""
        points = path.point(self.piece, (self.low + self.high) / 2)
        half = path.ways[self.piece] * (self.high - self.low) / 2
        found, other = (
            search.around(points, search.curve.way(each.piece, each.share) + way)
            for each, way in ((self.before, half), (self.behind, -half))
        )
        nearer = np.flatnonzero(other.gap < found.gap)
        found.put(nearer, taken(other, nearer))
        return found

    def halves(self, middle: Nearest) -> NearestInterval:
        """Both halves of each, by what is nearest to its middle."""
        half = (self.low + self.high) / 2
        return stacked([replace(self, high=half, behind=middle), replace(self, low=half, before=middle)])


def over_peaks(
    search: Search, path: Curve, samples: CurvePoints, before: Nearest, found: Nearest
) -> Iterator[tuple[CurvePoints, Nearest]]:
    """More samples of a path, where there are peaks between those that there are, and what is nearest to them.

    samples, found  (n,) those that there are
    before          (n,) what is nearest to the place before each sample
    """
    joined = np.flatnonzero((samples.share > 0) & (path.ways[samples.piece] > 0))
    share = samples.share[joined]
    left = NearestInterval(samples.piece[joined], share - 0.5, share, taken(before, joined), taken(found, joined))
    for _ in range(HALVINGS):
        left = left.leaping(search, path)
        if not len(left.piece):
            return
        half = (left.low + left.high) / 2
        middle = left.middle(search, path)
        yield CurvePoints(left.piece, half, path.point(left.piece, half), np.zeros(len(half))), middle
        left = left.halves(middle)
