"""Following a program of the Fanuc family part by part.

Jumps, loops and corners that the control puts in have to do with blocks elsewhere in the text: a program with one of
them is no program for parts, and `runs_straight_on` sees it by the shape of a block. A subprogram in a file of its own
is followed; that the text itself has none of that number is certain only at its end.
"""

from __future__ import annotations

from ncfix.control.following import PartFollower
from ncfix.text.dialect import Dialect
from ncfix.text.language import Run
from ncfix.text.tree import Flow, Program, Template
from ncfix_fanuc.macro.control import MacroControl
from ncfix_fanuc.macro.corners import CORNER, letters_of
from ncfix_fanuc.macro.interpreter import MacroInterpreter

ELSEWHERE = frozenset({970, 990})
"""M97 calls what stands in the text, M99 would end a subprogram in it."""


def runs_straight_on(template: Template) -> bool:
    """Whether a block of this shape has nothing to do with others elsewhere in the text."""
    flows = [item.keyword for item in template.items if isinstance(item, Flow)]
    free = ELSEWHERE.isdisjoint(template.m_codes) and CORNER.isdisjoint(letters_of(template))
    return free and all(keyword == "program" for keyword in flows)


class MacroFollower(PartFollower):
    """See `parts.Follower`."""

    control: MacroControl
    interpreter: MacroInterpreter | None

    def __init__(self, dialect: Dialect, run: Run) -> None:
        super().__init__(MacroControl(run, dialect), run)

    @property
    def to_the_last(self) -> bool:
        """A subprogram that was looked for in files may stand behind the end of the program."""
        return self.interpreter is not None and self.interpreter.flow.looked

    def begin(self, program: Program) -> MacroInterpreter:
        """What goes through the program, of which this is the first part."""
        return MacroInterpreter(self.control, program, self.run, in_parts=True)
