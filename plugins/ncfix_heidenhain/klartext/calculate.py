"""Q parameters: their values, and formulas made into functions, once per shape.

Source: TNC 640 user's manual, "Q parameters"; angles are degrees. A parameter that the program has not set holds
whatever an earlier program left in it: it is known only at run time, and so is all that is computed from it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from ncfix.control.arithmetic import ARITHMETIC
from ncfix.control.faults import Fault
from ncfix.control.scope import literal
from ncfix.text.tree import Binary, Call, Constant, Expression, Literal, NamedParameter, Text, Unary

EQUAL = 1e-9
"""Two numbers are equal that differ by less."""


@dataclass(slots=True)
class Parameters:
    """The Q parameters; QL parameters belong to one program, the others to all.

    values   those that the program has set, or the setup gives
    runtime  those of them that were computed from what is known only at run time
    touched  such a value has been read since this was last cleared, or one that was never set
    lacking  the name of the last one that was
    changes  how often a parameter has got another value
    """

    values: dict[str, float] = field(default_factory=dict)
    runtime: set[str] = field(default_factory=set)
    touched: bool = False
    lacking: str = ""
    changes: int = 0

    def get(self, name: str) -> float:
        """The value of a parameter; 0 where it is not known."""
        if name not in self.values or name in self.runtime:
            self.touched = True
            self.lacking = name
        return self.values.get(name, 0.0)

    def assign(self, name: str, value: float, runtime: bool = False) -> None:
        """Set a parameter."""
        self.changes += self.values.get(name) != value or runtime
        self.values[name] = value
        (self.runtime.add if runtime else self.runtime.discard)(name)

    def enter(self) -> dict[str, tuple[float, bool]]:
        """A program is called: it has QL parameters of its own. Returns those of the caller, for `leave`."""
        own = {name: (value, name in self.runtime) for name, value in self.values.items() if name.startswith("QL")}
        for name in own:
            del self.values[name]
        return own

    def leave(self, own: Mapping[str, tuple[float, bool]]) -> None:
        """The called program is over."""
        self.enter()
        for name, (value, runtime) in own.items():
            self.assign(name, value, runtime)


@dataclass(slots=True)
class Scope:
    """What a formula may refer to: the numbers of the program, where those of the block begin, and the parameters."""

    numbers: Sequence[float] = ()
    first: int = 0
    parameters: Parameters = field(default_factory=Parameters)

    def value_of(self, function: Evaluate) -> tuple[float, bool]:
        """The value of a formula, and whether it is known only at run time; raises `Fault`."""
        self.parameters.touched = False
        value = function(self)
        return value, self.parameters.touched


Evaluate = Callable[[Scope], float]


def degrees_of(left: float, right: float) -> float:
    """`left ANG right`: the angle whose sine side is `left` and whose cosine side is `right`."""
    return math.degrees(math.atan2(left, right)) % 360.0


UNARY: Mapping[str, Callable[[float], float]] = {
    "+": lambda x: x,
    "-": lambda x: -x,
    "neg": lambda x: -x,
    "sin": lambda x: math.sin(math.radians(x)),
    "cos": lambda x: math.cos(math.radians(x)),
    "tan": lambda x: math.tan(math.radians(x)),
    "asin": lambda x: math.degrees(math.asin(x)),
    "acos": lambda x: math.degrees(math.acos(x)),
    "atan": lambda x: math.degrees(math.atan(x)),
    "sqrt": math.sqrt,
    "sq": lambda x: x * x,
    "abs": abs,
    "int": lambda x: float(math.trunc(x)),
    "frac": lambda x: x - math.trunc(x),
    "exp": math.exp,
    "ln": math.log,
    "log": math.log10,
    "sgn": lambda x: float((x > 0) - (x < 0)),
}
BINARY: Mapping[str, Callable[[float, float], float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "div": lambda a, b: a / b,
    "%": math.fmod,
    "^": lambda a, b: a**b,
    "len": math.hypot,
    "ang": degrees_of,
    "equ": lambda a, b: float(abs(a - b) < EQUAL),
    "ne": lambda a, b: float(abs(a - b) >= EQUAL),
    "gt": lambda a, b: float(a > b),
    "lt": lambda a, b: float(a < b),
}


def compiled(expression: Expression) -> Evaluate:
    """The function that computes a formula; it raises `Fault` where the control would stop."""
    match expression:
        case Literal(slot):
            return literal(slot)
        case Constant(value):
            return lambda scope: value
        case NamedParameter(name):
            return lambda scope: scope.parameters.get(name)
        case Call("pi"):
            return lambda scope: math.pi
        case Unary(operator, operand):
            return computed(operator, UNARY[operator], compiled(operand))
        case Binary(operator, left, right):
            return computed(operator, BINARY[operator], compiled(left), compiled(right))
        case Text():
            return unknown_text
    raise AssertionError(f"Klartext has no {type(expression).__name__}")


def computed(operator: str, function: Callable[..., float], *operands: Evaluate) -> Evaluate:
    """An operator and its operands. Where an operand is known only at run time, an impossible result is none, too."""

    def evaluate(scope: Scope) -> float:
        values = [operand(scope) for operand in operands]
        try:
            result = function(*values)
        except (ValueError, ArithmeticError):
            result = math.nan
        if not isinstance(result, float) or not math.isfinite(result):
            if scope.parameters.touched:
                return 0.0
            raise Fault(ARITHMETIC, f"{operator.upper()} cannot be computed here")
        return result

    return evaluate


def unknown_text(scope: Scope) -> float:
    """A string, or a word such as AUTO: no number."""
    scope.parameters.touched = True
    return 0.0
