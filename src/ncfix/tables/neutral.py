"""What a set of tables does, whatever control it is for: sums of tables and of products of tables.

Everything here is a correction: what is ADDED to the command of an axis, mm or rad. Signs, units and digits of a
control's own files are the business of its plugin, which turns them into this and back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from ncfix.tables.grid import Array, Grid


@dataclass(frozen=True, slots=True)
class Term:
    """One summand: a table, or the product of tables with the same outputs.

    factors  the tables; a product takes the unit of the first, the others are plain numbers
    way      (axis, 1 or -1): it acts only while that axis moves this way; with the way unknown it counts half
    """

    factors: tuple[Grid, ...]
    way: tuple[str, int] | None = None

    @property
    def outputs(self) -> tuple[str, ...]:
        """The axes that it corrects."""
        return self.factors[0].outputs

    def at(self, names: Sequence[str], q: Array, direction: Array) -> Array:
        """Its contribution to its outputs, (n, n_outputs)."""
        value = self._weight(names, direction)
        for grid in self.factors:
            value = value * grid.at(q[:, [names.index(name) for name in grid.inputs]])
        return value

    def _weight(self, names: Sequence[str], direction: Array) -> Array:
        if self.way is None:
            return np.ones((len(direction), 1))
        axis, sense = self.way
        weight: Array = (1 + sense * direction[:, [names.index(axis)]]) / 2
        return weight


@runtime_checkable
class Tables(Protocol):
    """What a control does with its files: a sum of tables (`Compensation`), or whatever else it works out of them."""

    def at(self, names: Sequence[str], q: Array, direction: Array | None = None) -> Array:
        """Corrections of all axes `names` at commands q (n, n_axes) [mm, rad], to be added to them, (n, n_axes)."""

    def for_tool(self, length: float) -> Tables:
        """What it does with a tool of this length, mm, if the control takes that into account."""

    @property
    def grids(self) -> tuple[Grid, ...]:
        """Every table in it."""

    @property
    def axes(self) -> frozenset[str]:
        """Every axis that it looks up or corrects."""

    @property
    def points(self) -> int:
        """The nodes of all its tables."""


@dataclass(frozen=True, slots=True)
class Compensation:
    """All tables of a machine: their sum is the correction."""

    terms: tuple[Term, ...]

    def at(self, names: Sequence[str], q: Array, direction: Array | None = None) -> Array:
        """Corrections of all axes `names` at commands q (n, n_axes) [mm, rad], to be added to them, (n, n_axes).

        direction: -1, 0 (unknown) or 1 per axis, (n, n_axes).
        """
        way = np.zeros(q.shape) if direction is None else direction
        total = np.zeros(q.shape)
        for term in self.terms:
            columns = [names.index(name) for name in term.outputs]
            total[:, columns] += term.at(names, q, way)
        return total

    def for_tool(self, length: float) -> Compensation:
        """The same: tables know nothing of tools."""
        return self

    @property
    def grids(self) -> tuple[Grid, ...]:
        """Every table in it, once: several may be multiplied by the same."""
        return tuple({id(grid): grid for term in self.terms for grid in term.factors}.values())

    @property
    def axes(self) -> frozenset[str]:
        """Every axis that it looks up or corrects."""
        return frozenset(name for grid in self.grids for name in (*grid.inputs, *grid.outputs))

    @property
    def points(self) -> int:
        """The nodes of all its tables."""
        return sum(grid.points for grid in self.grids)


NOTHING = Compensation(())
"""No tables at all."""
