"""The scan of a text, compiled: numbers, comments and shapes of its blocks in one pass over the bytes.

It finds what `shapes.scan` finds, to the last bit; a test holds the two together. Also what a text has in common with
the one that it was made from.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.kernel import Library
from ncfix.text.number_kernels import word_at

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Rows = NDArray[np.int32]
Mask = NDArray[np.bool_]
Tables = tuple[Bytes, Mask, Mask, Mask]

LIBRARY = Library(__name__, (word_at,))

POINT, ZERO, MINUS, OPEN, CLOSE, TAIL = (ord(character) for character in ".0-();")
UNTOUCHED, CRAMPED = -1, -2
"""Instead of the number of shapes: there is a block that must be taken as it is, or more than there is room for."""
NONE, BROKEN = -1, -2
FREE, FIXED = 1, 2
"""A number, and one that belongs to the shape."""
LITERAL, NUMERIC, SIGN, COMMENT, ODD = range(5)
"""Kinds of bytes: of the shape as they are, of a number, a sign, the beginning of a comment, or not to be scanned."""
CHARACTER, CHILD, SIBLING, SHAPE = range(4)
"""Columns of the tree of shapes, a row for each beginning of one: its last character, the first of the rows that go on
from it (0: none), the next row that goes on from where this one does, and the number of the shape that ends there (-1:
none does). Row 0 is the beginning of all."""


@LIBRARY.helper
def before(text: Bytes, place: int, blank: Mask, blanks: int) -> int:
    """Where the last character before a place is that is no blank: as `numbers.last_before`."""
    at = place - 1
    least = max(at - blanks, 0)
    while at > least and blank[text[np.uint64(at)]]:
        at -= 1
    return at


@LIBRARY.helper
def run_of(text: Bytes, place: int, stop: int) -> tuple[int, int, int, int, np.uint64]:
    """A run of digits and points: where it ends, its points, digits, decimals, and its digits as a whole number."""
    begin, points, point, mantissa = place, 0, stop, np.uint64(0)
    while place < stop:
        character = text[np.uint64(place)]
        digit = np.uint64(character) - np.uint64(ZERO)
        if digit < np.uint64(10):
            mantissa = np.uint64(10) * mantissa + digit
        elif character == POINT:
            points += 1
            point = min(point, place)
        else:
            break
        place += 1
    decimals = place - point - 1 if points else 0
    return place, points, place - begin - points, decimals, mantissa


@LIBRARY.helper
def takes_sign(text: Bytes, at: int, unsigned_after: Mask, blank: Mask, blanks: int) -> bool:
    """Whether the sign at a place belongs to the number after it."""
    further = before(text, at, blank, blanks)
    return not unsigned_after[text[further] if further >= 0 else np.uint8(0)]


@LIBRARY.helper
def comment_end(text: Bytes, place: int, stop: int, kinds: Bytes) -> int:
    """Where the comment that begins at a place ends; `NONE` if none does, `BROKEN` if there is something odd in it."""
    tail = text[place] == TAIL
    for at in range(place + 1, stop):
        if kinds[text[at]] == ODD:
            return BROKEN
        if not tail and text[at] == CLOSE:
            return at + 1
        if not tail and text[at] == OPEN:
            return NONE
    return stop if tail else NONE


@LIBRARY.helper
def is_last(text: Bytes, place: int, stop: int, blank: Mask) -> bool:
    """Whether nothing but blanks follows in the block."""
    while place < stop and blank[text[place]]:
        place += 1
    return place == stop


@LIBRARY.helper
def number_from(
    text: Bytes, place: int, stop: int, tables: Tables, most: tuple[int, int], powers: Floats
) -> tuple[int, int, int, bool, float]:
    """What the run of digits at a place is: `FREE`, `FIXED` or `BROKEN`; its start, with a sign before it, and end.

    Also whether it has a point, and its value.
    """
    (kinds, fixed, unsigned_after, blank), (blanks, digits_most) = tables, most
    past, points, digits, decimals, mantissa = run_of(text, place, stop)
    at = before(text, place, blank, blanks)
    leader = text[at] if at >= 0 else np.uint8(0)
    if fixed[leader]:
        return FIXED, place, past, points > 0, 0.0
    if points > 1 or digits == 0 or digits > digits_most:
        return BROKEN, place, past, points > 0, 0.0
    value = float(mantissa) / powers[np.uint64(decimals)]
    if kinds[leader] == SIGN and takes_sign(text, at, unsigned_after, blank, blanks):
        return FREE, at, past, points > 0, -value if leader == MINUS else value
    return FREE, place, past, points > 0, value


@LIBRARY.helper
def led(tree: Rows, row: int, character: int, size: int) -> tuple[int, int]:
    """The row of a tree of shapes to which a character leads from another; a new one if none does. And their number."""
    at = int(tree[np.uint64(row), CHILD])
    while at and tree[np.uint64(at), CHARACTER] != character:
        at = int(tree[np.uint64(at), SIBLING])
    if at:
        return at, size
    new = np.uint64(size)
    tree[new, CHARACTER], tree[new, CHILD], tree[new, SHAPE] = character, 0, NONE
    tree[new, SIBLING] = tree[np.uint64(row), CHILD]
    tree[np.uint64(row), CHILD] = size
    return size, size + 1


@LIBRARY.kernel(
    "u1[:]",
    "i8[:,:]",
    ("u1[:]", "b1[:]", "b1[:]", "b1[:]"),
    ("i8", "i8"),
    ("i8", "i8", "i8"),
    "f8[:]",
    ("i8[:]", "i8[:]", "i8[:]"),
    ("i8[:,:]", "f8[:]"),
    ("u1[:]", "i8[:]", "i4[:,:]"),
)
def scan(
    text: Bytes,
    blocks: Ints,
    tables: Tables,
    most: tuple[int, int],
    marks: tuple[int, int, int],
    powers: Floats,
    columns: tuple[Ints, Ints, Ints],
    numbers: tuple[Ints, Floats],
    found: tuple[Bytes, Ints, Rows],
) -> int:
    """Scan the n blocks of a text; how many shapes there are, or `UNTOUCHED`, or `CRAMPED`.

    tables  of the 256 bytes: their kinds, and fixed, unsigned_after, blank (see `numbers` and `shapes`)
    most    see `numbers.BLANKS` and `numbers.EXACT_DIGITS`
    marks   of a number, of one without a point, of the comment that ends a block
    powers  of ten

    Room for results, that of numbers and of the tree for each byte of the text, or for fewer:

    columns  which shape each block has, where its last comment begins (-1: it has none), and (n + 1,) its first number
    numbers  spans and values
    found    the shapes one after the other, where each begins, and their tree, see `CHARACTER`
    """
    (kinds, _, _, blank), (number_mark, pointless_mark, comment_mark) = tables, marks
    (group, comment, first), (spans, values), (shapes, starts, tree) = columns, numbers, found
    count, known, size, starts[0] = 0, 0, 1, 0
    tree[0, CHILD], tree[0, SHAPE] = 0, NONE
    for block in range(len(blocks)):
        first[block], end, place, stop = count, starts[known], blocks[block, 0], blocks[block, 1]
        row, row_at_sign, end_at_sign = 0, 0, end
        if max(count - len(values), size - len(tree)) + stop - place > 0:
            return CRAMPED
        while place < stop:
            character, past = text[np.uint64(place)], place + 1
            kind = kinds[character]
            if kind == NUMERIC:
                form, start, past, pointed, value = number_from(text, place, stop, tables, most, powers)
                kind = ODD if form == BROKEN else kind
                if form == FREE:
                    if start < place:
                        row, end = row_at_sign, end_at_sign
                    at = np.uint64(count)
                    spans[at, 0], spans[at, 1], values[at] = start, past, value
                    count += 1
                    place, character = past - 1, np.uint8(number_mark if pointed else pointless_mark)
            elif kind == COMMENT:
                close = comment_end(text, place, stop, kinds)
                past = max(past, close)
                if close > 0 and is_last(text, close, stop, blank):
                    comment[block], place, character = place, close - 1, np.uint8(comment_mark)
                kind = ODD if close == BROKEN else kind
            elif kind == SIGN:
                row_at_sign, end_at_sign = row, end
            if kind == ODD:
                return UNTOUCHED
            while True:
                row, size = led(tree, row, character, size)
                shapes[np.uint64(end)] = character
                place, end = place + 1, end + 1
                if place >= past:
                    break
                character = text[np.uint64(place)]
        if tree[np.uint64(row), SHAPE] < 0:
            tree[np.uint64(row), SHAPE] = known
            known += 1
            starts[known] = end
        group[block] = tree[np.uint64(row), SHAPE]
    first[len(blocks)] = count
    return known


@LIBRARY.helper
def same(old: Bytes, at: int, new: Bytes, to: int, count: int) -> bool:
    """Whether so many bytes are the same in two texts."""
    a, b, done, whole = np.uint64(at), np.uint64(to), np.uint64(0), np.uint64(count)
    different = np.uint64(0)
    while done + np.uint64(8) <= whole:
        different |= word_at(old, a + done) ^ word_at(new, b + done)
        done += np.uint64(8)
    while done < whole:
        different |= np.uint64(old[a + done] ^ new[b + done])
        done += np.uint64(1)
    return bool(different == np.uint64(0))


@LIBRARY.kernel("u1[:]", "u1[:]", "i8[:]", "i8[:]", "i8[:]")
def left_alone(old: Bytes, new: Bytes, start: Ints, stop: Ints, length: Ints) -> bool:
    """Whether all between some edits, which are as in `Splices`, is the same in the text that they make of the old one.

    The new text is as long as they make it.
    """
    at, to, alike = 0, 0, True
    for edit in range(len(start)):
        count = start[edit] - at
        alike &= same(old, at, new, to, count)
        at, to = stop[edit], to + count + length[edit]
    return alike and same(old, at, new, to, len(old) - at)
