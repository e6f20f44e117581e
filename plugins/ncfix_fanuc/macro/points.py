"""The decimal-point rule: which words count least increments where their number has no point, and which of them angles.

Source: Fanuc 30i operator's manual (machining centre), "Decimal point programming".
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.control.coordinates import LETTERS
from ncfix_iso.rs274.groups import NON_MODAL, ROTATION
from ncfix_iso.rs274.order import DWELL

if TYPE_CHECKING:
    from ncfix_fanuc.macro.control import MacroControl
    from ncfix_iso.rs274.plans import Codes, RS274Plan

G15, G16 = 150, 160
SCALED = frozenset("XYZABCUVWIJKRQ")
"""Addresses whose numbers count least increments when they have no point."""
DRILLING = frozenset("KLQ")
"""K and L may be the repeats of a cycle, Q is the depth of its pecks."""
ANGLES = frozenset("IJKR")
"""Of a rotation (G68, G68.2)."""


def is_scaled(control: MacroControl, plan: RS274Plan, letter: str) -> bool:
    """Whether the number of a word counts least increments when it has no point."""
    codes = plan.codes
    motion = control.modal.motion if codes is None else motion_in_force(control, codes)
    if motion in control.rules.tables and letter == control.rules.level_of(motion):
        return True
    if letter not in SCALED or (letter == "R" and is_level(control, plan)):
        return False
    if codes is None:
        return letter not in DRILLING
    if codes.g.get(NON_MODAL) == DWELL:
        return False
    cycle = motion_in_force(control, codes) in control.rules.cycles
    return letter not in DRILLING or (letter == "K" and not cycle) or (letter == "Q" and cycle)


def is_level(control: MacroControl, plan: RS274Plan) -> bool:
    """Whether R of a block is no length: no axis, cycle, plane or setting takes it (G5.1 Q1 R3, G332 R1)."""
    if plan.axes or plan.codes is None or not plan.codes.g.keys().isdisjoint((NON_MODAL, ROTATION)):
        return False
    return motion_in_force(control, plan.codes) not in control.rules.cycles


def is_angle(control: MacroControl, plan: RS274Plan, letter: str) -> bool:
    """Whether the number of a word counts degrees though its address is none of a rotary axis."""
    groups = {} if plan.codes is None else plan.codes.g
    if ROTATION in groups:
        return letter in ANGLES
    codes = groups.values()
    polar = (control.polar is not None or G16 in codes) and G15 not in codes
    return polar and letter == LETTERS[control.modal.plane.second]


def motion_in_force(control: MacroControl, codes: Codes) -> int:
    """The motion code of a block, its own or the one that still holds."""
    return control.modal.motion if codes.motion is None else codes.motion
