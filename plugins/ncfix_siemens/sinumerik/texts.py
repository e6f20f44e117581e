"""Functions of texts. Places in a text count from zero.

Source: Siemens, "SINUMERIK 840D sl, NC programming, job planning", string operations.
"""

from __future__ import annotations

from collections.abc import Callable

Result = float | str | None


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


TEXT_FUNCTIONS: dict[str, tuple[Callable[..., Result], tuple[type, ...], int]] = {
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


def of_texts(name: str, values: tuple[Result, ...]) -> Result:
    """The value of a function of texts; None where an argument is not known or of another type."""
    function, types, least = TEXT_FUNCTIONS[name]
    fits = least <= len(values) <= len(types)
    if not fits or any(not isinstance(value, kind) for value, kind in zip(values, types, strict=False)):
        return None
    return function(*values)
