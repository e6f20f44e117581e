"""TRANS MIRROR, ROTATION and SCALE of the TNC7, which do what the cycles 8, 10 and 11 do; TRANS DATUM TABLE.

Source: TNC7, "NC functions for coordinate transformation". How a function and a cycle of the same kind act upon each
other is left open there: where both are used at once, nothing is corrected any more.
"""

from __future__ import annotations

import re

from ncfix.control.coordinates import INDEX
from ncfix.text.spelling import value_of
from ncfix_heidenhain.klartext.control import KlartextControl

FORM = re.compile(r"TRANS\s+(?P<kind>MIRROR|ROTATION|SCALE|DATUM)\s*(?P<rest>.*)", re.IGNORECASE | re.DOTALL)
NUMBER = re.compile(r"(?P<word>IROT|ROT|SCL)\s*(?P<value>[+-]?\s*(\d+([.,]\d*)?|[.,]\d+))\Z", re.IGNORECASE)
AXES = re.compile(r"AXIS(\s+[XYZ])+\Z", re.IGNORECASE)
FROM_TABLE = "the datum of the axis {} comes from a table that is not given"
NOT_FOLLOWED = "TRANS {} with words that are not followed"
BOTH = "TRANS {} and a cycle of the same kind at once: how they add up is not sure"


def transform(control: KlartextControl, text: str) -> None:
    """A TRANS function but DATUM AXIS and DATUM RESET."""
    found = FORM.match(text)
    assert found is not None, "the grammar asks for one of these"
    kind, rest = found["kind"].upper(), found["rest"].strip()
    if kind == "DATUM":
        control.shaky |= {INDEX[letter]: FROM_TABLE for letter in "XYZABCUVW"}
        return
    note_source(control, kind, by_function=True)
    control.suspended.pop(kind, None)
    if not put_in_force(control, kind, rest):
        control.suspended[kind] = NOT_FOLLOWED.format(kind)
    control.recompose()


def note_source(control: KlartextControl, kind: str, *, by_function: bool) -> None:
    """A transformation is about to be set: notice if the one in force came from the other of cycle and function."""
    trans = control.transformations
    in_force = {"MIRROR": bool(trans.mirror), "ROTATION": trans.turn != 0.0, "SCALE": trans.scale != 1.0}[kind]
    if in_force and by_function != (kind in control.functions):
        control.suspended["both"] = BOTH.format(kind)
    control.functions = control.functions | {kind} if by_function else control.functions - {kind}


def put_in_force(control: KlartextControl, kind: str, rest: str) -> bool:
    """Do what the words of a function say; False if they are not its own."""
    trans = control.transformations
    reset, number = rest.upper() == "RESET", NUMBER.match(rest)
    word = "RESET" if reset else number["word"].upper() if number else ""
    value = value_of(number["value"]) if number else 0.0
    if kind == "MIRROR" and (reset or AXES.match(rest)):
        trans.mirror_axes(frozenset(rest.upper().split()[1:]))
    elif kind == "ROTATION" and word in ("RESET", "ROT", "IROT"):
        trans.rotate(value, incremental=word == "IROT")
    elif kind == "SCALE" and word in ("RESET", "SCL"):
        trans.scale_by(value if number else 1.0)
    else:
        return False
    return True
