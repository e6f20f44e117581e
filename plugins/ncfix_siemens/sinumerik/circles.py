"""Arcs by G2, G3, CIP and CT: from the words of a block to an arc in machine axes.

A CT arc is tangential to the end of the motion before it.
"""

from __future__ import annotations

import math

from ncfix.control.arcs import ARC_FAULT, CLOCKWISE, Point, centre_from_radius, check_closure, sweep_angle
from ncfix.control.coordinates import CENTRE_LETTERS, Plane, dot
from ncfix.control.expressions import Fault
from ncfix.control.moves import Arc, MotionEnd, MotionKind
from ncfix_siemens.sinumerik.destination import NO_POLE, destination, doubtful_polar
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.vocabulary import ABSOLUTE, CT_LEFT, CT_RIGHT, BlockWordValues

NO_HEADING = "the direction at the end of the motion before this arc (CT) is not known"
TURNS_AT_RUNTIME = "the turns of the arc (CT) are known only at run time"
STRAIGHT = 1e-9
"""Sine of the angle between heading and chord below which a CT arc is a straight line."""


def tangential(control: Sinumerik, words: BlockWordValues) -> None:
    """Execute CT, the arc tangential to the last motion; TURN adds full turns."""
    control.use_all_start_positions()
    end, heading, plane = destination(control, words), control.heading, control.modal.plane
    why = TURNS_AT_RUNTIME if words.unknown("TURN") else ""
    if {"AP", "RP"} & words.values.keys():
        why = POLAR_ARC
    step = control.way_to(end.target)
    ahead = (0.0, 0.0) if heading is None else plane.of(heading)
    chord = plane.of(step)
    lost = end.unknown or control.unknown
    if why or lost or not math.hypot(*ahead):
        why = why or ("" if lost else NO_HEADING)  # an axis that is not known refuses it by itself
        circle = circle_of(control, plane, (1.0, 0.0), 0.0)._replace(fixed=True)
        control.go(MotionKind.ARC, words, end, CT_LEFT, refusal=why, arc=circle)
        return
    along = ahead[0] * chord[0] + ahead[1] * chord[1]
    left = ahead[0] * chord[1] - ahead[1] * chord[0]
    if abs(left) <= STRAIGHT * math.hypot(*ahead) * math.hypot(*chord):
        if along <= 0.0 and any(chord):
            raise Fault(
                ARC_FAULT,
                "the arc (CT) is not possible: its end is exactly opposite to the direction of the motion before it",
            )
        control.go(MotionKind.FEED, words, end, CT_LEFT)
        return
    away = (chord[0] ** 2 + chord[1] ** 2) / (2 * left)
    sweep = 2 * math.atan2(left, along)
    sweep += math.copysign(2 * math.pi * max(round(words.get("TURN")), 0), left)
    circle = circle_of(control, plane, (-ahead[1] * away, ahead[0] * away), sweep)
    control.go(MotionKind.ARC, words, end, CT_LEFT if left > 0 else CT_RIGHT, arc=circle)


CENTRE_AT_RUNTIME = "the centre of the arc is known only at run time"
VIA_AT_RUNTIME = "the intermediate point of the arc is known only at run time"
POLAR_ARC = "an arc (CT) in polar coordinates"
"""Its end is said in Cartesian coordinates (SINUMERIK ONE, NC Programming, 12/2019: CT)."""
POLAR_AND_CENTRE = "an arc about the pole (AP, RP) that also has a centre or radius"
DIAMETERS = "an absolute centre or intermediate point of an arc while X is a diameter ({})"
VIA = ("I1", "J1", "K1")
OF_ARCS = frozenset({*CENTRE_LETTERS, "CR", "AR", "TURN"})
OF_CIP = frozenset({*VIA, "TURN"})
NOT_TAKEN = "{} does not allow the word {}: the control would stop, or make a path that ncfix does not support"
TWICE = "{} defines the arc both by {} and by {}: which one the control uses is not certain"
ACROSS = (
    "{} gives a centre word normal to the plane ({}) and defines the arc by {}: which one the control uses is not "
    "certain"
)
NO_END = "CIP without an end point: two points do not define a circle"
FLAT = 1e-9
"""Relative area of the triangle of three points below which they are collinear."""

Triple = tuple[float, float, float]


def misled(control: Sinumerik, words: BlockWordValues, name: str, taken: frozenset[str]) -> str:
    """Why a motion is refused that has arc words it does not take, or contradictory ones; "" if it is not."""
    named = words.values.keys() & (OF_ARCS | OF_CIP | {"ANG"})
    if not named:
        return ""
    stray = sorted(named - taken)
    if stray:
        return NOT_TAKEN.format(name, stray[0])
    plane = control.modal.plane
    centre = sorted(set(plane.of(CENTRE_LETTERS)) & named)
    across = sorted(set(CENTRE_LETTERS) & named - set(centre))
    otherwise = sorted({"CR", "AR"} & named)
    if across and not centre and otherwise:
        return ACROSS.format(name, across[0], otherwise[0])
    ended = any(words.axes >> index & 1 for index in plane.pair)
    if "CR" in named and (centre or "AR" in named):
        return TWICE.format(name, "CR", (centre or ["AR"])[0])
    return (
        TWICE.format(name, "AR", "an end point in addition to its centre") if "AR" in named and centre and ended else ""
    )


def arc(control: Sinumerik, words: BlockWordValues, code: int) -> None:
    """Execute an arc, helix or full circle, given by centre, radius or opening angle."""
    control.use_all_start_positions()
    end = destination(control, words)
    doubtful = bool(end.unknown or control.unknown or words.unknown("I", "J", "K", "CR", "AR", "TURN"))
    clockwise, plane = code == CLOCKWISE, control.modal.plane
    refusal = refusal_of(words, plane) or doubtful_diameter(control, words, "I") or doubtful_polar(control, words)
    try:
        centre, end = geometry(control, words, end, clockwise=clockwise)
    except Fault:
        if not doubtful and not refusal:
            raise
        centre = (1.0, 0.0)
    step = control.way_to(end.target)
    finish = plane.of(step)
    sweep = sweep_angle(centre, finish, 1 + max(round(words.get("TURN")), 0), clockwise=clockwise)
    circle = circle_of(control, plane, centre, sweep)._replace(fixed=is_fixed(words, plane))
    control.go(MotionKind.ARC, words, end, code, refusal=refusal, arc=circle)


def is_fixed(words: BlockWordValues, plane: Plane) -> bool:
    """Whether the centre is given absolutely: by `AC`, or as the pole."""
    letters = plane.of(CENTRE_LETTERS)
    return bool({"AP", "RP"} & words.values.keys()) or any(words.forms.get(each) == ABSOLUTE for each in letters)


def refusal_of(words: BlockWordValues, plane: Plane) -> str:
    """Why an arc is refused: its words are unknown or not followed; "" if it is not refused."""
    letters = plane.of(CENTRE_LETTERS)
    if words.unknown(*letters, "CR", "AR", "TURN"):
        return CENTRE_AT_RUNTIME
    doubled = {"AP", "RP"} & words.values.keys() and {*letters, "CR", "AR"} & words.values.keys()
    return POLAR_AND_CENTRE if doubled else ""


def doubtful_diameter(control: Sinumerik, words: BlockWordValues, address: str) -> str:
    """Why an arc is refused whose absolute X word `address` may be a diameter; "" if it is not."""
    form = words.forms.get(address, "")
    absolute = form == ABSOLUTE or (address == "I1" and not form and not control.modal.incremental)
    counts = control.modal.diameter and absolute and address in words.values
    return DIAMETERS.format(address) if counts else ""


def geometry(control: Sinumerik, words: BlockWordValues, end: MotionEnd, *, clockwise: bool) -> tuple[Point, MotionEnd]:
    """Centre relative to the start in the plane, mm, and end of an arc; raises `Fault` if the control refuses it."""
    plane = control.modal.plane
    step = control.way_to(end.target)
    chord = plane.of(step)
    letters = plane.of(CENTRE_LETTERS)
    has_centre = any(letter in words.values for letter in letters)
    if {"AP", "RP"} & words.values.keys():
        if control.modes.pole is None:
            raise Fault(ARC_FAULT, NO_POLE)
        here = control.program_position()
        centre = control.modes.pole[0] - here[plane.first], control.modes.pole[1] - here[plane.second]
        check_closure(centre, chord, control.dialect.closure_mm, control.dialect.closure_relative)
        return centre, end
    if "CR" in words.values:
        return centre_from_radius(chord, control.stretch * words.get("CR"), clockwise=clockwise), end
    if "AR" in words.values and not has_centre:
        return centre_from_angle(chord, words.get("AR"), clockwise=clockwise), end
    if not has_centre:
        raise Fault(ARC_FAULT, "the arc has neither a centre (I J K) nor CR= nor AR=")
    centre = centre_words(control, words, plane)
    if "AR" in words.values:
        return centre, ended_by_angle(control, words, end, centre, clockwise=clockwise)
    check_closure(centre, chord, control.dialect.closure_mm, control.dialect.closure_relative)
    return centre, end


def centre_words(control: Sinumerik, words: BlockWordValues, plane: Plane) -> Point:
    """The centre relative to the start, mm, by I J K, which are incremental unless they have `AC`."""
    here = control.program_position()
    found = []
    for index in plane.pair:
        letter = CENTRE_LETTERS[index]
        value = control.stretch * words.get(letter)
        found.append(value - here[index] if words.forms.get(letter) == ABSOLUTE else value)
    return found[0], found[1]


def centre_from_angle(chord: Point, degrees: float, *, clockwise: bool) -> Point:
    """The centre of an arc given by its end and opening angle (AR)."""
    if not 0.0 < degrees < 360.0:
        raise Fault(ARC_FAULT, f"AR is {degrees:g}, but must be between 0 and 360 degrees")
    radius = math.hypot(*chord) / (2 * math.sin(math.radians(degrees) / 2))
    return centre_from_radius(chord, radius if degrees <= 180.0 else -radius, clockwise=clockwise)


def ended_by_angle(
    control: Sinumerik, words: BlockWordValues, end: MotionEnd, centre: Point, *, clockwise: bool
) -> MotionEnd:
    """The end of an arc given by its centre and opening angle."""
    plane = control.modal.plane
    angle = math.radians(words.get("AR")) * (-1.0 if clockwise else 1.0)
    cosine, sine = math.cos(angle), math.sin(angle)
    step = [0.0, 0.0, 0.0]
    step[plane.first] = centre[0] - centre[0] * cosine + centre[1] * sine
    step[plane.second] = centre[1] - centre[0] * sine - centre[1] * cosine
    whole = control.way_to(end.target)
    step[plane.across] = whole[plane.across]
    target = end.target[:]
    target[:3] = [here + dot(row, step) for here, row in zip(control.position, control.rotation, strict=False)]
    return MotionEnd(target, end.unknown, end.lost)


def circle_of(control: Sinumerik, plane: Plane, centre: Point, sweep: float) -> Arc:
    """The arc in machine axes; if an odd number of axes is mirrored, its normal is reversed."""
    circle = control.circle(plane, centre, sweep)
    if not control.is_rotated:
        return circle
    sense = control.handedness
    x, y, z = (sense * value for value in circle.normal)
    return circle._replace(normal=(x, y, z))


# -- by way of a point ------------------------------------------------------------------------------------------------


def through_point(control: Sinumerik, words: BlockWordValues, code: int) -> None:
    """Execute CIP, the circle through start, intermediate point I1 J1 K1 and end, in any plane."""
    control.use_all_start_positions()
    end = destination(control, words)
    why = VIA_AT_RUNTIME if words.unknown(*VIA, "TURN") else doubtful_diameter(control, words, "I1")
    if why:
        control.go(MotionKind.FEED, words, end, code, refusal=why)
        return
    if end.unknown or control.unknown:
        control.go(MotionKind.FEED, words, end, code, refusal="the start or end of the arc (CIP) is not known")
        return
    start, finish = tuple(control.position[:3]), tuple(end.target[:3])
    if not words.axes & 0b111 and not {"AP", "RP"} & words.values.keys():
        raise Fault(ARC_FAULT, NO_END)
    circle = circle_through(start, via_point(control, words), finish)  # type: ignore[arg-type]
    circle = circle._replace(sweep=circle.sweep + 2 * math.pi * max(round(words.get("TURN")), 0))
    control.go(MotionKind.ARC, words, end, code, arc=circle)


def via_point(control: Sinumerik, words: BlockWordValues) -> Triple:
    """The intermediate point in machine axes, mm."""
    program = control.program_position()
    for index, address in enumerate(VIA):
        if address not in words.values:
            continue
        value, form = control.stretch * words.get(address), words.forms.get(address, "")
        incremental = form == "ic" or (not form and control.modal.incremental)
        program[index] = value + (program[index] if incremental else 0.0)
    x, y, z = (dot(row, program) + control.offset[i] for i, row in enumerate(control.rotation))
    return x, y, z


def circle_through(start: Triple, via: Triple, end: Triple) -> Arc:
    """The circle through three points in that order; raises `Fault` if they are collinear."""
    u = [b - a for a, b in zip(start, via, strict=True)]
    v = [b - a for a, b in zip(start, end, strict=True)]
    normal = cross(u, v)
    size = math.sqrt(dot(normal, normal))
    if size <= FLAT * (dot(u, u) + dot(v, v)):
        raise Fault(ARC_FAULT, "start, intermediate point and end of the arc (CIP) are in line")
    uu, vv = dot(u, u), dot(v, v)
    arm = [(uu * b + vv * a) / (2 * size * size) for a, b in zip(cross(normal, u), cross(v, normal), strict=True)]
    unit = [part / size for part in normal]
    centre = [a + b for a, b in zip(start, arm, strict=True)]
    first, last = [-part for part in arm], [b - a for a, b in zip(arm, v, strict=True)]
    sweep = math.atan2(dot(unit, cross(first, last)), dot(first, last)) % (2 * math.pi)
    return Arc((centre[0], centre[1], centre[2]), (unit[0], unit[1], unit[2]), sweep)


def cross(a: list[float], b: list[float]) -> list[float]:
    """Vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
