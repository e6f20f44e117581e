"""Piecewise bases: table, spline, step, truncated powers.

Outside the first and last place of a table, spline or step the end values hold.
"""

# The methods are documented in `Basis`.
# ruff: noqa: D102

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any, ClassVar, Self

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.machine.basis import Basis, columns_like, distinct, key, powers
from ncfix.values import frozen


def splines(knots: Array, degree: int, coefficients: Array, u: Array) -> Array:
    """(m, ...) sums of B-splines with coefficients (m, k) at u (...), all within the range of the knots.

    By de Boor's algorithm (A Practical Guide to Splines, chapter X). No library is used, because importing one takes
    longer than correcting a short program.
    """
    cell = np.clip(np.searchsorted(knots, u, side="right") - 1, degree, coefficients.shape[1] - 1)
    sums = [coefficients[:, cell - degree + j] for j in range(degree + 1)]
    for r in range(1, degree + 1):
        for j in range(degree, r - 1, -1):
            low, high = knots[cell - degree + j], knots[cell + 1 + j - r]
            width = high - low
            share = np.where(width > 0, (u - low) / np.where(width > 0, width, 1.0), 0.0)
            sums[j] = (1 - share) * sums[j - 1] + share * sums[j]
    return sums[degree]


def spline_slopes(knots: Array, degree: int, coefficients: Array, u: Array) -> Array:
    """(m, ...) the derivatives by u of the sums of `splines`: splines of one degree less."""
    return splines(knots[1:-1], degree - 1, spline_rates(knots, degree, coefficients), u)


def spline_rates(knots: Array, degree: int, coefficients: Array) -> Array:
    """(m, k - 1) the coefficients of the derivatives of splines (m, k), on the knots without the first and the last."""
    width = knots[degree + 1 : -1] - knots[1 : -degree - 1]
    rise = degree * np.diff(coefficients, axis=1)
    return np.where(width > 0, rise / np.where(width > 0, width, 1.0), 0.0)


BOTH, POSITIVE, NEGATIVE = "both", "positive", "negative"
ONE_WAY = "both, positive or negative: acts for this direction of motion only"


def share_of(way: str, direction: Array) -> Array | float:
    """Weight of an effect that acts in direction `way` for directions of motion (-1, 0, 1): 0 or 1, 0.5 if unknown."""
    if way == BOTH:
        return 1.0
    return 0.5 * (1 + (1.0 if way == POSITIVE else -1.0) * direction)


def no_way(way: str) -> list[tuple[str, str]]:
    """The complaint about an invalid direction; none for a valid one."""
    return [] if way in (BOTH, POSITIVE, NEGATIVE) else [("direction", f"{way!r} is none of both, positive, negative")]


@frozen
class PiecewiseLinear(Basis):
    """Values at given positions with straight lines between them, as in a control's own table."""

    positions: tuple[float, ...] = key("numbers", "where the values stand, ascending")
    direction: str = key("text", ONE_WAY, BOTH)
    name: ClassVar[str] = "table"
    title: ClassVar[str] = "values at `positions`, linear between them; for one `direction` if wanted"

    @property
    def needs_direction(self) -> bool:
        return self.direction != BOTH

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f"at {position}" for position in self.positions)

    @property
    def domain(self) -> tuple[float, float]:
        return self.positions[0], self.positions[-1]

    @property
    def kinks(self) -> tuple[float, ...]:
        return self.positions

    def feature(self, span: float) -> float:
        return float(np.diff(self.positions).min())

    def bounds(self, coefficients: tuple[float, ...], low: float, high: float) -> tuple[float, float, float] | None:
        rates = np.diff(coefficients) / np.diff(self.positions)
        return float(np.abs(coefficients).max()), float(np.abs(rates).max()), 0.0

    def complaints(self) -> list[tuple[str, str]]:
        if len(self.positions) < 2:
            return [("positions", "a table needs at least two positions")]
        return ascending("positions", self.positions) + no_way(self.direction)

    def rows(self, u: Array, direction: Array) -> Array:
        index, fraction = self._cell(u)
        rows = _at(index, 1 - fraction, self.size) + _at(index + 1, fraction, self.size)
        return rows * share_of(self.direction, direction)

    def slopes(self, u: Array, direction: Array) -> Array:
        index, _ = self._cell(u)
        inside = (u >= self.positions[0]) & (u < self.positions[-1])
        rate = np.where(inside, 1 / np.diff(self.positions)[index], 0.0)
        slopes = _at(index + 1, rate, self.size) - _at(index, rate, self.size)
        return slopes * share_of(self.direction, direction)

    def combine(self, gains: Array, u: Array, direction: Array) -> Array:
        index, fraction = self._cell(u)
        low: Array = gains[:, index]
        return (low + fraction * (gains[:, index + 1] - low)) * share_of(self.direction, direction)

    def _cell(self, u: Array) -> tuple[Any, Array]:
        positions = np.asarray(self.positions)
        index = np.clip(np.searchsorted(positions, u, side="right") - 1, 0, len(positions) - 2)
        fraction = (u - positions[index]) / np.diff(positions)[index]
        return index, np.clip(fraction, 0.0, 1.0)


@frozen
class Spline(Basis):
    """B-splines on a full knot vector (repeat the end knots degree times more); degree 3 is twice smooth."""

    knots: tuple[float, ...] = key("numbers", "full knot vector, not descending")
    degree: int = key("integer", "degree of the pieces", 3)
    name: ClassVar[str] = "spline"
    title: ClassVar[str] = "B-splines of `degree` on `knots`; len(knots) - degree - 1 coefficients"

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(f"B{i}" for i in range(len(self.knots) - self.degree - 1))

    @property
    def domain(self) -> tuple[float, float]:
        return self.knots[self.degree], self.knots[-self.degree - 1]

    @property
    def kinks(self) -> tuple[float, ...]:
        low, high = self.domain
        inside = Counter(knot for knot in self.knots if low < knot < high)
        return tuple(sorted(place for place, count in inside.items() if count >= self.degree))

    def feature(self, span: float) -> float:
        low, high = self.domain
        steps = np.diff(np.clip(self.knots, low, high))
        return float(steps[steps > 0].min())

    def bounds(self, coefficients: tuple[float, ...], low: float, high: float) -> tuple[float, float, float] | None:
        """See `Basis.bounds`: the values of a spline and of its derivatives lie between their coefficients."""
        found, knots, values = [], np.asarray(self.knots), np.asarray(coefficients)[None]
        for degree in range(self.degree, self.degree - 3, -1):
            found.append(float(np.abs(values).max()) if degree >= 0 else 0.0)
            if degree > 0:
                values, knots = spline_rates(knots, degree, values), knots[1:-1]
        return found[0], found[1], found[2]

    def complaints(self) -> list[tuple[str, str]]:
        if self.degree < 1:
            return [("degree", "a spline needs degree 1 or more; the basis `step` is piecewise constant")]
        if len(self.knots) < 2 * self.degree + 2:
            return [("knots", f"degree {self.degree} needs at least {2 * self.degree + 2} knots, ends repeated")]
        if self.domain[0] >= self.domain[1]:
            return [("knots", "the knots enclose no range")]
        return ascending("knots", self.knots, strictly=False)

    def rows(self, u: Array, direction: Array) -> Array:
        return self._sum(np.eye(self.size), u)

    def slopes(self, u: Array, direction: Array) -> Array:
        low, high = self.domain
        inside = (u >= low) & (u < high)
        return np.where(inside, self._sum(np.eye(self.size), u, order=1), 0.0)

    def combine(self, gains: Array, u: Array, direction: Array) -> Array:
        return self._sum(gains, u)

    def _sum(self, gains: Array, u: Array, order: int = 0) -> Array:
        evaluated = spline_slopes if order else splines
        return evaluated(np.asarray(self.knots), self.degree, gains, np.clip(u, *self.domain))


@frozen
class PiecewiseConstant(Basis):
    """One value below the first position, one between each pair, one above the last."""

    positions: tuple[float, ...] = key("numbers", "where the value jumps, ascending; it has the upper value there")
    direction: str = key("text", ONE_WAY, BOTH)
    name: ClassVar[str] = "step"
    title: ClassVar[str] = "constant pieces, one coefficient more than `positions`; for one `direction` if wanted"

    @property
    def needs_direction(self) -> bool:
        return self.direction != BOTH

    @property
    def labels(self) -> tuple[str, ...]:
        return "below", *(f"from {position}" for position in self.positions)

    @property
    def kinks(self) -> tuple[float, ...]:
        return self.positions

    def feature(self, span: float) -> float:
        return float(np.diff(self.positions).min()) if len(self.positions) > 1 else np.inf

    def bounds(self, coefficients: tuple[float, ...], low: float, high: float) -> tuple[float, float, float] | None:
        return float(np.abs(coefficients).max()), 0.0, 0.0

    def complaints(self) -> list[tuple[str, str]]:
        return ascending("positions", self.positions) + no_way(self.direction)

    def rows(self, u: Array, direction: Array) -> Array:
        share = share_of(self.direction, direction)
        return _at(np.searchsorted(np.asarray(self.positions), u, side="right"), share, self.size)

    def slopes(self, u: Array, direction: Array) -> Array:
        return np.zeros((self.size, *np.shape(u)))

    def combine(self, gains: Array, u: Array, direction: Array) -> Array:
        index = np.searchsorted(np.asarray(self.positions), u, side="right")
        return gains[:, index] * share_of(self.direction, direction)


def ascending(name: str, values: tuple[float, ...], strictly: bool = True) -> list[tuple[str, str]]:
    """The complaint about values that do not ascend; none if they do."""
    steps = np.diff(values)
    bad = np.flatnonzero(steps <= 0 if strictly else steps < 0)
    if not bad.size:
        return []
    at = int(bad[0])
    return [(name, f"{values[at]:g} is followed by {values[at + 1]:g}: not ascending")]


def _at(index: Any, values: Array | float, size: int) -> Array:
    """(size, ...) rows that are zero except for `values` in row `index`."""
    return np.where(columns_like(range(size), index) == index, values, 0.0)


@frozen
class Truncated(Basis):
    """Powers of u, and for each knot t a power of u - t above t: degree 2 is smooth once, 3 twice (Soons, Eq. 3.2).

    Each knot has a coefficient of its own, so that knots can be selected.

    With `detrended`, no function has a mean or slope between these ends, by least squares: straightness must have none,
    because its slope is squareness (J. A. Soons, TU Eindhoven 1993, Eq. 3.8).
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
            wrong.append(("knots", "neither knots nor powers are given"))
        if self.degree < 1:
            wrong.append(("degree", "pieces need degree 1 or more; the basis `step` is piecewise constant"))
        if len(self.detrended) not in (0, 2) or (self.detrended and self.detrended[0] >= self.detrended[1]):
            wrong.append(("detrended", "two ends, the lower one first"))
        elif self.detrended and not all(self.detrended[0] <= knot < self.detrended[1] for knot in self.knots):
            wrong.append(("knots", "knots must be between the ends of `detrended`"))
        return wrong

    def rows(self, u: Array, direction: Array) -> Array:
        u = np.asarray(u, dtype=np.float64)
        found = np.concatenate([powers(u, self.powers), self._above(u) ** self.degree])
        if not self.detrended:
            return found
        trend = self._trend()
        return found - columns_like(trend[:, 0], u) - columns_like(trend[:, 1], u) * u

    def slopes(self, u: Array, direction: Array) -> Array:
        u = np.asarray(u, dtype=np.float64)
        own = columns_like(self.powers, u) * powers(u, tuple(max(power - 1, 0) for power in self.powers))
        above = self._above(u)
        pieces = self.degree * above ** (self.degree - 1) * (above > 0)
        found = np.concatenate([own, pieces])
        return found - columns_like(self._trend()[:, 1], u) if self.detrended else found

    def without_knots(self, keep: Mask) -> Self:
        """The basis with the functions `keep` (k,) only."""
        own = len(self.powers)
        return replace(
            self,
            powers=tuple(power for power, k in zip(self.powers, keep[:own], strict=True) if k),
            knots=tuple(knot for knot, k in zip(self.knots, keep[own:], strict=True) if k),
        )

    def _above(self, u: Array) -> Array:
        """(k, ...) u minus each knot; zero below the knot."""
        return np.maximum(u - columns_like(self.knots, u), 0.0)

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


PIECEWISE: tuple[type[Basis], ...] = (PiecewiseLinear, Spline, PiecewiseConstant, Truncated)
