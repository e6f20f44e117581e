"""Frames, turns and circles of SINUMERIK as plain matrices, for judging."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}
"""First and second axis of the plane, and the one across it."""


def about(axis: int, degrees: float) -> Floats:
    """The right-handed rotation about X, Y or Z."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn = np.eye(3)
    i, k = (axis + 1) % 3, (axis + 2) % 3
    turn[i, i], turn[i, k], turn[k, i], turn[k, k] = c, -s, s, c
    return turn


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame: `base = turn @ p + shift`."""

    turn: Floats = field(default_factory=lambda: np.eye(3))
    shift: Floats = field(default_factory=lambda: np.zeros(3))

    def __matmul__(self, inner: Frame) -> Frame:
        return Frame(self.turn @ inner.turn, self.turn @ inner.shift + self.shift)

    def of(self, point: Floats) -> Floats:
        """A point, or points (n, 3), of the program in the base."""
        return point @ self.turn.T + self.shift

    def back(self, base: Floats) -> Floats:
        """The inverse."""
        return np.linalg.solve(self.turn, base - self.shift)


def rotated(axis: Floats, angle: float) -> Floats:
    """The rotation about a unit vector."""
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def through(start: Floats, via: Floats, end: Floats) -> tuple[Floats, Floats, float]:
    """Centre, normal and sweep of the circle through three points."""
    normal = np.cross(via - start, end - via)
    normal /= np.linalg.norm(normal)
    rows = np.array([via - start, end - start, normal])
    values = [(via @ via - start @ start) / 2, (end @ end - start @ start) / 2, normal @ start]
    centre = np.linalg.solve(rows, np.array(values))
    arm, last = start - centre, end - centre
    return centre, normal, math.atan2(normal @ np.cross(arm, last), arm @ last) % (2 * math.pi)


def projected(order: int, angles: list[float]) -> Floats:
    """CYCLE800 by projected angles about X and Y (in either order), then about the new Z."""
    if order not in (57, 54):
        raise NotImplementedError(order)
    about_x, about_y = (angles[0], angles[1]) if order == 57 else (angles[1], angles[0])
    x = about(1, about_y)[:, 0]
    normal = np.cross(x, about(0, about_x)[:, 1])
    normal /= np.linalg.norm(normal)
    return np.stack([x, np.cross(normal, x), normal], axis=-1) @ about(2, angles[2])
