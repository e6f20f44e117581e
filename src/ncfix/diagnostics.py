"""What goes wrong, in plain words: coded errors with a place, the source line and one hint.

Every failure that a user can cause is an `NcfixError` with a stable code. A fault of ncfix itself is never one: it
stays an ordinary exception, and the command line reports it as a fault of ncfix (exit code 5).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from enum import IntEnum
from typing import ClassVar, Self

from ncfix.values import frozen, mutable


@frozen
class Code:
    """What `ncfix explain` says about a message code: a title, what it means, and what to do about it.

    Every floor lists its own in `codes.py` as `CODES: dict[str, Code]`.
    """

    title: str
    text: str
    hint: str = ""


_BIDI = "\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
"""Characters that turn the direction of writing round, or end a line, and are not seen themselves."""
_UNSEEN = rf"\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f{_BIDI}\ud800-\udfff"
_IN_A_LINE = re.compile(rf"[\t\n\r{_UNSEEN}]")
_IN_LINES = re.compile(rf"\r\n?|[{_UNSEEN}]")
EXCERPT = 100
"""Characters of a source line that a message shows."""


def visible(text: str, lines: bool = False) -> str:
    """A text in which nothing steers a terminal: control characters as they are written in Python, `\\x1b` for one.

    So are those that turn the direction of writing round, and bytes of a name that are no characters.

    lines  the text has several lines, which may end in any way, and tabs
    """
    return (_IN_LINES if lines else _IN_A_LINE).sub(_escaped, text)


def _escaped(found: re.Match[str]) -> str:
    if found[0] == "\r\n":
        return "\n"
    number = ord(found[0])
    if 0xDC80 <= number <= 0xDCFF:  # a byte, as Python has it in the name of a file
        return f"\\x{number - 0xDC00:02x}"
    return {9: "\\t", 10: "\\n", 13: "\\r"}.get(number, f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}")


class ExitCode(IntEnum):
    """Exit codes of the command line; over many files the worst one counts."""

    DONE = 0
    FINDINGS = 1
    USAGE = 2
    UNREADABLE = 3
    REFUSED = 4
    FAULT = 5


@frozen
class Place:
    """Where in a file: path as the user wrote it, line and column from 1 (0 = the whole file), and that line's text."""

    path: str
    line: int = 0
    column: int = 0
    text: str = ""

    def __str__(self) -> str:
        parts = [visible(self.path) or "''"]
        if self.line:
            parts.append(str(self.line))
            if self.column:
                parts.append(str(self.column))
        return ":".join(parts)


@frozen
class Message:
    """One coded remark: what is the matter, where, and what to do about it."""

    code: str
    text: str
    place: Place | None = None
    hint: str = ""

    def __str__(self) -> str:
        head = f"{self.place}: " if self.place else ""
        lines = [f"{head}{self.code}: {visible(self.text)}"]
        if self.place and self.place.text:
            lines += [f"    {line}" for line in _excerpt(self.place.text, self.place.column)]
        if self.hint:
            lines.append(f"  hint: {visible(self.hint)}")
        return "\n".join(lines)

    @property
    def advice(self) -> str:
        """The hint; of a message without one of its own, where its code is explained."""
        return self.hint or f"ncfix explain {self.code} says more"

    def as_dict(self) -> dict[str, object]:
        """The message as plain data, for `--json`."""
        place = self.place
        return {
            "code": self.code,
            "text": self.text,
            "path": place.path if place else None,
            "line": place.line if place else None,
            "column": place.column if place else None,
            "hint": self.advice,
        }


def _excerpt(text: str, column: int) -> list[str]:
    """The part of a source line round a column (from 1, 0 for none), safe for a terminal, and a caret below it."""
    start = max(0, column - EXCERPT // 2) if len(text) > EXCERPT else 0
    part = text[start : start + EXCERPT]
    head, tail = "..." * (start > 0), "..." * (start + EXCERPT < len(text))
    shown = head + "".join(char if char.isprintable() else " " if char == "\t" else "?" for char in part) + tail
    return [shown, " " * (len(head) + column - 1 - start) + "^"] if column else [shown]


@mutable(eq=False, slots=False)
class NcfixError(Exception):
    """A failure with a remedy. `messages` holds coded remarks: one, or all that were found in a config file."""

    messages: tuple[Message, ...]
    exit_code: ClassVar[ExitCode] = ExitCode.USAGE

    def __str__(self) -> str:
        return "\n".join(str(message) for message in self.messages)

    @property
    def code(self) -> str:
        """The code of the first message."""
        return self.messages[0].code

    @classmethod
    def of(cls, code: str, text: str, place: Place | None = None, hint: str = "") -> Self:
        """An error with a single message."""
        return cls((Message(code, text, place, hint),))

    @classmethod
    def collected(cls, messages: Iterable[Message]) -> Self:
        """An error with all the messages found."""
        return cls(tuple(messages))


class UsageError(NcfixError):
    """The command was asked for something it cannot do as asked (exit 2)."""

    exit_code = ExitCode.USAGE


class DifferenceError(NcfixError):
    """What was compared differs so much that there is nothing to measure (exit 1)."""

    exit_code = ExitCode.FINDINGS


class SourceError(NcfixError):
    """An NC program that cannot be read or followed (exit 3)."""

    exit_code = ExitCode.UNREADABLE


class ConfigError(NcfixError):
    """A machine, setup or measurement file that is wrong (exit 3)."""

    exit_code = ExitCode.UNREADABLE


class RefusedError(NcfixError):
    """ncfix could go on, but the result might harm the part or the machine (exit 4)."""

    exit_code = ExitCode.REFUSED


class FaultError(NcfixError):
    """ncfix itself failed (exit 5): what the command line makes of an exception that nobody foresaw."""

    exit_code = ExitCode.FAULT


class PluginError(NcfixError):
    """A plugin failed (exit 5)."""

    exit_code = ExitCode.FAULT
