"""sympy is an optional part of ncfix: it is asked for here, before anything of this package uses it."""

from __future__ import annotations

from importlib.util import find_spec

from ncfix.diagnostics import UsageError


def require_sympy() -> None:
    """Raise `UsageError` NCF390 unless sympy is installed."""
    if find_spec("sympy") is None:
        text = "symbolic formulas need sympy, which is not installed"
        raise UsageError.of("NCF390", text, hint='pip install "ncfix[symbolic]"')
