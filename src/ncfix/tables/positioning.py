"""Tables of one axis over itself: what a control without volumetric compensation can do (class L-POS).

The value at a node is the mean of the exact correction over the rest of the working space, which is what leaves the
least rms error of all that such a table can say; forward and reverse are filled apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.machine import Machine, State
from ncfix.tables.exact import exact_correction, own_rotary_error
from ncfix.tables.grid import Array, Grid
from ncfix.tables.neutral import Compensation, Term
from ncfix.tables.poses import random_poses

REST = 64
"""Poses of the other axes over which a node's value is averaged: half of them, and those opposite."""
FINE = 241
"""Positions at which an axis is looked at to find how many nodes it needs."""


def positioning(machine: Machine, space: Array, tool_length: float, most: int, target: float) -> Compensation:
    """A forward and a reverse table for each axis over itself; linear between nodes, held beyond the ends.

    Rotary axes get their own angular positioning error taken off, linear axes the mean of what is then left. The nodes
    are as few as keep the line between them within `target` (mm; mm at a radius of 200 for rotary axes) of the
    curve, and at most `most`. Axes with nothing to correct get no table.
    """
    terms: list[Term] = []
    for axis in sorted(range(len(space)), key=lambda index: not machine.rotary[index]):
        limit = target / 200 if machine.rotary[axis] else target
        own = Own(machine, space, tool_length, axis, Compensation(tuple(terms)))
        nodes = own.nodes(most, limit)
        for way in (1, -1):
            terms.append(Term((own.grid(way, nodes, limit),), (machine.axis_names[axis], way)))
        if not any(term.factors[0].values.any() for term in terms[-2:]):
            del terms[-2:]
    return Compensation(tuple(terms))


@dataclass(frozen=True, slots=True)
class Own:
    """What the tables of an axis over itself are made of.

    space        (n_axes, 2) the positions that are covered, mm and rad
    tool_length  mm
    axis         its column
    done         tables that are made already: rotary axes turn themselves right first
    """

    machine: Machine
    space: Array
    tool_length: float
    axis: int
    done: Compensation

    def nodes(self, most: int, limit: float) -> Array:
        """Where a table has its nodes: as many as the mean of both ways needs."""
        low, high = self.space[self.axis].tolist()
        fine = np.linspace(low, high, FINE)
        return np.linspace(low, high, nodes_needed(fine, self.mean(0, fine), most, limit))

    def grid(self, way: int, nodes: Array, limit: float) -> Grid:
        """The table while the axis moves one way; values of less than a thousandth of the limit are none."""
        values = self.mean(way, nodes)
        values[np.abs(values) < 1e-3 * limit] = 0.0
        name = self.machine.axis_names[self.axis]
        return Grid((name,), (nodes,), (name,), values[:, None])

    def mean(self, way: int, nodes: Array) -> Array:
        """The mean correction of the axis at its positions `nodes` while it moves one way, (n,) mm or rad."""
        machine, axis = self.machine, self.axis
        half = random_poses(self.space, REST // 2, seed=11)
        rest = np.concatenate([half, self.space.sum(axis=1) - half])
        q = np.repeat(rest[None], len(nodes), axis=0)
        q[:, :, axis] = nodes[:, None]
        direction = np.zeros(len(self.space))
        direction[axis] = way
        state = State(self.tool_length, direction)
        flat = q.reshape(-1, len(self.space))
        if machine.rotary[axis]:
            correction = -own_rotary_error(machine, flat, state, axis)
        else:
            turned = self.done.at(machine.axis_names, flat) * machine.rotary
            correction = exact_correction(machine, flat, state, turned)[:, axis]
        mean: Array = correction.reshape(len(nodes), REST).mean(axis=1)
        return mean


def nodes_needed(fine: Array, curve: Array, most: int, limit: float) -> int:
    """How many even nodes keep straight lines between them within `limit` of a curve (n,) over `fine` (n,), at most."""
    for count in range(2, most):
        nodes = np.linspace(fine[0], fine[-1], count)
        if np.abs(np.interp(fine, nodes, np.interp(nodes, fine, curve)) - curve).max() <= limit:
            return count
    return most
