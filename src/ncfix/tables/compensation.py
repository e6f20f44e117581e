"""Compensation tables independent of the control: sums of tables and of products of tables.

All values are corrections, ADDED to the command of an axis, mm or rad. Plugins convert these to the signs, units and
digits of a control's own files, and back.

`class_of` gives the class (ISO/TR 16907) of tables that were written, by the axes that each looks up and corrects. It
is not what the control could hold: a single table of X over itself is L-POS.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from ncfix.arrays import Array
from ncfix.tables.grid import Grid
from ncfix.values import frozen

LINEAR = ("X", "Y", "Z")


@frozen
class Term:
    """One summand: a table, or the product of tables with the same outputs.

    factors  the tables; a product has the unit of the first, the others have no unit
    way      (axis, 1 or -1): active only while that axis moves in this direction; if the direction is unknown, half
    """

    factors: tuple[Grid, ...]
    way: tuple[str, int] | None = None

    @property
    def outputs(self) -> tuple[str, ...]:
        """The axes that it corrects."""
        return self.factors[0].outputs

    def at(self, names: Sequence[str], q: Array, direction: Array) -> Array:
        """Contribution to the outputs, (n, n_outputs), at commands q (n, n_axes) of axes `names`."""
        value = np.ones((len(direction), 1))
        if self.way is not None:
            axis, sense = self.way
            value = (1 + sense * direction[:, [names.index(axis)]]) / 2
        for grid in self.factors:
            value = value * grid.at(q[:, [names.index(name) for name in grid.inputs]])
        return value


def own_terms(axis: str, nodes: Array, ahead: Array, back: Array) -> tuple[Term, Term]:
    """Tables of an axis over itself, for motion towards plus (`ahead`) and minus (`back`), (n,) each."""
    both = (Grid((axis,), (nodes,), (axis,), values[:, None]) for values in (ahead, back))
    first, second = (Term((grid,), (axis, way)) for grid, way in zip(both, (1, -1), strict=True))
    return first, second


@runtime_checkable
class Tables(Protocol):
    """The correction that a control computes from its files: a sum of tables (`Compensation`), or another form."""

    def at(self, names: Sequence[str], q: Array, direction: Array | None = None) -> Array:
        """Corrections of all axes `names` at commands q (n, n_axes) [mm, rad], to be added to them, (n, n_axes)."""

    def for_tool(self, length: float) -> Tables:
        """The tables for a tool of this length, mm, if the control takes it into account."""

    @property
    def grids(self) -> tuple[Grid, ...]:
        """Every table in it."""

    @property
    def axes(self) -> frozenset[str]:
        """Every axis that it looks up or corrects."""

    @property
    def points(self) -> int:
        """Number of nodes of all tables."""


@frozen
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
        """This compensation: plain tables do not depend on the tool."""
        return self

    @property
    def grids(self) -> tuple[Grid, ...]:
        """Every table, once: several products may share a factor."""
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


@frozen
class Lookup:
    """An axis that a table or a product of tables corrects, and the axes that it looks up."""

    output: str
    inputs: frozenset[str]
    product: bool


def class_of(tables: Compensation, rotary: Collection[str]) -> str:
    """The class of sums and products of tables; rotary: the rotary axes of the machine."""
    lines = [line for term in tables.terms for line in _lines(term)]
    linear = [line for line in lines if line.output not in rotary]
    found = list(_linear([line for line in linear if line.inputs.isdisjoint(rotary)], linear))
    if any(not line.inputs.isdisjoint(rotary) for line in linear):
        together = any(len(line.inputs) > 2 and not line.inputs.isdisjoint(rotary) for line in linear)
        found.append("the position part of R-VOL" if together and _reach(linear, rotary) else "part of R-VOL")
    if any(line.output in rotary and line.output in line.inputs for line in lines):
        found.append("R-RAX")
    *head, last = found or ["none"]
    return f"{', '.join(head)} and {last}" if head else last


def _linear(lines: Sequence[Lookup], all_lines: Sequence[Lookup]) -> Iterator[str]:
    """Classes of tables of linear axes over linear axes; `all_lines`: also those over rotary axes."""
    if any(len(line.inputs) > 1 for line in all_lines) and _reach(all_lines, ()):
        yield "L-VOL"
        return
    if any(line.output in line.inputs and not line.product for line in lines):
        yield "L-POS"
    if any(line.inputs - {line.output} and not line.product for line in lines):
        yield from ("L-STR", "L-SQR")
    if any(line.inputs - {line.output} for line in lines):
        yield "part of L-ANG"


def _reach(lines: Sequence[Lookup], rotary: Collection[str]) -> bool:
    """Whether each corrected axis is corrected over X, Y and Z, and over a rotary axis if `rotary` has any."""
    for output in {line.output for line in lines}:
        reached = {name for line in lines if line.output == output for name in line.inputs}
        if not reached >= {*LINEAR} or (rotary and reached.isdisjoint(rotary)):
            return False
    return bool(lines)


def _lines(term: Term) -> Iterator[Lookup]:
    inputs = frozenset(name for factor in term.factors for name in factor.inputs)
    if all(factor.values.any() for factor in term.factors):
        for index, name in enumerate(term.outputs):
            if term.factors[0].values[..., index].any():
                yield Lookup(name, inputs, len(term.factors) > 1)
