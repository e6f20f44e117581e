"""Text as people and spreadsheets save it: UTF-8, UTF-16 or Latin-1, with cells parted by commas, semicolons or tabs.

Where semicolons or tabs part the cells, numbers may have a decimal comma, as spreadsheets of many countries write them;
then all of a file have it, since 1,234 is read as it stands.
"""

from __future__ import annotations

import codecs
from dataclasses import dataclass

MARKS = ",;\t"
"""What may part cells."""


def plain_text(source: bytes) -> str | None:
    """The text of a file: UTF-16 if it says so by its mark, else UTF-8, else Latin-1; None if it is none."""
    try:
        if source.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            found = source.decode("utf-16")
        else:
            found = source.decode("utf-8-sig")
    except UnicodeDecodeError:
        found = source.decode("latin-1")
    return None if "\0" in found else found


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell's text with its line and column from 1."""

    text: str
    line: int
    column: int


@dataclass(slots=True)
class SeparatedText:
    """How the cells of a file are parted, and how its numbers are written.

    mark     what parts the cells
    decimal  the decimal mark of the first number that has one; "" before
    """

    mark: str
    decimal: str = ""

    @classmethod
    def of(cls, names: str) -> SeparatedText:
        """By the line with the names of the columns: a semicolon or a tab in it parts the cells, else commas do."""
        return cls(next((mark for mark in ";\t" if mark in names), ","))

    def cells(self, row: str, line: int) -> list[Cell]:
        """The cells of a row; blanks and a spreadsheet's quotes round a cell are taken off."""
        cells, column = [], 1
        for part in row.split(self.mark):
            text, at = part.strip(), column + len(part) - len(part.lstrip())
            quoted = len(text) > 1 and text[0] == text[-1] == '"'
            cells.append(Cell(text[1:-1].strip(), line, at + 1) if quoted else Cell(text, line, at))
            column += len(part) + 1
        return cells

    def plain(self, text: str) -> str:
        """A number with a decimal point. Raises ValueError for one that is not written as those before it."""
        found = "," if "," in text and self.mark != "," else "." if "." in text else ""
        if found and self.decimal and found != self.decimal:
            raise ValueError("decimal points and decimal commas in one file")
        self.decimal = self.decimal or found
        return text.replace(found, ".") if found else text
