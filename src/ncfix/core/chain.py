# cython: boundscheck=False, cdivision=True
"""Forward kinematics: the tool tip of a machine at many poses, as `machine.steps` and `machine.chain` compute it.

The operations and their order are those of the numpy code, and both take their sines from numpy, so the results agree
to the last bit; a test compares them. Poses are processed in batches: intermediate values stay in the processor's
cache, and the inner loops run over the poses of a batch, so that a compiler can vectorise them.

Array bounds are checked once, by `RouteSteps`, `PoseBatch` and the functions called from Python, and not again in inner
loops. Constant quotients are written with decimal points, because `1 / 6` is an integer division in C.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Ints = NDArray[np.int64]

BATCH = 64
"""Poses processed at a time."""
SPARE = 14
"""Rows of a batch that are free for callers (`core.aim` keeps its goals and gaps there)."""
SHIFT, TURN, FORTH, BACK = 0, 1, 2, 3
POWERS, WAVES, GIVEN = 0, 1, 2
PARTS = 9
"""See `machine.steps`."""


class RouteSteps:
    """The steps from tool tip to workpiece, with the fields of `machine.steps.Steps` and `machine.steps.Functions`.

    signal_axis         `axis` of `Functions`
    axes, turns, given  how many rows of positions, of sines and of precomputed functions a batch must have for it
    """

    def __init__(
        self,
        start: Array,
        kind: Ints,
        axis: Ints,
        direction: Array,
        point: Array,
        center: Array,
        small: Ints,
        rotates: Ints,
        screws: Ints,
        family: Ints,
        signal_axis: Ints,
        signal: Array,
        first: Ints,
        order: Ints,
        part: Ints,
        function: Ints,
        gain: Array,
    ) -> None:
        self.start, self.kind, self.axis, self.direction, self.point = start, kind, axis, direction, point
        self.center, self.small, self.rotates, self.screws, self.family = center, small, rotates, screws, family
        self.signal_axis, self.signal, self.first, self.order = signal_axis, signal, first, order
        self.part, self.function, self.gain = part, function, gain
        steps, groups, terms = len(kind), len(family), len(part)
        self.steps, self.functions, self.axes, self.turns, self.given = steps, len(order), 0, 0, 0
        sizes: tuple[int, ...] = (len(start) - 6, len(axis) - steps, len(direction) - 3 * steps, len(point) - 3 * steps)
        sizes += (len(center) - 3 * steps, len(small) - steps, len(rotates) - steps, len(screws) - steps)
        sizes += (len(signal_axis) - groups, len(signal) - 5 * groups, len(first) - groups - 1)
        sizes += (len(function) - terms, len(gain) - terms, first[0], first[groups] - len(order))
        right = not any(sizes)
        for i in range(steps):
            if kind[i] == SHIFT:
                right, self.axes = right and axis[i] >= 0, max(self.axes, axis[i] + 1)
            else:
                right, self.turns = right and (axis[i] >= 0 or kind[i] != TURN), max(self.turns, axis[i] + 1)
            right = right and (kind[i] in (SHIFT, TURN) or 0 <= small[i] < steps)
        for g in range(groups):
            right = right and first[g] <= first[g + 1]
            if family[g] == GIVEN:
                self.given += first[g + 1] - first[g]
            elif family[g] == POWERS:
                right, self.axes = right and signal_axis[g] >= 0, max(self.axes, signal_axis[g] + 1)
            else:
                right, self.turns = right and signal_axis[g] >= 0, max(self.turns, signal_axis[g] + 1)
                right = right and (first[g + 1] - first[g]) % 2 == 0
        for t in range(terms):
            right = right and 0 <= part[t] < PARTS * steps and 0 <= function[t] < len(order)
        if not right:
            raise IndexError("these are not the steps of a route")

    # -- operations on a batch --------------------------------------------------------------------------------------

    def set_off(self, batch: PoseBatch, count: int, tip: int) -> int:
        """Write the tips of a batch before all steps into the rows from `tip` on, as `steps.at_tip`."""
        work, length = batch.work, batch.length
        x, y, z = self.start[0], self.start[1], self.start[2]
        u, v, w = self.start[3], self.start[4], self.start[5]
        for k in range(count):
            work[tip, k], work[tip + 1, k] = x + u * work[length, k], y + v * work[length, k]
            work[tip + 2, k], work[tip + 3, k] = z + w * work[length, k], 0.0
        return 0

    def carry(self, batch: PoseBatch, count: int, tip: int, values: int, stop: int) -> int:
        """Move the points in the rows from `tip` on through the first `stop` steps, as `steps.carried`.

        values  first row of the translations and rotations of the small motions
        """
        work = batch.work
        for i in range(stop):
            kind, axis, j, at = self.kind[i], self.axis[i], 3 * i, values + PARTS * self.small[i]
            dx, dy, dz = self.direction[j], self.direction[j + 1], self.direction[j + 2]
            if kind == SHIFT:
                for k in range(count):
                    way = work[axis, k]
                    work[tip, k] = work[tip, k] + dx * way
                    work[tip + 1, k] = work[tip + 1, k] + dy * way
                    work[tip + 2, k] = work[tip + 2, k] + dz * way
            elif kind == TURN:
                self.turn(batch, i, count, tip, 1.0)
            elif not self.rotates[i]:
                sign = 1.0 if kind == FORTH else -1.0
                for k in range(count):
                    work[tip, k] = work[tip, k] + sign * work[at, k]
                    work[tip + 1, k] = work[tip + 1, k] + sign * work[at + 1, k]
                    work[tip + 2, k] = work[tip + 2, k] + sign * work[at + 2, k]
            elif axis < 0 and not self.screws[i]:
                if kind == FORTH:
                    self.nudge_forth(batch, i, count, tip, at)
                else:
                    self.nudge_back(batch, i, count, tip, at)
            else:
                self.screw(batch, i, count, tip, at)
        return 0

    def turn(self, batch: PoseBatch, i: int, count: int, tip: int, sense: float) -> int:
        """Rotate points about the axis of step i, backwards if `sense` is -1, as `steps.turned`."""
        work, j, sine, versine = batch.work, 3 * i, batch.sine + self.axis[i], batch.versine + self.axis[i]
        dx, dy, dz = self.direction[j], self.direction[j + 1], self.direction[j + 2]
        px, py, pz = self.point[j], self.point[j + 1], self.point[j + 2]
        for k in range(count):
            s, c = sense * work[sine, k], work[versine, k]
            x, y, z = work[tip, k], work[tip + 1, k], work[tip + 2, k]
            ax, ay, az = x - px, y - py, z - pz
            ox, oy, oz = dy * az - dz * ay, dz * ax - dx * az, dx * ay - dy * ax
            tx, ty, tz = dy * oz - dz * oy, dz * ox - dx * oz, dx * oy - dy * ox
            work[tip, k] = x + (s * ox + c * tx)
            work[tip + 1, k] = y + (s * oy + c * ty)
            work[tip + 2, k] = z + (s * oz + c * tz)
        return 0

    def nudge_forth(self, batch: PoseBatch, i: int, count: int, tip: int, at: int) -> int:
        """Apply the small motion of step i about its centre to points, as `steps.moved_forth`."""
        work, a, b, c = batch.work, self.center[3 * i], self.center[3 * i + 1], self.center[3 * i + 2]
        for k in range(count):
            u, v, w = work[at + 3, k], work[at + 4, k], work[at + 5, k]
            s = u * u + v * v + w * w
            work[tip + 3, k] = max(work[tip + 3, k], s)
            x, y, z = work[tip, k], work[tip + 1, k], work[tip + 2, k]
            first = 1 - s * (1.0 / 6.0) * (1 - s * (1.0 / 20.0))
            second = 0.5 - s * (1.0 / 24.0) * (1 - s * (1.0 / 30.0))
            ax, ay, az = x - a, y - b, z - c
            ox, oy, oz = v * az - w * ay, w * ax - u * az, u * ay - v * ax
            tx, ty, tz = v * oz - w * oy, w * ox - u * oz, u * oy - v * ox
            work[tip, k] = x + (first * ox + second * tx) + work[at, k]
            work[tip + 1, k] = y + (first * oy + second * ty) + work[at + 1, k]
            work[tip + 2, k] = z + (first * oz + second * tz) + work[at + 2, k]
        return 0

    def nudge_back(self, batch: PoseBatch, i: int, count: int, tip: int, at: int) -> int:
        """Apply the inverse of the small motion of step i to points, as `steps.moved_back`."""
        work, a, b, c = batch.work, self.center[3 * i], self.center[3 * i + 1], self.center[3 * i + 2]
        for k in range(count):
            u, v, w = -work[at + 3, k], -work[at + 4, k], -work[at + 5, k]
            s = u * u + v * v + w * w
            work[tip + 3, k] = max(work[tip + 3, k], s)
            x, y, z = work[tip, k] - work[at, k], work[tip + 1, k] - work[at + 1, k], work[tip + 2, k] - work[at + 2, k]
            first = 1 - s * (1.0 / 6.0) * (1 - s * (1.0 / 20.0))
            second = 0.5 - s * (1.0 / 24.0) * (1 - s * (1.0 / 30.0))
            ax, ay, az = x - a, y - b, z - c
            ox, oy, oz = v * az - w * ay, w * ax - u * az, u * ay - v * ax
            tx, ty, tz = v * oz - w * oy, w * ox - u * oz, u * oy - v * ox
            work[tip, k] = x + (first * ox + second * tx)
            work[tip + 1, k] = y + (first * oy + second * ty)
            work[tip + 2, k] = z + (first * oz + second * tz)
        return 0

    def screw(self, batch: PoseBatch, i: int, count: int, tip: int, at: int) -> int:
        """Apply a small motion with several centres, or one that a rotary axis moves, or its inverse."""
        work, j, axis, forth = batch.work, 3 * i, self.axis[i], self.kind[i] == FORTH
        dx, dy, dz = self.direction[j], self.direction[j + 1], self.direction[j + 2]
        px, py, pz = self.point[j], self.point[j + 1], self.point[j + 2]
        for k in range(count):
            t0, t1, t2 = work[at, k], work[at + 1, k], work[at + 2, k]
            u, v, w = work[at + 3, k], work[at + 4, k], work[at + 5, k]
            s = u * u + v * v + w * w
            work[tip + 3, k] = max(work[tip + 3, k], s)
            first = 1 - s * (1.0 / 6.0) * (1 - s * (1.0 / 20.0))
            second = 0.5 - s * (1.0 / 24.0) * (1 - s * (1.0 / 30.0))
            if self.screws[i]:
                third = 1.0 / 6.0 - s * (1.0 / 120.0) * (1 - s * (1.0 / 42.0))
                x, y, z = work[at + 6, k], work[at + 7, k], work[at + 8, k]
                ox, oy, oz = v * z - w * y, w * x - u * z, u * y - v * x
                tx, ty, tz = v * oz - w * oy, w * ox - u * oz, u * oy - v * ox
                t0 = t0 + (x + (second * ox + third * tx))
                t1 = t1 + (y + (second * oy + third * ty))
                t2 = t2 + (z + (second * oz + third * tz))
            a, b, c = self.center[j], self.center[j + 1], self.center[j + 2]
            if axis >= 0:
                sine, versine = work[batch.sine + axis, k], work[batch.versine + axis, k]
                ax, ay, az = a - px, b - py, c - pz
                ox, oy, oz = dy * az - dz * ay, dz * ax - dx * az, dx * ay - dy * ax
                tx, ty, tz = dy * oz - dz * oy, dz * ox - dx * oz, dx * oy - dy * ox
                a, b, c = a + (sine * ox + versine * tx), b + (sine * oy + versine * ty), c + (sine * oz + versine * tz)
            x, y, z = work[tip, k], work[tip + 1, k], work[tip + 2, k]
            if not forth:
                x, y, z, u, v, w = x - t0, y - t1, z - t2, -u, -v, -w
            ax, ay, az = x - a, y - b, z - c
            ox, oy, oz = v * az - w * ay, w * ax - u * az, u * ay - v * ax
            tx, ty, tz = v * oz - w * oy, w * ox - u * oz, u * oy - v * ox
            x, y, z = x + (first * ox + second * tx), y + (first * oy + second * ty), z + (first * oz + second * tz)
            if forth:
                x, y, z = x + t0, y + t1, z + t2
            work[tip, k], work[tip + 1, k], work[tip + 2, k] = x, y, z
        return 0

    def set_goal(self, batch: PoseBatch, count: int, target: Array, begin: int, point: int) -> int:
        """Write the goals of the tips: `target` (3, n) mm or, if that is (3, 0), the tips by these steps."""
        work = batch.work
        if target.shape[1]:
            for k in range(count):
                work[point, k], work[point + 1, k] = target[0, begin + k], target[1, begin + k]
                work[point + 2, k], work[point + 3, k] = target[2, begin + k], 0.0
        else:
            self.set_off(batch, count, point)
            self.carry(batch, count, point, batch.values, self.steps)
        return 0

    def work_out(self, batch: PoseBatch, count: int, used: int, values: int) -> int:
        """Compute translations and rotations of the small motions, as `steps.work_out_functions` and `add_up`.

        values  first row of the results
        used    how many of the precomputed functions belong to other routes

        Returns `used` plus the functions used here. The rows of the tips serve as scratch space.
        """
        work, found, last = batch.work, batch.found, -1
        for g in range(self.family.shape[0]):
            if self.family[g] == GIVEN:
                for f in range(self.first[g], self.first[g + 1]):
                    for k in range(count):
                        work[found + f, k] = work[batch.others + used, k]
                    used += 1
            elif self.family[g] == POWERS:
                self.powers(batch, g, count)
            else:
                self.waves(batch, g, count)
        for t in range(self.part.shape[0]):
            part, function, gain = self.part[t], found + self.function[t], self.gain[t]
            if part == last:
                for k in range(count):
                    work[values + part, k] = work[values + part, k] + gain * work[function, k]
            else:
                for k in range(count):
                    work[values + part, k] = gain * work[function, k]
            last = part
        return used

    def powers(self, batch: PoseBatch, g: int, count: int) -> int:
        """Compute the powers of a position that group g of the functions needs."""
        work, u, value, axis, at, power = batch.work, batch.tip, batch.tip + 1, self.signal_axis[g], 5 * g, 1
        unit, low, high = self.signal[at], self.signal[at + 1], self.signal[at + 2]
        center, scale = self.signal[at + 3], self.signal[at + 4]
        for k in range(count):
            work[u, k] = (min(max(work[axis, k] / unit, low), high) - center) / scale
            work[value, k] = work[u, k]
        for f in range(self.first[g], self.first[g + 1]):
            order, row = self.order[f], batch.found + f
            while power < order:
                power += 1
                for k in range(count):
                    work[value, k] = work[value, k] * work[u, k]
            if order > 0:
                for k in range(count):
                    work[row, k] = work[value, k]
            else:
                for k in range(count):
                    work[row, k] = 1.0
        return 0

    def waves(self, batch: PoseBatch, g: int, count: int) -> int:
        """Compute the cosines and sines of multiples of an angle that group g of the functions needs."""
        work, tip, axis, order = batch.work, batch.tip, self.signal_axis[g], 1
        sine, versine = batch.sine + axis, batch.versine + axis
        for k in range(count):
            work[tip, k] = 1 - work[versine, k]
            work[tip + 1, k], work[tip + 2, k] = work[tip, k], work[sine, k]
        for f in range(self.first[g], self.first[g + 1], 2):
            row = batch.found + f
            while order < self.order[f]:
                order += 1
                for k in range(count):
                    c, s = work[tip + 1, k], work[tip + 2, k]
                    work[tip + 1, k] = c * work[tip, k] - s * work[sine, k]
                    work[tip + 2, k] = s * work[tip, k] + c * work[sine, k]
            for k in range(count):
                work[row, k], work[row + 1, k] = work[tip + 1, k], work[tip + 2, k]
        return 0

    def follow(self, batch: PoseBatch, column: int, count: int, way: int) -> int:
        """Write the derivative of the tips by a linear axis, mm per mm, into rows from `way` on, as `steps.follows`."""
        work, found = batch.work, False
        for k in range(count):
            work[way, k], work[way + 1, k], work[way + 2, k] = 0.0, 0.0, 0.0
        for i in range(self.kind.shape[0]):
            axis, j = self.axis[i], 3 * i
            dx, dy, dz = self.direction[j], self.direction[j + 1], self.direction[j + 2]
            if self.kind[i] == SHIFT and axis == column:
                found = True
                for k in range(count):
                    work[way, k], work[way + 1, k], work[way + 2, k] = dx, dy, dz
            elif self.kind[i] == TURN and found:
                sine, versine = batch.sine + axis, batch.versine + axis
                for k in range(count):
                    x, y, z = work[way, k], work[way + 1, k], work[way + 2, k]
                    ox, oy, oz = dy * z - dz * y, dz * x - dx * z, dx * y - dy * x
                    tx, ty, tz = dy * oz - dz * oy, dz * ox - dx * oz, dx * oy - dy * ox
                    work[way, k] = x + (work[sine, k] * ox + work[versine, k] * tx)
                    work[way + 1, k] = y + (work[sine, k] * oy + work[versine, k] * ty)
                    work[way + 2, k] = z + (work[sine, k] * oz + work[versine, k] * tz)
        return 0


class PoseBatch:
    """Poses as columns, and working space for one batch of them.

    q              (n_axes, n) axis positions, mm and rad
    sine, versine  (k, n) of rotary axes: sin(angle) and 1 - cos(angle)
    others         (m, n) precomputed functions
    length         (n,) or (1,) tool lengths, mm
    work           working space, (rows, BATCH) with the rows that `rows_for` gives; positions come first

    The attributes `sine`, `versine`, `others`, `found` (functions), `values` (small motions), `tip`, `length` and
    `spare` are the first rows of these quantities in `work`.
    """

    def __init__(
        self,
        q: Array,
        sine: Array,
        versine: Array,
        others: Array,
        length: Array,
        work: Array,
        functions: int,
        small: int,
    ) -> None:
        self.q, self.sines, self.versines, self.given, self.lengths, self.work = q, sine, versine, others, length, work
        self.n = q.shape[1]
        self.sine = q.shape[0]
        self.versine = self.sine + sine.shape[0]
        self.others = self.versine + sine.shape[0]
        self.found = self.others + others.shape[0]
        self.values = self.found + functions
        self.tip = self.values + PARTS * small
        self.length, self.spare = self.tip + 4, self.tip + 5
        rows = self.spare + SPARE
        if work.shape[0] < rows or work.shape[1] != BATCH or versine.shape[0] != sine.shape[0]:
            raise IndexError("there is no room for what is worked out for a batch of poses")
        if {sine.shape[1], versine.shape[1], others.shape[1]} != {self.n} or length.shape[0] not in (1, self.n):
            raise IndexError("there are not as many of everything as there are poses")

    def fits(self, route: RouteSteps, given: int) -> bool:
        """Whether there are all rows a route needs; `given` of the precomputed functions belong to other routes."""
        rows = route.axes <= self.q.shape[0] and route.turns <= self.sines.shape[0]
        return bool(rows and route.given <= self.given.shape[0] - given and route.functions <= self.values - self.found)

    def take_up(self, begin: int, count: int) -> int:
        """Copy the poses from `begin` on into the working space."""
        for i in range(self.q.shape[0]):
            for k in range(count):
                self.work[i, k] = self.q[i, begin + k]
        for i in range(self.sines.shape[0]):
            for k in range(count):
                self.work[self.sine + i, k], self.work[self.versine + i, k] = (
                    self.sines[i, begin + k],
                    self.versines[i, begin + k],
                )
        for i in range(self.given.shape[0]):
            for k in range(count):
                self.work[self.others + i, k] = self.given[i, begin + k]
        for k in range(count):
            self.work[self.length, k] = self.lengths[begin + k if self.lengths.shape[0] > 1 else 0]
        return 0


def rows_for(axes: int, turns: int, others: int, functions: int, small: int) -> int:
    """Number of rows of the working space of a `PoseBatch`.

    axes, turns, others  rows of `q`, `sine` and `others`
    functions, small     functions of a route, and small motions of all routes; components that no function contributes
                         to must stay zero
    """
    return axes + 2 * turns + others + functions + PARTS * small + 5 + SPARE


def tips(route: RouteSteps, batch: PoseBatch, out: Array) -> int:
    """Compute the tips of all poses: `out` (4, n) receives x, y, z, mm, and the largest squared small angle, rad^2."""
    if (
        not batch.fits(route, 0)
        or out.shape[0] != 4
        or out.shape[1] != batch.n
        or batch.tip - batch.values < PARTS * route.steps
    ):
        raise IndexError("a route needs more than it is given")
    begin = 0
    while begin < batch.n:
        count = min(BATCH, batch.n - begin)
        batch.take_up(begin, count)
        route.work_out(batch, count, 0, batch.values)
        route.set_off(batch, count, batch.tip)
        route.carry(batch, count, batch.tip, batch.values, route.steps)
        for i in range(4):
            for k in range(count):
                out[i, begin + k] = batch.work[batch.tip + i, k]
        begin += BATCH
    return 0


def gaps(
    perfect: RouteSteps, real: RouteSteps, batch: PoseBatch, target: Array, sides: Ints, out: Array, angle: Array
) -> int:
    """Compute the gaps between tips and goals: `out` (k, n, 3) receives tip minus goal, mm.

    batch   several sets of n poses each, the programmed poses first
    target  (3, n) goals, mm; (3, 0): the tips of the perfect machine at the programmed poses
    sides   (k,) the set of poses of each result
    angle   (k, n) receives the largest squared angle of a small motion, rad^2
    """
    n, work, tip, point = out.shape[1], batch.work, batch.tip, batch.spare
    right = batch.fits(perfect, 0) and batch.fits(real, 0) and batch.tip - batch.values >= PARTS * real.steps
    right = right and perfect.part.shape[0] == 0 and out.shape[2] == 3 and target.shape[1] in (0, n)
    right = right and batch.tip - batch.values >= PARTS * perfect.steps and target.shape[0] == 3
    right = right and angle.shape[0] == out.shape[0] == sides.shape[0] and angle.shape[1] == n <= batch.n
    for side in range(sides.shape[0]):
        right = right and sides[side] >= 0 and (sides[side] + 1) * n <= batch.n
    if not right:
        raise IndexError("a route needs more than it is given")
    begin = 0
    while begin < n:
        count = min(BATCH, n - begin)
        batch.take_up(begin, count)
        perfect.set_goal(batch, count, target, begin, point)
        for side in range(sides.shape[0]):
            batch.take_up(sides[side] * n + begin, count)
            real.work_out(batch, count, 0, batch.values)
            real.set_off(batch, count, tip)
            real.carry(batch, count, tip, batch.values, real.steps)
            for k in range(count):
                angle[side, begin + k] = work[tip + 3, k]
                for i in range(3):
                    out[side, begin + k, i] = work[tip + i, k] - work[point + i, k]
        begin += BATCH
    return 0
