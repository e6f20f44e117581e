"""Formulas as plain text, as LaTeX (`align*` of amsmath), and as two functions in Python (numpy arrays) or in C."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence

import sympy as sp
from sympy.printing.c import C99CodePrinter
from sympy.printing.codeprinter import CodePrinter
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
    """The derivation as plain text: variables, nominal formulas, their inverse, and errors with a summand per line."""
    lines = [f"{derivation.chain.name}: errors to {ordinal(derivation.order)} order", "", "Variables"]
    lines += variable_table(derivation.chain.variables)
    lines += ["", "Nominal", f"  {MEANINGS[0]}"]
    lines += [f"  {name} = {derivation.nominal[name]}" for name in (*POSITION, *DIRECTION)]
    lines += ["", "Inverse nominal", "  axis positions, rad and mm"]
    lines += [f"  {line}" for line in inverse_nominal(derivation).lines()]
    lines += ["", "Error", f"  {MEANINGS[1]}"]
    for component in COMPONENTS:
        terms = derivation.terms[component]
        lines.append(f"  {component} =" if terms else f"  {component} = 0")
        for key, coefficient in terms.items():
            sign, size = signed(coefficient)
            shown = f"({size})" if size.is_Add else f"{size}"
            errors = str(derivation.monomial(key))
            product = errors if size == 1 else f"{size}*{errors}" if size.is_Number else f"{errors}*{shown}"
            lines.append(f"    {sign} {product}")
    if derivation.without_effect:
        lines += ["", f"Without effect: {' '.join(derivation.without_effect)}"]
    return "\n".join(lines) + "\n"


def ordinal(order: int) -> str:
    """The word for an order."""
    return ORDINALS.get(order, f"{order}th")


def variable_table(variables: Iterable[Variable]) -> Iterator[str]:
    """A line for each variable: symbol, value, size, definition, and whether it is clockwise."""
    for variable in variables:
        value = "" if variable.value is None else f" = {variable.value:.12g}"
        sign = " (clockwise)" if variable.sign < 0 else ""
        yield f"  {f'{variable.symbol}{value}':<24} {variable.size.value:<6} {variable.definition}{sign}".rstrip()


def signed(coefficient: sp.Expr) -> tuple[str, sp.Expr]:
    """The sign of a summand, "+" or "-", and the summand without it."""
    negative = coefficient.as_coeff_Mul()[0].is_negative
    return ("-", -coefficient) if negative else ("+", coefficient)


NAMES = {"dx": r"\delta_x", "dy": r"\delta_y", "dz": r"\delta_z", "rx": r"\rho_x", "ry": r"\rho_y", "rz": r"\rho_z"}


def to_latex(derivation: Derivation) -> str:
    """The nominal and the error formulas as LaTeX: aligned equations, for a document that loads amsmath."""
    names = {}
    for variable in derivation.chain.variables:
        arguments = f"({', '.join(variable.arguments)})" if variable.arguments else ""
        names[variable.symbol] = variable.latex + arguments
    blocks = [[f"{name} &= {_latex(derivation.nominal[name], names)}" for name in (*POSITION, *DIRECTION)]]
    for component in COMPONENTS:
        lines = [] if derivation.terms[component] else [f"{NAMES[component]} &= 0"]
        for number, (key, coefficient) in enumerate(derivation.terms[component].items()):
            sign, size = signed(coefficient)
            shown = "" if sign == "+" and number == 0 else sign
            head = "&\\quad" if number else f"{NAMES[component]} &="
            lines.append(f"{head} {shown} {_latex_product(_latex(derivation.monomial(key), names), size, names)}")
        blocks.append(lines)
    bodies = (" \\\\\n".join(f"  {line}" for line in lines) for lines in blocks)
    return "\n".join(f"\\begin{{align*}}\n{body}\n\\end{{align*}}\n" for body in bodies)


def _latex(expression: sp.Expr, names: dict[sp.Expr, str]) -> str:
    """An expression as LaTeX with these names. Functions such as EXX(X) become symbols, as sympy names only those."""
    plain = {symbol: sp.Symbol(str(symbol)) for symbol in names if not symbol.is_Symbol}
    labels = {plain.get(symbol, symbol): name for symbol, name in names.items()}
    return sp.latex(expression.xreplace(plain), symbol_names=labels, fold_func_brackets=True)


def _latex_product(errors: str, size: sp.Expr, names: dict[sp.Expr, str]) -> str:
    if size == 1:
        return errors
    text = _latex(size, names)
    if size.is_Number:
        return rf"{text}\,{errors}"
    return rf"{errors}\,\left({text}\right)" if size.is_Add else rf"{errors}\,{text}"


WIDTH = 116
"""Largest number of characters in a line of the source."""
UNBROKEN = "\N{NO-BREAK SPACE}"
"""A space at which no line is broken."""


def to_python(derivation: Derivation) -> str:
    """A Python module with `nominal(...) -> (..., 6)` and `error(...) -> (..., 6)`; all arguments broadcast."""
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


def to_c(derivation: Derivation) -> str:
    """C99 source with `void nominal(..., double result[6])` and `error`; all dimensions and errors are parameters."""
    chain = derivation.chain
    title = f"{chain.name}: errors to {ordinal(derivation.order)} order. mm, rad."
    told = (title, "", *variable_table(chain.variables))
    lines = ["/*", *(f" * {line}".rstrip().replace("*/", "* /") for line in told), " */", "", "#include <math.h>"]
    large, printer = (*chain.axes, *chain.dimensions), C99CodePrinter({"math_macros": {}})
    nominal = {name: derivation.nominal[name] for name in (*POSITION, *DIRECTION)}
    for name, formulas, meaning, given in (
        ("nominal", nominal, MEANINGS[0], large),
        ("error", derivation.error, MEANINGS[1], (*large, *chain.smalls)),
    ):
        parameters = [f"double{UNBROKEN}{each.name}" for each in given] + [f"double{UNBROKEN}result[6]"]
        lines += ["", f"/* {meaning} */", *_wrapped(f"void {name}(", parameters, ")", ""), "{"]
        places = {target: f"result[{place}]" for place, target in enumerate(formulas)}
        plain = {target: formula.xreplace({sp.pi: sp.pi.evalf(17)}) for target, formula in formulas.items()}
        for target, expression in _assignments(plain, given, printer):
            lines += _wrapped(f"    {places.get(target, f'const double {target}')} = ", [expression], ";", "    ")
        lines.append("}")
    return "\n".join(lines).replace(UNBROKEN, " ") + "\n"


def compiled(derivation: Derivation) -> tuple[Callable[..., object], Callable[..., object]]:
    """The functions `nominal` and `error` of the Python module, ready to be called."""
    module: dict[str, Callable[..., object]] = {}
    exec(compile(to_python(derivation), f"<derived from {derivation.chain.name}>", "exec"), module)
    return module["nominal"], module["error"]


def _function(
    name: str, large: Sequence[Variable], small: Sequence[Variable], formulas: dict[str, sp.Expr], meaning: str
) -> str:
    lines = [*_wrapped(f"def {name}(", _parameters(large, small), "):", ""), f'    """{meaning}"""']
    lines.append("    shape = np.broadcast_shapes(*map(np.shape, locals().values()))")
    for target, expression in _assignments(formulas, [*large, *small], NumPyPrinter()):
        lines += _wrapped(f"    {target} = ", [expression.replace("numpy.", "np.")], "", "    ")
    lines.append(
        f"    return np.stack([np.broadcast_to(v, shape) for v in ({', '.join(formulas)})], axis=-1).astype(float)"
    )
    return "\n".join(lines) + "\n"


def _wrapped(head: str, parts: Iterable[str], tail: str, indent: str) -> list[str]:
    """Source on one line if it fits, else on several in brackets."""
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


def _assignments(
    formulas: dict[str, sp.Expr], variables: Sequence[Variable], printer: CodePrinter
) -> Iterator[tuple[str, str]]:
    plain = {variable.symbol: variable.plain for variable in variables if variable.arguments}
    taken = {variable.name for variable in variables} | {*formulas, "shape", "v"}
    names = (symbol for symbol in sp.numbered_symbols("c") if symbol.name not in taken)
    parts, results = sp.cse([formula.xreplace(plain) for formula in formulas.values()], names)
    for symbol, expression in (*parts, *zip(formulas, results, strict=True)):
        yield str(symbol), printer.doprint(expression)
