"""How two rotary axes orient the tool in the workpiece, and the angles at which they point it in a given direction.

For any kinematic chain, the direction from the tip to the spindle is `turn(outer axis) @ turn(inner axis) @ tool`: each
rotary axis turns it about a line that is fixed in the workpiece or carried by the other axis only. Three positions of
each axis, asked of the machine's kinematics, determine these lines.

Many directions are solved in columns by the same operations in the same order as a single one, so that the results are
identical to the last bit: the functions of `math` are called number by number, since numpy's may round differently.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.control.coordinates import TURN
from ncfix.values import frozen

Columns = tuple[Array, Array, Array]

Ways = tuple[tuple[float, float], tuple[float, float]]
"""The two solutions for a tool direction, among which `nearest` chooses: angles of outer and inner axis, rad."""

Directions = Callable[[float, float], Array]
"""Angles of the two rotary axes, rad -> unit vector (3,) from the tip to the spindle in the workpiece."""

PROBES = (0.0, 0.7, 1.3, -0.9)
"""Angles, rad, of one axis at which the line of the other is sought; at some the tool may lie along that line."""

MIN_RELATIVE_RADIUS = 1e-3
"""Smallest radius of the tool's circle about an axis, relative to its length, from which the line can be determined."""


@frozen
class Pointing:
    """Orientation of the tool by the two rotary axes of a machine.

    columns  position columns of the outer axis (its line is fixed in the workpiece) and of the inner axis
    lines    unit vectors: the outer line, the inner line with the outer axis at zero, both right-handed; and the
             direction of the tool with both axes at zero
    """

    columns: tuple[int, int]
    lines: tuple[Triple, Triple, Triple]

    @classmethod
    def of(cls, columns: tuple[int, int], directions: Directions) -> Pointing | None:
        """Determine it from a machine's directions; None if two successive rotations cannot produce them."""
        swapped = _swapped(directions)
        for pair, ask in ((columns, directions), (columns[::-1], swapped)):
            outer, inner = _line(ask), _line(_swapped(ask), (0.0,))
            if outer is None or inner is None:
                continue
            found = cls((pair[0], pair[1]), (_triple(outer), _triple(inner), _triple(ask(0.0, 0.0))))
            if all(
                np.abs(found.at(a, b) - ask(a, b)).max() < EQUALITY_TOLERANCE
                for a, b in ((0.4, -1.1), (-2.0, 0.8), (2.9, 2.2))
            ):
                return found
        return None

    def at(self, outer: float, inner: float) -> Array:
        """The tool direction (3,) at these angles, rad."""
        return np.array(turned(self.lines[0], outer, turned(self.lines[1], inner, self.lines[2], to_one), to_one))

    def direction(self, position: Array) -> Array:
        """The tool direction (3,) at a position (n_axes,), mm and rad."""
        return self.at(float(position[self.columns[0]]), float(position[self.columns[1]]))

    def angles(self, direction: Array, near: tuple[float, float]) -> list[tuple[float, float]]:
        """Angles of outer and inner axis, rad, at which the tool points along a unit vector; empty if it cannot.

        The solution nearest to `near` comes first; an axis whose angle does not matter takes that of `near`.
        """
        beyond, ways = solve(self.lines, _triple(direction), to_one)
        if beyond > 0:
            return []
        first, second = nearest(ways, near)
        return [first] if first == second else [first, second]

    def ways_of_many(self, directions: Columns) -> tuple[Mask, list[Ways]]:
        """For unit vectors in three columns (n,): whether the machine can point along each, and its two `Ways`."""
        outer, inner, tool = ((np.array(x), np.array(y), np.array(z)) for x, y, z in self.lines)
        beyond, ways = solve((outer, inner, tool), directions, to_each)
        first, second = (zip(one.tolist(), other.tolist(), strict=True) for one, other in ways)
        return beyond <= 0, list(zip(first, second, strict=True))

    def at_pole(self, direction: Array) -> bool:
        """Whether a tool along the unit vector `direction` (3,) is parallel to the line of the outer axis."""
        return math.hypot(*cross(self.lines[0], _triple(direction))) < POLE_ANGLE_RAD

    def leaves_pole(self, here: Pair, ways: Sequence[Pair]) -> bool:
        """Whether the tool is to leave a pole, where it is parallel to the outer axis: then neither way is nearer."""
        return len({*ways}) > 1 and self.at_pole(self.at(*here)) and not self.at_pole(self.at(*ways[0]))

    def is_close(self, here: Pair, ways: Sequence[Pair]) -> bool:
        """Whether two ways are about equally far from the angles `here`: a small change of these decides."""
        if len(ways) < 2:
            return False
        (outer, inner), (other, another) = ways[:2]
        near, far = abs(outer - here[0]) + abs(inner - here[1]), abs(other - here[0]) + abs(another - here[1])
        return far - near < CLOSE_RAD

    def stray(self, start: tuple[float, float], stop: tuple[float, float]) -> float:
        """Angle, rad, between the tool at the mean axis angles and the middle of the plane arc between the ends."""
        middle = self.at((start[0] + stop[0]) / 2, (start[1] + stop[1]) / 2)
        half = self.at(*start) + self.at(*stop)
        size = float(np.linalg.norm(half))
        return math.pi if size < EQUALITY_TOLERANCE else float(np.linalg.norm(middle - half / size))


def _swapped(directions: Directions) -> Directions:
    return lambda a, b: directions(b, a)


def _triple(vector: Array) -> Triple:
    x, y, z = vector.tolist()
    return x, y, z


def _line(directions: Directions, probes: tuple[float, ...] = PROBES) -> Array | None:
    """The line about which the first axis turns; None if it depends on the angle of the second."""
    lines = [line for probe in probes if (line := _line_at(directions, probe)) is not None]
    if not lines or any(np.abs(line - lines[0]).max() > EQUALITY_TOLERANCE for line in lines):
        return None
    return lines[0]


def _line_at(directions: Directions, second: float) -> Array | None:
    points = [directions(angle, second) for angle in (0.0, math.pi / 2, math.pi)]
    normal = np.cross(points[1] - points[0], points[2] - points[1])
    size = float(np.linalg.norm(normal))
    return normal / size if size > MIN_RELATIVE_RADIUS**2 else None


Number = TypeVar("Number", float, Array)
"""A number, or a column (n,) with one number per direction."""

Vector = tuple[Number, Number, Number]
Triple = tuple[float, float, float]
Pair = tuple[float, float]

EQUALITY_TOLERANCE = 1e-9
"""Difference of directions and lines (unit vectors, mm) below which they count as equal."""
CLOSE_RAD = 0.05
"""Difference of two ways, rad, summed over both axes, within which corrections could make the other one the nearer."""
POLE_ANGLE_RAD = 1e-7
"""Smallest angle, rad, between tool and outer axis; below it the angle of the outer axis is free."""


class Apply(Protocol[Number]):
    """Applies a function of numbers to numbers, or to columns row by row."""

    def __call__(self, function: Callable[..., float], *values: Number) -> Number:
        """The results of the function."""


def to_one(function: Callable[..., float], *values: float) -> float:
    """Call a function with numbers."""
    return function(*values)


def to_each(function: Callable[..., float], *values: Array) -> Array:
    """Call a function of numbers for each row of columns of one shape."""
    found = list(map(function, *(each.ravel().tolist() for each in values)))
    return np.array(found, dtype=np.float64).reshape(values[0].shape)


def solve(
    lines: tuple[Vector[Number], Vector[Number], Vector[Number]], wanted: Vector[Number], apply: Apply[Number]
) -> tuple[Number, tuple[tuple[Number, Number], tuple[Number, Number]]]:
    """The two ways to point the tool along a unit vector, rad, and by how much it is out of reach.

    lines  the outer line, the inner line, and the tool direction, see `Pointing`

    The direction can be reached if the first number is not above zero. A way is the angle of the outer axis (NaN if any
    angle will do) and of the inner axis, less than two turns from zero.
    """
    outer, inner, tool = lines
    share = dot(inner, tool)
    flat = inner[0] * share, inner[1] * share, inner[2] * share
    a, b = dot(outer, tool) - dot(outer, flat), dot(outer, cross(inner, tool))
    c, r = dot(outer, wanted) - dot(outer, flat), apply(math.hypot, a, b)
    middle, half = apply(math.atan2, b, a), apply(_arc, c / r)
    stop = across(outer, wanted)
    first, second = (
        (_outer_angle(outer, across(outer, turned(inner, angle, tool, apply)), stop, apply), angle)
        for angle in (middle + half, middle - half)
    )
    return abs(c) - r * (1 + EQUALITY_TOLERANCE), (first, second)


def nearest(ways: tuple[Pair, Pair], near: Pair) -> tuple[Pair, Pair]:
    """The solutions of `solve`, changed by whole turns to be nearest to the angles `near`, rad; nearer one first."""
    (outer, inner), (other, another) = ways
    here, there = near
    one = nearest_turn(outer, here), nearest_turn(inner, there)
    two = nearest_turn(other, here), nearest_turn(another, there)
    way = abs(one[0] - here) + abs(one[1] - there)
    return (one, two) if way <= abs(two[0] - here) + abs(two[1] - there) else (two, one)


def nearest_turn(angle: float, near: float) -> float:
    """The angle, changed by whole turns to be within half a turn of `near`, rad; `near` itself for NaN.

    Of two such angles, exactly half a turn away on both sides, the lower one.
    """
    return angle + TURN * math.ceil((near - angle) / TURN - 0.5) if angle == angle else near


def dot(a: Vector[Number], b: Vector[Number]) -> Number:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector[Number], b: Vector[Number]) -> Vector[Number]:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def across(axis: Vector[Number], vector: Vector[Number]) -> Vector[Number]:
    """The component of a vector perpendicular to an axis."""
    along = dot(axis, vector)
    return vector[0] - along * axis[0], vector[1] - along * axis[1], vector[2] - along * axis[2]


def turned(axis: Vector[Number], angle: Number, vector: Vector[Number], apply: Apply[Number]) -> Vector[Number]:
    """A vector turned about an axis by an angle, rad."""
    along, (u, v, w) = dot(axis, vector), cross(axis, vector)
    c, s = apply(math.cos, angle), apply(math.sin, angle)
    rest = 1 - c
    return (
        along * axis[0] * rest + c * vector[0] + s * u,
        along * axis[1] * rest + c * vector[1] + s * v,
        along * axis[2] * rest + c * vector[2] + s * w,
    )


def _outer_angle(outer: Vector[Number], start: Vector[Number], stop: Vector[Number], apply: Apply[Number]) -> Number:
    """The angle, rad, by which the outer axis turns one perpendicular vector into another; NaN if one is too short."""
    sine, cosine = dot(outer, cross(start, stop)), dot(start, stop)
    return apply(_angle, sine, cosine, dot(start, start), dot(stop, stop))


def _angle(sine: float, cosine: float, start: float, stop: float) -> float:
    return (
        math.nan
        if start < POLE_ANGLE_RAD * POLE_ANGLE_RAD or stop < POLE_ANGLE_RAD * POLE_ANGLE_RAD
        else math.atan2(sine, cosine)
    )


def _arc(cosine: float) -> float:
    return math.acos(min(max(cosine, -1.0), 1.0))
