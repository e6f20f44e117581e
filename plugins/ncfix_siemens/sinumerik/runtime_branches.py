"""Branches of SINUMERIK programs that are decided at run time.

An IF whose blocks move nothing and change no coordinates is skipped (`bypassed`). Behind any other undecided branch all
motions that may follow are refused (`sweep`).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from ncfix.control.moves import MotionEnd, MotionKind, Pass, Passing
from ncfix_siemens.sinumerik.flow import SinumerikFlow
from ncfix_siemens.sinumerik.framing import PROGRAMMABLE
from ncfix_siemens.sinumerik.plans import AssignedVariable, Branching, Calling, SinumerikPlan, has_value, names_in
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.unit import SinumerikUnit
from ncfix_siemens.sinumerik.vocabulary import (
    BY_THEMSELVES,
    HARMLESS,
    OF_THE_CONTROL,
    PROBING,
    RESULTS,
    UNSEEN,
    BlockWordValues,
)

DECIDED_AT_RUNTIME = "which blocks are executed from here on is known only at run time"
GIVE = ': it depends on {}; give the value as variables."{}" in the setup file'
NO_MOTIONS = frozenset({40, 740, 750, 250, 260, 1100, 1110, 1120})
MACHINE = frozenset({530, 1530})


def decided_at_runtime(flow: SinumerikFlow) -> str:
    """Why the next block is undecided, naming the unknown variables of the branch."""
    conditions = (part for step in flow.unit.branchings(flow.block - 1) for part in step.written)
    named = dict.fromkeys(name for part in conditions for name in names_in(part))
    unknown = [name.upper() for name in named if not has_value(flow.control.variables, name)]
    return DECIDED_AT_RUNTIME + (GIVE.format(" and ".join(unknown), unknown[0]) if unknown else "")


def sweep(flow: SinumerikFlow, others: Sequence[SinumerikUnit], why: str) -> list[tuple[int, int]]:
    """Refuse the motions of all remaining blocks, and of the programs of the text that they may call.

    Returns the stretches of blocks that may be executed again.
    """
    control = flow.control
    control.refuse_rest(why)
    control.lose_all(why)
    places = [call.back for call in flow.calls] + [(flow.unit, flow.block - 1)]
    first = [found for unit, block in places if not unit.external if (found := earliest(unit, block)) is not None]
    called = callable_from(places, others)
    for unit, block in [*reversed(places), *((unit, unit.begin) for unit in called)]:
        for each in range(block, unit.stop):
            row = each if not unit.external else control.row_block
            refuse(control, unit.plan(each), row, why)
    return [*((block, len(flow.unit.program)) for block in first), *((unit.begin, unit.stop) for unit in called)]


NAME_IN_TEXT, NAMED_BY_TEXT = re.compile(r"\w+"), frozenset({"CALL", "PCALL", "EXTCALL"})


def callable_from(places: Iterable[tuple[SinumerikUnit, int]], others: Iterable[SinumerikUnit]) -> list[SinumerikUnit]:
    """The programs among `others` that blocks from these places on may call, directly or indirectly."""
    found: list[SinumerikUnit] = []
    pending = list(places)
    while pending:
        unit, block = pending.pop()
        lines = (unit.program.text_of(each).partition(";")[0].upper() for each in range(block, unit.stop))
        names = {name for line in lines for name in NAME_IN_TEXT.findall(line)}
        new = [each for each in others if each not in found and (each.name in names or names & NAMED_BY_TEXT)]
        found += new
        pending += [(each, each.begin) for each in new]
    return found


def refuse(control: Sinumerik, plan: SinumerikPlan, block: int, why: str) -> None:
    """Add the motion of a block, if it has one, with unknown end and as refused."""
    if not plan.axes or plan.names & PROGRAMMABLE or not NO_MOTIONS.isdisjoint(plan.g):
        return
    machine = "supa" in plan.names or not MACHINE.isdisjoint(plan.g)
    passing = Passing(Pass.MACHINE_COORDINATES, "machine coordinates") if machine else None
    control.row_block = block
    lost = dict.fromkeys(control.axis_indices, why)
    words = BlockWordValues(block, axes=plan.axes)
    control.go(MotionKind.RAPID, words, MotionEnd(control.position[:], lost, dict(lost)), 0, passing=passing)


def earliest(unit: SinumerikUnit, block: int) -> int | None:
    """The first block before `block` to which a later block may jump back; None if there is none."""
    found: list[int] = []
    for each in range(block, unit.stop):
        if each in unit.begins:
            found.append(unit.begins[each])
        for step in unit.branchings(each):
            found.extend(targets(unit, step, each))
    return min((place for place in found if place < block), default=None)


def targets(unit: SinumerikUnit, step: Branching, block: int) -> list[int]:
    """The blocks to which a jump or repetition may lead."""
    if step.keyword == "gotos":
        return [unit.begin]
    if "goto" not in step.keyword and step.keyword not in ("repeat", "repeatb"):
        return []
    return unit.labelled(step.label) or ([unit.begin] if "goto" in step.keyword else [])


LOUD_M = frozenset({20, 60, 170, 300})
"""M codes, in tenths, that end programs or change tools."""

QUIET_WORDS = frozenset("SH")
INNER = frozenset({"if", "else", "endif"})


def bypassed(control: Sinumerik, flow: SinumerikFlow, step: Branching, steps: Iterable[Branching]) -> bool:
    """Skip an undecided IF whose blocks do not matter; whether it was skipped. `flow.block` is the next block."""
    if step.keyword != "if":
        return False
    here, unit = flow.block - 1, flow.unit
    jump = next((each for each in steps if each.keyword.startswith("goto")), None)
    end = unit.ends.get(here) if jump is None else unit.find(jump.label, here, jump.keyword)
    if end is None or end <= here or not all(is_quiet(unit.plan(block)) for block in range(here + 1, end)):
        return False
    if unbalanced(unit, here, end, alone=jump is None):
        return False
    for block in range(here + 1, end):
        for each in unit.plan(block).steps:
            if isinstance(each, AssignedVariable):
                control.variables.forget(each.name)
    flow.block = end if jump is not None else end + 1
    return True


def is_quiet(plan: SinumerikPlan) -> bool:
    """Whether a block moves nothing, changes no coordinates, and does not jump."""
    if plan.opaque or plan.g or plan.functions or not LOUD_M.isdisjoint(plan.m):
        return False
    if any(setting.address not in QUIET_WORDS for setting in plan.settings):
        return False
    return all(is_quiet_step(step) for step in plan.steps)


def is_quiet_step(step: object) -> bool:
    """Whether an assignment, a name or a control structure moves nothing and changes no coordinates."""
    match step:
        case AssignedVariable(name):
            quiet = not name.startswith("$") and not OF_THE_CONTROL.match(name)
            return quiet and name not in BY_THEMSELVES | UNSEEN.keys() | PROBING
        case Calling(name):
            return name in HARMLESS - RESULTS.keys()
        case Branching(keyword):
            return keyword in INNER or keyword == "label"
    return False


def unbalanced(unit: SinumerikUnit, begin: int, end: int, *, alone: bool) -> bool:
    """Whether a control structure that begins between two blocks ends outside of them."""
    inner = range(begin + (0 if alone else 1), end)
    return any(each in inner and not begin <= last <= end for each, last in unit.ends.items())
