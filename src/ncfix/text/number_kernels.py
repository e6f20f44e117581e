"""Single numbers as text, compiled: what the kernels that write words are made of (see `writing_kernels`).

The same operations on each number as in `number_text`, so that the bytes are the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.text.number_text import LARGEST, LONGEST, MINUS, MOST_DECIMALS, PLUS, TENS, TIE, ZERO
from ncfix.text.numbers import POINT, POWERS

Bytes = NDArray[np.uint8]

MOST_STEPS = 18
"""Decimals of the finest output step that is written here."""
EIGHT_DIGITS = np.uint64(10**8)
"""What numbers of eight digits are less than."""
ZEROS, TOPS, ABOVE_NINE = (np.uint64(each * 0x0101010101010101) for each in (ZERO, 0x80, 0x76))
"""Of each of eight bytes: the digit zero, the highest bit, and what takes all above nine, but no digit, to that bit."""
PLACES = np.uint64(0x0001020304050607)
"""Times a number of eight bytes, of which one is 1 and the others are 0: its highest byte is the place of that one."""
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


def put_word(out: Bytes, at: np.uint64, word: np.uint64) -> None:
    """Write eight bytes: the reverse of `word_at`."""
    for k in range(np.uint64(8)):
        out[at + k] = np.uint8(word >> (np.uint64(8) * k))


def point_in(text: Bytes, first: int, stop: int) -> int:
    """How many digits stand before the point of up to eight characters, all of them if it has none; -1: another text.

    As bytes of one number: no branch depends on how many digits there are, which no processor foresees.
    """
    count = np.uint64(stop - first)
    if stop < 8 or count - np.uint64(1) >= np.uint64(8):
        return -1
    word = (word_at(text, np.uint64(stop - 8)) ^ ZEROS) >> (np.uint64(64) - np.uint64(8) * count)
    odd = ((word & ~TOPS) + ABOVE_NINE | word) & TOPS
    if odd == np.uint64(0):
        return stop - first
    at = ((odd >> np.uint64(7)) * PLACES) >> np.uint64(56)
    alone = odd & (odd - np.uint64(1)) == np.uint64(0)
    found = alone and (word >> (np.uint64(8) * at)) & np.uint64(255) == np.uint64(POINT ^ ZERO)
    return int(np.int64(at)) if found else -1


def style_of(text: Bytes, start: int, stop: int, signed: int) -> tuple[int, bool, bool, int, bool]:
    """Decimals, point, plus, digits before the point of the number at a span, and whether it is nothing but that.

    `signed`: a minus sign counts as one, too: what had a sign keeps one.
    """
    head = text[np.uint64(start)]
    first = start + (head in (PLUS, MINUS))
    plus = bool(head == PLUS) or (signed != 0 and bool(head == MINUS))
    whole = point_in(text, first, stop)
    if whole >= 0:
        pointed = first + whole < stop
        return stop - first - whole - (1 if pointed else 0), pointed, plus, whole, True
    point = -1
    for place in range(first, stop):
        character = text[np.uint64(place)]
        if character == POINT and point < 0:
            point = place
        elif character < ZERO or character > ZERO + 9:
            return 0, False, False, 0, False
    decimals = stop - point - 1 if point >= 0 else 0
    clear = stop - first <= LONGEST and decimals <= MOST_DECIMALS
    return decimals, point >= 0, plus, stop - first - decimals - (point >= 0), clear


def steps_of(value: float, decimals: int) -> int:
    """The output steps of a number; -1 where it is too large, or too near to the middle between two outputs."""
    if decimals > MOST_STEPS:
        return -1
    steps = abs(value) * POWERS[decimals]
    if not (steps < LARGEST and abs(steps - np.floor(steps) - 0.5) > TIE * steps):
        return -1
    return int(np.rint(steps))


def eight_digits(number: np.uint64) -> np.uint64:
    """Eight digits of a number, the first one in the lowest byte: halves, quarters and eighths, all at once."""
    four = number // np.uint64(10_000)
    halves = four | (number - np.uint64(10_000) * four) << np.uint64(32)
    two = (halves * np.uint64(10_486) >> np.uint64(20)) & np.uint64(0x7F0000007F)
    quarters = two | (halves - np.uint64(100) * two) << np.uint64(16)
    one = (quarters * np.uint64(103) >> np.uint64(10)) & np.uint64(0x000F000F000F000F)
    return ZEROS + (one | (quarters - np.uint64(10) * one) << np.uint64(8))


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
    """Write a number at `at`; where the next byte goes. `least`: digits before the point, -1 for none if it is zero.

    What stands up to ten bytes behind it may change: it is yet to be written.
    """
    data[np.uint64(at)] = sign
    at += 1 if sign else 0
    number, one, pointed = np.uint64(steps), np.uint64(TENS[decimals]), point or decimals > 0
    count = max(least, 0 if number < one and least < 0 and decimals > 0 else 1)
    if number < EIGHT_DIGITS and count + decimals <= 8:
        count = max(count, digits_in(number) - decimals)
        return put_short(data, np.uint64(at), number, count, decimals, pointed)
    whole = number // one
    while count < 18 and whole >= np.uint64(TENS[count]):
        count += 1
    at = put_digits(data, at, whole, count)
    if pointed:
        data[np.uint64(at)] = POINT
        at += 1
    return put_digits(data, at, number - whole * one, decimals)


def digits_in(number: np.uint64) -> int:
    """How many digits a number of eight digits at most has; 1 for zero."""
    digits = 1
    for power in range(1, 8):
        digits += 1 if number >= np.uint64(TENS[power]) else 0
    return digits


def put_short(data: Bytes, at: np.uint64, number: np.uint64, whole: int, decimals: int, pointed: bool) -> int:
    """Write a number with so many digits before and behind the point, eight at most; where the next byte goes."""
    before, four = np.uint64(whole), np.uint64(4)
    word = eight_digits(number) >> (np.uint64(64) - np.uint64(8) * (before + np.uint64(decimals)))
    put_word(data, at, word)
    at += before
    if pointed:
        data[at] = POINT
        put_word(data, at + np.uint64(1), (word >> four * before) >> four * before)
    return int(np.int64(at)) + (1 if pointed else 0) + decimals


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


HELPERS = (
    word_at,
    put_word,
    copied,
    point_in,
    style_of,
    steps_of,
    eight_digits,
    put_digits,
    digits_in,
    put_short,
    put,
    put_in_style,
    put_all,
    put_new,
)
"""Functions that kernels are made of."""
