"""Coordinate transformations of a program: datum, mirror, rotation, scale and preset, by cycles and by TRANS.

Mirror, rotation and scale act about the datum that is in force when they are programmed. A shift after a tilt counts
along the tilted axes. Where the manuals do not say how transformations combine, the result is `doubtful`: nothing is
corrected until they are reset. The same holds where a function (TRANS MIRROR, ROTATION, SCALE of the TNC7) and a cycle
of the same kind (8, 10, 11) are in force at once.
Sources: TNC 640, "Coordinate systems" and "Cycles: coordinate transformations"; TNC7, "NC functions for coordinate
transformation".

PLANE and cycle 19 tilt the plane by angles, vectors or points.

Source: TNC 640, "The PLANE function: tilting the working plane", and "Cycle 19". The kinematics of the machine say
where TURN and MOVE take the rotary axes; MOVE also moves the linear axes, which are not known after it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace

from ncfix.control.coordinates import DEGREE, IDENTITY, INDEX, LETTERS, PLANES, Rotation, product
from ncfix.control.expressions import Fault, Unknown
from ncfix.control.frames import (
    WORLD,
    Affine,
    FrameStack,
    euler,
    from_points,
    from_vectors,
    mirrored,
    projected,
    spatial,
    turned_in,
)
from ncfix.control.moves import AT_START, Motion, MotionEnd, MotionKind, Pass, Passing
from ncfix.control.posture import MIN_SIGNED_RAD, WayRules, normal_of
from ncfix.control.tcp import switch
from ncfix_heidenhain.klartext.control import MOVED_ALONG, PRESET, TILTED, KlartextControl
from ncfix_heidenhain.klartext.targets import MotionWords

SHIFT_IN_ROTATION = "a datum shift while mirror, rotation or scale is active: whether it turns along is not sure"
SHIFT_UNDER_TILT = "a datum shift on both sides of a tilted plane: how the control adds them up is not sure"
MIRROR_AND_ROTATION = "mirror and rotation together: their order is not sure"
MIRRORED_ROTARY = "a mirrored rotary axis"

FORM = re.compile(r"TRANS\s+(?P<kind>MIRROR|ROTATION|SCALE|DATUM)\s*(?P<rest>.*)", re.IGNORECASE | re.DOTALL)
NUMBER = re.compile(r"(?P<word>IROT|ROT|SCL)\s*(?P<value>[+-]?\s*(\d+([.,]\d*)?|[.,]\d+))\Z", re.IGNORECASE)
AXES = re.compile(r"AXIS(\s+[XYZ])+\Z", re.IGNORECASE)
FROM_TABLE = "the datum of the axis {} comes from a table that is not given"
AT_RUN_TIME = "the datum of the axis {} is known only at run time"
NOT_FOLLOWED = "TRANS {} with words that are not followed"
BOTH = "TRANS {} and a cycle of the same kind at once: how they add up is not sure"
BY_FUNCTION = {8: "MIRROR", 10: "ROTATION", 11: "SCALE"}
"""Cycle -> the TRANS function that does the same."""

NO_PRESET = "the number of the preset is known only at run time"


# -- what is in force -------------------------------------------------------------------------------------------------


def is_plain(control: KlartextControl) -> bool:
    """Whether neither mirror nor rotation nor scale is active."""
    frames = control.frames
    return frames.mirror.rotation == IDENTITY and control.turn == 0.0 and frames.scaling.scale == 1.0


def put_turned(control: KlartextControl, frames: FrameStack) -> None:
    """Put another mirror, rotation or scale into force; mirror with rotation is doubtful, since their order matters."""
    if frames.mirror.rotation != IDENTITY and control.turn:
        control.doubtful = MIRROR_AND_ROTATION
    put(control, frames)


def put(control: KlartextControl, frames: FrameStack) -> None:
    """Put frames into force; nothing is doubtful any more once everything is reset."""
    control.frames = frames
    shifted = any(frames.programmable.shift) or any(frames.local.shift)
    if is_plain(control) and not control.plane_tilted and not shifted:
        control.doubtful = ""


def shift_axis(control: KlartextControl, letter: str, value: float, *, incremental: bool) -> None:
    """Shift the datum of one axis by cycle 7 or TRANS DATUM; `value` in mm or rad."""
    index, frames = INDEX[letter], control.frames
    along_plane = control.plane_tilted and index < 3
    here = frames.local if along_plane else frames.programmable
    now = here.shift[index] + value if incremental else value
    if now != here.shift[index] and not is_plain(control):
        control.doubtful = SHIFT_IN_ROTATION
    here = here.shifted_to({index: now})
    frames = replace(frames, local=here) if along_plane else replace(frames, programmable=here)
    if control.plane_tilted and any(frames.programmable.shift[:3]):
        control.doubtful = SHIFT_UNDER_TILT
        if not incremental and value == 0.0:
            frames = replace(frames, programmable=frames.programmable.shifted_to({index: 0.0}))
    put(control, frames)


def mirror_axes(control: KlartextControl, letters: frozenset[str]) -> None:
    """Mirror these axes (cycle 8); none ends mirroring."""
    if letters & frozenset("ABC"):
        control.doubtful = MIRRORED_ROTARY
    rotation = mirrored("".join(letters))
    put_turned(control, replace(control.frames, mirror=Affine(rotation=rotation)))


def rotate_by(control: KlartextControl, degrees: float, *, incremental: bool) -> None:
    """Rotate in the working plane, degrees (cycle 10)."""
    control.turn = (control.turn if incremental else 0.0) + degrees
    rotation = turned_in(PLANES[170], control.turn) if control.turn else WORLD
    put_turned(control, replace(control.frames, rotation=rotation))


def scale_by(control: KlartextControl, factor: float) -> None:
    """Scale by a factor (cycle 11)."""
    put_turned(control, replace(control.frames, scaling=Affine(scale=factor)))


def with_plane(control: KlartextControl, tilt: Rotation | None) -> FrameStack:
    """The frames with a tilted plane, or without one (None): shifts along its axes then become plain datum shifts."""
    frames = control.frames
    if any(frames.local.shift):
        control.doubtful = SHIFT_UNDER_TILT
        if tilt is None:
            own, inner = frames.programmable.shift, frames.local.shift
            together = frames.programmable.shifted_to({index: own[index] + inner[index] for index in range(3)})
            frames = replace(frames, programmable=together, local=WORLD)
    return replace(frames, plane=WORLD if tilt is None else Affine(rotation=tilt))


# -- TRANS ------------------------------------------------------------------------------------------------------------


def trans(control: KlartextControl, text: str) -> None:
    """Execute a TRANS function other than DATUM AXIS and DATUM RESET."""
    found = FORM.match(text)
    assert found is not None, "the grammar asks for one of these"
    kind, rest = found["kind"].upper(), found["rest"].strip()
    if kind == "DATUM":
        from_table(control)
        return
    note_source(control, kind, by_function=True)
    control.resume(kind)
    if not put_in_force(control, kind, rest):
        control.suspend(kind, NOT_FOLLOWED.format(kind))
    control.recompose()


def reset_datum(control: KlartextControl) -> None:
    """Execute TRANS DATUM RESET."""
    for letter in LETTERS:
        shift_axis(control, letter, 0.0, incremental=False)
    datum_unknown(control, {})


def from_table(control: KlartextControl) -> None:
    """Note that the datum comes from a table, and so is not known."""
    datum_unknown(control, dict.fromkeys(range(len(LETTERS)), FROM_TABLE))


def datum_unknown(control: KlartextControl, why: dict[int, str]) -> None:
    """Note for which axes (by index) the datum is not known, and why; for the others it is."""
    control.frames = replace(control.frames, programmable=replace(control.frames.programmable, unknown=why))
    control.recompose()


def note_source(control: KlartextControl, kind: str, *, by_function: bool) -> None:
    """Note what sets a transformation; suspend corrections if one of the other source (function, cycle) is in force."""
    frames = control.frames
    in_force = {
        "MIRROR": frames.mirror.rotation != IDENTITY,
        "ROTATION": control.turn != 0.0,
        "SCALE": frames.scaling.scale != 1.0,
    }
    if in_force[kind] and by_function != (kind in control.functions):
        control.suspend("both", BOTH.format(kind))
    control.functions = control.functions | {kind} if by_function else control.functions - {kind}


def put_in_force(control: KlartextControl, kind: str, rest: str) -> bool:
    """Execute a TRANS MIRROR, ROTATION or SCALE; False if its words are not understood."""
    reset, number = rest.upper() == "RESET", NUMBER.match(rest)
    word = "RESET" if reset else number["word"].upper() if number else ""
    value = float("".join(number["value"].split()).replace(",", ".")) if number else 0.0
    if kind == "MIRROR" and (reset or AXES.match(rest)):
        mirror_axes(control, frozenset(rest.upper().split()[1:]))
    elif kind == "ROTATION" and word in ("RESET", "ROT", "IROT"):
        rotate_by(control, value, incremental=word == "IROT")
    elif kind == "SCALE" and word in ("RESET", "SCL"):
        scale_by(control, value if number else 1.0)
    else:
        return False
    return True


# -- cycles -----------------------------------------------------------------------------------------------------------


def transform(control: KlartextControl, cycle: int, part: str, words: MotionWords, text: str) -> None:
    """Execute a part (1 in `CYCL DEF 10.1 ROT+35`) of one of the cycles `ACTS`; `text`: its words without value."""
    says = part == "1" if cycle in (8, 10, 11) else cycle != 26 or part not in ("", "0")
    if says:
        if cycle in BY_FUNCTION:
            note_source(control, BY_FUNCTION[cycle], by_function=False)
        ACTS[cycle](control, words, text)
    control.recompose()


def shift(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 7: `7.1 X+10`, `7.2 IY5`, `7.1 #5` for a row of the datum table."""
    if "#" in text:
        from_table(control)
        return
    why = dict(control.frames.programmable.unknown)
    for address, value in words.values.items():
        letter = address.removeprefix("I")
        if letter not in INDEX:
            continue
        index = INDEX[letter]
        scale = DEGREE if control.rotary[index] else control.modal.unit
        shift_axis(control, letter, scale * value, incremental=address[0] == "I")
        why.pop(index, None)
        if address in words.unknown:
            why[index] = AT_RUN_TIME
    datum_unknown(control, why)


def mirror(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 8: `8.1 X Y` mirrors these axes; `8.1` alone ends mirroring."""
    mirror_axes(control, frozenset(text.upper()) & frozenset("XYZABC"))


def rotate(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 10: `10.1 ROT+35` or `IROT+5`, degrees."""
    rotation = words.values.get("ROT", words.values.get("IROT"))
    suspend(control, words, "rotation")
    rotate_by(control, rotation or 0.0, incremental="IROT" in words.values)


def scale(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 11: `11.1 SCL 0.9`."""
    suspend(control, words, "scale")
    factor = 1.0 if "SCL" in words.unknown else words.values.get("SCL", 1.0)
    if factor <= 0.0:
        control.suspend("scale", "a scale that is not above zero (cycle 11)")
    scale_by(control, factor if factor > 0.0 else 1.0)


def scale_axes(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 26: `26.1 X1.4 Y0.6`; nothing is corrected while an axis has a scale of its own."""
    control.resume("scales")
    if any(factor != 1.0 for key, factor in words.values.items() if key in "XYZ"):
        control.suspend("scales", "a scale of single axes (cycle 26)")


def preset(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 247: activate the preset in row Q339 of the preset table."""
    number = control.scope.parameters.get("Q339")
    control.resume(PRESET)
    if isinstance(number, Unknown):
        control.suspend(PRESET, NO_PRESET)
        return
    control.load_preset(f"PRESET{number:g}")


def suspend(control: KlartextControl, words: MotionWords, what: str) -> None:
    """Suspend corrections while a transformation depends on what is known only at run time."""
    control.resume(what)
    if words.unknown:
        control.suspend(what, f"the {what} of the coordinates is known only at run time")


ACTS: Mapping[int, Callable[[KlartextControl, MotionWords, str], None]] = {
    7: shift,
    8: mirror,
    10: rotate,
    11: scale,
    26: scale_axes,
    247: preset,
}


# -- PLANE and cycle 19 ------------------------------------------------------------------------------------------------

BAD_PLANE = "NCF273"
RETRACTING = "mb max"
"""The flag of a PLANE block with MB: the tool is retracted before the axes turn."""

POSITIONED = "where the axis {} stands after PLANE ... TURN or MOVE the control works out"
NOT_NORMAL = "the tool does not stand normal to the tilted plane, by the axis positions of the program"
TURNED = Passing(Pass.ALIGNMENT, "the control positions the rotary axes (PLANE)")
WAY = "NCF279"
WAY_HINT = "say SEQ+ or SEQ- in the program, or state the rotary axes"
HOME = "PLANE RESET is taken to turn the rotary axes to zero, their basic position"
RUNTIME = "the tilted plane depends on a Q parameter that is known only at run time"
ANGLES = "NCF284"
ANGLES_HINT = "a machine parameter decides: compare Q120 to Q122 on the control, or use PLANE"
NO_KINEMATICS = "the tilted plane is given by the positions of rotary axes (PLANE AXIAL, cycle 19)"
CALCULATED = ("Q120", "Q121", "Q122")
"""The parameters in which the control stores the positions of A, B and C that it has worked out."""

Values = Mapping[str, float]


def by_vectors(values: Values) -> Rotation | None:
    """PLANE VECTOR: the plane by its base vector and normal."""
    base, normal = ([values.get(f"{kind}{axis}", 0.0) for axis in "XYZ"] for kind in "BN")
    return from_vectors((base[0], base[1], base[2]), (normal[0], normal[1], normal[2]))


def by_points(values: Values) -> Rotation | None:
    """PLANE POINTS: the plane through three points."""
    first, second, third = ([values.get(f"P{number}{axis}", 0.0) for axis in "XYZ"] for number in "123")
    return from_points(
        (first[0], first[1], first[2]), (second[0], second[1], second[2]), (third[0], third[1], third[2])
    )


def by_angles(values: Values) -> Rotation:
    """PLANE SPATIAL: the plane by three spatial angles."""
    return spatial({letter: values.get(f"SP{word}", 0.0) for letter, word in zip("XYZ", "ABC", strict=True)})


def by_projection(values: Values) -> Rotation | None:
    """PLANE PROJECTED: the plane by two projected angles and a rotation; None from 90 degrees on."""
    first, second = values.get("PROPR", 0.0), values.get("PROMIN", 0.0)
    return None if max(abs(first), abs(second)) >= 90 else projected(first, second, values.get("ROT", 0.0))


FORMS: Mapping[str, Callable[[Values], Rotation | None]] = {
    "spatial": by_angles,
    "projected": by_projection,
    "euler": lambda v: euler(v.get("EULPR", 0.0), v.get("EULNU", 0.0), v.get("EULROT", 0.0)),
    "vector": by_vectors,
    "points": by_points,
}


def plane(control: KlartextControl, form: str, words: MotionWords, flags: frozenset[str]) -> None:
    """Execute a PLANE block; `form` is `spatial`, `reset`, ..."""
    values = words.values
    if "MB" in values:
        flags |= {RETRACTING}
    if form == "reset" and is_idle(control, flags):
        return
    control.use()
    if form == "reset":
        tilt_to(control, None, flags)
        return
    if words.unknown:
        tilt_to(control, control.frames.plane.rotation, flags, RUNTIME)
    elif form.startswith("relativ"):
        tilt_to(control, product(control.frames.plane.rotation, by_angles(values)), flags)
    elif form == "axial":
        by_axes(control, values, flags)
    else:
        found = FORMS[form](values)
        if found is None:
            raise Fault(BAD_PLANE, f"PLANE {form.upper()} gives no plane: its vectors or points are in one line")
        tilt_to(control, found, flags)


def is_idle(control: KlartextControl, flags: frozenset[str]) -> bool:
    """Whether the end of a tilt changes nothing: no tilt is in force, and no rotary start position was needed yet.

    Many programs begin so; Q120 to Q122 are then not known.
    """
    asked = any(control.rotary[index] and why is AT_START for index, why in control.unknown.items())
    turns = flags & {"turn", "move", RETRACTING}
    idle = asked and not turns and not control.plane_tilted and TILTED not in control.suspended
    if idle:
        for name in CALCULATED:
            control.scope.parameters.assign(name, Unknown())
    return idle


def by_axes(control: KlartextControl, values: Values, flags: frozenset[str]) -> None:
    """PLANE AXIAL: the plane to which the tool is normal with rotary axes at these positions; TURN moves them there."""
    way = {index: values[letter] * DEGREE for letter, index in INDEX.items() if letter in values}
    staying = {index: control.position[index] for index in control.turning if index not in way}
    plane = None if staying.keys() & control.unknown.keys() else plane_of(control, values)
    refusal = "" if plane else NO_KINEMATICS
    tilt_to(control, plane or control.frames.plane.rotation, flags, refusal, staying | way)


def plane_of(control: KlartextControl, values: Values) -> Rotation | None:
    """The plane to which the tool is normal with rotary axes at these positions (degrees); None if it is not known."""
    turned = control.position[:]
    for letter in "ABC":
        if letter in values:
            turned[INDEX[letter]] = values[letter] * DEGREE
    found = control.posture.directions(turned)
    return None if found is None or math.dist(found.tool, normal_of(found.axes)) > 1e-6 else found.axes


def tilt_to(
    control: KlartextControl,
    tilt: Rotation | None,
    flags: frozenset[str],
    refusal: str = "",
    way: dict[int, float] | None = None,
) -> None:
    """Put a tilted plane into force, or end it (None); `way`: where rotary axes go, if the block states it."""
    frames, control.plane_tilted = with_plane(control, tilt), tilt is not None
    control.resume(TILTED)
    if refusal:
        control.suspend(TILTED, refusal)
    home = tilt is None and flags & {"turn", "move"}
    if refusal or way is None:
        way = None if refusal else way_home(control) if home else chosen_way(control, tilt, flags)
    for letter, name in zip("ABC", CALCULATED, strict=True):
        known = way is not None and INDEX[letter] in way
        angle = way[INDEX[letter]] - control.offset[INDEX[letter]] if way is not None and known else 0.0
        control.scope.parameters.assign(name, angle / DEGREE if known else Unknown("", angle / DEGREE))
    if flags & {"turn", "move"}:
        turn_axes(control, way)
    if flags & {"move", RETRACTING}:
        control.lose(range(3), MOVED_ALONG)
    put(control, frames)
    control.recompose()
    control.switch_tip()
    control.path.tangent = None


def chosen_way(control: KlartextControl, tilt: Rotation | None, flags: frozenset[str]) -> dict[int, float] | None:
    """Axis -> the rotary position that the control works out for a plane; None if that is not known or not sure.

    SEQ (or SYM) chooses between the two solutions by the sign of the master axis, the one that tilts the tool when all
    rotary axes stand at zero. Without it the nearest solution is taken.

    At the pole the axis next to the workpiece is free: the tool is square to the plane at any of its positions. With
    COORD ROT, the default, some controls turn it to zero, and others leave it; with TABLE ROT it takes over the
    rotation of the plane. All agree only if it already stands at zero and the plane is not rotated by TABLE ROT.
    """
    signs = (-1 if flag.endswith("-") else 1 for flag in flags if flag[:3] in ("seq", "sym"))
    normal = normal_of(IDENTITY if tilt is None else tilt)
    found = control.postures(normal, WayRules(in_travel=True, sign=next(signs, 0)))
    if found is None or not found.ways:
        return None
    if found.at_pole:
        turned = "table rot" in flags and tilt is not None and tilt != IDENTITY
        at_zero = abs(found.ways[0][0]) < MIN_SIGNED_RAD
        return found.chosen if at_zero and not turned else None
    if len(found.ways) > 1:
        control.warn(WAY, f"the rotary axes are taken to turn to {found}, the nearest of several ways", WAY_HINT)
    return found.chosen


def way_home(control: KlartextControl) -> dict[int, float] | None:
    """Where PLANE RESET with TURN or MOVE takes the rotary axes: to zero; None if their datum is shifted."""
    if any(control.offset[index] for index in control.turning):
        return None
    if any(index in control.unknown or abs(control.position[index]) > MIN_SIGNED_RAD for index in control.turning):
        control.warn(WAY, HOME, "state the rotary axes in the next block")
    return dict.fromkeys(control.turning, 0.0)


def turn_axes(control: KlartextControl, way: dict[int, float] | None) -> None:
    """Turn the rotary axes as TURN and MOVE do; `way`: to where, None if that is not known."""
    if control.tcp:
        switch(control, control.tools.vector, False, control.tools.offset)
        control.refresh()
    if way is None:
        why = next((control.unknown[index] for index in control.turning if index in control.unknown), POSITIONED)
        control.pass_here(TURNED, why, "".join(LETTERS[index] for index in control.turning))
        return
    target, unknown = control.position[:], {k: why for k, why in control.unknown.items() if k not in way}
    for index, angle in way.items():
        target[index] = angle
    control.make(Motion(MotionKind.RAPID, 0, MotionEnd(target, unknown), 0, passing=TURNED))


def cycle_19(control: KlartextControl, words: MotionWords) -> None:
    """Cycle 19: tilt by spatial angles or by positions of rotary axes; without angles it ends the tilt.

    A machine parameter decides which of the two is meant; here the positions of the axes show it.
    """
    values = {letter: words.values[letter] for letter in "ABC" if letter in words.values}
    if not values and is_idle(control, frozenset()):
        return
    control.use()
    if not values:
        tilt_to(control, None, frozenset())
        return
    if words.unknown:
        tilt_to(control, control.frames.plane.rotation, frozenset(), RUNTIME)
        return
    meant = by_angles({f"SP{letter}": value for letter, value in values.items()})
    standing = all(
        INDEX[letter] in control.axis_indices
        and INDEX[letter] not in control.unknown
        and abs(control.position[INDEX[letter]] - value * DEGREE) < 1e-6
        for letter, value in values.items()
    )
    square = control.square_to(meant)
    if square is False and standing:
        by_axes(control, values, frozenset())
        return
    if not square and all(INDEX[letter] in control.axis_indices for letter in values):
        other = plane_of(control, values)
        if other is not None and math.dist(normal_of(other), normal_of(meant)) > 1e-6:
            control.warn(ANGLES, "cycle 19 is taken to name spatial angles, not positions of rotary axes", ANGLES_HINT)
    tilt_to(control, meant, frozenset())


def check_normal(control: KlartextControl) -> str:
    """Why a motion in the tilted plane is refused: the tool is not normal to it. Empty if it is not refused."""
    if not control.plane_tilted or control.m128 or TILTED in control.suspended:
        return ""
    return NOT_NORMAL if control.square_to(control.frames.plane.rotation) is False else ""
