"""The scan of a text, compiled: numbers and shapes in one pass each.

They find what `numbers` and `shapes` find, to the last bit; a test holds the two together.
"""

# numba finds out the types.
# mypy: disable-error-code="untyped-decorator"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

POINT, ZERO, MINUS = ord("."), ord("0"), ord("-")
OFFSET, PRIME = np.uint64(14695981039346656037), np.uint64(1099511628211)
"""Of the hash FNV-1a."""

PLAIN, BROKEN, LONG = 0, 1, 2
"""What a number is: converted, no number at all, or one with too many digits to be converted here."""


@njit(inline="always")
def before(text: Bytes, place: int, blank: Mask, blanks: int) -> int:
    """Where the last character before a place is that is no blank: as `numbers.last_before`."""
    at = place - 1
    for _ in range(blanks):
        if at > 0 and blank[text[at]]:
            at -= 1
    return at


@njit(cache=True, nogil=True)
def numbers(
    text: Bytes,
    numeric: Mask,
    hidden: Ints,
    fixed: Mask,
    sign: Mask,
    unsigned_after: Mask,
    blank: Mask,
    blanks: int,
    digits_most: int,
) -> tuple[Ints, NDArray[np.float64], Bytes]:
    """Spans, values and kinds of the numbers of a text: as `numbers.find_numbers`.

    numeric  (256,) bytes that may belong to a number
    hidden   (k, 2) stretches of the text that are not looked at, ascending
    """
    most = len(text) // 2 + 1
    spans, values, kinds = np.empty((most, 2), np.int64), np.empty(most), np.empty(most, np.uint8)
    count, place, next_hidden, size = 0, 0, 0, len(text)
    powers = 10.0 ** np.arange(digits_most + 1)
    while place < size:
        if next_hidden < len(hidden) and place == hidden[next_hidden, 0]:
            place = max(hidden[next_hidden, 1], place)
            next_hidden += 1
            continue
        if not numeric[text[place]]:
            place += 1
            continue
        stop, points, digits, decimals, mantissa = place, 0, 0, 0, np.int64(0)
        limit = hidden[next_hidden, 0] if next_hidden < len(hidden) else size
        while stop < limit and numeric[text[stop]]:
            if text[stop] == POINT:
                points += 1
            else:
                digits += 1
                decimals += points > 0
                if digits <= digits_most:
                    mantissa = mantissa * 10 + (np.int64(text[stop]) - ZERO)
            stop += 1
        at = before(text, place, blank, blanks)
        character = text[at] if at >= 0 else np.uint8(0)
        if not fixed[character]:
            further = before(text, max(at, 0), blank, blanks)
            last = text[further] if further >= 0 else np.uint8(0)
            signed = sign[character] and not unsigned_after[last]
            spans[count, 0], spans[count, 1] = at if signed else place, stop
            negative = signed and character == MINUS
            kinds[count] = BROKEN if points > 1 or digits == 0 else PLAIN if digits <= digits_most else LONG
            value = float(mantissa) / powers[min(decimals, digits_most)]
            values[count] = -value if negative else value
            count += 1
        place = stop
    return spans[:count].copy(), values[:count].copy(), kinds[:count].copy()


@njit(cache=True, nogil=True)
def shapes(
    text: Bytes, blocks: Ints, spans: Ints, marks: Bytes, comments: Ints, comment_mark: int
) -> tuple[Bytes, Ints, NDArray[np.uint64], Ints]:
    """The shapes of blocks one after the other, where each begins, their hashes, and where the numbers of each begin.

    As `shapes.shape_keys`. `marks` stand for the numbers; `comments` (k, 2) are those that end their blocks, ascending.
    """
    n = len(blocks)
    out, starts = np.empty(len(text) + 1, np.uint8), np.empty(n + 1, np.int64)
    hashes, first = np.empty(n, np.uint64), np.empty(n + 1, np.int64)
    size, number, comment = 0, 0, 0
    for block in range(n):
        starts[block], code, place, stop = size, OFFSET, blocks[block, 0], blocks[block, 1]
        while number < len(spans) and spans[number, 0] < place:
            number += 1
        while comment < len(comments) and comments[comment, 0] < place:
            comment += 1
        first[block] = number
        while place < stop:
            character = text[place]
            if number < len(spans) and place == spans[number, 0]:
                character, place = marks[number], spans[number, 1]
                number += 1
            elif comment < len(comments) and place == comments[comment, 0]:
                character, place = np.uint8(comment_mark), comments[comment, 1]
                comment += 1
            else:
                place += 1
            out[size] = character
            size += 1
            code = (code ^ np.uint64(character)) * PRIME
        hashes[block] = code
    starts[n], first[n] = size, len(spans)
    return out[:size].copy(), starts, hashes, first


@njit(cache=True, nogil=True)
def alike(shapes: Bytes, starts: Ints, group: Ints, model: Ints) -> bool:
    """Whether every block has the same shape as the model of its group: no two shapes share a hash."""
    for block in range(len(group)):
        a, b = starts[block], starts[model[group[block]]]
        length = starts[block + 1] - a
        if starts[model[group[block]] + 1] - b != length:
            return False
        for k in range(length):
            if shapes[a + k] != shapes[b + k]:
                return False
    return True
