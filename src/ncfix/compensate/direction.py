"""Which way each axis came to where it is: the sign of its motion, and the last one that it had where it rests.

The motion that counts is that of the program on a perfect machine. The corrections themselves move axes to and fro by
micrometres; an axis that rests in the program is taken to keep the side of its play that it last had.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.compensate.findings import Array
from ncfix.machine import Machine

Signs = NDArray[np.int8]

REST = 1e-9
"""mm or rad; an axis that moves less in a motion does not move."""


def matters(machine: Machine) -> bool:
    """Whether any error depends on the direction of motion."""
    return machine.depends_on_direction


def signs(motion: Array, rest: float = REST) -> Signs:
    """The direction of a motion (n, n_axes) mm and rad: -1, 1, or 0 where it is below `rest` or not known."""
    known = np.where(np.isfinite(motion), motion, 0.0)
    return np.where(np.abs(known) < rest, 0, np.sign(known)).astype(np.int8)


def carried(directions: Signs) -> Signs:
    """Each axis's last direction that is not 0, row after row; 0 before its first motion. Shape (n, n_axes)."""
    rows = np.arange(len(directions))[:, None]
    last = np.maximum.accumulate(np.where(directions != 0, rows, 0), axis=0)
    return np.take_along_axis(directions, last, axis=0)
