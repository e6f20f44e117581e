"""An axis: a straight guide or a bearing, and the frame in which its errors are given."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ncfix.machine import se3
from ncfix.machine.se3 import Array

Vector = tuple[float, float, float]
Triad = tuple[Vector, Vector, Vector]
ORIGIN: Vector = (0.0, 0.0, 0.0)
BASE_AXES: Triad = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Axis:
    """A prismatic or revolute joint. Geometry in the base frame with all axes at zero.

    name            the axis letter
    rotary          revolute (rad) or prismatic (mm)
    workpiece_side  it carries the workpiece rather than the tool
    direction       unit vector: how the moving body moves when the number grows; of a rotary axis right-handed
    point           a point on the axis line, mm
    range           lowest and highest position, mm or rad; infinite where endless or not given
    error_axes      the triad along and about which its errors act, as rows
    moving_frame    that triad turns with the axis itself
    pitch           mm, of its screw, where known
    """

    name: str
    rotary: bool
    workpiece_side: bool
    direction: Vector
    point: Vector = ORIGIN
    range: tuple[float, float] = (-np.inf, np.inf)
    error_axes: Triad = BASE_AXES
    moving_frame: bool = False
    pitch: float | None = None

    @property
    def endless(self) -> bool:
        """A rotary axis that may turn round and round: 370 degrees is where 10 degrees is."""
        return self.rotary and not np.isfinite(self.range).any()

    @property
    def reference(self) -> Vector:
        """Where errors of an effect refer to if it does not say: the axis point, or the base origin of a linear one."""
        return self.point if self.rotary else ORIGIN

    @property
    def zero_sense(self) -> float:
        """What turns a location error along or about the axis into the zero offset that is added to its position.

        The file gives the offset as such, so one along an error axis that points against `direction` counts as it is
        written; of errors that are only partly along the axis, the projection on `direction` counts.
        """
        against = np.asarray(self.error_axes) @ np.asarray(self.direction) < -1 + 1e-9
        return -1.0 if against.any() else 1.0

    @property
    def unit(self) -> float:
        """Internal units per unit of the machine file: rad per degree, or 1."""
        return np.pi / 180 if self.rotary else 1.0

    @property
    def screw(self) -> tuple[Array, Array]:
        """The twist of unit motion (v, w) about the base origin."""
        direction = np.asarray(self.direction)
        if self.rotary:
            return np.cross(self.point, direction), direction
        return direction, np.zeros(3)

    def motion(self, position: Array) -> Array:
        """The nominal motion of its body, shape (...) [mm or rad] -> (..., 4, 4), base frame."""
        position = np.asarray(position, dtype=np.float64)
        displacement = position[..., None] * np.asarray(self.direction)
        return se3.turn(displacement, self.point) if self.rotary else se3.shift(displacement)


@dataclass(frozen=True, slots=True)
class Tool:
    """The end of the tool branch, base frame with all axes at zero: the gauge line, and the way from the tip to it."""

    direction: Vector = (0.0, 0.0, 1.0)
    point: Vector = field(default=ORIGIN)

    def tip(self, length: Array) -> Array:
        """The tip of a tool of this length, shape (...) [mm] -> (..., 3)."""
        tip: Array = np.asarray(self.point) - np.asarray(length)[..., None] * np.asarray(self.direction)
        return tip
