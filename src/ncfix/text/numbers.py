"""The numbers of a text, found and converted in bulk.

A number here is a run of digits and points, with the sign before it. What a run means is for the grammar to say: the
reader compares the two for every shape, and goes by the grammar where they differ.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array, Bytes, Ints, Mask
from ncfix.values import frozen

EXACT_DIGITS = 15
"""Up to so many digits a number and its power of ten are exact in a double, and so is their rounded quotient."""

POINT = ord(".")


def table(characters: bytes) -> Mask:
    """A look-up table: which bytes are among `characters`."""
    found = np.zeros(256, dtype=np.bool_)
    found[list(characters)] = True
    return found


NUMERIC = table(b"0123456789.")
SIGN = table(b"+-")
BLANK = table(b" \t")

BLANKS = 3
"""How many blanks the scan looks across, before a number or its sign."""

UNSIGNED_AFTER = table(b"0123456789.]>Nn#")
"""After these a sign does not belong to the number: it is an operator, or wrong."""


@frozen
class Numbers:
    """The numbers of a text in order.

    spans    (m, 2) start and stop byte, sign included
    values   (m,) NaN where `broken`
    broken   (m,) more than one point, no digit, or too large for a double
    covered  (n,) the bytes that belong to a number
    """

    spans: Ints
    values: Array
    broken: Mask
    covered: Mask


def find_numbers(text: Bytes, numeric: Mask, fixed: Mask) -> Numbers:
    """The numbers of `text`.

    numeric  (n,) the bytes that may belong to a number
    fixed    (256,) a run after one of these characters is no number but belongs to the shape
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
    """`NUMERIC[text]`, faster: digits and the point stand together in the alphabet, with a stroke between them."""
    return (text - np.uint8(POINT) < ord("9") - POINT + 1) & (text != ord("/"))


SHORT = 64
"""Stretches up to this long are filled all at once, place by place; the rest of longer ones one by one."""


def fill(cells: NDArray[Any], spans: Ints, value: int) -> None:
    """Set cells over stretches of them, most of which are short."""
    starts, stops = spans[:, 0].copy(), spans[:, 1]
    for _ in range(SHORT):
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
    """The last character before each of some places that is no blank: where it is, and what; 0 at the text's start."""

    places: Ints
    characters: Bytes


def last_before(text: Bytes, places: Ints) -> LastBefore:
    """What stands before `places`, up to `BLANKS` blanks left out (a blank, if there are more)."""
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


EIGHT = 8
"""Bytes that are converted at once, as one whole number; the last ones of a run are its highest."""


def convert(text: Bytes, runs: Ints) -> tuple[Array, Mask]:
    """The values of runs of digits and points, exactly rounded; and which are malformed."""
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
    """A text, sixteen zero bytes before it and some behind it, as numbers of eight bytes each."""
    padded = np.zeros((len(text) // EIGHT + 4) * EIGHT, dtype=np.uint8)
    padded[2 * EIGHT : 2 * EIGHT + len(text)] = text
    return padded.view("<u8")


def digits_of(text: Bytes, starts: Ints, stops: Ints, *, valued: bool = True) -> Digits:
    """What stands in runs of digits and points; of long ones in their last sixteen bytes. See `Digits.of`."""
    lanes, lengths = in_lanes(text), stops - starts
    found = Digits.of(eight_at(lanes, stops + EIGHT), lengths, valued)
    long = np.flatnonzero(lengths > EIGHT)
    if len(long):
        found.put_before(long, Digits.of(eight_at(lanes, stops[long]), lengths[long] - EIGHT, valued))
    return found


def eight_at(lanes: NDArray[np.uint64], places: Ints) -> NDArray[np.uint64]:
    """Eight bytes from each of some places on, as one number; `lanes` has them at every eighth place."""
    lane, over = places >> 3, (places & 7).view(np.uint64)
    over <<= np.uint64(3)
    low = lanes.take(lane)
    low >>= over
    lane += 1
    high = lanes.take(lane)
    high <<= np.subtract(np.uint64(8 * EIGHT), over, out=over)  # by 64 leaves nothing
    low |= high
    return low


def repeated(byte: int) -> np.uint64:
    """Eight bytes alike as one number."""
    return np.uint64(int.from_bytes(bytes([byte]) * EIGHT, "little"))


ONES, TOPS, FOURS, POINTS, ZEROS, ABOVE = (repeated(byte) for byte in (0x01, 0x80, 0x0F, POINT, ord("0"), 0x76))
OWN = np.array([0, *((1 << 64) - (1 << 64 - 8 * count) for count in range(1, EIGHT + 1))], dtype=np.uint64)
"""The highest so many bytes of eight."""
MASKS = {8: 0x00FF00FF00FF00FF, 16: 0x0000FFFF0000FFFF, 32: 0x00000000FFFFFFFF}
"""Every second group of so many bits."""
POWERS: Array = (10.0 ** np.arange(23)).astype(np.float64)
"""Those powers of ten that a double holds exactly."""


@frozen
class Digits:
    """Up to sixteen characters each, columns.

    value    their digits as a whole number, ten times as large where there is a point; 0 if not asked for
    tail     how many characters stand from the point on, 0 without one: the value is in units of 10^-tail
    pointed  there is a point; `several`: there are more
    pure     there is nothing but digits and points; True where the value was asked for
    """

    value: Ints
    tail: Ints
    pointed: Mask
    several: Mask
    pure: Mask

    @classmethod
    def of(cls, words: NDArray[np.uint64], lengths: Ints, valued: bool) -> Digits:
        """Of the last `lengths` bytes of words in which the first character is the lowest byte.

        A point shows as the only zero byte when its code is taken from all bytes. `valued`: the words are known to be
        digits and points, and their value is wanted; else it is looked what they are.
        """
        own = OWN.take(lengths, mode="clip")
        words &= own
        rest = words ^ POINTS
        points = rest - ONES
        points &= np.invert(rest, out=rest)
        points &= TOPS
        below = points - np.uint64(1)
        tail = points.astype(np.float64).view(np.int64)
        tail >>= 52
        np.subtract(1023 + 8 * EIGHT + 7, tail, out=tail)
        tail >>= 3
        pointed = points != 0
        tail *= pointed
        several = (points & below) != 0
        pure = np.ones(len(words), dtype=np.bool_) if valued else others(words, own) == points
        value = whole(words, points, below) if valued else words
        return cls(value.view(np.int64), tail, pointed, several, pure)

    def put_before(self, rows: Ints, front: Digits) -> None:
        """Put eight characters before those of some rows."""
        again = front.pointed & self.pointed[rows]
        first = front.pointed & ~again
        self.value[rows] *= np.where(first, 10, 1)
        self.value[rows] += front.value * 10**EIGHT
        self.tail[rows] += np.where(first, front.tail + EIGHT, 0)
        self.several[rows] |= front.several | again
        self.pointed[rows] |= front.pointed
        self.pure[rows] &= front.pure


def others(words: NDArray[np.uint64], own: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The top bit of each byte of words, among those that are their `own`, that is no digit."""
    digits = words ^ ZEROS
    return (((digits & ~TOPS) + ABOVE) | digits) & TOPS & own


def whole(words: NDArray[np.uint64], points: NDArray[np.uint64], below: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The digits of words as whole numbers, those behind the point moved down onto it, and a zero behind them.

    points  the top bit of the byte that is a point, 0 without one; one less is `below`. Both are lost.
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
    """Eight digits, one a byte, as a whole number. They are lost.

    They are added in pairs, these in pairs, and these in pairs (Lemire, "Quickly parsing eight digits", 2018).
    """
    for bits, weight in ((8, 10), (16, 100), (32, 10_000)):
        value *= np.uint64((weight << bits) + 1)
        value >>= np.uint64(bits)
        value &= np.uint64(MASKS[bits])
    return value
