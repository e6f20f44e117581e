"""A measurement protocol: sums and differences of readings at indexed poses that isolate parameters one by one.

The reading is the position of the tool tip, nominal part included. Freeman and Ford (2003), section 5, Table 4; what
they leave to the user's eye, whether two parameters can be told apart at all, is decided by the rank.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product

import sympy as sp

from ncfix.machine.symbolic.algebra import Algebra, Poly
from ncfix.machine.symbolic.dependence import Columns
from ncfix.machine.symbolic.derivation import POSITION, Derivation

RIGHT_ANGLES = (0, 90, 180, 270)
Pose = tuple[int, ...]
"""Degrees, one per rotary axis."""


@dataclass(frozen=True, eq=False)
class Equation:
    """A difference or sum of one coordinate at two poses, as a linear equation in the unknown errors.

    sign          -1: first minus second; 1: first plus second
    coefficients  per unknown that occurs
    constant      what the nominal machine gives
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
        """The errors that occur."""
        return frozenset(self.coefficients)

    @cached_property
    def expression(self) -> sp.Expr:
        """The right-hand side."""
        parts = [self.algebra.expression(poly) * symbol for symbol, poly in self.coefficients.items()]
        return sp.Add(*parts, self.algebra.expression(self.constant))

    @property
    def measurement(self) -> str:
        """What is measured, in degrees: `X(90, 0) - X(270, 180)`."""
        letter, operator = self.coordinate.upper(), "-" if self.sign < 0 else "+"
        return f"{letter}{_pose(self.first)} {operator} {letter}{_pose(self.second)}"

    @property
    def terms(self) -> int:
        """How long it is."""
        return sum(len(poly) for poly in self.coefficients.values()) + len(self.constant)


def _pose(pose: Pose) -> str:
    return f"({', '.join(map(str, pose))})"


def equations(
    derivation: Derivation,
    angles: Sequence[int] = RIGHT_ANGLES,
    zero: Iterable[str] = (),
    signs: Sequence[int] = (-1, 1),
) -> tuple[Equation, ...]:
    """All differences (sign -1) and sums (1) of every coordinate over every pair of poses.

    angles  degrees that each rotary axis takes
    zero    names of errors assumed to be zero
    An error that depends on a rotary axis is another unknown at each of its positions.
    """
    axes = [variable.symbol for variable in derivation.chain.axes if variable.rotary]
    poses = list(product(angles, repeat=len(axes)))
    readings = [_reading(derivation, dict(zip(axes, pose, strict=True)), set(zero)) for pose in poses]
    algebra = Algebra(sp.expand(e) for reading in readings for linear in reading for e in linear.values())
    polys = [[{key: algebra.poly(e) for key, e in linear.items()} for linear in reading] for reading in readings]
    found = []
    for sign, (first, second), k in product(signs, combinations(range(len(poses)), 2), range(len(POSITION))):
        total = _combined(algebra, polys[first][k], polys[second][k], sign)
        constant = total.pop(sp.S.One, algebra.ring.zero)
        found.append(Equation(algebra, POSITION[k], poses[first], poses[second], sign, total, constant))
    return tuple(found)


def _reading(derivation: Derivation, pose: Mapping[sp.Expr, int], zero: set[str]) -> list[dict[sp.Expr, sp.Expr]]:
    """Per coordinate: the nominal value under 1, and the coefficient of each error."""
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


def _combined(
    algebra: Algebra, first: Mapping[sp.Expr, Poly], second: Mapping[sp.Expr, Poly], sign: int
) -> dict[sp.Expr, Poly]:
    zero = algebra.ring.zero
    total = {key: first.get(key, zero) + sign * second.get(key, zero) for key in {**first, **second}}
    return {key: poly for key, poly in total.items() if poly}


Choose = Callable[[Sequence[Equation]], Equation]


def shortest(candidates: Sequence[Equation]) -> Equation:
    """Of equations with equally many unknowns the one with the fewest terms; the first of those."""
    return min(candidates, key=lambda equation: equation.terms)


@dataclass(frozen=True, slots=True)
class Identification:
    """A step of the protocol: measure, and find an error from those found before.

    identifies  the error; or the errors that only show up together, as one expression
    equations   one, or several that are solved together
    """

    identifies: sp.Expr
    equations: tuple[Equation, ...]


def simplest(
    system: Iterable[Equation], wanted: sp.Expr | None = None, known: Iterable[sp.Expr] = ()
) -> list[Equation]:
    """The equations with the fewest unknowns that are not known yet; `wanted`: those that have this one."""
    done = frozenset(known)
    open_ones = [(equation.unknowns - done, equation) for equation in system]
    useful = [(rest, equation) for rest, equation in open_ones if rest and (wanted is None or wanted in rest)]
    fewest = min((len(rest) for rest, _ in useful), default=0)
    return [equation for rest, equation in useful if len(rest) == fewest]


def protocol(system: Sequence[Equation], choose: Choose = shortest) -> tuple[Identification, ...]:
    """Identify one error after the other, each from the simplest equation that is left.

    Errors that all these equations only have together are identified as one combination. Where no equation has a
    single unknown, several are solved together.
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


def _columns(system: Sequence[Equation], unknowns: Sequence[sp.Expr]) -> Columns:
    """A column per unknown, a row per equation."""
    columns: list[dict[Hashable, Poly]] = [{} for _ in unknowns]
    for equation in system:
        for column, unknown in zip(columns, unknowns, strict=True):
            if unknown in equation.coefficients:
                column[equation] = equation.coefficients[unknown]
    return Columns(system[0].algebra, columns)


def _solvable(
    system: Sequence[Equation], first: Equation, known: set[sp.Expr]
) -> tuple[list[sp.Expr], tuple[Equation, ...]]:
    """The fewest unknowns, with those of the first equation, for which there are as many independent equations."""
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
    """The protocol as text: what each test identifies, and its equations."""
    lines = []
    for number, test in enumerate(tests, 1):
        lines.append(f"{number:3}. {test.identifies}")
        lines += [f"       {equation.measurement} = {equation.expression}" for equation in test.equations]
    return "\n".join(lines) + "\n"
