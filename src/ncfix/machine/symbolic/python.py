"""Formulas as Python source: two functions of numpy arrays, common subexpressions taken out, variables declared."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence

import sympy as sp
from sympy.printing.numpy import NumPyPrinter

from ncfix.machine.symbolic.derivation import COMPONENTS, DIRECTION, POSITION, Derivation
from ncfix.machine.symbolic.text import MEANINGS, ordinal, variable_table
from ncfix.machine.symbolic.variables import Variable

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
