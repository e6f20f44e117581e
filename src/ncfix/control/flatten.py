"""Flat programs: every block that the control executes written out once, in order, with numbers instead of expressions.

A block that is executed in several states (in a loop, a subprogram, a repeated cycle) can be corrected for only one of
them. In the flat program each execution is a block of its own. It is written while the program is followed (by the
language's `Flattener`); then it is parsed and followed, and must make the same motions.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ncfix.control.expressions import Fault
from ncfix.control.interpreter import RUNTIME, FlatLine, FollowedLanguage
from ncfix.control.moves import Kinematics, MotionKind, Moves, Rule
from ncfix.control.setup import Resolve, Run
from ncfix.control.trace import interpreter_of, trace
from ncfix.diagnostics import RefusedError, SourceError
from ncfix.text.language import language_of
from ncfix.text.reader import read
from ncfix.text.tree import Assignment, Command, Item, Opaque, OWordLine, Program, Span, Word
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.control.interpreter import TextUnit
    from ncfix.control.setup import Setup

TOO_LONG, NOT_FLAT = "NCF238", "NCF239"
MAX_FLAT_LINES = 500_000
"""Largest number of lines of a flat program."""

LEADING = (MotionKind.RAPID, MotionKind.CYCLE)
"""Motions whose end position does not depend on where they begin."""

MAX_DEVIATION_INCREMENTS = 2.0
"""Largest deviation of an end position, in least increments: numbers are rounded to them, and several may add up."""


class Change(NamedTuple):
    """Replacement of the source bytes from `start` up to `stop` by `text`."""

    start: int
    stop: int
    text: str = ""


class Flattener:
    """Watches the interpreter and writes down every block as it is executed.

    One pass over the items of a block replaces expressions by numbers and drops items that only direct the program
    flow. The language defines the new text of words, assignments, names and other text (None: unchanged), and the
    number format.

    steps  axis letter -> least increment of its axis, mm or degree
    limit  largest number of lines; `lines`: the lines so far
    unit, block  what is executed; `line`: the line of that block in the main program, or of the block that called
    with_blank   whether the blank before a dropped item is dropped, too
    """

    with_blank = False

    def __init__(self, steps: Mapping[str, float], limit: int) -> None:
        self.steps, self.limit = steps, limit
        self.lines: list[FlatLine] = []
        self.line = 1
        self.unit: TextUnit[Any]
        self.block = 0

    def watch(self, unit: TextUnit[Any], block: int) -> None:
        """Called before a block is executed."""
        self.unit, self.block = unit, block
        if not unit.external:
            self.line = unit.program.line(block)

    def write(self, text: str, below: int = 0) -> None:
        """Append a line; its original is `below` lines after `line`. Raises `Fault` NCF238 beyond the limit."""
        if len(self.lines) >= self.limit:
            hint = "correct such a long program in the CAM system or post-processor"
            raise Fault(TOO_LONG, f"written out flat the program has more than {self.limit} lines", hint)
        self.lines.append(FlatLine(text, self.line + below))

    def changes(self) -> list[Change]:
        """The changes to all items of the block."""
        found = map(self.rewritten, self.unit.program.items_of(self.block))
        return [change for change in found if change is not None]

    def rewritten(self, item: Item) -> Change | None:
        """The change to an item; None if it stays."""
        match item:
            case Word():
                return self.word(item)
            case Assignment():
                return self.assignment(item)
            case Command():
                return self.command(item)
            case Opaque():
                return self.opaque(item)
            case OWordLine():
                return self.dropped(item)
        return None

    def word(self, word: Word) -> Change | None:
        """The change to a word."""
        return None

    def assignment(self, item: Assignment) -> Change | None:
        """The change to an assignment."""
        return None

    def command(self, command: Command) -> Change | None:
        """The change to a name."""
        return None

    def opaque(self, item: Opaque) -> Change | None:
        """The change to text that is not parsed."""
        return None

    def replaced(self, span: Span, text: str) -> Change:
        """Replace a span of the block by other text."""
        return Change(*self.unit.program.span(self.block, span), text)

    def dropped(self, item: Item) -> Change:
        """Remove an item."""
        program = self.unit.program
        start, stop = program.span(self.block, item.span)
        if self.with_blank and start > int(program.blocks[self.block, 0]) and program.source[start - 1] in b" \t":
            start -= 1
        return Change(start, stop)

    def text(self, changes: Iterable[Change]) -> str:
        """The text of the block with the changes made, decoded as Latin-1; a change inside another one is ignored."""
        program = self.unit.program
        at, stop = map(int, program.blocks[self.block])
        text = ""
        for change in sorted(changes, key=lambda each: (each.start, each.stop)):
            if change.start < at and change.stop <= at:
                continue
            text += program.source[at : max(at, change.start)].decode("latin-1") + change.text
            at = change.stop
        return text + program.source[at:stop].decode("latin-1")


@frozen
class Flat:
    """A flat program.

    program  parsed, with the path of the original
    lines    for each of its lines, the line of the original
    """

    program: Program
    lines: tuple[int, ...]


def flatten(
    program: Program,
    setup: Setup,
    axes: tuple[str, ...],
    rotary: frozenset[str],
    steps: Mapping[str, float],
    resolve: Resolve | None = None,
    kinematics: Kinematics | None = None,
    limit: int = MAX_FLAT_LINES,
) -> Flat:
    """Write a program out flat; for the arguments see `trace` and `Flattener`.

    Raises RefusedError NCF237 where what is executed depends on the machine at run time, NCF238 beyond the limit,
    NCF239 if the language cannot, or if the flat program would not make the same motions.
    """
    unroll = language_of(program.dialect, FollowedLanguage).unroll
    if unroll is None:
        raise RefusedError.of(NOT_FLAT, f"programs in {program.dialect.title} cannot be written out flat")
    try:
        walk = interpreter_of(program, Run(setup, axes, rotary, resolve, kinematics=kinematics))
        found = unroll(walk, steps, limit)
    except SourceError as error:
        if error.messages[0].code in (RUNTIME, TOO_LONG):
            raise RefusedError.collected(error.messages) from None
        raise
    end = program.line_end.decode()
    text = "".join(line.text + end for line in found).encode("latin-1")
    flat = read(text, program.path, program.dialect)
    before = trace(program, setup, axes, rotary, resolve, kinematics=kinematics).moves
    after = trace(flat, setup, axes, rotary, resolve, kinematics=kinematics).moves
    off = difference(before, after, steps)
    if off:
        raise RefusedError.of(NOT_FLAT, f"written out flat the program would not make the same motions: {off}")
    return Flat(flat, tuple(line.line for line in found))


def difference(before: Moves, after: Moves, steps: Mapping[str, float]) -> str:
    """The first difference between the motions of a program and of its flat form, in words; empty if they agree.

    A refused arc without a sweep stands for a curve of any kind that ncfix does not follow. At the end of a rapid or at
    a hole, the flat form may state a position that the program leaves unknown: positions of holes that the control
    computes.
    """
    rows, flat = (np.flatnonzero(moves.kind != MotionKind.DWELL) for moves in (before, after))
    if len(rows) != len(flat):
        return f"it has {len(rows)} motions, and would have {len(flat)}"
    size = np.array([steps[axis] for axis in before.axes])
    size = np.where(before.rotary, np.radians(size), size)
    ends, flat_ends = before.end[rows], after.end[flat]
    other = (np.abs(ends - flat_ends) > MAX_DEVIATION_INCREMENTS * size).any(axis=1)
    told = (np.isnan(ends) & ~np.isnan(flat_ends)).any(axis=1) & ~np.isin(before.kind[rows], LEADING)
    other |= told | (np.isnan(flat_ends) & ~np.isnan(ends)).any(axis=1)
    stands_in = (before.kind == MotionKind.ARC) & (before.sweep == 0) & (before.rule == Rule.REFUSE)
    other |= (before.kind[rows] != after.kind[flat]) & ~stands_in[rows] | (before.tcp[rows] != after.tcp[flat])
    return f"motion {int(np.argmax(other)) + 1} of {len(rows)} would be different" if other.any() else ""
