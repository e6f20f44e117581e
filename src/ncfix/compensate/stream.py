"""A program corrected while it is read: part after part, in memory that does not depend on its length.

    text --part--> Program --follow--> Moves --settle--> pieces, text --read, follow--> Moves again --> written

Every part goes through the same plan, emitter, checks and proof as a whole program does (see `fix`), and what comes out
is the same, byte for byte. A part begins with the last motion of the one before it, which is written already: all that
one part has to know of the earlier ones is what that motion left (`Before`). What cannot be done that way raises
`NotInPartsError`, and the caller takes the program as a whole.

Several processes can work on a program (see `crew`): each corrects parts in turn, and follows what it has to of others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial

from ncfix.compensate.account import FixReport
from ncfix.compensate.corrector import Corrector, Done
from ncfix.compensate.crew import Ground, Read, crew
from ncfix.compensate.double import LOOKED, suspected
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.compensate.tally import Tally
from ncfix.compensate.task import Task
from ncfix.control.parts import NotInPartsError
from ncfix.diagnostics import Message
from ncfix.text import stamp


@dataclass(frozen=True, slots=True)
class Stamp:
    """Where the stamp stands in what was written, what it is now, and what it has to be (empty: there is none)."""

    at: int
    written: bytes
    wanted: bytes


@dataclass(frozen=True, slots=True)
class Streamed:
    """What was done, and the stamp, which may say more at the end than could be known at the beginning."""

    report: FixReport
    stamp: Stamp


@dataclass(slots=True)
class Stream:
    """One program on its way. `run` is called once.

    read   gives the next so many bytes of the text; none at its end
    write  takes the corrected text, part by part; or how much of it stands where it belongs already (`Ground.out`)
    jobs   processes that work on it
    ground  the files, which all of them have; without it there is one process
    suspicion  what makes one think that the program was corrected before; None: not judged yet
    """

    task: Task
    read: Read
    write: Callable[[bytes | int], object]
    jobs: int = 1
    ground: Ground | None = None
    tally: Tally = field(init=False)
    suspicion: tuple[Message, ...] | None = None
    corrector: Corrector | None = None

    def __post_init__(self) -> None:
        self.tally = Tally(self.task.machine.least_increment[0])

    @property
    def stamped(self) -> bytes:
        """The stamp as it was written; empty as long as there is none."""
        return b"" if self.corrector is None else self.corrector.stamped

    def run(self) -> Streamed:
        """Correct the program; raises what `fix_program` raises, and `NotInPartsError`."""
        task = self.task
        task.check()
        task.follower()
        with crew(self.jobs, partial(Corrector, task), self.ground) as others:
            own = self.corrector = Corrector(task, others.spread(self.read))
            for number, done in own.work(others.share):
                others.put(number, done)
                self._take(others.ready())
            self._take(others.rest(own.units.count))
        self._pass_on(own.units.rest, own.units.read)
        self.tally.blocks += own.units.blocks
        self.tally.notes = own.units.notes
        messages = (*self._judged(), *own.units.follower.messages)
        report = self.tally.report(task.path, messages, get_strategy(task.options.strategy).leaves, task.options)
        return Streamed(report, Stamp(own.at, own.stamped, own.stamp() if self.tally.changed else b""))

    def _take(self, parts: Iterator[Done]) -> None:
        """Write parts, and report them."""
        for done in parts:
            self.tally.take(done.tally)
            if done.next_line > LOOKED:
                self._judged()
            if self.task.options.allow_refused or not self.tally.refused:
                self.write(done.text)

    def _judged(self) -> tuple[Message, ...]:
        """Judge the program by its beginning, once; raises RefusedError NCF438 (see `suspected`)."""
        if self.suspicion is None:
            force = self.task.options.force
            self.suspicion = suspected(self.tally.numbers, self.tally.step, self.task.path, force)
        return self.suspicion

    def _pass_on(self, text: bytes, read: Read) -> None:
        """What comes after the end of the program goes out as it came in."""
        while text:
            if stamp.SIGN.search(text.decode("latin-1")) and not self.task.options.force:
                raise NotInPartsError("there is a stamp after the end of the program")
            ended = text.endswith(b"\n")
            self.tally.blocks += text.count(b"\n")
            self.write(text)
            text = read(self.task.size)
            self.tally.blocks += not text and not ended
