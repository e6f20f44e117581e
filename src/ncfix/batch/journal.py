"""What a batch remembers: a journal in the folder of the outputs, one line of JSON for each thing done.

The journal stays when the batch is over. The next run of the same batch, with `--resume`, finds there what need not be
done again: programs of which nothing has changed, also those that failed. What changed is done again, and its output
takes the place of the old one, as long as that is what ncfix has written there for this program: the journal knows the
digests of all outputs. An output that somebody has changed since, or that was made of another program of the same name,
is never replaced, and never taken for done.

A process can be killed at any moment. So an output is announced in the journal before it gets its name, and noted after
it; a line that was cut off does not count, and spoils no other. While a batch runs its journal is locked.
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
"""How long the processes of a batch that was killed may hold its journal."""
ROOM_BYTES = 1 << 20
"""A journal is written anew where more than this, and more than half of it, does not count any more."""
REPORTED = frozenset({"changed", "refused", "warnings"})
"""What is reported at least of a program that was followed to its end."""
Find = Callable[[str], bytes | None]
"""Gives the text of a subprogram by its name."""


def digest_of(path: str) -> str | None:
    """The SHA-256 of a file; None if it cannot be read, or not a second time, as a pipe."""
    if not os.path.isfile(path):
        return None
    try:
        with open(path, "rb") as handle:
            return hashlib.file_digest(handle, "sha256").hexdigest()
    except OSError:
        return None


def text_digest(text: bytes | Iterable[bytes] | None) -> str:
    """The SHA-256 of a text, whole or in parts; empty for none."""
    if text is None:
        return ""
    found = hashlib.sha256()
    for part in (text,) if isinstance(text, bytes) else text:
        found.update(part)
    return found.hexdigest()


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


@frozen
class JournalRecord:
    """A program that is done, or that failed.

    name    the output, as a way down from the folder
    source  the program's real path
    key     what the result depends on, as a digest: the program, the machine, the set-up, the options
    digest  of the output; empty if none was written
    called  subprograms that were looked for: name -> digest of their text, empty if there was none
    entry   what was reported
    code    the exit code
    limits  of time and memory, which decide whether a program fails and nothing else
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
        """Whether the same would come of it again, and the output is as it was written."""
        if not key or key != self.key:
            return False
        if self.digest and digest_of(output) != self.digest:
            return False
        if not self.digest and limits != self.limits:
            return False
        return all(text_digest(find(name)) == digest for name, digest in self.called.items())

    @property
    def is_sound(self) -> bool:
        """Whether it is as ncfix writes it; what somebody has changed in the journal does not count."""
        texts = (self.name, self.key, self.digest, self.limits, self.source)
        maps = isinstance(self.called, Mapping) and isinstance(self.entry, Mapping)
        if not (maps and isinstance(self.code, int) and all(isinstance(each, str) for each in texts)):
            return False
        return bool(self.entry.get("errors")) or self.entry.keys() >= REPORTED

    def as_dict(self) -> dict[str, Any]:
        """The record as plain data."""
        return {each.name: getattr(self, each.name) for each in fields(self)}


def announce(path: str, name: str, digest: str, source: str) -> None:
    """Say in a journal that an output is about to get this content, made of the program with this real path.

    Raises `UsageError` NCF005, NCF007.
    """
    _append(path, {"name": name, "writes": digest, "source": source})


def _append(path: str, content: Mapping[str, Any]) -> int:
    """Write a line, and say how long it is."""
    line = "\n" + json.dumps({"schema": SCHEMA, **content})  # a line that was cut off earlier does not spoil this one
    files.append(path, line.encode())
    return len(line)


class Journal:
    """The journal of a folder.

    records  what is known of each output, by its name: the last word counts
    written  what ncfix has written, or was about to, under a name: digests, and the real paths of the programs
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
        """The journal of a folder, for this process alone.

        Raises `UsageError` NCF005, NCF007 if it cannot be written, NCF026 if another process works on this folder.
        """
        path = os.path.join(folder, JOURNAL)
        with _locked(path):
            journal = cls(folder)
            yield journal
            journal.tidy()

    def made(self, name: str, program: str) -> frozenset[str]:
        """The digests of what ncfix has written under a name for this program; not for another of the same name."""
        source = os.path.realpath(program)
        return frozenset(digest for digest, of in self.written.get(name, {}).items() if of == source)

    def add(self, record: JournalRecord) -> None:
        """Note what came of a program. Raises `UsageError` NCF005, NCF007."""
        self._take(record, _append(self.path, record.as_dict()))

    def tidy(self) -> None:
        """Write the journal anew without what does not count any more, if that is much."""
        with suppress(FileNotFoundError):
            size, counting = os.path.getsize(self.path), sum(self._counting.values())
            if size > ROOM_BYTES and size > 2 * counting:
                lines = (f"\n{json.dumps(line)}".encode() for line in self._lines())
                files.write_whole(self.path, lines, replace=True)

    def _lines(self) -> Iterator[dict[str, Any]]:
        """All that counts."""
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
    """Lock a file as long as this lasts; where there are no locks, it is not locked."""
    until = monotonic() + PATIENCE_S
    while True:
        files.append(path, b"")
        with open(path, "rb") as handle:
            if not _is_free(handle.fileno()):
                if monotonic() > until:
                    text = "another ncfix writes into this folder"
                    raise UsageError.of("NCF026", text, Place(path), "wait until it is done, or another -o")
                sleep(0.05)
            elif os.path.exists(path) and os.path.samestat(os.fstat(handle.fileno()), os.stat(path)):
                yield
                return


def _is_free(handle: int) -> bool:
    """Lock an open file; whether it could be, or cannot be at all."""
    try:
        import fcntl
    except ImportError:  # Windows
        return True
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in (errno.EWOULDBLOCK, errno.EACCES)
    return True
