"""Scaling: G51 X Y Z P magnifies the words of the program about a point, G50 ends it. A flat program has no need of it.

Its words are made those that they mean; a correction cannot be written in them, for a magnified digit is a coarser one.
Sources: Fanuc 30i operator's manual (machining centre), "Scaling"; Haas mill operator's manual, G51; Mitsubishi M700V
programming manual, where it acts on the axes that the block names only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ncfix.control.coordinates import CENTRE_LETTERS, INDEX, LETTERS, Vector, X, Y, Z
from ncfix_iso.rs274.groups import CONTROL, CUTTER, DISTANCE, FEED_MODE, MOTION, PLANE, RETRACT, SPINDLE_MODE
from ncfix_iso.rs274.settings import unfollowed

if TYPE_CHECKING:
    from ncfix_fanuc.macro.control import MacroControl
    from ncfix_iso.rs274.control import Block
    from ncfix_iso.rs274.plans import Codes

ON, OFF = 510, 500
REASON = "scaling (G51) is in force; --flatten writes out what its words mean"
TOGETHER = "what {} does while scaling (G51) is in force is not certain"
AXES_SAID = "NCF245"
ALIKE = "scaling (G51) is taken to act on X, Y and Z alike"
AT_PEACE = frozenset((MOTION, PLANE, DISTANCE, FEED_MODE, CUTTER, CONTROL, RETRACT, SPINDLE_MODE))
"""Groups of codes that scaling has nothing to do with."""


@dataclass(frozen=True, slots=True)
class Scaling:
    """A scaling in force: its centre, mm in the program's frame, all letters, and its factor."""

    centre: Vector
    factor: float


def switch(control: MacroControl, block: Block, code: int) -> None:
    """G51 and G50; a scaling that is not certain is not followed."""
    if code == OFF:
        moves = bool(block.axes)
        if control.scaling is not None and not moves:
            control.scaling, control.left_out = None, True
            control.suspended.pop("scaling", None)
            return
        control.scaling = None
        unfollowed(control, block, code)
        return
    if control.scaling is not None or not is_certain(control, block):
        control.unwritten = control.unwritten or "scaling (G51) is not followed here"
        control.scaling = None
        unfollowed(control, block, code)
        return
    centre = control.program_position()
    for index in (X, Y, Z):
        if LETTERS[index] in block.values:
            centre[index] = control.scale[index] * block.values[LETTERS[index]]
    control.scaling, control.left_out = Scaling(centre, block.values["P"]), True
    control.suspended["scaling"] = REASON
    control.warn(AXES_SAID, ALIKE, "check which axes the control scales (Fanuc: parameter 5401 SCL)")


def is_certain(control: MacroControl, block: Block) -> bool:
    """Whether factor and centre are in the block, or where the control stands, and mean one thing only."""
    named = {index for index in (X, Y, Z) if LETTERS[index] in block.values}
    known = not control.unknown.keys() & ({X, Y, Z} - named) and not block.runtime
    plain = "P" in block.values and block.values["P"] > 0 and block.values.keys().isdisjoint(CENTRE_LETTERS)
    alone = not (control.mirrored or control.is_rotated or control.polar is not None or control.tcp)
    whole = len(named) == len((X, Y, Z)) or not control.rules.scales_named
    return known and plain and alone and whole and not control.modal.incremental


def scaled(control: MacroControl, block: Block, codes: Codes) -> Block:
    """The block with its words made what they mean."""
    scaling = control.scaling
    if scaling is None or OFF in codes.g.values():
        return block
    foreign = [code for group, code in codes.g.items() if group not in AT_PEACE]
    if foreign:
        control.refusal = control.refusal or TOGETHER.format(f"G{foreign[0] / 10:g}")
        control.unwritten = control.unwritten or TOGETHER.format(f"G{foreign[0] / 10:g}")
        return block
    motion = control.modal.motion if codes.motion is None else codes.motion
    drills, level = motion in control.rules.cycles, control.rules.level_of(motion)
    across = control.modal.plane.across
    for letter, value in block.values.items():
        if letter in "XYZ" or (drills and letter == level):
            index = INDEX.get(letter, across)
            centre = 0.0 if control.modal.incremental else scaling.centre[index] / control.scale[index]
            block.values[letter] = centre + scaling.factor * (value - centre)
        elif letter == "R" or (letter in CENTRE_LETTERS and not drills):
            block.values[letter] = scaling.factor * value
    return block
