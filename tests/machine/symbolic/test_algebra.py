"""The ring of sines, cosines, roots and dimensions: what is equal is the same, what is written is what was meant."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import some
from ncfix.machine.symbolic.algebra import Algebra
from ncfix.machine.symbolic.identification import PolynomialColumns, independent_columns

A, B, L, M = sp.symbols("A B L M", real=True)
sin, cos = sp.sin, sp.cos
ATOMS = [sin(A), cos(A), sin(B), cos(B), L, M, sp.sqrt(2), sp.Rational(1, 2), sp.Integer(-1)]


@st.composite
def polynomials(draw: st.DrawFn) -> sp.Expr:
    """Sums of products of the atoms."""
    products = draw(st.lists(st.lists(st.sampled_from(ATOMS), min_size=1, max_size=5), min_size=1, max_size=6))
    return sp.Add(*(sp.Mul(*factors) for factors in products))


@settings(max_examples=some(60), deadline=None)
@given(expression=polynomials(), numbers=st.tuples(*[st.floats(-3, 3) for _ in range(4)]))
def test_what_is_written_is_what_was_meant(expression: sp.Expr, numbers: tuple[float, ...]) -> None:
    algebra = Algebra([expression])
    written = algebra.expression(algebra.poly(expression))
    at = dict(zip((A, B, L, M), numbers, strict=True))
    assert float((written - expression).subs(at)) == pytest.approx(0, abs=1e-9)
    # Equal expressions have one form, which is not the shortest of each: sin^4 + cos^2 becomes 1 - sin^2 cos^2.
    assert sp.count_ops(written) <= sp.count_ops(sp.expand(expression)) + 2


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (sin(A) ** 2 + cos(A) ** 2, 1),
        (sin(A) ** 4, (1 - cos(A) ** 2) ** 2),
        (sp.sqrt(2) ** 3 * L, 2 * sp.sqrt(2) * L),
        ((sin(A) * cos(B)) ** 2 + (sin(A) * sin(B)) ** 2, 1 - cos(A) ** 2),
    ],
)
def test_equal_expressions_have_one_polynomial(one: sp.Expr, other: sp.Expr) -> None:
    algebra = Algebra([sp.expand(one), sp.expand(sp.sympify(other)), sin(A), sin(B), sp.sqrt(2)])
    assert algebra.poly(one) == algebra.poly(sp.sympify(other))


def test_different_expressions_do_not() -> None:
    algebra = Algebra([sin(A), cos(A), L])
    assert algebra.poly(sin(A) ** 2) != algebra.poly(cos(A) ** 2)
    assert algebra.poly(L * sin(A)) != algebra.poly(-L * sin(A))


@pytest.mark.parametrize(
    ("given_", "text"),
    [
        (L * sin(A) - M * sin(A), "(L - M)*sin(A)"),
        (cos(A) ** 2 * cos(B) - cos(B) - cos(A) ** 2, "-sin(A)**2*cos(B) - cos(A)**2"),
        (1 - cos(A) ** 2, "sin(A)**2"),
        (1 - sin(A) ** 2, "cos(A)**2"),
        (L * sin(A) ** 2 + L * cos(A) ** 2, "L"),
        (sin(A) - sin(A), "0"),
    ],
)
def test_short_forms(given_: sp.Expr, text: str) -> None:
    algebra = Algebra([given_, sin(A), sin(B), L, M])
    assert str(algebra.expression(algebra.poly(given_))) == text


def test_measured_numbers_stay_decimals_and_their_rounding_vanishes() -> None:
    x, y, z = (sp.Rational(value) for value in (0.267261241912424, 0.534522483824849, 0.801783725737273))
    algebra = Algebra([x, y, z, L])
    length = algebra.poly(x * x + y * y + z * z)
    assert algebra.measured
    assert not algebra.poly(L * (x * y - y * x))
    assert float(algebra.expression(length)) == pytest.approx(1, abs=1e-14)
    assert str(algebra.expression(algebra.poly(x * L))) == "0.267261241912424*L"


# -- dependence of columns --------------------------------------------------------------------------------------------


def test_independent_columns_are_found_from_the_left() -> None:
    matrix = np.array([[1.0, 2.0, 0.0, 1.0, 0.0], [0.0, 0.0, 1.0, 1.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0]])
    assert independent_columns(matrix) == [0, 2]


def test_combinations_in_symbols() -> None:
    """Column 3 is cos(A) times column 1 minus L times column 2; column 4 is zero."""
    columns = [{"x": sin(B), "y": M}, {"y": cos(B)}, {"x": cos(A) * sin(B), "y": M * cos(A) - L * cos(B)}, {}]
    algebra = Algebra(sp.expand(e) for column in columns for e in column.values())
    table = PolynomialColumns(algebra, [{row: algebra.poly(e) for row, e in column.items()} for column in columns])
    p, q, r, s = sp.symbols("p q r s")
    found = table.combinations([p, q, r, s])
    assert table.invisible == [3]
    assert sp.simplify(found[0] - (p + cos(A) * r)) == 0
    assert sp.simplify(found[1] - (q - L * r)) == 0
