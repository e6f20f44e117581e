"""Checked values of JSON records: whole numbers, numbers within limits, lists of the right length.

All functions raise ValueError with a text for people, or KeyError for a missing key.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

FAR = 1e6
"""Largest position, mm or degree: beyond any machine."""


def whole(record: Mapping[str, Any], key: str, low: int, high: int) -> int:
    """A whole number within limits."""
    value = record[key]
    if type(value) is not int or not low <= value <= high:
        raise ValueError(f"{key} is {value!r}, not a whole number from {low} to {high}")
    return value


def real(record: Mapping[str, Any], key: str, low: float = -FAR, high: float = FAR) -> float:
    """A number within limits."""
    value = record[key]
    if type(value) not in (int, float) or not low <= value <= high:
        raise ValueError(f"{key} is {value!r}, not a number from {low:g} to {high:g}")
    return float(value)


def reals(record: Mapping[str, Any], key: str, count: int, low: float = -FAR) -> tuple[float, ...]:
    """A list of `count` numbers, not below `low`."""
    values = record[key]
    if not isinstance(values, list) or len(values) != count:
        raise ValueError(f"{key} is {values!r}, not {count} numbers")
    return tuple(real({key: value}, key, low) for value in values)


def wholes(record: Mapping[str, Any], key: str) -> list[int]:
    """A list of whole numbers of any length."""
    values = record[key]
    if not isinstance(values, list) or any(type(value) is not int or abs(value) > FAR for value in values):
        raise ValueError(f"{key} holds something that is not a whole number")
    return values


def text(record: Mapping[str, Any], key: str) -> str:
    """A text."""
    value = record[key]
    if not isinstance(value, str):
        raise ValueError(f"{key} is {value!r}, not a word")
    return value


def records(value: Any) -> list[Mapping[str, Any]]:
    """The list of records of a file."""
    if not isinstance(value, dict) or not isinstance(value["records"], list):
        raise ValueError("it is not an object with a list of records")
    if not all(isinstance(record, dict) for record in value["records"]):
        raise ValueError("a record is not an object")
    return value["records"]


SMALLEST = math.ulp(1.0)
"""Lower limit of a positive number."""
