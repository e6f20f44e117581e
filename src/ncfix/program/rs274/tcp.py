"""Tool-centre-point control: what is known of X Y Z when it goes on and off, or the tool length changes in it.

X Y Z of a command are then those of the tip in the workpiece. Only the machine's kinematics connect them with axis
positions; while all rotary axes stand at zero the two differ by the tool length along Z and nothing else.
"""

from __future__ import annotations

from ncfix.program.rs274.control import Control, Unknown
from ncfix.program.rs274.coordinates import Vector, X, Y, Z

TURNED = "where the axis {} stands in tool-centre-point coordinates depends on the machine's kinematics"


def rotary_at_zero(control: Control, position: Vector, unknown: Unknown) -> bool:
    """Whether all rotary axes of the machine stand at zero."""
    turning = [index for index in control.machine if control.rotary[index]]
    return all(index not in unknown and abs(position[index]) < 1e-12 for index in turning)


def from_machine(control: Control, target: Vector, unknown: Unknown) -> None:
    """Make a position of the axes one of tool-centre-point control, in place."""
    if rotary_at_zero(control, target, unknown):
        target[Z] -= control.offsets.tool[Z]
        return
    unknown |= {index: TURNED for index in (X, Y, Z) if index in control.machine}


def switch(control: Control, tool: Vector, on: bool) -> None:
    """Another tool length, and tool-centre-point control on or off: the machine stands still, the tip may not."""
    before = control.offsets.tool[Z] if control.tcp else 0.0
    after = tool[Z] if on else 0.0
    if before != after or control.tcp != on:
        if rotary_at_zero(control, control.position, control.unknown):
            control.position[Z] += before - after
        else:
            control.lose((X, Y, Z), TURNED)
    control.tcp = on
