"""Motions other than arcs and cycles: the commands to which the axis words of a block lead, which axes are known
afterwards, and the steps of the motion codes. An axis without a word stays where it is.

Source: LinuxCNC documentation, "G-code overview", "F", "G53", "G90, G91", "G93, G94, G95".
"""

from __future__ import annotations

import math

from ncfix.control.coordinates import INDEX, LETTERS, N_LETTERS, Vector, X, Y, mask_of, rotated
from ncfix.control.expressions import Fault, Unknown, nominal
from ncfix.control.moves import FeedMode, Motion, MotionEnd, MotionKind, Pass, Passing, UnknownAxes
from ncfix.control.tcp import led_in_machine
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.systems import REFERENCES, check_system, is_given, store, stored, words_of

AFTER_ROTATION = (
    "the end position of the axis {} after G68 or G69 depends on the control until both axes of the plane are "
    "programmed"
)
RUNTIME = "the position of the axis {} is known only at run time"
POLAR = "NCF223"


def destination(control: RS274Control, block: Block) -> MotionEnd:
    """The end of this block's motion."""
    end = words_destination(control, block)
    return MotionEnd(end.target, end.unknown | unnamed(control, block)) if control.unnamed else end


def unnamed(control: RS274Control, block: Block) -> UnknownAxes:
    """Why axes of the plane are unknown until both are named, after a rotation began or ended (G68, G69)."""
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
    return dict.fromkeys(sorted(doubtful & {*control.axis_indices}), AFTER_ROTATION)


def words_destination(control: RS274Control, block: Block) -> MotionEnd:
    """The end to which the words of a block lead."""
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
        return rotated_end(control, block, incremental, target)
    return MotionEnd(target, unknown_after(control, block, incremental, control.unknown))


def unknown_after(control: RS274Control, block: Block, incremental: bool, before: UnknownAxes) -> UnknownAxes:
    """Reasons for unknown axes at the end of a motion; `before`: those at its start."""
    if not (before or control.composed.unknown or block.unknown):
        return before
    unknown = dict(before)
    for index, letter in enumerate(LETTERS):
        if not block.axes >> index & 1 or index not in control.axis_indices:
            continue
        if not incremental:
            unknown.pop(index, None)
            if index in control.composed.unknown:
                unknown[index] = control.composed.unknown[index]
        if letter in block.unknown:
            unknown[index] = RUNTIME
    return unknown


def rotated_destination(control: RS274Control, block: Block, incremental: bool) -> MotionEnd:
    """Like `words_destination`, in a rotated frame, where one word moves several axes."""
    program = control.program_position()
    for letter, value in block.values.items():
        if letter in INDEX:
            index = INDEX[letter]
            program[index] = control.scale[index] * value + (program[index] if incremental else 0.0)
    return rotated_end(control, block, incremental, control.command(program, block.axes))


def rotated_end(control: RS274Control, block: Block, incremental: bool, target: Vector) -> MotionEnd:
    """The end of a motion at `target` in a rotated frame: an axis is known if all axes that it depends on are."""
    own = unknown_after(control, block, incremental, control.lost_in_frame())
    return MotionEnd(target, control.axes_of(own), own)


def cartesian(control: RS274Control, block: Block) -> Block:
    """A block with polar words `@` (radius) and `^` (angle) converted to X and Y of the program's frame, absolute."""
    program = [
        nominal(control.coordinate(index)) if index in (X, Y) or block.axes >> index & 1 else 0.0 for index in range(9)
    ]
    x, y = by_radius_and_angle(control, block, program[X], program[Y])
    others = {letter: value for letter, value in block.values.items() if letter not in "@^"}
    if control.modal.incremental:
        others |= {letter: value + program[INDEX[letter]] for letter, value in others.items() if letter in INDEX}
    ends = {"X": 2.0 * x if control.modal.diameter else x, "Y": y}
    unknown = block.unknown | {"X", "Y"} if block.unknown & {"@", "^"} else block.unknown
    return Block(block.index, others | ends, unknown, block.axes)


def by_radius_and_angle(control: RS274Control, block: Block, x: float, y: float) -> tuple[float, float]:
    """X and Y of polar words, from a position, in program units; what is omitted stays, or in G91 is added."""
    if control.modal.plane.code != 170:
        raise Fault(POLAR, "polar coordinates are allowed in the plane G17 only")
    if block.values.keys() & {"X", "Y"}:
        raise Fault(POLAR, "the block has both polar coordinates and X or Y")
    radius, angle = math.hypot(x, y), math.degrees(math.atan2(y, x))
    if radius == 0.0 and (control.modal.incremental or "^" not in block.values):
        raise Fault(POLAR, "at the origin polar coordinates need both radius and angle, in G90")
    if control.modal.incremental:
        radius, angle = radius + block.get("@"), angle + block.get("^")
    else:
        radius, angle = block.get("@", radius), block.get("^", angle)
    return radius * math.cos(math.radians(angle)), radius * math.sin(math.radians(angle))


def machine_destination(control: RS274Control, block: Block) -> MotionEnd:
    """The end of a motion in machine coordinates (G53)."""
    named = [letter for letter in block.values if letter in INDEX]
    axes = {INDEX[letter]: control.scale[INDEX[letter]] * block.values[letter] for letter in named}
    return led_in_machine(control, axes, {INDEX[letter]: RUNTIME for letter in named if letter in block.unknown})


NO_FEED = "NCF225"


def feed_mode(control: RS274Control, block: Block, code: int) -> None:
    """G93, G94, G95. In LinuxCNC the feed per minute or revolution must be given again after the code."""
    mode = code // 10
    if mode != control.modal.feed_mode or (control.rules.strict and mode != FeedMode.INVERSE_TIME):
        control.modal.feed = math.nan
        control.modal.feed_given = False
    control.modal.feed_mode = mode


def feed(control: RS274Control, block: Block, code: int) -> None:
    """F."""
    control.modal.feed = math.nan if "F" in block.unknown else control.feed_unit * block.values["F"]
    control.modal.feed_given = control.modal.feed != 0.0


def speed(control: RS274Control, block: Block, code: int) -> None:
    """S."""
    control.modal.speed = block.values["S"]


def check_feed(control: RS274Control, block: Block) -> None:
    """Raise `Fault` if LinuxCNC would refuse a motion because the feed is missing."""
    if not control.needs_feed:
        return
    if control.modal.feed_mode == FeedMode.INVERSE_TIME:
        if "F" not in block.values:
            raise Fault(NO_FEED, "in inverse time mode (G93) every block with a motion at feed rate needs F")
    elif not control.modal.feed_given:
        raise Fault(NO_FEED, "a motion at feed rate, but no feed rate (F) is set")
    elif control.modal.feed_mode == FeedMode.PER_REVOLUTION and control.modal.speed == 0.0:
        raise Fault(NO_FEED, "a feed rate per revolution (G95), but no spindle speed (S) is set")


BAD_MOTION = "NCF221"
MACHINE_COORDINATES = Passing(Pass.MACHINE_COORDINATES, "machine coordinates (G53)")
REFERENCE_POINT = "reference point ({})"
PROBING = Passing(Pass.PROBING, "probing")
DWELL = Passing(Pass.DWELL, "dwell")
AFTER_G53 = "the position of the axis {} after G53 in incremental coordinates (G91) depends on the control"
AFTER_PROBING = "the position of the axis {} after probing is known only at run time"
WITH_CANCEL = "what a word {} in a block with G80 does depends on the control: program G0 or G1 in the block"
SECOND_POINT = 300
AFTER_REFERENCE = "the position of the axis {} after the approach to the reference point is not given"
AFTER_CYCLE = "the position of the axis {} after a turning cycle is not known"
NO_CODE = -2
"""Motion code of blocks with axis words before any motion code is in force."""

ONE_SHOT_PROBE = 310
"""G31 applies to its block only; the previous motion code stays in force."""

REFUSALS = {
    50: "spline (G5)",
    51: "spline (G5.1)",
    52: "spline (G5.2)",
    330: "threading (G33)",
    331: "rigid tapping (G33.1)",
    760: "threading cycle (G76)",
}


def straight(control: RS274Control, block: Block, code: int) -> None:
    """G0 and G1."""
    if code:
        check_feed(control, block)
    control.modal.motion = control.modal.straight = code
    if not block.axes:
        return
    kind = MotionKind.FEED if code else MotionKind.RAPID
    computed = block.unknown & INDEX.keys()
    if computed and control.probes_nominally:
        measured(control, block, computed, kind, code)
        return
    control.make(Motion(kind, block.axes, destination(control, block), code))


def measured(control: RS274Control, block: Block, computed: frozenset[str], kind: MotionKind, code: int) -> None:
    """Make a straight motion whose words are partly computed from nominal probing results.

    The control will compute them at run time. An inserted block, or a later word for such an axis, would have to do so,
    too: neither is written.
    """
    axes = mask_of(INDEX[letter] for letter in computed)
    end = destination(control, Block(block.index, block.values, block.unknown - computed, block.axes))
    with control.in_one_piece():
        control.builder.measures(axes)
        control.make(Motion(kind, block.axes, end, code))
    control.places.lose(axes)


def in_machine_coordinates(control: RS274Control, block: Block, code: int) -> None:
    """G53 with G0 or G1; if neither is in force, ISO controls move in rapid."""
    if code not in (0, 10):
        if control.rules.strict:
            raise Fault(BAD_MOTION, "G53 needs G0 or G1 in force")
        code, modal = 0, code
    else:
        modal = code
    if control.modal.incremental and control.rules.strict:
        raise Fault(BAD_MOTION, "G53 is not allowed with incremental coordinates (G91)")
    if code:
        check_feed(control, block)
    control.modal.motion = modal
    if block.axes:
        end, kind = machine_destination(control, block), MotionKind.FEED if code else MotionKind.RAPID
        control.make(Motion(kind, block.axes, end, code, passing=MACHINE_COORDINATES))
        if control.modal.incremental:
            control.lose_in_machine([index for index in range(N_LETTERS) if block.axes >> index & 1], AFTER_G53)


def one_way(control: RS274Control, block: Block, code: int) -> None:
    """G60: a rapid that approaches its end from one side (ISO controls); it stays whole, as it acts on one block."""
    with control.in_one_piece():
        control.make(Motion(MotionKind.RAPID, block.axes, destination(control, block), 0))


# -- reference points -------------------------------------------------------------------------------------------------


def go_to_reference(control: RS274Control, block: Block, code: int) -> None:
    """G28 and G30: via the words of the block to the reference point, along the axes named, or along all.

    P of G30 names the second, third or fourth; where the last two lie is not known (not in LinuxCNC).
    """
    name, which = f"G{code // 10}", block.get("P", 2.0)
    further = code == SECOND_POINT and (which != 2.0 or "P" in block.unknown)
    passing = Passing(Pass.REFERENCE_POINT, REFERENCE_POINT.format(f"{name} P{which:g}" if further else name))
    modal = control.modal.motion
    checked, control.offset_checked = control.offset_checked, True
    way = destination(control, block)
    control.offset_checked = checked
    if goes_by_way(control, block):
        control.make(Motion(MotionKind.RAPID, block.axes, way, modal, passing=passing))
    axes = block.axes or mask_of(control.axis_indices)
    lost = dict.fromkeys((i for i in control.axis_indices if axes >> i & 1), AFTER_REFERENCE)
    nowhere = MotionEnd(control.position[:], control.unknown | lost)
    end = nowhere if further else reference_target(control, name, axes)
    control.make(Motion(MotionKind.RAPID, block.axes, end, modal, passing=passing))


def goes_by_way(control: RS274Control, block: Block) -> bool:
    """Whether the motion to a reference point goes via the words of the block; zero increments lead nowhere."""
    values = [block.values.get(LETTERS[index], 1.0) for index in words_of(block)]
    return any(values) if control.modal.incremental else bool(values)


def reference_target(control: RS274Control, name: str, axes: int) -> MotionEnd:
    """The end at a reference point along the axes in the bit mask; other axes stay."""
    first = REFERENCES[name]
    place, unsure = along(control, stored(control, first), axes), dict(control.unknown)
    for index in control.axis_indices:
        if axes >> index & 1:
            unsure.pop(index, None)
            given = is_given(control, first, index) and not control.parameters.is_unknown(first + index)
            if not given and not assumed(control, name):
                unsure[index] = AFTER_REFERENCE
    places = {i: place[i] for i in range(N_LETTERS) if axes >> i & 1 or place[i] != control.position[i]}
    return led_in_machine(control, places, unsure)


def along(control: RS274Control, point: Vector, axes: int) -> Vector:
    """The position moved to a point along some letters of the program's frame, rotated like the frame (LinuxCNC)."""
    if control.tcp or not control.is_rotated or axes & 3 in (0, 3):
        return [point[i] if axes >> i & 1 else value for i, value in enumerate(control.position)]
    here = control.program_position()
    there = rotated(control.inverse, [p - o for p, o in zip(point, control.offset, strict=True)])
    mixed = [there[i] if axes >> i & 1 else value for i, value in enumerate(here)]
    return [a + b for a, b in zip(rotated(control.rotation, mixed), control.offset, strict=True)]


def assumed(control: RS274Control, name: str) -> bool:
    """Whether a reference point that is not given counts as zero."""
    if control.setup.assume_zero:
        control.knowledge.reference_point(name)
    return control.setup.assume_zero


def save_reference(control: RS274Control, block: Block, code: int) -> None:
    """G28.1 and G30.1: save the position as reference point."""
    control.use_start_positions(tuple(control.unknown))
    first = REFERENCES[f"G{code // 10}"]
    for index, value in enumerate(control.position):
        store(control, first, index, value, index in control.unknown)


# -- probing ----------------------------------------------------------------------------------------------------------


def probe(control: RS274Control, block: Block, code: int) -> None:
    """G38.2 to G38.5, and G31 of ISO controls: move towards the words until the probe switches."""
    if control.rules.strict:
        if not control.modal.feed_given:
            raise Fault("NCF225", "probing, but no feed rate (F) is set")
        if control.modal.feed_mode == FeedMode.PER_REVOLUTION:
            raise Fault(BAD_MOTION, "probing needs a feed rate per minute (G94)")
    if code != ONE_SHOT_PROBE:
        control.modal.motion = code
    end = destination(control, block)
    if control.probes_nominally:
        probe_nominally(control, block, end, code)
        return
    target, unknown = end.target, end.unknown
    moved = [index for index in range(N_LETTERS) if target[index] != control.position[index] or index in unknown]
    if control.rules.strict and code % 2 == 0 and not moved:
        raise Fault(BAD_MOTION, "the probing motion has no length: it starts at its end point")
    spatial = 7 if control.is_rotated and block.axes & 7 else 0
    named = [index for index in moved if (block.axes | spatial) >> index & 1]
    touched = MotionEnd(target, unknown | {index: AFTER_PROBING for index in named if index in control.axis_indices})
    probed(control, Motion(MotionKind.FEED, block.axes, touched, code, passing=PROBING), touches=False)


def probe_nominally(control: RS274Control, block: Block, end: MotionEnd, code: int) -> None:
    """Probing that nominally ends where the setup says; at run time, results are computed anew."""
    control.knowledge.probing()
    touched = {letter: value for letter, value in (control.setup.probed or {}).items() if letter in block.values}
    if touched:
        values = {letter: value / control.unit_of(INDEX[letter]) for letter, value in touched.items()}
        incremental, control.modal.incremental = control.modal.incremental, False
        end = destination(control, Block(block.index, values, frozenset(), block.axes))
        control.modal.incremental = incremental
    probed(control, Motion(MotionKind.FEED, block.axes, end, code, passing=PROBING), touches=True)


def probed(control: RS274Control, motion: Motion, *, touches: bool) -> None:
    """Make the motion of a probe, and set the parameters with its result; `touches`: whether it touches for certain."""
    control.make(motion)
    program = control.program_position()
    for index in range(N_LETTERS):
        control.parameters.assign(5061 + index, Unknown("", program[index] / control.unit_of(index)))
    control.parameters.assign(5070, 1.0 if touches else Unknown("", 1.0))


# -- followed only as far as their end --------------------------------------------------------------------------------


def refused(control: RS274Control, block: Block, code: int) -> None:
    """Splines and threads: their end is followed, their path is not."""
    if code in (330, 331, 760):
        control.modal.motion = code
        if control.rules.strict and control.modal.spindle == 5:
            raise Fault(BAD_MOTION, f"the spindle is not on for {REFUSALS[code]}")
    elif code in (50, 51):
        check_feed(control, block)
    else:
        control.modal.motion = code
    end = destination(control, block)
    before, known = control.position, control.unknown
    control.make(Motion(MotionKind.FEED, block.axes, end, code, refusal=REFUSALS[code]))
    if code == 331:
        control.stand(before, known)


def end_spline(control: RS274Control, block: Block, code: int) -> None:
    """G5.3: end the spline that the G5.2 blocks described."""
    if control.modal.motion != 52:
        raise Fault(BAD_MOTION, "G5.3 ends a spline, but no G5.2 has started one")
    control.modal.motion = -1


STORED_CYCLES = range(10001, 11000)
"""P of G5 that runs one of 999 cycles stored in variables, each of which moves axes."""
STORED = "high-speed cycle machining (G5 P{:.0f}): its path is in variables of the control"
STORED_AT_RUN_TIME = "which kind of high-speed machining (P of G5) begins is known only at run time"


def high_speed(control: RS274Control, block: Block, code: int) -> None:
    """G5 of ISO controls: P0 to P10000 set how far ahead the control looks, and move nothing.

    Source: Fanuc 30i operator's manual, "High-speed cycle machining".
    """
    kind = block.get("P")
    if "P" in block.unknown:
        control.refuse_rest(STORED_AT_RUN_TIME)
    elif kind in STORED_CYCLES:
        from ncfix.control.operations import make_up

        make_up(control, block, STORED.format(kind), control.turning)


def turning_cycle(control: RS274Control, block: Block, code: int) -> None:
    """G70 to G72 of turning: their path is written elsewhere in the program.

    On other controls than LinuxCNC these codes may be patterns of holes, or copies of a figure, which move Y, too.
    """
    unknown = dict(control.unknown)
    for letter in "XZ" if control.rules.strict else "XYZ":
        if INDEX[letter] in control.axis_indices:
            unknown[INDEX[letter]] = AFTER_CYCLE
    refusal = f"turning cycle (G{code / 10:g})"
    control.make(Motion(MotionKind.FEED, block.axes, MotionEnd(control.position[:], unknown), code, refusal=refusal))


def at_power_on(control: RS274Control, block: Block, code: int) -> None:
    """Axis words before the first motion code: a setting of ISO controls decides whether G0 or G1 is in force (Fanuc:
    parameter 3402). Both end at the same place; an inserted block would have to name one, so none may be inserted."""
    end = destination(control, block)
    with control.in_one_piece():
        control.make(Motion(MotionKind.RAPID, block.axes, end, 0))


def dwell(control: RS274Control, block: Block, code: int) -> None:
    """G4."""
    if control.rules.strict and block.get("P", -1.0) == -1.0:
        raise Fault(BAD_MOTION, "G4 needs P, the time in seconds")
    here = MotionEnd(control.position, control.unknown)
    control.make(Motion(MotionKind.DWELL, 0, here, control.modal.motion, passing=DWELL))


def cancel(control: RS274Control, block: Block, code: int) -> None:
    """G80: end the motion code; on ISO controls the one before the cycle is in force again."""
    control.modal.motion = code if control.rules.strict else control.modal.straight
    word = "" if control.rules.strict else control.path_word(control.block_words)
    if word:
        control.claim_words()
        control.refuse_here(WITH_CANCEL.format(word))
