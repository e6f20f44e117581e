"""Rigid motions in batches: 4x4 matrices with any leading dimensions, right-handed, mm and rad.

Names read `a_from_b`: it takes coordinates in b to coordinates in a. A rotation vector is axis times angle.
Formulas: Lynch and Park, Modern Robotics (2017), sections 3.2 and 3.3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ncfix.arrays import Array

_SERIES_BELOW = 0.02
"""Squared angle below which five terms of a power series are exact to double precision."""


def rotation_factors(squared: Array) -> tuple[Array, Array]:
    """The factors of Rodrigues' formula for squared angles: sin a / a and (1 - cos a) / a^2."""
    x = np.minimum(squared, _SERIES_BELOW)
    first = 1 - x / 6 * (1 - x / 20 * (1 - x / 42 * (1 - x / 72)))
    second = 0.5 - x / 24 * (1 - x / 30 * (1 - x / 56 * (1 - x / 90)))
    small = squared < _SERIES_BELOW
    if small.all():
        return first, second
    angle = np.sqrt(np.maximum(squared, _SERIES_BELOW))
    return np.where(small, first, np.sin(angle) / angle), np.where(small, second, 2 * (np.sin(angle / 2) / angle) ** 2)


def screw_factor(squared: Array) -> Array:
    """The factor (a - sin a) / a^3 of a screw's translation, for squared angles a^2, rad^2, of any shape."""
    x = squared
    series = 1 / 6 - x / 120 * (1 - x / 42 * (1 - x / 72 * (1 - x / 110)))
    angle = np.sqrt(np.maximum(x, _SERIES_BELOW))
    return np.where(x < _SERIES_BELOW, series, (angle - np.sin(angle)) / angle**3)


def skew(vector: ArrayLike) -> Array:
    """The matrix that takes b to `vector x b`, shape (..., 3) -> (..., 3, 3)."""
    x, y, z = np.moveaxis(np.asarray(vector, dtype=np.float64), -1, 0)
    zero = np.zeros_like(x)
    rows = [np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)]
    return np.stack(rows, -2)


def rotation(vector: ArrayLike) -> Array:
    """The rotation of a rotation vector, shape (..., 3) [rad] -> (..., 3, 3)."""
    vector = np.asarray(vector, dtype=np.float64)
    first, second = rotation_factors((vector * vector).sum(-1))
    cross = skew(vector)
    return np.eye(3) + first[..., None, None] * cross + second[..., None, None] * (cross @ cross)


def rigid(rotation: ArrayLike, translation: ArrayLike) -> Array:
    """The rigid motion that rotates, then translates; shapes (..., 3, 3) and (..., 3) [mm] -> (..., 4, 4)."""
    rotation = np.asarray(rotation, dtype=np.float64)
    translation = np.asarray(translation, dtype=np.float64)
    shape = np.broadcast_shapes(rotation.shape[:-2], translation.shape[:-1])
    motion = np.zeros((*shape, 4, 4))
    motion[..., :3, :3] = rotation
    motion[..., :3, 3] = translation
    motion[..., 3, 3] = 1
    return motion


def shift(translation: ArrayLike) -> Array:
    """A pure translation, shape (..., 3) [mm] -> (..., 4, 4)."""
    return rigid(np.eye(3), translation)


def turn(vector: ArrayLike, point: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """A rotation by a rotation vector about the axis through `point`, shapes (..., 3) [rad], [mm] -> (..., 4, 4)."""
    matrix = rotation(vector)
    point = np.asarray(point, dtype=np.float64)
    return rigid(matrix, point - (matrix @ point[..., None])[..., 0])


def exp(twist: ArrayLike) -> Array:
    """The motion of a screw: twist (v, w) of shape (..., 6) [mm, rad], translation first -> (..., 4, 4)."""
    twist = np.asarray(twist, dtype=np.float64)
    velocity, vector = twist[..., :3], twist[..., 3:]
    squared = (vector * vector).sum(-1)
    second, third = rotation_factors(squared)[1], screw_factor(squared)
    once = np.cross(vector, velocity)
    moved = velocity + second[..., None] * once + third[..., None] * np.cross(vector, once)
    return rigid(rotation(vector), moved)


def inverse(motion: ArrayLike) -> Array:
    """The inverse of rigid motions, shape (..., 4, 4)."""
    motion = np.asarray(motion, dtype=np.float64)
    back = np.swapaxes(motion[..., :3, :3], -1, -2)
    return rigid(back, -(back @ motion[..., :3, 3:])[..., 0])


def apply(motion: ArrayLike, points: ArrayLike) -> Array:
    """Points moved, shapes (..., 4, 4) and (..., 3) -> (..., 3)."""
    motion = np.asarray(motion, dtype=np.float64)
    points = np.asarray(points, dtype=np.float64)
    return (motion[..., :3, :3] @ points[..., None])[..., 0] + motion[..., :3, 3]


def rotation_vector(rotation: ArrayLike) -> Array:
    """The rotation vector of rotations, shape (..., 3, 3) -> (..., 3) [rad], angle in 0..pi."""
    r = np.asarray(rotation, dtype=np.float64)
    sine = 0.5 * np.stack(
        [r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]], axis=-1
    )
    length = np.linalg.norm(sine, axis=-1)
    cosine = 0.5 * (np.trace(r, axis1=-2, axis2=-1) - 1)
    angle = np.arctan2(length, cosine)
    small = length < 1e-12
    factor = np.where(small, 1.0, angle / np.where(small, 1.0, length))
    vector: Array = factor[..., None] * sine
    half_turn = (cosine < 0) & (length < 1e-6)
    return np.where(half_turn[..., None], _near_half_turn(r, sine, angle), vector) if half_turn.any() else vector


def _near_half_turn(r: Array, sine: Array, angle: Array) -> Array:
    """`rotation_vector` near half a turn, where the sine is lost to rounding.

    The axis comes from the symmetric part of the rotation, its sign from the remainder of the sine.
    """
    symmetric = 0.5 * (r + np.swapaxes(r, -1, -2)) + np.eye(3)
    column = np.argmax(np.diagonal(symmetric, axis1=-2, axis2=-1), axis=-1)
    axis = np.take_along_axis(symmetric, column[..., None, None], axis=-1)[..., 0]
    axis = axis / np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-300)
    sign = np.where((axis * sine).sum(-1) < 0, -1.0, 1.0)
    return (sign * angle)[..., None] * axis
