"""Circular motions: C, CR, CP, CT and CTP; and `Step`, the motion block that is being executed.

The sense of rotation counts in the program's frame; mirroring reverses it, as on the control.

Source: TNC 640, "Programming: contours".
"""

from __future__ import annotations

import math

from ncfix.control.arcs import CLOCKWISE, COUNTER, Point, centre_from_radius, check_closure, sweep_angle
from ncfix.control.coordinates import LETTERS, Plane, Vector, X, Y, dot
from ncfix.control.expressions import Fault
from ncfix.control.moves import Arc, Motion, MotionEnd, MotionKind
from ncfix.values import frozen
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.targets import (
    BAD_POLE,
    PLANE_OF,
    FramePosition,
    MotionWords,
    command_of,
    derived,
    here,
    polar,
    polar_axes,
    pole_frame,
    programmed_position,
    starts_unknown,
)

IN_PLANE = 1 << X | 1 << Y
"""The bits of X and Y."""


@frozen
class Step:
    """The motion block that is being executed.

    name    path function
    words   words with their values
    flags   words without values: `fmax`, `dr+`, ...
    codes   M codes
    """

    name: str
    words: MotionWords
    flags: frozenset[str]
    codes: frozenset[int]

    @property
    def kind(self) -> MotionKind:
        """A rapid with FMAX, else a feed motion."""
        return MotionKind.RAPID if "fmax" in self.flags else MotionKind.FEED


def somewhere(control: KlartextControl, axes: int, end: MotionEnd, reason: str) -> None:
    """Make a refused arc of unknown shape: the motion before must still end exactly where the program says."""
    normal = control.rotation[0][2], control.rotation[1][2], control.rotation[2][2]
    control.modal.arc_absolute = True
    nowhere = Arc((0.0, 0.0, 0.0), normal, 0.0)
    control.make(Motion(MotionKind.ARC, axes | IN_PLANE, end, 10, refusal=reason, arc=nowhere))
    control.modal.arc_absolute = False
    control.path.tangent = None


BAD_ARC = "NCF220"

NO_TANGENT = (
    "a tangential arc (CT), but its direction at the start is not known, or its end is straight ahead or behind"
)
NO_ANGLE = "CP without an angle (PA, IPA): whether the control makes a full circle or stops is not certain"
AROUND = "an arc about a pole (CC) that was set before the datum was shifted: its position is not certain"
FLAT = 1e-9
"""A length, mm, below which there is no direction; also the least sine of the angle by which CT turns away."""


def circular(control: KlartextControl, step: Step) -> None:
    """C: an arc about the pole to an end point."""
    pole = known_pole(control)
    plane, clockwise = control.path.plane, is_clockwise(step)
    control.use()
    where = programmed_position(control, step.words)
    if give_up(control, step, where):
        return
    if control.path.pole_in != pole_frame(control):
        do_without(control, step, where, AROUND)
        return
    start, away = start_and_way(control, where, plane)
    centre = pole[0] - start[0], pole[1] - start[1]
    try:
        check_closure(centre, away, control.dialect.closure_mm, control.dialect.closure_relative)
    except Fault as fault:
        do_without(control, step, where, fault.text)
        return
    swing(control, step, where, plane, centre, sweep_angle(centre, away, 1, clockwise=clockwise))


def circular_by_radius(control: KlartextControl, step: Step) -> None:
    """CR: an arc of a given radius to an end point."""
    clockwise = is_clockwise(step)
    control.use()
    where = programmed_position(control, step.words)
    if "R" not in step.words.values:
        raise Fault(BAD_ARC, "CR needs R, the radius")
    if give_up(control, step, where):
        return
    plane = plane_of(step.words)
    _, away = start_and_way(control, where, plane)
    try:
        centre = centre_from_radius(away, control.stretch * step.words.values["R"], clockwise=clockwise)
    except Fault as fault:
        do_without(control, step, where, fault.text)
        return
    swing(control, step, where, plane, centre, sweep_angle(centre, away, 1, clockwise=clockwise))


def circular_polar(control: KlartextControl, step: Step) -> None:
    """CP: an arc about the pole to a polar angle, or a helix with several turns and a height."""
    pole = known_pole(control)
    plane, clockwise = control.path.plane, is_clockwise(step)
    control.use()
    where, angle = polar(
        control, MotionWords({k: v for k, v in step.words.values.items() if k not in ("PR", "IPR")}, step.words.unknown)
    )
    if give_up(control, step, where):
        return
    if not step.words.values.keys() & {"PA", "IPA"}:
        do_without(control, step, where, NO_ANGLE)
        return
    start, away = start_and_way(control, where, plane)
    centre = pole[0] - start[0], pole[1] - start[1]
    if math.hypot(*centre) < FLAT:
        raise Fault(BAD_ARC, "the arc has no radius: the tool is at the pole")
    if angle is None:
        angle = sweep_angle(centre, away, 1, clockwise=clockwise)
    elif (angle < 0) != clockwise and angle:
        raise Fault(BAD_ARC, "the sign of IPA and DR contradict each other")
    swing(control, step, where, plane, centre, angle)


def tangential(control: KlartextControl, step: Step) -> None:
    """CT and CTP: an arc that starts in the direction in which the element before ended."""
    control.use()
    where = polar(control, step.words)[0] if step.name == "ctp" else programmed_position(control, step.words)
    if give_up(control, step, where):
        return
    if control.path.tangent is None:
        do_without(control, step, where, NO_TANGENT)
        return
    plane = control.path.plane if step.name == "ctp" else plane_of(step.words)
    ahead = [dot(row, control.path.tangent) for row in control.inverse] if control.is_rotated else control.path.tangent
    _, away = start_and_way(control, where, plane)
    left = -ahead[plane.second], ahead[plane.first]
    side = away[0] * left[0] + away[1] * left[1]
    size = math.hypot(*left)
    if size < FLAT or math.hypot(*away) < FLAT or abs(side) <= FLAT * math.hypot(*away):
        do_without(control, step, where, NO_TANGENT)
        return
    radius = (away[0] ** 2 + away[1] ** 2) * size / (2 * side)
    centre = radius * left[0] / size, radius * left[1] / size
    swing(control, step, where, plane, centre, sweep_angle(centre, away, 1, clockwise=radius < 0))


def swing(
    control: KlartextControl, step: Step, where: FramePosition, plane: Plane, centre: Point, sweep: float
) -> None:
    """Make an arc.

    centre  from the start, mm along the axes of the plane
    sweep   signed angle, rad
    """
    axes = step.words.axes | plane.axes
    end = command_of(control, where, axes)
    arc = control.circle(plane, centre, control.handedness * sweep)._replace(fixed=step.name == "c")
    control.modal.incremental = step.name in ("ct", "ctp", "cp") or step.words.incremental
    code, why = CLOCKWISE if sweep < 0 else COUNTER, derived(control, step.words, axes)
    control.make(Motion(MotionKind.ARC, axes, end, code, refusal=why, arc=arc))
    control.modal.incremental = False
    control.path.tangent = direction_at_end(control.position, arc)


def direction_at_end(end: Vector, arc: Arc) -> tuple[float, float, float]:
    """The unit tangent of an arc at its end."""
    x, y, z = (a - b for a, b in zip(end[:3], arc.centre, strict=True))
    a, b, c = arc.normal
    sign = 1.0 if arc.sweep > 0 else -1.0
    way = sign * (b * z - c * y), sign * (c * x - a * z), sign * (a * y - b * x)
    length = math.hypot(*way)
    return way[0] / length, way[1] / length, way[2] / length


def is_clockwise(step: Step) -> bool:
    """Whether an arc has DR-, not DR+; one of them is needed."""
    if not step.flags & {"dr-", "dr+"}:
        raise Fault(BAD_ARC, f"{step.name.upper()} needs DR+ or DR-, the sense of rotation")
    return "dr-" in step.flags


def known_pole(control: KlartextControl) -> tuple[float, float]:
    """The pole in force; a `Fault` if none is known."""
    if control.path.pole is None:
        raise Fault(BAD_POLE, "an arc about the pole, but no pole (CC) is known")
    return control.path.pole


def plane_of(words: MotionWords) -> Plane:
    """The plane of an arc without a pole: that of the two axes that its words name, else X and Y."""
    named = frozenset(i for i in range(3) if words.axes >> i & 1)
    return PLANE_OF.get(named, PLANE_OF[frozenset((0, 1))])


def start_and_way(control: KlartextControl, where: FramePosition, plane: Plane) -> tuple[Point, Point]:
    """The start of a motion, and the way from it to the end, mm along the axes of a plane."""
    start, end = plane.of(here(control).inner), plane.of(where.inner)
    return start, (end[0] - start[0], end[1] - start[1])


def give_up(control: KlartextControl, step: Step, where: FramePosition) -> bool:
    """Refuse an arc whose start or end is not known; True if it was refused."""
    if not starts_unknown(control) and not where.unknown and not step.words.unknown:
        return False
    reasons = [why.format(LETTERS[i]) for i, why in {**control.unknown, **where.unknown}.items()]
    reason = reasons[0] if reasons else "a word of the arc depends on a Q parameter that is known only at run time"
    if step.words.unknown:
        axes = step.words.axes or 3
        where.unknown |= {i: reason for i in control.axis_indices if axes >> i & 1}
    do_without(control, step, where, reason)
    return True


def do_without(control: KlartextControl, step: Step, where: FramePosition, reason: str) -> None:
    """Refuse an arc, and stand at its end: the control would not accept it either, or its shape is not known.

    Before CT, CP and CTP the motion before must stay as it is, too: CT goes on in its direction.
    """
    about_pole = step.name in ("cp", "ctp")
    axes = polar_axes(control, step.words) if about_pole else step.words.axes or 3
    end = command_of(control, where, axes)
    if about_pole or step.name == "ct" or (step.words.unknown and not step.words.incremental):
        somewhere(control, axes, end, reason)
        return
    control.make(Motion(MotionKind.FEED, axes, end, 10, refusal=reason))
    control.path.tangent = None
