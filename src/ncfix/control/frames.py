"""Coordinate frames between program coordinates and axis commands, for all languages.

A point `p` of a frame is `shift + rotation @ (scale * p)` in the next frame outwards. A control stacks several frames,
from the work offset to the innermost programmed one; the language defines their order. The tool length is added on top.
The forms in which programs state a tilted plane (angles, vectors, points) are here, too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace

from ncfix.control.coordinates import (
    IDENTITY,
    N_LETTERS,
    PLANES,
    Plane,
    Rotation,
    about,
    as_rotation,
    dot,
    product,
    rotated,
    transposed,
)
from ncfix.control.moves import UnknownAxes
from ncfix.control.pointing import Triple, cross
from ncfix.values import frozen

ZEROS = (0.0,) * N_LETTERS
AROUND = {"X": PLANES[190], "Y": PLANES[180], "Z": PLANES[170]}
"""The plane in which a rotation about each axis turns."""


def mixed_into(unknown: UnknownAxes, rotation: Rotation) -> UnknownAxes:
    """Reasons for unknown coordinates after a rotation: a turned axis is unknown if any axis it is composed of is."""
    mixed = {index: why for index, why in unknown.items() if index > 2}
    for index in range(3):
        why = next((unknown[k] for k in range(3) if rotation[index][k] != 0.0 and k in unknown), None)
        if why is not None:
            mixed[index] = why
    return mixed


@frozen
class Affine:
    """A coordinate frame: shift, rotation and scale.

    shift     nine numbers in the order of the axis letters, mm and rad
    rotation  of X Y Z; with a mirrored axis its determinant is negative
    scale     one factor for X Y Z
    unknown   letter index -> why the frame's contribution to this coordinate is not known; for X Y Z along the axes of
              the frame itself
    """

    shift: Sequence[float] = ZEROS
    rotation: Rotation = IDENTITY
    scale: float = 1.0
    unknown: UnknownAxes = field(default_factory=dict)

    def then(self, inner: Affine) -> Affine:
        """The frame `inner`, given in this frame, as one frame."""
        if inner is WORLD:
            return self
        if self is WORLD:
            return inner
        if self.rotation is IDENTITY and self.scale == 1.0:
            moved, rotation = inner.shift, inner.rotation
        else:
            x, y, z = (self.scale * dot(row, inner.shift) for row in self.rotation)
            moved, rotation = (x, y, z, *inner.shift[3:]), product(self.rotation, inner.rotation)
        shift = tuple([a + b for a, b in zip(self.shift, moved, strict=True)])
        mine = mixed_into(self.unknown, transposed(inner.rotation)) if self.unknown else self.unknown
        return Affine(shift, rotation, self.scale * inner.scale, {**mine, **inner.unknown})

    def shifted_to(self, values: Mapping[int, float]) -> Affine:
        """The frame with some of its shifts replaced."""
        return replace(self, shift=tuple(values.get(index, value) for index, value in enumerate(self.shift)))


WORLD = Affine()
"""The identity frame."""


@frozen
class FrameStack:
    """The frames in force.

    order         slots that the language stacks, the outermost first
    name          name of the work offset: G54, PRESET2
    datum         work offset or preset, with its own rotation (G10 R)
    additive      G92
    local         G52, or a datum shift along the axes of a tilted plane
    plane         tilted plane: G68.2, CYCLE800, PLANE, cycle 19
    programmable  TRANS, ROT and similar, or the datum shift of cycle 7
    rotation      G68, cycle 10
    mirror        G51.1, cycle 8
    scaling       cycle 11
    """

    order: tuple[str, ...]
    name: str = ""
    datum: Affine = WORLD
    additive: Affine = WORLD
    local: Affine = WORLD
    plane: Affine = WORLD
    programmable: Affine = WORLD
    rotation: Affine = WORLD
    mirror: Affine = WORLD
    scaling: Affine = WORLD

    @property
    def whole(self) -> Affine:
        """All frames composed into one."""
        whole = WORLD
        for slot in reversed(self.order):
            whole = getattr(self, slot).then(whole)
        return whole


# -- frames of one kind -----------------------------------------------------------------------------------------------


def shifted(values: Mapping[int, float]) -> Affine:
    """A pure shift: letter index -> mm or rad."""
    return WORLD.shifted_to(values) if values else WORLD


def turned(angles: Mapping[str, float], order: str = "ZYX") -> Affine:
    """A rotation about the axes in `order`, each as turned by those before it; angles in degrees.

    `ROT X Y Z` turns about Z first, then Y, then X (RPY, the default of MD10600).
    """
    rotation = IDENTITY
    for letter in order:
        if angles.get(letter, 0.0):
            rotation = product(rotation, about(AROUND[letter], angles[letter]))
    return Affine(rotation=rotation)


def turned_in(plane: Plane, degrees: float) -> Affine:
    """A rotation in a plane about the zero point."""
    return Affine(rotation=about(plane, degrees))


def turned_about(rotation: Rotation, centre: Sequence[float]) -> Affine:
    """A rotation or mirroring that leaves the point `centre` (nine numbers, mm and rad) in place."""
    away = rotated(rotation, list(centre))
    return Affine(tuple(c - t for c, t in zip(centre, away, strict=True)), rotation)


def mirrored(letters: str) -> Rotation:
    """The matrix that reverses the named axes."""
    signs = [-1.0 if letter in letters else 1.0 for letter in "XYZ"]
    return as_rotation([[signs[i] if i == k else 0.0 for k in range(3)] for i in range(3)])


def handed(rotation: Rotation) -> float:
    """Handedness of a rotation: 1, or -1 if an odd number of axes is mirrored."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    return 1.0 if a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) > 0 else -1.0


# -- tilted planes ----------------------------------------------------------------------------------------------------


def spatial(angles: Mapping[str, float], order: str = "XYZ") -> Rotation:
    """Rotation about the fixed axes of the workpiece, in `order`; angles in degrees.

    SPA, SPB and SPC turn about X, then Y, then Z; so do roll, pitch and yaw.
    """
    rotation = IDENTITY
    for letter in order:
        rotation = product(about(AROUND[letter], angles.get(letter, 0.0)), rotation)
    return rotation


def euler(precession: float, nutation: float, rotation: float) -> Rotation:
    """Rotation by Euler angles, degrees: about Z, about the turned X, about the tilted Z."""
    return product(about(PLANES[170], precession), product(about(PLANES[190], nutation), about(PLANES[170], rotation)))


def projected(about_y: float, about_x: float, turn: float) -> Rotation | None:
    """Rotation by projection angles, degrees: the tilt seen in the Z/X and Y/Z planes, and a turn in the plane.

    The new X lies in the old Z/X plane, turned by an angle about Y (PROPR); the tilted plane cuts Y/Z at an angle about
    X (PROMIN); then it turns about the new Z (`turn`). None if the two lines do not span a plane.
    """
    x, _, _ = zip(*about(PLANES[180], about_y), strict=True)
    _, trace, _ = zip(*about(PLANES[190], about_x), strict=True)
    normal = unit(cross(x, trace), 1e-9)
    if normal is None:
        return None
    return product(as_rotation(list(zip(x, cross(normal, x), normal, strict=True))), about(PLANES[170], turn))


def from_vectors(base: Triple, normal: Triple, least: float = 1e-12) -> Rotation | None:
    """Rotation to the plane with the given normal (Z) and its X axis towards `base`.

    None if either vector is shorter than `least`, or the sine of the angle between them is less than `least`.
    """
    z, x = unit(normal, least), unit(base, least)
    if z is None or x is None or unit(cross(z, x), least) is None:
        return None
    y = unit(cross(z, base))
    assert y is not None
    return as_rotation(list(zip(cross(y, z), y, z, strict=True)))


def from_points(first: Triple, second: Triple, third: Triple, least: float = 1e-12) -> Rotation | None:
    """Rotation to the plane through three points: X from the first to the second, the third on the +Y side."""
    along, other = minus(second, first), minus(third, first)
    return from_vectors(along, cross(along, other), least)


def minus(a: Triple, b: Triple) -> Triple:
    """`a - b`."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def unit(a: Triple, least: float = 1e-12) -> Triple | None:
    """The unit vector along `a`; None if `a` is shorter than `least`."""
    length = math.hypot(*a)
    return None if length < least else (a[0] / length, a[1] / length, a[2] / length)
