"""The gap between actual and intended tool tip, and the linear axis positions that bring the tip to a point.

The positions are found by Newton's method on the exact model. The derivative is that of the machine without errors,
which change it by parts in ten thousand only; so each pass gains about four digits.
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
"""(poses, sines) -> the tip (3, n), and the largest squared angle of a small motion (n,)."""
Vector = Sequence[float | Array]
"""Components x, y, z: columns (n,), or one number that is valid for all poses."""

CLOSE = 1e-6
"""Expected distance, mm, below which a tip has arrived at its target: 1 nm. A kink of an error between two passes may
leave some nanometres."""
FLAT = 1e-6
"""Volume spanned by the motions of the tip per mm of X, Y and Z below which they do not reach every point."""
PASSES = 40
WHOLE_STEPS = 8
"""Number of passes after which the steps are halved: whole steps oscillate at a jump or a kink of the error."""


@frozen
class Aim:
    """Positions of three linear axes that bring the tip to its target, in columns.

    place    (3, n) positions of the linear axes, mm; the start positions if they cannot bring the tip there
    arrived  (n,) the tip is at its target, to 1 nm; near a kink of an error, to some nanometres
    off      (n,) distance of the tip from its target at the start positions, mm
    """

    place: Array
    arrived: Mask
    off: Array

    @classmethod
    def of(cls, n: int) -> Aim:
        """An uninitialised result for n poses."""
        return cls(np.empty((3, n)), np.empty(n, dtype=np.bool_), np.empty(n))

    def put(self, rows: slice | Index, other: Aim) -> None:
        """Put the results of poses `rows` in place."""
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
    """Move three linear axes until the tip is at `goal` (3, n), mm.

    axes   the columns of X, Y and Z
    turns  sines and versines of the rotary axes, which do not change
    tips   the tip of the machine with errors
    ways   derivative of the tip by each of the axes on the machine without errors, mm per mm

    Also (n,) the largest squared angle of a small motion in any pass, rad^2.
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
    """Move three linear axes until the tip is at `target` (3, n), mm; None: the tip of a perfect machine.

    The steps of the route that these axes do not change are undone once, before all passes, so that each pass goes
    through the other steps only.

    Also the numbers of the poses for which this is not sufficient: they need more passes, or have large small motions.
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
    """`aimed_ahead` by compiled loops; also (n,) the largest squared angle of a small motion, rad^2."""
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
"""(route; None: the chain, poses, sines and versines if known) -> the tip (3, n), mm."""


def gaps(
    perfect: Route, route: Route | None, tips: RouteTips, meant: Poses, done: Sequence[Poses], target: Array | None
) -> list[Array]:
    """For each of `done`: (n, 3) the tip with the axes there, by `route`, minus `target` (n, 3), mm.

    target  None: the tip of a perfect machine at `meant`
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
    """(k, n, 3) like `_gaps`, compiled; and (k, n) the largest squared angles of small motions, rad^2."""
    from ncfix.core import chain

    kinds = [meant, *(each for each in done if each is not meant)]
    poses, n = behind_each_other(kinds), meant.positions.shape[1]
    batch = batch_of(poses, route.turns(poses), route.terms.given(poses), route, perfect)
    goal = np.empty((3, 0)) if target is None else np.ascontiguousarray(target)
    sides = np.array([next(k for k, kind in enumerate(kinds) if kind is each) for each in done], dtype=np.int64)
    out, angle = np.empty((len(done), n, 3)), np.empty((len(done), n))
    chain.gaps(perfect.compiled, route.compiled, batch, goal, sides, out, angle)
    return out, angle
