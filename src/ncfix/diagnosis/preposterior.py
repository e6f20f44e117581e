"""The chance that further poses leave a single name, by drawing the values that would be measured there.

Preposterior analysis (Raiffa and Schlaifer 1961). Each name that may be true predicts the new values with a covariance:
its size and shape are known as far as the old rows determine them, the set-up will be new, the instrument has noise,
and the background of small effects is unknown where nothing was measured. Values are drawn from each prediction. The
odds of a name afterwards are its odds now times the likelihood ratio of the new values. So the old rows are not counted
twice, and a vague prediction tells little.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import logsumexp

from ncfix.arrays import Array
from ncfix.diagnosis.effect_form import EffectForm
from ncfix.diagnosis.evidence import MISSHAPEN, Comparison, Member, Members
from ncfix.diagnosis.forms import shape_variations_with
from ncfix.diagnosis.noise import everything_at
from ncfix.diagnosis.selection import ASSUMED, Selected, lead_needed, untold
from ncfix.measure.observation import Observation
from ncfix.values import frozen

FORMS = 2
"""Number of forms of each name that are considered."""
DRAWS = 500
"""Number of draws for each name that may be true; the chance then has a standard error of about 0.02."""
UNLIKELY = 5.0
"""Predictions less likely than the best by this log likelihood are left out."""
WIDE_UM = 1e3
"""Prior standard deviation of set-up and constants, um."""


@frozen(repr=False, slots=False)
class PredictedValues:
    """Predictive normal distribution of the new values for a name in one form and shape.

    weight  log likelihood of the old values, less the price of the members
    mean    (v,) um; factor (v, v): Cholesky factor of the covariance, um
    """

    name: str
    weight: float
    mean: Array
    factor: Array

    def likelihood(self, values: Array) -> Array:
        """Log likelihood (d,) of d draws of the values, (v, d), but for a constant."""
        white = solve_triangular(self.factor, values - self.mean[:, None], lower=True, check_finite=False)
        found: Array = -0.5 * (white**2).sum(axis=0) - np.log(np.diag(self.factor)).sum()
        return found

    def drawn(self, random: np.random.Generator, count: int) -> Array:
        """Random values (v, count), um."""
        return self.mean[:, None] + self.factor @ random.standard_normal((len(self.mean), count))


def shown_at(new: Observation, groups: Sequence[EffectForm]) -> list[Array]:
    """Effect of the numbers of each form at further poses, (v, p) um; zero for forms that no machine file holds."""
    owners = {group.owner.name: group.owner for group in groups if not group.owner.kept_out}
    design = new.um[:, None] * new.design([effect for owner in owners.values() for effect in owner.effects])
    ends = np.cumsum([sum(effect.basis.size for effect in owner.effects) for owner in owners.values()])
    designs = dict(zip(owners, np.split(design, ends[:-1], axis=1), strict=True))
    nothing = [np.zeros((len(design), group.width)) for group in groups]
    return [
        none if group.owner.kept_out else designs[group.owner.name] @ group.loading
        for none, group in zip(nothing, groups, strict=True)
    ]


@frozen(repr=False, slots=False)
class Prospect:
    """Expected outcome of measuring further poses.

    names     the names that may be true
    chances   for each name, if it is true: probability that it is the only one left afterwards
    weights   probability now of each name
    """

    names: tuple[str, ...]
    chances: Array
    weights: Array

    @property
    def chance(self) -> float:
        """Probability that only the true name is left."""
        return float(self.weights @ self.chances)


def prospect(scale: Comparison, selected: Selected, names: Sequence[str], new: Observation, sigma: float) -> Prospect:
    """The expected outcome of measuring `new`, if one of `names` is true; `sigma` is the noise of a value, um.

    One of the names is a selected member; the other members stay. Names that act alike in old and new rows together
    need larger odds to be told apart, as in `aliases`.
    """
    own = next(name for name in names if name in selected.members)
    others = {key: member for key, member in selected.members.items() if key != own}
    predictor, random = _Predictor(scale, new, sigma), np.random.default_rng(0)
    by_name = [list(predictor.predictions(others, name)) for name in names]
    now = np.array([logsumexp([each.weight for each in forms]) for forms in by_name])
    apart = {own: 0.0} | {each: untold(scale, selected, own, each) for each in selected.acting_alike.get(own, ())}
    chances = np.zeros(len(names))
    for k, forms in enumerate(by_name):
        share = np.exp([each.weight - now[k] for each in forms])
        counts = random.multinomial(DRAWS, share / share.sum())
        values = np.concatenate([each.drawn(random, int(n)) for each, n in zip(forms, counts, strict=True)], axis=1)
        odds = np.stack([_weighed(every, values) for every in by_name])
        alone = np.ones(DRAWS, dtype=bool)
        for j in range(len(names)):
            if j != k:
                ahead, before = odds[k] - odds[j], max(apart.get(names[i], np.inf) for i in (j, k))
                told = before + 2 * (float(ahead.mean()) - now[k] + now[j])
                alone &= ahead > lead_needed(told)
        chances[k] = alone.mean()
    tempered = [(w - now[0]) / (ASSUMED if name in apart else 1.0) for name, w in zip(names, now, strict=True)]
    return Prospect(tuple(names), chances, np.exp(tempered - logsumexp(tempered)))


def _weighed(predictions: Sequence[PredictedValues], values: Array) -> Array:
    """Weight (d,) of a name after d draws of the new values, (v, d)."""
    found: Array = logsumexp([each.weight + each.likelihood(values) for each in predictions], axis=0)
    return found


class _Predictor:
    """Predictions of the values at new poses, given the old values, for a name and its companions."""

    def __init__(self, scale: Comparison, new: Observation, sigma: float) -> None:
        self.scale, self.new = scale, new
        self.background = scale.evidence.background
        data = self.background.data
        self.noise = (sigma / self.background.sigma) ** 2
        constants = data.problem.design.shape[1]
        used = data.base.shape[1] - constants
        setup = new.um[:, None] * new.unknown_design(new.unknowns.start)
        kinematic = new.um[:, None] * new.design(data.problem.selection.estimated)
        old = np.concatenate(
            [data.base[:, :used], np.zeros((len(data.y), setup.shape[1])), data.base[:, used:]], axis=1
        )
        rows = np.concatenate([np.zeros((len(setup), used)), setup, kinematic], axis=1)
        size = np.sqrt((old**2).mean(axis=0) + (rows**2).mean(axis=0))
        size = np.where(size > 0, size, 1.0) / WIDE_UM
        self.free = (old / size, rows / size)
        named = scale.evidence.groups[: scale.evidence.named]
        self.named = shown_at(new, named)
        self.everything, self.across = everything_at(data, named, self.named)
        self.variations = shape_variations_with(data, new)
        self.carried: dict[float, tuple[Array, Array]] = {}

    def shown(self, group: int) -> Array:
        """Effect of the numbers of a form at the new poses, (v, p) um; zero for unnamed alternatives."""
        if group < len(self.named):
            return self.named[group]
        return np.zeros((len(self.variations[1]), self.scale.evidence.groups[group].width))

    def _carried(self, share: float) -> tuple[Array, Array]:
        """Kriging weights (v, m) of the background, from old values to new ones; and the free columns, transposed and
        weighted by the precision of the old values, (k, m).
        """
        precision = self.background.precision(share) / self.noise
        size = share**2 * self.noise * self.background.sigma**2
        return size * self.across @ precision, self.free[0].T @ precision

    def predictions(self, others: Members, name: str) -> Iterator[PredictedValues]:
        """Predictions of `name` beside the members `others`: for its likeliest forms, in the catalogue's shape and
        slightly misshapen, with every likely share of the background.
        """
        scale, evidence = self.scale, self.scale.evidence
        asked: list[tuple[list[Member], list[Member], float, float]] = []
        for member in scale.candidate_odds(others).likeliest(evidence.forms[name], FORMS):
            members = {**others, name: member}
            every, paid = scale.all(members), scale.paid(members)
            asked += [(every, [], own - paid, share) for own, share in evidence.by_share(every)]
            allowance = scale.allowance(members)
            if allowance is not None:
                bent = scale.shaped(members)
                asked += [(every, bent, own - paid, share) for own, share in evidence.by_share(every, allowance)]
        least = max(weight for _, _, weight, _ in asked) - UNLIKELY
        for every, bent, weight, share in asked:
            if weight > least:
                yield self._predicted(name, every, weight, share, bent)

    def _predicted(
        self, name: str, every: Sequence[Member], weight: float, share: float, bent: Sequence[Member]
    ) -> PredictedValues:
        """The prediction in closed form: regression on the columns of the members, and kriging of the background."""
        evidence, background, data = self.scale.evidence, self.background, self.background.data
        old = [self.free[0], *(m.size * evidence.groups[m.group].columns for m in every)]
        rows = [self.free[1], *(m.size * self.shown(m.group) for m in every)]
        if bent:
            numbers = evidence.numbers(every, share)
            both = [(m, z) for m, z in zip(every, numbers, strict=True) if m in bent]
            whole = np.sum([evidence.groups[m.group].columns @ z for m, z in both], axis=0)
            ahead = np.sum([self.shown(m.group) @ z for m, z in both], axis=0)
            old.append(MISSHAPEN * whole[:, None] * self.variations[0])
            rows.append(MISSHAPEN * ahead[:, None] * self.variations[1])
        columns, new = np.concatenate(old, axis=1), np.concatenate(rows, axis=1)
        if share not in self.carried:
            self.carried[share] = self._carried(share)
        carried, free = self.carried[share]
        more = columns[:, self.free[0].shape[1] :].T @ background.precision(share) / self.noise
        inside, size = np.concatenate([free, more]), share**2 * self.noise * background.sigma**2
        spread = np.linalg.inv(np.eye(columns.shape[1]) + inside @ columns)
        ahead_of = new - carried @ columns
        mean = carried @ data.y + ahead_of @ (spread @ (inside @ data.y))
        white = self.noise * background.sigma**2 * (1 + background.drift**2)
        covariance = ahead_of @ spread @ ahead_of.T + size * (self.everything - carried @ self.across.T)
        covariance[np.diag_indices_from(covariance)] += white
        return PredictedValues(name, weight, mean, cholesky((covariance + covariance.T) / 2, lower=True))
