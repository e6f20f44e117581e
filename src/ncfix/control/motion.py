"""A motion as a block means it, and what is not known of where it leads."""

from __future__ import annotations

import math
from typing import NamedTuple

from ncfix.control.builder import Arc
from ncfix.control.coordinates import LETTERS, Vector
from ncfix.control.moves import MotionKind
from ncfix.control.passing import Passing

AT_START = "where the axis {} stands when the program starts is not given"
"""Why a position is not known at first; asked of the setup when it matters."""

UnknownAxes = dict[int, str]
"""Letter index -> why the position of the axis is not known, with a `{}` for its letter."""


class Motion(NamedTuple):
    """One motion of the control.

    axes     axes with a word, as bits
    target   the command at its end, of every letter; a nominal value along `unknown`
    code     the motion code, in tenths
    refusal  why it is refused; empty if it is not
    passing  why it is passed as it is; None if it is not
    settles  the axes whose words say where they stand afterwards; None: those of absolute words
    """

    kind: MotionKind
    axes: int
    target: Vector
    unknown: UnknownAxes
    code: int
    refusal: str = ""
    passing: Passing | None = None
    arc: Arc | None = None
    settles: int | None = None


def blanked(position: Vector, unknown: UnknownAxes) -> Vector:
    """A position with NaN where it is not known."""
    if not unknown:
        return position
    return [math.nan if index in unknown else value for index, value in enumerate(position)]


def first_reason(unknown: UnknownAxes) -> str:
    """The reason for the first axis whose position is not known."""
    index = min(unknown)
    return unknown[index].format(LETTERS[index])


def leaves_unknown(rapid: Motion, before: set[str], lost: UnknownAxes) -> bool:
    """Whether a rapid says nothing of the axes of the program's frame that are `lost` at its end, and were `before`.

    Where they stand, its correction would depend on. It cuts nothing, and the axes that it names can be corrected as
    soon as the program has named the others: it passes. `before` are the reasons why something was not known.
    """
    return before.issuperset(rapid.unknown.values()) and not any(rapid.axes >> index & 1 for index in lost)
