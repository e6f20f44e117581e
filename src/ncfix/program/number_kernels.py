"""Single numbers as text, compiled: what the kernels that write words are made of (see `writing_kernels`).

The same operations on each number as in `number_text`, so that the bytes are the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.program.number_text import LARGEST, LONGEST, MINUS, MOST_DECIMALS, PLUS, TENS, TIE, ZERO
from ncfix.program.numbers import POINT, POWERS

Bytes = NDArray[np.uint8]

MOST_STEPS = 18
"""Decimals of the finest output step that is written here."""
ROOM = LONGEST + MOST_STEPS + 4
"""Bytes that a word takes at most: its head, a sign, digits before the point and behind it."""


def word_at(data: Bytes, place: np.uint64) -> np.uint64:
    """Eight bytes as one number. A place without a sign is no place from the end: that makes it one load."""
    word = np.uint64(0)
    for k in range(np.uint64(8)):
        word |= np.uint64(data[place + k]) << (np.uint64(8) * k)
    return word


def copied(out: Bytes, at: int, data: Bytes, start: int, stop: int) -> int:
    """Copy some bytes to `at`; where the next one goes. What stands behind it may change: it is yet to be written."""
    to, first, done, count = np.uint64(at), np.uint64(start), np.uint64(0), np.uint64(stop - start)
    most = min(len(data) - start, len(out) - at) - 8
    while done < count and np.int64(done) <= most:
        word, place = word_at(data, first + done), to + done
        for k in range(np.uint64(8)):
            out[place + k] = np.uint8(word >> (np.uint64(8) * k))
        done += np.uint64(8)
    while done < count:
        out[to + done] = data[first + done]
        done += np.uint64(1)
    return at + stop - start


def style_of(text: Bytes, start: int, stop: int, signed: int) -> tuple[int, bool, bool, int, bool]:
    """Decimals, point, plus, digits before the point of the number at a span, and whether it is nothing but that.

    `signed`: a minus sign counts as one, too: what had a sign keeps one.
    """
    head = text[np.uint64(start)]
    first = start + (head in (PLUS, MINUS))
    point = -1
    for place in range(first, stop):
        character = text[np.uint64(place)]
        if character == POINT and point < 0:
            point = place
        elif character < ZERO or character > ZERO + 9:
            return 0, False, False, 0, False
    decimals = stop - point - 1 if point >= 0 else 0
    clear = stop - first <= LONGEST and decimals <= MOST_DECIMALS
    plus = bool(head == PLUS) or (signed != 0 and bool(head == MINUS))
    return decimals, point >= 0, plus, stop - first - decimals - (point >= 0), clear


def steps_of(value: float, decimals: int) -> int:
    """The output steps of a number; -1 where it is too large, or too near to the middle between two outputs."""
    if decimals > MOST_STEPS:
        return -1
    steps = abs(value) * POWERS[decimals]
    if not (steps < LARGEST and abs(steps - np.floor(steps) - 0.5) > TIE * steps):
        return -1
    return int(np.rint(steps))


def put_digits(data: Bytes, at: int, number: np.uint64, count: int) -> int:
    """Write the last digits of a number at `at`; where the next byte goes."""
    first = np.uint64(at)
    place = first + np.uint64(count)
    while place > first:
        place -= np.uint64(1)
        rest = number // np.uint64(10)
        data[place] = np.uint8(np.uint64(ZERO) + number - np.uint64(10) * rest)
        number = rest
    return at + count


def put(data: Bytes, at: int, steps: int, decimals: int, sign: int, least: int, point: bool) -> int:
    """Write a number at `at`; where the next byte goes. `least`: digits before the point, -1 for none if it is zero."""
    number, one = np.uint64(steps), np.uint64(TENS[decimals])
    whole = number // one
    if sign:
        data[np.uint64(at)] = sign
        at += 1
    count = max(least, 0 if whole == np.uint64(0) and least < 0 and decimals > 0 else 1)
    while count < 18 and whole >= np.uint64(TENS[count]):
        count += 1
    at = put_digits(data, at, whole, count)
    if point or decimals > 0:
        data[np.uint64(at)] = POINT
        at += 1
    return put_digits(data, at, number - whole * one, decimals)


def put_in_style(
    data: Bytes, at: int, text: Bytes, start: int, stop: int, value: float, decimals: int, signed: int
) -> tuple[int, float]:
    """Write a value in the style of the number at a span, as `NumberStyle.write`; -1 where that is not clear.

    Returns where the next byte goes, and what a reader makes of the number.
    """
    own, point, plus, whole, clear = style_of(text, start, stop, signed)
    if not clear:
        return -1, 0.0
    most = max(own, decimals)
    steps = steps_of(value, most)
    if steps < 0:
        return -1, 0.0
    read = np.copysign(steps / POWERS[most], value) + 0.0
    while most > own and steps % 10 == 0:
        steps //= 10
        most -= 1
    sign = MINUS if value < 0 and steps != 0 else PLUS if plus else 0
    padded = whole > 1 and text[stop - own - point - whole] == ZERO
    least = whole if padded else -1 if whole == 0 else 1
    return put(data, at, steps, most, sign, least, point), read


def put_all(data: Bytes, at: int, characters: Bytes) -> int:
    """Write all of some bytes that are not 0; where the next byte goes."""
    for character in characters:
        if character:
            data[at] = character
            at += 1
    return at


def put_new(data: Bytes, at: int, head: Bytes, value: float, decimals: int, signed: int) -> tuple[int, float]:
    """Write a missing word: what stands before its number, and the number with all decimals; -1 if not clear."""
    steps = steps_of(value, decimals)
    if steps < 0:
        return -1, 0.0
    at = put_all(data, at, head)
    sign = MINUS if np.signbit(value) else 0
    if signed != 0:
        sign = MINUS if value < 0 and steps != 0 else PLUS
    return put(data, at, steps, decimals, sign, 1, False), np.copysign(steps / POWERS[decimals], value)


HELPERS = (word_at, copied, style_of, steps_of, put_digits, put, put_in_style, put_all, put_new)
"""Functions that kernels are made of."""
