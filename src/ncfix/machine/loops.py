"""The steps of a route for many poses, as loops: what `kernels` compiles. Not meant to be run as it is.

Poses are taken by the handful, so that what is worked out for one step of them stays in the processor's cache, and
functions and sums are loops over poses that a compiler turns into vector instructions.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.machine.steps import GIVEN, PARTS, POWERS, Functions, Steps, carried, held_signal, next_wave
from ncfix.machine.steps import follows as followed

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

HANDFUL = 64


def tips(
    steps: Steps, functions: Functions, length: Array, q: Array, sine: Array, versine: Array, given: Array
) -> tuple[Array, Array]:
    """The tip (3, n) at positions q (n_axes, n), and the largest squared angle of a small motion at each pose (n,)."""
    n = q.shape[1]
    out, largest = np.empty((3, n)), np.empty(n)
    found, values = np.ones((len(functions.order), HANDFUL)), np.zeros((PARTS * len(steps.kind), HANDFUL))
    here, sines, versines = np.zeros(len(q)), np.zeros(len(sine)), np.zeros(len(sine))
    small = np.zeros(len(values))
    for begin in range(0, n, HANDFUL):
        count = min(HANDFUL, n - begin)
        work_out(functions, q, sine, versine, given, begin, count, found)
        add_up(functions, found, count, values)
        for k in range(begin, begin + count):
            take(q, k, here)
            take(sine, k, sines)
            take(versine, k, versines)
            take(values, k - begin, small)
            tool = length[k] if len(length) > 1 else length[0]
            out[0, k], out[1, k], out[2, k], largest[k] = carried(steps, small, tool, here, sines, versines, 0.0)
    return out, largest


def take(rows: Array, k: int, into: Array) -> None:
    """The numbers of one pose."""
    for i in range(len(into)):
        into[i] = rows[i, k]


def work_out(
    functions: Functions, q: Array, sine: Array, versine: Array, given: Array, begin: int, count: int, found: Array
) -> None:
    """The functions (f, count) at poses from `begin` on: as `steps.work_out_functions`."""
    u, value, turn = np.empty(HANDFUL), np.empty(HANDFUL), np.empty(HANDFUL)
    signal, used = functions.signal, 0
    for g in range(len(functions.family)):
        axis, first, last = functions.axis[g], functions.first[g], functions.first[g + 1]
        if functions.family[g] == GIVEN:
            for f in range(first, last):
                for k in range(count):
                    found[f, k] = given[used, begin + k]
                used += 1
        elif functions.family[g] == POWERS:
            unit, low, high, center, scale = signal[5 * g : 5 * g + 5]
            for k in range(count):
                u[k] = held_signal(q[axis, begin + k], unit, low, high, center, scale)
                value[k] = u[k]
            power = 1
            for f in range(first, last):
                while power < functions.order[f]:
                    power += 1
                    for k in range(count):
                        value[k] = value[k] * u[k]
                if functions.order[f] > 0:
                    for k in range(count):
                        found[f, k] = value[k]
        else:
            for k in range(count):
                value[k], turn[k] = 1 - versine[axis, begin + k], sine[axis, begin + k]
            order = 1
            for f in range(first, last, 2):
                while order < functions.order[f]:
                    order += 1
                    for k in range(count):
                        s = sine[axis, begin + k]
                        value[k], turn[k] = next_wave(value[k], turn[k], 1 - versine[axis, begin + k], s)
                for k in range(count):
                    found[f, k], found[f + 1, k] = value[k], turn[k]


def add_up(functions: Functions, found: Array, count: int, values: Array) -> None:
    """The numbers of the small motions: as `steps.add_up`."""
    last = -1
    for t in range(len(functions.part)):
        part, function, gain = functions.part[t], functions.function[t], functions.gain[t]
        if part == last:
            for k in range(count):
                values[part, k] = values[part, k] + gain * found[function, k]
        else:
            for k in range(count):
                values[part, k] = gain * found[function, k]
        last = part


def follows(steps: Steps, axes: Ints, sine: Array, versine: Array) -> Array:
    """How the tip follows linear axes, (3, axes, n) mm per mm."""
    n = sine.shape[1]
    out = np.empty((3, len(axes), n))
    sines, versines = np.zeros(len(sine)), np.zeros(len(sine))
    for k in range(n):
        take(sine, k, sines)
        take(versine, k, versines)
        for place in range(len(axes)):
            out[0, place, k], out[1, place, k], out[2, place, k] = followed(steps, axes[place], sines, versines)
    return out


HELPERS = (take, work_out, add_up)
"""Loops that are parts of others."""
