"""The numbers of a text, found and converted in bulk.

A number here is a run of digits and points, with the sign before it. What a run means is for the grammar to say: the
reader compares the two for every shape, and goes by the grammar where they differ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

EXACT_DIGITS = 15
"""Up to so many digits a number and its power of ten are exact in a double, and so is their rounded quotient."""

POINT = ord(".")


def table(characters: bytes) -> NDArray[np.bool_]:
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


@dataclass(frozen=True, slots=True)
class Numbers:
    """The numbers of a text in order.

    spans    (m, 2) start and stop byte, sign included
    values   (m,) NaN where `broken`
    broken   (m,) more than one point, no digit, or too large for a double
    covered  (n,) the bytes that belong to a number
    """

    spans: NDArray[np.int64]
    values: NDArray[np.float64]
    broken: NDArray[np.bool_]
    covered: NDArray[np.bool_]


def find_numbers(text: NDArray[np.uint8], numeric: NDArray[np.bool_], fixed: NDArray[np.bool_]) -> Numbers:
    """The numbers of `text`.

    numeric  (n,) the bytes that may belong to a number
    fixed    (256,) a run after one of these characters is no number but belongs to the shape
    """
    runs = runs_of(numeric)
    at = last_before(text, runs[:, 0])
    free = ~fixed[at.characters]
    covered = numeric.copy()
    fill(covered, runs[~free], False)
    rows = np.flatnonzero(free)
    runs, at = runs.take(rows, axis=0), Before(at.places[rows], at.characters[rows])
    values, broken = convert(text, runs)
    negative = with_sign(text, runs, at, covered)
    values[negative] *= -1
    return Numbers(runs, values, broken, covered)


def is_numeric(text: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """`NUMERIC[text]`, faster: digits and the point stand together in the alphabet, with a stroke between them."""
    numeric: NDArray[np.bool_] = (text - np.uint8(POINT) < ord("9") - POINT + 1) & (text != ord("/"))
    return numeric


def fill(mask: NDArray[np.bool_], spans: NDArray[np.int64], value: bool) -> None:
    """Set a mask over short stretches of it."""
    starts, lengths, place = spans[:, 0], spans[:, 1] - spans[:, 0], 0
    while len(starts):
        further = lengths > place
        starts, lengths = starts[further], lengths[further]
        mask[starts + place] = value
        place += 1


@dataclass(frozen=True, slots=True)
class Before:
    """The last character before each of some places that is no blank: where it is, and what; 0 at the text's start."""

    places: NDArray[np.int64]
    characters: NDArray[np.uint8]


def last_before(text: NDArray[np.uint8], places: NDArray[np.int64]) -> Before:
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
    return Before(at, characters)


def runs_of(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Start and stop of each run of True, shape (k, 2)."""
    framed = np.zeros(len(mask) + 2, dtype=np.bool_)
    framed[1:-1] = mask
    return np.flatnonzero(framed[1:] != framed[:-1]).reshape(-1, 2)


def with_sign(
    text: NDArray[np.uint8], runs: NDArray[np.int64], at: Before, covered: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Put the sign that stands before a run into it, if it belongs to it, and mark it; the runs that are negative."""
    rows = np.flatnonzero(SIGN[at.characters])
    further = last_before(text, at.places[rows]).characters
    rows = rows[~UNSIGNED_AFTER[further]]
    signs = at.places[rows]
    fill(covered, np.stack((signs, runs[rows, 0]), axis=1), True)
    runs[rows, 0] = signs
    negative: NDArray[np.int64] = rows[text[signs] == ord("-")]
    return negative


EIGHT = 8
"""Bytes that are converted at once, as one whole number; the last ones of a run are its highest."""


def convert(text: NDArray[np.uint8], runs: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The values of runs of digits and points, exactly rounded; and which are malformed."""
    found = digits_of(text, runs)
    digits = runs[:, 1] - runs[:, 0] - found.points
    values = found.value / POWERS[found.decimals]
    broken = np.zeros(len(runs), dtype=np.bool_)
    for row in np.flatnonzero((found.points > 1) | (digits == 0) | (digits > EXACT_DIGITS)):
        try:
            values[row] = float(text[slice(*runs[row])].tobytes())
        except ValueError:
            values[row] = np.nan
        broken[row] = not np.isfinite(values[row])
    return values, broken


def digits_of(text: NDArray[np.uint8], runs: NDArray[np.int64], *, valued: bool = True) -> Digits:
    """What stands in runs of digits and points; of long ones in their last sixteen bytes. Values only if `valued`."""
    stops, lengths = runs[:, 1], runs[:, 1] - runs[:, 0]
    padded = np.concatenate((np.zeros(2 * EIGHT, dtype=np.uint8), text))
    words = np.ndarray(len(text) + EIGHT + 1, dtype="<u8", buffer=padded.data, strides=(1,))
    found = Digits.of(words[stops + EIGHT], np.minimum(lengths, EIGHT), valued)
    long = np.flatnonzero(lengths > EIGHT)
    if len(long):
        front = Digits.of(words[stops[long]], np.minimum(lengths[long] - EIGHT, EIGHT), valued)
        if valued:
            found.value[long] += front.value * 10 ** (EIGHT - found.points[long])
        found.decimals[long] += np.where(front.points > 0, front.decimals + EIGHT, 0)
        found.points[long] += front.points
        found.pure[long] &= front.pure
    return found


def repeated(byte: int) -> np.uint64:
    """Eight bytes alike as one number."""
    return np.uint64(int.from_bytes(bytes([byte]) * EIGHT, "little"))


ONES, TOPS, FOURS, POINTS, ZEROS, ABOVE = (repeated(byte) for byte in (0x01, 0x80, 0x0F, POINT, ord("0"), 0x76))
OWN = np.array([0, *((1 << 64) - (1 << 64 - 8 * count) for count in range(1, EIGHT + 1))], dtype=np.uint64)
"""The highest so many bytes of eight."""
MASKS = {8: 0x00FF00FF00FF00FF, 16: 0x0000FFFF0000FFFF, 32: 0x00000000FFFFFFFF}
"""Every second group of so many bits."""
POWERS = 10.0 ** np.arange(23)
"""Those powers of ten that a double holds exactly."""


@dataclass(frozen=True, slots=True)
class Digits:
    """Up to sixteen characters each: their digits as a whole number, those behind the point, points, nothing else."""

    value: NDArray[np.int64]
    decimals: NDArray[np.int64]
    points: NDArray[np.int64]
    pure: NDArray[np.bool_]

    @classmethod
    def of(cls, words: NDArray[np.uint64], lengths: NDArray[np.int64], valued: bool = True) -> Digits:
        """Of the last `lengths` bytes of words in which the first character is the lowest byte.

        Eight digits are added in pairs, these in pairs, and these in pairs (Lemire, "Quickly parsing eight digits",
        2018). A point shows as the only zero byte when its code is taken from all bytes; the characters before it move
        up by one.
        """
        own = OWN[lengths]
        words = words & own
        rest = words ^ POINTS
        points = (rest - ONES) & ~rest & TOPS
        digits = words ^ ZEROS
        others = (((digits & ~TOPS) + ABOVE) | digits) & TOPS
        pure = others == points | (TOPS & ~own)
        point, pointed = points >> np.uint64(7), points != 0
        value = np.zeros_like(words)
        if valued:
            behind = ~((point << np.uint64(8)) - np.uint64(1))
            words = np.where(pointed, words & behind | (words & (point - np.uint64(1))) << np.uint64(8), words)
            value = words & FOURS
            for bits, weight in ((8, 10), (16, 100), (32, 10_000)):
                value *= np.uint64((weight << bits) + 1)
                value >>= np.uint64(bits)
                value &= np.uint64(MASKS[bits])
        power = point.astype(np.float64).view(np.int64) >> 52
        decimals = np.where(pointed, EIGHT - 1 - (power - 1023 >> 3), 0)
        several = (points & (points - np.uint64(1))) != 0
        return cls(value.view(np.int64), decimals, pointed + several.astype(np.int64), pure)
