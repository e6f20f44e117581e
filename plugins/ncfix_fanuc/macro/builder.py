"""Programs of the machine's builder or of a probe's maker, O8000 to O9999: they are in the control, not at hand.

They are taken to leave offsets, lengths and modal codes as they are; where the axes stand afterwards, which motion code
and which feed are in force is not known until the program says so.
Source: Fanuc 30i operator's manual: editing of O8000 to O8999 and of O9000 to O9999 can be locked (parameter 3202).
"""

from __future__ import annotations

import math

from ncfix.control.coordinates import mask_of
from ncfix.control.modal import NO_MOTION
from ncfix_iso.rs274.control import RS274Control

LOCKED = range(8000, 10000)
NOT_AT_HAND = "NCF246"
AFTER = "where the axis {{}} stands after the program O{label}, which is not at hand, is not known"
TAKEN = "the program O{label} is not at hand, and is taken to leave offsets, tool lengths and modal codes as they are"


def is_builders(label: str) -> bool:
    """Whether a number is one of those that are locked in the control."""
    return label.isdigit() and int(label) in LOCKED


def ran(control: RS274Control, label: str) -> None:
    """Such a program has run."""
    control.warn(
        NOT_AT_HAND,
        TAKEN.format(label=label),
        "check what it sets, or say where its file is: --subprograms DIR",
    )
    control.lose(control.machine, AFTER.format(label=label))
    control.places.lose(mask_of(control.machine))
    control.modal.motion, control.modal.feed, control.modal.cycle.initial = NO_MOTION, math.nan, None
    control.unwritten = control.unwritten or f"the program O{label} is not at hand"
