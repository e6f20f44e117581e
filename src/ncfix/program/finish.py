"""What there is to say when a program has been followed, the same for all languages."""

from __future__ import annotations

from typing import Protocol

from ncfix.diagnostics import Message, UsageError
from ncfix.program import stamp
from ncfix.program.follow.knowledge import Knowledge
from ncfix.program.moves import Moves, Trace
from ncfix.program.tree import Program


class Control(Protocol):
    """A control that has followed a program.

    foreign    axes that the program moves and the machine lacks
    knowledge  what was not given, and what was assumed
    messages   what else there is to say
    """

    foreign: dict[str, Message]
    knowledge: Knowledge
    messages: dict[str, Message]


def finished(control: Control, program: Program, moves: Moves) -> Trace:
    """The trace of a program; raises UsageError with all that was not given."""
    lacking = (*control.foreign.values(), *control.knowledge.missing.values())
    if lacking:
        raise UsageError.collected(lacking)
    marked = stamp.find(program)
    return Trace(
        moves=moves,
        messages=(*control.knowledge.assumed.values(), *control.messages.values()),
        assumed=tuple(control.knowledge.assumed),
        stamp="" if marked is None else program.text_of(marked),
    )
