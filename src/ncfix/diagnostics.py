"""Errors and messages: a code, plain words, a place with its source line, and one hint.

Every failure that a user can cause is an `NcfixError` with a stable code. A bug of ncfix is never one: it stays an
ordinary exception, which the command line reports as a fault of ncfix (exit code 5).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from enum import IntEnum
from typing import ClassVar, Self

from ncfix.values import frozen, mutable


@frozen
class Code:
    """The explanation of a message code by `ncfix explain`: a title, its meaning, and what to do.

    Packages list their codes in a `codes.py` as `CODES: dict[str, Code]`.
    """

    title: str
    text: str
    hint: str = ""


_BIDI = "\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
"""Invisible characters that change the writing direction or end a line."""
_UNSEEN = rf"\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f{_BIDI}\ud800-\udfff"
_IN_A_LINE = re.compile(rf"[\t\n\r{_UNSEEN}]")
_IN_LINES = re.compile(rf"\r\n?|[{_UNSEEN}]")
EXCERPT = 100
"""Number of characters of a source line that a message shows."""


def visible(text: str, lines: bool = False) -> str:
    """The text without characters that could control a terminal; they are shown as Python escapes, such as `\\x1b`.

    This includes characters that change the writing direction, and bytes of a file name that are no characters.

    lines  whether the text may have several lines, with any line ends, and tabs
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
    """Exit codes of the command line; for several files the worst one is returned."""

    DONE = 0
    FINDINGS = 1
    USAGE = 2
    UNREADABLE = 3
    REFUSED = 4
    FAULT = 5


@frozen
class Place:
    """A place in a file: path as the user wrote it, line and column from 1 (0: the whole file), and the line's text."""

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
    """One coded message: what is wrong, where, and what to do about it."""

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
        """The hint; for a message without one, how to get an explanation of its code."""
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
    """The part of a source line around a column (from 1; 0: none), safe for a terminal, with a caret below."""
    start = max(0, column - EXCERPT // 2) if len(text) > EXCERPT else 0
    part = text[start : start + EXCERPT]
    head, tail = "..." * (start > 0), "..." * (start + EXCERPT < len(text))
    shown = head + "".join(char if char.isprintable() else " " if char == "\t" else "?" for char in part) + tail
    return [shown, " " * (len(head) + column - 1 - start) + "^"] if column else [shown]


def lines_named(stretches: Sequence[tuple[int, int]], most: int = 8) -> str:
    """Stretches of lines in words, "lines 3 to 5, 9"; of more than `most` only where they begin and end."""
    first, last = stretches[0][0], stretches[-1][1]
    if len(stretches) > most:
        return f"between lines {first} and {last}"
    parts = [str(a) if a == b else f"{a} to {b}" for a, b in stretches]
    return f"line{'s' if last > first else ''} {', '.join(parts)}"


@mutable(eq=False, slots=False)
class NcfixError(Exception):
    """A failure with a remedy. `messages`: one message, or all that were found in a file."""

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
    """The command or function cannot do what it was asked for (exit 2)."""

    exit_code = ExitCode.USAGE


class DifferenceError(NcfixError):
    """Two compared things differ so much that no measure of the difference makes sense (exit 1)."""

    exit_code = ExitCode.FINDINGS


class SourceError(NcfixError):
    """An NC program cannot be read or followed (exit 3)."""

    exit_code = ExitCode.UNREADABLE


class ConfigError(NcfixError):
    """A machine, setup or measurement file has errors (exit 3)."""

    exit_code = ExitCode.UNREADABLE


class RefusedError(NcfixError):
    """The result might harm the part or the machine (exit 4)."""

    exit_code = ExitCode.REFUSED


class FaultError(NcfixError):
    """A bug of ncfix (exit 5): made by the command line from an unexpected exception."""

    exit_code = ExitCode.FAULT


class PluginError(NcfixError):
    """A plugin failed (exit 5)."""

    exit_code = ExitCode.FAULT
