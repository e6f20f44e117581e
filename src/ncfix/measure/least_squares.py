"""Least squares: Gauss-Newton steps, linear problems with undetermined coefficients, and robust weights.

In linear problems nuisance unknowns (the set-up) are eliminated. All rows are in units of the noise, divided by their
standard deviations. Robust weights are those of Holland and Welsch, "Robust regression using iteratively reweighted
least-squares" (1977).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from scipy.linalg import qr, solve_triangular
from scipy.linalg.lapack import dpotrf, dpotri
from scipy.special import chdtr, ndtri, stdtrit

from ncfix.arrays import Array, Ints, Mask
from ncfix.values import frozen

NUISANCE_RANK = 1e-10
"""Relative singular value of the scaled nuisance columns below which it counts as zero."""
VISIBLE = 1e-6
"""A column of which a smaller share is left after eliminating the set-up is not seen."""
RANK = 1e-6
"""A scaled column nearer than this to a combination of others counts as that combination."""
STURDY = 0.05
"""Share of a scaled column, orthogonal to those before it, from which it is kept in the given order."""
ALONE = 0.3
"""Share of a held column orthogonal to the kept ones from which it is called weak, not a combination of them."""
SIGNIFICANT = 0.02
"""Share, of the largest factor, from which a column is named as part of a combination."""
AUTO, NONE, HUBER, TUKEY = "auto", "none", "huber", "tukey"
HUBER_K, TUKEY_K = 1.345, 4.685
"""Tuning constants for 95 % efficiency with normal noise."""
ROUNDS = 30
"""Largest number of iterations of the robust fit."""
FALSE_ALARM = 0.001
"""Probability of any false outlier in a clean measurement."""
HEAVY = 1.6
"""Factor on the normal limit of outliers, since real noise has longer tails."""
ROUNDING, TINY = 1e-12, 1e-300

At = TypeVar("At")


def gauss_newton(step: Callable[[At], tuple[At, float]], start: At, most: int, settled: float) -> tuple[At, float]:
    """Iterate `step` from a first guess until the predictions settle; returns the end and the size of the last step.

    step     maps a guess to the next one and the largest change of a prediction
    most     largest number of steps
    settled  the iteration ends when the change is below this; if the last step was larger, it did not converge
    """
    at, size = start, np.inf
    for _ in range(most):
        at, size = step(at)
        if size < settled:
            break
    return at, size


@frozen
class Combination:
    """A column that equals a combination of others: raising `held` by 1 is raising each of `others` by its factor."""

    held: int
    others: tuple[int, ...]
    factors: tuple[float, ...]


@frozen(slots=False)
class Solution:
    """Least-squares solution for p coefficients, of which undetermined ones are held.

    change       (p,) change of the coefficients; zero if held
    kept         (r,) indices of the estimated coefficients
    unseen       held: they do not affect the measured values
    set_up       held: they only affect the values as the unknown set-up does
    combinations held: a combination of others has the same effect
    weak         held: their effect is too small to determine them
    covariance   (r, r) of the estimated ones, for a noise of one
    orthogonal   (m, r) orthonormal basis of their columns after elimination of the set-up
    nuisance     (m, s) orthonormal basis of the columns of the set-up
    residual     (m,) in units of the noise
    condition    condition number of the estimated columns, scaled to unit length
    """

    change: Array
    kept: Ints
    unseen: tuple[int, ...]
    set_up: tuple[int, ...]
    combinations: tuple[Combination, ...]
    covariance: Array
    orthogonal: Array
    nuisance: Array
    residual: Array
    condition: float
    weak: tuple[int, ...] = ()

    @property
    def leverage(self) -> Array:
        """Leverage of each value on its own prediction, (m,)."""
        return (self.orthogonal**2).sum(1) + (self.nuisance**2).sum(1)

    @property
    def rank(self) -> int:
        """Number of determined parameters, including the set-up."""
        return int(self.orthogonal.shape[1] + self.nuisance.shape[1])


def orthonormal(columns: Array) -> Array:
    """An orthonormal basis (m, rank) of the span of columns (m, k)."""
    size = np.linalg.norm(columns, axis=0)
    scaled = columns[:, size > 0] / size[size > 0]
    if not scaled.shape[1]:
        return np.zeros((len(columns), 0))
    left, values, _ = np.linalg.svd(scaled, full_matrices=False)
    return left[:, values > NUISANCE_RANK * values[0]]


def inverse(matrix: Array) -> Array:
    """The inverse of a symmetric positive definite matrix (n, n), computed in place by its Cholesky factor.

    Raises `numpy.linalg.LinAlgError` if it is not positive definite.
    """
    factor, failed = dpotrf(matrix.T, lower=1, overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError("not positive definite")
    found: Array = dpotri(factor, lower=1, overwrite_c=1)[0].T
    for k in range(len(found) - 1):
        found[k + 1 :, k] = found[k, k + 1 :]
    return found


def without(basis: Array, columns: Array) -> Array:
    """The part of columns (m, ...) orthogonal to an orthonormal basis (m, k); projected twice against rounding."""
    once = columns - basis @ (basis.T @ columns)
    return once - basis @ (basis.T @ once)


def solve(
    design: Array, nuisance: Array, target: Array, limit: Array | None = None, last: Mask | None = None
) -> Solution:
    """Least squares of `design @ change + nuisance @ anything = target`, all rows in units of the noise.

    design (m, p), nuisance (m, k), target (m,)
    limit  (p,) coefficients with a larger standard deviation are held
    last   (p,) mask: among columns of the same effect, these are held before others
    """
    basis = orthonormal(nuisance)
    left, wanted = without(basis, design), without(basis, target)
    before, after = np.linalg.norm(design, axis=0), np.linalg.norm(left, axis=0)
    seen = np.flatnonzero(after > VISIBLE * np.maximum(before, 1e-300))
    scaled = left[:, seen] / after[seen]
    most = np.full(len(seen), np.inf) if limit is None else limit[seen] * after[seen]
    order = np.arange(len(seen)) if last is None else np.argsort(last[seen], kind="stable")
    kept, orthogonal, triangle, combinations, weak = _independent(scaled, seen, after, most, order)
    change = np.zeros(design.shape[1])
    projected = orthogonal.T @ wanted
    inverse = solve_triangular(triangle, np.eye(len(kept))) / after[kept, None] if len(kept) else np.zeros((0, 0))
    change[kept] = inverse @ projected
    blind = np.setdiff1d(np.arange(design.shape[1]), seen)
    values = np.linalg.svd(triangle, compute_uv=False) if len(kept) else np.ones(1)
    return Solution(
        change,
        kept,
        tuple(int(k) for k in blind if before[k] == 0),
        tuple(int(k) for k in blind if before[k] > 0),
        combinations,
        inverse @ inverse.T,
        orthogonal,
        basis,
        wanted - orthogonal @ projected,
        float(values[0] / values[-1]),
        weak,
    )


def _independent(
    scaled: Array, seen: Ints, size: Array, most: Array, order: Ints
) -> tuple[Ints, Array, Array, tuple[Combination, ...], tuple[int, ...]]:
    """A largest set of independent columns and their QR factors; of the others, combinations and weak ones.

    scaled (m, s)  columns of unit length; seen (s,): their indices among all; size (s,): their lengths before scaling
    most (s,)      limits of the standard deviations of the scaled coefficients
    order (s,)     the order in which columns are kept
    """
    if not scaled.shape[1]:
        return np.zeros(0, dtype=np.int64), scaled, np.zeros((0, 0)), (), ()
    chosen, orthogonal, upper = _known(scaled, _chosen(scaled, order), most)
    held = np.setdiff1d(np.arange(scaled.shape[1]), chosen)
    kept = seen[chosen]
    combinations, weak = [], []
    for column in held:
        along = orthogonal.T @ scaled[:, column]
        if along @ along < 1 - ALONE**2:
            weak.append(int(seen[column]))
            continue
        shares = solve_triangular(upper, along)
        others = np.flatnonzero(np.abs(shares) > SIGNIFICANT * np.abs(shares).max())
        factors = shares[others] * size[seen[column]] / size[kept[others]]
        names = tuple(int(k) for k in kept[others])
        combinations.append(Combination(int(seen[column]), names, tuple(float(f) for f in factors)))
    return kept, orthogonal, upper, tuple(combinations), tuple(weak)


def _known(scaled: Array, chosen: Ints, most: Array) -> tuple[Ints, Array, Array]:
    """The chosen columns whose coefficients have standard deviations within `most` (s,), and their QR factors.

    The least determined one is dropped and the others are checked again: if only the sum of some columns is seen,
    dropping one determines the others.
    """
    orthogonal, upper = np.linalg.qr(scaled[:, chosen])
    among, triangle = np.arange(len(chosen)), upper
    while len(among):
        deviation = np.linalg.norm(solve_triangular(triangle, np.eye(len(among))), axis=1) / most[chosen[among]]
        worst = int(np.argmax(deviation))
        if deviation[worst] <= 1:
            break
        among = np.delete(among, worst)
        triangle = np.asarray(np.linalg.qr(upper[:, among], mode="r"))
    if len(among) == len(chosen):
        return chosen, orthogonal, upper
    return chosen[among], *np.linalg.qr(scaled[:, chosen[among]])


def _chosen(scaled: Array, order: Ints) -> Ints:
    """Indices of independent columns: first those clearly independent of earlier ones in `order`, so that noise does
    not decide; then further ones by pivoted QR.
    """
    first: list[int] = []
    basis: Array = np.zeros((len(scaled), 0))
    for k in order.tolist():
        new = without(basis, scaled[:, k])
        size = float(np.linalg.norm(new))
        if size > STURDY:
            first.append(k)
            basis = np.column_stack([basis, new / size])
    others = np.setdiff1d(np.arange(scaled.shape[1]), first)
    if not len(others):
        return np.array(first, dtype=np.int64)
    left = without(basis, scaled[:, others])
    _, triangle, order = qr(left, mode="economic", pivoting=True)
    more = others[order[: int((np.abs(np.diag(triangle)) > RANK).sum())]]
    return np.sort(np.concatenate([first, more]).astype(np.int64))


# -- robust weights ----------------------------------------------------------------------------------------------------


def robust_spread(residual: Array) -> float:
    """A robust standard deviation of residuals (m,): their median absolute value over that of the unit normal."""
    return float(np.median(np.abs(residual))) / 0.6745 or 1.0


def robust_weights(loss: str, residual: Array) -> Array:
    """The weights (m,), 0 to 1, of iteratively reweighted least squares for residuals (m,), by Huber or else Tukey."""
    size = np.abs(residual) / robust_spread(residual)
    if loss == HUBER:
        return np.minimum(1.0, HUBER_K / np.maximum(size, 1e-12))
    return np.where(size < TUKEY_K, (1 - (size / TUKEY_K) ** 2) ** 2, 0.0)


def weighted_share(loss: str) -> float:
    """Expected weight times square for unit normal noise, below 1 for robust losses: a correction of chi-square.

    Moments of the normal distribution within a bound are chi-square probabilities.
    """
    if loss == HUBER:
        return float(chdtr(1, HUBER_K**2))
    if loss == TUKEY:
        square = TUKEY_K**2
        return float(chdtr(3, square) - 6 * chdtr(5, square) / square + 15 * chdtr(7, square) / square**2)
    return 1.0


def outliers(solution: Solution) -> Mask:
    """Mask (m,) of the values further from a robust fit than noise explains.

    The fit is a Huber fit of the linear problem about the least-squares solution.
    """
    columns = np.concatenate([solution.orthogonal, solution.nuisance], axis=1)
    residual = solution.residual
    shift: Array = np.zeros(columns.shape[1])
    for _ in range(ROUNDS):
        left = residual - columns @ shift
        weighted = columns * robust_weights(HUBER, left)[:, None]
        new = np.asarray(np.linalg.lstsq(columns.T @ weighted, weighted.T @ residual, rcond=None)[0], dtype=np.float64)
        if np.abs(new - shift).max(initial=0.0) < 1e-3 * robust_spread(left):
            break
        shift = new
    left = residual - columns @ shift
    m, free = len(residual), max(len(residual) - columns.shape[1], 1)
    limit = -HEAVY * ndtri(FALSE_ALARM / (2 * m))
    size = np.abs(left) / (robust_spread(left) * np.sqrt(m / free))
    return _confirmed(size > limit, size, columns, residual)


def _confirmed(suspected: Mask, size: Array, columns: Array, residual: Array) -> Mask:
    """Mask (m,) of the suspected values that deviate significantly from their prediction by all other values.

    With few degrees of freedom a robust fit follows some values and rejects others without reason; the t distribution
    of the prediction error allows for this.
    size      (m,) deviations from the robust fit, in robust standard deviations
    columns   (m, r) orthonormal; residual (m,): of least squares
    """
    gross = suspected.copy()
    while gross.any():
        aside = np.flatnonzero(gross)
        free = len(residual) - columns.shape[1] - len(aside)
        far = np.zeros(len(aside))
        if free > 0:
            inverse = np.linalg.inv((1 + ROUNDING) * np.eye(len(aside)) - columns[aside] @ columns[aside].T)
            missed = inverse @ residual[aside]
            noise = max(float(residual @ residual - residual[aside] @ missed) / free, 0.0)
            limit = HEAVY * float(stdtrit(free, 1 - FALSE_ALARM / (2 * len(residual))))
            far = np.abs(missed) / np.maximum(limit * np.sqrt(noise * np.diag(inverse)), TINY)
        near = aside[far <= 1]
        if not len(near):
            break
        order = np.lexsort((size[near], far[far <= 1]))
        gross[near[order[: (len(near) + 1) // 2]]] = False
    return gross
