"""Following a program part by part, what goes on from one part to the next, and what there is to say at the end: the
same for all languages.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.control.control import ProgramControl
from ncfix.control.interpreter import Interpreter
from ncfix.control.moves import MotionKind, Moves, Rule, Trace
from ncfix.control.parts import NotInPartsError
from ncfix.control.turns import remarks, say
from ncfix.diagnostics import Message, SourceError, UsageError
from ncfix.text import stamp
from ncfix.text.language import Run
from ncfix.text.tree import Program


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """The state in which a part leaves a control, before its last block, where it has changed nothing else for good.

    It goes from one process to another.

    position    (n_axes,) the command, mm and rad
    feed        the feed in force; `feed_given`: there is one
    motion      the motion code in force, in tenths
    variables   those that the program may have set, as the language has them
    """

    position: list[float]
    feed: float
    feed_given: bool
    motion: int
    variables: Any


class Follower:
    """Follows a program that comes in parts: the control keeps its state, the interpreter goes on where it was.

    walk     makes the interpreter, given the first part
    watched  it is to be found out what the next part leaves behind
    """

    def __init__(
        self, control: ProgramControl, run: Run, walk: Callable[[Any, Program, Run], Interpreter[Any]]
    ) -> None:
        self.control, self.run, self.walk = control, run, walk
        self.interpreter: Interpreter[Any] | None = None
        self.watched = self.unchanged = False

    @property
    def to_the_last(self) -> bool:
        """What stands behind the end of the program matters: something was looked for that may be there."""
        return self.interpreter is not None and self.interpreter.to_the_last

    @property
    def ended(self) -> bool:
        """The control has come to the end of the program."""
        return self.interpreter is not None and self.interpreter.ended

    def follow(self, program: Program, last: bool) -> Moves:
        """The motions of the next part; `last`: nothing comes after it."""
        control, interpreter = self.control, self.interpreter
        begun = control.lasting() if self.watched and interpreter is not None else None
        if interpreter is None:
            interpreter = self.interpreter = self.walk(control, program, self.run)
        else:
            interpreter.next_part(program, self.run.budget(program))
        control.builder.clear()
        interpreter.check_part(program)
        interpreter.last = last
        interpreter.run()
        if control.switches:
            raise NotInPartsError("blocks with / may be skipped, and all positions of block delete are looked at")
        moves = control.moves()
        check_reach(program, moves)
        say(control, program)
        interpreter.check_motions(program, moves)
        self.unchanged = begun is not None and begun == control.lasting()
        return moves

    def checkpoint(self, moves: Moves) -> Checkpoint | None:
        """What the part that was followed last, with these motions, has left; None if there is more to it than that.

        Its last two blocks have to be straight motions.
        """
        control, modal = self.control, self.control.modal
        if not self.unchanged or control.unknown or control.builder.winding is not None or len(moves) < 2:
            return None
        straight = np.isin(moves.kind[-2:], (MotionKind.RAPID, MotionKind.FEED)) & np.isin(moves.modal[-2:], (0, 10))
        if not straight.all() or moves.block[-2] + 1 != moves.block[-1] or _changes_tools(moves):
            return None
        before = moves.start[-1].tolist(), float(moves.feed[-2]), modal.feed_given, int(moves.modal[-2])
        return Checkpoint(*before, control.set_variables())

    def resume(self, state: Checkpoint) -> None:
        """Go on as if a part had been followed up to its last block, which comes next."""
        modal = self.control.modal
        self.stand(np.array(state.position))
        modal.feed, modal.feed_given = state.feed, state.feed_given
        modal.motion = modal.straight = state.motion
        modal.cycle.initial = None
        self.control.take_variables(state.variables)

    def stand(self, position: NDArray[np.float64]) -> None:
        """Take the axes to a command (n_axes,), mm and rad, where the corrected program has left them."""
        self.control.position = list(self.control.position)
        for column, value in zip(self.control.builder.columns, position.tolist(), strict=True):
            self.control.position[column] = value

    @property
    def lacking(self) -> tuple[Message, ...]:
        """What the program used so far and the setup does not give, and axes that the machine lacks."""
        return (*self.control.foreign.values(), *self.control.knowledge.missing.values())

    @property
    def messages(self) -> tuple[Message, ...]:
        """What there is to say so far."""
        return remarks(self.control)

    @property
    def assumed(self) -> tuple[str, ...]:
        """What was taken as zero so far, in words."""
        return tuple(self.control.knowledge.assumed)


def _changes_tools(moves: Moves) -> bool:
    """Whether motions are made with more than one tool, or length of it: what is lacking is said of each of them."""
    tool, length = moves.tool, moves.tool_length
    same = (length == length[-1]) | (np.isnan(length) & np.isnan(length[-1]))
    return bool((tool != tool[-1]).any() or not same.all())


FAR = 1e9
"""mm or rad; no machine goes farther from zero, and sums of such numbers do not tell micrometres apart."""
TOO_FAR = "NCF248"


def check_reach(program: Program, moves: Moves) -> None:
    """Raise SourceError at the first motion that leads farther away than any machine goes."""
    far, arcs = _are_far(moves.end), np.flatnonzero(moves.kind == MotionKind.ARC)
    far[arcs] |= _are_far(moves.centre[arcs])
    rows = np.flatnonzero(far & (moves.rule != Rule.REFUSE))
    if rows.size:
        text = "this leads farther away than any machine goes (1e9 mm or radians)"
        raise SourceError.of(TOO_FAR, text, program.place(int(moves.block[rows[0]])), "check the numbers of the block")


def _are_far(places: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) which of (n, k) places are too far away."""
    rows = np.zeros(len(places), dtype=np.bool_)
    if not places.size or max(places.max(), -places.min()) <= FAR:
        return rows
    rows[np.flatnonzero(np.abs(places) > FAR) // places.shape[1]] = True
    return rows


def finished(control: ProgramControl, program: Program, moves: Moves) -> Trace:
    """The trace of a program; raises UsageError with all that was not given."""
    check_reach(program, moves)
    say(control, program)
    lacking = (*control.foreign.values(), *control.knowledge.missing.values())
    if lacking:
        raise UsageError.collected(lacking)
    marked = stamp.find(program)
    return Trace(
        moves=moves,
        messages=remarks(control),
        assumed=tuple(control.knowledge.assumed),
        stamp="" if marked is None else program.text_of(marked),
        switches=frozenset(control.switches),
    )
