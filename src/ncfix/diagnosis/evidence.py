"""The noise in which an effect must show: of the instrument, and a little of everything that machines do.

A real machine has many small effects at once, and an instrument wanders. So the residual is taken as base columns, plus
noise, plus noise that lasts for some minutes, plus a little of every candidate together. In the coordinates `rotation`
(orthogonal to the base, error contrasts of restricted likelihood; then principal axes of "everything") the covariance
is diagonal for every share of that background: sigma^2 (1 + share^2 `spectrum`).

Evidence in closed form: how much likelier the data are if an effect is there.

In the coordinates of the background its covariance is diagonal for every share of "a little of everything". A form of
an effect is a group of columns Z with independent numbers of variance s^2, a member; members that are there add
Z Z' s^2 to the covariance, and the scale of the noise is integrated out. A group that is offered beside the members has
log odds in closed form (effect_form.py).

One account of evidence: how well a set of effects explains the data, less what each of them must pay.

The weight of a set is the log likelihood of the data with these effects there (evidence.py), less a price for each:

    ln(names)         it was chosen from all names of the catalogue
    ln(forms sizes)   and its form and size from those that it may have
    SURE, FURTHER     ln 100 for the first, ln 20 for every further one
    UNNAMED           ln 20 more for a rival without a name: of twenty effects that are missing one is in no catalogue

The first two make the weights of all sets probabilities of one mixture, whose mean under noise alone is 1. So by
Markov's inequality noise weighs more than an empty set in at most one of a hundred measurements, and more with a name
too many than with the true set in at most one of twenty, of whatever design (e-values: Vovk and Wang 2021).

An effect is never quite what the catalogue says: the true one may differ in shape by a smooth share (`MISSHAPEN`) of
what it shows. What such a change explains is no reason for another name, nor for a rival.
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
"""Size of everything else together, against the noise of one value."""
PRIOR = (0.3, 0.3, 0.25, 0.12, 0.03)
"""How likely these are beforehand."""
TOGETHER = 64
"""Groups that are carried into the coordinates at once: of many the copies would take much memory."""
FALLEN = 12.0
"""A share of the background that is less likely than another by this log likelihood adds nothing."""
Members = Mapping[str, "Member"]

FALSE_ALARM = 0.01
"""How often noise alone may name anything."""
COMPANION = 0.05
"""How often noise alone may bring a further name."""
SURE, FURTHER = float(-np.log(FALSE_ALARM)), float(-np.log(COMPANION))
UNNAMED = float(np.log(20.0))
"""Log odds beforehand against what is in no catalogue."""
MISSHAPEN = 0.2
"""How much the shape of an effect may differ from that of the catalogue, as a share of what it shows."""
DRIFT_TIME = 900.0
"""s: how long an instrument's wandering lasts."""
USUAL_SHARE = SHARES[2]
"""The share of the background at which it is asked what the members show."""


@frozen(repr=False, slots=False)
class Background:
    """The coordinates and the likelihoods in them.

    data      what was measured
    relative  (m,) standard deviation of each value against that of a plain one, outliers very large
    rotation  (m, n) to the n coordinates; its columns are in units of the noise
    spectrum  (n,) variance of everything at a size of one noise, along the coordinates
    sigma     um, standard deviation of one plain value before anything was looked at
    freedom   degrees of freedom of that; the data have n of their own
    drift     size of the instrument's wandering against the noise
    everything  (m, m) covariance of a little of everything at 1 um, um^2
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
        """The inverse of the covariance of all values with this share of everything, um^-2, (m, m); computed once."""
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
        """Columns (m, p) or values (m,) um in the coordinates, in units of `sigma`."""
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
    """The covariance (m, m) of noise and a share of everything, in units of each value's noise; `relative` (m,)."""
    found = in_noise(everything, relative / share)
    found[np.diag_indices_from(found)] += 1.0
    return found


def wandering_correlation(data: ResidualData, relative: Array) -> Array | None:
    """What the times between values of one component say of their wandering together, in units of each value's noise.

    (m, m), by `relative` (m,); None without a clock.
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
    """Log likelihood of `count` values, sum of squares in units of a variance known with `freedom`."""
    return -0.5 * log_determinant - 0.5 * (count + freedom) * float(np.log((squares + freedom) / (count + freedom)))


@frozen(slots=False)
class Member:
    """An effect that is taken to be there: a form and its size."""

    group: int
    size: float


@frozen(repr=False, slots=False)
class DataProducts:
    """Inner products of the data with the covariance of the background at one share.

    projected    (p,) with all columns; squares with themselves
    determinant  log determinant of the covariance
    """

    projected: Array
    squares: float
    determinant: float


@frozen(slots=False)
class CandidateOdds:
    """Log odds of every group per size (um) beside some members, (groups, sizes)."""

    odds: Array
    sizes: Sequence[float]

    def of(self, groups: Sequence[int]) -> float:
        """Log odds of an effect with these forms, whichever form and size it has."""
        own = self.odds[list(groups)]
        return float(own.max() + np.log(np.exp(own - own.max()).mean()))

    def likeliest(self, groups: Sequence[int], count: int = 1) -> list[Member]:
        """Its likeliest forms, each with its likeliest size."""
        own = self.odds[list(groups)]
        order = np.argsort(-own.max(axis=1))[:count]
        return [Member(groups[int(form)], self.sizes[int(own[form].argmax())]) for form in order]


@mutable(repr=False, slots=False)
class Evidence:
    """All groups in the coordinates of the background, and the names that own them.

    groups  those with a name come first, `named` of them; then their rivals without one
    most    how many of `SHARES`, from the least, the background may have
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
        """Carry everything into the coordinates, once."""
        self.bounds = np.concatenate([[0], np.cumsum([group.width for group in self.groups])])
        rotation = (self.background.rotation / self.background.sigma).astype(np.float32)
        seen = np.empty((int(self.bounds[-1]), rotation.shape[1]), dtype=np.float32)
        for start in range(0, len(self.groups), TOGETHER):
            some = self.groups[start : start + TOGETHER]
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
        """Whether a name is of a constant that the machine file lacks."""
        return self.groups[self.forms[name][0]].owner.constant

    def part(self, index: int) -> slice:
        """Where a group's columns are."""
        return slice(int(self.bounds[index]), int(self.bounds[index + 1]))

    def own(self, index: int) -> Array:
        """A group's columns, (n, w)."""
        return self.columns[:, self.part(index)].astype(np.float64)

    def across(self, others: Array) -> Array:
        """The inner products of some columns (n, k) with those of all groups, (k, p)."""
        found = np.empty((others.shape[1], self.columns.shape[1]))
        for start in range(0, len(self.groups), TOGETHER):
            part = slice(self.bounds[start], self.bounds[min(start + TOGETHER, len(self.groups))])
            np.matmul(others.T, self.columns[:, part].astype(np.float64), out=found[:, part])
        return found

    def candidate_odds(self, members: Sequence[Member], beside: Array | None = None) -> CandidateOdds:
        """The odds of all groups beside these members, at their likeliest share of the background.

        beside  further columns in the coordinates that are there at unit size
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
        """Log likelihood of the data with these members there and no others, whatever the share of the background."""
        return float(logsumexp(self._likelihoods(members, beside)))

    def share(self, members: Sequence[Member], beside: Array | None = None) -> float:
        """The likeliest share of everything in the background beside these members."""
        return SHARES[int(self._likelihoods(members, beside).argmax())]

    def by_share(self, members: Sequence[Member], beside: Array | None = None) -> list[tuple[float, float]]:
        """Log likelihood of the data with each share of everything, its prior counted in; and the share."""
        found = self._likelihoods(members, beside)
        return [(float(own), share) for own, share in zip(found, SHARES, strict=True) if np.isfinite(own)]

    def noise(self, members: Sequence[Member], share: float) -> float:
        """The variance of the noise with these members against what was taken for it before the data were seen."""
        _, own = self._solved(members, None, share)
        squares, freedom = self._inner(share).squares - float(own @ own), self.background.freedom
        return (squares + freedom) / (len(self.y) + freedom)

    def _likelihoods(self, members: Sequence[Member], beside: Array | None) -> Array:
        """For every share, its probability beforehand counted in, (shares,); -inf for those far from the likeliest.

        It has one peak: from the middle share on, each side is followed until it has fallen by `FALLEN`.
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
            for own, member, size in zip(places, members, sizes, strict=False):
                whole[last, own] = size * weighed.T @ self.own(member.group)
        return whole, seen

    def strength(self, group: int, share: float) -> Array:
        """Squares that independent parts of a form show at 1 um, over the variance of noise and background, (w,)."""
        squares: Array = np.maximum(np.linalg.eigvalsh(self._pair(share, group, group)), 0.0)
        return squares

    def _products(self, share: float, group: int) -> Array:
        """The inner products of a group's columns with all, (w, p); computed once."""
        key = share, group
        if key not in self.products:
            self.products[key] = self.across(self.own(group) / self.background.variance(share)[:, None])
        return self.products[key]

    def _pair(self, share: float, first: int, second: int) -> Array:
        """The inner products of two groups' columns, (v, w); computed once."""
        key = share, first, second
        if key not in self.pairs:
            self.pairs[key] = self.own(first).T @ (self.own(second) / self.background.variance(share)[:, None])
        return self.pairs[key]

    def _inner(self, share: float) -> DataProducts:
        """What the data show with this share of the background; computed once."""
        if share not in self.inner:
            variance = self.background.variance(share)
            weighed = self.y / variance
            projected = self.across(weighed[:, None])[0]
            self.inner[share] = DataProducts(projected, float(self.y @ weighed), float(np.log(variance).sum()))
        return self.inner[share]

    def _blocks(self, share: float) -> Blocks:
        """The inner products of all groups with themselves; computed once."""
        if share not in self.blocks:
            variance = self.background.variance(share)
            own = map(self.own, range(len(self.groups)))
            self.blocks[share] = blocks_of([columns.T / variance @ columns for columns in own])
        return self.blocks[share]

    def numbers(self, members: Sequence[Member], share: float) -> list[Array]:
        """The most probable numbers behind each member when all are fitted, per um."""
        if not members:
            return []
        factor, own = self._solved(members, None, share)
        found = solve_triangular(factor, own, lower=True, trans="T", check_finite=False)
        widths = [self.groups[m.group].width for m in members]
        parts = np.split(found, np.cumsum(widths)[:-1])
        return [m.size * part for m, part in zip(members, parts, strict=True)]

    def shown(self, members: Sequence[Member], share: float) -> list[Array]:
        """What each member shows when all are fitted, (m,) um."""
        numbers = self.numbers(members, share)
        return [self.groups[m.group].columns @ own for m, own in zip(members, numbers, strict=True)]


def entry_price(count: int) -> float:
    """What so many effects pay for being there."""
    return SURE + (count - 1) * FURTHER if count else 0.0


@frozen(repr=False, slots=False)
class Comparison:
    """Weighs sets of effects; remembers what it has weighed.

    free  what is there besides in any case, and no names to be found: constants that the machine file lacks
    """

    evidence: Evidence
    free: tuple[Member, ...] = ()
    weights: dict[frozenset[Member], float] = field(default_factory=dict)
    sketches: dict[frozenset[Member], float] = field(default_factory=dict)
    asked: dict[frozenset[Member], CandidateOdds] = field(default_factory=dict)
    allowed: dict[frozenset[Member], Array | None] = field(default_factory=dict)

    def weight(self, members: Members) -> float:
        """Log likelihood of the data with these members, less their prices."""
        key = frozenset(members.values())
        if key not in self.weights:
            self.weights[key] = self._likelihood(members) - self.paid(members)
        return self.weights[key]

    def sketched(self, members: Members) -> float:
        """As `weight`, at first sight: of effects that are shaped as in the catalogue."""
        return self._plain(members) - self.paid(members)

    def paid(self, members: Members) -> float:
        """What all members pay."""
        return sum(map(self.price, members)) + entry_price(len(members))

    def _plain(self, members: Members) -> float:
        key = frozenset(members.values())
        if key not in self.sketches:
            self.sketches[key] = self.evidence.likelihood(self.all(members))
        return self.sketches[key]

    def _likelihood(self, members: Members) -> float:
        """Of effects shaped as in the catalogue, or a little otherwise: either in half of all machines."""
        plain, allowance = self._plain(members), self.allowance(members)
        if allowance is None:
            return plain
        misshapen = self.evidence.likelihood(self.all(members), allowance)
        return float(np.logaddexp(plain, misshapen) - np.log(2))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names to be found."""
        free = {member.group for member in self.free}
        return tuple(name for name in self.evidence.names if self.evidence.forms[name][0] not in free)

    def all(self, members: Members) -> list[Member]:
        """The members and what is free."""
        return [*members.values(), *self.free]

    def price(self, name: str) -> float:
        """What an effect pays for what it was chosen from."""
        chosen = np.log(len(self.evidence.forms[name]) * len(self.evidence.background.data.sizes))
        alternatives = self.evidence.alternatives
        return float(
            chosen + (np.log(len(alternatives)) + UNNAMED if name in alternatives else np.log(len(self.names)))
        )

    def candidate_odds(self, members: Members) -> CandidateOdds:
        """The odds of everything beside these members."""
        key = frozenset(members.values())
        if key not in self.asked:
            self.asked[key] = self.evidence.candidate_odds(self.all(members), self.allowance(members))
        return self.asked[key]

    def allowance(self, members: Members) -> Array | None:
        """What the named members would show besides if their shapes differed a little, in the coordinates, (n, k)."""
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
        """The members whose shape may differ: those with a name, but constants."""
        evidence = self.evidence
        return [each for name, each in members.items() if name in evidence.names and not evidence.constant(name)]

    @cached_property
    def _slow(self) -> Array:
        """How a shape may differ, (m, k)."""
        return shape_variations(self.evidence.background.data)
