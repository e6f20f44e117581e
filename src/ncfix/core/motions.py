# cython: boundscheck=False
"""Loops over blocks and motions: positions, arc angles, splitting, limits, deviation bounds and tip errors.

They repeat the numpy code of `control.lanes`, `compensate.plan` and `compensate.figures` operation by operation, so the
results agree; a test compares them. Each function checks the sizes of its arrays, and indices that it takes from them,
before it uses them.
"""

from __future__ import annotations

from math import atan2, ceil, pi, sqrt
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
    """Follow the k blocks of a stretch: positions, feeds and motion codes, as `block_rows.followed`.

    numbers, first, shapes        numbers of the program; first number and shape of each block (k,)
    slots, feeds, motions, masks  `axes`, `feed`, `motion`, `mask` of `LaneTables`
    position                      (letters,) command before the first block
    unit, feed, motion            unit of F; feed and motion code in force before the first block
    offset, scale, incremental    (letters,) the frame; whether words are increments
    path, feed_of, fed, motion_of, coded, mask  receive the columns of `BlockRows`
    """
    letters, n, known = position.shape[0], first.shape[0], slots.shape[0]
    least = min(shapes.shape[0], path.shape[0] - 1, feed_of.shape[0], fed.shape[0], motion_of.shape[0], coded.shape[0])
    widths = min(slots.shape[1], path.shape[1], offset.shape[0], scale.shape[0])
    if (
        min(least, mask.shape[0]) < n
        or widths < letters
        or min(feeds.shape[0], motions.shape[0], masks.shape[0]) < known
    ):
        raise IndexError("columns of other shapes")
    for letter in range(letters):
        path[0, letter] = position[letter]
    for row in range(n):
        shape, number = shapes[row], first[row]
        if not 0 <= shape < known or number < 0 or number + feeds[shape] >= numbers.shape[0]:
            raise IndexError("there is no such shape or number")
        for letter in range(letters):
            slot = slots[shape, letter]
            if slot < 0:
                path[row + 1, letter] = path[row, letter]
            elif number + slot >= numbers.shape[0]:
                raise IndexError("there is no such number")
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


TURN = 2 * pi


def sweeps(centre: Array, step: Array, clockwise: Bytes, fuzz: float, out: Array) -> int:
    """Signed angles of arcs, rad, as `arcs.sweep_angle`.

    centre, step  (k, 2) centres and ends relative to the starts
    fuzz          `arcs.FUZZ`
    """
    n = out.shape[0]
    if min(centre.shape[0], step.shape[0], clockwise.shape[0]) < n or min(centre.shape[1], step.shape[1]) < 2:
        raise IndexError("columns of other shapes")
    for row in range(n):
        begin = atan2(-centre[row, 1], -centre[row, 0])
        end = atan2(step[row, 1] - centre[row, 1], step[row, 0] - centre[row, 0])
        angle = begin - end if clockwise[row] else end - begin
        while angle < fuzz:
            angle += TURN
        if angle > TURN + fuzz:
            angle -= TURN
        out[row] = -angle if clockwise[row] else angle
    return 0


# -- pieces of motions ------------------------------------------------------------------------------------------------


def deviation(fraction: Array, command: Array, follow: Array, a: int, b: int) -> float:
    """Largest deviation of the straight piece from node a to node b, mm, as `PathNodes.deviations`."""
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
    """Split motions into the fewest pieces within `tolerance`, mm, as `splitting.fewest`.

    stretch  `splitting.STRETCH`
    ends     all 0; receives 1 for each node at which a piece ends
    worst    receives the largest deviation of the pieces of each motion, mm
    """
    nodes = min(fraction.shape[0], command.shape[0], ends.shape[0])
    if follow.shape[0] > 1:
        nodes = min(nodes, follow.shape[0])
    if follow.shape[0] < 1 or follow.shape[2] < command.shape[1] or worst.shape[0] < counts.shape[0]:
        raise IndexError("columns of other shapes")
    first = 0
    for motion in range(counts.shape[0]):
        if counts[motion] < 0 or first + counts[motion] > nodes:
            raise IndexError("there are no such nodes")
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
    """Whether programmed and corrected poses (n, axes) are known and within all limits.

    low, high  (axes,) travel
    most       (axes,) largest correction of each axis
    linear     (axes,) 1 for a linear axis, 0 for a rotary one
    together   largest length of the correction of all linear axes, mm
    jump       largest change of that correction from one pose to the next, mm
    fuzz       how far beyond a travel limit still counts as within
    """
    axes = linear.shape[0]
    if meant.shape[0] < done.shape[0] or min(meant.shape[1], done.shape[1]) < axes:
        raise IndexError("columns of other shapes")
    if min(low.shape[0], high.shape[0], most.shape[0]) < axes:
        raise IndexError("columns of other shapes")
    for row in range(done.shape[0]):
        before, square, change = max(row - 1, 0), 0.0, 0.0
        for axis in range(axes):
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
    """Upper bounds of the deviation of the tip along straight motions, mm, as `deviation.straight_bounds`.

    meant, done         (n + 1, axes) programmed and corrected poses between the motions
    linear              (axes,) 1 for a linear axis, 0 for a rotary one
    slopes, curvatures  (2, axes) those of `DeviationBounds`
    moved, turned       its `shift` and `turn`
    least_arm           lever arm with all axes at zero, mm
    more, corner        `error_model.MORE`, a factor for products of errors, and `deviation.CORNER`
    close               `aim.CLOSE`, mm
    bound               (n,) receives the bounds
    """
    axes, arm = linear.shape[0], 0.0
    if min(meant.shape[0], done.shape[0]) <= bound.shape[0] or min(meant.shape[1], done.shape[1]) < axes:
        raise IndexError("columns of other shapes")
    if min(slopes.shape[0], curvatures.shape[0]) < 2 or min(slopes.shape[1], curvatures.shape[1]) < axes:
        raise IndexError("columns of other shapes")
    for axis in range(axes):
        most = 0.0
        for row in range(done.shape[0]):
            most = max(most, abs(done[row, axis]))
        arm += linear[axis] * most
    arm = least_arm + arm
    for row in range(bound.shape[0]):
        way, angle, shifting, turning = 0.0, 0.0, 0.0, 0.0
        second, before, after, change = 0.0, 0.0, 0.0, 0.0
        for axis in range(axes):
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
    """Sum up the tip errors at the ends of motions; `apart` receives 1 where they are not known here.

    start, end                  (n, axes) programmed commands
    before_all, written, first  command before the first motion; written commands at the ends of all pieces (m, axes);
                                first piece of each motion (n + 1,)
    wanted, before              (n, axes) commands at which the tip is at its goal; (n,) mm, tip error uncorrected
    features                    (axes,) distances over which the errors bend
    ways, columns, linear       (3, 3) derivatives of the tip by X Y Z as columns; columns of X Y Z; linear axes
    straight, turned            `deviation.STRAIGHT`, `written.TURNED`
    density, most               samples per bend inside a motion, and the largest number of them
    shown, apart, followed      (n,) motions with figures; motions counted elsewhere; motions to be sampled inside
    sums                        receives path length, mm, the sums of squares times length and the largest error, before
                                and after the correction
    places                      receives the number of ends, and the motions with the largest errors
    counts                      (n,) receives the number of samples inside each motion
    """
    n, axes, pieces = end.shape[0], linear.shape[0], written.shape[0]
    rows = min(start.shape[0], wanted.shape[0], first.shape[0] - 1, before.shape[0], shown.shape[0], apart.shape[0])
    widths = min(
        start.shape[1], end.shape[1], written.shape[1], wanted.shape[1], before_all.shape[0], features.shape[0]
    )
    right = min(rows, followed.shape[0], counts.shape[0]) >= n and widths >= axes and columns.shape[0] >= 3
    right = right and min(ways.shape[0], ways.shape[1]) >= 3 and sums.shape[0] >= 5 and places.shape[0] >= 3
    for i in range(3 if right else 0):
        right = right and 0 <= columns[i] < axes
    if not right:
        raise IndexError("columns of other shapes")
    for row in range(n):
        if not shown[row] or apart[row]:
            continue
        if not 0 <= first[row] < pieces:
            raise IndexError("there is no such piece")
        bends, turns, chord, piece = 0.0, 0.0, 0.0, first[row]
        for axis in range(axes):
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
