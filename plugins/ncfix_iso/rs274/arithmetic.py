"""The operators and functions of RS274NGC expressions on doubles, as LinuxCNC computes them.

Source: LinuxCNC documentation, "G-code overview", "Binary operators" and "Functions"; angles are degrees. Since
version 2.9.1 numbers are equal that differ by less than 1e-6, and `le` and `ge` hold for equal ones. Before, `eq` and
`ne` had 0.0001, and `le` and `ge` were exact. `lt` and `gt` are exact in all (LinuxCNC, pull request 2525).
"""

from __future__ import annotations

import math
from collections.abc import Callable

from ncfix.control.arithmetic import ARITHMETIC, FUNCTIONS, divide, power
from ncfix.control.faults import Fault

EQUAL = 1e-6
"""Two numbers are equal that differ by less."""

FORMERLY_EQUAL = 1e-4
"""The same for `eq` and `ne` before 2.9.1."""


def modulo(left: float, right: float) -> float:
    """`left MOD right`, never negative."""
    if right == 0.0:
        raise Fault(ARITHMETIC, "MOD by zero")
    rest = math.fmod(left, right)
    return rest + abs(right) if rest < 0.0 else rest


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


def in_doubt(operator: str, left: float, right: float) -> bool:
    """Whether a comparison comes out otherwise in older versions of the control."""
    match operator:
        case "eq" | "ne":
            return EQUAL <= abs(left - right) < FORMERLY_EQUAL
        case "le":
            return 0.0 < left - right < EQUAL
        case "ge":
            return 0.0 < right - left < EQUAL
        case _:
            return False


UNARY: dict[str, Callable[[float], float]] = {
    **FUNCTIONS,
    "-": lambda a: -a,
    "+": lambda a: a,
    "fix": lambda a: float(math.floor(a)),
    "fup": lambda a: float(math.ceil(a)),
    "round": lambda a: float(math.trunc(a + math.copysign(0.5, a))),
}


def whole(value: float, what: str) -> int:
    """A number that must be a whole one, as an index or a label; LinuxCNC allows 0.0001 off."""
    nearest = math.floor(value)
    if value - nearest > 0.9999:
        return nearest + 1
    if value - nearest > 0.0001:
        raise Fault(ARITHMETIC, f"{what} is {value:g}, and must be a whole number")
    return nearest
