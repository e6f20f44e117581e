"""Bases: known functions of one signal whose weighted sum is an error. This module has the smooth ones, and play.

The argument of a basis is u = (x - center) / scale, x in the unit of the machine file (mm, degree, or an input's unit).
Its own parameters are the fields of a frozen dataclass, declared with `key`; the machine file is read and written by
these declarations, so a plugin's basis needs no code for that. Register one with the hook `register_bases`.
"""

# The methods are documented in `Basis`.
# ruff: noqa: D102

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import field, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from ncfix.arrays import Array
from ncfix.values import frozen

REQUIRED = object()


def key(kind: str, meaning: str, default: Any = REQUIRED) -> Any:
    """Declare a parameter of a basis and its key in the machine file.

    kind: "number", "numbers", "integer", "integers" or "text".
    """
    metadata = {"kind": kind, "meaning": meaning, "required": default is REQUIRED}
    return field(metadata=metadata) if default is REQUIRED else field(default=default, metadata=metadata)


class Basis(ABC):
    """Functions f_1 ... f_k of u (and of the direction of motion); an error is sum c_i f_i."""

    __slots__ = ()

    name: ClassVar[str]
    title: ClassVar[str]
    needs_signal: ClassVar[bool] = True
    rotary_only: ClassVar[bool] = False

    @property
    @abstractmethod
    def labels(self) -> tuple[str, ...]:
        """One short name per coefficient, in their order."""

    @abstractmethod
    def rows(self, u: Array, direction: Array) -> Array:
        """The functions at u, shape (...) -> (k, ...); `direction` is -1, 0 (unknown) or 1, same shape as u."""

    @abstractmethod
    def slopes(self, u: Array, direction: Array) -> Array:
        """The derivatives of the functions by u, shape (...) -> (k, ...); at a kink, that of the upper side."""

    @abstractmethod
    def feature(self, span: float) -> float:
        """The smallest distance of u over which the sum may bend, if u has the range `span`; inf if it never does."""

    @property
    def needs_direction(self) -> bool:
        """Whether the functions depend on the direction of motion."""
        return False

    @property
    def size(self) -> int:
        """The number of coefficients."""
        return len(self.labels)

    @property
    def domain(self) -> tuple[float, float]:
        """The range of u for which the functions are given; outside, the end values hold."""
        return -np.inf, np.inf

    @property
    def kinks(self) -> tuple[float, ...]:
        """The u at which the sum has a jump or a kink."""
        return ()

    @property
    def family(self) -> tuple[object, ...]:
        """A key that is equal for bases that can be merged into one."""
        return self.name, self

    def merged(self, other: Self) -> Self:
        """A basis of the same family with the functions of both."""
        return self

    def bounds(self, coefficients: tuple[float, ...], low: float, high: float) -> tuple[float, float, float] | None:
        """Bounds of the size, slope and curvature of the sum with these coefficients for u from low to high.

        Kinks and jumps do not count. None if no bounds are known, or there are none.
        """
        return None

    def complaints(self) -> list[tuple[str, str]]:
        """(key, text) of each fault of the parameters."""
        return []

    def design(self, u: Array, direction: Array | float = 0.0) -> Array:
        """The functions at u as rows of a design matrix, shape (...) -> (..., k)."""
        u = np.asarray(u, dtype=np.float64)
        return np.moveaxis(self.rows(u, np.broadcast_to(direction, u.shape)), 0, -1)

    def derivative(self, u: Array, direction: Array | float = 0.0) -> Array:
        """The derivatives of the functions by u, shape (...) -> (..., k)."""
        u = np.asarray(u, dtype=np.float64)
        return np.moveaxis(self.slopes(u, np.broadcast_to(direction, u.shape)), 0, -1)

    def combine(self, gains: Array, u: Array, direction: Array) -> Array:
        """Several sums at once, gains (m, k) and u (n,) -> (m, n)."""
        return gains @ self.rows(u, direction)


def check_shapes(basis: Basis) -> None:
    """Raise ValueError for a basis that does not return one row for each coefficient."""
    u = np.array([-0.5, 0.0, 0.5])
    for name, function in (("rows", basis.rows), ("slopes", basis.slopes)):
        shape = np.shape(function(u, np.zeros(3)))
        if shape != (basis.size, 3):
            raise ValueError(f"{name} gives shape {shape} for three places and {basis.size} coefficients")


@frozen
class ConstantBasis(Basis):
    """One number, whatever the signal."""

    name: ClassVar[str] = "constant"
    title: ClassVar[str] = "one number, independent of position"
    needs_signal: ClassVar[bool] = False

    @property
    def labels(self) -> tuple[str, ...]:
        return ("1",)

    def rows(self, u: Array, direction: Array) -> Array:
        return np.ones((1, *np.shape(u)))

    def slopes(self, u: Array, direction: Array) -> Array:
        return np.zeros((1, *np.shape(u)))

    def feature(self, span: float) -> float:
        return np.inf

    def bounds(self, coefficients: tuple[float, ...], low: float, high: float) -> tuple[float, float, float] | None:
        return abs(coefficients[0]), 0.0, 0.0


@frozen
class Polynomial(Basis):
    """Powers of u."""

    degree: tuple[int, ...] = key("integers", "which powers of u, one coefficient each")
    name: ClassVar[str] = "polynomial"
    title: ClassVar[str] = "powers of u = (x - center) / scale"

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f"u^{power}" for power in self.degree)

    def rows(self, u: Array, direction: Array) -> Array:
        return powers(u, self.degree)

    def slopes(self, u: Array, direction: Array) -> Array:
        return columns_like(self.degree, u) * powers(u, tuple(max(power - 1, 0) for power in self.degree))

    def feature(self, span: float) -> float:
        return span / (4 * max(self.degree)) if max(self.degree) else np.inf

    def bounds(self, coefficients: tuple[float, ...], low: float, high: float) -> tuple[float, float, float] | None:
        most = max(abs(low), abs(high))
        if not np.isfinite(most) and any(self.degree):
            return None
        size, slope, curvature = 0.0, 0.0, 0.0
        for coefficient, k in zip(coefficients, self.degree, strict=True):
            size += abs(coefficient) * most**k if k else abs(coefficient)
            slope += abs(coefficient) * k * most ** max(k - 1, 0)
            curvature += abs(coefficient) * k * (k - 1) * most ** max(k - 2, 0)
        return size, slope, curvature

    @property
    def family(self) -> tuple[object, ...]:
        return (self.name,)

    def merged(self, other: Self) -> Self:
        return replace(self, degree=tuple(sorted({*self.degree, *other.degree})))

    def complaints(self) -> list[tuple[str, str]]:
        return distinct("degree", self.degree, lowest=0)


@frozen
class Backlash(Polynomial):
    """Half the play of an axis: +1/2 if its position was approached in positive direction, -1/2 in negative."""

    degree: tuple[int, ...] = key("integers", "which powers of u, one coefficient each", (0,))
    name: ClassVar[str] = "backlash"
    title: ClassVar[str] = "direction of motion (-1, 0 unknown, 1) times half the powers of u"

    @property
    def needs_direction(self) -> bool:
        return True

    def rows(self, u: Array, direction: Array) -> Array:
        return 0.5 * direction * powers(u, self.degree)

    def slopes(self, u: Array, direction: Array) -> Array:
        return 0.5 * direction * columns_like(self.degree, u) * powers(u, tuple(max(p - 1, 0) for p in self.degree))


@frozen
class Fourier(Basis):
    """Harmonics of the angle of a rotary axis."""

    order: tuple[int, ...] = key("integers", "harmonics, cos and sin of each in turn")
    name: ClassVar[str] = "fourier"
    title: ClassVar[str] = "cos and sin of k times the angle of a rotary axis, k in `order`"
    rotary_only: ClassVar[bool] = True

    @property
    def turn(self) -> float:
        """The u of one period."""
        return 360.0

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f"{function} {k}" for k in self.order for function in ("cos", "sin"))

    def rows(self, u: Array, direction: Array) -> Array:
        return _waves(u, self.order, self.turn)

    def slopes(self, u: Array, direction: Array) -> Array:
        waves = _waves(u, self.order, self.turn)
        rate = 2 * np.pi / self.turn * columns_like(self.order, u)
        slopes = np.empty_like(waves)
        slopes[0::2], slopes[1::2] = -rate * waves[1::2], rate * waves[0::2]
        return slopes

    def feature(self, span: float) -> float:
        return self.turn / (8 * max(self.order))

    def bounds(self, coefficients: tuple[float, ...], low: float, high: float) -> tuple[float, float, float] | None:
        sizes = np.hypot(coefficients[0::2], coefficients[1::2])
        rates = 2 * np.pi / self.turn * np.array(self.order)
        return float(sizes.sum()), float((sizes * rates).sum()), float((sizes * rates**2).sum())

    @property
    def family(self) -> tuple[object, ...]:
        return self.name, self.turn

    def merged(self, other: Self) -> Self:
        return replace(self, order=tuple(sorted({*self.order, *other.order})))

    def complaints(self) -> list[tuple[str, str]]:
        return distinct("order", self.order, lowest=1)


@frozen
class Periodic(Fourier):
    """Harmonics of a period, as of a screw's pitch, a scale's grating, or a gear."""

    period: float = key("number", "length of one period, mm or degree")
    name: ClassVar[str] = "periodic"
    title: ClassVar[str] = "cos and sin of 2 pi k u / period, k in `order`"
    rotary_only: ClassVar[bool] = False

    @property
    def turn(self) -> float:
        """The u of one period."""
        return self.period

    def complaints(self) -> list[tuple[str, str]]:
        wrong = [] if self.period > 0 else [("period", f"{self.period:g} is not a positive length")]
        return wrong + distinct("order", self.order, lowest=1)


def powers(u: Array, degree: tuple[int, ...]) -> Array:
    """Powers of u by repeated multiplication, shape (...) -> (k, ...)."""
    u = np.asarray(u, dtype=np.float64)
    ladder = np.empty((max(degree, default=0) + 1, *u.shape))
    ladder[0] = 1.0
    for power in range(1, len(ladder)):
        ladder[power] = ladder[power - 1] * u
    return ladder if degree == tuple(range(len(ladder))) else ladder[list(degree)]


HIGHEST = 1000
"""Largest power or harmonic that is accepted."""


def distinct(name: str, values: tuple[int, ...], lowest: int) -> list[tuple[str, str]]:
    """The complaint about values that are missing, repeated, below `lowest` or beyond `HIGHEST`; none if valid."""
    if not values:
        return [(name, "is empty")]
    if min(values) < lowest:
        return [(name, f"{min(values)} is below {lowest}")]
    if max(values) > HIGHEST:
        return [(name, f"exceeds {HIGHEST}")]
    if len(set(values)) < len(values):
        return [(name, "has a value twice")]
    return []


def columns_like(values: ArrayLike, u: ArrayLike) -> Array:
    """Values (k,) in the shape (k, 1, ...), which broadcasts with u (...)."""
    return np.asarray(values, dtype=np.float64).reshape(-1, *np.ones(np.ndim(u), dtype=int))


def _waves(u: Array, order: tuple[int, ...], period: float) -> Array:
    phase = (2 * np.pi / period) * np.asarray(u, dtype=np.float64) * columns_like(order, u)
    waves = np.empty((2 * len(order), *np.shape(u)))
    waves[0::2], waves[1::2] = np.cos(phase), np.sin(phase)
    return waves


SMOOTH: tuple[type[Basis], ...] = (ConstantBasis, Polynomial, Fourier, Periodic, Backlash)
