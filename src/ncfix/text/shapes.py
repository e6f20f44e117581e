"""The shapes of a text's blocks: their bytes with each number, and the comment that ends them, replaced by a mark.

Blocks of one shape differ in meaning only by their numbers, so one of them is parsed for all. The scan does not know
the language: it finds possible numbers. Whether they are numbers is checked once per shape.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial, reduce
from itertools import pairwise

import numpy as np

from ncfix import core
from ncfix.arrays import Array, Bytes, Ints, Mask
from ncfix.text.numbers import (
    BLANK,
    BLANKS,
    EXACT_DIGITS,
    NUMERIC,
    OWN,
    POINT,
    POWERS,
    SIGN,
    UNSIGNED_AFTER,
    WORD_BYTES,
    Numbers,
    eight_at,
    fill,
    find_numbers,
    is_numeric,
    table,
)
from ncfix.values import frozen

NUMBER_MARK = 1
COMMENT_MARK = 2
POINTLESS_MARK = 3
"""Mark of a number without a decimal point, in languages where the point changes the meaning."""

ODD = table(bytes([0, NUMBER_MARK, COMMENT_MARK, POINTLESS_MARK]) + b"\r")
"""Bytes that a block with a shape cannot contain: zero, the marks, and a carriage return, which might end a comment."""

FIXED = table(b"GgMmOo")
"""Letters after which a number is part of the shape, because it selects a meaning."""

MAX_RETURNS = 2
"""Largest number of carriage returns before a line feed that belong to the line end."""

COMMENT = re.compile(rb"(?:\([^()\r\n]*\)|;[^\r\n]*)(?P<last>(?=[ \t]*(?:[\r\n]|\Z)))?")
"""A comment; its group `last` matches if only blanks follow on the line."""


@frozen
class Scan:
    """Result of scanning a text with n blocks and m numbers, as columns.

    shapes        keys: blocks with equal keys have equal shapes; None for a block that must be parsed by itself
    group         (n,) index of each block in `shapes`, if most keys are stored only once; None: one key for each block
    comment       (n,) start of the comment that ends the block; -1 without one
    first_number  (n + 1,) the numbers of block i are first_number[i] : first_number[i + 1]
    spans         (m, 2) start and stop byte of each number
    values        (m,) value of each number
    """

    shapes: list[bytes | None]
    comment: Ints
    first_number: Ints
    spans: Ints
    values: Array
    group: Ints | None = None

    @classmethod
    def of(cls, keys: bytes, blocks: Ints, comment: Ints, numbers: Numbers, apart: set[int]) -> Scan:
        """From the keys of all blocks, see `shape_keys`; the blocks `apart` must be parsed by themselves."""
        shapes: list[bytes | None]
        if apart:
            shapes, group = list(keys.split(b"\n")[: len(blocks)]), None
        else:
            shapes, group = distinct(keys)
        for block in apart:
            shapes[block] = None
        starts = np.ascontiguousarray(numbers.spans[:, 0])
        first = np.append(np.searchsorted(starts, blocks[:, 0]), len(starts))
        return cls(shapes, comment, first, numbers.spans, numbers.values, group)

    @classmethod
    def joined(cls, parts: Sequence[tuple[int, Scan]]) -> Scan:
        """The scan of a text from the scans of its slices, each with its first byte in the text."""
        shapes, comment, counts, spans, group = list[bytes | None](), [], [], [], []
        for at, part in parts:
            comment.append(np.where(part.comment < 0, -1, part.comment + at))
            counts.append(np.diff(part.first_number))
            spans.append(part.spans + at)
            group.append(len(shapes) + part.groups)
            shapes += part.shapes
        values = np.concatenate([part.values for _, part in parts])
        first = firsts(np.concatenate(counts))
        return cls(shapes, np.concatenate(comment), first, np.concatenate(spans), values, np.concatenate(group))

    @property
    def groups(self) -> Ints:
        """(n,) index of each block's shape."""
        return np.arange(len(self.comment)) if self.group is None else self.group

    def expanded(self) -> Scan:
        """This scan with one shape for each block."""
        if self.group is None:
            return self
        return replace(self, shapes=[self.shapes[index] for index in self.group.tolist()], group=None)

    def setting_apart(self, blocks: Sequence[int]) -> Scan:
        """This scan with the given blocks marked as to be parsed by themselves."""
        if not len(blocks):
            return self
        found = self.expanded()
        shapes = list(found.shapes)
        for block in blocks:
            shapes[block] = None
        return replace(found, shapes=shapes)


def split_blocks(source: bytes) -> Ints:
    """Start and stop byte of each line, shape (n, 2), without line ends.

    A line ends with LF, CR LF, or CR CR LF (left by some transfers); with a single CR only if the text has no LF. Text
    after the last line end is a line.
    """
    text = np.frombuffer(source, dtype=np.uint8)
    ends = np.flatnonzero(text == ord("\n"))
    if not len(ends):
        ends = np.flatnonzero(text == ord("\r"))
    starts = np.concatenate(([0], ends + 1))
    stops = np.concatenate((ends, [len(text)]))
    if starts[-1] == len(text):
        starts, stops = starts[:-1], stops[:-1]
    for _ in range(MAX_RETURNS if b"\r" in source else 0):
        stops = stops - ((stops > starts) & (text[np.maximum(stops - 1, 0)] == ord("\r")))
    return np.stack((starts, stops), axis=1)


def scan(source: bytes, blocks: Ints, *, pointless: bool = False) -> Scan:
    """Find the numbers and the shape of every block; `pointless`: numbers without a point make another shape."""
    text = np.frombuffer(source, dtype=np.uint8)
    if core.engaged():
        found = scan_compiled(text, blocks, pointless)
        if found is not None:
            return found
    return in_slices(source, blocks, partial(scan_any, pointless=pointless))


SLICE_BYTES = 1 << 19
"""Number of bytes scanned at once in numpy: the columns take about a hundred times as much memory."""

UNTOUCHED, CRAMPED = -1, -2
"""Results of the compiled scan: some block must be parsed by itself, or the arrays are too small."""
SPARE, DENSE, VARIED = 1 << 12, 5, 16
"""Initial sizes of its arrays: a constant part, and one number or one row of a shape for so many bytes."""

PlainScan = Callable[[bytes, Ints], Scan]


def in_slices(source: bytes, blocks: Ints, scan: PlainScan) -> Scan:
    """Apply `scan` to a text slice by slice."""
    begins = set(np.searchsorted(blocks[:, 0], np.arange(0, len(source), SLICE_BYTES)).tolist())
    if len(source) <= SLICE_BYTES or len(begins) == 1:
        return scan(source, blocks)
    parts = list[tuple[int, Scan]]()
    for begin, end in pairwise(sorted(begins | {len(blocks)})):
        start, stop = int(blocks[begin, 0]), int(blocks[end, 0]) if end < len(blocks) else len(source)
        parts.append((start, scan(source[start:stop], blocks[begin:end] - start)))
    return Scan.joined(parts)


def scan_any(source: bytes, blocks: Ints, pointless: bool) -> Scan:
    """Like `scan`, but in numpy and for any text."""
    found = [(*match.span(), match.start("last") >= 0) for match in matches(COMMENT, source, b"(;")]
    comments = np.array(found, dtype=np.int64).reshape(-1, 3)
    final = comments[comments[:, 2] != 0, :2]
    return scan_beside(np.frombuffer(source, dtype=np.uint8), blocks, comments[:, :2], final, pointless=pointless)


def scan_beside(
    text: Bytes,
    blocks: Ints,
    silent: Ints,
    final: Ints,
    *,
    fixed: Mask = FIXED,
    named: Mask | None = None,
    apart: Iterable[int] = (),
    pointless: bool = False,
) -> Scan:
    """The numbers and shapes of a text; the language says where there are no numbers.

    silent     (k, 2) start and stop of text without numbers: comments, strings
    final      (m, 2) start and stop of comments that end their block
    fixed      (256,) bytes after which a number belongs to the shape
    named      (n,) digits that belong to names; None: none do
    apart      blocks that must be parsed by themselves, besides those that cannot have a shape
    pointless  whether numbers without a point make another shape
    """
    numeric = is_numeric(text)
    if named is not None:
        numeric &= ~named
    fill(numeric, silent, False)
    numbers = find_numbers(text, numeric, fixed)
    comment = np.full(len(blocks), -1, dtype=np.int64)
    comment[block_of(blocks, final[:, 0])] = final[:, 0]
    marks = np.full(len(numbers.spans), NUMBER_MARK, dtype=np.uint8)
    if pointless:
        marks[without_point(text, numbers.spans)] = POINTLESS_MARK
    keys = shape_keys(text, blocks, numbers.spans, final, marks, numbers.covered)
    broken = block_of(blocks, numbers.spans[numbers.broken, 0]).tolist()
    return Scan.of(keys, blocks, comment, numbers, {*broken, *odd_blocks(text, blocks), *apart})


def scan_compiled(
    text: Bytes,
    blocks: Ints,
    pointless: bool,
    comments: bytes = b"(;",
    fixed: Mask = FIXED,
    odd: Mask = ODD,
) -> Scan | None:
    """Like `scan`, compiled; None if some block must be parsed by itself.

    comments  characters that begin comments
    fixed     characters after which a number belongs to the shape
    odd       bytes that a block must not contain
    """
    from ncfix.core import scan as loop

    kinds = np.zeros(256, dtype=np.uint8)
    starting = np.zeros(256, dtype=np.bool_)
    starting[list(comments)] = True
    for kind, members in enumerate((NUMERIC, SIGN, starting, odd), start=1):
        kinds[members] = kind
    held, unsigned, blank = (each.view(np.uint8) for each in (fixed, UNSIGNED_AFTER, BLANK))
    scanner = loop.Scanner(kinds, held, unsigned, blank, BLANKS, EXACT_DIGITS, POWERS)
    n = len(blocks)
    group, comment, first = np.empty(n, np.int64), np.full(n, -1, np.int64), np.empty(n + 1, np.int64)
    shapes, starts = np.empty(len(text) + 1, np.uint8), np.empty(n + 1, np.int64)
    for most, rows in ((SPARE + len(text) // DENSE, SPARE + len(text) // VARIED), (len(text), len(text) + 1)):
        spans, values = np.empty((most, 2), np.int64), np.empty(most)
        known = scanner.scan(
            text,
            np.ascontiguousarray(blocks),
            NUMBER_MARK,
            POINTLESS_MARK if pointless else NUMBER_MARK,
            COMMENT_MARK,
            group,
            comment,
            first,
            spans,
            values,
            shapes,
            starts,
            np.empty(n + 1, np.int64),
            np.empty((rows, 4), np.int32),
        )
        if known != CRAMPED:
            break
    if known == UNTOUCHED:
        return None
    edges, count = starts[: known + 1].tolist(), int(first[n])
    keys: list[bytes | None] = [shapes[slice(*each)].tobytes() for each in pairwise(edges)]
    return Scan(keys, comment, first, spans[:count], values[:count], group)


def odd_blocks(text: Bytes, blocks: Ints) -> list[int]:
    """The blocks that hold an `ODD` byte."""
    suspicious = np.flatnonzero((text <= ord("\r")) & (text != ord("\n")))
    places = suspicious[ODD[text[suspicious]]]
    return blocks_at(blocks, places)


def blocks_at(blocks: Ints, places: Ints) -> list[int]:
    """The blocks in which places (k,) lie; places in line ends are dropped."""
    owner = block_of(blocks, places)
    return owner[places < blocks[owner, 1]].tolist()


def firsts(counts: Ints) -> Ints:
    """Index of the first number of each block, and the total, (n + 1,), from the counts of each block (n,)."""
    return np.concatenate(([0], np.cumsum(counts)))


def block_of(blocks: Ints, places: Ints) -> Ints:
    """The block of each byte position; a line end belongs to the block before it."""
    return np.searchsorted(blocks[:, 0], places, side="right") - 1


def matches(pattern: re.Pattern[bytes], source: bytes, heads: bytes) -> Iterator[re.Match[bytes]]:
    """Like `pattern.finditer`, but faster, for a pattern whose matches all begin with one of the bytes `heads`."""
    text = np.frombuffer(source, dtype=np.uint8)
    begins = reduce(np.logical_or, [text == head for head in heads if head in source] or [np.empty(0, np.bool_)])
    done = 0
    for place in np.flatnonzero(begins).tolist():
        found = pattern.match(source, place) if place >= done else None
        if found:
            done = found.end()
            yield found


def shape_keys(
    text: Bytes,
    blocks: Ints,
    numbers: Ints,
    comments: Ints,
    marks: Bytes,
    covered: Mask,
) -> bytes:
    """The keys of all blocks, each with a line feed: the block with a mark for each number and its final comment.

    covered  (n,) bytes that belong to numbers
    """
    marked = np.empty(len(text) + 1, dtype=np.uint8)
    np.bitwise_and(text, covered.view(np.uint8) - np.uint8(1), out=marked[:-1])  # zero is what goes
    fill(marked, comments, 0)
    for places, mark in ((numbers[:, 0], marks), (comments[:, 0], COMMENT_MARK), (blocks[:, 1], ord("\n"))):
        marked[places] = mark
    fill(marked, np.stack((np.append(0, blocks[:, 1] + 1), np.append(blocks[:, 0], len(text) + 1)), axis=1), 0)
    return marked.tobytes().translate(None, b"\0")


MAX_KEY_BYTES = 8 * WORD_BYTES
"""Largest length of keys that are compared with others."""
KINDS = 16
"""Number of different keys that are searched for among all others; further ones are assumed to be rare."""


def distinct(keys: bytes) -> tuple[list[bytes | None], Ints]:
    """The different keys among `keys` (rare ones may be repeated), and for each key its index among them.

    In `keys` each is followed by a line feed. They are compared eight characters at a time, from the end.
    """
    padded = np.zeros((len(keys) + MAX_KEY_BYTES) // WORD_BYTES * WORD_BYTES + 2 * WORD_BYTES, dtype=np.uint8)
    padded[MAX_KEY_BYTES : MAX_KEY_BYTES + len(keys)] = np.frombuffer(keys, dtype=np.uint8)
    stops = np.flatnonzero(padded == ord("\n")) - MAX_KEY_BYTES
    starts = np.append(0, stops[:-1] + 1)
    lengths, lanes = stops - starts, padded.view("<u8")
    compared = range(0, min(int(lengths.max(initial=0)), MAX_KEY_BYTES), WORD_BYTES)
    words = [
        eight_at(lanes, stops + MAX_KEY_BYTES - WORD_BYTES - k) & OWN.take(lengths - k, mode="clip") for k in compared
    ]
    group, rows = np.full(len(stops), -1, dtype=np.int64), list[int]()
    left = np.flatnonzero(lengths <= MAX_KEY_BYTES)
    while len(left) and len(rows) < KINDS:
        same = reduce(np.logical_and, (word.take(left) == word[left[0]] for word in words), np.ones(len(left), bool))
        group[left.compress(same)] = len(rows)
        rows.append(int(left[0]))
        left = left.compress(~same)
    alone = np.flatnonzero(group < 0)
    group[alone] = np.arange(len(rows), len(rows) + len(alone))
    rows += alone.tolist()
    return [keys[slice(*edges)] for edges in zip(starts[rows].tolist(), stops[rows].tolist(), strict=True)], group


def without_point(text: Bytes, numbers: Ints) -> Mask:
    """(m,) whether each number has no decimal point."""
    points = np.concatenate(([0], np.cumsum(text == POINT)))
    return np.asarray(points[numbers[:, 1]] == points[numbers[:, 0]])
