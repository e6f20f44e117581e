"""Formulas as plain text, as LaTeX (`align*` of amsmath) and as Python source of two functions of numpy arrays."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence

import sympy as sp
from sympy.printing.numpy import NumPyPrinter

from ncfix.machine.symbolic.chain import Variable
from ncfix.machine.symbolic.derivation import COMPONENTS, DIRECTION, POSITION, Derivation
from ncfix.machine.symbolic.inverse import inverse_nominal

ORDINALS = {1: "first", 2: "second", 3: "third"}
MEANINGS = (
    "x y z: tool tip in the workpiece frame, mm; i j k: unit vector from the tip towards the spindle",
    "dx dy dz: shift of the tip, mm; rx ry rz: rotation vector of the tool, rad; actual minus nominal, workpiece frame",
)


def to_text(derivation: Derivation) -> str:
    """The whole derivation."""
    return "\n".join(_text_lines(derivation)) + "\n"


def _text_lines(derivation: Derivation) -> Iterator[str]:
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
        yield from _text_component(derivation, component)
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


def _text_component(derivation: Derivation, component: str) -> Iterator[str]:
    terms = derivation.terms[component]
    yield f"  {component} = 0" if not terms else f"  {component} ="
    for key, coefficient in terms.items():
        sign, size = signed(coefficient)
        yield f"    {sign} {_text_product(str(derivation.monomial(key)), size)}"


def signed(coefficient: sp.Expr) -> tuple[str, sp.Expr]:
    """The sign of a summand, and the rest."""
    negative = coefficient.as_coeff_Mul()[0].is_negative
    return ("-", -coefficient) if negative else ("+", coefficient)


def _text_product(errors: str, size: sp.Expr) -> str:
    if size == 1:
        return errors
    if size.is_Number:
        return f"{size}*{errors}"
    return f"{errors}*({size})" if size.is_Add else f"{errors}*{size}"


NAMES = {"dx": r"\delta_x", "dy": r"\delta_y", "dz": r"\delta_z", "rx": r"\rho_x", "ry": r"\rho_y", "rz": r"\rho_z"}


def to_latex(derivation: Derivation) -> str:
    """Nominal formulas and error formulas."""
    names = symbol_names(derivation)
    nominal = [f"{name} &= {_latex(derivation.nominal[name], names)}" for name in (*POSITION, *DIRECTION)]
    blocks = [_aligned(nominal), *(_aligned(list(_latex_component(derivation, name, names))) for name in COMPONENTS)]
    return "\n".join(blocks)


def symbol_names(derivation: Derivation) -> dict[sp.Expr, str]:
    """How each variable is written."""
    return {variable.symbol: _latex_name(variable) for variable in derivation.chain.variables}


def _latex_name(variable: Variable) -> str:
    return f"{variable.latex}({', '.join(variable.arguments)})" if variable.arguments else variable.latex


def _latex(expression: sp.Expr, names: dict[sp.Expr, str]) -> str:
    """sympy takes names for plain symbols only, so functions such as EXX(X) are put in as symbols first."""
    plain = {symbol: sp.Symbol(str(symbol)) for symbol in names if not symbol.is_Symbol}
    labels = {plain.get(symbol, symbol): name for symbol, name in names.items()}
    text: str = sp.latex(expression.xreplace(plain), symbol_names=labels, fold_func_brackets=True)
    return text


def _latex_component(derivation: Derivation, component: str, names: dict[sp.Expr, str]) -> Iterator[str]:
    terms = derivation.terms[component]
    if not terms:
        yield f"{NAMES[component]} &= 0"
    for number, (key, coefficient) in enumerate(terms.items()):
        sign, size = signed(coefficient)
        shown = "" if sign == "+" and number == 0 else sign
        head = "&\\quad" if number else f"{NAMES[component]} &="
        yield f"{head} {shown} {_latex_product(_latex(derivation.monomial(key), names), size, names)}"


def _latex_product(errors: str, size: sp.Expr, names: dict[sp.Expr, str]) -> str:
    if size == 1:
        return errors
    text = _latex(size, names)
    if size.is_Number:
        return rf"{text}\,{errors}"
    return rf"{errors}\,\left({text}\right)" if size.is_Add else rf"{errors}\,{text}"


def _aligned(lines: list[str]) -> str:
    body = " \\\\\n".join(f"  {line}" for line in lines)
    return f"\\begin{{align*}}\n{body}\n\\end{{align*}}\n"


WIDTH = 116
"""Characters in a line of the source."""


def to_python(derivation: Derivation) -> str:
    """A module with `nominal(...) -> (..., 6)` and `error(...) -> (..., 6)`; everything broadcasts."""
    chain = derivation.chain
    title = f"{chain.name}: errors to {ordinal(derivation.order)} order. mm, rad."
    table = "\n".join(variable_table(chain.variables))
    told = f"{title}\n\n{table}\n".replace("\\", "/").replace('"', "'")
    head = f'"""{told}"""\n\nimport numpy as np\n'
    large, small = (*chain.axes, *chain.dimensions), chain.smalls
    nominal = [derivation.nominal[name] for name in (*POSITION, *DIRECTION)]
    error = list(derivation.error.values())
    return "\n\n".join(
        [
            head,
            _function("nominal", large, (), dict(zip((*POSITION, *DIRECTION), nominal, strict=True)), MEANINGS[0]),
            _function("error", large, small, dict(zip(COMPONENTS, error, strict=True)), MEANINGS[1]),
        ]
    )


def compiled(derivation: Derivation) -> tuple[Callable[..., object], Callable[..., object]]:
    """The functions `nominal` and `error` of that module, ready to be called."""
    module: dict[str, Callable[..., object]] = {}
    exec(compile(to_python(derivation), f"<derived from {derivation.chain.name}>", "exec"), module)
    return module["nominal"], module["error"]


def _function(
    name: str, large: Sequence[Variable], small: Sequence[Variable], formulas: dict[str, sp.Expr], meaning: str
) -> str:
    lines = [*_wrapped(f"def {name}(", _parameters(large, small), "):", ""), f'    """{meaning}"""']
    lines.append("    shape = np.broadcast_shapes(*map(np.shape, locals().values()))")
    for target, expression in _assignments(formulas, [*large, *small]):
        lines += _wrapped(f"    {target} = ", [expression], "", "    ")
    lines.append(
        f"    return np.stack([np.broadcast_to(v, shape) for v in ({', '.join(formulas)})], axis=-1).astype(float)"
    )
    return "\n".join(lines) + "\n"


def _wrapped(head: str, parts: Iterable[str], tail: str, indent: str) -> list[str]:
    """One line if it fits, else several in brackets."""
    text = ", ".join(parts)
    if len(head) + len(text) + len(tail) <= WIDTH:
        return [head + text + tail]
    opened, closed = (head, tail) if head.endswith("(") else (f"{head}(", f"){tail}")
    inner = f"{indent}    " if opened == f"{head}(" else "    "
    body = textwrap.wrap(text, WIDTH, initial_indent=inner, subsequent_indent=inner, break_long_words=False)
    return [opened, *body, f"{indent}{closed}"]


def _parameters(large: Sequence[Variable], small: Sequence[Variable]) -> Iterator[str]:
    yield from (variable.name for variable in large if variable.value is None)
    keywords = [f"{variable.name}={variable.value!r}" for variable in large if variable.value is not None]
    keywords += [f"{variable.name}=0.0" for variable in small]
    yield from ("*", *keywords) if keywords else ()


def _assignments(formulas: dict[str, sp.Expr], variables: Sequence[Variable]) -> Iterator[tuple[str, str]]:
    plain = {variable.symbol: variable.plain for variable in variables if variable.arguments}
    taken = {variable.name for variable in variables} | {*formulas, "shape", "v"}
    names = (symbol for symbol in sp.numbered_symbols("c") if symbol.name not in taken)
    parts, results = sp.cse([formula.xreplace(plain) for formula in formulas.values()], names)
    printer = NumPyPrinter()
    for symbol, expression in (*parts, *zip(formulas, results, strict=True)):
        yield str(symbol), printer.doprint(expression).replace("numpy.", "np.")
