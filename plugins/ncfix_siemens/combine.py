"""Between the neutral sums and products and the control's tables: signs, units, and what a product adds.

Only one factor of a pair carries sign and unit: the table that points, the base. The multiplier is a plain number.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.grid import Array, Grid
from ncfix.tables.table_files import unit_of
from ncfix_siemens.table import BOTH, DIGITS, PLACES, Table

TERMS = ("only", "plus_multiplier", "plus_base", "plus_both")
"""What a product adds: itself, and its multiplier, or its base, or both of them by themselves as well."""


@dataclass(frozen=True, slots=True)
class Reading:
    """How the control takes tables.

    axes   letter -> machine axis
    sign   what a value of 1 does: 1 a correction, -1 an error
    terms  one of `TERMS`; "" if there are no products
    """

    axes: Mapping[str, str]
    sign: int
    terms: str

    def unit(self, letter: str) -> float:
        """mm or rad per unit of the file."""
        return unit_of(letter)


def tables_of(terms: Iterable[Term], reading: Reading) -> list[Table]:
    """The control's tables: multipliers go before the tables that point at them."""
    tables: list[Table] = []
    multipliers: dict[int, tuple[int, float]] = {}
    terms = list(terms)
    for term in terms:
        base, *others = term.factors
        multiply, size = 0, 1.0
        if others:
            centre = others[0]
            if id(centre) not in multipliers:
                size = _shared(centre, terms, reading)
                multipliers[id(centre)] = len(tables) + 1, size
                tables.append(_table(len(tables), centre, size, term.outputs[0], reading))
            multiply, size = multipliers[id(centre)]
        direction = BOTH if term.way is None else term.way[1]
        factor = reading.sign / size / reading.unit(term.outputs[0])
        table = _table(len(tables), base, factor, term.outputs[0], reading)
        tables.append(replace(table, direction=direction, multiply=multiply))
    return _balanced(tables, reading.terms)


def _shared(centre: Grid, terms: Sequence[Term], reading: Reading) -> float:
    """How large the multiplier is made: as large as its largest base, so that neither does harm by itself."""
    own = float(np.abs(centre.values).max()) or 1.0
    bases = [term.factors[0] for term in terms if any(factor is centre for factor in term.factors[1:])]
    largest = max(float(np.abs(base.values).max()) / reading.unit(base.outputs[0]) for base in bases) * own
    wanted = np.sqrt(largest) if largest > 0 else 1.0
    return float(f"{min(wanted, 1.0):.2g}") / own


def _table(index: int, grid: Grid, factor: float, output: str, reading: Reading) -> Table:
    (letter,) = grid.inputs
    nodes = grid.nodes[0] / reading.unit(letter)
    step = round(float(nodes[-1] - nodes[0]) / (len(nodes) - 1), PLACES)
    values: Array = np.round(grid.values[:, 0] * factor, DIGITS) + 0.0
    modulo = bool(grid.modulo and grid.modulo[0])
    low = round(float(nodes[0]), PLACES)
    return Table(index, reading.axes[letter], reading.axes[output], low, step, values, modulo=modulo)


def _balanced(tables: list[Table], terms: str) -> list[Table]:
    """With tables that take off again what the control adds besides the products."""
    pointed = {table.multiply - 1 for table in tables if table.multiply}
    extra = [
        table
        for table in tables
        if (table.index in pointed and terms in ("plus_multiplier", "plus_both"))
        or (table.multiply and terms in ("plus_base", "plus_both"))
    ]
    for table in extra:
        tables.append(replace(table, index=len(tables), values=-table.values + 0.0, multiply=0))
    return tables


def compensation(tables: Sequence[Table], reading: Reading) -> Compensation:
    """What the control does with its tables."""
    letters = {axis: letter for letter, axis in reading.axes.items()}
    pointed = {table.multiply for table in tables if table.multiply}
    multipliers = {table.index + 1: _grid(table, letters, reading, plain=True) for table in tables}
    terms = []
    for table in tables:
        grid = _grid(table, letters, reading)
        way = None if table.direction == BOTH else (letters[table.input], table.direction)
        if table.multiply:
            terms.append(Term((grid, multipliers[table.multiply]), way))
        if _added(table, pointed, reading.terms):
            terms.append(Term((grid,), way))
    return Compensation(tuple(terms))


def _added(table: Table, pointed: set[int], terms: str) -> bool:
    if table.multiply:
        return terms in ("plus_base", "plus_both")
    return table.index + 1 not in pointed or terms in ("plus_multiplier", "plus_both")


def _grid(table: Table, letters: Mapping[str, str], reading: Reading, plain: bool = False) -> Grid:
    own, output = letters[table.input], letters[table.output]
    return table.grid(own, output, 1.0 if plain else reading.sign * reading.unit(output), reading.unit(own))
