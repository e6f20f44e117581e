"""Shapes: bases with priors on their coefficients. A curve is smooth, harmonics decay, play grows along the travel."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ncfix.machine.piecewise import Spline
from ncfix.measure.measurement import Array

PIECES = 14
"""Pieces of a spline over what was measured: bends down to a seventh of the travel."""
SMOOTH = (0.18, 0.4, 0.9)
"""Distances, of half the travel, over which a curve bends: wear, a scale's or guide's own shape, a bow."""
HARMONICS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.03, 0.02, 0.01)
"""Variance of the orders of an error that repeats with a turn."""
LOST = (1.0, 0.15, 0.1)
"""Variance of play: constant, growing, bowed along the travel."""


@lru_cache(maxsize=64)
def spline(low: float = -1.0, high: float = 1.0, pieces: int = PIECES) -> Spline:
    """Cubic pieces over low ... high of u."""
    inner = np.linspace(low, high, pieces + 1)
    knots = (low,) * 3 + tuple(float(x) for x in inner) + (high,) * 3
    return Spline(knots=knots)


@lru_cache(maxsize=64)
def smooth(length: float, low: float = -1.0, high: float = 1.0, pieces: int = PIECES) -> Array:
    """The loading of a spline that is a Gaussian process of this length, (k, k)."""
    places = _places(low, high, pieces)
    return _rooted(np.exp(-0.5 * ((places[:, None] - places) / length) ** 2))


def _places(low: float, high: float, pieces: int) -> Array:
    """Where the pieces have their middles."""
    knots = np.asarray(spline(low, high, pieces).knots)
    return np.array([knots[i + 1 : i + 4].mean() for i in range(pieces + 3)])


def _rooted(covariance: Array) -> Array:
    """Columns whose inner products are nearly this covariance."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-5 * values[-1]
    loading: Array = vectors[:, kept] * np.sqrt(values[kept])
    return loading


@lru_cache(maxsize=64)
def wandering(length: float, pieces: int) -> Array:
    """The loading of a spline that bends over this length, with kinks where a cause sets in (Matern 3/2), (k, p)."""
    places = _places(-1.0, 1.0, pieces)
    apart = np.sqrt(3) * np.abs(places[:, None] - places) / length
    return _rooted((1 + apart) * np.exp(-apart))


@lru_cache(maxsize=64)
def bent(length: float) -> Array:
    """The same without its mean and slope: those are constants of the machine."""
    return smooth(length) - _straight(length, 2)


@lru_cache(maxsize=64)
def turned(length: float) -> Array:
    """The same with half of its mean: where a tilt is zero, nobody knows; in part that is a constant of the machine."""
    return smooth(length) - 0.5 * _straight(length, 1)


def _straight(length: float, powers: int) -> Array:
    """Mean, and slope if `powers` is 2, of what `smooth` loads."""
    places = _places(-1.0, 1.0, PIECES)
    straight = np.linalg.qr(places[:, None] ** np.arange(powers))[0]
    found: Array = straight @ (straight.T @ smooth(length))
    return found


def harmonics(count: int) -> tuple[float, ...]:
    """Variances of cos and sin of the first orders."""
    return tuple(v for v in HARMONICS[:count] for _ in range(2))
