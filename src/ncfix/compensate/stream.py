"""A long program corrected while it is read, part after part: see `driver`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ncfix import fast
from ncfix.compensate.account import (
    FixReport,
)
from ncfix.compensate.driver import SelfCheckError, strays
from ncfix.compensate.following import (
    LOOKED,
    Task,
    stamp_of,
    suspected,
)
from ncfix.compensate.parts import Part, Unit, Units
from ncfix.compensate.plain import Course, Planner
from ncfix.compensate.plain_figures import figures, largest_shift, written
from ncfix.compensate.plan.arrays import Mask
from ncfix.compensate.plan.deviation import PathError, path_error
from ncfix.compensate.plan.offset import is_offset
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.compensate.report import Tally
from ncfix.compensate.solve import Agreed, Before, Round, Settled, agree, differences, increments, settle
from ncfix.compensate.workers import Ground, Read, Share, crew
from ncfix.control.moves import Moves
from ncfix.control.parts import NotInPartsError, PartReader
from ncfix.diagnostics import Message, NcfixError
from ncfix.files import put_at
from ncfix.machine import State
from ncfix.text import stamp
from ncfix.text.language import language_of
from ncfix.text.tree import Program
from ncfix.text.writer import Splices, left_alone, spliced
from ncfix.writer.emit import Emission

FRAMES = "the program takes frames or values from where the machine stands"


@dataclass(frozen=True, slots=True)
class Done:
    """A part that has been corrected and proved.

    text       what it is now; how many bytes that are, where it has been put into a file
    tally      what there is to report of it
    next_line  of the program, with which the next part begins
    """

    text: bytes | int
    tally: Tally
    next_line: int

    def placed(self, file: int, at: int) -> Done:
        """The same with the text put into a file, from a byte on."""
        assert isinstance(self.text, bytes)
        put_at(file, at, self.text)
        return replace(self, text=len(self.text))


class Corrector:
    """Goes through a program and corrects its parts, or some of them. `work` is called once.

    head     the first part
    at       where the stamp stands in what is written
    stamped  the stamp, as far as it was known then; empty if there is none
    """

    def __init__(self, task: Task, read: Read) -> None:
        self.task = task
        self.units = Units.of(task, read)
        self.machine, reader = self.units.placed, self.units.reader
        self.again, self.proof = PartReader(task.path, task.dialect, task.head), task.follower()
        self.again.templates, self.again.index = reader.templates, reader.index
        self.planner, self.language = Planner.of(self.machine, task.options), language_of(task.dialect)
        self.head: Program | None = None
        self.at = 0
        self.stamped = b""

    def work(self, share: Share) -> Iterator[tuple[int, Done]]:
        """The number of each part of the share, and what it has become; the others are followed, or passed over.

        Raises what reading, following and correcting do, and at last UsageError for what the setup does not give.
        """
        foreign, self.units.share = False, share
        for number, unit in enumerate(self.units):
            if not share.has(number):
                self._follow_on(unit, foreign)
                foreign = True
                continue
            yield number, self._corrected(unit, number, share, foreign)
            foreign = False

    def _follow_on(self, unit: Unit, foreign: bool) -> None:
        """Take the proof past a part of another process, as programmed; `foreign`: so was the one before."""
        part = unit.part
        if unit.head is not None and not foreign:
            self.proof.stand(unit.head.moves.end[-1])
        if part.passage is not None:
            self.again.first_line += part.passage.lines
            self.proof.resume(part.passage.remains)
        self.again.first_line += part.program.lines_ended
        self.proof.follow(part.program, part.last)

    def stamp(self) -> bytes:
        """The stamp as it has to be by what is known now."""
        assert self.head is not None
        text = stamp_of(self.head, self.task.machine, self.task.options, assumed=self.units.assumed)
        return stamp.insertion(self.head, text).text

    def _corrected(self, unit: Unit, number: int, share: Share, foreign: bool) -> Done:
        """Correct a part, hand on what the next one has to know, and prove it; `foreign`: the one before was not."""
        if unit.head is not None and is_offset(unit.head.moves).any():
            raise NotInPartsError("the control offsets a contour from one part into the next")
        course = None if self.planner is None else self.planner.plan(unit)
        agreed = None if course is not None else self._agreed(unit)
        before = share.before(number)
        if before is not None and foreign:
            self.proof.stand(before.position)
        if course is not None and before is not None and not before.kept:
            plain = written(self.language, course, before.position, increments(self.machine))
            if plain is not None:
                return self._plainly(course, plain, number, share)
        return self._settled(unit, agreed or self._agreed(unit), before, number, share)

    def _plainly(self, course: Course, plain: Emission, number: int, share: Share) -> Done:
        """Finish a part of plain motions."""
        part, moves = course.part, course.part.moves
        text = spliced(part.program.source, plain.splices)
        if not part.last:
            shift = course.real.start[-1] - moves.start[-1]
            left = Before.steady(shift, np.zeros(len(shift), dtype=np.int8), plain.end[-1].copy())
            share.leave(number, left, len(text))
        settled = course.settled(plain)
        _check(differences(settled, self._read_again(text, part, plain.splices)))
        tally = Tally(self.machine.least_increment[0])
        tally.add_plain(part.program, settled, largest_shift(course, plain), course.intent)
        if self.task.options.verify:
            _note(tally, figures(course, plain, self.task.options.split_rapids), part.program, moves)
        return Done(text, tally, part.program.first_line + part.program.lines_ended)

    def _agreed(self, unit: Unit) -> Agreed:
        """The plan of a part by the long way, as far as it does not depend on what the part before has left."""
        part = unit.together
        nowhere = np.zeros(len(part.moves.axes))
        guess = None if unit.head is None else Before.steady(nowhere, unit.direction, nowhere)
        return agree(part.moves, self.machine, self.task.dialect, self.task.options, guess)

    def _settled(self, unit: Unit, agreed: Agreed, before: Before | None, number: int, share: Share) -> Done:
        """Correct a part by the long way."""
        task, part = self.task, unit.together
        moves = part.moves
        first: Agreed | None = agreed
        if before is not None:
            before = replace(before, direction=unit.direction)
            first = None if _is_off(moves, before.rounds[0]) else first
        settled = settle(part.program, moves, self.machine, task.options, before=before, first=first)
        if before is not None and (settled.unmoored or settled.kept[0] != before.kept):
            raise NotInPartsError("a refusal reaches back into an earlier part")
        text = self._text(part.program, settled, before is None)
        if not part.last:
            share.leave(number, _left(settled), len(text))
        own = np.ones(len(moves), dtype=bool)
        own[:1] = unit.head is None
        self._prove(text, settled, own, unit)
        tally = Tally(self.machine.least_increment[0])
        tally.add(part.program, settled, own, self.machine)
        if task.options.verify:
            self._look(part, settled, own, unit, tally)
        return Done(text, tally, part.program.first_line + part.program.lines_ended)

    def _text(self, program: Program, settled: Settled, first: bool) -> bytes:
        """The corrected text of a part."""
        splices = settled.emission.splices
        if not first:
            stop = int(program.blocks[1, 0]) if len(program) > 1 else len(program.source)
            return spliced(program.source, splices)[stop:]
        edit = stamp.insertion(program, stamp_of(program, self.task.machine, self.task.options))
        self.at = edit.start
        self.head = program
        if len(splices):
            self.stamped = self.stamp()
            edit = replace(edit, text=self.stamped)
            splices = Splices.joined([splices, Splices.of([edit])])
        return spliced(program.source, splices)

    def _prove(self, text: bytes, settled: Settled, own: Mask, unit: Unit) -> None:
        """The control must understand what the plan meant."""
        head, splices = unit.head, settled.emission.splices
        edits = None if head is None else splices.moved(-len(head.program.source))
        _check(differences(settled, self._read_again(text, unit.part, edits), own[settled.plan.pieces.move]))

    def _read_again(self, text: bytes, part: Part, edits: Splices | None) -> Moves:
        """What a control makes of the text that was written; `edits` make it of that of the part, if known."""
        if edits is not None and fast.engaged() and not left_alone(part.program.source, edits, text):
            raise SelfCheckError("more of the text has changed than was written anew")
        try:
            program = self.again.read(text)
            again = self.proof.follow(program, part.last)
        except NcfixError as error:
            raise SelfCheckError(f"the corrected program cannot be read: {error}") from error
        self.again.first_line += program.lines_ended
        return again

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
        _note(tally, errors, part.program, moves)


def _note(tally: Tally, errors: PathError, program: Program, moves: Moves) -> None:
    """Take in the tip errors of a part; raises `NotInPartsError` where these say that its path strays."""
    if strays(errors):
        raise NotInPartsError("the path of a part strays")
    tally.figures(errors, program, moves)


def _check(wrong: Mask | None) -> None:
    """Raise `NotInPartsError` where a control would understand pieces otherwise than they were meant."""
    if wrong is None or wrong.any():
        raise NotInPartsError(FRAMES)


def _is_off(moves: Moves, before: Round) -> bool:
    """Whether in a round the motion before was left as it was, or an axis goes on standing off its place behind it."""
    return bool(before.kept.any() or (moves.wordless[0] & (before.shift != 0)).any())


def _left(settled: Settled) -> Before:
    """What a part leaves to the next one, but for the way in which the axes came there."""
    return Before.of(settled.rounds, np.zeros(len(settled.moves.axes), dtype=np.int8))


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
