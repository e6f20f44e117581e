"""Symbolic machine: exact nominal formulas and error formulas of any serial chain. Needs the extra `symbolic` (sympy).

After C. Freeman and D. G. Ford, Automated error analysis of serial manipulators and servo heads, Proc. IMechE C 217
(2003) 1077-1084. Importing this package without sympy raises `UsageError` NCF390.
"""

from ncfix.machine.symbolic.extra import require_sympy

require_sympy()

from ncfix.machine.symbolic.api import derive  # noqa: E402
from ncfix.machine.symbolic.chain import Chain  # noqa: E402
from ncfix.machine.symbolic.chain_file import load_chain, loads_chain  # noqa: E402
from ncfix.machine.symbolic.derivation import Derivation  # noqa: E402
from ncfix.machine.symbolic.from_machine import from_machine  # noqa: E402
from ncfix.machine.symbolic.identify import Identifiable, identifiable  # noqa: E402
from ncfix.machine.symbolic.inverse import Inverse, inverse_nominal  # noqa: E402
from ncfix.machine.symbolic.measuring import measuring  # noqa: E402
from ncfix.machine.symbolic.protocol import Equation, Identification, equations, protocol  # noqa: E402
from ncfix.machine.symbolic.variables import Size, Variable  # noqa: E402

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
]
