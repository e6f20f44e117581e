"""Tables as text, made while what they say is found: many rows at once."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.cli import console
from ncfix.text.spelling import MINUS, ZERO, without_zeros
from ncfix.values import frozen

DIGITS = 9
"""Decimals that are kept: what is below has no meaning on any machine."""
ROWS = 1 << 13
"""Rows that are written at a time."""
LONGEST = 24
"""Characters of a number at most: a sign, 17 digits, a point, and an exponent of three digits with its sign."""
CLEAR = 1e15
"""Steps of the last decimal from which on a double has not as many digits, and the shortest text may have fewer."""
SMALL = 100_000
"""Steps below which a number is written with an exponent."""
TIE = 4e-16
"""So close to the middle between two outputs, as a share of the number of steps, a product of doubles may have been
rounded over to the other side: twice its rounding error, and that of the constant, which is a whole number, is none."""


@frozen
class WordColumn:
    """A column of words: which of some names each row has, (n,)."""

    names: Sequence[str]
    which: NDArray[Any]

    def __len__(self) -> int:
        return len(self.which)


def named(kinds: type[IntEnum], values: NDArray[Any]) -> WordColumn:
    """Kinds by their names."""
    known = sorted(kinds)
    return WordColumn([kind.name.lower() for kind in known], np.searchsorted(known, values))


Columns = dict[str, NDArray[Any] | WordColumn]
"""Name -> values, all of one length; whole numbers from 0 on, and others, of which those not known are NaN."""


@frozen
class RowForm:
    """How the rows of a table are written.

    begin, between, end  what stands before the first cell of a row, between two cells, and behind the last
    word                 a word as a cell
    number               a number that digits alone do not say
    """

    begin: bytes
    between: bytes
    end: bytes
    word: Callable[[str], str]
    number: Callable[[float], str]

    def rows(self, columns: Columns) -> Iterator[bytes]:
        """The rows, some at a time."""
        whole = [self._named(each) if isinstance(each, WordColumn) else each for each in columns.values()]
        for start in range(0, len(whole[0]), ROWS):
            yield self._written([column[start : start + ROWS] for column in whole])

    def _named(self, words: WordColumn) -> NDArray[Any]:
        """The cells of a column of words."""
        return np.array([self.word(name).encode() for name in words.names]).take(words.which)

    def _written(self, columns: list[NDArray[Any]]) -> bytes:
        marks = [self.begin, *[self.between] * (len(columns) - 1), self.end]
        begin, *behind = [np.full(len(columns[0]), mark) for mark in marks]
        cells = [[*self._cells(column), mark] for column, mark in zip(columns, behind, strict=True)]
        return without_zeros([begin, *(part for parts in cells for part in parts)])

    def _cells(self, column: NDArray[Any]) -> list[NDArray[Any]]:
        """The cells of a column: bytes that stand side by side, zero where there is nothing."""
        if column.dtype.kind == "S":
            return [column]
        if column.dtype.kind == "i":
            return _digits(column)
        steps, clear = _steps(column)
        cells = _number(column, steps)
        odd = np.flatnonzero(~clear)
        if odd.size:
            texts = np.zeros(len(column), dtype=f"S{LONGEST}")
            texts[odd] = [self.number(value).encode() for value in column[odd].tolist()]
            for part in cells:
                part[odd] = 0
            cells.append(texts)
        return cells


def _steps(values: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """The sizes of numbers in units of the last decimal, (n,), and which are written with their digits alone, (n,)."""
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.abs(values) * 10.0**DIGITS
        nearest = np.rint(steps)
        clear = (steps < CLEAR) & (np.abs(np.abs(steps - nearest) - 0.5) > TIE * steps)
    clear &= (nearest == 0) | (nearest >= SMALL)
    return np.where(clear, nearest, 0.0).astype(np.int64), clear


def _number(values: NDArray[np.float64], steps: NDArray[np.int64]) -> list[NDArray[Any]]:
    """Numbers of so many steps: sign, digits before the point, point, digits behind it up to the last that counts."""
    whole = steps // 10**DIGITS
    rest = (steps - whole * 10**DIGITS).astype(np.uint32)
    sign = ((values < 0) & (steps != 0)) * np.uint8(MINUS)
    first = rest // np.uint32(1_000_000)
    rest -= first * np.uint32(1_000_000)
    second = rest // np.uint32(1000)
    third = rest - second * np.uint32(1000)
    decimals = [POINTED.take(first + (rest > 0) * np.uint32(1000))]
    decimals += [BEHIND.take(second + (third > 0) * np.uint32(1000)), BEHIND.take(third)]
    return [sign, *_digits(whole), *decimals]


def _digits(values: NDArray[np.integer[Any]]) -> list[NDArray[np.uint32]]:
    """Whole numbers from 0 on, four bytes for three digits each."""
    found: list[NDArray[np.uint32]] = []
    while True:
        above = values // 1000
        kind = np.where(above > 0, 1000, 2000 if found else 0)
        found.insert(0, BEFORE.take(values - above * 1000 + kind))
        if not above.any():
            return found
        values = above


def _tables() -> tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.uint32]]:
    """Three digits as text, four bytes as one number.

    before the point    as the first of a number; as others; as the first, where more follow
    behind a point      with the point, up to the last digit that counts; in full, where more follow
    farther behind it   the same without a point
    """
    numbers = np.arange(1000)[:, None]
    full = np.zeros((1000, 4), dtype=np.uint8)
    full[:, 1:] = numbers // (100, 10, 1) % 10 + ZERO
    above = full * (numbers >= (1, 100, 10, 1))
    least = np.where(np.arange(4) == 3, full, above)
    behind = full[:, [1, 2, 3, 0]]
    ended = behind * (numbers % (1000, 100, 10, 1) > 0)
    pointed, short = full.copy(), full * (numbers % (1000, 1000, 100, 10) > 0)
    short[:, 1] = full[:, 1]
    pointed[:, 0] = short[:, 0] = ord(".")
    tables = ((least, full, above), (short, pointed), (ended, behind))
    before, after, farther = (np.concatenate(each).view(np.uint32).ravel() for each in tables)
    return before, after, farther


BEFORE, POINTED, BEHIND = _tables()


def _quoted(word: str) -> str:
    return '"' + word.replace('"', '""') + '"' if any(mark in word for mark in ',"\n\r') else word


def _shortest(value: float) -> str:
    """No noise in the last digits, no minus zero."""
    return repr(round(value, DIGITS) + 0.0)


CSV = RowForm(b"", b",", b"\n", _quoted, lambda value: "" if math.isnan(value) else _shortest(value))


JSON = RowForm(
    b",\n  [\n   ",
    b",\n   ",
    b"\n  ]",
    lambda word: json.dumps(word).replace("\x7f", "\\u007f"),
    lambda value: _shortest(value) if math.isfinite(value) else "null",
)


def as_csv(tables: Iterable[Columns]) -> Iterator[bytes]:
    """A header and one line a row; cells of what is not known are empty. All tables have the same columns."""
    for number, columns in enumerate(tables):
        if number == 0:
            yield (",".join(columns) + "\n").encode()
        yield from CSV.rows(columns)


def as_json(tables: Iterable[Columns], **content: object) -> Iterator[bytes]:
    """A JSON object with `content`, the names of the columns, and the rows."""
    rows = 0
    for number, columns in enumerate(tables):
        if number == 0:
            opening, closing = console.json_text(**content, columns=list(columns), rows=[]).encode().rsplit(b"]", 1)
            yield opening
        for part in JSON.rows(columns):
            yield part if rows else part[1:]
            rows += 1
    yield (b"\n ]" if rows else b"]") + closing
