"""Finite rigid motions as 4x4 matrices, batched over leading dimensions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def cross_matrix(vectors: Array) -> Array:
    """[v] such that [v] w = v x w, (..., 3) -> (..., 3, 3)."""
    result = np.zeros((*vectors.shape, 3))
    x, y, z = np.moveaxis(vectors, -1, 0)
    result[..., 0, 1], result[..., 0, 2], result[..., 1, 2] = -z, y, -x
    result[..., 1, 0], result[..., 2, 0], result[..., 2, 1] = z, -y, x
    return result


def rotation(vectors: ArrayLike) -> Array:
    """Rotation matrices of rotation vectors (Rodrigues), (..., 3) -> (..., 3, 3); good at any angle, zero too."""
    vectors = np.asarray(vectors, dtype=np.float64)
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    k = cross_matrix(vectors)
    half = np.sinc(angle / (2 * np.pi))
    result: Array = np.eye(3) + np.sinc(angle / np.pi) * k + 0.5 * half**2 * (k @ k)
    return result


def rigid(turn: Array, shift: ArrayLike) -> Array:
    """The motion p -> turn p + shift; (..., 3, 3), (..., 3) -> (..., 4, 4)."""
    shift = np.asarray(shift, dtype=np.float64)
    shape = np.broadcast_shapes(turn.shape[:-2], shift.shape[:-1])
    result = np.zeros((*shape, 4, 4))
    result[..., :3, :3] = turn
    result[..., :3, 3] = shift
    result[..., 3, 3] = 1.0
    return result


def about(point: ArrayLike, vectors: ArrayLike, shift: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Turn by rotation vectors about a point, then shift: p -> point + R (p - point) + shift."""
    turn = rotation(vectors)
    point = np.asarray(point, dtype=np.float64)
    return rigid(turn, point - turned(turn, point) + np.asarray(shift))


def inverse(motions: Array) -> Array:
    """The inverse motions, (..., 4, 4) -> (..., 4, 4)."""
    back = np.swapaxes(motions[..., :3, :3], -1, -2)
    return rigid(back, -turned(back, motions[..., :3, 3]))


def turned(turn: Array, vectors: NDArray[Any]) -> Array:
    """Rotation matrices (..., 3, 3) applied to vectors (..., 3)."""
    result: Array = np.einsum("...ij,...j->...i", turn, vectors)
    return result


def moved(motions: Array, points: ArrayLike) -> Array:
    """Motions (..., 4, 4) applied to points (..., 3)."""
    return turned(motions[..., :3, :3], np.asarray(points, dtype=np.float64)) + motions[..., :3, 3]
