"""Formulas as LaTeX: `align*` environments of amsmath, one error on each line."""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from ncfix.machine.symbolic.derivation import COMPONENTS, DIRECTION, POSITION, Derivation
from ncfix.machine.symbolic.text import signed
from ncfix.machine.symbolic.variables import Variable

NAMES = {"dx": r"\delta_x", "dy": r"\delta_y", "dz": r"\delta_z", "rx": r"\rho_x", "ry": r"\rho_y", "rz": r"\rho_z"}


def to_latex(derivation: Derivation) -> str:
    """Nominal formulas and error formulas."""
    names = symbol_names(derivation)
    nominal = [f"{name} &= {_written(derivation.nominal[name], names)}" for name in (*POSITION, *DIRECTION)]
    blocks = [_aligned(nominal), *(_aligned(list(_component(derivation, name, names))) for name in COMPONENTS)]
    return "\n".join(blocks)


def symbol_names(derivation: Derivation) -> dict[sp.Expr, str]:
    """How each variable is written."""
    return {variable.symbol: _name(variable) for variable in derivation.chain.variables}


def _name(variable: Variable) -> str:
    return f"{variable.latex}({', '.join(variable.arguments)})" if variable.arguments else variable.latex


def _written(expression: sp.Expr, names: dict[sp.Expr, str]) -> str:
    """sympy takes names for plain symbols only, so functions such as EXX(X) are put in as symbols first."""
    plain = {symbol: sp.Symbol(str(symbol)) for symbol in names if not symbol.is_Symbol}
    labels = {plain.get(symbol, symbol): name for symbol, name in names.items()}
    text: str = sp.latex(expression.xreplace(plain), symbol_names=labels, fold_func_brackets=True)
    return text


def _component(derivation: Derivation, component: str, names: dict[sp.Expr, str]) -> Iterator[str]:
    terms = derivation.terms[component]
    if not terms:
        yield f"{NAMES[component]} &= 0"
    for number, (key, coefficient) in enumerate(terms.items()):
        sign, size = signed(coefficient)
        shown = "" if sign == "+" and number == 0 else sign
        head = "&\\quad" if number else f"{NAMES[component]} &="
        yield f"{head} {shown} {_product(_written(derivation.monomial(key), names), size, names)}"


def _product(errors: str, size: sp.Expr, names: dict[sp.Expr, str]) -> str:
    if size == 1:
        return errors
    text = _written(size, names)
    if size.is_Number:
        return rf"{text}\,{errors}"
    return rf"{errors}\,\left({text}\right)" if size.is_Add else rf"{errors}\,{text}"


def _aligned(lines: list[str]) -> str:
    body = " \\\\\n".join(f"  {line}" for line in lines)
    return f"\\begin{{align*}}\n{body}\n\\end{{align*}}\n"
