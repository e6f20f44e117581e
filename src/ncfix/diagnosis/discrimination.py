"""Choice of poses that discriminate between names, by an exchange algorithm (T-optimal design).

Each name in turn is taken as true, and every rival is refitted to old and new rows together. Poses are good if the
refitted rivals still deviate.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import compress

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import ndtr

from ncfix.arrays import Array
from ncfix.diagnosis.effect_form import EffectForm
from ncfix.diagnosis.evidence import Evidence
from ncfix.diagnosis.residual_data import ResidualData
from ncfix.diagnosis.selection import ALIAS_LOG_ODDS
from ncfix.measure.instruments import observe
from ncfix.measure.measurement import Measurement
from ncfix.measure.observation import Observation
from ncfix.values import frozen

COUNT = 12
"""Number of poses that are chosen."""
PASSES = 4
"""Largest number of passes of the exchange over all chosen poses."""
STARTS = 60
CLIMBED = 2
"""Number of random starting sets, and of the best of them that are improved by exchange."""
MIN_MERIT_GAIN = 5e-3
"""A pass of the exchange that gains less is the last one."""
LEAN = 0.01
"""Worth of an e-fold more discrimination, which decides where the chance is nearly one or nearly zero anyway."""
TOLD_APART = 6.0
"""Squared difference, in units of the noise, from which on a rival can be told apart: then one measurement in two gives
odds of 20 to 1."""
WEAK = 1e-6
"""Prior precision of the free parameters, which keeps the matrix regular."""


@frozen(repr=False, slots=False)
class Discrimination:
    """A true name against a refitted rival: normal equations of the old rows, and the rows of n poses on offer.

    matrix (k, k), vector (k,), square  inner products of the refitted columns, with the signal of the true name, and of
                                        that signal, over the old rows, in units of the noise
    columns (n, r, k), signal (n, r)    the same columns and signal at the poses on offer, r values each
    """

    matrix: Array
    vector: Array
    square: float
    columns: Array
    signal: Array

    def told(self, rows: Sequence[int]) -> float:
        """Squared signal, in units of the noise, that the rival refitted to old rows and these poses cannot imitate."""
        own = self.columns[list(rows)].reshape(-1, self.columns.shape[2])
        seen = self.signal[list(rows)].ravel()
        vector, square = self.vector + own.T @ seen, self.square + float(seen @ seen)
        return square - float(vector @ np.linalg.solve(self.matrix + own.T @ own, vector))

    def told_with(self, rows: Sequence[int]) -> Array:
        """`told` for these poses plus each pose on offer in turn, (n,), by a block update of the fit."""
        products, missed = self._seen
        count, height = self.signal.shape
        taken = (height * np.asarray(rows, dtype=np.int64)[:, None] + np.arange(height)).ravel()
        across, fitted = products[:, taken], missed[taken]
        inverse = np.linalg.inv(products[np.ix_(taken, taken)] + np.eye(len(taken)))
        left = (missed - across @ (inverse @ fitted)).reshape(count, height)
        blocks = products.reshape(count, height, count, height)[np.arange(count), :, np.arange(count)]
        weighed, own = (across @ inverse).reshape(count, height, -1), across.reshape(count, height, -1)
        spread = np.eye(height) + blocks - weighed @ own.swapaxes(1, 2)
        gain = (left * np.linalg.solve(spread, left[:, :, None])[:, :, 0]).sum(axis=1)
        found: Array = self._alone + float(fitted @ inverse @ fitted) + gain
        return found

    @cached_property
    def _alone(self) -> float:
        """`told` of the old rows alone."""
        return self.told([])

    @cached_property
    def _seen(self) -> tuple[Array, Array]:
        """For all poses on offer: covariance (n r, n r) of the rival's prediction from the old rows, and the signal
        minus that prediction, (n r,).
        """
        factor = cholesky(self.matrix, lower=True)
        flat = self.columns.reshape(-1, self.columns.shape[2])
        white = solve_triangular(factor, flat.T, lower=True).T
        return white @ white.T, self.signal.ravel() - white @ solve_triangular(factor, self.vector, lower=True)


Round = Sequence[Discrimination]
"""One name taken as true, against each of the others."""


def chance(told: Array | Sequence[float] | float) -> Array:
    """Probability that the true name becomes 20 to 1 likelier than a rival at a squared distance `told`.

    At a squared distance t, in units of the noise, the log odds have mean t / 2 and variance t.
    """
    sure = np.maximum(np.asarray(told, dtype=np.float64), 1e-9)
    found: Array = ndtr((sure / 2 - ALIAS_LOG_ODDS) / np.sqrt(sure))
    return found


def merit(told: Sequence[Array]) -> Array:
    """Merit (n,) of sets of poses; `told`: for each name taken as true the squared distance (n,) of its worst rival."""
    worth = [chance(each) + LEAN * np.log1p(np.maximum(each, 0.0)) for each in told]
    found: Array = np.mean(worth, axis=0)
    return found


def worst(rounds: Sequence[Round], rows: Sequence[int]) -> list[float]:
    """For each name taken as true, the squared distance of its worst rival with these poses."""
    return [min(each.told(rows) for each in own) for own in rounds]


def exchanged(rounds: Sequence[Round], count: int) -> list[int]:
    """The best set of poses: many random starting sets, the best of them improved by exchange of single poses."""
    random = np.random.default_rng(0)
    starts = [random.permutation(count)[:COUNT].tolist() for _ in range(STARTS)]
    starts.sort(key=lambda rows: -_worth(rounds, rows))
    best = [climbed(rounds, rows) for rows in starts[:CLIMBED]]
    return max(best, key=lambda rows: _worth(rounds, rows))


def _worth(rounds: Sequence[Round], rows: Sequence[int]) -> float:
    return float(merit([np.asarray(each) for each in worst(rounds, rows)]))


def climbed(rounds: Sequence[Round], chosen: list[int]) -> list[int]:
    """The set improved by replacing each pose in turn with the best one on offer."""
    value = _worth(rounds, chosen)
    for _ in range(PASSES):
        before = value
        for place in range(len(chosen)):
            rest = [*chosen[:place], *chosen[place + 1 :]]
            told = merit([np.min([each.told_with(rest) for each in own], axis=0) for own in rounds])
            told[rest] = -np.inf
            best = int(told.argmax())
            if told[best] > value:
                chosen, value = [*chosen[:place], best, *chosen[place + 1 :]], float(told[best])
        if value < before + MIN_MERIT_GAIN:
            break
    return chosen


@frozen(repr=False, slots=False)
class Hypothesis:
    """A candidate name as it was fitted to the data.

    group    its likeliest form
    numbers  the independent numbers of that form, um
    forms    several of its forms, each with a size, um
    """

    group: EffectForm
    numbers: Array
    forms: tuple[tuple[EffectForm, float], ...]


@frozen(repr=False, slots=False)
class HypothesisPairs:
    """All pairs of a true name and a rival, over the poses on offer.

    names     the first is the selected one
    contests  for each name taken as true: one discrimination from each of the others, in their order
    count     number of poses on offer
    """

    names: tuple[str, ...]
    contests: list[list[Discrimination]]
    count: int

    @staticmethod
    def of(evidence: Evidence, sides: Sequence[Hypothesis], offered: Measurement, sigma: float) -> HypothesisPairs:
        """All pairs between the hypotheses `sides`; `sigma` is the noise of a value, um."""
        new = seen_at(evidence.background.data, offered)
        pairs = [[(true, other) for other in sides if other is not true] for true in sides]
        contests = [[_contest(evidence, new, *pair, sigma) for pair in own] for own in pairs]
        return HypothesisPairs(tuple(side.group.owner.name for side in sides), contests, len(offered))

    @cached_property
    def able(self) -> list[list[bool]]:
        """For each contest, whether all poses on offer together would tell the rival from the true name."""
        return [[each.told(range(self.count)) > TOLD_APART for each in own] for own in self.contests]

    @cached_property
    def useful(self) -> list[list[Discrimination]]:
        """The contests that the poses on offer can decide; names without any are left out."""
        kept = [list(compress(own, can)) for own, can in zip(self.contests, self.able, strict=True)]
        return [own for own in kept if own]

    @property
    def told_from_first(self) -> tuple[str, ...]:
        """The other names that can be told from the first one, or the first one from them."""
        ways = zip(self.names[1:], self.able[0], self.able[1:], strict=True)
        return tuple(name for name, there, back in ways if there or back[0])

    @property
    def stuck(self) -> tuple[str, ...]:
        """The names that, if true, some other name would imitate at all poses on offer."""
        return tuple(name for name, can in zip(self.names, self.able, strict=True) if not all(can))


def seen_at(data: ResidualData, plan: Measurement) -> Observation:
    """The observation at the poses of a plan, without values: with the components that files of its kind have."""
    seen = {name for each in data.measurements if each.kind == plan.kind for name in each.measured}
    return observe(plan.with_columns({name: np.zeros(len(plan)) for name in sorted(seen)}), data.machine)


def _contest(evidence: Evidence, new: Observation, true: Hypothesis, other: Hypothesis, sigma: float) -> Discrimination:
    """The discrimination of `true` from `other`, which is refitted with both set-ups and the constants."""
    data = evidence.background.data
    constants = data.problem.design.shape[1]
    used = data.base.shape[1] - constants
    setup = new.um[:, None] * new.unknown_design(new.unknowns.start)
    fresh, weight = setup.shape[1], 1 / (sigma * data.relative)
    imitating = [size * group.columns for group, size in other.forms]
    old = np.concatenate([data.base[:, :used], np.zeros((len(data.y), fresh)), data.base[:, used:], *imitating], axis=1)
    imitating = [size * _shown(new, group) for group, size in other.forms]
    kinematic = new.um[:, None] * new.design(data.problem.selection.estimated)
    rows = np.concatenate([np.zeros((len(setup), used)), setup, kinematic, *imitating], axis=1)
    free = used + fresh + constants
    scale = np.ones(old.shape[1])
    scale[:free] = np.sqrt((old[:, :free] ** 2).mean(axis=0) + (rows[:, :free] ** 2).mean(axis=0))
    scale = np.where(scale > 0, scale, 1.0)
    prior = np.concatenate([np.full(free, WEAK), np.ones(old.shape[1] - free)])
    old, rows = old / scale * weight[:, None], rows / scale / sigma
    signal = (true.group.columns @ true.numbers) * weight
    count = len(new.measurement)
    return Discrimination(
        old.T @ old + np.diag(prior), old.T @ signal, float(signal @ signal),
        rows.reshape(count, -1, rows.shape[1]), (_shown(new, true.group) @ true.numbers / sigma).reshape(count, -1),
    )  # fmt: skip


def _shown(new: Observation, group: EffectForm) -> Array:
    """Effect of the numbers of a form at the poses on offer, um."""
    used = group.loading.any(axis=1)
    return new.um[:, None] * new.design(group.owner.effects)[:, used] @ group.loading[used]
