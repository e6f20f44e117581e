"""Values while a program is followed: numbers, texts, and what is known only at run time.

`Unknown` is the only word for a value that nobody knows before the machine runs: a probed position, an input, a
variable that an earlier program has left. What is computed from it is unknown, too, for the same reason.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple


class Unknown(NamedTuple):
    """A value that is known only at run time.

    why      what it depends on, as it is said to people: the name of a variable; empty where there is nothing to say
    nominal  what a dry run would give
    """

    why: str = ""
    nominal: float = 0.0


Value = float | str | Unknown
"""A number (also for true and false), a text, or what is known only at run time."""


def nominal(value: Value) -> float:
    """A value as a dry run has it: a number as it is, what is unknown by its nominal value; 0 for a text."""
    if isinstance(value, Unknown):
        return value.nominal
    return 0.0 if isinstance(value, str) else value


def number(value: Value) -> float | None:
    """A value as a number; None for a text, and where it is not known."""
    return None if isinstance(value, Unknown | str) else value


def numbers(values: Iterable[Value]) -> list[float] | None:
    """Values as numbers; None where one of them is a text or not known."""
    found: list[float] = []
    for value in values:
        if isinstance(value, Unknown | str):
            return None
        found.append(value)
    return found


def signed(sign: float, value: Value) -> Value:
    """A value times 1 or -1."""
    return Unknown(value.why, sign * value.nominal) if isinstance(value, Unknown) else sign * nominal(value)
