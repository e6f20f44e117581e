"""The shapes of a text's blocks in SINUMERIK: where its numbers would be, without understanding it.

A digit inside a name belongs to the name, and so does the number of an extended address (`C1=`): they are part of the
shape. The reader compares with the grammar for every shape, and goes by the grammar where the two differ.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from ncfix.text.numbers import fill, find_numbers, is_numeric, runs_of, table
from ncfix.text.shapes import NUMBER_MARK, Scan, block_of, in_slices, matches, odd_blocks, shape_keys

FIXED = table(b"GgMmRr")
"""A number after these is no value but says which code or parameter it is."""

LETTERS = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$"
LETTER, ADDRESS = table(LETTERS), table(LETTERS[:-2])
DIGITS, BLANKS = b"0123456789", b" \t"
DIGIT = table(DIGITS)
NAMES = table(LETTERS + DIGITS)

PASSIVE = re.compile(rb'"[^"\r\n]*"|(?P<comment>;[^\r\n]*)')
"""Strings and comments: there are no numbers in them."""

PATH = re.compile(rb"(?im)^[ \t]*;[ \t]*\$PATH[ \t]*=")
"""The line of an archive that says where a program belongs: no comment, though it looks like one."""


def scan(source: bytes, blocks: NDArray[np.int64]) -> Scan:
    """Find the numbers and the shape of every block."""
    return in_slices(source, blocks, scan_slice)


def scan_slice(source: bytes, blocks: NDArray[np.int64]) -> Scan:
    """As `scan`, of so much that its columns do not take much room."""
    text = np.frombuffer(source, dtype=np.uint8)
    passive = list(matches(PASSIVE, source, b';"'))
    quiet = np.array([match.span() for match in passive], dtype=np.int64).reshape(-1, 2)
    final = [match.span() for match in passive if match["comment"] is not None]
    comments = np.array(final, dtype=np.int64).reshape(-1, 2)
    numeric = is_numeric(text)
    numeric &= ~in_names(text, source)
    fill(numeric, quiet, False)
    numbers = find_numbers(text, numeric, FIXED)
    comment = np.full(len(blocks), -1, dtype=np.int64)
    comment[block_of(blocks, comments[:, 0])] = comments[:, 0]
    marks = np.full(len(numbers.spans), NUMBER_MARK, dtype=np.uint8)
    keys = shape_keys(text, blocks, numbers.spans, comments, marks, numbers.covered)
    paths = PATH.finditer(source) if b";" in source else ()
    heads = np.array([match.start() for match in paths], dtype=np.int64)
    broken = block_of(blocks, numbers.spans[numbers.broken, 0])
    apart = {*broken.tolist(), *odd_blocks(text, blocks), *block_of(blocks, heads).tolist()}
    return Scan.of(keys, blocks, comment, numbers, apart)


def in_names(text: NDArray[np.uint8], source: bytes) -> NDArray[np.bool_]:
    """(n,) the digits that belong to a name of two letters or more, or to an extended address."""
    words = runs_of(NAMES[text])
    start = words[:, 0]
    second = text[np.minimum(start + 1, len(text) - 1)]
    named = np.zeros(len(text), dtype=np.bool_)
    fill(named, words[LETTER[text[start]] & LETTER[second]], True)
    places = np.flatnonzero(text == ord("="))
    single = extended_by_one(text, places)
    named[places[single] - 1] = True
    for place in places[~single].tolist():
        named[slice(*extension(source, place))] = True
    return named


def extended_by_one(text: NDArray[np.uint8], places: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) the equals signs right behind an address of one letter and one digit, as in ` A3=`."""
    digit, letter, before = (text[np.maximum(places - back, 0)] for back in (1, 2, 3))
    return (places > 2) & DIGIT[digit] & ADDRESS[letter] & ~LETTER[before]


def extension(source: bytes, place: int) -> tuple[int, int]:
    """Where the number of an extended address stands before an equals sign at `place`; nowhere if it is none."""
    stop = place
    while stop and source[stop - 1] in BLANKS:
        stop -= 1
    start = stop
    while start and source[start - 1] in DIGITS:
        start -= 1
    alone = start > 0 and source[start - 1] in LETTERS[:-2] and (start == 1 or source[start - 2] not in LETTERS)
    return (start, stop) if alone else (stop, stop)
