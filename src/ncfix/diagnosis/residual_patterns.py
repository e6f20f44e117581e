"""The largest patterns of the residual in words, for the report, and the clustering of residuals.

A pattern is a function of the state for one measured component: a slope, a bow, a wave, a direction, a direction that
grows along an axis, time, a temperature, a tool. Patterns do not affect the verdict.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.special import chdtrc

from ncfix.arrays import Array, Ints
from ncfix.diagnosis.evidence import Background
from ncfix.diagnosis.residual_data import ResidualData
from ncfix.measure.least_squares import orthonormal, without
from ncfix.values import frozen

SHOWN = 6
"""Largest number of patterns."""
UNLIKELY = 1e-3
"""Probability by chance above which a pattern is not shown."""
NEARLY = 0.99
"""Share of the largest gain at which a simpler pattern is preferred."""
NEIGHBOURS, BLOCK = 6, 500
"""Number of nearest poses that are compared with each pose; poses for which these are sought at once."""


@frozen(slots=False)
class ResidualPattern:
    """One pattern: in words, its size (um rms) and its probability by chance among all patterns considered."""

    text: str
    rms_um: float
    p_value: float


def patterns(background: Background, sigma_um: float) -> list[ResidualPattern]:
    """The largest patterns, each beside those found before.

    Each is tested against the remaining residual, not only the noise: beside a large error of another shape some
    pattern always fits a little.
    """
    data = background.data
    weight = 1 / background.relative
    basis = orthonormal(data.base * weight[:, None])
    y = without(basis, (data.y * weight)[:, None])[:, 0]
    offered = list(_offered(data))
    found: list[ResidualPattern] = []
    while len(found) < SHOWN and offered:
        gains = [(_gain(basis, y, column * weight), text, column * weight) for text, column in offered]
        most = max(gain for (gain, _), _, _ in gains)
        # simple patterns come first: a product with a nearly constant factor is the simple one
        (best, size), text, column = next(each for each in gains if each[0][0] >= NEARLY * most)
        usual = max(sigma_um**2, float(y @ y) / max(len(y) - basis.shape[1], 1))
        p = min(1.0, len(offered) * float(chdtrc(1, best / usual)))
        if p > UNLIKELY:
            break
        left = without(basis, column[:, None])[:, 0]
        explained = left * (left @ y) / (left @ left)
        said = text.format(_signed(size, data.problem.um[np.argmax(column != 0)]))
        found.append(ResidualPattern(said, data.size(explained * background.relative), p))
        basis = np.column_stack([basis, left / np.linalg.norm(left)])
        y = y - explained
    return found


def _gain(basis: Array, y: Array, column: Array) -> tuple[float, float]:
    left = without(basis, column[:, None])[:, 0]
    squares = float(left @ left)
    if squares < 1e-6 * float(column @ column) or squares == 0:
        return 0.0, 0.0
    return float(left @ y) ** 2 / squares, float(left @ y) / squares


def _signed(size: float, um: float) -> str:
    """A size as text: in um for a length (`um` = 1000 per mm), else in urad for an angle (`um` per rad)."""
    return f"{size:+.1f} um" if um == 1e3 else f"{1e6 * size / um:+.1f} urad"


def _offered(data: ResidualData) -> Iterator[tuple[str, Array]]:
    """All patterns considered: (text with a placeholder for the size, column)."""
    names = list(dict.fromkeys(name for name, row in zip(data.names, data.row, strict=True) if row >= 0))
    for text, feature in _features(data):
        for name in names:
            own = np.array([each == name for each in data.names]) & (data.row >= 0)
            if own.any() and np.ptp(feature) > 0:
                yield f"{name} {text}", np.where(own, feature[np.maximum(data.row, 0)], 0.0)


def _features(data: ResidualData) -> Iterator[tuple[str, Array]]:
    u, linear = {}, []
    for index, axis in enumerate(data.machine.axes):
        if data.measured.moved(axis):
            low, high = data.measured.spans[axis.name]
            u[axis.name] = (data.q[:, index] / axis.unit - (low + high) / 2) * 2 / (high - low)
            if axis.rotary:
                yield f"varies as cos {axis.name} ({{}})", np.cos(data.q[:, index])
                yield f"varies as sin {axis.name} ({{}})", np.sin(data.q[:, index])
                yield f"varies as cos 2{axis.name} ({{}})", np.cos(2 * data.q[:, index])
            else:
                linear.append(axis.name)
                yield f"grows with {axis.name} ({{}} from the middle to the end)", u[axis.name]
            yield f"is parabolic along {axis.name} ({{}})", u[axis.name] ** 2 - 1 / 3
            yield f"is cubic along {axis.name} ({{}})", u[axis.name] ** 3 - 0.6 * u[axis.name]
    for letter in data.machine.axis_names:
        side = data.column(f"dir_{letter}")
        if np.ptp(side) > 0:
            yield f"depends on the direction of {letter} ({{}} when it moves towards plus)", side
            for other in linear:
                yield (
                    f"grows with {other}, with opposite sign for the two directions of {letter} ({{}} at the end "
                    f"of {other}, {letter} towards plus)",
                    side * u[other],
                )
    for k, first in enumerate(linear):
        for other in linear[k + 1 :]:
            yield f"grows with the product of {first} and {other} ({{}} at the end of both)", u[first] * u[other]
    for name in ("time_s", "load_kg", "tool_length", *data.measured.sensors):
        values = data.column(name)
        if np.ptp(values) > 0:
            scaled = (2 * values - values.max() - values.min()) / np.ptp(values)
            yield f"changes with {name} ({{}} from the middle to the end)", scaled
            if name.startswith("temp_") or name == "time_s":
                for other in linear:
                    yield (
                        f"grows with the product of {other} and {name} ({{}} at the end of both)",
                        scaled * u[other],
                    )


def clustering(background: Background, residual: Array, places: Array) -> float:
    """Moran's I of neighbouring poses: 0 for independent residuals, 1 for equal neighbours.

    residual (m,) um; places (n, k) of the rows. Source: Moran, "Notes on continuous stochastic phenomena" (1950).
    """
    data = background.data
    if data.count <= NEIGHBOURS + 1:
        return 0.0
    near = np.concatenate([_nearest(places, part) for part in np.array_split(places, -(-len(places) // BLOCK))])
    total, count, square = 0.0, 0, 0.0
    for name in dict.fromkeys(data.names):
        own = np.array([each == name for each in data.names]) & (data.row >= 0)
        value = np.full(data.count, np.nan)
        value[data.row[own]] = residual[own] / background.relative[own]
        known = np.isfinite(value[near]).all(axis=1)
        products = value[near[known, :1]] * value[near[known, 1:]]
        total, count = total + float(products.sum()), count + products.size
        square += float((value[known] ** 2).sum()) * NEIGHBOURS
    return total / square if count and square else 0.0


def _nearest(places: Array, part: Array) -> Ints:
    """Indices (p, NEIGHBOURS + 1) of the places (n, k) nearest to each of `part` (p, k), itself first."""
    apart = (places**2).sum(axis=1) - 2 * part @ places.T
    nearest = np.argpartition(apart, NEIGHBOURS, axis=1)[:, : NEIGHBOURS + 1]
    order = np.argsort(np.take_along_axis(apart, nearest, axis=1), axis=1, kind="stable")
    return np.take_along_axis(nearest, order, axis=1)
