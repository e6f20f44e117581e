"""Grids over several axes: the exact correction at every node, or what comes nearest to it all around."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ncfix.machine import Machine, State
from ncfix.tables.exact import exact_correction, linear_axes
from ncfix.tables.fit import WITHIN, between, fitted
from ncfix.tables.grid import Array, Grid
from ncfix.tables.poses import random_poses

LINES = 60
"""Random lines along an axis on which its bending is judged."""
CHECKS = 8000
"""Random poses on which a grid is judged, four times as many as in Esmaeili (2021), section 4.2."""
MATTERS = 1e-6
"""mm: a smaller change of the correction is none."""
DIGITS = 6
"""Decimals of a node's position, mm or degree."""
BETWEEN = 4
"""Points looked at between two nodes of a line."""
GOLDEN = 0.6180339887498949
"""Of a cell, by which those points move on from cell to cell, lest they keep step with the pitch of a screw."""


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
    _checks: list[tuple[Array, Array]] = field(default_factory=list)

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
        within = WITHIN if len(nodes) <= 3 else WITHIN // 2
        looked_at = tuple(between(line, within) for line in nodes) if self.area else nodes
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
        if not self._checks:
            positions = random_poses(self.space[self.columns], CHECKS, seed=3)
            self._checks.append((positions, self.exact(positions)))
        positions, exact = self._checks[0]
        return float(np.linalg.norm(grid.at(positions) - exact, axis=1).max())

    def bending(self, axis: int, count: int) -> float:
        """The largest correction that `count` nodes along one input miss on random lines along it, mm."""
        if (axis, count) not in self._bending:
            self._bending[axis, count] = self._missed(axis, count)
        return self._bending[axis, count]

    def _missed(self, axis: int, count: int) -> float:
        spread = random_poses(self.space[self.columns], LINES, seed=5)
        low, high = self.space[self.columns[axis]]
        nodes = np.linspace(low, high, count)
        part = np.mod(np.arange(BETWEEN) / BETWEEN + GOLDEN * np.arange(count - 1)[:, None], 1.0)
        inside = (nodes[:-1, None] + part * (nodes[1] - nodes[0])).reshape(-1)
        ends, values = self._along(spread, axis, nodes), self._along(spread, axis, inside)
        share = part.reshape(-1)[:, None]
        chord = np.repeat(ends[:, :-1], BETWEEN, axis=1) * (1 - share) + np.repeat(ends[:, 1:], BETWEEN, axis=1) * share
        return float(np.linalg.norm(values - chord, axis=2).max())

    def _along(self, spread: Array, axis: int, line: Array) -> Array:
        """Corrections at positions `line` of one input, the others as in `spread`: (n_spread, n_line, 3)."""
        positions = np.repeat(spread, len(line), axis=0)
        positions[:, axis] = np.tile(line, len(spread))
        return self.exact(positions).reshape(len(spread), len(line), 3)


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
