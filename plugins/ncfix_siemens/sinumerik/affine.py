"""Frames of SINUMERIK: shifts, turns, mirrors and scales, and how they follow one another.

A point `p` of the program is `shift + rotation @ (scale * p)` one frame further out; the chain runs from the settable
frame (G54) by way of the swivelled plane (CYCLE800) to the programmable frame (TRANS, ROT, SCALE, MIRROR).
Source: Siemens, "SINUMERIK 840D sl, NC programming", frames; `$P_ACTFRAME`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ncfix.control.coordinates import (
    IDENTITY,
    PLANES,
    Plane,
    Rotation,
    about,
    as_rotation,
    dot,
    product,
    zeros,
)

AROUND = {"X": PLANES[190], "Y": PLANES[180], "Z": PLANES[170]}
"""The plane in which a rotation about an axis turns."""


@dataclass(frozen=True, slots=True)
class Affine:
    """One frame.

    shift     nine numbers in the order of the axis letters, mm and rad
    rotation  of X Y Z; a mirrored axis makes its determinant negative
    scale     one factor for X Y Z
    """

    shift: tuple[float, ...] = tuple(zeros())
    rotation: Rotation = IDENTITY
    scale: float = 1.0

    def then(self, inner: Affine) -> Affine:
        """The frame of `inner` within this one."""
        x, y, z = (self.scale * dot(row, inner.shift) for row in self.rotation)
        moved = (x, y, z, *inner.shift[3:])
        shift = tuple(a + b for a, b in zip(self.shift, moved, strict=True))
        rotation = inner.rotation if self.rotation is IDENTITY else product(self.rotation, inner.rotation)
        return Affine(shift, rotation, self.scale * inner.scale)


WORLD = Affine()


def shifted(values: dict[int, float]) -> Affine:
    """A frame that only shifts."""
    return Affine(tuple(values.get(index, 0.0) for index in range(9)))


def turned(angles: dict[str, float], order: str = "ZYX") -> Affine:
    """A frame that turns about the axes in that order, each as the ones before have left it; degrees.

    `ROT X Y Z` turns about Z first, then Y, then X (RPY, the default of MD10600).
    """
    rotation = IDENTITY
    for letter in order:
        if angles.get(letter, 0.0):
            rotation = product(rotation, about(AROUND[letter], angles[letter]))
    return Affine(rotation=rotation)


def turned_in(plane: Plane, degrees: float) -> Affine:
    """`ROT RPL=`: a turn in a plane."""
    return Affine(rotation=about(plane, degrees))


def mirrored(letters: str) -> Affine:
    """A frame in which the axes named run the other way."""
    rows = [
        [(-1.0 if letter in letters else 1.0) if i == k else 0.0 for k in range(3)] for i, letter in enumerate("XYZ")
    ]
    return Affine(rotation=as_rotation(rows))


def scaled(factor: float) -> Affine:
    """A frame with another scale."""
    return Affine(scale=factor)


def with_shift(frame: Affine, values: dict[int, float]) -> Affine:
    """The frame with some of its shifts replaced."""
    return replace(frame, shift=tuple(values.get(index, value) for index, value in enumerate(frame.shift)))


def handed(rotation: Rotation) -> float:
    """1, or -1 where an odd number of axes is mirrored."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    return 1.0 if a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) > 0 else -1.0
