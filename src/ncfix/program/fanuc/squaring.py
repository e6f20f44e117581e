"""Which rotary positions put the tool square to the frame in force, by the machine's own kinematics.

This floor knows no kinematics; it is told how a command is said with tool-centre-point control on and off. The tips of
two tool lengths say which way the tool points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ncfix.program.follow.coordinates import DEGREE, Vector, X, Y, Z
from ncfix.program.moves import TcpState
from ncfix.program.pointing import Pointing

if TYPE_CHECKING:
    from ncfix.program.fanuc.control import MacroControl

SQUARED = "the control's parameters decide; state the rotary axes in the program if they are others"
LENGTH = 100.0
PLACES = (X, Y, Z)


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
    """The nearest rotary positions with the tool along Z of the frame in force; None if it cannot be known."""
    machine, kinematics = control.machine, control.kinematics
    if kinematics is None or control.unknown.keys() & set(machine) or not {X, Y, Z} <= set(machine):
        return None
    pointing = pointing_of(control)
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


def pointing_of(control: MacroControl) -> Pointing | None:
    """How the machine points its tool; None unless by two rotary axes."""
    if not control.pointing:
        control.pointing.append(found_out(control))
    return control.pointing[0]


def found_out(control: MacroControl) -> Pointing | None:
    """`pointing_of`, asked of the kinematics."""
    machine, kinematics = control.machine, control.kinematics
    turning = [column for column, index in enumerate(machine) if control.rotary[index]]
    if kinematics is None or len(turning) != 2:
        return None
    spatial = [machine.index(index) for index in PLACES if index in machine]
    if len(spatial) < len(PLACES):
        return None

    def direction(first: float, second: float) -> NDArray[np.float64]:
        values = [0.0] * len(machine)
        values[turning[0]], values[turning[1]] = first, second
        tips = [np.array(kinematics(values, TcpState(False, size), TcpState(True, size))) for size in (LENGTH, 0.0)]
        return np.asarray((tips[1] - tips[0])[spatial] / LENGTH)

    return Pointing.of((turning[0], turning[1]), direction)
