"""Formulas as plain text: the variables, the nominal formulas, the error formulas with one error on each line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import sympy as sp

from ncfix.machine.symbolic.derivation import COMPONENTS, DIRECTION, POSITION, Derivation
from ncfix.machine.symbolic.inverse import inverse_nominal
from ncfix.machine.symbolic.variables import Variable

ORDINALS = {1: "first", 2: "second", 3: "third"}
MEANINGS = (
    "x y z: tool tip in the workpiece frame, mm; i j k: unit vector from the tip towards the spindle",
    "dx dy dz: shift of the tip, mm; rx ry rz: rotation vector of the tool, rad; actual minus nominal, workpiece frame",
)


def to_text(derivation: Derivation) -> str:
    """The whole derivation."""
    return "\n".join(_lines(derivation)) + "\n"


def _lines(derivation: Derivation) -> Iterator[str]:
    chain = derivation.chain
    yield f"{chain.name}: errors to {ordinal(derivation.order)} order"
    yield from ("", "Variables")
    yield from variable_table(chain.variables)
    yield from ("", "Nominal", f"  {MEANINGS[0]}")
    yield from (f"  {name} = {derivation.nominal[name]}" for name in (*POSITION, *DIRECTION))
    yield from ("", "Inverse nominal", "  axis positions, rad and mm")
    yield from (f"  {line}" for line in inverse_nominal(derivation).lines())
    yield from ("", "Error", f"  {MEANINGS[1]}")
    for component in COMPONENTS:
        yield from _component(derivation, component)
    if derivation.without_effect:
        yield from ("", f"Without effect: {' '.join(derivation.without_effect)}")


def ordinal(order: int) -> str:
    """The word for an order."""
    return ORDINALS.get(order, f"{order}th")


def variable_table(variables: Iterable[Variable]) -> Iterator[str]:
    """One line per variable: symbol, size, sign where it is clockwise, value, definition."""
    for variable in variables:
        value = "" if variable.value is None else f" = {variable.value:.12g}"
        sign = " (clockwise)" if variable.sign < 0 else ""
        yield f"  {f'{variable.symbol}{value}':<24} {variable.size.value:<6} {variable.definition}{sign}".rstrip()


def _component(derivation: Derivation, component: str) -> Iterator[str]:
    terms = derivation.terms[component]
    yield f"  {component} = 0" if not terms else f"  {component} ="
    for key, coefficient in terms.items():
        sign, size = signed(coefficient)
        yield f"    {sign} {_product(str(derivation.monomial(key)), size)}"


def signed(coefficient: sp.Expr) -> tuple[str, sp.Expr]:
    """The sign of a summand, and the rest."""
    negative = coefficient.as_coeff_Mul()[0].is_negative
    return ("-", -coefficient) if negative else ("+", coefficient)


def _product(errors: str, size: sp.Expr) -> str:
    if size == 1:
        return errors
    if size.is_Number:
        return f"{size}*{errors}"
    return f"{errors}*({size})" if size.is_Add else f"{errors}*{size}"
