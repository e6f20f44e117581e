"""Cycles that transform coordinates where they are defined: datum, mirror, rotation, scale, tilt, preset.

Source: TNC 640, "Cycle programming": coordinate transformations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ncfix.control.coordinates import DEGREE, INDEX
from ncfix.control.expressions import Unknown
from ncfix_heidenhain.klartext.control import PRESET, KlartextControl
from ncfix_heidenhain.klartext.targets import MotionWords
from ncfix_heidenhain.klartext.tilting import cycle_19
from ncfix_heidenhain.klartext.trans import FROM_TABLE, note_source

BY_FUNCTION = {8: "MIRROR", 10: "ROTATION", 11: "SCALE"}
"""What a TRANS function can do, too."""

NO_PRESET = "the number of the preset is known only at run time"


def transform(control: KlartextControl, cycle: int, part: str, words: MotionWords, text: str) -> None:
    """A part of one of the cycles `ACTS`, `part` 1 of `CYCL DEF 10.1 ROT+35`, with its words and its text."""
    if counts(cycle, part):
        if cycle in BY_FUNCTION:
            note_source(control, BY_FUNCTION[cycle], by_function=False)
        ACTS[cycle](control, words, text)
    control.recompose()


def counts(cycle: int, part: str) -> bool:
    """Whether a part of a cycle says what is transformed, and not its name only."""
    if cycle in (8, 10, 11, 19):
        return part == "1"
    return cycle != 26 or part not in ("", "0")


def shift(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 7: `7.1 X+10`, `7.2 IY5`, `7.1 #5` for a row of the datum table."""
    if "#" in text:
        for letter in "XYZABCUVW":
            control.shaky[INDEX[letter]] = FROM_TABLE
        return
    for address, value in words.values.items():
        letter = address.removeprefix("I")
        if letter not in INDEX:
            continue
        index = INDEX[letter]
        scale = DEGREE if control.rotary[index] else control.unit
        control.transformations.shift_axis(letter, scale * value, incremental=address[0] == "I")
        control.shaky.pop(index, None)
        if address in words.runtime:
            control.shaky[index] = "the datum of the axis {} is known only at run time"


def mirror(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 8: `8.1 X Y`, the axes that are mirrored; none ends it."""
    control.transformations.mirror_axes(frozenset(text.upper()) & frozenset("XYZABC"))


def rotate(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 10: `10.1 ROT+35` or `IROT+5`, degrees."""
    rotation = words.values.get("ROT", words.values.get("IROT"))
    suspend(control, words, "rotation")
    control.transformations.rotate(rotation or 0.0, incremental="IROT" in words.values)


def scale(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 11: `11.1 SCL 0.9`."""
    suspend(control, words, "scale")
    factor = words.values.get("SCL", 1.0)
    if factor <= 0.0:
        control.suspended["scale"] = "a scale that is not above zero (cycle 11)"
    control.transformations.scale_by(factor if factor > 0.0 else 1.0)


def scale_axes(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 26: `26.1 X1.4 Y0.6`: nothing is corrected while an axis has a scale of its own."""
    control.suspended.pop("scales", None)
    if any(factor != 1.0 for key, factor in words.values.items() if key in "XYZ"):
        control.suspended["scales"] = "a scale of single axes (cycle 26)"


def tilt(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 19: `19.1 A+0 B+45 C+0`."""
    cycle_19(control, words)


def preset(control: KlartextControl, words: MotionWords, text: str) -> None:
    """Cycle 247: the preset of the row Q339."""
    number = control.scope.parameters.get("Q339")
    control.suspended.pop(PRESET, None)
    if isinstance(number, Unknown):
        control.suspended[PRESET] = NO_PRESET
        return
    control.load_preset(f"PRESET{number:g}")


def suspend(control: KlartextControl, words: MotionWords, what: str) -> None:
    """Nothing is corrected while a transformation depends on what is known only at run time."""
    control.suspended.pop(what, None)
    if words.runtime:
        control.suspended[what] = f"the {what} of the coordinates is known only at run time"


Act = Callable[[KlartextControl, MotionWords, str], None]
ACTS: Mapping[int, Act] = {7: shift, 8: mirror, 10: rotate, 11: scale, 19: tilt, 26: scale_axes, 247: preset}
