"""A program corrected while it is read: part after part, in memory that does not depend on its length.

    text --part--> Program --follow--> Moves --settle--> pieces, text --read, follow--> Moves again --> written

Every part goes through the same plan, emitter, checks and proof as a whole program does (see `fix`), and what comes out
is the same, byte for byte. A part begins with the last motion of the one before it, which is written already: all that
one part has to know of the earlier ones is what that motion left (`Before`). What cannot be done that way raises
`NotInPartsError`, and the caller takes the program as a whole.

Several processes can work on a program (see `crew`): each reads and follows all of it, and corrects parts in turn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ncfix.compensate.account import FixReport
from ncfix.compensate.crew import Read, Share, crew
from ncfix.compensate.double import suspected
from ncfix.compensate.findings import Mask
from ncfix.compensate.fix import stamp_of
from ncfix.compensate.following import Resolve, kinematics_of, placed, rotary_names
from ncfix.compensate.options import FixOptions
from ncfix.compensate.proof import SelfCheckError, differences
from ncfix.compensate.settle import Agreed, Before, Settled, agree, increments, settle
from ncfix.compensate.strategies import get_strategy
from ncfix.compensate.tally import Tally
from ncfix.compensate.units import Part, Unit, Units
from ncfix.compensate.verify import path_error
from ncfix.diagnostics import Message, NcfixError
from ncfix.machine import Machine, State
from ncfix.program import stamp
from ncfix.program.dialect import Dialect
from ncfix.program.language import Run, language_of
from ncfix.program.moves import Moves
from ncfix.program.parts import Follower, NotInPartsError, PartReader
from ncfix.program.setup import Setup
from ncfix.program.tree import Program
from ncfix.program.writer import Splices, spliced

PART_BYTES = 3 << 19
"""How much text is a part: the columns of a part take about thirty times as much memory."""


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


@dataclass(frozen=True, slots=True)
class Done:
    """A part that has been corrected and proved; of the first one, what makes one think that it was corrected before.

    text   what it is now
    tally  what there is to report of it
    """

    text: bytes
    tally: Tally
    suspicion: tuple[Message, ...] = ()


@dataclass(frozen=True, slots=True)
class Task:
    """What all parts of a program have in common.

    resolve  gives the text of a subprogram file by its name
    size     bytes of a part
    """

    machine: Machine
    setup: Setup
    options: FixOptions
    resolve: Resolve | None
    path: str
    dialect: Dialect
    size: int = PART_BYTES

    def follower(self) -> Follower:
        """What follows the program; raises `NotInPartsError` if its language is followed as a whole."""
        make = language_of(self.dialect).follower
        if make is None:
            raise NotInPartsError(f"{self.dialect.title} is followed as a whole")
        axes, rotary = self.machine.axis_names, rotary_names(self.machine)
        kinematics = kinematics_of(self.machine)
        found: Follower = make(self.dialect, Run(self.setup, axes, rotary, self.resolve, kinematics=kinematics))
        return found

    def check(self) -> None:
        """Raise `NotInPartsError` for what has to be looked at as a whole."""
        strategy = get_strategy(self.options.strategy)
        if strategy.corrects_orientation or not strategy.follows_path or self.machine.is_perfect:
            raise NotInPartsError(f"the strategy {strategy.name} looks at the whole path at once")


class Corrector:
    """Goes through a program and corrects its parts, or some of them. `work` is called once.

    head     the first part
    at       where the stamp stands in what is written
    stamped  the stamp, as far as it was known then; empty if there is none
    """

    def __init__(self, task: Task, read: Read) -> None:
        self.task = task
        self.machine = placed(task.machine, task.setup)
        reader = PartReader(task.path, task.dialect)
        self.units = Units(
            task.machine, self.machine, task.setup, task.options, reader, task.follower(), read, task.size
        )
        self.again, self.proof = PartReader(task.path, task.dialect), task.follower()
        self.again.templates, self.again.index = reader.templates, reader.index
        self.head: Program | None = None
        self.at = 0
        self.stamped = b""

    def work(self, share: Share) -> Iterator[tuple[int, Done]]:
        """The number of each part of the share, and what it has become; the others are only followed."""
        foreign = False
        for number, unit in enumerate(self.units):
            if not share.has(number):
                foreign = True
                self.again.first_line += len(unit.part.program)
                self.proof.follow(unit.part.program, unit.part.last)
                continue
            yield number, self._corrected(unit, number, share, foreign)
            foreign = False

    def stamp(self) -> bytes:
        """The stamp as it has to be by what is known now."""
        assert self.head is not None
        text = stamp_of(self.head, self.task.machine, self.task.options, self.units.assumed)
        return stamp.insertion(self.head, text).text

    def _corrected(self, unit: Unit, number: int, share: Share, foreign: bool) -> Done:
        """Correct a part, hand on what the next one has to know, and prove it; `foreign`: the one before was not."""
        task, part = self.task, unit.together()
        moves = part.moves
        nowhere = np.zeros(len(moves.axes))
        guess = None if unit.head is None else Before(False, nowhere, unit.direction, nowhere)
        first: Agreed | None = agree(moves, self.machine, task.dialect, task.options, guess)
        before = share.before(number)
        if before is not None:
            before = replace(before, direction=unit.direction)
            first = None if before.kept or _still_off(moves, before) else first
        settled = settle(part.program, moves, self.machine, task.options, before=before, first=first)
        if before is not None and (settled.unmoored or settled.kept[0] != before.kept):
            raise NotInPartsError("a refusal reaches back into an earlier part")
        if not part.last:
            share.leave(_left(settled))
        text = self._text(part.program, settled, before is None)
        if before is not None and foreign:
            self.proof.stand(before.position)
        own = np.ones(len(moves), dtype=bool)
        own[:1] = unit.head is None
        self._prove(text, settled, own, part.last)
        tally = Tally()
        tally.add(part.program, settled, own, increments(self.machine))
        if task.options.verify:
            self._look(part, settled, own, unit, tally)
        return Done(text, tally, self._suspicion(settled) if before is None else ())

    def _suspicion(self, settled: Settled) -> tuple[Message, ...]:
        return suspected(settled, self.machine.least_increment[0], self.task.path, self.task.options.force)

    def _text(self, program: Program, settled: Settled, first: bool) -> bytes:
        """The corrected text of a part."""
        splices = settled.emission.splices
        if not first:
            stop = int(program.blocks[1, 0]) if len(program) > 1 else len(program.source)
            return spliced(program.source, splices)[stop:]
        edit = stamp.insertion(program, stamp_of(program, self.task.machine, self.task.options, ()))
        self.at = edit.start
        self.head = program
        if len(splices):
            self.stamped = self.stamp()
            edit = replace(edit, text=self.stamped)
            splices = Splices.joined([splices, Splices.of([edit])])
        return spliced(program.source, splices)

    def _prove(self, text: bytes, settled: Settled, own: Mask, last: bool) -> None:
        """The text is read and followed again: the control must understand what the plan meant."""
        try:
            program = self.again.read(text)
            again = self.proof.follow(program, last)
        except NcfixError as error:
            raise SelfCheckError(f"the corrected program cannot be read: {error}") from error
        self.again.first_line += len(program)
        wrong = differences(settled, again, own[settled.plan.pieces.move])
        if wrong is None or wrong.any():
            raise NotInPartsError("the program takes frames or values from where the machine stands")

    def _look(self, part: Part, settled: Settled, own: Mask, unit: Unit, tally: Tally) -> None:
        """Find out the tip errors before and after, with the numbers as the control will understand them."""
        emission, moves = settled.emission, settled.moves
        pieces = replace(settled.plan.pieces, end=emission.end, centre=emission.centre)
        errors = path_error(
            self.machine,
            moves,
            pieces,
            emission.start,
            state=State() if unit.head is None else State(direction=unit.direction),
            rows=own & settled.shown(self.task.options.split_rapids),
            tilts=False,
            known=settled.plan.known,
        )
        tally.figures(errors, part.program.lines(moves.block))


def _still_off(moves: Moves, before: Before) -> bool:
    """Whether an axis goes on standing off its place where a part begins, which its plan did not know."""
    return bool((moves.wordless[0] & (before.shift != 0)).any())


def _left(settled: Settled) -> Before:
    """What a part leaves to the next one, but for the way in which the axes came there."""
    plan, moves = settled.plan, settled.moves
    shift = plan.start[-1] - moves.start[-1]
    shift = np.where(np.isfinite(shift), shift, 0.0)
    nowhere = np.zeros(len(shift), dtype=np.int8)
    return Before(bool(settled.kept[-1]), shift, nowhere, settled.emission.end[-1].copy())


@dataclass(slots=True)
class Stream:
    """One program on its way. `run` is called once.

    read   gives the next so many bytes of the text; none at its end
    write  takes the corrected text, part by part
    jobs   processes that work on it
    """

    task: Task
    read: Read
    write: Callable[[bytes], None]
    jobs: int = 1
    tally: Tally = field(default_factory=Tally)
    suspicion: tuple[Message, ...] = ()
    corrector: Corrector | None = None

    @property
    def stamped(self) -> bytes:
        """The stamp as it was written; empty as long as there is none."""
        return b"" if self.corrector is None else self.corrector.stamped

    def run(self) -> Streamed:
        """Correct the program; raises what `fix_program` raises, and `NotInPartsError`."""
        task = self.task
        task.check()
        task.follower()
        with crew(self.jobs, partial(Corrector, replace(task, resolve=None))) as others:
            own = self.corrector = Corrector(task, others.spread(self.read))
            for number, done in own.work(others.share):
                others.put(number, done)
                self._take(others.ready())
            if error := own.units.missing():
                raise error
            self._take(others.rest(own.units.count))
        self._pass_on(own.units.rest)
        self.tally.blocks += own.units.blocks
        self.tally.notes = own.units.notes
        messages = (*self.suspicion, *own.units.follower.messages)
        report = self.tally.report(task.path, messages, get_strategy(task.options.strategy).leaves, task.options)
        return Streamed(report, Stamp(own.at, own.stamped, own.stamp() if self.tally.changed else b""))

    def _take(self, parts: Iterator[Done]) -> None:
        """Write parts, and report them."""
        for done in parts:
            self.suspicion += done.suspicion
            self.tally.take(done.tally)
            if self.task.options.allow_refused or not self.tally.refused:
                self.write(done.text)

    def _pass_on(self, text: bytes) -> None:
        """What comes after the end of the program goes out as it came in."""
        while text:
            if stamp.SIGN.search(text.decode("latin-1")) and not self.task.options.force:
                raise NotInPartsError("there is a stamp after the end of the program")
            ended = text.endswith(b"\n")
            self.tally.blocks += text.count(b"\n")
            self.write(text)
            text = self.read(self.task.size)
            self.tally.blocks += not text and not ended
