"""Refinement of a model: removal of insignificant coefficients, and estimation of time constants.

Stepwise regression (Soons 1993, section 3.3): coefficients not significantly different from zero are removed one at a
time, the least significant first; a removed one returns if it becomes significant. A removed coefficient is zero; one
that the data do not determine keeps the value of the machine file. Tests are two-sided t-tests with the noise of the
residuals. Since removed coefficients are not known to be zero, the covariance of the others includes them with zero
mean and a usual size, and the change that their removal has caused.

Time constants (section 2.7): an effect with a lag is linear in its coefficients once its time constant is known. So
only the time constants are searched, first on a coarse grid and then by descent, with all other parameters solved for
at each try (variable projection).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import stdtr

from ncfix.arrays import Array, Ints, Mask
from ncfix.diagnostics import Message, UsageError
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Basis, Polynomial
from ncfix.machine.piecewise import Truncated
from ncfix.measure.estimate import HOPELESS, Estimate, LeftOut, Problem, fit, noise_scale
from ncfix.measure.least_squares import orthonormal, without
from ncfix.measure.measurement import Measurement
from ncfix.measure.selection import Selection, labels_of

SCALE = 24
"""Number of time constants of the coarse grid, from a third of the time step to three times the duration."""
USUAL = 1 / 3
"""Standard deviation of a removed error, in units of a large one (`plausible.much`)."""
STEP = 1e-3
"""Relative accuracy of a time constant."""


def pruned(problem: Problem, estimate: Estimate, level: float, loss: str) -> tuple[Problem, Estimate, tuple[str, ...]]:
    """The problem with the coefficients significant at `level` only, its solution, and names of the removed ones."""
    chosen = _significant(problem, estimate, 1 - level)
    if chosen.all():
        return problem, estimate, ()
    smaller = _without(problem, chosen)
    found = fit(smaller, loss)
    left_out = LeftOut(problem.selection, chosen, _covariance(problem, estimate, chosen, found))
    return smaller, replace(found, left_out=left_out), tuple(_left_out(problem.selection, chosen))


def _covariance(problem: Problem, estimate: Estimate, stays: Mask, found: Estimate) -> Array:
    """Covariance (p, p) of all coefficients of a problem about the values `found` without the removed ones.

    stays  (p,) mask of the coefficients of the reduced problem. The noise is one.
    """
    told = np.flatnonzero(stays)[found.solution.kept]  # may include one that was held before the removal
    kept, scale = np.union1d(estimate.solution.kept, told), noise_scale(problem, estimate) or 1.0
    design, target = _alone(problem, estimate, kept)
    usual = USUAL * problem.limits[kept] / HOPELESS
    held = np.diag(np.where(stays[kept], 0.0, scale / usual))
    columns = np.concatenate([design[:, kept], held])
    size = np.linalg.norm(columns, axis=0)
    orthogonal, triangle = np.linalg.qr(columns / size)
    inverse = solve_triangular(triangle, np.eye(len(kept))) / size[:, None]
    model = np.zeros(len(stays))
    model[stays] = found.coefficients
    astray = (model[kept] - inverse @ (orthogonal[: len(target)].T @ target)) / scale
    covariance = np.zeros((len(stays), len(stays)))
    covariance[np.ix_(kept, kept)] = inverse @ inverse.T + np.outer(astray, astray)
    return covariance


def _left_out(selection: Selection, chosen: Mask) -> Iterator[str]:
    """Names of the coefficients that `_without` removes; an effect removed as a whole is named once."""
    at = 0
    for effect in selection.estimated:
        keep = chosen[at : at + effect.basis.size]
        at += effect.basis.size
        labels = labels_of(effect, selection.estimated)
        kept = _reduced(effect, keep)
        if kept is None:
            yield labels[0].removesuffix(f" {effect.basis.labels[0]}")
        elif kept is not effect:
            yield from (label for label, stays in zip(labels, keep, strict=True) if not stays)


def _significant(problem: Problem, estimate: Estimate, risk: float) -> Mask:
    """Mask of the coefficients that stay, by backward elimination with re-entry; `risk`: significance probability."""
    inside = np.zeros(len(estimate.coefficients), dtype=np.bool_)
    inside[estimate.solution.kept] = True
    held = ~inside & (estimate.coefficients != 0)
    design, target = _alone(problem, estimate, estimate.solution.kept)
    start = int((estimate.weight > 0).sum()) - estimate.solution.nuisance.shape[1]
    banned = set(np.flatnonzero(held).tolist())
    while inside.any():
        chances, left = _chances(design[:, inside], target, start)
        worst = int(np.flatnonzero(inside)[np.argmax(chances)])
        if chances.max() <= risk:
            back = _best_outside(design, left, inside, start, banned)
            if back is None or back[1] > risk:
                break
            inside[back[0]] = True
            banned.add(back[0])
            continue
        inside[worst] = False
    return _whole(problem.selection, inside | held)


def _whole(selection: Selection, chosen: Mask) -> Mask:
    """The chosen coefficients, plus the others of effects whose basis cannot be reduced."""
    stays, at = chosen.copy(), 0
    for effect in selection.estimated:
        part = slice(at, at + effect.basis.size)
        at = part.stop
        stays[part] |= _reduced(effect, chosen[part]) is effect
    return stays


def _alone(problem: Problem, estimate: Estimate, kept: Ints) -> tuple[Array, Array]:
    """Design and target of the coefficients `kept`, orthogonal to the set-up, in units of the noise."""
    root, basis = np.sqrt(estimate.weight) / problem.sigma, estimate.solution.nuisance
    asked = np.zeros(len(estimate.coefficients))
    asked[kept] = estimate.coefficients[kept]
    design = without(basis, problem.design * root[:, None])
    return design, without(basis, (estimate.residual + problem.design @ asked) * root)


def _chances(design: Array, target: Array, start: int) -> tuple[Array, Array]:
    """Probability by chance of each estimate (two-sided t-test), and the residual.

    start  degrees of freedom before the coefficients are fitted
    """
    orthogonal, triangle = np.linalg.qr(design)
    inverse = np.linalg.inv(triangle)
    value = inverse @ (orthogonal.T @ target)
    left = target - design @ value
    freedom = max(start - design.shape[1], 1)
    deviation = np.sqrt((inverse**2).sum(1) * float(left @ left) / freedom)
    chances: Array = 2 * stdtr(freedom, -np.abs(value) / np.maximum(deviation, 1e-300))
    return chances, left


def _best_outside(design: Array, left: Array, inside: Mask, start: int, banned: set[int]) -> tuple[int, float] | None:
    """The removed coefficient that would be most significant if added, with its probability; each returns only once."""
    orthogonal, _ = np.linalg.qr(design[:, inside])
    best: tuple[int, float] | None = None
    for k in np.flatnonzero(~inside):
        column = without(orthogonal, design[:, k])
        size = float(np.linalg.norm(column))
        if int(k) in banned or size <= 1e-6 * float(np.linalg.norm(design[:, k])):
            continue
        explained = float(column @ left / size)
        freedom = max(start - int(inside.sum()) - 1, 1)
        rest = max(float(left @ left) - explained**2, 1e-300)
        chance = float(2 * stdtr(freedom, -abs(explained) / np.sqrt(rest / freedom)))
        if best is None or chance < best[1]:
            best = int(k), chance
    return best


def _without(problem: Problem, chosen: Mask) -> Problem:
    """The problem without the coefficients that are not chosen."""
    effects: list[Effect] = []
    free: list[bool] = []
    at = 0
    for effect, estimated in zip(problem.selection.effects, problem.selection.free, strict=True):
        keep = chosen[at : at + effect.basis.size] if estimated else None
        at += effect.basis.size if estimated else 0
        kept = effect if keep is None else _reduced(effect, keep)
        if kept is not None:
            effects.append(kept)
            free.append(estimated)
    selection = Selection(tuple(effects), tuple(free))
    machine = problem.machine.replace(effects=tuple(effects))
    return Problem.of([each.measurement for each in problem.observations], machine, selection)


def _reduced(effect: Effect, keep: Mask) -> Effect | None:
    """The effect with the powers or knots in `keep` only; None if none is left. Other bases are kept as a whole."""
    if not keep.any():
        return None
    if keep.all() or not isinstance(effect.basis, Polynomial | Truncated):
        return effect
    values = tuple(c for c, k in zip(effect.coefficients, keep, strict=True) if k)
    if isinstance(effect.basis, Truncated):
        basis: Basis = effect.basis.without_knots(keep)
    else:
        basis = replace(effect.basis, degree=tuple(d for d, k in zip(effect.basis.degree, keep, strict=True) if k))
    return replace(effect, basis=basis, coefficients=values, covariance=None)


# -- time constants ----------------------------------------------------------------------------------------------------


def with_time_constants(
    measurements: Sequence[Measurement], machine: Machine, selection: Selection
) -> tuple[Selection, tuple[Message, ...]]:
    """The selection with the best time constants of its estimated effects, and messages with these and their sigmas.

    Effects with equal time constants keep them equal. Raises `UsageError` NCF639 if no effect has a time constant, or
    no time was logged.
    """
    from scipy.optimize import minimize

    constants = sorted({effect.time_constant_s for effect in selection.estimated if effect.time_constant_s})
    if not constants:
        text = "none of the estimated effects has a time constant"
        raise UsageError.of(
            "NCF639",
            text,
            hint="estimate for example spindle-growth-late, or give an effect `time_constant_s` in the machine file",
        )
    low, high = _times(measurements)

    def left(logs: Array) -> float:
        """Sum of squared residuals, in units of the noise, with coefficients and set-up solved for."""
        tried = _with(selection, constants, np.exp(logs))
        problem = Problem.of(measurements, machine.replace(effects=tried.effects), tried)
        residual = problem.residual(tried.start, problem.start) / problem.sigma
        rest = without(orthonormal(problem.columns), residual)
        return float(rest @ rest)

    start = np.log(np.clip(constants, low, high))
    scale = np.linspace(np.log(low), np.log(high), SCALE)
    for k in range(len(start)):
        options = [np.concatenate([start[:k], [value], start[k + 1 :]]) for value in scale]
        start = min(options, key=left)
    bounds = [(np.log(low), np.log(high))] * len(start)
    best = minimize(left, start, method="Nelder-Mead", bounds=bounds, options={"xatol": STEP, "fatol": 1e-3})
    chosen = _with(selection, constants, np.exp(best.x))
    sigmas = [_sigma(left, best.x, k, float(best.fun)) for k in range(len(constants))]
    words = [_words(chosen, float(np.exp(x)), sigma, (low, high)) for x, sigma in zip(best.x, sigmas, strict=True)]
    return chosen, tuple(words)


def _times(measurements: Sequence[Measurement]) -> tuple[float, float]:
    """The shortest and longest time constants that the measured times resolve, s."""
    times = [np.unique(each.columns["time_s"]) for each in measurements if "time_s" in each.columns]
    spans = [float(np.ptp(each)) for each in times if len(each) > 1]
    if not spans:
        raise UsageError.of(
            "NCF639", "there is no column time_s", hint="a time constant needs the times of the rows in a column time_s"
        )
    steps = [float(np.median(np.diff(each))) for each in times if len(each) > 1]
    return max(min(steps) / 3, 1e-3), 3 * max(spans)


def _with(selection: Selection, constants: Sequence[float], values: Array) -> Selection:
    """The selection with the time constants `constants` replaced by `values`, s."""
    new = dict(zip(constants, values.tolist(), strict=True))
    effects = tuple(
        replace(effect, time_constant_s=new[effect.time_constant_s])
        if free and effect.time_constant_s in new
        else effect
        for effect, free in zip(selection.effects, selection.free, strict=True)
    )
    return Selection(effects, selection.free)


def _sigma(left: Callable[[Array], float], best: Array, k: int, least: float) -> float:
    """Relative standard deviation of time constant k, from the curvature of the sum of squares at its minimum."""
    step = np.zeros(len(best))
    step[k] = 0.05
    curvature = (left(best + step) + left(best - step) - 2 * least) / 0.05**2
    return float(np.sqrt(2 / curvature)) if curvature > 0 else float("inf")


def _words(selection: Selection, constant: float, sigma: float, limits: tuple[float, float]) -> Message:
    late = [effect for effect in selection.estimated if effect.time_constant_s == constant]
    text = f"{', '.join(each.name for each in late)} follows {late[0].input} with a time constant of "
    if sigma > 0.5 or not limits[0] * 1.01 < constant < limits[1] / 1.01:
        text += f"about {constant:.3g} s, which these measurements do not determine"
        return Message("NCF639", text, hint="measure over several time constants, while warming up and cooling down")
    return Message("NCF640", f"{text}{constant:.4g} s, sigma {constant * sigma:.2g} s")
