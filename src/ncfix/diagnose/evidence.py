"""Evidence in closed form: how much likelier the data are if an effect is there.

In the coordinates of the background its covariance is diagonal for every share of "a little of everything". A form of
an effect is a group of columns Z with independent numbers of variance s^2, a member; members that are there add
Z Z' s^2 to the covariance, and the scale of the noise is integrated out. A group that is offered beside the members has
log odds -1/2 ln|1 + s^2 B| - n/2 ln(1 - gain) with B = Z'V^-1 Z (MacKay 1992).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logsumexp

from ncfix.diagnose.background import PRIOR, SHARES, Background, marginal
from ncfix.diagnose.groups import Group
from ncfix.measure.measurement import Array, Index

SIZES = (1.5, 3.0, 6.0, 12.0, 24.0)
"""um: sizes of an effect at the tool tip that are considered."""


@dataclass(frozen=True)
class Member:
    """An effect that is taken to be there: a form and its size."""

    group: int
    size: float


@dataclass(frozen=True, repr=False)
class Inner:
    """Inner products with the covariance of the background at one share.

    projected    (p,) of all columns with the data; squares of the data with themselves
    determinant  log determinant of the covariance
    blocks       for each width: numbers of the groups, their columns (g, w), their inner products (g, w, w)
    """

    projected: Array
    squares: float
    determinant: float
    blocks: list[tuple[Index, Index, Array]]


@dataclass(frozen=True)
class Heard:
    """Log odds of every group per size beside some members, (groups, sizes)."""

    odds: Array

    def of(self, groups: Sequence[int]) -> float:
        """Log odds of an effect with these forms, whichever form and size it has."""
        own = self.odds[list(groups)]
        return float(own.max() + np.log(np.exp(own - own.max()).mean()))

    def likeliest(self, groups: Sequence[int], count: int = 1) -> list[Member]:
        """Its likeliest forms, each with its likeliest size."""
        own = self.odds[list(groups)]
        order = np.argsort(-own.max(axis=1))[:count]
        return [Member(groups[int(form)], SIZES[int(own[form].argmax())]) for form in order]


@dataclass(repr=False)
class Court:
    """All groups in the coordinates of the background, and the names that own them.

    groups  those with a name come first, `named` of them; then their rivals without one
    """

    background: Background
    groups: tuple[Group, ...]
    named: int
    columns: Array = field(init=False)
    bounds: Array = field(init=False)
    y: Array = field(init=False)
    forms: dict[str, list[int]] = field(init=False)
    names: tuple[str, ...] = field(init=False)
    rivals: tuple[str, ...] = field(init=False)
    inner: dict[float, Inner] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Carry everything into the coordinates, once."""
        none = np.zeros((len(self.background.view.y), 0))
        columns = np.concatenate([none, *(group.columns for group in self.groups)], axis=1)
        self.columns = self.background.seen(columns)
        self.bounds = np.concatenate([[0], np.cumsum([group.columns.shape[1] for group in self.groups])])
        self.y = self.background.seen(self.background.view.y)
        self.forms = {}
        for index, group in enumerate(self.groups):
            self.forms.setdefault(group.owner.name, []).append(index)
        self.names = tuple(name for name, own in self.forms.items() if own[0] < self.named)
        self.rivals = tuple(name for name, own in self.forms.items() if own[0] >= self.named)

    def constant(self, name: str) -> bool:
        """Whether a name is of a constant that the machine file lacks."""
        return self.groups[self.forms[name][0]].owner.constant

    def part(self, index: int) -> slice:
        """Where a group's columns are."""
        return slice(int(self.bounds[index]), int(self.bounds[index + 1]))

    def heard(self, members: Sequence[Member], beside: Array | None = None) -> Heard:
        """The odds of all groups beside these members, at their likeliest share of the background.

        beside  further columns in the coordinates that are there at unit size
        """
        share, known = self.share(members, beside), self._known(members, beside)
        inner, freedom = self._inner(share), self.background.freedom
        weighed = known / self.background.variance(share)[:, None]
        factor = np.linalg.cholesky(np.eye(known.shape[1]) + known.T @ weighed)
        taken = solve_triangular(factor, weighed.T @ self.columns, lower=True)
        own = solve_triangular(factor, weighed.T @ self.y, lower=True)
        total, count = inner.squares - float(own @ own) + freedom, len(self.y) + freedom
        projected = inner.projected - taken.T @ own
        odds = np.empty((len(self.groups), len(SIZES)))
        for groups, places, blocks in inner.blocks:
            lost = np.moveaxis(taken[:, places], 0, 1)
            odds[groups] = log_odds(blocks - np.swapaxes(lost, 1, 2) @ lost, projected[places], total, count)
        return Heard(odds)

    def likelihood(self, members: Sequence[Member], beside: Array | None = None) -> float:
        """Log likelihood of the data with these members there and no others, whatever the share of the background."""
        return float(logsumexp(self._likelihoods(members, beside)))

    def share(self, members: Sequence[Member], beside: Array | None = None) -> float:
        """The likeliest share of everything in the background beside these members."""
        return SHARES[int(self._likelihoods(members, beside).argmax())]

    def squares(self, members: Sequence[Member], share: float) -> float:
        """The sum of squares of the data in units of their covariance with these members."""
        known, variance = self._known(members, None), self.background.variance(share)
        weighed = known / variance[:, None]
        own = weighed.T @ self.y
        inner = np.eye(known.shape[1]) + known.T @ weighed
        return float((self.y**2 / variance).sum() - own @ np.linalg.solve(inner, own))

    def _likelihoods(self, members: Sequence[Member], beside: Array | None) -> Array:
        """For every share, its probability beforehand counted in, (shares,)."""
        known, freedom, found = self._known(members, beside), self.background.freedom, []
        for share, prior in zip(SHARES, PRIOR, strict=True):
            variance = self.background.variance(share)
            weighed = known / variance[:, None]
            factor = np.linalg.cholesky(np.eye(known.shape[1]) + known.T @ weighed)
            own = solve_triangular(factor, weighed.T @ self.y, lower=True)
            squares = float((self.y**2 / variance).sum() - own @ own)
            determinant = float(np.log(variance).sum() + 2 * np.log(np.diag(factor)).sum())
            found.append(marginal(squares, determinant, len(self.y), freedom) + np.log(prior))
        return np.array(found)

    def _known(self, members: Sequence[Member], beside: Array | None) -> Array:
        """Columns of what is there at unit size, (n, k)."""
        there = [np.zeros((len(self.y), 0)), *(self.columns[:, self.part(m.group)] * m.size for m in members)]
        return np.concatenate(there if beside is None else [*there, beside], axis=1)

    def _inner(self, share: float) -> Inner:
        """The inner products with this share of the background; computed once."""
        if share not in self.inner:
            variance = self.background.variance(share)
            blocks = []
            for alike in self._by_width().values():
                places = np.array([range(self.part(k).start, self.part(k).stop) for k in alike], dtype=np.int64)
                stack = np.stack([self.columns[:, self.part(k)] for k in alike])
                products = np.swapaxes(stack, 1, 2) @ (stack / variance[:, None])
                blocks.append((np.asarray(alike), places.reshape(len(alike), -1), products))
            weighed = self.y / variance
            determinant = float(np.log(variance).sum())
            self.inner[share] = Inner(self.columns.T @ weighed, float(self.y @ weighed), determinant, blocks)
        return self.inner[share]

    def numbers(self, members: Sequence[Member], share: float) -> list[Array]:
        """The most probable numbers behind each member when all are fitted, per um."""
        if not members:
            return []
        known = self._known(members, None)
        weighed = known / self.background.variance(share)[:, None]
        found = np.linalg.solve(known.T @ weighed + np.eye(known.shape[1]), weighed.T @ self.y)
        widths = [self.groups[m.group].columns.shape[1] for m in members]
        parts = np.split(found, np.cumsum(widths)[:-1])
        return [m.size * part for m, part in zip(members, parts, strict=True)]

    def shown(self, members: Sequence[Member], share: float) -> list[Array]:
        """What each member shows when all are fitted, (m,) um."""
        numbers = self.numbers(members, share)
        return [self.groups[m.group].columns @ own for m, own in zip(members, numbers, strict=True)]

    def _by_width(self) -> dict[int, list[int]]:
        widths: dict[int, list[int]] = {}
        for index, width in enumerate(np.diff(self.bounds).tolist()):
            widths.setdefault(width, []).append(index)
        return widths


def log_odds(inner: Array, projected: Array, total: float, count: float) -> Array:
    """Log odds per size, (..., p, p) inner products of columns and (..., p) with the data -> (..., sizes).

    `total` is the sum of squares of the data, `count` its freedom. One Cholesky factor of [[I/s^2 + B, a], [a', total]]
    has the determinant in its diagonal and what the columns gain in its last row.
    """
    width = inner.shape[-1]
    bordered = np.empty((*inner.shape[:-2], width + 1, width + 1))
    bordered[..., :width, :width] = inner
    bordered[..., width, :width] = bordered[..., :width, width] = projected
    bordered[..., width, width] = total
    places = np.arange(width)
    odds = np.empty((*inner.shape[:-2], len(SIZES)))
    for k, size in enumerate(SIZES):
        own = bordered.copy()
        own[..., places, places] += size**-2
        factor = np.linalg.cholesky(own)
        occam = width * np.log(size) + np.log(factor[..., places, places]).sum(axis=-1)
        gain = (factor[..., width, :width] ** 2).sum(axis=-1)
        odds[..., k] = -occam - 0.5 * count * np.log1p(-np.minimum(gain / total, 1 - 1e-12))
    return odds
