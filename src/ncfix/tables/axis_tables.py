"""Tables over one axis: of an axis over itself, sums of tables over several axes, and backlash.

Tables of an axis over itself (`positioning`) suit controls without volumetric compensation (class L-POS). The value at
a node is the mean of the exact correction over the other axes, which leaves the least rms error that such a table can;
there is one table for each direction.

Sums of tables (`additive`) suit controls with a table for each pair of an input and a corrected axis. The sum with the
least rms error consists of means: the table over an axis holds the mean of the correction over all other axes, less the
overall mean, which is added once.

Backlash (`reversals`) suits controls with separate backlash tables or parameters: plus or minus half the difference of
an axis's own correction between both directions. The mean of both directions belongs into the other tables.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ncfix.arrays import Array, Index
from ncfix.machine import Machine, State
from ncfix.tables.compensation import NOTHING, Compensation, Term, own_terms
from ncfix.tables.correction import (
    even_poses,
    exact_correction,
    linear_axes,
    own_rotary_correction,
    poses_along,
    random_poses,
    random_ways,
)
from ncfix.tables.grid import Grid, projector
from ncfix.values import frozen

MEAN_POSES = 64
"""Number of poses of the other axes in the mean of `positioning`: half of them, and the opposite ones."""
OWN_FINE = 241
"""Number of positions of an axis at which `positioning` evaluates the curve."""
SUM_POSES = 128
"""Number of poses of the other axes in the mean of `additive`: half of them, and the opposite ones."""
FINE = 121
"""Number of positions of an axis at which curves are evaluated."""
RADIUS = 200.0
"""Radius at which an angle is compared with a length, mm."""
PLAY_POSES = 8
"""Number of poses of the other axes in the mean of backlash."""
SLIGHT = 1e-5
"""Smallest backlash that counts, mm."""
SHARE = 0.1
"""Share of the target that a backlash table may miss between nodes."""
WAYS = 1000
"""Number of random poses at which the remaining backlash is evaluated."""


def positioning(machine: Machine, space: Array, tool_length: float, most: int, target: float) -> Compensation:
    """A forward and a reverse table for each axis over itself; linear between nodes, constant beyond the ends.

    Tables of rotary axes remove their own angular positioning error, those of linear axes the mean of the rest.
    most    largest number of nodes
    target  largest deviation between nodes, mm; for rotary axes at `RADIUS`
    Axes without errors get no table.
    """
    half = random_poses(space, MEAN_POSES // 2, seed=11)
    rest = np.concatenate([half, space.sum(axis=1) - half])
    done = NOTHING

    def mean(axis: int, positions: Array, way: int) -> Array:
        """Mean correction (n,), mm or rad, of an axis at positions (n,) while it moves in direction `way`."""
        q = poses_along(axis, positions, rest)
        state = State(tool_length, np.eye(len(space))[axis] * way)
        if machine.rotary[axis]:
            correction = own_rotary_correction(machine, q, state)
        else:
            correction = exact_correction(machine, q, state, done.at(machine.axis_names, q) * machine.rotary)
        return correction[:, axis].reshape(len(positions), MEAN_POSES).mean(axis=1)

    for axis in sorted(range(len(space)), key=lambda index: not machine.rotary[index]):
        limit = target / RADIUS if machine.rotary[axis] else target
        low, high = space[axis].tolist()
        fine, name = np.linspace(low, high, OWN_FINE), machine.axis_names[axis]
        nodes = np.linspace(low, high, nodes_needed(fine, mean(axis, fine, 0), most, limit))
        both = [mean(axis, nodes, way) for way in (1, -1)]
        for values in both:
            values[np.abs(values) < 1e-3 * limit] = 0.0  # values of less than a thousandth of the limit are none
        if any(values.any() for values in both):
            done = Compensation((*done.terms, *own_terms(name, nodes, *both)))
    return done


def nodes_needed(fine: Array, curve: Array, most: int, limit: float) -> int:
    """Number of even nodes, at most `most`, whose connecting lines are within `limit` of a curve (n,) over `fine`."""
    for count in range(2, most):
        nodes = np.linspace(fine[0], fine[-1], count)
        if np.abs(np.interp(fine, nodes, np.interp(nodes, fine, curve)) - curve).max() <= limit:
            return count
    return most


@frozen
class AxisTables:
    """The tables over one axis.

    values   (n_nodes, n_outputs) corrections of `outputs` at the positions `nodes`, mm or rad
    reverse  (n_nodes,) correction of the axis itself while it moves towards minus; `values` then hold for plus
    """

    input: str
    nodes: Array
    outputs: tuple[str, ...]
    values: Array
    reverse: Array

    def grid(self, output: str) -> Grid:
        """The table that corrects one axis."""
        column = self.values[:, [self.outputs.index(output)]]
        return Grid((self.input,), (self.nodes,), (output,), column)


def additive(
    machine: Machine, space: Array, tool_length: float, most: int, target: float, both: bool = False
) -> tuple[AxisTables, ...]:
    """Tables over every axis in the space (n_axes, 2), correcting the axis itself and the three linear axes.

    Nodes are evenly spaced, at positions of four decimals (mm, degree). Rotary axes first correct themselves.
    most    largest number of nodes
    target  twice the largest deviation between nodes, mm; for rotary axes at `RADIUS`
    both    the table of an axis over itself differs by direction; else it holds the mean
    """
    region = Region(machine, space, tool_length)
    tables = []
    total = np.zeros(len(space))
    for axis in range(len(space)):
        curve, over_all = region.means(axis)
        curve = curve - over_all
        share = np.where(machine.rotary, np.arange(len(space)) == axis, 1 / len(space))
        total = total + share * over_all
        outputs = region.outputs(axis, curve, target)
        count = region.nodes_needed(axis, curve, outputs, most, target)
        unit = machine.axes[axis].unit
        nodes = np.round(region.fine(axis, count) / unit, 4) * unit
        half = np.zeros(FINE)
        if both:  # of what its own correction differs by between both ways
            ahead, back = (region.means(axis, np.eye(len(space))[axis] * way)[0][:, axis] for way in (1.0, -1.0))
            half = (ahead - back) / 2
        tables.append(_axis_tables(region, axis, curve, outputs, nodes, half))
    for number, table in enumerate(tables):  # that of an axis over itself has the mean over all
        constant, values = total[number], table.values.copy()
        values[:, table.outputs.index(table.input)] += constant
        tables[number] = replace(table, values=values, reverse=table.reverse + constant)
    return tuple(tables)


@frozen
class Region:
    """A machine with the space (n_axes, 2) that tables cover, mm and rad, and a tool length, mm."""

    machine: Machine
    space: Array
    tool_length: float

    def fine(self, axis: int, count: int = FINE) -> Array:
        """Evenly spaced positions of an axis, (count,)."""
        low, high = self.space[axis].tolist()
        return np.linspace(low, high, count)

    def means(self, axis: int, way: Array | float = 0.0) -> tuple[Array, Array]:
        """Mean correction of every axis at fine positions of one, (FINE, n_axes), and its overall mean, (n_axes,).

        way  (n_axes,) the directions in which axes move; 0: none
        """
        machine, space, state = self.machine, self.space, State(self.tool_length, way)
        half = even_poses(space, SUM_POSES // 2)
        q = poses_along(axis, self.fine(axis), np.concatenate([half, space.sum(axis=1) - half]))
        correction = exact_correction(machine, q, state, own_rotary_correction(machine, q, state))
        curve = correction.reshape(FINE, SUM_POSES, -1).mean(axis=1)
        curve[:, machine.rotary & (np.arange(len(space)) != axis)] = 0.0
        over_all: Array = (curve[1:] + curve[:-1]).mean(axis=0) / 2
        return curve, over_all

    def outputs(self, axis: int, curve: Array, target: float) -> Index:
        """Columns of axes that tables over this axis correct: itself, and those with more than a tenth of target."""
        needed = np.flatnonzero((np.abs(curve) * self._lever).max(axis=0) > target / 10)
        return np.union1d(needed, [axis])

    def nodes_needed(self, axis: int, curve: Array, outputs: Index, most: int, target: float) -> int:
        """Number of nodes, at most `most`, whose connecting lines are within half the target of all curves."""
        fine = self.fine(axis)
        return max(nodes_needed(fine, curve[:, j] * self._lever[j], most, target / 2) for j in outputs)

    @property
    def _lever(self) -> Array:
        """(n_axes,) how far the tip moves, mm, per mm or rad of each axis; rotary axes act at `RADIUS`."""
        return np.where(self.machine.rotary, RADIUS, 1.0)


def _axis_tables(region: Region, axis: int, curve: Array, outputs: Index, nodes: Array, half: Array) -> AxisTables:
    """The tables over an axis, fitted to its curves (FINE, n_axes); half (FINE,): half of its own backlash."""
    fit = projector(region.fine(axis), nodes)
    own = int(np.flatnonzero(outputs == axis)[0])
    values = fit @ curve[:, outputs]
    reverse = values[:, own] - fit @ half
    values[:, own] += fit @ half
    names = region.machine.axis_names
    return AxisTables(names[axis], nodes, tuple(names[j] for j in outputs), values, reverse)


@frozen
class Reversal:
    """The backlash correction of an axis: `half` is added while it moves towards plus, subtracted towards minus.

    nodes  positions of the axis, ascending, (n,) mm
    half   half of the backlash correction there, (n,) mm
    """

    axis: str
    nodes: Array
    half: Array

    @property
    def whole(self) -> float:
        """Mean correction step of the axis at a reversal from minus to plus, mm."""
        return 2 * float(self.half.mean())

    def terms(self) -> tuple[Term, Term]:
        """The correction as a table for each direction."""
        return own_terms(self.axis, self.nodes, self.half, -self.half)


def reversals(machine: Machine, space: Array, tool_length: float, target: float, most: int) -> tuple[Reversal, ...]:
    """The backlash correction of every linear axis that has backlash, with at most `most` nodes each."""
    found = []
    for axis in linear_axes(machine):
        low, high = space[axis].tolist()
        fine = np.linspace(low, high, FINE)
        q, way = poses_along(axis, fine, even_poses(space, PLAY_POSES)), np.eye(len(space))[axis]
        ahead, back = (exact_correction(machine, q, State(tool_length, each))[:, axis] for each in (way, -way))
        curve = (ahead - back).reshape(FINE, PLAY_POSES).mean(axis=1) / 2
        if np.abs(curve).max() > SLIGHT:
            nodes = np.linspace(low, high, nodes_needed(fine, curve, most, SHARE * target))
            found.append(Reversal(machine.axis_names[axis], nodes, np.interp(nodes, fine, curve)))
    return tuple(found)


def reversal_note(machine: Machine, space: Array, tool_length: float, done: Compensation = NOTHING) -> Iterator[str]:
    """A note on the backlash that the tables `done` leave, if there is any."""
    q, ways = random_poses(space, WAYS, seed=21), random_ways(len(space), WAYS, seed=22)
    neither = np.zeros_like(ways)
    either, mean = (exact_correction(machine, q, State(tool_length, way)) for way in (ways, neither))
    taken = done.at(machine.axis_names, q, ways) - done.at(machine.axis_names, q, neither)
    left = float(np.linalg.norm((either - mean - taken)[:, linear_axes(machine)], axis=1).max())
    if left > SLIGHT:
        yield (
            f"Errors that depend on the direction of motion (play) are not corrected: up to {1e3 * left:.2f} um remain."
        )
