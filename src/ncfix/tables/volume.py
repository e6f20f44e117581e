"""Grids over several axes, and the search for the number of nodes along each axis.

A grid holds the exact correction at every node, or the values that fit it best all around. `search` finds the number of
nodes along each axis. A multilinear grid misses about the sum of what it misses along each axis alone, which is quickly
computed on random lines. So for every total number of nodes the best distribution among the axes is known; among these
distributions the search finds the smallest one that really meets the target.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field, replace

import numpy as np

from ncfix.arrays import Array, Index
from ncfix.machine import Machine, State
from ncfix.tables.correction import corners, even_poses, exact_correction, linear_axes, random_poses
from ncfix.tables.grid import WITHIN, Bending, Grid, between, fitted, on_full_grid
from ncfix.values import frozen, mutable

LINES = 32
"""Number of random lines along an axis on which the error of its nodes is evaluated."""
CHECKS = 8000
"""Number of random poses at which a grid is checked, four times as many as in Esmaeili (2021), section 4.2."""
MATTERS = 1e-6
"""Smallest change of the correction that counts, mm."""
DIGITS = 6
"""Decimals of a node's position, mm or degree."""
STEP = 1e-3
"""Unit of the step of nodes with an anchor, mm or degree, as in parameters of controls."""
SLACK = 1e-6
"""Rounding tolerance of a step, in that unit."""
END = 1e-9
"""Distance from an end of the range, mm or degree, within which an anchor is at the end."""
COARSE = (3, 5, 9, 17)
"""Numbers of nodes per axis that are tried for the grid of the middle over other axes."""
SEEN = 200
"""Number of random positions at which that grid is checked."""
NEARLY = 1e-4
"""Largest error of that grid, mm."""
OTHERS = 12
"""Number of poses of other axes, besides the corners, over which the middle is taken."""
CLOSE = 48
"""Up to this number every number of even nodes is tried, since they may hit the kinks of a table."""
MAX_NODES = 130
GROWTH = 1.15
"""Largest number of even nodes that is tried, and the factor of growth from `CLOSE` on."""
FINE = 1 / 8
"""Share of the target at which one axis has enough nodes."""
SURELY = 1 / 2
"""Share of the target within which the sum of the errors of all axes is surely good enough."""
AIM = 0.95
"""Share of a target that is aimed at, since poses that were not checked may be slightly worse."""
LAST = 3
"""Number of the largest grids that are tried if the target is missed."""
REMEMBERED = 1 << 16
"""Largest number of points of a grid that is cached."""


@mutable
class Volume:
    """Corrections of some axes as a function of the positions of some axes, from which grids are made and checked.

    inputs   the axes that are looked up
    ranges   (n_inputs, 2) ranges of their positions, mm and rad
    units    mm or rad per unit of their positions in a file
    outputs  the axes that are corrected
    exact    positions of the inputs (n, n_inputs) -> corrections (n, n_outputs), mm
    area     whether values at nodes are fitted to the surroundings (least squares) instead of exact at the nodes
    written  grid -> the grid after rounding by the file, which is what is checked
    made     numbers of nodes -> the grid of a file, if that does not follow from the corrections at its nodes
    kinks    for each input, positions at which the corrections may have a corner
    uneven   whether nodes may be unevenly spaced
    covered  (n_inputs, 2) range of the nodes, mm and rad; beyond it, within `ranges`, the end values hold
    anchors  for each input, a position within its range that must be a node, in the unit of the file, or None. Steps
             are then whole thousandths of that unit, and the outermost nodes may lie beyond the range
    """

    inputs: tuple[str, ...]
    ranges: Array
    units: tuple[float, ...]
    outputs: tuple[str, ...]
    exact: Callable[[Array], Array]
    area: bool = False
    written: Callable[[Grid], Grid] = lambda grid: grid
    made: Callable[[tuple[int, ...]], Grid] | None = None
    kinks: tuple[Array, ...] = ()
    uneven: bool = False
    covered: Array = field(default_factory=lambda: np.zeros((0, 2)))
    anchors: tuple[float | None, ...] = ()
    _bending: dict[int, Bending] = field(default_factory=dict, init=False)
    _checks: list[tuple[Array, Array]] = field(default_factory=list, init=False)
    _grids: dict[tuple[int, ...], Grid] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        if not len(self.covered):
            self.covered = self.ranges

    @classmethod
    def of(
        cls, machine: Machine, inputs: tuple[str, ...], space: Array, tool_length: float, area: bool = False
    ) -> Volume:
        """Corrections of X, Y and Z of a machine over some axes; the others are at zero, or nearest to it."""
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
        """As `of`, but with the middle of the corrections over the whole ranges of the other axes.

        The difference from the correction with the other axes at rest comes from levers and rotations and changes
        slowly with the inputs, so it is interpolated on a coarse grid.
        """
        found = cls.of(machine, inputs, space, tool_length, area)
        columns = [machine.axis_names.index(name) for name in inputs]
        linear = linear_axes(machine)
        rest = np.concatenate([corners(space), even_poses(space, OTHERS)])
        rest[:, columns] = 0.0
        rest = np.unique(rest, axis=0)

        def added(positions: Array) -> Array:
            """Middle of the corrections minus the correction with the other axes at rest, (n, 3) mm."""
            meant = found.exact(positions)
            low = high = meant
            for place in rest:
                q = np.tile(place, (len(positions), 1))
                q[:, columns] = positions
                one = exact_correction(machine, q, State(tool_length))[:, linear]
                low, high = np.minimum(low, one), np.maximum(high, one)
            return (low + high) / 2 - meant

        seen = random_poses(found.ranges, SEEN, seed=19)
        meant = added(seen)
        for count in COARSE:
            nodes = tuple(np.linspace(low, high, count) for low, high in found.ranges.tolist())
            grid = Grid(inputs, nodes, found.outputs, on_full_grid(added, nodes))
            if np.abs(grid.at(seen) - meant).max() < NEARLY:
                break
        return replace(found, exact=lambda positions: found.exact(positions) + grid.at(positions))

    def grid(self, counts: Sequence[int]) -> Grid:
        """The table with these numbers of nodes along the inputs, at positions that a file can hold; cached."""
        key = tuple(counts)
        if key in self._grids:
            return self._grids[key]
        found = self._grid(key) if self.made is None else self.made(key)
        if found.points <= REMEMBERED:
            self._grids[key] = found
        return found

    def _grid(self, counts: tuple[int, ...]) -> Grid:
        nodes = tuple(self.nodes(index, count) for index, count in enumerate(counts))
        within = WITHIN if len(nodes) <= 3 else WITHIN // 2
        looked_at = tuple(self._around(index, line, within) for index, line in enumerate(nodes)) if self.area else nodes
        values = on_full_grid(self._at, looked_at)
        return Grid(self.inputs, nodes, self.outputs, fitted(values, looked_at, nodes) if self.area else values)

    def _at(self, places: Array) -> Array:
        """The corrections at places (n, n_inputs); beyond the ranges extrapolated by point reflection at the edge."""
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
        """Positions for the fit: between the nodes, and beyond the end nodes, which count as half a cell."""
        low, high = self.ranges[index].tolist()
        step = (nodes[-1] - nodes[0]) / (len(nodes) - 1) / within
        before = np.linspace(low, nodes[0], within // 2, endpoint=False) if nodes[0] - low > step else np.zeros(0)
        after = np.linspace(high, nodes[-1], within // 2, endpoint=False) if high - nodes[-1] > step else np.zeros(0)
        return np.concatenate([before, between(nodes, within), after[::-1]])

    def nodes(self, index: int, count: int) -> Array:
        """Positions of `count` nodes along one input, mm or rad, rounded as in a file."""
        if self.uneven:
            line = self._bends(index).uneven()[count][0] / self.units[index]
        else:
            low, high = (self.covered[index] / self.units[index]).tolist()
            line = even_line(low, high, count, self.anchor(index))
        return np.round(line, DIGITS) * self.units[index]

    def anchor(self, index: int) -> float | None:
        """The position at which one input must have a node, in the unit of the file; None if there is none."""
        return self.anchors[index] if self.anchors else None

    def least(self, index: int) -> int:
        """Smallest number of nodes along one input: 2, or 3 with an anchor that is not at an end."""
        anchor = self.anchor(index)
        return 2 if anchor is None or np.abs(self.covered[index] / self.units[index] - anchor).min() < END else 3

    def left(self, grid: Grid) -> float:
        """The largest correction that a grid misses at random poses, mm."""
        if not self._checks:
            positions = random_poses(self.ranges, CHECKS, seed=3)
            self._checks.append((positions, self.exact(positions)))
        positions, exact = self._checks[0]
        return float(np.linalg.norm(self.written(grid).at(positions) - exact, axis=1).max())

    def counts(self, index: int, most: int) -> list[int]:
        """The numbers of nodes along one input that are tried, ascending, at most `most`."""
        if self.uneven:
            return sorted(count for count in self._bends(index).uneven() if count <= most)
        found = [self.least(index)]
        while found[-1] < min(most, MAX_NODES):
            found.append(found[-1] + 1 if found[-1] < CLOSE else int(np.ceil(found[-1] * GROWTH)))
        return [count for count in found if count <= min(most, MAX_NODES)]

    def fewer(self, index: int, count: int) -> int:
        """The next smaller possible number of nodes along one input."""
        return max((each for each in self.counts(index, count - 1)), default=2) if self.uneven else count - 1

    def bending(self, index: int, count: int) -> float:
        """Largest correction that `count` nodes along one input miss on random lines, mm."""
        bends = self._bends(index)
        return bends.uneven()[count][1] if self.uneven else bends.missed(self.nodes(index, count))

    def trimmed(self, index: int, allowed: float) -> Volume:
        """The volume with nodes of one input only where the corrections change by more than `allowed`, mm."""
        covered = self.covered.copy()
        covered[index] = self._bends(index).ends(allowed)
        anchor = self.anchor(index)
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


def even_line(low: float, high: float, count: int, anchor: float | None) -> Array:
    """`count` evenly spaced nodes over a range; with an anchor, one of them is there and the ends may be exceeded."""
    if anchor is None:
        return np.linspace(low, high, count)
    before = np.arange(count)
    with np.errstate(divide="ignore", invalid="ignore"):
        sides = [
            np.where(part > 0, length / part, 0.0 if length < END else np.inf)
            for length, part in ((anchor - low, before), (high - anchor, before[::-1]))
        ]
    steps = np.max(sides, axis=0)
    chosen = int(np.argmin(steps))
    step = np.ceil(steps[chosen] / STEP - SLACK) * STEP
    return anchor + step * (before - chosen)


def inputs_that_matter(machine: Machine, space: Array, tool_length: float) -> tuple[str, ...]:
    """The linear axes that correct the tip, and the other axes on which the correction depends."""
    q, other = random_poses(space, 200, seed=13), random_poses(space, 200, seed=17)
    state = State(tool_length)
    before = exact_correction(machine, q, state)
    found, linear = [], linear_axes(machine)
    for axis, name in enumerate(machine.axis_names):
        moved = q.copy()
        moved[:, axis] = other[:, axis]
        changed = np.abs(exact_correction(machine, moved, state) - before).max()
        if axis in linear or changed > MATTERS:
            found.append(name)
    return tuple(found)


def unseen_axes(machine: Machine, space: Array, tool_length: float, inputs: Sequence[str]) -> str:
    """Axes on which the correction depends but a table over `inputs` does not, as text; "" if there are none."""
    return ", ".join(name for name in inputs_that_matter(machine, space, tool_length) if name not in inputs)


@frozen
class Mesh:
    """The result of a search.

    grid     the table
    left     largest correction that it misses at random poses, mm
    reached  whether that is within the target
    """

    grid: Grid
    left: float
    reached: bool


def search(volume: Volume, target: float, most: Sequence[int], points: int, equal: bool = False) -> Mesh:
    """The grid with the fewest nodes found that misses at most `target`, mm.

    most    largest number of nodes along each input; points: in all
    equal   the same number of nodes along every input, increased one by one, as Esmaeili (2021), Fig. 4.4
    """
    if equal:
        side = int(min(min(most), np.floor(points ** (1 / len(most)) + 1e-9)))
        fewest = max(volume.least(axis) for axis in range(len(most)))
        ladder = np.repeat(np.arange(fewest, side + 1)[:, None], len(most), axis=1)
        return _first(volume, target, ladder)
    ladder, missed = _frontier([_along(volume, axis, target, n) for axis, n in enumerate(most)], points)
    found = _bisected(volume, target, ladder, float(missed[-1]) <= SURELY * target)
    return _thinned(volume, found, target) if found.reached else found


def _along(volume: Volume, axis: int, target: float, most: int) -> tuple[Index, Array]:
    """Numbers of nodes along one input, and what each misses along it, mm."""
    counts, missed = [], []
    for count in volume.counts(axis, most):
        counts.append(count)
        missed.append(volume.bending(axis, count))
        if missed[-1] <= FINE * target:
            break
    return np.array(counts, dtype=np.intp), np.array(missed)


def _frontier(axes: Sequence[tuple[Index, Array]], points: int) -> tuple[Index, Array]:
    """The Pareto-optimal counts (k, n_inputs) of total nodes and error, by ascending total; and their errors, mm.

    The error of counts is the sum of the errors along all axes.
    """
    counts, missed = np.zeros((1, 0), dtype=np.intp), np.zeros(1)
    for index, (line, part) in enumerate(axes):
        rest = int(np.prod([line[0] for line, _ in axes[index + 1 :]]))
        grown = np.concatenate([np.repeat(counts, len(line), axis=0), np.tile(line, len(counts))[:, None]], axis=1)
        total = (missed[:, None] + part).reshape(-1)
        allowed = grown.prod(axis=1) * rest <= points
        counts, missed = grown[allowed], total[allowed]
        order = np.lexsort((missed, counts.prod(axis=1)))
        before = np.minimum.accumulate(np.concatenate([[np.inf], missed[order][:-1]]))
        better = order[missed[order] < before]
        counts, missed = counts[better], missed[better]
    return counts, missed


def _at(volume: Volume, counts: Index, target: float) -> Mesh:
    grid = volume.grid(counts.tolist())
    left = volume.left(grid)
    return Mesh(grid, left, left <= target)


def _first(volume: Volume, target: float, ladder: Index) -> Mesh:
    """The first counts of a ladder (k, n_inputs) that meet the target, or the best ones."""
    best = _at(volume, ladder[0], target)
    for counts in ladder[1:]:
        if best.reached:
            break
        best = min(_at(volume, counts, target), best, key=lambda mesh: mesh.left)
    return best


def _bisected(volume: Volume, target: float, ladder: Index, surely: bool) -> Mesh:
    """The first counts of a ladder that meet the target, by bisection; or the best of the last few.

    surely  the last and largest grid certainly meets the target, so it need not be checked first
    """
    low, high, best = 0, len(ladder) - 1, None
    if not surely:
        last = _at(volume, ladder[-1], target)
        best = None if last.reached else _best_of_last(volume, target, ladder, last)
        if best is not None and not best.reached:
            return best
    while low < high:
        middle = (low + high) // 2
        found = _at(volume, ladder[middle], target)
        if found.reached:
            best, high = found, middle
        else:
            low = middle + 1
    return best or _best_of_last(volume, target, ladder, _at(volume, ladder[-1], target))


def _best_of_last(volume: Volume, target: float, ladder: Index, last: Mesh) -> Mesh:
    before = [_at(volume, counts, target) for counts in ladder[-LAST:-1]]
    return min((*before, last), key=lambda mesh: mesh.left)


def _thinned(volume: Volume, mesh: Mesh, target: float) -> Mesh:
    """Remove nodes along each axis as long as the target is still met."""
    counts = np.array(mesh.grid.counts, dtype=np.intp)
    for axis in np.argsort(counts):
        while counts[axis] > volume.least(int(axis)):
            fewer = counts.copy()
            fewer[axis] = volume.fewer(int(axis), int(counts[axis]))
            found = _at(volume, fewer, target)
            if not found.reached:
                break
            counts, mesh = fewer, found
    return mesh
