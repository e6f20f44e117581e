"""Which rotary positions put the tool square to the frame in force, by the machine's own kinematics.

This floor knows no kinematics; it is told how a command is said with tool-centre-point control on and off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ncfix.control.coordinates import DEGREE, Vector, X, Y, Z
from ncfix.control.moves import TcpState
from ncfix.control.pointing import SQUARE

if TYPE_CHECKING:
    from ncfix_fanuc.macro.control import MacroControl

SQUARED = "the control's parameters decide; state the rotary axes in the program if they are others"


@dataclass(frozen=True, slots=True)
class Squared:
    """Where the machine stands when the tool is square to the frame.

    position  the command, all letters, where the linear axes stand still
    about_tip the same where they follow, and the tip stays where it is
    degrees   angle of each letter
    several   other rotary positions would do as well
    """

    position: Vector
    about_tip: Vector
    degrees: tuple[float, ...]
    several: bool


def turned_square(control: MacroControl) -> Squared | None:
    """The nearest rotary positions with the tool along Z of the frame in force; None if it cannot be known.

    Where X Y Z stand does not matter for these.
    """
    machine, kinematics = control.machine, control.kinematics
    if kinematics is None or any(control.rotary[index] for index in control.unknown) or not {X, Y, Z} <= set(machine):
        return None
    pointing = control.pointing
    if pointing is None:
        return None
    on, off = TcpState(True, control.offsets.tool[Z]), TcpState(False, control.offsets.tool[Z])
    here = list(kinematics([control.position[i] for i in machine], on, off))
    outer, inner = pointing.columns
    ways = pointing.angles(np.array([row[2] for row in control.rotation]), (here[outer], here[inner]))
    if not ways:
        return None
    here[outer], here[inner] = ways[0]
    position = control.position[:]
    for index, value in zip(machine, kinematics(here, off, on), strict=True):
        position[index] = value
    about_tip = [position[i] if control.rotary[i] else control.position[i] for i in range(len(position))]
    return Squared(position, about_tip, tuple(value / DEGREE for value in position), len(ways) > 1)


def stands_square(control: MacroControl) -> bool:
    """Whether the tool is known to lie along Z of the frame in force."""
    if control.pointing is None or any(control.rotary[index] for index in control.unknown):
        return False
    tool = control.pointing.direction(np.array([control.position[index] for index in control.machine]))
    return bool(np.linalg.norm(tool - [row[2] for row in control.rotation]) < SQUARE)
