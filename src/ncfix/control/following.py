"""Following a program part by part: the control keeps its state, the interpreter goes on where it was."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.control import rollover
from ncfix.control.control import Control
from ncfix.control.finish import check_reach
from ncfix.control.interpreter import Interpreter
from ncfix.control.moves import Kind, Moves
from ncfix.control.parts import NotInPartsError, Remains
from ncfix.diagnostics import Message
from ncfix.text.language import Run
from ncfix.text.tree import Program


class PartFollower(ABC):
    """What the followers of all languages do alike; see `parts.Follower`."""

    def __init__(self, control: Control, run: Run) -> None:
        self.control = control
        self.run = run
        self.interpreter: Interpreter[Any] | None = None
        self.watched = self.unchanged = False

    @abstractmethod
    def begin(self, program: Program) -> Interpreter[Any]:
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
        begun = self.lasting() if self.watched and self.interpreter is not None else None
        if self.interpreter is None:
            self.interpreter = self.begin(program)
        else:
            self.interpreter.next_part(program, self.run.budget(program))
        self.control.builder.clear()
        self.interpreter.last = last
        self.interpreter.run()
        if self.control.switches:
            raise NotInPartsError("blocks with / may be skipped, and all positions of block delete are looked at")
        moves = self.control.moves()
        check_reach(program, moves)
        rollover.say(self.control, program)
        self.unchanged = begun is not None and begun == self.lasting()
        return moves

    def lasting(self) -> str | None:
        """All that the control keeps, but for what `Remains` says, so that it can be compared; None: not said."""
        return None

    def remains(self, moves: Moves) -> Remains | None:
        """What the part left behind, if its last two blocks are straight motions, and no more than that has changed."""
        control, modal = self.control, self.control.modal
        if not self.unchanged or control.unknown or control.builder.winding is not None or len(moves) < 2:
            return None
        straight = np.isin(moves.kind[-2:], (Kind.RAPID, Kind.FEED)) & np.isin(moves.modal[-2:], (0, 10))
        if not straight.all() or moves.block[-2] + 1 != moves.block[-1] or _changes_tools(moves):
            return None
        before = moves.start[-1].tolist(), float(moves.feed[-2]), modal.feed_given, int(moves.modal[-2])
        return Remains(*before, self.parameters())

    def resume(self, remains: Remains) -> None:
        """Go on behind what has been followed elsewhere."""
        modal = self.control.modal
        self.stand(np.array(remains.position))
        modal.feed, modal.feed_given = remains.feed, remains.feed_given
        modal.motion = modal.straight = remains.motion
        modal.cycle.initial = None

    def parameters(self) -> Any:
        """What the program may have set, to go from one process to another."""
        return None

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
        return rollover.remarks(self.control)

    @property
    def assumed(self) -> tuple[str, ...]:
        """What was taken as zero so far."""
        return tuple(self.control.knowledge.assumed)


def _changes_tools(moves: Moves) -> bool:
    """Whether motions are made with more than one tool, or length of it: what is lacking is said of each of them."""
    tool, length = moves.tool, moves.tool_length
    same = (length == length[-1]) | (np.isnan(length) & np.isnan(length[-1]))
    return bool((tool != tool[-1]).any() or not same.all())
