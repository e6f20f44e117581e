"""What of a batch is done: one line of JSON for each output, written after it, so that an interrupted batch can go on.

The journal lies in the folder of the outputs while a batch runs, and is taken away at its end. A line that was cut
off when the power went does not count.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from typing import Any

from ncfix import files

NAME = ".ncfix-journal.jsonl"
SCHEMA = 1

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


@dataclass(frozen=True, slots=True)
class Record:
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


class Noted:
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
        return os.path.join(self.folder, NAME)

    def records(self) -> dict[str, Record]:
        """What is done, by the name of the output; the last word counts."""
        return {record.name: record for record in self._lines()}

    def add(self, record: Record) -> None:
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

    def _lines(self) -> Iterator[Record]:
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
                    yield Record(**found)
