"""Piecewise polynomials by truncated powers: a coefficient for each knot, so that knots can be chosen.

J. A. Soons, TU Eindhoven 1993, Eq. 3.2 and 3.8.
"""

# What the methods mean is said once, in `Basis`.
# ruff: noqa: D102

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ncfix.machine.basis import Array, Basis, key
from ncfix.machine.piecewise import ascending
from ncfix.machine.smooth import distinct, powers


@dataclass(frozen=True, slots=True)
class Truncated(Basis):
    """Powers of u, and for each knot t the power of u - t above it: degree 2 is once smooth, 3 twice.

    With `detrended` each function has no mean and no slope between these ends, by least squares over all of it: what
    straightness must not have, since that is squareness (Soons, Eq. 3.8).
    """

    knots: tuple[float, ...] = key("numbers", "where the pieces meet, ascending")
    degree: int = key("integer", "degree of the pieces", 2)
    powers: tuple[int, ...] = key("integers", "which powers of u besides", (1, 2))
    detrended: tuple[float, ...] = key("numbers", "two ends between which no function has a mean or slope", ())
    name: ClassVar[str] = "truncated"
    title: ClassVar[str] = "powers of u and, above each of `knots`, (u - knot)^degree; smooth for degree 2 and 3"

    @property
    def labels(self) -> tuple[str, ...]:
        return (*(f"u^{power}" for power in self.powers), *(f"above {knot:g}" for knot in self.knots))

    @property
    def kinks(self) -> tuple[float, ...]:
        return self.knots if self.degree == 1 else ()

    def feature(self, span: float) -> float:
        steps = np.diff(self.knots)
        return float(steps.min()) if len(steps) else span / (4 * max(self.degree, *self.powers))

    def complaints(self) -> list[tuple[str, str]]:
        wrong = ascending("knots", self.knots)
        wrong += distinct("powers", self.powers, lowest=0) if self.powers else []
        if not self.powers and not self.knots:
            wrong.append(("knots", "there are neither knots nor powers"))
        if self.degree < 1:
            wrong.append(("degree", "pieces have degree 1 or more; `step` is piecewise constant"))
        if len(self.detrended) not in (0, 2) or (self.detrended and self.detrended[0] >= self.detrended[1]):
            wrong.append(("detrended", "two ends, the lower one first"))
        elif self.detrended and not all(self.detrended[0] <= knot < self.detrended[1] for knot in self.knots):
            wrong.append(("knots", "they lie between the ends of `detrended`"))
        return wrong

    def rows(self, u: Array, direction: Array) -> Array:
        u = np.asarray(u, dtype=np.float64)
        found = np.concatenate([_powers(u, self.powers), self._above(u) ** self.degree])
        if not self.detrended:
            return found
        trend = self._trend()
        return found - _column(trend[:, 0], u) - _column(trend[:, 1], u) * u

    def slopes(self, u: Array, direction: Array) -> Array:
        u = np.asarray(u, dtype=np.float64)
        own = _column(np.array(self.powers), u) * _powers(u, tuple(max(power - 1, 0) for power in self.powers))
        above = self._above(u)
        pieces = self.degree * above ** (self.degree - 1) * (above > 0)
        found = np.concatenate([own, pieces])
        return found - _column(self._trend()[:, 1], u) if self.detrended else found

    def without_knots(self, keep: NDArray[np.bool_]) -> Self:
        """The basis with some of its functions only."""
        own = len(self.powers)
        return replace(
            self,
            powers=tuple(power for power, k in zip(self.powers, keep[:own], strict=True) if k),
            knots=tuple(knot for knot, k in zip(self.knots, keep[own:], strict=True) if k),
        )

    def _above(self, u: Array) -> Array:
        """How far u is above each knot, (k, ...); zero below it."""
        above: Array = np.maximum(u - _column(np.array(self.knots), u), 0.0)
        return above

    def _trend(self) -> Array:
        """Mean and slope of each function between the ends, as [a1, a2] of a1 + a2 u, (k, 2)."""
        low, high = self.detrended
        moments = np.array([_moments(power, low, high, 0.0) for power in self.powers]).reshape(-1, 2)
        above = np.array([_moments(self.degree, knot, high, knot) for knot in self.knots]).reshape(-1, 2)
        normal = np.array([[high - low, (high**2 - low**2) / 2], [(high**2 - low**2) / 2, (high**3 - low**3) / 3]])
        return np.linalg.solve(normal, np.concatenate([moments, above]).T).T


def _moments(power: int, low: float, high: float, knot: float) -> tuple[float, float]:
    """The integrals of (u - knot)^power, and of that times u, from low to high."""

    def integral(n: int) -> float:
        return float((high - knot) ** (n + 1) - (low - knot) ** (n + 1)) / (n + 1)

    return integral(power), integral(power + 1) + knot * integral(power)


def _powers(u: Array, degree: tuple[int, ...]) -> Array:
    return powers(u, degree) if degree else np.zeros((0, *u.shape))


def _column(values: Array, u: Array) -> Array:
    return np.asarray(values, dtype=np.float64).reshape(-1, *np.ones(np.ndim(u), dtype=int))


BASES: tuple[type[Basis], ...] = (Truncated,)
