"""Following a program of SINUMERIK part by part.

Jumps, labels, loops and subprograms in the text lead anywhere: a program with one of them is no program for parts, and
`runs_straight_on` sees it by the shape of a block. Two rules look at the whole text: with an M6 anywhere, T does not
change the tool by itself; and where a block has only one of AP and RP, all blocks that have them depend on each other.
"""

from __future__ import annotations

import numpy as np

from ncfix.control.faults import Fault
from ncfix.control.following import PartFollower
from ncfix.control.parts import NotInPartsError
from ncfix.text import reach
from ncfix.text.dialect import Dialect
from ncfix.text.language import Run
from ncfix.text.tree import Program, Template
from ncfix_siemens.sinumerik.course import AtRuntimeError, Course
from ncfix_siemens.sinumerik.destination import Words
from ncfix_siemens.sinumerik.interpreter import Interpreter, changes_tools
from ncfix_siemens.sinumerik.plans import Plan
from ncfix_siemens.sinumerik.poles import polar_words
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.unit import HEAD, PROCEDURE, Unit


def runs_straight_on(template: Template) -> bool:
    """Whether a block of this shape has nothing to do with others elsewhere in the text."""
    return reach.runs_straight_on(template) and len(polar_words(template)) != 1


class PartInterpreter(Interpreter):
    """An interpreter whose text ends where the next part begins.

    ended  the program has ended
    called a tool has been called
    """

    ended = False
    called = False

    def next_part(self, program: Program) -> None:
        """Take the next part."""
        unit = Unit(self.units[0].text.followed_by(program), 0, len(program))
        if begins_a_program(unit):
            raise NotInPartsError("the text holds several programs")
        if self.control.modes.modal_cycle is not None:
            raise NotInPartsError("a cycle (MCALL) goes on in the next part, whose motions are those of its block")
        if self.at_once and changes_tools(unit.text.plans, program.source):
            if self.called:
                raise NotInPartsError("there is an M6 only further down")
            self.at_once = False
        self.units = [unit]
        self.course = Course(self.control, unit, 0)

    def run_part(self, last: bool, max_blocks: int) -> None:
        """Follow the part to its end, or to that of the program."""
        self.control.budget.left = max_blocks
        try:
            self.ended = self.walk() or last
        except AtRuntimeError:
            raise NotInPartsError("what is executed is decided at run time") from None
        except Fault as fault:
            raise self.error(fault) from None

    def evaluate(self, plan: Plan, index: int) -> Words:
        """The values of the words of a block."""
        words = super().evaluate(plan, index)
        self.called |= "T" in words.values or "T" in words.texts
        return words


def begins_a_program(unit: Unit) -> bool:
    """Whether a program or procedure begins in a text."""
    shapes = [shape for shape, plan in enumerate(unit.text.plans) if "program head" in plan.opaque]
    texts = map(unit.program.text_of, np.flatnonzero(np.isin(unit.program.template, shapes)).tolist())
    return any(HEAD.match(text) or PROCEDURE.search(text) for text in texts)


class SinumerikFollower(PartFollower):
    """See `parts.Follower`."""

    control: Sinumerik

    def __init__(self, dialect: Dialect, run: Run) -> None:
        super().__init__(Sinumerik(run, dialect), run)

    @property
    def to_the_last(self) -> bool:
        """A name may be that of a subprogram behind the end of the program."""
        return True

    def begin(self, program: Program) -> PartInterpreter:
        """What goes through the program, of which this is the first part."""
        walk = PartInterpreter(self.control, program, self.resolve, self.budget(program))
        if len(walk.units) > 1:
            raise NotInPartsError("the text holds several programs")
        return walk
