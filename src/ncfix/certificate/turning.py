"""The second reader: turned coordinates, and the rotary positions that square the tool to a tilted plane."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.certificate.reading import DECIMAL, NUMBER
from ncfix.certificate.steps import AxisStep, StraightRun
from ncfix.values import frozen

AXIS = {"X": 0, "Y": 1, "Z": 2}
SAME = 1e-9
MOST_STEPS, MOST_KNOWN = 40, 100
AS_NEAR = 1e-3
"""Difference of two ways, rad, below which they are equally near."""


@frozen
class TurnedFrame:
    """Coordinates turned by a program: numbers `zero + p` mean commands `origin + rotation @ p`.

    columns   the columns of X, Y and Z
    rotation  (3, 3); `zero`, `origin` (3,) mm
    tilted    the numbers are those of the tip in a plane fixed to the workpiece, with the tool square to it
    """

    columns: tuple[int, ...]
    rotation: Array
    zero: Array
    origin: Array
    tilted: bool

    def commands(self, numbers: Array) -> Array:
        """(k, n_axes) commands that numbers (k, n_axes) mean."""
        found = numbers.copy()
        away = numbers[:, self.columns] - self.zero
        for row, column in enumerate(self.columns):
            found[:, column] = self.origin[row]
            for k in np.flatnonzero(self.rotation[row]).tolist():  # an axis that takes no part may be unknown
                found[:, column] += away[:, k] * self.rotation[row, k]  # rounded alike for one and for many
        return found

    def numbers(self, command: Array) -> Array:
        """(n_axes,) the inverse of `commands`, for one position (n_axes,)."""
        found, columns = command.copy(), list(self.columns)
        found[columns] = self.zero + self.rotation.T @ (command[columns] - self.origin)
        return found

    def said(self, said: Mask) -> Mask:
        """(k, n_axes) whether the program has set all numbers on which the command of an axis depends."""
        found, mixed = said.copy(), self.rotation != 0.0
        for row in range(3):
            found[:, self.columns[row]] = said[:, [self.columns[k] for k in range(3) if mixed[row, k]]].all(axis=1)
        return found

    def step(self, step: AxisStep) -> AxisStep:
        """A step in numbers, converted to commands."""
        start, end = self.commands(np.array([step.start, step.end]))
        said = self.said(np.array([step.said]))[0]
        centre = self.origin + self.rotation @ (np.array(step.centre) - self.zero)
        return replace(
            step,
            start=start.tolist(),
            end=end.tolist(),
            said=said.tolist(),
            centre=tuple(centre.tolist()),
            turn=self.rotation,
        )

    def run(self, run: StraightRun) -> StraightRun:
        """A run of steps in numbers, converted to commands."""
        return run._replace(
            start=self.commands(run.start),
            end=self.commands(run.end),
            said=self.said(run.said),
            modes=run.modes._replace(turn=self.rotation),
        )


def about(axis: str, degrees: float) -> Array:
    """(3, 3) right-handed rotation about an axis."""
    k = AXIS[axis]
    i, j = (k + 1) % 3, (k + 2) % 3
    quarter = degrees % 360.0
    exact = {0.0: (1.0, 0.0), 90.0: (0.0, 1.0), 180.0: (-1.0, 0.0), 270.0: (0.0, -1.0)}.get(quarter)
    cos, sin = exact or (math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))
    found = np.eye(3)
    found[i, i] = found[j, j] = cos
    found[i, j], found[j, i] = -sin, sin
    return found


def turned(*turns: tuple[str, float]) -> Array:
    """(3, 3) consecutive rotations about axes, degrees, each axis turned by the rotations before it."""
    found = np.eye(3)
    for axis, degrees in turns:
        found = found @ about(axis, degrees)
    return found


@frozen
class SwivelCall:
    """The meaning of a CYCLE800 call.

    rotation  (3, 3) rotation of the plane; `origin` (3,): its origin in the work offset, in units of the program
    sense     -1 or 1: take the smaller or the larger angle of the axis that tilts the tool
    """

    rotation: Array
    origin: Array
    sense: int

    @classmethod
    def of(cls, call: str) -> SwivelCall | None:
        """From a call with plain numbers and consecutive rotations about three axes; None for any other call."""
        parts = [part.strip() for part in re.sub(r'"[^"]*"', "", call.partition("(")[2].rstrip(") \t")).split(",")]
        if not all(re.fullmatch(NUMBER, part) for part in parts if part):
            return None
        values = [float(part) if part else 0.0 for part in parts] + [0.0] * 14
        mode, state, sense = int(values[3]), int(values[2]), int(values[13])
        axes = ["?XYZ"[mode >> shift & 3] for shift in (0, 2, 4)]
        if sense not in (-1, 1) or mode >> 6 or sorted(axes) != ["X", "Y", "Z"] or state % 10 or state // 100 % 10:
            return None
        rotation = turned(*zip(axes, values[7:10], strict=True))
        return cls(rotation, np.array(values[4:7]) + rotation @ np.array(values[10:13]), sense)


PLANE = re.compile(r"PLANE (?:SPATIAL|RESET)\b")
PLANE_WORD = re.compile(
    rf"(?P<angle>SP[ABC]) ?(?P<size>{DECIMAL})(?![\d.,])|(?P<turn>TURN|MOVE|STAY)|(?P<sign>SEQ|SYM) ?(?P<side>[+-])"
    r"|(?P<other>FMAX|F ?AUTO|F ?MAX|F ?\d+|MB ?MAX|(?:MB|DIST|ABST) ?[\d.,]+|TABLE ROT|COORD ROT)"
    r"|(?P<comment>;.*)|(?P<odd>\S+)"
)


@frozen
class PlaneBlock:
    """The meaning of a PLANE block of Klartext.

    rotation   (3, 3) rotation of the plane; None for RESET
    positions  TURN, MOVE or STAY
    sign       1 for SEQ+, -1 for SEQ-, 0 for neither
    table      whether it has TABLE ROT
    """

    rotation: Array | None
    positions: str
    sign: int
    table: bool

    @classmethod
    def of(cls, block: str) -> PlaneBlock | None:
        """From a block in capitals; None if this reader does not know all of its words."""
        angles, positions, sign = dict.fromkeys("ABC", 0.0), "", 0
        for found in PLANE_WORD.finditer(block, len("PLANE SPATIAL" if "SPATIAL" in block[:14] else "PLANE RESET")):
            if found["odd"] is not None:
                return None
            if found["angle"]:
                angles[found["angle"][-1]] = float(found["size"].replace(",", "."))
            positions = found["turn"] or positions
            sign = {"+": 1, "-": -1, None: sign}[found["side"]]
        if not positions:
            return None
        about_fixed = turned(("Z", angles["C"]), ("Y", angles["B"]), ("X", angles["A"]))
        return cls(None if "RESET" in block[:12] else about_fixed, positions, sign, "TABLE ROT" in block)


class RotaryWay:
    """The positions of two rotary axes with the tool square to a plane.

    directions  positions of both axes (k, 2), rad -> unit vectors (k, 3) from the tip to the spindle in the workpiece
    travel      (2, 2) travels of both axes, rad
    """

    def __init__(self, directions: Callable[[Array], Array], travel: Array) -> None:
        self.directions, self.travel = directions, travel
        self._known: dict[tuple[bytes, bytes], tuple[list[Array], bool]] = {}
        self.outer = 0 if self._turns_about_one_line() else 1
        """The axis (0 or 1) that turns about a line fixed in the workpiece."""

    def _turns_about_one_line(self) -> bool:
        """Whether the first axis turns about the same line for all positions of the second."""
        points = self.directions(np.array([[angle, other] for other in (0.5, 1.3) for angle in (0.0, 2.0, 4.0)]))
        lines = np.cross(points[[1, 4]] - points[[0, 3]], points[[2, 5]] - points[[1, 4]])
        lines /= np.maximum(np.linalg.norm(lines, axis=1), SAME)[:, None]
        return bool(np.abs(lines[0] - lines[1]).max() < SAME)

    def to(self, wanted: Array, here: Array, *, sense: int, sign: int, inside: bool, stays: bool) -> Array | None:
        """(2,) positions, rad, nearest to `here` (2,), with the tool along the unit vector `wanted` (3,).

        sense   1 or -1: take the position with the larger or smaller angle of the inner axis; 0: the nearest
        sign    1 or -1: the sign of the angle of the inner axis; 0: any
        inside  within the travels
        stays   if the outer axis is free, it stays; else there is a result only if it stands at zero

        None if there is none, if two are equally near, or if an axis makes half a turn.
        """
        key = (wanted.tobytes(), here.tobytes())  # programs turn to the same planes again and again
        if key not in self._known:
            if len(self._known) >= MOST_KNOWN:
                self._known.clear()
            self._known[key] = self._ways(wanted, here)
        ways, free = self._known[key]
        if free and not stays and abs(here[self.outer]) > SAME:
            return None
        if inside:
            ways = [within for each in ways if (within := self._inside(each, here)) is not None]
        inner = 1 - self.outer
        if sign:
            ways = [each for each in ways if abs(each[inner]) < SAME or (each[inner] > 0) == (sign > 0)]
        if sense and not free:
            if any(_is_half_turn(each[inner] - here[inner]) for each in ways):
                return None  # which of two angles it is
            ways = sorted(ways, key=lambda each: -sense * float(each[inner]))
            return None if not ways or _is_half_turn(ways[0][self.outer] - here[self.outer]) else ways[0]
        ways = sorted(ways, key=lambda each: float(np.abs(each - here).sum()))
        if len(ways) > 1 and np.abs(ways[1] - here).sum() - np.abs(ways[0] - here).sum() < AS_NEAR:
            return None
        return None if not ways or any(map(_is_half_turn, ways[0] - here)) else ways[0]

    def _inside(self, way: Array, here: Array) -> Array | None:
        """The equivalent positions within the travels, by full turns, nearest to `here`; None if there are none."""
        turns = way[:, None] + 2 * math.pi * np.arange(-2, 3)
        good = (turns >= self.travel[:, :1] - 1e-6) & (turns <= self.travel[:, 1:] + 1e-6)
        best = np.argmin(np.where(good, np.abs(turns - here[:, None]), np.inf), axis=1)
        return turns[[0, 1], best] if good.any(axis=1).all() else None

    def _ways(self, wanted: Array, here: Array) -> tuple[list[Array], bool]:
        """All positions at most half a turn from `here`, and whether the outer axis is free (then it stays)."""
        grid = np.linspace(-3.0, 3.0, 5)
        at = np.vstack([here, *([[one, other] for one in grid for other in grid])])
        for _ in range(MOST_STEPS):
            ahead, behind = (
                np.stack([self.directions(at + probe * np.eye(2)[k]) for k in (0, 1)], axis=-1)
                for probe in (1e-5, -1e-5)
            )
            off = (self.directions(at) - wanted)[..., None]
            step = np.clip((np.linalg.pinv((ahead - behind) / 2e-5, rcond=1e-5) @ off)[..., 0], -0.5, 0.5)
            at = at - step
            if (np.abs(step) < SAME).all():
                break
        good = np.abs(self.directions(at) - wanted).max(axis=1) < SAME
        at = here + (at - here + math.pi) % (2 * math.pi) - math.pi
        found: list[Array] = []
        for each in at[good]:
            if all(np.abs((each - other + math.pi) % (2 * math.pi) - math.pi).max() > 1e-6 for other in found):
                found.append(each)
        free = len(found) > 2
        if free:
            found = [at[0]] if good[0] and abs(float(at[0][self.outer] - here[self.outer])) < 1e-6 else []
        return found, free


def _is_half_turn(angle: float) -> bool:
    """Whether an angle, rad, is half a turn, whose direction is ambiguous."""
    return abs(abs(angle) - math.pi) < AS_NEAR
