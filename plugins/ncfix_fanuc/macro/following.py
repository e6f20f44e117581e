"""Following a program of the Fanuc family part by part.

Jumps, loops and corners that the control puts in have to do with blocks elsewhere in the text: a program with one of
them is no program for parts, and `runs_straight_on` sees it by the shape of a block. A subprogram in a file of its own
is followed; that the text itself has none of that number is certain only at its end.
"""

from __future__ import annotations

from collections.abc import Iterator

from ncfix.control.faults import Fault
from ncfix.control.following import PartFollower
from ncfix.control.parts import NotInPartsError
from ncfix.text.dialect import Dialect
from ncfix.text.language import Run
from ncfix.text.tree import Flow, Program, Template
from ncfix_fanuc.macro.control import MacroControl
from ncfix_fanuc.macro.corners import CORNER, letters_of
from ncfix_fanuc.macro.flow import MacroFlow
from ncfix_fanuc.macro.interpreter import MacroInterpreter
from ncfix_fanuc.macro.outline import head_of
from ncfix_iso.rs274.flow import NO_SUBPROGRAM
from ncfix_iso.rs274.following import PartInterpreter
from ncfix_iso.rs274.unit import Unit

ELSEWHERE = frozenset({970, 990})
"""M97 calls what stands in the text, M99 would end a subprogram in it."""


def runs_straight_on(template: Template) -> bool:
    """Whether a block of this shape has nothing to do with others elsewhere in the text."""
    flows = [item.keyword for item in template.items if isinstance(item, Flow)]
    free = ELSEWHERE.isdisjoint(template.m_codes) and CORNER.isdisjoint(letters_of(template))
    return free and all(keyword == "program" for keyword in flows)


class PartFlow(MacroFlow):
    """Where execution stands in a text of which only a part is known.

    heads   numbers and names of the program itself
    looked  a subprogram has been looked for
    """

    heads: frozenset[str] = frozenset()
    looked = False

    def entry(self, label: str) -> tuple[Unit, int]:
        """The text and block at which a program begins that is called."""
        self.looked = True
        if label in self.heads:
            raise NotInPartsError("the program calls itself")
        try:
            return super().entry(label)
        except Fault as fault:
            if fault.code == NO_SUBPROGRAM:
                raise NotInPartsError("a subprogram may stand further down") from None
            raise

    def take(self, unit: Unit) -> None:
        """Go on in the next part; raises `NotInPartsError` if another program begins in it."""
        self.unit = self.main = unit
        self.block = 0
        self.outlines.clear()
        if unit.flows or any(head_of(template) for template in used(unit.program)):
            self.begin_at_heads()

    def begin_at_heads(self) -> None:
        """Take note of the head of the program; raises `NotInPartsError` if it is not the only one."""
        outline = self.outline_of(self.main)
        if len(outline.starts) + len(self.heads) > 1:
            raise NotInPartsError("the text holds several programs")
        self.heads |= outline.programs.keys()


def used(program: Program) -> Iterator[Template]:
    """The shapes that occur in a part."""
    return (program.templates[shape] for shape in set(program.template.tolist()))


class PartMacroInterpreter(PartInterpreter, MacroInterpreter):
    """An interpreter of Macro B whose text ends where the next part begins."""

    flow: PartFlow

    def prepared(self) -> PartFlow:
        """Give the control its own variables; where execution begins."""
        super().prepared()
        flow = PartFlow(self.control, self.main, self.find)
        flow.begin_at_heads()
        return flow

    def next_part(self, program: Program) -> None:
        """Take the next part."""
        super().next_part(program)
        self.flow.take(self.main)

    def is_there(self, label: str) -> bool:
        """Whether there is a program of that number."""
        self.flow.looked = True
        return super().is_there(label)

    def coming(self) -> Iterator[Template]:
        """The shapes of the blocks that follow in the text, as far as they are known."""
        yield from super().coming()
        if self.flow.unit is self.main and not self.last:
            raise NotInPartsError("what follows a tool length is in the next part")

    def at_end_of_text(self) -> None:
        """The text is over, this part of it, or that of a subprogram, which should have returned."""
        if self.flow.calls:
            raise self.flow.missing_end()
        super().at_end_of_text()


class MacroFollower(PartFollower):
    """See `parts.Follower`."""

    control: MacroControl
    interpreter: PartMacroInterpreter | None

    def __init__(self, dialect: Dialect, run: Run) -> None:
        super().__init__(MacroControl(run, dialect), run)

    @property
    def to_the_last(self) -> bool:
        """A subprogram that was looked for in files may stand behind the end of the program."""
        return self.interpreter is not None and self.interpreter.flow.looked

    def begin(self, program: Program) -> PartMacroInterpreter:
        """What goes through the program, of which this is the first part."""
        return PartMacroInterpreter(self.control, program, self.resolve, self.budget(program))
