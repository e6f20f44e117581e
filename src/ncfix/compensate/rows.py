"""What concerns the rows of narrow tables, done in a way that does not take numpy a step for each short row."""

from __future__ import annotations

from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.compensate.findings import Array, Index, Mask


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


def extent(table: Array) -> tuple[Array, Array]:
    """The smallest and the largest number of each column, (m,) each; NaN if one is NaN."""
    return np.array([column.min() for column in table.T]), np.array([column.max() for column in table.T])


def lengths(vectors: Array) -> Array:
    """The lengths (n,) of vectors (n, k)."""
    size: Array = np.sqrt(squares(vectors))
    return size


def squares(vectors: Array) -> Array:
    """The squares of the lengths (n,) of vectors (n, k)."""
    return sum((column * column for column in vectors.T), np.zeros(len(vectors)))


def vector_product(first: Array, second: Array) -> Array:
    """Vector products (n, 3): as `np.cross`, which takes several times as long over few of them."""
    (a, b, c), (d, e, f) = first.T, second.T
    product = np.empty(first.shape)
    product[:, 0], product[:, 1], product[:, 2] = b * f - c * e, c * d - a * f, a * e - b * d
    return product
