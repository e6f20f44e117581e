"""How two rotary axes point the tool in the workpiece, found out from a machine's own kinematics, and turned round.

Whatever the chain, the direction from the tip to the spindle is `turn(outer axis) @ turn(inner axis) @ tool`: each
rotary axis turns it about a line that is fixed in the workpiece, or that only the other axis carries. Where these lines
lie shows in three positions of each axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.control.pointing_angles import POLE, SAME, FloatArray, Triple, cross, nearest, solve, to_each, to_one, turned

Columns = tuple[FloatArray, FloatArray, FloatArray]

Ways = tuple[tuple[float, float], tuple[float, float]]
"""Two ways to point the tool, of which `pointing_angles.nearest` takes one: angles of outer and inner axis, rad."""

Directions = Callable[[float, float], FloatArray]
"""Angles of the two rotary axes, rad -> the unit vector (3,) from the tip to the spindle in the workpiece."""

PROBES = (0.0, 0.7, 1.3, -0.9)
"""Positions of one axis at which the other is tried: in some the tool may lie along its line."""

LEAST = 1e-3
"""A smaller circle, relative to the tool's length, says nothing about its axis."""

SQUARE = 2e-4
"""A tool closer to a direction than this, rad, is taken to lie along it: rotary words have three decimals of a degree,
9e-6 rad each."""

TURNS = 2
AT_END = 1e-6
"""rad; so far past its travel an axis is still at the end of it."""


@dataclass(frozen=True, slots=True)
class Pointing:
    """How a machine with two rotary axes points its tool.

    columns  of the outer axis (its line is fixed in the workpiece) and of the inner one, in positions
    lines    unit vectors: of the outer line, of the inner one with the outer axis at zero, both right-handed; and the
             direction of the tool with both at zero
    """

    columns: tuple[int, int]
    lines: tuple[Triple, Triple, Triple]

    @classmethod
    def of(cls, columns: tuple[int, int], directions: Directions) -> Pointing | None:
        """From the directions that a machine gives; None if they are not those of two turns."""
        swapped = _swapped(directions)
        for pair, ask in ((columns, directions), (columns[::-1], swapped)):
            outer, inner = _line(ask), _line(_swapped(ask), (0.0,))
            if outer is None or inner is None:
                continue
            found = cls((pair[0], pair[1]), (_triple(outer), _triple(inner), _triple(ask(0.0, 0.0))))
            if all(np.abs(found.at(a, b) - ask(a, b)).max() < SAME for a, b in ((0.4, -1.1), (-2.0, 0.8), (2.9, 2.2))):
                return found
        return None

    def at(self, outer: float, inner: float) -> FloatArray:
        """The direction (3,) at these angles, rad."""
        return np.array(turned(self.lines[0], outer, turned(self.lines[1], inner, self.lines[2], to_one), to_one))

    def direction(self, position: FloatArray) -> FloatArray:
        """The direction (3,) at a position (n_axes,), rad."""
        return self.at(float(position[self.columns[0]]), float(position[self.columns[1]]))

    def angles(self, direction: FloatArray, near: tuple[float, float]) -> list[tuple[float, float]]:
        """The angles of outer and inner axis, rad, with which the tool points along a unit vector.

        Nearest to `near` first; an axis that may stand anywhere stands there. Empty if the machine cannot point there.
        """
        beyond, ways = solve(self.lines, _triple(direction), to_one)
        if beyond > 0:
            return []
        first, second = nearest(ways, near)
        return [first] if first == second else [first, second]

    def ways_of_many(self, directions: Columns) -> tuple[NDArray[np.bool_], list[Ways]]:
        """Whether the machine can point along unit vectors, three columns (n,), and the two `Ways` to do it."""
        outer, inner, tool = ((np.array(x), np.array(y), np.array(z)) for x, y, z in self.lines)
        beyond, ways = solve((outer, inner, tool), directions, to_each)
        first, second = (zip(one.tolist(), other.tolist(), strict=True) for one, other in ways)
        return beyond <= 0, list(zip(first, second, strict=True))

    def at_pole(self, direction: FloatArray) -> bool:
        """Whether a tool along the unit vector `direction` (3,) would stand along the line of the outer axis."""
        return math.hypot(*cross(self.lines[0], _triple(direction))) < POLE

    def stray(self, start: tuple[float, float], stop: tuple[float, float]) -> float:
        """How far half-way the plane between two directions is from the direction at the mean angles, rad."""
        middle = self.at((start[0] + stop[0]) / 2, (start[1] + stop[1]) / 2)
        half = self.at(*start) + self.at(*stop)
        size = float(np.linalg.norm(half))
        return math.pi if size < SAME else float(np.linalg.norm(middle - half / size))


def within(
    ways: Iterable[tuple[float, float]], travel: Sequence[tuple[float, float]], near: tuple[float, float]
) -> list[tuple[float, float]]:
    """The ways that two axes can go within their travels, whole turns away if need be; the nearest first."""
    found = []
    for way in ways:
        places = [_in_travel(angle, *span, to) for angle, span, to in zip(way, travel, near, strict=True)]
        if places[0] is not None and places[1] is not None:
            found.append((places[0], places[1]))
    return sorted(found, key=lambda way: abs(way[0] - near[0]) + abs(way[1] - near[1]))


def _in_travel(angle: float, low: float, high: float, near: float) -> float | None:
    """An angle, or whole turns away from it, within a travel and nearest to another; None if none is."""
    turns = (angle + 2 * math.pi * count for count in range(-TURNS, TURNS + 1))
    possible = [each for each in turns if low - AT_END <= each <= high + AT_END]
    return min(possible, key=lambda each: abs(each - near), default=None)


def _swapped(directions: Directions) -> Directions:
    return lambda a, b: directions(b, a)


def _triple(vector: FloatArray) -> Triple:
    x, y, z = vector.tolist()
    return x, y, z


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
