"""The operators and functions of RS274NGC expressions on doubles, as LinuxCNC computes them.

Source: LinuxCNC documentation, "G-code overview", "Binary operators" and "Functions"; angles are degrees. Comparisons
take numbers as equal when they differ by less than 0.0001, except `lt` and `gt`, which are exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from ncfix.program.rs274.faults import Fault

EQUAL = 0.0001
"""Two numbers compare equal when they differ by less."""

ARITHMETIC = "NCF210"


def divide(left: float, right: float) -> float:
    """`left / right`."""
    if right == 0.0:
        raise Fault(ARITHMETIC, "division by zero")
    return left / right


def modulo(left: float, right: float) -> float:
    """`left MOD right`, never negative."""
    if right == 0.0:
        raise Fault(ARITHMETIC, "MOD by zero")
    rest = math.fmod(left, right)
    return rest + abs(right) if rest < 0.0 else rest


def power(left: float, right: float) -> float:
    """`left ** right`."""
    if left < 0.0 and not right.is_integer():
        raise Fault(ARITHMETIC, f"a negative number to the power {right:g}")
    try:
        return float(left**right)
    except (OverflowError, ZeroDivisionError):
        raise Fault(ARITHMETIC, f"{left:g} ** {right:g} is too large a number") from None


def arc_tangent(y: float, x: float) -> float:
    """`ATAN[y]/[x]` in degrees, from -180 to 180."""
    return math.degrees(math.atan2(y, x))


BINARY: dict[str, Callable[[float, float], float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": divide,
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
    "atan": arc_tangent,
}


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


UNARY: dict[str, Callable[[float], float]] = {
    "-": lambda a: -a,
    "+": lambda a: a,
    "abs": abs,
    "acos": inverse(math.acos, "ACOS"),
    "asin": inverse(math.asin, "ASIN"),
    "cos": lambda a: math.cos(math.radians(a)),
    "exp": exponential,
    "fix": lambda a: float(math.floor(a)),
    "fup": lambda a: float(math.ceil(a)),
    "ln": logarithm,
    "round": lambda a: float(math.trunc(a + math.copysign(0.5, a))),
    "sin": lambda a: math.sin(math.radians(a)),
    "sqrt": square_root,
    "tan": lambda a: math.tan(math.radians(a)),
}


def whole(value: float, what: str) -> int:
    """A number that must be a whole one, as an index or a label; LinuxCNC allows 0.0001 off."""
    nearest = math.floor(value)
    if value - nearest > 0.9999:
        return nearest + 1
    if value - nearest > 0.0001:
        raise Fault(ARITHMETIC, f"{what} is {value:g}, and must be a whole number")
    return nearest
