"""Operators and functions that all controls compute alike, on doubles; angles are degrees."""

from __future__ import annotations

import math
from collections.abc import Callable

from ncfix.control.faults import Fault

ARITHMETIC = "NCF210"


def divide(left: float, right: float) -> float:
    """`left / right`."""
    if right == 0.0:
        raise Fault(ARITHMETIC, "division by zero")
    return left / right


def power(left: float, right: float) -> float:
    """`left ** right`."""
    if left < 0.0 and not right.is_integer():
        raise Fault(ARITHMETIC, f"a negative number to the power {right:g}")
    try:
        return float(left**right)
    except (OverflowError, ZeroDivisionError):
        raise Fault(ARITHMETIC, f"{left:g} ** {right:g} is too large a number") from None


def inverse(function: Callable[[float], float], name: str) -> Callable[[float], float]:
    """Arc sine or arc cosine in degrees."""

    def checked(value: float) -> float:
        if not -1.0 <= value <= 1.0:
            raise Fault(ARITHMETIC, f"{name} of {value:g}: the argument must be between -1 and 1")
        return math.degrees(function(value))

    return checked


def logarithm(value: float) -> float:
    """`LN[value]`."""
    if value <= 0.0:
        raise Fault(ARITHMETIC, f"LN of {value:g}: the argument must be positive")
    return math.log(value)


def square_root(value: float) -> float:
    """`SQRT[value]`."""
    if value < 0.0:
        raise Fault(ARITHMETIC, f"SQRT of the negative number {value:g}")
    return math.sqrt(value)


def exponential(value: float) -> float:
    """`EXP[value]`."""
    try:
        return math.exp(value)
    except OverflowError:
        raise Fault(ARITHMETIC, f"EXP of {value:g} is too large a number") from None


FUNCTIONS: dict[str, Callable[[float], float]] = {
    "abs": abs,
    "acos": inverse(math.acos, "ACOS"),
    "asin": inverse(math.asin, "ASIN"),
    "cos": lambda a: math.cos(math.radians(a)),
    "exp": exponential,
    "ln": logarithm,
    "sin": lambda a: math.sin(math.radians(a)),
    "sqrt": square_root,
    "tan": lambda a: math.tan(math.radians(a)),
}
"""The functions of one argument that the families with brackets have in common."""
