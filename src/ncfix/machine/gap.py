"""How far the tip of a machine with errors is from where it shall be, at several positions of its axes at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from ncfix import fast
from ncfix.machine.loops import room
from ncfix.machine.route import Route, Turns
from ncfix.machine.se3 import Array
from ncfix.machine.state import Poses, behind_each_other
from ncfix.machine.steps import SMALL

Tips = Callable[[Route | None, Poses, Turns | None], Array]
"""The tip (3, n) by a route, or by the chain without one; sines and versines, if they are known."""


def gaps(
    perfect: Route, route: Route | None, tips: Tips, meant: Poses, done: Sequence[Poses], target: Array | None
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
    perfect: Route, route: Route | None, tips: Tips, meant: Poses, done: Sequence[Poses], target: Array | None
) -> Iterable[Array]:
    if route is not None and fast.engaged() and meant.positions.shape[1] > 1:
        found, angle = _compiled(perfect, route, meant, done, target)
        if not (angle >= SMALL).any():
            return found
    turns, turning = (route or perfect).turns(meant), list(perfect.rotary)
    goal = tips(perfect, meant, turns) if target is None else target
    alike = (np.array_equal(each.positions[turning], meant.positions[turning]) for each in done)
    both = zip(done, alike, strict=True)
    return [(tips(route, each, turns if same else None) - goal).T for each, same in both]


def _compiled(
    perfect: Route, route: Route, meant: Poses, done: Sequence[Poses], target: Array | None
) -> tuple[Array, Array]:
    """The same, (k, n, 3), compiled; and the largest squared angles of small motions that were met with, (k, n)."""
    from ncfix.machine import kernels

    kinds = [meant, *(each for each in done if each is not meant)]
    poses, n = behind_each_other(kinds), meant.positions.shape[1]
    given = route.columns(poses, route.turns(poses), route.terms.given(poses))
    goal = np.empty((3, 0)) if target is None else np.ascontiguousarray(target)
    sides = np.array([next(k for k, kind in enumerate(kinds) if kind is each) for each in done])
    out, angle = np.empty((len(done), n, 3)), np.empty((len(done), n))
    kernels.gaps(perfect.compiled, route.compiled, given, goal, sides, room(given, route.compiled), out, angle)
    return out, angle
