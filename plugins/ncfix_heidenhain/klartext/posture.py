"""How the machine stands to the workpiece, asked of its kinematics: for tilted planes.

The kinematics say where the tip of a tool of any length is in the workpiece. The tip of a longer tool less that of a
shorter one is the direction of the tool; the tip with an axis moved less the tip without is the direction of that axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ncfix.control.coordinates import Rotation, Vector, X, Y, Z, as_rotation
from ncfix.control.moves import TcpState
from ncfix.control.pointing import SQUARE, within
from ncfix.control.tcp import PROBE
from ncfix_heidenhain.klartext.control import Control
from ncfix_heidenhain.klartext.transformations import Triple, minus, unit

NOT_NORMAL = "the tool does not stand normal to the tilted plane, by the axis positions of the program"


@dataclass(frozen=True, slots=True)
class Posture:
    """Directions in the workpiece.

    tool   from the tip to the spindle
    axes   of the machine's X, Y and Z, as columns of a rotation
    """

    tool: Triple
    axes: Rotation


def tip(control: Control, position: Vector, length: float) -> Triple:
    """The tip in the workpiece, mm."""
    assert control.kinematics is not None
    command = [position[index] for index in control.machine]
    found = control.kinematics(command, TcpState(False, 0.0), TcpState(True, length))
    x, y, z = (found[control.machine.index(index)] for index in (X, Y, Z))
    return x, y, z


def posture(control: Control, position: Vector) -> Posture | None:
    """How the machine stands with its rotary axes at these positions; None if nobody knows its kinematics."""
    if control.kinematics is None or not {X, Y, Z} <= set(control.machine):
        return None
    still = [value if control.rotary[index] else 0.0 for index, value in enumerate(position)]
    if control.stood is None or control.stood[0] != still:
        control.stood = still, _posture(control, still)
    found = control.stood[1]
    assert found is None or isinstance(found, Posture)
    return found


def _posture(control: Control, still: Vector) -> Posture | None:
    """As `posture`, with X Y Z at zero."""
    origin = tip(control, still, 0.0)
    tool = unit(minus(origin, tip(control, still, PROBE)))
    columns = []
    for index in (X, Y, Z):
        moved = still[:]
        moved[index] = PROBE
        columns.append(unit(minus(tip(control, moved, 0.0), origin)))
    if tool is None or any(column is None for column in columns):
        return None
    return Posture(tool, as_rotation(list(zip(*columns, strict=True))))


def apart(a: Triple, b: Triple) -> float:
    """The angle between two unit vectors, rad."""
    cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return math.hypot(*minus(a, b)) if cosine > 0 else math.pi - math.hypot(a[0] + b[0], a[1] + b[1], a[2] + b[2])


def normal_of(tilt: Rotation) -> Triple:
    """The Z axis of a tilted plane."""
    return tilt[0][2], tilt[1][2], tilt[2][2]


def angles_for(control: Control, direction: Triple) -> list[dict[int, float]]:
    """The ways to point the tool within the travels, letter index -> rad, the nearest first; empty if none is known."""
    pointing = control.pointing
    if pointing is None:
        return []
    first, second = (control.machine[column] for column in pointing.columns)
    control.settle((first, second))
    if first in control.unknown or second in control.unknown:
        return []
    assert control.kinematics is not None, "they have shown how the tool is pointed"
    near = control.position[first], control.position[second]
    travel = [control.kinematics.travel[column] for column in pointing.columns]
    ways = within(pointing.angles(np.array(direction), near), travel, near)
    return [{first: outer, second: inner} for outer, inner in ways]


def stands_normal(control: Control, tilt: Rotation) -> bool | None:
    """Whether the tool stands normal to a plane; None if that is not known."""
    if any(index in control.unknown for index in control.turning):
        return None
    found = posture(control, control.position)
    return None if found is None else apart(found.tool, normal_of(tilt)) < SQUARE
