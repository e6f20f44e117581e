"""Evidence in closed form: how much likelier the data are if an effect is there.

In the coordinates of the background its covariance is diagonal for every share of "a little of everything". A form of
an effect is a group of columns Z with independent numbers of variance s^2, a member; members that are there add
Z Z' s^2 to the covariance, and the scale of the noise is integrated out. A group that is offered beside the members has
log odds -1/2 ln|1 + s^2 B| - n/2 ln(1 - gain) with B = Z'V^-1 Z (MacKay 1992).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import logsumexp

from ncfix.diagnose.background import PRIOR, SHARES, Background, marginal
from ncfix.diagnose.groups import Group
from ncfix.measure.measurement import Array, Index

SIZES = (1.5, 3.0, 6.0, 12.0, 24.0)
"""um: sizes of an effect at the tool tip that are considered."""
FALLEN = 12.0
"""A share of the background that is less likely than another by this log likelihood adds nothing."""


@dataclass(frozen=True)
class Member:
    """An effect that is taken to be there: a form and its size."""

    group: int
    size: float


@dataclass(frozen=True, repr=False)
class Inner:
    """Inner products of the data with the covariance of the background at one share.

    projected    (p,) with all columns; squares with themselves
    determinant  log determinant of the covariance
    """

    projected: Array
    squares: float
    determinant: float


Blocks = list[tuple[Index, Index, Array]]
"""For each width: numbers of the groups, their columns (g, w), their inner products (g, w, w)."""


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
    blocks: dict[float, Blocks] = field(init=False, default_factory=dict)
    pairs: dict[tuple[float, int, int], Array] = field(init=False, default_factory=dict)
    products: dict[tuple[float, int], Array] = field(init=False, default_factory=dict)

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
        share = self.share(members, beside)
        inner, freedom = self._inner(share), self.background.freedom
        factor, own = self._solved(members, beside, share)
        across = [m.size * self._products(share, m.group) for m in members]
        if beside is not None:
            across.append((beside / self.background.variance(share)[:, None]).T @ self.columns)
        taken = np.concatenate([np.zeros((0, self.columns.shape[1])), *across])
        taken = solve_triangular(factor, taken, lower=True, check_finite=False)
        total, count = inner.squares - float(own @ own) + freedom, len(self.y) + freedom
        projected = inner.projected - taken.T @ own
        odds = np.empty((len(self.groups), len(SIZES)))
        for groups, places, blocks in self._blocks(share):
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
        _, own = self._solved(members, None, share)
        return self._inner(share).squares - float(own @ own)

    def _likelihoods(self, members: Sequence[Member], beside: Array | None) -> Array:
        """For every share, its probability beforehand counted in, (shares,); -inf for those far from the likeliest.

        It has one peak: from the middle share on, each side is followed until it has fallen by `FALLEN`.
        """
        found, middle = np.full(len(SHARES), -np.inf), len(SHARES) // 2
        for side in (range(middle, -1, -1), range(middle + 1, len(SHARES))):
            for k in side:
                found[k] = self._likelihood(members, beside, SHARES[k]) + np.log(PRIOR[k])
                if found[k] < found.max() - FALLEN:
                    break
        return found

    def _likelihood(self, members: Sequence[Member], beside: Array | None, share: float) -> float:
        factor, own = self._solved(members, beside, share)
        inner = self._inner(share)
        determinant = inner.determinant + 2 * float(np.log(np.diag(factor)).sum())
        return marginal(inner.squares - float(own @ own), determinant, len(self.y), self.background.freedom)

    def _solved(self, members: Sequence[Member], beside: Array | None, share: float) -> tuple[Array, Array]:
        """The Cholesky factor of 1 + K'V^-1 K for the columns K of what is there, and what it makes of K'V^-1 y."""
        inner, seen = self._gram(members, beside, share)
        factor = cholesky(inner, lower=True, overwrite_a=True, check_finite=False)
        return factor, solve_triangular(factor, seen, lower=True, check_finite=False)

    def _gram(self, members: Sequence[Member], beside: Array | None, share: float) -> tuple[Array, Array]:
        """Identity and inner products of what is there, (k, k), the lower half, and those with the data, (k,)."""
        parts, sizes = [self.part(m.group) for m in members], [m.size for m in members]
        bounds = np.cumsum([0, *(part.stop - part.start for part in parts), 0 if beside is None else beside.shape[1]])
        places = [slice(int(a), int(b)) for a, b in pairwise(bounds)]
        whole, seen = np.eye(int(bounds[-1])), np.zeros(int(bounds[-1]))
        for k, own in enumerate(places[: len(members)]):
            seen[own] = sizes[k] * self._inner(share).projected[parts[k]]
            for j, other in enumerate(places[: k + 1]):
                products = sizes[k] * sizes[j] * self._pair(share, members[k].group, members[j].group)
                whole[own, other] += products
        if beside is not None:
            weighed, last = beside / self.background.variance(share)[:, None], places[-1]
            seen[last] = weighed.T @ self.y
            whole[last, last] += beside.T @ weighed
            for own, part, size in zip(places, parts, sizes, strict=False):
                whole[last, own] = size * weighed.T @ self.columns[:, part]
        return whole, seen

    def strength(self, group: int, share: float) -> Array:
        """Squares that independent parts of a form show at 1 um, over the variance of noise and background, (w,)."""
        squares: Array = np.maximum(np.linalg.eigvalsh(self._pair(share, group, group)), 0.0)
        return squares

    def _products(self, share: float, group: int) -> Array:
        """The inner products of a group's columns with all, (w, p); computed once."""
        key = share, group
        if key not in self.products:
            weighed = self.columns[:, self.part(group)] / self.background.variance(share)[:, None]
            self.products[key] = weighed.T @ self.columns
        return self.products[key]

    def _pair(self, share: float, first: int, second: int) -> Array:
        """The inner products of two groups' columns, (v, w); computed once."""
        key = share, first, second
        if key not in self.pairs:
            weighed = self.columns[:, self.part(second)] / self.background.variance(share)[:, None]
            self.pairs[key] = self.columns[:, self.part(first)].T @ weighed
        return self.pairs[key]

    def _inner(self, share: float) -> Inner:
        """What the data show with this share of the background; computed once."""
        if share not in self.inner:
            variance = self.background.variance(share)
            weighed = self.y / variance
            self.inner[share] = Inner(self.columns.T @ weighed, float(self.y @ weighed), float(np.log(variance).sum()))
        return self.inner[share]

    def _blocks(self, share: float) -> Blocks:
        """The inner products of all groups with themselves; computed once."""
        if share not in self.blocks:
            variance, self.blocks[share] = self.background.variance(share), []
            for alike in self._by_width().values():
                places = np.array([range(self.part(k).start, self.part(k).stop) for k in alike], dtype=np.int64)
                stack = np.stack([self.columns[:, self.part(k)] for k in alike])
                products = np.swapaxes(stack, 1, 2) @ (stack / variance[:, None])
                self.blocks[share].append((np.asarray(alike), places.reshape(len(alike), -1), products))
        return self.blocks[share]

    def numbers(self, members: Sequence[Member], share: float) -> list[Array]:
        """The most probable numbers behind each member when all are fitted, per um."""
        if not members:
            return []
        factor, own = self._solved(members, None, share)
        found = solve_triangular(factor, own, lower=True, trans="T", check_finite=False)
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
