"""Least squares: Gauss-Newton steps, the linear problem of each, which unknowns can be told, and robust weights.

In linear problems unknowns of no interest are eliminated. Everything is in units of the noise: rows were divided by
their standard deviations before. Robust weights are those of Holland and Welsch, "Robust regression using iteratively
reweighted least-squares" (1977).
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
"""Singular values of the scaled nuisance columns below this are zero."""
VISIBLE = 1e-6
"""A column of which less than this is left after the set-up was eliminated is not seen."""
RANK = 1e-6
"""Scaled columns nearer than this to a combination of others are that combination."""
STURDY = 0.05
"""Of columns that are combinations of one another the first are kept, if this much of them is new."""
ALONE = 0.3
"""Share of a held column that is new from which on it is no combination of others, but weak by itself."""
SIGNIFICANT = 0.02
"""Share from which on a column is named as part of such a combination."""
AUTO, NONE, HUBER, TUKEY = "auto", "none", "huber", "tukey"
HUBER_K, TUKEY_K = 1.345, 4.685
"""The usual constants: 95 % efficiency for normal noise."""
ROUNDS = 30
FALSE_ALARM = 0.001
"""How often one value of a clean measurement may be taken for an outlier."""
HEAVY = 1.6
"""Noise has longer tails than the normal distribution: how much further out a value may be."""
ROUNDING, TINY = 1e-12, 1e-300

At = TypeVar("At")


def gauss_newton(step: Callable[[At], tuple[At, float]], start: At, most: int, settled: float) -> tuple[At, float]:
    """Steps from a first guess until the predictions no longer change; where they end, and how far the last one went.

    step     from a guess to the next one, by linear least squares about it, and the largest change of a prediction
    most     so many steps; if the last one changes a prediction by `settled` or more, they did not converge
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
    """What least squares say of p coefficients.

    change       (p,) what is to be added; zero for those held
    kept         (r,) indices of those that were estimated
    unseen       those that change nothing that was measured
    set_up       those that change only what the unknown set-up changes too
    combinations those that are held because others do the same
    weak         those that are held because they are seen too little to be told from zero
    covariance   (r, r) of the kept, for a noise of one
    orthogonal   (m, r) orthonormal columns of the kept after elimination
    nuisance     (m, s) orthonormal columns of the set-up
    residual     (m,) what is left
    condition    of the kept columns, scaled to one
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
        """How much each value determines its own prediction, (m,)."""
        return (self.orthogonal**2).sum(1) + (self.nuisance**2).sum(1)

    @property
    def rank(self) -> int:
        """How many numbers were determined, set-up included."""
        return int(self.orthogonal.shape[1] + self.nuisance.shape[1])


def orthonormal(columns: Array) -> Array:
    """An orthonormal basis of what the columns span, (m, k) -> (m, rank)."""
    size = np.linalg.norm(columns, axis=0)
    scaled = columns[:, size > 0] / size[size > 0]
    if not scaled.shape[1]:
        return np.zeros((len(columns), 0))
    left, values, _ = np.linalg.svd(scaled, full_matrices=False)
    return left[:, values > NUISANCE_RANK * values[0]]


def inverse(matrix: Array) -> Array:
    """The inverse of a symmetric positive definite matrix (n, n), in its place, by its Cholesky factor.

    Raises `numpy.linalg.LinAlgError` where it is none.
    """
    factor, failed = dpotrf(matrix.T, lower=1, overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError("not positive definite")
    found: Array = dpotri(factor, lower=1, overwrite_c=1)[0].T
    for k in range(len(found) - 1):
        found[k + 1 :, k] = found[k, k + 1 :]
    return found


def without(basis: Array, columns: Array) -> Array:
    """The part of columns (m, ...) orthogonal to an orthonormal basis (m, k); done twice, for the last digits."""
    once = columns - basis @ (basis.T @ columns)
    return once - basis @ (basis.T @ once)


def solve(
    design: Array, nuisance: Array, target: Array, limit: Array | None = None, last: Mask | None = None
) -> Solution:
    """Least squares of `design @ change + nuisance @ anything = target`.

    design (m, p), nuisance (m, k), target (m,), all divided by the noise; limit (p,): what would be known to no better
    than this is not known, and held; last (p,): of columns that do the same, these are held before others.
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
    """A largest set of independent columns, their QR factors, what the others are made of, and which are just weak.

    most (s,) is the standard deviation of the scaled columns' factors beyond which one is not known; order (s,): which
    are kept first.
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
    """The chosen columns whose factors are known to `most` (s,), and their QR factors.

    The one that is known least is left out, and all others are looked at anew: of columns whose sum alone is seen, one
    goes and the others are known.
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
    """Which columns are kept: the first that are well apart, so that noise does not decide, then what is left by QR."""
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
    """A robust standard deviation of residuals (m,): their median size over that of the normal distribution."""
    return float(np.median(np.abs(residual))) / 0.6745 or 1.0


def robust_weights(loss: str, residual: Array) -> Array:
    """The weights (m,), 0 to 1, of iteratively reweighted least squares for residuals (m,); of Tukey unless Huber's."""
    size = np.abs(residual) / robust_spread(residual)
    if loss == HUBER:
        return np.minimum(1.0, HUBER_K / np.maximum(size, 1e-12))
    return np.where(size < TUKEY_K, (1 - (size / TUKEY_K) ** 2) ** 2, 0.0)


def weighted_share(loss: str) -> float:
    """The mean of weight times square over normal noise of one: residuals so weighted look smaller than the noise is.

    Moments of the normal distribution within a bound are chi-square probabilities.
    """
    if loss == HUBER:
        return float(chdtr(1, HUBER_K**2))
    if loss == TUKEY:
        square = TUKEY_K**2
        return float(chdtr(3, square) - 6 * chdtr(5, square) / square + 15 * chdtr(7, square) / square**2)
    return 1.0


def outliers(solution: Solution) -> Mask:
    """Which values lie further from a robust fit than noise can explain, (m,).

    The fit is that of the linear problem round the least-squares solution, whose columns are at hand; Huber's weights
    let no value pull for more than its share.
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
    """The suspected values (m,) that least squares of all others do not predict; the rest is no longer suspected.

    With few values for the unknowns a robust fit follows some of them and leaves the others out in the cold; the t
    distribution of what the others predict allows for how little they know. Residuals are those of least squares, of
    sizes (m,) about the robust fit; columns are orthonormal.
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
