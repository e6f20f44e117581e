"""The dynamic work offset of Haas: G254 turns the work offset along with the tables as they stand, G255 ends it.

X Y Z are then those of the tip along the machine's axes, from where the origin of the workpiece has gone: the frame of
a tilted plane that is square to the tool already. As in one, the control computes the linear axes from the tip.
Source: Haas, "Next Generation Control, mill operator's manual", G254, G234.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ncfix.control.coordinates import Rotation, X, Y, Z, as_rotation
from ncfix.control.moves import TcpState
from ncfix_fanuc.macro import tilt
from ncfix_iso.rs274.control import Block

if TYPE_CHECKING:
    from ncfix_fanuc.macro.control import MacroControl

ON, OFF = 2540, 2550
PROBE = 128.0
"""mm; a power of two, so that dividing by it rounds nothing."""

KEY = "dynamic work offset"
NOT_SOLVED = "how the tables stand where G254 comes into force, or what is in force besides it, is not followed"
MOVED = "a rotary axis moves while G254 is in force, which counts from where the tables stood"


def dynamic_offset(control: MacroControl, block: Block, code: int) -> None:
    """G254 and G255."""
    control.suspended.pop(KEY, None)
    if code == OFF:
        control.dynamic = False
        tilt.end(control)
        return
    rotation = None if control.mirrored or control.is_rotated else axes_in_workpiece(control)
    if rotation is None:
        control.suspended[KEY] = NOT_SOLVED
        return
    control.dynamic = True
    tilt.begin(control, rotation, Block(block.index, {}, frozenset(), 0))


def axes_in_workpiece(control: MacroControl) -> Rotation | None:
    """The directions of the machine's X, Y and Z in the workpiece, as columns; None if they are not known."""
    machine, kinematics = control.machine, control.kinematics
    control.settle(control.turning)
    if kinematics is None or not {X, Y, Z} <= {*machine} or control.unknown.keys() & {*control.turning}:
        return None
    at_tip = TcpState(False, 0.0), TcpState(True, 0.0)
    still = [control.position[index] if control.rotary[index] else 0.0 for index in machine]
    places = [machine.index(index) for index in (X, Y, Z)]
    origin = np.array(kinematics(still, *at_tip))[places]
    columns = []
    for place in places:
        moved = still[:]
        moved[place] = PROBE
        columns.append((np.array(kinematics(moved, *at_tip))[places] - origin) / PROBE)
    return as_rotation(np.stack(columns, axis=-1).tolist())


def turned(control: MacroControl, block: Block) -> bool:
    """Whether a block has a word of a rotary axis that would turn the tables under the offset."""
    return control.dynamic and any(block.axes >> index & 1 for index in control.turning)
