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
OPERAND_ENDS = table(b"0123456789.]>")
"""After these a sign is an operator."""


@dataclass(frozen=True, slots=True)
class Numbers:
    """The numbers of a text in order.

    spans   (m, 2) start and stop byte, sign included
    values  (m,) NaN where `broken`
    broken  (m,) more than one point, or no digit
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
    before = text[np.maximum(runs[:, 0] - 1, 0)]
    before[runs[:, 0] == 0] = 0
    free = ~fixed[before]
    runs, before = runs[free], before[free]
    values, broken = convert(text, runs)
    spans, negative = with_sign(text, runs, before)
    return Numbers(spans, np.where(negative, -values, values), broken)


def runs_of(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Start and stop of each run of True, shape (k, 2)."""
    edges = np.flatnonzero(np.diff(mask.view(np.int8), prepend=0, append=0))
    return edges.reshape(-1, 2)


def with_sign(
    text: NDArray[np.uint8], runs: NDArray[np.int64], before: NDArray[np.uint8]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """The runs with the sign before them, if it is not an operator; and which are negative."""
    further = np.where(runs[:, 0] > 1, text[np.maximum(runs[:, 0] - 2, 0)], 0)
    signed = SIGN[before] & ~OPERAND_ENDS[further]
    spans = runs.copy()
    spans[:, 0] -= signed
    return spans, signed & (before == ord("-"))


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
    return values, broken
