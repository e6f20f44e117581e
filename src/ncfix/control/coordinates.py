"""The axis letters of all languages, how their words become millimetres and radians, and rotations of X Y Z."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

LETTERS = "XYZABCUVW"
"""The axis letters of RS274NGC in the order of its parameters; every position here is a list in this order."""

INDEX = {letter: index for index, letter in enumerate(LETTERS)}
N_LETTERS = len(LETTERS)
X, Y, Z = 0, 1, 2
ROTARY_LETTERS = frozenset("ABC")
DEGREE = math.pi / 180
INCH = 25.4

Vector = list[float]
Rotation = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
"""Rows of a 3 x 3 matrix that acts on X Y Z."""

IDENTITY: Rotation = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Plane:
    """A plane of arcs and cycles: its two axes in right-handed order, and the one across it."""

    code: int
    first: int
    second: int
    across: int


PLANES = {
    170: Plane(170, X, Y, Z),
    180: Plane(180, Z, X, Y),
    190: Plane(190, Y, Z, X),
    171: Plane(171, 6, 7, 8),
    181: Plane(181, 8, 6, 7),
    191: Plane(191, 7, 8, 6),
}
"""G17, G18, G19 and the planes of U V W, by G code in tenths."""

CENTRE_LETTERS = "IJK"
"""The centre words of arcs, by axis: I belongs to X, J to Y, K to Z."""


def zeros() -> Vector:
    """A position at zero."""
    return [0.0] * N_LETTERS


def about(plane: Plane, degrees: float) -> Rotation:
    """The right-handed rotation in a plane of X Y Z. Exact for multiples of a right angle."""
    turn = degrees % 360.0
    exact = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}
    cosine, sine = exact.get(turn) or (math.cos(degrees * DEGREE), math.sin(degrees * DEGREE))
    rows = [list(row) for row in IDENTITY]
    rows[plane.first][plane.first] = rows[plane.second][plane.second] = cosine
    rows[plane.first][plane.second] = -sine
    rows[plane.second][plane.first] = sine
    return as_rotation(rows)


def as_rotation(rows: Sequence[Sequence[float]]) -> Rotation:
    """Three rows of three as a rotation."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    return (a, b, c), (d, e, f), (g, h, i)


def product(left: Rotation, right: Rotation) -> Rotation:
    """`left @ right`."""
    columns = tuple(zip(*right, strict=True))
    return as_rotation([[dot(row, column) for column in columns] for row in left])


def transposed(rotation: Rotation) -> Rotation:
    """The inverse of a rotation."""
    return as_rotation(list(zip(*rotation, strict=True)))


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """Scalar product of two triples."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def rotated(rotation: Rotation, vector: Vector) -> Vector:
    """A position with its X Y Z rotated."""
    return [dot(row, vector) for row in rotation] + vector[3:]


def angles_in_words(indices: Iterable[int], angles: Iterable[float]) -> str:
    """Angles (rad) of rotary axes as people write them: `B30.000 C120.000`."""
    return " ".join(f"{LETTERS[index]}{angle / DEGREE:.3f}" for index, angle in zip(indices, angles, strict=True))
