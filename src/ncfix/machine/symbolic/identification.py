"""Identification: the errors that only act together, and a measurement protocol that isolates errors one by one.

The coefficients of the errors are polynomials in functions of the varied quantities (axis positions, perhaps tool
length). Errors can be separated if, and only if, their coefficients are linearly independent polynomials. This is
exact: no grid of poses is chosen. Dependence is found numerically, with the fixed quantities at a generic point, and
solved symbolically. Freeman and Ford (2003) do not examine it: their Tests 6 to 8 ask for two parameters where the
formulas have only one.

The protocol is that of their section 5, Table 4: sums and differences of readings at indexed poses. A reading is the
position of the tool tip, nominal part included.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from functools import cache, cached_property
from itertools import combinations, product

import numpy as np
import sympy as sp

from ncfix.arrays import Array, Mask
from ncfix.machine.symbolic.algebra import Algebra, Poly
from ncfix.machine.symbolic.derivation import POSITION, Derivation
from ncfix.values import frozen

NEGLIGIBLE = 1e-9
"""Relative size below which a residual is rounding; entries are of order 1 with errors of about 1e-15."""


class PolynomialColumns:
    """A matrix of polynomials with a column for each unknown: {row: polynomial}; entries that are absent are zero."""

    def __init__(self, algebra: Algebra, columns: Sequence[Mapping[Hashable, Poly]]) -> None:
        """The rows are all those that occur in any column."""
        self._algebra = algebra
        self._columns = columns
        self._rows = list(dict.fromkeys(row for column in columns for row in column))
        value = _at_generic_point(algebra)
        values = [[value(column.get(row)) for column in columns] for row in self._rows]
        self.numbers: Array = np.array(values, dtype=np.float64).reshape(len(self._rows), len(columns))
        self.pivots = independent_columns(self.numbers)

    @property
    def invisible(self) -> list[int]:
        """Indices of the columns that are zero."""
        return [index for index, column in enumerate(self.numbers.T) if not column.any()]

    @property
    def independent_rows(self) -> list[Hashable]:
        """The rows that do not depend on rows before them; as many as the rank."""
        return [self._rows[index] for index in independent_columns(self.numbers.T)]

    def combinations(self, unknowns: Sequence[sp.Expr]) -> dict[int, sp.Expr]:
        """Pivot -> its unknown plus the multiples of unknowns of dependent columns that act in the same way."""
        found = {pivot: unknowns[pivot] for pivot in self.pivots}
        for index in set(range(len(unknowns))) - set(self.pivots):
            for pivot, factor in self._factors(index).items():
                found[pivot] += factor * unknowns[index]
        return found

    def _factors(self, index: int) -> dict[int, sp.Expr]:
        """Pivot -> its factor in the combination of pivot columns that equals column `index`, by Cramer's rule."""
        algebra = self._algebra
        factors = np.linalg.lstsq(self.numbers[:, self.pivots], self.numbers[:, index], rcond=None)[0]
        used = [pivot for pivot, factor in zip(self.pivots, factors, strict=True) if abs(factor) > NEGLIGIBLE]
        rows = independent_columns(self.numbers[:, used].T)
        square = [[self._entry(row, pivot) for pivot in used] for row in rows]
        whole, found = _determinant(algebra, square), {}
        for k, pivot in enumerate(used):
            replaced = [[*row[:k], self._entry(r, index), *row[k + 1 :]] for r, row in zip(rows, square, strict=True)]
            above, below = _determinant(algebra, replaced).cancel(whole)
            found[pivot] = algebra.expression(above) / algebra.expression(below)
        return found

    def _entry(self, row: int, column: int) -> Poly:
        return self._columns[column].get(self._rows[row], self._algebra.ring.zero)


def _determinant(algebra: Algebra, square: list[list[Poly]]) -> Poly:
    """The determinant, by minors of the last rows, each computed once."""

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


def _at_generic_point(algebra: Algebra) -> Callable[[Poly | None], float]:
    """A function that evaluates polynomials (None is zero) with all symbols at fixed random numbers."""
    symbols = sorted(set().union(*(g.free_symbols for g in algebra.ring.symbols)), key=sp.default_sort_key)
    numbers = np.random.default_rng(2003).uniform(0.4, 1.4, len(symbols))
    point = {symbol: sp.Float(number) for symbol, number in zip(symbols, numbers, strict=True)}
    values = np.array([float(g.subs(point)) for g in algebra.ring.symbols])

    def value(poly: Poly | None) -> float:
        terms = poly.items() if poly else ()
        return float(sum(float(factor) * np.prod(values ** np.array(powers)) for powers, factor in terms))

    return value


def independent_columns(matrix: Array) -> list[int]:
    """Indices of the columns that are not combinations of those to their left."""
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


TIP = ("dx", "dy", "dz")


@frozen
class Identifiable:
    """What measurements at all poses can identify.

    unknowns      names of the errors examined
    combinations  as many as the rank: each an error, or a weighted sum of errors that act as one
    invisible     names of the errors that have no effect at any pose
    """

    unknowns: tuple[str, ...]
    combinations: tuple[sp.Expr, ...]
    invisible: tuple[str, ...]

    @property
    def rank(self) -> int:
        """The number of independent parameters."""
        return len(self.combinations)

    @property
    def inseparable(self) -> tuple[sp.Expr, ...]:
        """The combinations of more than one error."""
        return tuple(combination for combination in self.combinations if combination.is_Add)

    def to_text(self) -> str:
        """The result as text."""
        lines = [f"rank {self.rank} of {len(self.unknowns)}"]
        lines += [f"only in combination: {combination}" for combination in self.inseparable]
        lines += [f"visible at no pose: {' '.join(self.invisible)}"] if self.invisible else []
        return "\n".join(lines) + "\n"


def identifiable(
    derivation: Derivation, varied: Sequence[str] | None = None, components: Sequence[str] = TIP, absolute: bool = True
) -> Identifiable:
    """What can be identified while `varied` is varied; errors that depend on positions are left out.

    varied      names of axes, and of dimensions that are also varied (a second tool length); None: all axes
    components  the measured components, of dx dy dz, rx ry rz
    absolute    False: the origin of the measurement is unknown, so only changes are measured
    """
    names = set(varied) if varied is not None else {axis.name for axis in derivation.chain.axes}
    wanted = {i: variable for i, variable in enumerate(derivation.chain.smalls) if not variable.arguments}
    found = [{c: derivation.terms[c].get((i,), sp.Integer(0)) for c in components} for i in wanted]
    algebra = Algebra(sp.expand(value) for column in found for value in column.values())
    moving = np.array([any(str(symbol) in names for symbol in g.free_symbols) for g in algebra.ring.symbols])
    columns = PolynomialColumns(algebra, [_split(algebra, column, moving, absolute) for column in found])
    unknowns = list(wanted.values())
    combinations = columns.combinations([variable.symbol for variable in unknowns])
    invisible = tuple(unknowns[i].name for i in columns.invisible)
    return Identifiable(tuple(v.name for v in unknowns), tuple(combinations.values()), invisible)


def _split(algebra: Algebra, column: Mapping[str, sp.Expr], moving: Mask, absolute: bool) -> dict[Hashable, Poly]:
    """(component, monomial of the varied quantities) -> polynomial in the fixed ones; `moving`: varied generators."""
    found: dict[Hashable, Poly] = {}
    for component, expression in column.items():
        poly = algebra.poly(expression)
        for powers, coefficient in poly.items():
            varied = tuple(np.where(moving, powers, 0).tolist())
            if absolute or any(varied):
                term = poly.new({tuple(np.where(moving, 0, powers).tolist()): coefficient})
                key = (component, varied)
                found[key] = found[key] + term if key in found else term
    return found


RIGHT_ANGLES = (0, 90, 180, 270)
Pose = tuple[int, ...]
"""Degrees, one per rotary axis."""


@frozen(eq=False, slots=False)
class Equation:
    """A difference or sum of one coordinate at two poses, as a linear equation in the unknown errors.

    sign          -1: first minus second; 1: first plus second
    coefficients  unknown -> its coefficient, for all that occur
    constant      the value for a machine without errors
    """

    algebra: Algebra
    coordinate: str
    first: Pose
    second: Pose
    sign: int
    coefficients: Mapping[sp.Expr, Poly]
    constant: Poly

    @property
    def unknowns(self) -> frozenset[sp.Expr]:
        """The unknown errors in the equation."""
        return frozenset(self.coefficients)

    @cached_property
    def expression(self) -> sp.Expr:
        """The right-hand side: what the measurement equals."""
        parts = [self.algebra.expression(poly) * symbol for symbol, poly in self.coefficients.items()]
        return sp.Add(*parts, self.algebra.expression(self.constant))

    @property
    def measurement(self) -> str:
        """The left-hand side: the readings, with their poses in degrees, like `X(90, 0) - X(270, 180)`."""
        first, second = (f"{self.coordinate.upper()}({', '.join(map(str, p))})" for p in (self.first, self.second))
        return f"{first} {'-' if self.sign < 0 else '+'} {second}"

    @property
    def terms(self) -> int:
        """The number of terms on the right-hand side."""
        return sum(len(poly) for poly in self.coefficients.values()) + len(self.constant)


def equations(
    derivation: Derivation,
    angles: Sequence[int] = RIGHT_ANGLES,
    zero: Iterable[str] = (),
    signs: Sequence[int] = (-1, 1),
) -> tuple[Equation, ...]:
    """All differences (sign -1) and sums (1) of every coordinate over every pair of poses.

    angles  positions of each rotary axis, degrees
    zero    names of errors that are assumed to be zero

    An error that depends on a rotary axis is a separate unknown at each position of the axis.
    """
    axes = [variable.symbol for variable in derivation.chain.axes if variable.rotary]
    poses = list(product(angles, repeat=len(axes)))
    readings = [_reading(derivation, dict(zip(axes, pose, strict=True)), set(zero)) for pose in poses]
    algebra = Algebra(sp.expand(e) for reading in readings for linear in reading for e in linear.values())
    polys = [[{key: algebra.poly(e) for key, e in linear.items()} for linear in reading] for reading in readings]
    found, none = [], algebra.ring.zero
    for sign, (first, second), k in product(signs, combinations(range(len(poses)), 2), range(len(POSITION))):
        a, b = polys[first][k], polys[second][k]
        total = {key: poly for key in {**a, **b} if (poly := a.get(key, none) + sign * b.get(key, none))}
        constant = total.pop(sp.S.One, none)
        found.append(Equation(algebra, POSITION[k], poses[first], poses[second], sign, total, constant))
    return tuple(found)


def _reading(derivation: Derivation, pose: Mapping[sp.Expr, int], zero: set[str]) -> list[dict[sp.Expr, sp.Expr]]:
    """For each coordinate, error -> its coefficient; under the key 1, the nominal value."""
    values = {axis: sp.pi * sp.Rational(degrees, 180) for axis, degrees in pose.items()}
    wanted = {i for i, variable in enumerate(derivation.chain.smalls) if variable.name not in zero}
    found = []
    for coordinate in POSITION:
        linear = {sp.S.One: derivation.nominal[coordinate].subs(values)}
        for key, coefficient in derivation.terms[f"d{coordinate}"].items():
            if len(key) == 1 and key[0] in wanted:
                linear[derivation.monomial(key).subs(values)] = coefficient.subs(values)
        found.append(linear)
    return found


Choose = Callable[[Sequence[Equation]], Equation]


def shortest(candidates: Sequence[Equation]) -> Equation:
    """The equation with the fewest terms; the first if several have equally few."""
    return min(candidates, key=lambda equation: equation.terms)


@frozen
class Identification:
    """A step of the protocol: it finds an error by measurements, and by the errors found before.

    identifies  the error; or a combination of errors that only act together
    equations   one equation, or several that are solved together
    """

    identifies: sp.Expr
    equations: tuple[Equation, ...]


def simplest(
    system: Iterable[Equation], wanted: sp.Expr | None = None, known: Iterable[sp.Expr] = ()
) -> list[Equation]:
    """The equations with the fewest unknowns that are not known yet; if `wanted` is given, only among those with it."""
    done = frozenset(known)
    open_ones = [(equation.unknowns - done, equation) for equation in system]
    useful = [(rest, equation) for rest, equation in open_ones if rest and (wanted is None or wanted in rest)]
    fewest = min((len(rest) for rest, _ in useful), default=0)
    return [equation for rest, equation in useful if len(rest) == fewest]


def protocol(system: Sequence[Equation], choose: Choose = shortest) -> tuple[Identification, ...]:
    """The steps that identify one error after the other, each from the simplest equation that is left.

    Errors that occur in the equations only together are identified as one combination. If no equation has a single
    unknown, several are solved together.
    """
    unknowns = sorted(frozenset[sp.Expr]().union(*(equation.unknowns for equation in system)), key=sp.default_sort_key)
    if not unknowns:
        return ()
    columns = _columns(system, unknowns)
    titles = {unknowns[pivot]: combination for pivot, combination in columns.combinations(unknowns).items()}
    known = set(unknowns) - titles.keys()
    tests: list[Identification] = []
    while candidates := simplest(system, known=known):
        solved, used = _solvable(system, choose(candidates), known)
        tests += [Identification(titles[unknown], used) for unknown in solved]
        known |= set(solved)
    return tuple(tests)


def _columns(system: Sequence[Equation], unknowns: Sequence[sp.Expr]) -> PolynomialColumns:
    """The coefficients, with a column for each unknown and a row for each equation."""
    columns: list[dict[Hashable, Poly]] = [{} for _ in unknowns]
    for equation in system:
        for column, unknown in zip(columns, unknowns, strict=True):
            if unknown in equation.coefficients:
                column[equation] = equation.coefficients[unknown]
    return PolynomialColumns(system[0].algebra, columns)


def _solvable(
    system: Sequence[Equation], first: Equation, known: set[sp.Expr]
) -> tuple[list[sp.Expr], tuple[Equation, ...]]:
    """A small set of unknowns, with those of the first equation, and as many independent equations, which find them."""
    unknowns = sorted(first.unknowns - known, key=sp.default_sort_key)
    if len(unknowns) == 1:
        return unknowns, (first,)
    useful = sorted((equation for equation in system if equation.unknowns - known), key=lambda equation: equation.terms)
    while True:
        fitting = [first, *(e for e in useful if e is not first and e.unknowns - known <= set(unknowns))]
        rows = _columns(fitting, unknowns).independent_rows
        if len(rows) == len(unknowns):
            return unknowns, tuple(row for row in rows if isinstance(row, Equation))
        more = min((e.unknowns - known - set(unknowns) for e in useful if e not in fitting), key=len)
        unknowns = sorted({*unknowns, *more}, key=sp.default_sort_key)


def report(tests: Iterable[Identification]) -> str:
    """The protocol as text: for each step what it identifies, and its equations."""
    lines = []
    for number, test in enumerate(tests, 1):
        lines.append(f"{number:3}. {test.identifies}")
        lines += [f"       {equation.measurement} = {equation.expression}" for equation in test.equations]
    return "\n".join(lines) + "\n"


def measuring(derivation: Derivation, vary: Iterable[str] = ()) -> str:
    """The rank and inseparable combinations, also with the lengths `vary` varied, then a protocol of differences."""
    chain = derivation.chain
    axes = [axis.name for axis in chain.axes]
    parts = [
        f"{chain.name}: what measured positions of the tool tip determine\n",
        f"\nwith {', '.join(axes)} varied: {identifiable(derivation).to_text()}",
    ]
    for name in vary:
        if any(dimension.name == name for dimension in chain.dimensions):
            parts.append(f"\nwith {name} varied, too: {identifiable(derivation, [*axes, name]).to_text()}")
    if rotary := [axis.name for axis in chain.axes if axis.rotary]:
        parts.append(f"\nDifferences of readings at ({', '.join(rotary)}), degrees, with all other axes at rest\n")
        parts.append(report(protocol(equations(derivation, signs=(-1,)))))
    return "".join(parts)
