"""Where the tool tip of a machine with errors is beside where it shall be, and the linear axes that bring it there.

They are found by Newton's method on the exact model. The derivative is that of the machine without small motions: they
change it by parts in ten thousand only, so each pass gains about as many digits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from ncfix import core
from ncfix.arrays import Array, Index, Mask
from ncfix.machine.route import Route, SplitRoute, Turns, batch_of
from ncfix.machine.state import Poses, behind_each_other, some
from ncfix.machine.steps import SMALL, dot, has_arrived, volume
from ncfix.values import frozen

Tips = Callable[[Poses, Turns], tuple[Array, Array]]
"""Poses with their sines -> the tip (3, n), and the largest squared angle of a small motion (n,)."""
Vector = Sequence[float | Array]
"""Along x, y, z: columns (n,), or numbers where all poses have the same."""

CLOSE = 1e-6
"""mm; a tip that is expected to be closer to its target than 1 nm has arrived. A kink of an error between two passes
may leave some nanometres."""
FLAT = 1e-6
"""The volume spanned by the tip's motions per mm of X, Y and Z below which they do not reach every point."""
PASSES = 40
WHOLE_STEPS = 8
"""After so many passes the steps are halved: whole steps jump to and fro where the error has a jump or a kink."""


@frozen
class Aim:
    """Where the axes have to be, in columns.

    place    (3, n) of the linear axes, mm; where it began if they cannot bring the tip there
    arrived  (n,) the tip is where it should be, to 1 nm, beside a kink of an error to some nanometres
    off      (n,) mm: how far off the tip was where it began
    """

    place: Array
    arrived: Mask
    off: Array

    @classmethod
    def of(cls, n: int) -> Aim:
        """Room for n poses."""
        return cls(np.empty((3, n)), np.empty(n, dtype=np.bool_), np.empty(n))

    def put(self, rows: slice | Index, other: Aim) -> None:
        """Put in some poses."""
        self.place[:, rows], self.arrived[rows], self.off[rows] = other.place, other.arrived, other.off


def aimed(
    poses: Poses,
    axes: tuple[int, int, int],
    turns: Turns,
    tips: Tips,
    ways: Sequence[Vector],
    goal: Array,
    passes: int = PASSES,
) -> tuple[Aim, Array]:
    """Move three linear axes until the tip is at `goal` (3, n).

    axes   the columns of X, Y and Z
    turns  sines and versines of the rotary axes, which do not change
    tips   the tip of the machine with errors
    ways   how the tip follows each of the axes without them, mm per mm

    Also the largest squared angle of a small motion that was met with (n,).
    """
    with np.errstate(all="ignore"):
        whole, *normals = volume(*([np.atleast_1d(part) for part in way] for way in ways))
        back = [[part * (1 / whole) for part in normal] for normal in normals]
        usable = ~(np.abs(whole) < FLAT) & np.isfinite(goal.sum(0) + poses.positions.sum(0))
    q, (off, before, largest) = poses.positions.copy(), np.zeros((3, len(usable)))
    arrived = np.zeros(len(usable), dtype=bool)
    active = np.flatnonzero(usable)
    for number in range(passes):
        if not active.size:
            break
        everyone = active.size == len(usable)
        rows: slice | Index = slice(None) if everyone else active
        here = replace(poses, positions=q)
        here = here if everyone else here.part(active)
        tip, angle = tips(here, turns if everyone else (turns[0][:, active], turns[1][:, active]))
        gap = tip - goal[:, rows]
        for i, axis in enumerate(axes):
            step = dot([part if everyone else some(part, active) for part in back[i]], gap)
            q[axis, rows] -= step if number < WHOLE_STEPS else step / 2
        size = np.sqrt(dot(gap, gap))
        if number == 0:
            off[rows] = size
        largest[rows] = np.maximum(largest[rows], angle)
        done = has_arrived(size, before[rows], CLOSE)
        before[rows] = size
        arrived[active[done]] = True
        active = active[~done]
    return Aim(q[list(axes)], arrived, off), largest


def aimed_ahead(poses: Poses, perfect: Route, split: SplitRoute, target: Array | None) -> tuple[Aim, Index]:
    """Move three linear axes until the tip is at `target` (3, n); None: where a perfect machine has it.

    What they do not change is undone once, ahead of all passes; so only the rest is gone through in each.

    Also the poses that it is not for: they need more passes, or small motions are large.
    """
    within, turns = split.within, split.within.turns(poses)
    if core.engaged() and poses.positions.shape[1] > 1:
        aim, largest = _compiled(poses, perfect, split, turns, target)
    else:
        goal = perfect.tips(poses, turns)[0] if target is None else target
        goal, angle = split.behind.carried(poses, turns, goal)
        aim, largest = aimed(poses, split.axes, turns, within.tips, within.ways(split.axes, turns), goal, WHOLE_STEPS)
        largest = np.maximum(largest, angle)
    return aim, np.flatnonzero(~aim.arrived | (largest >= SMALL))


def _compiled(poses: Poses, perfect: Route, split: SplitRoute, turns: Turns, target: Array | None) -> tuple[Aim, Array]:
    """By compiled loops; also the largest squared angle of a small motion (n,)."""
    from ncfix.core import aim

    within, behind = split.within, split.behind
    given = within.terms.given(poses)
    batch = batch_of(poses, turns, [*behind.terms.given(poses), *given], within, behind)
    out = np.empty((6, poses.positions.shape[1]))
    goal = np.empty((3, 0)) if target is None else np.ascontiguousarray(target)
    routes, axes = (perfect.compiled, within.compiled, behind.compiled), np.array(split.axes, dtype=np.int64)
    aim.aim(*routes, batch, axes, goal, CLOSE, FLAT, WHOLE_STEPS, out)
    return Aim(out[:3], out[5] > 0, out[3]), out[4]


RouteTips = Callable[[Route | None, Poses, Turns | None], Array]
"""The tip (3, n) by a route, or by the chain without one; sines and versines, if they are known."""


def gaps(
    perfect: Route, route: Route | None, tips: RouteTips, meant: Poses, done: Sequence[Poses], target: Array | None
) -> list[Array]:
    """Where the tip is with the axes at each of `done` by a route, minus `target` (n, 3): (n, 3) mm each.

    target  where a perfect machine has the tip as `meant`, if not given
    """
    found = [np.empty((meant.positions.shape[1], 3)) for _ in done]
    for part, goal in meant.chunks():
        here = [goal if each is meant else each.part(part) for each in done]
        there = None if target is None else target[part].T
        for out, gap in zip(found, _gaps(perfect, route, tips, goal, here, there), strict=True):
            out[part] = gap
    return found


def _gaps(
    perfect: Route, route: Route | None, tips: RouteTips, meant: Poses, done: Sequence[Poses], target: Array | None
) -> Iterable[Array]:
    if route is not None and core.engaged() and meant.positions.shape[1] > 1:
        found, angle = _compiled_gaps(perfect, route, meant, done, target)
        if not (angle >= SMALL).any():
            return found
    turns, turning = (route or perfect).turns(meant), list(perfect.rotary)
    goal = tips(perfect, meant, turns) if target is None else target
    alike = (np.array_equal(each.positions[turning], meant.positions[turning]) for each in done)
    both = zip(done, alike, strict=True)
    return [(tips(route, each, turns if same else None) - goal).T for each, same in both]


def _compiled_gaps(
    perfect: Route, route: Route, meant: Poses, done: Sequence[Poses], target: Array | None
) -> tuple[Array, Array]:
    """As `_gaps`, (k, n, 3), compiled; and the largest squared angles of small motions that were met with, (k, n)."""
    from ncfix.core import chain

    kinds = [meant, *(each for each in done if each is not meant)]
    poses, n = behind_each_other(kinds), meant.positions.shape[1]
    batch = batch_of(poses, route.turns(poses), route.terms.given(poses), route, perfect)
    goal = np.empty((3, 0)) if target is None else np.ascontiguousarray(target)
    sides = np.array([next(k for k, kind in enumerate(kinds) if kind is each) for each in done], dtype=np.int64)
    out, angle = np.empty((len(done), n, 3)), np.empty((len(done), n))
    chain.gaps(perfect.compiled, route.compiled, batch, goal, sides, out, angle)
    return out, angle
