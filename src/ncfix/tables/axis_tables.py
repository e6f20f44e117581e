"""Tables over one axis: of an axis over itself, sums of them over several axes, and play.

Of an axis over itself (`positioning`) is what a control without volumetric compensation can do (class L-POS). The value
at a node is the mean of the exact correction over the rest of the working space, which is what leaves the least rms
error of all that such a table can say; forward and reverse are filled apart.

Sums of tables (`additive`) are what a control does that has a table for each pair of an axis and an axis that it moves.
Of all such sums the one that leaves the least rms error over a space is made of means: the table over an axis holds the
mean of the correction over all other axes, less the mean over all of them, which is given once.

Play (`reversals`) is for controls that have a table or a parameter of their own for it. What the way an axis moves in
adds to its own correction, half of it one way and half of it the other: the mean of both ways belongs into the tables
that do not know the way.
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
"""Poses of the other axes over which a node's value is averaged: half of them, and those opposite."""
OWN_FINE = 241
"""Positions at which an axis is looked at to find how many nodes its table over itself needs."""
SUM_POSES = 128
"""Poses of the other axes that a mean is taken over: half of them, and those opposite."""
FINE = 121
"""Positions at which an axis is looked at."""
RADIUS = 200.0
"""mm: where an angle counts as much as a length."""
PLAY_POSES = 8
"""Poses of the other axes that play is averaged over."""
SLIGHT = 1e-5
"""mm: a change that is none."""
SHARE = 0.1
"""Of the target that nodes of a table of play may miss."""
WAYS = 1000
"""Random poses at which it is seen what the way changes in which an axis moves."""


def positioning(machine: Machine, space: Array, tool_length: float, most: int, target: float) -> Compensation:
    """A forward and a reverse table for each axis over itself; linear between nodes, held beyond the ends.

    Rotary axes get their own angular positioning error taken off, linear axes the mean of what is then left. The nodes
    are as few as keep the line between them within `target` (mm; mm at a radius of 200 for rotary axes) of the
    curve, and at most `most`. Axes with nothing to correct get no table.
    """
    half = random_poses(space, MEAN_POSES // 2, seed=11)
    rest = np.concatenate([half, space.sum(axis=1) - half])
    done = NOTHING

    def mean(axis: int, positions: Array, way: int) -> Array:
        """The mean correction of an axis at its positions (n,) while it moves one way, (n,) mm or rad."""
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
    """How many even nodes keep straight lines between them within `limit` of a curve (n,) over `fine` (n,), at most."""
    for count in range(2, most):
        nodes = np.linspace(fine[0], fine[-1], count)
        if np.abs(np.interp(fine, nodes, np.interp(nodes, fine, curve)) - curve).max() <= limit:
            return count
    return most


@frozen
class AxisTables:
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
    machine: Machine, space: Array, tool_length: float, most: int, target: float, both: bool = False
) -> tuple[AxisTables, ...]:
    """Tables over every axis, over the space (n_axes, 2): on itself, and on the three linear axes.

    Nodes are evenly spaced, at positions of four decimals (mm, degree), as few as keep straight lines between them
    within half the target (mm; at a radius of 200 mm) and at most `most`. Rotary axes turn themselves right first.
    `both` fills the table of an axis over itself for either way apart; else its mean serves both.
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
        half = even_poses(space, SUM_POSES // 2)
        q = poses_along(axis, self.fine(axis), np.concatenate([half, space.sum(axis=1) - half]))
        correction = exact_correction(machine, q, state, own_rotary_correction(machine, q, state))
        curve = correction.reshape(FINE, SUM_POSES, -1).mean(axis=1)
        curve[:, machine.rotary & (np.arange(len(space)) != axis)] = 0.0
        over_all: Array = (curve[1:] + curve[:-1]).mean(axis=0) / 2
        return curve, over_all

    def outputs(self, axis: int, curve: Array, target: float) -> Index:
        """The axes that tables over this one correct: itself, and those that need more than a tenth of the target."""
        needed = np.flatnonzero((np.abs(curve) * self._lever).max(axis=0) > target / 10)
        return np.union1d(needed, [axis])

    def nodes_needed(self, axis: int, curve: Array, outputs: Index, most: int, target: float) -> int:
        """How many nodes keep straight lines between them within half the target of all curves, at most."""
        fine = self.fine(axis)
        return max(nodes_needed(fine, curve[:, j] * self._lever[j], most, target / 2) for j in outputs)

    @property
    def _lever(self) -> Array:
        """(n_axes,) mm that a unit of each axis counts for."""
        return np.where(self.machine.rotary, RADIUS, 1.0)


def _axis_tables(region: Region, axis: int, curve: Array, outputs: Index, nodes: Array, half: Array) -> AxisTables:
    """The tables over an axis, by least squares to its curves (FINE, n_axes); `half` (FINE,) of the own one's play."""
    fit = projector(region.fine(axis), nodes)
    own = int(np.flatnonzero(outputs == axis)[0])
    values = fit @ curve[:, outputs]
    reverse = values[:, own] - fit @ half
    values[:, own] += fit @ half
    names = region.machine.axis_names
    return AxisTables(names[axis], nodes, tuple(names[j] for j in outputs), values, reverse)


@frozen
class Reversal:
    """What is added to an axis while it moves towards plus, and taken off it while it moves towards minus.

    nodes  positions of the axis, ascending, (n,) mm
    half   there, (n,) mm
    """

    axis: str
    nodes: Array
    half: Array

    @property
    def whole(self) -> float:
        """What the axis is moved by when it turns round, from minus to plus, on the average, mm."""
        return 2 * float(self.half.mean())

    def terms(self) -> tuple[Term, Term]:
        """As tables."""
        return own_terms(self.axis, self.nodes, self.half, -self.half)


def reversals(machine: Machine, space: Array, tool_length: float, target: float, most: int) -> tuple[Reversal, ...]:
    """The play of every linear axis that has some, with at most so many nodes."""
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
    """What to say of play that is left; `done`: tables that take some off."""
    q, ways = random_poses(space, WAYS, seed=21), random_ways(len(space), WAYS, seed=22)
    neither = np.zeros_like(ways)
    either, mean = (exact_correction(machine, q, State(tool_length, way)) for way in (ways, neither))
    taken = done.at(machine.axis_names, q, ways) - done.at(machine.axis_names, q, neither)
    left = float(np.linalg.norm((either - mean - taken)[:, linear_axes(machine)], axis=1).max())
    if left > SLIGHT:
        yield f"What the way changes in which an axis moves (play) is left: up to {1e3 * left:.2f} um."
