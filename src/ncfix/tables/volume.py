"""Grids over several axes: the exact correction at every node, or what comes nearest to it all around."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ncfix.machine import Machine, State
from ncfix.tables.bending import Bending
from ncfix.tables.exact import exact_correction, linear_axes
from ncfix.tables.fit import WITHIN, between, fitted
from ncfix.tables.grid import Array, Grid
from ncfix.tables.poses import corners, even_poses, random_poses

LINES = 32
"""Random lines along an axis on which its bending is judged."""
CHECKS = 8000
"""Random poses on which a grid is judged, four times as many as in Esmaeili (2021), section 4.2."""
MATTERS = 1e-6
"""mm: a smaller change of the correction is none."""
DIGITS = 6
"""Decimals of a node's position, mm or degree."""
STEP = 1e-3
"""Of nodes with an anchor, what steps are whole multiples of: mm or degree, what parameters of controls can say."""
SLACK = 1e-6
"""Of that, what rounding may come to."""
END = 1e-9
"""An anchor that is no farther from an end of the range is there."""
COARSE = (3, 5, 9, 17)
"""Nodes an axis of the grid on which the middle over other axes is looked up."""
SEEN = 200
"""Random positions at which it is seen whether they are enough."""
NEARLY = 1e-4
"""mm: what they may miss; the middle is exact nowhere."""
OTHERS = 12
"""Poses of other axes, besides the corners of their ranges, over which a middle is taken."""
CLOSE = 48
"""Up to here every count of even nodes is looked at, since they may come to lie on the kinks of a table; then some."""
FAR = 130
GROWTH = 1.15
"""Most nodes that are looked at, and by which factor their count grows to there."""


def as_it_is(grid: Grid) -> Grid:
    """A file that keeps every digit."""
    return grid


@dataclass(slots=True)
class Volume:
    """Corrections of some axes over the positions of some, of which grids are made and judged.

    inputs   the axes that are looked up
    ranges   (n_inputs, 2) where, mm and rad
    units    mm or rad per unit of their positions in a file
    outputs  the axes that are corrected
    exact    their corrections at positions of the inputs: (n, n_inputs) -> (n, n_outputs) mm
    area     values at nodes are those that come nearest to the corrections all around (least squares), not those of the
             nodes themselves
    written  what a file makes of a grid: it is judged after that
    kinks    of each input, positions at which the corrections may have a corner
    uneven   nodes need not be evenly spaced
    covered  (n_inputs, 2) where nodes are, mm and rad; beyond, but within the ranges, the values at the ends hold
    anchors  of each input, a position within its range at which there must be a node, in its unit of the file, or None.
             Steps are then whole thousandths of that unit, and the outermost nodes may lie beyond the range
    """

    inputs: tuple[str, ...]
    ranges: Array
    units: tuple[float, ...]
    outputs: tuple[str, ...]
    exact: Callable[[Array], Array]
    area: bool = False
    written: Callable[[Grid], Grid] = as_it_is
    kinks: tuple[Array, ...] = ()
    uneven: bool = False
    covered: Array = field(default_factory=lambda: np.zeros((0, 2)))
    anchors: tuple[float | None, ...] = ()
    _bending: dict[int, Bending] = field(default_factory=dict, init=False)
    _checks: list[tuple[Array, Array]] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        if not len(self.covered):
            self.covered = self.ranges

    @classmethod
    def of(
        cls, machine: Machine, inputs: tuple[str, ...], space: Array, tool_length: float, area: bool = False
    ) -> Volume:
        """The three linear axes of a machine over some axes; the others stay at zero, or as near as they can."""
        columns = [machine.axis_names.index(name) for name in inputs]
        linear = linear_axes(machine)
        rest = np.clip(np.zeros(len(space)), space[:, 0], space[:, 1])

        def exact(positions: Array) -> Array:
            q = np.tile(rest, (len(positions), 1))
            q[:, columns] = positions
            return exact_correction(machine, q, State(tool_length))[:, linear]

        units = tuple(machine.axes[column].unit for column in columns)
        outputs = tuple(machine.axis_names[column] for column in linear)
        kinks = tuple(machine.breakpoints(name) for name in inputs)
        return cls(inputs, space[columns], units, outputs, exact, area, kinks=kinks)

    @classmethod
    def over_all(
        cls, machine: Machine, inputs: tuple[str, ...], space: Array, tool_length: float, area: bool = False
    ) -> Volume:
        """The same, in the middle of what is asked for over the whole range of the other axes.

        What other positions of the other axes add to a correction is levers and turns, which change slowly with where
        the inputs stand: it is worked out on a coarse grid of them, as fine as it takes, and straight in between.
        """
        found = cls.of(machine, inputs, space, tool_length, area)
        columns = [machine.axis_names.index(name) for name in inputs]
        linear = linear_axes(machine)
        rest = np.concatenate([corners(space), even_poses(space, OTHERS)])
        rest[:, columns] = 0.0
        rest = np.unique(rest, axis=0)

        def added(positions: Array) -> Array:
            """The middle less the correction with the other axes at rest."""
            meant = found.exact(positions)
            low = high = meant
            for place in rest:
                q = np.tile(place, (len(positions), 1))
                q[:, columns] = positions
                one = exact_correction(machine, q, State(tool_length))[:, linear]
                low, high = np.minimum(low, one), np.maximum(high, one)
            middle: Array = (low + high) / 2 - meant
            return middle

        grid = _followed(added, inputs, found.ranges, found.outputs)
        return replace(found, exact=lambda positions: found.exact(positions) + grid.at(positions))

    def grid(self, counts: Sequence[int]) -> Grid:
        """The table with that many nodes along each input, at positions that files can say."""
        nodes = tuple(self._nodes(index, count) for index, count in enumerate(counts))
        within = WITHIN if len(nodes) <= 3 else WITHIN // 2
        looked_at = tuple(self._around(index, line, within) for index, line in enumerate(nodes)) if self.area else nodes
        places = np.stack(np.meshgrid(*looked_at, indexing="ij"), axis=-1)
        values = self._at(places.reshape(-1, len(nodes))).reshape(*places.shape[:-1], len(self.outputs))
        return Grid(self.inputs, nodes, self.outputs, fitted(values, looked_at, nodes) if self.area else values)

    def _at(self, places: Array) -> Array:
        """The corrections at places (n, n_inputs); beyond the ranges they go on as straight as they came there."""
        if not self.anchors:
            return self.exact(places)
        low, high = self.ranges.T
        edge = np.clip(places, low, high)
        values = self.exact(edge)
        beyond = (edge != places).any(axis=1)
        if beyond.any():
            mirrored = np.clip(2 * edge[beyond] - places[beyond], low, high)
            values[beyond] = 2 * values[beyond] - self.exact(mirrored)
        return values

    def _around(self, index: int, nodes: Array, within: int) -> Array:
        """Places between the nodes, and where the ends hold: these count as much as half a cell."""
        low, high = self.ranges[index].tolist()
        step = (nodes[-1] - nodes[0]) / (len(nodes) - 1) / within
        before = np.linspace(low, nodes[0], within // 2, endpoint=False) if nodes[0] - low > step else np.zeros(0)
        after = np.linspace(high, nodes[-1], within // 2, endpoint=False) if high - nodes[-1] > step else np.zeros(0)
        return np.concatenate([before, between(nodes, within), after[::-1]])

    def _nodes(self, index: int, count: int) -> Array:
        if self.uneven:
            line = self._bends(index).uneven()[count][0] / self.units[index]
        else:
            low, high = (self.covered[index] / self.units[index]).tolist()
            line = even_line(low, high, count, self._anchor(index))
        nodes: Array = np.round(line, DIGITS) * self.units[index]
        return nodes

    def _anchor(self, index: int) -> float | None:
        return self.anchors[index] if self.anchors else None

    def least(self, index: int) -> int:
        """The fewest nodes along one input: a node at its anchor that is not at an end makes them three."""
        anchor = self._anchor(index)
        return 2 if anchor is None or np.abs(self.covered[index] / self.units[index] - anchor).min() < END else 3

    def left(self, grid: Grid) -> float:
        """The largest correction that a grid misses at random poses, mm."""
        if not self._checks:
            positions = random_poses(self.ranges, CHECKS, seed=3)
            self._checks.append((positions, self.exact(positions)))
        positions, exact = self._checks[0]
        return float(np.linalg.norm(self.written(grid).at(positions) - exact, axis=1).max())

    def counts(self, index: int, most: int) -> list[int]:
        """How many nodes may be put along one input."""
        if self.uneven:
            return sorted(count for count in self._bends(index).uneven() if count <= most)
        found = [self.least(index)]
        while found[-1] < min(most, FAR):
            found.append(found[-1] + 1 if found[-1] < CLOSE else int(np.ceil(found[-1] * GROWTH)))
        return [count for count in found if count <= min(most, FAR)]

    def fewer(self, index: int, count: int) -> int:
        """The next smaller number of nodes along one input."""
        return max((each for each in self.counts(index, count - 1)), default=2) if self.uneven else count - 1

    def bending(self, index: int, count: int) -> float:
        """The largest correction that `count` nodes along one input miss on random lines along it, mm."""
        bends = self._bends(index)
        return bends.uneven()[count][1] if self.uneven else bends.missed(self._nodes(index, count))

    def trimmed(self, index: int, allowed: float) -> Volume:
        """Nodes of one input only where the corrections change: at either end by no more than is allowed, mm."""
        covered = self.covered.copy()
        covered[index] = self._bends(index).ends(allowed)
        anchor = self._anchor(index)
        if anchor is not None:
            place = anchor * self.units[index]
            covered[index] = min(covered[index, 0], place), max(covered[index, 1], place)
        return replace(self, covered=covered)

    def _bends(self, index: int) -> Bending:
        if index not in self._bending:
            low, high = self.covered[index].tolist()
            kinks = self.kinks[index] if self.kinks else np.zeros(0)
            spread = random_poses(self.ranges, LINES, seed=5)
            self._bending[index] = Bending.over(low, high, kinks, lambda line: self._along(spread, index, line))
        return self._bending[index]

    def _along(self, spread: Array, axis: int, line: Array) -> Array:
        """Corrections at positions `line` of one input, the others as in `spread`: (n_spread, n_line, n_outputs)."""
        positions = np.repeat(spread, len(line), axis=0)
        positions[:, axis] = np.tile(line, len(spread))
        return self.exact(positions).reshape(len(spread), len(line), -1)


def _followed(
    function: Callable[[Array], Array], inputs: tuple[str, ...], ranges: Array, outputs: Sequence[str]
) -> Grid:
    """A function of positions (n, n_inputs) on even nodes, as many as keep it near, or the most."""
    seen = random_poses(ranges, SEEN, seed=19)
    meant = function(seen)
    for count in COARSE:
        nodes = tuple(np.linspace(low, high, count) for low, high in ranges.tolist())
        places = np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1)
        values = function(places.reshape(-1, len(nodes))).reshape(*places.shape[:-1], len(outputs))
        grid = Grid(inputs, nodes, tuple(outputs), values)
        if np.abs(grid.at(seen) - meant).max() < NEARLY:
            break
    return grid


def even_line(low: float, high: float, count: int, anchor: float | None) -> Array:
    """Evenly spaced nodes from one end to the other, or as near to that as they can be with one at the anchor."""
    if anchor is None:
        line: Array = np.linspace(low, high, count)
        return line
    before = np.arange(count)
    with np.errstate(divide="ignore", invalid="ignore"):
        sides = [
            np.where(part > 0, length / part, 0.0 if length < END else np.inf)
            for length, part in ((anchor - low, before), (high - anchor, before[::-1]))
        ]
    steps = np.max(sides, axis=0)
    chosen = int(np.argmin(steps))
    step = np.ceil(steps[chosen] / STEP - SLACK) * STEP
    nodes: Array = anchor + step * (before - chosen)
    return nodes


def inputs_that_matter(machine: Machine, space: Array, tool_length: float) -> tuple[str, ...]:
    """The linear axes, and those rotary axes on which the correction depends."""
    q, other = random_poses(space, 200, seed=13), random_poses(space, 200, seed=17)
    state = State(tool_length)
    before = exact_correction(machine, q, state)
    found = []
    for axis, name in enumerate(machine.axis_names):
        moved = q.copy()
        moved[:, axis] = other[:, axis]
        changed = np.abs(exact_correction(machine, moved, state) - before).max()
        if not machine.rotary[axis] or changed > MATTERS:
            found.append(name)
    return tuple(found)
