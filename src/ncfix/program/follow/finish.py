"""What there is to say when a program has been followed, the same for all languages."""

from __future__ import annotations

from ncfix.diagnostics import UsageError
from ncfix.program import stamp
from ncfix.program.follow import rollover
from ncfix.program.follow.control import Control
from ncfix.program.moves import Moves, Trace
from ncfix.program.tree import Program


def finished(control: Control, program: Program, moves: Moves) -> Trace:
    """The trace of a program; raises UsageError with all that was not given."""
    rollover.say(control, program)
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
