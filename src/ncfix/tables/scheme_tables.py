"""From a layout that is known at a few nodes to tables: its functions at any position, at as few nodes as will do.

At a new position of one axis the correction is linear in the values there of all functions of that axis, with factors
that are known from the nodes of the others: a least-squares problem with a handful of unknowns and one matrix for all
positions. The functions so found are the exact ones where the layout is exact, and the best there are where it is not.

Functions are looked at in many fine steps; a table takes a number of steps that divides them, so that its nodes are
among the positions that are known. A file can say them exactly: the first one, the step, and a whole number of steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ncfix.arrays import Array, Index
from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.correction import poses_along, random_poses, random_ways
from ncfix.tables.grid import Grid
from ncfix.tables.separable import Star, TableLayout
from ncfix.values import frozen

SCALE = 10**4
"""Positions and steps have four decimals, mm or degree."""
STEPS = ((120, 160, 200), (240, 320, 400), (720, 800, 640), (1440, 1600, 1280))
"""How many fine steps, from coarse to fine: numbers with many divisors. The first that divides the range is taken."""
PER_FEATURE = 3
"""Steps for each length within which the errors may bend."""
SAMPLES = 7
"""Two to this power combinations of nodes of the other axes are looked at for each position."""
SOBOL = (
    *((0, (1,)), (1, (1, 3)), (1, (1, 3, 1)), (2, (1, 1, 1)), (1, (1, 1, 3, 3)), (4, (1, 3, 5, 13))),
    *((2, (1, 1, 5, 5, 17)), (4, (1, 1, 5, 5, 5)), (7, (1, 1, 7, 11, 19))),
)
"""From the second dimension on: the inner coefficients of a primitive polynomial, as bits, and its first numbers."""
Slot = tuple[int, int | None]
"""A function of one axis in a layout: (star, leaf axis), (star, None) its centre, or (-1, axis) a sum."""
Curves = dict[Slot, Array]
Evaluate = Callable[[Array, int | None], Array]
"""Corrections of all outputs at poses (n, n_axes), (n, n_outputs): without direction, or what changes with a way."""
TableLayouts = Mapping[int, Sequence[TableLayout]]
"""Output -> its layouts. The outputs are in the order in which `Evaluate` has them."""
AlongAxis = Callable[[int, int | None], Array]
"""What layouts are to say at all fine positions of an axis and combinations of the others, (n, m, n_outputs)."""
ROUNDS = 6
CHECKS = 1000
GAIN = 0.95
"""A round of smaller steps that leaves more than this share of what was missed is the last."""
Corrections = Callable[[Array, Array], Array]
"""What to add to some axes at commands (n, n_axes) reached in directions (n, n_axes) or (n_axes,): (n, n_outputs)."""


@frozen
class AxisPositions:
    """The positions of an axis that tables cover, in its file unit (mm, degree).

    unit    mm or rad per file unit
    steps   into how many it is divided
    modulo  they repeat
    """

    name: str
    low: float
    high: float
    unit: float
    steps: int
    modulo: bool

    @classmethod
    def over(cls, name: str, low: float, high: float, unit: float, feature: float, modulo: bool) -> AxisPositions:
        """With steps small enough for errors that may bend within the length `feature` (file unit)."""
        wanted = PER_FEATURE * (high - low) / feature
        choices = next((some for some in STEPS if some[0] >= wanted), STEPS[-1])
        whole = round((high - low) * SCALE)
        steps = next((some for some in choices if whole % some == 0), choices[0])
        return cls(name, low, high, unit, steps, modulo)

    @property
    def fine(self) -> Array:
        """All positions (steps + 1,), from low to high or less than one part in a thousand beyond it, mm or rad."""
        first = np.floor(self.low * SCALE + 1e-6)
        step = np.ceil((self.high * SCALE - first) / self.steps - 1e-6)
        return (first + step * np.arange(self.steps + 1)) / SCALE * self.unit

    def stride(self, curve: Array, most: int, limit: float) -> int:
        """The widest step, in fine ones, with which straight lines stay within `limit` of a curve over `fine`.

        No more than `most` nodes. What repeats takes two steps at least.
        """
        strides = [s for s in range(self.steps, 0, -1) if self.steps % s == 0 and self.steps // s < most]
        for stride in strides[1:] if self.modulo else strides:
            if self._missed(curve, stride) <= limit:
                return stride
        return strides[-1]

    @staticmethod
    def _missed(curve: Array, stride: int) -> float:
        place = np.arange(len(curve))
        return float(np.abs(np.interp(place, place[::stride], curve[::stride]) - curve).max())


@frozen
class TableSample:
    """Where functions of one axis are looked for: combinations of nodes of all axes, (m, n_axes), their numbers."""

    nodes: Sequence[Array]
    places: Index

    @classmethod
    def of(cls, nodes: Sequence[Array]) -> TableSample:
        """Spread evenly over pairs and triples of axes (a Sobol net)."""
        unit = _sobol_net(len(nodes))
        counts = np.array([len(line) for line in nodes])
        return cls(nodes, np.floor(unit * counts).astype(np.intp))

    def poses(self, axis: int, positions: Array) -> Array:
        """The poses with one axis at positions (n,): (n * m, n_axes)."""
        rest = np.stack([line[column] for line, column in zip(self.nodes, self.places.T, strict=True)], axis=1)
        return poses_along(axis, positions, rest)

    def curves(self, layout: TableLayout, axis: int, values: Array) -> Curves:
        """All functions of the layout over this axis, from its values (n, m) at `poses`: slot -> (n,)."""
        slots, known = self._columns(layout, axis)
        if not slots:
            return {}
        design = np.stack(list(slots.values()), axis=1)
        found = np.linalg.lstsq(design, (values - known).T, rcond=None)[0]
        return dict(zip(slots, found, strict=True))

    def _columns(self, layout: TableLayout, axis: int) -> tuple[Curves, Array]:
        """The factors of the unknown functions, and the sum of all that does not depend on the axis, (m,) each."""
        slots: Curves = {}
        known = np.full(len(self.places), layout.constant)
        for other, values in layout.sums.items():
            if other == axis:
                slots[-1, axis] = np.ones(len(self.places))
            else:
                known += values[self.places[:, other]]
        for number, star in enumerate(layout.stars):
            leaves = {leaf: values[self.places[:, leaf]] for leaf, values in star.leaves.items() if leaf != axis}
            together = sum(leaves.values(), np.zeros(len(self.places)))
            if star.axis == axis:
                slots[number, None] = together
                continue
            centre = star.centre[self.places[:, star.axis]]
            known += centre * together
            if axis in star.leaves:
                slots[number, axis] = centre
        return slots, known


def _sobol_net(dimensions: int) -> Array:
    """The first points of Sobol's sequence, (2 ** SAMPLES, dimensions) from 0 to 1: that of SciPy, which imports much.

    Direction numbers of S. Joe and F. Y. Kuo (2008).
    """
    if dimensions > 1 + len(SOBOL):
        from scipy.stats import qmc

        return qmc.Sobol(dimensions, scramble=False).random_base2(SAMPLES)
    bits = [[1] * SAMPLES]
    for polynomial, first in SOBOL[: dimensions - 1]:
        degree, numbers = len(first), list(first)
        for k in range(degree, SAMPLES):
            number = numbers[k - degree] ^ (numbers[k - degree] << degree)
            for j in range(1, degree):
                number ^= (polynomial >> (degree - 1 - j) & 1) * (numbers[k - j] << j)
            numbers.append(number)
        bits.append(numbers[:SAMPLES])
    directions = np.array(bits) << np.arange(SAMPLES - 1, -1, -1)
    points = np.zeros((2**SAMPLES, dimensions), dtype=np.intp)
    for k in range(1, len(points)):
        lowest = (k & -k).bit_length() - 1
        points[k] = points[k - 1] ^ directions[:, lowest]
    return points / 2**SAMPLES


def followed(sample: TableSample, layouts: TableLayouts, along: AlongAxis) -> dict[int, list[TableLayout]]:
    """These layouts with their functions at the fine positions of each axis."""
    curves: dict[tuple[int, int | None], Curves] = {}
    for axis in range(len(sample.nodes)):
        concerned = [(output, one) for output, each in layouts.items() for one in each if axis in one.axes]
        for way in dict.fromkeys(layout.way for _, layout in concerned):
            values = along(axis, way)
            for column, output in enumerate(layouts):
                for layout in (one for key, one in concerned if key == output and one.way == way):
                    found = sample.curves(layout, axis, values[:, :, column])
                    curves[output, way] = {**curves.get((output, way), {}), **found}
    return {output: [_with(one, curves.get((output, one.way), {})) for one in each] for output, each in layouts.items()}


def _with(layout: TableLayout, curves: Curves) -> TableLayout:
    """The layout with other values."""
    stars = [
        Star(star.axis, curves[number, None], {leaf: curves[number, leaf] for leaf in star.leaves})
        for number, star in enumerate(layout.stars)
    ]
    return TableLayout({axis: curves[-1, axis] for axis in layout.sums}, tuple(stars), layout.way, layout.constant)


def by_way(corrections: Corrections) -> Evaluate:
    """Corrections without direction, and the half of the difference that the way of one axis makes."""

    def evaluate(q: Array, way: int | None) -> Array:
        direction = np.zeros(q.shape[1])
        if way is None:
            return corrections(q, direction)
        direction[way] = 1.0
        return (corrections(q, direction) - corrections(q, -direction)) / 2

    return evaluate


def checked(lines: Sequence[AxisPositions], correct: Corrections) -> tuple[Array, Array, Array]:
    """Random poses and ways, and the corrections there: what tables are judged by."""
    space = np.array([(line.low * line.unit, line.high * line.unit) for line in lines])
    q, ways = random_poses(space, CHECKS, seed=3), random_ways(len(space), CHECKS, seed=4)
    return q, ways, correct(q, ways)


@frozen
class StagedTables:
    """Axes that are corrected together.

    lines    all axes of the machine
    layouts  output (its column) -> layouts with functions over the fine positions, mm or rad
    checked  poses, ways and corrections of the outputs there, in the order of `layouts`
    scale    how much one unit of them counts, mm
    """

    lines: Sequence[AxisPositions]
    layouts: Mapping[int, Sequence[TableLayout]]
    checked: tuple[Array, Array, Array]
    scale: float = 1.0

    def settled(self, target: float, points: int, left: float = 0.0) -> tuple[Compensation, float]:
        """Tables that miss at most `target` (mm) if that many points allow it, and what they miss.

        left  mm that they miss anyway: it need not get better than that
        """
        parts = sum(len(one.sums) + len(one.stars) for each in self.layouts.values() for one in each)
        limit = target / np.sqrt(max(parts, 1)) / self.scale
        best = self._tried(limit, points)
        for _ in range(ROUNDS):
            if best[1] <= max(target, left):
                break
            limit /= 2
            tried = self._tried(limit, points)
            if tried[1] > GAIN * best[1]:
                break
            best = tried
        return best

    def _tried(self, limit: float, points: int) -> tuple[Compensation, float]:
        tables = self._tables(limit, points)
        return tables, self.missed(tables)

    def missed(self, tables: Compensation) -> float:
        """The largest correction that the tables lack at random poses, mm."""
        q, ways, wanted = self.checked
        names = [line.name for line in self.lines]
        lacking = tables.at(names, q, ways)[:, list(self.layouts)] - wanted
        return self.scale * float(np.linalg.norm(lacking, axis=1).max())

    def _tables(self, limit: float, points: int) -> Compensation:
        terms: list[Term] = []
        for output, layouts in self.layouts.items():
            terms += self._sums(output, layouts, limit, points)
            for layout in layouts:
                for star in layout.stars:
                    terms += self._star(output, layout.way, star, limit, points)
        return Compensation(tuple(terms))

    def _sums(self, output: int, layouts: Sequence[TableLayout], limit: float, points: int) -> Iterator[Term]:
        """A table for each axis, or one for either way; what changes with the way is joined to what does not."""
        plain: dict[int, Array] = {}
        for layout in layouts:
            if layout.way is None:
                plain = {**layout.sums} if layout.sums or not layout.constant else {output: np.full(1, layout.constant)}
        turned = {way: layout.sums[way] for layout in layouts if (way := layout.way) is not None and way in layout.sums}
        for axis in sorted({*plain, *turned}):
            mean = plain.get(axis, np.zeros(1))
            if axis not in turned:
                yield Term((self._grid(output, axis, mean, limit, points),))
                continue
            both = [mean + turned[axis], mean - turned[axis]]
            stride = min(self.lines[axis].stride(curve, points, limit) for curve in both)
            for curve, sense in zip(both, (1, -1), strict=True):
                yield Term((self._nodes(output, axis, curve, stride),), (self.lines[axis].name, sense))

    def _star(self, output: int, way: int | None, star: Star, limit: float, points: int) -> Iterator[Term]:
        """The centre has no unit, is 1 at most, and its largest value is positive; each leaf points at it."""
        weight = sum(float(np.abs(values).max()) for values in star.leaves.values())
        centre = self._grid(output, star.axis, star.centre, limit / max(weight, 1e-30), points)
        largest = float(centre.values.flat[np.argmax(np.abs(centre.values))]) or 1.0
        centre = replace(centre, values=centre.values / largest)
        for axis, values in star.leaves.items():
            leaf = self._grid(output, axis, values * largest, limit, points)
            if way is None:
                yield Term((leaf, centre))
                continue
            for sense in (1, -1):
                yield Term((replace(leaf, values=sense * leaf.values), centre), (self.lines[way].name, sense))

    def _grid(self, output: int, axis: int, curve: Array, limit: float, points: int) -> Grid:
        curve = np.broadcast_to(curve, self.lines[axis].fine.shape)
        return self._nodes(output, axis, curve, self.lines[axis].stride(curve, points, limit))

    def _nodes(self, output: int, axis: int, curve: Array, stride: int) -> Grid:
        line = self.lines[axis]
        values = curve[::stride].copy()
        if line.modulo:
            values[-1] = values[0]
        outputs = (self.lines[output].name,)
        return Grid((line.name,), (line.fine[::stride],), outputs, values[:, None], (line.modulo,))
