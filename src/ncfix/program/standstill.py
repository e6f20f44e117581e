"""Where the control believes its axes to stand when tool-centre-point control goes on or off: the machine stands still.

X Y Z have other numbers then, also those that a correction has put beside their places.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.program.moves import Kinematics, Moves, TcpState

FloatArray = NDArray[np.float64]

ALIKE = 1e-7
"""mm and rad; positions that are the same but for rounding."""


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


def _state(moves: Moves, row: int) -> TcpState:
    """Whether tool-centre-point control is on in a motion, and with which length."""
    on = bool(moves.tcp[row])
    return TcpState(on, float(moves.tool_length[row]) if on else 0.0)
