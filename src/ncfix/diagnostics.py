"""What goes wrong, in plain words: coded errors with a place, the source line and one hint.

Every failure that a user can cause is an `NcfixError` with a stable code. A fault of ncfix itself is never one: it
stays an ordinary exception, and the command line reports it as a fault of ncfix (exit code 5).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import IntEnum


@dataclass(frozen=True, slots=True)
class Code:
    """What `ncfix explain` says about a message code: a title, what it means, and what to do about it.

    Every floor lists its own in `codes.py` as `CODES: dict[str, Code]`.
    """

    title: str
    text: str
    hint: str = ""


class ExitCode(IntEnum):
    """Exit codes of the command line; over many files the worst one counts."""

    DONE = 0
    FINDINGS = 1
    USAGE = 2
    UNREADABLE = 3
    REFUSED = 4
    FAULT = 5


@dataclass(frozen=True, slots=True)
class Place:
    """Where in a file: path as the user wrote it, line and column from 1 (0 = the whole file), and that line's text."""

    path: str
    line: int = 0
    column: int = 0
    text: str = ""

    def __str__(self) -> str:
        parts = [self.path]
        if self.line:
            parts.append(str(self.line))
            if self.column:
                parts.append(str(self.column))
        return ":".join(parts)


@dataclass(frozen=True, slots=True)
class Message:
    """One coded remark: what is the matter, where, and what to do about it."""

    code: str
    text: str
    place: Place | None = None
    hint: str = ""

    def __str__(self) -> str:
        head = f"{self.place}: " if self.place else ""
        lines = [f"{head}{self.code}: {self.text}"]
        if self.place and self.place.text:
            lines.append(f"    {self.place.text}")
            if self.place.column:
                lines.append("    " + " " * (self.place.column - 1) + "^")
        if self.hint:
            lines.append(f"  hint: {self.hint}")
        return "\n".join(lines)

    def as_dict(self) -> dict[str, object]:
        """The message as plain data, for `--json`."""
        place = self.place
        return {
            "code": self.code,
            "text": self.text,
            "path": place.path if place else None,
            "line": place.line if place else None,
            "column": place.column if place else None,
            "hint": self.hint or None,
        }


@dataclass(eq=False)
class NcfixError(Exception):
    """A failure with a remedy. `messages` holds coded remarks: one, or all that were found in a config file."""

    messages: tuple[Message, ...]
    exit_code: ExitCode = field(default=ExitCode.USAGE, init=False)

    def __str__(self) -> str:
        return "\n".join(str(message) for message in self.messages)

    @property
    def code(self) -> str:
        """The code of the first message."""
        return self.messages[0].code

    @classmethod
    def of(cls, code: str, text: str, place: Place | None = None, hint: str = "") -> NcfixError:
        """An error with a single message."""
        return cls((Message(code, text, place, hint),))

    @classmethod
    def collected(cls, messages: Iterable[Message]) -> NcfixError:
        """An error with all the messages found."""
        return cls(tuple(messages))


class UsageError(NcfixError):
    """The command was asked for something it cannot do as asked (exit 2)."""

    def __post_init__(self) -> None:
        self.exit_code = ExitCode.USAGE


class SourceError(NcfixError):
    """An NC program that cannot be read or followed (exit 3)."""

    def __post_init__(self) -> None:
        self.exit_code = ExitCode.UNREADABLE


class ConfigError(NcfixError):
    """A machine, setup or measurement file that is wrong (exit 3)."""

    def __post_init__(self) -> None:
        self.exit_code = ExitCode.UNREADABLE


class RefusedError(NcfixError):
    """ncfix could go on, but the result might harm the part or the machine (exit 4)."""

    def __post_init__(self) -> None:
        self.exit_code = ExitCode.REFUSED


class PluginError(NcfixError):
    """A plugin failed (exit 5)."""

    def __post_init__(self) -> None:
        self.exit_code = ExitCode.FAULT
