"""Q parameters: their values, and the formulas of Klartext.

Source: TNC 640 user's manual, "Q parameters"; angles are degrees. A parameter that the program has not set holds
whatever an earlier program left in it: it is known only at run time, and so is all that is computed from it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from ncfix.control.expressions import FUNCTIONS, SUMS, Evaluate, Expressions, Unknown, Value, nominal

EQUAL = 1e-9
"""Two numbers are equal that differ by less."""


@dataclass(slots=True)
class QParameters:
    """The Q parameters; QL parameters belong to one program, the others to all.

    values   those that the program has set, or the setup gives
    changes  how often a parameter has got another value
    """

    values: dict[str, Value] = field(default_factory=dict)
    changes: int = 0

    def get(self, name: str) -> Value:
        """The value of a parameter; one that was never set is unknown."""
        value = self.values.get(name, Unknown(name))
        return Unknown(name, value.nominal) if isinstance(value, Unknown) else value

    def assign(self, name: str, value: float, runtime: bool = False) -> None:
        """Set a parameter."""
        self.changes += name not in self.values or nominal(self.values[name]) != value or runtime
        self.values[name] = Unknown(name, value) if runtime else value

    def enter(self) -> dict[str, Value]:
        """A program is called: it has QL parameters of its own. Returns those of the caller, for `leave`."""
        return {name: self.values.pop(name) for name in [name for name in self.values if name.startswith("QL")]}

    def leave(self, own: Mapping[str, Value]) -> None:
        """The called program is over."""
        self.enter()
        for name, value in own.items():
            self.assign(name, nominal(value), isinstance(value, Unknown))


@dataclass(slots=True)
class FormulaScope:
    """What a formula may refer to: the numbers of the program, where those of the block begin, and the parameters."""

    numbers: Sequence[float] = ()
    first: int = 0
    parameters: QParameters = field(default_factory=QParameters)

    def value_of(self, function: Evaluate) -> tuple[float, bool]:
        """The value of a formula, nominal where it is known only at run time, and whether it is; raises `Fault`."""
        value = function(self)
        return nominal(value), isinstance(value, Unknown)


OPERATORS: dict[str, Callable[[float, float], float]] = {
    **SUMS,
    "/": lambda a, b: a / b,
    "div": lambda a, b: a / b,
    "%": math.fmod,
    "^": lambda a, b: a**b,
    "len": math.hypot,
    "ang": lambda a, b: math.degrees(math.atan2(a, b)) % 360.0,
    "equ": lambda a, b: float(abs(a - b) < EQUAL),
    "ne": lambda a, b: float(abs(a - b) >= EQUAL),
    "gt": lambda a, b: float(a > b),
    "lt": lambda a, b: float(a < b),
}
"""`a ANG b` is the angle whose sine side is `a` and whose cosine side is `b`."""

FUNCTIONS_OF_FORMULAS: dict[str, tuple[Callable[..., float], int]] = {
    **FUNCTIONS,
    "pi": (lambda: math.pi, 0),
    "neg": (lambda a: -a, 1),
    "asin": (lambda a: math.degrees(math.asin(a)), 1),
    "acos": (lambda a: math.degrees(math.acos(a)), 1),
    "atan": (lambda a: math.degrees(math.atan(a)), 1),
    "sqrt": (math.sqrt, 1),
    "sq": (lambda a: a * a, 1),
    "int": (lambda a: float(math.trunc(a)), 1),
    "frac": (lambda a: a - math.trunc(a), 1),
    "exp": (math.exp, 1),
    "ln": (math.log, 1),
    "log": (math.log10, 1),
    "sgn": (lambda a: float((a > 0) - (a < 0)), 1),
}


class QExpressions(Expressions):
    """Formulas of Q parameters."""

    operators = OPERATORS
    functions = FUNCTIONS_OF_FORMULAS
    impossible = "{} cannot be computed here"

    def text(self, text: str) -> Evaluate:
        """A string, or a word such as AUTO: no number."""
        return lambda scope: Unknown(text)

    def named(self, name: str) -> Evaluate:
        """A Q parameter."""
        return lambda scope: scope.parameters.get(name)


compiled = QExpressions().compiled
