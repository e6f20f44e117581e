"""Polar coordinates: G16 makes the two axis words of the plane a radius and an angle, G15 ends it.

Source: Fanuc 30i operator's manual (machining centre), "Polar coordinate command".
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ncfix.control.coordinates import LETTERS

if TYPE_CHECKING:
    from ncfix_fanuc.macro.control import MacroControl
    from ncfix_iso.rs274.control import Block

REASON = "polar coordinates (G16) are in force; --flatten writes them in X and Y"
ON = 160


def switch(control: MacroControl, block: Block, code: int) -> None:
    """G16 and G15."""
    if code == ON and control.polar is None:
        control.suspend("polar", REASON)
        control.polar = here(control)
    elif code != ON:
        control.resume("polar")
        control.polar = None


def here(control: MacroControl) -> tuple[float, float]:
    """Where the control stands, as radius and angle in program units and degrees."""
    position, plane = control.program_position(), control.modal.plane
    first, second = position[plane.first] / control.modal.unit, position[plane.second] / control.modal.unit
    return math.hypot(first, second), math.degrees(math.atan2(second, first))


def cartesian(control: MacroControl, block: Block) -> Block:
    """The block with radius and angle made coordinates of the plane; where a radius is added is not followed."""
    plane = control.modal.plane
    letters = LETTERS[plane.first], LETTERS[plane.second]
    given = [letter for letter in letters if letter in block.values]
    if control.polar is None or not given:
        return block
    if control.modal.incremental and given == [letters[1]] and block.turn is None:
        return further_round(control, block, letters)
    radius, angle = (block.get(letter, known) for letter, known in zip(letters, control.polar, strict=True))
    control.polar = radius, angle
    turn = math.radians(angle)
    block.values[letters[0]], block.values[letters[1]] = radius * math.cos(turn), radius * math.sin(turn)
    block.axes |= plane.axes
    if control.modal.incremental or block.unknown & set(letters):
        block.unknown |= set(letters)
    return block


def further_round(control: MacroControl, block: Block, letters: tuple[str, str]) -> Block:
    """A block in G91 with an angle alone: it is added to the one in force, by each repeat of a cycle anew."""
    assert control.polar is not None
    plane, (radius, angle) = control.modal.plane, control.polar
    block.turn = block.values[letters[1]]
    count = next((block.values[letter] for letter in control.rules.repeats if letter in block.values), 1.0)
    control.polar = radius, angle + block.turn * count
    turn, position = math.radians(angle + block.turn), control.program_position()
    ends = radius * math.cos(turn), radius * math.sin(turn)
    for letter, index, end in zip(letters, (plane.first, plane.second), ends, strict=True):
        block.values[letter] = end - position[index] / control.modal.unit
    block.axes |= plane.axes
    if letters[1] in block.unknown:
        block.unknown |= set(letters)
    return block
