"""Array types by kind of number; fast operations on narrow tables and on lists of different lengths.

numpy is slow per row of a narrow table. The functions here work column by column, as fast as on one long column. Lists
of different lengths are stored flat: the members of each list adjacent, with `counts` (n,) members per list.
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
"""Real numbers: mm, rad, or as stated where used."""
Mask = NDArray[np.bool_]
"""Selection flags."""
Index = NDArray[np.intp]
"""Indices into other arrays, or counts."""
Ints = NDArray[np.int64]
"""Integers: positions in a text, codes, blocks."""
Signs = NDArray[np.int8]
"""Directions: -1, 0 or 1."""
Bytes = NDArray[np.uint8]
"""The bytes of a text."""
Table = TypeVar("Table")
"""A dataclass whose fields are columns of equal length: arrays, or dataclasses of that kind."""


def taken(table: Table, rows: Index | slice) -> Table:
    """The given rows of a table."""
    columns = (getattr(table, each.name) for each in fields(table))  # type: ignore[arg-type]
    return type(table)(*(taken(column, rows) if is_dataclass(column) else column[rows] for column in columns))


def stacked(tables: Sequence[Table]) -> Table:
    """The rows of several tables in sequence; a column that is None in any of them is None."""
    if len(tables) == 1:
        return tables[0]
    names = [each.name for each in fields(tables[0])]  # type: ignore[arg-type]
    return type(tables[0])(*(_stacked([getattr(table, name) for table in tables]) for name in names))


def _stacked(columns: list[Any]) -> Any:
    if any(column is None for column in columns):
        return None
    return stacked(columns) if is_dataclass(columns[0]) else np.concatenate(columns)


def every(mask: Mask) -> Mask:
    """(n,) whether all values of each row of (n, k) are true."""
    if mask.all():
        return np.ones(len(mask), dtype=bool)
    return reduce(np.logical_and, mask.T[1:], mask[:, 0].copy())


def some(mask: Mask) -> Mask:
    """(n,) whether any value of each row of (n, k) is true."""
    if not mask.any():
        return np.zeros(len(mask), dtype=bool)
    return reduce(np.logical_or, mask.T[1:], mask[:, 0].copy())


def finite(values: Array) -> Mask:
    """(n,) whether all numbers of each row of (n, k) are finite."""
    return every(np.isfinite(values))


def picked(table: NDArray[Any], rows: Index) -> NDArray[Any]:
    """Rows (k, m) of a table (n, m): `table[rows]`, ten times faster."""
    return table.take(rows, axis=0)


def spread(values: Array, width: int) -> Array:
    """Each value (n,) repeated in all columns of its row, (n, width)."""
    return np.repeat(values, width).reshape(-1, width)


def chosen(table: NDArray[Any], mask: Mask) -> NDArray[Any]:
    """The rows of a table selected by a mask (n,): `table[mask]`."""
    return table.compress(mask, axis=0)


def put(table: NDArray[Any], rows: Index, values: NDArray[Any]) -> None:
    """Assign values (k, m) to rows (k,) of a table: `table[rows] = values`."""
    for column, new in zip(table.T, values.T, strict=True):
        column[rows] = new


def greatest(table: Array) -> Array:
    """The largest number of each row, (n,), but at least 0; NaN if the row contains NaN."""
    return reduce(np.maximum, table.T, np.zeros(len(table)))


def totals(table: Array) -> Array:
    """The sum of each row, (n,), added from the first column on."""
    return reduce(np.add, table.T)


def farthest(table: Array) -> Array:
    """The largest absolute value of each column, (m,); NaN if the column contains NaN."""
    return np.array([np.abs(column).max() for column in table.T])


def lengths(vectors: Array) -> Array:
    """The lengths (n,) of vectors (n, k)."""
    return np.sqrt(squares(vectors))


def squares(vectors: Array) -> Array:
    """The squared lengths (n,) of vectors (n, k)."""
    return sum((column * column for column in vectors.T), np.zeros(len(vectors)))


def vector_product(first: Array, second: Array) -> Array:
    """Vector products (n, 3): `np.cross`, several times faster for few vectors."""
    (a, b, c), (d, e, f) = first.T, second.T
    product = np.empty(first.shape)
    product[:, 0], product[:, 1], product[:, 2] = b * f - c * e, c * d - a * f, a * e - b * d
    return product


def offsets(counts: Index) -> Index:
    """Index of each list's first member, and of the end of the last list, (n + 1,)."""
    result = np.zeros(len(counts) + 1, dtype=np.intp)
    np.cumsum(counts, out=result[1:])
    return result


def owners(counts: Index) -> Index:
    """The index of each member's list."""
    return np.repeat(np.arange(len(counts)), counts)


def places(counts: Index) -> Index:
    """The index of each member in its list, from 0."""
    return np.arange(int(counts.sum())) - np.repeat(offsets(counts)[:-1], counts)


def ranges(begin: Index, counts: Index) -> Index:
    """For each list, consecutive integers starting at `begin`, `counts` of them."""
    return np.repeat(begin, counts) + places(counts)


def largest(values: Array, counts: Index) -> Array:
    """The largest member of each list, (n,), 0 for an empty one; NaN if a member is NaN."""
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


def in_stretches(lines: Ints) -> tuple[tuple[int, int], ...]:
    """Whole numbers in ascending order, as stretches without gaps, from and to."""
    begins = np.flatnonzero(np.diff(lines, prepend=-1) > 1)
    ends = np.append(begins[1:], len(lines)) - 1
    return tuple(zip(lines[begins].tolist(), lines[ends].tolist(), strict=True))


def stops(flags: Mask) -> Ints:
    """(n + 1,) for each index from 0 to n, the first index from there on whose flag (n,) is not set; n if none is."""
    ends = np.append(np.flatnonzero(~flags), len(flags))
    return np.repeat(ends, np.diff(ends, prepend=-1))


def batches(sizes: Index, most: int) -> list[Index]:
    """Consecutive lists in groups of at most about `most` members, each group with at least one list."""
    if not len(sizes):
        return []
    ends = np.cumsum(sizes)
    marks = np.searchsorted(ends, np.arange(most, int(ends[-1]) + most, most), side="right")
    cuts = distinct(np.concatenate([[0], np.maximum(marks, 1), [len(sizes)]]))
    return [np.arange(a, b) for a, b in pairwise(cuts.tolist())]


def distinct(places: Index) -> Index:
    """The distinct values of nonnegative integers, ascending."""
    return np.flatnonzero(np.bincount(places))


def slices(n: int, most: int) -> list[slice]:
    """Rows 0 to n in slices of at most `most` rows; one empty slice if n is 0."""
    return [slice(start, min(start + most, n)) for start in range(0, max(n, 1), most)]
