# cython: boundscheck=False, cdivision=True
"""Inverse kinematics: positions of X Y Z that bring the tip to a goal, as `machine.aim` and `Route.placed`."""

from __future__ import annotations

from math import inf, sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ncfix.core.chain import PoseBatch, RouteSteps

    Array = NDArray[np.float64]
    Ints = NDArray[np.int64]

BATCH = 64
SHIFT, TURN = 0, 1
PARTS = 9
"""As in `core.chain`."""


def aim(
    perfect: RouteSteps,
    within: RouteSteps,
    behind: RouteSteps,
    batch: PoseBatch,
    axes: Ints,
    target: Array,
    close: float,
    flat: float,
    passes: int,
    out: Array,
) -> int:
    """Solve by Newton's method for all poses, as `machine.aim.aimed` with full steps.

    within, behind  the parts of a `route.SplitRoute`; the precomputed functions in `batch` are those of `behind`, then
                    those of `within`
    axes            the columns of X, Y and Z
    target          (3, n) goals, mm; (3, 0): the tips of the perfect machine
    close, flat     distance at which a tip has arrived, mm; volume of the derivatives below which there is no solution
    passes          largest number of steps
    out             (6, n) receives the positions of the axes, the distance from the goal before the first step, mm, the
                    largest squared angle of a small motion, rad^2, and 1 where the tip has arrived
    """
    n, work, tip, point = batch.n, batch.work, batch.tip, batch.spare
    ahead = batch.values + PARTS * within.steps
    right = batch.fits(perfect, 0) and batch.fits(behind, 0) and batch.fits(within, behind.given)
    right = right and batch.tip - batch.values >= PARTS * (within.steps + behind.steps) and perfect.part.shape[0] == 0
    right = right and batch.tip - batch.values >= PARTS * perfect.steps and target.shape[0] == 3
    right = right and target.shape[1] in (0, n) and out.shape[0] == 6 and out.shape[1] == n and axes.shape[0] == 3
    for i in range(axes.shape[0]):
        right = right and 0 <= axes[i] < batch.q.shape[0]
    if not right:
        raise IndexError("a route needs more than it is given")
    begin = 0
    while begin < n:
        count = min(BATCH, n - begin)
        batch.take_up(begin, count)
        perfect.set_goal(batch, count, target, begin, point)
        used = behind.work_out(batch, count, 0, ahead)
        behind.carry(batch, count, point, ahead, behind.steps)
        left = set_out(within, axes, batch, count, flat)
        for k in range(count):
            out[3, begin + k], out[4, begin + k], out[5, begin + k] = 0.0, work[point + 3, k], 0.0
        number = 0
        while left and number < passes:
            within.work_out(batch, count, used, batch.values)
            within.set_off(batch, count, tip)
            within.carry(batch, count, tip, batch.values, within.steps)
            left -= step_closer(axes, close, number == 0, batch, count, begin, out)
            number += 1
        for i in range(3):
            for k in range(count):
                out[i, begin + k] = work[axes[i], k]
        begin += BATCH
    return 0


def set_out(steps: RouteSteps, axes: Ints, batch: PoseBatch, count: int, flat: float) -> int:
    """Prepare the steps of a batch; returns how many of its poses have a solution.

    The spare rows of the batch hold the goals and the largest squared angle (4 rows), the inverse of the derivative of
    the tip (9), and the size of the previous gap, mm (1): -1 where there is no solution.
    """
    work, point, back, before, whole, total = (
        batch.work,
        batch.spare,
        batch.spare + 4,
        batch.spare + 13,
        batch.tip,
        batch.tip + 1,
    )
    left = 0
    for i in range(3):
        steps.follow(batch, axes[i], count, back + 3 * i)
    for k in range(count):
        ax, ay, az = work[back, k], work[back + 1, k], work[back + 2, k]
        bx, by, bz = work[back + 3, k], work[back + 4, k], work[back + 5, k]
        cx, cy, cz = work[back + 6, k], work[back + 7, k], work[back + 8, k]
        px, py, pz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        qx, qy, qz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
        rx, ry, rz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        size = ax * px + ay * py + az * pz
        share = 1 / size if size != 0 else inf
        work[whole, k] = size
        work[back, k], work[back + 1, k], work[back + 2, k] = px * share, py * share, pz * share
        work[back + 3, k], work[back + 4, k], work[back + 5, k] = qx * share, qy * share, qz * share
        work[back + 6, k], work[back + 7, k], work[back + 8, k] = rx * share, ry * share, rz * share
        work[total, k] = work[point, k] + work[point + 1, k] + work[point + 2, k]
    for i in range(batch.q.shape[0]):
        for k in range(count):
            work[total, k] = work[total, k] + work[i, k]
    for k in range(count):
        possible = abs(work[total, k]) < inf and not abs(work[whole, k]) < flat
        work[before, k] = 0.0 if possible else -1.0
        left += 1 if possible else 0
    return left


def step_closer(axes: Ints, close: float, begins: bool, batch: PoseBatch, count: int, begin: int, out: Array) -> int:
    """Take one Newton step; returns how many tips have arrived with it."""
    work, gap, point, back, last, arrived = batch.work, batch.tip, batch.spare, batch.spare + 4, batch.spare + 13, 0
    for i in range(3):
        for k in range(count):
            work[gap + i, k] = work[gap + i, k] - work[point + i, k]
    for i in range(3):
        q, row = axes[i], back + 3 * i
        for k in range(count):
            step = (
                work[row, k] * work[gap, k] + work[row + 1, k] * work[gap + 1, k] + work[row + 2, k] * work[gap + 2, k]
            )
            if work[last, k] >= 0 and out[5, begin + k] == 0:
                work[q, k] = work[q, k] - step
    for k in range(count):
        before, x, y, z = work[last, k], work[gap, k], work[gap + 1, k], work[gap + 2, k]
        size = sqrt(x * x + y * y + z * z)
        if before >= 0 and out[5, begin + k] == 0:
            if begins:
                out[3, begin + k] = size
            out[4, begin + k] = max(out[4, begin + k], work[gap + 3, k])
            if size < close or size * size < close * before:
                out[5, begin + k] = 1.0
                arrived += 1
            work[last, k] = size
    return arrived


def placed(perfect: RouteSteps, batch: PoseBatch, axes: Ints, ways_back: Array, target: Array, out: Array) -> int:
    """Positions of X Y Z of a perfect machine with the tips at `target` (3, n) mm, as `Route.placed`.

    axes       the columns of X, Y and Z; no rotary axis is between them in the chain
    ways_back  (3, 3) maps displacements of the tip to displacements of the axes
    out        (3, n) receives the positions, mm
    """
    work, tip, point, n, first = batch.work, batch.tip, batch.spare, batch.n, perfect.steps
    right = batch.fits(perfect, 0) and axes.shape[0] == 3 and ways_back.shape[0] == ways_back.shape[1] == 3
    right = right and perfect.part.shape[0] == 0 and batch.tip - batch.values >= PARTS * perfect.steps
    right = right and target.shape[0] == out.shape[0] == 3 and target.shape[1] == out.shape[1] == n
    for i in range(axes.shape[0]):
        right = right and 0 <= axes[i] < batch.q.shape[0]
    if not right:
        raise IndexError("a route needs more than it is given")
    for i in range(perfect.steps - 1, -1, -1):
        if perfect.kind[i] == SHIFT and is_one_of(perfect.axis[i], axes):
            first = i
    begin = 0
    while begin < n:
        count = min(BATCH, n - begin)
        batch.take_up(begin, count)
        perfect.set_off(batch, count, tip)
        perfect.carry(batch, count, tip, batch.values, first)
        for i in range(3):
            for k in range(count):
                work[point + i, k] = target[i, begin + k]
        for i in range(perfect.steps - 1, first - 1, -1):
            axis, j = perfect.axis[i], 3 * i
            if perfect.kind[i] == TURN:
                perfect.turn(batch, i, count, point, -1.0)
            elif not is_one_of(axis, axes):
                dx, dy, dz = perfect.direction[j], perfect.direction[j + 1], perfect.direction[j + 2]
                for k in range(count):
                    way = work[axis, k]
                    work[point, k] = work[point, k] - dx * way
                    work[point + 1, k] = work[point + 1, k] - dy * way
                    work[point + 2, k] = work[point + 2, k] - dz * way
        for i in range(3):
            a, b, c = ways_back[i, 0], ways_back[i, 1], ways_back[i, 2]
            for k in range(count):
                x, y, z = (
                    work[point, k] - work[tip, k],
                    work[point + 1, k] - work[tip + 1, k],
                    work[point + 2, k] - work[tip + 2, k],
                )
                out[i, begin + k] = a * x + b * y + c * z
        begin += BATCH
    return 0


def is_one_of(axis: int, axes: Ints) -> bool:
    """Whether a column is one of X, Y and Z."""
    return bool(axis == axes[0] or axis == axes[1] or axis == axes[2])
