"""Questions about the rows of narrow tables, column by column: numpy goes through short rows one at a time."""

from __future__ import annotations

from functools import reduce

import numpy as np

from ncfix.compensate.findings import Array, Mask


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


def lengths(vectors: Array) -> Array:
    """The lengths (n,) of vectors (n, k)."""
    size: Array = np.sqrt(sum((column * column for column in vectors.T), np.zeros(len(vectors))))
    return size
