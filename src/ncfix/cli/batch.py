"""Many programs for `ncfix fix`: one after another or several at a time, from the start or from where it stopped."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ncfix.batch.journal import Journal, Record, digest_of
from ncfix.batch.work import Staff, each
from ncfix.cli import console
from ncfix.cli.job import Job, Outcome
from ncfix.cli.options import subprograms
from ncfix.cli.targets import STREAM, Target, shown
from ncfix.diagnostics import ExitCode, FaultError, Place, visible


@dataclass(frozen=True, slots=True)
class Batch:
    """Programs that are fixed one after another, or several at a time.

    folder  where their outputs go together; None: each has its own place
    resume  what an earlier run has done stays
    """

    job: Job
    targets: Sequence[Target]
    folder: str | None
    resume: bool

    def run(self, jobs: int, make: Staff) -> Iterator[Outcome]:
        """What becomes of them, in their order; each is noted as soon as it is done."""
        journal = Journal(self.folder) if self.folder is not None and len(self.targets) > 1 else None
        if journal is not None:
            journal.check()
        done = {} if journal is None or not self.resume else journal.records()
        kept = {target: done[target.name] for target in self.targets if self._holds(target, done.get(target.name))}
        fresh = self._fresh([target for target in self.targets if target not in kept], jobs, make)
        for target in self.targets:
            outcome = _kept(target, kept[target]) if target in kept else next(fresh)
            if journal is not None and target not in kept and outcome.entry["output"] is not None:
                journal.add(self._record(target, outcome))
            yield outcome
        if journal is not None:
            journal.finish()

    def _fresh(self, rest: Sequence[Target], jobs: int, make: Staff) -> Iterator[Outcome]:
        if jobs == 1 or len(rest) <= 1 or any(target.source == STREAM for target in rest):
            for target in rest:
                yield self.job.outcome(target, jobs)
            return
        for outcome, said in each(self.job.heard, rest, make, jobs, _lost):
            for line in said:
                console.say(line)
            yield outcome

    def _holds(self, target: Target, record: Record | None) -> bool:
        if record is None:
            return False
        return record.holds(self.job.key(target), target.path, subprograms(self.job.setup, target.source))

    def _record(self, target: Target, outcome: Outcome) -> Record:
        digest = digest_of(target.path) or ""
        return Record(target.name, self.job.key(target), digest, outcome.called, outcome.entry)


def _kept(target: Target, record: Record) -> Outcome:
    console.say(f"{visible(shown(target.source))} -> {visible(target.path)}: done before")
    return Outcome(ExitCode.DONE, {**record.entry, "resumed": True}, record.called)


def _lost(target: Target) -> tuple[Outcome, list[str]]:
    """What to say of a program over which two processes died: too large for the memory, or a fault in compiled code."""
    text = "the process that worked on it was killed, and so was another one"
    error = FaultError.of("NCF017", text, Place(shown(target.source)), "fix it alone, where there is more memory")
    return Outcome.failed(target, error), [str(message) for message in error.messages]
