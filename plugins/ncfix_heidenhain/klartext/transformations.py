"""What lies between the numbers of a Klartext program and commands: preset, shift, tilt, mirror, rotation, scale.

Source: TNC 640, "Coordinate systems" and "Cycles: coordinate transformations". Mirror, rotation and scale act about the
datum that is in force when they are programmed. A shift that follows a tilt is counted along the tilted axes. What
the manuals leave open, or make depend on the order, is `doubtful`: nothing is corrected until it has been reset.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ncfix.control.coordinates import (
    IDENTITY,
    INDEX,
    PLANES,
    Rotation,
    Vector,
    about,
    as_rotation,
    product,
    rotated,
    zeros,
)

SHIFT_IN_ROTATION = "a datum shift while mirror, rotation or scale is active: whether it turns along is not sure"
SHIFT_UNDER_TILT = "a datum shift on both sides of a tilted plane: how the control adds them up is not sure"
MIRROR_AND_ROTATION = "mirror and rotation together: their order is not sure"
MIRRORED_ROTARY = "a mirrored rotary axis"


@dataclass(slots=True)
class Transformations:
    """The transformations in force, mm and rad.

    preset    (9,) the active preset
    shift     (9,) datum shift before the tilt
    inner     (3,) datum shift along the tilted axes
    tilt      the tilted plane, columns its axes in the workpiece; IDENTITY with `tilted` False while there is none
    mirror    letters that are mirrored
    turn      rotation in the working plane, degrees
    scale     factor
    doubtful  why what is in force is not sure; empty while it is
    """

    preset: Vector = field(default_factory=zeros)
    shift: Vector = field(default_factory=zeros)
    inner: Vector = field(default_factory=zeros)
    tilt: Rotation = IDENTITY
    tilted: bool = False
    mirror: frozenset[str] = frozenset()
    turn: float = 0.0
    scale: float = 1.0
    doubtful: str = ""

    @property
    def plain(self) -> bool:
        """Neither mirror nor rotation nor scale is active."""
        return not self.mirror and self.turn == 0.0 and self.scale == 1.0

    @property
    def rotation(self) -> Rotation:
        """What acts on X Y Z of the program, before the shift."""
        signs = [-1.0 if letter in self.mirror else 1.0 for letter in "XYZ"]
        mirror = as_rotation([[signs[i] if i == j else 0.0 for j in range(3)] for i in range(3)])
        inside = about(PLANES[170], self.turn) if self.turn else mirror
        if not self.tilted:
            return IDENTITY if inside == IDENTITY else inside
        return product(self.tilt, inside)

    @property
    def whole_shift(self) -> Vector:
        """The datum in the coordinates of the preset."""
        turned = rotated(self.tilt, self.inner) if self.tilted else self.inner
        return [a + b for a, b in zip(self.shift, turned, strict=True)]

    # -- what a program does to them ----------------------------------------------------------------------------------

    def shift_axis(self, letter: str, value: float, *, incremental: bool) -> None:
        """Cycle 7, or TRANS DATUM, for one axis; mm or rad."""
        index = INDEX[letter]
        here = self.inner if self.tilted and index < 3 else self.shift
        before = here[index]
        here[index] = before + value if incremental else value
        if here[index] != before and not self.plain:
            self.doubtful = SHIFT_IN_ROTATION
        if self.tilted and any(self.shift[:3]):
            self.doubtful = SHIFT_UNDER_TILT
            if not incremental and value == 0.0:
                self.shift[index] = 0.0
        self.settle()

    def reset_shift(self) -> None:
        """TRANS DATUM RESET."""
        for letter in "XYZABCUVW":
            self.shift_axis(letter, 0.0, incremental=False)

    def mirror_axes(self, letters: frozenset[str]) -> None:
        """Cycle 8: these axes are mirrored; none ends it."""
        self.mirror = letters & frozenset("XYZ")
        if letters & frozenset("ABC"):
            self.doubtful = MIRRORED_ROTARY
        self.check()

    def rotate(self, degrees: float, *, incremental: bool) -> None:
        """Cycle 10."""
        self.turn = (self.turn if incremental else 0.0) + degrees
        self.check()

    def scale_by(self, factor: float) -> None:
        """Cycle 11."""
        self.scale = factor
        self.check()

    def tilt_to(self, tilt: Rotation | None) -> None:
        """A tilted plane, None for none."""
        if any(self.inner):
            self.doubtful = SHIFT_UNDER_TILT
            if tilt is None:
                self.shift[:3] = [a + b for a, b in zip(self.shift[:3], self.inner[:3], strict=True)]
                self.inner = zeros()
        self.tilt, self.tilted = (IDENTITY, False) if tilt is None else (tilt, True)
        self.settle()

    def check(self) -> None:
        """Mirror and rotation do not commute."""
        if self.mirror and self.turn:
            self.doubtful = MIRROR_AND_ROTATION
        self.settle()

    def settle(self) -> None:
        """With everything reset nothing is doubtful."""
        if self.plain and not self.tilted and not any(self.shift) and not any(self.inner):
            self.doubtful = ""


def spatial(a: float, b: float, c: float) -> Rotation:
    """Spatial angles, degrees: about the machine's X by `a`, then about its Y by `b`, then about its Z by `c`."""
    return product(about(PLANES[170], c), product(about(PLANES[180], b), about(PLANES[190], a)))


def euler(precession: float, nutation: float, rotation: float) -> Rotation:
    """Euler angles, degrees: about Z, about the turned X, about the tilted Z (EULPR, EULNU, EULROT)."""
    return product(about(PLANES[170], precession), product(about(PLANES[190], nutation), about(PLANES[170], rotation)))


def projected(first: float, second: float, turn: float) -> Rotation | None:
    """Projection angles, degrees: the tilt as it shows in the Z/X and in the Y/Z plane, and a turn in the plane.

    `first` (PROPR) turns the X axis towards Z as seen in the Z/X plane, as a spatial angle about Y does; `second`
    (PROMIN) turns Y towards Z as seen in the Y/Z plane, as one about X does. None where there is no such plane.
    """
    if abs(first) >= 90 or abs(second) >= 90:
        return None
    along_x = (1.0, 0.0, -math.tan(math.radians(first)))
    along_y = (0.0, 1.0, math.tan(math.radians(second)))
    found = from_vectors(along_x, cross(along_x, along_y))
    return None if found is None else product(found, about(PLANES[170], turn))


Triple = tuple[float, float, float]


def from_vectors(base: Triple, normal: Triple) -> Rotation | None:
    """The plane with a normal and an X axis that lies in the direction of `base`; None if they are parallel or zero."""
    z = unit(normal)
    y = None if z is None else unit(cross(z, base))
    if z is None or y is None:
        return None
    x = cross(y, z)
    return as_rotation(list(zip(x, y, z, strict=True)))


def from_points(first: Triple, second: Triple, third: Triple) -> Rotation | None:
    """The plane through three points: X from the first to the second, the third on the side of +Y."""
    along, other = minus(second, first), minus(third, first)
    return from_vectors(along, cross(along, other))


def minus(a: Triple, b: Triple) -> Triple:
    """`a - b`."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def cross(a: Triple, b: Triple) -> Triple:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def unit(a: Triple) -> Triple | None:
    """A vector of length one; None for the zero vector."""
    length = math.hypot(*a)
    return None if length < 1e-12 else (a[0] / length, a[1] / length, a[2] / length)
