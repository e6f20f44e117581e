"""The second reader: formulas of plain numbers, and of variables with plain values.

It evaluates the operations that are equal on all controls: brackets, + - * /, powers, roots, and SIN, COS and TAN of
degrees. A formula in which controls differ (rounding, integers, arc tangents, comparisons, the sign of a power) has no
value here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping

LONGEST = 400
"""Largest number of characters of a formula."""
TOKEN = re.compile(
    r"[ \t]*(?:(\d+\.?\d*|\.\d+)|(#\d+|#<[^<>]*>|[A-Z_]\w*)|(\*\*|[-+*/^()\[\]]))[ \t]*", re.ASCII | re.IGNORECASE
)
"""A number; a variable or the name of a function; a sign."""
CLOSES = {"(": ")", "[": "]"}
FUNCTIONS: Mapping[str, Callable[[float], float]] = {
    "SIN": lambda angle: math.sin(math.radians(angle)),
    "COS": lambda angle: math.cos(math.radians(angle)),
    "TAN": lambda angle: math.tan(math.radians(angle)),
    "SQRT": math.sqrt,
    "ABS": abs,
    "SQ": lambda number: number * number,
    "POT": lambda number: number * number,
}


def value_of(formula: str, known: Mapping[str, float | None]) -> float | None:
    """The value of a formula; None if it is not known.

    known  name of a variable, see `variable_name` -> its value; None: not known
    """
    tokens, at = list[str](), 0
    while at < len(formula) <= LONGEST and (found := TOKEN.match(formula, at)):
        tokens.append(found[0].strip())
        at = found.end()
    if at < len(formula) or not tokens:
        return None
    try:
        value, behind = _sum(tokens, 0, known)
    except (ArithmeticError, LookupError, ValueError, RecursionError):
        return None
    return value if behind == len(tokens) and isinstance(value, float) and math.isfinite(value) else None


def variable_name(text: str) -> str:
    """The name of a variable without blanks, in upper case."""
    return re.sub(r"[ \t]", "", text).upper()


def _sum(tokens: list[str], at: int, known: Mapping[str, float | None]) -> tuple[float, int]:
    value, at = _product(tokens, at, known)
    while at < len(tokens) and tokens[at] in "+-":
        more, behind = _product(tokens, at + 1, known)
        value, at = value + more if tokens[at] == "+" else value - more, behind
    return value, at


def _product(tokens: list[str], at: int, known: Mapping[str, float | None]) -> tuple[float, int]:
    value, at = _power(tokens, at, known)
    while at < len(tokens) and tokens[at] in ("*", "/"):
        more, behind = _power(tokens, at + 1, known)
        value, at = value * more if tokens[at] == "*" else value / more, behind
    return value, at


def _power(tokens: list[str], at: int, known: Mapping[str, float | None]) -> tuple[float, int]:
    signed = tokens[at] in "+-"
    value, behind = _single(tokens, at + signed, known)
    if behind < len(tokens) and tokens[behind] in ("^", "**"):
        if signed or tokens[at].upper() in FUNCTIONS:
            raise ValueError
        more, behind = _single(tokens, behind + 1, known)
        value = math.pow(value, more)
    return -value if tokens[at] == "-" else value, behind


def _single(tokens: list[str], at: int, known: Mapping[str, float | None]) -> tuple[float, int]:
    """The value of a number, variable, bracket, or function of one of these, and the index of the next token."""
    token = tokens[at].upper()
    if token in CLOSES:
        value, behind = _sum(tokens, at + 1, known)
        if tokens[behind] != CLOSES[token]:
            raise ValueError
        return value, behind + 1
    if token in FUNCTIONS:
        value, behind = _single(tokens, at + 1, known)
        return FUNCTIONS[token](value), behind
    if token[0] in "0123456789.":
        return float(token), at + 1
    found = known[variable_name(token)]
    if found is None:
        raise ValueError
    return found, at + 1
