"""The execution of a program block by block, in the order of its flow; common to all languages.

A language defines what a block does (`execute`), the file names of its subprograms, and what the end of a text means.
Everything around that is here: the program counter, the fast lane, block delete, the limit on executed blocks, endless
programs, the place of a fault in the program, and programs that come in parts.

The text that is executed is a `TextUnit`: a program, one of several programs in a file, or the file of a subprogram.

`FollowedLanguage` lists what a family of controls provides for this.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from copy import copy
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

import numpy as np

from ncfix.arrays import Ints, Mask
from ncfix.control.control import ProgramControl
from ncfix.control.expressions import Fault
from ncfix.control.flow import ENDLESS, NEVER_ENDS, Recurrence
from ncfix.control.lanes.block_rows import LaneTables, Lookahead
from ncfix.control.lanes.lane import run_lane, turned
from ncfix.control.moves import Moves
from ncfix.control.setup import Run
from ncfix.diagnostics import Message, Place, SourceError
from ncfix.text.dialect import goes_back
from ncfix.text.language import Language
from ncfix.text.reader import read
from ncfix.text.tree import Program, Span, Template, view
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.text.dialect import Dialect


P = TypeVar("P")
"""What a language prepares for a block shape, with `skip` (its block delete switches) and `lane`."""


class TextUnit(ABC, Generic[P]):
    """Blocks from `begin` up to `stop` of a program, with the plans of their shapes.

    external  name of the file; empty for text of the main program
    plans     plan of each shape, made on first use; units of one program share them
    template  index of each block's shape; `first`: index of its first number in `numbers`
    operations  control structures of blocks as operations, see `flow`; made when a block is first executed
    ahead     what the fast lane has read of the blocks to come
    """

    def __init__(
        self,
        program: Program,
        plan_of: Callable[[Template], P],
        external: str = "",
        blocks: tuple[int, int] | None = None,
        plans: list[P | None] | None = None,
    ) -> None:
        self.plan_of = plan_of
        self.external = external
        self.plans: list[P | None] = [] if plans is None else plans
        self.take(program, *(blocks or (0, len(program))))

    def take(self, program: Program, begin: int, stop: int) -> None:
        """Refer to blocks `begin` up to `stop` of `program`."""
        self.program, self.begin, self.stop = program, begin, stop
        self.plans += [None] * (len(program.templates) - len(self.plans))
        self.template: Sequence[int] = view(program.template)
        self.first: Sequence[int] = view(program.first_number)
        self.numbers: Sequence[float] = view(program.numbers)
        self.operations: dict[int, Any] = {}
        self.ahead = Lookahead()
        self._lanes: Any = None
        self._stops: Ints | None = None

    def plan(self, block: int) -> P:
        """The plan of a block."""
        shape = self.template[block]
        return self.plans[shape] or self.plan_of_shape(shape)

    def plan_of_shape(self, shape: int) -> P:
        """The plan of a shape."""
        plan = self.plans[shape]
        if plan is None:
            plan = self.plans[shape] = self.plan_of(self.program.templates[shape])
        return plan

    def all_plans(self) -> list[P]:
        """The plans of all shapes."""
        return [self.plan_of_shape(shape) for shape in range(len(self.plans))]

    def blocks_of(self, shapes: Collection[int]) -> list[int]:
        """The blocks that have one of these shapes, in order."""
        if not shapes:
            return []
        found = np.flatnonzero(np.isin(self.program.template[self.begin : self.stop], list(shapes))) + self.begin
        return found.tolist()

    # -- for the fast lane --------------------------------------------------------------------------------------------

    @property
    def lanes(self) -> Any:
        """The lanes of all shapes as columns."""
        if self._lanes is None:
            self._lanes = self.tables()
        return self._lanes

    @abstractmethod
    def closed(self) -> Mask:
        """(s,) whether blocks of each shape cannot go through the fast lane."""

    def tables(self) -> Any:
        """The lanes of all shapes as columns, made once."""
        plans: list[Any] = self.all_plans()
        return LaneTables.of([plan.lane for plan in plans])

    def lane_end(self, block: int) -> int:
        """The first block from `block` on that cannot go through the fast lane."""
        if self._stops is None:
            shapes = self.program.template[self.begin : self.stop]
            self._stops = np.append(np.flatnonzero(self.closed().take(shapes)) + self.begin, self.stop)
        return int(self._stops[np.searchsorted(self._stops, block)])


NO_END = "NCF234"
NEVER = "NCF249"
SUBPROGRAM = "NCF258"
AS_PROGRAM = (
    "the program ends like a subprogram; ncfix corrects it as a main program that starts in the state of the setup"
)
BY_ITSELF = "if a caller sets its offsets, tools or positions, correct the caller with --flatten"
NAMES_AN_AXIS = re.compile(
    rb"(?i)(?!\d*[ \t]*(?:\*|(?:BEGIN|END|CALL)[ \t]+PGM\b))"
    rb"(?:\([^)\r\n]*\)|\"[^\"\r\n]*\"|[^(;%\"\r\n])*?"
    rb"(?<![A-Z_$#<])I?[XYZABCUVW][ \t]*=?[ \t]*[-+]?[ \t]*(?:[.,]?\d|[#\[]|Q[LR]?\d|R\d)"
)
"""Matches a block with an axis word, in any language; ignores comments, strings and program names."""
RUNTIME = "NCF237"
"""What is executed depends on the machine at run time, so the program cannot be written out flat."""

U = TypeVar("U", bound=TextUnit[Any])


class Interpreter(ABC, Generic[U]):
    """Follows a program, whole or in parts.

    main      text of the main program
    flow      program counter, calls and repetitions
    files     texts of subprogram files by name; None: not found
    span      part of the block being evaluated, for messages
    watcher   writes down the blocks as they are executed, if the program is to be written out flat
    in_parts  whether the text comes in parts; `first` and `last`: whether this is the first, the last part
    ended     whether the program has ended
    behind    the block of the main text after the program's end; None: the end is not known
    executed  blocks of the main text executed one by one; of a program in parts only those executed in calls
    jumped    ranges (first, stop) of blocks of the main text that the program jumped over
    """

    main: U
    flow: Any

    def __init__(self, control: ProgramControl, program: Program, run: Run, *, in_parts: bool = False) -> None:
        self.control: Any = control
        self.dialect = program.dialect
        self.resolve = run.resolve
        self.in_parts = in_parts
        self.files: dict[str, U | None] = {}
        self.span: Span | None = None
        self.watcher: Any = None
        self.first = self.last = True
        self.ended = False
        self.behind: int | None = None
        self.executed: set[int] = set()
        self.jumped = set[tuple[int, int]]()
        self._recurrence = Recurrence()
        control.budget.left = run.budget(program)
        control.locate = self.place

    # -- what a language says -----------------------------------------------------------------------------------------

    @abstractmethod
    def execute(self, plan: Any, unit: U, block: int) -> bool:
        """Execute a block; `flow.block` is already the next one. Returns whether the program ends here."""

    @abstractmethod
    def spellings(self, name: str) -> Iterable[str]:
        """The file names under which a subprogram is looked for."""

    @abstractmethod
    def text_of_file(self, source: bytes, name: str, spelling: str) -> U:
        """The text of a subprogram file that was found."""

    @abstractmethod
    def end_of_text(self) -> bool:
        """Handle the end of a text before the program's end; returns whether execution continues (in a caller)."""

    @property
    @abstractmethod
    def changes(self) -> int:
        """Count of changes of anything that decides where the program goes on."""

    @property
    def why_endless(self) -> str:
        """The message for an endless program."""
        return NEVER_ENDS

    def lane_is_open(self, plan: Any) -> bool:
        """Whether the motions from this block on may be followed at once."""
        return plan.lane is not None

    def run_lane(self, unit: U, block: int, plan: Any) -> int:
        """Follow simple motions from `block` on; returns the number of blocks followed, 0 for none."""
        return run_lane(self.control, unit, block, not unit.external, partial(turned, self.control, unit))

    def note_stretch(self, unit: U, block: int, done: int) -> None:
        """Called after `done` blocks from `block` on were followed at once."""

    def moves(self) -> Moves:
        """The motions of the program, after it has been followed."""
        return self.control.moves()

    def note_uncorrected(self, program: Program, moves: Moves) -> None:
        """Report where blocks begin that name axes but are never executed.

        They belong to other programs in the file, to subprograms that nothing calls, or to branches that are not taken.
        `program` and `moves`: the program, or its last part.
        """
        if self.behind is None:
            return
        if 0 < self.behind <= len(program):
            start, stop = program.blocks[self.behind - 1].tolist()
            if goes_back(program.source[start:stop], self.dialect):
                place = program.place(self.behind - 1)
                self.control.messages[AS_PROGRAM] = Message(SUBPROGRAM, AS_PROGRAM, place, BY_ITSELF)
        jumped = sorted((first, min(stop, self.behind)) for first, stop in self.jumped)
        behind = [(self.behind, len(program))] if self.behind < len(program) else []
        if not (behind or jumped):
            return
        executed = self.executed.union(moves.block.tolist())
        text = "after the end of the program there are blocks with axis words, which are never executed"
        hint = "they are not corrected; if they are another program, put it in a file of its own and correct that"
        self._note_first(program, executed, behind, text, hint)
        text = "the program jumps over blocks with axis words and never executes them"
        hint = (
            "they are not corrected; if the program is to execute them later, change the original and correct it again"
        )
        self._note_first(program, executed, jumped, text, hint)

    def _note_first(
        self, program: Program, executed: set[int], spans: Iterable[tuple[int, int]], text: str, hint: str
    ) -> None:
        """Report the first block in `spans`, in order, that names an axis and was not executed."""
        seen = 0
        for first, stop in spans:
            first, seen = max(first, seen), max(stop, seen)
            for block in range(first, stop):
                if block not in executed and NAMES_AN_AXIS.match(program.source, *program.blocks[block].tolist()):
                    self.control.messages[text] = Message(NEVER, text, program.place(block), hint)
                    return

    # -- what a language says of parts --------------------------------------------------------------------------------

    @property
    def to_the_last(self) -> bool:
        """Whether text after the end of the program matters, because something was searched that may be there."""
        return True

    def check_part(self, program: Program) -> None:
        """Raise `NotInPartsError` if the part depends on an earlier one in a way that a checkpoint does not keep."""

    def check_motions(self, program: Program, moves: Moves) -> None:
        """Like `check_part`, after the part has been followed."""

    # -- where we are -------------------------------------------------------------------------------------------------

    def place(self) -> Place:
        """The place in the program of the block being executed."""
        unit, block = self.flow.unit, self.flow.block - 1
        inside = unit.begin <= block < unit.stop
        return unit.program.place(block, self.span) if inside else Place(unit.program.path)

    def find(self, name: str) -> U | None:
        """The text of a subprogram file; None if it is not found."""
        if name not in self.files:
            spellings = dict.fromkeys(self.spellings(name)) if self.resolve else ()
            found = ((each, source) for each in spellings if self.resolve and (source := self.resolve(each)))
            self.files[name] = next((self.text_of_file(source, name, each) for each, source in found), None)
        return self.files[name]

    def read(self, source: bytes, path: str) -> Program:
        """Parse the file of a subprogram."""
        return read(source, path, self.dialect)

    # -- the walk -----------------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Follow the program, or the part, to its end; raises SourceError where the control would stop."""
        try:
            self.ended = self.walk() or self.last
        except Fault as fault:
            self.span = fault.span or self.span
            raise SourceError.of(fault.code, fault.text, self.place(), fault.hint) from None

    def next_part(self, program: Program, blocks: int) -> None:
        """Go on with the next part, in which at most `blocks` blocks may be executed."""
        self.main = copy(self.main)  # whoever holds the part before keeps it
        self.main.take(program, 0, len(program))
        self.flow.unit, self.flow.block = self.main, 0
        self.first = False
        self.control.budget.left = blocks

    def walk(self) -> bool:
        """Execute block after block; returns whether the program ends before its text does."""
        control, flow = self.control, self.flow
        after, depth = flow.block, 0
        while True:
            here = flow.arrive()
            if flow.unit is self.main and flow.block > after and len(flow.calls) == depth:
                self.jumped.add((after, flow.block))
            if not here:
                if (self.last or flow.calls) and self.end_of_text():
                    continue
                self.behind = flow.block
                return False
            unit, block = flow.unit, flow.block
            plan = unit.plan(block)
            control.external = unit.external
            after, depth = len(self.main.program) if unit.external else block + 1, len(flow.calls)
            if self.take_stretch(plan):
                after = flow.block
                continue
            flow.block = block + 1
            self.span = None
            control.budget.spend(1)
            control.numbers, control.first = unit.numbers, unit.first[block]
            if not unit.external:
                control.row_block = block
                if flow.calls or not self.in_parts:
                    self.executed.add(block)
            if plan.skip is not None and control.is_deleted(plan.skip):
                continue
            ended = self.execute(plan, unit, block)
            control.leave_block()
            if ended:
                self.behind = flow.calls[0].back[1] if flow.calls else flow.block
                return True
            if flow.unit is unit and flow.block <= block:
                self._look_round(block)

    def take_stretch(self, plan: Any) -> bool:
        """Follow the simple motions that begin here at once; returns whether there are any."""
        if not self.lane_is_open(plan):
            return False
        unit, block = self.flow.unit, self.flow.block
        done = self.run_lane(unit, block, plan)
        if done:
            self.note_stretch(unit, block, done)
            self.flow.block += done
            self.control.budget.spend(done)
        return done > 0

    def _look_round(self, block: int) -> None:
        """After a backward jump: raise `Fault` if the program is endless."""
        flow = self.flow
        jump = id(flow.unit), block, flow.block, flow.under_way()
        if self._recurrence.seen(jump, self.changes):
            flow.block = block + 1
            raise Fault(ENDLESS, self.why_endless)


# -- how a family of controls is followed ------------------------------------------------------------------------------


class FlatLine(NamedTuple):
    """A line of a flat program, and the line of the original it comes from."""

    text: str
    line: int


@frozen(kw_only=True)
class FollowedLanguage(Language):
    """How the programs of one family of controls are followed.

    control      (run, dialect) -> the state of the control
    interpreter  (control, program, run) -> the interpreter; with `in_parts`, the program is its first part
    unroll       (interpreter, least increments, limit) -> the lines of the flat program, see `flatten`; None if the
                 language cannot be written out flat
    """

    control: Callable[[Run, Dialect], ProgramControl]
    interpreter: Callable[..., Interpreter[Any]]
    unroll: Callable[[Any, Mapping[str, float], int], Sequence[FlatLine]] | None = None
