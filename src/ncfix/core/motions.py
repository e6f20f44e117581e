"""Loops over blocks, motions and points of a path, one after the other.

They do what the columns of `control.lanes`, `compensate.plan` and `compensate.figures` do, operation by operation, so
that the results are the same; a test holds them together.
"""

from __future__ import annotations

from math import ceil, sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Bytes = NDArray[np.uint8]
    Ints = NDArray[np.int64]
    Rows = NDArray[np.int32]
    Array = NDArray[np.float64]


def followed(
    numbers: Array,
    first: Ints,
    shapes: Rows,
    slots: Ints,
    feeds: Ints,
    motions: Ints,
    masks: Ints,
    position: Array,
    unit: float,
    feed: float,
    motion: float,
    offset: Array,
    scale: Array,
    incremental: bool,
    path: Array,
    feed_of: Array,
    fed: Bytes,
    motion_of: Array,
    coded: Bytes,
    mask: Ints,
) -> int:
    """What the k blocks of a stretch say, and where they lead: as `block_rows.followed`.

    numbers, first, shapes        of the program; the first number and the shape of each block (k,)
    slots, feeds, motions, masks  `axes`, `feed`, `motion`, `mask` of `LaneTables`
    position                      the command before the first block (letters,)
    unit, feed, motion            what the number of F counts, feed and motion code in force
    offset, scale, incremental    the frame (letters,), and whether words are increments
    path, feed_of, fed, motion_of, coded, mask  room for what `BlockRows` holds
    """
    letters = position.shape[0]
    for letter in range(letters):
        path[0, letter] = position[letter]
    for row in range(first.shape[0]):
        shape, number = shapes[row], first[row]
        for letter in range(letters):
            slot = slots[shape, letter]
            if slot < 0:
                path[row + 1, letter] = path[row, letter]
            else:
                step = scale[letter] * numbers[number + slot]
                path[row + 1, letter] = (path[row, letter] if incremental else offset[letter]) + step
        fed[row], coded[row], mask[row] = feeds[shape] >= 0, motions[shape] >= 0, masks[shape]
        if feeds[shape] >= 0:
            feed = unit * numbers[number + feeds[shape]]
        if motions[shape] >= 0:
            motion = float(motions[shape])
        feed_of[row], motion_of[row] = feed, motion
    return 0


# -- pieces of motions ------------------------------------------------------------------------------------------------


def deviation(fraction: Array, command: Array, follow: Array, a: int, b: int) -> float:
    """The largest deviation of the straight piece from node a to node b: as `PathNodes.deviations`."""
    most = 0.0
    for node in range(a + 1, b):
        seen = node if follow.shape[0] > 1 else 0
        share = (fraction[node] - fraction[a]) / (fraction[b] - fraction[a])
        square = 0.0
        for i in range(follow.shape[1]):
            off = 0.0
            for j in range(command.shape[1]):
                here = command[a, j] + share * (command[b, j] - command[a, j])
                off += follow[seen, i, j] * (here - command[node, j])
            square += off * off
        most = max(most, sqrt(square))
    return most


def fewest(
    counts: Ints, fraction: Array, command: Array, follow: Array, tolerance: float, stretch: int, ends: Bytes,
    worst: Array,
) -> int:  # fmt: skip
    """Mark in `ends`, all 0, which nodes end a piece; put down the largest deviation of each motion's pieces.

    As `splitting.fewest`; `tolerance` in mm, `stretch` is `splitting.STRETCH`.
    """
    first = 0
    for motion in range(counts.shape[0]):
        at, last, usual = first, first + counts[motion] - 1, 1
        stop = at
        while at < last:
            if at == stop:
                stop = at + stretch if last - at >= 2 * stretch else last
                usual = 1
            near, far, step, reached = at + 1, stop + 1, usual, 0.0
            fresh = True
            while near < stop:
                if far > stop:
                    trial = min(near + step, stop)
                elif near > at + 1:
                    trial = (near + far) // 2
                else:
                    trial = max(far - step, (near + far) // 2)
                if trial <= near:
                    break
                off = deviation(fraction, command, follow, at, trial)
                if off <= tolerance:
                    near, reached = trial, off
                else:
                    far = trial
                step = 1 if fresh else 2 * step
                fresh = False
            ends[near] = 1
            worst[motion] = max(worst[motion], reached)
            usual, at = max(near - at - 1, 1), near
        first += counts[motion]
    return 0


# -- the nearest point of a path --------------------------------------------------------------------------------------


class CurveColumns:
    """What a `Curve` calls by the same names."""

    def __init__(self, parabolas: Array, lengths: Array, ways: Array, opens: Bytes, upto: Ints, lying: Ints) -> None:
        self.parabolas, self.lengths, self.ways = parabolas, lengths, ways
        self.opens, self.upto, self.lying = opens, upto, lying
        self.share = self.gap = self.push = 0.0

    def place(self, way: float) -> int:
        """The parabola in which a way ends: as `Curve.place`."""
        low, high = 0, self.lengths.shape[0]
        while low < high:
            middle = (low + high) // 2
            if self.lengths[middle] <= way:
                low = middle + 1
            else:
                high = middle
        return max(low - 1, 0)

    def hop(self, piece: int, push: float, one: bool) -> int:
        """Where to look next: as `Search._hop`."""
        end = self.lengths[piece] + (self.ways[piece] if push > 0 else 0.0)
        at, after = self.upto[self.place(end + (0.0 if one else push))] - 1, self.upto[piece]
        at = max(at, after) if push > 0 else min(at, after - (1 if self.ways[piece] > 0 else 0) - 1)
        return int(self.lying[min(max(at, 0), self.lying.shape[0] - 1)])

    def newton(self, px: float, py: float, pz: float, k: int, share: float, close: float, steps: int) -> int:
        """The nearest point of parabola k: put down its share, its distance, and how far the way to it goes on.

        As `nearest._newton`.
        """
        p = self.parabolas
        while True:
            x = px - p[0, k] - share * (p[3, k] + share * p[6, k])
            y = py - p[1, k] - share * (p[4, k] + share * p[7, k])
            z = pz - p[2, k] - share * (p[5, k] + share * p[8, k])
            u, v, w = p[3, k] + 2 * share * p[6, k], p[4, k] + 2 * share * p[7, k], p[5, k] + 2 * share * p[8, k]
            square = u * u + v * v + w * w
            size = sqrt(square)
            ahead = (x * u + y * v + z * w) / (size if size > 0 else 1.0)
            outside = (share == 1 and ahead > 0) or (share == 0 and ahead < 0)
            if outside or not abs(ahead) > close or steps == 0:
                self.share, self.gap = share, sqrt(x * x + y * y + z * z)
                self.push = ahead if outside else 0.0
                return 0
            bowed = square - 2 * (x * p[6, k] + y * p[7, k] + z * p[8, k])
            share += ahead * size / (bowed if bowed > square / 4 else square)
            share, steps = min(max(share, 0.0), 1.0), steps - 1

    def down(
        self,
        points: Array,
        expected: Array,
        near: float,
        close: float,
        steps: int,
        hops: int,
        pieces: Ints,
        shares: Array,
        gaps: Array,
    ) -> int:
        """The nearest points that are reached without going away from `points` (3, n): as `Search._down`.

        expected              (n,) mm, the way along the path from where to look
        near, close           `Search.near` and `nearest.CLOSE`
        steps, hops           `nearest.STEPS` and `HOPS`
        pieces, shares, gaps  room for parabolas, shares, and distances (n,) mm
        """
        for row in range(expected.shape[0]):
            x, y, z, piece = points[0, row], points[1, row], points[2, row], self.place(expected[row])
            start = (expected[row] - self.lengths[piece]) / (self.ways[piece] if self.ways[piece] > 0 else 1.0)
            self.newton(x, y, z, piece, min(max(start, 0.0), 1.0), close, steps)
            share, gap, push = self.share, self.gap, self.push
            if gap > near and share == 1 and self.opens[min(piece + 1, self.opens.shape[0] - 1)]:
                push += close
            if gap > near and share == 0 and self.opens[piece]:
                push -= close
            one = False
            for _ in range(hops if self.lying.shape[0] else 0):
                if push == 0:
                    break
                new = self.hop(piece, push, one)
                self.newton(x, y, z, new, 0.0 if push > 0 else 1.0, close, steps)
                if self.gap < gap:
                    piece, share, gap, push, one = new, self.share, self.gap, self.push, False
                elif one:
                    break
                else:
                    one = True
            pieces[row], shares[row], gaps[row] = piece, share, gap
        return 0


# -- limits and bounds ------------------------------------------------------------------------------------------------


def within_limits(
    meant: Array,
    done: Array,
    low: Array,
    high: Array,
    most: Array,
    linear: Array,
    together: float,
    jump: float,
    fuzz: float,
) -> bool:
    """Whether corrected poses, and those of the program (n, axes), come near no limit and are known.

    low, high  of each axis
    most       its largest correction alone
    linear     1 for a linear axis, 0 for others
    together   largest correction of the linear axes together
    jump       largest change of one
    fuzz       how far on a limit is on it
    """
    for row in range(done.shape[0]):
        before, square, change = max(row - 1, 0), 0.0, 0.0
        for axis in range(linear.shape[0]):
            here, there = meant[row, axis], done[row, axis]
            off = there - here
            step = off - (done[before, axis] - meant[before, axis])
            beyond = max(low[axis] - min(here, there), max(here, there) - high[axis])
            if not (beyond <= fuzz and abs(off) <= most[axis]):
                return False
            square, change = square + linear[axis] * off * off, change + linear[axis] * step * step
        if not (square <= together * together and change <= jump * jump):
            return False
    return True


def bounds(
    meant: Array,
    done: Array,
    linear: Array,
    slopes: Array,
    curvatures: Array,
    moved: float,
    turned: float,
    least_arm: float,
    more: float,
    corner: float,
    close: float,
    bound: Array,
) -> int:
    """What the deviation of the tip from pose to pose (n + 1, axes) does not exceed: as `deviation.straight_bounds`.

    linear              1 for a linear axis, 0 for others
    slopes, curvatures  (2, axes) of `bow.Bow`
    moved, turned       its `shift` and `turn`
    least_arm           the arm with all axes at zero, mm
    more, corner        a factor for products of errors, and `deviation.CORNER`
    """
    arm = 0.0
    for axis in range(linear.shape[0]):
        most = 0.0
        for row in range(done.shape[0]):
            most = max(most, abs(done[row, axis]))
        arm += linear[axis] * most
    arm = least_arm + arm
    for row in range(bound.shape[0]):
        way, angle, shifting, turning = 0.0, 0.0, 0.0, 0.0
        second, before, after, change = 0.0, 0.0, 0.0, 0.0
        for axis in range(linear.shape[0]):
            here, there, along = done[row, axis], done[row + 1, axis], linear[axis]
            step, first, last = abs(there - here), here - meant[row, axis], there - meant[row + 1, axis]
            way, angle = way + along * step, angle + (1 - along) * step
            shifting, turning = shifting + step * slopes[0, axis], turning + step * slopes[1, axis]
            second += step * step * (curvatures[0, axis] + arm * curvatures[1, axis])
            before, after = before + along * first * first, after + along * last * last
            change += along * (last - first) * (last - first)
        swing = way + arm * angle
        leaning = shifting + arm * turning + turned * swing
        second += 2 * turning * swing + turned * (2 * way * angle + arm * angle * angle)
        bow = more * (second + 2 * leaning * angle + (moved + arm * turned) * angle * angle) / 8
        most = sqrt(max(before, after))
        bound[row] = bow + corner * (most * angle + 2 * sqrt(change)) * angle / 8 + close
    return 0


# -- figures ----------------------------------------------------------------------------------------------------------


def at_ends(
    start: Array,
    end: Array,
    before_all: Array,
    written: Array,
    first: Ints,
    wanted: Array,
    before: Array,
    features: Array,
    ways: Array,
    columns: Ints,
    linear: Bytes,
    straight: float,
    turned: float,
    density: float,
    most: float,
    shown: Bytes,
    apart: Bytes,
    followed: Bytes,
    sums: Array,
    places: Ints,
    counts: Ints,
) -> int:
    """Add up the errors at the ends of motions; mark in `apart` those at the end of which they are not known.

    start, end                  of the moves (n, axes), as programmed
    before_all, written, first  where the control stood before, commands at the ends of all pieces as written (m, axes),
                                and the first piece of each motion (n + 1,)
    wanted, before              commands at which the tip is where it should be (n, axes), and how far off it is without
                                correction (n,) mm
    features                    ways over which errors bend (axes,)
    ways, columns, linear       the ways of X, Y and Z as columns, their columns, linear axes
    straight, turned            `deviation.STRAIGHT`, `written.TURNED`
    density, most               how many places inside: per bend, at most
    shown, apart, followed      motions that figures are of, those not to be counted here, those to be looked at inside
    sums                        way, squares times way and largest error before and after, mm
    places                      how many ends, and where the largest are
    counts                      at how many places inside each motion has to be looked at (n,)
    """
    for row in range(end.shape[0]):
        if not shown[row] or apart[row]:
            continue
        bends, turns, chord, piece = 0.0, 0.0, 0.0, first[row]
        for axis in range(linear.shape[0]):
            here = written[piece - 1, axis] if piece else before_all[axis]
            step = written[piece, axis] - here
            bends += abs(end[row, axis] - start[row, axis]) / features[axis]
            if linear[axis]:
                chord += step * step
            else:
                turns = max(turns, abs(written[piece, axis] - wanted[row, axis]))
        if turns > turned:
            apart[row] = 1
            continue
        if followed[row] and bends >= straight:
            counts[row] = int(ceil(min(density * bends, most)))  # noqa: RUF046 (in C it is none)
        square = 0.0
        for i in range(3):
            off = 0.0
            for j in range(3):
                off += (written[piece, columns[j]] - wanted[row, columns[j]]) * ways[i, j]
            square += off * off
        way, after = sqrt(chord) / (counts[row] + 1), sqrt(square)
        sums[0] += way
        sums[1] += way * before[row] * before[row]
        sums[2] += way * square
        places[0] += 1
        if before[row] > sums[3]:
            sums[3], places[1] = before[row], row
        if after > sums[4]:
            sums[4], places[2] = after, row
    return 0
