"""The journal of a batch: a file in the output folder with one line of JSON for each finished program.

The journal stays after the batch. The next run with `--resume` skips programs for which nothing has changed, including
those that failed. Changed programs are done again, and their output replaces the old one if ncfix wrote that for the
same program: the journal has the digests of all outputs. An output that was edited since, or made from another program
of the same name, is never replaced and never counts as finished.

A process can be killed at any moment. So an output is announced in the journal before it gets its name, and recorded
afterwards; an incomplete line is ignored and does not damage others. While a batch runs its journal is locked.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import field, fields
from time import monotonic, sleep
from typing import Any

from ncfix import files
from ncfix.diagnostics import Place, UsageError
from ncfix.values import frozen

JOURNAL = ".ncfix-journal.jsonl"
SCHEMA = 2
PATIENCE_S = 5.0
"""Time, s, for which the processes of a killed batch may still hold its journal."""
ROOM_BYTES = 1 << 20
"""A journal is rewritten if outdated lines take up more than this, and more than half of it."""
REPORTED = frozenset({"changed", "refused", "warnings"})
"""Keys that the report of a program followed to its end has at least."""
Find = Callable[[str], bytes | None]
"""Returns the text of a subprogram by its name."""


def digest_of(path: str) -> str | None:
    """The SHA-256 of a file; None if it cannot be read, or is no ordinary file."""
    if not os.path.isfile(path):
        return None
    try:
        with open(path, "rb") as handle:
            return hashlib.file_digest(handle, "sha256").hexdigest()
    except OSError:
        return None


def text_digest(text: bytes | Iterable[bytes] | None) -> str:
    """The SHA-256 of a text, whole or in parts; empty for None."""
    if text is None:
        return ""
    found = hashlib.sha256()
    for part in (text,) if isinstance(text, bytes) else text:
        found.update(part)
    return found.hexdigest()


class RecordingFinder:
    """A finder of subprograms that records what was asked for."""

    def __init__(self, find: Find) -> None:
        self.find = find
        self.called: dict[str, str] = {}

    def __call__(self, name: str) -> bytes | None:
        """The text of a subprogram."""
        text = self.find(name)
        self.called[name] = text_digest(text)
        return text


@frozen
class JournalRecord:
    """A program that was finished or has failed.

    name    output, as path below the folder
    source  real path of the program
    key     digest of everything the result depends on: program, machine, setup, options
    digest  digest of the output; empty if none was written
    called  subprograms that were looked for: name -> digest of their text, empty if there was none
    entry   report of the program
    code    exit code
    limits  limits of time and memory; they only decide whether a program fails
    """

    name: str
    key: str
    digest: str
    called: Mapping[str, str] = field(default_factory=dict)
    entry: Mapping[str, Any] = field(default_factory=dict)
    code: int = 0
    limits: str = ""
    source: str = ""

    def holds(self, key: str, output: str, find: Find, limits: str = "") -> bool:
        """Whether a new run would give the same result, and the output is still as it was written."""
        if not key or key != self.key:
            return False
        if self.digest and digest_of(output) != self.digest:
            return False
        if not self.digest and limits != self.limits:
            return False
        return all(text_digest(find(name)) == digest for name, digest in self.called.items())

    @property
    def is_sound(self) -> bool:
        """Whether its contents are of the kinds that ncfix writes; a record edited otherwise is ignored."""
        texts = (self.name, self.key, self.digest, self.limits, self.source)
        maps = isinstance(self.called, Mapping) and isinstance(self.entry, Mapping)
        if not (maps and isinstance(self.code, int) and all(isinstance(each, str) for each in texts)):
            return False
        return bool(self.entry.get("errors")) or self.entry.keys() >= REPORTED

    def as_dict(self) -> dict[str, Any]:
        """The record as plain data."""
        return {each.name: getattr(self, each.name) for each in fields(self)}


def announce(path: str, name: str, digest: str, source: str) -> None:
    """Announce in a journal that an output is about to get this content, made from the program with this real path.

    Raises `UsageError` NCF005, NCF007.
    """
    _append(path, {"name": name, "writes": digest, "source": source})


def _append(path: str, content: Mapping[str, Any]) -> int:
    """Append a line; returns its length."""
    line = "\n" + json.dumps({"schema": SCHEMA, **content})  # a line that was cut off earlier does not spoil this one
    files.append(path, line.encode())
    return len(line)


class Journal:
    """The journal of a folder.

    records  latest record of each output, by its name
    written  output name -> digests that ncfix has written, or announced, with the real paths of the programs
    """

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self.path = os.path.join(folder, JOURNAL)
        self.records: dict[str, JournalRecord] = {}
        self.written: dict[str, dict[str, str]] = {}
        self._counting: dict[str, int] = {}
        self._read()

    @classmethod
    @contextmanager
    def opened(cls, folder: str) -> Iterator[Journal]:
        """Open the journal of a folder exclusively for this process.

        Raises `UsageError` NCF005, NCF007 if it cannot be written, NCF026 if another process works on this folder.
        """
        path = os.path.join(folder, JOURNAL)
        with _locked(path):
            journal = cls(folder)
            yield journal
            journal.tidy()

    def made(self, name: str, program: str) -> frozenset[str]:
        """The digests that ncfix has written under a name for this program; not those for another of the same name."""
        source = os.path.realpath(program)
        return frozenset(digest for digest, of in self.written.get(name, {}).items() if of == source)

    def add(self, record: JournalRecord) -> None:
        """Record the result of a program. Raises `UsageError` NCF005, NCF007."""
        self._take(record, _append(self.path, record.as_dict()))

    def tidy(self) -> None:
        """Rewrite the journal without outdated lines, if these are many."""
        with suppress(FileNotFoundError):
            size, counting = os.path.getsize(self.path), sum(self._counting.values())
            if size > ROOM_BYTES and size > 2 * counting:
                lines = (f"\n{json.dumps(line)}".encode() for line in self._lines())
                files.write_whole(self.path, lines, replace=True)

    def _lines(self) -> Iterator[dict[str, Any]]:
        """All lines that are not outdated."""
        for name, digests in self.written.items():
            for digest, source in digests.items():
                if name not in self.records or digest != self.records[name].digest:
                    yield {"schema": SCHEMA, "name": name, "writes": digest, "source": source}
        yield from ({"schema": SCHEMA, **record.as_dict()} for record in self.records.values())

    def _take(self, record: JournalRecord, size: int = 0) -> None:
        self.records[record.name] = record
        self._counting[record.name] = size
        if record.digest:
            self.written.setdefault(record.name, {})[record.digest] = record.source

    def _read(self) -> None:
        try:
            with open(self.path, "rb") as handle:
                for line in handle:
                    with suppress(ValueError, TypeError, KeyError, AttributeError):
                        self._understand(json.loads(line), len(line))
        except FileNotFoundError:
            return
        except OSError as error:
            raise files.unreadable(self.path, error) from error

    def _understand(self, found: dict[str, Any], size: int) -> None:
        if found.pop("schema") != SCHEMA:
            return
        if "writes" in found:
            self.written.setdefault(str(found["name"]), {})[str(found["writes"])] = str(found["source"])
        elif (record := JournalRecord(**found)).is_sound:
            self._take(record, size)


@contextmanager
def _locked(path: str) -> Iterator[None]:
    """Context in which a file is locked; on systems without locks it is not."""
    until = monotonic() + PATIENCE_S
    while True:
        files.append(path, b"")
        with open(path, "rb") as handle:
            if not _is_free(handle.fileno()):
                if monotonic() > until:
                    text = "another ncfix writes into this folder"
                    raise UsageError.of("NCF026", text, Place(path), "wait until it has ended, or give another -o")
                sleep(0.05)
            elif os.path.exists(path) and os.path.samestat(os.fstat(handle.fileno()), os.stat(path)):
                yield
                return


def _is_free(handle: int) -> bool:
    """Lock an open file; returns False if another process holds the lock."""
    try:
        import fcntl
    except ImportError:  # Windows
        return True
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in (errno.EWOULDBLOCK, errno.EACCES)
    return True
