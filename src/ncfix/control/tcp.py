"""Tool-centre-point control (TCP): what is known of X Y Z when it goes on and off, or the tool length changes in it.

X Y Z of a command are then those of the tip in the workpiece. Only the machine's kinematics connect them with axis
positions; where they are not given, only while all rotary axes stand at zero is known how the two differ: by the tool
length along Z.

When TCP goes on or off the machine stands still, and X Y Z have other numbers; in machine coordinates some axes move
and others do not. `renamed` and `passed_through` tell where the control believes its axes to stand then, also of
axes that a correction has put beside their places.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.control.coordinates import Vector, X, Y, Z
from ncfix.control.moves import Kinematics, MotionEnd, Moves, Rule, TcpState

if TYPE_CHECKING:
    from ncfix.control.moves import UnknownAxes
    from ncfix.control.state import ControlState


MACHINE = TcpState(False, 0.0)

ALIKE = 1e-7
"""mm and rad; positions that are the same but for rounding."""

TURNED = "where the axis {} stands in tool-centre-point coordinates depends on the machine's kinematics"


def rotary_at_zero(control: ControlState, position: Vector, unknown: UnknownAxes) -> bool:
    """Whether all rotary axes of the machine stand at zero."""
    return all(index not in unknown and abs(position[index]) < 1e-12 for index in control.turning)


def led_in_machine(control: ControlState, axes: Mapping[int, float], unsure: UnknownAxes) -> MotionEnd:
    """Where a motion ends that leads axes to places of the machine, while the others stand still.

    axes    letter index -> where that axis of the machine goes, mm or rad
    unsure  why that is not known, of those of which it is not

    Under TCP the tip moves along other axes, too: the numbers of an axis that stands still change with the rest.
    """
    target, unknown = control.position[:], dict(control.unknown)
    tip = TcpState(True, control.length_under_tcp)
    still = [index for index in (X, Y, Z) if index in control.axis_indices and index not in axes]
    if control.tcp and still and not converted(control, target, unknown, tip, MACHINE):
        unknown |= dict.fromkeys(still, TURNED)
    for index, value in axes.items():
        target[index] = value
        unknown.pop(index, None)
    doubts = {index: unsure[index] for index in axes if index in unsure}
    unknown |= doubts
    if not control.tcp:
        return MotionEnd(target, unknown)
    end = target[:]
    if not converted(control, target, unknown, MACHINE, tip):
        turned = {index: TURNED for index in (X, Y, Z) if index in control.axis_indices}
        return MotionEnd(target, unknown | turned | doubts)
    for index in still:
        if abs(target[index] - control.position[index]) < ALIKE:
            target[index] = control.position[index]
    known = not (control.unknown or unknown) and in_machine(control) is not None
    return MotionEnd(target, unknown, in_machine=end if known else None)


def in_machine(control: ControlState) -> Vector | None:
    """Where the axes of the machine stand under TCP; None if that is not known."""
    position = control.position[:]
    return (
        position
        if converted(control, position, control.unknown, TcpState(True, control.length_under_tcp), MACHINE)
        else None
    )


def converted(control: ControlState, position: Vector, unknown: UnknownAxes, before: TcpState, after: TcpState) -> bool:
    """Say the same position as another command, in place; False where that is not known."""
    if rotary_at_zero(control, position, unknown):
        position[Z] += before.shift - after.shift
        return True
    if control.kinematics is None or unknown.keys() & set(control.axis_indices):
        return False
    command = control.kinematics([position[index] for index in control.axis_indices], before, after)
    for index, value in zip(control.axis_indices, command, strict=True):
        position[index] = value
    return True


def switch(control: ControlState, tool: Vector, on: bool, number: int | None) -> None:
    """Another tool length, and tool-centre-point control on or off: the machine stands still, the tip may not.

    Where the tool lies along Z of a tilted plane, another length moves the tip along that only. `number` is that of the
    tool whose length it is, None if none is in force from here on.
    """
    lost = {**control.lost_in_frame(), Z: TURNED} if on and control.tcp and control.stands_square() else None
    before = TcpState(control.tcp, control.length_under_tcp)
    after = TcpState(on, control.length_under_tcp_with(tool, number))
    if (before.shift != after.shift or control.tcp != on) and not converted(
        control, control.position, control.unknown, before, after
    ):
        control.lose((X, Y, Z), TURNED)
        control.frame_unknown = lost
    control.tcp = on


def renamed(moves: Moves, row: int, position: Array, kinematics: Kinematics | None) -> Array | None:
    """The command (n_axes,) at which a motion starts, if nothing but TCP or a tool length in it has changed before it.

    position  (n_axes,) the command at the end of the motion before, as written
    """
    if row == 0 or kinematics is None:
        return None
    before, after = _state(moves, row - 1), _state(moves, row)
    known = np.isfinite([position, moves.end[row - 1], moves.start[row]]).all()
    if before == after or not known:
        return None
    meant = kinematics(moves.end[row - 1].tolist(), before, after)
    if np.abs(meant - moves.start[row]).max() > ALIKE:
        return None
    return np.array(kinematics(position.tolist(), before, after))


def passed_through(moves: Moves, row: int, position: Array, kinematics: Kinematics | None) -> Array | None:
    """The command (n_axes,) at the end of a motion in machine coordinates that is left as it is, under TCP.

    Axes of the machine that it moves go where they do anyway, the others stand where `position` (n_axes,) has them: the
    turn of a tilted plane, or the retreat in machine coordinates. None for other motions, also for those of which a
    control says that in coordinates of the tip fewer axes move.
    """
    state = _state(moves, row)
    if kinematics is None or not state.on or moves.rule[row] != Rule.PASS:
        return None
    if not np.isfinite([position, moves.start[row], moves.end[row]]).all():
        return None
    start, end, now = (
        np.array(kinematics(each.tolist(), state, MACHINE)) for each in (moves.start[row], moves.end[row], position)
    )
    moved, said = np.abs(end - start) > ALIKE, np.abs(moves.end[row] - moves.start[row]) > ALIKE
    if moved.sum() >= said.sum():
        return None
    return np.array(kinematics(np.where(moved, end, now).tolist(), MACHINE, state))


def _state(moves: Moves, row: int) -> TcpState:
    """Whether tool-centre-point control is on in a motion, and with which length."""
    on = bool(moves.tcp[row])
    return TcpState(on, float(moves.length_under_tcp[row]) if on else 0.0)


def jumps(moves: Moves) -> Mask:
    """(n, n_axes) where a motion does not start where the one before ended.

    Where tool-centre-point control goes on or off, or has another length, linear axes stand elsewhere as soon as the
    rotary axes are not quite at zero any more, though the program may have left them there.
    """
    found = np.zeros(moves.start.shape, dtype=bool)
    found[1:] = ~(moves.start[1:] == moves.end[:-1]) & ~(np.isnan(moves.start[1:]) & np.isnan(moves.end[:-1]))
    length = moves.length_under_tcp
    longer = moves.tcp[1:] & (length[1:] != length[:-1])
    found[1:] |= (longer | (moves.tcp[1:] != moves.tcp[:-1]))[:, None] & ~moves.rotary
    return found
