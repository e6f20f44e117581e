"""Execution of cycles: drilling, milling, measuring and patterns of holes, single or modal (MCALL).

A hole is followed as one motion to its bottom, as in all languages: a motion under MCALL ends in a hole, and is no
rapid. The place of a hole is corrected for its bottom, in the block that leads to it. The depth is an argument of the
call, so a hole with a corrected depth gets a call of its own.
Source: Siemens, "SINUMERIK, cycles": CYCLE81 to CYCLE89, CYCLE840 (RTP, RFP, SDIS, DP, DPR).

Patterns are holes in a row (HOLES1), on a circle (HOLES2) and at listed places (CYCLE802), under a modal cycle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ncfix.control.coordinates import LETTERS, mask_of, rotated
from ncfix.control.expressions import number
from ncfix.control.moves import CycleCall, MotionEnd, MotionKind, Pass, Passing
from ncfix_siemens.sinumerik.cycles.milling import (
    ALIKE,
    MILLING,
    OTHER_PLANE,
    PLANES,
    TWO_DEPTHS,
    digit,
    milling_of,
    said_in,
)
from ncfix_siemens.sinumerik.framing import mind_carried, take_up
from ncfix_siemens.sinumerik.plans import Calling
from ncfix_siemens.sinumerik.state import GEOMETRY, Sinumerik
from ncfix_siemens.sinumerik.vocabulary import (
    CALIBRATING,
    DEEP,
    DP,
    DPR,
    DRILLING,
    FIRST_DEPTH,
    MEASURING,
    BlockWordValues,
    Drilling,
)

Points = tuple[tuple[float, float], ...]
"""Places in the plane, in program units."""

ARGUMENTS = 6
"""Smallest number of arguments of a pattern."""
MAX_HOLES = 1000
WRITE_OUT = "holes whose positions the control calculates ({}): with --flatten ncfix writes them out"
AFTER_PATTERN = "the position of the axis {} after a pattern of holes is not known"


def row(values: Sequence[float | None]) -> Points:
    """The places of HOLES1."""
    x, y, angle, first, step, count = (value or 0.0 for value in values)
    ways = (first + step * k for k in range(round(count)))
    turn = math.radians(angle)
    return tuple((x + way * math.cos(turn), y + way * math.sin(turn)) for way in ways)


def circle(values: Sequence[float | None]) -> Points:
    """The places of HOLES2; an indexing angle of zero divides the circle evenly."""
    x, y, radius, angle, step, count = (value or 0.0 for value in values)
    step = step or 360.0 / max(count, 1.0)
    turns = (math.radians(angle + step * k) for k in range(round(count)))
    return tuple((x + radius * math.cos(turn), y + radius * math.sin(turn)) for turn in turns)


def listed(values: Sequence[float | None]) -> Points:
    """The places of CYCLE802, up to nine; the first two arguments have a digit for each: 1 if it is absolute."""
    across, along, *places = values
    known = [value for value in places if value is not None]
    absolute = all(mode is not None and {*f"{mode:.0f}"} == {"1"} for mode in (across, along))
    if not absolute or places[: len(known)] != known or len(known) % 2:
        return ()
    return tuple(zip(known[::2], known[1::2], strict=True))


PATTERNS = {"holes1": (6, row), "holes2": (6, circle), "cycle802": (20, listed)}
"""Cycle -> number of its arguments of position, and the function that evaluates them."""
SAYS_IT_AGAIN = {True: 2000.0, False: 1000.0}
"""VARI of HOLES2 for a partial circle (True) and a full circle (False), which repeats what its angle tells."""


def points_of(control: Sinumerik, step: Calling) -> Points:
    """The places of a pattern in the order of drilling; empty if the pattern cannot be followed.

    After the arguments of position follow VARI (not in CYCLE802), UMODE, HIDE and NSP, which affect the order or skip
    places, and DMODE, whose last digit may select a plane. G0 must be in force, as it is after the holes are written
    out.
    """
    modal, (count, places) = control.modal, PATTERNS.get(step.name, (0, row))
    plain = modal.motion == 0 and not (modal.incremental or modal.diameter) and control.modes.modal_cycle is not None
    said, sure = said_in(control, step)
    values = [value for value in said[:count] if not isinstance(value, str)]
    if not (count and plain and sure) or not ARGUMENTS <= len(said) == len(values) + len(said[count:]):
        return ()
    others = [*said[count:], *[None] * 5]
    others = others[: 4 if places is listed else 5]
    if places is circle and others[0] == SAYS_IT_AGAIN[bool(values[4])]:
        others[0] = None
    *hiding, mode = others
    chosen = digit_of((mode,), 0)
    if any(hiding) or (chosen and PLANES.get(chosen) != modal.plane.across):
        return ()
    if places is not listed and not 1 <= (values[ARGUMENTS - 1] or 0.0) <= MAX_HOLES:
        return ()
    points = places([*values, *[None] * (count - len(values))])
    control.budget.spend(len(points))
    return points[::-1] if places is row and is_nearer(control, points[-1], points[0]) else points


def is_nearer(control: Sinumerik, last: tuple[float, float], first: tuple[float, float]) -> bool:
    """Whether the axes are nearer to the last place than to the first."""
    plane = control.modal.plane
    if any(control.lost_in_frame().get(index, AFTER_PATTERN) != AFTER_PATTERN for index in plane.pair):
        return False
    here = [control.program_position()[index] / control.stretch for index in plane.pair]
    return math.dist(here, last) < math.dist(here, first)


def lead_to(
    control: Sinumerik, block: int, point: tuple[float, float], name: str
) -> tuple[BlockWordValues, MotionEnd, str]:
    """The words and the end of a motion to a place, and the reason why its hole is not corrected."""
    plane, program, lost = control.modal.plane, control.program_position(), dict(control.lost_in_frame())
    axes = plane.axes
    for index, value in zip(plane.pair, point, strict=True):
        program[index] = control.stretch * value
        lost.pop(index, None)
    end = MotionEnd(control.command(program, axes), control.axes_of(lost), lost)
    return BlockWordValues(block, axes=axes), end, WRITE_OUT.format(name)


POCKETS = frozenset({"cycle63", "cycle64"})
"""Cycles that use the contours named by CYCLE62."""

MADE = "motions that the control generates ({})"
MADE_HOLES = "holes whose positions the control calculates ({})"
HEIGHTS = "the planes and the depth of the cycle {} are known only at run time"
BY_DIAMETER = "a diameter gives the depth of {} (_GMODE)"
TO_A_HOLE = "a hole under MCALL without G0 or G1 in force, or in machine coordinates"
WITH_WORDS = "a drilling cycle and axis words in one block"
ELSEWHERE = "this hole needs a depth of its own, but its cycle is called in another file"
ALONE = "this hole needs a line of its own, but REPEAT would not execute it"
UNDER_ANOTHER = "this hole needs a line of its own, but the modal cycle in force would drill after that line"
UNSTATED = "this hole needs a line of its own, but the motion code in force is not known"
MEASURES = (
    "{} measures and may set a work offset at run time; motions are refused until the program selects a work offset "
    "(G54, ...)"
)
AFTER_CYCLE = "the position of the axis {} after a cycle is not known"

CENTRING, GEOMETRY_MODE = "cycle81", 6
"""The cycle whose depth may be given by a diameter, and the index of the argument that tells (_GMODE)."""

PLANE_AT = {"cycle81": 7, "cycle82": 7, "cycle83": 18, "cycle85": 9, "cycle86": 12}
"""Drilling cycle -> index of its argument DMODE, whose last digit may select a plane."""
AXIS_AT = {"cycle83": 12, "cycle84": 12, "cycle840": 11}
"""Drilling cycle -> index of its argument AXN; values 1 and 2 select a drilling axis in the plane."""
OTHER_AXIS = "{} drills along an axis of the plane in force (AXN)"


def drilling_of(control: Sinumerik, step: Calling) -> Drilling:
    """The call of a drilling cycle, evaluated from the arguments RTP, RFP, SDIS, DP, DPR."""
    values = tuple(value(control) for value in step.arguments)
    given = [(part is not None, number(value)) for part, value in zip(step.written, values, strict=True)]
    (_, clear), (_, reference), _, (is_deep, deep), (is_way, way) = (given + [(False, None)] * 5)[:5]
    name, depth, fault = step.name.upper(), deep if is_deep else None, ""
    if is_way and way and clear is not None and reference is not None:
        down = reference - way if clear >= reference else reference + way
        fault = TWO_DEPTHS.format(name) if is_deep and (deep is None or abs(deep - down) > ALIKE) else ""
        depth = down
    elif is_way and way is None:
        depth = None
    if clear is None or depth is None:
        fault = fault or HEIGHTS.format(name)
    mode = given[GEOMETRY_MODE][1] if len(given) > GEOMETRY_MODE else None
    if step.name == CENTRING and mode:
        fault = BY_DIAMETER.format(name)
    said, sure = said_in(control, step)
    chosen, axis = (digit_of(said, places.get(step.name)) for places in (PLANE_AT, AXIS_AT))
    if chosen and PLANES.get(chosen) != control.modal.plane.across:
        fault = OTHER_PLANE.format(name)
    elif axis in (1, 2):
        fault = OTHER_AXIS.format(name)
    first, first_way = FIRST_DEPTH if step.name == DEEP else (DP, DPR)
    heights = [(place, 1) for place in sorted({DP, first}) if said[place:] and said[place] is not None]
    ways = [(place, -1) for place in sorted({DPR, first_way}) if said[place:] and said[place] not in (None, 0.0)]
    depths = tuple(sorted(heights + ways))
    return Drilling(step.name, clear, depth, fault, said, sure, control.external, depths)


def digit_of(said: Sequence[float | str | None], place: int | None) -> int:
    """The last digit of an argument; zero if it is not given."""
    value = said[place] if place is not None and place < len(said) else None
    return digit(value) if isinstance(value, float) else 0


def call_of(control: Sinumerik, drilling: Drilling, block: int, *, modal: bool) -> CycleCall:
    """The cycle call of a hole, for the writer."""
    fixed = ALONE if block in control.solitary else ""
    if modal and drilling.external != control.external:
        fixed = fixed or ELSEWHERE
    if not modal:
        fixed = fixed or (UNDER_ANOTHER if control.modes.modal_cycle is not None else "")
        fixed = fixed or ("" if control.stated else UNSTATED)
    plane, name = control.modal.plane, drilling.name.upper()
    points = tuple((place, plane.of(LETTERS)[axis]) for place, axis in drilling.points)
    led = plane.of(LETTERS) if drilling.name in MILLING and MILLING[drilling.name].named else ()
    across, bound = LETTERS[plane.across], not (drilling.sure or points or led)
    return CycleCall(name, drilling.values, drilling.depths, across, modal, fixed, bound, points, led)


def cycle(control: Sinumerik, words: BlockWordValues, step: Calling, *, modal: bool) -> None:
    """Execute a cycle of the control, or keep it as the modal one (MCALL)."""
    name, block = step.name.upper(), words.block
    if step.name not in DRILLING and step.name not in MILLING:
        if points := points_of(control, step):
            pattern(control, block, name, points)
            return
        if MEASURING.fullmatch(step.name):
            measure(control, block, step)
            return
        control.milled |= step.name in POCKETS
        holes = step.name.startswith(("holes", "cycle80"))
        made(control, block, refusal=(MADE_HOLES if holes else MADE).format(name))
        return
    drilling = milling_of(control, step, modal=modal) if step.name in MILLING else drilling_of(control, step)
    if modal:
        control.modes.modal_cycle = drilling
        return
    take_up(control)
    mind_carried(control)
    control.use_all_start_positions()
    named, over = BlockWordValues(block), control.here()
    if drilling.place is not None:
        named, over, _ = lead_to(control, block, drilling.place, name)
        control.builder.rests(mask_of(index for index in control.axis_indices if index not in GEOMETRY))
    drill(control, named, over, drilling, refusal=WITH_WORDS if words.axes else "")


def pattern(control: Sinumerik, block: int, name: str, points: Points) -> None:
    """Execute the modal cycle at each place of a pattern; the position in the plane is unknown afterwards."""
    drilling, plane = control.modes.modal_cycle, control.modal.plane
    assert drilling is not None
    control.pattern = points
    for point in points:
        words, over, refusal = lead_to(control, block, point, name)
        drill(control, words, over, drilling, refusal=refusal, modal=True)
    lost = control.lost_in_frame() | dict.fromkeys(plane.pair, AFTER_PATTERN)
    control.stand(control.position, control.axes_of(lost), lost)


def hole_after(control: Sinumerik, words: BlockWordValues) -> None:
    """Execute the modal cycle after a motion that does not lead to a hole, as a refused hole at its end."""
    drilling = control.modes.modal_cycle
    assert drilling is not None
    drill(control, BlockWordValues(words.block), control.here(), drilling, refusal=TO_A_HOLE, modal=True)


def drill(
    control: Sinumerik,
    words: BlockWordValues,
    over: MotionEnd,
    drilling: Drilling,
    *,
    refusal: str = "",
    modal: bool = False,
) -> None:
    """Add one hole: the motion over its place, down to its depth, and the retraction.

    over     the end of the motion by the words
    refusal  why the hole is refused
    modal    the cycle is modal and the words lead to the hole; else it is called where the axes stand
    """
    across, stated = control.modal.plane.across, words.axes
    if drilling.fault:
        refusal = refusal or drilling.fault
    depth, clear = drilling.depth, drilling.clear
    bottom = over if depth is None else at_height(control, over, depth)
    counted = mask_of(control.counted_words(words))
    placed = (stated & ~counted) | (1 << across if depth is not None else 0)
    control.builder.called(call_of(control, drilling, words.block, modal=modal))
    code = control.modal.motion
    control.go(MotionKind.CYCLE, words, bottom, code if code >= 0 else 10, refusal=refusal, placed=placed)
    control.heading = None
    lost = control.lost_in_frame()
    if drilling.name in MILLING:
        lost = lost | dict.fromkeys(control.modal.plane.pair, AFTER_CYCLE)
        if not refusal and not MILLING[drilling.name].named:
            control.moved_as_a_whole(drilling.name.upper())
    if clear is None or depth is None:
        up = control.here(lost | {across: AFTER_CYCLE})
    else:
        up = at_height(control, control.here(lost), clear)
        control.count_from_here(1 << across)
    control.stand(up.target, up.unknown, up.lost)


def at_height(control: Sinumerik, over: MotionEnd, height: float) -> MotionEnd:
    """The position of `over` with another height along the tool, in program units."""
    across = control.modal.plane.across
    inner = [value - offset for value, offset in zip(over.target, control.offset, strict=True)]
    program = rotated(control.inverse, inner) if control.is_rotated else inner
    program[across] = control.scale[across] * height
    back = rotated(control.rotation, program) if control.is_rotated else program
    mixed = [index for index in GEOMETRY if index == across or control.rotation[index][across] != 0.0]
    target = over.target[:]
    for index in mixed:
        target[index] = back[index] + control.offset[index]
    lost = {index: why for index, why in over.lost.items() if index != across}
    return MotionEnd(target, control.axes_of(lost), lost)


def measure(control: Sinumerik, block: int, step: Calling) -> None:
    """Execute a measuring cycle, which may set the work offset unless its argument 2 (S_KNUM) is zero or absent."""
    name = step.name.upper()
    made(control, block, passing=Passing(Pass.PROBING, f"measuring ({name})"))
    if len(step.arguments) > 1:
        sets = number(step.arguments[1](control)) if step.written[1] is not None else 0.0
    else:
        sets = number(control.variables.value("_knum"))
    if sets != 0.0 and step.name not in CALIBRATING:
        control.suspend("measured", MEASURES.format(name), followed=True)


def made(control: Sinumerik, block: int, *, refusal: str = "", passing: Passing | None = None) -> None:
    """Add motions that the control generates; the position of X, Y and Z is unknown afterwards."""
    gone = [index for index in GEOMETRY if index in control.axis_indices]
    lost = dict(control.lost_in_frame()) | dict.fromkeys(gone, AFTER_CYCLE)
    words = BlockWordValues(block, axes=mask_of(gone))
    control.go(MotionKind.RAPID, words, control.here(lost), control.modal.motion, refusal=refusal, passing=passing)
