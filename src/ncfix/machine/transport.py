"""Carrying points and directions through joints, exactly, many poses at a time.

Columns have shape (3, m, n): m points or directions, n poses. `weight` tells them apart: 1 for a point, 0 for a
direction, shape () or (m, 1). A pose is carried as four columns, three directions and an origin; a tool tip as one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ncfix import fast
from ncfix.machine import se3
from ncfix.machine.axis import Axis
from ncfix.machine.se3 import Array

Weight = float | Array

SMALL = 0.08
"""rad; rotation vectors with such components are left to the power series, which is exact there."""


def columns(*vectors: Sequence[float]) -> Array:
    """Constant vectors as columns, shape (3, m, 1)."""
    return np.array(vectors, dtype=np.float64).T[:, :, None]


def cross(a: Array, b: Array) -> Array:
    """The vector product along the first dimension, (3, ...) each."""
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
    if _is_many(moved) and position.shape == moved.shape[2:]:
        from ncfix.machine import kernels

        constants = np.array(axis.direction, dtype=np.float64), np.array(axis.point, dtype=np.float64)
        out = np.empty_like(moved)
        kernels.advanced(*constants, *turn(position), moved, _weights(moved, weight), out)
        return out
    arm = moved - np.asarray(axis.point)[:, None, None] * weight
    once = cross_with(axis.direction, arm)
    sine, versine = turn(position)
    result: Array = moved + sine * once + versine * cross_with(axis.direction, once)
    return result


def _is_many(moved: Array) -> bool:
    """Whether compiled kernels are to take it: columns for each of many poses."""
    return fast.engaged() and moved.shape[2] > 1 and moved.flags.c_contiguous


def _weights(moved: Array, weight: Weight) -> Array:
    """The weight of each column, (m,)."""
    return np.broadcast_to(np.asarray(weight, dtype=np.float64).reshape(-1), moved.shape[1:2]).copy()


def turn(angle: Array) -> tuple[Array, Array]:
    """Sine and versine (1 - cosine) of angles, to some 1e-16; the versine without loss of digits for small ones.

    By the tangent of half the angle: one function for both, and one that numpy works out eight at a time where it can.
    """
    half = np.tan(angle / 2)
    sine: Array = 2 * half / (1 + half * half)
    return sine, half * sine


def dot(direction: Sequence[float], vector: Array) -> Array:
    """The scalar product of a constant direction and vectors (3, ...), summed in the order of the components."""
    x, y, z = direction
    result: Array = x * vector[0] + y * vector[1] + z * vector[2]
    return result


def cross_with(direction: Sequence[float], arm: Array) -> Array:
    """The vector product of a constant direction, often one of the base axes, and arms (3, ...)."""
    x, y, z = direction
    out = np.empty_like(arm)
    for place, (first, second) in enumerate(((y, z), (z, x), (x, y))):
        following, last = arm[(place + 2) % 3], arm[(place + 1) % 3]
        if first == 0.0:
            np.multiply(last, -second, out=out[place])
        elif second == 0.0:
            np.multiply(following, first, out=out[place])
        else:
            np.subtract(first * following, second * last, out=out[place])
    return out


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
        if self._varies_like(moved):
            from ncfix.machine import kernels

            out = np.empty_like(moved)
            kernels.forth(*self._rows, moved, _weights(moved, weight), out)
            return out
        if self.rotation is not None:
            moved = _turned(self.rotation, self.center, moved, weight)
        return moved if self.translation is None else moved + self.translation * weight

    def back(self, moved: Array, weight: Weight = 1.0) -> Array:
        """Undo it."""
        if self._varies_like(moved):
            from ncfix.machine import kernels

            out = np.empty_like(moved)
            kernels.back(*self._rows, moved, _weights(moved, weight), out)
            return out
        if self.translation is not None:
            moved = moved - self.translation * weight
        if self.rotation is not None:
            moved = _turned(-self.rotation, self.center, moved, weight)
        return moved

    def _varies_like(self, moved: Array) -> bool:
        """Whether rotation and translation differ from pose to pose, as the compiled kernels have it."""
        if self.rotation is None or self.translation is None or not _is_many(moved):
            return False
        same = self.rotation.shape == self.translation.shape == (3, 1, moved.shape[2])
        return same and bool(np.abs(self.rotation).max() < SMALL)

    @property
    def _rows(self) -> tuple[Array, Array, Array]:
        """Rotation, translation and center, (3, n) each, contiguous."""
        assert self.rotation is not None
        assert self.translation is not None
        center = np.broadcast_to(self.center, self.rotation.shape)
        rotation, translation, center = map(_first_row, (self.rotation, self.translation, center))
        return rotation, translation, center


def _first_row(vectors: Array) -> Array:
    return np.ascontiguousarray(vectors[:, 0])


def _turned(vector: Array, center: Array, moved: Array, weight: Weight) -> Array:
    """What is carried, after a small rotation about a center."""
    if vector.size == 3 and center.size == 3 and _is_many(moved):
        from ncfix.machine import kernels

        first, second = (factor.item() for factor in se3.rotation_factors((vector * vector).sum(0)))
        weights = _weights(moved, weight)
        out = np.empty_like(moved)
        kernels.turned(vector.ravel(), first, second, center.ravel(), moved, weights, out)
        return out
    return moved + rotated_by(vector, moved - center * weight)


def rotated_by(vector: Array, arm: Array) -> Array:
    """By how much a rotation vector (3, ...) moves the end of an arm (3, ...): (R - 1) arm, to all digits if small."""
    first, second = se3.rotation_factors((vector * vector).sum(0))
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
