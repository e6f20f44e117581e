"""Newton's method for many poses, as loops: what `kernels` compiles, as `loops` are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ncfix.machine.loops import (
    HANDFUL,
    Array,
    Columns,
    Hand,
    Ints,
    Packed,
    add_up,
    carry,
    laid_out,
    take_up,
    unpacked,
    work_out,
)
from ncfix.machine.steps import SHIFT, TURN, Steps, dot, has_arrived, twice_crossed, volume


class Goal(NamedTuple):
    """Where a handful of tips shall be.

    point   (4, .) mm
    back    (9, .) what takes a gap of the tip to positions of the axes, row after row
    before  (.,) the size of the gap before, mm; -1 if the axes cannot bring the tip there
    """

    point: Array
    back: Array
    before: Array


def aim(
    perfect: Packed,
    route: Packed,
    columns: Columns,
    axes: Ints,
    target: Array,
    limits: Array,
    work: Array,
    out: Array,
) -> None:
    """Newton's method for all poses: as `aim.aimed`, by whole steps.

    axes    the columns of X, Y and Z
    target  (3, n) mm; (3, 0): where a perfect machine has the tip
    limits  when a tip has arrived, mm, which volume of its motions is none, and how many steps there are
    out     (8, n): positions of the axes, gaps at the beginning, mm, largest squared angles of small motions, and
            whether the tip has arrived
    """
    nominal, _ = unpacked(perfect[0], perfect[1])
    steps, functions = unpacked(route[0], route[1])
    hand, spare = laid_out(work, columns, len(functions.order), len(steps.kind))
    goal = Goal(spare[:4], spare[4:13], spare[13])
    close, flat, passes = limits[0], limits[1], limits[2]
    n = columns.q.shape[1]
    for begin in range(0, n, HANDFUL):
        count = min(HANDFUL, n - begin)
        take_up(columns, begin, count, hand)
        left = set_out(nominal, axes, hand, count, target, begin, flat, goal)
        for i in range(3, 8):
            for k in range(count):
                out[i, begin + k] = 0.0
        number = 0
        while left and number < passes:
            work_out(functions, hand, count)
            add_up(functions, hand, count)
            carry(steps, hand, count, hand.tip)
            left -= step_closer(axes, close, number == 0, hand, count, goal, begin, out)
            number += 1
        for i in range(3):
            for k in range(count):
                out[i, begin + k] = hand.q[axes[i], k]


def set_out(
    perfect: Steps, axes: Ints, hand: Hand, count: int, target: Array, begin: int, flat: float, goal: Goal
) -> int:
    """Put down where the tips shall be and how they follow the axes; how many can be brought there at all."""
    if target.shape[1]:
        for i in range(3):
            for k in range(count):
                goal.point[i, k] = target[i, begin + k]
    else:
        carry(perfect, hand, count, goal.point)
    for i in range(3):
        follow(perfect, axes[i], hand, count, goal.back[3 * i : 3 * i + 3])
    left = 0
    for k in range(count):
        a = goal.back[0, k], goal.back[1, k], goal.back[2, k]
        b = goal.back[3, k], goal.back[4, k], goal.back[5, k]
        c = goal.back[6, k], goal.back[7, k], goal.back[8, k]
        whole, p, q, r = volume(a, b, c)
        share = 1 / whole
        for i in range(3):
            goal.back[i, k], goal.back[3 + i, k], goal.back[6 + i, k] = p[i] * share, q[i] * share, r[i] * share
        total = goal.point[0, k] + goal.point[1, k] + goal.point[2, k]
        for i in range(len(hand.q)):
            total += hand.q[i, k]
        possible = np.isfinite(total) and not abs(whole) < flat
        goal.before[k] = 0.0 if possible else -1.0
        left += possible
    return left


def step_closer(
    axes: Ints, close: float, begins: bool, hand: Hand, count: int, goal: Goal, begin: int, out: Array
) -> int:
    """Move the axes against the gaps of the tips; how many have arrived with that."""
    arrived = 0
    for k in range(count):
        at = begin + k
        if goal.before[k] < 0 or out[7, at] > 0:
            continue
        gap = hand.tip[0, k] - goal.point[0, k], hand.tip[1, k] - goal.point[1, k], hand.tip[2, k] - goal.point[2, k]
        if begins:
            out[3, at], out[4, at], out[5, at] = gap
        for i in range(3):
            j = 3 * i
            hand.q[axes[i], k] -= dot((goal.back[j, k], goal.back[j + 1, k], goal.back[j + 2, k]), gap)
        size = np.sqrt(dot(gap, gap))
        out[6, at] = max(out[6, at], hand.tip[3, k])
        if has_arrived(size, goal.before[k], close):
            out[7, at] = 1.0
            arrived += 1
        goal.before[k] = size
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


HELPERS = (set_out, step_closer, follow)
"""Loops that others are made of."""
