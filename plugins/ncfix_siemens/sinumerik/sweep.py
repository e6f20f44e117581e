"""What follows a branch that is decided at run time: every motion there may come from anywhere, and is refused.

Blocks further up that a jump or loop may lead back to are refused too, though they have been followed once.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ncfix.control.moves import Kind, Moves, Rule
from ncfix.control.passing import Pass, Passing
from ncfix_siemens.sinumerik.course import Course
from ncfix_siemens.sinumerik.destination import End, Leg, Words
from ncfix_siemens.sinumerik.framing import PROGRAMMABLE
from ncfix_siemens.sinumerik.plans import Branching, Plan
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.unit import SinumerikUnit

DECIDED_AT_RUNTIME = "which blocks are executed here is decided at run time"
NO_MOTIONS = frozenset({40, 740, 750, 250, 260, 1100, 1110, 1120})
MACHINE = frozenset({530, 1530})


def sweep(course: Course) -> int | None:
    """Refuse the motions of all that is left; the first block that may be executed again, None for none."""
    control = course.control
    control.refusal = control.refusal or DECIDED_AT_RUNTIME
    control.lose_all(DECIDED_AT_RUNTIME)
    places = [(call.unit, call.block) for call in course.calls] + [(course.unit, course.block - 1)]
    again = [found for unit, block in places if not unit.external if (found := earliest(unit, block)) is not None]
    for unit, block in reversed(places):
        for each in range(block, unit.stop):
            row = each if not unit.external else control.row_block
            refuse(control, unit.plan(each), row)
    return min(again, default=None)


def refuse(control: Sinumerik, plan: Plan, block: int) -> None:
    """Note the motion of a block, if it has one."""
    if not plan.axes or plan.names & PROGRAMMABLE or not NO_MOTIONS.isdisjoint(plan.g):
        return
    machine = "supa" in plan.names or not MACHINE.isdisjoint(plan.g)
    passing = Passing(Pass.MACHINE_COORDINATES, "machine coordinates") if machine else None
    control.row_block = block
    lost = dict.fromkeys(control.machine, DECIDED_AT_RUNTIME)
    words = Words(block, {}, {}, plan.axes)
    control.go(Leg(Kind.RAPID, words, End(control.position[:], lost, dict(lost)), 0, passing=passing))


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
