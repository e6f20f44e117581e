"""Sums of one-axis tables: what a control does that has a table for each pair of an axis and an axis that it moves.

Of all such sums the one that leaves the least rms error over a space is made of means: the table over an axis holds the
mean of the correction over all other axes, less the mean over all of them, which is given once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.machine import Machine, State
from ncfix.tables.exact import exact_correction, own_rotary_error
from ncfix.tables.fit import projector
from ncfix.tables.grid import Array, Grid
from ncfix.tables.poses import even_poses
from ncfix.tables.positioning import nodes_needed

REST = 128
"""Poses of the other axes that a mean is taken over: half of them, and those opposite."""
FINE = 121
"""Positions at which an axis is looked at."""
RADIUS = 200.0
"""mm: where an angle counts as much as a length."""


@dataclass(frozen=True, slots=True)
class Line:
    """The tables over one axis: corrections of `outputs` at its positions `nodes`, (n_nodes, n_outputs) mm or rad.

    reverse  of the axis itself while it moves towards minus, (n_nodes,); `values` then hold the other way
    """

    input: str
    nodes: Array
    outputs: tuple[str, ...]
    values: Array
    reverse: Array

    def grid(self, output: str) -> Grid:
        """One of them."""
        column = self.values[:, [self.outputs.index(output)]]
        return Grid((self.input,), (self.nodes,), (output,), column)


def additive(
    machine: Machine, space: Array, tool_length: float, most: int, target: float, digits: int = 4, both: bool = False
) -> tuple[Line, ...]:
    """A line of tables for every axis, over the space (n_axes, 2): on itself, and on the three linear axes.

    Nodes are evenly spaced, at positions of so many `digits` (mm, degree), as few as keep straight lines between them
    within half the target (mm; at a radius of 200 mm) and at most `most`. Rotary axes turn themselves right first.
    `both` fills the table of an axis over itself for either way apart; else its mean serves both.
    """
    region = Region(machine, space, tool_length)
    lines = []
    total = np.zeros(len(space))
    for axis in range(len(space)):
        curve, over_all = region.means(axis)
        curve = curve - over_all
        share = np.where(machine.rotary, np.arange(len(space)) == axis, 1 / len(space))
        total = total + share * over_all
        outputs = region.outputs(axis, curve, target)
        count = region.nodes_needed(axis, curve, outputs, most, target)
        unit = machine.axes[axis].unit
        nodes = np.round(region.fine(axis, count) / unit, digits) * unit
        half = region.half_reversal(axis) if both else np.zeros(FINE)
        lines.append(_line(region, axis, curve, outputs, nodes, half))
    return tuple(_with_constant(line, machine, total) for line in lines)


@dataclass(frozen=True, slots=True)
class Region:
    """A machine in the space (n_axes, 2) that tables are to cover, mm and rad, with a tool length, mm."""

    machine: Machine
    space: Array
    tool_length: float

    def fine(self, axis: int, count: int = FINE) -> Array:
        """Evenly spaced positions of an axis, (count,)."""
        low, high = self.space[axis].tolist()
        return np.linspace(low, high, count)

    def means(self, axis: int, way: Array | float = 0.0) -> tuple[Array, Array]:
        """The mean correction of every axis at fine positions of one, (FINE, n_axes), and over all of them, (n_axes,).

        way  (n_axes,) the directions in which axes move; 0: none
        """
        machine, space, state = self.machine, self.space, State(self.tool_length, way)
        q = np.repeat(_rest(space)[None], FINE, axis=0)
        q[:, :, axis] = self.fine(axis)[:, None]
        flat = q.reshape(-1, len(space))
        correction = exact_correction(machine, flat, state, _turned(machine, flat, state))
        curve = correction.reshape(FINE, REST, -1).mean(axis=1)
        curve[:, machine.rotary & (np.arange(len(space)) != axis)] = 0.0
        over_all: Array = (curve[1:] + curve[:-1]).mean(axis=0) / 2
        return curve, over_all

    def half_reversal(self, axis: int) -> Array:
        """Half of what the own correction of an axis differs by between both ways, at its fine positions, (FINE,)."""
        ways = [np.eye(len(self.space))[axis] * way for way in (1.0, -1.0)]
        ahead, back = (self.means(axis, way)[0][:, axis] for way in ways)
        half: Array = (ahead - back) / 2
        return half

    def outputs(self, axis: int, curve: Array, target: float) -> NDArray[np.intp]:
        """The axes that tables over this one correct: itself, and those that need more than a tenth of the target."""
        needed = np.flatnonzero((np.abs(curve) * self._lever).max(axis=0) > target / 10)
        return np.union1d(needed, [axis])

    def nodes_needed(self, axis: int, curve: Array, outputs: NDArray[np.intp], most: int, target: float) -> int:
        """How many nodes keep straight lines between them within half the target of all curves, at most."""
        fine = self.fine(axis)
        return max(nodes_needed(fine, curve[:, j] * self._lever[j], most, target / 2) for j in outputs)

    @property
    def _lever(self) -> Array:
        """(n_axes,) mm that a unit of each axis counts for."""
        return np.where(self.machine.rotary, RADIUS, 1.0)


def _rest(space: Array) -> Array:
    half = even_poses(space, REST // 2)
    return np.concatenate([half, space.sum(axis=1) - half])


def _turned(machine: Machine, q: Array, state: State) -> Array:
    """The correction of the rotary axes: their own angular error, with the opposite sign."""
    turned = np.zeros_like(q)
    for axis in np.flatnonzero(machine.rotary).tolist():
        turned[:, axis] = -own_rotary_error(machine, q, state, axis)
    return turned


def _line(region: Region, axis: int, curve: Array, outputs: NDArray[np.intp], nodes: Array, half: Array) -> Line:
    """The tables over an axis, by least squares to its curves (FINE, n_axes); `half` (FINE,) of the own one's play."""
    fit = projector(region.fine(axis), nodes)
    own = int(np.flatnonzero(outputs == axis)[0])
    values = fit @ curve[:, outputs]
    reverse = values[:, own] - fit @ half
    values[:, own] += fit @ half
    names = region.machine.axis_names
    return Line(names[axis], nodes, tuple(names[j] for j in outputs), values, reverse)


def _with_constant(line: Line, machine: Machine, total: Array) -> Line:
    """The table of an axis over itself has the mean over all."""
    own = line.outputs.index(line.input)
    constant = total[machine.axis_names.index(line.input)]
    values = line.values.copy()
    values[:, own] += constant
    return Line(line.input, line.nodes, line.outputs, values, line.reverse + constant)
