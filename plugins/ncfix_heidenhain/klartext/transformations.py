"""Coordinate transformations of a program: datum, mirror, rotation, scale and preset, by cycles and by TRANS.

Mirror, rotation and scale act about the datum that is in force when they are programmed. A shift after a tilt counts
along the tilted axes. Where the manuals do not say how transformations combine, the result is `doubtful`: nothing is
corrected until they are reset. The same holds where a function (TRANS MIRROR, ROTATION, SCALE of the TNC7) and a cycle
of the same kind (8, 10, 11) are in force at once.

Sources: TNC 640, "Coordinate systems" and "Cycles: coordinate transformations"; TNC7, "NC functions for coordinate
transformation".
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace

from ncfix.control.coordinates import DEGREE, IDENTITY, INDEX, LETTERS, PLANES, Rotation
from ncfix.control.expressions import Unknown
from ncfix.control.frames import WORLD, Affine, FrameStack, mirrored, turned_in
from ncfix_heidenhain.klartext.control import PRESET, KlartextControl
from ncfix_heidenhain.klartext.targets import MotionWords

SHIFT_IN_ROTATION = (
    "a datum shift while mirror, rotation or scale is active: whether the control transforms the shift is not certain"
)
SHIFT_UNDER_TILT = "datum shifts before and in a tilted plane: how the control combines them is not certain"
MIRROR_AND_ROTATION = "mirror and rotation together: their order is not certain"
MIRRORED_ROTARY = "a mirrored rotary axis"

FORM = re.compile(r"TRANS\s+(?P<kind>MIRROR|ROTATION|SCALE|DATUM)\s*(?P<rest>.*)", re.IGNORECASE | re.DOTALL)
NUMBER = re.compile(r"(?P<word>IROT|ROT|SCL)\s*(?P<value>[+-]?\s*(\d+([.,]\d*)?|[.,]\d+))\Z", re.IGNORECASE)
AXES = re.compile(r"AXIS(\s+[XYZ])+\Z", re.IGNORECASE)
FROM_TABLE = "the datum of the axis {} is from a datum table, which is not given"
AT_RUN_TIME = "the datum of the axis {} is known only at run time"
NOT_FOLLOWED = "TRANS {} with words that are not supported"
BOTH = "TRANS {} and a cycle of the same kind are both active: how the control combines them is not certain"
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
        control.suspend("scale", "a scale factor that is zero or negative (cycle 11)")
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
