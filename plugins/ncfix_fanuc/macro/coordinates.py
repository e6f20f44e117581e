"""Polar coordinates, scaling and mirror image: the words of a block are converted to plain coordinates.

Polar coordinates: G16 makes the two axis words of the plane a radius and an angle, G15 ends it. Scaling: G51 X Y Z P
magnifies the words of the program about a point, G50 ends it. Programmable mirror image: G51.1 X10. mirrors X at 10,
G50.1 X0 ends that. A correction cannot be written in such words (a magnified digit is coarser); a flat program does not
need them.
Sources: Fanuc 30i operator's manual (machining centre), "Polar coordinate command", "Scaling", "Programmable mirror
image"; Haas mill operator's manual, G51; Mitsubishi M700V programming manual, where it acts on the axes that the block
names only.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from ncfix.control.coordinates import CENTRE_LETTERS, INDEX, LETTERS, X, Y, Z, zeros
from ncfix.control.frames import WORLD, mirrored, turned_about
from ncfix_fanuc.macro.control import MacroControl, Scaling
from ncfix_iso.rs274.cycles import AXES_SAID
from ncfix_iso.rs274.groups import CONTROL, CUTTER, DISTANCE, FEED_MODE, MOTION, PLANE, RETRACT, SPINDLE_MODE
from ncfix_iso.rs274.systems import AFTER_UNFOLLOWED, is_turned, turned_back, unfollowed, words_of

if TYPE_CHECKING:
    from ncfix_iso.rs274.control import Block
    from ncfix_iso.rs274.plans import Codes


ON, OFF = 510, 500
REASON = "scaling (G51) is in force; with --flatten ncfix writes the scaled positions"
TOGETHER = "the effect of {} while scaling (G51) is in force is not certain"
ALIKE = "scaling (G51): ncfix assumes that it acts on X, Y and Z alike"
AT_PEACE = frozenset((MOTION, PLANE, DISTANCE, FEED_MODE, CUTTER, CONTROL, RETRACT, SPINDLE_MODE))
"""Groups of codes that scaling does not affect."""
MIRROR, MIRROR_OFF, HAAS_MIRROR = 511, 501, 1010
SPATIAL = (X, Y, Z)


def switch_scaling(control: MacroControl, block: Block, code: int) -> None:
    """G51 and G50; a scaling whose effect is not certain is not followed."""
    if code == OFF:
        moves = bool(block.axes)
        if control.scaling is not None and not moves:
            control.scaling, control.left_out = None, True
            control.resume("scaling")
            return
        control.scaling = None
        unfollowed(control, block, code)
        return
    if control.scaling is not None or not is_certain(control, block):
        control.unwritten = control.unwritten or "ncfix does not support this form of scaling (G51)"
        control.scaling = None
        unfollowed(control, block, code)
        return
    centre = control.program_position()
    for index in (X, Y, Z):
        if LETTERS[index] in block.values:
            centre[index] = control.scale[index] * block.values[LETTERS[index]]
    control.scaling, control.left_out = Scaling(centre, block.values["P"]), True
    control.suspend("scaling", REASON, followed=True)
    control.warn(AXES_SAID, ALIKE, "check which axes the control scales (Fanuc: parameter 5401 SCL)")


def is_certain(control: MacroControl, block: Block) -> bool:
    """Whether factor and centre are given by the block, or the position, and have one possible meaning only."""
    named = {index for index in (X, Y, Z) if LETTERS[index] in block.values}
    known = not control.unknown.keys() & ({X, Y, Z} - named) and not block.unknown
    plain = "P" in block.values and block.values["P"] > 0 and block.values.keys().isdisjoint(CENTRE_LETTERS)
    alone = not (control.mirrored or control.is_rotated or control.polar is not None or control.tcp)
    whole = len(named) == len((X, Y, Z)) or not control.rules.scales_named
    return known and plain and alone and whole and not control.modal.incremental


def scaled(control: MacroControl, block: Block, codes: Codes) -> Block:
    """The block with scaled words converted to plain ones."""
    scaling = control.scaling
    if scaling is None or OFF in codes.g.values():
        return block
    foreign = [code for group, code in codes.g.items() if group not in AT_PEACE]
    if foreign:
        control.refuse_rest(TOGETHER.format(f"G{foreign[0] / 10:g}"))
        control.unwritten = control.unwritten or TOGETHER.format(f"G{foreign[0] / 10:g}")
        return block
    motion = control.modal.motion if codes.motion is None else codes.motion
    drills, level = motion in control.rules.cycles, control.dialect.cycle_of(motion).level
    across = control.modal.plane.across
    for letter, value in block.values.items():
        if letter in "XYZ" or (drills and letter == level):
            index = INDEX.get(letter, across)
            centre = 0.0 if control.modal.incremental else scaling.centre[index] / control.scale[index]
            block.values[letter] = centre + scaling.factor * (value - centre)
        elif letter == "R" or (letter in CENTRE_LETTERS and not drills):
            block.values[letter] = scaling.factor * value
    return block


# -- mirror image ------------------------------------------------------------------------------------------------------


def mirror(control: MacroControl, block: Block, code: int) -> None:
    """G51.1 and G50.1; mirrored rotary axes, and mirrors in turned coordinates, are not followed."""
    named, elsewhere = words_of(block), turned(control)
    if code == MIRROR_OFF:
        unfollowed(control, block, code)
        for index in named or SPATIAL:
            control.mirrored.pop(index, None)
    elif elsewhere or block.unknown or not set(named) <= {*SPATIAL}:
        unfollowed(control, block, code)
        return
    else:
        control.mirrored |= {index: control.scale[index] * block.values[LETTERS[index]] for index in named}
    if not elsewhere:
        put_up(control)


def mirror_about_zero(control: MacroControl, block: Block, code: int) -> None:
    """G101 and G100 of Haas: the named axes are mirrored at the zero point; other values are not followed."""
    if code == HAAS_MIRROR and any(block.values[LETTERS[index]] for index in words_of(block)):
        unfollowed(control, block, MIRROR)
    else:
        mirror(control, block, MIRROR if code == HAAS_MIRROR else MIRROR_OFF)


def map_on_cylinder(control: MacroControl, block: Block, code: int) -> None:
    """G107 of Haas: on with axis words, off without any."""
    if block.axes:
        control.suspend("cylinder", "cylindrical interpolation (G107) is in force, which ncfix does not support")
    elif control.resume("cylinder"):
        control.lose(control.axis_indices, AFTER_UNFOLLOWED)


def turned(control: MacroControl) -> bool:
    """Whether coordinates are turned (G68, G68.2)."""
    return control.tilted or (not control.mirrored and is_turned(control))


def put_up(control: MacroControl) -> None:
    """Put the mirrors into force."""
    centre = zeros()
    for index, place in control.mirrored.items():
        centre[index] = place
    rotation = mirrored("".join(LETTERS[index] for index in control.mirrored))
    control.frames = replace(control.frames, mirror=turned_about(rotation, centre) if control.mirrored else WORLD)
    turned_back(control)
    control.refresh()


POLAR_REASON = "polar coordinates (G16) are in force; with --flatten ncfix writes them as X and Y"
ONE_ALONE = "since G16 the program has given only one of radius and angle, and the value of the other is not certain"
POLAR_ON = 160


def switch_polar(control: MacroControl, block: Block, code: int) -> None:
    """G16 and G15."""
    if code == POLAR_ON and control.polar is None:
        control.suspend("polar", POLAR_REASON, followed=True)
        control.polar = math.nan, math.nan
    elif code != POLAR_ON:
        control.resume("polar")
        control.polar = None


def cartesian(control: MacroControl, block: Block) -> Block:
    """The block with radius and angle converted to coordinates of the plane; an incremental radius is not followed."""
    plane = control.modal.plane
    letters = plane.of(LETTERS)
    given = [letter for letter in letters if letter in block.values]
    if control.polar is None or not given:
        return block
    lone = any(math.isnan(known) and letter not in given for letter, known in zip(letters, control.polar, strict=True))
    if control.modal.incremental and given == [letters[1]] and block.turn is None and not lone:
        return further_round(control, block, letters)
    radius, angle = (block.get(letter, known) for letter, known in zip(letters, control.polar, strict=True))
    control.polar = radius, angle
    control.suspend("polar", ONE_ALONE if lone else POLAR_REASON, followed=not lone)
    if lone:
        control.unwritten = control.unwritten or ONE_ALONE
        radius, angle = block.get(letters[0]), block.get(letters[1])
    turn = math.radians(angle)
    block.values[letters[0]], block.values[letters[1]] = radius * math.cos(turn), radius * math.sin(turn)
    block.axes |= plane.axes
    if lone or control.modal.incremental or block.unknown & set(letters):
        block.unknown |= set(letters)
    return block


def further_round(control: MacroControl, block: Block, letters: tuple[str, str]) -> Block:
    """A block in G91 with an angle alone: it is added to the one in force, again with each repeat of a cycle."""
    assert control.polar is not None
    plane, (radius, angle) = control.modal.plane, control.polar
    block.turn = block.values[letters[1]]
    count = next((block.values[letter] for letter in control.rules.repeats if letter in block.values), 1.0)
    control.polar = radius, angle + block.turn * count
    turn, position = math.radians(angle + block.turn), control.program_position()
    ends = radius * math.cos(turn), radius * math.sin(turn)
    for letter, index, end in zip(letters, plane.pair, ends, strict=True):
        block.values[letter] = end - position[index] / control.modal.unit
    block.axes |= plane.axes
    if letters[1] in block.unknown:
        block.unknown |= set(letters)
    return block
