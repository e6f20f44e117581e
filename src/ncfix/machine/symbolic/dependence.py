"""Which columns of a matrix of polynomials depend on which: found in numbers at a generic point, solved in symbols."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from functools import cache

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ncfix.machine.symbolic.algebra import Algebra, Poly

Array = NDArray[np.float64]
NEGLIGIBLE = 1e-9
"""Relative size below which a residual is rounding: entries are of order one and exact to 1e-15."""


class Columns:
    """Columns of polynomials, one per unknown; a column is {row: polynomial}, what it has not is zero."""

    def __init__(self, algebra: Algebra, columns: Sequence[Mapping[Hashable, Poly]]) -> None:
        """All rows that occur are taken."""
        self._algebra = algebra
        self._columns = columns
        self._rows = list(dict.fromkeys(row for column in columns for row in column))
        point = _GenericPoint(algebra)
        values = [[point.value(column.get(row)) for column in columns] for row in self._rows]
        self.numbers: Array = np.array(values, dtype=np.float64).reshape(len(self._rows), len(columns))
        self.pivots = independent_columns(self.numbers)

    @property
    def invisible(self) -> list[int]:
        """The columns that are zero."""
        return [index for index, column in enumerate(self.numbers.T) if not column.any()]

    @property
    def independent_rows(self) -> list[Hashable]:
        """As many rows as the rank, from the first on."""
        return [self._rows[index] for index in independent_columns(self.numbers.T)]

    def combinations(self, unknowns: Sequence[sp.Expr]) -> dict[int, sp.Expr]:
        """By pivot: the unknown itself plus what the dependent columns' unknowns add to it."""
        found = {pivot: unknowns[pivot] for pivot in self.pivots}
        for index in set(range(len(unknowns))) - set(self.pivots):
            for pivot, factor in self._factors(index).items():
                found[pivot] += factor * unknowns[index]
        return found

    def _factors(self, index: int) -> dict[int, sp.Expr]:
        """The column as a combination of pivot columns."""
        factors = np.linalg.lstsq(self.numbers[:, self.pivots], self.numbers[:, index], rcond=None)[0]
        used = [pivot for pivot, factor in zip(self.pivots, factors, strict=True) if abs(factor) > NEGLIGIBLE]
        rows = independent_columns(self.numbers[:, used].T)
        square = [[self._entry(row, pivot) for pivot in used] for row in rows]
        right = [self._entry(row, index) for row in rows]
        whole = _determinant(self._algebra, square)
        return {pivot: self._ratio(_replaced(square, k, right), whole) for k, pivot in enumerate(used)}

    def _ratio(self, square: list[list[Poly]], whole: Poly) -> sp.Expr:
        """Cramer's rule."""
        above, below = _determinant(self._algebra, square).cancel(whole)
        return self._algebra.expression(above) / self._algebra.expression(below)

    def _entry(self, row: int, column: int) -> Poly:
        return self._columns[column].get(self._rows[row], self._algebra.ring.zero)


def _replaced(square: list[list[Poly]], column: int, right: list[Poly]) -> list[list[Poly]]:
    return [[*row[:column], side, *row[column + 1 :]] for row, side in zip(square, right, strict=True)]


def _determinant(algebra: Algebra, square: list[list[Poly]]) -> Poly:
    """By minors of the last rows, each worked out once."""

    @cache
    def minor(columns: tuple[int, ...]) -> Poly:
        if not columns:
            return algebra.ring.one
        row = square[len(square) - len(columns)]
        total = algebra.ring.zero
        for k, column in enumerate(columns):
            if row[column]:
                total += (-1) ** k * row[column] * minor((*columns[:k], *columns[k + 1 :]))
        return algebra.reduced(total)

    return minor(tuple(range(len(square))))


class _GenericPoint:
    """Numbers for the ring's generators as no coincidence would give them."""

    def __init__(self, algebra: Algebra) -> None:
        symbols = sorted(set().union(*(g.free_symbols for g in algebra.ring.symbols)), key=sp.default_sort_key)
        numbers = np.random.default_rng(2003).uniform(0.4, 1.4, len(symbols))
        point = {symbol: sp.Float(number) for symbol, number in zip(symbols, numbers, strict=True)}
        self._values = np.array([float(g.subs(point)) for g in algebra.ring.symbols])

    def value(self, poly: Poly | None) -> float:
        terms = poly.items() if poly else ()
        return float(sum(float(factor) * np.prod(self._values ** np.array(powers)) for powers, factor in terms))


def independent_columns(matrix: Array) -> list[int]:
    """The columns, from the left, that are not combinations of those before them."""
    found: list[int] = []
    basis = np.zeros((matrix.shape[0], 0))
    for index, column in enumerate(matrix.T):
        rest = column
        for _ in range(2):
            rest = rest - basis @ (basis.T @ rest)
        if np.linalg.norm(rest) > NEGLIGIBLE * np.linalg.norm(column):
            basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
            found.append(index)
    return found
