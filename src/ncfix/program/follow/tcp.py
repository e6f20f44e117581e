"""Tool-centre-point control: what is known of X Y Z when it goes on and off, or the tool length changes in it.

X Y Z of a command are then those of the tip in the workpiece. Only the machine's kinematics connect them with axis
positions; where they are not given, only while all rotary axes stand at zero is known how the two differ: by the tool
length along Z.
"""

from __future__ import annotations

from ncfix.program.follow.control import Control, Unknown
from ncfix.program.follow.coordinates import Vector, X, Y, Z
from ncfix.program.moves import TcpState

TURNED = "where the axis {} stands in tool-centre-point coordinates depends on the machine's kinematics"


def rotary_at_zero(control: Control, position: Vector, unknown: Unknown) -> bool:
    """Whether all rotary axes of the machine stand at zero."""
    turning = [index for index in control.machine if control.rotary[index]]
    return all(index not in unknown and abs(position[index]) < 1e-12 for index in turning)


def from_machine(control: Control, target: Vector, unknown: Unknown) -> None:
    """Make a position of the axes one of tool-centre-point control, in place."""
    if not converted(control, target, unknown, TcpState(False, 0.0), TcpState(True, control.offsets.tool[Z])):
        unknown |= {index: TURNED for index in (X, Y, Z) if index in control.machine}


def converted(control: Control, position: Vector, unknown: Unknown, before: TcpState, after: TcpState) -> bool:
    """Say the same position as another command, in place; False where that is not known."""
    if rotary_at_zero(control, position, unknown):
        position[Z] += before.shift - after.shift
        return True
    if control.kinematics is None or unknown.keys() & set(control.machine):
        return False
    command = control.kinematics([position[index] for index in control.machine], before, after)
    for index, value in zip(control.machine, command, strict=True):
        position[index] = value
    return True


def switch(control: Control, tool: Vector, on: bool) -> None:
    """Another tool length, and tool-centre-point control on or off: the machine stands still, the tip may not."""
    before = TcpState(control.tcp, control.offsets.tool[Z])
    after = TcpState(on, tool[Z])
    if (before.shift != after.shift or control.tcp != on) and not converted(
        control, control.position, control.unknown, before, after
    ):
        control.lose((X, Y, Z), TURNED)
    control.tcp = on
