"""The dynamic work offset of Haas: G254 turns the work offset along with the tables as they stand, G255 ends it.

X Y Z are then those of the tip along the machine's axes, from where the origin of the workpiece has gone: the frame of
a tilted plane that is square to the tool already. As in one, the control computes the linear axes from the tip.
Source: Haas, "Next Generation Control, mill operator's manual", G254, G234.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.control.posture import machine_directions
from ncfix_fanuc.macro import tilt
from ncfix_iso.rs274.control import Block

if TYPE_CHECKING:
    from ncfix_fanuc.macro.control import MacroControl

ON, OFF = 2540, 2550
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
    machine = None
    if not (control.mirrored or control.is_rotated):
        control.settle(control.turning)
        known = not control.unknown.keys() & {*control.turning}
        machine = machine_directions(control, control.position) if known else None
    if machine is None:
        control.suspended[KEY] = NOT_SOLVED
        return
    control.dynamic = True
    tilt.begin(control, machine.axes, Block(block.index, {}, frozenset(), 0))


def turned(control: MacroControl, block: Block) -> bool:
    """Whether a block has a word of a rotary axis that would turn the tables under the offset."""
    return control.dynamic and any(block.axes >> index & 1 for index in control.turning)
