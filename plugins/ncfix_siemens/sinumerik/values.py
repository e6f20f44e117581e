"""Expressions of SINUMERIK made into functions, once per shape: numbers, texts, and what is known only at run time.

Angles are degrees. A value that depends on something unknown is None, and so is everything that is made of it.
Source: Siemens, "SINUMERIK 840D sl, NC programming, job planning", arithmetic functions, priority of the operations.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from ncfix.control import arithmetic
from ncfix.control.arithmetic import ARITHMETIC, divide, power
from ncfix.control.faults import Fault
from ncfix.control.scope import BlockNumbers, literal
from ncfix.text.tree import (
    Binary,
    Call,
    Constant,
    Expression,
    Literal,
    NamedParameter,
    Parameter,
    Text,
    Unary,
)
from ncfix_siemens.sinumerik.build import BRACKET
from ncfix_siemens.sinumerik.texts import TEXT_FUNCTIONS, of_texts

Value = float | str | None
"""A number (also for true and false), a text, or None where it is known only at run time."""

Key = str | tuple[str, tuple[float, ...]]
"""A variable, or an element of an array."""

COMPARISONS = frozenset({"==", "<>", ">", "<", ">=", "<="})
EQUAL = 1e-12
"""Relative difference up to which two numbers are equal (MD10280)."""


class Values(Protocol):
    """The variables as expressions see them."""

    def value(self, key: Key) -> Value:
        """The value of a variable, None if nobody knows it."""


class Scope(BlockNumbers, Protocol):
    """What an expression may refer to."""

    @property
    def variables(self) -> Values:
        """The variables."""


Evaluate = Callable[[Scope], Value]


def compiled(expression: Expression) -> Evaluate:
    """The function that computes an expression; it raises `Fault` where the control would stop."""
    match expression:
        case Literal(slot):
            return literal(slot)
        case Constant(value):
            return lambda scope: value
        case Text(text):
            return lambda scope: text
        case Parameter(Constant(number)):
            key = ("r", (number,))
            return lambda scope: scope.variables.value(key)
        case Parameter(index):
            return element("r", (compiled(index),))
        case NamedParameter(name):
            return lambda scope: scope.variables.value(name)
        case Unary(operator, operand):
            return unary(operator, compiled(operand))
        case Binary(operator, left, right):
            return relation(operator, left, right) if operator in COMPARISONS else binary(operator, left, right)
        case Call(name, arguments, indexed):
            parts = tuple(nothing if part is None else compiled(part) for part in arguments)
            return element(name, parts) if indexed else called(name, parts)
    raise AssertionError(f"the grammar of this family has no {type(expression).__name__}")


def nothing(scope: Scope) -> Value:
    """An argument that is left out."""
    return None


def element(name: str, index: tuple[Evaluate, ...]) -> Evaluate:
    """An element of an array."""

    def evaluate(scope: Scope) -> Value:
        places = tuple(number(part(scope)) for part in index)
        if any(place is None for place in places):
            return None
        return scope.variables.value((name, tuple(place for place in places if place is not None)))

    return evaluate


def number(value: Value) -> float | None:
    """A value as a number; texts are none."""
    return value if isinstance(value, float | int) else None


# -- operators --------------------------------------------------------------------------------------------------------


def unary(operator: str, operand: Evaluate) -> Evaluate:
    """A sign, a negation, or brackets."""
    if operator == BRACKET:
        return operand
    if operator == "<<":
        return lambda scope: shown(operand(scope))
    function = {"-": lambda a: -a, "+": lambda a: a, "not": lambda a: float(not a), "b_not": lambda a: float(~int(a))}
    return lambda scope: applied(function[operator], operand(scope))


def applied(function: Callable[..., float], *values: Value) -> float | None:
    """A function of numbers, None where one of them is not known."""
    known = [value for value in map(number, values) if value is not None]
    if len(known) < len(values):
        return None
    result = function(*known)
    if not math.isfinite(result):
        raise Fault(ARITHMETIC, "the result of a calculation is not a finite number")
    return result


OPERATORS: dict[str, Callable[[float, float], float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": divide,
    "div": lambda a, b: float(math.trunc(divide(a, b))),
    "mod": lambda a, b: a - b * math.trunc(divide(a, b)),
    "and": lambda a, b: float(bool(a) and bool(b)),
    "or": lambda a, b: float(bool(a) or bool(b)),
    "xor": lambda a, b: float(bool(a) != bool(b)),
    "b_and": lambda a, b: float(int(a) & int(b)),
    "b_or": lambda a, b: float(int(a) | int(b)),
    "b_xor": lambda a, b: float(int(a) ^ int(b)),
}


def binary(operator: str, left: Expression, right: Expression) -> Evaluate:
    """An operator between two operands; `<<` joins texts."""
    first, second = compiled(left), compiled(right)
    if operator == "<<":
        return lambda scope: joined(first(scope), second(scope))
    function = OPERATORS[operator]
    return lambda scope: applied(function, first(scope), second(scope))


def relation(operator: str, left: Expression, right: Expression) -> Evaluate:
    """A comparison. Of two without brackets, or of a sum of truths, controls and people do not think alike: unknown."""
    if any(is_loose(side) for side in (left, right)):
        return nothing
    first, second = compiled(left), compiled(right)
    return lambda scope: compared(operator, first(scope), second(scope))


def is_loose(side: Expression) -> bool:
    """Whether a side of a comparison is one itself, or a logical operation, without brackets."""
    return isinstance(side, Binary) and side.operator in COMPARISONS | {"and", "or", "xor"}


def compared(operator: str, left: Value, right: Value) -> float | None:
    """Two values compared; 1 for true."""
    if left is None or right is None or isinstance(left, str) != isinstance(right, str):
        return None
    if isinstance(left, str) or isinstance(right, str):
        same, greater = str(left).upper() == str(right).upper(), str(left).upper() > str(right).upper()
    else:
        same = abs(left - right) <= EQUAL * max(abs(left), abs(right))
        greater = not same and left > right
    truth = {"==": same, "<>": not same, ">": greater, "<=": not greater, ">=": greater or same}
    return float(truth.get(operator, not greater and not same))


def shown(value: Value) -> Value:
    """A value as the text that `<<` makes of it."""
    return value if value is None or isinstance(value, str) else f"{value:.15g}"


def joined(left: Value, right: Value) -> Value:
    """Two texts as one."""
    first, second = shown(left), shown(right)
    return None if first is None or second is None else f"{first}{second}"


# -- functions --------------------------------------------------------------------------------------------------------


FUNCTIONS: dict[str, tuple[Callable[..., float], int]] = {
    **{name: (function, 1) for name, function in arithmetic.FUNCTIONS.items()},
    "atan2": (lambda y, x: math.degrees(math.atan2(y, x)), 2),
    "pot": (lambda a: power(a, 2.0), 1),
    "trunc": (lambda a: float(math.trunc(a)), 1),
    "round": (lambda a: float(math.floor(a + 0.5)), 1),
    "roundup": (lambda a: float(math.ceil(a)), 1),
    "minval": (min, 2),
    "maxval": (max, 2),
    "bound": (lambda low, high, a: min(max(low, a), high), 3),
}
"""Name -> the function and how many arguments it takes; angles are degrees."""


def called(name: str, arguments: tuple[Evaluate, ...]) -> Evaluate:
    """A function; what is none of ours gives a value that only the control knows."""
    if name in TEXT_FUNCTIONS:
        return lambda scope: of_texts(name, tuple(argument(scope) for argument in arguments))
    function, count = FUNCTIONS.get(name, (None, 0))
    if function is None:
        return nothing
    if len(arguments) != count:

        def wrong(scope: Scope) -> Value:
            raise Fault(ARITHMETIC, f"{name.upper()} takes {count} argument{'s' if count > 1 else ''}")

        return wrong
    return lambda scope: applied(function, *(argument(scope) for argument in arguments))
