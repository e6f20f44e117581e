"""Constants of the machine file (location errors, gains) that differ from what the data say.

The data determine combinations of constants, so each constant by itself may look uncertain although the file is far
off. The fit holds the constants that the data cannot determine, exactly as `calibrate` does
(`ncfix.measure.least_squares.solve`). Among the others it seeks the smallest set whose change explains the misfit. Such
a set has log odds, like a named effect: its constants are independent a priori, of a common size at the tool tip, and
each pays a price for having been chosen among all. The distance of the file from the data, over all constants that can
be determined, is Mahalanobis' (chi-square).

All likelihoods of the ladder are of the same values, with only the set-up free. So the odds of constants, named effects
and mistakes are on one scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import chdtrc, logsumexp

from ncfix.arrays import Array, Ints, Mask
from ncfix.diagnosis.effect_form import side_by_side
from ncfix.diagnosis.evidence import FURTHER, SURE, Evidence, Member, marginal
from ncfix.diagnosis.residual_data import ResidualData
from ncfix.machine.effects import Unit, units
from ncfix.measure.least_squares import Combination, Solution, orthonormal, solve, without
from ncfix.measure.selection import Selection
from ncfix.values import frozen

FIRST_UM, TIMES, STEPS = 1.5, 3.0, 10
"""Assumed sizes of a change at the tool tip: `STEPS` of them, from `FIRST_UM` um on, each `TIMES` the one before."""
MAX_NAMED = 6
"""Largest number of constants that are named one by one; if more are off, the file as a whole is reported."""
DOUBT = 3.0
"""Standard deviations beyond which a difference, or an excess of chi-square, is significant."""
ALIAS_LOG_ODDS = 3.0
"""Log odds (20 to 1) within which another constant explains the data as well."""
MIN_GAIN = 0.1
"""Log odds that a change of the set must gain."""


@frozen
class MovedConstant:
    """A constant of the machine file whose value the data contradict.

    file, data  the value in the file and by the data, mm or rad; sigma: standard deviation of the latter
    unit     (factor from mm or rad to the usual unit, name of that unit)
    odds     log odds that it is off, given the others; aliases: constants that explain the same data as well
    size_um  rms change of the measured values by its correction, that part which the set-up cannot absorb
    """

    name: str
    file: float
    data: float
    sigma: float
    unit: Unit
    odds: float = 0.0
    aliases: tuple[str, ...] = ()
    size_um: float = 0.0

    @property
    def turned(self) -> bool:
        """Whether the data give the file's value with the opposite sign."""
        return abs(self.file) > DOUBT * self.sigma and abs(self.file + self.data) < DOUBT * self.sigma


@frozen(repr=False, slots=False)
class ConstantsVerdict:
    """The verdict of the data on all constants of the file together.

    change    (k,) correction to the file's values, mm or rad; zero for constants that stay
    moved     the constants that are significantly off, those with the largest effect first
    odds      log odds that any constant is off, less the price for the choice
    distance, freedom  chi-square of the file's constants against the data, and its degrees of freedom
    size_um   rms change of the measured values by all corrections, beside the set-up
    shown     (m,) change of each measured value by all corrections, um
    solution  the fit: which constants could not be determined, and which only in combinations
    paid      price of the changes, log odds
    whole     the file as a whole is off: more constants than can be named one by one
    """

    change: Array
    moved: tuple[MovedConstant, ...]
    odds: float
    distance: float
    freedom: int
    size_um: float
    shown: Array
    solution: Solution
    whole: bool
    paid: float

    def remedy(self, probed: str = "") -> str:
        """The advice to the user. `probed`: the rotary axis whose position is off, if only probing has measured it.

        A probe cannot distinguish an axis that has moved from a wrong axis point in the file.
        """
        anew = "use the new machine file, or calibrate the machine again"
        point = f"; if the control has another point of {probed} than the old file, "
        point += "correct the point in that file instead"
        return anew + point if probed else anew

    @property
    def p_value(self) -> float:
        """Probability of so large a distance if the file is right."""
        return float(chdtrc(max(self.freedom, 1), self.distance))

    @property
    def stay(self) -> Mask:
        """(k,) whether a constant keeps the file's value."""
        kept: Mask = self.change == 0
        return kept


@frozen(repr=False, slots=False)
class FileLikelihood:
    """Likelihood of the measured values given the machine file, with some constants changed and some effects added.

    evidence  the evidence of the data
    members   the effects that are added
    share     size of the background of small effects, in units of the noise
    """

    evidence: Evidence
    members: Sequence[Member]
    share: float

    @property
    def data(self) -> ResidualData:
        """The residual data of the diagnosis."""
        return self.evidence.background.data

    @cached_property
    def from_file(self) -> Array:
        """(m,) measured values minus the prediction of the unchanged file with the fitted set-up, um."""
        data = self.data
        back = data.problem.selection.start - data.coefficients
        return data.y - self.constants @ back

    @property
    def constants(self) -> Array:
        """(m, k) derivatives of the values by the free constants, um per mm or rad."""
        count = len(self.data.coefficients)
        return self.data.base[:, self.data.base.shape[1] - count :]

    @property
    def setup(self) -> Array:
        """(m, j) derivatives of the values by the unknowns of the set-up."""
        return self.data.base[:, : self.data.base.shape[1] - len(self.data.coefficients)]

    @cached_property
    def white(self) -> tuple[list[Array], float]:
        """Whitened columns of set-up (m, j), members at their sizes (m, p), constants (m, k) and the values (m, 1); and
        the log determinant of the covariance of noise and background.

        They are multiplied by a root of the inverse covariance, (m, m), which is not kept: it is large.
        """
        groups = self.evidence.groups
        named = [m.size * groups[m.group].columns for m in self.members]
        parts = (self.setup, side_by_side([self.setup[:, :0], *named]), self.constants, self.from_file[:, None])
        root = cholesky(self.evidence.background.precision(self.share), check_finite=False)
        return [root @ part for part in parts], -2 * float(np.log(np.diag(root)).sum())

    @cached_property
    def free(self) -> tuple[Array, float]:
        """An orthonormal basis of the white set-up, and the log of its determinant."""
        white = self.white[0][0]
        size = np.linalg.norm(white, axis=0)
        scaled = white[:, size > 0] / size[size > 0]
        left, values, _ = np.linalg.svd(scaled, full_matrices=False)
        kept = values > 1e-9 * values.max(initial=1e-300)
        return left[:, kept], 2 * float(np.log(values[kept]).sum() + np.log(size[size > 0]).sum())

    @cached_property
    def sizes(self) -> Array:
        """(k,) rms effect of each constant on the values, um per mm or rad; zero if the data do not see it."""
        return np.array([self.data.size(column) for column in self.constants.T])

    @cached_property
    def _products(self) -> tuple[Array, Array, float]:
        """Inner products of the whitened columns Z (members at their sizes, constants at 1 um) and values y, all
        orthogonal to the set-up: Z'Z, Z'y and y'y.
        """
        _, named, constants, y = self.white[0]
        unit = constants / np.where(self.sizes > 0, self.sizes, 1.0)
        left = without(self.free[0], np.concatenate([named, unit, y], axis=1))
        inner = left.T @ left
        return inner[:-1, :-1], inner[:-1, -1], float(inner[-1, -1])

    def likelihood(self, moved: Sequence[int] = ()) -> float:
        """Log likelihood of the values if the constants with the indices `moved` are off, averaged over all sizes."""
        if not len(moved):
            return self._at((), 1.0)
        return float(logsumexp([self._at(moved, size) for size in self._steps]) - np.log(len(self._steps)))

    @property
    def _steps(self) -> Array:
        return FIRST_UM * np.power(TIMES, np.arange(STEPS, dtype=np.float64))

    def _at(self, moved: Sequence[int], size: float) -> float:
        inner, seen, total = self._products
        named = self.white[0][1].shape[1]
        places = [*range(named), *(named + k for k in moved)]
        scale = np.concatenate([np.ones(named), np.full(len(moved), size)])
        gram = np.eye(len(places)) + scale[:, None] * inner[np.ix_(places, places)] * scale
        factor = cholesky(gram, lower=True, check_finite=False)
        own = solve_triangular(factor, scale * seen[places], lower=True, check_finite=False)
        freedom, basis = self.evidence.background.freedom, self.free
        count = len(self.from_file) - basis[0].shape[1]
        squares = max(total - float(own @ own), 0.0)
        determinant = 2 * float(np.log(np.diag(factor)).sum()) + self.white[1] + basis[1]
        return marginal(squares, determinant, count, freedom)

    def solution(self, first: Sequence[int] = ()) -> Solution:
        """Least-squares changes of all constants beside set-up and members; undetermined constants are held.

        Where the data see only a combination of constants, those in `first` are fitted and the others held.
        """
        setup, named, constants, y = self.white[0]
        extra, scale = named.shape[1], np.linalg.norm(self.setup, axis=0)
        beside = np.concatenate([setup / np.where(scale > 0, scale, 1.0), named], axis=1)
        prior = np.concatenate([np.zeros((extra, setup.shape[1])), np.eye(extra)], axis=1)
        still = np.zeros((extra, constants.shape[1]))
        limits = self.data.problem.limits.copy()
        limits[list(first)] = np.inf  # badly determined with all others free, it may be well determined by itself
        order = np.array([*first, *(k for k in range(still.shape[1]) if k not in set(first))], dtype=np.int64)
        found = solve(
            np.concatenate([constants, still])[:, order],
            np.concatenate([beside, prior]),
            np.concatenate([y[:, 0], np.zeros(extra)]),
            limits[order],
        )
        return _renumbered(found, order)


def judged_constants(evidence: Evidence, members: Sequence[Member], share: float) -> ConstantsVerdict:
    """The constants that the data contradict, given the effects in `members`."""
    asked = FileLikelihood(evidence, members, share)
    data, k = asked.data, len(asked.data.coefficients)
    plainly = asked.solution()
    offered = [each for each in range(k) if each not in {*plainly.unseen, *plainly.set_up}]
    chosen = _chosen(asked, offered)
    solution = asked.solution(chosen)
    kept = solution.kept
    chosen = [each for each in chosen if each in kept]
    scale = evidence.noise(members, share)
    inner = _inverse(solution.covariance)
    full = solution.change[kept]
    seen = inner @ full
    distance = float(full @ seen) / scale
    places = np.array([kept.tolist().index(each) for each in chosen], dtype=np.int64)
    explained = _gained(inner, seen, places) / scale
    left, spare = distance - explained, len(kept) - len(chosen)
    whole = spare > 0 and left > spare + DOUBT * np.sqrt(2 * spare) and left > 2 * DOUBT**2
    whole &= left > explained or len(chosen) == MAX_NAMED  # else the chosen ones matter, the rest is daily change
    every = [int(each) for each in kept]
    whole = whole and _weight(asked, every, offered) > asked.likelihood()  # else all of them vary from day to day
    if whole:
        chosen, places = every, np.arange(len(every), dtype=np.int64)
    spread: Array = _inverse(inner[np.ix_(places, places)])
    change = np.zeros(k)
    change[chosen] = spread @ seen[places]
    odds = _weight(asked, chosen, offered) - asked.likelihood()
    basis = orthonormal(asked.setup / data.relative[:, None])

    def beside(shown: Array) -> Array:
        return without(basis, (shown / data.relative)[:, None])[:, 0] * data.relative

    sigma: Array = np.sqrt(np.diag(spread) * scale)
    start, labels = data.problem.selection.start, names_of(data.problem.selection)
    said = [unit for effect in data.problem.selection.estimated for unit in units(data.machine, effect)]
    moved = []
    for place, index in enumerate(chosen):
        size = data.size(beside(asked.constants[:, index] * change[index]))
        own, alike = (0.0, ()) if whole else _own(asked, chosen, index, offered)
        if whole and abs(change[index]) <= DOUBT * sigma[place]:
            continue
        value = float(start[index])
        data_value = value + float(change[index])
        moved.append(
            MovedConstant(
                labels[index],
                value,
                data_value,
                float(sigma[place]),
                said[index],
                own,
                tuple(labels[each] for each in alike),
                size,
            )
        )
    shown = beside(asked.constants @ change)
    moved.sort(key=lambda each: -each.size_um)
    paid = _price(len(chosen), len(offered))
    return ConstantsVerdict(
        change, tuple(moved), odds, distance, len(kept), data.size(shown), shown, solution, bool(whole), paid
    )


def _inverse(matrix: Array) -> Array:
    """The inverse of a matrix, which may be empty."""
    return np.asarray(np.linalg.inv(matrix) if len(matrix) else matrix, dtype=np.float64)


def names_of(selection: Selection) -> list[str]:
    """A name for each free constant: the name of its effect if that has one coefficient only, else with the power."""
    names = [effect.name for effect in selection.estimated for _ in range(effect.basis.size)]
    return [name if names.count(name) == 1 else label for name, label in zip(names, selection.labels, strict=True)]


def _gained(inner: Array, seen: Array, places: Ints) -> float:
    """Part of chi-square that the constants at `places` explain."""
    own = seen[places]
    return float(own @ np.linalg.solve(inner[np.ix_(places, places)], own)) if len(places) else 0.0


def _price(count: int, among: int) -> float:
    """Price, log odds, of changing `count` constants chosen from `among`."""
    return count * float(np.log(max(among, 1))) + SURE + (count - 1) * FURTHER if count else 0.0


def _weight(asked: FileLikelihood, moved: Sequence[int], offered: Sequence[int]) -> float:
    """Log likelihood with these constants off, less their price."""
    return asked.likelihood(moved) - _price(len(moved), len(offered))


def _chosen(asked: FileLikelihood, offered: Sequence[int]) -> list[int]:
    """The set of constants with the largest weight, found by adding, exchanging and dropping one at a time."""

    def weight(chosen: Sequence[int]) -> float:
        return _weight(asked, chosen, offered)

    chosen: list[int] = []
    best = weight(chosen)
    while True:
        tried = [[*chosen, each] for each in offered if each not in chosen and len(chosen) < MAX_NAMED]
        for out in chosen:
            less = [each for each in chosen if each != out]
            tried += [less, *([*less, each] for each in offered if each not in chosen)]
        candidate = max(tried, key=weight, default=chosen)
        if weight(candidate) <= best + MIN_GAIN:
            return sorted(chosen)
        chosen, best = candidate, weight(candidate)


def _own(
    asked: FileLikelihood, chosen: Sequence[int], index: int, offered: Sequence[int]
) -> tuple[float, tuple[int, ...]]:
    """Log odds that constant `index` is off, given the other chosen ones; and the constants that do as well instead."""
    others = [each for each in chosen if each != index]
    with_all, less = asked.likelihood(chosen), asked.likelihood(others)
    near = with_all - ALIAS_LOG_ODDS
    alike = [each for each in offered if each not in chosen and asked.likelihood([*others, each]) > near]
    return with_all - less - float(np.log(max(len(offered), 1))), tuple(alike)


def _renumbered(found: Solution, order: Ints) -> Solution:
    """A solution with its columns in the original order: column i of `found` is constant `order[i]`."""
    change = np.zeros(len(order))
    change[order] = found.change
    back = np.argsort(order[found.kept])

    def those(numbers: Sequence[int]) -> tuple[int, ...]:
        return tuple(int(order[each]) for each in numbers)

    return replace(
        found,
        change=change,
        kept=order[found.kept][back],
        covariance=found.covariance[np.ix_(back, back)],
        orthogonal=found.orthogonal,
        unseen=those(found.unseen),
        set_up=those(found.set_up),
        weak=those(found.weak),
        combinations=tuple(
            Combination(int(order[each.held]), those(each.others), each.factors) for each in found.combinations
        ),
    )
