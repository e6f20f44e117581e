"""The rules by which a motion passes as it is: all there are, what each may pass, and why that is right.

A motion that is neither corrected nor refused has one of these rules, whatever the language of its program, and the
reports count it by that rule. What no rule here may pass is corrected or refused: a feed, say, is never passed because
nobody has said where an axis stands.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

from ncfix.control.moves import MotionKind

if TYPE_CHECKING:
    from collections.abc import Mapping


class Pass(IntEnum):
    """A rule by which a motion passes, as columns hold it; `NONE` for all that do not pass."""

    NONE = 0
    DWELL = 1
    MACHINE_COORDINATES = 2
    REFERENCE_POINT = 3
    PROBING = 4
    UNSAID = 5
    LED = 6
    ALIGNMENT = 7
    ROTARY_ALONE = 8
    RETRACTION = 9
    DEPARTURE = 10


class PassRule(NamedTuple):
    """What a rule may pass.

    name   in reports
    kinds  of motions; all others are refused instead
    cuts   at feed they may cut something, and the program is not known to cut right there
    why    it is right to leave them alone
    """

    name: str
    kinds: frozenset[MotionKind]
    cuts: bool
    why: str


class Passing(NamedTuple):
    """Why one motion passes: the rule, and that in the words of its program."""

    rule: Pass
    words: str


RAPIDS = frozenset({MotionKind.RAPID})
STRAIGHT = frozenset({MotionKind.RAPID, MotionKind.FEED})

PASS_RULES: Mapping[Pass, PassRule] = {
    Pass.DWELL: PassRule("dwell", frozenset({MotionKind.DWELL}), False, "Nothing moves."),
    Pass.MACHINE_COORDINATES: PassRule(
        "machine coordinates",
        STRAIGHT | {MotionKind.ARC},
        True,
        "The program means places of the machine's axes (a tool changer, a limit), not places on the workpiece.",
    ),
    Pass.REFERENCE_POINT: PassRule(
        "reference point", RAPIDS, False, "The machine goes to a place of its own, and cuts nothing."
    ),
    Pass.PROBING: PassRule(
        "probing", STRAIGHT, False, "It ends where the probe switches, and what it measures must stay comparable."
    ),
    Pass.UNSAID: PassRule(
        "rapid while an axis has not been said",
        RAPIDS,
        False,
        "Its correction would need a word for an axis of which nobody has said where it stands. It cuts nothing, and "
        "the first block that names the axis is corrected.",
    ),
    Pass.LED: PassRule(
        "rapid from where the control has led the tool",
        RAPIDS,
        False,
        "Only the control knows where it begins. It cuts nothing, and the next block that names the axes is corrected.",
    ),
    Pass.ALIGNMENT: PassRule(
        "rotary axes positioned by the control",
        RAPIDS,
        False,
        "The control works out the angles (PLANE, CYCLE800, G53.1); the tip is corrected where it moves next.",
    ),
    Pass.ROTARY_ALONE: PassRule(
        "rotary axes alone in a tilted plane",
        STRAIGHT,
        True,
        "Linear axes stand still, and words for them would mean the plane; the tip is corrected where it moves next.",
    ),
    Pass.RETRACTION: PassRule(
        "retraction by the control", RAPIDS, False, "The control works out where it ends (M140). It cuts nothing."
    ),
    Pass.DEPARTURE: PassRule(
        "departure from a contour",
        frozenset({MotionKind.FEED}),
        True,
        "The control goes on from the corrected end of the contour (DEP); no word says where that leads.",
    ),
}
"""The list: nothing else may pass."""


def may_pass(passing: Passing, kind: MotionKind) -> bool:
    """Whether a rule may pass a motion of this kind."""
    return kind in PASS_RULES[passing.rule].kinds
