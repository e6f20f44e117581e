"""Play of the linear axes, for controls that have a table or a parameter of their own for it.

What the way an axis moves in adds to its own correction, half of it one way and half of it the other: the mean of both
ways belongs into the tables that do not know the way.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ncfix.machine import Machine, State
from ncfix.tables.exact import exact_correction, linear_axes
from ncfix.tables.grid import Array, Grid
from ncfix.tables.neutral import NOTHING, Compensation, Term
from ncfix.tables.poses import even_poses, random_poses, random_ways
from ncfix.tables.positioning import nodes_needed

FINE = 121
"""Positions at which an axis is looked at."""
REST = 8
"""Poses of the other axes that are averaged over."""
SLIGHT = 1e-5
"""mm: a change that is none."""
SHARE = 0.1
"""Of the target that nodes of a table of play may miss."""
WAYS = 1000
"""Random poses at which it is seen what the way changes in which an axis moves."""


@dataclass(frozen=True, slots=True)
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
        ahead, back = (Grid((self.axis,), (self.nodes,), (self.axis,), way * self.half[:, None]) for way in (1, -1))
        return Term((ahead,), (self.axis, 1)), Term((back,), (self.axis, -1))


def reversals(machine: Machine, space: Array, tool_length: float, target: float, most: int) -> tuple[Reversal, ...]:
    """The play of every linear axis that has some, with at most so many nodes."""
    found = []
    for axis in linear_axes(machine):
        low, high = space[axis].tolist()
        fine = np.linspace(low, high, FINE)
        curve = _half(machine, space, tool_length, axis, fine)
        if np.abs(curve).max() > SLIGHT:
            nodes = np.linspace(low, high, nodes_needed(fine, curve, most, SHARE * target))
            found.append(Reversal(machine.axis_names[axis], nodes, np.interp(nodes, fine, curve)))
    return tuple(found)


def _half(machine: Machine, space: Array, tool_length: float, axis: int, fine: Array) -> Array:
    """Half of what the own correction of an axis changes by with its way, at positions of it, (n,) mm."""
    q = np.repeat(even_poses(space, REST)[None], len(fine), axis=0)
    q[:, :, axis] = fine[:, None]
    ways = np.eye(len(space))[axis]
    flat = q.reshape(-1, len(space))
    ahead, back = (exact_correction(machine, flat, State(tool_length, way))[:, axis] for way in (ways, -ways))
    half: Array = (ahead - back).reshape(len(fine), REST).mean(axis=1) / 2
    return half


def reversal_note(machine: Machine, space: Array, tool_length: float, done: Compensation = NOTHING) -> Iterator[str]:
    """What to say of play that is left; `done`: tables that take some off."""
    q, ways = random_poses(space, WAYS, seed=21), random_ways(len(space), WAYS, seed=22)
    neither = np.zeros_like(ways)
    either, mean = (exact_correction(machine, q, State(tool_length, way)) for way in (ways, neither))
    taken = done.at(machine.axis_names, q, ways) - done.at(machine.axis_names, q, neither)
    left = float(np.linalg.norm((either - mean - taken)[:, linear_axes(machine)], axis=1).max())
    if left > SLIGHT:
        yield f"What the way changes in which an axis moves (play) is left: up to {1e3 * left:.2f} um."
