"""The second reading of a text, compiled: one pass over both texts, the numbers and the edits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.kernel import Library
from ncfix.program.kernels import MINUS, POINT, before, run_of, takes_sign
from ncfix.program.number_kernels import word_at

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

LIBRARY = Library(__file__, (before, run_of, takes_sign, word_at))


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


@LIBRARY.helper
def has_point(text: Bytes, begin: int, end: int) -> bool:
    """Whether there is a decimal point in a span."""
    while begin < end and text[np.uint64(begin)] != POINT:
        begin += 1
    return begin < end


@LIBRARY.helper
def number_at(
    new: Bytes, begin: int, end: int, tables: tuple[Mask, Mask, Mask], most: tuple[int, int], powers: Floats
) -> tuple[bool, float]:
    """Whether a number with one point fills a span, and its value."""
    (sign, unsigned_after, blank), (blanks, digits_most) = tables, most
    signed = begin < end and sign[new[begin]]
    if signed and not takes_sign(new, begin, unsigned_after, blank, blanks):
        return False, 0.0
    past, points, digits, decimals, mantissa = run_of(new, begin + signed, end)
    if past != end or points != 1 or digits == 0 or digits > digits_most:
        return False, 0.0
    value = float(mantissa) / powers[decimals]
    return True, -value if signed and new[begin] == MINUS else value


@LIBRARY.kernel(
    "u1[:]",
    "u1[:]",
    "i8[:,:]",
    ("i8[:]", "i8[:]", "i8[:]"),
    ("b1[:]", "b1[:]", "b1[:]"),
    ("i8", "i8"),
    "f8[:]",
    ("f8[:]", "i8[:,:]", "b1[:]"),
)
def looked_at(
    old: Bytes,
    new: Bytes,
    spans: Ints,
    edits: tuple[Ints, Ints, Ints],
    tables: tuple[Mask, Mask, Mask],
    most: tuple[int, int],
    powers: Floats,
    found: tuple[Floats, Ints, Mask],
) -> int:
    """Compare all between the edits, and read the new numbers; 0 if anything differs, else 1.

    spans   (m, 2) of the numbers of the old text
    edits   start, stop and length (k,), as in `Splices`
    tables  SIGN, UNSIGNED_AFTER and BLANK of `numbers`
    most    see `numbers.BLANKS` and `numbers.EXACT_DIGITS`
    found   values (m,) of the old text, where those of new numbers are put, room for spans in the new text, and (k,)
            all False: marked where an edit is more than one number for another
    """
    (start, stop, length), (values, moved, odd) = edits, found
    at, to, number = 0, 0, 0
    for edit in range(len(start)):
        begin, end = start[edit], stop[edit]
        if not same(old, at, new, to, begin - at):
            return 0
        while number < len(spans) and spans[number, 0] < begin:
            moved[number, 0], moved[number, 1] = spans[number, 0] + to - at, spans[number, 1] + to - at
            number += 1
        to += begin - at
        at, past = end, to + length[edit]
        odd[edit] = True
        if number < len(spans) and spans[number, 0] == begin and spans[number, 1] == end:
            fine, value = number_at(new, to, past, tables, most, powers)
            if fine and has_point(old, begin, end):
                odd[edit], values[number] = False, value
                moved[number, 0], moved[number, 1] = to, past
                number += 1
        to = past
    if not same(old, at, new, to, len(old) - at):
        return 0
    while number < len(spans):
        moved[number, 0], moved[number, 1] = spans[number, 0] + to - at, spans[number, 1] + to - at
        number += 1
    return 1
