"""Finds and converts the numbers of a text in bulk.

A number is a run of digits and points, with the sign before it. Only the grammar knows what a run means: the reader
compares both for every shape, and follows the grammar where they differ.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array, Bytes, Ints, Mask
from ncfix.values import frozen

EXACT_DIGITS = 15
"""Largest number of digits of which number and power of ten are exact doubles: their quotient is correctly rounded."""

POINT = ord(".")


def table(characters: bytes) -> Mask:
    """Look-up table (256,): which bytes are among `characters`."""
    found = np.zeros(256, dtype=np.bool_)
    found[list(characters)] = True
    return found


NUMERIC = table(b"0123456789.")
SIGN = table(b"+-")
BLANK = table(b" \t")

BLANKS = 3
"""Number of blanks that the scan skips before a number or its sign."""

UNSIGNED_AFTER = table(b"0123456789.]>Nn#")
"""After these characters a sign is not part of the number: it is an operator, or an error."""


@frozen
class Numbers:
    """The numbers of a text, in order.

    spans    (m, 2) start and stop byte, including the sign
    values   (m,) NaN where `broken`
    broken   (m,) has more than one point, has no digit, or is too large for a double
    covered  (n,) bytes that belong to a number
    """

    spans: Ints
    values: Array
    broken: Mask
    covered: Mask


def find_numbers(text: Bytes, numeric: Mask, fixed: Mask) -> Numbers:
    """Find the numbers of `text`.

    numeric  (n,) bytes that may belong to a number
    fixed    (256,) characters after which a run is not a number but part of the shape
    """
    runs, covered = runs_of(numeric), numeric.copy()
    heeded = np.flatnonzero((fixed | SIGN | BLANK).take(text.take(runs[:, 0] - 1)))
    at = last_before(text, runs[heeded, 0])
    named, signed = fixed[at.characters], SIGN[at.characters]
    fill(covered, runs[heeded[named]], False)
    free = np.ones(len(runs), dtype=np.bool_)
    free[heeded[named]] = False
    runs = runs.take(np.flatnonzero(free), axis=0)
    values, broken = convert(text, runs)
    rows, signs = (heeded - np.cumsum(named))[signed], at.places[signed]
    own = np.flatnonzero(~UNSIGNED_AFTER[last_before(text, signs).characters])
    rows, signs = rows[own], signs[own]
    fill(covered, np.stack((signs, runs[rows, 0]), axis=1), True)
    runs[rows, 0] = signs
    values[rows[text[signs] == ord("-")]] *= -1
    return Numbers(runs, values, broken, covered)


def is_numeric(text: Bytes) -> Mask:
    """`NUMERIC[text]`, faster: "." to "9" is a contiguous range of codes that contains only "/" besides."""
    return (text - np.uint8(POINT) < ord("9") - POINT + 1) & (text != ord("/"))


LEADING_BYTES = 64
"""Leading bytes of spans that are filled for all spans at once; the rest of longer spans is filled one by one."""


def fill(cells: NDArray[Any], spans: Ints, value: int) -> None:
    """Set `cells` to `value` over spans (k, 2), most of which are short."""
    starts, stops = spans[:, 0].copy(), spans[:, 1]
    for _ in range(LEADING_BYTES):
        rows = np.flatnonzero(stops > starts)
        if not len(rows):
            return
        if len(rows) < len(starts):
            starts, stops = starts.take(rows), stops.take(rows)
        cells[starts] = value
        starts += 1
    for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
        cells[start:stop] = value


@frozen
class LastBefore:
    """The last nonblank character before each of some places: where it is, and its code (0: start of the text)."""

    places: Ints
    characters: Bytes


def last_before(text: Bytes, places: Ints) -> LastBefore:
    """The characters before `places`, skipping up to `BLANKS` blanks (a blank, if there are more)."""
    at = places - 1
    characters = text[np.maximum(at, 0)]
    for _ in range(BLANKS):
        rows = np.flatnonzero(BLANK[characters] & (at > 0))
        if not len(rows):
            break
        at[rows] -= 1
        characters[rows] = text[at[rows]]
    characters[at < 0] = 0
    return LastBefore(at, characters)


def runs_of(mask: Mask) -> Ints:
    """Start and stop of each run of True, shape (k, 2)."""
    framed = np.zeros(len(mask) + 2, dtype=np.bool_)
    framed[1:-1] = mask
    return np.flatnonzero(framed[1:] != framed[:-1]).reshape(-1, 2)


WORD_BYTES = 8
"""Bytes converted at once, as one integer; the last bytes of a run are its most significant ones."""


def convert(text: Bytes, runs: Ints) -> tuple[Array, Mask]:
    """Values (k,) of runs of digits and points, correctly rounded; and a mask (k,) of those that are malformed."""
    found = digits_of(text, runs[:, 0], runs[:, 1])
    values = found.value.astype(np.float64)
    values /= POWERS.take(found.tail)
    broken = np.zeros(len(runs), dtype=np.bool_)
    lengths = runs[:, 1] - runs[:, 0]
    for row in np.flatnonzero(found.several | (lengths == found.pointed) | (lengths > EXACT_DIGITS)):
        try:
            values[row] = float(text[slice(*runs[row])].tobytes())
        except ValueError:
            values[row] = np.nan
        broken[row] = not np.isfinite(values[row])
    return values, broken


def in_lanes(text: Bytes) -> NDArray[np.uint64]:
    """A text as integers of eight bytes each, with sixteen zero bytes before it and some after it."""
    padded = np.zeros((len(text) // WORD_BYTES + 4) * WORD_BYTES, dtype=np.uint8)
    padded[2 * WORD_BYTES : 2 * WORD_BYTES + len(text)] = text
    return padded.view("<u8")


def digits_of(text: Bytes, starts: Ints, stops: Ints) -> Digits:
    """The digits of runs (of long runs, of their last sixteen bytes). See `Digits.of`."""
    lanes, lengths = in_lanes(text), stops - starts
    found = Digits.of(eight_at(lanes, stops + WORD_BYTES), lengths)
    long = np.flatnonzero(lengths > WORD_BYTES)
    if len(long):
        found.put_before(long, Digits.of(eight_at(lanes, stops[long]), lengths[long] - WORD_BYTES))
    return found


def eight_at(lanes: NDArray[np.uint64], places: Ints) -> NDArray[np.uint64]:
    """The eight bytes from each of `places` on, as one integer; `lanes` as made by `in_lanes`."""
    lane, over = places >> 3, (places & 7).view(np.uint64)
    over <<= np.uint64(3)
    low = lanes.take(lane)
    low >>= over
    lane += 1
    high = lanes.take(lane)
    high <<= np.subtract(np.uint64(8 * WORD_BYTES), over, out=over)  # by 64 leaves nothing
    low |= high
    return low


def repeated(byte: int) -> np.uint64:
    """Eight equal bytes as one integer."""
    return np.uint64(int.from_bytes(bytes([byte]) * WORD_BYTES, "little"))


ONES, TOPS, FOURS, POINTS = (repeated(byte) for byte in (0x01, 0x80, 0x0F, POINT))
OWN = np.array([0, *((1 << 64) - (1 << 64 - 8 * count) for count in range(1, WORD_BYTES + 1))], dtype=np.uint64)
"""Masks of the `count` most significant bytes of eight, by `count`."""
MASKS = {8: 0x00FF00FF00FF00FF, 16: 0x0000FFFF0000FFFF, 32: 0x00000000FFFFFFFF}
"""Masks of every second group of `bits` bits."""
POWERS: Array = (10.0 ** np.arange(23)).astype(np.float64)
"""The powers of ten that are exact doubles."""


@frozen
class Digits:
    """The digits of runs of up to sixteen characters, as columns.

    value    the digits as an integer, multiplied by ten if there is a point
    tail     number of characters from the point to the end, 0 without a point: the value is in units of 10^-tail
    pointed  whether there is a point; `several`: whether there are more
    """

    value: Ints
    tail: Ints
    pointed: Mask
    several: Mask

    @classmethod
    def of(cls, words: NDArray[np.uint64], lengths: Ints) -> Digits:
        """The digits in the last `lengths` bytes of words, which are digits and points; their lowest byte comes first.

        After xor with the code of the point, a point is the only zero byte.
        """
        words &= OWN.take(lengths, mode="clip")
        rest = words ^ POINTS
        points = rest - ONES
        points &= np.invert(rest, out=rest)
        points &= TOPS
        below = points - np.uint64(1)
        tail = points.astype(np.float64).view(np.int64)
        tail >>= 52
        np.subtract(1023 + 8 * WORD_BYTES + 7, tail, out=tail)
        tail >>= 3
        pointed = points != 0
        tail *= pointed
        several = (points & below) != 0
        return cls(whole(words, points, below).view(np.int64), tail, pointed, several)

    def put_before(self, rows: Ints, front: Digits) -> None:
        """Combine with the digits of the eight characters before those of some rows."""
        again = front.pointed & self.pointed[rows]
        first = front.pointed & ~again
        self.value[rows] *= np.where(first, 10, 1)
        self.value[rows] += front.value * 10**WORD_BYTES
        self.tail[rows] += np.where(first, front.tail + WORD_BYTES, 0)
        self.several[rows] |= front.several | again
        self.pointed[rows] |= front.pointed


def whole(words: NDArray[np.uint64], points: NDArray[np.uint64], below: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The digits of words as integers. Digits after the point are moved onto it, with a zero after them.

    points  the top bit of the point's byte, 0 without a point; `below` is `points` - 1. Both are overwritten.
    """
    points += below
    behind = np.invert(points, out=points)
    behind &= words
    behind >>= np.uint64(8)
    before = below.view(np.int64)
    before >>= 7
    value = below
    value &= words
    value |= behind
    value &= FOURS
    return summed(value)


def summed(value: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The integer of eight digits, one per byte; `value` is overwritten.

    Neighbouring digits are combined to pairs, fours and eights (Lemire, "Quickly parsing eight digits", 2018).
    """
    for bits, weight in ((8, 10), (16, 100), (32, 10_000)):
        value *= np.uint64((weight << bits) + 1)
        value >>= np.uint64(bits)
        value &= np.uint64(MASKS[bits])
    return value
