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
    FORTH,
    GIVEN,
    PARTS,
    POWERS,
    SHIFT,
    TURN,
    Functions,
    Steps,
    dot,
    held_signal,
    moved_back,
    moved_forth,
    next_wave,
    screwed,
    turned,
)

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

Packed = tuple[Ints, Array]

HANDFUL = 64
LINE = 8
"""Numbers in a line of the cache, and in the widest vector: room that begins with one is gone through faster."""
SPARE = 14
"""Rows for those who do more with a handful of poses."""


class PoseColumns(NamedTuple):
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
    length         (.,) of the tool, mm
    found, values  the functions, and the numbers of the small motions
    tip            (4, .) x, y, z in mm, and the largest squared angle of a small motion
    """

    q: Array
    sine: Array
    versine: Array
    others: Array
    length: Array
    found: Array
    values: Array
    tip: Array


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


def room(columns: PoseColumns, *routes: Packed) -> Array:
    """Room for a handful of poses on some routes, and `SPARE` rows more, as `laid_out` divides it.

    Each route has small motions of its own: what none of its functions adds to has to stay zero.
    """
    m, f = sum(int(route[0][0]) for route in routes), max(int(route[0][2]) for route in routes)
    rows = len(columns.q) + 2 * len(columns.sine) + len(columns.others) + f + PARTS * m
    count = (rows + 5 + SPARE) * HANDFUL
    memory = np.zeros(count + LINE)
    begin = -(memory.ctypes.data // memory.itemsize) % LINE
    return memory[begin : begin + count].reshape(-1, HANDFUL)


def laid_out(work: Array, columns: PoseColumns, f: int, m: int) -> tuple[Hand, Array]:
    """The parts of the room for f functions and m small motions, and the rows to spare."""
    axes, sines, others = len(columns.q), len(columns.sine), len(columns.others)
    a = axes + 2 * sines
    b = a + others + f
    c = b + PARTS * m
    turns = work[axes : axes + sines], work[axes + sines : a]
    results = work[a + others : b], work[b:c], work[c : c + 4]
    hand = Hand(work[:axes], turns[0], turns[1], work[a : a + others], work[c + 4], results[0], results[1], results[2])
    return hand, work[c + 5 :]


def tips(ints: Ints, reals: Array, columns: PoseColumns, work: Array, out: Array) -> None:
    """The tips of all poses: out (4, n) are x, y, z in mm, and the largest squared angle of a small motion."""
    steps, functions = unpacked(ints, reals)
    hand, _ = laid_out(work, columns, len(functions.order), len(steps.kind))
    n = columns.q.shape[1]
    for begin in range(0, n, HANDFUL):
        count = min(HANDFUL, n - begin)
        take_up(columns, begin, count, hand)
        work_out(functions, hand, count, 0)
        add_up(functions, hand, count)
        set_off(steps, hand, count, hand.tip)
        carry(steps, hand, count, hand.tip)
        for i in range(4):
            for k in range(count):
                out[i, np.uint64(begin + k)] = hand.tip[i, k]


def gaps(
    perfect: Packed,
    real: Packed,
    columns: PoseColumns,
    target: Array,
    sides: Ints,
    work: Array,
    out: Array,
    angle: Array,
) -> None:
    """How far the tips of all poses are from where they shall be: out (k, n, 3) mm.

    columns  of n poses as they are meant, and of others behind them, n of each kind
    target   (3, n) mm; (3, 0): where a perfect machine has the tip as meant
    sides    (k,) which kind each of the results is of
    angle    (k, n) the largest squared angle of a small motion
    """
    nominal, _ = unpacked(perfect[0], perfect[1])
    steps, functions = unpacked(real[0], real[1])
    hand, spare = laid_out(work, columns, len(functions.order), len(steps.kind))
    n, point = out.shape[1], spare[:4]
    for begin in range(0, n, HANDFUL):
        count = min(HANDFUL, n - begin)
        take_up(columns, begin, count, hand)
        set_goal(nominal, hand, count, target, begin, point)
        for side in range(len(sides)):
            take_up(columns, sides[side] * n + begin, count, hand)
            work_out(functions, hand, count, 0)
            add_up(functions, hand, count)
            set_off(steps, hand, count, hand.tip)
            carry(steps, hand, count, hand.tip)
            for k in range(count):
                at = np.uint64(begin + k)
                angle[side, at] = hand.tip[3, k]
                for i in range(3):
                    out[side, at, i] = hand.tip[i, k] - point[i, k]


def set_goal(perfect: Steps, hand: Hand, count: int, target: Array, begin: int, point: Array) -> None:
    """Put down where the tips shall be, (4, .): at `target` (3, n) mm, or (3, 0) where a perfect machine has them."""
    if target.shape[1]:
        for k in range(count):
            at = np.uint64(begin + k)
            point[0, k], point[1, k], point[2, k], point[3, k] = target[0, at], target[1, at], target[2, at], 0.0
    else:
        set_off(perfect, hand, count, point)
        carry(perfect, hand, count, point)


def set_off(steps: Steps, hand: Hand, count: int, tip: Array) -> None:
    """Where the tips of a handful of poses are before all steps, (4, .): as `steps.at_tip`."""
    start = steps.start
    for k in range(count):
        length = hand.length[k]
        tip[0, k], tip[1, k] = start[0] + start[3] * length, start[1] + start[4] * length
        tip[2, k], tip[3, k] = start[2] + start[5] * length, 0.0


def carry(steps: Steps, hand: Hand, count: int, tip: Array) -> None:
    """Where points of a handful of poses go, (4, .): as `steps.carried`."""
    d, p, center = steps.direction, steps.point, steps.center
    for i in range(len(steps.kind)):
        kind, axis, j = steps.kind[i], steps.axis[i], 3 * i
        dx, dy, dz, px, py, pz = d[j], d[j + 1], d[j + 2], p[j], p[j + 1], p[j + 2]
        if kind == SHIFT:
            for k in range(count):
                way = hand.q[axis, k]
                tip[0, k], tip[1, k], tip[2, k] = tip[0, k] + dx * way, tip[1, k] + dy * way, tip[2, k] + dz * way
        elif kind == TURN:
            for k in range(count):
                turn = hand.sine[axis, k], hand.versine[axis, k]
                tip[0, k], tip[1, k], tip[2, k] = turned(
                    tip[0, k], tip[1, k], tip[2, k], dx, dy, dz, px, py, pz, turn[0], turn[1]
                )
        elif not steps.rotates[i]:
            sign, at = 1.0 if kind == FORTH else -1.0, PARTS * steps.small[i]
            for part in range(3):
                for k in range(count):
                    tip[part, k] = tip[part, k] + sign * hand.values[at + part, k]
        elif axis < 0 and not steps.screws[i]:
            at = PARTS * steps.small[i]
            nudge(hand.values[at : at + PARTS], (center[j], center[j + 1], center[j + 2]), kind, count, tip)
        else:
            at, a, b, c = PARTS * steps.small[i], center[j], center[j + 1], center[j + 2]
            for k in range(count):
                t = hand.values[at, k], hand.values[at + 1, k], hand.values[at + 2, k]
                r = hand.values[at + 3, k], hand.values[at + 4, k], hand.values[at + 5, k]
                s, middle = dot(r, r), (a, b, c)
                tip[3, k] = max(tip[3, k], s)
                if steps.screws[i]:
                    x, y, z = hand.values[at + 6, k], hand.values[at + 7, k], hand.values[at + 8, k]
                    more = screwed(s, r[0], r[1], r[2], x, y, z)
                    t = t[0] + more[0], t[1] + more[1], t[2] + more[2]
                if axis >= 0:
                    turn = hand.sine[axis, k], hand.versine[axis, k]
                    middle = turned(a, b, c, dx, dy, dz, px, py, pz, turn[0], turn[1])
                here = tip[0, k], tip[1, k], tip[2, k]
                if kind == FORTH:
                    found = moved_forth(here[0], here[1], here[2], s, t, r, middle[0], middle[1], middle[2])
                else:
                    found = moved_back(here[0], here[1], here[2], s, t, r, middle[0], middle[1], middle[2])
                tip[0, k], tip[1, k], tip[2, k] = found


def nudge(small: Array, center: tuple[float, float, float], kind: int, count: int, tip: Array) -> None:
    """Move tips forth or back by small motions (`PARTS`, .) about one point; simple enough for vector instructions."""
    a, b, c = center
    if kind == FORTH:
        for k in range(count):
            t, r = (small[0, k], small[1, k], small[2, k]), (small[3, k], small[4, k], small[5, k])
            s = dot(r, r)
            tip[3, k] = max(tip[3, k], s)
            tip[0, k], tip[1, k], tip[2, k] = moved_forth(tip[0, k], tip[1, k], tip[2, k], s, t, r, a, b, c)
    else:
        for k in range(count):
            t, r = (small[0, k], small[1, k], small[2, k]), (small[3, k], small[4, k], small[5, k])
            s = dot(r, r)
            tip[3, k] = max(tip[3, k], s)
            tip[0, k], tip[1, k], tip[2, k] = moved_back(tip[0, k], tip[1, k], tip[2, k], s, t, r, a, b, c)


def take_up(columns: PoseColumns, begin: int, count: int, hand: Hand) -> None:
    """Put a handful of poses next to each other."""
    copy(columns.q, begin, count, hand.q)
    copy(columns.sine, begin, count, hand.sine)
    copy(columns.versine, begin, count, hand.versine)
    copy(columns.others, begin, count, hand.others)
    for k in range(count):
        hand.length[k] = columns.length[np.uint64(begin + k)] if len(columns.length) > 1 else columns.length[0]


def copy(rows: Array, begin: int, count: int, into: Array) -> None:
    """Part of some rows."""
    for i in range(len(rows)):
        for k in range(count):
            into[i, k] = rows[i, np.uint64(begin + k)]


def work_out(functions: Functions, hand: Hand, count: int, used: int) -> int:
    """The functions at a handful of poses: as `steps.work_out_functions`; the tips lend their room to it.

    used  how many of those that come from elsewhere are for other functions; those after them are added to it
    """
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
    return used


def powers(functions: Functions, g: int, hand: Hand, count: int) -> None:
    """Powers of a position."""
    (u, value), axis, at = (hand.tip[0], hand.tip[1]), functions.axis[g], 5 * g
    unit, low, high = functions.signal[at], functions.signal[at + 1], functions.signal[at + 2]
    center, scale = functions.signal[at + 3], functions.signal[at + 4]
    for k in range(count):
        u[k] = held_signal(hand.q[axis, k], unit, low, high, center, scale)
        value[k] = u[k]
    power = 1
    for f in range(functions.first[g], functions.first[g + 1]):
        while power < functions.order[f]:
            power += 1
            for k in range(count):
                value[k] = value[k] * u[k]
        for k in range(count):
            hand.found[f, k] = value[k] if functions.order[f] > 0 else 1.0


def waves(functions: Functions, g: int, hand: Hand, count: int) -> None:
    """Harmonics of an angle."""
    axis, order, cosine, c, s = functions.axis[g], 1, hand.tip[0], hand.tip[1], hand.tip[2]
    for k in range(count):
        cosine[k] = 1 - hand.versine[axis, k]
        c[k], s[k] = cosine[k], hand.sine[axis, k]
    for f in range(functions.first[g], functions.first[g + 1], 2):
        while order < functions.order[f]:
            order += 1
            for k in range(count):
                c[k], s[k] = next_wave(c[k], s[k], cosine[k], hand.sine[axis, k])
        for k in range(count):
            hand.found[f, k], hand.found[f + 1, k] = c[k], s[k]


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


HELPERS = (
    unpacked,
    laid_out,
    set_goal,
    set_off,
    carry,
    nudge,
    take_up,
    copy,
    work_out,
    powers,
    waves,
    add_up,
)
"""Loops and steps that others are made of."""
