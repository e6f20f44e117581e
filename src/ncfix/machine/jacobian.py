"""First order: how the tool moves relative to the workpiece when an axis moves or a joint errs.

Everything is taken at the nominal pose. A twist of a joint is [ex ey ez ea eb ec], mm and rad, along and about its
error axes, at its reference point (`Axis.reference`, carried along by the axis). A result is [dx dy dz rx ry rz] of
the tool tip relative to the workpiece, in the workpiece frame: what `Machine.error` gives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.machine.axis import BASE_AXES, ORIGIN, Axis, Tool
from ncfix.machine.se3 import Array
from ncfix.machine.state import Poses
from ncfix.machine.transport import advance, columns, cross


@dataclass(frozen=True, slots=True)
class Jacobians:
    """Derivatives at the nominal pose.

    axes    (..., 6, n_axes) by the axis positions, per mm or rad
    joints  (..., 6, n_joints, 6) by the error twists of the joints: axes in machine order, then the spindle
    """

    axes: Array
    joints: Array


def axis_jacobian(axes: tuple[Axis, ...], tool: Tool, poses: Poses) -> Array:
    """By the axis positions, poses last: (6, n_axes, n)."""
    tip, joints = _in_workpiece_frame(axes, tool, poses, with_errors=False)
    columns = np.empty((6, len(axes), poses.positions.shape[1]))
    for index, axis in enumerate(axes):
        direction, point = joints[index][:, 0], joints[index][:, 1]
        column = _turning(direction, tip - point) if axis.rotary else _shifting(direction)
        columns[:, index] = -column if axis.workpiece_side else column
    return columns


def joint_jacobian(axes: tuple[Axis, ...], tool: Tool, poses: Poses) -> Array:
    """By the error twists of the joints, poses last: (6, n_joints, 6, n)."""
    tip, joints = _in_workpiece_frame(axes, tool, poses, with_errors=True)
    columns = np.empty((6, len(axes) + 1, 6, poses.positions.shape[1]))
    for index, own in enumerate(joints):
        sign = -1.0 if index < len(axes) and axes[index].workpiece_side else 1.0
        arm = tip - own[:, 3]
        for k in range(3):
            columns[:, index, k] = sign * _shifting(own[:, k])
            columns[:, index, 3 + k] = sign * _turning(own[:, k], arm)
    return columns


def _shifting(direction: Array) -> Array:
    return np.concatenate([direction, np.zeros_like(direction)])


def _turning(direction: Array, arm: Array) -> Array:
    return np.concatenate([cross(direction, arm), direction])


def _in_workpiece_frame(
    axes: tuple[Axis, ...], tool: Tool, poses: Poses, with_errors: bool
) -> tuple[Array, list[Array]]:
    """The tip (3, n), and the vectors of each joint (3, 2 or 4, n), the spindle last.

    All of them are carried together, one growing bundle of columns: each joint adds its own where it stands.
    """
    tip = np.moveaxis(tool.tip(poses.tool_length), -1, 0)[:, None, :]
    bundle, weight = _joined(tip, np.ones((1, 1)), *_spindle_vectors(tool, with_errors))
    order = [len(axes)]
    for index in reversed(range(len(axes))):
        axis, position = axes[index], poses.positions[index]
        own, own_weight = _error_vectors(axis, position) if with_errors else _line_vectors(axis)
        if axis.workpiece_side:
            bundle, weight = _joined(bundle, weight, own, own_weight)
            bundle = advance(axis, -position, bundle, weight)
        else:
            bundle = advance(axis, position, bundle, weight)
            bundle, weight = _joined(bundle, weight, own, own_weight)
        order.append(index)
    bundle = np.broadcast_to(bundle, (3, bundle.shape[1], poses.positions.shape[1]))
    size = 4 if with_errors else 2
    starts = {joint: 1 + size * place for place, joint in enumerate(order)}
    return bundle[:, 0], [bundle[:, starts[joint] : starts[joint] + size] for joint in range(len(order))]


def _line_vectors(axis: Axis) -> tuple[Array, Array]:
    """Direction and point of an axis line: where its motion leaves them."""
    return columns(axis.direction, axis.point), np.array([[0.0], [1.0]])


def _error_vectors(axis: Axis, position: Array) -> tuple[Array, Array]:
    """Error axes and reference point of a joint, in the frame of its body's zero position."""
    triad = columns(*axis.error_axes)
    if axis.moving_frame:
        triad = advance(axis, position, triad, weight=0.0)
    reference = advance(axis, position, columns(axis.reference))
    return _joined(triad, np.zeros((3, 1)), reference, np.ones((1, 1)))


def _spindle_vectors(tool: Tool, with_errors: bool) -> tuple[Array, Array]:
    if not with_errors:
        return columns(ORIGIN, ORIGIN), np.zeros((2, 1))
    return columns(*BASE_AXES, tool.point), np.array([[0.0], [0.0], [0.0], [1.0]])


def _joined(bundle: Array, weight: Array, own: Array, own_weight: Array) -> tuple[Array, Array]:
    n = max(bundle.shape[-1], own.shape[-1])
    both = [np.broadcast_to(part, (3, part.shape[1], n)) for part in (bundle, own)]
    return np.concatenate(both, axis=1), np.concatenate([weight, own_weight])
