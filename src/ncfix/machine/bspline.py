"""Sums of B-splines, many at a time, by de Boor's algorithm (C. de Boor, A Practical Guide to Splines, chapter X).

A library could do it, too; importing one takes longer than correcting a short program.
"""

from __future__ import annotations

import numpy as np

from ncfix.machine.se3 import Array


def splines(knots: Array, degree: int, coefficients: Array, u: Array) -> Array:
    """Sums of B-splines with coefficients (m, k) at u (...), all within the range of the knots: (m, ...)."""
    cell = np.clip(np.searchsorted(knots, u, side="right") - 1, degree, coefficients.shape[1] - 1)
    sums = [coefficients[:, cell - degree + j] for j in range(degree + 1)]
    for r in range(1, degree + 1):
        for j in range(degree, r - 1, -1):
            low, high = knots[cell - degree + j], knots[cell + 1 + j - r]
            width = high - low
            share = np.where(width > 0, (u - low) / np.where(width > 0, width, 1.0), 0.0)
            sums[j] = (1 - share) * sums[j - 1] + share * sums[j]
    return sums[degree]


def slopes(knots: Array, degree: int, coefficients: Array, u: Array) -> Array:
    """Their derivatives by u, as `splines`: splines of a degree less."""
    return splines(knots[1:-1], degree - 1, rates(knots, degree, coefficients), u)


def rates(knots: Array, degree: int, coefficients: Array) -> Array:
    """The coefficients (m, k - 1) of the derivatives of splines (m, k), on the knots but the first and the last."""
    width = knots[degree + 1 : -1] - knots[1 : -degree - 1]
    rise = degree * np.diff(coefficients, axis=1)
    return np.where(width > 0, rise / np.where(width > 0, width, 1.0), 0.0)
