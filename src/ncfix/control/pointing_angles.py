"""The angles with which two rotary axes point the tool along a direction, for one direction or for many at once.

Many are solved in columns with the same operations in the same order as one, so that the results are the same to the
last bit: the functions of the standard library are called on number after number, since numpy's may round otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Number = TypeVar("Number", float, FloatArray)
"""A number, or a column of them (n,), one per direction."""

Vector = tuple[Number, Number, Number]
Triple = tuple[float, float, float]
Pair = tuple[float, float]

SAME = 1e-9
POLE = 1e-7
"""rad; nearer to the outer axis than that the tool may turn about it at will."""

TURN = 2 * math.pi


class Apply(Protocol[Number]):
    """Calls a function of numbers with numbers, or with columns row by row."""

    def __call__(self, function: Callable[..., float], *values: Number) -> Number:
        """What the function returns."""


def to_one(function: Callable[..., float], *values: float) -> float:
    """Apply a function to numbers."""
    return function(*values)


def to_each(function: Callable[..., float], *values: FloatArray) -> FloatArray:
    """Apply a function of numbers to columns of one shape."""
    found = list(map(function, *(each.ravel().tolist() for each in values)))
    return np.array(found, dtype=np.float64).reshape(values[0].shape)


def solve(
    lines: tuple[Vector[Number], Vector[Number], Vector[Number]], wanted: Vector[Number], apply: Apply[Number]
) -> tuple[Number, tuple[tuple[Number, Number], tuple[Number, Number]]]:
    """How far a unit vector is beyond what two axes reach, and the two ways to point the tool along it, rad.

    lines  of the outer axis, of the inner one, and the direction of the tool, see `Pointing`

    A direction is reached where the first number is not above zero; a way is an angle of the outer axis, NaN where it
    may stand anywhere, and one of the inner, less than two turns from zero.
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
    return abs(c) - r * (1 + SAME), (first, second)


def nearest(ways: tuple[Pair, Pair], near: Pair) -> tuple[Pair, Pair]:
    """The ways that `solve` found, led to the whole turns nearest to where the axes stand, rad; the nearer first."""
    (outer, inner), (other, another) = ways
    here, there = near
    one = led(outer, here), led(inner, there)
    two = led(other, here), led(another, there)
    way = abs(one[0] - here) + abs(one[1] - there)
    return (one, two) if way <= abs(two[0] - here) + abs(two[1] - there) else (two, one)


def led(angle: float, near: float) -> float:
    """An angle, whole turns away if need be, at most half a turn from another, rad; the other itself for NaN.

    Just half a turn away it is the lower one.
    """
    return angle + TURN * math.ceil((near - angle) / TURN - 0.5) if angle == angle else near


def dot(a: Vector[Number], b: Vector[Number]) -> Number:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector[Number], b: Vector[Number]) -> Vector[Number]:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def across(axis: Vector[Number], vector: Vector[Number]) -> Vector[Number]:
    """What of a vector is square to an axis."""
    along = dot(axis, vector)
    return vector[0] - along * axis[0], vector[1] - along * axis[1], vector[2] - along * axis[2]


def turned(axis: Vector[Number], angle: Number, vector: Vector[Number], apply: Apply[Number]) -> Vector[Number]:
    """A vector turned about an axis."""
    along, (u, v, w) = dot(axis, vector), cross(axis, vector)
    c, s = apply(math.cos, angle), apply(math.sin, angle)
    rest = 1 - c
    return (
        along * axis[0] * rest + c * vector[0] + s * u,
        along * axis[1] * rest + c * vector[1] + s * v,
        along * axis[2] * rest + c * vector[2] + s * w,
    )


def _outer_angle(outer: Vector[Number], start: Vector[Number], stop: Vector[Number], apply: Apply[Number]) -> Number:
    """By how much the outer axis turns one vector square to it into another; NaN if one of them is too short."""
    sine, cosine = dot(outer, cross(start, stop)), dot(start, stop)
    return apply(_angle, sine, cosine, dot(start, start), dot(stop, stop))


def _angle(sine: float, cosine: float, start: float, stop: float) -> float:
    return math.nan if start < POLE * POLE or stop < POLE * POLE else math.atan2(sine, cosine)


def _arc(cosine: float) -> float:
    return math.acos(min(max(cosine, -1.0), 1.0))
