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

    spans   (m, 2) start and stop byte, sign included
    values  (m,) NaN where `broken`
    broken  (m,) more than one point, no digit, or too large for a double
    """

    spans: NDArray[np.int64]
    values: NDArray[np.float64]
    broken: NDArray[np.bool_]


def find_numbers(text: NDArray[np.uint8], numeric: NDArray[np.bool_], fixed: NDArray[np.bool_]) -> Numbers:
    """The numbers of `text`.

    numeric  (n,) the bytes that may belong to a number
    fixed    (256,) a run after one of these characters is no number but belongs to the shape
    """
    runs = runs_of(numeric)
    at = last_before(text, runs[:, 0])
    free = ~fixed[at.characters]
    runs, at = runs[free], Before(at.places[free], at.characters[free])
    values, broken = convert(text, runs)
    spans, negative = with_sign(text, runs, at)
    return Numbers(spans, np.where(negative, -values, values), broken)


@dataclass(frozen=True, slots=True)
class Before:
    """The last character before each of some places that is no blank: where it is, and what; 0 at the text's start."""

    places: NDArray[np.int64]
    characters: NDArray[np.uint8]


def last_before(text: NDArray[np.uint8], places: NDArray[np.int64]) -> Before:
    """What stands before `places`, up to `BLANKS` blanks left out (a blank, if there are more)."""
    at = places - 1
    for _ in range(BLANKS):
        at -= (at > 0) & BLANK[text[np.maximum(at, 0)]]
    return Before(at, np.where(at >= 0, text[np.maximum(at, 0)], 0).astype(np.uint8))


def runs_of(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Start and stop of each run of True, shape (k, 2)."""
    edges = np.flatnonzero(np.diff(mask.view(np.int8), prepend=0, append=0))
    return edges.reshape(-1, 2)


def with_sign(
    text: NDArray[np.uint8], runs: NDArray[np.int64], at: Before
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """The runs with the sign that stands before them, if it belongs to them; and which are negative."""
    further = last_before(text, np.maximum(at.places, 0)).characters
    signed = SIGN[at.characters] & ~UNSIGNED_AFTER[further]
    spans = runs.copy()
    spans[:, 0] = np.where(signed, at.places, runs[:, 0])
    return spans, signed & (at.characters == ord("-"))


def convert(text: NDArray[np.uint8], runs: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The values of runs of digits and points, exactly rounded; and which are malformed."""
    if not len(runs):
        return np.empty(0), np.empty(0, dtype=np.bool_)
    lengths = runs[:, 1] - runs[:, 0]
    first = np.cumsum(lengths) - lengths
    run = np.repeat(np.arange(len(runs)), lengths)
    place = np.arange(len(run)) - first[run]
    characters = text[runs[run, 0] + place]
    is_point = characters == POINT
    points = np.add.reduceat(is_point, first, dtype=np.int64)
    digits = lengths - points
    point_place = lengths.copy()
    point_place[run[is_point]] = place[is_point]
    decimals = np.maximum(lengths - point_place - 1, 0)
    power = lengths[run] - place - 1 - ((place < point_place[run]) & (points[run] > 0))
    small = digits <= EXACT_DIGITS
    scale = np.where(is_point | ~small[run], 0.0, 10.0 ** np.minimum(power, EXACT_DIGITS))
    mantissa = np.add.reduceat((characters - ord("0")) * scale, first)
    values = mantissa / 10.0 ** np.minimum(decimals, EXACT_DIGITS)
    broken = (points > 1) | (digits == 0)
    values[broken] = np.nan
    for long in np.flatnonzero(~small & ~broken):
        values[long] = float(text[slice(*runs[long])].tobytes())
    return values, broken | np.isinf(values)
