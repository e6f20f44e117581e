"""Rotary words on their side of zero and of a full turn.

A table that counts below 360 degrees takes -0.001 for 359.999, and the next word may then lead it the long way round.
So a program that never writes such an angle does not get one from a correction either: the word stays at the limit, and
what that leaves at the tip is part of the figures. Under `--strategy full` only are rotary words corrected at all.
"""

from __future__ import annotations

import re
from functools import lru_cache

from ncfix.text.spelling import value_of

FULL = 360.0
UNCORRECTED = 1e-9
"""Degrees: what an angle is off for nothing but the rounding of doubles."""


@lru_cache(maxsize=16)
def extremes(source: bytes, letter: str) -> tuple[float, float]:
    """The smallest and largest angle that a program writes for a rotary axis, degrees; 0 at least is among them."""
    code = re.sub(rb";[^\r\n]*", b"", source)
    found = re.findall(rb"(?i)(?<![A-Z0-9])" + letter.encode() + rb"[ \t]*([+-]?[ \t]*[\d.,]*\d)", code)
    angles = [value_of(text) for text in map(bytes.decode, found) if text.count(".") + text.count(",") < 2]
    return min(angles, default=0.0), max(angles, default=0.0)


def on_its_side(source: bytes, letter: str, nominal: float, angle: float, step: float) -> float:
    """A corrected angle, degrees; not below zero or past a full turn where the program never is. `step`: one digit."""
    if abs(angle - nominal) < UNCORRECTED:
        return angle
    if nominal >= 0.0 > angle and extremes(source, letter)[0] >= 0.0:
        return 0.0
    if nominal < FULL <= angle and extremes(source, letter)[1] < FULL:
        return FULL - step
    return angle
