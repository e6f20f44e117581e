"""The axis letters of all languages, how their words become millimetres and radians, rotations of X Y Z, and which
axes the program itself has brought to where they stand.

A correction may want a word for an axis that its block does not name. Such a word says where the axis stands already,
but for some um, and that must be the program's own knowledge: if it rests on what tables or people say of the start,
of work offsets or of tool lengths, and they are wrong, the word makes the axis move there, perhaps into the part.
So an axis is unplaced until an absolute word of the program brings it to its place, and again after whatever takes it
elsewhere or makes another table count: machine coordinates, reference points, probing, a change of tool, of its
length offset, or of the work offset.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import field
from typing import TypeVar

from ncfix.values import frozen, mutable

LETTERS = "XYZABCUVW"
"""The axis letters of RS274NGC in the order of its parameters; every position here is a list in this order."""

INDEX = {letter: index for index, letter in enumerate(LETTERS)}
N_LETTERS = len(LETTERS)
X, Y, Z = 0, 1, 2
ROTARY_LETTERS = frozenset("ABC")
TURN = 2 * math.pi
DEGREE = math.pi / 180
INCH = 25.4

Vector = list[float]
Rotation = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
"""Rows of a 3 x 3 matrix that acts on X Y Z."""

IDENTITY: Rotation = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
T = TypeVar("T")


@frozen
class Plane:
    """A plane of arcs and cycles: its two axes in right-handed order, and the one across it."""

    code: int
    first: int
    second: int
    across: int

    @property
    def axes(self) -> int:
        """Its two axes as a bit mask."""
        return 1 << self.first | 1 << self.second

    @property
    def pair(self) -> tuple[int, int]:
        """Its two axes, in their order."""
        return self.first, self.second

    def of(self, values: Sequence[T]) -> tuple[T, T]:
        """The values of its two axes, of those of all axes."""
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


@mutable
class Places:
    """The book of it; axes are bits of a mask, by letter.

    unplaced   axes that the program has not brought to where they stand
    anchors  for each letter what its numbers count from, besides what the program states in numbers itself
    rotation how X Y Z of the program are turned: its rows, for comparison only
    begun    there has been a motion
    """

    unplaced: int
    anchors: Sequence[Hashable] = field(default_factory=list)
    rotation: Sequence[Hashable] = ()
    begun: bool = False

    def watch(self, anchors: Sequence[Hashable], rotation: Sequence[Hashable]) -> None:
        """What numbers count from now; an axis for which that has changed since the first motion is unplaced.

        Of axes that the program turns (G68, ROT) each is made of all: they are unplaced together.
        """
        if self.begun:
            self.unplaced |= changed(self.anchors, anchors)
            turned = changed(self.rotation, rotation)
            self.unplaced |= turned if self.unplaced & turned else 0
        self.anchors, self.rotation = anchors, rotation

    def lose(self, axes: int) -> None:
        """Something else than a word of the program has moved these axes, or may have."""
        self.unplaced |= axes

    def shift(self, axes: int) -> None:
        """What the numbers of these axes count from is put anew, perhaps to other values than it really had.

        Before the first motion nothing has been brought anywhere.
        """
        if self.begun:
            self.unplaced |= axes

    def place(self, axes: int) -> None:
        """The program says where these axes stand."""
        self.unplaced &= ~axes


def changed(before: Sequence[Hashable], now: Sequence[Hashable]) -> int:
    """The places at which two sequences differ, as a bit mask."""
    return mask_of(index for index, (a, b) in enumerate(zip(before, now, strict=True)) if a != b)


def mask_of(indices: Iterable[int]) -> int:
    """Letter indices as a bit mask."""
    return sum(1 << index for index in indices)
