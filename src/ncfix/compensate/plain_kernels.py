"""Parts of plain motions, compiled: what `plain` and `plain_figures` do by columns, in one pass over the motions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.kernel import Library

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Mask = NDArray[np.bool_]

LIBRARY = Library(__file__)


@LIBRARY.helper
def size_of(vectors: Array, row: int, linear: Mask) -> float:
    """The length of a row along linear axes, mm."""
    square = 0.0
    for axis in range(len(linear)):
        if linear[axis]:
            square += vectors[row, axis] * vectors[row, axis]
    return float(np.sqrt(square))


@LIBRARY.helper
def step_of(vectors: Array, row: int, linear: Mask) -> float:
    """How far the next row is from a row along linear axes, mm."""
    square = 0.0
    for axis in range(len(linear)):
        if linear[axis]:
            off = vectors[row + 1, axis] - vectors[row, axis]
            square += off * off
    return float(np.sqrt(square))


@LIBRARY.helper
def is_within(position: float, low: float, high: float, fuzz: float) -> bool:
    """Whether an axis is not beyond its range; not so if its position is not known."""
    return low - position <= fuzz and position - high <= fuzz


@LIBRARY.helper
def corrections_fine(shift: Array, linear: Mask, most: tuple[float, float, float]) -> bool:
    """Whether corrections (n + 1, axes) stay below the largest linear and rotary ones, and do not jump."""
    for row in range(len(shift)):
        for axis in range(len(linear)):
            if not (linear[axis] or abs(shift[row, axis]) <= most[1]):
                return False
        if not size_of(shift, row, linear) <= most[0]:
            return False
        if row + 1 < len(shift) and not step_of(shift, row, linear) <= most[2]:
            return False
    return True


@LIBRARY.kernel(
    "f8[:,:]", "f8[:,:]", "f8[:,:]", ("f8[:]", "f8[:]"), "b1[:]", ("f8", "f8", "f8", "f8"), ("f8[:,:]", "f8[:,:]")
)
def displaced(
    start: Array,
    end: Array,
    shift: Array,
    ranges: tuple[Array, Array],
    linear: Mask,
    limits: tuple[float, float, float, float],
    found: tuple[Array, Array],
) -> int:
    """Where motions (n, axes) really start and end; 0 if they come near a limit, else 1.

    shift   (n + 1, axes) corrections at their starts and ends
    ranges  lowest and highest position of each axis
    limits  largest correction of linear and rotary axes, largest change of one, and how far on a limit is on it
    found   room for starts and ends
    """
    (low, high), (real_start, real_end) = ranges, found
    if not corrections_fine(shift, linear, limits[:3]):
        return 0
    for row in range(len(end)):
        for axis in range(len(linear)):
            meant = end[row, axis]
            done = meant + shift[row + 1, axis]
            real_start[row, axis], real_end[row, axis] = start[row, axis] + shift[row, axis], done
            if not is_within(meant, low[axis], high[axis], limits[3]):
                return 0
            if not is_within(done, low[axis], high[axis], limits[3]):
                return 0
    return 1


@LIBRARY.kernel(
    "f8[:,:]", "f8[:,:]", "f8[:,:]", "b1[:]", ("f8[:,:]", "f8[:,:]"), ("f8", "f8", "f8", "f8", "f8"), "f8", "f8[:]"
)
def bounds(
    start: Array,
    end: Array,
    shift: Array,
    linear: Mask,
    bends: tuple[Array, Array],
    constants: tuple[float, float, float, float, float],
    close: float,
    bound: Array,
) -> None:
    """What the deviation of the tip along corrected motions does not exceed: as `judge.straight_bounds`.

    shift      (n + 1, axes) corrections at their starts and ends
    bends      slopes and curvatures (2, axes) of `bow.Bow`
    constants  its `shift` and `turn`, the largest arm, mm, a factor for products of errors, and `judge.CORNER`
    """
    (slopes, curvatures), (moved, turned, arm, more, corner) = bends, constants
    for row in range(len(end)):
        way, angle, shifting, turning, second = 0.0, 0.0, 0.0, 0.0, 0.0
        for axis in range(len(linear)):
            step = abs(end[row, axis] - start[row, axis])
            way, angle = (way + step, angle) if linear[axis] else (way, angle + step)
            shifting, turning = shifting + step * slopes[0, axis], turning + step * slopes[1, axis]
            second += step * step * (curvatures[0, axis] + arm * curvatures[1, axis])
        swing = way + arm * angle
        first = shifting + arm * turning + turned * swing
        second += 2 * turning * swing + turned * (2 * way * angle + arm * angle * angle)
        bow = more * (second + 2 * first * angle + (moved + arm * turned) * angle * angle) / 8
        size = max(size_of(shift, row, linear), size_of(shift, row + 1, linear))
        bound[row] = bow + corner * (size * angle + 2 * step_of(shift, row, linear)) * angle / 8 + close


@LIBRARY.kernel(
    ("f8[:,:]", "f8[:,:]"),
    ("f8[:]", "f8[:,:]", "i8[:]"),
    ("f8[:,:]", "f8[:]"),
    ("f8[:]", "f8[:,:]", "i8[:]", "b1[:]"),
    ("f8", "f8"),
    ("b1[:]", "b1[:]"),
    ("f8[:]", "i8[:]"),
)
def at_ends(
    moves: tuple[Array, Array],
    text: tuple[Array, Array, Ints],
    known: tuple[Array, Array],
    machine: tuple[Array, Array, Ints, Mask],
    limits: tuple[float, float],
    masks: tuple[Mask, Mask],
    found: tuple[Array, Ints],
) -> None:
    """Add up the errors at the ends of motions that need no look along their way; mark the others in `along`.

    moves    their starts and ends (n, axes), as programmed
    text     where the control stood before, commands at the ends of all pieces as written (m, axes), and the first
             piece of each motion (n + 1,)
    known    commands at which the tip is where it should be (n, axes), and how far off it is without correction (n,) mm
    machine  ways over which errors bend (axes,), the ways of X, Y and Z as columns, their columns, linear axes
    limits   `verify.STRAIGHT` and `known.TURNED`
    masks    motions that figures are of, and those to be looked at along their way
    found    way, squares times way and largest error before and after, mm; how many ends, and where the largest are
    """
    (start, end), (before_all, written, first), (wanted, before) = moves, text, known
    (features, ways, columns, linear), (shown, along), (sums, places) = machine, masks, found
    for row in range(len(end)):
        if not shown[row] or along[row]:
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
        if bends >= limits[0] or turns > limits[1]:
            along[row] = True
            continue
        square = 0.0
        for i in range(3):
            off = 0.0
            for j in range(3):
                off += (written[piece, columns[j]] - wanted[row, columns[j]]) * ways[i, j]
            square += off * off
        way, after = np.sqrt(chord), np.sqrt(square)
        sums[0] += way
        sums[1] += way * before[row] * before[row]
        sums[2] += way * square
        places[0] += 1
        if before[row] > sums[3]:
            sums[3], places[1] = before[row], row
        if after > sums[4]:
            sums[4], places[2] = after, row
