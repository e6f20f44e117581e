"""Messages that say the same of several lines of a program, as one that names them all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from ncfix.diagnostics import Message

FEW = 8
"""So many stretches of lines are named one by one."""


def gathered(messages: Iterable[Message]) -> list[Message]:
    """Each message once, where it first stands, with the other lines of which it is said."""
    groups: dict[tuple[str, ...], list[Message]] = {}
    for number, message in enumerate(messages):
        place = message.place
        alone = "" if place is not None and place.line else str(number)
        key = message.code, message.text, message.hint, place.path if place else "", alone
        groups.setdefault(key, []).append(message)
    return [_as_one(group) for group in groups.values()]


def _as_one(group: Sequence[Message]) -> Message:
    first = group[0]
    if len(group) == 1:
        return first
    lines = sorted({message.place.line for message in group if message.place})
    return replace(first, text=f"{first.text} ({len(group)} times, {named(lines)})")


def named(lines: Sequence[int]) -> str:
    """Line numbers in words, those that follow each other as stretches: "lines 3 to 5, 9"."""
    begins = [line for before, line in zip((None, *lines), lines, strict=False) if before is None or line > before + 1]
    ends = [line for line, after in zip(lines, (*lines[1:], None), strict=True) if after is None or after > line + 1]
    if len(begins) > FEW:
        return f"between lines {lines[0]} and {lines[-1]}"
    parts = [str(a) if a == b else f"{a} to {b}" for a, b in zip(begins, ends, strict=True)]
    return f"line{'s' if len(lines) > 1 else ''} {', '.join(parts)}"
