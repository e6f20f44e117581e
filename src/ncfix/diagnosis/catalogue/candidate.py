"""A candidate: a named physical effect with priors on its coefficients; and the priors of smooth and periodic shapes.

A candidate is a group of functions that is selected as a whole: a curve, a set of harmonics, a sag with its slope. Its
coefficients are `loading @ z`, with z independent and of variance one. A loading expresses the physics: how smooth a
curve is, how harmonics decay, which rotation comes with a deflection. Several loadings are several forms of one name.
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
"""An axis whose positions span less than this counts as not moved."""
PIECES = 14
"""Pieces of a spline over the measured travel: resolves bends down to a seventh of it."""
SMOOTH = (0.18, 0.4, 0.9)
"""Correlation lengths of a curve, in units of half the travel: of wear, the shape of a scale or guide, a bow."""
HARMONICS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.03, 0.02, 0.01)
"""Variances of orders 1, 2, ... of a periodic error."""
LOST = (1.0, 0.15, 0.1)
"""Variances of a play's constant, linear and quadratic part along the travel."""


@frozen(repr=False, slots=False)
class Candidate:
    """A physical effect that may be missing.

    name      as reported: the kind of effect, then the axis
    title     description in words
    axis      letter of the axis to which it belongs, or ""
    family    related effects, which may imitate one another, have the same family
    effects   effects that it adds to a machine file, zero until estimated
    loadings  one (k, p) for each form of the effect, for the k coefficients of all effects
    needs     state columns without which it cannot be seen
    remedy    what can be done about it besides compensation, in words
    grows     an expansion of the part on the table, no error of the machine; `effects` then give its course only
    lead      number of leading effects; the others only accompany them; 0: all lead
    constant  a constant that the machine file lacks, which is selected before other effects
    dynamic   an error of the drives while axes move, absent at standstill
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
        """Whether it adds nothing to a machine file."""
        return self.grows or self.dynamic

    @property
    def slow(self) -> bool:
        """Whether all of its effects depend on time or temperature, and so may look like drift of the instrument."""
        signals = [effect.input or "" for effect in self.effects]
        return bool(signals) and all(signal == "time_s" or signal.startswith("temp_") for signal in signals)


@frozen(slots=False)
class MeasuredRange:
    """The measured ranges of axes, inputs and time.

    spans    axis -> (low, high) position, mm or degree
    columns  state columns that every file has and that vary
    clock    (first, last) time, s
    warmth   temperature column -> (mean, standard deviation), K; thermal effects are zero at the mean
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
        """`center` and `scale` of an effect, so that u is -1 ... 1 over the measured range of an axis."""
        low, high = self.spans[axis.name]
        return {"center": (low + high) / 2, "scale": max((high - low) / 2, 1e-6)}

    def factor(self, axis: Axis) -> dict[str, Any]:
        """`times`, `times_center` and `times_scale` of an effect that is multiplied by the position of an axis."""
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
    """Index (0, 1, 2) of the error axis along the direction of the axis itself; None if none is."""
    shares = np.abs(np.asarray(axis.error_axes) @ np.asarray(axis.direction))
    index = int(shares.argmax())
    return index if shares[index] > 1 - 1e-9 else None


def across(axis: Axis) -> tuple[int, ...]:
    """Indices of the error axes across the axis; all three if none is along it."""
    own = along(axis)
    return tuple(k for k in range(3) if k != own)


def zero(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """The effects with zero coefficients."""
    from dataclasses import replace

    return tuple(replace(effect, coefficients=(0.0,) * effect.basis.size) for effect in effects)


def weighed(variances: Sequence[float] | Array) -> Array:
    """The loading of independent coefficients with these variances."""
    return np.diag(np.sqrt(np.asarray(variances, dtype=np.float64)))


def stacked(*parts: Array) -> Array:
    """The loading of several independent effects: their loadings as a block diagonal."""
    from scipy.linalg import block_diag

    whole: Array = block_diag(*parts)
    return whole


@lru_cache(maxsize=64)
def spline(low: float = -1.0, high: float = 1.0, pieces: int = PIECES) -> Spline:
    """A cubic spline of equal pieces over low ... high of u."""
    inner = np.linspace(low, high, pieces + 1)
    knots = (low,) * 3 + tuple(float(x) for x in inner) + (high,) * 3
    return Spline(knots=knots)


@lru_cache(maxsize=64)
def smooth_loading(length: float, low: float = -1.0, high: float = 1.0, pieces: int = PIECES) -> Array:
    """The loading (k, p) of a spline as a Gaussian process with this correlation length (squared exponential)."""
    places = _spline_places(low, high, pieces)
    return _root(np.exp(-0.5 * ((places[:, None] - places) / length) ** 2))


def _spline_places(low: float, high: float, pieces: int) -> Array:
    """Position of each coefficient of a spline: the mean of its inner knots (Greville abscissa), (pieces + 3,)."""
    knots = np.asarray(spline(low, high, pieces).knots)
    return np.array([knots[i + 1 : i + 4].mean() for i in range(pieces + 3)])


def _root(covariance: Array) -> Array:
    """A loading L (k, p) with L L' nearly equal to the covariance (k, k)."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-5 * values[-1]
    loading: Array = vectors[:, kept] * np.sqrt(values[kept])
    return loading


@lru_cache(maxsize=64)
def time_course(length: float, pieces: int) -> Array:
    """The loading (k, p) of a spline as a Gaussian process with kinks (Matern 3/2), of this correlation length."""
    places = _spline_places(-1.0, 1.0, pieces)
    apart = np.sqrt(3) * np.abs(places[:, None] - places) / length
    return _root((1 + apart) * np.exp(-apart))


@lru_cache(maxsize=64)
def bent_loading(length: float) -> Array:
    """The loading of a smooth spline without mean and slope, which are constants of the machine."""
    return smooth_loading(length) - _straight(length, 2)


@lru_cache(maxsize=64)
def leaning_loading(length: float) -> Array:
    """The loading of a smooth spline without mean and with half the slope, which other constants imitate in part."""
    return smooth_loading(length) - 0.5 * (_straight(length, 1) + _straight(length, 2))


@lru_cache(maxsize=64)
def turned_loading(length: float) -> Array:
    """The loading of a smooth spline with half the mean: the zero of a tilt is arbitrary, in part a constant."""
    return smooth_loading(length) - 0.5 * _straight(length, 1)


def _straight(length: float, powers: int) -> Array:
    """The mean, and with `powers` 2 the slope as well, of `smooth_loading`."""
    places = _spline_places(-1.0, 1.0, PIECES)
    straight = np.linalg.qr(places[:, None] ** np.arange(powers))[0]
    return straight @ (straight.T @ smooth_loading(length))


def harmonic_variances(count: int) -> tuple[float, ...]:
    """Variances of cosine and sine of the first `count` orders."""
    return tuple(v for v in HARMONICS[:count] for _ in range(2))
