"""The rules of docs/conventions.md once more, one pose at a time, with pytransform3d for every motion.

Written to be obviously right, not fast; nothing of ncfix is used but the plain data of `Machine`.
"""

from __future__ import annotations

import numpy as np
from pytransform3d.rotations import matrix_from_axis_angle, matrix_from_compact_axis_angle
from pytransform3d.transformations import invert_transform, transform_from, transform_from_exponential_coordinates

from ncfix.machine import Axis, Effect, Machine

Array = np.ndarray


def nominal(machine: Machine, q: Array, length: float) -> Array:
    """`workpiece_from_tool` of the perfect machine at one pose."""
    return actual(machine.replace(effects=()), q, length)


def actual(machine: Machine, q: Array, length: float) -> Array:
    """`workpiece_from_tool` of the machine with its errors at one pose; effects of axis positions only."""
    tool = work = np.eye(4)
    for index in range(len(machine.axes)):
        axis = machine.axes[index]
        if not axis.workpiece_side:
            tool = tool @ body(machine, axis, q[index])
    for index in reversed(range(len(machine.axes))):
        axis = machine.axes[index]
        if axis.workpiece_side:
            work = work @ body(machine, axis, q[index])
    tool = tool @ spindle(machine)
    tip = np.asarray(machine.tool.point) - length * np.asarray(machine.tool.direction)
    offset = transform_from(np.eye(3), machine.workpiece_offset)
    return invert_transform(work @ offset) @ tool @ transform_from(np.eye(3), tip)


def body(machine: Machine, axis: Axis, position: float) -> Array:
    """B = Lc L E M(q + offset) inverse(L)."""
    effects = [effect for effect in machine.effects if effect.joint == axis.name]
    moving = [effect for effect in effects if not effect.location]
    location = [effect for effect in effects if effect.location and not effect.carried]
    carried = [effect for effect in effects if effect.location and effect.carried]
    straight = {id(effect): component_vectors(axis, effect, position) for effect in effects}
    offset = 0.0
    for effect in location:
        shift, turn = straight[id(effect)]
        along = float((turn if axis.rotary else shift) @ axis.direction)
        against = min(np.asarray(row) @ axis.direction for row in axis.error_axes) < -1 + 1e-9
        offset += -along if against else along
        part = along * np.asarray(axis.direction)
        straight[id(effect)] = (shift, turn - part) if axis.rotary else (shift - part, turn)
    still = [(reference_of(axis, effect), *straight[id(effect)]) for effect in location]
    outer = [(reference_of(axis, effect), *straight[id(effect)]) for effect in carried]
    carried_along = motion(axis, position)
    error = [(apply(carried_along, reference_of(axis, effect)), *straight[id(effect)]) for effect in moving]
    line = small(still)
    return small(outer) @ line @ small(error) @ motion(axis, position + offset) @ invert_transform(line)


def spindle(machine: Machine) -> Array:
    """The small motion at the end of the tool branch."""
    terms = []
    for effect in machine.effects:
        if effect.joint == "S":
            vector = value(effect, 0.0) * np.eye(3)[effect.component % 3]
            pair = (np.zeros(3), vector) if effect.rotational else (vector, np.zeros(3))
            terms.append((np.asarray(effect.reference or machine.tool.point), *pair))
    return small(terms)


def motion(axis: Axis, position: float) -> Array:
    """The nominal motion of an axis."""
    direction = np.asarray(axis.direction)
    if not axis.rotary:
        return transform_from(np.eye(3), position * direction)
    turned = matrix_from_axis_angle(np.append(direction, position))
    return transform_from(turned, np.asarray(axis.point) - turned @ axis.point)


def small(terms: list[tuple[Array, Array, Array]]) -> Array:
    """The small motion of (reference, translation, rotation vector) terms: turned about the points, then shifted."""
    if not terms:
        return np.eye(4)
    turn = np.sum([rotation for _, _, rotation in terms], axis=0)
    shift = np.sum([translation for _, translation, _ in terms], axis=0)
    velocity = np.sum([np.cross(reference, rotation) for reference, _, rotation in terms], axis=0)
    turning = transform_from_exponential_coordinates(np.concatenate([turn, velocity]))
    assert np.allclose(turning[:3, :3], matrix_from_compact_axis_angle(turn), atol=1e-15)
    return transform_from(np.eye(3), shift) @ turning


def component_vectors(axis: Axis, effect: Effect, position: float) -> tuple[Array, Array]:
    """Translation and rotation vector of an effect in base axes."""
    place = np.rad2deg(position) if axis.rotary else position
    vector = value(effect, place) * np.asarray(axis.error_axes)[effect.component % 3]
    if axis.moving_frame and axis.rotary and not effect.location:
        vector = motion(axis, position)[:3, :3] @ vector
    return (np.zeros(3), vector) if effect.rotational else (vector, np.zeros(3))


def value(effect: Effect, position: float) -> float:
    """The size of a constant or polynomial effect at a position in mm or degree."""
    if effect.basis.name == "constant":
        return effect.coefficients[0]
    u = (position - effect.center) / effect.scale
    return sum(c * u**power for c, power in zip(effect.coefficients, effect.basis.degree, strict=True))


def reference_of(axis: Axis, effect: Effect) -> Array:
    """Where its rotations cause no translation, axes at zero."""
    if effect.reference is not None:
        return np.asarray(effect.reference)
    return np.asarray(axis.point) if axis.rotary else np.zeros(3)


def apply(transform: Array, place: Array) -> Array:
    """A point moved."""
    return transform[:3, :3] @ place + transform[:3, 3]
