"""Canned cycles G73, G74, G81 to G89: one motion per hole, and the position of the control after it.

Source: LinuxCNC documentation, "Canned cycles"; what it leaves open was tested with `rs274`: in incremental mode R
counts from the level at which the series of holes began, and a block without R or Z repeats those of the cycle in
force.
"""

from __future__ import annotations

import math

from ncfix.control.coordinates import LETTERS, Plane, Vector, X, Y, Z, mask_of
from ncfix.control.expressions import Fault
from ncfix.control.moves import FeedMode, Motion, MotionEnd, MotionKind, UnknownAxes
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.motion import by_radius_and_angle, unknown_after, unnamed
from ncfix_iso.rs274.parameters import whole
from ncfix_iso.rs274.systems import check_system, words_of

BAD_CYCLE = "NCF226"
AXES_SAID = "NCF245"
"""Code for: a parameter of the control decides on which axes a code acts."""
ACROSS = "drilling cycles in G18 and G19: ncfix assumes that they drill along the axis normal to the plane"
WHICH_AXIS = "check along which axis the control drills (Fanuc: parameter 5101 FXY)"
AFTER_NONE = "the position of the axis {} after a cycle without a hole (K0, L0) depends on the control"
AT_RUN_TIME = "a word of the cycle is known only at run time"
NO_DEPTH = "the retract plane (R) is at the bottom of the hole"
NEEDED_WORDS = {730: "Q", 830: "Q", 820: "P", 860: "P", 880: "P", 890: "P", 870: "IJK"}
"""Words without which LinuxCNC refuses to start a cycle."""
PATTERN_WORDS = frozenset("IJKLPXY")
"""Words of a code that drills a pattern of holes."""


def cycle(control: RS274Control, block: Block, code: int) -> None:
    """Drill the holes of a block."""
    modal, plane = control.modal, control.modal.plane
    check_cycle(control, block, code)
    if not modal.incremental and not control.offset_checked:
        check_system(control)
    control.use_start_positions(tuple(control.unknown))
    take_words(control, block, code, plane)
    program = control.program_position()
    initial = program[plane.across] if modal.cycle.initial is None else modal.cycle.initial
    r, depth = levels(control, initial)
    modal.cycle.initial, modal.cycle.level, modal.motion = initial, r, code
    clear = r if control.dialect.cycle_of(code).ends_at_level(modal.retract_to_r) else max(initial, r)
    for _ in range(repeats(control, block, code)):
        place_hole(control, block, program)
        drill(control, block, code, program, depth, r, clear)


def check_cycle(control: RS274Control, block: Block, code: int) -> None:
    """Raise `Fault` if LinuxCNC would refuse the cycle."""
    if not control.rules.strict:
        return
    modal = control.modal
    if not modal.feed_given or modal.feed_mode == FeedMode.INVERSE_TIME:
        raise Fault("NCF225", "a canned cycle needs a feed rate (F) per minute or per revolution")
    if modal.compensated:
        raise Fault(BAD_CYCLE, "canned cycles cannot be used with cutter compensation")
    turned = [letter for letter in "ABC" if letter in block.values]
    if turned:
        raise Fault(BAD_CYCLE, f"{turned[0]} cannot move in a canned cycle")
    missing = [letter for letter in NEEDED_WORDS.get(code, "") if letter not in block.values]
    if modal.motion != code and missing:
        raise Fault(BAD_CYCLE, f"{missing[0]} is missing: G{code // 10} needs it")
    if "Q" in NEEDED_WORDS.get(code, "") and block.get("Q", 1.0) <= 0.0:
        raise Fault(BAD_CYCLE, "Q, the depth of one peck, must be positive")


def take_words(control: RS274Control, block: Block, code: int, plane: Plane) -> None:
    """Take R and the depth from the block, else keep those in force."""
    sticky = control.modal.cycle
    in_force = control.modal.motion == code or (not control.rules.strict and sticky.initial is not None)
    depth_letter = LETTERS[plane.across]
    level_letter = control.dialect.cycle_of(code).level
    for letter in (level_letter, depth_letter):
        if letter not in block.values and not in_force:
            raise Fault(BAD_CYCLE, f"{letter} is missing: a canned cycle needs it")
    if not in_force:
        sticky.unknown = False
    if level_letter in block.values:
        sticky.r = block.values[level_letter]
    if depth_letter in block.values:
        sticky.depth = block.values[depth_letter]
    sticky.unknown |= bool(block.unknown & {level_letter, depth_letter})


def levels(control: RS274Control, initial: float) -> tuple[float, float]:
    """R and the depth in the program's frame, mm."""
    sticky = control.modal.cycle
    r, depth = control.modal.unit * sticky.r, control.scale[control.modal.plane.across] * sticky.depth
    if control.modal.incremental:
        r += initial
        depth += r
    if r < depth:
        raise Fault(BAD_CYCLE, f"R is below the bottom of the hole ({r:g} and {depth:g} mm)")
    return r, depth


def repeat_letters(control: RS274Control, code: int) -> str:
    """The addresses of the repeat count of a canned cycle."""
    return control.dialect.cycle_of(code).repeats or control.rules.repeats


def repeats(control: RS274Control, block: Block, code: int) -> int:
    """The repeat count of a block: L, or K of most ISO controls."""
    letter = next((each for each in repeat_letters(control, code) if each in block.values), "L")
    count = whole(block.get(letter, 1.0), letter)
    control.budget.spend(max(count, 0))
    if count < 1 and control.rules.strict:
        raise Fault(BAD_CYCLE, "L, the number of repeats, must be 1 or more")
    if count < 1:
        control.claim_words()
        control.lose([index for index in words_of(block) if index != control.modal.plane.across], AFTER_NONE)
    return count


def place_hole(control: RS274Control, block: Block, program: Vector) -> None:
    """Move `program` over the next hole."""
    plane, unit = control.modal.plane, control.modal.unit
    given = {plane.across}
    if block.values.keys() & {"@", "^"}:
        place = by_radius_and_angle(control, block, program[X] / unit, program[Y] / unit)
        program[X], program[Y] = unit * place[0], unit * place[1]
    if block.turn is not None:
        turn = math.radians(block.turn)
        first, second = plane.of(program)
        program[plane.first] = first * math.cos(turn) - second * math.sin(turn)
        program[plane.second] = first * math.sin(turn) + second * math.cos(turn)
        given |= set(plane.pair)
    for index, letter in enumerate(LETTERS):
        if index not in given and letter in block.values:
            step = program[index] if control.modal.incremental else 0.0
            program[index] = step + control.scale[index] * block.values[letter]


def drill(
    control: RS274Control, block: Block, code: int, program: Vector, depth: float, r: float, clear: float
) -> None:
    """Drill one hole: a motion via R to its bottom, after which the control stands above it at `clear`."""
    across = control.modal.plane.across
    if across != Z and not control.rules.strict:
        control.warn(AXES_SAID, ACROSS, WHICH_AXIS)
    moved = block.axes | 1 << across
    unknown = hole_unknown(control, block)
    refusal = AT_RUN_TIME if control.modal.cycle.unknown else NO_DEPTH if depth == r else ""
    height = control.lost_in_frame().get(across)
    if not control.modal.incremental and not unknown and not control.modal.diameter:
        program[across] = r
        control.builder.approach(control.command(program, moved))
    program[across] = depth
    bottom, unplaced = control.command(program, moved), control.places.unplaced
    placed = 0 if control.modal.incremental else moved
    if control.rules.strict:
        control.builder.rests(mask_of(control.turning))
    control.make(Motion(MotionKind.CYCLE, block.axes, MotionEnd(bottom, unknown), code, refusal=refusal, placed=placed))
    at_level = control.dialect.cycle_of(code).ends_at_level(control.modal.retract_to_r)
    if not at_level:
        control.places.lose(unplaced & 1 << across)
    program[across] = clear
    above = control.command(program, moved)
    if height is not None and not at_level:
        control.stand(above, control.axes_of({**unknown, across: height}))
    else:
        control.position = above


def hole_unknown(control: RS274Control, block: Block) -> UnknownAxes:
    """Reasons for unknown positions of axes at the bottom of a hole."""
    modal = control.modal
    unknown = dict(unknown_after(control, block, modal.incremental, control.lost_in_frame()))
    if not modal.incremental:
        unknown.pop(modal.plane.across, None)
        if modal.plane.across in control.composed.unknown:
            unknown[modal.plane.across] = control.composed.unknown[modal.plane.across]
    if control.unnamed:
        unknown |= unnamed(control, block)
    if control.is_rotated and unknown.keys() & {0, 1, 2}:
        reason = unknown[min(unknown)]
        unknown |= {index: reason for index in (0, 1, 2) if index in control.axis_indices}
    return unknown
