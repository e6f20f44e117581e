"""Carrying points and directions through joints, exactly, many poses at a time.

Columns have shape (3, m, n): m points or directions, n poses. `weight` tells them apart: 1 for a point, 0 for a
direction, shape () or (m, 1). A pose is carried as four columns, three directions and an origin; a tool tip as one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.machine import se3
from ncfix.machine.axis import Axis
from ncfix.machine.se3 import Array

Weight = float | Array


def columns(*vectors: Sequence[float]) -> Array:
    """Constant vectors as columns, shape (3, m, 1)."""
    return np.array(vectors, dtype=np.float64).T[:, :, None]


def cross(a: Array, b: Array) -> Array:
    """The vector product along the first dimension."""
    ax, ay, az = a
    bx, by, bz = b
    x = ay * bz - az * by
    out = np.empty((3, *x.shape))
    out[0] = x
    np.subtract(az * bx, ax * bz, out=out[1])
    np.subtract(ax * by, ay * bx, out=out[2])
    return out


def advance(axis: Axis, position: Array, moved: Array, weight: Weight = 1.0) -> Array:
    """What is carried, after the axis went to `position` (n,): the nominal motion M."""
    direction = np.asarray(axis.direction)
    if not axis.rotary:
        return moved + direction[:, None, None] * position * weight if np.any(weight) else moved
    arm = moved - np.asarray(axis.point)[:, None, None] * weight
    turning = se3.skew(direction)
    flat = arm.reshape(3, -1)
    once = (turning @ flat).reshape(arm.shape)
    twice = (turning @ turning @ flat).reshape(arm.shape)
    result: Array = moved + np.sin(position) * once + (2 * np.sin(position / 2) ** 2) * twice
    return result


@dataclass(frozen=True, slots=True)
class SmallMotion:
    """A proper rigid motion near the identity: a rotation about `center`, then a translation. None is none.

    rotation     (3, 1, n) rotation vector, rad
    translation  (3, 1, n) mm
    center       (3, 1, n) mm
    """

    rotation: Array | None
    translation: Array | None
    center: Array

    def forth(self, moved: Array, weight: Weight = 1.0) -> Array:
        """Carry with it."""
        if self.rotation is not None:
            moved = moved + rotated_by(self.rotation, moved - self.center * weight)
        return moved if self.translation is None else moved + self.translation * weight

    def back(self, moved: Array, weight: Weight = 1.0) -> Array:
        """Undo it."""
        if self.translation is not None:
            moved = moved - self.translation * weight
        if self.rotation is not None:
            moved = moved + rotated_by(-self.rotation, moved - self.center * weight)
        return moved


def rotated_by(vector: Array, arm: Array) -> Array:
    """By how much a rotation vector moves the end of an arm: (R - 1) arm, without loss of digits for small angles."""
    first, second = se3.rotation_factors((vector * vector).sum(0))
    if vector.size == 3:
        turning = se3.skew(vector.ravel())
        matrix = first.ravel() * turning + second.ravel() * (turning @ turning)
        return (matrix @ arm.reshape(3, -1)).reshape(arm.shape)
    once = cross(vector, arm)
    result: Array = first * once + second * cross(vector, once)
    return result


def composed(motions: Sequence[tuple[Array, Array]], rotates: bool) -> SmallMotion:
    """One small motion from several about different reference points: (small motion (6, n), reference (3, 1, n)) each.

    The sum is taken of translations, of rotation vectors and of the velocities that the rotations cause, and its
    exponential is the motion: with one reference point it is exactly a rotation about that point.
    """
    values, center = motions[0]
    translation, rotation = values[:3, None], values[3:, None]
    rest: Array | None = None
    for other, reference in motions[1:]:
        translation = translation + other[:3, None]
        rotation = rotation + other[3:, None]
        moment = cross(reference - center, other[3:, None])
        rest = moment if rest is None else rest + moment
    if not rotates:
        return SmallMotion(None, translation, center)
    if rest is not None:
        translation = translation + _integrated(rotation, rest)
    return SmallMotion(rotation, translation if np.any(translation) else None, center)


def _integrated(vector: Array, velocity: Array) -> Array:
    """The translation of the screw with this rotation vector and velocity of the center."""
    squared = (vector * vector).sum(0)
    second, third = se3.rotation_factors(squared)[1], se3.screw_factor(squared)
    once = cross(vector, velocity)
    result: Array = velocity + second * once + third * cross(vector, once)
    return result
