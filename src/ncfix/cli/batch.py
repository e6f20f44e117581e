"""The programs of `ncfix fix`, each corrected and written: one after another or several at a time.

They are done from the start, or from where it stopped.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import islice
from typing import TYPE_CHECKING, Any

from ncfix import fast, files
from ncfix.batch.programs import subprograms
from ncfix.batch.work import (
    ExecutorMaker,
    Find,
    Journal,
    JournalRecord,
    RecordingFinder,
    digest_of,
    results_in_order,
    text_digest,
)
from ncfix.cli import console
from ncfix.cli.console import owned
from ncfix.cli.options import dialect_of
from ncfix.cli.streams import FixedText, Outlet, Source, outlet_for, part_bytes, source_of
from ncfix.cli.targets import STREAM, OutputTarget, shown
from ncfix.diagnostics import ExitCode, FaultError, Message, NcfixError, Place, visible
from ncfix.version import __version__

if TYPE_CHECKING:
    from ncfix.compensate import FixOptions
    from ncfix.compensate.driver import Stream
    from ncfix.control.setup import Setup
    from ncfix.machine import Machine
    from ncfix.text.dialect import Dialect

FLATTEN = "--flatten may correct more: it writes out what cycles, loops and subprograms repeat; "
ACCEPT = "--allow-refused writes the program with the refused motions as they were"


@dataclass(frozen=True, slots=True)
class FixOutcome:
    """What became of one program: its exit code, its entry in the JSON object, and the subprograms looked for."""

    code: int
    entry: dict[str, Any]
    called: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def failed(cls, target: OutputTarget, error: NcfixError) -> FixOutcome:
        """A program that ended in an error."""
        entry = {"path": shown(target.source), "output": None}
        return cls(error.exit_code, {**entry, "errors": [message.as_dict() for message in error.messages]})


@dataclass(frozen=True, slots=True)
class FixJob:
    """What is the same for all programs."""

    machine: Machine
    setup: Setup
    dialect: str | None
    options: FixOptions

    def key(self, target: OutputTarget) -> str:
        """A digest of what the result for a program depends on, subprograms apart."""
        options = (__version__, self.machine.hash, self.setup, self.dialect, self.options, digest_of(target.source))
        return text_digest(repr(options).encode())

    def outcome_and_messages(self, target: OutputTarget) -> tuple[FixOutcome, list[str]]:
        """Fix one program elsewhere: what came of it, and what there is to say."""
        with console.keeping() as said:
            return self.outcome(target), said

    def outcome(self, target: OutputTarget, jobs: int = 1) -> FixOutcome:
        """Fix one program and say what came of it; an error, and a fault of ncfix, ends this program only."""
        find = RecordingFinder(subprograms(self.setup, target.source))
        try:
            with console.busy(f"fixing {shown(target.source)}"), self.fixed(target, find, jobs) as fixed:
                return replace(_written(fixed, target, self.options), called=find.called)
        except console.ReaderGoneError:
            raise
        except Exception as error:
            own = owned(error)
            console.tell(*own.messages)
            return FixOutcome.failed(target, own)

    @contextmanager
    def fixed(self, target: OutputTarget, find: Find, jobs: int) -> Iterator[FixedText]:
        """The corrected program; a long one is corrected while it is read, if it can be."""
        with source_of(target.source) as source:
            long = source.looked_into(named=self.dialect is not None)
            if not long or self.options.flatten:
                yield self._whole(source, source.everything(), find)
                return
            dialect = dialect_of(source.head, shown(target.source), self.dialect, self.machine)
            with self._outlet(source, target, dialect, find, jobs) as (stream, outlet):
                yield self._in_parts(source, stream, outlet, find)

    def _whole(self, source: Source, text: bytes, find: Find) -> FixedText:
        from ncfix import api
        from ncfix.text.reader import read

        path = shown(source.path)
        program = read(text, path, dialect_of(text, path, self.dialect, self.machine))
        fixed = api.fixed(program, self.machine, self.setup, self.options, find)
        return FixedText(fixed.text, fixed.changed, fixed.report)

    @contextmanager
    def _outlet(
        self, source: Source, target: OutputTarget, dialect: Dialect, find: Find, jobs: int
    ) -> Iterator[tuple[Stream, Outlet]]:
        from ncfix.compensate.driver import Stream
        from ncfix.compensate.following import Task

        if source.size is None or source.size >= part_bytes():
            fast.engage(console.forewarn)
        path = shown(source.path)
        with outlet_for(
            target, not self.setup.assume_zero and self.setup.probed is None, lambda: bool(stream.stamped)
        ) as outlet:
            task = Task(self.machine, self.setup, self.options, find, path, dialect, part_bytes(), source.head)
            stream = Stream(task, source.read, outlet.put, jobs, source.ground(outlet.kept.fileno()))
            yield stream, outlet

    def _in_parts(self, source: Source, stream: Stream, outlet: Outlet, find: Find) -> FixedText:
        from ncfix.compensate.workers import GoneError
        from ncfix.control.trace import NotInPartsError

        _let_stay()
        try:
            done = stream.run()
        except NotInPartsError:
            fixed = self._whole(source, source.everything(), find)
            assert isinstance(fixed.text, bytes)
            return FixedText(outlet.after(fixed.text, source.path), fixed.changed, fixed.report)
        except GoneError:
            text = "one of the processes that worked on it was killed"
            raise FaultError.of("NCF017", text, Place(shown(source.path)), "fix it with --jobs 1") from None
        source.check_unchanged()
        return FixedText(outlet.remaining(done.stamp), done.report.changed, done.report)


@cache
def _let_stay() -> None:
    """Spare the garbage collector what is loaded by now, once in a process: it stays, and is much to go through."""
    gc.freeze()


def _written(fixed: FixedText, target: OutputTarget, options: FixOptions) -> FixOutcome:
    entry: dict[str, Any] = fixed.report.as_dict()
    path = shown(target.source)
    refusals = (Message(each["code"], each["reason"], Place(path, each["line"])) for each in entry["refused"])
    console.tell_some([*fixed.report.warnings, *refusals], partial(_with_lines, source=target.source))
    refused = bool(entry["refused"]) and not options.allow_refused
    if not refused:
        if fixed.changed or not target.in_place:
            target.write(fixed.text, files.mode_of(target.source))
        entry["output"] = target.path
    for line in _summary(entry, refused):
        console.say(line)
    if refused:
        console.say(f"  {ACCEPT if options.flatten else FLATTEN + ACCEPT}")
    return FixOutcome(ExitCode.REFUSED if refused else ExitCode.DONE, entry)


def _with_lines(messages: Sequence[Message], source: str) -> list[Message]:
    """Messages, those on lines of a program file with these lines."""
    bare = [(each, each.place if each.place and _is_bare(each.place, shown(source)) else None) for each in messages]
    wanted = {place.line for _, place in bare if place}
    if not wanted or not os.path.isfile(source):
        return list(messages)
    with open(source, encoding="latin-1") as text:
        lines = {n: line.rstrip("\n") for n, line in enumerate(islice(text, max(wanted)), start=1) if n in wanted}
    return [replace(each, place=replace(at, text=lines.get(at.line, ""))) if at else each for each, at in bare]


def _is_bare(place: Place, path: str) -> bool:
    """Whether a place is a line of this file, and does not show it."""
    return place.path == path and place.line > 0 and not place.text


def _summary(entry: dict[str, Any], refused: bool) -> list[str]:
    """What was done, for people."""
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
        lines.append("  nothing corrected")
    else:
        lines.append(f"  largest correction  {entry['max_correction_um']:.1f} um")
    if entry["error_before_um"] and entry["error_before_um"]["max"] is None:
        if entry["compensated"]:
            lines.append("  tip error           no figure: nothing that cuts was corrected")
    elif entry["error_before_um"]:
        without = "; without what is refused" if entry["refused"] else ""
        if any(left["cuts"] for left in entry["left_where_it_stands"]):
            without += "; without what is left where it stands (NCF439)"
        lines.append(f"  tip error before    {console.error_figures(entry['error_before_um'])}{without}")
        lines.append(f"  tip error after     {console.error_figures(entry['error_after_um'])}{without}")
    if entry["compensated"]:
        lines.append(f"  rounding            up to {entry['rounding_um']:.2f} um of that are the control's digits")
    if entry["no_figure"]:
        lines.append(f"  {console.no_figure(entry['no_figure'])}")
    if entry["leaves"]:
        lines.append(f"  {entry['strategy']}: {entry['leaves']}")
    return lines


@dataclass(frozen=True, slots=True)
class Batch:
    """Programs that are fixed one after another, or several at a time.

    folder  where their outputs go together; None: each has its own place
    resume  what an earlier run has done stays
    """

    job: FixJob
    targets: Sequence[OutputTarget]
    folder: str | None
    resume: bool

    def run(self, jobs: int, make: ExecutorMaker) -> Iterator[FixOutcome]:
        """What becomes of them, in their order; each is noted as soon as it is done."""
        journal = Journal(self.folder) if self.folder is not None and len(self.targets) > 1 else None
        if journal is not None:
            journal.check()
        done = {} if journal is None or not self.resume else journal.records()
        kept = {target: done[target.name] for target in self.targets if self._holds(target, done.get(target.name))}
        fresh = self._fresh([target for target in self.targets if target not in kept], jobs, make)
        for target in self.targets:
            if target in kept:
                console.say(f"{visible(shown(target.source))} -> {visible(target.path)}: done before")
                yield FixOutcome(ExitCode.DONE, {**kept[target].entry, "resumed": True}, kept[target].called)
                continue
            outcome = next(fresh)
            if journal is not None and outcome.entry["output"] is not None:
                digest = digest_of(target.path) or ""
                journal.add(JournalRecord(target.name, self.job.key(target), digest, outcome.called, outcome.entry))
            yield outcome
        if journal is not None:
            journal.finish()

    def _fresh(self, rest: Sequence[OutputTarget], jobs: int, make: ExecutorMaker) -> Iterator[FixOutcome]:
        if jobs == 1 or len(rest) <= 1 or any(target.source == STREAM for target in rest):
            for target in rest:
                yield self.job.outcome(target, jobs)
            return
        for outcome, said in results_in_order(self.job.outcome_and_messages, rest, make, jobs, _lost):
            for line in said:
                console.say(line)
            yield outcome

    def _holds(self, target: OutputTarget, record: JournalRecord | None) -> bool:
        if record is None:
            return False
        return record.holds(self.job.key(target), target.path, subprograms(self.job.setup, target.source))


def _lost(target: OutputTarget) -> tuple[FixOutcome, list[str]]:
    """What to say of a program over which two processes died: too large for the memory, or a fault in compiled code."""
    text = "the process that worked on it was killed, and so was another one"
    error = FaultError.of("NCF017", text, Place(shown(target.source)), "fix it alone, where there is more memory")
    return FixOutcome.failed(target, error), [str(message) for message in error.messages]
