"""Axes as the files of controls name them: by a letter that tells whether a position is in millimetres or degree."""

from __future__ import annotations

import numpy as np

from ncfix.diagnostics import RefusedError
from ncfix.machine import Machine

ORDER = "XYZABCUVW"
"""In which order controls count them."""
TURNING = "ABC"
DEGREE = np.pi / 180


def unit_of(letter: str) -> float:
    """mm or rad per unit of a file."""
    return DEGREE if letter in TURNING else 1.0


def in_order(machine: Machine, known: str = ORDER) -> tuple[str, ...]:
    """The axes of a machine as its control counts them; raises `RefusedError` NCF484 for one that it cannot have."""
    odd = [axis.name for axis in machine.axes if axis.name not in known or (axis.name in TURNING) != axis.rotary]
    if odd:
        lengths = " ".join(letter for letter in known if letter not in TURNING)
        text = f"axes {' '.join(odd)}: linear axes are {lengths} here, rotary axes {' '.join(TURNING)}"
        hint = "name them so in the machine file, or correct its programs: ncfix fix"
        raise RefusedError.of("NCF484", text, hint=hint)
    return tuple(letter for letter in known if letter in machine.axis_names)
