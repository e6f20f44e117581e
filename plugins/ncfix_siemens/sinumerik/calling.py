"""Calls of subprograms: by name, by number, by a text; and names that are none of ours."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

from ncfix_siemens.sinumerik.cycles import AFTER_CYCLE
from ncfix_siemens.sinumerik.framing import into_spindle, set_length
from ncfix_siemens.sinumerik.plans import Calling, plain_text
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.unit import SinumerikUnit

if TYPE_CHECKING:
    from ncfix_siemens.sinumerik.statements import Turn

Find = Callable[[str], SinumerikUnit | None]

UNKNOWN_CYCLE = "NCF252"
TRANSFORMING = ("traori", "transmit", "tracyl", "traang", "tracon", "trafoo")
"""How names of transformations by kinematic chains begin, `TRANSMIT_K`."""

CALLED_BY_TEXT = frozenset({"call", "extcall"})
FILE = re.compile(r"(?:^|[/:])(?:_N_)?(?P<name>\w+?)(?:_(?:SPF|MPF)|\.(?:SPF|MPF))?$", re.IGNORECASE)
"""A program named in a text, perhaps with a path."""


def subprogram(control: Sinumerik, turn: Turn, step: Calling, find: Find) -> None:
    """A subprogram, or a cycle of the machine's builder."""
    if turn.modal:
        text = f"the modal subprogram {step.name.upper()} is in force, which ncfix does not follow"
        control.suspended["cycle"] = text
        return
    unit = find(step.name)
    if unit is not None:
        turn.subprogram, turn.called, turn.arguments, turn.written = unit, step, step.arguments, step.written
        turn.times = round(turn.words.get("P", 1.0))
        return
    if step.name.startswith(TRANSFORMING):
        control.suspended[step.name] = (
            f"the transformation {step.name.upper()} is in force, which ncfix does not follow"
        )
        return
    ran_elsewhere(control, step.name.upper(), changes_tool=control.fresh_tool)


def ran_elsewhere(control: Sinumerik, name: str, *, changes_tool: bool) -> None:
    """A name or number that is no subprogram at hand is taken as a cycle of the builder; it may change the tool."""
    text = f"{name} is not known: it is taken as a cycle that leaves coordinates as they are"
    control.warn(
        UNKNOWN_CYCLE,
        text,
        "if it is a subprogram, say where its file is: --subprograms DIR",
    )
    control.lose_all(AFTER_CYCLE)
    control.changed_by_cycle |= changes_tool
    if "tool" in control.suspended:
        into_spindle(control)
        set_length(control)


def call_by_text(turn: Turn, step: Calling, find: Find) -> bool:
    """`CALL "NAME"`, `EXTCALL("NAME.SPF")`: whether the program is at hand."""
    found = FILE.search(plain_text(step.written[0]) or "") if step.written else None
    unit = find(found["name"]) if found else None
    if unit is None:
        return False
    turn.subprogram, turn.called, turn.times = unit, step, round(turn.words.get("P", 1.0))
    return True


def call_word(control: Sinumerik, turn: Turn, find: Find) -> None:
    """`L123`: a subprogram by its number."""
    value = turn.words.values.get("L")
    if "L" not in turn.words.values:
        return
    if turn.modal:
        control.suspended["cycle"] = "a modal subprogram (MCALL L) is in force, which ncfix does not follow"
        return
    if value is None:
        control.refusal = control.refusal or "which subprogram is called (L) is known only at run time"
        return
    unit = find(f"L{value:g}")
    if unit is None:
        turn.elsewhere = f"L{value:g}"
        return
    turn.subprogram, turn.times = unit, round(turn.words.get("P", 1.0))
