"""Least squares on the exact model of a machine: the stacked problem, its solution and residuals.

Each step solves the linear problem with the set-up eliminated (`ncfix.measure.least_squares`) and adds the change. The
residual is always that of the exact, composed machine, so the iteration converges to the exact model. The Jacobian is
that at the first guess in all steps, so the undetermined coefficients are always the same; its small error does not
affect the result.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy.special import chdtrc

from ncfix.arrays import Array, Ints, Mask
from ncfix.diagnostics import Message, Place, UsageError
from ncfix.machine import Effect, Machine
from ncfix.machine.error_model import signals_of
from ncfix.machine.plausible import METRE, functions, much, reach
from ncfix.machine.state import inputs_of
from ncfix.measure import least_squares
from ncfix.measure.instruments import observe
from ncfix.measure.least_squares import Solution, gauss_newton, solve
from ncfix.measure.measurement import Measurement
from ncfix.measure.observation import Observation
from ncfix.measure.selection import LOCATIONS, Selection
from ncfix.values import frozen

STEPS = 25
"""Largest number of steps."""
CONVERGED = 1e-5
"""Largest change of a prediction, in units of the noise, at convergence."""
STEADY, CLOSE = 1e-3, 0.1
"""Largest change of a robust weight at convergence; of a prediction, accepted if the weights do not settle."""
DIVERGED = 1e6
"""Change of a prediction, in units of the noise, from which the iteration is said to run away."""
TINY = 1e-300
UNLIKELY = 0.01
"""Probability of chi-square below which the noise is assumed to be larger than stated."""
ROUNDING = 1e-9
"""A column of the design with no larger element, mm of reading per mm or rad of error, is rounding error: zero."""

HOPELESS = 240.0
"""A coefficient is held if its standard deviation exceeds this many times a large error (`plausible.much`). A held
coefficient biases the others by its true value, so the limit is above what is determined jointly in practice (Esmaeili
2021, 84 errors by 109 probings: 200 times), and below the centimetres of coefficients of which only the sum is seen."""
WIDE = 0.05
"""Upper bound of that limit: rad for angles, and times the machine's reach (at least a metre) for lengths. Larger steps
would leave the linear range of the equations."""


@frozen(slots=False)
class Estimate:
    """The result of the iteration.

    coefficients, unknowns  of the effects (p,), and of the set-ups (k,), mm or rad
    solution                the last linear step
    residual                values minus predictions, (m,), mm or rad
    weight                  (m,) robust weights, 0 ... 1
    share                   expected weighted mean square of normal noise of variance one; 1 without robust weights
    left_out                insignificant coefficients that were removed from the model
    """

    coefficients: Array
    unknowns: Array
    solution: Solution
    residual: Array
    weight: Array
    share: float = 1.0
    left_out: LeftOut | None = None

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the residual."""
        return int((self.weight > 0).sum()) - self.solution.rank

    def chi_square(self, sigma: Array) -> float:
        """Reduced chi-square for standard deviations `sigma` (m,): 1 if the residuals are as large as the noise."""
        squares = self.weight * (self.residual / sigma) ** 2
        return float(squares.sum() / (self.share * max(self.freedom, 1)))

    def covariance(self, scale: float) -> Array:
        """Covariance of all coefficients, (p, p), for a noise `scale` times the stated one; NaN if held."""
        full, kept = np.full((len(self.coefficients), len(self.coefficients)), np.nan), self.solution.kept
        own = self.solution.covariance
        if self.left_out is not None:
            of_all = np.flatnonzero(self.left_out.stays)[kept]
            own = self.left_out.covariance[np.ix_(of_all, of_all)]
        full[np.ix_(kept, kept)] = own * scale**2
        return full


@frozen(slots=False)
class LeftOut:
    """Insignificant coefficients that were removed from a model; they are not known to be exactly zero.

    selection   the selection before the removal, of q coefficients
    stays       (q,) mask of the coefficients that the model keeps
    covariance  (q, q) covariance of all q about the model's values, for a noise of one; zero if held
    """

    selection: Selection
    stays: Mask
    covariance: Array


@frozen(slots=False)
class Problem:
    """Several observations of one machine, stacked.

    values  (m,) readings, mm or rad; sigma (m,): their standard deviations
    design  (m, p) derivatives of the predictions by the estimated coefficients
    """

    machine: Machine
    selection: Selection
    observations: tuple[Observation, ...]
    values: Array
    sigma: Array
    design: Array

    @staticmethod
    def of(measurements: Sequence[Measurement], machine: Machine, selection: Selection) -> Problem:
        """Stack the observations of several measurements."""
        seen = tuple(observe(measurement, machine) for measurement in measurements)
        values = np.concatenate([each.values for each in seen])
        sigma = np.concatenate([each.sigma for each in seen])
        design = np.ascontiguousarray(np.concatenate([each.design(selection.estimated) for each in seen]))
        design[:, np.abs(design).max(axis=0, initial=0.0) < ROUNDING] = 0.0
        return Problem(machine, selection, seen, values, sigma, design)

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """Number of unknowns of each observation."""
        return tuple(len(each.unknowns.start) for each in self.observations)

    @cached_property
    def stated(self) -> Mask:
        """Mask (m,) of the calibrated distances, which a certificate states."""
        rows: Ints = np.concatenate([each.rows for each in self.observations])
        return rows < 0

    @cached_property
    def um(self) -> Array:
        """Factor of each value to um, (m,); an angle counts as the displacement at half the machine's reach."""
        return np.concatenate([each.um for each in self.observations])

    @cached_property
    def limits(self) -> Array:
        """Standard deviation above which each coefficient is held, (p,), mm or rad; see `HOPELESS` and `WIDE`."""
        parts, far = [np.zeros(0)], WIDE * max(reach(self.machine), METRE)
        for effect in self.selection.estimated:
            largest = np.abs(functions(self.machine, effect)).max(axis=1)
            most = min(HOPELESS * much(self.machine, effect.name), WIDE if effect.name[1] in "ABC" else far)
            parts.append(most / np.maximum(largest, TINY))
        return np.concatenate(parts)

    @cached_property
    def fleeting(self) -> Mask:
        """Mask (p,) of the coefficients of effects that depend on a temperature, a load, the time, ..."""
        follows = [bool(_followed(self.machine, effect)) for effect in self.selection.estimated]
        return np.repeat(np.array(follows, dtype=np.bool_), [each.basis.size for each in self.selection.estimated])

    @property
    def start(self) -> Array:
        """First guess of the unknowns of all set-ups, (k,), mm or rad."""
        return np.concatenate([np.zeros(0), *(each.unknowns.start for each in self.observations)])

    @property
    def noise_known(self) -> bool:
        """Whether the noise of all instruments is known."""
        return all(each.noise_known for each in self.observations)

    @cached_property
    def columns(self) -> Array:
        """Derivatives by coefficients and unknowns at the first guess, in units of the noise, (m, p + k)."""
        return np.concatenate([self.design, self.nuisance(self.start)], axis=1) / self.sigma[:, None]

    def residual(self, coefficients: Array, unknowns: Array) -> Array:
        """Values minus exact predictions, (m,), mm or rad, for coefficients (p,) and unknowns (k,)."""
        machine = self.selection.machine(self.machine, coefficients.tolist())
        parts = np.split(unknowns, np.cumsum(self.sizes)[:-1])
        predicted = [each.predict(machine, part) for each, part in zip(self.observations, parts, strict=True)]
        return self.values - np.concatenate(predicted)

    def nuisance(self, unknowns: Array) -> Array:
        """Derivatives (m, k) of the predictions by the unknowns, at `unknowns` (k,); block diagonal by observation."""
        columns = np.zeros((len(self.values), sum(self.sizes)))
        parts = np.split(unknowns, np.cumsum(self.sizes)[:-1])
        row = column = 0
        for each, part in zip(self.observations, parts, strict=True):
            block = each.unknown_design(part)
            columns[row : row + len(block), column : column + block.shape[1]] = block
            row, column = row + len(block), column + block.shape[1]
        return columns


@frozen(eq=False, slots=False)
class Calibration:
    """A calibrated machine and its uncertainty.

    machine     the machine with estimated coefficients and their covariances
    problem     the least-squares problem
    estimate    its solution
    scale       factor on the standard deviations: 1 if the noise was known and explains the residuals
    remarks     remarks for the user: undetermined coefficients, outliers, noise
    before_um   rms residual of lengths with the given machine, set-up fitted, um; after_um: with the result;
                NaN if only angles were measured
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
    def chi_square(self) -> float:
        """The reduced chi-square: 1 if the residuals are as large as the noise."""
        return self.estimate.chi_square(self.problem.sigma)

    @property
    def covariance(self) -> Array:
        """Covariance of all coefficients, (p, p); NaN if held."""
        return self.estimate.covariance(self.scale)

    @property
    def sigma(self) -> Array:
        """Standard deviations of all coefficients, (p,); NaN if held."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def asked(self) -> Selection:
        """The selection that was asked for, including coefficients that were removed since."""
        return self.problem.selection if self.estimate.left_out is None else self.estimate.left_out.selection

    def uncertainty(self, design: Array) -> Array:
        """Standard deviation (...) of a prediction with design (..., p) over the coefficients of `asked`.

        `machine.design(q, state, asked.estimated)` is the design of the pose error. Held coefficients count as known.
        """
        left_out = self.estimate.left_out
        covariance = np.nan_to_num(self.covariance) if left_out is None else left_out.covariance * self.scale**2
        return np.sqrt(np.einsum("...i,ij,...j->...", design, covariance, design))


def _followed(machine: Machine, effect: Effect) -> frozenset[str]:
    return inputs_of(each for each in signals_of(machine.axes, effect) if each is not None) - {"tool_length"}


def fit(problem: Problem, loss: str = least_squares.AUTO) -> Estimate:
    """Iterate to convergence; with loss `auto` repeat without the outliers that a robust fit finds.

    Raises `UsageError` NCF630 and NCF637.
    """
    _enough(problem)
    ones, first = np.ones(len(problem.values)), 1.0
    try:
        estimate = _iterate(problem, ones, loss)
    except UsageError:
        if problem.noise_known:
            raise
        first = _first_scale(problem)
        estimate = _iterate(problem, ones, loss, first)
    if loss == least_squares.AUTO:
        outlying = least_squares.outliers(estimate.solution) & ~problem.stated
        if outlying.any():
            estimate = _iterate(problem, np.where(outlying, 0.0, ones), loss, first)
    scale = noise_scale(problem, estimate) or 1.0
    unknown = np.sqrt(np.diag(estimate.solution.covariance)) * scale > problem.limits[estimate.solution.kept]
    if unknown.any() or (scale < 1 and (estimate.solution.weak or estimate.solution.combinations)):
        kept = estimate.weight if loss == least_squares.AUTO else ones
        estimate = _iterate(problem, kept, loss, scale)
    return estimate


def _enough(problem: Problem) -> None:
    """Refuse a problem without degrees of freedom: NCF630."""
    m, p = len(problem.values), int((np.abs(problem.design) > 0).any(axis=0).sum())
    nuisance = problem.nuisance(problem.start)
    k = int(np.linalg.matrix_rank(nuisance)) if nuisance.shape[1] else 0
    if m <= p + k:
        text = f"{m} values are too few for {p} coefficients and {k} unknowns of the set-up"
        hint = f'measure more poses, or estimate fewer effects: --effects "{LOCATIONS}" asks where axes lie'
        raise UsageError.of("NCF630", text, hint=hint)


def _first_scale(problem: Problem) -> float:
    """Factor on an unknown noise, estimated by the residual of the first linear step."""
    design, nuisance = np.split(problem.columns, [problem.design.shape[1]], axis=1)
    target = problem.residual(problem.selection.start, problem.start) / problem.sigma
    solution = solve(design, nuisance, target, problem.limits, problem.fleeting)
    return float(np.linalg.norm(solution.residual) / np.sqrt(max(len(target) - solution.rank, 1)))


def _iterate(problem: Problem, weight: Array, loss: str, scale: float = 1.0) -> Estimate:
    """Gauss-Newton steps to convergence; `scale`: factor on the stated noise. Raises `UsageError` NCF637."""
    design = problem.design / problem.sigma[:, None]
    nuisance = problem.nuisance(problem.start) / problem.sigma[:, None]
    robust = loss in (least_squares.HUBER, least_squares.TUKEY)
    solution: Solution
    change: Array

    def step(at: tuple[Array, Array, Array]) -> tuple[tuple[Array, Array, Array], float]:
        nonlocal solution, change
        coefficients, unknowns, weight = at
        target = problem.residual(coefficients, unknowns) / problem.sigma
        root = np.sqrt(weight)
        weighed = design * root[:, None], nuisance * root[:, None], target * root
        solution = solve(*weighed, problem.limits / scale, problem.fleeting)
        rest = (target - design @ solution.change) * root
        moved = np.linalg.lstsq(nuisance * root[:, None], rest, rcond=1e-11)[0] if nuisance.shape[1] else unknowns
        change = design @ solution.change + nuisance @ moved
        size = float(np.abs(change).max(initial=0.0))
        if robust:
            new = np.where(problem.stated, 1.0, least_squares.robust_weights(loss, target - change))
            size = max(size, CONVERGED / STEADY * float(np.abs(new - weight).max()))
            weight = new
        return (coefficients + solution.change, unknowns + moved, weight), size

    start = problem.selection.start.copy(), problem.start, weight
    (coefficients, unknowns, weight), size = gauss_newton(step, start, STEPS, CONVERGED)
    if not size < CONVERGED and not (robust and np.abs(change).max() < CLOSE):
        size = float(np.abs(change).max())
        still = f"still change by {size:.3g} times the noise" if size < DIVERGED else "run away"
        text = f"after {STEPS} steps, the predictions {still}"
        raise UsageError.of("NCF637", text, hint="check that the measurements are of this machine, in mm and degrees")
    residual = problem.residual(coefficients, unknowns)
    return Estimate(coefficients, unknowns, solution, residual, weight, least_squares.weighted_share(loss))


def noise_scale(problem: Problem, estimate: Estimate) -> float:
    """The factor on the standard deviations: estimated if the noise is not known, never below one if it is."""
    chi_square, freedom = estimate.chi_square(problem.sigma), max(estimate.freedom, 1)
    improbable = chdtrc(freedom, chi_square * freedom) < UNLIKELY
    return float(np.sqrt(chi_square)) if improbable or not problem.noise_known else 1.0


@frozen(slots=False)
class Residuals:
    """Residuals of a calibration; arrays with one entry per value, (m,).

    measurements  the measurements of the calibration
    observation   index of the measurement; row: of it (-1: a calibrated distance); component: name of the value
    turns         whether the value is an angle
    value         measured minus predicted, mm or rad
    studentised   residual divided by its own standard deviation
    cook          Cook's distance: change of all estimates if this value is left out
    """

    measurements: tuple[Measurement, ...]
    observation: Ints
    row: Ints
    component: tuple[str, ...]
    turns: Mask
    value: Array
    studentised: Array
    cook: Array

    @staticmethod
    def of(problem: Problem, estimate: Estimate) -> Residuals:
        """The residuals with their diagnostics; outliers (weight 0) are studentised like new values."""
        solution, weight = estimate.solution, estimate.weight
        size = estimate.residual / problem.sigma
        scale = np.sqrt(estimate.chi_square(problem.sigma)) or 1.0
        leverage = np.where(weight > 0, solution.leverage, 0.0).clip(0.0, 1 - 1e-9)
        studentised = size / (scale * np.sqrt(1 - leverage))
        cook = studentised**2 * leverage / ((1 - leverage) * max(solution.rank, 1))
        seen = problem.observations
        names = [name for each in seen for name in (*each.value_names, *["distance"] * len(each.extra_values))]
        return Residuals(
            tuple(each.measurement for each in seen),
            np.repeat(np.arange(len(seen)), [len(each.values) for each in seen]),
            np.concatenate([each.rows for each in seen]),
            tuple(names),
            np.concatenate([turn for each in seen for turn in (each.turns, np.zeros(len(each.extra_values), bool))]),
            estimate.residual,
            studentised,
            cook,
        )

    def place(self, index: int) -> Place:
        """The place of a value in its file."""
        measurement, row = self.measurements[int(self.observation[index])], int(self.row[index])
        return Place(measurement.path) if row < 0 else measurement.place(row)

    def rms_by_set(self) -> dict[str, float]:
        """Root mean square of the length residuals of each file and set, um."""
        sizes: dict[str, float] = {}
        for index, measurement in enumerate(self.measurements):
            mine = np.flatnonzero((self.observation == index) & (self.row >= 0) & ~self.turns)
            sets = np.array(measurement.sets)[self.row[mine]]
            for name in dict.fromkeys(measurement.sets):
                chosen = self.value[mine[sets == name]]
                if chosen.size:
                    sizes[f"{measurement.path} set {name}"] = float(1e3 * np.sqrt((chosen**2).mean()))
        return sizes
