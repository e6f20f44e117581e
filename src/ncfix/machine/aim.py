"""Bringing the tool tip of a machine with errors to a point by its linear axes: Newton's method on the exact model.

The derivative is that of the perfect machine: errors change it by parts in ten thousand only, so each pass gains about
as many digits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ncfix import fast
from ncfix.machine.loops import room
from ncfix.machine.se3 import Array
from ncfix.machine.state import Poses
from ncfix.machine.steps import SMALL, dot, has_arrived, volume

if TYPE_CHECKING:
    from ncfix.machine.route import Route

Mask = NDArray[np.bool_]
Turns = tuple[Array, Array]
Tips = Callable[[Poses, Turns], Array]
"""Poses with their sines -> the tip (3, n)."""

CLOSE = 1e-6
"""mm; a tip that is expected to be closer to its target than 1 nm has arrived."""
FLAT = 1e-6
"""The volume spanned by the tip's motions per mm of X, Y and Z below which they do not reach every point."""
PASSES = 40
WHOLE_STEPS = 8
"""After so many passes the steps are halved: whole steps jump to and fro where the error has a jump or a kink."""


@dataclass(frozen=True, slots=True)
class Aim:
    """Where the axes have to be, in columns.

    place    (3, n) of the linear axes, mm; where it began if they cannot bring the tip there
    arrived  (n,) the tip is where it should be, to 1 nm
    gap      (3, n) actual tip minus target where it began, mm
    """

    place: Array
    arrived: Mask
    gap: Array


def aimed(
    poses: Poses, axes: tuple[int, int, int], perfect: Route, turns: Turns, tips: Tips, target: Array | None
) -> Aim:
    """Move three linear axes until the tip is at `target` (3, n); None: where a perfect machine has it.

    axes     the columns of X, Y and Z
    perfect  the route without errors
    turns    sines and versines of the rotary axes, which do not change
    tips     the tip of the machine with errors
    """
    goal = perfect.tips(poses, turns)[0] if target is None else target
    ways = perfect.follows(poses, axes, turns)
    with np.errstate(all="ignore"):
        whole, *normals = volume(*(ways[:, i] for i in range(3)))
        back = np.array(normals) * (1 / whole)
        usable = ~(np.abs(whole) < FLAT) & np.isfinite(goal.sum(0) + poses.positions.sum(0))
    q, gap = poses.positions.copy(), np.zeros_like(goal)
    arrived, before = np.zeros(q.shape[1], dtype=bool), np.zeros(q.shape[1])
    active = np.flatnonzero(usable)
    for number in range(PASSES):
        if not active.size:
            break
        everyone = active.size == q.shape[1]
        rows: slice | NDArray[np.intp] = slice(None) if everyone else active
        here = replace(poses, positions=q) if everyone else taken(poses, q, active)
        off = tips(here, turns if everyone else (turns[0][:, active], turns[1][:, active])) - goal[:, rows]
        if number == 0:
            gap[:, rows] = off
        for i, axis in enumerate(axes):
            step = dot(back[i][:, rows], off)
            q[axis, rows] -= step if number < WHOLE_STEPS else step / 2
        size = np.sqrt(dot(off, off))
        done = has_arrived(size, before[rows], CLOSE)
        before[rows] = size
        arrived[active[done]] = True
        active = active[~done]
    return Aim(q[list(axes)], arrived, gap)


def aimed_at_once(
    poses: Poses, axes: tuple[int, int, int], perfect: Route, route: Route, target: Array | None
) -> tuple[Aim, Mask]:
    """As `aimed`, compiled, and which poses (n,) it is not for: they need more passes, or small motions are large."""
    from ncfix.machine import kernels

    given, out = route.columns(poses, route.turns(poses)), np.empty((8, poses.positions.shape[1]))
    goal = np.empty((3, 0)) if target is None else np.ascontiguousarray(target)
    limits, columns = np.array([CLOSE, FLAT, WHOLE_STEPS]), np.array(axes, dtype=np.int64)
    kernels.aim(perfect.compiled, route.compiled, given, columns, goal, limits, room(route.compiled, given), out)
    arrived = out[7] > 0
    return Aim(out[:3], arrived, out[3:6]), ~arrived | (out[6] >= SMALL)


def at_once(route: Route, poses: Poses, axes: tuple[int, int, int]) -> bool:
    """Whether compiled kernels are to take it: nothing that comes from elsewhere changes with the linear axes."""
    return fast.engaged() and poses.positions.shape[1] > 1 and not route.terms.see(axes)


def taken(poses: Poses, q: Array, rows: NDArray[np.intp]) -> Poses:
    """Some of the poses, with positions from q (n_axes, n)."""
    return Poses(
        q[:, rows],
        _rows(poses.tool_length, rows),
        _rows(poses.direction, rows),
        {name: values[rows] for name, values in poses.inputs.items()},
    )


def _rows(values: Array, rows: NDArray[np.intp]) -> Array:
    return values if values.shape[-1] == 1 else values[..., rows]
