"""Loops over motions and points, compiled: one after the other instead of all at once.

They do what their plain forms do, operation by operation, so that the results are the same; a test holds them together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ncfix.kernel import Library

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Mask = NDArray[np.bool_]

LIBRARY = Library(__name__)


@LIBRARY.helper
def deviation(fraction: Array, command: Array, follow: Array, a: int, b: int) -> float:
    """The largest deviation of the straight piece from node a to node b: as `PathNodes.deviations`."""
    most = 0.0
    for node in range(a + 1, b):
        seen = node if len(follow) > 1 else 0
        share = (fraction[node] - fraction[a]) / (fraction[b] - fraction[a])
        square = 0.0
        for i in range(follow.shape[1]):
            off = 0.0
            for j in range(command.shape[1]):
                here = command[a, j] + share * (command[b, j] - command[a, j])
                off += follow[seen, i, j] * (here - command[node, j])
            square += off * off
        most = max(most, np.sqrt(square))
    return most


@LIBRARY.kernel("i8[:]", "f8[:]", "f8[:,:]", "f8[:,:,:]", ("f8", "i8"), "b1[:]", "f8[:]")
def fewest(
    counts: Ints, fraction: Array, command: Array, follow: Array, limits: tuple[float, int], ends: Mask, worst: Array
) -> None:
    """Mark in `ends`, all False, which nodes end a piece; put down the largest deviation of each motion's pieces.

    limits  tolerance, mm, and `splitting.STRETCH`

    As `splitting.fewest`.
    """
    first, (tolerance, stretch) = 0, limits
    for motion in range(len(counts)):
        at, last, usual = first, first + counts[motion] - 1, 1
        stop = at
        while at < last:
            if at == stop:
                stop, usual = at + stretch if last - at >= 2 * stretch else last, 1
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
            ends[near] = True
            worst[motion] = max(worst[motion], reached)
            usual, at = max(near - at - 1, 1), near
        first += counts[motion]


class CurveColumns(NamedTuple):
    """What a `Curve` calls by the same names."""

    parabolas: Array
    lengths: Array
    ways: Array
    opens: Mask
    upto: Ints
    lying: Ints


@LIBRARY.helper
def place(lengths: Array, way: float) -> int:
    """The parabola in which a way ends: as `Curve.place`."""
    low, high = 0, len(lengths)
    while low < high:
        middle = (low + high) // 2
        if lengths[middle] <= way:
            low = middle + 1
        else:
            high = middle
    return max(low - 1, 0)


@LIBRARY.helper
def hop(path: CurveColumns, piece: int, push: float, one: bool) -> int:
    """Where to look next: as `Search._hop`."""
    end = path.lengths[piece] + (path.ways[piece] if push > 0 else 0.0)
    at, after = path.upto[place(path.lengths, end + (0.0 if one else push))] - 1, path.upto[piece]
    at = max(at, after) if push > 0 else min(at, after - (1 if path.ways[piece] > 0 else 0) - 1)
    return int(path.lying[min(max(at, 0), len(path.lying) - 1)])


@LIBRARY.helper
def newton(
    p: Array, point: tuple[float, float, float], k: int, share: float, close: float, steps: int
) -> tuple[float, float, float]:
    """The nearest point of parabola k of `p`: its share, its distance, and how far the way to it goes on.

    As `nearest._newton`.
    """
    while True:
        x = point[0] - p[0, k] - share * (p[3, k] + share * p[6, k])
        y = point[1] - p[1, k] - share * (p[4, k] + share * p[7, k])
        z = point[2] - p[2, k] - share * (p[5, k] + share * p[8, k])
        u, v, w = p[3, k] + 2 * share * p[6, k], p[4, k] + 2 * share * p[7, k], p[5, k] + 2 * share * p[8, k]
        square = u * u + v * v + w * w
        size = np.sqrt(square)
        ahead = (x * u + y * v + z * w) / (size if size > 0 else 1.0)
        outside = (share == 1 and ahead > 0) or (share == 0 and ahead < 0)
        if outside or not abs(ahead) > close or steps == 0:
            return share, np.sqrt(x * x + y * y + z * z), ahead if outside else 0.0
        bowed = square - 2 * (x * p[6, k] + y * p[7, k] + z * p[8, k])
        share += ahead * size / (bowed if bowed > square / 4 else square)
        share, steps = min(max(share, 0.0), 1.0), steps - 1


@LIBRARY.kernel(
    "f8[:,:]",
    "f8[:]",
    (CurveColumns, "f8[:,:]", "f8[:]", "f8[:]", "b1[:]", "i8[:]", "i8[:]"),
    ("f8", "f8"),
    ("i8", "i8"),
    ("i8[:]", "f8[:]", "f8[:]"),
)
def down(
    points: Array,
    expected: Array,
    path: CurveColumns,
    limits: tuple[float, float],
    most: tuple[int, int],
    found: tuple[Ints, Array, Array],
) -> None:
    """The nearest points that are reached without going away from `points` (3, n): as `Search._down`.

    expected  (n,) mm, the way along the path from where to look
    limits    `Search.near` and `nearest.CLOSE`
    most      `nearest.STEPS` and `HOPS`
    found     parabolas, shares, and distances (n,) mm
    """
    (near, close), (steps, hops), (pieces, shares, gaps) = limits, most, found
    for row in range(len(expected)):
        point, piece = (points[0, row], points[1, row], points[2, row]), place(path.lengths, expected[row])
        share = (expected[row] - path.lengths[piece]) / (path.ways[piece] if path.ways[piece] > 0 else 1.0)
        share, gap, push = newton(path.parabolas, point, piece, min(max(share, 0.0), 1.0), close, steps)
        if gap > near and share == 1 and path.opens[min(piece + 1, len(path.opens) - 1)]:
            push += close
        if gap > near and share == 0 and path.opens[piece]:
            push -= close
        one = False
        for _ in range(hops if len(path.lying) else 0):
            if push == 0:
                break
            new = hop(path, piece, push, one)
            tried, way, further = newton(path.parabolas, point, new, 0.0 if push > 0 else 1.0, close, steps)
            if way < gap:
                piece, share, gap, push, one = new, tried, way, further, False
            elif one:
                break
            else:
                one = True
        pieces[row], shares[row], gaps[row] = piece, share, gap


@LIBRARY.kernel("f8[:,:]", "f8[:,:]", ("f8[:]", "f8[:]", "f8[:]", "f8[:]"), ("f8", "f8", "f8"))
def within_limits(
    meant: Array, done: Array, axes: tuple[Array, Array, Array, Array], limits: tuple[float, float, float]
) -> int:
    """1 if corrected poses, and those of the program (n, axes), come near no limit and are known, else 0.

    axes    lowest and highest position of each, its largest correction alone, and 1 for a linear axis, 0 for others
    limits  largest correction of the linear axes together, largest change of one, and how far on a limit is on it
    """
    low, high, most, linear = axes
    together, jump, fuzz = limits
    for row in range(len(done)):
        before, square, change = max(row - 1, 0), 0.0, 0.0
        for axis in range(len(linear)):
            here, there = meant[row, axis], done[row, axis]
            off = there - here
            step = off - (done[before, axis] - meant[before, axis])
            beyond = max(low[axis] - min(here, there), max(here, there) - high[axis])
            if not (beyond <= fuzz and abs(off) <= most[axis]):
                return 0
            square, change = square + linear[axis] * off * off, change + linear[axis] * step * step
        if not (square <= together * together and change <= jump * jump):
            return 0
    return 1


@LIBRARY.helper
def reached(done: Array, linear: Array) -> float:
    """What the largest ways of all linear axes from zero add up to, mm."""
    total = 0.0
    for axis in range(len(linear)):
        most = 0.0
        for row in range(len(done)):
            most = max(most, abs(done[row, axis]))
        total += linear[axis] * most
    return total


@LIBRARY.kernel("f8[:,:]", "f8[:,:]", "f8[:]", ("f8[:,:]", "f8[:,:]"), ("f8", "f8", "f8", "f8", "f8"), "f8", "f8[:]")
def bounds(
    meant: Array,
    done: Array,
    linear: Array,
    bends: tuple[Array, Array],
    constants: tuple[float, float, float, float, float],
    close: float,
    bound: Array,
) -> None:
    """What the deviation of the tip from pose to pose (n + 1, axes) does not exceed: as `deviation.straight_bounds`.

    linear     1 for a linear axis, 0 for others
    bends      slopes and curvatures (2, axes) of `bow.Bow`
    constants  its `shift` and `turn`, the arm with all axes at zero, mm, a factor for products of errors, and
               `deviation.CORNER`
    """
    (slopes, curvatures), (moved, turned, least_arm, more, corner) = bends, constants
    arm = least_arm + reached(done, linear)
    for row in range(len(bound)):
        way, angle, shifting, turning, second, before, after, change = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for axis in range(len(linear)):
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
        most = np.sqrt(max(before, after))
        bound[row] = bow + corner * (most * angle + 2 * np.sqrt(change)) * angle / 8 + close


@LIBRARY.kernel(
    ("f8[:,:]", "f8[:,:]"),
    ("f8[:]", "f8[:,:]", "i8[:]"),
    ("f8[:,:]", "f8[:]"),
    ("f8[:]", "f8[:,:]", "i8[:]", "b1[:]"),
    ("f8", "f8", "f8", "f8"),
    ("b1[:]", "b1[:]", "b1[:]"),
    ("f8[:]", "i8[:]", "i8[:]"),
)
def at_ends(
    moves: tuple[Array, Array],
    text: tuple[Array, Array, Ints],
    known: tuple[Array, Array],
    machine: tuple[Array, Array, Ints, Mask],
    limits: tuple[float, float, float, float],
    masks: tuple[Mask, Mask, Mask],
    found: tuple[Array, Ints, Ints],
) -> None:
    """Add up the errors at the ends of motions; mark in `apart` those at the end of which they are not known.

    moves    their starts and ends (n, axes), as programmed
    text     where the control stood before, commands at the ends of all pieces as written (m, axes), and the first
             piece of each motion (n + 1,)
    known    commands at which the tip is where it should be (n, axes), and how far off it is without correction (n,) mm
    machine  ways over which errors bend (axes,), the ways of X, Y and Z as columns, their columns, linear axes
    limits   `deviation.STRAIGHT`, `written.TURNED`, and how many places inside: per bend, at most
    masks    motions that figures are of, those not to be counted here (`apart`), and those to be looked at inside
    found    way, squares times way and largest error before and after, mm; how many ends, and where the largest are;
             at how many places inside each motion has to be looked at (n,)
    """
    (start, end), (before_all, written, first), (wanted, before) = moves, text, known
    (features, ways, columns, linear), (shown, apart, followed), (sums, places, counts) = machine, masks, found
    straight, turned, density, most = limits
    for row in range(len(end)):
        if not shown[row] or apart[row]:
            continue
        bends, turns, chord, piece = 0.0, 0.0, 0.0, first[row]
        for axis in range(len(linear)):
            here = written[piece - 1, axis] if piece else before_all[axis]
            step = written[piece, axis] - here
            bends += abs(end[row, axis] - start[row, axis]) / features[axis]
            if linear[axis]:
                chord += step * step
            else:
                turns = max(turns, abs(written[piece, axis] - wanted[row, axis]))
        if turns > turned:
            apart[row] = True
            continue
        if followed[row] and bends >= straight:
            counts[row] = int(min(np.ceil(density * bends), most))
        square = 0.0
        for i in range(3):
            off = 0.0
            for j in range(3):
                off += (written[piece, columns[j]] - wanted[row, columns[j]]) * ways[i, j]
            square += off * off
        way, after = np.sqrt(chord) / (counts[row] + 1), np.sqrt(square)
        sums[0] += way
        sums[1] += way * before[row] * before[row]
        sums[2] += way * square
        places[0] += 1
        if before[row] > sums[3]:
            sums[3], places[1] = before[row], row
        if after > sums[4]:
            sums[4], places[2] = after, row
