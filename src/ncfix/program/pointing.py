"""How two rotary axes point the tool in the workpiece, found out from a machine's own kinematics, and turned round.

Whatever the chain, the direction from the tip to the spindle is `turn(outer axis) @ turn(inner axis) @ tool`: each
rotary axis turns it about a line that is fixed in the workpiece, or that only the other axis carries. Where these lines
lie shows in three positions of each axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

Directions = Callable[[float, float], FloatArray]
"""Angles of the two rotary axes, rad -> the unit vector (3,) from the tip to the spindle in the workpiece."""

PROBES = (0.0, 0.7, 1.3, -0.9)
"""Positions of one axis at which the other is tried: in some the tool may lie along its line."""

LEAST = 1e-3
"""A smaller circle, relative to the tool's length, says nothing about its axis."""

SAME = 1e-9
POLE = 1e-7
"""rad; nearer to the outer axis than that the tool may turn about it at will."""


@dataclass(frozen=True, slots=True)
class Pointing:
    """How a machine with two rotary axes points its tool.

    columns      of the outer axis (its line is fixed in the workpiece) and of the inner one, in positions
    outer, inner (3,) unit vectors of their lines, the inner one with the outer axis at zero; right-handed
    tool         (3,) direction of the tool with both at zero
    """

    columns: tuple[int, int]
    outer: FloatArray
    inner: FloatArray
    tool: FloatArray

    @classmethod
    def of(cls, columns: tuple[int, int], directions: Directions) -> Pointing | None:
        """From the directions that a machine gives; None if they are not those of two turns."""
        swapped = _swapped(directions)
        for pair, ask in ((columns, directions), (columns[::-1], swapped)):
            outer, inner = _line(ask), _line(_swapped(ask), (0.0,))
            if outer is None or inner is None:
                continue
            found = cls((pair[0], pair[1]), outer, inner, ask(0.0, 0.0))
            if all(np.abs(found.at(a, b) - ask(a, b)).max() < SAME for a, b in ((0.4, -1.1), (-2.0, 0.8), (2.9, 2.2))):
                return found
        return None

    def at(self, outer: float, inner: float) -> FloatArray:
        """The direction (3,) at these angles, rad."""
        return _turned(self.outer, outer, _turned(self.inner, inner, self.tool))

    def direction(self, position: FloatArray) -> FloatArray:
        """The direction (3,) at a position (n_axes,), rad."""
        return self.at(float(position[self.columns[0]]), float(position[self.columns[1]]))

    def angles(self, direction: FloatArray, near: tuple[float, float]) -> list[tuple[float, float]]:
        """The angles of outer and inner axis, rad, with which the tool points along a unit vector.

        Nearest to `near` first; an axis that may stand anywhere stands there. Empty if the machine cannot point there.
        """
        flat = self.inner * float(self.inner @ self.tool)
        a, b = float(self.outer @ (self.tool - flat)), float(self.outer @ np.cross(self.inner, self.tool))
        c, r = float(self.outer @ (direction - flat)), math.hypot(a, b)
        if abs(c) > r * (1 + SAME):
            return []
        middle, half = math.atan2(b, a), math.acos(min(max(c / r, -1.0), 1.0))
        inner = {near[1] + wrapped(angle - near[1]) for angle in (middle + half, middle - half)}
        ways = [(self._outer_angle(angle, direction, near[0]), angle) for angle in inner]
        return sorted(ways, key=lambda way: abs(way[0] - near[0]) + abs(way[1] - near[1]))

    def at_pole(self, direction: FloatArray) -> bool:
        """Whether the tool would stand along the line of the outer axis."""
        return float(np.linalg.norm(np.cross(self.outer, direction))) < POLE

    def _outer_angle(self, inner: float, direction: FloatArray, near: float) -> float:
        start = _across(self.outer, _turned(self.inner, inner, self.tool))
        stop = _across(self.outer, direction)
        if min(float(np.linalg.norm(start)), float(np.linalg.norm(stop))) < POLE:
            return near
        angle = math.atan2(float(self.outer @ np.cross(start, stop)), float(start @ stop))
        return near + wrapped(angle - near)


def wrapped(angle: float) -> float:
    """An angle between minus and plus half a turn, rad."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


def _swapped(directions: Directions) -> Directions:
    return lambda a, b: directions(b, a)


def _turned(axis: FloatArray, angle: float, vector: FloatArray) -> FloatArray:
    flat = axis * float(axis @ vector)
    return flat + math.cos(angle) * (vector - flat) + math.sin(angle) * np.cross(axis, vector)


def _across(axis: FloatArray, vector: FloatArray) -> FloatArray:
    return np.asarray(vector - axis * float(axis @ vector))


def _line(directions: Directions, probes: tuple[float, ...] = PROBES) -> FloatArray | None:
    """The line about which the first angle turns, the same wherever the second stands; None if it is not."""
    lines = [line for probe in probes if (line := _line_at(directions, probe)) is not None]
    if not lines or any(np.abs(line - lines[0]).max() > SAME for line in lines):
        return None
    return lines[0]


def _line_at(directions: Directions, second: float) -> FloatArray | None:
    points = [directions(angle, second) for angle in (0.0, math.pi / 2, math.pi)]
    normal = np.cross(points[1] - points[0], points[2] - points[1])
    size = float(np.linalg.norm(normal))
    return normal / size if size > LEAST**2 else None
