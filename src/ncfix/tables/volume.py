"""Grids over several axes: the exact correction at every node, and how many nodes along each axis it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ncfix.machine import Machine, State
from ncfix.tables.exact import exact_correction, linear_axes
from ncfix.tables.fit import between, fitted
from ncfix.tables.grid import Array, Grid
from ncfix.tables.poses import random_poses

LINES = 60
"""Random lines along an axis on which its bending is judged."""
CHECKS = 2000
"""Random poses on which a grid is judged, as many as in Esmaeili (2021), section 4.2."""
MATTERS = 1e-6
"""mm: a smaller change of the correction is none."""
DIGITS = 6
"""Decimals of a node's position, mm or degree."""
BETWEEN = 4
"""Points looked at between two nodes of a line."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """A grid that was searched for.

    grid     the table
    left     largest correction that it misses at random poses, mm
    reached  whether that is within the target
    """

    grid: Grid
    left: float
    reached: bool


@dataclass(slots=True)
class Volume:
    """The corrections of the linear axes over some axes; the other axes stay at zero, or as near as they can.

    area  values at nodes are those that come nearest to the corrections all around (least squares), not those of the
          nodes themselves
    """

    machine: Machine
    inputs: tuple[str, ...]
    space: Array
    tool_length: float
    area: bool = False
    _bending: dict[tuple[int, int], float] = field(default_factory=dict)

    @property
    def columns(self) -> list[int]:
        """The columns of the inputs."""
        return [self.machine.axis_names.index(name) for name in self.inputs]

    def exact(self, positions: Array) -> Array:
        """The correction of the three linear axes at positions of the inputs (n, n_inputs), (n, 3) mm."""
        rest = np.clip(np.zeros(len(self.space)), self.space[:, 0], self.space[:, 1])
        q = np.tile(rest, (len(positions), 1))
        q[:, self.columns] = positions
        return exact_correction(self.machine, q, State(self.tool_length))[:, linear_axes(self.machine)]

    def grid(self, counts: Sequence[int]) -> Grid:
        """The table with that many nodes along each input, at positions that files can say."""
        nodes = tuple(self._nodes(column, count) for column, count in zip(self.columns, counts, strict=True))
        looked_at = tuple(between(line) for line in nodes) if self.area else nodes
        places = np.stack(np.meshgrid(*looked_at, indexing="ij"), axis=-1)
        values = self.exact(places.reshape(-1, len(nodes))).reshape(*places.shape[:-1], 3)
        names = tuple(self.machine.axis_names[index] for index in linear_axes(self.machine))
        return Grid(self.inputs, nodes, names, fitted(values, looked_at, nodes) if self.area else values)

    def _nodes(self, column: int, count: int) -> Array:
        unit = self.machine.axes[column].unit
        low, high = self.space[column].tolist()
        nodes: Array = np.round(np.linspace(low, high, count) / unit, DIGITS) * unit
        return nodes

    def left(self, grid: Grid) -> float:
        """The largest correction that a grid misses at random poses, mm."""
        positions = random_poses(self.space[self.columns], CHECKS, seed=3)
        return float(np.linalg.norm(grid.at(positions) - self.exact(positions), axis=1).max())

    def bending(self, axis: int, count: int) -> float:
        """The largest correction that `count` nodes along one input miss on random lines along it, mm."""
        if (axis, count) not in self._bending:
            self._bending[axis, count] = self._missed(axis, count)
        return self._bending[axis, count]

    def _missed(self, axis: int, count: int) -> float:
        spread = random_poses(self.space[self.columns], LINES, seed=5)
        low, high = self.space[self.columns[axis]]
        steps = (count - 1) * BETWEEN + 1
        positions = np.repeat(spread, steps, axis=0)
        positions[:, axis] = np.tile(np.linspace(low, high, steps), LINES)
        values = self.exact(positions).reshape(LINES, steps, 3)
        part = (np.arange(steps - 1) % BETWEEN / BETWEEN)[None, :, None]
        nodes = values[:, ::BETWEEN]
        start, stop = (np.repeat(ends, BETWEEN, axis=1) for ends in (nodes[:, :-1], nodes[:, 1:]))
        chord = start * (1 - part) + stop * part
        return float(np.linalg.norm(values[:, :-1] - chord, axis=2).max())


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


def search(volume: Volume, target: float, most: Sequence[int], points: int, equal: bool = False) -> Mesh:
    """The grid with the fewest nodes found that misses at most `target` (mm) of the correction anywhere.

    It starts with two nodes along each input and adds one where that takes off most for the nodes that it costs, until
    random poses are within the target; then it takes away what was too much. `equal` adds one along every input at a
    time, as Esmaeili (2021), Fig. 4.4. At most `most` nodes along each input and `points` in all.
    """
    counts = [2] * len(volume.inputs)
    estimate = target
    best = volume.grid(counts)
    while (left := volume.left(best)) > target:
        grown = _grown(volume, counts, estimate, most, points, equal)
        if grown is None:
            return Mesh(best, left, False)
        counts, best = grown, volume.grid(grown)
        bent = sum(volume.bending(axis, n) for axis, n in enumerate(counts))
        estimate = bent * min(0.9, max(0.5, target / max(volume.left(best), 1e-12)))
    return Mesh(best, left, True) if equal else _thinned(volume, best, left, target)


def _grown(
    volume: Volume, counts: list[int], estimate: float, most: Sequence[int], points: int, equal: bool
) -> list[int] | None:
    """The next larger counts whose bending is below the estimate; None if the limits do not allow more."""
    counts = list(counts)
    grew = False
    while not grew or (not equal and sum(volume.bending(axis, n) for axis, n in enumerate(counts)) > estimate):
        larger = [[n + (equal or i == axis) for i, n in enumerate(counts)] for axis in range(len(counts))]
        allowed = [
            axis
            for axis, new in enumerate(larger)
            if np.prod(new) <= points and all(n <= limit for n, limit in zip(new, most, strict=True))
        ]
        if not allowed:
            return counts if grew else None
        counts = larger[max(allowed, key=lambda axis: _gain(volume, counts, axis))]
        grew = True
    return counts


def _gain(volume: Volume, counts: list[int], axis: int) -> float:
    """How much of the bending a node more along an axis takes off, for what it costs."""
    n = counts[axis]
    return (volume.bending(axis, n) - volume.bending(axis, min(2 * n, n + 4))) / float(np.log(min(2 * n, n + 4) / n))


def _thinned(volume: Volume, grid: Grid, left: float, target: float) -> Mesh:
    """Take nodes away as long as the target still holds."""
    axes = sorted(range(len(grid.counts)), key=lambda axis: -grid.points / grid.counts[axis])
    for axis in axes:
        while grid.counts[axis] > 2:
            fewer = volume.grid([n - (i == axis) for i, n in enumerate(grid.counts)])
            missed = volume.left(fewer)
            if missed > target:
                break
            grid, left = fewer, missed
    return Mesh(grid, left, True)
