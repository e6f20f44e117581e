"""Branches decided at run time that hold nothing but assignments and messages: they need not be followed.

Whichever way the control goes, the axes stand where they stood. What such a branch may assign is not known after it.
"""

from __future__ import annotations

from collections.abc import Iterable

from ncfix_siemens.sinumerik.course import Course
from ncfix_siemens.sinumerik.lettings import BY_THEMSELVES
from ncfix_siemens.sinumerik.plans import Branching, Calling, Letting, Plan
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.unit import SinumerikUnit
from ncfix_siemens.sinumerik.vocabulary import HARMLESS, OF_THE_CONTROL, PROBING, UNSEEN

LOUD_M = frozenset({20, 60, 170, 300})
"""M codes, in tenths, that end programs or change tools."""

QUIET_WORDS = frozenset("SH")
INNER = frozenset({"if", "else", "endif"})


def bypassed(control: Sinumerik, course: Course, step: Branching, steps: Iterable[object]) -> bool:
    """Go past a branch that nobody can decide, if nothing in it matters; `course.block` is that of the next line."""
    if step.keyword != "if":
        return False
    here, unit = course.block - 1, course.unit
    jump = next((s for s in steps if isinstance(s, Branching) and s.keyword.startswith("goto")), None)
    end = unit.find(jump.label, here, jump.keyword) if jump is not None and jump.label else unit.ends.get(here)
    if end is None or end <= here or not all(is_quiet(unit.plan(block)) for block in range(here + 1, end)):
        return False
    if unbalanced(unit, here, end, alone=jump is None):
        return False
    for block in range(here + 1, end):
        for each in unit.plan(block).steps:
            if isinstance(each, Letting):
                control.variables.forget(each.name)
    course.block = end if jump is not None else end + 1
    return True


def is_quiet(plan: Plan) -> bool:
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
