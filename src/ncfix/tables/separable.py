"""A function of several axes, taken apart: a constant, functions of one axis, products of two of them, and a rest.

A chain of axes turns and shifts one after the other, so that a correction is a sum of products of functions of one axis
each (sines, cosines, positions, errors). Which they are need not be known: on a full grid of positions the mean over
the other axes leaves what depends on one axis, or on two; and of two axes the singular value decomposition finds the
fewest products. The parts are orthogonal: leaving one out costs exactly its own size, and what is kept is the best fit
in the mean square that sums and products of pairs can make. What is left over is the rest: it needs three axes at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ncfix.tables.grid import Array

NOISE = 2e-6
"""mm: below what is solved for, and far below what any control resolves."""


@dataclass(frozen=True, slots=True)
class Single:
    """A function of one axis with mean zero: its values at the nodes (m,). `size` is its rms."""

    axis: int
    values: Array

    @property
    def size(self) -> float:
        """How much it matters: rms."""
        return float(np.sqrt(np.mean(self.values**2)))


@dataclass(frozen=True, slots=True)
class Product:
    """size * first * second: functions of two axes with rms 1, at their nodes."""

    axes: tuple[int, int]
    first: Array
    second: Array
    size: float

    def on(self, axis: int) -> Array:
        """The factor that is a function of this axis, at its nodes, (n,)."""
        return self.first if axis == self.axes[0] else self.second

    def across(self, axis: int) -> int:
        """The other axis."""
        return self.axes[1] if axis == self.axes[0] else self.axes[0]


Part = Single | Product


@dataclass(frozen=True, slots=True)
class Parts:
    """What a function consists of, largest first; `rest` is the rms of what no pair of axes can say."""

    constant: float
    parts: tuple[Part, ...]
    rest: float


def taken_apart(values: Array, noise: float = NOISE) -> Parts:
    """The parts of a function on a full grid, values (m_1, ..., m_n); those below `noise` (rms) belong to the rest."""
    constant = float(values.mean())
    left = values - constant
    parts: list[Part] = []
    for axis in range(values.ndim):
        single = Single(axis, _mean_over_others(left, (axis,)))
        left = left - _spread(single.values, (axis,), values.ndim)
        parts.append(single)
    for pair in combinations(range(values.ndim), 2):
        both = _mean_over_others(left, pair)
        left = left - _spread(both, pair, values.ndim)
        parts += products(both, pair)
    return _sorted(constant, parts, left, noise)


def taken_apart_along(values: Array, axis: int, noise: float = NOISE) -> Parts:
    """The same, with every part a function of `axis` at least: what changes sign with the way that axis moves.

    A function of another axis alone becomes a product with a constant.
    """
    left = values.copy()
    own = _mean_over_others(left, (axis,))
    left -= _spread(own, (axis,), values.ndim)
    parts: list[Part] = [Single(axis, own)]
    for other in range(values.ndim):
        if other != axis:
            pair = (min(axis, other), max(axis, other))
            both = _mean_over_others(left, pair)
            left = left - _spread(both, pair, values.ndim)
            parts += products(both, pair)
    return _sorted(0.0, parts, left, noise)


def products(both: Array, pair: tuple[int, int]) -> list[Product]:
    """The fewest products whose sum is a function of two axes, values (m_a, m_b), largest first."""
    u, s, v = np.linalg.svd(both, full_matrices=False)
    scale = float(np.sqrt(both.size))
    found = []
    for k, value in enumerate(s.tolist()):
        turn = np.sign(v[k][np.argmax(np.abs(v[k]))]) or 1.0
        first, second = (side * np.sqrt(len(side)) * turn for side in (u[:, k], v[k]))
        found.append(Product(pair, first, second, value / scale))
    return found


def _sorted(constant: float, parts: Sequence[Part], left: Array, noise: float) -> Parts:
    kept = [part for part in parts if part.size > noise]
    lost = sum(part.size**2 for part in parts if part.size <= noise)
    rest = float(np.sqrt(np.mean(left**2) + lost))
    return Parts(constant, tuple(sorted(kept, key=lambda part: -part.size)), rest)


def _mean_over_others(values: Array, kept: tuple[int, ...]) -> Array:
    mean: Array = values.mean(axis=tuple(axis for axis in range(values.ndim) if axis not in kept))
    return mean


def _spread(values: Array, axes: tuple[int, ...], ndim: int) -> Array:
    """A function of some axes, shaped to broadcast over all of them."""
    shape = [1] * ndim
    for axis, size in zip(axes, values.shape, strict=True):
        shape[axis] = size
    return values.reshape(shape)
