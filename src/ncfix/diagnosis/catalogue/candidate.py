"""A candidate: a named physical effect as a group of functions with a prior on their coefficients.

A group is never cut into columns: a curve, a set of harmonics, a sag with its slope is one candidate. Its coefficients
are `loading @ z`, z independent with variance one, so a loading carries what the physics says about them: how smooth a
curve is, how harmonics decay, which rotation comes with a deflection. Several loadings are several forms of one name.

Shapes: bases with priors on their coefficients. A curve is smooth, harmonics decay, play grows along the travel.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import lru_cache
from typing import Any

import numpy as np

from ncfix.arrays import Array
from ncfix.machine import Effect, Machine
from ncfix.machine.axes import Axis
from ncfix.machine.piecewise import Spline
from ncfix.values import frozen

LETTERS = "XYZ"
TURNS = "ABC"
UNTOUCHED_MM, UNTOUCHED_DEG = 1.0, 5.0
"""An axis that moves less than this was not measured."""
PIECES = 14
"""Pieces of a spline over what was measured: bends down to a seventh of the travel."""
SMOOTH = (0.18, 0.4, 0.9)
"""Distances, of half the travel, over which a curve bends: wear, a scale's or guide's own shape, a bow."""
HARMONICS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.03, 0.02, 0.01)
"""Variance of the orders of an error that repeats with a turn."""
LOST = (1.0, 0.15, 0.1)
"""Variance of play: constant, growing, bowed along the travel."""


@frozen(repr=False, slots=False)
class Candidate:
    """A physical effect that may be missing.

    name      as it is reported; `kind` is its first words, `axis` the letter of the axis it belongs to, or ""
    title     in words
    family    effects of one family are next of kin: one may stand for another
    effects   what it adds to a machine file, zero until estimated
    loadings  each (k, p) for the k coefficients of all effects: forms of the effect
    needs     state columns without which it cannot be seen
    remedy    what can be done about it besides compensation, in words
    grows     it belongs to the measurement: what stands on the table expands; `effects` then only say what drives it
    lead      how many of the effects are the effect itself, the rest only comes with it; 0: all
    constant  a constant of the machine that its file does not have: it goes before all that is not one
    dynamic   it is of the drives while axes move: where they stand it is not there
    """

    name: str
    title: str
    axis: str
    family: str
    effects: tuple[Effect, ...]
    loadings: tuple[Array, ...]
    needs: tuple[str, ...] = ()
    remedy: str = ""
    grows: bool = False
    lead: int = 0
    constant: bool = False
    dynamic: bool = False

    @property
    def kept_out(self) -> bool:
        """Whether nothing of it is added to a machine file."""
        return self.grows or self.dynamic

    @property
    def slow(self) -> bool:
        """Whether it is nothing but a course of time, wherever it acts."""
        signals = [effect.input or "" for effect in self.effects]
        return bool(signals) and all(signal == "time_s" or signal.startswith("temp_") for signal in signals)


@frozen(slots=False)
class MeasuredRange:
    """What was measured: where the axes were, and which state columns there are.

    spans    axis -> (low, high), mm or degree, of what was measured
    columns  state columns that every file has and that vary
    clock    (first, last) time, s
    warmth   temperature column -> (mean, standard deviation), K; what a thermal effect is at the mean is a constant
    """

    machine: Machine
    spans: Mapping[str, tuple[float, float]]
    columns: frozenset[str]
    clock: tuple[float, float] = (0.0, 0.0)
    warmth: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def moved(self, axis: Axis) -> bool:
        """Whether an axis was moved enough to say anything of it."""
        low, high = self.spans[axis.name]
        return high - low > (UNTOUCHED_DEG if axis.rotary else UNTOUCHED_MM)

    def scaled(self, axis: Axis) -> dict[str, Any]:
        """`center` and `scale` of an effect, so that u is -1 ... 1 over what was measured."""
        low, high = self.spans[axis.name]
        return {"center": (low + high) / 2, "scale": max((high - low) / 2, 1e-6)}

    def factor(self, axis: Axis) -> dict[str, Any]:
        """`center` and `scale` of an axis that multiplies an effect."""
        found = self.scaled(axis)
        return {"times": axis.name, "times_center": found["center"], "times_scale": found["scale"]}

    @property
    def linear(self) -> tuple[Axis, ...]:
        """The linear axes that were moved."""
        return tuple(axis for axis in self.machine.axes if not axis.rotary and self.moved(axis))

    @property
    def rotary(self) -> tuple[Axis, ...]:
        """The rotary axes that were moved."""
        return tuple(axis for axis in self.machine.axes if axis.rotary and self.moved(axis))

    @property
    def sensors(self) -> tuple[str, ...]:
        """The temperatures that were logged."""
        return tuple(sorted(name for name in self.columns if name.startswith("temp_")))


def along(axis: Axis) -> int | None:
    """Which of its error axes lies along the axis itself (0, 1, 2); None if none does."""
    shares = np.abs(np.asarray(axis.error_axes) @ np.asarray(axis.direction))
    index = int(shares.argmax())
    return index if shares[index] > 1 - 1e-9 else None


def across(axis: Axis) -> tuple[int, ...]:
    """The other two; all three where none lies along."""
    own = along(axis)
    return tuple(k for k in range(3) if k != own)


def zero(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """The effects with as many zeros as their bases ask for."""
    from dataclasses import replace

    return tuple(replace(effect, coefficients=(0.0,) * effect.basis.size) for effect in effects)


def weighed(variances: Sequence[float] | Array) -> Array:
    """A loading of independent coefficients with these variances."""
    return np.diag(np.sqrt(np.asarray(variances, dtype=np.float64)))


def stacked(*parts: Array) -> Array:
    """Loadings of several effects that are independent of one another, one below the other."""
    from scipy.linalg import block_diag

    whole: Array = block_diag(*parts)
    return whole


@lru_cache(maxsize=64)
def spline(low: float = -1.0, high: float = 1.0, pieces: int = PIECES) -> Spline:
    """Cubic pieces over low ... high of u."""
    inner = np.linspace(low, high, pieces + 1)
    knots = (low,) * 3 + tuple(float(x) for x in inner) + (high,) * 3
    return Spline(knots=knots)


@lru_cache(maxsize=64)
def smooth_loading(length: float, low: float = -1.0, high: float = 1.0, pieces: int = PIECES) -> Array:
    """The loading of a spline that is a Gaussian process of this length, (k, k)."""
    places = _spline_places(low, high, pieces)
    return _root(np.exp(-0.5 * ((places[:, None] - places) / length) ** 2))


def _spline_places(low: float, high: float, pieces: int) -> Array:
    """Where the pieces have their middles."""
    knots = np.asarray(spline(low, high, pieces).knots)
    return np.array([knots[i + 1 : i + 4].mean() for i in range(pieces + 3)])


def _root(covariance: Array) -> Array:
    """Columns whose inner products are nearly this covariance."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-5 * values[-1]
    loading: Array = vectors[:, kept] * np.sqrt(values[kept])
    return loading


@lru_cache(maxsize=64)
def time_course(length: float, pieces: int) -> Array:
    """The loading of a spline that bends over this length, with kinks where a cause sets in (Matern 3/2), (k, p)."""
    places = _spline_places(-1.0, 1.0, pieces)
    apart = np.sqrt(3) * np.abs(places[:, None] - places) / length
    return _root((1 + apart) * np.exp(-apart))


@lru_cache(maxsize=64)
def bent_loading(length: float) -> Array:
    """A spline loading without its mean and slope: those are constants of the machine."""
    return smooth_loading(length) - _straight(length, 2)


@lru_cache(maxsize=64)
def leaning_loading(length: float) -> Array:
    """A spline loading without its mean, and with half of its slope: other constants stand for that in part."""
    return smooth_loading(length) - 0.5 * (_straight(length, 1) + _straight(length, 2))


@lru_cache(maxsize=64)
def turned_loading(length: float) -> Array:
    """A spline loading with half of its mean: where a tilt is zero nobody knows; in part that is a constant."""
    return smooth_loading(length) - 0.5 * _straight(length, 1)


def _straight(length: float, powers: int) -> Array:
    """Mean, and slope if `powers` is 2, of what `smooth` loads."""
    places = _spline_places(-1.0, 1.0, PIECES)
    straight = np.linalg.qr(places[:, None] ** np.arange(powers))[0]
    return straight @ (straight.T @ smooth_loading(length))


def harmonic_variances(count: int) -> tuple[float, ...]:
    """Variances of cos and sin of the first orders."""
    return tuple(v for v in HARMONICS[:count] for _ in range(2))
