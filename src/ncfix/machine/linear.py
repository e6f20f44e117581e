"""First-order model: Jacobians of the tool pose by axis positions and joint errors, and the design matrix.

All derivatives are taken at the nominal pose. A twist of a joint is [ex ey ez ea eb ec], mm and rad, along and about
its error axes, at its reference point (`Axis.reference`, carried along by the axis). A result is [dx dy dz rx ry rz] of
the tool tip relative to the workpiece, in the workpiece frame, as `Machine.error` returns it.

A small motion of a joint's body is written as a twist (v, w) about the base origin, in base axes with all joints
nearer to the foundation at zero. For the joint's Jacobian it is converted to its reference point and error axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

import numpy as np

from ncfix.arrays import Array
from ncfix.machine.axes import BASE_AXES, ORIGIN, Axis, Effect, GaugeLine, Vector
from ncfix.machine.chain import advance, columns, cross, turned_with
from ncfix.machine.error_model import (
    Dependence,
    Slot,
    SmallMotionKind,
    dependence_of,
    joint_index,
    slot_of,
    unit_motion,
)
from ncfix.machine.state import Poses, Signal
from ncfix.values import frozen


@frozen
class Jacobians:
    """Derivatives at the nominal pose.

    axes    (..., 6, n_axes) by the axis positions, per mm or rad
    joints  (..., 6, n_joints, 6) by the error twists of the joints: axes in machine order, then the spindle
    """

    axes: Array
    joints: Array


def axis_jacobian(axes: tuple[Axis, ...], tool: GaugeLine, poses: Poses) -> Array:
    """(6, n_axes, n) derivative of the tool pose by the axis positions, poses last."""
    tip, joints = _in_workpiece_frame(axes, tool, poses, range(len(axes)), with_errors=False)
    columns = np.empty((6, len(axes), poses.positions.shape[1]))
    for index, axis in enumerate(axes):
        direction, point = joints[index][:, 0], joints[index][:, 1]
        column = _turning(direction, tip - point) if axis.rotary else _shifting(direction)
        columns[:, index] = -column if axis.workpiece_side else column
    return columns


def joint_jacobian(axes: tuple[Axis, ...], tool: GaugeLine, poses: Poses, joints: Sequence[int]) -> Array:
    """(6, n_joints, 6, n) derivative of the tool pose by the error twists of some joints, poses last."""
    tip, vectors = _in_workpiece_frame(axes, tool, poses, joints, with_errors=True)
    columns = np.empty((6, len(joints), 6, poses.positions.shape[1]))
    for place, (joint, own) in enumerate(zip(joints, vectors, strict=True)):
        sign = -1.0 if joint < len(axes) and axes[joint].workpiece_side else 1.0
        arm = tip - own[:, 3]
        for k in range(3):
            columns[:, place, k] = sign * _shifting(own[:, k])
            columns[:, place, 3 + k] = sign * _turning(own[:, k], arm)
    return columns


def _shifting(direction: Array) -> Array:
    return np.concatenate([direction, np.zeros_like(direction)])


def _turning(direction: Array, arm: Array) -> Array:
    return np.concatenate([cross(direction, arm), direction])


def _in_workpiece_frame(
    axes: tuple[Axis, ...], tool: GaugeLine, poses: Poses, joints: Sequence[int], with_errors: bool
) -> tuple[Array, list[Array]]:
    """The tip (3, n), and the vectors of each of these joints, (3, 2 or 4, n), in the workpiece frame.

    The vectors are direction and point of the axis; or `with_errors`, the three error axes and the reference point. The
    spindle is the last joint. All vectors are carried together in one bundle of columns, to which each joint adds its
    own.
    """
    bundle, weight = np.moveaxis(tool.tip(poses.tool_length), -1, 0)[:, None, :], np.ones((1, 1))
    size = 4 if with_errors else 2
    own_weight = np.eye(size)[:, -1:]  # of directions, and a point
    order: list[int] = []
    if len(axes) in joints:
        bundle, weight = _joined(bundle, weight, columns(*BASE_AXES, tool.point), own_weight)
        order.append(len(axes))
    for index in reversed(range(len(axes))):
        axis, position = axes[index], poses.positions[index]
        if not axis.workpiece_side:
            bundle = advance(axis, position, bundle, weight)
        if index in joints:
            own = _error_vectors(axis, position) if with_errors else columns(axis.direction, axis.point)
            bundle, weight = _joined(bundle, weight, own, own_weight)
            order.append(index)
        if axis.workpiece_side:
            bundle = advance(axis, -position, bundle, weight)
    bundle = np.broadcast_to(bundle, (3, bundle.shape[1], poses.positions.shape[1]))
    starts = {joint: 1 + size * place for place, joint in enumerate(order)}
    return bundle[:, 0], [bundle[:, starts[joint] : starts[joint] + size] for joint in joints]


def _error_vectors(axis: Axis, position: Array) -> Array:
    """(3, 4, n or 1) error axes and reference point of a joint, in the frame of its body's zero position."""
    triad, reference = columns(*axis.error_axes), advance(axis, position, columns(axis.reference))
    if axis.moving_frame:
        triad = advance(axis, position, triad, weight=0.0)
    return _joined(triad, np.zeros((3, 1)), reference, np.ones((1, 1)))[0]


def _joined(bundle: Array, weight: Array, own: Array, own_weight: Array) -> tuple[Array, Array]:
    n = max(bundle.shape[-1], own.shape[-1])
    both = [np.broadcast_to(part, (3, part.shape[1], n)) for part in (bundle, own)]
    return np.concatenate(both, axis=1), np.concatenate([weight, own_weight])


@frozen(slots=False)
class Dependences:
    """The distinct dependences on the state of several effects.

    ways  each dependence once
    own   for each effect, the number of its dependence in `ways`
    """

    ways: tuple[Dependence, ...]
    own: tuple[int, ...]

    @staticmethod
    def of(axes: tuple[Axis, ...], effects: Sequence[Effect]) -> Dependences:
        """The dependences of these effects."""
        numbers: dict[object, int] = {}
        own: list[int] = []
        ways: list[Dependence] = []
        for e in effects:
            signal = e.joint, e.input, e.range, e.center, e.scale, e.time_constant_s
            key = e.basis, *signal, e.times, e.times_center, e.times_scale  # cheaper to compare than to make one
            if key not in numbers:
                numbers[key] = len(ways)
                ways.append(dependence_of(axes, e))
            own.append(numbers[key])
        return Dependences(tuple(ways), tuple(own))

    @property
    def signals(self) -> frozenset[Signal]:
        """All signals that the dependences need."""
        return frozenset().union(*(each.signals for each in self.ways))


def joint_errors(axes: tuple[Axis, ...], tool: GaugeLine, effects: Sequence[Effect], poses: Poses) -> Array:
    """See `Machine.joint_errors`; poses last: (n_joints, 6, n)."""
    errors = np.zeros((len(axes) + 1, 6, poses.positions.shape[1]))
    for effect in effects:
        value = np.asarray(effect.coefficients) @ dependence_of(axes, effect).rows(poses)
        errors[joint_index(axes, effect)] += unit_twist(axes, tool, effect, poses) * value
    return errors


@frozen(repr=False, eq=False, slots=False)
class UnitResponses:
    """The responses of the tool pose to effects of 1 mm or 1 rad at some poses; each is computed when first asked for.

    jacobians  cache: joint -> (6, 6, n) derivative by its error twist
    found      cache: what an effect moves, by its name and frame -> (6, n) response
    """

    axes: tuple[Axis, ...]
    tool: GaugeLine
    poses: Poses
    jacobians: dict[int, Array] = field(default_factory=dict)
    found: dict[tuple[str, Vector | None, bool], Array] = field(default_factory=dict)

    def of(self, effects: Sequence[Effect]) -> list[Array]:
        """The response of each effect, (6, n), poses last."""
        new = sorted({joint_index(self.axes, effect) for effect in effects} - set(self.jacobians))
        if new:
            jacobian = joint_jacobian(self.axes, self.tool, self.poses, new)
            self.jacobians.update(zip(new, np.moveaxis(jacobian, 1, 0), strict=True))
        return [self._of(effect) for effect in effects]

    def _of(self, effect: Effect) -> Array:
        key = effect.name, effect.reference, effect.carried
        if key not in self.found:
            twist = unit_twist(self.axes, self.tool, effect, self.poses)
            twist = np.broadcast_to(twist, (6, self.poses.positions.shape[1]))
            self.found[key] = np.einsum("ijn,jn->in", self.jacobians[joint_index(self.axes, effect)], twist)
        return self.found[key]


def design(responses: Sequence[Array], shared: Dependences, poses: Poses) -> Array:
    """See `Machine.design`: effects with these responses (r, n) to 1 mm or 1 rad; poses last: (r, k, n).

    shared  how the effects depend on the state
    """
    curves = [way.rows(poses) for way in shared.ways]
    ends = np.cumsum([0, *(len(curves[k]) for k in shared.own)]).tolist()
    found = np.empty((len(responses[0]) if responses else 6, ends[-1], poses.positions.shape[1]))
    for response, own, start, end in zip(responses, shared.own, ends[:-1], ends[1:], strict=True):
        np.multiply(response[:, None], curves[own], out=found[:, start:end])
    return found


def unit_twist(axes: tuple[Axis, ...], tool: GaugeLine, effect: Effect, poses: Poses) -> Array:
    """(6, n or 1) twist of the joint by an effect of 1 mm or 1 rad, at its reference point in its error axes."""
    slot, motion = slot_of(axes, tool, effect), unit_motion(axes, effect)
    if slot.joint == len(axes):
        triad, (velocity, turned) = BASE_AXES, _at(columns(tool.point), _twist(motion, columns(slot.reference)))
    else:
        axis, position = axes[slot.joint], poses.positions[slot.joint]
        triad, reference = axis.error_axes, advance(axis, position, columns(axis.reference))
        velocity, turned = _at(reference, _joint_twist(axis, position, slot, motion))
        if axis.moving_frame:
            velocity, turned = (advance(axis, -position, part, weight=0.0) for part in (velocity, turned))
    return np.concatenate([np.asarray(triad) @ part[:, 0] for part in (velocity, turned)])


def _joint_twist(axis: Axis, position: Array, slot: Slot, motion: Array) -> Array:
    """(6, 1, n or 1) twist of the body about the base origin by a small motion (6,) of an axis."""
    if slot.sort is SmallMotionKind.MOTION:
        turned = turned_with(axis, position, motion[:, None])
        return _twist(turned, advance(axis, position, columns(slot.reference)))
    fixed = _twist(motion, columns(slot.reference))
    if slot.sort is SmallMotionKind.CARRIED:
        return fixed
    along = slice(3, 6) if axis.rotary else slice(0, 3)
    direction = np.asarray(axis.direction)
    share = float(direction @ motion[along])
    across = motion.copy()
    across[along] -= share * direction
    line = _twist(across, columns(slot.reference))
    own = axis.zero_sense * share * np.concatenate(axis.screw)[:, None, None]
    velocity, turned = (advance(axis, position, part, weight=0.0) for part in (line[:3], line[3:]))
    origin = advance(axis, position, columns(ORIGIN))
    velocity, turned, origin = np.broadcast_arrays(velocity, turned, origin)
    carried = np.concatenate([velocity + cross(origin, turned), turned])  # the adjoint of the nominal motion
    return line - carried + own


def _twist(motion: Array, reference: Array) -> Array:
    """(6, 1, n) a small motion (6,) or (6, n) about a reference point, as a twist (v, w) about the base origin."""
    shifted, turned = motion[:3].reshape(3, 1, -1), motion[3:].reshape(3, 1, -1)
    velocity = shifted + cross(reference, turned)
    return np.concatenate([velocity, np.broadcast_to(turned, velocity.shape)])


def _at(point: Array, twist: Array) -> tuple[Array, Array]:
    """The velocity of a point (3, 1, n) under a twist (6, 1, n), and the rotation."""
    velocity = twist[:3] + cross(twist[3:], np.broadcast_to(point, np.broadcast_shapes(twist[3:].shape, point.shape)))
    return velocity, np.broadcast_to(twist[3:], velocity.shape)
