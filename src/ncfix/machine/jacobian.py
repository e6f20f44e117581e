"""First order: how the tool moves relative to the workpiece when an axis moves or a joint errs.

Everything is taken at the nominal pose. A twist of a joint is [ex ey ez ea eb ec], mm and rad, along and about its
error axes, at its reference point (`Axis.reference`, carried along by the axis). A result is [dx dy dz rx ry rz] of
the tool tip relative to the workpiece, in the workpiece frame: what `Machine.error` gives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.machine.axis import Axis, Tool
from ncfix.machine.se3 import Array
from ncfix.machine.state import Poses
from ncfix.machine.transport import advance, columns, cross

TIP, PER_JOINT = 1, 6


@dataclass(frozen=True, slots=True)
class Jacobians:
    """Derivatives at the nominal pose.

    axes    (..., 6, n_axes) by the axis positions, per mm or rad
    joints  (..., 6, n_joints, 6) by the error twists of the joints: axes in machine order, then the spindle
    """

    axes: Array
    joints: Array


def nominal_jacobians(axes: tuple[Axis, ...], tool: Tool, poses: Poses) -> tuple[Array, Array]:
    """Both derivatives with the poses last: (6, n_axes, n) and (6, n_joints, 6, n)."""
    tip, lines, triads = _in_workpiece_frame(axes, tool, poses)
    n = poses.positions.shape[1]
    by_axis, by_joint = np.empty((6, len(axes), n)), np.empty((6, len(axes) + 1, 6, n))
    for index, axis in enumerate(axes):
        sign = -1.0 if axis.workpiece_side else 1.0
        direction, point = lines[index]
        by_axis[:, index] = sign * (_turning(direction, tip - point) if axis.rotary else _shifting(direction))
    for index, (triad, reference) in enumerate(triads):
        sign = -1.0 if index < len(axes) and axes[index].workpiece_side else 1.0
        for k in range(3):
            by_joint[:, index, k] = sign * _shifting(triad[:, k])
            by_joint[:, index, 3 + k] = sign * _turning(triad[:, k], tip - reference)
    return by_axis, by_joint


def _shifting(direction: Array) -> Array:
    return np.concatenate([direction, np.zeros_like(direction)])


def _turning(direction: Array, arm: Array) -> Array:
    return np.concatenate([cross(direction, arm), direction])


def _in_workpiece_frame(
    axes: tuple[Axis, ...], tool: Tool, poses: Poses
) -> tuple[Array, list[tuple[Array, Array]], list[tuple[Array, Array]]]:
    """The tip; direction and point of each axis line; error axes and reference point of each joint.

    All of them are carried together, one growing bundle of columns: each joint adds its own where it stands.
    """
    bundle, weight = _spindle_bundle(tool, poses)
    order = list(range(len(axes), len(axes) + 1))
    for index in reversed(range(len(axes))):
        axis, position = axes[index], poses.positions[index]
        own, own_weight = _joint_bundle(axis, position)
        if axis.workpiece_side:
            bundle, weight = _joined(bundle, weight, own, own_weight)
            bundle = advance(axis, -position, bundle, weight)
        else:
            bundle = advance(axis, position, bundle, weight)
            bundle, weight = _joined(bundle, weight, own, own_weight)
        order.append(index)
    n = poses.positions.shape[1]
    bundle = np.broadcast_to(bundle, (3, bundle.shape[1], n))
    return _unpacked(bundle, order)


def _unpacked(bundle: Array, order: list[int]) -> tuple[Array, list[tuple[Array, Array]], list[tuple[Array, Array]]]:
    starts = {joint: TIP + PER_JOINT * place for place, joint in enumerate(order)}
    lines, triads = [], []
    for joint in range(len(order)):
        start = starts[joint]
        triads.append((bundle[:, start : start + 3], bundle[:, start + 3]))
        lines.append((bundle[:, start + 4], bundle[:, start + 5]))
    return bundle[:, 0], lines, triads


def _spindle_bundle(tool: Tool, poses: Poses) -> tuple[Array, Array]:
    tip = np.moveaxis(tool.tip(poses.tool_length), -1, 0)[:, None, :]
    zero = (0.0, 0.0, 0.0)
    own = columns((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), tool.point, zero, zero)
    return _joined(tip, np.ones((1, 1)), own, _weights())


def _joint_bundle(axis: Axis, position: Array) -> tuple[Array, Array]:
    """Error axes and reference point, direction and point of the axis line, in the zero position frame of the joint."""
    triad = columns(*axis.error_axes)
    if axis.moving_frame:
        triad = advance(axis, position, triad, weight=0.0)
    reference = advance(axis, position, columns(axis.reference))
    parts = (triad, reference, columns(axis.direction, axis.point))
    n = max(part.shape[-1] for part in parts)
    return np.concatenate([np.broadcast_to(p, (*p.shape[:2], n)) for p in parts], axis=1), _weights()


def _weights() -> Array:
    return np.array([0.0, 0.0, 0.0, 1.0, 0.0, 1.0])[:, None]


def _joined(bundle: Array, weight: Array, own: Array, own_weight: Array) -> tuple[Array, Array]:
    n = max(bundle.shape[-1], own.shape[-1])
    both = [np.broadcast_to(part, (*part.shape[:2], n)) for part in (bundle, own)]
    return np.concatenate(both, axis=1), np.concatenate([weight, own_weight])
