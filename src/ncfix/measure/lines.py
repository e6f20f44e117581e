"""The lines of a text file, its cells, and what is wrong with them."""

from __future__ import annotations

from dataclasses import dataclass, field

from ncfix.diagnostics import ConfigError, Message, Place

SHOWN = 25
"""Faults that are named one by one; a file with more has a fault of another sort."""


def _where(message: Message) -> tuple[int, int]:
    return (message.place.line, message.place.column) if message.place else (0, 0)


@dataclass(slots=True)
class Text:
    """The lines of a file and what is wrong with them."""

    path: str
    lines: list[str]
    messages: list[Message] = field(default_factory=list)

    def note(self, code: str, text: str, line: int = 0, column: int = 0, hint: str = "") -> None:
        """Note a fault at a line and column, counted from 1."""
        source = self.lines[line - 1] if line else ""
        self.messages.append(Message(code, text, Place(self.path, line, column, source), hint))

    def stop(self) -> None:
        """Raise what was noted, if anything."""
        if self.messages:
            self.messages.sort(key=_where)
            more = len(self.messages) - SHOWN
            rest = [Message(self.messages[0].code, f"{more} more faults", Place(self.path))] if more > 0 else []
            raise ConfigError.collected([*self.messages[:SHOWN], *rest])


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell's text with its line and column from 1."""

    text: str
    line: int
    column: int
