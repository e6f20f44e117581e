"""Words that axes lack which have to stand elsewhere than where the program leaves them, by columns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.program.number_text import ROUNDED

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Mask = NDArray[np.bool_]


def with_those_before(rows: IntArray, n: int) -> IntArray | slice:
    """Rows and those just before them, of n; all, if they are many."""
    if 4 * len(rows) > n:
        return slice(None)
    return np.flatnonzero(np.bincount(np.concatenate((rows, np.maximum(rows - 1, 0)))))


def missing(
    start: FloatArray,
    values: FloatArray,
    present: Mask,
    wanted: FloatArray,
    half: FloatArray,
    clear: Mask,
    stays: Mask,
) -> Mask:
    """Axes without a word that must stand elsewhere by half an output step; marks in `clear` where that is clear.

    start  (n_axes,) program numbers of where the control stands before the stretch
    rows of pieces that have all words may be left out, unless one that lacks a word comes next
    stays  (k, n_axes) axes that get no word; where one must stand elsewhere by more than what rounding does to it, that
           is not clear

    After its last word an axis is left there until it is off by half a step; from then on it is on the digits, and gets
    a word whenever the nearest digits change.
    """
    rows = np.arange(len(values))[:, None]
    last_word = np.maximum.accumulate(np.where(present, rows, -1), axis=0)
    left_at = np.where(last_word >= 0, np.take_along_axis(values, np.maximum(last_word, 0), axis=0), start)
    away = ~(np.abs(wanted - left_at) < half)
    last_away = np.maximum.accumulate(np.where(away & ~present, rows, -1), axis=0)
    held = np.vstack((np.full(len(start), -1), last_away[:-1])) <= last_word
    before = np.where(held, left_at, np.vstack((start, values[:-1])))
    add: Mask = ~present & ~(np.abs(wanted - before) < half)
    clear |= ~present & held & ~away
    if stays.any():
        add &= ~stays
        clear[stays] = (np.abs(wanted - left_at) <= ROUNDED * half)[stays]
    return add
