"""What `--set` gives is text: of a form that its option states, or `UsageError` NCF485 with what would be right."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ncfix.diagnostics import UsageError


@dataclass(frozen=True, slots=True)
class Form:
    """What the text of a setting may be: `fits` decides, `hint` says it."""

    hint: str
    fits: Callable[[str], bool]


def one_of(*words: str, hint: str = "") -> Form:
    """One of some words."""
    return Form(hint or f"one of {', '.join(words)}", lambda text: text in words)


def whole(low: int, high: int) -> Form:
    """A whole number within limits."""
    return Form(
        f"a whole number from {low} to {high}",
        lambda text: text.isascii() and text.isdigit() and low <= int(text) <= high,
    )


def number(low: float, high: float) -> Form:
    """A number within limits."""
    return Form(f"from {low:g} to {high:g}", lambda text: low <= _number(text) <= high)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def wrong(settings: Mapping[str, str], key: str, hint: str) -> UsageError:
    """The error for a setting that cannot be, which its form alone does not show."""
    return UsageError.of("NCF485", f"{key}={settings[key]}", hint=hint)
