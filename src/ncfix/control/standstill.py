"""Where the control believes its axes to stand after what moves axes of the machine, or none, but its tip.

When tool-centre-point control (TCP) goes on or off the machine stands still, and X Y Z have other numbers; in machine
coordinates some axes move and others do not. That holds also for axes that a correction has put beside their places.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.control.moves import Kinematics, Moves, Rule, TcpState

FloatArray = NDArray[np.float64]

ALIKE = 1e-7
"""mm and rad; positions that are the same but for rounding."""

MACHINE = TcpState(False, 0.0)


def renamed(moves: Moves, row: int, position: FloatArray, kinematics: Kinematics | None) -> FloatArray | None:
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


def passed_through(moves: Moves, row: int, position: FloatArray, kinematics: Kinematics | None) -> FloatArray | None:
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
    return TcpState(on, float(moves.tool_length[row]) if on else 0.0)


def jumps(moves: Moves) -> NDArray[np.bool_]:
    """(n, n_axes) where a motion does not start where the one before ended.

    Where tool-centre-point control goes on or off, or has another length, linear axes stand elsewhere as soon as the
    rotary axes are not quite at zero any more, though the program may have left them there.
    """
    found = np.zeros(moves.start.shape, dtype=bool)
    found[1:] = ~(moves.start[1:] == moves.end[:-1]) & ~(np.isnan(moves.start[1:]) & np.isnan(moves.end[:-1]))
    longer = moves.tcp[1:] & (moves.tool_length[1:] != moves.tool_length[:-1])
    found[1:] |= (longer | (moves.tcp[1:] != moves.tcp[:-1]))[:, None] & ~moves.rotary
    return found
