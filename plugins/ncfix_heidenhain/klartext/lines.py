"""Straight motions (L, LN, LP, blocks of words alone), motions in machine coordinates, approach and departure.

Source: TNC 640, "Programming: contours", "Multiple axis machining", "Miscellaneous functions for coordinate data".
"""

import math
from collections.abc import Sequence

from ncfix.control.coordinates import DEGREE, LETTERS, Vector, dot, mask_of
from ncfix.control.frames import unit
from ncfix.control.moves import Motion, MotionEnd, MotionKind, Pass, Passing, UnknownAxes
from ncfix.control.posture import WayRules
from ncfix.control.tcp import led_in_machine, switch
from ncfix_heidenhain.klartext.arcs import FLAT, Step
from ncfix_heidenhain.klartext.control import DEPARTED, SPATIAL_ANGLES, SPATIAL_MODE, KlartextControl
from ncfix_heidenhain.klartext.planes import check_normal
from ncfix_heidenhain.klartext.targets import (
    MotionWords,
    command_of,
    derived,
    destination,
    in_machine,
    polar,
    polar_axes,
    programmed_position,
)

MACHINE_COORDINATES = "machine coordinates ({})"
NOT_GIVEN = "the position of the axis {} after M92 depends on the M92 datum: give references.M92 in the setup"
NOT_STRAIGHT = "the position of the axis {} after a path other than L in machine coordinates is not known"
SQUARE = (
    "the control turns the tool normal to the surface (NX NY NZ under M128), and ncfix does not calculate its direction"
)
ORIENTED = "the control calculates the rotary axes (TX TY TZ), and their positions are not known"
TURNS_UNDER_TILT = Passing(
    Pass.ROTARY_ALONE, "rotary axes are positioned in a tilted plane; the tool tip is corrected in the next motion"
)
MIXED_UNDER_TILT = "linear and rotary axes move together in a tilted plane"
FAR_INCREMENT = (
    "an increment of more than half a turn under M126: whether the axis takes the shorter path is not certain"
)
OFF = Passing(Pass.LED, "a rapid from a position that the control calculates")
DEPARTURE = Passing(Pass.DEPARTURE, "departure from the contour (DEP)")
IN_TRAVEL = WayRules(in_travel=True)
IN_SPACE = 0b111
"""The bits of X, Y and Z."""

STILL_RAD = 1e-9
"""A rotary axis whose end is this near its start does not turn."""


def straight(control: KlartextControl, step: Step) -> None:
    """Execute L, LN, or a block of words alone."""
    control.use()
    end = destination(control, step.words)
    if not {"TX", "TY", "TZ"} & step.words.values.keys():
        turning = mask_of(control.turning)
        if step.name == "ln" and control.m128 and turning and not step.words.axes & turning:
            control.refuse_here(SQUARE)
            return
        run(control, step, end, step.words.axes)
        return
    way = None if step.words.unknown else pointed(control, step.words)
    if way is None:
        control.refuse_here(ORIENTED)
        return
    control.points = True
    for index, angle in way.items():
        end.target[index] = angle
        end.unknown.pop(index, None)
    spatial = not step.words.axes & mask_of(way) and control.resume(SPATIAL_MODE)  # a direction is one all the same
    run(control, step, end, step.words.axes | mask_of(way))
    if spatial:
        control.suspend(SPATIAL_MODE, SPATIAL_ANGLES)


def pointed(control: KlartextControl, words: MotionWords) -> dict[int, float] | None:
    """The nearest rotary positions that point the tool along TX TY TZ; None if they are not known."""
    vector = unit((words.values.get("TX", 0.0), words.values.get("TY", 0.0), words.values.get("TZ", 0.0)))
    if vector is None or not control.m128:
        return None
    found = control.postures([dot(row, vector) for row in control.rotation], IN_TRAVEL)
    if found is None or not found.ways:
        return None
    if found.is_close:
        control.builder.keeps_direction()
    return found.chosen


def straight_polar(control: KlartextControl, step: Step) -> None:
    """Execute LP."""
    control.use()
    where, _ = polar(control, step.words)
    axes = polar_axes(control, step.words)
    run(control, step, command_of(control, where, axes), axes, follows=True)
    name_polar(control, step)


def name_polar(control: KlartextControl, step: Step) -> None:
    """Note that the program has stated where the axes of the plane are, if the block has both PR and PA."""
    if {"PR", "PA"} <= step.words.values.keys():
        control.places.place(control.path.plane.axes)


def run(control: KlartextControl, step: Step, end: MotionEnd, axes: int, *, follows: bool = False) -> None:
    """Make a straight motion; `axes`: bit mask of the axes that it names; `follows`: it counts from where it starts."""
    turned = [index for index in control.turning if axes >> index & 1]
    positioning = turned and (not axes & IN_SPACE or turns(control, turned, end))
    if positioning and control.plane_tilted and not control.m128:
        turn_under_tilt(control, step, end, axes)
        return
    way = take_short_way(control, step, end.target, axes) if control.shortest else ""
    before = control.position, control.unknown
    off = step.kind == MotionKind.RAPID and control.is_led(end.unknown)
    control.modal.incremental = follows or step.words.incremental
    code = 0 if step.kind == MotionKind.RAPID else 10
    refusal = way or check_normal(control) or derived(control, step.words, axes)
    control.make(Motion(step.kind, axes, end, code, refusal=refusal, passing=OFF if off else None))
    control.modal.incremental = False
    keep_tangent(control, *before)


def turns(control: KlartextControl, indices: Sequence[int], end: MotionEnd) -> bool:
    """Whether any of these axes moves, or may move since its start or end is not known."""
    lost = control.unknown.keys() | end.unknown.keys()
    return any(index in lost or abs(end.target[index] - control.position[index]) > STILL_RAD for index in indices)


def keep_tangent(control: KlartextControl, start: Vector, unknown: UnknownAxes) -> None:
    """Note the direction of a straight motion that has just been made; one without a length leaves it as it was."""
    if any(index in unknown or index in control.unknown for index in range(3) if index in control.axis_indices):
        control.path.tangent = None
        return
    way = [b - a for a, b in zip(start[:3], control.position[:3], strict=True)]
    length = math.hypot(*way)
    if length > FLAT:
        control.path.tangent = (way[0] / length, way[1] / length, way[2] / length)


def take_short_way(control: KlartextControl, step: Step, target: Vector, axes: int) -> str:
    """M126: add whole turns to the present positions of rotary axes, so that each goes the shorter way to its end.

    Returns why the motion is refused: what M126 makes of increments of more than half a turn the manuals do not say.
    """
    for index in control.axis_indices:
        if not (control.rotary[index] and axes >> index & 1) or index in control.unknown:
            continue
        if "I" + LETTERS[index] in step.words.values and abs(target[index] - control.position[index]) > math.pi:
            return FAR_INCREMENT
        turns = round((target[index] - control.position[index]) / (2 * math.pi))
        control.position[index] += 2 * math.pi * turns
    return ""


def turn_under_tilt(control: KlartextControl, step: Step, end: MotionEnd, axes: int) -> None:
    """Turn rotary axes in a tilted plane without M128: X Y Z of the machine stand still, so the tip moves."""
    target, still = end.target, [index for index in control.axis_indices if not control.rotary[index]]
    linear = any(axes >> index & 1 for index in range(len(target)) if not control.rotary[index])
    switch(control, control.tools.vector, False, control.tools.offset)
    control.refresh()
    unknown = {index: why for index, why in end.unknown.items() if index not in still}
    for index in still:
        target[index] = control.position[index]
        if index in control.unknown:
            unknown[index] = control.unknown[index]
    code = 0 if step.kind == MotionKind.RAPID else 10
    refusal, passing = (MIXED_UNDER_TILT, None) if linear else ("", TURNS_UNDER_TILT)
    control.make(Motion(step.kind, axes, MotionEnd(target, unknown), code, refusal=refusal, passing=passing))
    if linear:
        control.lose(range(3), MIXED_UNDER_TILT + ": the position of {} is not known")
    control.switch_tip()
    control.path.tangent = None


def at_machine(control: KlartextControl, step: Step) -> None:
    """Execute a motion in machine coordinates (M91, M92)."""
    code, (axes, unsure) = "M91" if 91 in step.codes else "M92", in_machine(control, step.words)
    if code == "M92":
        zero = control.setup.references.get(code, {})
        unsure |= {index: NOT_GIVEN for index in axes if LETTERS[index] not in zero}
        for index in axes.keys() - unsure.keys():
            axes[index] += zero[LETTERS[index]] * (DEGREE if control.rotary[index] else 1.0)
    if step.name not in ("", "l") or {"PA", "PR", "IPA", "IPR"} & step.words.values.keys():
        elsewhere = dict.fromkeys((i for i in control.axis_indices if not control.rotary[i]), NOT_STRAIGHT)
        axes, unsure = dict.fromkeys(elsewhere, 0.0) | axes, unsure | elsewhere
    end = led_in_machine(control, axes, unsure)
    passing = Passing(Pass.MACHINE_COORDINATES, MACHINE_COORDINATES.format(code))
    control.make(Motion(step.kind, step.words.axes, end, 0, passing=passing))
    control.path.tangent = None


# -- approach and departure -------------------------------------------------------------------------------------------


def approach(control: KlartextControl, step: Step) -> None:
    """APPR: a motion to the first point of the contour, which the words state; the control makes the way there."""
    control.use()
    where = polar(control, step.words)[0] if " p" in step.name else programmed_position(control, step.words)
    axes = polar_axes(control, step.words) if " p" in step.name else step.words.axes
    end = command_of(control, where, axes)
    control.path.corner = True
    control.modal.incremental = step.words.incremental or " p" in step.name
    control.make(Motion(MotionKind.FEED, axes, end, 10, refusal=derived(control, step.words, axes)))
    control.modal.incremental = False
    if " p" in step.name:
        name_polar(control, step)
    control.path.tangent = None


def departure(control: KlartextControl, step: Step) -> None:
    """DEP: with an end point of its own (LCT) it is corrected like APPR; otherwise its end follows from the contour.

    The end is known only of DEP LT without radius compensation: with RL or RR the tool may end beside that line, by its
    radius.
    """
    beside, control.modal.compensated = control.modal.compensated, 0
    if step.name.endswith("lct"):
        approach(control, step)
        return
    tangent, control.path.tangent = control.path.tangent, None
    plane = control.path.plane
    lost: UnknownAxes = {i: DEPARTED for i in plane.pair if i in control.axis_indices}
    target = control.position[:]
    straight_on = step.name == "dep lt" and "LEN" in step.words.values and not (beside or step.words.unknown)
    if straight_on and tangent is not None:
        length = control.stretch * step.words.values["LEN"]
        target[:3] = [a + length * b for a, b in zip(target[:3], tangent, strict=True)]
        lost = {}
    axes = plane.axes
    end = MotionEnd(target, {**control.unknown, **lost})
    control.make(Motion(MotionKind.FEED, axes, end, 10, passing=DEPARTURE))
