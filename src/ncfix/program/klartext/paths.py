"""The path functions: L, LN, LP, C, CR, CT, CP, CTP, corners, approach and departure.

Source: TNC 640, "Programming: contours". The sense of rotation counts in the program's frame; in a mirrored frame it
turns round, as on the control.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ncfix.program.klartext.control import RETRACTED, Control
from ncfix.program.klartext.posture import angles_for
from ncfix.program.klartext.targets import (
    BAD_POLE,
    PLANE_OF,
    Where,
    Words,
    command_of,
    destination,
    here,
    in_machine,
    led,
    polar,
    polar_axes,
    starts_unknown,
)
from ncfix.program.klartext.tilting import check_normal
from ncfix.program.klartext.transformations import unit
from ncfix.program.moves import Kind
from ncfix.program.rs274 import tcp
from ncfix.program.rs274.arcs import centre_from_radius, check_closure, sweep_angle
from ncfix.program.rs274.builder import Arc
from ncfix.program.rs274.control import Unknown
from ncfix.program.rs274.coordinates import IDENTITY, Plane, Vector, dot, rotated
from ncfix.program.rs274.faults import Fault

BAD_ARC = "NCF220"

CLOCKWISE, COUNTER = 20, 30
MACHINE_COORDINATES = "machine coordinates ({})"
NOT_GIVEN = "where the axis {} stands after M92 depends on a datum of the machine that is not given"
ORIENTED = "the control works out the rotary axes (TX TY TZ), and what it finds is not known"
TURNS_UNDER_TILT = "rotary axes are positioned in a tilted plane; the tip is corrected where it moves next"
MIXED_UNDER_TILT = "linear and rotary axes move together in a tilted plane"
OFF = "a rapid after a retract (M140)"
DEPARTURE = "where the axis {} stands after a departure (DEP) depends on the radius of the tool"
NO_TANGENT = "a tangential arc (CT), and the element before leaves no direction from which it can turn"
FLAT = 1e-9


@dataclass(frozen=True, slots=True)
class Step:
    """One motion block while it is executed.

    name    its path function
    words   its words
    flags   `fmax`, `dr+`, ...
    codes   its M codes
    """

    name: str
    words: Words
    flags: frozenset[str]
    codes: frozenset[int]

    @property
    def kind(self) -> Kind:
        """At FMAX a rapid."""
        return Kind.RAPID if "fmax" in self.flags else Kind.FEED


def straight(control: Control, step: Step) -> None:
    """L, LN, and blocks of words alone."""
    control.use()
    target, unknown = destination(control, step.words)
    if not {"TX", "TY", "TZ"} & step.words.values.keys():
        run(control, step, target, unknown, step.words.axes)
        return
    way = None if step.words.runtime else pointed(control, step.words)
    if way is None:
        refuse(control, ORIENTED)
        return
    control.points = True
    for index, angle in way.items():
        target[index] = angle
        unknown.pop(index, None)
    run(control, step, target, unknown, step.words.axes | sum(1 << index for index in way))


def pointed(control: Control, words: Words) -> dict[int, float] | None:
    """The rotary positions that point the tool along TX TY TZ, the nearest; None if that is not known."""
    vector = unit((words.values.get("TX", 0.0), words.values.get("TY", 0.0), words.values.get("TZ", 0.0)))
    if vector is None or not control.m128:
        return None
    x, y, z = (dot(row, vector) for row in control.rotation)
    ways = angles_for(control, (x, y, z))
    return ways[0] if ways else None


def straight_polar(control: Control, step: Step) -> None:
    """LP."""
    control.use()
    where, _ = polar(control, step.words)
    axes = polar_axes(control, step.words)
    target, unknown = command_of(control, where, axes)
    run(control, step, target, unknown, axes, follows=True)


def run(control: Control, step: Step, target: Vector, unknown: Unknown, axes: int, *, follows: bool = False) -> None:
    """A straight motion to a command."""
    turned = any(control.rotary[index] and axes >> index & 1 for index in control.machine)
    if turned and control.transformations.tilted and not control.m128:
        turn_under_tilt(control, step, target, unknown, axes)
        return
    if control.shortest:
        take_short_way(control, target, axes)
    before = control.position, control.unknown
    off = step.kind == Kind.RAPID and control.lost_to(RETRACTED, unknown)
    with_increments(control, follows or step.words.incremental)
    code = 0 if step.kind == Kind.RAPID else 10
    control.move(step.kind, axes, target, unknown, code, refusal=check_normal(control), passing=OFF if off else "")
    with_increments(control, False)
    keep_tangent(control, *before)


def with_increments(control: Control, on: bool) -> None:
    """Whether the words of the next motion count from where it begins."""
    control.modal.incremental = on


def keep_tangent(control: Control, start: Vector, unknown: Unknown) -> None:
    """Note in which direction a straight motion went; one without a way leaves the direction as it was."""
    if any(index in unknown or index in control.unknown for index in range(3) if index in control.machine):
        control.path.tangent = None
        return
    way = [b - a for a, b in zip(start[:3], control.position[:3], strict=True)]
    length = math.hypot(*way)
    if length > FLAT:
        control.path.tangent = (way[0] / length, way[1] / length, way[2] / length)


def take_short_way(control: Control, target: Vector, axes: int) -> None:
    """M126: rotary axes go the shorter way round; where one stands is said by a number that makes it so."""
    for index in control.machine:
        if control.rotary[index] and axes >> index & 1 and index not in control.unknown:
            turns = round((target[index] - control.position[index]) / (2 * math.pi))
            control.position[index] += 2 * math.pi * turns


def turn_under_tilt(control: Control, step: Step, target: Vector, unknown: Unknown, axes: int) -> None:
    """Rotary axes that move in a tilted plane without M128: X Y Z of the machine stand still, the tip does not."""
    linear = any(axes >> index & 1 for index in range(len(target)) if not control.rotary[index])
    tcp.switch(control, control.offsets.tool, False)
    control.refresh()
    for index in control.machine:
        if not control.rotary[index]:
            target[index] = control.position[index]
            unknown = {**{k: why for k, why in unknown.items() if k != index}, **own(control.unknown, index)}
    code = 0 if step.kind == Kind.RAPID else 10
    refusal, passing = (MIXED_UNDER_TILT, "") if linear else ("", TURNS_UNDER_TILT)
    control.move(step.kind, axes, target, unknown, code, refusal=refusal, passing=passing)
    if linear:
        control.lose(range(3), MIXED_UNDER_TILT + ": where {} stands is not known")
    control.switch_tip()
    control.path.tangent = None


def own(unknown: Unknown, index: int) -> Unknown:
    """The entry of one axis."""
    return {index: unknown[index]} if index in unknown else {}


def at_machine(control: Control, step: Step) -> None:
    """A motion in machine coordinates: M91, or M92."""
    target, unknown = in_machine(control, step.words)
    code = "M91" if 91 in step.codes else "M92"
    if code == "M92":
        unknown |= {i: NOT_GIVEN for i in control.machine if step.words.axes >> i & 1}
    was = control.tcp
    if was:
        tcp.switch(control, control.offsets.tool, False)
        control.refresh()
        target, unknown = in_machine(control, step.words)
    control.move(step.kind, step.words.axes, target, unknown, 0, passing=MACHINE_COORDINATES.format(code))
    if was:
        control.switch_tip()
    control.path.tangent = None


def refuse(control: Control, reason: str) -> None:
    """A motion that is not followed."""
    control.refuse_here(reason)


# -- arcs -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Circle:
    """An arc in its plane: centre and end from its start, mm along the plane's axes; signed sweep, rad."""

    plane: Plane
    centre: tuple[float, float]
    sweep: float


def circular(control: Control, step: Step) -> None:
    """C: about the pole to an end point."""
    pole = known_pole(control)
    plane, turning = control.path.plane, sense(step)
    control.use()
    where = led(control, step.words)
    if give_up(control, step, where):
        return
    start, end = points(control, where, plane)
    centre = pole[0] - start[0], pole[1] - start[1]
    away = end[0] - start[0], end[1] - start[1]
    try:
        check_closure(centre, away, control.dialect.closure_mm, control.dialect.closure_relative)
    except Fault as fault:
        do_without(control, step, where, fault.text)
        return
    swing(control, step, where, Circle(plane, centre, sweep_angle(centre, away, 1, clockwise=turning == CLOCKWISE)))


def circular_by_radius(control: Control, step: Step) -> None:
    """CR."""
    turning = sense(step)
    control.use()
    where = led(control, step.words)
    if "R" not in step.words.values:
        raise Fault(BAD_ARC, "CR needs R, the radius")
    if give_up(control, step, where):
        return
    plane = plane_of(control, step.words)
    start, end = points(control, where, plane)
    away = end[0] - start[0], end[1] - start[1]
    radius = control.modal.unit * step.words.values["R"]
    try:
        centre = centre_from_radius(away, radius, clockwise=turning == CLOCKWISE)
    except Fault as fault:
        do_without(control, step, where, fault.text)
        return
    swing(control, step, where, Circle(plane, centre, sweep_angle(centre, away, 1, clockwise=turning == CLOCKWISE)))


def circular_polar(control: Control, step: Step) -> None:
    """CP: about the pole to a polar angle; several turns, and a height, make a helix."""
    pole = known_pole(control)
    plane, turning = control.path.plane, sense(step)
    control.use()
    where, angle = polar(
        control, Words({k: v for k, v in step.words.values.items() if k not in ("PR", "IPR")}, step.words.runtime)
    )
    if give_up(control, step, where):
        return
    start, end = points(control, where, plane)
    centre = pole[0] - start[0], pole[1] - start[1]
    if math.hypot(*centre) < FLAT:
        raise Fault(BAD_ARC, "the arc has no radius: the tool stands at the pole")
    if angle is None:
        away = end[0] - start[0], end[1] - start[1]
        angle = sweep_angle(centre, away, 1, clockwise=turning == CLOCKWISE)
    elif (angle < 0) != (turning == CLOCKWISE) and angle:
        raise Fault(BAD_ARC, "the sign of IPA and DR contradict each other")
    swing(control, step, where, Circle(plane, centre, angle))


def tangential(control: Control, step: Step) -> None:
    """CT and CTP: an arc that goes on in the direction of the element before."""
    control.use()
    where = polar(control, step.words)[0] if step.name == "ctp" else led(control, step.words)
    if give_up(control, step, where):
        return
    if control.path.tangent is None:
        do_without(control, step, where, NO_TANGENT)
        return
    plane = control.path.plane if step.name == "ctp" else plane_of(control, step.words)
    ahead = [dot(row, control.path.tangent) for row in control.inverse] if control.is_rotated else control.path.tangent
    start, end = points(control, where, plane)
    away = end[0] - start[0], end[1] - start[1]
    left = -ahead[plane.second], ahead[plane.first]
    side = away[0] * left[0] + away[1] * left[1]
    size = math.hypot(*left)
    if size < FLAT or abs(side) < FLAT * math.hypot(*away):
        do_without(control, step, where, NO_TANGENT)
        return
    radius = (away[0] ** 2 + away[1] ** 2) * size / (2 * side)
    centre = radius * left[0] / size, radius * left[1] / size
    swing(control, step, where, Circle(plane, centre, sweep_angle(centre, away, 1, clockwise=radius < 0)))


def swing(control: Control, step: Step, where: Where, circle: Circle) -> None:
    """The arc itself."""
    plane = circle.plane
    axes = step.words.axes | 1 << plane.first | 1 << plane.second
    target, unknown = command_of(control, where, axes)
    local = [0.0, 0.0, 0.0]
    local[plane.first], local[plane.second] = circle.centre
    outward = rotated(control.rotation, local) if control.is_rotated else local
    hand = mirrored(control)
    centre = tuple(p + o for p, o in zip(control.position[:3], outward, strict=True))
    normal = tuple(dot(row, IDENTITY[plane.across]) for row in control.rotation)
    sweep = hand * circle.sweep
    relative = step.name in ("ct", "ctp", "cp") or step.words.incremental
    with_increments(control, relative)
    arc = Arc(centre, normal, sweep)  # type: ignore[arg-type]
    control.move(Kind.ARC, axes, target, unknown, CLOCKWISE if circle.sweep < 0 else COUNTER, arc=arc)
    with_increments(control, False)
    control.path.tangent = direction_at_end(control.position, arc)


def direction_at_end(end: Vector, arc: Arc) -> tuple[float, float, float]:
    """The unit tangent of an arc at its end."""
    x, y, z = (a - b for a, b in zip(end[:3], arc.centre, strict=True))
    a, b, c = arc.normal
    sign = 1.0 if arc.sweep > 0 else -1.0
    way = sign * (b * z - c * y), sign * (c * x - a * z), sign * (a * y - b * x)
    length = math.hypot(*way)
    return way[0] / length, way[1] / length, way[2] / length


def mirrored(control: Control) -> float:
    """-1 where the frame is mirrored: what turns left in the program turns right in the workpiece."""
    return -1.0 if len(control.transformations.mirror) % 2 else 1.0


def sense(step: Step) -> int:
    """DR+ or DR-."""
    if "dr-" in step.flags:
        return CLOCKWISE
    if "dr+" in step.flags:
        return COUNTER
    raise Fault(BAD_ARC, f"{step.name.upper()} needs DR+ or DR-, the sense of rotation")


def known_pole(control: Control) -> tuple[float, float]:
    """The pole."""
    if control.path.pole is None:
        raise Fault(BAD_POLE, "an arc about the pole, and no pole (CC) is known")
    return control.path.pole


def plane_of(control: Control, words: Words) -> Plane:
    """The plane of an arc that has no pole: that of its words, else the working plane."""
    named = frozenset(i for i in range(3) if words.axes >> i & 1)
    return PLANE_OF.get(named, PLANE_OF[frozenset((0, 1))])


def points(control: Control, where: Where, plane: Plane) -> tuple[tuple[float, float], tuple[float, float]]:
    """Start and end of a motion along the axes of a plane."""
    start, end = here(control).inner, where.inner
    return (start[plane.first], start[plane.second]), (end[plane.first], end[plane.second])


def give_up(control: Control, step: Step, where: Where) -> bool:
    """Refuse an arc of which an end is not known; True if that is so."""
    if not starts_unknown(control) and not where.unknown and not step.words.runtime:
        return False
    reasons = [why.format("XYZABCUVW"[i]) for i, why in {**control.unknown, **where.unknown}.items()]
    reason = reasons[0] if reasons else "a word of the arc depends on a Q parameter that is known only at run time"
    if step.words.runtime:
        axes = step.words.axes or 3
        where.unknown |= {i: reason for i in control.machine if axes >> i & 1}
    do_without(control, step, where, reason)
    return True


def do_without(control: Control, step: Step, where: Where, reason: str) -> None:
    """An arc that is not followed but for its end: one that the control would not accept either, or one not known."""
    axes = step.words.axes or 3
    target, unknown = command_of(control, where, axes)
    control.move(Kind.FEED, axes, target, unknown, 10, refusal=reason)
    control.path.tangent = None


# -- approach and departure -------------------------------------------------------------------------------------------


def approach(control: Control, step: Step) -> None:
    """APPR: to the first point of the contour, which its words give; the control makes the way there."""
    control.use()
    where = polar(control, step.words)[0] if " p" in step.name else led(control, step.words)
    axes = polar_axes(control, step.words) if " p" in step.name else step.words.axes
    target, unknown = command_of(control, where, axes)
    control.path.corner = True
    with_increments(control, step.words.incremental or " p" in step.name)
    control.move(Kind.FEED, axes, target, unknown, 10)
    with_increments(control, False)
    control.path.tangent = None


def departure(control: Control, step: Step) -> None:
    """DEP: with an end point of its own (LCT) it is corrected there; else it is what the contour before makes of it."""
    if step.name.endswith("lct"):
        approach(control, step)
        return
    tangent, control.path.tangent = control.path.tangent, None
    plane = control.path.plane
    lost: Unknown = {i: DEPARTURE for i in (plane.first, plane.second) if i in control.machine}
    target = control.position[:]
    if step.name == "dep lt" and tangent is not None and "LEN" in step.words.values and not step.words.runtime:
        length = control.modal.unit * step.words.values["LEN"]
        target[:3] = [a + length * b for a, b in zip(target[:3], tangent, strict=True)]
        lost = {}
    axes = 1 << plane.first | 1 << plane.second
    control.move(Kind.FEED, axes, target, {**control.unknown, **lost}, 10, passing="departure from the contour (DEP)")


PATHS = {
    "": straight,
    "l": straight,
    "ln": straight,
    "lp": straight_polar,
    "c": circular,
    "cr": circular_by_radius,
    "cp": circular_polar,
    "ct": tangential,
    "ctp": tangential,
}
"""Path functions by name."""
