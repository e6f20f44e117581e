"""Tool-centre-point control (TCP): X Y Z when it is switched on or off, or when the tool length changes under it.

Under TCP, X Y Z of a command are tip coordinates in the workpiece. Only the machine's kinematics relate them to axis
positions. Without kinematics the difference is known only while all rotary axes are at zero: the tool length along Z.

When TCP is switched, the machine stands still and X Y Z get other numbers; in a motion in machine coordinates some axes
move and others do not. `renamed` and `passed_through` tell where the control then takes its axes to be, including axes
that a correction has displaced.
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

EQUAL_TOLERANCE = 1e-7
"""Largest difference, mm and rad, of positions that are equal except for rounding."""

TURNED = "the position of the axis {} in tool-centre-point coordinates depends on the machine's kinematics"


def rotary_at_zero(control: ControlState, position: Vector, unknown: UnknownAxes) -> bool:
    """Whether all rotary axes of the machine are at zero."""
    return all(index not in unknown and abs(position[index]) < 1e-12 for index in control.turning)


def led_in_machine(control: ControlState, axes: Mapping[int, float], unsure: UnknownAxes) -> MotionEnd:
    """The end of a motion that moves some axes to machine positions while the others stand still.

    axes    letter index -> machine position of that axis, mm or rad
    unsure  reasons for those positions that are not known

    Under TCP the tip also moves along other axes: the coordinate of an axis that stands still changes with the others.
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
        if abs(target[index] - control.position[index]) < EQUAL_TOLERANCE:
            target[index] = control.position[index]
    known = not (control.unknown or unknown) and in_machine(control) is not None
    return MotionEnd(target, unknown, in_machine=end if known else None)


def in_machine(control: ControlState) -> Vector | None:
    """Machine positions of the axes under TCP; None if they are not known."""
    position = control.position[:]
    return (
        position
        if converted(control, position, control.unknown, TcpState(True, control.length_under_tcp), MACHINE)
        else None
    )


def converted(control: ControlState, position: Vector, unknown: UnknownAxes, before: TcpState, after: TcpState) -> bool:
    """Convert a position in place from one TCP state to another; returns False if that is not possible."""
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
    """Change the tool length or switch TCP while the machine stands still; the coordinates may change.

    If the tool lies along Z of a tilted plane, another length moves the tip along that Z only. `number` is that of the
    tool whose length comes into force, None for none.
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
    """The command (n_axes,) at which a motion starts, if only TCP or its tool length changed before it; else None.

    position  (n_axes,) the command at the end of the motion before, as written
    """
    if row == 0 or kinematics is None:
        return None
    before, after = _state(moves, row - 1), _state(moves, row)
    known = np.isfinite([position, moves.end[row - 1], moves.start[row]]).all()
    if before == after or not known:
        return None
    meant = kinematics(moves.end[row - 1].tolist(), before, after)
    if np.abs(meant - moves.start[row]).max() > EQUAL_TOLERANCE:
        return None
    return np.array(kinematics(position.tolist(), before, after))


def passed_through(moves: Moves, row: int, position: Array, kinematics: Kinematics | None) -> Array | None:
    """The command (n_axes,) at the end of an uncorrected motion in machine coordinates under TCP.

    Machine axes that it moves go to their programmed positions, the others stay where `position` (n_axes,) has them:
    the rotation into a tilted plane, or a retreat in machine coordinates. None for other motions, and for those in
    which fewer axes move in tip coordinates than in machine coordinates.
    """
    state = _state(moves, row)
    if kinematics is None or not state.on or moves.rule[row] != Rule.PASS:
        return None
    if not np.isfinite([position, moves.start[row], moves.end[row]]).all():
        return None
    start, end, now = (
        np.array(kinematics(each.tolist(), state, MACHINE)) for each in (moves.start[row], moves.end[row], position)
    )
    moved, said = np.abs(end - start) > EQUAL_TOLERANCE, np.abs(moves.end[row] - moves.start[row]) > EQUAL_TOLERANCE
    if moved.sum() >= said.sum():
        return None
    return np.array(kinematics(np.where(moved, end, now).tolist(), MACHINE, state))


def _state(moves: Moves, row: int) -> TcpState:
    """TCP state of a motion."""
    on = bool(moves.tcp[row])
    return TcpState(on, float(moves.length_under_tcp[row]) if on else 0.0)


def jumps(moves: Moves) -> Mask:
    """(n, n_axes) where a motion does not start at the end of the one before.

    When TCP is switched or its length changes, this includes the linear axes: as soon as the rotary axes are not
    exactly at zero any more, their positions change, even if the program left them at zero.
    """
    found = np.zeros(moves.start.shape, dtype=bool)
    found[1:] = ~(moves.start[1:] == moves.end[:-1]) & ~(np.isnan(moves.start[1:]) & np.isnan(moves.end[:-1]))
    length = moves.length_under_tcp
    longer = moves.tcp[1:] & (length[1:] != length[:-1])
    found[1:] |= (longer | (moves.tcp[1:] != moves.tcp[:-1]))[:, None] & ~moves.rotary
    return found
