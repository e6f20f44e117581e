"""What the run decides: assignments that set no variable, and branches.

Assignments to axes that move by themselves, to probing and to data of the control; branches that need not be followed,
and what is refused behind all others.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ncfix.control.coordinates import INDEX, LETTERS, mask_of
from ncfix.control.expressions import number
from ncfix.control.moves import MotionKind, Moves, Pass, Passing, Rule
from ncfix_siemens.sinumerik.destination import destination
from ncfix_siemens.sinumerik.flow import SinumerikFlow
from ncfix_siemens.sinumerik.framing import PROGRAMMABLE
from ncfix_siemens.sinumerik.plans import Branching, Calling, Letting, SinumerikPlan
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.unit import SinumerikUnit
from ncfix_siemens.sinumerik.values import BlockWordValues, End, ProgrammedMotion
from ncfix_siemens.sinumerik.vocabulary import (
    ASYNCHRONOUS,
    HARMLESS,
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
        still = BlockWordValues(turn.words.block, {}, {}, mask_of(gone))
        lost = control.lost | control.along_frame(dict.fromkeys(gone, AFTER_POSITIONING))
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
    words = BlockWordValues(turn.words.block, ends, {}, mask_of(INDEX[each] for each in axes))
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


DECIDED_AT_RUNTIME = "which blocks are executed here is decided at run time"
NO_MOTIONS = frozenset({40, 740, 750, 250, 260, 1100, 1110, 1120})
MACHINE = frozenset({530, 1530})


def sweep(flow: SinumerikFlow) -> int | None:
    """Refuse the motions of all that is left; the first block that may be executed again, None for none."""
    control = flow.control
    control.refusal = control.refusal or DECIDED_AT_RUNTIME
    control.lose_all(DECIDED_AT_RUNTIME)
    places = [call.back for call in flow.calls] + [(flow.unit, flow.block - 1)]
    again = [found for unit, block in places if not unit.external if (found := earliest(unit, block)) is not None]
    for unit, block in reversed(places):
        for each in range(block, unit.stop):
            row = each if not unit.external else control.row_block
            refuse(control, unit.plan(each), row)
    return min(again, default=None)


def refuse(control: Sinumerik, plan: SinumerikPlan, block: int) -> None:
    """Note the motion of a block, if it has one."""
    if not plan.axes or plan.names & PROGRAMMABLE or not NO_MOTIONS.isdisjoint(plan.g):
        return
    machine = "supa" in plan.names or not MACHINE.isdisjoint(plan.g)
    passing = Passing(Pass.MACHINE_COORDINATES, "machine coordinates") if machine else None
    control.row_block = block
    lost = dict.fromkeys(control.machine, DECIDED_AT_RUNTIME)
    words = BlockWordValues(block, {}, {}, plan.axes)
    control.go(
        ProgrammedMotion(MotionKind.RAPID, words, End(control.position[:], lost, dict(lost)), 0, passing=passing)
    )


def earliest(unit: SinumerikUnit, block: int) -> int | None:
    """The first block before `block` that something after it may lead back to."""
    found: list[int] = []
    for each in range(block, unit.stop):
        if each in unit.begins:
            found.append(unit.begins[each])
        for step in unit.branchings(each):
            found.extend(targets(unit, step, each))
    return min((place for place in found if place < block), default=None)


def targets(unit: SinumerikUnit, step: Branching, block: int) -> list[int]:
    """Where a jump or a repetition may lead."""
    if step.keyword == "gotos":
        return [unit.begin]
    if "goto" not in step.keyword and step.keyword not in ("repeat", "repeatb"):
        return []
    if not step.label:
        return [unit.begin] if "goto" in step.keyword else []
    return unit.labelled(step.label)


def demoted(moves: Moves, first: int | None) -> Moves:
    """The motions with those of blocks from `first` on refused, which may be executed again from another state."""
    if first is None:
        return moves
    rows = (moves.block >= first) & (moves.rule == Rule.CORRECT)
    if not rows.any():
        return moves
    reasons = moves.reasons if DECIDED_AT_RUNTIME in moves.reasons else (*moves.reasons, DECIDED_AT_RUNTIME)
    reason = np.where(rows, reasons.index(DECIDED_AT_RUNTIME), moves.reason).astype(np.int16)
    rule = np.where(rows, Rule.REFUSE, moves.rule).astype(np.int8)
    return replace(moves, rule=rule, reason=reason, reasons=reasons)


LOUD_M = frozenset({20, 60, 170, 300})
"""M codes, in tenths, that end programs or change tools."""

QUIET_WORDS = frozenset("SH")
INNER = frozenset({"if", "else", "endif"})


def bypassed(control: Sinumerik, flow: SinumerikFlow, step: Branching, steps: Iterable[Branching]) -> bool:
    """Go past a branch that nobody can decide, if nothing in it matters; `flow.block` is that of the next line."""
    if step.keyword != "if":
        return False
    here, unit = flow.block - 1, flow.unit
    jump = next((each for each in steps if each.keyword.startswith("goto")), None)
    end = unit.find(jump.label, here, jump.keyword) if jump is not None and jump.label else unit.ends.get(here)
    if end is None or end <= here or not all(is_quiet(unit.plan(block)) for block in range(here + 1, end)):
        return False
    if unbalanced(unit, here, end, alone=jump is None):
        return False
    for block in range(here + 1, end):
        for each in unit.plan(block).steps:
            if isinstance(each, Letting):
                control.variables.forget(each.name)
    flow.block = end if jump is not None else end + 1
    return True


def is_quiet(plan: SinumerikPlan) -> bool:
    """Whether a block moves nothing, changes no coordinates, and leads nowhere else."""
    if plan.opaque or plan.g or not LOUD_M.isdisjoint(plan.m):
        return False
    if any(setting.address not in QUIET_WORDS for setting in plan.settings):
        return False
    return all(is_quiet_step(step) for step in plan.steps)


def is_quiet_step(step: object) -> bool:
    """Whether an assignment, a name or a control structure does no more than that."""
    match step:
        case Letting(name):
            quiet = not name.startswith("$") and not OF_THE_CONTROL.match(name)
            return quiet and name not in BY_THEMSELVES | UNSEEN.keys() | PROBING
        case Calling(name):
            return name in HARMLESS
        case Branching(keyword):
            return keyword in INNER or keyword == "label"
    return False


def unbalanced(unit: SinumerikUnit, begin: int, end: int, *, alone: bool) -> bool:
    """Whether a structure that begins between two blocks ends elsewhere."""
    inner = range(begin + (0 if alone else 1), end)
    return any(each in inner and not begin <= last <= end for each, last in unit.ends.items())
