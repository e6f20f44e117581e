"""The nearest point of a curve, searched near the same length of path.

For a point of another path, the search starts where this path has the same length, and descends to the nearest point.
If that is farther away than the tolerance, and the path turns so much nearby that it might come back nearer to the
point, all of the path that could be nearer is examined.

Between the samples of a path further samples are taken in two cases:

- The path passes a gap of the other path, between two of its cuts, however short the gap is. A straight cut is sampled
  at its begin, middle and end, and a gap in between would be missed.
- The path may be too far from the other one between two samples that are near enough. The distance changes by at most
  the way, and has a peak where the nearest point leaps along the other path. The way between two such samples is halved
  until a place is found that is too far, or until there can be none.
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
"""Weight of a difference of lengths along the path: it counts as this share of a distance."""
STEPS = 6
"""Largest number of Newton steps on a parabola; each squares the error."""
CLOSE = 1e-6
"""Step along the path, mm, that makes no difference to the distance."""
HOPS = 40
"""Largest number of parabolas on which a nearest point is searched in succession."""
STRAIGHT = 0.1
"""Turn of a path, rad, below which it leads no nearer to a point: the gain is at most 1 - cos, half a per cent."""
INSIDE = 1e-6
"""Distance from the ends of a parabola, as a share of it, because the search from its end may find another point than
that from the start of the next one."""
SUDDEN = 0.5
"""Sudden change of the difference of lengths, mm, at which a group of points is divided to find its place."""
FEWEST = 16
"""Least number of points in half of a group that is divided."""
PAIRS = 1 << 18
"""Number of pairs of points and parabolas worked on at a time."""


class NearestNotHereError(NotInPartsError):
    """The nearest point may lie on a part of the path that is not held."""


@frozen
class Nearest:
    """The nearest places of a curve to n points.

    piece  (n,) the parabola; `share` (n,): its parameter
    gap    (n,) the distance from the point, mm
    """

    piece: Index
    share: Array
    gap: Array

    def shifted(self, by: int) -> Nearest:
        """The same places, with `by` added to the numbers of the parabolas."""
        return replace(self, piece=self.piece + by)

    def way(self, curve: Curve) -> Array:
        """(n,) the lengths of the curve up to these places, mm, kept slightly inside the parabolas (`INSIDE`)."""
        return curve.way(self.piece, np.clip(self.share, INSIDE, 1 - INSIDE))

    def put(self, which: Index, other: Nearest) -> None:
        """Replace the places of points `which` by those of `other`."""
        self.piece[which], self.share[which], self.gap[which] = other.piece, other.share, other.gap


@mutable
class Search:
    """Searches the nearest places of a curve to points of another path.

    curve   the curve, or the held part of it
    near    distance, mm, below which a found place need not be the nearest one
    ahead   length along the curve minus length along the other path, mm, at the latest points
    begins, ends  the held part begins, or ends, with the whole curve
    """

    curve: Curve
    near: float
    ahead: float = 0.0
    begins: bool = True
    ends: bool = True

    def all(self, points: Array, lengths: Array, groups: Index) -> Nearest:
        """The nearest places to points (n, 3) of another path, in order, at lengths (n,) of it, mm.

        groups  indices at which groups of points begin; in a group, one difference of the two lengths is assumed first

        Raises `NearestNotHereError`.
        """
        parts = zip(np.split(points, groups), np.split(lengths, groups), strict=True)
        return stacked([each for part in parts for each in self._together(*part)])

    def _together(self, points: Array, lengths: Array) -> list[Nearest]:
        """The nearest places to a group of points, which is divided if the difference of lengths changes suddenly.

        The new difference is taken from the last point that is near enough, or from the nearest one if none is.
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
        """The nearest places to points (n, 3), searched near the lengths `expected` (n,) of the curve, mm.

        lengths  (n,) lengths of the other path up to the points, mm, if they are in order along it

        Raises `NearestNotHereError`.
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
        """(n,) the expected lengths, mm, interpolated from points before and behind that have a place near enough.

        The difference of lengths changes with every step that takes up play.
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
        """The places that are reached from the expected ones by descending towards `points` (3, n)."""
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
        """Like `_down`, compiled."""
        from ncfix.core import nearest

        n, path = len(expected), self.curve
        found = Nearest(np.empty(n, dtype=np.intp), np.empty(n), np.empty(n))
        opens = path.opens.view(np.uint8)
        columns = nearest.CurveColumns(path.parabolas, path.lengths, path.ways, opens, path.upto, path.lying)
        columns.down(points, expected, self.near, CLOSE, STEPS, HOPS, found.piece, found.share, found.gap)
        return found

    def _at_gap(self, piece: Index, share: Array) -> Array:
        """(n,) 1 at the end of a cut, -1 at the start of one, 0 elsewhere."""
        opens = self.curve.opens
        ends = (share == 1) & opens.take(piece + 1, mode="clip")
        return 1.0 * ends - ((share == 0) & opens[piece])

    def _hop(self, piece: Index, push: Array, one: Mask) -> Index:
        """(n,) the parabola to try next: the one `push` mm farther or, with `one`, the next one that has a length."""
        curve = self.curve
        ahead, size = push > 0, curve.ways[piece]
        end = curve.lengths[piece] + np.where(ahead, size, 0.0)
        at = curve.upto[curve.place(end + np.where(one, 0.0, push))] - 1
        after = curve.upto[piece]
        at = np.where(ahead, np.maximum(at, after), np.minimum(at, after - (size > 0) - 1))
        return curve.lying[np.clip(at, 0, len(curve.lying) - 1)]

    # -- exhaustive search where the path turns -----------------------------------------------------------------------

    def _everywhere(self, points: Array, expected: Array, found: Nearest, far: Index) -> None:
        """Examine all parabolas that could be nearer to points `far` (k,) than `found`, if the path turns nearby."""
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
        """(k,) the lengths of the curve, mm, between which a nearer place may lie."""
        way = self._cost(expected, found, which) / ALONG
        return expected[which] - way, expected[which] + way

    def _cost(self, expected: Array, found: Nearest, which: Index) -> Array:
        """(k,) the measure that is minimised, mm: the distance combined with the deviation from the expected length."""
        off = self.curve.way(found.piece[which], found.share[which]) - expected[which]
        return np.hypot(found.gap[which], ALONG * off)

    def _lacks(self, low: Array, high: Array) -> bool:
        """Whether some of these lengths of the curve, mm, lie outside the held part."""
        curve = self.curve
        before = not self.begins and low.min() < curve.lengths[0]
        return bool(before or (not self.ends and high.max() > curve.lengths[-1] + curve.ways[-1]))

    def _among(self, points: Array, expected: Array, found: Nearest, rows: Index, where: tuple[Index, Index]) -> None:
        """Examine runs of parabolas for points `rows` (k,); `where`: the first parabola and the length of each run."""
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
    """The nearest places to `points` (3, n) on parabolas `piece` (n,), by Newton steps from shares (n,).

    Returns the shares, the distances, mm, and how far the foot of the point lies beyond the end, mm: negative before
    the start, 0 if it is on the parabola.
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
    """(n,) scalar products of vectors (3, n)."""
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def _on_chords(curve: Curve, points: Array, piece: Index) -> tuple[Array, Array]:
    """(n,) shares of the chords of parabolas nearest to points (n, 3), and lower bounds of the distances, mm."""
    begin = picked(curve.begin, piece)
    chord, gap = picked(curve.end, piece) - begin, points - begin
    square = np.einsum("ij,ij->i", chord, chord)
    share = np.clip(np.einsum("ij,ij->i", gap, chord) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    return share, length(gap - share[:, None] * chord) - length(picked(curve.bend, piece)) / 4


def over_holes(
    search: Search, path: Curve, samples: CurvePoints, before: Index, found: Nearest
) -> tuple[CurvePoints, Nearest]:
    """Further samples of a path where it passes gaps of the other one, and the nearest places to them.

    samples, found  (n,) the samples so far, and the nearest places to them
    before          (n,) the parabola of the other path that is nearest to the sample before each
    """
    rows, middles = _crossed(search, samples, before, found.piece)
    piece, share = samples.piece[rows], _shares_beside(path, samples, rows, middles)
    points = path.point(piece, share)
    back = (samples.share[rows] - share) * path.ways[piece]
    more = search.around(points, search.curve.way(found.piece, found.share)[rows] - back)
    return CurvePoints(piece, share, points, np.zeros(len(rows))), more


def _crossed(search: Search, samples: CurvePoints, before: Index, behind: Index) -> tuple[Index, Array]:
    """(k,) samples before which gaps are passed, from parabolas `before` to `behind` (n,), and (k, 3) gap centres."""
    curve = search.curve
    holes = np.flatnonzero(curve.gaps > search.near)
    passed = np.searchsorted(holes, np.stack([before, behind]), side="right")
    low = passed.min(axis=0)
    counts = np.where(samples.share > 0, passed.max(axis=0) - low, 0)
    rows = owners(counts)
    hole = holes[low[rows] + places(counts)]
    return rows, (curve.end[hole - 1] + curve.begin[hole]) / 2


def _shares_beside(path: Curve, samples: CurvePoints, rows: Index, points: Array) -> Array:
    """(k,) the shares of parabolas beside points (k, 3), in the half of each parabola before samples `rows` (k,)."""
    piece, share = samples.piece[rows], samples.share[rows]
    begin = path.point(piece, share - 0.5)
    chord = samples.points[rows] - begin
    square = np.einsum("ij,ij->i", chord, chord)
    along = np.einsum("ij,ij->i", points - begin, chord) / np.where(square > 0, square, 1.0)
    return share - 0.5 + np.clip(along, 0.0, 1.0) / 2


HALVINGS = 24
"""Largest number of times that an interval is halved: to some nanometres of the longest one."""


@frozen
class NearestInterval:
    """n intervals of parabolas, and the nearest places of the other path to their ends.

    piece             (n,) the parabola
    low, high         (n,) the shares of it at which the interval begins and ends
    before, behind    the nearest places to its start, and to its end
    """

    piece: Index
    low: Array
    high: Array
    before: Nearest
    behind: Nearest

    def leaping(self, search: Search, path: Curve) -> NearestInterval:
        """The intervals on which the distance may have a peak above `near`."""
        way, near = path.ways[self.piece] * (self.high - self.low), search.near
        begin, end = (search.curve.way(each.piece, each.share) for each in (self.before, self.behind))
        within = (self.before.gap <= near) & (self.behind.gap <= near)
        peaks = within & (self.before.gap + self.behind.gap + way > 2 * near)
        return taken(self, np.flatnonzero(peaks & (np.abs(end - begin - way) > near)))

    def middle(self, search: Search, path: Curve) -> Nearest:
        """The nearest place to the middle of each interval, searched from its begin and from its end."""
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
        """Both halves of each interval; `middle`: the nearest places to the middles."""
        half = (self.low + self.high) / 2
        return stacked([replace(self, high=half, behind=middle), replace(self, low=half, before=middle)])


def over_peaks(
    search: Search, path: Curve, samples: CurvePoints, before: Nearest, found: Nearest
) -> Iterator[tuple[CurvePoints, Nearest]]:
    """Further samples of a path where the distance may have peaks between samples, and the nearest places to them.

    samples, found  (n,) the samples so far, and the nearest places to them
    before          (n,) the nearest place to the sample before each
    """
    joined = np.flatnonzero((samples.share > 0) & (path.ways[samples.piece] > 0))
    share = samples.share[joined]
    intervals = NearestInterval(samples.piece[joined], share - 0.5, share, taken(before, joined), taken(found, joined))
    for _ in range(HALVINGS):
        intervals = intervals.leaping(search, path)
        if not len(intervals.piece):
            return
        half = (intervals.low + intervals.high) / 2
        middle = intervals.middle(search, path)
        yield CurvePoints(intervals.piece, half, path.point(intervals.piece, half), np.zeros(len(half))), middle
        intervals = intervals.halves(middle)
