"""The evidence of the data for a set of effects, beside noise and a background of small effects.

Background. A real machine has many small effects at once, and an instrument drifts. So the residual is modelled as base
columns, plus white noise, plus noise correlated over minutes, plus a small amount of every candidate ("everything"). In
the coordinates `rotation` (error contrasts of restricted likelihood, orthogonal to the base; then principal axes of
"everything") the covariance is diagonal for every share of that background: sigma^2 (1 + share^2 `spectrum`).

Members. A form of an effect is a group of columns Z whose coefficients are independent with variance s^2. A member adds
s^2 Z Z' to the covariance. The scale of the noise is integrated out. A further group beside the members has log odds in
closed form (effect_form.py).

Weight. The weight of a set is the log likelihood of the data with these members, less a price for each:

    ln(names)         it was chosen from all names of the catalogue
    ln(forms sizes)   and its form and size from those that it may have
    SURE, FURTHER     ln 100 for the first, ln 20 for every further one
    UNNAMED           ln 20 more for an unnamed alternative: one missing effect of twenty is in no catalogue

The first two make the weights of all sets probabilities of one mixture, whose mean under noise alone is 1. So by
Markov's inequality, whatever the design, noise outweighs the empty set in at most one of a hundred measurements, and a
superfluous name outweighs the true set in at most one of twenty (e-values: Vovk and Wang 2021).

Shape. The true effect may differ from the catalogue by a smooth change of shape, a share `MISSHAPEN` of its size. What
such a change explains is no reason for another name, nor for an unnamed alternative.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.special import logsumexp

from ncfix.arrays import Array
from ncfix.diagnosis.effect_form import Blocks, EffectForm, block_odds, blocks_of
from ncfix.diagnosis.forms import shape_variations
from ncfix.diagnosis.residual_data import ResidualData
from ncfix.measure.least_squares import inverse
from ncfix.values import frozen, mutable

SHARES = (0.05, 0.2, 0.4, 0.8, 2.5)
"""Sizes of the background of small effects that are considered, in units of the noise of one value."""
PRIOR = (0.3, 0.3, 0.25, 0.12, 0.03)
"""Prior probabilities of `SHARES`."""
BATCH = 64
"""Groups that are transformed at once, to limit memory."""
FALLEN = 12.0
"""A share of the background less likely than the best by this log likelihood is neglected."""
Members = Mapping[str, "Member"]

FALSE_ALARM = 0.01
"""Largest probability that noise alone leads to any name."""
COMPANION = 0.05
"""Largest probability that noise alone leads to a further name."""
SURE, FURTHER = float(-np.log(FALSE_ALARM)), float(-np.log(COMPANION))
"""Prices, log odds, of the first effect of a set and of each further one."""
UNNAMED = float(np.log(20.0))
"""Price, log odds, of an effect that is in no catalogue."""
MISSHAPEN = 0.2
"""Standard deviation of a change of an effect's shape against the catalogue, as a share of its size."""
DRIFT_TIME = 900.0
"""Correlation time of the drift of an instrument, s."""
USUAL_SHARE = SHARES[2]
"""Share of the background at which the sizes of the members are estimated."""


@frozen(repr=False, slots=False)
class Background:
    """Noise and background of small effects, and the coordinates in which their covariance is diagonal.

    data      the measured values
    relative  (m,) standard deviation of each value relative to a usual one; very large for outliers
    rotation  (m, n) to the n coordinates; its columns are in units of the noise
    spectrum  (n,) variance of "everything" along the coordinates, at a size of one noise
    sigma     prior standard deviation of a usual value, um
    freedom   degrees of freedom of `sigma`; the data have n of their own
    drift     standard deviation of the instrument's drift, in units of the noise
    everything  (m, m) covariance of "everything" at a size of 1 um, um^2
    precisions  cache: share -> `precision`
    """

    data: ResidualData
    relative: Array
    rotation: Array
    spectrum: Array
    sigma: float
    freedom: float
    drift: float
    everything: Array
    precisions: dict[float, Array] = field(default_factory=dict)

    def precision(self, share: float) -> Array:
        """Inverse covariance of all values with this share of the background, um^-2, (m, m); cached."""
        if share not in self.precisions:
            covariance = with_noise(self.everything, share, self.relative)
            wandering = wandering_correlation(self.data, self.relative) if self.drift else None
            if wandering is not None:
                wandering *= self.drift**2
                covariance += wandering
                del wandering
            found, scale = inverse(covariance), self.sigma * self.relative
            found /= scale[:, None]
            found /= scale
            self.precisions[share] = found
        return self.precisions[share]

    def seen(self, columns: Array) -> Array:
        """Columns (m, p) or values (m,), um, transformed to the coordinates, in units of `sigma`."""
        scaled: Array = columns.T @ self.rotation
        scaled /= self.sigma
        return scaled.T

    def variance(self, share: float) -> Array:
        """Variance along the coordinates in units of sigma^2, (n,)."""
        return 1.0 + share**2 * self.spectrum


def in_noise(covariance: Array, relative: Array) -> Array:
    """A covariance (m, m) in units of each value's noise; `relative` (m,)."""
    scaled = covariance / relative[:, None]
    scaled /= relative
    return scaled


def with_noise(everything: Array, share: float, relative: Array) -> Array:
    """Covariance (m, m) of noise plus a share of "everything", in units of each value's noise; `relative` (m,)."""
    found = in_noise(everything, relative / share)
    found[np.diag_indices_from(found)] += 1.0
    return found


def wandering_correlation(data: ResidualData, relative: Array) -> Array | None:
    """Covariance (m, m) of the instrument's drift at the size of the noise, in units of each value's noise.

    It falls exponentially with the time between two values of one file and component. None if no time was logged.
    """
    time = data.column("time_s")
    if np.ptp(time) == 0:
        return None
    row = np.maximum(data.row, 0)
    own, file = time[row], data.file[row]
    lasting: Array = np.subtract.outer(own / DRIFT_TIME, own / DRIFT_TIME)
    np.exp(np.negative(np.abs(lasting, out=lasting), out=lasting), out=lasting)
    lasting *= (data.component[:, None] == data.component) & (data.row[:, None] >= 0) & (file[:, None] == file)
    lasting /= relative[:, None]
    lasting /= relative
    return lasting


def marginal(squares: float, log_determinant: float, count: int, freedom: float) -> float:
    """Log likelihood of `count` whitened values with the scale of the noise integrated out.

    squares  their sum of squares, in units of a variance that is known with `freedom` degrees of freedom
    """
    return -0.5 * log_determinant - 0.5 * (count + freedom) * float(np.log((squares + freedom) / (count + freedom)))


@frozen(slots=False)
class Member:
    """An effect assumed to be there: the index of its form, and its size, um."""

    group: int
    size: float


@frozen(repr=False, slots=False)
class DataProducts:
    """Inner products, weighted by the inverse covariance V of the background at one share.

    projected    (p,) of the data with all columns
    squares      of the data with themselves
    determinant  log determinant of V
    """

    projected: Array
    squares: float
    determinant: float


@frozen(slots=False)
class CandidateOdds:
    """Log odds of every group at every size (um), given some members: (groups, sizes)."""

    odds: Array
    sizes: Sequence[float]

    def of(self, groups: Sequence[int]) -> float:
        """Log odds of an effect with these forms, averaged over forms and sizes."""
        own = self.odds[list(groups)]
        return float(own.max() + np.log(np.exp(own - own.max()).mean()))

    def likeliest(self, groups: Sequence[int], count: int = 1) -> list[Member]:
        """The likeliest `count` forms among `groups`, each with its likeliest size."""
        own = self.odds[list(groups)]
        order = np.argsort(-own.max(axis=1))[:count]
        return [Member(groups[int(form)], self.sizes[int(own[form].argmax())]) for form in order]


@mutable(repr=False, slots=False)
class Evidence:
    """All forms of all effects in the coordinates of the background, and their inner products, cached.

    groups  the forms: first `named` forms of named effects, then those of unnamed alternatives
    most    number of `SHARES`, from the smallest, that the background may have
    """

    background: Background
    groups: tuple[EffectForm, ...]
    named: int
    most: int = len(SHARES)
    columns: NDArray[np.float32] = field(init=False)
    bounds: Array = field(init=False)
    y: Array = field(init=False)
    forms: dict[str, list[int]] = field(init=False)
    names: tuple[str, ...] = field(init=False)
    alternatives: tuple[str, ...] = field(init=False)
    inner: dict[float, DataProducts] = field(init=False, default_factory=dict)
    blocks: dict[float, Blocks] = field(init=False, default_factory=dict)
    pairs: dict[tuple[float, int, int], Array] = field(init=False, default_factory=dict)
    products: dict[tuple[float, int], Array] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Transform all columns and the data to the coordinates."""
        self.bounds = np.concatenate([[0], np.cumsum([group.width for group in self.groups])])
        rotation = (self.background.rotation / self.background.sigma).astype(np.float32)
        seen = np.empty((int(self.bounds[-1]), rotation.shape[1]), dtype=np.float32)
        for start in range(0, len(self.groups), BATCH):
            some = self.groups[start : start + BATCH]
            part = slice(int(self.bounds[start]), int(self.bounds[start + len(some)]))
            np.matmul(np.concatenate([group.single.T for group in some]), rotation, out=seen[part])
        self.columns = seen.T
        self.y = self.background.seen(self.background.data.y)
        self.forms = {}
        for index, group in enumerate(self.groups):
            self.forms.setdefault(group.owner.name, []).append(index)
        self.names = tuple(name for name, own in self.forms.items() if own[0] < self.named)
        self.alternatives = tuple(name for name, own in self.forms.items() if own[0] >= self.named)

    def constant(self, name: str) -> bool:
        """Whether a name is a constant that the machine file lacks."""
        return self.groups[self.forms[name][0]].owner.constant

    def part(self, index: int) -> slice:
        """The columns of a group."""
        return slice(int(self.bounds[index]), int(self.bounds[index + 1]))

    def own(self, index: int) -> Array:
        """A group's columns in the coordinates, (n, w)."""
        return self.columns[:, self.part(index)].astype(np.float64)

    def across(self, others: Array) -> Array:
        """Inner products of columns (n, k) with the columns of all groups, (k, p)."""
        found = np.empty((others.shape[1], self.columns.shape[1]))
        for start in range(0, len(self.groups), BATCH):
            part = slice(self.bounds[start], self.bounds[min(start + BATCH, len(self.groups))])
            np.matmul(others.T, self.columns[:, part].astype(np.float64), out=found[:, part])
        return found

    def candidate_odds(self, members: Sequence[Member], beside: Array | None = None) -> CandidateOdds:
        """The odds of all groups given these members, at the likeliest share of the background.

        beside  further columns, in the coordinates, with coefficients of unit variance
        """
        share = self.share(members, beside)
        inner, freedom = self._inner(share), self.background.freedom
        factor, own = self._solved(members, beside, share)
        across = [m.size * self._products(share, m.group) for m in members]
        if beside is not None:
            across.append(self.across(beside / self.background.variance(share)[:, None]))
        taken = np.concatenate([np.zeros((0, self.columns.shape[1])), *across])
        taken = solve_triangular(factor, taken, lower=True, check_finite=False)
        total, count = inner.squares - float(own @ own) + freedom, len(self.y) + freedom
        projected = inner.projected - taken.T @ own
        sizes = self.background.data.sizes
        return CandidateOdds(block_odds(self._blocks(share), projected, taken, total, count, sizes), sizes)

    def likelihood(self, members: Sequence[Member], beside: Array | None = None) -> float:
        """Log likelihood of the data with exactly these members, averaged over the share of the background."""
        return float(logsumexp(self._likelihoods(members, beside)))

    def share(self, members: Sequence[Member], beside: Array | None = None) -> float:
        """The likeliest share of the background, given these members."""
        return SHARES[int(self._likelihoods(members, beside).argmax())]

    def by_share(self, members: Sequence[Member], beside: Array | None = None) -> list[tuple[float, float]]:
        """For each share that is not negligible: (log likelihood plus log prior of the share, share)."""
        found = self._likelihoods(members, beside)
        return [(float(own), share) for own, share in zip(found, SHARES, strict=True) if np.isfinite(own)]

    def noise(self, members: Sequence[Member], share: float) -> float:
        """Estimated variance of the noise, given these members, relative to the prior one (`Background.sigma`^2)."""
        _, own = self._solved(members, None, share)
        squares, freedom = self._inner(share).squares - float(own @ own), self.background.freedom
        return (squares + freedom) / (len(self.y) + freedom)

    def _likelihoods(self, members: Sequence[Member], beside: Array | None) -> Array:
        """Log likelihood plus log prior of every share, (shares,); -inf for shares far from the likeliest.

        It has one peak: from the middle share, each side is followed until it has fallen by `FALLEN`.
        """
        found, middle = np.full(len(SHARES), -np.inf), min(len(SHARES) // 2, self.most - 1)
        for side in (range(middle, -1, -1), range(middle + 1, self.most)):
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
        """The Cholesky factor L of 1 + K'V^-1 K, for the columns K of members and `beside`; and L^-1 K'V^-1 y."""
        inner, seen = self._gram(members, beside, share)
        factor = cholesky(inner, lower=True, overwrite_a=True, check_finite=False)
        return factor, solve_triangular(factor, seen, lower=True, check_finite=False)

    def _gram(self, members: Sequence[Member], beside: Array | None, share: float) -> tuple[Array, Array]:
        """1 + K'V^-1 K, (k, k), its lower half only, and K'V^-1 y, (k,), for the columns K of members and `beside`."""
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
            for own, member, size in zip(places, members, sizes, strict=False):
                whole[last, own] = size * weighed.T @ self.own(member.group)
        return whole, seen

    def strength(self, group: int, share: float) -> Array:
        """Squared signal-to-noise ratio of each principal part of a form at 1 um, (w,)."""
        squares: Array = np.maximum(np.linalg.eigvalsh(self._pair(share, group, group)), 0.0)
        return squares

    def _products(self, share: float, group: int) -> Array:
        """Weighted inner products of a group's columns with all columns, (w, p); cached."""
        key = share, group
        if key not in self.products:
            self.products[key] = self.across(self.own(group) / self.background.variance(share)[:, None])
        return self.products[key]

    def _pair(self, share: float, first: int, second: int) -> Array:
        """Weighted inner products of two groups' columns, (v, w); cached."""
        key = share, first, second
        if key not in self.pairs:
            self.pairs[key] = self.own(first).T @ (self.own(second) / self.background.variance(share)[:, None])
        return self.pairs[key]

    def _inner(self, share: float) -> DataProducts:
        """Inner products of the data at this share of the background; cached."""
        if share not in self.inner:
            variance = self.background.variance(share)
            weighed = self.y / variance
            projected = self.across(weighed[:, None])[0]
            self.inner[share] = DataProducts(projected, float(self.y @ weighed), float(np.log(variance).sum()))
        return self.inner[share]

    def _blocks(self, share: float) -> Blocks:
        """Weighted inner products of each group's columns with themselves; cached."""
        if share not in self.blocks:
            variance = self.background.variance(share)
            own = map(self.own, range(len(self.groups)))
            self.blocks[share] = blocks_of([columns.T / variance @ columns for columns in own])
        return self.blocks[share]

    def numbers(self, members: Sequence[Member], share: float) -> list[Array]:
        """The most probable independent numbers of each member, um, all members fitted together."""
        if not members:
            return []
        factor, own = self._solved(members, None, share)
        found = solve_triangular(factor, own, lower=True, trans="T", check_finite=False)
        widths = [self.groups[m.group].width for m in members]
        parts = np.split(found, np.cumsum(widths)[:-1])
        return [m.size * part for m, part in zip(members, parts, strict=True)]

    def shown(self, members: Sequence[Member], share: float) -> list[Array]:
        """The effect of each member on the values, (m,) um, all members fitted together."""
        numbers = self.numbers(members, share)
        return [self.groups[m.group].columns @ own for m, own in zip(members, numbers, strict=True)]


def entry_price(count: int) -> float:
    """Price, log odds, of a set of so many effects, without the price of choosing them."""
    return SURE + (count - 1) * FURTHER if count else 0.0


@frozen(repr=False, slots=False)
class Comparison:
    """Weights of sets of effects, cached.

    free  members of every set, not to be found: constants that the machine file lacks
    """

    evidence: Evidence
    free: tuple[Member, ...] = ()
    weights: dict[frozenset[Member], float] = field(default_factory=dict)
    sketches: dict[frozenset[Member], float] = field(default_factory=dict)
    asked: dict[frozenset[Member], CandidateOdds] = field(default_factory=dict)
    allowed: dict[frozenset[Member], Array | None] = field(default_factory=dict)

    def weight(self, members: Members) -> float:
        """Log likelihood of the data with these members, less their price."""
        key = frozenset(members.values())
        if key not in self.weights:
            self.weights[key] = self._likelihood(members) - self.paid(members)
        return self.weights[key]

    def sketched(self, members: Members) -> float:
        """A quick approximation of `weight`: for effects exactly shaped as in the catalogue."""
        return self._plain(members) - self.paid(members)

    def paid(self, members: Members) -> float:
        """The price of choosing all members, log odds."""
        return sum(map(self.price, members)) + entry_price(len(members))

    def _plain(self, members: Members) -> float:
        key = frozenset(members.values())
        if key not in self.sketches:
            self.sketches[key] = self.evidence.likelihood(self.all(members))
        return self.sketches[key]

    def _likelihood(self, members: Members) -> float:
        """Log likelihood, averaged over effects shaped as in the catalogue and slightly misshapen ones."""
        plain, allowance = self._plain(members), self.allowance(members)
        if allowance is None:
            return plain
        misshapen = self.evidence.likelihood(self.all(members), allowance)
        return float(np.logaddexp(plain, misshapen) - np.log(2))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names that may be found."""
        free = {member.group for member in self.free}
        return tuple(name for name in self.evidence.names if self.evidence.forms[name][0] not in free)

    def all(self, members: Members) -> list[Member]:
        """The members, and the effects that are always free."""
        return [*members.values(), *self.free]

    def price(self, name: str) -> float:
        """Price, log odds, of choosing an effect, its form and its size among all."""
        chosen = np.log(len(self.evidence.forms[name]) * len(self.evidence.background.data.sizes))
        alternatives = self.evidence.alternatives
        return float(
            chosen + (np.log(len(alternatives)) + UNNAMED if name in alternatives else np.log(len(self.names)))
        )

    def candidate_odds(self, members: Members) -> CandidateOdds:
        """The odds of all groups given these members; cached."""
        key = frozenset(members.values())
        if key not in self.asked:
            self.asked[key] = self.evidence.candidate_odds(self.all(members), self.allowance(members))
        return self.asked[key]

    def allowance(self, members: Members) -> Array | None:
        """Columns (n, k), in the coordinates, of small changes of shape of the named members; None without any."""
        key = frozenset(members.values())
        if key not in self.allowed:
            self.allowed[key] = self._allowance(members)
        return self.allowed[key]

    def _allowance(self, members: Members) -> Array | None:
        evidence, named = self.evidence, self.shaped(members)
        if not named:
            return None
        every = self.all(members)
        shown = evidence.shown(every, USUAL_SHARE)
        whole = np.sum([each for member, each in zip(every, shown, strict=True) if member in named], axis=0)
        return evidence.background.seen(MISSHAPEN * whole[:, None] * self._slow)

    def shaped(self, members: Members) -> list[Member]:
        """The members whose shape may differ from the catalogue: named ones, without constants."""
        evidence = self.evidence
        return [each for name, each in members.items() if name in evidence.names and not evidence.constant(name)]

    @cached_property
    def _slow(self) -> Array:
        """Smooth factors of a change of shape, (m, k)."""
        return shape_variations(self.evidence.background.data)
