"""From the functions of a scheme to its tables: as few nodes as keep the lines between them near the function."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ncfix.tables.grid import Array, Grid
from ncfix.tables.neutral import Compensation, Term
from ncfix.tables.poses import random_poses, random_ways
from ncfix.tables.scheme_curves import Evaluate
from ncfix.tables.scheme_layout import Layout, Star
from ncfix.tables.scheme_nodes import Line

ROUNDS = 6
CHECKS = 1000
GAIN = 0.95
"""A round of smaller steps that leaves more than this share of what was missed is the last."""

Corrections = Callable[[Array, Array], Array]
"""What to add to some axes at commands (n, n_axes) reached in directions (n, n_axes) or (n_axes,): (n, n_outputs)."""


def by_way(corrections: Corrections) -> Evaluate:
    """Corrections without direction, and the half of the difference that the way of one axis makes."""

    def evaluate(q: Array, way: int | None) -> Array:
        direction = np.zeros(q.shape[1])
        if way is None:
            return corrections(q, direction)
        direction[way] = 1.0
        return (corrections(q, direction) - corrections(q, -direction)) / 2

    return evaluate


@dataclass(frozen=True, slots=True)
class Stage:
    """Axes that are corrected together.

    lines    all axes of the machine
    layouts  output (its column) -> layouts with functions over the fine positions, mm or rad
    correct  the corrections of the outputs, in the order of `layouts`
    scale    how much one unit of them counts, mm
    """

    lines: Sequence[Line]
    layouts: Mapping[int, Sequence[Layout]]
    correct: Corrections
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
        space = np.array([(line.low * line.unit, line.high * line.unit) for line in self.lines])
        q, ways = random_poses(space, CHECKS, seed=3), random_ways(len(space), CHECKS, seed=4)
        names = [line.name for line in self.lines]
        lacking = tables.at(names, q, ways)[:, list(self.layouts)] - self.correct(q, ways)
        return self.scale * float(np.linalg.norm(lacking, axis=1).max())

    def _tables(self, limit: float, points: int) -> Compensation:
        terms: list[Term] = []
        for output, layouts in self.layouts.items():
            terms += self._sums(output, layouts, limit, points)
            for layout in layouts:
                for star in layout.stars:
                    terms += self._star(output, layout.way, star, limit, points)
        return Compensation(tuple(terms))

    def _sums(self, output: int, layouts: Sequence[Layout], limit: float, points: int) -> Iterator[Term]:
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
