"""The expressions of Macro B.

A variable that was never set is vacant, and NaN stands for that here: copied as it is, zero in arithmetic, and equal
to nothing but another vacant one. Source: Fanuc 30i operator's manual, "Custom macro", "Variables" and "Arithmetic and
logic operation".
"""

from __future__ import annotations

import math
from collections.abc import Callable

from ncfix.control.expressions import (
    ARITHMETIC,
    FUNCTIONS,
    SUMS,
    Evaluate,
    Expressions,
    Fault,
    Scope,
    Unknown,
    Value,
    nominal,
    power,
    remainder,
    scaled,
)
from ncfix.text.tree import Expression

VACANT = math.nan
"""The value of a variable that has none."""

NEARLY = 1e-8
"""Numbers that differ by less, relative to their size, may be equal to a control with other rounding."""

ROUNDED = frozenset("XYZABCUVWIJKRQ")
"""Addresses in which ROUND works to the least increment."""


def number(value: float) -> float:
    """A value in arithmetic: vacant counts as zero."""
    return 0.0 if math.isnan(value) else value


def is_vacant(value: Value) -> bool:
    """Whether a value is that of a vacant variable."""
    return math.isnan(nominal(value))


def variable_number(value: float) -> int:
    """The number of a variable."""
    index = number(value)
    if abs(index - round(index)) > 0.001:
        raise Fault(ARITHMETIC, f"the number of a variable is {value:g}, and must be a whole number")
    return round(index)


def whole_number(value: float) -> int:
    """The whole number that a bit operation works on."""
    return math.floor(value + 0.5)


def rounded(value: float) -> float:
    """ROUND: to the nearest whole number, halves away from zero."""
    return math.copysign(math.floor(abs(value) + 0.5), value)


def from_bcd(value: float) -> float:
    """BIN: the number whose decimal digits are the hexadecimal ones of `value`."""
    try:
        return float(int(f"{whole_number(value):x}"))
    except ValueError:
        raise Fault(ARITHMETIC, f"BIN of {value:g}: it is no binary coded decimal") from None


def arc_tangent(y: float, x: float) -> float:
    """`ATAN[y]/[x]` in degrees, from 0 to 360 (the control's parameter NAT at 0)."""
    if x == 0.0 and y == 0.0:
        raise Fault(ARITHMETIC, "ATAN of zero by zero")
    return math.degrees(math.atan2(y, x)) % 360.0


RELATIONS: dict[str, Callable[[float, float], bool]] = {
    "eq": lambda a, b: math.isnan(a) and math.isnan(b) if math.isnan(a) or math.isnan(b) else a == b,
    "ne": lambda a, b: not RELATIONS["eq"](a, b),
    "lt": lambda a, b: number(a) < number(b),
    "gt": lambda a, b: number(a) > number(b),
    "le": lambda a, b: number(a) <= number(b),
    "ge": lambda a, b: number(a) >= number(b),
}
"""EQ and NE: a vacant variable equals a vacant one only."""


OPERATORS: dict[str, Callable[[float, float], float]] = {
    **SUMS,
    "mod": remainder,
    "**": power,
    "pow": power,
    "and": lambda a, b: float(whole_number(a) & whole_number(b)),
    "or": lambda a, b: float(whole_number(a) | whole_number(b)),
    "xor": lambda a, b: float(whole_number(a) ^ whole_number(b)),
    "atan": arc_tangent,
}

FUNCTIONS_OF_MACROS: dict[str, tuple[Callable[..., float], int]] = {
    **FUNCTIONS,
    "adp": (lambda a: a, 1),
    "atan": (lambda a: math.degrees(math.atan(a)), 1),
    "bcd": (lambda a: float(int(str(whole_number(a)), 16)), 1),
    "bin": (from_bcd, 1),
    "fix": (lambda a: float(math.trunc(a)), 1),
    "fup": (lambda a: math.copysign(math.ceil(abs(a)), a), 1),
    "rnd": (rounded, 1),
    "round": (rounded, 1),
}


class MacroExpressions(Expressions):
    """Macro B: `#1`, `#[...]`, `[...]`; scopes have `parameters` and `least_increment(address)`."""

    operators = OPERATORS
    functions = FUNCTIONS_OF_MACROS

    def operand(self, value: float) -> float:
        """A vacant variable counts as zero."""
        return number(value)

    def numbered(self, index: Evaluate) -> Evaluate:
        """`#1`, `#[...]`; which one may itself be unknown."""

        def evaluate(scope: object) -> Value:
            which = index(scope)
            value: Value = scope.parameters.numbered(variable_number(nominal(which)))  # type: ignore[attr-defined]
            return Unknown(which.why, nominal(value)) if isinstance(which, Unknown) else value

        return evaluate

    def function(self, name: str, arguments: tuple[Evaluate, ...], address: str = "") -> Evaluate:
        """A sign leaves a vacant value vacant; in an address ROUND rounds to the least increment."""
        (operand,) = arguments
        if name in "+-":
            sign = -1.0 if name == "-" else 1.0
            return lambda scope: scaled(sign, operand(scope))
        if name != "round" or address not in ROUNDED:
            return super().function(name, arguments, address)

        def to_increments(scope: Scope) -> Value:
            increment = scope.least_increment(address)  # type: ignore[attr-defined]
            return self.applied(name, lambda value: rounded(value / increment) * increment, operand(scope))

        return to_increments

    def operator(self, operator: str, left: Expression, right: Expression, address: str = "") -> Evaluate:
        """As everywhere; where rounding decides a relation, it is unknown."""
        relation = RELATIONS.get(operator)
        if relation is None:
            return super().operator(operator, left, right, address)
        first, second = self.compiled(left, address), self.compiled(right, address)

        def evaluate(scope: Scope) -> Value:
            one, other = first(scope), second(scope)
            a, b = nominal(one), nominal(other)
            holds = float(relation(a, b))
            in_doubt = a != b and abs(a - b) <= NEARLY * max(abs(a), abs(b))
            if in_doubt or isinstance(one, Unknown) or isinstance(other, Unknown):
                return Unknown("", holds)
            return holds

        return evaluate


compiled = MacroExpressions().compiled
