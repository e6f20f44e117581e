"""Routes: the kinematic chain from tool tip to workpiece as a list of numbers, which `steps` evaluates.

Motions that are the same at all poses (location errors, zero offsets, the workpiece offset) are merged into the steps
when the route is made: each is moved ahead of all steps before it, which are transformed by it, up to the tool tip. So
a pose costs little more than on a machine without such errors.

Powers and harmonics of axis positions are evaluated along the route. All other functions are evaluated by their bases
as columns, and added to the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ncfix import core
from ncfix.arrays import Array
from ncfix.machine import se3, steps
from ncfix.machine.axes import Axis, GaugeLine, Vector
from ncfix.machine.basis import ConstantBasis, Fourier, Polynomial
from ncfix.machine.chain import JointModel, SmallMotion, columns, lies_on_axis, turn
from ncfix.machine.error_model import EffectGroup, ErrorModel, Slot
from ncfix.machine.piecewise import PiecewiseConstant, PiecewiseLinear, Spline
from ncfix.machine.state import Poses, Signal
from ncfix.machine.steps import BACK, FORTH, GIVEN, PARTS, POWERS, SHIFT, TURN, WAVES, Functions, Number, Steps
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.core.chain import PoseBatch, RouteSteps

SUMS = (PiecewiseLinear, Spline, PiecewiseConstant)
"""Bases that evaluate weighted sums of their functions directly, without the single functions."""
BATCH = 64
"""Number of poses that the compiled core takes at a time."""
CACHE_LINE = 8
"""Number of floats in a cache line; aligned memory is faster."""
ANY = (1.0, -np.inf, np.inf, 0.0, 1.0)
"""The signal numbers (see `Functions.signal`) of an unchanged position."""
ClampedAngle = tuple[int, float, float]
"""(axis, low, high): a rotary axis whose harmonics are held at the ends of a range, rad."""


@frozen
class SmallMotionPlace:
    """A small motion of a route: the slots whose sum it is, and the rotation from base axes to the axes of the step."""

    slots: tuple[Slot, ...]
    turn: Array


@frozen
class Terms:
    """Functions of a route that are evaluated by their bases, and rotary axes that are clamped.

    groups  groups with their gains (m, k), if the basis evaluates weighted sums; None: single functions
    held    axes whose harmonics are held at the ends of a range
    """

    groups: tuple[tuple[EffectGroup, Array | None], ...]
    held: tuple[ClampedAngle, ...]

    def see(self, axes: Sequence[int]) -> bool:
        """Whether any of these functions depends on the position of one of the axes."""
        return any(group.changes_with(axes) for group, _ in self.groups)

    def given(self, poses: Poses) -> list[Array]:
        """The functions or sums that bases evaluate at these poses, (n,) or (1,) each, in order."""
        found: list[Array] = []
        for group, gains in self.groups:
            u, way = group.arguments(poses)
            values = group.basis.rows(u, way) if gains is None else group.basis.combine(gains, u, way)
            found += list(group.times_factor(values, poses))
        return found


@frozen
class _Part:
    """A group of effects as numbers: its functions, and their gains (parts, functions) to the small motions."""

    family: int
    axis: int
    signal: tuple[float, ...]
    orders: tuple[int, ...]
    gains: Array


def terms_of(
    axes: tuple[Axis, ...], groups: Sequence[EffectGroup], places: Sequence[SmallMotionPlace], held: list[ClampedAngle]
) -> tuple[Functions, Terms]:
    """The functions of the small motions at `places`, and those that bases evaluate; new clamped axes go to `held`."""
    parts: list[_Part] = []
    given: list[tuple[EffectGroup, Array | None]] = []
    for group in groups:
        gains = _gains(group, places)
        if not gains.any():
            continue
        signal, basis = group.signal, group.basis
        if group.factor is not None:
            parts.append(_given(group, gains, given))
        elif isinstance(basis, ConstantBasis):
            parts.append(_Part(POWERS, 0, ANY, (0,), gains))
        elif signal is None or signal.axis is None or signal.constant_s:
            parts.append(_given(group, gains, given))
        elif type(basis) is Polynomial and not signal.endless:
            numbers = signal.unit, signal.low, signal.high, signal.center, signal.scale
            parts.append(_sorted(_Part(POWERS, signal.axis, numbers, basis.degree, gains), 1))
        elif type(basis) is Fourier and (signal.center, signal.scale) == (0.0, 1.0) and axes[signal.axis].rotary:
            parts.append(_sorted(_Part(WAVES, _wave_row(len(axes), signal, held), ANY, basis.order, gains), 2))
        else:
            parts.append(_given(group, gains, given))
    first = np.cumsum([0, *(len(part.orders) for part in parts)])
    gains = np.concatenate([part.gains for part in parts], axis=1) if parts else np.zeros((0, 0))
    to, function = np.nonzero(gains)
    functions = Functions(
        np.array([part.family for part in parts], dtype=np.int64),
        np.array([part.axis for part in parts], dtype=np.int64),
        np.array([part.signal for part in parts], dtype=np.float64).ravel(),
        first.astype(np.int64),
        np.array([order for part in parts for order in part.orders], dtype=np.int64),
        to.astype(np.int64),
        function.astype(np.int64),
        gains[to, function],
    )
    return functions, Terms(tuple(given), tuple(held))


def _gains(group: EffectGroup, places: Sequence[SmallMotionPlace]) -> Array:
    """(PARTS * places, functions) the gains of the functions of a group to the numbers of all small motions."""
    gains = np.zeros((len(places), PARTS, group.gains.shape[-1]))
    for total, place in zip(gains, places, strict=True):
        for slot in place.slots:
            if slot in group.slots:
                way, turn = np.split(group.gains[group.slots.index(slot)], 2)
                arm = np.subtract(slot.reference, place.slots[0].reference)
                parts = way, turn, np.cross(arm, turn, axisb=0, axisc=0)
                total += np.concatenate([place.turn @ each for each in parts])
    return gains.reshape(-1, gains.shape[-1])


def _sorted(part: _Part, width: int) -> _Part:
    """The part with its functions in ascending order; there are `width` functions of each order."""
    order = np.argsort(part.orders, kind="stable")
    take = (width * order[:, None] + np.arange(width)).ravel()
    orders = tuple(part.orders[i] for i in order.tolist() for _ in range(width))
    return replace(part, orders=orders, gains=part.gains[:, take])


def _wave_row(rows: int, signal: Signal, held: list[ClampedAngle]) -> int:
    """The row of sines for a harmonic: that of its axis, or of the axis held at the ends of a range."""
    assert signal.axis is not None
    if not np.isfinite([signal.low, signal.high]).any():
        return signal.axis
    hold = signal.axis, signal.low * signal.unit, signal.high * signal.unit
    if hold not in held:
        held.append(hold)
    return rows + held.index(hold)


def _given(group: EffectGroup, gains: Array, given: list[tuple[EffectGroup, Array | None]]) -> _Part:
    """A group whose basis evaluates its functions, or its weighted sums; it is added to `given`."""
    if not isinstance(group.basis, SUMS):
        given.append((group, None))
        return _Part(GIVEN, 0, ANY, (0,) * gains.shape[1], gains)
    rows = np.flatnonzero(gains.any(axis=1))
    given.append((group, np.ascontiguousarray(gains[rows])))
    return _Part(GIVEN, 0, ANY, (0,) * len(rows), (np.arange(len(gains))[:, None] == rows).astype(np.float64))


Turns = tuple[Array, Array]
"""(sines, versines) of rotary axes, see `Route.turns`; the versine is 1 - cosine."""


@frozen(slots=False)
class Route:
    """The steps of a machine from the tool tip to the workpiece.

    plain   steps and functions as lists, for columns of poses
    arrays  the same as arrays, for the compiled core
    terms   the functions that bases evaluate
    rotary  the columns of the rotary axes
    """

    plain: tuple[Steps, Functions]
    arrays: tuple[Steps, Functions]
    terms: Terms
    rotary: tuple[int, ...]

    @cached_property
    def compiled(self) -> RouteSteps:
        """The steps in the form of the compiled core."""
        from ncfix.core import chain

        return chain.RouteSteps(*self.arrays[0], *self.arrays[1])

    def __getstate__(self) -> dict[str, Any]:
        """The state without the compiled form, which cannot be copied to another process."""
        return {name: value for name, value in self.__dict__.items() if name != "compiled"}

    def tips(self, poses: Poses, turns: Turns | None = None) -> tuple[Array, Array]:
        """(3, n) the tip, mm, and (n,) the largest squared angle of a small motion, rad^2; `turns`, if known."""
        turns = turns or self.turns(poses)
        n = poses.positions.shape[1]
        if core.engaged() and n > 1:
            from ncfix.core import chain

            batch, out = batch_of(poses, turns, self.terms.given(poses), self), np.empty((4, n))
            chain.tips(self.compiled, batch, out)
            return out[:3], out[3]
        return self.carried(poses, turns, steps.at_tip(self.plain[0], poses.tool_length))

    def carried(self, poses: Poses, turns: Turns, point: Sequence[Array] | Array) -> tuple[Array, Array]:
        """Like `tips`, for any point (3, n) instead of the tip, not compiled."""
        legs, functions = self.plain
        results, values = [0.0] * len(functions.order), [0.0] * (PARTS * (1 + max(legs.small, default=-1)))
        steps.work_out_functions(functions, poses.positions, *turns, self.terms.given(poses), results)
        steps.add_up(functions, results, values)
        n = poses.positions.shape[1]
        found, largest = np.empty((3, n)), np.zeros(n)
        found[0], found[1], found[2], largest = steps.carried(legs, values, point, poses.positions, *turns, largest)
        return found, largest

    def ways(self, axes: Sequence[int], turns: Turns) -> list[tuple[Number, Number, Number]]:
        """The derivative of the tip by linear axes, mm per mm, without small motions: x, y, z for each axis.

        Each is a column (n,), or one number if it is the same at all poses.
        """
        return [steps.follows(self.plain[0], axis, *turns) for axis in axes]

    def xyz_for_tip(self, poses: Poses, axes: Sequence[int], back: Array, target: Array) -> Array:
        """(3, n) the positions of linear axes with the tip at `target` (3, n), mm; for a route without errors.

        back  (3, 3) inverse of `ways_together`
        """
        if core.engaged() and target.shape[1] > 1:
            from ncfix.core import aim

            batch, out = batch_of(poses, self.turns(poses), [], self), np.empty(target.shape)
            goal, columns = np.ascontiguousarray(target), np.array(axes, dtype=np.int64)
            aim.placed(self.compiled, batch, columns, back, goal, out)
            return out
        x, y, z = target
        way = steps.brought_back(self.plain[0], axes, x, y, z, poses.tool_length, poses.positions, self.turns(poses))
        out = np.empty(target.shape)
        for row, each in zip(out, back.tolist(), strict=True):
            row[:] = steps.dot(each, way)
        return out

    def ways_together(self, axes: Sequence[int]) -> Array | None:
        """(3, axes) directions of linear axes as columns; None if an axis between them turns only some of them."""
        legs, found = self.plain[0], []
        for i, (kind, axis) in enumerate(zip(legs.kind, legs.axis, strict=True)):
            if kind == SHIFT and axis in axes:
                found.append((axes.index(axis), legs.direction[3 * i : 3 * i + 3]))
            elif kind == TURN and 0 < len(found) < len(axes):
                return None
        return np.array([direction for _, direction in sorted(found)]).T if len(found) == len(axes) else None

    def turns(self, poses: Poses) -> Turns:
        """(n_axes + k, n) sines and versines of the rotary axes, and of the k axes held at the ends of a range."""
        q, held = poses.positions, self.terms.held
        sine, versed = (np.empty((len(q) + len(held), q.shape[1])) for _ in range(2))
        for axis in self.rotary:
            sine[axis], versed[axis] = turn(q[axis])
        for row, (axis, low, high) in enumerate(held, start=len(q)):
            if q[axis].min(initial=low) >= low and q[axis].max(initial=high) <= high:
                sine[row], versed[row] = sine[axis], versed[axis]
            else:
                sine[row], versed[row] = turn(np.minimum(np.maximum(q[axis], low), high))
        return sine, versed


def batch_of(poses: Poses, turns: Turns, given: Sequence[Array], *routes: Route) -> PoseBatch:
    """Poses for the compiled core, with memory for these routes; `given`: the functions evaluated by their bases."""
    from ncfix.core import chain

    n = poses.positions.shape[1]
    others = np.array([np.broadcast_to(row, n) for row in given]).reshape(len(given), n)
    q, sine, versine, length = (np.ascontiguousarray(each) for each in (poses.positions, *turns, poses.tool_length))
    functions = max(len(route.plain[1].order) for route in routes)
    small = sum(len(route.plain[0].kind) for route in routes)
    rows = chain.rows_for(len(q), len(sine), len(others), functions, small)
    memory = np.zeros(rows * BATCH + CACHE_LINE)
    begin = -(memory.ctypes.data // memory.itemsize) % CACHE_LINE
    work = memory[begin : begin + rows * BATCH].reshape(rows, BATCH)
    return chain.PoseBatch(q, sine, versine, others, length, work, functions, small)


@frozen(slots=False)
class SplitRoute:
    """A route in two parts, for finding the linear axis positions that bring the tip to a point.

    axes    the columns of X, Y and Z
    within  the steps from the tip up to the last one that depends on these axes
    behind  the inverse of the further steps: it takes the target to where the tip must be after `within`
    """

    axes: tuple[int, int, int]
    within: Route
    behind: Route


def route_of(
    axes: tuple[Axis, ...], tool: GaugeLine, joints: tuple[JointModel, ...], model: ErrorModel | None, offset: Vector
) -> Route | None:
    """The route through joints with the errors of a model, or without errors; None if it cannot be written as steps.

    It cannot if the location of an axis changes from pose to pose, or if error motions of a rotary axis refer to
    several points one of which does not lie on the axis.
    """
    groups = () if model is None else model.groups
    path = _path(tool, joints, groups, offset, real=model is not None)
    return None if path is None else _written_out(axes, groups, *path, [])


def split_route_of(
    axes: tuple[Axis, ...], tool: GaugeLine, joints: tuple[JointModel, ...], model: ErrorModel, offset: Vector
) -> SplitRoute | None:
    """The route with errors, split for X, Y and Z.

    None without a route or these axes, or if functions evaluated by their bases depend on these axes.
    """
    path, names = _path(tool, joints, model.groups, offset, real=True), [axis.name for axis in axes]
    if path is None or not set(names).issuperset("XYZ"):
        return None
    moved, (start, links), held = (names.index("X"), names.index("Y"), names.index("Z")), path, list[ClampedAngle]()
    if _written_out(axes, model.groups, start, links, held).terms.see(moved):
        return None
    cut = 1 + max((i for i, link in enumerate(links) if link.changes_with(moved, model.groups)), default=-1)
    parts = links[:cut], [link.undone() for link in reversed(links[cut:])]
    within, behind = (_written_out(axes, model.groups, start, part, held) for part in parts)
    return SplitRoute(moved, within, behind)


def _path(
    tool: GaugeLine, joints: tuple[JointModel, ...], groups: tuple[EffectGroup, ...], offset: Vector, *, real: bool
) -> tuple[Array, list[Link]] | None:
    """The start of a route, as in `Steps`, and its steps, `real`: with errors; None if there is no route."""
    links: list[Link] = []
    for index in reversed(range(len(joints))):
        own = _forth(index, joints[index], groups) if real else _nominal(index, joints[index])
        if own is None:
            return None
        axis = joints[index].axis
        links += [link.undone() for link in reversed(own)] if axis is not None and axis.workpiece_side else own
    found, ahead = [], se3.shift(-np.asarray(offset))
    for link in reversed(links):  # motions that are the same at all poses are moved ahead of all others
        if link.rigid is not None:
            ahead = ahead @ link.rigid
        else:
            found.append(link.behind(ahead))
    start = ahead[:3, :3] @ tool.point + ahead[:3, 3], ahead[:3, :3] @ np.negative(tool.direction)
    return np.array(start), found[::-1]


def _written_out(
    axes: tuple[Axis, ...], groups: tuple[EffectGroup, ...], start: Array, links: list[Link], held: list[ClampedAngle]
) -> Route:
    """The route of these steps as numbers; clamped axes are added to `held`."""
    places = [SmallMotionPlace(link.slots, link.seen_from[:3, :3]) for link in links if link.slots]
    functions, terms = terms_of(axes, groups, places, held)
    small = np.cumsum([bool(link.slots) for link in links]) - 1
    legs = Steps(
        start.ravel(),
        np.array([link.kind for link in links], dtype=np.int64),
        np.array([link.axis for link in links], dtype=np.int64),
        np.array([link.direction for link in links]).ravel(),
        np.array([link.point for link in links]).ravel(),
        np.array([link.center for link in links]).ravel(),
        np.where([bool(link.slots) for link in links], small, -1).astype(np.int64),
        np.array([link.rotates for link in links], dtype=np.int64),
        np.array([len(link.slots) > 1 for link in links], dtype=np.int64),
    )
    listed = Steps(*(part.tolist() for part in legs)), Functions(*(part.tolist() for part in functions))
    return Route(listed, (legs, functions), terms, tuple(i for i, axis in enumerate(axes) if axis.rotary))


@frozen
class Link:
    """One step before it is written as numbers; `axis`, `direction`, `point` and `center` as in `Steps`.

    slots      the slots whose sum is the small motion; empty for other steps
    seen_from  (4, 4) transformation from the frame of the slots to that of the step
    rigid      (4, 4) a motion that is the same at all poses; then the other fields have no meaning
    """

    kind: int = SHIFT
    axis: int = -1
    direction: Array = field(default_factory=lambda: np.zeros(3))
    point: Array = field(default_factory=lambda: np.zeros(3))
    center: Array = field(default_factory=lambda: np.zeros(3))
    slots: tuple[Slot, ...] = ()
    rotates: bool = False
    seen_from: Array = field(default_factory=lambda: np.eye(4))
    rigid: Array | None = None

    def undone(self) -> Link:
        """The inverse step."""
        if self.rigid is not None:
            return replace(self, rigid=se3.inverse(self.rigid))
        other = BACK if self.kind == FORTH else FORTH
        return replace(self, kind=other) if self.slots else replace(self, direction=-self.direction)

    def changes_with(self, axes: Sequence[int], groups: tuple[EffectGroup, ...]) -> bool:
        """Whether the step moves along one of these axes, or is a small motion that depends on one."""
        if not self.slots:
            return self.axis in axes
        own = [group for group in groups if any(slot in group.slots for slot in self.slots)]
        return self.axis in axes or any(group.changes_with(axes) for group in own)

    def behind(self, motion: Array) -> Link:
        """The equivalent step if `motion` (4, 4) is done before it instead of after it."""
        turn, way = motion[:3, :3], motion[:3, 3]
        point, center = turn @ self.point + way, turn @ self.center + way
        return replace(self, direction=turn @ self.direction, point=point, center=center, seen_from=motion)


def _nominal(index: int, joint: JointModel) -> list[Link]:
    """The nominal motion of a joint, for all bodies outward of it."""
    axis = joint.axis
    if axis is None:
        return []
    return [Link(TURN if axis.rotary else SHIFT, index, np.asarray(axis.direction), np.asarray(axis.point))]


def _forth(index: int, joint: JointModel, groups: tuple[EffectGroup, ...]) -> list[Link] | None:
    """Like `_nominal`, with the errors of the joint; None if they cannot be written as steps."""
    placed = (*joint.location, *joint.carried)
    if any(slot in group.slots and group.signals for group in groups for slot in placed):
        return None
    moving = _error_motion(index, joint)
    if moving is None:
        return None
    small = {slot: np.zeros((6, 1)) for slot in placed}
    for group in groups:
        for slot in small.keys() & group.slots:
            small[slot] += group.gains[group.slots.index(slot)] @ group.basis.rows(np.zeros(1), np.zeros(1))
    line, zero = joint.axis_line(small)
    carried = joint.together(joint.carried, small, None)
    links = list(moving)
    if zero is not None and joint.axis is not None:
        links.insert(0, Link(rigid=joint.axis.motion(zero[0])))
    if line is not None:
        links = [Link(rigid=se3.inverse(_rigid(line))), *links, Link(rigid=_rigid(line))]
    return links if carried is None else [*links, Link(rigid=_rigid(carried))]


def _error_motion(index: int, joint: JointModel) -> list[Link] | None:
    """The nominal motion of a joint and its error motion, in the order in which the centre of the latter is fixed.

    The error motion of a linear axis, and one in a frame that turns with its axis, can be done before the motion of the
    axis, about its centre with all axes at zero. None if it cannot be written as steps.
    """
    axis, moved = joint.axis, _nominal(index, joint)
    if not joint.motion:
        return moved
    center = np.asarray(joint.motion[0].reference)
    small = Link(FORTH, center=center, slots=joint.motion, rotates=any(slot in joint.rotating for slot in joint.motion))
    if axis is None or not axis.rotary or axis.moving_frame:
        return [small, *moved]
    if not all(lies_on_axis(axis, columns(slot.reference)) for slot in joint.motion):
        if len(joint.motion) > 1:
            return None
        small = replace(small, axis=index, direction=moved[0].direction, point=moved[0].point)
    return [*moved, small]


def _rigid(small: SmallMotion) -> Array:
    """(4, 4) a small motion that is the same at all poses."""
    way, turn = (np.zeros(3) if part is None else part.ravel() for part in (small.translation, small.rotation))
    return se3.shift(way) @ se3.turn(turn, small.center.ravel())
