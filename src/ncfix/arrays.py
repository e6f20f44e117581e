"""The types of arrays, one name for each kind of number; rows of narrow tables, and lists of different lengths.

numpy takes a step of its own for each row of a narrow table. What is done to rows here goes by columns instead: as fast
as for one long column. Lists of different lengths are flat: members of one list next to each other, `counts` (n,) of
them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from functools import reduce
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Numbers: mm, rad, or what is said where it is used."""
Mask = NDArray[np.bool_]
"""Which of some things."""
Index = NDArray[np.intp]
"""Places in other arrays, or how many of something."""
Ints = NDArray[np.int64]
"""Whole numbers: places in a text, codes, blocks."""
Signs = NDArray[np.int8]
"""Directions: -1, 0 or 1."""
Bytes = NDArray[np.uint8]
"""A text."""
Table = TypeVar("Table")
"""A dataclass whose fields are columns of one length: arrays, or such dataclasses again."""


def taken(table: Table, rows: Index | slice) -> Table:
    """Some rows of a table."""
    columns = (getattr(table, each.name) for each in fields(table))  # type: ignore[arg-type]
    return type(table)(*(taken(column, rows) if is_dataclass(column) else column[rows] for column in columns))


def stacked(tables: Sequence[Table]) -> Table:
    """The rows of tables one behind the other; a column that one of them lacks (None) is None."""
    if len(tables) == 1:
        return tables[0]
    names = [each.name for each in fields(tables[0])]  # type: ignore[arg-type]
    return type(tables[0])(*(_stacked([getattr(table, name) for table in tables]) for name in names))


def _stacked(columns: list[Any]) -> Any:
    if any(column is None for column in columns):
        return None
    return stacked(columns) if is_dataclass(columns[0]) else np.concatenate(columns)


def every(mask: Mask) -> Mask:
    """Rows (n,) in which all of (n, k) hold."""
    if mask.all():
        return np.ones(len(mask), dtype=bool)
    return reduce(np.logical_and, mask.T[1:], mask[:, 0].copy())


def some(mask: Mask) -> Mask:
    """Rows (n,) in which any of (n, k) holds."""
    if not mask.any():
        return np.zeros(len(mask), dtype=bool)
    return reduce(np.logical_or, mask.T[1:], mask[:, 0].copy())


def finite(values: Array) -> Mask:
    """Rows (n,) in which all numbers (n, k) are finite."""
    return every(np.isfinite(values))


def picked(table: NDArray[Any], rows: Index) -> NDArray[Any]:
    """Rows (k, m) of a table (n, m): as `table[rows]`, in a tenth of the time."""
    return table.take(rows, axis=0)


def spread(values: Array, width: int) -> Array:
    """One value (n,) for all columns of each row, (n, width)."""
    return np.repeat(values, width).reshape(-1, width)


def chosen(table: NDArray[Any], mask: Mask) -> NDArray[Any]:
    """The rows of a table that a mask (n,) names: as `table[mask]`."""
    return table.compress(mask, axis=0)


def put(table: NDArray[Any], rows: Index, values: NDArray[Any]) -> None:
    """Put values (k, m) into rows (k,) of a table: as `table[rows] = values`."""
    for column, new in zip(table.T, values.T, strict=True):
        column[rows] = new


def greatest(table: Array) -> Array:
    """The largest number of each row, (n,); not below 0, NaN if one is NaN."""
    return reduce(np.maximum, table.T, np.zeros(len(table)))


def totals(table: Array) -> Array:
    """The sum of each row, (n,), from the first column on."""
    return reduce(np.add, table.T)


def farthest(table: Array) -> Array:
    """How far from 0 each column goes, (m,); NaN if that is not known."""
    return np.array([np.abs(column).max() for column in table.T])


def lengths(vectors: Array) -> Array:
    """The lengths (n,) of vectors (n, k)."""
    return np.sqrt(squares(vectors))


def squares(vectors: Array) -> Array:
    """The squares of the lengths (n,) of vectors (n, k)."""
    return sum((column * column for column in vectors.T), np.zeros(len(vectors)))


def vector_product(first: Array, second: Array) -> Array:
    """Vector products (n, 3): as `np.cross`, which takes several times as long over few of them."""
    (a, b, c), (d, e, f) = first.T, second.T
    product = np.empty(first.shape)
    product[:, 0], product[:, 1], product[:, 2] = b * f - c * e, c * d - a * f, a * e - b * d
    return product


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


def ranges(begin: Index, counts: Index) -> Index:
    """Whole numbers from each `begin` on, so many of them."""
    return np.repeat(begin, counts) + places(counts)


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


def batches(sizes: Index, most: int) -> list[Index]:
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
