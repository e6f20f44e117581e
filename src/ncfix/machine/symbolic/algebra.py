"""Coded algebra: polynomials in sines, cosines, square roots and dimensions, simplified after every product.

All entries of a chain's matrices are polynomials in these, with rational coefficients. In the ring, sin^2 + cos^2 = 1
and sqrt(n)^2 = n are applied at once, so two expressions are equal if, and only if, their polynomials are the same.
Freeman and Ford (2003), section 4.

For people, a polynomial is written in the shortest of several ways: squares of sines or of cosines replaced, pairs
1 - cos^2 merged, factored or not, dimensions with the same function of the angles in brackets. A polynomial that is too
long to be read, or has measured numbers in it, is only collected into such brackets.
"""

from __future__ import annotations

from collections.abc import Iterable
from operator import itemgetter
from typing import Any

import sympy as sp
from sympy.polys.matrices import DomainMatrix
from sympy.polys.orderings import lex
from sympy.polys.rings import PolyRing

SIMPLE = 10**9
"""A fraction with a larger denominator is a measured number, not an exact constant."""
FINENESS = 2**90
"""Measured numbers are kept as multiples of one part in this many."""
ROUNDING = 2**46
"""With measured numbers, factors below one part in this many are dropped: they come from rounding (to doubles)."""

Powers = tuple[int, ...]
"""Exponents of the generators."""
Poly = Any
"""An element of the ring."""


class Algebra:
    """The ring of polynomials to which some expressions belong.

    written   polynomial -> the shortest way to write it, kept because the same ones occur again and again
    factored  polynomial -> its factors
    """

    def __init__(self, expressions: Iterable[sp.Expr]) -> None:
        """The ring that holds sums and products of the expressions."""
        expressions = [as_fractions(expression) for expression in expressions]
        numbers = {number for expression in expressions for number in expression.atoms(sp.Rational)}
        self.measured = any(number.q > SIMPLE for number in numbers)
        found = set().union(*(generators(expression) for expression in expressions))
        angles = {generator.args[0] for generator in found if isinstance(generator, (sp.sin, sp.cos))}
        self.angles = sorted(angles, key=sp.default_sort_key)
        powers = [g for g in found if g.is_Pow and g.exp == sp.Rational(1, 2)]
        self.roots = sorted((g for g in powers if g.base.is_Integer), key=sp.default_sort_key)
        trig = {f(angle) for angle in self.angles for f in (sp.sin, sp.cos)}
        self.others = sorted(found - trig - set(self.roots), key=sp.default_sort_key)
        leading = [sp.sin(angle) for angle in self.angles] + self.roots
        symbols = leading + [sp.cos(angle) for angle in self.angles] + self.others
        self.ring = PolyRing(symbols or [sp.Dummy()], sp.QQ, lex)
        self._squares = [self._one_minus(cosine) for _, cosine in self.pairs]
        self._squares += [self.ring.from_expr(root.base) for root in self.roots]
        self.written: dict[Poly, sp.Expr] = {}
        self.factored: dict[Poly, list[sp.Expr]] = {}

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """The indices of sine and cosine of each angle among the generators."""
        cosines = len(self.angles) + len(self.roots)
        return [(index, cosines + index) for index in range(len(self.angles))]

    def _one_minus(self, index: int) -> Poly:
        return 1 - self.ring.gens[index] ** 2

    def poly(self, expression: sp.Expr) -> Poly:
        """The polynomial of an expression, reduced."""
        return self.reduced(self.ring.from_expr(sp.expand(as_fractions(expression))))

    def reduced(self, poly: Poly) -> Poly:
        """The polynomial with squares of sines and of roots replaced; factors rounded if there are measured numbers."""
        for index, square in enumerate(self._squares):
            poly = _replaced(poly, index, square)
        return _rounded(poly) if self.measured else poly

    def with_sines(self, poly: Poly) -> Poly:
        """The same function with squares of cosines replaced, instead of squares of sines."""
        for sine, cosine in self.pairs:
            poly = _replaced(poly, cosine, self._one_minus(sine))
        return poly

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
        return matrix.to_list()

    def expression(self, poly: Poly) -> sp.Expr:
        """A short way to write the polynomial."""
        if not poly:
            return sp.Integer(0)
        collected = _collected(self, poly)
        if self.measured:
            return collected.replace(lambda e: bool(e.is_Rational and e.q > SIMPLE), sp.Float)
        return collected if _plain(self, poly) else min(collected, _shortest(self, poly), key=sp.count_ops)


def as_fractions(expression: sp.Expr) -> sp.Expr:
    """The expression with its floating-point numbers replaced by the fractions that they are exactly."""
    return expression.xreplace({number: sp.Rational(float(number)) for number in expression.atoms(sp.Float)})


def generators(expression: sp.Expr) -> set[sp.Expr]:
    """The subexpressions, such as symbols, sines and roots, in which the expression is a polynomial."""
    if expression.is_Rational:
        return set()
    if expression.is_Add or expression.is_Mul:
        return set().union(*(generators(part) for part in expression.args))
    if expression.is_Pow and expression.exp.is_Integer and expression.exp > 0:
        return generators(expression.base)
    return {expression}


def _replaced(poly: Poly, index: int, square: Poly) -> Poly:
    """The polynomial with the square of generator `index` replaced by `square` wherever it occurs."""
    while any(powers[index] >= 2 for powers in poly):
        low = {powers: factor for powers, factor in poly.items() if powers[index] < 2}
        high = {raised(powers, index, -2): factor for powers, factor in poly.items() if powers[index] >= 2}
        poly = poly.new(low) + poly.new(high) * square
    return poly


def raised(powers: Powers, index: int, by: int) -> Powers:
    """The exponents with that of generator `index` changed by `by`."""
    return (*powers[:index], powers[index] + by, *powers[index + 1 :])


def _rounded(poly: Poly) -> Poly:
    field = poly.ring.domain
    limit = field(1, ROUNDING)
    large = {powers: factor for powers, factor in poly.items() if abs(factor) > limit}
    fine = {powers: factor.numerator * FINENESS // factor.denominator for powers, factor in large.items()}
    return poly.new({powers: field(factor, FINENESS) for powers, factor in fine.items()})


LONG = 40
"""Number of terms above which the search for a shorter way of writing takes long and finds little."""


def _plain(algebra: Algebra, poly: Poly) -> bool:
    return algebra.measured or len(poly) > LONG


def _shortest(algebra: Algebra, poly: Poly) -> sp.Expr:
    if _plain(algebra, poly):
        return poly.as_expr()
    if poly not in algebra.written:
        forms = dict.fromkeys((_with_pairs_merged(algebra, poly), poly, algebra.with_sines(poly)))
        short = [form for form in forms if len(form) <= len(poly)]
        ways = [way for form in short for way in (form.as_expr(), sp.Mul(*_factors(algebra, form)))]
        algebra.written[poly] = min(ways, key=sp.count_ops)
    return algebra.written[poly]


def _factors(algebra: Algebra, poly: Poly) -> list[sp.Expr]:
    if poly not in algebra.factored:
        factor, factors = poly.factor_list()
        algebra.factored[poly] = [sp.sympify(factor), *(base.as_expr() ** power for base, power in factors)]
    return algebra.factored[poly]


def _collected(algebra: Algebra, poly: Poly) -> sp.Expr:
    """The polynomial with dimensions that have the same function of the angles in brackets: (Z - L) sin(C) + ..."""
    groups: dict[Poly, dict[Powers, object]] = {}
    for lengths, function in _by_dimension(algebra, poly).items():
        leading = function.LC
        groups.setdefault(function.quo_ground(leading), {})[lengths] = leading
    parts = []
    for function, brackets in groups.items():
        lengths = poly.new(brackets)
        outside = [lengths.as_expr()] if _plain(algebra, lengths) else _factors(algebra, lengths)
        parts.append(sp.Mul(*outside, *sp.Mul.make_args(_shortest(algebra, function))))
    return sp.Add(*parts)


def _by_dimension(algebra: Algebra, poly: Poly) -> dict[Powers, Poly]:
    """Product of dimensions -> the polynomial in sines, cosines and roots that is multiplied by it."""
    start = 2 * len(algebra.angles) + len(algebra.roots)
    found: dict[Powers, dict[Powers, object]] = {}
    for powers, factor in poly.items():
        lengths, angles = (0,) * start + powers[start:], powers[:start] + (0,) * (len(powers) - start)
        found.setdefault(lengths, {})[angles] = factor
    return {lengths: poly.new(function) for lengths, function in found.items()}


def _with_pairs_merged(algebra: Algebra, poly: Poly) -> Poly:
    """The polynomial with pairs of terms a m - a m cos^2 replaced by a m sin^2."""
    for sine, cosine in algebra.pairs:
        found = dict(poly)
        for powers in sorted(poly, key=itemgetter(cosine), reverse=True):
            base = raised(powers, cosine, -2)
            if powers[cosine] >= 2 and powers in found and found.get(base) == -found[powers]:
                del found[powers]
                found[raised(base, sine, 2)] = found.pop(base)
        poly = poly.new(found)
    return poly
