"""The end of a block's motion by its axis words: absolute, incremental, with forms, polar, in machine coordinates."""

from __future__ import annotations

import math

from ncfix.control.coordinates import INDEX, LETTERS, TURN, Vector, mask_of, zeros
from ncfix.control.expressions import Fault
from ncfix.control.moves import MotionEnd, TcpState, UnknownAxes
from ncfix.control.tcp import EQUAL_TOLERANCE, converted, led_in_machine
from ncfix_siemens.sinumerik.state import GEOMETRY, Sinumerik
from ncfix_siemens.sinumerik.vocabulary import ABSOLUTE, HALF_A_TURN, POLAR, SHORTEST_WAY, TURNING, BlockWordValues

RUNTIME = "the position of the axis {} is known only at run time"
RADIUS = "an increment of X as a radius while absolute ones are diameters (DIAM90)"
BAD_POLAR = "NCF223"
IMPOSSIBLE = "NCF221"
POLAR_DIAMETER = "polar coordinates (AP, RP) while X is a diameter"
NO_POLE = "polar coordinates (AP, RP) while the pole is not known"
TWICE = "polar coordinates (AP, RP) together with {} in the plane: which one the control uses is not certain"
NO_RADIUS = "a polar radius (RP) of zero: the control uses the distance from the pole instead"
ASIDE = "AP is missing, or AP or RP is an increment, after the axes have left the last polar position"
NEAR_POLE = 1e-6
"""mm"""
STILL = 1e-9
"""Largest difference of equal angles, rad."""
INCREMENT_IN_PLANE = (
    "the position of the axis {} after increments in machine coordinates in a tilted plane is not known"
)
TOOL_OFF = "$mn_g53_toolcorr"
"""Machine data 10760: 0, the tool stays on in machine coordinates; 1, it is taken off. A control may have either."""
TOOL_ON_OR_OFF = (
    "the position of the axis {} after SUPA or G53 with a tool length in force depends on machine data: "
    f'variables."{TOOL_OFF.upper()}" = 0 (it stays on) or 1 (it does not) in the setup file; or D0 in that block'
)


def destination(control: Sinumerik, words: BlockWordValues) -> MotionEnd:
    """The command at the end of the block's motion; refused if an increment of X would be a radius (DIAM90)."""
    program = control.program_position()
    lost = dict(control.lost_in_frame())
    moved = 0
    if control.modal.incremental and control.modes.diameter == "DIAM90":
        words.refusal = words.refusal or RADIUS
    for letter in LETTERS:
        if letter in words.values:
            place(control, words, letter, program, lost)
            moved |= 1 << INDEX[letter]
    if POLAR & words.values.keys():
        moved |= polar(control, words, program, lost)
    return MotionEnd(control.command(program, moved), control.axes_of(lost), lost)


def place(control: Sinumerik, words: BlockWordValues, letter: str, program: Vector, lost: UnknownAxes) -> None:
    """Apply one axis word to the position `program` and the unknown axes `lost`."""
    index, value = INDEX[letter], words.values[letter]
    form = words.forms.get(letter, "")
    incremental = control.counts_on(form)
    if incremental and (why := control.unsteady(index)):
        lost[index] = why
        return
    if not incremental:
        control.check_offset()
        lost.pop(index, None)
        if index in control.composed.unknown:
            lost[index] = control.composed.unknown[index]
    if value is None:
        lost[index] = RUNTIME
        return
    step = control.scale[index] * value
    if incremental:
        if index == 0 and control.modes.diameter == "DIAM90":
            words.refusal, step = words.refusal or RADIUS, 2.0 * step
        program[index] += step
    elif form in TURNING:
        if not control.rotary[index]:
            raise Fault(IMPOSSIBLE, f"{form.upper()} is for rotary axes, but {letter} is not one")
        program[index] = turned(form, program[index], step, known=index not in control.lost_in_frame())
        control.over += (index,)
        if index in control.lost_in_frame():
            lost.pop(index, None)
    else:
        assert form in ("", ABSOLUTE)
        program[index] = step


def turned(form: str, here: float, angle: float, *, known: bool) -> float:
    """The end angle, rad, of a rotary axis from `here` to `angle`: by the shortest way (DC), or in a sense (ACP, ACN).

    known  whether `here` is known; if not, the end is `angle`
    """
    if not known or (form == SHORTEST_WAY and abs(angle - here) < math.radians(HALF_A_TURN)):
        return angle
    step = (angle - here + STILL) % TURN - STILL
    if form == SHORTEST_WAY:
        return here + (step if step <= math.pi + STILL else step - TURN)
    return here + step if form == "acp" or step <= STILL else here + step - TURN


# -- polar coordinates ------------------------------------------------------------------------------------------------


def polar(control: Sinumerik, words: BlockWordValues, program: Vector, lost: UnknownAxes) -> int:
    """Apply AP and RP about the pole to the position `program`; returns the axes of the plane as a bit mask."""
    plane, pole = control.modal.plane, control.modes.pole
    angle, radius = (polar_word(control, words, address) for address in ("AP", "RP"))
    why = doubtful_polar_word(control, words, program, radius)
    control.modes.polar = angle, radius
    control.check_offset()
    if pole is None or angle is None or radius is None or why:
        lost |= dict.fromkeys(plane.pair, why or (RUNTIME if pole else NO_POLE))
        return plane.axes
    program[plane.first] = pole[0] + radius * math.cos(angle)
    program[plane.second] = pole[1] + radius * math.sin(angle)
    for index in plane.pair:
        lost.pop(index, None)
    return plane.axes


def doubtful_polar_word(control: Sinumerik, words: BlockWordValues, here: Vector, radius: float | None) -> str:
    """Why the end of polar words is uncertain though they are known; "" if it is certain.

    A radius of zero means the distance of the start from the pole. An omitted angle, or an increment, may refer to the
    start or to the last polar words. So the axes must be at the end of the last polar words.
    """
    plane = control.modal.plane
    doubled = [letter for letter in "XYZ" if letter in words.values and INDEX[letter] in plane.pair]
    if doubled:
        return TWICE.format(doubled[0])
    if radius is not None and abs(radius) < NEAR_POLE:
        return NO_RADIUS
    forms = {address: control.counts_on(words.forms.get(address, "")) for address in POLAR & words.values.keys()}
    angle, distance = control.modes.polar
    first = angle if forms.get("AP", True) else None
    second = distance if forms.get("RP", False) else None
    return "" if first is second is None or stands_there(control, here, first, second) else ASIDE


def stands_there(control: Sinumerik, here: Vector, angle: float | None, distance: float | None) -> bool:
    """Whether the axes are at this angle, rad, and distance, mm, from the pole; None: not checked."""
    plane, pole = control.modal.plane, control.modes.pole
    if pole is None or control.lost_in_frame().keys() & set(plane.pair):
        return False
    x, y = here[plane.first] - pole[0], here[plane.second] - pole[1]
    near = distance is None or abs(math.hypot(x, y) - distance) < NEAR_POLE
    if angle is None:
        return near
    ahead, aside = x * math.cos(angle) + y * math.sin(angle), x * math.sin(angle) - y * math.cos(angle)
    return near and ahead > NEAR_POLE and abs(aside) < NEAR_POLE


def doubtful_polar(control: Sinumerik, words: BlockWordValues) -> str:
    """Why a motion with polar coordinates is refused while X is a diameter; "" if it is not."""
    return POLAR_DIAMETER if control.modal.diameter and {"AP", "RP"} & words.values.keys() else ""


def polar_word(control: Sinumerik, words: BlockWordValues, address: str) -> float | None:
    """AP, rad, or RP, mm: absolute, incremental to the last one, or the last one if omitted; None if unknown."""
    before = control.modes.polar[0 if address == "AP" else 1]
    if address not in words.values:
        return before
    value = words.values[address]
    if value is None:
        return None
    value *= math.pi / 180 if address == "AP" else control.stretch
    form = words.forms.get(address, "")
    if control.counts_on(form):
        return None if before is None else before + value
    return value


def set_pole(control: Sinumerik, words: BlockWordValues, code: int) -> None:
    """G110, G111, G112: set the pole relative to the current position, the zero point, or the last pole."""
    plane = control.modal.plane
    base: tuple[float, float] | None = (0.0, 0.0)
    if code == 1100:
        base = where_it_stands(control)
    elif code == 1120:
        base = control.modes.pole or ((0.0, 0.0) if control.modes.in_plane else None)
    steps = [words.values.get(LETTERS[index], 0.0) for index in plane.pair]
    if POLAR & words.values.keys():
        angle, radius = math.radians(words.get("AP")), words.get("RP")
        steps = [radius * math.cos(angle), radius * math.sin(angle)]
        if words.unknown("AP", "RP"):
            base = None
    if base is None or steps[0] is None or steps[1] is None:
        control.modes.pole = None
        return
    control.modes.pole = base[0] + control.stretch * steps[0], base[1] + control.stretch * steps[1]
    control.modes.polar = (None, None)


# -- machine coordinates ----------------------------------------------------------------------------------------------


def where_it_stands(control: Sinumerik) -> tuple[float, float] | None:
    """The position in the plane in program coordinates, mm; None if unknown."""
    here, plane = control.program_position(), control.modal.plane
    control.use_all_start_positions()
    axes = plane.pair
    if control.lost_in_frame().keys() & {*axes} or control.places.unplaced & mask_of(axes):
        return None
    return None if any(control.unsteady(index) for index in axes) else plane.of(here)


def machine_destination(control: Sinumerik, words: BlockWordValues) -> MotionEnd:
    """The command at the end of a motion in machine coordinates (SUPA, G53, G153): without frames.

    Machine data say whether the tool length is on. Where they are not given, axes for which it matters are unknown. A
    swivelled plane is a frame: without it the words are positions of the machine axes. With TRAORI they remain those
    of the tip.
    """
    if POLAR & words.values.keys():
        raise Fault(BAD_POLAR, "polar coordinates are not allowed with machine coordinates")
    if control.tcp and not (control.modes.transformed or control.setup.tcp):
        end = led_in_machine(control, *axes_of_machine(control, words))
        return MotionEnd(end.target, end.unknown, control.along_frame(end.unknown), end.in_machine)
    target, unknown = placed_at_machine(control, words, control.position[:], dict(control.unknown), control.tool_shift)
    without, lost, known = control.position[:], dict(control.unknown), True
    on, off = TcpState(control.tcp, control.length_under_tcp), TcpState(control.tcp, 0.0)
    if control.tcp:
        known = converted(control, without, lost, on, off)
    without, lost = placed_at_machine(control, words, without, lost, zeros())
    if control.tcp:
        known = converted(control, without, lost, off, on) and known
    toolless = control.variables.value(TOOL_OFF)
    for index in GEOMETRY if on.tool_length or not control.tcp else ():
        if index not in control.axis_indices or toolless == 0.0:
            continue
        if not known or abs(target[index] - without[index]) > EQUAL_TOLERANCE:
            target[index] = without[index]
            if not known or toolless != 1.0:
                unknown[index] = TOOL_ON_OR_OFF
    return MotionEnd(target, unknown, control.along_frame(unknown))


def axes_of_machine(control: Sinumerik, words: BlockWordValues) -> tuple[dict[int, float], UnknownAxes]:
    """Machine axis positions by the words, mm and rad; and reasons for unknown ones, by axis."""
    axes, unsure = dict[int, float](), dict[int, str]()
    toolless = control.variables.value(TOOL_OFF)
    for letter in LETTERS:
        if letter in words.values:
            index, value = INDEX[letter], words.values[letter]
            length = control.tools.vector[index]
            axes[index] = step_of(control, letter, value) + (0.0 if toolless == 1.0 else length)
            if value is None:
                unsure[index] = RUNTIME
            elif control.counts_on(words.forms.get(letter, "")):
                unsure[index] = INCREMENT_IN_PLANE
            elif length and toolless not in (0.0, 1.0):
                unsure[index] = TOOL_ON_OR_OFF
    return axes, unsure


def placed_at_machine(
    control: Sinumerik, words: BlockWordValues, target: Vector, unknown: UnknownAxes, tool: Vector
) -> tuple[Vector, UnknownAxes]:
    """Take the axis words of a block in machine coordinates into `target` and `unknown`; `tool` is what is on then."""
    for letter in LETTERS:
        if letter in words.values:
            place_at_machine(control, words, letter, target, unknown, tool)
    return target, unknown


def place_at_machine(
    control: Sinumerik, words: BlockWordValues, letter: str, target: Vector, unknown: UnknownAxes, tool: Vector
) -> None:
    """Apply one axis word in machine coordinates to the position `target`; `tool`: the length along each axis there."""
    index, value = INDEX[letter], words.values[letter]
    if control.counts_on(words.forms.get(letter, "")):
        target[index] += step_of(control, letter, value)
        if index == 0 and control.modes.diameter == "DIAM90":
            unknown[index] = RADIUS
        if why := control.unsteady(index, by_machine=True):
            unknown[index] = why
    else:
        target[index] = tool[index] + step_of(control, letter, value)
        unknown.pop(index, None)
    if value is None:
        unknown[index] = RUNTIME


def step_of(control: Sinumerik, letter: str, value: float | None) -> float:
    """The value of a word in machine coordinates, mm or rad, without the scale of a frame; 0 if unknown."""
    index = INDEX[letter]
    if control.rotary[index]:
        return control.of_setup(letter) * (value or 0.0)
    return control.modal.unit * (value or 0.0) / (2.0 if index == 0 and control.modal.diameter else 1.0)
