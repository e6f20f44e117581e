"""Poses chosen by exchange, so that whichever name is true, rivals that are refitted to them still err.

Each name in turn taken for the true one, and every other refitted to old and new rows together.
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
from ncfix.diagnosis.selection import ALIKE
from ncfix.measure.instruments import observe
from ncfix.measure.measurement import Measurement
from ncfix.measure.observation import Observation
from ncfix.values import frozen

COUNT = 12
"""Poses that are chosen."""
PASSES = 4
STARTS = 60
CLIMBED = 2
"""Of so many random dozens, so many are improved."""
LITTLE = 5e-3
"""A pass that gains less is the last one."""
LEAN = 0.01
"""What an e-fold of what is told apart is worth where the chance is nearly one or nearly nothing anyway."""
TOLD_APART = 6.0
"""Squared noise units from which on a rival may be told apart: then the odds are 20 to 1 in one of two measurements."""
WEAK = 1e-6
"""Prior on what is free, so that unseen combinations do no harm."""


@frozen(repr=False, slots=False)
class Discrimination:
    """One name against another that imitates it: information of the old rows, and the blocks of every pose on offer.

    matrix, vector, square  inner products of what may be refitted, of that with the signal, of the signal
    columns (n, r, k), signal (n, r)  of the poses on offer
    """

    matrix: Array
    vector: Array
    square: float
    columns: Array
    signal: Array

    def told(self, rows: Sequence[int]) -> float:
        """What of the signal the refitted rival cannot imitate with these poses too, squared noise units."""
        own = self.columns[list(rows)].reshape(-1, self.columns.shape[2])
        seen = self.signal[list(rows)].ravel()
        vector, square = self.vector + own.T @ seen, self.square + float(seen @ seen)
        return square - float(vector @ np.linalg.solve(self.matrix + own.T @ own, vector))

    def told_with(self, rows: Sequence[int]) -> Array:
        """As `told`, with these poses and one more, for every pose on offer, (n,): a block of rows added to a fit."""
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
        """What the old rows tell."""
        return self.told([])

    @cached_property
    def _seen(self) -> tuple[Array, Array]:
        """Covariance of the values of all poses on offer as the old rows leave it, (n r, n r), and what of the signal
        the rival that is fitted to the old rows misses there, (n r,).
        """
        factor = cholesky(self.matrix, lower=True)
        flat = self.columns.reshape(-1, self.columns.shape[2])
        white = solve_triangular(factor, flat.T, lower=True).T
        return white @ white.T, self.signal.ravel() - white @ solve_triangular(factor, self.vector, lower=True)


Round = Sequence[Discrimination]
"""A name that may be the true one, against each of the others."""


def chance(told: Array | Sequence[float] | float) -> Array:
    """How often a name that is right would be 20 to 1 likelier than one that is so well told apart from it.

    Log odds of what is told apart by t squared noise units scatter about t / 2 with a variance of t.
    """
    sure = np.maximum(np.asarray(told, dtype=np.float64), 1e-9)
    found: Array = ndtr((sure / 2 - ALIKE) / np.sqrt(sure))
    return found


def merit(told: Sequence[Array]) -> Array:
    """What poses are worth, (n,), that tell each name's worst rival apart so well, (n,): the chance that one stays."""
    worth = [chance(each) + LEAN * np.log1p(np.maximum(each, 0.0)) for each in told]
    found: Array = np.mean(worth, axis=0)
    return found


def worst(rounds: Sequence[Round], rows: Sequence[int]) -> list[float]:
    """How well the worst rival of each name is told apart with these poses."""
    return [min(each.told(rows) for each in own) for own in rounds]


def exchanged(rounds: Sequence[Round], count: int) -> list[int]:
    """Start with many random dozens, keep the best, and exchange one pose after another as long as that helps."""
    random = np.random.default_rng(0)
    starts = [random.permutation(count)[:COUNT].tolist() for _ in range(STARTS)]
    starts.sort(key=lambda rows: -_worth(rounds, rows))
    best = [climbed(rounds, rows) for rows in starts[:CLIMBED]]
    return max(best, key=lambda rows: _worth(rounds, rows))


def _worth(rounds: Sequence[Round], rows: Sequence[int]) -> float:
    return float(merit([np.asarray(each) for each in worst(rounds, rows)]))


def climbed(rounds: Sequence[Round], chosen: list[int]) -> list[int]:
    """Every pose in turn replaced by the one on offer that helps most."""
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
        if value < before + LITTLE:
            break
    return chosen


@frozen(repr=False, slots=False)
class Hypothesis:
    """A name with what it would be: its likeliest form, the numbers behind it, and all forms with their sizes in um."""

    group: EffectForm
    numbers: Array
    forms: tuple[tuple[EffectForm, float], ...]


@frozen(repr=False, slots=False)
class HypothesisPairs:
    """All contests between some names, over poses on offer.

    names     the first is the one that was chosen
    contests  for each name, were it true, one against each of the others in their order
    count     poses on offer
    """

    names: tuple[str, ...]
    contests: list[list[Discrimination]]
    count: int

    @staticmethod
    def of(evidence: Evidence, sides: Sequence[Hypothesis], offered: Measurement, sigma: float) -> HypothesisPairs:
        """The pairs between the sides; `sigma` is the noise of a value, um."""
        new = seen_at(evidence.background.data, offered)
        pairs = [[(true, other) for other in sides if other is not true] for true in sides]
        contests = [[_contest(evidence, new, *pair, sigma) for pair in own] for own in pairs]
        return HypothesisPairs(tuple(side.group.owner.name for side in sides), contests, len(offered))

    @cached_property
    def able(self) -> list[list[bool]]:
        """Whether all poses together would tell the other from the true one, for each contest."""
        return [[each.told(range(self.count)) > TOLD_APART for each in own] for own in self.contests]

    @cached_property
    def useful(self) -> list[list[Discrimination]]:
        """The contests that poses can decide, of the names that have any."""
        kept = [list(compress(own, can)) for own, can in zip(self.contests, self.able, strict=True)]
        return [own for own in kept if own]

    @property
    def told_from_first(self) -> tuple[str, ...]:
        """The other names that can be told from the first one, or it from them."""
        ways = zip(self.names[1:], self.able[0], self.able[1:], strict=True)
        return tuple(name for name, there, back in ways if there or back[0])

    @property
    def stuck(self) -> tuple[str, ...]:
        """The names that some other would imitate at all poses, were they true."""
        return tuple(name for name, can in zip(self.names, self.able, strict=True) if not all(can))


def seen_at(data: ResidualData, plan: Measurement) -> Observation:
    """What is seen at the poses of a plan: the components that files of its kind have, without values."""
    seen = {name for each in data.measurements if each.kind == plan.kind for name in each.measured}
    return observe(plan.with_columns({name: np.zeros(len(plan)) for name in sorted(seen)}), data.machine)


def _contest(evidence: Evidence, new: Observation, true: Hypothesis, other: Hypothesis, sigma: float) -> Discrimination:
    """Columns: set-up of the old rows, of the new ones, constants of the machine, the forms of the other."""
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
    """What the numbers of a form show in the poses on offer, um."""
    used = group.loading.any(axis=1)
    return new.um[:, None] * new.design(group.owner.effects)[:, used] @ group.loading[used]
