"""The steps of a route for many poses, as loops: what `kernels` compiles. They are not meant to be run as they are.

Room for results and for what is worked out on the way is made before: so nothing has to be kept account of inside.

Poses are taken by the handful, so that what is worked out for them stays in the processor's cache, and so that sums
are loops over poses, which a compiler turns into vector instructions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ncfix.machine.steps import (
    GIVEN,
    PARTS,
    POWERS,
    Functions,
    Steps,
    carried,
    dot,
    follows,
    has_arrived,
    held_signal,
    next_wave,
    volume,
)

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

Packed = tuple[Ints, Array]

HANDFUL = 64


class Columns(NamedTuple):
    """Poses in columns: positions (n_axes, n), sines and versines, other functions, tool lengths (n,) or (1,)."""

    q: Array
    sine: Array
    versine: Array
    others: Array
    length: Array


class Hand(NamedTuple):
    """A handful of poses, in columns, and room for what is worked out for them.

    q              (n_axes, .) positions
    sine, versine  (k, .) of rotary axes
    others         functions that come from elsewhere
    found, values  the functions, and the numbers of the small motions
    """

    q: Array
    sine: Array
    versine: Array
    others: Array
    found: Array
    values: Array


class Pose(NamedTuple):
    """One pose of them."""

    q: Array
    sine: Array
    versine: Array
    values: Array


class Goal(NamedTuple):
    """Where a handful of tips shall be.

    point   (3, .) mm
    back    (9, .) what takes a gap of the tip to positions of the axes, row after row
    before  (.,) the size of the gap before, mm; -1 if the axes cannot bring the tip there
    """

    point: Array
    back: Array
    before: Array


def packed(steps: Steps, functions: Functions) -> Packed:
    """All numbers of a route in two arrays: it takes a while to hand over an array to a compiled function."""
    sizes = len(steps.kind), len(functions.family), len(functions.order), len(functions.part)
    ints = [steps.kind, steps.axis, steps.small, steps.rotates, steps.screws]
    ints += [functions.family, functions.axis, functions.first, functions.order, functions.part, functions.function]
    reals = (steps.start, steps.direction, steps.point, steps.center, functions.signal, functions.gain)
    return np.concatenate([sizes, *ints]).astype(np.int64), np.concatenate(reals)


def unpacked(ints: Ints, reals: Array) -> tuple[Steps, Functions]:
    """The route that was packed so."""
    m, g, f, t = ints[0], ints[1], ints[2], ints[3]
    of_steps, of_groups = ints[4 : 4 + 5 * m], ints[4 + 5 * m :]
    of_functions, rest = of_groups[3 * g + 1 :], reals[6 + 9 * m :]
    steps = Steps(
        reals[:6],
        of_steps[:m],
        of_steps[m : 2 * m],
        reals[6 : 6 + 3 * m],
        reals[6 + 3 * m : 6 + 6 * m],
        reals[6 + 6 * m : 6 + 9 * m],
        of_steps[2 * m : 3 * m],
        of_steps[3 * m : 4 * m],
        of_steps[4 * m :],
    )
    functions = Functions(
        of_groups[:g],
        of_groups[g : 2 * g],
        rest[: 5 * g],
        of_groups[2 * g : 3 * g + 1],
        of_functions[:f],
        of_functions[f : f + t],
        of_functions[f + t : f + 2 * t],
        rest[5 * g : 5 * g + t],
    )
    return steps, functions


def room(route: Packed, columns: Columns) -> Array:
    """Room for a handful of poses, and for where their tips shall be, as `laid_out` divides it."""
    m, f = int(route[0][0]), int(route[0][2])
    rows = len(columns.q) + 2 * len(columns.sine) + len(columns.others) + f + PARTS * m
    return np.zeros((rows + 13, HANDFUL))


def laid_out(work: Array, columns: Columns, f: int, m: int) -> tuple[Hand, Goal]:
    """The parts of the room."""
    axes, sines, others = len(columns.q), len(columns.sine), len(columns.others)
    a = axes + 2 * sines
    b = a + others + f
    c = b + PARTS * m
    hand = Hand(
        work[:axes],
        work[axes : axes + sines],
        work[axes + sines : a],
        work[a : a + others],
        work[a + others : b],
        work[b:c],
    )
    return hand, Goal(work[c : c + 3], work[c + 3 : c + 12], work[c + 12])


def tips(ints: Ints, reals: Array, columns: Columns, work: Array, out: Array) -> None:
    """The tips of all poses: out (4, n) are x, y, z in mm, and the largest squared angle of a small motion."""
    steps, functions = unpacked(ints, reals)
    hand, _ = laid_out(work, columns, len(functions.order), len(steps.kind))
    n = columns.q.shape[1]
    for begin in range(0, n, HANDFUL):
        count = min(HANDFUL, n - begin)
        take_up(columns, begin, count, hand)
        work_out(functions, hand, count)
        add_up(functions, hand, count)
        for k in range(count):
            at, length = begin + k, tool(columns, begin + k)
            turns = hand.sine[:, k], hand.versine[:, k]
            x, y, z, most = carried(steps, hand.values[:, k], length, hand.q[:, k], turns[0], turns[1], 0.0)
            out[0, at], out[1, at], out[2, at], out[3, at] = x, y, z, most


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
    hand, goal = laid_out(work, columns, len(functions.order), len(steps.kind))
    close, flat, passes = limits[0], limits[1], limits[2]
    n = columns.q.shape[1]
    for begin in range(0, n, HANDFUL):
        count = min(HANDFUL, n - begin)
        take_up(columns, begin, count, hand)
        left = 0
        for k in range(count):
            pose = Pose(hand.q[:, k], hand.sine[:, k], hand.versine[:, k], hand.values[:, k])
            out[6, begin + k], out[7, begin + k] = 0.0, 0.0
            left += set_out(nominal, axes, pose, tool(columns, begin + k), target, begin + k, flat, goal, k)
            if goal.before[k] < 0:
                out[3, begin + k], out[4, begin + k], out[5, begin + k] = 0.0, 0.0, 0.0
        number = 0
        while left and number < passes:
            work_out(functions, hand, count)
            add_up(functions, hand, count)
            for k in range(count):
                at, length = begin + k, tool(columns, begin + k)
                if goal.before[k] >= 0 and out[7, at] == 0.0:
                    turns = hand.sine[:, k], hand.versine[:, k]
                    x, y, z, most = carried(steps, hand.values[:, k], length, hand.q[:, k], turns[0], turns[1], 0.0)
                    gap = x - goal.point[0, k], y - goal.point[1, k], z - goal.point[2, k]
                    if number == 0:
                        out[3, at], out[4, at], out[5, at] = gap
                    out[6, at] = max(out[6, at], most)
                    out[7, at] = step_closer(axes, gap, close, goal, k, hand)
                    left -= out[7, at] > 0
            number += 1
        for i in range(3):
            for k in range(count):
                out[i, begin + k] = hand.q[axes[i], k]


def set_out(
    perfect: Steps, axes: Ints, pose: Pose, length: float, target: Array, at: int, flat: float, goal: Goal, k: int
) -> bool:
    """Put down where the tip shall be and how it follows the axes; whether it can be brought there at all."""
    if target.shape[1]:
        x, y, z = target[0, at], target[1, at], target[2, at]
    else:
        x, y, z, _ = carried(perfect, pose.values, length, pose.q, pose.sine, pose.versine, 0.0)
    goal.point[0, k], goal.point[1, k], goal.point[2, k] = x, y, z
    a = follows(perfect, axes[0], pose.sine, pose.versine)
    b = follows(perfect, axes[1], pose.sine, pose.versine)
    c = follows(perfect, axes[2], pose.sine, pose.versine)
    whole, p, q, r = volume(a, b, c)
    share = 1 / whole
    for i in range(3):
        goal.back[i, k], goal.back[3 + i, k], goal.back[6 + i, k] = p[i] * share, q[i] * share, r[i] * share
    total = x + y + z
    for i in range(len(pose.q)):
        total += pose.q[i]
    possible = np.isfinite(total) and not abs(whole) < flat
    goal.before[k] = 0.0 if possible else -1.0
    return possible


def step_closer(axes: Ints, gap: tuple[float, float, float], close: float, goal: Goal, k: int, hand: Hand) -> bool:
    """Move the axes against a gap; whether the tip has arrived with that."""
    for i in range(3):
        j = 3 * i
        hand.q[axes[i], k] -= dot((goal.back[j, k], goal.back[j + 1, k], goal.back[j + 2, k]), gap)
    size = np.sqrt(dot(gap, gap))
    there: bool = has_arrived(size, goal.before[k], close)
    goal.before[k] = size
    return there


def take_up(columns: Columns, begin: int, count: int, hand: Hand) -> None:
    """Put a handful of poses next to each other."""
    copy(columns.q, begin, count, hand.q)
    copy(columns.sine, begin, count, hand.sine)
    copy(columns.versine, begin, count, hand.versine)
    copy(columns.others, begin, count, hand.others)


def copy(rows: Array, begin: int, count: int, into: Array) -> None:
    """Part of some rows."""
    for i in range(len(rows)):
        for k in range(count):
            into[i, k] = rows[i, begin + k]


def tool(columns: Columns, k: int) -> float:
    """The tool length at a pose."""
    length: float = columns.length[k] if len(columns.length) > 1 else columns.length[0]
    return length


def work_out(functions: Functions, hand: Hand, count: int) -> None:
    """The functions at a handful of poses: as `steps.work_out_functions`."""
    used = 0
    for g in range(len(functions.family)):
        if functions.family[g] == GIVEN:
            for f in range(functions.first[g], functions.first[g + 1]):
                for k in range(count):
                    hand.found[f, k] = hand.others[used, k]
                used += 1
        elif functions.family[g] == POWERS:
            powers(functions, g, hand, count)
        else:
            waves(functions, g, hand, count)


def powers(functions: Functions, g: int, hand: Hand, count: int) -> None:
    """Powers of a position."""
    axis, at = functions.axis[g], 5 * g
    unit, low, high = functions.signal[at], functions.signal[at + 1], functions.signal[at + 2]
    center, scale = functions.signal[at + 3], functions.signal[at + 4]
    for k in range(count):
        u = held_signal(hand.q[axis, k], unit, low, high, center, scale)
        value, power = u, 1
        for f in range(functions.first[g], functions.first[g + 1]):
            while power < functions.order[f]:
                power += 1
                value = value * u
            hand.found[f, k] = value if functions.order[f] > 0 else 1.0


def waves(functions: Functions, g: int, hand: Hand, count: int) -> None:
    """Harmonics of an angle."""
    axis = functions.axis[g]
    for k in range(count):
        cosine, sine, order = 1 - hand.versine[axis, k], hand.sine[axis, k], 1
        c, s = cosine, sine
        for f in range(functions.first[g], functions.first[g + 1], 2):
            while order < functions.order[f]:
                order += 1
                c, s = next_wave(c, s, cosine, sine)
            hand.found[f, k], hand.found[f + 1, k] = c, s


def add_up(functions: Functions, hand: Hand, count: int) -> None:
    """The numbers of the small motions: as `steps.add_up`."""
    last = -1
    for t in range(len(functions.part)):
        part, function, gain = functions.part[t], functions.function[t], functions.gain[t]
        if part == last:
            for k in range(count):
                hand.values[part, k] = hand.values[part, k] + gain * hand.found[function, k]
        else:
            for k in range(count):
                hand.values[part, k] = gain * hand.found[function, k]
        last = part


HELPERS = (unpacked, laid_out, set_out, step_closer, take_up, copy, tool, work_out, powers, waves, add_up)
"""Loops and steps that others are made of."""
