"""Names that get a value and are no variables: axes that move by themselves, probing, data of the control."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.control.coordinates import INDEX, LETTERS
from ncfix.control.expressions import number
from ncfix.control.moves import MotionKind
from ncfix_siemens.sinumerik.destination import BlockWordValues, End, ProgrammedMotion, destination
from ncfix_siemens.sinumerik.plans import Letting
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.vocabulary import (
    ASYNCHRONOUS,
    MOTIONS,
    OF_THE_CONTROL,
    PROBING,
    UNFOLLOWED_MOTIONS,
    UNSEEN,
)

if TYPE_CHECKING:
    from ncfix_siemens.sinumerik.statements import Turn

AFTER_POSITIONING = "where the axis {} stands after it was positioned by itself is not followed"
POLYNOMIAL, POLYNOMIALS = "po", UNFOLLOWED_MOTIONS[MOTIONS["poly"]]
GO_SOMEWHERE = frozenset({"pos", "posa", "posp", "ax"})
DESELECTED = frozenset({"tcarr", "cutmod"})
"""Names of which zero takes out of force what is refused where another number brings it into force."""

BY_THEMSELVES = frozenset(ASYNCHRONOUS) | GO_SOMEWHERE | {POLYNOMIAL}
"""What with an axis as index lets it move on its own, `POS[X]=100`, or says where it goes, `PO[X]=(10,2)`."""


def let_axis_go(control: Sinumerik, turn: Turn, step: Letting) -> None:
    """POS[X]=.. and its like: an axis that moves by itself; where it arrives is not followed."""
    name = step.index[0](control) if step.index else None
    known = isinstance(name, str) and name in INDEX and INDEX[name] in control.machine
    if step.name == POLYNOMIAL:
        follow_polynomial(control, turn, step, str(name) if known else None)
        return
    gone = (INDEX[str(name)],) if known else () if isinstance(name, str) else control.machine
    if not gone:
        return
    why = ASYNCHRONOUS.get(step.name, "a positioning axis (POS)")
    if step.name in GO_SOMEWHERE:
        still = BlockWordValues(turn.words.block, {}, {}, sum(1 << index for index in gone))
        lost = dict(control.lost) | dict.fromkeys(gone, AFTER_POSITIONING)
        control.go(
            ProgrammedMotion(
                MotionKind.RAPID, still, End(control.position[:], control.axes_of(lost), lost), 0, refusal=why
            )
        )
    else:
        control.refusal = control.refusal or f"{why} is not followed"


def follow_polynomial(control: Sinumerik, turn: Turn, step: Letting, letter: str | None) -> None:
    """PO[X]=(end, a2, a3): the axis ends where the first number says; without one, or for an angle, nobody knows."""
    first = next(iter(step.listed), step.value)
    value = first(control) if first is not None and letter is not None else None
    letters = LETTERS if letter is None else letter
    axes = [each for each in letters if INDEX[each] in control.machine]
    ends: dict[str, float | None] = dict.fromkeys(axes, None if value is None else number(value))
    words = BlockWordValues(turn.words.block, ends, {}, sum(1 << INDEX[each] for each in axes))
    control.go(
        ProgrammedMotion(MotionKind.FEED, words, destination(control, words), MOTIONS["poly"], refusal=POLYNOMIALS)
    )


def note_letting(control: Sinumerik, turn: Turn, step: Letting) -> None:
    """A name that gets a value and is no variable, or one with which the control changes."""
    if step.name in DESELECTED and step.value is not None and step.value(control) == 0.0:
        return
    if OF_THE_CONTROL.match(step.name):
        why = f"the program sets {step.name.upper()}, which may change coordinates or tool lengths"
        control.refusal = control.refusal or why
    elif step.name in PROBING:
        turn.special.add("meas")
    elif step.name in UNSEEN and step.index:
        control.refusal = control.refusal or f"{UNSEEN[step.name]} is not followed"
