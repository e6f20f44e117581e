"""The expressions of RS274NGC, as LinuxCNC computes them.

Source: LinuxCNC documentation, "G-code overview", "Binary operators" and "Functions"; angles are degrees. Since
version 2.9.1 numbers are equal that differ by less than 1e-6, and `le` and `ge` hold for equal ones. Before, `eq` and
`ne` had 0.0001, and `le` and `ge` were exact. `lt` and `gt` are exact in all (LinuxCNC, pull request 2525).
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
    Unknown,
    Value,
    nominal,
    power,
    remainder,
)
from ncfix.text.tree import NamedParameter, NumberedParameter

EQUAL = 1e-6
"""Two numbers are equal that differ by less."""

FORMERLY_EQUAL = 1e-4
"""The same for `eq` and `ne` before 2.9.1."""


def modulo(left: float, right: float) -> float:
    """`left MOD right`, never negative."""
    rest = remainder(left, right)
    return rest + abs(right) if rest < 0.0 else rest


def whole(value: float, what: str) -> int:
    """A number that must be a whole one, as an index or a label; LinuxCNC allows 0.0001 off."""
    nearest = math.floor(value)
    if value - nearest > 0.9999:
        return nearest + 1
    if value - nearest > 0.0001:
        raise Fault(ARITHMETIC, f"{what} is {value:g}, and must be a whole number")
    return nearest


def number_of(value: Value) -> int:
    """The number of a parameter."""
    return whole(nominal(value), "the number of a parameter")


OPERATORS: dict[str, Callable[[float, float], float]] = {
    **SUMS,
    "mod": modulo,
    "**": power,
    "and": lambda a, b: float(a != 0.0 and b != 0.0),
    "or": lambda a, b: float(a != 0.0 or b != 0.0),
    "xor": lambda a, b: float((a != 0.0) != (b != 0.0)),
    "eq": lambda a, b: float(abs(a - b) < EQUAL),
    "ne": lambda a, b: float(abs(a - b) >= EQUAL),
    "lt": lambda a, b: float(a < b),
    "gt": lambda a, b: float(a > b),
    "le": lambda a, b: float(a <= b or abs(a - b) < EQUAL),
    "ge": lambda a, b: float(a >= b or abs(a - b) < EQUAL),
    "atan": lambda y, x: math.degrees(math.atan2(y, x)),
}

FUNCTIONS_OF_PARAMETERS: dict[str, tuple[Callable[..., float], int]] = {
    **FUNCTIONS,
    "fix": (lambda a: float(math.floor(a)), 1),
    "fup": (lambda a: float(math.ceil(a)), 1),
    "round": (lambda a: float(math.trunc(a + math.copysign(0.5, a))), 1),
}


class ParameterExpressions(Expressions):
    """RS274NGC: `#1`, `#<name>`, `[...]`; scopes have `parameters`."""

    operators = OPERATORS
    functions = FUNCTIONS_OF_PARAMETERS

    def in_doubt(self, operator: str, left: float, right: float) -> bool:
        """Whether a comparison comes out otherwise in older versions of the control."""
        match operator:
            case "eq" | "ne":
                return EQUAL <= abs(left - right) < FORMERLY_EQUAL
            case "le":
                return 0.0 < left - right < EQUAL
            case "ge":
                return 0.0 < right - left < EQUAL
        return False

    def numbered(self, index: Evaluate) -> Evaluate:
        """`#1`, `#[...]`; which one may itself be unknown."""

        def evaluate(scope: object) -> Value:
            which = index(scope)
            value: Value = scope.parameters.numbered(number_of(which))  # type: ignore[attr-defined]
            return Unknown(which.why, nominal(value)) if isinstance(which, Unknown) else value

        return evaluate

    def named(self, name: str) -> Evaluate:
        """`#<name>`."""
        return lambda scope: scope.parameters.named(name)

    def existence(self, parameter: NumberedParameter | NamedParameter) -> Evaluate:
        """`EXISTS[...]`: 1 or 0."""
        if isinstance(parameter, NamedParameter):
            name = parameter.name
            return lambda scope: float(scope.parameters.exists(name))
        number = self.compiled(parameter.index)
        return lambda scope: float(scope.parameters.exists(number_of(number(scope))))


compiled = ParameterExpressions().compiled
