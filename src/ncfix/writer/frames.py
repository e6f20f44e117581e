"""Between commands (mm, rad, offsets included) and the numbers a program writes (its units, its frame, degrees)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.control.moves import Frame
from ncfix.text.spelling import decimals_for

FloatArray = NDArray[np.float64]


class FrameMap:
    """One frame of a program for a given set of axes, with the maps both ways. Positions have shape (..., n_axes)."""

    def __init__(self, frame: Frame, axes: tuple[str, ...], rotary: NDArray[np.bool_]) -> None:
        self.frame = frame
        self.scale = np.where(rotary, np.pi / 180, frame.unit)
        if frame.diameter and "X" in axes:
            self.scale[axes.index("X")] /= 2
        self.spatial = [axes.index(letter) for letter in "XYZ" if letter in axes]
        self.axes = ["XYZ".index(letter) for letter in "XYZ" if letter in axes]
        self.rotation = frame.rotation[np.ix_(self.axes, self.axes)]
        self.rotated = not np.array_equal(frame.rotation, np.eye(3))
        self.unit = frame.unit
        self.origin = np.array([frame.offset[axes.index(letter)] if letter in axes else 0.0 for letter in "XYZ"])

    def program(self, command: FloatArray) -> FloatArray:
        """Program numbers of a command (..., n_axes), mm and rad: in units of the program, in its frame."""
        values = command - self.frame.offset
        if self.rotated:
            values[..., self.spatial] = _turned(values[..., self.spatial], self.rotation)
        return values / self.scale

    def decimals(self, steps: FloatArray) -> NDArray[np.int64]:
        """(n_axes,) digits behind the point that numbers need for what the control can resolve, mm and rad."""
        return np.array([decimals_for(step) for step in steps / self.scale], dtype=np.int64)

    def still(self, unmoved: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Axes that stand exactly where they stood, free of the rounding of these maps.

        unmoved  (n_axes,) those that the program did not tell to move; in a rotated frame one of X Y Z moves them all
        """
        if not self.rotated or unmoved[self.spatial].all():
            return unmoved
        result = unmoved.copy()
        result[self.spatial] = False
        return result

    def command(self, program: FloatArray) -> FloatArray:
        """The inverse of `program`."""
        values = program * self.scale
        if self.rotated:
            values[..., self.spatial] = _turned(values[..., self.spatial], self.rotation.T)
        return values + self.frame.offset

    def program_point(self, point: FloatArray) -> FloatArray:
        """A point X Y Z (mm, command coordinates) in program numbers; diameters do not apply to centres."""
        return np.asarray((point - self.origin) @ self.frame.rotation / self.unit)

    def point_of(self, program: FloatArray) -> FloatArray:
        """X Y Z (3,) of a position (n_axes,) in the numbers in which centres are given: no diameters."""
        point = np.zeros(3)
        point[self.axes] = program[self.spatial]
        if self.frame.diameter:
            point[0] /= 2
        return point

    def command_point(self, point: FloatArray) -> FloatArray:
        """The inverse of `program_point`, (..., 3)."""
        return np.asarray((point * self.unit) @ self.frame.rotation.T + self.origin)


def _turned(points: FloatArray, rotation: FloatArray) -> FloatArray:
    """Points (..., k) times a rotation; what is not known (NaN) stays with the coordinates that are made of it."""
    lost = np.isnan(points)
    if not lost.any():
        return np.asarray(points @ rotation)
    result: FloatArray = np.where(lost, 0.0, points) @ rotation
    result[(lost.astype(float) @ (rotation != 0.0)) > 0] = np.nan
    return result
