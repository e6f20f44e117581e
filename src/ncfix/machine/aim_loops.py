"""Linear axes that bring the tip to a point, for many poses, as loops: what `kernels` compiles, as `loops` are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ncfix.machine.loops import (
    HANDFUL,
    Array,
    Hand,
    Ints,
    Packed,
    PoseColumns,
    add_up,
    carry,
    laid_out,
    set_goal,
    set_off,
    take_up,
    unpacked,
    work_out,
)
from ncfix.machine.steps import PARTS, SHIFT, TURN, Steps, dot, has_arrived, turned, twice_crossed, volume


class Goal(NamedTuple):
    """Where a handful of tips shall be.

    point   (4, .) mm, after the steps that change with the linear axes; and the largest squared angle behind them
    back    (9, .) what takes a gap of the tip to positions of the axes, row after row
    before  (.,) the size of the gap before, mm; -1 if the axes cannot bring the tip there
    """

    point: Array
    back: Array
    before: Array


def aim(
    perfect: Packed,
    within: Packed,
    behind: Packed,
    columns: PoseColumns,
    axes: Ints,
    target: Array,
    limits: Array,
    work: Array,
    out: Array,
) -> None:
    """Newton's method for all poses: as `aim.aimed`, by whole steps.

    within, behind  the two of `route.SplitRoute`; the other functions in `columns` are of the second, then of the first
    axes            the columns of X, Y and Z
    target          (3, n) mm; (3, 0): where a perfect machine has the tip
    limits          when a tip has arrived, mm, which volume of its motions is none, and how many steps there are
    out             (6, n): positions of the axes, how far off the tip is at the beginning, mm, largest squared angles
                    of small motions, and whether the tip has arrived
    """
    nominal, _ = unpacked(perfect[0], perfect[1])
    steps, functions = unpacked(within[0], within[1])
    undone, more = unpacked(behind[0], behind[1])
    small = len(steps.kind) + len(undone.kind)
    hand, spare = laid_out(work, columns, max(len(functions.order), len(more.order)), small)
    ahead = with_values_from(hand, PARTS * len(steps.kind))
    goal = Goal(spare[:4], spare[4:13], spare[13])
    close, flat, passes = limits[0], limits[1], limits[2]
    n = columns.q.shape[1]
    for begin in range(0, n, HANDFUL):
        count = min(HANDFUL, n - begin)
        take_up(columns, begin, count, hand)
        set_goal(nominal, hand, count, target, begin, goal.point)
        used = work_out(more, hand, count, 0)
        add_up(more, ahead, count)
        carry(undone, ahead, count, goal.point)
        left = set_out(steps, axes, hand, count, flat, goal)
        for k in range(count):
            at = np.uint64(begin + k)
            out[3, at], out[4, at], out[5, at] = 0.0, goal.point[3, k], 0.0
        number = 0
        while left and number < passes:
            work_out(functions, hand, count, used)
            add_up(functions, hand, count)
            set_off(steps, hand, count, hand.tip)
            carry(steps, hand, count, hand.tip)
            left -= step_closer(axes, close, number == 0, hand, count, goal, begin, out)
            number += 1
        for i in range(3):
            for k in range(count):
                out[i, np.uint64(begin + k)] = hand.q[axes[i], k]


def with_values_from(hand: Hand, row: int) -> Hand:
    """The same poses, with small motions of their own: those of another route must not be found there."""
    return Hand(hand.q, hand.sine, hand.versine, hand.others, hand.length, hand.found, hand.values[row:], hand.tip)


def set_out(steps: Steps, axes: Ints, hand: Hand, count: int, flat: float, goal: Goal) -> int:
    """Put down how the tips follow the axes; how many can be brought to their goals at all."""
    for i in range(3):
        follow(steps, axes[i], hand, count, goal.back[3 * i : 3 * i + 3])
    whole, total, left = hand.tip[0], hand.tip[1], 0
    for k in range(count):
        a = goal.back[0, k], goal.back[1, k], goal.back[2, k]
        b = goal.back[3, k], goal.back[4, k], goal.back[5, k]
        c = goal.back[6, k], goal.back[7, k], goal.back[8, k]
        whole[k], p, q, r = volume(a, b, c)
        share = 1 / whole[k]
        goal.back[0, k], goal.back[1, k], goal.back[2, k] = p[0] * share, p[1] * share, p[2] * share
        goal.back[3, k], goal.back[4, k], goal.back[5, k] = q[0] * share, q[1] * share, q[2] * share
        goal.back[6, k], goal.back[7, k], goal.back[8, k] = r[0] * share, r[1] * share, r[2] * share
        total[k] = goal.point[0, k] + goal.point[1, k] + goal.point[2, k]
    for i in range(len(hand.q)):
        for k in range(count):
            total[k] = total[k] + hand.q[i, k]
    for k in range(count):
        possible = abs(total[k]) < np.inf and not abs(whole[k]) < flat
        goal.before[k] = 0.0 if possible else -1.0
        left += possible
    return left


def step_closer(
    axes: Ints, close: float, begins: bool, hand: Hand, count: int, goal: Goal, begin: int, out: Array
) -> int:
    """Move the axes against the gaps of the tips; how many have arrived with that."""
    gap, arrived = hand.tip, 0
    for i in range(3):
        for k in range(count):
            gap[i, k] = gap[i, k] - goal.point[i, k]
    for i in range(3):
        q, row = hand.q[axes[i]], goal.back[3 * i : 3 * i + 3]
        for k in range(count):
            step = dot((row[0, k], row[1, k], row[2, k]), (gap[0, k], gap[1, k], gap[2, k]))
            q[k] = q[k] - step if goal.before[k] >= 0 and out[5, np.uint64(begin + k)] == 0 else q[k]
    for k in range(count):
        at, before = np.uint64(begin + k), goal.before[k]
        size = np.sqrt(dot((gap[0, k], gap[1, k], gap[2, k]), (gap[0, k], gap[1, k], gap[2, k])))
        active = before >= 0 and out[5, at] == 0
        out[3, at] = size if begins and active else out[3, at]
        out[4, at] = max(out[4, at], gap[3, k]) if active else out[4, at]
        there = active and has_arrived(size, before, close)
        out[5, at] = 1.0 if there else out[5, at]
        goal.before[k] = size if active else before
        arrived += there
    return arrived


def follow(steps: Steps, column: int, hand: Hand, count: int, way: Array) -> None:
    """How the tips of a handful follow a linear axis, (3, .) mm per mm: as `steps.follows`."""
    found, d = False, steps.direction
    for i in range(len(steps.kind)):
        axis, j = steps.axis[i], 3 * i
        dx, dy, dz = d[j], d[j + 1], d[j + 2]
        if steps.kind[i] == SHIFT and axis == column:
            found = True
            for k in range(count):
                way[0, k], way[1, k], way[2, k] = dx, dy, dz
        elif steps.kind[i] == TURN and found:
            for k in range(count):
                x, y, z = way[0, k], way[1, k], way[2, k]
                ex, ey, ez = twice_crossed(dx, dy, dz, hand.sine[axis, k], hand.versine[axis, k], x, y, z)
                way[0, k], way[1, k], way[2, k] = x + ex, y + ey, z + ez


def placed(
    perfect: Packed, columns: PoseColumns, axes: Ints, ways_back: Array, target: Array, work: Array, out: Array
) -> None:
    """Where linear axes have to be for all tips to be at `target` (3, n) mm, out (3, n): as `Route.placed`.

    axes       the columns of X, Y and Z; no rotary axis stands between them
    ways_back  (3, 3) what takes a way of the tip to one of the axes
    """
    steps, functions = unpacked(perfect[0], perfect[1])
    hand, spare = laid_out(work, columns, len(functions.order), len(steps.kind))
    first, point, n = first_of(steps, axes), spare[:3], columns.q.shape[1]
    before = Steps(
        steps.start,
        steps.kind[:first],
        steps.axis,
        steps.direction,
        steps.point,
        steps.center,
        steps.small,
        steps.rotates,
        steps.screws,
    )
    for begin in range(0, n, HANDFUL):
        count = min(HANDFUL, n - begin)
        take_up(columns, begin, count, hand)
        set_off(before, hand, count, hand.tip)
        carry(before, hand, count, hand.tip)
        for i in range(3):
            for k in range(count):
                point[i, k] = target[i, np.uint64(begin + k)]
        bring_back(steps, first, axes, hand, count, point)
        for i in range(3):
            a, b, c = ways_back[i, 0], ways_back[i, 1], ways_back[i, 2]
            for k in range(count):
                way = point[0, k] - hand.tip[0, k], point[1, k] - hand.tip[1, k], point[2, k] - hand.tip[2, k]
                out[i, np.uint64(begin + k)] = dot((a, b, c), way)


def first_of(steps: Steps, axes: Ints) -> int:
    """The first step along one of these axes."""
    for i in range(len(steps.kind)):
        if steps.kind[i] == SHIFT and is_one_of(steps.axis[i], axes):
            return i
    return len(steps.kind)


def is_one_of(axis: int, axes: Ints) -> bool:
    """Whether a column is that of X, Y or Z."""
    return bool(axis == axes[0] or axis == axes[1] or axis == axes[2])


def bring_back(steps: Steps, first: int, axes: Ints, hand: Hand, count: int, point: Array) -> None:
    """Bring points (3, .) back before the steps from the first one on, but for those along X, Y and Z."""
    d, p = steps.direction, steps.point
    for i in range(len(steps.kind) - 1, first - 1, -1):
        axis, j = steps.axis[i], 3 * i
        dx, dy, dz, px, py, pz = d[j], d[j + 1], d[j + 2], p[j], p[j + 1], p[j + 2]
        if steps.kind[i] == TURN:
            for k in range(count):
                turn = -hand.sine[axis, k], hand.versine[axis, k]
                point[0, k], point[1, k], point[2, k] = turned(
                    point[0, k], point[1, k], point[2, k], dx, dy, dz, px, py, pz, turn[0], turn[1]
                )
        elif not is_one_of(axis, axes):
            for k in range(count):
                way = hand.q[axis, k]
                point[0, k], point[1, k] = point[0, k] - dx * way, point[1, k] - dy * way
                point[2, k] = point[2, k] - dz * way


HELPERS = (with_values_from, set_out, step_closer, follow, first_of, is_one_of, bring_back)
"""Loops that others are made of."""
