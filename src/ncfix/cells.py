"""Tables of cells in text files as people and spreadsheets save them: UTF-8, UTF-16 or Latin-1, separated by commas,
semicolons, tabs or blanks.

If the separator is not a comma, numbers may have a decimal comma, as spreadsheets of many countries write them; then
all numbers of the file must have it, since 1,234 is taken as written.
"""

from __future__ import annotations

import codecs
import re

from ncfix.values import frozen, mutable

MARKS = ",;\t"
"""Possible separators of cells, besides blanks."""
WORD = re.compile(r'"[^"]*"|\S+')
OTHERS = {
    b"PK\x03\x04": ("a workbook of a spreadsheet", "save its sheet as CSV"),
    b"\xd0\xcf\x11\xe0": ("a workbook of an old spreadsheet", "save its sheet as CSV"),
    b"%PDF": ("a PDF", "export the readings of the instrument's program as text"),
    b"\x1f\x8b": ("a compressed file", "unpack it first"),
    b"<": ("XML", "export it as text or CSV from the program that wrote it"),
    b"{": ("JSON", "export it as text or CSV from the program that wrote it"),
}
"""Beginnings of files of other formats -> what they are, and a hint."""


def plain_text(source: bytes) -> str | None:
    """The text of a file in UTF-16, UTF-8 or Latin-1; None if it is no text."""
    try:
        if source.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            found = source.decode("utf-16")
        else:
            found = source.decode(_coding(source[:4096]))
    except UnicodeDecodeError:
        found = source.decode("latin-1")
    return None if "\0" in found else found


def _coding(beginning: bytes) -> str:
    """The encoding of a text without a byte order mark; in UTF-16 one of the two bytes of most letters is zero."""
    zeros = beginning[0::2].count(0), beginning[1::2].count(0)
    if min(zeros) or max(zeros) * 4 <= len(beginning):
        return "utf-8-sig"
    return "utf-16-be" if zeros[0] else "utf-16-le"


def other_form(source: bytes) -> tuple[str, str]:
    """What a file of another format is, and a hint; empty for text."""
    start = source.removeprefix(codecs.BOM_UTF8).lstrip()
    return next((said for begin, said in OTHERS.items() if start.startswith(begin)), ("", ""))


@frozen
class Cell:
    """A cell's text with its line and column from 1."""

    text: str
    line: int
    column: int


@mutable
class SeparatedText:
    """The separator and the decimal mark of a file.

    mark     separator of cells; " " for any number of blanks
    decimal  decimal mark of the first number that has one; "" before
    """

    mark: str
    decimal: str = ""

    @classmethod
    def of(cls, names: str) -> SeparatedText:
        """Separator found in the line with the column names: a semicolon, a tab or a comma, else blanks."""
        return cls(next((mark for mark in ";\t," if mark in names), " " if len(names.split()) > 1 else ","))

    def cells(self, row: str, line: int) -> list[Cell]:
        """The cells of a row, without surrounding blanks and quotation marks."""
        if self.mark == " ":
            return [Cell(each[0].strip('"'), line, each.start() + 1) for each in WORD.finditer(row)]
        cells, column = [], 1
        for part in row.split(self.mark):
            text, at = part.strip(), column + len(part) - len(part.lstrip())
            quoted = len(text) > 1 and text[0] == text[-1] == '"'
            cells.append(Cell(text[1:-1].strip(), line, at + 1) if quoted else Cell(text, line, at))
            column += len(part) + 1
        return cells

    def plain(self, text: str) -> str:
        """A number with a decimal point. Raises ValueError if its decimal mark differs from that of earlier numbers."""
        found = "," if "," in text and self.mark != "," else "." if "." in text else ""
        if found and self.decimal and found != self.decimal:
            raise ValueError("decimal points and decimal commas in one file")
        self.decimal = self.decimal or found
        return text.replace(found, ".") if found else text
