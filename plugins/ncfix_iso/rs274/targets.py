"""Where the axis words of a block lead, as commands, and which of the axes are then known.

Source: LinuxCNC documentation, "G-code overview" and "G90, G91", "G53". A word that is absent leaves its axis
where it is.
"""

from __future__ import annotations

import math

from ncfix.control.coordinates import INDEX, LETTERS, Vector, X, Y
from ncfix.control.expressions import Fault, nominal
from ncfix.control.moves import UnknownAxes
from ncfix.control.tcp import LedInMachine, led_in_machine
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.systems import check_system

AFTER_ROTATION = "where the axis {} goes after G68 or G69 differs from control to control until both axes are named"
RUNTIME = "where the axis {} stands is known only at run time"
POLAR = "NCF223"


def destination(control: RS274Control, block: Block) -> tuple[Vector, UnknownAxes]:
    """The command at which a motion of this block ends."""
    target, unknown = words_destination(control, block)
    return (target, unknown | unnamed(control, block)) if control.unnamed else (target, unknown)


def unnamed(control: RS274Control, block: Block) -> UnknownAxes:
    """Axes of the plane that cannot be known until both are named, after a rotation has gone on or off (G68, G69)."""
    named = {index for index in control.unnamed if block.axes >> index & 1}
    if not named:
        return {}
    if control.modal.incremental:
        doubtful = frozenset() if control.is_rotated else control.unnamed
    else:
        doubtful = control.unnamed if control.is_rotated else control.unnamed - named
        doubtful = doubtful if named < control.unnamed else frozenset()
    if doubtful or not control.modal.incremental:
        control.unnamed = frozenset()
    return dict.fromkeys(sorted(doubtful & {*control.machine}), AFTER_ROTATION)


def words_destination(control: RS274Control, block: Block) -> tuple[Vector, UnknownAxes]:
    """The command to which the words of a block lead."""
    incremental = control.modal.incremental
    if not incremental and not control.offset_checked:
        check_system(control)
    if "@" in block.values or "^" in block.values:
        block = cartesian(control, block)
        incremental = False
    if control.is_rotated and block.axes & 7:
        return rotated_destination(control, block, incremental)
    target = control.position[:]
    for letter, value in block.values.items():
        if letter in INDEX:
            index = INDEX[letter]
            origin = target[index] if incremental else control.offset[index]
            target[index] = origin + control.scale[index] * value
    if control.frame_unknown is not None:
        return target, rotated_unknown(control, block, incremental)
    return target, unknown_after(control, block, incremental, control.unknown)


def unknown_after(control: RS274Control, block: Block, incremental: bool, before: UnknownAxes) -> UnknownAxes:
    """Which axes are not known where the motion ends, of those that were not `before`."""
    if not (before or control.composed.unknown or block.runtime):
        return before
    unknown = dict(before)
    for index, letter in enumerate(LETTERS):
        if not block.axes >> index & 1 or index not in control.machine:
            continue
        if not incremental:
            unknown.pop(index, None)
            if index in control.composed.unknown:
                unknown[index] = control.composed.unknown[index]
        if letter in block.runtime:
            unknown[index] = RUNTIME
    return unknown


def rotated_destination(control: RS274Control, block: Block, incremental: bool) -> tuple[Vector, UnknownAxes]:
    """`destination` in a rotated frame, where one word moves several axes."""
    program = control.program_position()
    for letter, value in block.values.items():
        if letter in INDEX:
            index = INDEX[letter]
            program[index] = control.scale[index] * value + (program[index] if incremental else 0.0)
    return control.command(program, block.axes), rotated_unknown(control, block, incremental)


def rotated_unknown(control: RS274Control, block: Block, incremental: bool) -> UnknownAxes:
    """`unknown_after` in a rotated frame: an axis is known if all that it is made of is."""
    own = unknown_after(control, block, incremental, control.lost_in_frame())
    unknown = control.axes_of(own)
    control.end_unknown = unknown, own
    return unknown


def cartesian(control: RS274Control, block: Block) -> Block:
    """A block with polar words `@` (radius) and `^` (angle), in X and Y of the program's frame, absolute."""
    program = [
        nominal(control.coordinate(index)) if index in (X, Y) or block.axes >> index & 1 else 0.0 for index in range(9)
    ]
    x, y = by_radius_and_angle(control, block, program[X], program[Y])
    others = {letter: value for letter, value in block.values.items() if letter not in "@^"}
    if control.modal.incremental:
        others |= {letter: value + program[INDEX[letter]] for letter, value in others.items() if letter in INDEX}
    ends = {"X": 2.0 * x if control.modal.diameter else x, "Y": y}
    runtime = block.runtime | {"X", "Y"} if block.runtime & {"@", "^"} else block.runtime
    return Block(block.index, others | ends, runtime, block.axes)


def by_radius_and_angle(control: RS274Control, block: Block, x: float, y: float) -> tuple[float, float]:
    """Where polar words lead from a place, in program units; what a block does not say stays, or is added in G91."""
    if control.modal.plane.code != 170:
        raise Fault(POLAR, "polar coordinates are for the plane G17 only")
    if block.values.keys() & {"X", "Y"}:
        raise Fault(POLAR, "a block has either polar coordinates or X and Y")
    radius, angle = math.hypot(x, y), math.degrees(math.atan2(y, x))
    if radius == 0.0 and (control.modal.incremental or "^" not in block.values):
        raise Fault(POLAR, "at the origin a polar coordinate needs both radius and angle, absolute")
    if control.modal.incremental:
        radius, angle = radius + block.get("@"), angle + block.get("^")
    else:
        radius, angle = block.get("@", radius), block.get("^", angle)
    return radius * math.cos(math.radians(angle)), radius * math.sin(math.radians(angle))


def machine_destination(control: RS274Control, block: Block) -> LedInMachine:
    """The command at which a motion in machine coordinates (G53) ends."""
    named = [letter for letter in block.values if letter in INDEX]
    axes = {INDEX[letter]: control.scale[INDEX[letter]] * block.values[letter] for letter in named}
    return led_in_machine(control, axes, {INDEX[letter]: RUNTIME for letter in named if letter in block.runtime})
