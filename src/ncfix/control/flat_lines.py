"""A program written out flat, as far as all families do it alike: lines up to a limit, blocks with changes made."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

from ncfix.control.faults import Fault
from ncfix.control.flatten import TOO_LONG, FlatLine
from ncfix.text.tree import Program


class Change(NamedTuple):
    """Text of a block to be replaced: from `start` up to `stop`, places in the source."""

    start: int
    stop: int
    text: str = ""


@dataclass(slots=True)
class FlatLines:
    """The lines of a flat program so far, and how many there may be."""

    limit: int
    lines: list[FlatLine] = field(default_factory=list)

    def write(self, text: str, line: int) -> None:
        """One line more, which comes from a line of the original; raises `Fault` NCF238 beyond the limit."""
        if len(self.lines) >= self.limit:
            hint = "a program so long is better corrected where it is made"
            raise Fault(TOO_LONG, f"written out flat the program has more than {self.limit} lines", hint)
        self.lines.append(FlatLine(text, line))


def changed(program: Program, block: int, changes: Iterable[Change]) -> str:
    """The text of a block with changes made, as Latin-1; one that lies within another does not count."""
    at, stop = map(int, program.blocks[block])
    text = ""
    for change in sorted(changes, key=lambda each: (each.start, each.stop)):
        if change.start < at and change.stop <= at:
            continue
        text += program.source[at : max(at, change.start)].decode("latin-1") + change.text
        at = change.stop
    return text + program.source[at:stop].decode("latin-1")
