"""Evidence for groups in closed form: the log of the odds that a form of an effect adds to what is there already.

With orthonormal coordinates in which the noise is one, a group Z of eigenvalues d and projections a of the data has
log odds sum(-1/2 ln(1 + s^2 d)) + 1/2 sum(a^2 s^2 / (1 + s^2 d)) for a size s (MacKay 1992); the noise itself is not
known exactly, which makes the second sum a logarithm. Averaged over sizes and forms, and over how much of everything
there is in the background.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logsumexp

from ncfix.diagnose.background import PRIOR, SHARES, Background, marginal
from ncfix.diagnose.groups import Group
from ncfix.measure.measurement import Array, Index

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
    among    numbers of the groups
    """

    odds: Array
    null: Array
    among: range

    @cached_property
    def base(self) -> float:
        """Log likelihood of the members alone."""
        return float(logsumexp(self.null))

    @cached_property
    def each(self) -> Array:
        """Log odds of every form at any size, (groups,)."""
        found: Array = logsumexp(self.odds + (self.null - self.base)[None, :, None], axis=(1, 2))
        found -= np.log(self.odds.shape[2])
        return found

    def of(self, groups: Sequence[int]) -> float:
        """Log odds of an effect with these forms."""
        each = self.each[self._places(groups)]
        largest = each.max()
        return float(largest + np.log(np.exp(each - largest).mean()))

    def _places(self, groups: Sequence[int]) -> list[int]:
        return [group - self.among.start for group in groups]

    def best(self, groups: Sequence[int]) -> Member:
        """Its likeliest form and size."""
        return self.likeliest(groups, 1)[0]

    def likeliest(self, groups: Sequence[int], count: int) -> list[Member]:
        """Its likeliest forms, each with its likeliest size."""
        weight = logsumexp(self.odds[self._places(groups)] + self.null[None, :, None], axis=1)
        order = np.argsort(-weight.max(axis=1))[:count]
        return [Member(groups[int(form)], SIZES[int(weight[form].argmax())]) for form in order]


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


@dataclass(repr=False)
class Court:
    """All groups in the coordinates of the background, and the names that own them.

    groups  those with a name come first, `named` of them; then their rivals without one
    free    constants that the machine file lacks are free, and no names to be found
    """

    background: Background
    groups: tuple[Group, ...]
    named: int
    free: bool = False
    columns: Array = field(init=False)
    bounds: Array = field(init=False)
    y: Array = field(init=False)
    forms: Mapping[str, list[int]] = field(init=False)
    names: tuple[str, ...] = field(init=False)
    rivals: tuple[str, ...] = field(init=False)
    inner: dict[float, Inner] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Carry everything into the coordinates, once."""
        self.columns = self.background.seen(np.concatenate([group.columns for group in self.groups], axis=1))
        self.bounds = np.concatenate([[0], np.cumsum([group.columns.shape[1] for group in self.groups])])
        self.y = self.background.seen(self.background.view.y)
        forms: dict[str, list[int]] = {}
        for index, group in enumerate(self.groups):
            forms.setdefault(group.owner.name, []).append(index)
        self.forms = forms
        offered = (name for name, own in forms.items() if own[0] < self.named)
        self.names = tuple(name for name in offered if not (self.free and self.constant(name)))
        self.rivals = tuple(name for name, own in forms.items() if own[0] >= self.named)

    def constant(self, name: str) -> bool:
        """Whether a name is of a constant that the machine file lacks."""
        return self.groups[self.forms[name][0]].owner.constant

    def part(self, index: int) -> slice:
        """Where a group's columns are."""
        return slice(int(self.bounds[index]), int(self.bounds[index + 1]))

    def heard(
        self, members: Sequence[Member], only: Sequence[int] | None = None, among: range | None = None,
        beside: Array | None = None,
    ) -> Evidence:  # fmt: skip
        """The evidence for groups beside these members; `only` some of the shares of the background.

        among   the groups that are heard: those with a name if not said
        beside  further columns in the coordinates that are there at unit size
        """
        among = range(self.named) if among is None else among
        odds = np.zeros((len(among), len(SHARES), len(SIZES)))
        null = np.full(len(SHARES), -np.inf)
        for index in range(len(SHARES)) if only is None else only:
            odds[:, index], null[index] = self._at(SHARES[index], members, among, beside)
            null[index] += np.log(PRIOR[index])
        return Evidence(odds, null, among)

    @property
    def unnamed(self) -> range:
        """The groups of the rivals."""
        return range(self.named, len(self.groups))

    def _at(self, share: float, members: Sequence[Member], among: range, beside: Array | None) -> tuple[Array, float]:
        """Log odds of the groups, (groups, sizes), and log likelihood of the members: all by inner products."""
        ground, inner = self.background, self._inner(share)
        part = slice(int(self.bounds[among.start]), int(self.bounds[among.stop]))
        known = self._known(members, beside)
        weighed = known / ground.variance(share)[:, None]
        factor = np.linalg.cholesky(np.eye(known.shape[1]) + known.T @ weighed)
        taken = solve_triangular(factor, weighed.T @ self.columns[:, part], lower=True)
        own = solve_triangular(factor, weighed.T @ self.y, lower=True)
        squares, freedom, count = inner.squares - float(own @ own), ground.freedom, len(self.y)
        null = marginal(squares, inner.determinant + 2 * float(np.log(np.diag(factor)).sum()), count, freedom)
        projected = inner.projected[part] - taken.T @ own
        odds = np.empty((len(among), len(SIZES)))
        for groups, places, blocks in inner.blocks:
            inside = (groups >= among.start) & (groups < among.stop)
            if inside.any():
                at = places[inside] - part.start
                lost = np.moveaxis(taken[:, at], 0, 1)
                eigen, vectors = np.linalg.eigh(blocks[inside] - np.swapaxes(lost, 1, 2) @ lost)
                a = np.einsum("gpk,gp->gk", vectors, projected[at])
                odds[groups[inside] - among.start] = log_odds(
                    np.maximum(eigen, 0.0), a**2, squares + freedom, count + freedom
                )
        return odds, null

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
            determinant = float(np.log(variance).sum())
            weighed = self.y / variance
            self.inner[share] = Inner(self.columns.T @ weighed, float(self.y @ weighed), determinant, blocks)
        return self.inner[share]

    def whitened(self, share: float, members: Sequence[Member]) -> tuple[Array, Array]:
        """Data and the columns of what has a name, with unit covariance given the members."""
        root = 1 / np.sqrt(self.background.variance(share))
        y, columns = self.y * root, self.columns[:, : self.bounds[self.named]] * root[:, None]
        known = self._known(members, None) * root[:, None]
        squares, turned = np.linalg.eigh(known.T @ known)
        squares, turned = squares[squares > TINY], turned[:, squares > TINY]
        left = known @ (turned / np.sqrt(squares))
        shrink = 1 - 1 / np.sqrt(1 + squares)
        return y - left @ (shrink * (left.T @ y)), columns - left @ (shrink[:, None] * (left.T @ columns))

    def likelihood(self, members: Sequence[Member], beside: Array | None = None) -> float:
        """Log likelihood of these members, what was chosen for each of them (form and size) counted against it."""
        null = self.heard(members, among=range(0), beside=beside).base
        chosen = [len(self.forms[self.groups[m.group].owner.name]) * len(SIZES) for m in members]
        return null - float(np.log(chosen).sum())

    def numbers(self, members: Sequence[Member], share: float) -> list[Array]:
        """The most probable numbers behind each member when all are fitted, per um."""
        if not members:
            return []
        variance = self.background.variance(share)
        known = self._known(members, None)
        weighed = known / variance[:, None]
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


def log_odds(eigen: Array, squares: Array, total: float | Array, count: float) -> Array:
    """Log odds per size, (..., p) -> (..., sizes); `total` sum of squares of the data, `count` its freedom."""
    size = np.asarray(SIZES)[:, None] ** 2
    shrunk = 1 + size * eigen[..., None, :]
    occam = 0.5 * np.log(shrunk).sum(axis=-1)
    gain = (squares[..., None, :] * size / shrunk).sum(axis=-1)
    odds: Array = -occam - 0.5 * count * np.log1p(-np.minimum(gain / np.asarray(total)[..., None], 1 - 1e-12))
    return odds
