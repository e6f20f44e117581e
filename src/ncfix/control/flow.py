"""Program flow: the operations to which languages lower their control structures, and their execution.

A language translates the labels, jumps, branches, loops and calls of a block once into operations; whatever depends on
the state of the control (a condition, a computed target, a repeat count) is a function in them. Open calls, repeated
sections and loop counts are kept here, for all languages.

Endless programs are recognised by their backward jumps: the same jump is made again and nothing that jumps depend on
has changed. The flow depends only on variables, open calls and remaining repetitions; axis positions do not matter
unless the program reads them, which counts as a change. So a second such jump proves that there will be a third. A loop
that counts must be executed instead, up to a bound on the number of executed blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from dataclasses import field
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from ncfix.control.expressions import Fault
from ncfix.values import mutable

ENDLESS = "NCF233"
NEVER_ENDS = "the program never ends: it jumps back from this block again and again, and no value changes in between"
WAITS = "the program repeats this loop until a value changes that is known only at run time"
MAX_JUMPS_REMEMBERED = 100_000
"""Largest number of backward jumps remembered; the same jump from different calls counts separately."""

TOO_DEEP = "NCF232"
NO_SUBPROGRAM = "NCF231"
NO_LABEL = "NCF230"


@mutable
class BlockBudget:
    """Number of blocks that may still be executed; each hole of a cycle and each subprogram run counts as a block too.

    most  blocks allowed in addition to those of the text, for the message
    left  blocks that may still be executed, including those of the text
    """

    most: int
    left: int

    def spend(self, blocks: int) -> None:
        """Count executed blocks; raises `Fault` if there are more than allowed."""
        self.foresee(blocks)
        self.left -= blocks

    def foresee(self, blocks: int) -> None:
        """Raise `Fault` if `blocks` more would exceed the budget."""
        if blocks > self.left:
            text = f"the program probably never ends: it executes more than {self.most:,} blocks"
            raise Fault(ENDLESS, text, "if it does end, set a larger most_blocks in the setup file")


@mutable
class Recurrence:
    """Backward jumps made so far, each with the count of changes at that time."""

    made: dict[Hashable, int] = field(default_factory=dict)

    def seen(self, jump: Hashable, changes: int) -> bool:
        """Record a backward jump; returns whether it was made before and nothing has changed since."""
        before = self.made.get(jump)
        if len(self.made) >= MAX_JUMPS_REMEMBERED:
            self.made.clear()
        self.made[jump] = changes
        return before == changes


class Blocks(Protocol):
    """A text to execute: blocks from `begin` up to `stop`."""

    @property
    def begin(self) -> int:
        """Index of its first block."""

    @property
    def stop(self) -> int:
        """Index of the block after its last one."""


U = TypeVar("U", bound=Blocks)


def nothing() -> None:
    """Do nothing."""


@mutable
class OpenCall(Generic[U]):
    """A call that has not returned.

    name   of the subprogram
    entry  text and block at which it begins
    left   number of runs still to come
    kind   kind of call, if the language ends different kinds by different means
    again  called before each further run; `leave`: called on the final return
    back   text and block at which to continue then; `sections`: repeated sections of the caller
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
    """Blocks from `start` up to `stop` that are executed `left` more times before execution continues at `back`."""

    start: int
    stop: int
    back: int
    left: int


class Let(NamedTuple):
    """Execute a function at this point of the flow: it assigns a value, or checks a condition and may raise."""

    do: Callable[[], object]


class Jump(NamedTuple):
    """Continue at a block of the same text (None: at the next block), if the condition holds.

    out  ends the repetition of sections that do not contain that block
    """

    to: int | Callable[[], int | None] | None
    when: Callable[[], bool] | None = None
    out: bool = False


class Repeat(NamedTuple):
    """Execute a section of the text again, `times` times.

    to    its first block
    stop  the block after its last; None: it ends with the block of the operation itself
    """

    to: Callable[[], int]
    times: Callable[[], int]
    stop: Callable[[], int] | None = None


class Call(NamedTuple):
    """Enter a subprogram; `enter` returns None if there is nothing to execute."""

    enter: Callable[[], OpenCall[Any] | None]


class Return(NamedTuple):
    """Return to the caller, or run the subprogram again if runs remain; without a caller the program ends.

    kind  also ends the calls inside the innermost call of this kind; empty: returns from the innermost call of any kind
    """

    when: Callable[[], bool] | None = None
    kind: str = ""


Operation = Let | Jump | Repeat | Call | Return


class ProgramFlow(Generic[U]):
    """The program counter, the calls and the repetitions of a program being followed.

    unit, block  the block to execute next: the program counter
    calls        open calls, the outermost first
    sections     repeated sections of this text
    counts       remaining runs of operations that repeat up to their own block, by operation
    ended        whether the program has ended
    most_calls   largest number of open calls; `too_deep`: message if it is exceeded
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
        """Resolve the next block at the end of repeated sections; returns whether the text has such a block."""
        while self.sections and self.block == self.sections[-1].stop:
            section = self.sections[-1]
            section.left -= 1
            if section.left > 0:
                self.block = section.start
                break
            self.block = self.sections.pop().back
        return self.block < self.unit.stop

    def under_way(self) -> tuple[object, ...]:
        """Open calls and remaining repetitions, in comparable form."""
        calls = tuple((id(call.back[0]), call.back[1], call.left) for call in self.calls)
        levels = [self.sections, *(call.sections for call in self.calls)]
        sections = tuple((section.start, section.left) for level in levels for section in level)
        return calls, sections, tuple(self.counts.items())

    def follow(self, operations: Iterable[Operation]) -> bool:
        """Execute operations until one changes the program counter; returns whether none did."""
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
        """Continue at a block of this text, see `Jump`."""
        if block is not None:
            self.block = block
        if block is not None and out:
            self.sections = [section for section in self.sections if section.start <= block < section.stop]

    def _repeat(self, repeat: Repeat) -> bool:
        """Begin a repetition; returns whether anything is repeated."""
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
        """Enter a call; raises `Fault` if too many calls are open."""
        self.check_depth(call.name)
        call.back, call.sections = (self.unit, self.block), self.sections
        self.calls.append(call)
        self.unit, self.block = call.entry
        self.sections = []

    def check_depth(self, name: str) -> None:
        """Raise `Fault` if one more call would be too many."""
        if len(self.calls) >= self.most_calls:
            raise Fault(TOO_DEEP, self.too_deep.format(name))

    def finish(self, kind: str = "", *, again: bool = True) -> None:
        """Return from a call, or run it again if runs remain and `again` is set; without a call the program ends."""
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
