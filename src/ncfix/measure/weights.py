"""Robust weights and outliers. Residuals are in units of the noise.

Source: Holland and Welsch, "Robust regression using iteratively reweighted least-squares" (1977).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr, ndtri, stdtrit

from ncfix.measure.measurement import Array
from ncfix.measure.solve import Solution

AUTO, NONE, HUBER, TUKEY = "auto", "none", "huber", "tukey"
HUBER_K, TUKEY_K = 1.345, 4.685
"""The usual constants: 95 % efficiency for normal noise."""
ROUNDS = 30
FALSE_ALARM = 0.001
"""How often one value of a clean measurement may be taken for an outlier."""
HEAVY = 1.6
"""Noise has longer tails than the normal distribution: how much further out a value may be."""
ROUNDING, TINY = 1e-12, 1e-300


def spread(residual: Array) -> float:
    """A robust standard deviation of residuals (m,): their median size over that of the normal distribution."""
    return float(np.median(np.abs(residual))) / 0.6745 or 1.0


def of(loss: str, residual: Array) -> Array:
    """The weights (m,), 0 to 1, of iteratively reweighted least squares for residuals (m,); of Tukey unless Huber's."""
    size = np.abs(residual) / spread(residual)
    if loss == HUBER:
        return np.minimum(1.0, HUBER_K / np.maximum(size, 1e-12))
    return np.where(size < TUKEY_K, (1 - (size / TUKEY_K) ** 2) ** 2, 0.0)


def share(loss: str) -> float:
    """The mean of weight times square over normal noise of one: residuals so weighted look smaller than the noise is.

    Moments of the normal distribution within a bound are chi-square probabilities.
    """
    if loss == HUBER:
        return float(chdtr(1, HUBER_K**2))
    if loss == TUKEY:
        square = TUKEY_K**2
        return float(chdtr(3, square) - 6 * chdtr(5, square) / square + 15 * chdtr(7, square) / square**2)
    return 1.0


def outliers(solution: Solution) -> NDArray[np.bool_]:
    """Which values lie further from a robust fit than noise can explain, (m,).

    The fit is that of the linear problem round the least-squares solution, whose columns are at hand; Huber's weights
    let no value pull for more than its share.
    """
    columns = np.concatenate([solution.orthogonal, solution.nuisance], axis=1)
    residual = solution.residual
    shift: Array = np.zeros(columns.shape[1])
    for _ in range(ROUNDS):
        left = residual - columns @ shift
        weighted = columns * of(HUBER, left)[:, None]
        new = np.asarray(np.linalg.lstsq(columns.T @ weighted, weighted.T @ residual, rcond=None)[0], dtype=np.float64)
        if np.abs(new - shift).max(initial=0.0) < 1e-3 * spread(left):
            break
        shift = new
    left = residual - columns @ shift
    m, free = len(residual), max(len(residual) - columns.shape[1], 1)
    limit = -HEAVY * ndtri(FALSE_ALARM / (2 * m))
    size = np.abs(left) / (spread(left) * np.sqrt(m / free))
    return _confirmed(size > limit, size, columns, residual)


def _confirmed(suspected: NDArray[np.bool_], size: Array, columns: Array, residual: Array) -> NDArray[np.bool_]:
    """Those of the suspected (m,) that least squares of all others do not predict; the rest is no longer suspected.

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
