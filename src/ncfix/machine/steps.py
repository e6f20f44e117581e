"""The evaluation of a route: the tool tip carried through a machine step by step, for numbers or columns of numbers.

The compiled core (`core.chain`) does the same operations in the same order, and both take sines from numpy. So the
results are equal to the last bit, and the result of a pose does not depend on the other poses of its batch.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

Number = Any
"""A number, or a column of numbers (n,)."""
Numbers = Any
"""A row of numbers: an array, or a sequence of columns."""
Sequence = Any
"""An array, or a list (faster in Python loops)."""

SHIFT, TURN, FORTH, BACK = 0, 1, 2, 3
"""Kinds of steps: along a linear axis, about a rotary axis, by a small motion, and back by one."""
POWERS, WAVES, GIVEN = 0, 1, 2
"""Kinds of functions: powers of an axis position, harmonics of a rotary axis, and columns evaluated by a basis."""
PARTS = 9
"""Number of values of a small motion: translation, rotation vector, velocity of the centre by rotations about other
points."""
SMALL = 1e-4
"""Squared angle of a small motion, rad^2 (10 mrad), up to which three terms of the power series are exact: the fourth
is below s^3 / 5040 = 2e-16."""


class Steps(NamedTuple):
    """Steps from the tool tip to the workpiece, m of them, in order.

    start      (6,) the tip of a tool of length 0, mm, and its change per mm of length
    kind       (m,) SHIFT, TURN, FORTH or BACK
    axis       (m,) the axis that moves; for a small motion, the rotary axis that carries its centre along, -1: none
    direction  (3 m,) direction of that axis
    point      (3 m,) point on that axis, mm
    center     (3 m,) centre of a small motion, mm
    small      (m,) number of the small motion, -1: none
    rotates    (m,) whether the small motion is more than a translation
    screws     (m,) whether it has rotations about several points
    """

    start: Sequence
    kind: Sequence
    axis: Sequence
    direction: Sequence
    point: Sequence
    center: Sequence
    small: Sequence
    rotates: Sequence
    screws: Sequence


class Functions(NamedTuple):
    """The values of small motions as sums: f functions in g groups, and t terms, each a gain times a function.

    family    (g,) POWERS, WAVES or GIVEN
    axis      (g,) the axis whose position is the signal, -1: none
    signal    (5 g,) unit, low, high, center, scale: u = (x - center) / scale, x = position / unit held in the range
    first     (g + 1,) number of the first function of each group
    order     (f,) the power or harmonic, ascending; for harmonics, the cosine comes first, then the sine
    part      (t,) the value to which the term is added: `PARTS` times the small motion, plus its place; ascending
    function  (t,) number of the function
    gain      (t,) mm or rad
    """

    family: Sequence
    axis: Sequence
    signal: Sequence
    first: Sequence
    order: Sequence
    part: Sequence
    function: Sequence
    gain: Sequence


def turned(
    x: Number, y: Number, z: Number, dx: Number, dy: Number, dz: Number, px: Number, py: Number, pz: Number,
    sine: Number, versine: Number,
) -> Any:  # fmt: skip
    """A point x y z turned about an axis with direction d through p; versine is 1 - cosine."""
    ex, ey, ez = twice_crossed(dx, dy, dz, sine, versine, x - px, y - py, z - pz)
    return x + ex, y + ey, z + ez


def factors(s: Number) -> Any:
    """The factors of Rodrigues' formula, sin a / a and (1 - cos a) / a^2, for small squared angles s."""
    return 1 - s * (1 / 6) * (1 - s * (1 / 20)), 0.5 - s * (1 / 24) * (1 - s * (1 / 30))


def screw_factor(s: Number) -> Any:
    """The factor (a - sin a) / a^3 of a screw's translation, for small squared angles s."""
    return 1 / 6 - s * (1 / 120) * (1 - s * (1 / 42))


def twice_crossed(u: Number, v: Number, w: Number, a: Number, b: Number, x: Number, y: Number, z: Number) -> Any:
    """a times (u v w) x (x y z), plus b times (u v w) x that product."""
    ox, oy, oz = v * z - w * y, w * x - u * z, u * y - v * x
    tx, ty, tz = v * oz - w * oy, w * ox - u * oz, u * oy - v * ox
    return a * ox + b * tx, a * oy + b * ty, a * oz + b * tz


def screwed(s: Number, u: Number, v: Number, w: Number, a: Number, b: Number, c: Number) -> Any:
    """The translation of a screw: rotation vector u v w of squared size s, velocity a b c of the center."""
    ex, ey, ez = twice_crossed(u, v, w, factors(s)[1], screw_factor(s), a, b, c)
    return a + ex, b + ey, c + ez


def moved_forth(x: Number, y: Number, z: Number, s: Number, t: Any, r: Any, a: Number, b: Number, c: Number) -> Any:
    """A point after a rotation r of squared size s about a b c, and a translation t."""
    first, second = factors(s)
    ex, ey, ez = twice_crossed(r[0], r[1], r[2], first, second, x - a, y - b, z - c)
    return x + ex + t[0], y + ey + t[1], z + ez + t[2]


def moved_back(x: Number, y: Number, z: Number, s: Number, t: Any, r: Any, a: Number, b: Number, c: Number) -> Any:
    """The point that `moved_forth` takes to x y z."""
    first, second = factors(s)
    x, y, z = x - t[0], y - t[1], z - t[2]
    ex, ey, ez = twice_crossed(-r[0], -r[1], -r[2], first, second, x - a, y - b, z - c)
    return x + ex, y + ey, z + ez


def held_signal(position: Number, unit: float, low: float, high: float, center: float, scale: float) -> Number:
    """The argument of powers: u = (x - center) / scale with x = position / unit, held at the ends of its range."""
    return (np.minimum(np.maximum(position / unit, low), high) - center) / scale


def next_wave(c: Number, s: Number, cosine: Number, sine: Number) -> Any:
    """Cosine and sine of the sum of two angles with (c, s) and (cosine, sine)."""
    return c * cosine - s * sine, s * cosine + c * sine


def work_out_functions(
    functions: Functions, q: Numbers, sine: Numbers, versine: Numbers, given: Numbers, found: Numbers
) -> None:
    """Write the functions at axis positions q into `found`; `given`: those evaluated by bases, in order."""
    used = 0
    for g in range(len(functions.family)):
        axis = functions.axis[g]
        if functions.family[g] == GIVEN:
            for f in range(functions.first[g], functions.first[g + 1]):
                found[f] = given[used]
                used += 1
        elif functions.family[g] == POWERS:
            u = held_signal(q[axis], *functions.signal[5 * g : 5 * g + 5])
            power, value = 1, u
            for f in range(functions.first[g], functions.first[g + 1]):
                while power < functions.order[f]:
                    power, value = power + 1, value * u
                found[f] = value if functions.order[f] > 0 else 1.0
        else:
            cosine, k = 1 - versine[axis], 1
            c, s = cosine, sine[axis]
            for f in range(functions.first[g], functions.first[g + 1], 2):
                while k < functions.order[f]:
                    k += 1
                    c, s = next_wave(c, s, cosine, sine[axis])
                found[f], found[f + 1] = c, s


def add_up(functions: Functions, found: Numbers, values: Numbers) -> None:
    """Write the values of the small motions into `values`; values without any term are not changed."""
    last = -1
    for t in range(len(functions.part)):
        part, term = functions.part[t], functions.gain[t] * found[functions.function[t]]
        if part == last:
            values[part] = values[part] + term
        else:
            values[part] = term
        last = part


def at_tip(steps: Steps, length: Number) -> Any:
    """x, y, z of the tip of a tool of this length before all steps, mm."""
    start = steps.start
    return start[0] + start[3] * length, start[1] + start[4] * length, start[2] + start[5] * length


def carried(
    steps: Steps, values: Numbers, point: Any, q: Numbers, sine: Numbers, versine: Numbers, largest: Number
) -> Any:
    """x, y, z of a point after all steps, and the largest squared angle of a small motion.

    values         the values of the small motions
    q              axis positions, mm and rad
    sine, versine  sines and versines of the rotary axes
    largest        zero, in the shape of the result
    """
    d, p, center, (x, y, z) = steps.direction, steps.point, steps.center, point
    for i in range(len(steps.kind)):
        kind, axis, j = steps.kind[i], steps.axis[i], 3 * i
        line = d[j], d[j + 1], d[j + 2], p[j], p[j + 1], p[j + 2]
        if kind == SHIFT:
            x, y, z = x + line[0] * q[axis], y + line[1] * q[axis], z + line[2] * q[axis]
            continue
        if kind == TURN:
            x, y, z = turned(x, y, z, *line, sine[axis], versine[axis])
            continue
        at = PARTS * steps.small[i]
        t, r = tuple(values[at : at + 3]), tuple(values[at + 3 : at + 6])
        if not steps.rotates[i]:
            sign = 1.0 if kind == FORTH else -1.0
            x, y, z = x + sign * t[0], y + sign * t[1], z + sign * t[2]
            continue
        s = dot(r, r)
        largest = np.maximum(largest, s)
        if steps.screws[i]:
            more = screwed(s, *r, *values[at + 6 : at + 9])
            t = t[0] + more[0], t[1] + more[1], t[2] + more[2]
        middle = center[j], center[j + 1], center[j + 2]
        if axis >= 0:
            middle = turned(*middle, *line, sine[axis], versine[axis])
        move = moved_forth if kind == FORTH else moved_back
        x, y, z = move(x, y, z, s, t, r, *middle)
    return x, y, z, largest


def follows(steps: Steps, column: int, sine: Numbers, versine: Numbers) -> Any:
    """x, y, z of the derivative of the tip by the linear axis with this column, mm per mm, without small motions."""
    x, y, z, found, d = 0.0, 0.0, 0.0, False, steps.direction
    for i in range(len(steps.kind)):
        axis, j = steps.axis[i], 3 * i
        if steps.kind[i] == SHIFT and axis == column:
            x, y, z, found = d[j], d[j + 1], d[j + 2], True
        elif steps.kind[i] == TURN and found:
            ex, ey, ez = twice_crossed(d[j], d[j + 1], d[j + 2], sine[axis], versine[axis], x, y, z)
            x, y, z = x + ex, y + ey, z + ez
    return x, y, z


def brought_back(
    steps: Steps, axes: Sequence, x: Number, y: Number, z: Number, length: Number, q: Numbers, turns: Any
) -> Any:
    """The motion by linear axes, as x, y, z in their common frame, that brings the tip to x y z; steps without errors.

    axes   columns of the linear axes; no rotary axis stands between them
    turns  sines and versines of the rotary axes
    """
    d, p, (sine, versine) = steps.direction, steps.point, turns
    ax, ay, az = at_tip(steps, length)
    led = [i for i, axis in enumerate(steps.axis) if steps.kind[i] == SHIFT and axis in axes]
    for i in range(led[0]):
        axis, j = steps.axis[i], 3 * i
        if steps.kind[i] == SHIFT:
            ax, ay, az = ax + d[j] * q[axis], ay + d[j + 1] * q[axis], az + d[j + 2] * q[axis]
            continue
        line = d[j], d[j + 1], d[j + 2], p[j], p[j + 1], p[j + 2]
        ax, ay, az = turned(ax, ay, az, *line, sine[axis], versine[axis])
    for i in reversed(range(led[0], len(steps.kind))):
        axis, j = steps.axis[i], 3 * i
        line = d[j], d[j + 1], d[j + 2], p[j], p[j + 1], p[j + 2]
        if steps.kind[i] == TURN:
            x, y, z = turned(x, y, z, *line, -sine[axis], versine[axis])
        elif axis not in axes:
            x, y, z = x - line[0] * q[axis], y - line[1] * q[axis], z - line[2] * q[axis]
    return x - ax, y - ay, z - az


def volume(a: Any, b: Any, c: Any) -> Any:
    """The volume spanned by three vectors, and their cross products b x c, c x a and a x b."""
    p = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
    q = c[1] * a[2] - c[2] * a[1], c[2] * a[0] - c[0] * a[2], c[0] * a[1] - c[1] * a[0]
    r = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    return dot(a, p), p, q, r


def dot(a: Any, b: Any) -> Any:
    """The scalar product of vectors x y z, summed in this order."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def has_arrived(size: Number, before: Number, close: float) -> Any:
    """Whether a gap is below `close`, or will be after the next pass if it keeps falling by the latest ratio."""
    return (size < close) | (size * size < close * before)
