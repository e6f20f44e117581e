"""Writes large tables as text, many rows at a time, while they are computed."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.cli import console
from ncfix.values import frozen

DIGITS = 9
"""Number of decimals written; smaller digits have no meaning on any machine."""
ROWS = 1 << 13
"""Number of rows written at a time."""


@frozen
class WordColumn:
    """A column of words: index into `names` for each row, (n,)."""

    names: Sequence[str]
    which: NDArray[Any]

    def __len__(self) -> int:
        return len(self.which)


def named(kinds: type[IntEnum], values: NDArray[Any]) -> WordColumn:
    """A column with the names of enumeration values."""
    known = sorted(kinds)
    return WordColumn([kind.name.lower() for kind in known], np.searchsorted(known, values))


Columns = dict[str, NDArray[Any] | WordColumn]
"""Name -> values, all of the same length; nonnegative integers, or floats with NaN for unknown values."""


@frozen
class RowForm:
    """The format of a table's rows.

    begin, between, end  text before the first cell of a row, between cells, and after the last one
    word                 formats a word as a cell
    number               formats a float as a cell
    """

    begin: str
    between: str
    end: str
    word: Callable[[str], str]
    number: Callable[[float], str]

    def rows(self, columns: Columns) -> Iterator[bytes]:
        """The rows as text, several at a time."""
        for start in range(0, len(next(iter(columns.values()))), ROWS):
            part = slice(start, start + ROWS)
            cells = [self._cells(each, part) for each in columns.values()]
            yield "".join(
                [f"{self.begin}{self.between.join(row)}{self.end}" for row in zip(*cells, strict=True)]
            ).encode()

    def _cells(self, column: NDArray[Any] | WordColumn, part: slice) -> list[str]:
        if isinstance(column, WordColumn):
            names = list(map(self.word, column.names))
            return [names[which] for which in column.which[part].tolist()]
        return list(map(str if column.dtype.kind == "i" else self.number, column[part].tolist()))


def _quoted(word: str) -> str:
    return '"' + word.replace('"', '""') + '"' if any(mark in word for mark in ',"\n\r') else word


def _shortest(value: float) -> str:
    """A number without noise in the last digits and without a minus zero."""
    return repr(round(value, DIGITS) + 0.0)


CSV = RowForm("", ",", "\n", _quoted, lambda value: "" if math.isnan(value) else _shortest(value))
JSON = RowForm(
    ",\n  [\n   ",
    ",\n   ",
    "\n  ]",
    lambda word: json.dumps(word).replace("\x7f", "\\u007f"),
    lambda value: _shortest(value) if math.isfinite(value) else "null",
)


def as_csv(tables: Iterable[Columns]) -> Iterator[bytes]:
    """A header and one line per row; unknown values are empty cells. All tables have the same columns."""
    for number, columns in enumerate(tables):
        if number == 0:
            yield (",".join(columns) + "\n").encode()
        yield from CSV.rows(columns)


def as_json(tables: Iterable[Columns], **content: object) -> Iterator[bytes]:
    """A JSON object with `content`, the column names, and the rows."""
    rows = 0
    for number, columns in enumerate(tables):
        if number == 0:
            opening, closing = console.json_text(**content, columns=list(columns), rows=[]).encode().rsplit(b"]", 1)
            yield opening
        for part in JSON.rows(columns):
            yield part if rows else part[1:]
            rows += 1
    yield (b"\n ]" if rows else b"]") + closing
