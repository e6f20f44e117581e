"""What `--set` gives is text: choices, whole numbers and lengths, or `UsageError` NCF485 with what would be right."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ncfix.diagnostics import UsageError


def choice(settings: Mapping[str, str], key: str, allowed: Sequence[str], hint: str = "") -> str:
    """One of some words."""
    if settings[key] not in allowed:
        raise wrong(settings, key, hint or f"one of {', '.join(filter(None, allowed))}")
    return settings[key]


def whole(settings: Mapping[str, str], key: str, low: int, high: int) -> int:
    """A whole number within limits."""
    text = settings[key]
    if not (text.isascii() and text.isdigit() and low <= int(text) <= high):
        raise wrong(settings, key, f"a whole number from {low} to {high}")
    return int(text)


def number(settings: Mapping[str, str], key: str, low: float, high: float) -> float:
    """A number within limits."""
    try:
        found = float(settings[key])
    except ValueError:
        found = math.nan
    if not low <= found <= high:
        raise wrong(settings, key, f"from {low:g} to {high:g}")
    return found


def wrong(settings: Mapping[str, str], key: str, hint: str) -> UsageError:
    """The error for a setting that cannot be."""
    return UsageError.of("NCF485", f"{key}={settings[key]}", hint=hint)
