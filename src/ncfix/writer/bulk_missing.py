"""Words that axes lack which have to stand elsewhere than where the program leaves them, by columns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.text.number_text import ROUNDED

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Mask = NDArray[np.bool_]


def with_those_before(rows: IntArray, n: int) -> IntArray | slice:
    """Rows and those just before them, of n; all, if they are many."""
    if 4 * len(rows) > n:
        return slice(None)
    return np.flatnonzero(np.bincount(np.concatenate((rows, np.maximum(rows - 1, 0)))))


def last_told(values: FloatArray, told: Mask, start: float) -> FloatArray:
    """What was told last in each row (k,), `start` before the first time."""
    last = np.maximum.accumulate(np.where(told, np.arange(len(told)), -1))
    found: FloatArray = np.where(last >= 0, values[last], start)
    return found


def missing(
    start: float, values: FloatArray, present: Mask, wanted: FloatArray, clear: Mask, stays: Mask, half: float
) -> tuple[Mask, Mask]:
    """Where an axis without a word must stand elsewhere by half an output step, (k,), and what is `clear` then.

    start   program number of where the control stands before the stretch
    values  program numbers of where it stands behind each piece, if that tells it to go there
    rows of pieces that have a word may be left out, unless one that lacks it comes next
    stays  it gets no word; where it must stand elsewhere by more than what rounding does to it, that is not clear

    After its last word an axis is left there until it is off by half a step; from then on it is on the digits, and gets
    a word whenever the nearest digits change.
    """
    rows = np.arange(len(values))
    last_word = np.maximum.accumulate(np.where(present, rows, -1))
    left_at = last_told(values, present, start)
    away = ~(np.abs(wanted - left_at) < half)
    last_away = np.maximum.accumulate(np.where(away & ~present, rows, -1))
    held = np.append(-1, last_away[:-1]) <= last_word
    before = np.where(held, left_at, np.append(start, values[:-1]))
    add = ~present & ~(np.abs(wanted - before) < half) & ~stays
    clear = clear | (~present & held & ~away)
    clear[stays] = (np.abs(wanted - left_at) <= ROUNDED * half)[stays]
    return add, clear
