"""How a tilted working plane lies in the workpiece, by the ways in which G68.2 says it: angles, points, vectors.

Sources: Fanuc 30i operator's manual (machining centre), "Tilted working plane indexing"; Mazak, "Inclined-plane
machining" (roll, pitch and yaw). That the first of three points is the origin, and that the block Q0 shifts it from
there, is what programs for these controls say of themselves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.control.coordinates import IDENTITY, PLANES, Rotation, about, as_rotation, product
from ncfix.control.faults import Fault

FloatArray = NDArray[np.float64]

ABOUT = {"1": PLANES[190], "2": PLANES[180], "3": PLANES[170]}
"""The plane in which a turn about X, Y or Z is."""

BAD_PLANE = "NCF221"
LEAST = 1e-6
"""Directions whose vector product is shorter, relative to them, are one."""

SQUARE = 2e-3
"""rad. So far from square two vectors may be that are written with three decimals."""


def euler(first: float, second: float, third: float) -> Rotation:
    """Turned about Z, then about the new X, then about the new Z, degrees."""
    return product(about(PLANES[170], first), product(about(PLANES[190], second), about(PLANES[170], third)))


def in_order(order: str, angles: tuple[float, float, float]) -> Rotation:
    """Turned about X, Y and Z of the workpiece in an order such as "123", degrees."""
    rotation = IDENTITY
    for axis in order:
        rotation = product(about(ABOUT[axis], angles[int(axis) - 1]), rotation)
    return rotation


def by_points(first: FloatArray, second: FloatArray, third: FloatArray, turn: float) -> Rotation:
    """X leads from the first point to the second, the third lies on the side of +Y; then turned about Z, degrees."""
    return product(by_axes(second - first, np.cross(second - first, third - first)), about(PLANES[170], turn))


def by_axes(x: FloatArray, z: FloatArray) -> Rotation:
    """The frame whose Z lies along a vector, and whose X along another as well as it can."""
    size = float(np.linalg.norm(x)), float(np.linalg.norm(z))
    if min(size) < LEAST or np.linalg.norm(np.cross(z, x)) < LEAST * size[0] * size[1]:
        raise Fault(BAD_PLANE, "the points or vectors of the tilted plane (G68.2) do not say how it lies")
    normal = z / size[1]
    side = np.cross(normal, x)
    side /= np.linalg.norm(side)
    return as_rotation(np.stack([np.cross(side, normal), side, normal], axis=-1).tolist())


def are_square(x: FloatArray, z: FloatArray) -> bool:
    """Whether two vectors are square to each other, but for the rounding of their components."""
    return abs(float(x @ z)) <= SQUARE * float(np.linalg.norm(x) * np.linalg.norm(z))
