"""Coded algebra: polynomials in sines, cosines, square roots and dimensions, kept simple after every product.

All that a chain multiplies is a polynomial in these, with rational coefficients. In the ring, sin^2 + cos^2 = 1 and
sqrt(n)^2 = n are applied at once, so two expressions are equal if, and only if, their polynomials are the same.
Freeman and Ford (2003), section 4.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import Any

import sympy as sp
from sympy.polys.matrices import DomainMatrix
from sympy.polys.orderings import lex
from sympy.polys.rings import PolyRing

SIMPLE = 10**9
"""A fraction with a larger denominator is a measured number, not an exact constant."""
FINENESS = 2**90
"""Measured numbers are computed with to one part in this many."""
ROUNDING = 2**46
"""Factors below one part in this many are the rounding of the measured numbers, doubles of order one."""

Poly = Any
"""An element of the ring."""


class Algebra:
    """The ring in which some expressions live."""

    def __init__(self, expressions: Iterable[sp.Expr]) -> None:
        """The ring that holds sums and products of the expressions."""
        expressions = list(expressions)
        numbers = {number for expression in expressions for number in expression.atoms(sp.Rational)}
        self.measured = any(number.q > SIMPLE for number in numbers)
        found = set().union(*(generators(expression) for expression in expressions))
        angles = {generator.args[0] for generator in found if isinstance(generator, (sp.sin, sp.cos))}
        self.angles = sorted(angles, key=sp.default_sort_key)
        self.roots = sorted((g for g in found if _is_root(g)), key=sp.default_sort_key)
        trig = {f(angle) for angle in self.angles for f in (sp.sin, sp.cos)}
        self.others = sorted(found - trig - set(self.roots), key=sp.default_sort_key)
        self.ring = self._ring(sp.sin, sp.cos)
        self.relations = self._relations(self.ring)

    def _ring(self, first: Any, last: Any) -> PolyRing:
        leading = [first(angle) for angle in self.angles] + self.roots
        symbols = leading + [last(angle) for angle in self.angles] + self.others
        return PolyRing(symbols or [sp.Dummy()], sp.QQ, lex)

    def _relations(self, ring: PolyRing) -> list[Poly]:
        circles = [ring.from_expr(sp.sin(angle) ** 2 + sp.cos(angle) ** 2 - 1) for angle in self.angles]
        return circles + [ring.from_expr(root) ** 2 - ring.from_expr(root.base) for root in self.roots]

    @cached_property
    def _swapped(self) -> tuple[PolyRing, list[Poly]]:
        """The same with the cosines squared away instead of the sines."""
        ring = self._ring(sp.cos, sp.sin)
        return ring, self._relations(ring)

    def poly(self, expression: sp.Expr) -> Poly:
        """The polynomial of an expression, reduced."""
        return self.reduced(self.ring.from_expr(sp.expand(expression)))

    def reduced(self, poly: Poly) -> Poly:
        """The polynomial with the relations applied."""
        poly = poly.rem(self.relations) if self.relations and poly else poly
        return _rounded(poly) if self.measured else poly

    def matrix(self, matrix: sp.Matrix) -> DomainMatrix:
        """A matrix over the ring."""
        rows = [[self.poly(entry) for entry in matrix.row(i)] for i in range(matrix.rows)]
        return DomainMatrix(rows, matrix.shape, self.ring.to_domain()).to_sparse()

    def product(self, a: DomainMatrix, b: DomainMatrix) -> DomainMatrix:
        """The product of two matrices, reduced."""
        return self.simplified(a * b)

    def simplified(self, matrix: DomainMatrix) -> DomainMatrix:
        """The matrix with reduced entries."""
        return matrix.applyfunc(self.reduced)

    def entries(self, matrix: DomainMatrix) -> list[list[Poly]]:
        """The polynomials of a matrix."""
        rows: list[list[Poly]] = matrix.to_list()
        return rows

    def expression(self, poly: Poly) -> sp.Expr:
        """The shortest way to write the polynomial that is found: sines or cosines squared away, factored or not."""
        if not poly:
            return sp.Integer(0)
        if self.measured:
            return self._collected(poly).replace(_is_measured, sp.Float)
        return min(self._collected(poly), self._best(poly), key=sp.count_ops)

    def _written(self, poly: Poly) -> list[sp.Expr]:
        other, relations = self._swapped
        swapped = poly.set_ring(other).rem(relations) if relations else poly
        forms = [self._merged(poly), poly, swapped]
        return [way(form) for form in forms if len(form) <= len(poly) for way in (_as_sum, _as_product)]

    def _collected(self, poly: Poly) -> sp.Expr:
        """Dimensions with the same function of the angles in brackets: (Z - tool_length) sin(C) + ..."""
        start = 2 * len(self.angles) + len(self.roots)
        functions: dict[tuple[int, ...], Poly] = {}
        for monomial, coefficient in poly.items():
            lengths, angles = (0,) * start + monomial[start:], monomial[:start] + (0,) * (len(monomial) - start)
            term = poly.new({angles: coefficient})
            functions[lengths] = functions[lengths] + term if lengths in functions else term
        groups: dict[Poly, Poly] = {}
        for lengths, function in functions.items():
            leading = function.LC
            brackets = poly.new({lengths: leading})
            same = function.quo_ground(leading)
            groups[same] = groups[same] + brackets if same in groups else brackets
        return sp.Add(*(sp.Mul(*self._brackets(b), *sp.Mul.make_args(self._best(same))) for same, b in groups.items()))

    def _brackets(self, poly: Poly) -> list[sp.Expr]:
        return [poly.as_expr()] if self.measured else _factors(poly)

    def _best(self, poly: Poly) -> sp.Expr:
        return poly.as_expr() if self.measured else min(self._written(poly), key=sp.count_ops)

    def _merged(self, poly: Poly) -> Poly:
        """Pairs a m - a m cos^2 become a m sin^2."""
        sines, cosines = 0, len(self.angles) + len(self.roots)
        for i in range(len(self.angles)):
            poly = _squares_merged(poly, sines + i, cosines + i)
        return poly


def _squares_merged(poly: Poly, sine: int, cosine: int) -> Poly:
    found = dict(poly)
    for monomial in sorted(poly, key=lambda monomial: -monomial[cosine]):
        base = _raised(monomial, cosine, -2)
        if monomial[cosine] >= 2 and monomial in found and found.get(base) == -found[monomial]:
            del found[monomial]
            found[_raised(base, sine, 2)] = found.pop(base)
    return poly.new(found)


def _raised(monomial: tuple[int, ...], index: int, by: int) -> tuple[int, ...]:
    return (*monomial[:index], monomial[index] + by, *monomial[index + 1 :])


def _as_sum(poly: Poly) -> sp.Expr:
    return poly.as_expr()


def _as_product(poly: Poly) -> sp.Expr:
    return sp.Mul(*_factors(poly))


def _factors(poly: Poly) -> list[sp.Expr]:
    factor, factors = poly.factor_list()
    return [sp.sympify(factor), *(base.as_expr() ** power for base, power in factors)]


def generators(expression: sp.Expr) -> set[sp.Expr]:
    """What a polynomial form of the expression is a polynomial in."""
    if expression.is_Rational:
        return set()
    if expression.is_Add or expression.is_Mul:
        return set().union(*(generators(part) for part in expression.args))
    if expression.is_Pow and expression.exp.is_Integer and expression.exp > 0:
        return generators(expression.base)
    return {expression}


def _is_root(expression: sp.Expr) -> bool:
    return bool(expression.is_Pow and expression.exp == sp.Rational(1, 2) and expression.base.is_Integer)


def _rounded(poly: Poly) -> Poly:
    field = poly.ring.domain
    limit = field(1, ROUNDING)
    kept = {powers: factor for powers, factor in poly.items() if abs(factor) > limit}
    fine = {powers: factor.numerator * FINENESS // factor.denominator for powers, factor in kept.items()}
    return poly.new({powers: field(factor, FINENESS) for powers, factor in fine.items()})


def _is_measured(expression: sp.Expr) -> bool:
    return bool(expression.is_Rational and expression.q > SIMPLE)
