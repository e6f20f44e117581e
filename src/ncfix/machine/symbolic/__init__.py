"""Symbolic machine: exact nominal formulas and error formulas of any serial chain. Needs the extra `symbolic` (sympy).

After C. Freeman and D. G. Ford, Automated error analysis of serial manipulators and servo heads, Proc. IMechE C 217
(2003) 1077-1084. Importing this package without sympy raises `UsageError` NCF390.
"""

from importlib.util import find_spec

from ncfix.diagnostics import UsageError


def require_sympy() -> None:
    """Raise `UsageError` NCF390 unless sympy is installed."""
    if find_spec("sympy") is None:
        text = "symbolic formulas need sympy, which is not installed"
        raise UsageError.of("NCF390", text, hint='pip install "ncfix[symbolic]"')


require_sympy()

from ncfix.machine.symbolic.chain import Chain, Size, Variable  # noqa: E402
from ncfix.machine.symbolic.chain_file import load_chain, loads_chain  # noqa: E402
from ncfix.machine.symbolic.derivation import Derivation, derive  # noqa: E402
from ncfix.machine.symbolic.from_machine import from_machine  # noqa: E402
from ncfix.machine.symbolic.identification import (  # noqa: E402
    Equation,
    Identifiable,
    Identification,
    equations,
    identifiable,
    measuring,
    protocol,
)
from ncfix.machine.symbolic.inverse import Inverse, inverse_nominal  # noqa: E402
from ncfix.machine.symbolic.printing import to_c, to_latex, to_python, to_text  # noqa: E402

__all__ = [
    "Chain",
    "Derivation",
    "Equation",
    "Identifiable",
    "Identification",
    "Inverse",
    "Size",
    "Variable",
    "derive",
    "equations",
    "from_machine",
    "identifiable",
    "inverse_nominal",
    "load_chain",
    "loads_chain",
    "measuring",
    "protocol",
    "to_c",
    "to_latex",
    "to_python",
    "to_text",
]
