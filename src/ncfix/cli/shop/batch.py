"""Corrects and writes the programs of `ncfix fix`, one after another or several at a time.

A batch starts from the beginning, or continues where an earlier run stopped.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field, replace
from functools import cache, partial
from itertools import islice
from typing import TYPE_CHECKING, Any

from ncfix import core, files
from ncfix.batch.journal import JOURNAL, Find, Journal, JournalRecord, RecordingFinder, announce, digest_of, text_digest
from ncfix.batch.programs import subprograms
from ncfix.batch.work import ExecutorMaker, results_in_order
from ncfix.cli import console
from ncfix.cli.console import owned
from ncfix.cli.options import dialect_of
from ncfix.cli.shop.summary import OutcomeReporter, Verbosity, brief, progress
from ncfix.cli.streams import FixedText, Outlet, Source, long_bytes, outlet_for, part_bytes, source_of
from ncfix.cli.targets import STREAM, OutputTarget, shown
from ncfix.diagnostics import ExitCode, FaultError, Message, NcfixError, Place, visible
from ncfix.host import limited
from ncfix.plugins import load_plugins
from ncfix.values import frozen
from ncfix.version import __version__

if TYPE_CHECKING:
    from ncfix.cli.shop.pages import Pages
    from ncfix.compensate import FixOptions
    from ncfix.compensate.driver import Fixed, Stream
    from ncfix.compensate.figures.path_record import PathRecord
    from ncfix.compensate.report import FixReport
    from ncfix.control.setup import Setup
    from ncfix.machine import Machine
    from ncfix.reports.program_page import ProgramPage
    from ncfix.text.dialect import Dialect

FLATTEN = "--flatten may correct more: it writes cycles, loops and subprograms out as single blocks; "
REPEATED = "NCF433"
"""Code of a refusal because a block is executed several times, or because it affects such a block."""
STALE = (
    "is out of date: the program, the machine file, the setup or the options have changed since; it was not replaced"
)
ACCEPT = "--allow-refused writes the program; the refused motions stay uncorrected"
OF_PROGRAMS = 100
"""Smallest number of message codes on programs, machines and setups; lower ones are on files and usage."""
LASTING = frozenset({"NCF017", "NCF024", "NCF030"})
"""Codes of failures by lack of time or memory, which would occur again at the same cost."""


@frozen
class FixOutcome:
    """The result of one program.

    code    exit code
    entry   entry in the JSON object
    called  subprograms that were looked for, as in the journal
    key     digest of what the result depends on, see `FixJob.key`; empty without a journal, or if it changed meanwhile
    digest  digest of the output, if there is one and it is needed
    """

    code: int
    entry: dict[str, Any]
    called: Mapping[str, str] = field(default_factory=dict)
    key: str = ""
    digest: str = ""

    @classmethod
    def failed(cls, target: OutputTarget, error: NcfixError) -> FixOutcome:
        """The result of a program that ended in an error."""
        entry = {"path": shown(target.source), "output": None}
        return cls(error.exit_code, {**entry, "errors": [message.as_dict() for message in error.messages]})

    @classmethod
    def left_out(cls, target: OutputTarget, why: Message) -> FixOutcome:
        """The result of a subprogram in a folder, which is corrected in the programs that call it."""
        reason = {"line": 0, "code": why.code, "reason": why.text}
        entry: dict[str, Any] = {
            "path": shown(target.source),
            "output": None,
            "left_out": True,
            "changed": False,
            "warnings": [],
        }
        return cls(ExitCode.DONE, {**entry, "refused": [reason]})


@frozen
class ProgramLimits:
    """Largest time and memory for one program; None: unlimited."""

    seconds: float | None = None
    megabytes: int | None = None

    def __bool__(self) -> bool:
        return self != ProgramLimits()


@frozen
class FixJob:
    """The settings common to all programs.

    pages    destinations of program pages; None: no pages
    journal  path of the journal; None: no journal
    certify  machine file, if a certificate is to be written beside each output; else empty
    basis    digest of everything a result depends on besides program and subprograms; used with a journal
    verbose  whether to print the dialect of each program
    """

    machine: Machine
    setup: Setup
    dialect: str | None
    options: FixOptions
    limits: ProgramLimits = ProgramLimits()
    pages: Pages | None = None
    journal: str | None = None
    basis: str = ""
    certify: str = ""
    verbose: bool = False

    def noted_in(self, journal: str) -> FixJob:
        """This job with a journal."""
        versions = [(plugin.name, plugin.version) for plugin in load_plugins().loaded]
        machine = (self.machine.hash, self.machine.name, self.machine.control)
        how = (__version__, versions, machine, self.setup, self.dialect, self.options)
        return replace(self, journal=journal, basis=text_digest(repr(how).encode()))

    def key(self, target: OutputTarget) -> str:
        """Digest of everything the result for a program depends on, except subprograms and limits."""
        return text_digest(f"{self.basis} {digest_of(target.source)}".encode())

    def outcome_and_messages(self, target: OutputTarget, jobs: int = 1) -> Finished:
        """Correct one program in a worker; returns the result and the messages to print."""
        with console.keeping() as lines:
            return self.outcome(target, jobs), lines

    def outcome(self, target: OutputTarget, jobs: int = 1) -> FixOutcome:
        """Correct one program and report it; an error, even a bug of ncfix, ends only this program."""
        find = RecordingFinder(subprograms(self.setup, target.source))
        key = self.key(target) if self.journal else ""
        try:
            done = self._done(target, find, jobs)
        except console.ReaderGoneError:
            raise
        except Exception as error:
            own = owned(error)
            console.tell(*own.messages)
            done = FixOutcome.failed(target, own)
        if done.entry["output"] is None and target.is_own:
            done.entry["stale"] = True
            console.tell(Message("NCF027", STALE, Place(target.path)))
        return replace(done, called=find.called, key=key if key and key == self.key(target) else "")

    def _done(self, target: OutputTarget, find: Find, jobs: int) -> FixOutcome:
        if target.program and (why := target.program.left_out):
            console.tell(why)
            return FixOutcome.left_out(target, why)
        with (
            limited(self.limits.seconds, self.limits.megabytes),
            console.busy(f"fixing {shown(target.source)}"),
            self.fixed(target, find, jobs) as fixed,
        ):
            return self._written(fixed, target)

    @contextmanager
    def fixed(self, target: OutputTarget, find: Find, jobs: int) -> Iterator[FixedText]:
        """Context with the corrected program; a long one is corrected while it is read, if possible."""
        with source_of(target.source) as source:
            long = source.looked_into(named=self.dialect is not None)
            if not long or self.options.flatten:
                yield self._whole(source, source.everything(), find)
                return
            dialect = dialect_of(source.head, shown(target.source), self.dialect, self.machine)
            with self._outlet(source, target, dialect, find, jobs) as (stream, outlet):
                yield self._in_parts(source, stream, outlet, find, dialect)

    def _whole(self, source: Source, text: bytes, find: Find) -> FixedText:
        from ncfix.compensate.driver import fix_flat, fix_program
        from ncfix.text.reader import read

        path = shown(source.path)
        program = read(text, path, dialect_of(text, path, self.dialect, self.machine))
        correct = fix_flat if self.options.flatten else fix_program
        found = correct(program, self.machine, self.setup, self.options, find)
        report = self._remarked(found.report, program.dialect)
        page = self._page(_recorded(found), report, text) if self.pages else None
        return FixedText(found.text, found.changed, report, program.dialect.name, page)

    def _remarked(self, report: FixReport, dialect: Dialect) -> FixReport:
        """The report with a warning (NCF106) if the program is for another control than the machine file names."""
        from ncfix.text.dialect import other_control

        remark = None if self.dialect else other_control(dialect, self.machine.control or "", report.path)
        return replace(report, warnings=(remark, *report.warnings)) if remark else report

    def _page(self, record: PathRecord, report: FixReport, text: bytes) -> ProgramPage:
        from ncfix.reports.program_page import ProgramPage

        return ProgramPage(record, report, self.machine, self.options, text)

    @contextmanager
    def _outlet(
        self, source: Source, target: OutputTarget, dialect: Dialect, find: Find, jobs: int
    ) -> Iterator[tuple[Stream, Outlet]]:
        from ncfix.compensate.driver import Stream
        from ncfix.compensate.following import Task

        if source.size is None or source.size >= long_bytes():
            core.forewarn(console.forewarn)
        path = shown(source.path)
        with outlet_for(
            target, not self.setup.assume_zero and self.setup.probed is None, lambda: bool(stream.stamped)
        ) as outlet:
            task = Task(self.machine, self.setup, self.options, find, path, dialect, part_bytes(), source.head)
            stream = Stream(task, source.read, outlet.put, jobs, source.files(outlet.spool.fileno()))
            yield stream, outlet

    def _in_parts(self, source: Source, stream: Stream, outlet: Outlet, find: Find, dialect: Dialect) -> FixedText:
        from ncfix.compensate.workers import WorkerGoneError
        from ncfix.control.trace import NotInPartsError

        _let_stay()
        record = None
        if self.pages:
            from ncfix.compensate.figures.path_record import PathRecord

            record = PathRecord()
            stream.watch = record.take
        try:
            done = stream.run()
        except NotInPartsError:
            fixed = self._whole(source, source.everything(), find)
            assert isinstance(fixed.text, bytes)
            return replace(fixed, text=outlet.after(fixed.text, source.path))
        except WorkerGoneError:
            text = "one of the processes that corrected it was killed"
            raise FaultError.of("NCF017", text, Place(shown(source.path)), "fix it with --jobs 1") from None
        source.check_unchanged()
        report = self._remarked(done.report, dialect)
        page = None if record is None else self._page(record, report, source.everything())
        return FixedText(outlet.remaining(done.stamp), report.changed, report, dialect.name, page)

    def _written(self, fixed: FixedText, target: OutputTarget) -> FixOutcome:
        entry: dict[str, Any] = {"path": "", "dialect": fixed.dialect, **fixed.report.as_dict()}
        digest = ""
        console.tell_some([*fixed.report.warnings, *fixed.report.refusals], partial(_with_lines, source=target.source))
        refused = bool(entry["refused"]) and not self.options.allow_refused
        if self.pages and fixed.page:
            fixed.page.output = None if refused else target.path
            self.pages.put(target, fixed.page)
            entry["page"] = self.pages.path_of(target)
        if not refused:
            if self.journal:
                digest = text_digest(fixed.text)
                announce(self.journal, target.name, digest, os.path.realpath(target.source))
            if fixed.changed or not target.in_place:
                target.write(fixed.text, files.mode_of(target.source))
            entry["output"] = target.path
        for line in _summary(entry, refused, bool(self.machine.effects)):
            console.say(line)
        if self.verbose:
            console.say(f"  dialect             {fixed.dialect}")
        if refused:
            repeated = any(each["code"] == REPEATED or "--flatten" in each["reason"] for each in entry["refused"])
            console.say(f"  {FLATTEN + ACCEPT if repeated and not self.options.flatten else ACCEPT}")
        code = ExitCode.REFUSED if refused else ExitCode.DONE
        if self.certify and entry["output"] is not None and (fixed.changed or not target.in_place):
            from ncfix.cli.shop.certificates import Proving, certify_output

            proving = Proving(self.machine, self.certify, self.setup, self.dialect, self.options.tolerance_um)
            entry["certificate"] = certify_output(proving, target)
            code = ExitCode.FINDINGS if entry["certificate"]["faults"] else code
        return FixOutcome(code, entry, digest=digest)


def _recorded(fixed: Fixed) -> PathRecord:
    """The data for the page of a program that was corrected as a whole."""
    from ncfix.compensate.figures.path_record import PathRecord

    record = PathRecord()
    if fixed.made is not None:
        record.take(fixed.made.program, fixed.made.plan)
    if fixed.lines:
        record.in_lines(fixed.lines)
    return record


@cache
def _let_stay() -> None:
    """Exclude all objects loaded so far from garbage collection, once per process: they stay, and are many."""
    gc.freeze()


def _with_lines(messages: Sequence[Message], source: str) -> list[Message]:
    """Messages, with the program's lines added to those that lack them."""
    bare = [(each, each.place if each.place and _is_bare(each.place, shown(source)) else None) for each in messages]
    wanted = {place.line for _, place in bare if place}
    if not wanted or not os.path.isfile(source):
        return list(messages)
    with open(source, encoding="latin-1") as text:
        lines = {n: line.rstrip("\n") for n, line in enumerate(islice(text, max(wanted)), start=1) if n in wanted}
    return [replace(each, place=replace(at, text=lines.get(at.line, ""))) if at else each for each, at in bare]


def _is_bare(place: Place, path: str) -> bool:
    """Whether a place is a line of this file, without the text of the line."""
    return place.path == path and place.line > 0 and not place.text


def _summary(entry: dict[str, Any], refused: bool, errors: bool) -> list[str]:
    """The summary of a corrected program for people; `errors`: whether the machine has any."""
    output = "nothing written" if refused else "<stdout>" if entry["output"] == STREAM else entry["output"]
    counts = f"{entry['compensated']} corrected, {entry['passed']} passed by rule, {len(entry['refused'])} refused"
    lines = [
        f"{visible(entry['path'])} -> {visible(output)}",
        f"  motion blocks       {counts}; {entry['inserted_blocks']} inserted",
    ]
    if entry["passed"]:
        rules = sorted(entry["passed_by_rule"].items(), key=lambda item: -item[1])
        lines.append(f"  passed by rule      {', '.join(f'{count} {rule}' for rule, count in rules)}")
    if entry["max_correction_um"] is None:
        lines.append("  nothing corrected" + ("" if errors else ": the machine file has no errors"))
    else:
        lines.append(f"  largest correction  {entry['max_correction_um']:.1f} um")
    if entry["error_before_um"] and entry["error_before_um"]["max"] is None:
        if entry["compensated"]:
            lines.append("  tip error           not computed: no cutting motion was corrected")
    elif entry["error_before_um"]:
        lines.append(f"  tip error before    {console.error_figures(entry['error_before_um'])}")
        lines.append(f"  tip error after     {console.error_figures(entry['error_after_um'])}")
    if entry["compensated"]:
        lines.append(
            f"  rounding            up to {entry['rounding_um']:.2f} um of this come from the control's digits"
        )
    if entry["no_figure"]:
        lines.append(f"  {console.no_figure(entry['no_figure'])}")
    if entry["leaves"]:
        lines.append(f"  {entry['strategy']}: {entry['leaves']}")
    return lines


@frozen
class Batch:
    """Programs that are corrected one after another, or several at a time.

    folder    common folder of their outputs; None: each has its own destination
    resume    keep results of an earlier run, and do not repeat what failed then
    retry     repeat what failed
    verbosity  how much is printed
    many      whether they belong to many programs; None: if they are several
    """

    job: FixJob
    targets: Sequence[OutputTarget]
    folder: str | None
    resume: bool
    retry: bool = False
    verbosity: Verbosity = Verbosity.USUAL
    many: bool | None = None

    def run(self, jobs: int, make: ExecutorMaker) -> Iterator[FixOutcome]:
        """The results in the order of the programs; each is recorded as soon as it is available."""
        several = len(self.targets) > 1
        if self.folder is None or not (self.resume or several or os.path.exists(os.path.join(self.folder, JOURNAL))):
            yield from self._told(self.targets, {}, self._fresh(self.job, self.targets, jobs, make, lambda *_: None))
            return
        with Journal.opened(self.folder) as journal:
            job = self.job.noted_in(journal.path)
            targets = []  # know what ncfix has written there; another worker may take over at any moment
            for each in self.targets:
                made = journal.made(each.name, each.source) if self.resume else frozenset[str]()
                targets.append(replace(each, made=made, resume=True))
            before = {target: record for target in targets if (record := self._record_of(job, target, journal))}
            rest = [target for target in targets if target not in before]
            fresh = self._fresh(job, rest, jobs, make, partial(_note, journal, repr(job.limits)))
            yield from self._told(targets, before, fresh)

    @property
    def _many(self) -> bool:
        return len(self.targets) > 1 if self.many is None else self.many

    def _told(
        self, targets: Sequence[OutputTarget], before: Mapping[OutputTarget, JournalRecord], fresh: Iterator[Finished]
    ) -> Iterator[FixOutcome]:
        """All results in order; prints the messages of each."""
        reporter = OutcomeReporter(self.verbosity, self._many)
        with progress(len(targets)) as step:
            for target in targets:
                if target in before:
                    outcome, lines = _done_before(target, before[target])
                else:
                    outcome, lines = next(fresh)
                reporter.report(outcome.entry, lines)
                step()
                yield outcome

    def _record_of(self, job: FixJob, target: OutputTarget, journal: Journal) -> JournalRecord | None:
        """The record of a program that need not be corrected again; None if it must be."""
        record = journal.records.get(target.name) if self.resume else None
        if record is None or (self.retry and not record.digest):
            return None
        if job.pages and "errors" not in record.entry and not job.pages.has(target):
            return None
        find = subprograms(job.setup, target.source)
        return record if record.holds(job.key(target), target.path, find, repr(job.limits)) else None

    def _fresh(
        self, job: FixJob, rest: Sequence[OutputTarget], jobs: int, make: ExecutorMaker, note: Note
    ) -> Iterator[Finished]:
        alone = len(rest) <= 1 or any(target.source == STREAM for target in rest)
        if not alone and (jobs > 1 or job.limits):
            yield from results_in_order(job.outcome_and_messages, rest, make, jobs, _lost, note)
            return
        for target in rest:
            if self._many or self.verbosity == Verbosity.QUIET:
                finished = job.outcome_and_messages(target, jobs)
            else:
                finished = job.outcome(target, jobs), []
            note(target, finished)
            yield finished


Finished = tuple[FixOutcome, list[str]]
"""The result of a program, and messages that are still to be printed."""
Note = Callable[[OutputTarget, Finished], None]


def _note(journal: Journal, limits: str, target: OutputTarget, finished: Finished) -> None:
    """Record a result in the journal, unless it may depend on something that the key does not cover."""
    outcome, _ = finished
    codes = [error["code"] for error in outcome.entry.get("errors", ())]
    faulty = outcome.code == ExitCode.FAULT
    if outcome.key and all(code in LASTING or (int(code[3:]) >= OF_PROGRAMS and not faulty) for code in codes):
        source = os.path.realpath(target.source)
        found = (outcome.key, outcome.digest, outcome.called, outcome.entry, outcome.code)
        journal.add(JournalRecord(target.name, *found, limits, source))


def _done_before(target: OutputTarget, record: JournalRecord) -> Finished:
    entry = {**record.entry, "path": shown(target.source), "resumed": True}
    entry["output"] = target.path if record.digest else None
    line = f"{visible(shown(target.source))} -> {visible(target.path)}: done before, unchanged"
    outcome = FixOutcome(record.code, entry, record.called)
    return outcome, [line] if record.digest else [brief(entry)]


def _lost(target: OutputTarget) -> Finished:
    """The result of a program whose worker died twice: too little memory, or a bug in compiled code."""
    text = "the process that corrected it was killed, and so was that of the second attempt"
    error = FaultError.of("NCF017", text, Place(shown(target.source)), "fix it alone, on a computer with more memory")
    return FixOutcome.failed(target, error), [str(message) for message in error.messages]
