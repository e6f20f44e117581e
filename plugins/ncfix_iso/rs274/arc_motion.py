"""G2 and G3: converts the words of a block to an arc in command coordinates."""

from __future__ import annotations

from ncfix.control.arcs import ARC_FAULT, CLOCKWISE, Point, centre_from_radius, check_closure, sweep_angle
from ncfix.control.coordinates import CENTRE_LETTERS, Plane
from ncfix.control.expressions import Fault
from ncfix.control.moves import Motion, MotionKind
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.motion import check_feed, destination
from ncfix_iso.rs274.parameters import whole

LATHE_PLANE = 180
"""G18, the plane in which lathes cut: Z and X."""

SPIRAL = "the arc has more turns than its end point gives (L, P, Q, or a centre word normal to its plane)"


def arc(control: RS274Control, block: Block, code: int) -> None:
    """Execute an arc, a helix or a full circle."""
    check_feed(control, block)
    control.modal.motion = code
    plane = control.modal.plane
    check_words(control, block, plane)
    control.use_start_positions(tuple(control.unknown))
    end = destination(control, block)
    step = control.way_to(end.target)
    point = plane.of(step)
    doubtful = bool(end.unknown or control.unknown or block.unknown or control.composed.unknown)
    clockwise = code == CLOCKWISE
    try:
        centre = centre_of(control, block, plane, point, clockwise=clockwise)
    except Fault as fault:
        if not doubtful:
            raise Fault(fault.code, fault.text, supposed(control, block, plane, point) or fault.hint) from None
        centre = (1.0, 0.0)
    turns = turns_of(block) if control.rules.strict else 1
    sweep = control.handedness * sweep_angle(centre, point, turns, clockwise=clockwise)
    refusal = refusal_of(block, plane) or ("" if control.rules.strict else spiral(block, plane))
    circle = control.circle(plane, centre, sweep)
    control.make(Motion(MotionKind.ARC, block.axes, end, code, refusal=refusal, arc=circle))


def turns_of(block: Block) -> int:
    """The P word: number of turns in which the arc reaches its end."""
    turns = whole(block.get("P", 1.0), "P, the number of turns")
    if turns < 1:
        raise Fault(ARC_FAULT, f"P, the number of turns, is {turns}, but must be 1 or more")
    return turns


def refusal_of(block: Block, plane: Plane) -> str:
    """Why an arc is refused if its centre is known only at run time; empty if it is known."""
    centre_words = set(plane.of(CENTRE_LETTERS)) | {"R"}
    if block.unknown & centre_words:
        return "the centre of the arc is known only at run time"
    return ""


def spiral(block: Block, plane: Plane) -> str:
    """Why an arc of ISO controls is refused: further words make it a spiral, a cone, or several turns; empty if not.

    With R, centre words have no effect; but L, P and Q would have one, once the corrected arc has its centre in words.
    """
    across = 0.0 if "R" in block.values else block.get(CENTRE_LETTERS[plane.across])
    winds = block.values.keys() & {"L", "Q"} or across or block.get("P", 1.0) != 1.0
    return SPIRAL if winds else ""


def check_words(control: RS274Control, block: Block, plane: Plane) -> None:
    """Raise `Fault` if the block lacks the words that an arc in its plane needs."""
    if plane.across > 2:
        raise Fault(ARC_FAULT, "arcs are not possible in the planes G17.1, G18.1 and G19.1")
    centre = [letter for letter in CENTRE_LETTERS if letter in block.values]
    if "R" in block.values:
        if centre and not control.rules.radius_first:
            raise Fault(ARC_FAULT, f"the arc has both R and {centre[0]}")
        if not block.axes & plane.axes:
            raise Fault(ARC_FAULT, "an arc given by R needs an end point in its plane")
        return
    if not centre:
        raise Fault(ARC_FAULT, "the arc has neither R nor a centre (I J K)")
    across = CENTRE_LETTERS[plane.across]
    if control.rules.strict and across in block.values:
        raise Fault(ARC_FAULT, f"{across} is not a centre word of the plane G{plane.code // 10}")
    wanted = plane.of(CENTRE_LETTERS)
    missing = [letter for letter in wanted if letter not in block.values]
    if control.modal.arc_absolute and missing:
        raise Fault(ARC_FAULT, f"with absolute centres (G90.1) the arc needs {missing[0]}")


def centre_of(control: RS274Control, block: Block, plane: Plane, end: Point, *, clockwise: bool) -> Point:
    """The centre relative to the start, mm; raises `Fault` if the control refuses the arc."""
    unit = control.modal.unit
    if "R" in block.values:
        return centre_from_radius(end, unit * block.values["R"], clockwise=clockwise)
    first, second = (unit * block.get(CENTRE_LETTERS[index]) for index in plane.pair)
    if control.modal.arc_absolute:
        here = control.program_position()
        first, second = first - here[plane.first], second - here[plane.second]
    check_closure((first, second), end, control.closure_mm, control.dialect.closure_relative)
    return first, second


def supposed(control: RS274Control, block: Block, plane: Plane, end: Point) -> str:
    """A guess at what an impossible arc was meant to be: in another plane, or with X as a diameter; else empty."""
    letters = plane.of(CENTRE_LETTERS)
    across = CENTRE_LETTERS[plane.across]
    if "R" not in block.values and across in block.values and not all(letter in block.values for letter in letters):
        return (
            f"{across} is a centre word of another plane than G{plane.code // 10}, which is in force (lathes use G18)"
        )
    if control.modal.diameter or plane.code != LATHE_PLANE or control.modal.arc_absolute:
        return ""
    try:
        centre_of(control, block, plane, (end[0], end[1] / 2), clockwise=True)
    except Fault:
        return ""
    return (
        "the arc would close if X were a diameter: check whether the program is for a lathe; ncfix reads X as a radius"
    )
