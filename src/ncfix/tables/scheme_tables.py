"""Tables from a layout whose functions are known at a few nodes: functions at all positions, then few table nodes.

At a new position of one axis the correction is linear in the values of all functions of that axis, with factors known
from the nodes of the other axes: a least-squares problem with a few unknowns and one matrix for all positions. The
functions found are exact if the layout is, else the best fit.

Functions are evaluated in many fine steps. A table uses a divisor of their number, so its nodes are among the known
positions, and a file can state them exactly: the first position, the step, and the number of steps.
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
"""Units per mm or degree of positions and steps: four decimals."""
STEPS = ((120, 160, 200), (240, 320, 400), (720, 800, 640), (1440, 1600, 1280))
"""Numbers of fine steps, from coarse to fine, with many divisors; within a group the first that divides the range."""
PER_FEATURE = 3
"""Smallest number of steps within the length over which errors bend."""
SAMPLES = 7
"""Base-2 logarithm of the number of combinations of nodes of the other axes at each position."""
SOBOL = (
    *((0, (1,)), (1, (1, 3)), (1, (1, 3, 1)), (2, (1, 1, 1)), (1, (1, 1, 3, 3)), (4, (1, 3, 5, 13))),
    *((2, (1, 1, 5, 5, 17)), (4, (1, 1, 5, 5, 5)), (7, (1, 1, 7, 11, 19))),
)
"""From the second dimension on: the inner coefficients of a primitive polynomial, as bits, and its first numbers."""
Slot = tuple[int, int | None]
"""A function of one axis in a layout: (star, leaf axis), (star, None) its centre, or (-1, axis) a sum."""
Curves = dict[Slot, Array]
Evaluate = Callable[[Array, int | None], Array]
"""Poses (n, n_axes), way -> corrections (n, n_outputs) without direction, or the part that changes with that way."""
TableLayouts = Mapping[int, Sequence[TableLayout]]
"""Output -> its layouts. The outputs are in the order in which `Evaluate` has them."""
AlongAxis = Callable[[int, int | None], Array]
"""Axis, way -> corrections at all its fine positions and combinations of the other axes, (n, m, n_outputs)."""
ROUNDS = 6
CHECKS = 1000
GAIN = 0.95
"""Ratio of the errors of two rounds of smaller steps above which the search ends."""
Corrections = Callable[[Array, Array], Array]
"""Commands (n, n_axes), directions (n, n_axes) or (n_axes,) -> corrections to add to some axes, (n, n_outputs)."""


@frozen
class AxisPositions:
    """The positions of an axis that tables cover, in its file unit (mm, degree).

    unit    mm or rad per file unit
    steps   number of fine steps
    modulo  whether the table repeats
    """

    name: str
    low: float
    high: float
    unit: float
    steps: int
    modulo: bool

    @classmethod
    def over(cls, name: str, low: float, high: float, unit: float, feature: float, modulo: bool) -> AxisPositions:
        """Positions in steps small enough for errors that bend within the length `feature` (file unit)."""
        wanted = PER_FEATURE * (high - low) / feature
        choices = next((some for some in STEPS if some[0] >= wanted), STEPS[-1])
        whole = round((high - low) * SCALE)
        steps = next((some for some in choices if whole % some == 0), choices[0])
        return cls(name, low, high, unit, steps, modulo)

    @property
    def fine(self) -> Array:
        """All fine positions (steps + 1,), mm or rad; the last is at `high`, or beyond it by less than 0.1 %."""
        first = np.floor(self.low * SCALE + 1e-6)
        step = np.ceil((self.high * SCALE - first) / self.steps - 1e-6)
        return (first + step * np.arange(self.steps + 1)) / SCALE * self.unit

    def stride(self, curve: Array, most: int, limit: float) -> int:
        """The largest step, in fine steps, at which straight lines are within `limit` of a curve over `fine`.

        most  largest number of nodes. A table that repeats has at least two steps.
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
    """Combinations of nodes of all axes at which functions of one axis are fitted.

    nodes   for each axis, its nodes; places (m, n_axes): indices of the nodes of each combination
    """

    nodes: Sequence[Array]
    places: Index

    @classmethod
    def of(cls, nodes: Sequence[Array]) -> TableSample:
        """Combinations that fill all pairs and triples of axes evenly (a Sobol net)."""
        unit = _sobol_net(len(nodes))
        counts = np.array([len(line) for line in nodes])
        return cls(nodes, np.floor(unit * counts).astype(np.intp))

    def poses(self, axis: int, positions: Array) -> Array:
        """The poses of all combinations with one axis at positions (n,) instead: (n * m, n_axes)."""
        rest = np.stack([line[column] for line, column in zip(self.nodes, self.places.T, strict=True)], axis=1)
        return poses_along(axis, positions, rest)

    def curves(self, layout: TableLayout, axis: int, values: Array) -> Curves:
        """The functions of the layout over an axis, fitted to values (n, m) at `poses`: slot -> (n,)."""
        slots, known = self._columns(layout, axis)
        if not slots:
            return {}
        design = np.stack(list(slots.values()), axis=1)
        found = np.linalg.lstsq(design, (values - known).T, rcond=None)[0]
        return dict(zip(slots, found, strict=True))

    def _columns(self, layout: TableLayout, axis: int) -> tuple[Curves, Array]:
        """Factors of the unknown functions of an axis, and the sum of the parts that do not depend on it, (m,) each."""
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
    """The first points of Sobol's sequence in 0 ... 1, (2 ** SAMPLES, dimensions).

    The same as SciPy's, whose import is slow. Direction numbers of S. Joe and F. Y. Kuo (2008).
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
    """The layouts with their functions fitted at the fine positions of each axis."""
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
    """The layout with the values of its functions replaced."""
    stars = [
        Star(star.axis, curves[number, None], {leaf: curves[number, leaf] for leaf in star.leaves})
        for number, star in enumerate(layout.stars)
    ]
    return TableLayout({axis: curves[-1, axis] for axis in layout.sums}, tuple(stars), layout.way, layout.constant)


def by_way(corrections: Corrections) -> Evaluate:
    """Corrections without direction (way None), or half their difference between both directions of one axis."""

    def evaluate(q: Array, way: int | None) -> Array:
        direction = np.zeros(q.shape[1])
        if way is None:
            return corrections(q, direction)
        direction[way] = 1.0
        return (corrections(q, direction) - corrections(q, -direction)) / 2

    return evaluate


def checked(lines: Sequence[AxisPositions], correct: Corrections) -> tuple[Array, Array, Array]:
    """Random poses, directions of motion, and the corrections there, by which tables are judged."""
    space = np.array([(line.low * line.unit, line.high * line.unit) for line in lines])
    q, ways = random_poses(space, CHECKS, seed=3), random_ways(len(space), CHECKS, seed=4)
    return q, ways, correct(q, ways)


@frozen
class StagedTables:
    """The tables of axes that are corrected together.

    lines    positions of all axes of the machine
    layouts  column of an output -> layouts with functions over the fine positions, mm or rad
    checked  poses, directions and corrections of the outputs there, in the order of `layouts`
    scale    mm per unit of the outputs
    """

    lines: Sequence[AxisPositions]
    layouts: Mapping[int, Sequence[TableLayout]]
    checked: tuple[Array, Array, Array]
    scale: float = 1.0

    def settled(self, target: float, points: int, left: float = 0.0) -> tuple[Compensation, float]:
        """Tables that miss at most `target`, mm, if `points` nodes per table allow it; and what they miss, mm.

        left  unavoidable error, mm, below which the tables need not go
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
        """The sums: one table for each axis, or two if the sum over it changes with the direction."""
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
        """The products of a star. The centre has no unit, and its value of largest size is 1."""
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
