"""Blocks, numbers and shapes of Klartext: lines joined by `~`, decimal points or commas."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from ncfix import fast
from ncfix.text.numbers import fill, find_numbers, is_numeric, table
from ncfix.text.shapes import (
    NUMBER_MARK,
    ODD,
    Scan,
    block_of,
    in_slices,
    odd_blocks,
    scan_compiled,
    shape_keys,
    split_blocks,
)

COMMENT = re.compile(rb";[^\r\n]*")
JOINED = re.compile(rb"~[ \t]*(?=\r*\n)")
"""The mark at the end of a line that the next line continues."""

FIXED = table(b"QqRrMmNn")
"""A number after these belongs to the shape, or may: `Q5`, `R0`, `M3`; the grammar is asked for each such shape."""

WITHIN_NONE = ODD | table(b"\x0b")
"""What no block with a shape holds: line ends, too."""

SMALL = 1 << 14
"""Bytes of text that are not parted any more to find the block in it that has no shape."""

COMMAS = bytes.maketrans(b",\n", b".\x0b")
"""Decimal commas as points, and line ends within a block as blanks: for the scan only, which counts bytes."""


def split(source: bytes) -> NDArray[np.int64]:
    """Start and stop byte of each block, shape (n, 2): lines, with those that `~` continues joined."""
    lines = split_blocks(source)
    marks = np.array([match.start() for match in JOINED.finditer(source)], dtype=np.int64)
    if not len(marks):
        return lines
    continued = np.zeros(len(lines), dtype=np.bool_)
    continued[block_of(lines, marks)] = True
    continued[-1] = False
    starts = np.append(True, ~continued[:-1])
    return np.stack((lines[starts, 0], lines[~continued, 1]), axis=1)


def scan(source: bytes, blocks: NDArray[np.int64]) -> Scan:
    """Find the numbers and the shape of every block. A block of several lines has none: it is taken as it is."""
    if fast.engaged():
        text = np.frombuffer(source.translate(COMMAS), dtype=np.uint8)
        found = scan_compiled(text, blocks, False, b";", FIXED, WITHIN_NONE)
        if found is not None:
            return found
        if len(source) > SMALL and len(blocks) > 1:
            return in_halves(source, blocks)
    return in_slices(source, blocks, scan_plain)


def in_halves(source: bytes, blocks: NDArray[np.int64]) -> Scan:
    """As `scan`, where some block has to be taken as it is: the others need not be."""
    middle = len(blocks) // 2
    at = int(blocks[middle, 0])
    return Scan.joined([(0, scan(source[:at], blocks[:middle])), (at, scan(source[at:], blocks[middle:] - at))])


def scan_plain(source: bytes, blocks: NDArray[np.int64]) -> Scan:
    """As `scan`, with numpy alone."""
    text = np.frombuffer(source.translate(COMMAS), dtype=np.uint8)
    comments = np.array([match.span() for match in COMMENT.finditer(source)], dtype=np.int64).reshape(-1, 2)
    comments = comments[inside(blocks, comments[:, 0])]
    numeric = is_numeric(text)
    fill(numeric, comments, False)
    numbers = find_numbers(text, numeric, FIXED)
    comment = np.full(len(blocks), -1, dtype=np.int64)
    comment[block_of(blocks, comments[:, 0])] = comments[:, 0]
    marks = np.full(len(numbers.spans), NUMBER_MARK, dtype=np.uint8)
    keys = shape_keys(text, blocks, numbers.spans, comments, marks, numbers.covered)
    broken = block_of(blocks, numbers.spans[numbers.broken, 0]).tolist()
    apart = {*broken, *odd_blocks(text, blocks), *of_several_lines(text, blocks)}
    return Scan.of(keys, blocks, comment, numbers, apart)


def inside(blocks: NDArray[np.int64], places: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which places stand inside a block."""
    found: NDArray[np.bool_] = places < blocks[block_of(blocks, places), 1]
    return found


def of_several_lines(text: NDArray[np.uint8], blocks: NDArray[np.int64]) -> list[int]:
    """The blocks with a line end in them."""
    places = np.flatnonzero(text == COMMAS[ord("\n")])
    owner = block_of(blocks, places)
    return list(map(int, owner[places < blocks[owner, 1]]))


# -- block numbers: nothing refers to them, jumps go to labels ---------------------------------------------------------

NUMBERED = re.compile(rb"(?P<skip>[ \t]*/)?[ \t]*(?:\d+(?![\d.,])[ \t]*)?")
"""The block number, block skip before it, and blanks."""


def renumbered(source: bytes) -> bytes:
    """A program with its blocks numbered from 0; the lines that `~` joins are one block, empty lines none."""
    pieces, done, count = [], 0, 0
    for start, stop in split(source).tolist():
        if not source[start:stop].strip():
            continue
        found = NUMBERED.match(source, start, stop)
        assert found is not None, "it matches nothing, too"
        pieces += [source[done:start], found["skip"].strip() if found["skip"] else b"", b"%d " % count]
        done, count = found.end(), count + 1
    return b"".join([*pieces, source[done:]])
