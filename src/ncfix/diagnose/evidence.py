"""Evidence for groups in closed form: the log of the odds that a form of an effect adds to what is there already.

With orthonormal coordinates in which the noise is one, a group Z of eigenvalues d and projections a of the data has
log odds sum(-1/2 ln(1 + s^2 d)) + 1/2 sum(a^2 s^2 / (1 + s^2 d)) for a size s (MacKay 1992); the noise itself is not
known exactly, which makes the second sum a logarithm. Averaged over sizes and forms, and over how much of everything
there is in the background.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import logsumexp

from ncfix.diagnose.background import PRIOR, SHARES, Background, marginal
from ncfix.diagnose.groups import Group
from ncfix.measure.measurement import Array

SIZES = (1.5, 3.0, 6.0, 12.0, 24.0)
"""um: sizes of an effect at the tool tip that are considered."""
TINY = 1e-9


@dataclass(frozen=True)
class Member:
    """An effect that is taken to be there: a form and its size."""

    group: int
    size: float


@dataclass(frozen=True)
class Evidence:
    """For every group: log odds per size, for every share of the background, given the members.

    odds     (groups, shares, sizes)
    null     (shares,) log likelihood, prior included, of the members alone
    """

    odds: Array
    null: Array

    @property
    def base(self) -> float:
        """Log likelihood of the members alone."""
        return float(logsumexp(self.null))

    def of(self, groups: Sequence[int]) -> float:
        """Log odds of an effect with these forms."""
        both = self.odds[list(groups)] + self.null[None, :, None]
        count = both.shape[0] * both.shape[2]
        return float(logsumexp(both) - np.log(count) - self.base)

    def best(self, groups: Sequence[int]) -> Member:
        """Its likeliest form and size."""
        weight = logsumexp(self.odds[list(groups)] + self.null[None, :, None], axis=1)
        form, size = np.unravel_index(int(weight.argmax()), weight.shape)
        return Member(groups[int(form)], SIZES[int(size)])


@dataclass(repr=False)
class Court:
    """All groups in the coordinates of the background, and the names that own them."""

    background: Background
    groups: tuple[Group, ...]
    columns: Array = field(init=False)
    bounds: Array = field(init=False)
    y: Array = field(init=False)
    forms: Mapping[str, list[int]] = field(init=False)

    def __post_init__(self) -> None:
        """Carry everything into the coordinates, once."""
        self.columns = self.background.seen(np.concatenate([group.columns for group in self.groups], axis=1))
        self.bounds = np.concatenate([[0], np.cumsum([group.columns.shape[1] for group in self.groups])])
        self.y = self.background.seen(self.background.view.y)
        forms: dict[str, list[int]] = {}
        for index, group in enumerate(self.groups):
            forms.setdefault(group.owner.name, []).append(index)
        self.forms = forms

    def part(self, index: int) -> slice:
        """Where a group's columns are."""
        return slice(int(self.bounds[index]), int(self.bounds[index + 1]))

    def heard(self, members: Sequence[Member], only: Sequence[int] | None = None) -> Evidence:
        """The evidence for every group beside these members; `only` some of the shares of the background."""
        odds = np.zeros((len(self.groups), len(SHARES), len(SIZES)))
        null = np.full(len(SHARES), -np.inf)
        for index in range(len(SHARES)) if only is None else only:
            odds[:, index], null[index] = self._at(SHARES[index], members)
            null[index] += np.log(PRIOR[index])
        return Evidence(odds, null)

    def _at(self, share: float, members: Sequence[Member]) -> tuple[Array, float]:
        y, columns, determinant = self.whitened(share, members)
        squares, freedom = float(y @ y), self.background.freedom
        null = marginal(squares, determinant, len(y), freedom)
        odds = np.empty((len(self.groups), len(SIZES)))
        projected = columns.T @ y
        for members_of in self._by_width().values():
            stack = np.stack([columns[:, self.part(k)] for k in members_of])
            eigen, vectors = np.linalg.eigh(np.swapaxes(stack, 1, 2) @ stack)
            a = np.einsum("gpk,gp->gk", vectors, np.stack([projected[self.part(k)] for k in members_of]))
            odds[members_of] = log_odds(np.maximum(eigen, 0.0), a**2, squares + freedom, len(y) + freedom)
        return odds, null

    def whitened(self, share: float, members: Sequence[Member]) -> tuple[Array, Array, float]:
        """Data and columns with unit covariance given the members, and the log determinant of that covariance."""
        variance = self.background.variance(share)
        root = 1 / np.sqrt(variance)
        y, columns = self.y * root, self.columns * root[:, None]
        determinant = float(np.log(variance).sum())
        if members:
            known = np.concatenate([columns[:, self.part(m.group)] * m.size for m in members], axis=1)
            squares, turned = np.linalg.eigh(known.T @ known)
            squares, turned = squares[squares > TINY], turned[:, squares > TINY]
            left = known @ (turned / np.sqrt(squares))
            shrink = 1 - 1 / np.sqrt(1 + squares)
            y = y - left @ (shrink * (left.T @ y))
            columns = columns - left @ (shrink[:, None] * (left.T @ columns))
            determinant += float(np.log1p(squares).sum())
        return y, columns, determinant

    def _by_width(self) -> dict[int, list[int]]:
        widths: dict[int, list[int]] = {}
        for index, width in enumerate(np.diff(self.bounds).tolist()):
            widths.setdefault(width, []).append(index)
        return widths


def log_odds(eigen: Array, squares: Array, total: float | Array, count: float) -> Array:
    """Log odds per size, (..., p) -> (..., sizes); `total` sum of squares of the data, `count` its freedom."""
    size = np.asarray(SIZES)[:, None] ** 2
    shrunk = 1 + size * eigen[..., None, :]
    occam = 0.5 * np.log(shrunk).sum(axis=-1)
    gain = (squares[..., None, :] * size / shrunk).sum(axis=-1)
    odds: Array = -occam - 0.5 * count * np.log1p(-np.minimum(gain / np.asarray(total)[..., None], 1 - 1e-12))
    return odds
