"""Parts of plain motions, compiled: what `plain` and `plain_figures` do by columns, in one pass over the motions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.kernel import Library

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Mask = NDArray[np.bool_]

LIBRARY = Library(__name__)


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
