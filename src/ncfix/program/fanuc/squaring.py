"""Which rotary positions put the tool square to the frame in force, by the machine's own kinematics.

This floor knows no kinematics; it is told how a command is said with tool-centre-point control on and off. The tip of
two tool lengths says which way the tool points, and the angles are found from that by Newton's method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ncfix.program.moves import Kinematics, TcpState
from ncfix.program.rs274.coordinates import DEGREE, Vector, X, Y, Z

if TYPE_CHECKING:
    from ncfix.program.fanuc.control import MacroControl

FloatArray = NDArray[np.float64]

SQUARED = "the control's parameters decide; state the rotary axes in the program if they are others"
LENGTH = 100.0
THIRDS = 2 * np.pi * np.arange(3) / 3
STARTS = np.radians(np.arange(-180.0, 180.0, 30.0))
ITERATIONS = 40
STRIDE = 0.5
"""Angles (rad) change by no more than this in a step."""
SOLVED = 1e-9
SAME = 1e-5


@dataclass(frozen=True, slots=True)
class Squared:
    """Where the machine stands when the tool is square to the frame.

    position  the command, all letters
    degrees   angle of each letter
    several   other rotary positions would do as well
    """

    position: Vector
    degrees: tuple[float, ...]
    several: bool


def turned_square(control: MacroControl) -> Squared | None:
    """The nearest rotary positions with the tool along Z of the frame in force; None if it cannot be known."""
    machine = control.machine
    if control.kinematics is None or control.unknown.keys() & set(machine) or not {X, Y, Z} <= set(machine):
        return None
    on, off = TcpState(True, control.offsets.tool[Z]), TcpState(False, control.offsets.tool[Z])
    here = np.array(control.kinematics([control.position[i] for i in machine], on, off))
    turning = [column for column, index in enumerate(machine) if control.rotary[index]]
    pointing = Pointing.of(control.kinematics, here, turning, [machine.index(index) for index in (X, Y, Z)])
    ways = solutions(pointing, np.array([row[2] for row in control.rotation]), here[turning])
    if not len(ways):
        return None
    best = ways[np.argmin(np.abs(wrapped(ways - here[turning])).sum(axis=1))]
    here[turning] += wrapped(best - here[turning])
    position = control.position[:]
    for index, value in zip(machine, control.kinematics(here.tolist(), off, on), strict=True):
        position[index] = value
    return Squared(position, tuple(value / DEGREE for value in position), len(ways) > 1)


@dataclass(frozen=True, slots=True)
class Pointing:
    """The unit vector from the tip towards the spindle in the workpiece, as a function of k rotary positions.

    Each rotary axis turns it about a line, so that it is a polynomial of first degree in cosine and sine of each angle:
    3^k poses determine it.

    coefficients  (3, ..., 3, 3) by 1, cos, sin of each angle; the last axis is X Y Z
    """

    coefficients: FloatArray

    @classmethod
    def of(cls, kinematics: Kinematics, here: FloatArray, turning: Sequence[int], spatial: Sequence[int]) -> Pointing:
        """From a machine's kinematics; `turning` and `spatial` are the columns of rotary axes and of X Y Z."""
        count = len(turning)
        sampled = np.empty((3,) * count + (3,))
        for place in product(range(3), repeat=count):
            command = here.copy()
            command[list(turning)] = THIRDS[list(place)]
            sampled[place] = direction(kinematics, command, spatial)
        inverse = np.linalg.inv(basis(THIRDS))
        for axis in range(count):
            sampled = np.moveaxis(np.tensordot(inverse, sampled, (1, axis)), 0, axis)
        return cls(sampled)

    def at(self, angles: FloatArray) -> FloatArray:
        """The vectors for angles (m, k) in rad, (m, 3)."""
        terms = np.broadcast_to(self.coefficients, (len(angles), *self.coefficients.shape))
        for column in angles.T:
            terms = np.einsum("mb,mb...->m...", basis(column), terms)
        return np.asarray(terms)


def basis(angles: FloatArray) -> FloatArray:
    """1, cosine and sine of angles (m,), (m, 3)."""
    return np.stack((np.ones_like(angles), np.cos(angles), np.sin(angles)), axis=-1)


def direction(kinematics: Kinematics, command: FloatArray, spatial: Sequence[int]) -> FloatArray:
    """The unit vector from the tip towards the spindle at axis positions: by the tips of two tool lengths."""
    values = command.tolist()
    tips = [np.array(kinematics(values, TcpState(False, length), TcpState(True, length))) for length in (LENGTH, 0.0)]
    return np.asarray((tips[1] - tips[0])[list(spatial)] / LENGTH)


def solutions(pointing: Pointing, wanted: FloatArray, here: FloatArray) -> FloatArray:
    """All rotary positions (rad, within a turn) that point the tool along `wanted` (3,): (m, k).

    Where an axis may stand anywhere (the tool along it), one of them is that nearest to `here` (k,).
    """
    count = pointing.coefficients.ndim - 1
    angles = np.array([tuple(here), *product(STARTS, repeat=count)])
    for _ in range(ITERATIONS):
        residual = pointing.at(angles) - wanted
        slopes = np.stack([pointing.at(angles + quarter) for quarter in np.eye(count) * np.pi / 2], axis=-1)
        halves = np.stack([pointing.at(angles - quarter) for quarter in np.eye(count) * np.pi / 2], axis=-1)
        step = np.linalg.pinv((slopes - halves) / 2, rcond=1e-9) @ -residual[..., None]
        angles = angles + np.clip(step[..., 0], -STRIDE, STRIDE)
    solved = angles[np.abs(pointing.at(angles) - wanted).max(axis=1) < SOLVED]
    found: list[FloatArray] = []
    for each in wrapped(solved):
        if all(np.abs(wrapped(each - other)).max() > SAME for other in found):
            found.append(each)
    return np.array(found).reshape(-1, count)


def wrapped(angles: FloatArray) -> FloatArray:
    """Angles (rad) between minus and plus half a turn."""
    return np.asarray((angles + np.pi) % (2 * np.pi) - np.pi)
