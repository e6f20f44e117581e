"""Following a program part by part: the control keeps its state, the interpreter goes on where it was."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnostics import Message
from ncfix.program.follow import rollover
from ncfix.program.follow.control import Control
from ncfix.program.follow.finish import check_reach
from ncfix.program.language import Run
from ncfix.program.moves import Moves
from ncfix.program.tree import Program


class Walk(Protocol):
    """An interpreter that takes one part after the other.

    ended  the program has ended
    """

    ended: bool

    def next_part(self, program: Program) -> None:
        """Take the next part."""

    def run_part(self, last: bool, max_blocks: int) -> None:
        """Follow the part to its end, or to that of the program."""


class PartFollower(ABC):
    """What the followers of all languages do alike; see `parts.Follower`."""

    def __init__(self, control: Control, run: Run) -> None:
        self.control = control
        self.resolve = run.resolve
        self.budget = run.budget
        self.interpreter: Walk | None = None

    @abstractmethod
    def begin(self, program: Program) -> Walk:
        """What goes through the program, of which this is the first part."""

    @property
    def to_the_last(self) -> bool:
        """What stands behind the end of the program matters."""
        return False

    @property
    def ended(self) -> bool:
        """The control has come to the end of the program."""
        return self.interpreter is not None and self.interpreter.ended

    def follow(self, program: Program, last: bool) -> Moves:
        """The motions of the next part."""
        if self.interpreter is None:
            self.interpreter = self.begin(program)
        else:
            self.interpreter.next_part(program)
        self.control.builder.clear()
        self.interpreter.run_part(last, self.budget(program))
        moves = self.control.moves()
        check_reach(program, moves)
        rollover.say(self.control, program)
        return moves

    def stand(self, position: NDArray[np.float64]) -> None:
        """Take the axes to a command (n_axes,), mm and rad."""
        self.control.position = list(self.control.position)
        for column, value in zip(self.control.builder.columns, position.tolist(), strict=True):
            self.control.position[column] = value

    @property
    def lacking(self) -> tuple[Message, ...]:
        """What has been missing so far."""
        return (*self.control.foreign.values(), *self.control.knowledge.missing.values())

    @property
    def messages(self) -> tuple[Message, ...]:
        """What there is to say so far."""
        return (*self.control.knowledge.assumed.values(), *self.control.messages.values())

    @property
    def assumed(self) -> tuple[str, ...]:
        """What was taken as zero so far."""
        return tuple(self.control.knowledge.assumed)
