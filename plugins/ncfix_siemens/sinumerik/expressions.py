"""The expressions of SINUMERIK: numbers and texts.

Angles are degrees; places in a text count from zero.
Source: Siemens, "SINUMERIK 840D sl, NC programming, job planning", arithmetic functions, priority of the operations,
string operations.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from ncfix.control.expressions import (
    FUNCTIONS,
    SUMS,
    Evaluate,
    Expressions,
    Scope,
    Unknown,
    Value,
    divide,
    left_out,
    number,
    power,
)
from ncfix.text.tree import Binary, Constant, Expression, NumberedParameter
from ncfix_siemens.sinumerik.build import BRACKET

Key = str | tuple[str, tuple[float, ...]]
"""A variable, or an element of an array."""

COMPARISONS = frozenset({"==", "<>", ">", "<", ">=", "<="})
EQUAL = 1e-12
"""Relative difference up to which two numbers are equal (MD10280)."""

OPERATORS: dict[str, Callable[[float, float], float]] = {
    **SUMS,
    "div": lambda a, b: float(math.trunc(divide(a, b))),
    "mod": lambda a, b: a - b * math.trunc(divide(a, b)),
    "and": lambda a, b: float(bool(a) and bool(b)),
    "or": lambda a, b: float(bool(a) or bool(b)),
    "xor": lambda a, b: float(bool(a) != bool(b)),
    "b_and": lambda a, b: float(int(a) & int(b)),
    "b_or": lambda a, b: float(int(a) | int(b)),
    "b_xor": lambda a, b: float(int(a) ^ int(b)),
}

FUNCTIONS_OF_NUMBERS: dict[str, tuple[Callable[..., float], int]] = {
    **FUNCTIONS,
    "not": (lambda a: float(not a), 1),
    "b_not": (lambda a: float(~int(a)), 1),
    "atan2": (lambda y, x: math.degrees(math.atan2(y, x)), 2),
    "pot": (lambda a: power(a, 2.0), 1),
    "trunc": (lambda a: float(math.trunc(a)), 1),
    "round": (lambda a: float(math.floor(a + 0.5)), 1),
    "roundup": (lambda a: float(math.ceil(a)), 1),
    "minval": (min, 2),
    "maxval": (max, 2),
    "bound": (lambda low, high, a: min(max(low, a), high), 3),
}


def substring(text: str, start: float, length: float | None = None) -> str:
    """`SUBSTR`."""
    first = int(start)
    return text[first:] if length is None else text[first : first + int(length)]


def as_number(text: str) -> float | None:
    """`NUMBER`, None where the control would stop."""
    try:
        return float(text.upper().replace("EX", "E"))
    except ValueError:
        return None


TEXT_FUNCTIONS: dict[str, tuple[Callable[..., Value | None], tuple[type, ...], int]] = {
    "strlen": (lambda text: float(len(text)), (str,), 1),
    "toupper": (str.upper, (str,), 1),
    "tolower": (str.lower, (str,), 1),
    "substr": (substring, (str, float, float), 2),
    "index": (lambda text, part: float(text.find(part[:1])), (str, str), 2),
    "rindex": (lambda text, part: float(text.rfind(part[:1])), (str, str), 2),
    "match": (lambda text, part: float(text.find(part)), (str, str), 2),
    "isnumber": (lambda text: float(as_number(text) is not None), (str,), 1),
    "number": (as_number, (str,), 1),
}
"""Name -> the function, the types of its arguments, and how many of them it needs."""


def of_texts(name: str, values: tuple[Value, ...]) -> Value:
    """The value of a function of texts; unknown where an argument is not known or of another type."""
    function, types, least = TEXT_FUNCTIONS[name]
    fits = least <= len(values) <= len(types)
    if not fits or any(not isinstance(value, kind) for value, kind in zip(values, types, strict=False)):
        return Unknown()
    found = function(*values)
    return Unknown() if found is None else found


class VariableExpressions(Expressions):
    """SINUMERIK: R parameters, variables, arrays and texts; scopes have `variables`."""

    operators = OPERATORS
    functions = FUNCTIONS_OF_NUMBERS
    impossible = "the result of a calculation is not a finite number"

    def compiled(self, expression: Expression, address: str = "") -> Evaluate:
        """As everywhere; an R parameter with a plain number is found at once."""
        if isinstance(expression, NumberedParameter) and isinstance(expression.index, Constant):
            key = ("r", (expression.index.value,))
            return lambda scope: scope.variables.value(key)
        return super().compiled(expression, address)

    def numbered(self, index: Evaluate) -> Evaluate:
        """`R[...]`."""
        return self.element("r", (index,))

    def named(self, name: str) -> Evaluate:
        """A variable."""
        return lambda scope: scope.variables.value(name)

    def element(self, name: str, index: tuple[Evaluate, ...]) -> Evaluate:
        """An element of an array."""

        def evaluate(scope: Scope) -> Value:
            places = tuple(number(part(scope)) for part in index)
            if None in places:
                return Unknown()
            value: Value = scope.variables.value((name, places))  # type: ignore[attr-defined]
            return value

        return evaluate

    def function(self, name: str, arguments: tuple[Evaluate, ...], address: str = "") -> Evaluate:
        """Brackets, functions of numbers and of texts; what is none of ours has a value that only the control knows."""
        if name == BRACKET:
            return arguments[0]
        if name == "<<":
            return lambda scope: shown(arguments[0](scope))
        if name in TEXT_FUNCTIONS:
            return lambda scope: of_texts(name, tuple(argument(scope) for argument in arguments))
        return super().function(name, arguments, address) if name in self.functions else left_out

    def operator(self, operator: str, left: Expression, right: Expression, address: str = "") -> Evaluate:
        """An operator between two operands; `<<` joins texts.

        Of a comparison of two without brackets, or of a sum of truths, controls and people do not think alike: unknown.
        """
        if operator == "<<":
            first, second = self.compiled(left), self.compiled(right)
            return lambda scope: joined(first(scope), second(scope))
        if operator not in COMPARISONS:
            return super().operator(operator, left, right, address)
        if any(is_loose(side) for side in (left, right)):
            return left_out
        first, second = self.compiled(left), self.compiled(right)
        return lambda scope: compared(operator, first(scope), second(scope))


def is_loose(side: Expression) -> bool:
    """Whether a side of a comparison is one itself, or a logical operation, without brackets."""
    return isinstance(side, Binary) and side.operator in COMPARISONS | {"and", "or", "xor"}


def compared(operator: str, left: Value, right: Value) -> Value:
    """Two values compared; 1 for true."""
    if isinstance(left, Unknown) or isinstance(right, Unknown) or isinstance(left, str) != isinstance(right, str):
        return Unknown()
    if isinstance(left, str) or isinstance(right, str):
        same, greater = str(left).upper() == str(right).upper(), str(left).upper() > str(right).upper()
    else:
        same = abs(left - right) <= EQUAL * max(abs(left), abs(right))
        greater = not same and left > right
    truth = {"==": same, "<>": not same, ">": greater, "<=": not greater, ">=": greater or same}
    return float(truth.get(operator, not greater and not same))


def shown(value: Value) -> Value:
    """A value as the text that `<<` makes of it."""
    return value if isinstance(value, Unknown | str) else f"{value:.15g}"


def joined(left: Value, right: Value) -> Value:
    """Two texts as one."""
    first, second = shown(left), shown(right)
    return Unknown() if isinstance(first, Unknown) or isinstance(second, Unknown) else f"{first}{second}"


compiled = VariableExpressions().compiled
