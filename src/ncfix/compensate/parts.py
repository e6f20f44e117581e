"""A long program in parts, which are read, followed and proved one after the other.

Each part is planned together with the last motion of the part before it, whose text is written already.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from ncfix import core
from ncfix.arrays import Index, Mask, Signs
from ncfix.compensate import FixOptions
from ncfix.compensate.block_delete import JointPlan, Readings
from ncfix.compensate.following import Task, refuse_stamped, resolving, with_tool_lengths, with_workpiece
from ncfix.compensate.plan.figure_tally import PathError
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.kinematics import matters
from ncfix.compensate.solve import Round, SelfCheckError, WrittenPlan, differences, same_rounds
from ncfix.compensate.workers import PartCheckpoint, Read, WorkShare
from ncfix.control.moves import MotionKind, Moves, Rule, Trace
from ncfix.control.setup import Setup
from ncfix.control.trace import Follower, NotInPartsError, PartReader, joined_moves, joined_programs, last_of, stretch
from ncfix.diagnostics import Message, NcfixError, UsageError
from ncfix.machine import Machine, State
from ncfix.text.tree import Program
from ncfix.text.writer import Splices, left_alone
from ncfix.values import frozen, mutable
from ncfix.writer.pieces import SecondReading

FRAMES = "the program uses the position of the machine in frames or values"
MOST_PENDING = 64
"""Largest number of stretches of text that are joined to find a part that ends at a permitted place (`_ends_clean`)."""


@frozen
class Part:
    """One part of a program: its text, its motions, and whether it is the last.

    checkpoint  if given, only the last block of the part was read; another process has corrected the part
    """

    program: Program
    moves: Moves
    last: bool
    checkpoint: PartCheckpoint | None = None

    @property
    def lines(self) -> Index:
        """(n,) the line number of each motion."""
        return self.program.lines(self.moves.block)


@mutable
class Parts:
    """Reads and follows a program part by part. `parts` can be iterated once only.

    read    returns the next `size` bytes of the text; no bytes at its end
    size    usual size of a part, bytes
    sided   the errors of the machine depend on the direction in which its axes move
    rest    text that was read and does not belong to a part yet; at the end, the text behind the end of the program
    blocks  number of lines so far
    tcp     whether tool-centre-point control was on in the last text, or may have been
    share   the parts that this process works on
    found   number of parts read so far, including those after a value was found to be lacking
    told    number of the last own part that was announced to the other processes
    """

    options: FixOptions
    reader: PartReader
    follower: Follower
    read: Read
    size: int
    sided: bool = False
    rest: bytes = b""
    blocks: int = 0
    tcp: bool = True
    share: WorkShare = field(default_factory=WorkShare)
    found: int = 0
    told: int = -1

    def parts(self) -> Iterator[Part]:
        """The parts of the text. Each ends behind a straight motion that may be corrected, see `_ends_clean`."""
        pending: list[tuple[Program, Moves]] = []
        for program, last, checkpoint in self._texts():
            refuse_stamped(program, self.options)
            self.reader.first_line += program.lines_ended
            self.blocks += len(program)
            self.follower.watched = self.share.shares(self.found)
            pending.append((program, self.follower.follow(program, last)))
            self.tcp = bool(pending[-1][1].tcp.any()) if checkpoint is None else checkpoint.tcp
            last |= self.follower.ended
            if checkpoint is not None:
                self.found += 1
                yield Part(*pending.pop(), last, checkpoint)
                continue
            if not last and not _ends_clean(*pending[-1]):
                self._tell(None)
                if len(pending) > MOST_PENDING:
                    raise NotInPartsError("the program cannot be divided into parts")
                continue
            programs = [each for each, _ in pending]
            moves = joined_moves([each for _, each in pending], [len(each) for each in programs])
            self._tell(None if last or len(pending) > 1 else self._checkpoint(*pending[0]))
            if last:
                while self.follower.to_the_last and not self.rest.strip() and (more := self.read(self.size)):
                    self.rest += more
                if self.follower.to_the_last and self.rest.strip():
                    raise NotInPartsError("text that may belong to the program comes after its end")
            self.found += 1
            yield Part(joined_programs(programs), moves, last)
            pending = []
            if last:
                return

    def behind(self) -> Iterator[bytes]:
        """The text behind the end of the program, piece by piece. Adds its lines to `blocks`."""
        text = self.rest
        while text:
            ended = text.endswith(b"\n")
            self.blocks += text.count(b"\n")
            yield text
            text = self.read(self.size)
            self.blocks += not text and not ended

    def check_behind(self) -> None:
        """Raise `NotInPartsError` if anything but a tape mark (%) stands behind the end of the program."""
        if any(text.strip(b"% \t\r\n") for text in self.behind()):
            raise NotInPartsError("text comes after the end of the program")

    def _tell(self, checkpoint: PartCheckpoint | None) -> None:
        """Announce an own part to the other processes, once.

        This must happen before more text is read: the first process, which reads for all, may wait for it.
        """
        if self.share.shares(self.found) and self.told < self.found:
            self.told = self.found
            self.share.announce(self.found, checkpoint)

    def _checkpoint(self, program: Program, moves: Moves) -> PartCheckpoint | None:
        """What other processes need to know of a part; None if they have to follow it themselves."""
        control = None if self.sided else self.follower.checkpoint(moves)
        if control is None:
            return None
        begin = int(program.blocks[-1, 0])
        lines = program.lines_ended_before(begin)
        return PartCheckpoint(len(program.source), begin, lines, len(program) - 1, self.tcp, control)

    def _passed(self, checkpoint: PartCheckpoint, text: bytes) -> Program:
        """Pass over the part with which this text begins; returns its last block, which alone is read."""
        self.rest = text[checkpoint.size :]
        self.reader.first_line += checkpoint.lines
        self.blocks += checkpoint.blocks
        self.follower.resume(checkpoint.control)
        return self.reader.read(text[checkpoint.begin : checkpoint.size])

    @property
    def _wanted(self) -> int:
        """Wanted size of the next part, bytes: smaller for the first part, and under TCP, which needs more memory."""
        if not self.found:
            return self.size // 8
        return self.size // 2 if self.tcp else self.size

    def _texts(self) -> Iterator[tuple[Program, bool, PartCheckpoint | None]]:
        """Stretches of text that end between two blocks of plain words, True with the last one, and its checkpoint.

        All processes read the same sizes, so that all of them cut the text at the same places.
        """
        wanted = self._wanted
        while True:
            new = self.read(max(wanted - len(self.rest), self.size // 8, 1))
            text = self.rest + new
            if not new:
                self.rest = b""
                if text:
                    yield self.reader.read(text), True, None
                return
            if text.isspace():
                self.rest = text
                continue
            checkpoint = self.share.checkpoint(self.found)
            if checkpoint is not None and checkpoint.size <= len(text):
                wanted = self._wanted
                yield self._passed(checkpoint, text), False, checkpoint
                continue
            begun = text[: text.rfind(b"\n", 0, max(text.rfind(b"\n"), 0)) + 1]
            program = None if not begun or begun.isspace() else self.reader.read(begun)
            cut = self.reader.last_cut(program) if program is not None else 0
            if program is None or not cut:
                self._tell(None)
                self.rest, wanted = text, 2 * max(wanted, len(text))
                continue
            wanted = self._wanted
            self.rest = text[int(program.blocks[cut, 0]) :]
            yield stretch(program, 0, cut), False, None


def _ends_clean(program: Program, moves: Moves) -> bool:
    """Whether a part may end here: its last block is one straight motion that may be corrected, between known ends."""
    if len(moves) < 2 or moves.block[-1] != len(program) - 1 or moves.block[-2] == moves.block[-1]:
        return False
    straight = moves.kind[-1] in (MotionKind.RAPID, MotionKind.FEED) and moves.modal[-1] in (0, 10)
    known = np.isfinite(moves.start[-1]).all() and np.isfinite(moves.end[-1]).all()
    return bool(straight and known and moves.rule[-1] == Rule.CORRECT)


@frozen(slots=False)
class ContinuedPart:
    """A part, with the last motion of the part before it, whose text is written already.

    head       that motion and its block; None for the first part
    direction  (n_axes,) direction in which each axis came to the start of that motion: -1, 1, or 0 if not known
    machine    the machine with the workpiece at its place
    """

    part: Part
    head: Part | None
    direction: Signs
    machine: Machine

    @classmethod
    def whole(cls, program: Program, moves: Moves, machine: Machine) -> ContinuedPart:
        """A program that is one part."""
        return cls(Part(program, moves, True), None, np.zeros(len(machine.axes), dtype=np.int8), machine)

    @cached_property
    def joined(self) -> Part:
        """The part with the motion before it as its first motion."""
        if self.head is None:
            return self.part
        program = joined_programs([self.head.program, self.part.program])
        moves = joined_moves([self.head.moves, self.part.moves], [1, len(self.part.program)])
        return Part(program, moves, self.part.last)

    @cached_property
    def intent(self) -> Intent:
        """The motions of `joined` on the machine."""
        return Intent(self.machine, self.joined.moves, State(direction=self.direction))


@mutable(kw_only=True)
class MachineParts(Parts):
    """The parts of a program on a machine, with every tool length known. Gone through once.

    machine  as its file describes it; `set_up` is the same with the workpiece where the setup has it
    count    number of parts so far
    tools    names of the tool lengths that were taken as zero
    notes    messages about tool lengths, by code and text
    lacking  messages about tool lengths that must be given, by text
    units    units of length so far, mm
    look     is called with each part
    """

    machine: Machine
    set_up: Machine
    setup: Setup
    count: int = 0
    tools: dict[str, str] = field(default_factory=dict)
    notes: dict[tuple[str, str], Message] = field(default_factory=dict)
    lacking: dict[str, Message] = field(default_factory=dict)
    units: set[float] = field(default_factory=set)
    look: Callable[[Part], object] | None = None

    @classmethod
    def of(cls, task: Task, read: Read) -> MachineParts:
        """The parts of the program whose text `read` returns."""
        return cls(
            task.options,
            PartReader(task.path, task.dialect, task.head),
            task.follower(),
            read,
            task.size,
            matters(task.machine),
            machine=task.machine,
            set_up=resolving(with_workpiece(task.machine, task.setup), task.dialect, task.head),
            setup=task.setup,
        )

    @property
    def assumed(self) -> tuple[str, ...]:
        """The names of all values that were taken as zero so far."""
        return tuple(dict.fromkeys((*self.follower.assumed, *self.tools)))

    @property
    def messages(self) -> tuple[Message, ...]:
        """The messages from following the program so far."""
        return (*self.follower.messages, *self.notes.values())

    def __iter__(self) -> Iterator[ContinuedPart]:
        """The parts, each with the motion before it. Once a value is lacking, no further part is yielded.

        Raises what reading and following raise and, at the end, UsageError for everything that the setup does not give.
        """
        head, direction = None, np.zeros(len(self.machine.axes), dtype=np.int8)
        for raw in self.parts():
            part = replace(raw, moves=self._known(raw))
            if self.follower.lacking or self.lacking:
                continue
            if self.look is not None:
                self.look(part)
            continued = ContinuedPart(part, head, direction, self.set_up)
            units = {frame.unit for frame in part.moves.frames}
            if head is not None and not units <= self.units:
                raise NotInPartsError("the program changes between inch and mm")
            self.units |= units
            if not part.last:
                head, direction = self._head(continued)
            self.count += 1
            yield continued
        if missing := (*self.follower.lacking,) or (*self.lacking.values(),):
            raise UsageError.collected(missing)

    def _known(self, part: Part) -> Moves:
        """The motions of a part with every tool length known. Lengths that must be given are noted in `lacking`."""
        try:
            trace = with_tool_lengths(part.program, Trace(part.moves), self.machine, self.setup)
        except UsageError as error:
            self.lacking |= {message.text: message for message in error.messages if message.text not in self.lacking}
            return part.moves
        for name, message in zip(trace.assumed, trace.messages, strict=True):
            self.tools.setdefault(name, name)
            self.notes.setdefault((message.code, message.text), message)
        return trace.moves

    def _head(self, continued: ContinuedPart) -> tuple[Part, Signs]:
        """The last motion of a part with its block, and the direction in which each axis came to its start."""
        part, direction = continued.part, continued.direction
        head = Part(*last_of(part.program, part.moves), False)
        if self.sided:
            assert continued.intent.came is not None
            direction = continued.intent.came[-1]
        return head, direction


@frozen
class Attempt:
    """A first attempt at a part whose text does not mean what was planned: the text, its motions, the plan's rounds."""

    text: bytes
    again: Moves
    rounds: tuple[Round, ...]


def misread_pieces(solution: WrittenPlan, again: Moves, own: Mask | None = None) -> Index:
    """The numbers of the pieces that the control would understand otherwise than planned.

    again  the motions of the text that was written
    own    (m,) the pieces that stand in this text; None: all
    """
    try:
        wrong = np.flatnonzero(differences(solution, again, own))
    except SelfCheckError as error:
        raise NotInPartsError(FRAMES) from error
    return wrong if own is None else np.flatnonzero(own)[wrong]


def reading_of(solution: WrittenPlan, again: Moves, head: Part | None) -> SecondReading:
    """The control's reading of a part that was written, one row for each motion.

    head  the motion before the part, if there is one: it is the first row, and its text belongs to the part before
    """
    pieces = solution.plan.pieces
    if head is None:
        return SecondReading.of(again, pieces)
    read = SecondReading.of(again, pieces.rows(np.flatnonzero(pieces.move > 0)))
    assert read.start is not None
    assert read.end is not None
    frame, last = head.moves.frames[head.moves.frame[0]], int(pieces.last[0])
    return SecondReading(
        np.append(np.int32(len(read.frames)), read.frame),
        (*read.frames, frame),
        np.concatenate([solution.plan.start[:1], read.start]),
        np.concatenate([solution.emission.end[last : last + 1], read.end]),
    )


class PartProof:
    """The proof of the parts of a program: reads and follows the corrected text, part after part."""

    def __init__(self, task: Task, reader: PartReader) -> None:
        self.again, self.follower = PartReader(task.path, task.dialect, task.head), task.follower()
        self.again.templates, self.again.index = reader.templates, reader.index
        self.misread: Attempt | None = None

    def pass_over(self, continued: ContinuedPart, skipped: bool) -> None:
        """Follow a part of another process as programmed; `skipped`: the part before belonged to another one, too."""
        part = continued.part
        if continued.head is not None and not skipped:
            self.follower.stand(continued.head.moves.end[-1])
        if part.checkpoint is not None:
            self.again.first_line += part.checkpoint.lines
            self.follower.resume(part.checkpoint.control)
        self.again.first_line += part.program.lines_ended
        self.follower.follow(part.program, part.last)

    def misreadings(self, continued: ContinuedPart, joint: JointPlan, text: bytes) -> Readings | None:
        """See `driver.Proof.misreadings`.

        A motion that is left unchanged may end elsewhere because a motion before it was corrected. Then the part is
        planned once more with this reading. The text must not change, because the follower has passed it already and
        cannot go back.
        """
        (solution,), head, misread = joint.plans, continued.head, self.misread
        own = None if head is None else solution.plan.pieces.move > 0
        if misread is None:
            edits = None if head is None else joint.splices.moved(-len(head.program.source))
            again = self._followed(continued.part, text, edits)
        elif misread.text == text and same_rounds(misread.rounds, solution.rounds):
            again = misread.again
        else:
            raise NotInPartsError(FRAMES)
        wrong = misread_pieces(solution, again, own)
        if not wrong.size:
            self.misread = None
            return None
        if misread is not None or not solution.plan.pieces.unchanged[wrong].all():
            raise NotInPartsError(FRAMES)
        self.misread = Attempt(text, again, solution.rounds)
        return [reading_of(solution, again, head)]

    def check(self, part: Part, solution: WrittenPlan, text: bytes, edits: Splices) -> None:
        """Prove a part of plain motions: raise `NotInPartsError` if its text means anything else than was planned.

        edits  the edits that make `text` from the text of the part
        """
        if misread_pieces(solution, self._followed(part, text, edits)).size:
            raise NotInPartsError(FRAMES)

    def _followed(self, part: Part, text: bytes, edits: Splices | None) -> Moves:
        """The motions of a corrected text; `edits` are those that make it from the text of the part, if known."""
        if edits is not None and core.engaged() and not left_alone(part.program.source, edits, text):
            raise SelfCheckError("more of the text has changed than was written anew")
        try:
            program = self.again.read(text)
            again = self.follower.follow(program, part.last)
        except NcfixError as error:
            raise SelfCheckError(f"the corrected program cannot be read: {error}") from error
        self.again.first_line += program.lines_ended
        return again

    def astray(self, line: int | None, errors: PathError) -> Exception:
        """See `driver.Proof.astray`."""
        return NotInPartsError("the path of a part strays")
