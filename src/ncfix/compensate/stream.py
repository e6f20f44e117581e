"""A program corrected while it is read: part after part, in memory that does not depend on its length.

    text --part--> Program --follow--> Moves --settle--> pieces, text --read, follow--> Moves again --> written

Every part goes through the same plan, emitter, checks and proof as a whole program does (see `fix`), and what comes out
is the same, byte for byte. A part begins with the last motion of the one before it, which is written already: all that
one part has to know of the earlier ones is what that motion left (`Before`). What cannot be done that way raises
`NotInPartsError`, and the caller takes the program as a whole.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ncfix.compensate.account import FixReport
from ncfix.compensate.crew import Crew, Later, crew
from ncfix.compensate.direction import Signs, matters
from ncfix.compensate.double import suspected
from ncfix.compensate.findings import Mask
from ncfix.compensate.fix import refuse_stamped, stamp_of
from ncfix.compensate.following import Resolve, kinematics_of, placed, rotary_names, with_tool_lengths
from ncfix.compensate.intent import Intent
from ncfix.compensate.options import FixOptions
from ncfix.compensate.proof import SelfCheckError, differences
from ncfix.compensate.settle import Agreed, Before, Settled, increments, settle
from ncfix.compensate.strategies import get_strategy
from ncfix.compensate.tally import Tally
from ncfix.compensate.verify import PathError
from ncfix.diagnostics import Message, NcfixError, UsageError
from ncfix.machine import Machine, State
from ncfix.program import stamp
from ncfix.program.dialect import Dialect
from ncfix.program.language import Run, language_of
from ncfix.program.moves import Kind, Moves, Rule, Trace
from ncfix.program.parts import Follower, NotInPartsError, PartReader, joined, joined_moves, rows_of, stretch
from ncfix.program.setup import Setup
from ncfix.program.tree import Program
from ncfix.program.writer import Splices, spliced

PART_BYTES = 3 << 18
"""How much text is a part: the columns of a part take about thirty times as much memory."""
MOST_PENDING = 64
"""Parts that may be put together before one of them ends where it may."""


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
class Part:
    """Text that can be worked on: a program that ends where it may, its motions, and whether it is the last."""

    program: Program
    moves: Moves
    last: bool


@dataclass(frozen=True, slots=True)
class Unit:
    """A part behind the last motion of the one before: `before` as far as it is known yet; `agreed` gives its plan."""

    program: Program
    moves: Moves
    last: bool
    before: Before | None
    agreed: Later[Agreed]


@dataclass(slots=True)
class Stream:
    """One program on its way. `run` is called once.

    read   gives the next so many bytes of the text; none at its end
    write  takes the corrected text, part by part
    size   bytes of a part
    jobs   processes that work on parts
    """

    machine: Machine
    setup: Setup
    options: FixOptions
    resolve: Resolve | None
    path: str
    dialect: Dialect
    read: Callable[[int], bytes]
    write: Callable[[bytes], None]
    size: int = PART_BYTES
    jobs: int = 1
    tally: Tally = field(default_factory=Tally)
    rest: bytes = b""
    context: tuple[Part, Signs] | None = None
    direction: Signs = field(init=False)
    before: Before | None = None
    looks: deque[tuple[Later[PathError], NDArray[np.int64]]] = field(default_factory=deque)
    at: int = 0
    stamped: bytes = b""
    head: Program | None = None
    units: set[float] = field(default_factory=set)
    tools: dict[str, str] = field(default_factory=dict)
    lacking: dict[str, Message] = field(default_factory=dict)
    suspicion: tuple[Message, ...] = ()

    def __post_init__(self) -> None:
        self.direction = np.zeros(len(self.machine.axes), dtype=np.int8)

    def run(self) -> Streamed:
        """Correct the program; raises what `fix_program` raises, and `NotInPartsError`."""
        strategy = get_strategy(self.options.strategy)
        language = language_of(self.dialect)
        if strategy.corrects_orientation or not strategy.follows_path or self.machine.is_perfect:
            raise NotInPartsError(f"the strategy {strategy.name} looks at the whole path at once")
        if language.follower is None:
            raise NotInPartsError(f"{self.dialect.title} is followed as a whole")
        on_machine = placed(self.machine, self.setup)
        follower, proof = self._follower(), self._follower()
        again = PartReader(self.path, self.dialect)
        with crew(self.jobs, on_machine, self.dialect, self.options) as workers:
            waiting: deque[Unit] = deque()
            for part in self._parts(follower):
                moves = self._known(part)
                if follower.lacking or self.lacking:
                    continue
                waiting.append(self._unit(part, moves, on_machine, workers))
                while len(waiting) > workers.ahead:
                    self._correct(waiting.popleft(), on_machine, follower, (again, proof), workers)
            while waiting and not (follower.lacking or self.lacking):
                self._correct(waiting.popleft(), on_machine, follower, (again, proof), workers)
            self._gather(workers, 0)
        if follower.lacking:
            raise UsageError.collected(follower.lacking)
        if self.lacking:
            raise UsageError.collected(self.lacking.values())
        self._pass_on()
        report = self.tally.report(self.path, (*self.suspicion, *follower.messages), strategy.leaves, self.options)
        assumed = (*follower.assumed, *self.tools)
        return Streamed(report, Stamp(self.at, self.stamped, self._stamp(assumed) if self.tally.changed else b""))

    # -- parts --------------------------------------------------------------------------------------------------------

    def _follower(self) -> Follower:
        make = language_of(self.dialect).follower
        assert make is not None
        axes, rotary = self.machine.axis_names, rotary_names(self.machine)
        kinematics = kinematics_of(self.machine)
        found: Follower = make(self.dialect, Run(self.setup, axes, rotary, self.resolve, kinematics=kinematics))
        return found

    def _parts(self, follower: Follower) -> Iterator[Part]:
        """The text in parts that end where they may."""
        reader = PartReader(self.path, self.dialect)
        pending: list[tuple[Program, Moves]] = []
        for program, last in self._texts(reader):
            refuse_stamped(program, self.options)
            reader.first_line += len(program)
            self.tally.blocks += len(program)
            pending.append((program, follower.follow(program, last)))
            last |= follower.ended
            if not last and not _ends_clean(*pending[-1]):
                if len(pending) > MOST_PENDING:
                    raise NotInPartsError("there is no place at which the program could be parted")
                continue
            programs = [each for each, _ in pending]
            moves = joined_moves([each for _, each in pending], [len(each) for each in programs])
            yield Part(joined(programs), moves, last)
            pending = []
            if last:
                return

    def _texts(self, reader: PartReader) -> Iterator[tuple[Program, bool]]:
        """The text in parts that end between two blocks of plain words; True with the last one."""
        wanted = self.size
        while True:
            new = self.read(max(wanted - len(self.rest), self.size // 4))
            text = self.rest + new
            if not new:
                self.rest = b""
                if text:
                    yield reader.read(text), True
                return
            if not text.strip():
                self.rest = text
                continue
            stop = text.rfind(b"\n", 0, max(text.rfind(b"\n"), 0)) + 1
            program = reader.read(text[:stop]) if stop else None
            cut = reader.last_cut(program) if program is not None else 0
            if program is None or not cut:
                self.rest, wanted = text, 2 * max(wanted, len(text))
                continue
            wanted = self.size
            self.rest = text[int(program.blocks[cut, 0]) :]
            yield stretch(program, 0, cut), False

    def _pass_on(self) -> None:
        """What comes after the end of the program goes out as it came in."""
        text = self.rest
        while text:
            if stamp.SIGN.search(text.decode("latin-1")) and not self.options.force:
                raise NotInPartsError("there is a stamp after the end of the program")
            ended = text.endswith(b"\n")
            self.tally.blocks += text.count(b"\n")
            self.write(text)
            text = self.read(self.size)
            self.tally.blocks += not text and not ended

    # -- one part -----------------------------------------------------------------------------------------------------

    def _unit(self, part: Part, moves: Moves, machine: Machine, workers: Crew) -> Unit:
        """A part behind the last motion of the one before, and its plan, which somebody begins to make."""
        program, before = part.program, None
        if self.context is not None:
            head, self.direction = self.context
            program = joined([head.program, program])
            moves = joined_moves([head.moves, moves], [1, len(part.program)])
            nowhere = np.zeros(len(moves.axes))
            before = Before(False, nowhere, self.direction, nowhere)
        units = {frame.unit for frame in moves.frames}
        if not units <= self.units and self.context is not None:
            raise NotInPartsError("the program changes between inch and mm")
        self.units |= units
        if not part.last:
            self.context = self._context(program, moves, machine)
        return Unit(program, moves, part.last, before, workers.agree(moves, before))

    def _context(self, program: Program, moves: Moves, machine: Machine) -> tuple[Part, Signs]:
        """The last motion with its block, and the way in which the axes came there."""
        row = len(moves) - 1
        block = int(moves.block[row])
        head = Part(stretch(program, block, block + 1), rows_of(moves, row, row + 1, block), False)
        if not matters(machine):
            return head, self.direction
        arrival = Intent(machine, moves, State(direction=self.direction)).arrival
        assert arrival is not None
        return head, arrival[row - 1] if row else self.direction

    def _correct(
        self, unit: Unit, machine: Machine, follower: Follower, proof: tuple[PartReader, Follower], workers: Crew
    ) -> None:
        """Correct a part, prove it, write it, and keep what the next one has to know."""
        program, moves = unit.program, unit.moves
        agreed: Later[Agreed] | None = unit.agreed
        own = np.ones(len(moves), dtype=bool)
        if unit.before is not None:
            assert self.before is not None
            own[0] = False
            agreed = None if self.before.kept or _still_off(moves, self.before) else agreed
            self.before = replace(self.before, direction=unit.before.direction)
        first = agreed() if agreed is not None else None
        settled = settle(program, moves, machine, self.options, before=self.before, first=first)
        if self.before is not None and settled.kept[0] != self.before.kept:
            raise NotInPartsError("a refusal reaches back into an earlier part")
        if self.before is None:
            self.suspicion = suspected(settled, machine.least_increment[0], self.path, self.options.force)
        text = self._text(program, settled, follower)
        self._prove(text, settled, own, unit.last, *proof)
        self.tally.add(program, settled, own, increments(machine))
        if self.options.verify:
            self._look(program, settled, own, workers)
        if self.options.allow_refused or not self.tally.refused:
            self.write(text)
        shift = settled.plan.start[-1] - moves.start[-1]
        shift = np.where(np.isfinite(shift), shift, 0.0)
        self.before = Before(bool(settled.kept[-1]), shift, self.direction, settled.emission.end[-1].copy())

    def _known(self, part: Part) -> Moves:
        """The motions of a part with every tool length known; notes what is lacking."""
        try:
            found = with_tool_lengths(part.program, Trace(part.moves), self.machine, self.setup)
        except UsageError as error:
            self.lacking |= {message.text: message for message in error.messages if message.text not in self.lacking}
            return part.moves
        for name, message in zip(found.assumed, found.messages, strict=True):
            self.tools.setdefault(name, name)
            self.tally.notes.setdefault((message.code, message.text), message)
        return found.moves

    def _text(self, program: Program, settled: Settled, follower: Follower) -> bytes:
        """The corrected text of a part."""
        splices = settled.emission.splices
        if self.before is not None:
            stop = int(program.blocks[1, 0]) if len(program) > 1 else len(program.source)
            return spliced(program.source, splices)[stop:]
        edit = stamp.insertion(program, stamp_of(program, self.machine, self.options, ()))
        self.at = edit.start
        self.head = program
        if len(splices):
            self.stamped = self._stamp((*follower.assumed, *self.tools))
            edit = replace(edit, text=self.stamped)
            splices = Splices.joined([splices, Splices.of([edit])])
        return spliced(program.source, splices)

    def _stamp(self, assumed: tuple[str, ...]) -> bytes:
        assert self.head is not None
        return stamp.insertion(self.head, stamp_of(self.head, self.machine, self.options, assumed)).text

    def _prove(
        self, text: bytes, settled: Settled, own: Mask, last: bool, reader: PartReader, follower: Follower
    ) -> None:
        """The text is read and followed again: the control must understand what the plan meant."""
        try:
            program = reader.read(text)
            again = follower.follow(program, last)
        except NcfixError as error:
            raise SelfCheckError(f"the corrected program cannot be read: {error}") from error
        reader.first_line += len(program)
        wrong = differences(settled, again, own[settled.plan.pieces.move])
        if wrong is None or wrong.any():
            raise NotInPartsError("the program takes frames or values from where the machine stands")

    def _look(self, program: Program, settled: Settled, own: Mask, workers: Crew) -> None:
        """Begin to find out the tip errors before and after, with the numbers as the control will understand them."""
        emission, moves = settled.emission, settled.moves
        pieces = replace(settled.plan.pieces, end=emission.end, centre=emission.centre)
        state = State() if self.before is None else State(direction=self.before.direction)
        known = settled.plan.known
        found = workers.errors(moves, pieces, emission.start, state, own & ~settled.kept, known)
        self.looks.append((found, program.lines(moves.block)))
        self._gather(workers, workers.ahead)

    def _gather(self, workers: Crew, most: int) -> None:
        """Take in what was found out, but for that of the last `most` parts."""
        while len(self.looks) > most:
            found, lines = self.looks.popleft()
            self.tally.figures(found(), lines)


def _still_off(moves: Moves, before: Before) -> bool:
    """Whether an axis goes on standing off its place where a part begins, which its plan did not know."""
    return bool((moves.wordless[0] & (before.shift != 0)).any())


def _ends_clean(program: Program, moves: Moves) -> bool:
    """Whether another part may follow: the last block is a straight motion that may be corrected, and nothing else."""
    if len(moves) < 2 or moves.block[-1] != len(program) - 1 or moves.block[-2] == moves.block[-1]:
        return False
    straight = moves.kind[-1] in (Kind.RAPID, Kind.FEED) and moves.modal[-1] in (0, 10)
    known = np.isfinite(moves.start[-1]).all() and np.isfinite(moves.end[-1]).all()
    return bool(straight and known and moves.rule[-1] == Rule.CORRECT)
