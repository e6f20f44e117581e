"""The correction of one program: plan, write, and prove by following the corrected text again.

    Program --trace--> Moves --plan--> Pieces --emit--> edits --apply--> text --read, trace--> Moves again

The corrected text is read and followed again before it is given out: the control must understand exactly what the plan
meant. If it would not, that is a fault of ncfix, and nothing is written.

A whole program is one part (`fix_program`). A long program is corrected while it is read, part after part, in memory
that does not depend on its length (`Stream`). Every part goes through the same plan, emitter, checks and proof, and the
output is the same, byte for byte. A part begins with the last motion of the part before it, whose text is written
already: that motion is all that a part needs to know of the earlier ones (`PrecedingMotion`). A program that cannot be
corrected in parts raises `NotInPartsError`; the caller then corrects it as a whole. Several processes may share the
parts of one program: see `workers`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import field, replace
from functools import partial
from typing import Protocol

import numpy as np

from ncfix.arrays import Mask
from ncfix.compensate import FixOptions
from ncfix.compensate.account import Reason
from ncfix.compensate.block_delete import (
    JointPlan,
    Readings,
    WholeProof,
    assumed_of,
    messages_of,
    plan_and_write_all,
    positions_of,
    stamped,
)
from ncfix.compensate.following import (
    LOOKED,
    Resolve,
    Task,
    kinematics_of,
    refuse_stamped,
    resolving,
    rotary_names,
    stamp_of,
    suspected,
    traced,
    with_tool_lengths,
    with_workpiece,
)
from ncfix.compensate.parts import ContinuedPart, MachineParts, PartProof
from ncfix.compensate.plain import PlainPlan, Planner
from ncfix.compensate.plain_figures import figures, largest_shift, written
from ncfix.compensate.plan.deviation import path_error
from ncfix.compensate.plan.figure_tally import PathError
from ncfix.compensate.plan.offset import is_offset
from ncfix.compensate.report import FixReport, Tally, in_lines
from ncfix.compensate.solve import AcceptedPlan, Planning, PrecedingMotion, WrittenPlan, increments
from ncfix.compensate.workers import OpenFiles, Read, WorkShare, worker_pool
from ncfix.control.interpreter import NEVER
from ncfix.control.moves import Moves, Trace
from ncfix.control.setup import Setup
from ncfix.control.trace import NotInPartsError
from ncfix.diagnostics import Message, Place
from ncfix.files import put_at
from ncfix.machine import Machine
from ncfix.text import stamp
from ncfix.text.language import Language, language_of
from ncfix.text.tree import Program
from ncfix.text.writer import Edit, Splices, spliced
from ncfix.values import frozen, mutable
from ncfix.writer.emit import Emission
from ncfix.writer.language import WrittenLanguage

ASTRAY_MM = 1.0
"""Tip error, mm, that no corrected path reaches: a larger one means that the path is a different one."""
FREE_ATTEMPTS = 4
"""Number of attempts after which a block that was refused in one attempt stays refused, so that the attempts end."""


class Proof(Protocol):
    """Reads and follows the corrected text again."""

    def misreadings(self, continued: ContinuedPart, joint: JointPlan, text: bytes) -> Readings | None:
        """The control's reading of a text that does not mean what was planned, for another attempt; None if it does.

        Raises `SelfCheckError` for a text that cannot be read or that no attempt makes right, and `NotInPartsError` for
        the text of a part that can only be made right in the whole program.
        """

    def astray(self, line: int | None, errors: PathError) -> Exception:
        """The exception to raise for a corrected path that is no longer that of the program, see `strays`."""


# -- one part ---------------------------------------------------------------------------------------------------------


@frozen
class ProvedPart:
    """A part that has been corrected and proved.

    text       its corrected text; or the number of its bytes, if it has been written into a file
    tally      its share of the report
    next_line  number of the line of the program with which the next part begins
    """

    text: bytes | int
    tally: Tally
    next_line: int

    def written_into(self, file: int, at: int) -> ProvedPart:
        """Write the text into a file, from byte `at` on; returns the part with the length instead of the text."""
        assert isinstance(self.text, bytes)
        put_at(file, at, self.text)
        return replace(self, text=len(self.text))


Watch = Callable[[Program, WrittenPlan, Mask | None], object]
"""Called with each corrected part: its program, its plan, and (n,) the motions that are its own (None: all)."""


@mutable
class Corrector:
    """Corrects a part of a program, or all of it.

    machine  the machine with the workpiece at its place
    said     returns the words for the stamp: position of block delete, names of values taken as zero, see `stamp_of`
    head     the first part
    at       byte at which the stamp stands in the corrected text
    stamped  the stamp as it was written with the first part; empty if there is none
    joint    the plan and text of the latest part
    watch    is called with each corrected part
    """

    task: Task
    machine: Machine
    proof: Proof
    said: Callable[[], tuple[str, tuple[str, ...]]]
    head: Program | None = None
    at: int = 0
    stamped: bytes = b""
    joint: JointPlan | None = None
    watch: Watch | None = None

    def stamp(self) -> bytes:
        """The stamp as it would be written now; parts after the first may add to it."""
        assert self.head is not None
        return stamp.insertion(self.head, stamp_of(self.head, self.task.machine, self.task.options, *self.said())).text

    def correct(
        self,
        continued: ContinuedPart,
        moves: Sequence[Moves],
        accepted: AcceptedPlan | None = None,
        before: PrecedingMotion | None = None,
        leave: Callable[[PrecedingMotion, int], object] | None = None,
    ) -> ProvedPart:
        """Plan, write, prove and count a part.

        moves     its motions, in each position of block delete
        accepted  the first plan, if it has been made already
        before    the last motion of the part before
        leave     is called with the last motion of this part and the length of its text, bytes, before the proof, so
                  that another process may go on from there; None if no part follows
        """
        task, part = self.task, continued.joined
        readings: Readings | None = [None] * len(moves)
        refused, attempts = dict[int, Reason](), 0
        while readings is not None:
            joint = plan_and_write_all(
                part.program, moves, self.machine, task.options, readings, before, accepted, refused
            )
            attempts += 1
            if attempts > FREE_ATTEMPTS:
                refused, accepted = {b: why for each in joint.plans for b, why in each.reasons.items()}, None
            solution = joint.plans[0]
            if before is not None and (solution.reaches_back or solution.unchanged[0] != before.unchanged):
                raise NotInPartsError("a refusal reaches back into an earlier part")
            text = self._text(part.program, joint.splices, before is None)
            if leave is not None and not part.last and readings[0] is None:
                leave(PrecedingMotion.of(solution.rounds, np.zeros(len(solution.moves.axes), dtype=np.int8)), len(text))
            readings = self.proof.misreadings(continued, joint, text)
        self.joint = joint
        own, tally = None, Tally(self.machine.least_increment[0])
        if continued.head is not None:
            own = np.ones(len(solution.moves), dtype=bool)
            own[:1] = False
        tally.add(part.program, joint, own, self.machine)
        if task.options.figures:
            path_errors = list[tuple[Moves, PathError]]()
            for each in joint.plans:
                shown = each.shown(task.options.split_rapids)
                errors = path_error(each.written, shown if own is None else own & shown, each.plan.known)
                path_errors.append((each.moves, errors))
            self.note(tally, part.program, *path_errors)
        if self.watch is not None:
            self.watch(part.program, solution, own)
        return ProvedPart(text, tally, part.program.first_line + part.program.lines_ended)

    def _text(self, program: Program, splices: Splices, first: bool) -> bytes:
        """The corrected text of a part. The first part gets the stamp, if its text has changed."""
        if not first:
            stop = int(program.blocks[1, 0]) if len(program) > 1 else len(program.source)
            return spliced(program.source, splices)[stop:]
        self.head = program
        edit = stamp.insertion(program, stamp_of(program, self.task.machine, self.task.options, *self.said()))
        self.at = edit.start
        if not len(splices):
            return program.source
        self.stamped = edit.text
        return spliced(program.source, Splices.joined([splices, Splices.of([edit])]))

    def note(self, tally: Tally, program: Program, *errors: tuple[Moves, PathError]) -> None:
        """Add the tip errors of a part, in each position of block delete, to its tally; raises `Proof.astray`."""
        lines = tally.figures(program, errors)
        for line, (_, path_errors) in zip(lines, errors, strict=True):
            if strays(path_errors):
                raise self.proof.astray(line, path_errors)


def strays(errors: PathError) -> bool:
    """Whether the corrected path is so far from the programmed one that it must be a different path."""
    return errors.after.max > max(ASTRAY_MM, 10 * errors.before.max)


# -- a whole program --------------------------------------------------------------------------------------------------


@frozen
class Fixed:
    """The corrected program, whether it differs from the original, and the report.

    lines  for a program that was written out flat: the original line number of each of its lines; else empty
    made   the conditions of the correction; None for a machine without errors
    """

    text: bytes
    changed: bool
    report: FixReport
    lines: tuple[int, ...] = ()
    made: Made | None = field(default=None, repr=False, compare=False)


@frozen
class Made:
    """The program, plan and edits from which a corrected text was made.

    program  as it was read, or as it was written out flat
    plan     the plan for the first position of block delete
    edits    the edits of the text, for all positions, with the stamp
    """

    program: Program
    plan: WrittenPlan
    edits: Splices


def fix_program(
    program: Program,
    machine: Machine,
    setup: Setup,
    options: FixOptions = FixOptions(),  # noqa: B008
    resolve: Resolve | None = None,
) -> Fixed:
    """Correct a program for a machine. A program that needs no change is returned unchanged, without a stamp.

    resolve  returns the text of a subprogram file by its name

    Raises SourceError for a block that cannot be followed, UsageError for values that the setup must give, RefusedError
    NCF430 for a program that carries a stamp, and NCF438 for one without a stamp that seems to have been corrected.
    Motions that had to stay uncorrected are in `report.refused`; the caller decides whether that is acceptable.
    """
    refuse_stamped(program, options)
    if machine.is_perfect:
        return Fixed(program.source, False, FixReport(program.path, len(program), 0, 0, 0, False))
    task = Task(machine, setup, options, resolve, program.path, program.dialect)
    program = replace(program, dialect=task.dialect)

    def follow(source: Program, own: Setup) -> Trace:
        return traced(source, machine, own, resolve)

    positions = positions_of(setup, lambda own: with_tool_lengths(program, follow(program, own), machine, own))
    moves, words = [each.trace.moves for each in positions], (stamped(positions), assumed_of(positions))
    proof = WholeProof(program, [partial(follow, own=each.setup) for each in positions])
    set_up = with_workpiece(resolving(machine, program.dialect, program.source), setup)
    corrector = Corrector(task, set_up, proof, lambda: words)
    done = corrector.correct(ContinuedPart.whole(program, moves[0], corrector.machine), moves)
    tally, text, joint = done.tally, done.text, corrector.joint
    assert isinstance(text, bytes)
    assert joint is not None
    stamps = [Edit(corrector.at, corrector.at, corrector.stamped)] if corrector.stamped else []
    made = Made(program, joint.plans[0], Splices.joined([joint.splices, Splices.of(stamps)]))
    suspicion = suspected(tally.numbers, tally.step, program.path, options.force)
    tally.blocks = len(program)
    report = tally.report(program.path, (*suspicion, *messages_of(positions)), options)
    report = replace(report, block_delete=tuple(sorted(each.on) for each in positions if each.on is not None))
    renumber = language_of(program.dialect, Language).renumber
    if text == program.source or renumber is None or options.block_numbers != "renumber":
        return Fixed(text, text != program.source, report, made=made)
    return Fixed(renumber(text), True, report, made=made)


def fix_flat(
    program: Program, machine: Machine, setup: Setup, options: FixOptions, resolve: Resolve | None = None
) -> Fixed:
    """Like `fix_program`; if that refuses motions, the program is written out flat and the flat program is corrected.

    A program that can be corrected as it is keeps its loops and subprograms. The flat program is used only if fewer
    lines are refused in it. A program of which nothing is corrected stays as it is, because flat it would lose all its
    blocks; so does one that must be right in several positions of block delete, because a flat program has the numbers
    of one position only (NCF447). The report gives lines of the original. Raises what `fix_program` and `flatten`
    raise.
    """
    fixed = fix_program(program, machine, setup, options, resolve)
    if all(each.code == NEVER for each in fixed.report.refused):
        return fixed
    if len(fixed.report.block_delete) > 1:
        text = "not written out flat: a flat program would have the numbers of one position of block delete"
        note = Message("NCF447", text, Place(program.path), "give that position with --block-skip on or off")
        return replace(fixed, report=replace(fixed.report, warnings=(note, *fixed.report.warnings)))
    steps = increments(resolving(machine, program.dialect, program.source))
    by_name = dict(zip(machine.axis_names, np.where(machine.rotary, np.degrees(steps), steps).tolist(), strict=True))
    from ncfix.control.flatten import flatten

    flat = flatten(program, setup, machine.axis_names, rotary_names(machine), by_name, resolve, kinematics_of(machine))
    again = fix_program(flat.program, machine, setup, options, resolve)
    if {each.line for each in fixed.report.refused} <= {flat.lines[each.line - 1] for each in again.report.refused}:
        return fixed
    report = in_lines(again.report, flat, program, fixed.report.warnings)
    return replace(again, changed=True, report=report, lines=tuple(flat.lines))


# -- part after part --------------------------------------------------------------------------------------------------


class PartCorrector(Corrector):
    """Reads a program part by part and corrects the parts of its share. `work` can be called once only."""

    def __init__(self, task: Task, read: Read) -> None:
        self.parts = parts = MachineParts.of(task, read)
        self.parts_proof = PartProof(task, parts.reader)
        super().__init__(task, parts.set_up, self.parts_proof, lambda: ("", parts.assumed))
        self.planner, self.language = Planner.of(self.machine, task.options), language_of(task.dialect, WrittenLanguage)

    def work(self, share: WorkShare) -> Iterator[tuple[int, ProvedPart]]:
        """The number of each part of the share, and its correction. Other parts are only followed, or passed over.

        Raises what reading, following and correcting raise and, at the end, UsageError for everything that the setup
        does not give.
        """
        skipped, self.parts.share = False, share
        for number, continued in enumerate(self.parts):
            if not share.has(number):
                self.parts_proof.pass_over(continued, skipped)
                skipped = True
                continue
            yield number, self._corrected(continued, number, share, skipped)
            skipped = False

    def _corrected(self, continued: ContinuedPart, number: int, share: WorkShare, skipped: bool) -> ProvedPart:
        """Correct a part, hand its last motion on to the next part, and prove it.

        skipped  the part before was not corrected in this process
        """
        if continued.head is not None and is_offset(continued.head.moves).any():
            raise NotInPartsError("the control offsets a contour from one part into the next")
        plan = None if self.planner is None else self.planner.plan(continued)
        accepted = None if plan is not None else self._accepted_plan(continued)
        before = share.before(number)
        if before is not None and skipped:
            self.parts_proof.follower.stand(before.position)
        if plan is not None and before is not None and not before.unchanged:
            plain = written(self.language, plan, before.position, increments(self.machine))
            if plain is not None:
                return self._plainly(plan, plain, number, share)
        accepted, moves = accepted or self._accepted_plan(continued), continued.joined.moves
        if before is not None:
            before, (first, *_) = replace(before, direction=continued.direction), before.rounds
            if first.unchanged.any() or (moves.wordless[0] & (first.shift != 0)).any():
                accepted = None  # the motion before stayed unchanged, or an axis without a word stays displaced
        return self.correct(continued, [moves], accepted, before, partial(share.leave, number))

    def _plainly(self, plan: PlainPlan, plain: Emission, number: int, share: WorkShare) -> ProvedPart:
        """Hand on, prove and count a part of plain motions that is planned and written."""
        part, moves = plan.part, plan.part.moves
        text = spliced(part.program.source, plain.splices)
        if not part.last:
            shift = plan.real.start[-1] - moves.start[-1]
            left = PrecedingMotion.steady(shift, np.zeros(len(shift), dtype=np.int8), plain.end[-1].copy())
            share.leave(number, left, len(text))
        solution = plan.written_plan(plain)
        self.parts_proof.check(part, solution, text, plain.splices)
        tally = Tally(self.machine.least_increment[0])
        tally.add_plain(part.program, solution, largest_shift(plan, plain), plan.intent)
        if self.task.options.figures:
            self.note(tally, part.program, (moves, figures(plan, plain, self.task.options.split_rapids)))
        if self.watch is not None:
            self.watch(part.program, solution, None)
        return ProvedPart(text, tally, part.program.first_line + part.program.lines_ended)

    def _accepted_plan(self, continued: ContinuedPart) -> AcceptedPlan:
        """The full plan of a part, assuming that the motion before it is corrected without any remainder."""
        part, task = continued.joined, self.task
        nowhere = np.zeros(len(part.moves.axes))
        guess = None if continued.head is None else PrecedingMotion.steady(nowhere, continued.direction, nowhere)
        planning = Planning.of(part.moves, self.machine, task.dialect, task.options, guess, part.program.source)
        return planning.accepted(guess)

    def report(self, tally: Tally, suspicion: tuple[Message, ...]) -> FixReport:
        """The report of all parts."""
        tally.notes = self.parts.notes
        return tally.report(self.task.path, (*suspicion, *self.parts.follower.messages), self.task.options)


@frozen
class Stamp:
    """The stamp in the output: its byte, its text as written, and its text as it must be (empty: no stamp)."""

    at: int
    written: bytes
    wanted: bytes


@frozen
class Streamed:
    """The report, and the stamp: its final text may differ from the one that was written with the first part."""

    report: FixReport
    stamp: Stamp


@mutable
class Stream:
    """The correction of one program part by part. `run` can be called once only.

    read       returns the next `size` bytes of the text; no bytes at its end
    write      takes the corrected text, part by part; or the number of bytes that are in `OpenFiles.out` already
    jobs       number of processes
    files      the open files that the processes share; None: one process
    suspicion  messages that the program seems to have been corrected before; None: not judged yet
    watch      is called with each corrected part; then there is only one process
    """

    task: Task
    read: Read
    write: Callable[[bytes | int], object]
    jobs: int = 1
    files: OpenFiles | None = None
    tally: Tally = field(init=False)
    suspicion: tuple[Message, ...] | None = None
    corrector: PartCorrector | None = None
    watch: Watch | None = None

    def __post_init__(self) -> None:
        self.tally = Tally(self.task.step)

    @property
    def stamped(self) -> bytes:
        """The stamp as it was written; empty if none has been written yet."""
        return b"" if self.corrector is None else self.corrector.stamped

    def run(self) -> Streamed:
        """Correct the program; raises what `fix_program` raises, and `NotInPartsError`."""
        task = self.task
        task.check()
        task.follower()
        with worker_pool(1 if self.watch else self.jobs, partial(PartCorrector, task), self.files) as others:
            own = self.corrector = PartCorrector(task, others.spread(self.read))
            own.watch = self.watch
            for number, done in own.work(others.share):
                others.put(number, done)
                self._take(others.ready())
            self._take(others.rest(own.parts.count))
        for text in own.parts.behind():  # written unchanged
            if stamp.SIGN.search(text.decode("latin-1")) and not task.options.force:
                raise NotInPartsError("there is a stamp after the end of the program")
            self.write(text)
        self.tally.blocks += own.parts.blocks
        report = own.report(self.tally, self._judged())
        return Streamed(report, Stamp(own.at, own.stamped, own.stamp() if self.tally.changed else b""))

    def _take(self, parts: Iterator[ProvedPart]) -> None:
        """Write the parts and add them to the report."""
        for done in parts:
            self.tally.take(done.tally)
            if done.next_line > LOOKED:
                self._judged()
            if self.task.options.allow_refused or not self.tally.refused:
                self.write(done.text)

    def _judged(self) -> tuple[Message, ...]:
        """Judge, once, by the first lines whether the program was corrected before; raises RefusedError NCF438."""
        if self.suspicion is None:
            force = self.task.options.force
            self.suspicion = suspected(self.tally.numbers, self.tally.step, self.task.path, force)
        return self.suspicion
