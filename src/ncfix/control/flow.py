"""Where a program goes on: operations to which languages lower their control structures, and what executes them.

A language lowers labels, jumps, branches, loops and calls of a block once, to operations; what depends on the state of
the control (a condition, a computed target, how often) is a function in them. Calls that have not returned, sections
under repetition and counts of loops stand here, for all languages.

Programs that go round for ever are found by their jumps back: the same one is made again, and nothing has changed that
a jump depends on. Which way a program goes depends on its variables alone, on the calls that are open, and on how
often repetitions are still to be made; where the axes stand does not matter unless the program reads it, which counts
as a change here. So a second jump of that kind shows that there will be a third. A loop that counts something has to be
followed instead, up to a bound on all that is executed.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from dataclasses import field
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from ncfix.control.expressions import Fault
from ncfix.values import mutable

ENDLESS = "NCF233"
NEVER_ENDS = "the program never ends: it jumps back here again and again, and nothing changes in between"
WAITS = "the program goes round here until something changes that only the machine knows"
MOST = 100_000
"""Jumps that are remembered; from different calls, one jump is another."""

TOO_DEEP = "NCF232"
NO_SUBPROGRAM = "NCF231"
NO_LABEL = "NCF230"


@mutable
class BlockBudget:
    """How much may still be executed; a hole of a cycle, and a subprogram that is gone through, count as blocks too.

    most  blocks beyond those of the text, for what is said
    left  blocks that may still be executed, those of the text included
    """

    most: int
    left: int

    def spend(self, blocks: int) -> None:
        """Count what is executed; raises `Fault` where it is too much."""
        self.foresee(blocks)
        self.left -= blocks

    def foresee(self, blocks: int) -> None:
        """Raise `Fault` at once where it will take more blocks than are left."""
        if blocks > self.left:
            text = f"the program seems to be endless: it executes more than {self.most:,} blocks"
            raise Fault(ENDLESS, text, "if it does end, most_blocks = ... in the setup file allows more")


@mutable
class Recurrence:
    """The jumps back that a program has made: what had changed by then, as a count."""

    made: dict[Hashable, int] = field(default_factory=dict)

    def seen(self, jump: Hashable, changes: int) -> bool:
        """Note a jump back, and tell whether it was made before and nothing has changed since."""
        before = self.made.get(jump)
        if len(self.made) >= MOST:
            self.made.clear()
        self.made[jump] = changes
        return before == changes


class Blocks(Protocol):
    """A text that is executed: blocks from `begin` up to `stop`."""

    @property
    def begin(self) -> int:
        """Its first block."""

    @property
    def stop(self) -> int:
        """The block behind its last."""


U = TypeVar("U", bound=Blocks)


def nothing() -> None:
    """Nothing is to be done."""


@mutable
class OpenCall(Generic[U]):
    """A call that has not returned.

    name   of what is called
    entry  the text and block where that begins
    left   how many more times it runs
    kind   of call, where the language ends different ones by different means
    again  done before it runs once more; `leave`: when it returns for good
    back   text and block where to go on then; `sections`: those of the caller that are being repeated
    """

    name: str
    entry: tuple[U, int]
    left: int = 0
    kind: str = ""
    again: Callable[[], object] = nothing
    leave: Callable[[], object] = nothing
    back: tuple[U, int] = field(init=False)
    sections: list[Section] = field(init=False)


@mutable
class Section:
    """Blocks from `start` up to `stop` that are executed so many times more, before going on at `back`."""

    start: int
    stop: int
    back: int
    left: int


class Let(NamedTuple):
    """Something gets a value, or is checked."""

    do: Callable[[], object]


class Jump(NamedTuple):
    """Go on at a block of the same text (None: at the next one), if a condition holds.

    out  repetitions of sections in which that block does not stand are over
    """

    to: int | Callable[[], int | None] | None
    when: Callable[[], bool] | None = None
    out: bool = False


class Repeat(NamedTuple):
    """Execute a section of the text again, so many times.

    to    where it begins
    stop  the block behind it, from where to come back; None: it ends with the block of the operation itself
    """

    to: Callable[[], int]
    times: Callable[[], int]
    stop: Callable[[], int] | None = None


class Call(NamedTuple):
    """Enter a subprogram; None: nothing is to be executed."""

    enter: Callable[[], OpenCall[Any] | None]


class Return(NamedTuple):
    """Go back to the caller, or run again what it calls several times; without a caller the program ends.

    kind  the calls that end with this one, the calls in them included; empty: any
    """

    when: Callable[[], bool] | None = None
    kind: str = ""


Operation = Let | Jump | Repeat | Call | Return


class ProgramFlow(Generic[U]):
    """Where execution stands, and what takes it elsewhere.

    unit, block  what is executed next: the program counter
    calls        those that have not returned, the outermost first
    sections     of this text that are being repeated
    counts       how often what is repeated in its place is still to be made, by what counts
    ended        the program has ended
    most_calls   so many calls may be open; `too_deep` says what is wrong with more
    """

    most_calls = 0
    too_deep = ""

    def __init__(self, unit: U, budget: BlockBudget) -> None:
        self.unit, self.block, self.budget = unit, unit.begin, budget
        self.calls: list[OpenCall[U]] = []
        self.sections: list[Section] = []
        self.counts: dict[Hashable, int] = {}
        self.ended = False

    def arrive(self) -> bool:
        """Settle what is executed next, at the end of a section that is repeated; whether the text has such a block."""
        while self.sections and self.block == self.sections[-1].stop:
            section = self.sections[-1]
            section.left -= 1
            if section.left > 0:
                self.block = section.start
                break
            self.block = self.sections.pop().back
        return self.block < self.unit.stop

    def under_way(self) -> tuple[object, ...]:
        """The calls that have not returned, and what is still to be repeated."""
        calls = tuple((id(call.back[0]), call.back[1], call.left) for call in self.calls)
        levels = [self.sections, *(call.sections for call in self.calls)]
        sections = tuple((section.start, section.left) for level in levels for section in level)
        return calls, sections, tuple(self.counts.items())

    def follow(self, operations: Iterable[Operation]) -> bool:
        """Execute operations until one leads elsewhere; whether none has."""
        for operation in operations:
            if isinstance(operation, Let):
                operation.do()
            elif isinstance(operation, Jump):
                if operation.when is None or operation.when():
                    self.jump(operation.to() if callable(operation.to) else operation.to, out=operation.out)
                    return False
            elif isinstance(operation, Repeat):
                if self._repeat(operation):
                    return False
            elif isinstance(operation, Call):
                call = operation.enter()
                if call is not None:
                    self.enter(call)
                    return False
            elif operation.when is None or operation.when():
                self.finish(operation.kind)
                return False
        return True

    def jump(self, block: int | None, *, out: bool = False) -> None:
        """Go on at a block of this text, see `Jump`."""
        if block is not None:
            self.block = block
        if block is not None and out:
            self.sections = [section for section in self.sections if section.start <= block < section.stop]

    def _repeat(self, repeat: Repeat) -> bool:
        """Whether there is something to be repeated."""
        if repeat.stop is None:
            key = id(self.unit), self.block
            left = self.counts.get(key, -1)
            left = repeat.times() if left < 0 else left
            self.budget.foresee(left)
            if left > 0:
                self.counts[key] = left - 1
                self.block = repeat.to()
            else:
                self.counts.pop(key, None)
            return left > 0
        times, start, stop = repeat.times(), repeat.to(), repeat.stop()
        self.budget.foresee(times)
        if times > 0 and stop > start:
            self.sections.append(Section(start, stop, self.block, times))
            self.block = start
        return times > 0 and stop > start

    def enter(self, call: OpenCall[U]) -> None:
        """Begin a call; raises `Fault` where too many are open."""
        self.check_depth(call.name)
        call.back, call.sections = (self.unit, self.block), self.sections
        self.calls.append(call)
        self.unit, self.block = call.entry
        self.sections = []

    def check_depth(self, name: str) -> None:
        """Raise `Fault` where one call more would be too many."""
        if len(self.calls) >= self.most_calls:
            raise Fault(TOO_DEEP, self.too_deep.format(name))

    def finish(self, kind: str = "", *, again: bool = True) -> None:
        """Return from a call, or run it again (if that is `again` wanted); the program ends where none is open."""
        while kind and self.calls and self.calls[-1].kind != kind:
            self.calls.pop().leave()
        if not self.calls:
            self.ended = True
            return
        call = self.calls[-1]
        if call.left and again:
            call.left -= 1
            call.again()
            self.unit, self.block = call.entry
            return
        self.calls.pop()
        call.leave()
        self.unit, self.block = call.back
        self.sections = call.sections
