"""Lines of the same words, scanned all at once: most lines of long programs say the same but for their numbers.

One line is taken as the example. Lines are alike if they have the same bytes between their numbers, and a sign only
before numbers that may have one. Their numbers are columns then, and each column is converted by itself. What is not
alike is put together and scanned as any text is (`shapes`); what is found is the same either way.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.text.numbers import (
    EXACT_DIGITS,
    POWERS,
    SIGN,
    digits_in,
    in_lanes,
    is_numeric,
    runs_of,
    values_of_one_tail,
)

IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]
Mask = NDArray[np.bool_]

FEWEST = 256
"""Fewer lines are scanned as any text is."""
SHARE = 2
"""One line in so many at least has to be like the example."""

TOGETHER = 1 << 11
"""Lines whose numbers are put in rows at once: they stay in the cache meanwhile."""

LINE = re.compile(rb"(?:[ \t]*(?:[GgMmOo][0-9]+(?:\.[0-9]+)?|[Nn][0-9.]+|[A-FH-LP-Za-fh-lp-z][+-]?[0-9.]+))+[ \t]*")
"""What an example may look like: words with plain numbers."""
NUMBER = re.compile(rb"(?<=[A-FH-LNP-Za-fh-lnp-z])[+-]?[0-9.]+")
RUN = re.compile(rb"[0-9.]+")
UNSIGNED = b"Nn"
"""A sign behind these does not belong to the number."""


@dataclass(frozen=True, slots=True)
class Example:
    """What lines that are alike have in common.

    gaps   what stands before each of their m numbers, without its sign, and behind the last one
    runs   (m,) which of the runs of digits and points on the line each number is; `count` is how many there are
    tails  (m,) how many characters the numbers of the example have from the point on, 0 without one
    """

    gaps: list[bytes]
    runs: list[int]
    count: int
    tails: list[int]

    @classmethod
    def of(cls, line: bytes) -> Example | None:
        """Of a line of words with numbers; None if it is no such line."""
        gaps = NUMBER.split(line) if LINE.fullmatch(line) else []
        if len(gaps) < 2:
            return None
        runs, count = list[int](), -1
        for gap in gaps:
            count += len(RUN.findall(gap)) + 1
            runs.append(count)
        numbers = [number.partition(b".") for number in NUMBER.findall(line)]
        return cls(gaps, runs[:-1], count, [len(point + tail) for _, point, tail in numbers])

    def key(self, mark: bytes, pointless: bytes) -> bytes:
        """What stands on the lines, with a mark for each number; `pointless`: for one without a point."""
        marks = [mark if tail else pointless for tail in self.tails]
        return b"".join(gap + each for gap, each in zip(self.gaps, [*marks, b""], strict=True))


@dataclass(frozen=True, slots=True)
class Column:
    """The numbers that stand at one place of lines that are alike, (k,) each.

    starts  where they start, their sign included; `heads`: not included
    stops   where they stop
    """

    starts: IntArray
    heads: IntArray
    stops: IntArray

    def values(
        self, text: NDArray[np.uint8], lanes: NDArray[np.uint64], tail: int, pointless: bool, fine: Mask
    ) -> FloatArray:
        """What they are; `fine` (k,) becomes False where that is not so plain.

        tail       how many characters most have from the point on
        pointless  they have to be alike in whether they have a point
        """
        values = values_of_one_tail(lanes, self.heads, self.stops, tail)
        if values is None:
            found, lengths = digits_in(lanes, self.heads, self.stops), self.stops - self.heads
            values = found.value.astype(np.float64)
            values /= POWERS.take(found.tail)
            fine &= ~found.several & (lengths > found.pointed) & (lengths <= EXACT_DIGITS)
            if pointless:
                fine &= found.pointed == (tail > 0)
        if self.starts is not self.heads:
            values[np.flatnonzero(text.take(self.starts) == ord("-"))] *= -1
        return values

    def take(self, rows: IntArray) -> Column:
        """Some of them."""
        heads = self.heads.take(rows)
        return Column(heads if self.starts is self.heads else self.starts.take(rows), heads, self.stops.take(rows))


@dataclass(frozen=True, slots=True)
class UniformLines:
    """Lines that are like an example: `rows` (k,) of all lines; the numbers of each of its places, and their values."""

    example: Example
    rows: IntArray
    columns: list[Column]
    values: list[FloatArray]

    def line_by_line(self) -> tuple[IntArray, FloatArray]:
        """The spans (k m, 2) and values (k m,) of all their numbers, as they stand in the text."""
        shape = len(self.rows), len(self.columns)
        spans, values = np.empty((*shape, 2), dtype=np.int64), np.empty(shape)
        for begin in range(0, len(self.rows), TOGETHER):
            part = slice(begin, begin + TOGETHER)
            for k, (column, value) in enumerate(zip(self.columns, self.values, strict=True)):
                values[part, k] = value[part]
                spans[part, k, 0], spans[part, k, 1] = column.starts[part], column.stops[part]
        return spans.reshape(-1, 2), values.ravel()


def find_uniform_lines(source: bytes, blocks: IntArray, *, pointless: bool) -> UniformLines | None:
    """The lines among `blocks` (n, 2) that are like the one in their middle; None if they are too few to matter.

    pointless  numbers without a point make lines different
    """
    if len(blocks) < FEWEST:
        return None
    example = Example.of(source[slice(*blocks[len(blocks) // 2])])
    if example is None:
        return None
    text = np.frombuffer(source, dtype=np.uint8)
    edges = runs_of(is_numeric(text)).ravel()
    first = np.searchsorted(edges, blocks[:, 0])
    rows = np.flatnonzero(np.diff(first, append=len(edges)) == 2 * example.count)
    if len(rows) * SHARE < len(blocks):
        return None
    columns, fine = _columns(example, text, blocks.take(rows, axis=0), edges, first.take(rows))
    lanes = in_lanes(text)
    each = zip(columns, example.tails, strict=True)
    values = [column.values(text, lanes, tail, pointless, fine) for column, tail in each]
    if not fine.all():
        own = np.flatnonzero(fine)
        rows, columns = rows.take(own), [column.take(own) for column in columns]
        values = [column.take(own) for column in values]
    return UniformLines(example, rows, columns, values) if len(rows) * SHARE >= len(blocks) else None


def _columns(
    example: Example, text: NDArray[np.uint8], blocks: IntArray, edges: IntArray, first: IntArray
) -> tuple[list[Column], Mask]:
    """The numbers of lines that have as many runs as the example, and which of the lines (k,) are like it.

    edges  where runs of digits and points start and stop; `first` (k,): the first of each line
    """
    fine, done, columns = np.ones(len(blocks), dtype=np.bool_), blocks[:, 0], list[Column]()
    for gap, run in zip(example.gaps, example.runs, strict=False):
        heads, stops = edges.take(first + 2 * run), edges.take(first + (2 * run + 1))
        starts = heads if gap[-1:] in UNSIGNED else heads - SIGN.take(text.take(heads - 1))
        fine &= _stands(text, gap, done, starts)
        columns.append(Column(starts, heads, stops))
        done = stops
    fine &= _stands(text, example.gaps[-1], done, blocks[:, 1])
    return columns, fine


def _stands(text: NDArray[np.uint8], gap: bytes, starts: IntArray, stops: IntArray) -> Mask:
    """Whether there is just this from starts up to stops."""
    found: Mask = stops - starts == len(gap)
    at = starts.copy()
    for character in gap:
        found &= text.take(at, mode="clip") == character
        at += 1
    return found
