"""Who works on many programs, and a journal of what is done.

The workers are processes of this machine, or whatever the executor of a plugin reaches. What comes out does not depend
on that: results come in the order of the tasks, and a worker that dies takes one task with it, not the batch.

The journal has one line of JSON for each output, written after it, so that an interrupted batch can go on. It lies in
the folder of the outputs while a batch runs, and is taken away at its end. A line that was cut off when the power went
does not count.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from ncfix import files
from ncfix.diagnostics import UsageError
from ncfix.host import tie
from ncfix.plugins import called, nearest, registry

if TYPE_CHECKING:
    from concurrent.futures import Executor

Task = TypeVar("Task")
Result = TypeVar("Result")
ExecutorMaker: TypeAlias = "Callable[[int], Executor]"
"""Makes an executor with so many workers."""
JOURNAL = ".ncfix-journal.jsonl"
SCHEMA = 1
Find = Callable[[str], bytes | None]
"""Gives the text of a subprogram by its name."""


def processes(workers: int) -> Executor:
    """Processes of this machine; they end with this one."""
    from concurrent.futures import ProcessPoolExecutor

    return ProcessPoolExecutor(workers, initializer=tie)


BUILT_IN: Mapping[str, ExecutorMaker] = {"processes": processes}


def executor_of(name: str) -> ExecutorMaker:
    """The executors of that name; raises `UsageError` NCF015."""
    known: dict[str, ExecutorMaker] = registry("executors", BUILT_IN)
    if name not in known:
        raise UsageError.of("NCF015", f"there is no executor {name!r}", hint=nearest(name, known))
    return partial(_made, name, known[name])


def _made(name: str, make: ExecutorMaker, workers: int) -> Executor:
    from concurrent.futures import Executor

    executor: Executor = called("executors", name, make, workers, gives=Executor)
    return executor


def results_in_order(
    work: Callable[[Task], Result],
    tasks: Sequence[Task],
    make: ExecutorMaker,
    workers: int,
    lost: Callable[[Task], Result],
) -> Iterator[Result]:
    """The results of `work` for all tasks, in their order, by `workers` workers.

    lost  the result for a task whose worker died over it twice, the second time alone
    """
    from concurrent.futures import BrokenExecutor

    rest = list(tasks)
    while rest:
        with make(min(workers, len(rest))) as executor:
            begun = [executor.submit(work, task) for task in rest]
            try:
                for future in begun:
                    yield future.result()
                    del rest[0]
            except BaseException as error:
                for future in begun:
                    future.cancel()
                if not isinstance(error, BrokenExecutor):
                    raise
        if rest:
            yield _done_alone(work, rest.pop(0), make, lost)


def _done_alone(
    work: Callable[[Task], Result], task: Task, make: ExecutorMaker, lost: Callable[[Task], Result]
) -> Result:
    from concurrent.futures import BrokenExecutor

    try:
        with make(1) as executor:
            return executor.submit(work, task).result()
    except BrokenExecutor:
        return lost(task)


def digest_of(path: str) -> str | None:
    """The SHA-256 of a file; None if it cannot be read, or not a second time, as a pipe."""
    if not os.path.isfile(path):
        return None
    try:
        with open(path, "rb") as handle:
            return hashlib.file_digest(handle, "sha256").hexdigest()
    except OSError:
        return None


@dataclass(frozen=True, slots=True)
class JournalRecord:
    """A program that is done.

    name    the output, as a way down from the folder
    key     what its correction depends on, as a digest: the program, the machine, the set-up, the options
    digest  of the output, or of the program where it needed no output
    called  subprograms that were looked for: name -> digest of their text, empty if there was none
    entry   what was reported
    """

    name: str
    key: str
    digest: str
    called: Mapping[str, str] = field(default_factory=dict)
    entry: Mapping[str, Any] = field(default_factory=dict)

    def holds(self, key: str, output: str, find: Find) -> bool:
        """Whether it would be done again just so, and the output is as it was written."""
        same = key == self.key and digest_of(output) == self.digest
        return same and all(text_digest(find(name)) == digest for name, digest in self.called.items())


class RecordingFinder:
    """A finder of subprograms that remembers what it was asked for."""

    def __init__(self, find: Find) -> None:
        self.find = find
        self.called: dict[str, str] = {}

    def __call__(self, name: str) -> bytes | None:
        """The text of a subprogram."""
        text = self.find(name)
        self.called[name] = text_digest(text)
        return text


def text_digest(text: bytes | None) -> str:
    """The SHA-256 of a text; empty for none."""
    return "" if text is None else hashlib.sha256(text).hexdigest()


@dataclass(frozen=True, slots=True)
class Journal:
    """The journal of a folder."""

    folder: str

    @property
    def path(self) -> str:
        """Where it lies."""
        return os.path.join(self.folder, JOURNAL)

    def records(self) -> dict[str, JournalRecord]:
        """What is done, by the name of the output; the last word counts."""
        return {record.name: record for record in self._lines()}

    def add(self, record: JournalRecord) -> None:
        """Note that a program is done. Raises `UsageError` NCF005, NCF007."""
        line = "\n" + json.dumps({"schema": SCHEMA, **asdict(record)})  # a line cut off earlier spoils this one no more
        files.append(self.path, line.encode())

    def check(self) -> None:
        """Refuse to write into what is not the journal itself: NCF005."""
        files.check_own(self.path)

    def finish(self) -> None:
        """Take it away: the batch came to its end."""
        with suppress(FileNotFoundError):
            os.unlink(self.path)

    def _lines(self) -> Iterator[JournalRecord]:
        try:
            with open(self.path, encoding="utf-8") as handle:
                lines = handle.readlines()
        except FileNotFoundError:
            return
        except OSError as error:
            raise files.unreadable(self.path, error) from error
        for line in lines:
            with suppress(ValueError, TypeError, KeyError):
                found = json.loads(line)
                if found.pop("schema") == SCHEMA:
                    yield JournalRecord(**found)
