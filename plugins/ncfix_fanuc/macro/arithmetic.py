"""The expressions of Macro B made into functions, once per shape.

A variable that was never set is vacant, and NaN stands for that here: copied as it is, zero in arithmetic, and equal
to nothing but another vacant one. Source: Fanuc 30i operator's manual, "Custom macro", "Variables" and "Arithmetic and
logic operation".
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol, cast

from ncfix.control.arithmetic import ARITHMETIC, FUNCTIONS, divide, power
from ncfix.control.faults import Fault
from ncfix.control.scope import literal
from ncfix.text.tree import Binary, Constant, Expression, Literal, Parameter, Unary
from ncfix_iso.rs274.expressions import Evaluate, Scope

VACANT = math.nan
"""The value of a variable that has none."""

NEARLY = 1e-8
"""Numbers that differ by less, relative to their size, may be equal to a control with other rounding."""


def number(value: float) -> float:
    """A value in arithmetic: vacant counts as zero."""
    return 0.0 if math.isnan(value) else value


def whole_number(value: float) -> int:
    """The whole number that a bit operation works on."""
    return math.floor(value + 0.5)


def truncated(value: float) -> float:
    """FIX: towards zero."""
    return float(math.trunc(value))


def raised(value: float) -> float:
    """FUP: away from zero."""
    return math.copysign(math.ceil(abs(value)), value)


def rounded(value: float) -> float:
    """ROUND: to the nearest whole number, halves away from zero."""
    return math.copysign(math.floor(abs(value) + 0.5), value)


def from_bcd(value: float) -> float:
    """BIN: the number whose decimal digits are the hexadecimal ones of `value`."""
    try:
        return float(int(f"{whole_number(value):x}"))
    except ValueError:
        raise Fault(ARITHMETIC, f"BIN of {value:g}: it is no binary coded decimal") from None


def to_bcd(value: float) -> float:
    """BCD: the number whose hexadecimal digits are the decimal ones of `value`."""
    return float(int(str(whole_number(value)), 16))


def remainder(left: float, right: float) -> float:
    """`left MOD right`, with the sign of `left`."""
    if right == 0.0:
        raise Fault(ARITHMETIC, "MOD by zero")
    return math.fmod(left, right)


def arc_tangent(y: float, x: float) -> float:
    """`ATAN[y]/[x]` in degrees, from 0 to 360 (the control's parameter NAT at 0)."""
    if x == 0.0 and y == 0.0:
        raise Fault(ARITHMETIC, "ATAN of zero by zero")
    return math.degrees(math.atan2(y, x)) % 360.0


UNARY: dict[str, Callable[[float], float]] = {
    **FUNCTIONS,
    "-": lambda a: -a,
    "+": lambda a: a,
    "adp": lambda a: a,
    "atan": lambda a: math.degrees(math.atan(a)),
    "bcd": to_bcd,
    "bin": from_bcd,
    "fix": truncated,
    "fup": raised,
    "rnd": rounded,
    "round": rounded,
}

BINARY: dict[str, Callable[[float, float], float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": divide,
    "mod": remainder,
    "**": power,
    "pow": power,
    "and": lambda a, b: float(whole_number(a) & whole_number(b)),
    "or": lambda a, b: float(whole_number(a) | whole_number(b)),
    "xor": lambda a, b: float(whole_number(a) ^ whole_number(b)),
    "lt": lambda a, b: float(a < b),
    "gt": lambda a, b: float(a > b),
    "le": lambda a, b: float(a <= b),
    "ge": lambda a, b: float(a >= b),
    "atan": arc_tangent,
}

RELATIONS = frozenset({"eq", "ne", "lt", "gt", "le", "ge"})


def equal(left: float, right: float) -> bool:
    """EQ: a vacant variable equals a vacant one only."""
    if math.isnan(left) or math.isnan(right):
        return math.isnan(left) and math.isnan(right)
    return left == right


def relation(operator: str, left: float, right: float) -> float:
    """1 if it holds, else 0."""
    if operator in ("eq", "ne"):
        return float(equal(left, right) == (operator == "eq"))
    return BINARY[operator](number(left), number(right))


def in_doubt(left: float, right: float) -> bool:
    """Whether the two differ by no more than rounding may do."""
    return left != right and abs(left - right) <= NEARLY * max(abs(left), abs(right))


def compiled(expression: Expression, address: str = "") -> Evaluate:
    """The function that computes an expression, which stands behind `address` if that is given.

    It raises `Fault` where the control would stop. In an address ROUND rounds to the least increment.
    """
    match expression:
        case Literal(slot):
            return literal(slot)
        case Constant(value):
            return lambda scope: value
        case Parameter(index):
            which = compiled(index)
            return lambda scope: scope.parameters.numbered(variable_number(which(scope)))
        case Unary(operator, operand):
            return unary(operator, compiled(operand, address), address)
        case Binary(operator, left, right):
            return binary(operator, compiled(left, address), compiled(right, address))
    raise AssertionError("the grammar has no other expressions")


def variable_number(value: float) -> int:
    """The number of a variable."""
    index = number(value)
    if abs(index - round(index)) > 0.001:
        raise Fault(ARITHMETIC, f"the number of a variable is {value:g}, and must be a whole number")
    return round(index)


def unary(operator: str, operand: Evaluate, address: str) -> Evaluate:
    """A sign or a function of one argument; a sign leaves a vacant value vacant."""
    function = UNARY[operator]
    if operator in "+-":
        return lambda scope: function(operand(scope))
    if operator == "round" and address in ROUNDED:
        return lambda scope: to_increments(number(operand(scope)), scope, address)
    return lambda scope: function(number(operand(scope)))


ROUNDED = frozenset("XYZABCUVWIJKRQ")
"""Addresses in which ROUND works to the least increment."""


class MacroScope(Scope, Protocol):
    """The scope of this family's expressions."""

    def least_increment(self, address: str) -> float:
        """The least increment of an address, in its own unit."""


def to_increments(value: float, scope: Scope, address: str) -> float:
    """`ROUND` in a word: to the least increment of its address."""
    increment = cast(MacroScope, scope).least_increment(address)
    return rounded(value / increment) * increment


def binary(operator: str, left: Evaluate, right: Evaluate) -> Evaluate:
    """An operator between two operands, or a function of two."""
    if operator in RELATIONS:
        return comparison(operator, left, right)
    function = BINARY[operator]

    def evaluate(scope: Scope) -> float:
        value = function(number(left(scope)), number(right(scope)))
        if not math.isfinite(value):
            raise Fault(ARITHMETIC, f"the result of {operator} is not a finite number")
        return value

    return evaluate


def comparison(operator: str, left: Evaluate, right: Evaluate) -> Evaluate:
    """A relation. Where rounding decides it, it is marked as known at run time only."""

    def evaluate(scope: Scope) -> float:
        a, b = left(scope), right(scope)
        if in_doubt(a, b):
            scope.parameters.touched = True
        return relation(operator, a, b)

    return evaluate
