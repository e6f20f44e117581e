"""Following a program of the RS274 family part by part."""

from __future__ import annotations

from dataclasses import replace

from ncfix.control.following import PartFollower
from ncfix.control.parts import Remains
from ncfix.text.dialect import Dialect
from ncfix.text.language import Run
from ncfix.text.tree import Program
from ncfix_iso.rs274.control import Control
from ncfix_iso.rs274.interpreter import RS274Interpreter
from ncfix_iso.rs274.parameters import Store

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

    def begin(self, program: Program) -> RS274Interpreter:
        """What goes through the program, of which this is the first part."""
        return RS274Interpreter(self.control, program, self.run, in_parts=True)

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
