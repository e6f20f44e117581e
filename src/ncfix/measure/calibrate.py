"""Calibration: the errors of a machine from measurements, by weighted least squares on the exact model.

Each step solves the linear problem with the set-up eliminated (`ncfix.measure.solve`) and adds the change; the residual
is always that of the exact, composed machine, so that what converges is the exact model (Gauss-Newton with the
Jacobian at the first guess, so that what cannot be told is the same in every step; its own error is of the size of the
errors and does not change where the iteration ends).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.special import chdtrc

from ncfix.diagnostics import Message, RefusedError, UsageError
from ncfix.machine import Machine
from ncfix.machine.plausible import functions, much
from ncfix.measure import weights
from ncfix.measure.measurement import Array, Index, Measurement
from ncfix.measure.observation import Mask, Observation
from ncfix.measure.observe import observe
from ncfix.measure.selection import Selection, select
from ncfix.measure.solve import Solution, solve

STEPS = 25
"""Most steps of the iteration."""
CONVERGED = 1e-5
"""Change of the predictions, in units of the noise, that is none."""
FAR = 1e6
"""The same: from here on it is no iteration any more."""
TINY = 1e-300
UNLIKELY = 0.01
"""Probability of so large a chi-square below which the noise is taken to be larger than it is said to be."""
ROUNDING = 1e-9
"""mm of reading per mm or rad of error: a column that is nowhere larger is made of rounding errors."""

HOPELESS = 240.0
"""A coefficient whose standard deviation is so many times what is much is held. What is held leads the others astray by
what it really is, so this is beyond what can be told together (Esmaeili 2021, 84 errors by 109 probings: 200 times),
and before single ones come out as centimetres, since only their sum is seen."""


@dataclass(frozen=True)
class Estimate:
    """Where the iteration ended.

    coefficients, unknowns  of the effects and of the set-up
    solution                the last linear step
    residual                values minus predictions, (m,), mm or rad
    weight                  (m,) 0 ... 1
    share                   how much of the squares of normal noise the weights leave: 1 if values count in full
    """

    coefficients: Array
    unknowns: Array
    solution: Solution
    residual: Array
    weight: Array
    share: float = 1.0

    def reduced(self, sigma: Array, freedom: int) -> float:
        """The reduced chi-square for standard deviations (m,): 1 if the residuals are as large as the noise."""
        squares = self.weight * (self.residual / sigma) ** 2
        return float(squares.sum() / (self.share * freedom))


@dataclass(frozen=True)
class Problem:
    """Several observations of one machine, stacked."""

    machine: Machine
    selection: Selection
    observations: tuple[Observation, ...]
    values: Array
    sigma: Array
    design: Array
    sizes: tuple[int, ...] = field(default=())

    @staticmethod
    def of(measurements: Sequence[Measurement], machine: Machine, selection: Selection) -> Problem:
        """Stack what the instruments saw."""
        seen = tuple(observe(measurement, machine) for measurement in measurements)
        values = np.concatenate([each.values for each in seen])
        sigma = np.concatenate([each.sigma for each in seen])
        design = np.concatenate([each.design(selection.estimated) for each in seen])
        design[:, np.abs(design).max(axis=0, initial=0.0) < ROUNDING] = 0.0
        return Problem(
            machine, selection, seen, values, sigma, design, tuple(len(each.unknowns.start) for each in seen)
        )

    @cached_property
    def stated(self) -> Mask:
        """Which values were stated by a certificate and not read, (m,): calibrated distances."""
        rows: Index = np.concatenate([each.rows for each in self.observations])
        return rows < 0

    @cached_property
    def limits(self) -> Array:
        """`HOPELESS` times what is much for each coefficient, (p,), mm or rad: who knows no better knows nothing."""
        parts = [np.zeros(0)]
        for effect in self.selection.estimated:
            largest = np.abs(functions(self.machine, effect)).max(axis=1)
            parts.append(HOPELESS * much(self.machine, effect.name) / np.maximum(largest, TINY))
        return np.concatenate(parts)

    @property
    def start(self) -> Array:
        """The first guess of what is unknown about the set-ups, one after another, (k,), mm or rad."""
        return np.concatenate([np.zeros(0), *(each.unknowns.start for each in self.observations)])

    @property
    def noise_known(self) -> bool:
        """Whether all instruments' noise is known."""
        return all(each.noise_known for each in self.observations)

    def residual(self, coefficients: Array, unknowns: Array) -> Array:
        """Values minus exact predictions, (m,), mm or rad, for coefficients (p,) and unknowns (k,)."""
        machine = self.selection.machine(self.machine, coefficients.tolist())
        parts = np.split(unknowns, np.cumsum(self.sizes)[:-1])
        predicted = [each.predict(machine, part) for each, part in zip(self.observations, parts, strict=True)]
        return self.values - np.concatenate(predicted)

    def nuisance(self, unknowns: Array) -> Array:
        """The derivative of predictions by the unknowns at `unknowns` (k,): (m, k), a block for each observation."""
        columns = np.zeros((len(self.values), sum(self.sizes)))
        parts = np.split(unknowns, np.cumsum(self.sizes)[:-1])
        row = column = 0
        for each, part in zip(self.observations, parts, strict=True):
            block = each.unknown_design(part)
            columns[row : row + len(block), column : column + block.shape[1]] = block
            row, column = row + len(block), column + block.shape[1]
        return columns


@dataclass(frozen=True)
class Calibration:
    """A calibrated machine and how well it is known.

    machine     with the estimated coefficients and their covariances
    problem     what was solved
    estimate    where it ended
    scale       factor on the standard deviations: 1 if the noise was known and explains the residuals
    remarks     what the user should know: what could not be told, outliers, noise
    before_um   rms of the lengths about the machine as it was, set-up fitted; after_um the same about the result; NaN
                if only angles were measured
    """

    machine: Machine
    problem: Problem
    estimate: Estimate
    scale: float
    remarks: tuple[Message, ...]
    before_um: float
    after_um: float

    @property
    def labels(self) -> tuple[str, ...]:
        """The names of the estimated coefficients."""
        return self.problem.selection.labels

    @property
    def freedom(self) -> int:
        """Degrees of freedom that are left."""
        return int((self.estimate.weight > 0).sum()) - self.estimate.solution.rank

    @property
    def chi_square(self) -> float:
        """The reduced chi-square: 1 if the residuals are as large as the noise."""
        return self.estimate.reduced(self.problem.sigma, max(self.freedom, 1))

    @property
    def covariance(self) -> Array:
        """Of all coefficients, (p, p); NaN where they were held."""
        p, kept = len(self.labels), self.estimate.solution.kept
        full = np.full((p, p), np.nan)
        full[np.ix_(kept, kept)] = self.estimate.solution.covariance * self.scale**2
        return full

    @property
    def sigma(self) -> Array:
        """The standard deviations of all coefficients, (p,); NaN where they were held."""
        deviations: Array = np.sqrt(np.diag(self.covariance))
        return deviations

    def uncertainty(self, design: Array) -> Array:
        """Standard deviation of a prediction with this design over the coefficients, (..., p) -> (...).

        `machine.design(q, state, selection.estimated)` gives that of the pose error. What was held counts as known.
        """
        kept = self.estimate.solution.kept
        own = design[..., kept]
        covariance = self.estimate.solution.covariance * self.scale**2
        deviation: Array = np.sqrt(np.einsum("...i,ij,...j->...", own, covariance, own))
        return deviation


def calibrate(
    measurements: Sequence[Measurement],
    machine: Machine,
    effects: str | Selection | None = None,
    loss: str = weights.AUTO,
    prune: float | None = None,
    knots: int = 0,
    time_constants: bool = False,
) -> Calibration:
    """Estimate the errors of a machine.

    effects  names, patterns, `all` or a model, see `ncfix.measure.selection`; None: those that the machine has
    loss     auto (gross outliers get no weight), none, huber or tukey
    prune    significance, e.g. 0.99, that a coefficient must have to stay; None keeps all
    knots    of new error motions of linear axes, which are cubics without; those that do not matter go with `prune`
    time_constants  estimate those of effects that lag, too

    Raises `UsageError` NCF630, NCF635, NCF637, NCF639, and `RefusedError` NCF623.
    """
    from ncfix.measure import contradictions, lags, pruning, results, suspects

    nothing = [message for each in measurements if (message := contradictions.untouched(each)) is not None]
    if nothing:
        raise RefusedError(tuple(nothing))

    selection = effects if isinstance(effects, Selection) else select(machine, effects, _point(measurements), knots)
    remarks: tuple[Message, ...] = ()
    if time_constants:
        late = lags.found(measurements, machine, selection)
        selection, remarks = late.selection, late.remarks
    problem = Problem.of(measurements, machine, selection)
    try:
        estimate = settle(problem, loss)
    except UsageError as error:
        why = suspects.suspected(problem) if error.code == "NCF637" else ()
        raise UsageError((*error.messages, *why, *(each for data in measurements for each in data.remarks))) from error
    if prune is not None:
        problem, estimate = pruning.pruned(problem, estimate, prune, loss)
    found = results.result(problem, estimate, loss)
    return replace(found, remarks=(*found.remarks, *remarks))


def _point(measurements: Sequence[Measurement]) -> list[float] | None:
    """The point at which errors were measured directly, if one was given."""
    texts = {measurement.header("point") for measurement in measurements if measurement.kind == "axis"} - {""}
    return [float(part) for part in texts.pop().split()] if len(texts) == 1 else None


def settle(problem: Problem, loss: str = weights.AUTO) -> Estimate:
    """Iterate to convergence; with `auto` once more without the outliers that a robust look finds."""
    _enough(problem)
    ones = np.ones(len(problem.values))
    estimate = _iterate(problem, ones, loss)
    if loss == weights.AUTO:
        outlying = weights.outliers(estimate.solution) & ~problem.stated
        if outlying.any():
            estimate = _iterate(problem, np.where(outlying, 0.0, ones), loss)
    scale = _scale(problem, estimate)
    unknown = np.sqrt(np.diag(estimate.solution.covariance)) * scale > problem.limits[estimate.solution.kept]
    if unknown.any() or (scale < 1 and (estimate.solution.weak or estimate.solution.combinations)):
        kept = estimate.weight if loss == weights.AUTO else ones
        estimate = _iterate(problem, kept, loss, scale)
    return estimate


def _scale(problem: Problem, estimate: Estimate) -> float:
    """How many times larger the noise is than its standard deviations say."""
    freedom = max(int((estimate.weight > 0).sum()) - estimate.solution.rank, 1)
    return noise_scale(problem, estimate.reduced(problem.sigma, freedom), freedom) or 1.0


def _enough(problem: Problem) -> None:
    """Refuse if nothing would be left to tell noise from error."""
    m, p = len(problem.values), int((np.abs(problem.design) > 0).any(axis=0).sum())
    nuisance = problem.nuisance(problem.start)
    k = int(np.linalg.matrix_rank(nuisance)) if nuisance.shape[1] else 0
    if m <= p + k:
        text = f"{m} values for {p} coefficients and {k} unknowns of the set-up"
        raise UsageError.of("NCF630", text, hint="measure more poses, or estimate fewer effects: --effects")


def _iterate(problem: Problem, weight: Array, loss: str, scale: float = 1.0) -> Estimate:
    """Gauss-Newton steps to convergence; `scale`: the noise is this many times larger than it is said to be."""
    coefficients, unknowns = problem.selection.start.copy(), problem.start
    design = problem.design / problem.sigma[:, None]
    nuisance = problem.nuisance(unknowns) / problem.sigma[:, None]
    for _ in range(STEPS):
        residual = problem.residual(coefficients, unknowns)
        target = residual / problem.sigma
        root = np.sqrt(weight)
        solution = solve(design * root[:, None], nuisance * root[:, None], target * root, problem.limits / scale)
        rest = (target - design @ solution.change) * root
        moved = np.linalg.lstsq(nuisance * root[:, None], rest, rcond=1e-11)[0] if nuisance.shape[1] else unknowns
        coefficients, unknowns = coefficients + solution.change, unknowns + moved
        change = design @ solution.change + nuisance @ moved
        settled = bool(np.abs(change).max(initial=0.0) < CONVERGED)
        if loss in (weights.HUBER, weights.TUKEY):
            before = weight
            weight = np.where(problem.stated, 1.0, weights.of(loss, target - change))
            settled = settled and bool(np.abs(weight - before).max() < 1e-3)
        if settled:
            residual = problem.residual(coefficients, unknowns)
            return Estimate(coefficients, unknowns, solution, residual, weight, weights.share(loss))
    if loss in (weights.HUBER, weights.TUKEY) and np.abs(change).max() < 0.1:
        residual = problem.residual(coefficients, unknowns)
        return Estimate(coefficients, unknowns, solution, residual, weight, weights.share(loss))
    size = float(np.abs(change).max())
    still = f"still change by {size:.3g} times the noise" if size < FAR else "run away"
    text = f"after {STEPS} steps the predictions {still}"
    raise UsageError.of("NCF637", text, hint="are the measurements of this machine, in mm and degree?")


def noise_scale(problem: Problem, chi_square: float, freedom: int) -> float:
    """The factor on the standard deviations: estimated if the noise is not known, never below one if it is."""
    if not problem.noise_known:
        return float(np.sqrt(chi_square))
    improbable = chdtrc(freedom, chi_square * freedom) < UNLIKELY
    return float(np.sqrt(chi_square)) if improbable else 1.0
