"""Polynomials of the ring as expressions that people can read: the shortest of several ways to write them.

Sines or cosines squared away, pairs 1 - cos^2 merged, factored or not, dimensions with the same function of the angles
in brackets. What is too long to be read, or has measured numbers in it, is only collected.
"""

from __future__ import annotations

import sympy as sp

from ncfix.machine.symbolic.algebra import SIMPLE, Algebra, Poly, Powers, raised

LONG = 40
"""With more terms than this the search for something shorter takes long and finds little."""


def written(algebra: Algebra, poly: Poly) -> sp.Expr:
    """The expression."""
    if not poly:
        return sp.Integer(0)
    if _plain(algebra, poly):
        collected = _collected(algebra, poly)
        return collected.replace(_is_measured, sp.Float) if algebra.measured else collected
    return min(_collected(algebra, poly), _shortest(algebra, poly), key=sp.count_ops)


def _plain(algebra: Algebra, poly: Poly) -> bool:
    return algebra.measured or len(poly) > LONG


def _shortest(algebra: Algebra, poly: Poly) -> sp.Expr:
    if _plain(algebra, poly):
        return poly.as_expr()
    forms = [_merged(algebra, poly), poly, algebra.with_sines(poly)]
    ways = [way for form in forms if len(form) <= len(poly) for way in (form.as_expr(), sp.Mul(*_factors(form)))]
    return min(ways, key=sp.count_ops)


def _factors(poly: Poly) -> list[sp.Expr]:
    factor, factors = poly.factor_list()
    return [sp.sympify(factor), *(base.as_expr() ** power for base, power in factors)]


def _collected(algebra: Algebra, poly: Poly) -> sp.Expr:
    """Dimensions with the same function of the angles in brackets: (Z - tool_length) sin(C) + ..."""
    groups: dict[Poly, dict[Powers, object]] = {}
    for lengths, function in _by_dimension(algebra, poly).items():
        leading = function.LC
        groups.setdefault(function.quo_ground(leading), {})[lengths] = leading
    parts = []
    for function, brackets in groups.items():
        lengths = poly.new(brackets)
        outside = [lengths.as_expr()] if _plain(algebra, lengths) else _factors(lengths)
        parts.append(sp.Mul(*outside, *sp.Mul.make_args(_shortest(algebra, function))))
    return sp.Add(*parts)


def _by_dimension(algebra: Algebra, poly: Poly) -> dict[Powers, Poly]:
    """Per product of dimensions, the polynomial in sines, cosines and roots that it comes with."""
    start = 2 * len(algebra.angles) + len(algebra.roots)
    found: dict[Powers, dict[Powers, object]] = {}
    for powers, factor in poly.items():
        lengths, angles = (0,) * start + powers[start:], powers[:start] + (0,) * (len(powers) - start)
        found.setdefault(lengths, {})[angles] = factor
    return {lengths: poly.new(function) for lengths, function in found.items()}


def _merged(algebra: Algebra, poly: Poly) -> Poly:
    """Pairs a m - a m cos^2 become a m sin^2."""
    for sine, cosine in algebra.pairs:
        poly = _squares_merged(poly, sine, cosine)
    return poly


def _squares_merged(poly: Poly, sine: int, cosine: int) -> Poly:
    found = dict(poly)
    for powers in sorted(poly, key=lambda powers: -powers[cosine]):
        base = raised(powers, cosine, -2)
        if powers[cosine] >= 2 and powers in found and found.get(base) == -found[powers]:
            del found[powers]
            found[raised(base, sine, 2)] = found.pop(base)
    return poly.new(found)


def _is_measured(expression: sp.Expr) -> bool:
    return bool(expression.is_Rational and expression.q > SIMPLE)
