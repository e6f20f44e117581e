"""Where the words of a block lead: absolute and incremental, Cartesian and polar words; and how far that is known.

A position along the axes of the program's frame (mm and rad) is called inner; a command to the machine is called outer.
An axis of the frame is known if all machine axes on which it depends are known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

from ncfix.control.control import UNPLACED
from ncfix.control.coordinates import DEGREE, INDEX, LETTERS, PLANES, Vector, X, Y, Z, mask_of
from ncfix.control.expressions import Fault
from ncfix.control.moves import AT_START, MotionEnd, UnknownAxes
from ncfix.values import frozen, mutable
from ncfix_heidenhain.klartext.control import SPATIAL, KlartextControl
from ncfix_heidenhain.klartext.plans import MOVING

BAD_POLE = "NCF271"
POLE_MOVED = "the end position of the axis {} from a pole (CC) that was set before the datum was shifted is not certain"
COUNTED_FROM = "the position of the axis {} after incremental words with M91 depends on the control"
RUNTIME = "the position of the axis {} depends on a Q parameter that is known only at run time"
PLANE_OF = {frozenset((X, Y)): PLANES[170], frozenset((Z, X)): PLANES[180], frozenset((Y, Z)): PLANES[190]}
"""Set of two axes -> their plane; polar angles count from its first axis (X, Z, Y) towards its second."""


@frozen
class MotionWords:
    """The words of one motion as numbers.

    values   address -> value, in program units
    unknown  addresses whose value is known only at run time
    """

    values: Mapping[str, float]
    unknown: frozenset[str]

    @property
    def axes(self) -> int:
        """Bit mask of the axes that have a word of their own; `polar_axes` adds those that polar words move."""
        return _said(tuple(self.values))[0]

    @property
    def incremental(self) -> bool:
        """Whether any word is incremental."""
        return _said(tuple(self.values))[1]

    @property
    def letters(self) -> tuple[str, ...]:
        """The letters of the axes that have a word."""
        return _said(tuple(self.values))[2]


@lru_cache(maxsize=1024)
def _said(addresses: tuple[str, ...]) -> tuple[int, bool, tuple[str, ...]]:
    """`axes`, `incremental` and `letters` of `MotionWords` with these addresses."""
    letters = tuple(letter for address in addresses if (letter := address.removeprefix("I")) in INDEX)
    return mask_of({INDEX[letter] for letter in letters}), any(address[0] == "I" for address in addresses), letters


@mutable
class FramePosition:
    """A position along the axes of the program's frame.

    inner    the position, mm and rad
    unknown  axis -> why its position is not known
    """

    inner: Vector
    unknown: UnknownAxes


def here(control: KlartextControl) -> FramePosition:
    """The present position of the control in the program's frame."""
    return FramePosition(control.program_position(), dict(control.lost_in_frame()))


def destination(control: KlartextControl, words: MotionWords) -> MotionEnd:
    """The end of a motion with Cartesian words, as a command."""
    return command_of(control, programmed_position(control, words), words.axes)


def programmed_position(control: KlartextControl, words: MotionWords) -> FramePosition:
    """The position in the program's frame to which the words of axes lead."""
    if words.incremental:
        counted = [INDEX[address[1:]] for address in words.values if address[0] == "I" and address[1:] in INDEX]
        control.use_start_positions(list(control.axis_indices) if control.is_rotated else counted)
    where = here(control)
    for address, value in words.values.items():
        letter = address.removeprefix("I")
        index = INDEX.get(letter)
        if index is None:
            continue
        if address[0] != "I":
            where.inner[index] = 0.0
            where.unknown.pop(index, None)
            if index in control.composed.unknown:
                where.unknown[index] = control.composed.unknown[index]
        where.inner[index] += control.scale[index] * value
        if address in words.unknown:
            where.unknown[index] = RUNTIME
    if control.path.spatial and {"A", "B", "C"} & {address.removeprefix("I") for address in words.values}:
        where.unknown |= dict.fromkeys(control.turning, SPATIAL)
    return where


def derived(control: KlartextControl, words: MotionWords, axes: int) -> str:
    """Why a motion cannot be rewritten with words for all of `axes`: no word says where some axis stands. Else empty.

    TX TY TZ say where the rotary axes go. Incremental polar words, and arcs whose end has only one word, count from a
    place that the program may not have stated.
    """
    if not control.places.unplaced:
        return ""
    own = words.axes
    if {"PR", "PA"} <= words.values.keys():
        own |= polar_axes(control, words)
    if words.values.keys() & {"TX", "TY", "TZ"}:
        own |= mask_of(control.turning)
    index = next((i for i in control.axis_indices if (axes & ~own & control.places.unplaced) >> i & 1), None)
    return "" if index is None else UNPLACED.format(LETTERS[index])


def command_of(control: KlartextControl, where: FramePosition, axes: int) -> MotionEnd:
    """A position in the program's frame as a command; axes that are not in `axes` stay exactly where they are."""
    return MotionEnd(control.command(where.inner, axes), control.axes_of(where.unknown), where.unknown)


def in_machine(control: KlartextControl, words: MotionWords) -> tuple[dict[int, float], UnknownAxes]:
    """Axis -> where words in machine coordinates (M91, M92) lead it; axis -> why that is not known.

    Incremental words count from the last position in machine coordinates, if there is one: that is not known.
    """
    axes, unsure = dict[int, float](), dict[int, str]()
    for address, value in words.values.items():
        index = INDEX.get(address.removeprefix("I"))
        if index is not None:
            axes[index] = value * (DEGREE if control.rotary[index] else control.modal.unit)
            if address[0] == "I":
                unsure[index] = COUNTED_FROM
            elif address in words.unknown:
                unsure[index] = RUNTIME
    return axes, unsure


# -- poles ------------------------------------------------------------------------------------------------------------


def set_pole(control: KlartextControl, words: MotionWords) -> None:
    """CC: set the pole. A coordinate that CC leaves out stays; CC alone takes both from where the tool stands."""
    path = control.path
    named = frozenset(
        INDEX[address.removeprefix("I")] for address in words.values if address.removeprefix("I") in "XYZ"
    )
    plane = PLANE_OF.get(named, path.plane) if len(named) == 2 else path.plane
    others = words.values.keys() & (MOVING - {f"{sign}{letter}" for sign in ("", "I") for letter in "XYZ"})
    if others or any(index not in plane.pair for index in named) or len(named) > 2:
        raise Fault(BAD_POLE, "CC needs the two axes of one plane")
    where = programmed_position(control, words)
    old = {} if path.pole is None else {path.plane.first: path.pole[0], path.plane.second: path.pole[1]}
    keep = {} if not named else old
    values = [keep.get(i, where.inner[i]) if i not in named else where.inner[i] for i in plane.pair]
    lost = [
        i
        for i in plane.pair
        if (i in where.unknown and (i in named or i not in keep)) or (named and i not in named and i not in keep)
    ]
    path.plane, path.pole = plane, None if lost else (values[0], values[1])
    path.pole_in = pole_frame(control)


def pole_frame(control: KlartextControl) -> object:
    """What determines where the numbers of a pole are: datum along the axes of its plane, rotation, unit."""
    plane = control.path.plane
    return plane.of(control.offset), control.rotation, control.stretch


def polar(control: KlartextControl, words: MotionWords) -> tuple[FramePosition, float | None]:
    """The position to which polar words lead, and the angle IPA, rad; None without IPA."""
    path = control.path
    if path.pole is None:
        raise Fault(BAD_POLE, "polar coordinates, but no pole (CC) is known")
    plane, (first, second) = path.plane, path.pole
    control.use_start_positions(plane.pair)
    start = here(control)
    where = programmed_position(control, words)
    away = start.inner[plane.first] - first, start.inner[plane.second] - second
    radius, angle = arm(words.values, away, control.stretch)
    where.inner[plane.first] = first + radius * math.cos(angle)
    where.inner[plane.second] = second + radius * math.sin(angle)
    why = doubt(control, words, start)
    for index in plane.pair:
        where.unknown.pop(index, None)
        if why:
            where.unknown[index] = why
    step = words.values.get("IPA")
    return where, None if step is None else step * DEGREE


def arm(values: Mapping[str, float], away: tuple[float, float], unit: float) -> tuple[float, float]:
    """Distance from the pole, mm, and angle, rad, to which polar words lead.

    away  the way from the pole to the start, mm
    unit  mm per program unit
    """
    radius, angle = math.hypot(*away), math.atan2(away[1], away[0])
    if "PR" in values:
        radius = unit * values["PR"]
    elif "IPR" in values:
        radius += unit * values["IPR"]
    if "IPA" in values:
        angle += values["IPA"] * DEGREE
    elif "PA" in values:
        angle = values["PA"] * DEGREE
    return radius, angle


def doubt(control: KlartextControl, words: MotionWords, start: FramePosition) -> str:
    """Why it is not known where polar words lead from a start; empty if it is known."""
    plane = control.path.plane
    if not {"PR", "PA"} <= words.values.keys():
        for index in plane.pair:
            if index in start.unknown:
                return start.unknown[index]
    if words.unknown & {"PR", "PA", "IPR", "IPA"}:
        return RUNTIME
    return "" if control.path.pole_in == pole_frame(control) else POLE_MOVED


def polar_axes(control: KlartextControl, words: MotionWords) -> int:
    """Bit mask of the axes that a motion in polar coordinates moves."""
    return words.axes | control.path.plane.axes


def starts_unknown(control: KlartextControl) -> bool:
    """Whether the start of the motion is unknown in X, Y or Z."""
    control.use_start_positions([index for index, why in control.unknown.items() if why is AT_START])
    return any(index in control.unknown for index in (X, Y, Z) if index in control.axis_indices)
