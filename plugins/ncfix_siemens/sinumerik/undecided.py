"""Branches that are decided at run time: those that need not be followed, and what is refused behind all others.

Where a branch holds nothing but assignments and messages the axes stand where they stood, whichever way the control
goes; what it may assign is not known after it. Behind any other branch every motion may come from anywhere, and is
refused; blocks further up that a jump or loop may lead back to are refused too, though they have been followed once.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ncfix.control.moves import MotionKind, Moves, Pass, Passing, Rule
from ncfix_siemens.sinumerik.destination import BlockWordValues, End, ProgrammedMotion
from ncfix_siemens.sinumerik.flow import SinumerikFlow
from ncfix_siemens.sinumerik.framing import PROGRAMMABLE
from ncfix_siemens.sinumerik.lettings import BY_THEMSELVES
from ncfix_siemens.sinumerik.plans import Branching, Calling, Letting, SinumerikPlan
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.unit import SinumerikUnit
from ncfix_siemens.sinumerik.vocabulary import HARMLESS, OF_THE_CONTROL, PROBING, UNSEEN

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
