"""Heidenhain's free tables: a BEGIN line, a line of column names, rows in fixed columns, and [END].

A column begins where its name begins and ends where the next one does; that is all there is to it. The same goes for
`.COM`, `.CMA` and kinematics tables. What is read can be written again to the byte.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ncfix.tables.table_files import Remarks, as_number

END = "[END]"
NAME = re.compile(r"\S+")


@dataclass(frozen=True, slots=True)
class Column:
    """A column: its name, and its width in characters."""

    name: str
    width: int


@dataclass(frozen=True, slots=True)
class TextTable:
    """A table as text.

    begin    the words of the BEGIN line after BEGIN, blanks included; "" where there is no such line
    columns  in their order
    rows     a cell for each column
    lines    the line that each row is on
    ended    whether it ends with [END]
    padded   whether blanks fill the last column
    eol      between lines
    """

    begin: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...] = ()
    ended: bool = True
    padded: bool = True
    eol: str = "\n"

    def text(self) -> bytes:
        """The file."""
        return "".join(f"{line}{self.eol}" for line in self._lines()).encode("ascii")

    def cells(self, name: str) -> list[str]:
        """One column, "" where it is missing."""
        names = [column.name for column in self.columns]
        return [row[names.index(name)] if name in names else "" for row in self.rows]

    def _lines(self) -> Iterator[str]:
        if self.begin:
            yield f"BEGIN {self.begin}"
        yield self._row([column.name for column in self.columns])
        for row in self.rows:
            yield self._row(row)
        if self.ended:
            yield END

    def _row(self, cells: Sequence[str]) -> str:
        line = "".join(f"{cell:<{column.width}}" for cell, column in zip(cells, self.columns, strict=True))
        return line if self.padded else line.rstrip()


def read_table(remarks: Remarks, content: bytes) -> TextTable | None:
    """The table in a file; None, with a remark, where there is none."""
    lines = [line for line in enumerate(remarks.rows, 1) if line[1].strip()]
    if not lines:
        remarks.refuse(0, "is empty")
        return None
    begin = lines.pop(0)[1][len("BEGIN ") :] if lines[0][1].upper().startswith("BEGIN ") else ""
    ended = bool(lines) and lines[-1][1].strip().upper() == END
    body = lines[: len(lines) - ended]
    if not body or not body[0][1].startswith("NR"):
        remarks.refuse(body[0][0] if body else 0, "no line of column names, which begins with NR")
        return None
    head = body.pop(0)[1]
    columns = _columns(head)
    _look_for_tabs(remarks)
    rows = tuple(_cells(remarks, number, line, columns) for number, line in body)
    eol = "\r\n" if b"\r\n" in content else "\n"
    return TextTable(begin, columns, rows, tuple(n for n, _ in body), ended, head.endswith(" "), eol)


def _columns(head: str) -> tuple[Column, ...]:
    found = list(NAME.finditer(head))
    ends = [*(match.start() for match in found[1:]), len(head)]
    return tuple(Column(match[0], end - match.start()) for match, end in zip(found, ends, strict=True))


def _cells(remarks: Remarks, number: int, line: str, columns: Sequence[Column]) -> tuple[str, ...]:
    cells, start = [], 0
    for index, column in enumerate(columns):
        stop = start + column.width if index + 1 < len(columns) else len(line)
        cell = line[start:stop]
        if index + 1 < len(columns) and len(cell) == column.width and not cell.endswith(" ") and cell.strip():
            remarks.refuse(number, f"what stands under {column.name} runs into the next column")
        if cell.startswith(" ") and cell.strip():
            remarks.doubt(number, f"what stands under {column.name} does not begin where the column does")
        cells.append(cell.strip())
        start = stop
    if len(cells[-1].split()) > 1:
        remarks.refuse(number, "more cells than there are columns")
    return tuple(cells)


def _look_for_tabs(remarks: Remarks) -> None:
    for number, row in enumerate(remarks.rows, 1):
        if "\t" in row:
            remarks.refuse(number, "a tab: columns are counted in characters")
            return


def number(remarks: Remarks, line: int, cell: str, name: str) -> float:
    """A number in a cell; a remark and nan where it is none."""
    found = as_number(cell)
    if found is not None:
        return found
    what = "a decimal comma" if "," in cell else f"{cell!r} is no number" if cell else "nothing"
    remarks.refuse(line, f"{what} under {name}")
    return float("nan")
