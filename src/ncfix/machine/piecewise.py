"""Bases that are given piece by piece: table, spline, step. Outside the first and last place the end values hold."""

# What the methods mean is said once, in `Basis`.
# ruff: noqa: D102

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ncfix.machine import bspline
from ncfix.machine.basis import Array, Basis, key

BOTH, POSITIVE, NEGATIVE = "both", "positive", "negative"


@dataclass(frozen=True, slots=True)
class Table(Basis):
    """Values at given positions, straight lines between them: what a control's own table holds."""

    positions: tuple[float, ...] = key("numbers", "where the values stand, ascending")
    name: ClassVar[str] = "table"
    title: ClassVar[str] = "values at `positions`, linear between them"

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
        return ascending("positions", self.positions)

    def rows(self, u: Array, direction: Array) -> Array:
        index, fraction = self._cell(u)
        return _at(index, 1 - fraction, self.size) + _at(index + 1, fraction, self.size)

    def slopes(self, u: Array, direction: Array) -> Array:
        index, _ = self._cell(u)
        inside = (u >= self.positions[0]) & (u < self.positions[-1])
        rate = np.where(inside, 1 / np.diff(self.positions)[index], 0.0)
        return _at(index + 1, rate, self.size) - _at(index, rate, self.size)

    def combine(self, gains: Array, u: Array, direction: Array) -> Array:
        index, fraction = self._cell(u)
        low: Array = gains[:, index]
        return low + fraction * (gains[:, index + 1] - low)

    def _cell(self, u: Array) -> tuple[Any, Array]:
        positions = np.asarray(self.positions)
        index = np.clip(np.searchsorted(positions, u, side="right") - 1, 0, len(positions) - 2)
        fraction = (u - positions[index]) / np.diff(positions)[index]
        return index, np.clip(fraction, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
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
        places, counts = np.unique(self.knots, return_counts=True)
        inside = (places > self.domain[0]) & (places < self.domain[1])
        return tuple(float(place) for place in places[inside & (counts >= self.degree)])

    def feature(self, span: float) -> float:
        low, high = self.domain
        steps = np.diff(np.clip(self.knots, low, high))
        return float(steps[steps > 0].min())

    def bounds(self, coefficients: tuple[float, ...], low: float, high: float) -> tuple[float, float, float] | None:
        """By the coefficients of the spline and of its derivatives, between which their values lie."""
        found, knots, values = [], np.asarray(self.knots), np.asarray(coefficients)[None]
        for degree in range(self.degree, self.degree - 3, -1):
            found.append(float(np.abs(values).max()) if degree >= 0 else 0.0)
            if degree > 0:
                values, knots = bspline.rates(knots, degree, values), knots[1:-1]
        return found[0], found[1], found[2]

    def complaints(self) -> list[tuple[str, str]]:
        if self.degree < 1:
            return [("degree", "a spline has degree 1 or more; `step` is piecewise constant")]
        if len(self.knots) < 2 * self.degree + 2:
            return [("knots", f"degree {self.degree} needs at least {2 * self.degree + 2} knots, ends repeated")]
        if self.domain[0] >= self.domain[1]:
            return [("knots", "the knots leave no range")]
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
        evaluated = bspline.slopes if order else bspline.splines
        return evaluated(np.asarray(self.knots), self.degree, gains, np.clip(u, *self.domain))


@dataclass(frozen=True, slots=True)
class Step(Basis):
    """One value below the first position, one between each pair, one above the last."""

    positions: tuple[float, ...] = key("numbers", "where the value jumps, ascending; it has the upper value there")
    direction: str = key("text", "both, positive or negative: acts for this direction of motion only", BOTH)
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
        wrong = ascending("positions", self.positions)
        if self.direction not in (BOTH, POSITIVE, NEGATIVE):
            wrong.append(("direction", f"{self.direction!r} is none of both, positive, negative"))
        return wrong

    def rows(self, u: Array, direction: Array) -> Array:
        return _at(np.searchsorted(np.asarray(self.positions), u, side="right"), self._share(direction), self.size)

    def slopes(self, u: Array, direction: Array) -> Array:
        return np.zeros((self.size, *np.shape(u)))

    def combine(self, gains: Array, u: Array, direction: Array) -> Array:
        index = np.searchsorted(np.asarray(self.positions), u, side="right")
        result: Array = gains[:, index] * self._share(direction)
        return result

    def _share(self, direction: Array) -> Array:
        if self.direction == BOTH:
            return np.ones(np.shape(direction))
        sign = 1.0 if self.direction == POSITIVE else -1.0
        return 0.5 * (1 + sign * direction)


def ascending(name: str, values: tuple[float, ...], strictly: bool = True) -> list[tuple[str, str]]:
    """A complaint if the values do not ascend."""
    steps = np.diff(values)
    bad = np.flatnonzero(steps <= 0 if strictly else steps < 0)
    if not bad.size:
        return []
    at = int(bad[0])
    return [(name, f"{values[at]:g} is followed by {values[at + 1]:g}: not ascending")]


def _at(index: Any, values: Array, size: int) -> Array:
    """Rows that are zero but for `values` in row `index`."""
    rows: Array = np.where(np.arange(size).reshape(-1, *np.ones(np.ndim(index), dtype=int)) == index, values, 0.0)
    return rows


BASES: tuple[type[Basis], ...] = (Table, Spline, Step)
