"""Decomposition of a function of several axes into the fewest one-axis tables, their sums and pairwise products.

The axes of a chain rotate and shift one after the other, so a correction is a sum of products of functions of one axis
each (sines, cosines, positions, errors). These need not be known: on a full grid of positions the mean over the other
axes gives the part that depends on one axis, or on two; for two axes the singular value decomposition gives the fewest
products. The parts are orthogonal: dropping one costs exactly its own size, and the others remain the best fit in the
mean square. The rest depends on three or more axes at once.

A control that multiplies pairs of tables lets several tables refer to the same other one. Products are therefore
arranged as stars: the centre is the table referred to, the leaves are the tables that refer to it. Tables are saved by
sharing a centre, by writing it as a multiple of another, and by hiding a sum in a factor:
(a + f(q)) g(p) = a g(p) + f(q) g(p).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from functools import lru_cache
from itertools import combinations, product

import numpy as np

from ncfix.arrays import Array
from ncfix.values import frozen

NOISE = 2e-6
"""Size, mm rms, below which a part counts as rest: far below the resolution of any control."""
EXHAUSTIVE = 6
"""Largest number of pairs of axes for which all choices of centres are tried."""
MIN_CONDITION = 0.05
"""Relative singular value below which columns count as dependent in a combination."""
KNOWN = 10_000
"""Size of the caches of combinations."""
SURELY = 1 + 1e-6
"""Factor on the tolerance beyond which a single column cannot fit, despite rounding."""


@frozen
class Single:
    """A function of one axis with mean zero: its values at the nodes (m,). `size` is its rms."""

    axis: int
    values: Array

    @property
    def size(self) -> float:
        """Root mean square of the values."""
        return float(np.sqrt(np.mean(self.values**2)))


@frozen
class Product:
    """The product size * first * second; first and second are functions of the two axes with rms 1, at the nodes."""

    axes: tuple[int, int]
    first: Array
    second: Array
    size: float

    def on(self, axis: int) -> Array:
        """The factor that is a function of this axis, at its nodes, (n,)."""
        return self.first if axis == self.axes[0] else self.second

    def across(self, axis: int) -> int:
        """The other of the two axes."""
        return self.axes[1] if axis == self.axes[0] else self.axes[0]


Part = Single | Product


@frozen
class Separation:
    """The parts of a function, largest first; rest: rms of what depends on three or more axes."""

    constant: float
    parts: tuple[Part, ...]
    rest: float


def taken_apart(values: Array) -> Separation:
    """Decompose a function on a full grid, values (m_1, ..., m_n); parts below `NOISE` (rms) belong to the rest."""
    constant = float(values.mean())
    axes = range(values.ndim)
    return _peeled(constant, values - constant, [*((axis,) for axis in axes), *combinations(axes, 2)])


def taken_apart_along(values: Array, axis: int) -> Separation:
    """As `taken_apart`, for a function that changes sign with the direction of `axis`: every part depends on `axis`.

    A function of another axis alone becomes a product with a constant.
    """
    pairs = [(min(axis, other), max(axis, other)) for other in range(values.ndim) if other != axis]
    return _peeled(0.0, values, [(axis,), *pairs])


def _peeled(constant: float, left: Array, sets: Sequence[tuple[int, ...]]) -> Separation:
    """Subtract for each of `sets`, axes or pairs, the mean over the other axes, and collect these parts."""
    found: list[Part] = []
    for subset in sets:
        mean = left.mean(axis=tuple(axis for axis in range(left.ndim) if axis not in subset), keepdims=True)
        left = left - mean
        part = mean.reshape([left.shape[axis] for axis in subset])
        found += [Single(subset[0], part)] if len(subset) == 1 else products(part, (subset[0], subset[1]))
    lost = sum(part.size**2 for part in found if part.size <= NOISE)
    parts = sorted((part for part in found if part.size > NOISE), key=lambda part: -part.size)
    return Separation(constant, tuple(parts), float(np.sqrt(np.mean(left**2) + lost)))


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


@frozen
class Star:
    """Products with a common factor: centre (m,), without unit, over `axis`; leaves: axis -> values, mm or rad."""

    axis: int
    centre: Array
    leaves: Mapping[int, Array]


@frozen
class TableLayout:
    """A function as tables: a constant, sums (axis -> values) and stars.

    way  the axis with whose direction of motion the function changes sign; None if it does not
    """

    sums: Mapping[int, Array] = field(default_factory=dict)
    stars: tuple[Star, ...] = ()
    way: int | None = None
    constant: float = 0.0

    @property
    def axes(self) -> frozenset[int]:
        """The axes on which the layout depends."""
        centres = {star.axis for star in self.stars}
        return frozenset({*self.sums, *centres, *(axis for star in self.stars for axis in star.leaves)})

    def scaled(self, factor: float) -> TableLayout:
        """The layout of a multiple of the function."""
        stars = [
            Star(star.axis, star.centre, {axis: factor * leaf for axis, leaf in star.leaves.items()})
            for star in self.stars
        ]
        sums = {axis: factor * values for axis, values in self.sums.items()}
        return TableLayout(sums, tuple(stars), self.way, factor * self.constant)

    def at(self, places: Array) -> Array:
        """Values (n,) with axis j at its node of index places[:, j]."""
        total = np.full(len(places), self.constant)
        for axis, values in self.sums.items():
            total += values[places[:, axis]]
        for star in self.stars:
            leaves = sum(values[places[:, axis]] for axis, values in star.leaves.items())
            total += star.centre[places[:, star.axis]] * leaves
        return total


def tables_of(layouts: Sequence[TableLayout], beside: tuple[int, int] = (0, 0)) -> int:
    """Number of tables that absorbed layouts take to correct one axis: the one without direction, and those with one.

    A constant without sums is a table. A part that changes with direction takes a table for each direction; a sum
    shares these two with the table without direction.
    beside  further tables for each table that multiplies others, and for each that is multiplied, if the control also
            adds these by themselves, which must be compensated
    """
    multiplier, multiplied = beside
    plain = {axis for layout in layouts if layout.way is None for axis in layout.sums}
    count = 0
    for layout in layouts:
        both = 1 if layout.way is None else 2
        count += int(layout.constant != 0.0)
        count += sum(1 if layout.way is None or axis in plain else 2 for axis in layout.sums)
        count += sum(1 + multiplier + (1 + multiplied) * both * len(star.leaves) for star in layout.stars)
    return count


def arranged(parts: Sequence[Part], constant: float, way: int | None, tolerance: float) -> TableLayout:
    """The layout that takes the fewest tables after `absorbed`, which is not yet applied.

    A part that changes with the direction of an axis has that axis as the leaf of every product.
    tolerance  rms that may be lost by writing a factor as a combination of others
    """
    singles = {part.axis: part.values for part in parts if isinstance(part, Single)}
    pairs = [part for part in parts if isinstance(part, Product)]
    choices = _choices(pairs) if way is None else iter([{part.axes: part.across(way) for part in pairs}])
    layouts = [TableLayout(singles, tuple(_stars(pairs, centres, tolerance)), way, constant) for centres in choices]
    return min(layouts, key=lambda layout: tables_of([absorbed(layout, tolerance)]))


def _choices(pairs: Sequence[Product]) -> Iterator[dict[tuple[int, int], int]]:
    """Choices of the centre axis of each pair: all, or if these are too many, those that prefer a subset of axes."""
    axes = list(dict.fromkeys(part.axes for part in pairs))
    if len(axes) <= EXHAUSTIVE:
        for sides in product((0, 1), repeat=len(axes)):
            yield {pair: pair[side] for pair, side in zip(axes, sides, strict=True)}
        return
    involved = sorted({axis for pair in axes for axis in pair})
    for favoured in product((False, True), repeat=len(involved)):
        rank = dict(zip(involved, favoured, strict=True))
        yield {pair: max(pair, key=lambda axis: rank[axis]) for pair in axes}


def _stars(pairs: Sequence[Product], centres: Mapping[tuple[int, int], int], tolerance: float) -> list[Star]:
    """The products as stars, largest first; a product joins existing centres if that takes no more tables."""
    stars: list[Star] = []
    for part in pairs:
        axis = centres[part.axes]
        leaf = part.across(axis)
        known = [index for index, star in enumerate(stars) if star.axis == axis]
        shares = _shares(part, axis, [stars[index].centre for index in known], tolerance)
        used = [] if shares is None else [(i, a) for i, a in zip(known, shares, strict=True) if a]
        if shares is None or sum(leaf not in stars[index].leaves for index, _ in used) > 2:
            stars.append(Star(axis, part.on(axis), {leaf: part.size * part.on(leaf)}))
            continue
        for index, share in used:
            added = share * part.size * part.on(leaf) + stars[index].leaves.get(leaf, 0.0)
            stars[index] = Star(axis, stars[index].centre, {**stars[index].leaves, leaf: added})
    return stars


def _shares(part: Product, axis: int, centres: Sequence[Array], tolerance: float) -> list[float] | None:
    """The factor of a product over `axis` as a combination of centres; None if none is within the tolerance."""
    if not centres:
        return None
    return _as_shares(part.on(axis).tobytes(), part.size, tuple(centre.tobytes() for centre in centres), tolerance)


@lru_cache(KNOWN)
def _as_shares(goal_bytes: bytes, size: float, centres: tuple[bytes, ...], tolerance: float) -> list[float] | None:
    """Cached part of `_shares`; negligible shares are 0. `size`: that of the product."""
    goal, columns = np.frombuffer(goal_bytes), np.stack([np.frombuffer(centre) for centre in centres], axis=1)
    shares = np.linalg.lstsq(columns, goal, rcond=None)[0]
    shares[np.abs(shares) * size * _rms(columns) <= tolerance] = 0.0
    missed = _rms(columns @ shares - goal) * size
    found: list[float] = shares.tolist()
    return found if missed <= tolerance else None


def absorbed(layout: TableLayout, tolerance: float) -> TableLayout:
    """The same function with fewer tables: a sum that factors of products can express is added to these factors.

    The values may be those at nodes or at any other positions. The constant goes into a sum if there is one.
    """
    sums, stars, constant = dict(layout.sums), list(layout.stars), layout.constant
    if layout.way is None:
        for axis in layout.sums:
            constant = _hide_in_leaves(sums, stars, constant, axis, tolerance)
        for axis in layout.sums:
            if axis in sums:
                constant = _hide_in_centres(sums, stars, constant, axis, tolerance)
        if sums:
            home = min(sums)
            sums[home], constant = sums[home] + constant, 0.0
        elif abs(constant) <= tolerance:
            constant = 0.0
    return TableLayout(dict(sorted(sums.items())), tuple(stars), layout.way, constant)


def _hide_in_leaves(sums: dict[int, Array], stars: list[Star], constant: float, axis: int, tolerance: float) -> float:
    """Hide a sum that is a combination of centres over its axis: add each share to a leaf. Returns the constant."""
    own = [index for index, star in enumerate(stars) if star.axis == axis]
    fit = _combination(sums[axis], [stars[index].centre for index in own], tolerance)
    if fit is None:
        return constant
    del sums[axis]
    for index, share in zip(own, fit[1:], strict=True):
        leaf, values = next(iter(stars[index].leaves.items()))
        stars[index] = Star(axis, stars[index].centre, {**stars[index].leaves, leaf: values + share})
    return constant + fit[0]


def _hide_in_centres(sums: dict[int, Array], stars: list[Star], constant: float, axis: int, tolerance: float) -> float:
    """Hide a sum that is a combination of leaves over its axis by shifting the centres, if that saves a table.

    Returns the constant.
    """
    own = [index for index, star in enumerate(stars) if axis in star.leaves]
    fit = _combination(sums[axis], [stars[index].leaves[axis] for index in own], tolerance)
    if fit is None:
        return constant
    changed, shifted = dict(sums), constant
    for index, share in zip(own, fit[1:], strict=True):
        for leaf, values in stars[index].leaves.items():
            changed[leaf] = changed.get(leaf, np.zeros_like(values)) - share * values
    for leaf in list(changed):
        mean = float(changed[leaf].mean())
        if _rms(changed[leaf] - mean) <= tolerance:
            shifted += mean
            del changed[leaf]
    if len(changed) >= len(sums):
        return constant
    sums.clear()
    sums.update(changed)
    for index, share in zip(own, fit[1:], strict=True):
        stars[index] = Star(stars[index].axis, stars[index].centre + share, stars[index].leaves)
    return shifted


def _combination(values: Array, columns: Sequence[Array], tolerance: float) -> list[float] | None:
    """Constant and shares of columns that reproduce the values to within the tolerance (rms); None if none do.

    Nearly equal columns count as one, so that no large shares cancel.
    """
    if not columns:
        return None
    return _combined(values.tobytes(), tuple(column.tobytes() for column in columns), tolerance)


@lru_cache(KNOWN)
def _combined(goal_bytes: bytes, column_bytes: tuple[bytes, ...], tolerance: float) -> list[float] | None:
    """Cached part of `_combination`; the search for few tables repeats the same questions."""
    values, together = np.frombuffer(goal_bytes), np.stack([np.frombuffer(column) for column in column_bytes])
    mean = values.mean()
    means = together.mean(axis=1)
    centred, goal = together - means[:, None], values - mean
    sizes = np.sqrt(np.mean(centred**2, axis=1))
    if sizes.min() == 0.0:
        return None
    design = centred / sizes[:, None]
    if len(design) == 1 and _rms(goal - np.mean(design[0] * goal) * design[0]) > SURELY * tolerance:
        return None
    scaled = np.linalg.lstsq(design.T, goal, rcond=MIN_CONDITION)[0]
    if _rms(design.T @ scaled - goal) > tolerance:
        return None
    shares = scaled / sizes
    return [float(mean - shares @ means), *shares.tolist()]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
