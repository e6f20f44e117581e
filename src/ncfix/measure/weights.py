"""Robust weights and outliers. Residuals are in units of the noise.

Source: Holland and Welsch, "Robust regression using iteratively reweighted least-squares" (1977).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from ncfix.measure.measurement import Array
from ncfix.measure.solve import Solution

AUTO, NONE, HUBER, TUKEY = "auto", "none", "huber", "tukey"
LOSSES = (AUTO, NONE, HUBER, TUKEY)
HUBER_K, TUKEY_K = 1.345, 4.685
"""The usual constants: 95 % efficiency for normal noise."""
ROUNDS = 30
FALSE_ALARM = 0.001
"""How often one value of a clean measurement may be taken for an outlier."""
HEAVY = 1.6
"""Noise has longer tails than the normal distribution: how much further out a value may be."""


def spread(residual: Array) -> float:
    """A robust standard deviation of residuals (m,): their median size over that of the normal distribution."""
    return float(np.median(np.abs(residual))) / 0.6745 or 1.0


def of(loss: str, residual: Array) -> Array:
    """The weights (m,), 0 to 1, of iteratively reweighted least squares for residuals (m,); of Tukey unless Huber's."""
    size = np.abs(residual) / spread(residual)
    if loss == HUBER:
        return np.minimum(1.0, HUBER_K / np.maximum(size, 1e-12))
    return np.where(size < TUKEY_K, (1 - (size / TUKEY_K) ** 2) ** 2, 0.0)


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
    deviation = spread(left) * np.sqrt(m / free)
    limit = -HEAVY * ndtri(FALSE_ALARM / (2 * m))
    gross: NDArray[np.bool_] = np.abs(left) > limit * deviation
    return gross
