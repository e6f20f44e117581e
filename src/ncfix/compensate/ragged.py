"""Lists of different lengths in flat arrays: members of one list next to each other, `counts` (n,) of them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ncfix.compensate.findings import Array, Index


def offsets(counts: Index) -> Index:
    """Where each list begins, and where the last one ends, (n + 1,)."""
    result = np.zeros(len(counts) + 1, dtype=np.intp)
    np.cumsum(counts, out=result[1:])
    return result


def owners(counts: Index) -> Index:
    """The list that each member belongs to."""
    return np.repeat(np.arange(len(counts)), counts)


def places(counts: Index) -> Index:
    """The place of each member in its list, from 0."""
    return np.arange(int(counts.sum())) - np.repeat(offsets(counts)[:-1], counts)


def largest(values: Array, counts: Index) -> Array:
    """The largest member of each list, 0 for an empty one; (n,). NaN if a member is NaN."""
    result = np.zeros(len(counts))
    full = np.flatnonzero(counts)
    if full.size:
        result[full] = np.maximum.reduceat(values, offsets(counts)[:-1][full])
    return result


def sums(values: Array, counts: Index) -> Array:
    """The sum of each list's members (m, ...) -> (n, ...)."""
    total: Array = np.zeros((len(counts), *values.shape[1:]))
    full = np.flatnonzero(counts)
    if full.size:
        total[full] = np.add.reduceat(values, offsets(counts)[:-1][full], axis=0)
    return total


def batches(sizes: Index, most: int) -> list[NDArray[np.intp]]:
    """The lists in runs of at most about `most` members together, at least one list each."""
    if not len(sizes):
        return []
    ends = np.cumsum(sizes)
    marks = np.searchsorted(ends, np.arange(most, int(ends[-1]) + most, most), side="right")
    cuts = distinct(np.concatenate([[0], np.maximum(marks, 1), [len(sizes)]]))
    return [np.arange(a, b) for a, b in pairwise(cuts.tolist())]


def distinct(places: Index) -> Index:
    """The different whole numbers among some that are not negative, ascending."""
    return np.flatnonzero(np.bincount(places))


def slices(n: int, most: int) -> list[slice]:
    """Rows 0 to n in runs of at most `most`; one empty run if there are none."""
    return [slice(start, min(start + most, n)) for start in range(0, max(n, 1), most)]
