"""A form of an effect as columns of the data, and its log odds in closed form.

For columns Z with independent coefficients of variance s^2, in data of covariance V with unknown scale, the log odds
are -1/2 ln|1 + s^2 B| - n/2 ln(1 - gain), with B = Z'V^-1 Z (MacKay 1992).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import accumulate
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array, Ints
from ncfix.diagnosis.catalogue import Candidate
from ncfix.values import frozen

Real = TypeVar("Real", np.float32, np.float64)
Blocks = list[tuple[Ints, Ints, Array]]
"""For each width w, the g groups of w columns: indices of groups, of columns (g, w), inner products (g, w, w)."""


@frozen(repr=False, slots=False)
class EffectForm:
    """One form of a candidate.

    owner     the candidate
    loading   (k, p) from p independent numbers to its k coefficients, per um
    single    (m, p) effect of those numbers on the values, um; in single precision, since there are thousands
    """

    owner: Candidate
    loading: Array
    single: NDArray[np.float32]

    @classmethod
    def of(cls, owner: Candidate, loading: Array, columns: Array) -> EffectForm:
        """The form with columns (m, p) of double precision."""
        return cls(owner, loading, columns.astype(np.float32))

    @property
    def columns(self) -> Array:
        """(m, p) effect of the independent numbers on the values, um."""
        return self.single.astype(np.float64)

    @property
    def width(self) -> int:
        """Number of independent numbers, p."""
        return int(self.single.shape[1])


def side_by_side(parts: Iterable[NDArray[Real]]) -> NDArray[Real]:
    """Concatenate the columns (m, ...) of several parts; each column is contiguous in memory."""
    return np.concatenate([part.T for part in parts]).T


def column_bounds(groups: Sequence[EffectForm]) -> list[int]:
    """Bounds of the columns of each group after `side_by_side`."""
    return [0, *accumulate(group.width for group in groups)]


def blocks_of(products: Sequence[Array]) -> Blocks:
    """Inner products (w, w) of each group's columns with themselves, stacked by width w."""
    bounds = [0, *accumulate(len(each) for each in products)]
    widths: dict[int, list[int]] = {}
    for group, own in enumerate(products):
        widths.setdefault(len(own), []).append(group)
    return [
        (
            np.asarray(alike),
            np.add.outer([bounds[k] for k in alike], np.arange(w)),
            np.stack([products[k] for k in alike]),
        )
        for w, alike in widths.items()
    ]


def block_odds(
    blocks: Blocks, projected: Array, taken: Array, total: float, count: float, sizes: Sequence[float]
) -> Array:
    """Log odds of every group at every size, (groups, sizes).

    projected  (p,) inner products of all columns with the data
    taken      (k, p): taken' taken is subtracted from the inner products of columns, for the members already there
    total, count  as in `log_odds`
    """
    odds = np.empty((sum(len(groups) for groups, _, _ in blocks), len(sizes)))
    for groups, places, inner in blocks:
        lost = np.moveaxis(taken[:, places], 0, 1)
        odds[groups] = log_odds(inner - np.swapaxes(lost, 1, 2) @ lost, projected[places], total, count, sizes)
    return odds


def log_odds(inner: Array, projected: Array, total: float, count: float, sizes: Sequence[float]) -> Array:
    """Log odds per size, (..., sizes).

    inner  (..., p, p) inner products B of columns; projected (..., p): a, of columns with the data
    total  sum of squares of the data; count: its degrees of freedom
    One Cholesky factor of [[I/s^2 + B, a], [a', total]] holds the determinant in its diagonal and the gain of the
    columns in its last row.
    """
    width, each = inner.shape[-1], np.asarray(sizes)
    bordered = np.zeros((*inner.shape[:-2], len(each), width + 1, width + 1))  # the lower half is all that counts
    bordered[..., :width, :width] = inner[..., None, :, :]
    bordered[..., width, :width] = projected[..., None, :]
    bordered[..., width, width] = total
    places = np.arange(width)
    bordered[..., places, places] += each[:, None] ** -2
    factor = np.linalg.cholesky(bordered)
    occam = width * np.log(each) + np.log(factor[..., places, places]).sum(axis=-1)
    gain = (factor[..., width, :width] ** 2).sum(axis=-1)
    odds: Array = -occam - 0.5 * count * np.log1p(-np.minimum(gain / total, 1 - 1e-12))
    return odds
