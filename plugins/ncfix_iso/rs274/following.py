"""Following a program of the RS274 family part by part."""

from __future__ import annotations

from dataclasses import replace

from ncfix.control.following import PartFollower, Walk
from ncfix.control.parts import Remains
from ncfix.text.dialect import Dialect
from ncfix.text.language import Run
from ncfix.text.tree import Program
from ncfix_iso.rs274.control import Control
from ncfix_iso.rs274.interpreter import Interpreter
from ncfix_iso.rs274.parameters import Store


class PartInterpreter(Interpreter):
    """An interpreter whose text ends where the next part begins.

    first  this is the first part
    last   this is the last part
    ended  the program has ended
    """

    first = True
    last = False
    ended = False

    def next_part(self, program: Program) -> None:
        """Take the next part."""
        self.main = self.main.followed_by(program)
        self.flow.unit, self.flow.block = self.main, 0
        self.first = False

    def run_part(self, last: bool, max_blocks: int) -> None:
        """Follow the part to its end, or to that of the program."""
        self.control.budget.left = max_blocks
        self.last = last
        self.ended = True
        self.run()

    def at_end_of_text(self) -> None:
        """The text is over; that of the program only if it was the last part."""
        if self.last:
            super().at_end_of_text()
        else:
            self.ended = False

    def at_tape(self, index: int) -> bool:
        """`%` ends the tape, if it does not begin it."""
        if self.first:
            return super().at_tape(index)
        if fault := self.flow.unfinished():
            raise fault
        return True


PASSING = frozenset(
    {
        *("setup", "kinematics", "dialect", "rules", "builder", "locate"),
        *("knowledge", "modal", "parameters", "position"),
        *("budget", "row_block", "numbers", "first"),
    }
)
"""Of a control: what never changes, what `lasting` looks into or `Remains` says, and what each block sets anew."""


class RS274Follower(PartFollower):
    """See `parts.Follower`."""

    control: Control

    def __init__(self, dialect: Dialect, run: Run) -> None:
        super().__init__(Control(run, dialect), run)

    def begin(self, program: Program) -> Walk:
        """What goes through the program, of which this is the first part."""
        return PartInterpreter(self.control, program, self.resolve, self.budget(program))

    def lasting(self) -> str:
        """All that the control keeps."""
        control = self.control
        modal, parameters, knowledge = control.modal, control.parameters, control.knowledge
        cycle = replace(modal.cycle, initial=None)
        kept = [each for name, each in vars(control).items() if name not in PASSING]
        kept.append(replace(modal, motion=0, straight=0, feed=0.0, feed_given=False, cycle=cycle))
        kept += (parameters.scopes, parameters.returned, knowledge.missing, knowledge.assumed)
        return repr(kept)

    def parameters(self) -> Store:
        """The numbered parameters."""
        return self.control.parameters.numbers.copy()

    def resume(self, remains: Remains) -> None:
        """See `parts.Follower`."""
        super().resume(remains)
        self.control.parameters.numbers = remains.parameters.copy()
