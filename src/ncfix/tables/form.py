"""Table files of controls that ncfix makes no tables for: read line by line, and written again to the byte.

A form is a list of the lines that it may have. A line is kept as its words and its numbers; a number keeps its
decimals, its sign and its place, so that it may be changed and the file written again as its control likes it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal

from ncfix.tables.lines import BYTE_ORDER, Remarks

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
N = f"({NUMBER})"
GAP = r"[ \t]+"
END = re.compile(rb"\r\n|\n")


@dataclass(frozen=True, slots=True)
class Line:
    """A line: what it is, its text with a slot for every number, and the numbers with the width of their slots."""

    kind: str
    text: str
    numbers: tuple[Decimal, ...] = ()
    plus: tuple[bool, ...] = ()

    def written(self) -> str:
        """The line."""
        words = (f"{'+' if plus else ''}{number}" for number, plus in zip(self.numbers, self.plus, strict=True))
        return "".join(part for pair in zip(self.text.split("\0"), [*words, ""], strict=True) for part in pair)


@dataclass(frozen=True, slots=True)
class Document:
    """A file of a known form. `eol` after each line; `last` whether also after the last; `start` a byte order mark."""

    form: str
    lines: tuple[Line, ...]
    eol: str = "\n"
    last: bool = True
    start: str = ""

    def content(self) -> bytes:
        """The file."""
        text = self.eol.join(line.written() for line in self.lines)
        return (self.start + text + (self.eol if self.last else "")).encode("latin-1")

    def rows(self, kind: str) -> list[tuple[float, ...]]:
        """The numbers of all lines of a kind."""
        return [tuple(map(float, line.numbers)) for line in self.lines if line.kind == kind]

    def sections(self, kind: str) -> dict[str, list[tuple[float, ...]]]:
        """The numbers of the lines after each line of a kind, `[X]`, under what that has between its brackets."""
        found: dict[str, list[tuple[float, ...]]] = {}
        rows: list[tuple[float, ...]] = []
        for line in self.lines:
            if line.kind == kind:
                rows = found.setdefault(line.text.strip().strip("[]"), [])
            elif line.numbers:
                rows.append(tuple(map(float, line.numbers)))
        return found

    def with_numbers(self, index: int, *numbers: Decimal) -> Document:
        """With other numbers in one line."""
        line = replace(self.lines[index], numbers=numbers)
        return replace(self, lines=(*self.lines[:index], line, *self.lines[index + 1 :]))


Check = Callable[[Document, Remarks], None]


@dataclass(frozen=True, slots=True)
class Form:
    """What lines a kind of file has: name -> pattern, whose groups are numbers; and what must hold between them.

    needs  the kinds of lines that tell it: no file of the form is without one of each
    """

    name: str
    title: str
    kinds: Mapping[str, str]
    check: Check = lambda document, remarks: None
    needs: tuple[str, ...] = ()


def read(form: Form, path: str, content: bytes) -> tuple[Document, Remarks]:
    """A file of a form, with remarks on lines that the form does not have."""
    remarks = Remarks.of(path, content)
    eol = "\r\n" if b"\r\n" in content else "\n"
    lines = [_line(form, remarks, number, row) for number, row in enumerate(remarks.rows, 1)]
    start = BYTE_ORDER if content.startswith(BYTE_ORDER.encode("latin-1")) else ""
    document = Document(form.name, tuple(lines), eol, bool(END.search(content[-2:])), start)
    if not lines:
        remarks.refuse(0, "is empty")
    for kind in {*form.needs} - {line.kind for line in lines}:
        remarks.refuse(0, f"no line of the sort {kind!r}")
    if not remarks.wrong:
        form.check(document, remarks)
    return document, remarks


def _line(form: Form, remarks: Remarks, number: int, row: str) -> Line:
    for kind, pattern in form.kinds.items():
        match = re.fullmatch(pattern, row)
        if match:
            return _slotted(kind, row, match)
    comma = re.search(r"\d,\d", row)
    remarks.refuse(number, "a decimal comma" if comma else f"is no line of {form.title}", "see docs/controllers.md")
    return Line("?", row)


def _slotted(kind: str, row: str, match: re.Match[str]) -> Line:
    spans = [match.span(group) for group in range(1, match.re.groups + 1) if match[group] is not None]
    text, at = "", 0
    for start, stop in spans:
        text += row[at:start] + "\0"
        at = stop
    words = [row[start:stop] for start, stop in spans]
    numbers = tuple(Decimal(word) for word in words)
    if any(str(value) != word.lstrip("+") for value, word in zip(numbers, words, strict=True)):
        return Line(kind, row)  # a way of writing that a number does not keep: such a line stays as it is
    return Line(kind, text + row[at:], numbers, tuple(word.startswith("+") for word in words))
