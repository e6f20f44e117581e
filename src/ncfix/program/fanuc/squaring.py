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
STEP = 1e-6
STARTS = np.radians(np.arange(-180.0, 180.0, 60.0))
ITERATIONS = 30
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
    if control.kinematics is None or control.unknown.keys() & set(control.machine):
        return None
    wanted = np.array([row[2] for row in control.rotation])
    tool = control.offsets.tool[Z]
    on, off = TcpState(True, tool), TcpState(False, tool)
    here = np.array(control.kinematics([control.position[i] for i in control.machine], on, off))
    turning = [column for column, index in enumerate(control.machine) if control.rotary[index]]
    ways = solutions(control.kinematics, here, turning, wanted)
    if not ways:
        return None
    best = min(ways, key=lambda angles: float(np.abs(wrapped(angles - here[turning])).sum()))
    here[turning] += wrapped(best - here[turning])
    command = control.kinematics(here.tolist(), off, on)
    position = control.position[:]
    for index, value in zip(control.machine, command, strict=True):
        position[index] = value
    return Squared(position, tuple(value / DEGREE for value in position), len(ways) > 1)


def solutions(kinematics: Kinematics, here: FloatArray, turning: Sequence[int], wanted: FloatArray) -> list[FloatArray]:
    """All rotary positions (rad, within a turn) that point the tool along `wanted` (3,)."""
    found: list[FloatArray] = []
    for start in product(STARTS, repeat=len(turning)):
        angles = newton(kinematics, here, turning, wanted, np.array(start))
        if angles is not None and all(np.abs(wrapped(angles - other)).max() > SAME for other in found):
            found.append(wrapped(angles))
    return found


def newton(
    kinematics: Kinematics, here: FloatArray, turning: Sequence[int], wanted: FloatArray, angles: FloatArray
) -> FloatArray | None:
    """The rotary positions that a start leads to; None if it leads nowhere."""
    for _ in range(ITERATIONS):
        residual = direction(kinematics, here, turning, angles) - wanted
        if np.abs(residual).max() < SOLVED:
            return angles
        slopes = [
            (direction(kinematics, here, turning, angles + STEP * unit) - wanted - residual) / STEP
            for unit in np.eye(len(angles))
        ]
        step = np.linalg.lstsq(np.stack(slopes, axis=1), -residual, rcond=1e-6)[0]
        angles = angles + np.clip(step, -0.5, 0.5)
    return None


def direction(kinematics: Kinematics, here: FloatArray, turning: Sequence[int], angles: FloatArray) -> FloatArray:
    """The unit vector from the tip towards the spindle in the workpiece, (3,), with the rotary axes at `angles`."""
    command = here.copy()
    command[list(turning)] = angles
    values = command.tolist()
    tips = [np.array(kinematics(values, TcpState(False, length), TcpState(True, length))) for length in (LENGTH, 0.0)]
    return np.asarray((tips[1] - tips[0])[[X, Y, Z]] / LENGTH)


def wrapped(angles: FloatArray) -> FloatArray:
    """Angles (rad) between minus and plus half a turn."""
    return np.asarray((angles + np.pi) % (2 * np.pi) - np.pi)
