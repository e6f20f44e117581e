"""Axis letters common to all languages, rotations of X Y Z, and the axes whose positions the program itself has set.

A correction may need a word for an axis that its block does not name. Such a word repeats the axis position, changed by
a few um, so that position must come from the program itself. If it came from a start position, work offset or tool
length that someone entered, and that value were wrong, the word would move the axis there, perhaps into the part.
So an axis is unplaced until an absolute word of the program positions it. It becomes unplaced again after anything that
moves it otherwise or changes its reference: machine coordinates, reference points, probing, a change of tool, of its
length offset, or of the work offset.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import field
from typing import TypeVar

from ncfix.values import frozen, mutable

LETTERS = "XYZABCUVW"
"""Axis letters of RS274NGC, in the order of its parameters; position vectors have this order."""

INDEX = {letter: index for index, letter in enumerate(LETTERS)}
N_LETTERS = len(LETTERS)
X, Y, Z = 0, 1, 2
ROTARY_LETTERS = frozenset("ABC")
TURN = 2 * math.pi
DEGREE = math.pi / 180
INCH = 25.4

Vector = list[float]
Rotation = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
"""Rows of a 3 x 3 matrix acting on X Y Z."""

IDENTITY: Rotation = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
T = TypeVar("T")


@frozen
class Plane:
    """A plane of arcs and cycles: its two axes in right-handed order, and the axis normal to it (`across`)."""

    code: int
    first: int
    second: int
    across: int

    @property
    def axes(self) -> int:
        """The two axes of the plane as a bit mask."""
        return 1 << self.first | 1 << self.second

    @property
    def pair(self) -> tuple[int, int]:
        """The two axes of the plane in right-handed order, as letter indices."""
        return self.first, self.second

    def of(self, values: Sequence[T]) -> tuple[T, T]:
        """The two values of this plane's axes, from one value per axis."""
        return values[self.first], values[self.second]


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
    """A position vector of zeros."""
    return [0.0] * N_LETTERS


def about(plane: Plane, degrees: float) -> Rotation:
    """Right-handed rotation in a plane of X Y Z by an angle in degrees; exact for multiples of 90."""
    turn = degrees % 360.0
    exact = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}
    cosine, sine = exact.get(turn) or (math.cos(degrees * DEGREE), math.sin(degrees * DEGREE))
    rows = [list(row) for row in IDENTITY]
    rows[plane.first][plane.first] = rows[plane.second][plane.second] = cosine
    rows[plane.first][plane.second] = -sine
    rows[plane.second][plane.first] = sine
    return as_rotation(rows)


def as_rotation(rows: Sequence[Sequence[float]]) -> Rotation:
    """A `Rotation` from three rows of three numbers."""
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
    """The position with its X Y Z rotated; the other axes unchanged."""
    return [dot(row, vector) for row in rotation] + vector[3:]


def angles_in_words(indices: Iterable[int], angles: Iterable[float]) -> str:
    """Angles (rad) of rotary axes as people write them: `B30.000 C120.000`."""
    return " ".join(f"{LETTERS[index]}{angle / DEGREE:.3f}" for index, angle in zip(indices, angles, strict=True))


@mutable
class Places:
    """Which axes the program has placed (see the module); axes are bits of a mask, by letter.

    unplaced  axes whose positions the program has not set
    anchors   for each letter, the references of its numbers other than numbers stated in the program
    rotation  rotation of the program's X Y Z, by rows; only compared
    begun     whether there has been a motion
    """

    unplaced: int
    anchors: Sequence[Hashable] = field(default_factory=list)
    rotation: Sequence[Hashable] = ()
    begun: bool = False

    def watch(self, anchors: Sequence[Hashable], rotation: Sequence[Hashable]) -> None:
        """Record what numbers now refer to; an axis whose reference changed since the first motion becomes unplaced.

        The axes of a rotated frame (G68, ROT) depend on each other and become unplaced together.
        """
        if self.begun:
            self.unplaced |= changed(self.anchors, anchors)
            turned = changed(self.rotation, rotation)
            self.unplaced |= turned if self.unplaced & turned else 0
        self.anchors, self.rotation = anchors, rotation

    def lose(self, axes: int) -> None:
        """Mark axes as unplaced: something other than a word of the program has moved them, or may have."""
        self.unplaced |= axes

    def shift(self, axes: int) -> None:
        """Mark axes as unplaced because their reference was set anew, perhaps to a value other than the real one.

        Has no effect before the first motion.
        """
        if self.begun:
            self.unplaced |= axes

    def place(self, axes: int) -> None:
        """Mark axes as placed by the program."""
        self.unplaced &= ~axes


def changed(before: Sequence[Hashable], now: Sequence[Hashable]) -> int:
    """Indices at which two sequences differ, as a bit mask."""
    return mask_of(index for index, (a, b) in enumerate(zip(before, now, strict=True)) if a != b)


def mask_of(indices: Iterable[int]) -> int:
    """Bit mask of letter indices."""
    return sum(1 << index for index in indices)
