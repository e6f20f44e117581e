"""The error model to first order: linear in the coefficients. The one place where a design matrix is made.

A small motion of a joint's body is written as a twist (v, w) about the base origin, in base axes with all joints
nearer to the foundation at zero; the joint's Jacobian wants it at its reference point in its error axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.machine.axis import BASE_AXES, ORIGIN, Axis, Tool, Triad
from ncfix.machine.basis import Basis
from ncfix.machine.effect import Effect
from ncfix.machine.error_model import Slot, Sort, direction_axis, joint_index, signals_of, slot_of, unit_motion
from ncfix.machine.jacobian import joint_jacobian
from ncfix.machine.se3 import Array
from ncfix.machine.signals import Signal, inputs_of
from ncfix.machine.state import Poses
from ncfix.machine.transport import advance, columns, cross


@dataclass(frozen=True, slots=True)
class Course:
    """How an error goes with the state, whichever component it is: functions of one signal, perhaps times another.

    direction_axis  whose direction of motion the functions need; -1: none
    """

    basis: Basis
    signal: Signal | None
    factor: Signal | None
    direction_axis: int

    @property
    def signals(self) -> frozenset[Signal]:
        """Those that it needs."""
        return frozenset(each for each in (self.signal, self.factor) if each is not None)

    @property
    def inputs(self) -> frozenset[str]:
        """The state inputs that must be given."""
        return inputs_of(self.signals)

    def rows(self, poses: Poses) -> Array:
        """The functions at these poses, times the factor: shape (k, n)."""
        n = poses.positions.shape[1]
        u = np.zeros(n) if self.signal is None else np.broadcast_to(self.signal.u(poses, self.basis.domain), (n,))
        way = poses.direction[self.direction_axis] if self.direction_axis >= 0 else 0.0
        found = self.basis.rows(u, np.broadcast_to(way, (n,)))
        return found if self.factor is None else found * self.factor.u(poses, (-np.inf, np.inf))


@dataclass(frozen=True)
class Shared:
    """The courses of many effects: each of them once, and the number of every effect's own."""

    courses: tuple[Course, ...]
    own: tuple[int, ...]

    @staticmethod
    def of(axes: tuple[Axis, ...], effects: Sequence[Effect]) -> Shared:
        """Those of these effects."""
        numbers: dict[object, int] = {}
        own: list[int] = []
        courses: list[Course] = []
        for effect in effects:
            key = _course_key(effect)
            if key not in numbers:
                numbers[key] = len(courses)
                courses.append(course_of(axes, effect))
            own.append(numbers[key])
        return Shared(tuple(courses), tuple(own))

    @property
    def signals(self) -> frozenset[Signal]:
        """All that they need."""
        return frozenset().union(*(each.signals for each in self.courses))


def course_of(axes: tuple[Axis, ...], effect: Effect) -> Course:
    """How an effect goes with the state."""
    return Course(effect.basis, *signals_of(axes, effect), direction_axis(axes, effect))


def _course_key(effect: Effect) -> tuple[object, ...]:
    """What the course depends on; cheaper to compare than a course is to make."""
    e = effect
    where = e.joint, e.input, e.range, e.center, e.scale, e.time_constant_s
    return e.basis, *where, e.times, e.times_center, e.times_scale


def joint_errors(axes: tuple[Axis, ...], tool: Tool, effects: Sequence[Effect], poses: Poses) -> Array:
    """See `Machine.joint_errors`; poses last: (n_joints, 6, n)."""
    errors = np.zeros((len(axes) + 1, 6, poses.positions.shape[1]))
    for effect in effects:
        value = np.asarray(effect.coefficients) @ course_of(axes, effect).rows(poses)
        errors[joint_index(axes, effect)] += unit_twist(axes, tool, effect, poses) * value
    return errors


def design(axes: tuple[Axis, ...], tool: Tool, effects: Sequence[Effect], shared: Shared, poses: Poses) -> Array:
    """See `Machine.design`; `shared` are the courses of the effects; poses last: (6, k, n)."""
    n = poses.positions.shape[1]
    by_joint = joint_jacobian(axes, tool, poses)
    responses: dict[object, Array] = {}
    curves = [course.rows(poses) for course in shared.courses]
    ends = np.cumsum([0, *(len(curves[k]) for k in shared.own)]).tolist()
    found = np.empty((6, ends[-1], n))
    for effect, own, start, end in zip(effects, shared.own, ends[:-1], ends[1:], strict=True):
        seen = (effect.name, effect.reference, effect.carried)
        if seen not in responses:
            twist = np.broadcast_to(unit_twist(axes, tool, effect, poses), (6, n))
            responses[seen] = np.einsum("ijn,jn->in", by_joint[:, joint_index(axes, effect)], twist)
        np.multiply(responses[seen][:, None], curves[own], out=found[:, start:end])
    return found


def unit_twist(axes: tuple[Axis, ...], tool: Tool, effect: Effect, poses: Poses) -> Array:
    """What an effect of 1 mm or 1 rad does to its joint, at its reference point in its error axes: (6, n) or (6, 1)."""
    slot, motion = slot_of(axes, tool, effect), unit_motion(axes, effect)
    if slot.joint == len(axes):
        return _seen(_twist(motion, columns(slot.reference)), columns(tool.point), BASE_AXES, None, None)
    axis, position = axes[slot.joint], poses.positions[slot.joint]
    reference = advance(axis, position, columns(axis.reference))
    moving = position if axis.moving_frame else None
    return _seen(_joint_twist(axis, position, slot, motion), reference, axis.error_axes, axis, moving)


def _joint_twist(axis: Axis, position: Array, slot: Slot, motion: Array) -> Array:
    """The twist about the base origin, (6, 1, n) or (6, 1, 1)."""
    if slot.sort is Sort.MOTION:
        turned = motion
        if axis.moving_frame:
            pair = columns(tuple(motion[:3]), tuple(motion[3:]))
            turned = np.concatenate(list(np.moveaxis(advance(axis, position, pair, weight=0.0), 1, 0)))
        return _twist(turned, advance(axis, position, columns(slot.reference)))
    fixed = _twist(motion, columns(slot.reference))
    if slot.sort is Sort.CARRIED:
        return fixed
    along = slice(3, 6) if axis.rotary else slice(0, 3)
    direction = np.asarray(axis.direction)
    share = float(direction @ motion[along])
    across = motion.copy()
    across[along] -= share * direction
    line = _twist(across, columns(slot.reference))
    own = axis.zero_sense * share * np.concatenate(axis.screw)[:, None, None]
    return line - _carried(axis, position, line) + own


def _twist(motion: Array, reference: Array) -> Array:
    """A small motion about a reference point as a twist (v, w) about the base origin: (6,) or (6, n) -> (6, 1, n)."""
    shifted, turned = motion[:3].reshape(3, 1, -1), motion[3:].reshape(3, 1, -1)
    velocity = shifted + cross(reference, turned)
    return np.concatenate([velocity, np.broadcast_to(turned, velocity.shape)])


def _carried(axis: Axis, position: Array, twist: Array) -> Array:
    """A twist carried along by the nominal motion of the axis: the adjoint of M applied to it."""
    velocity, turned = (advance(axis, position, part, weight=0.0) for part in (twist[:3], twist[3:]))
    origin = advance(axis, position, columns(ORIGIN))
    velocity, turned, origin = np.broadcast_arrays(velocity, turned, origin)
    return np.concatenate([velocity + cross(origin, turned), turned])


def _seen(twist: Array, point: Array, triad: Triad, axis: Axis | None, moving: Array | None) -> Array:
    """The twist at a point, in a triad that may turn with its axis."""
    velocity = twist[:3] + cross(twist[3:], np.broadcast_to(point, np.broadcast_shapes(twist[3:].shape, point.shape)))
    turned = np.broadcast_to(twist[3:], velocity.shape)
    if axis is not None and moving is not None:
        velocity, turned = (advance(axis, -moving, part, weight=0.0) for part in (velocity, turned))
    rows = np.asarray(triad)
    return np.concatenate([rows @ velocity[:, 0], rows @ turned[:, 0]])
