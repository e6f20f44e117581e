"""Messages that say the same of several lines of a program, as one that names them all."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace

from ncfix.diagnostics import Message

FEW = 8
"""So many stretches of lines are named one by one."""
FIGURE = re.compile(r"(?<![-.\w])\d+(?:\.\d+)?(?:e[-+]\d+)?(?= (?:mm|um|degrees|times)\b(?!/))")
"""How much it is, in a message."""


def gathered(messages: Iterable[Message]) -> list[Message]:
    """Each message once, where it first stands, with the other lines of which it is said.

    Of those that differ only in how much it is, the one that says the most stands for all.
    """
    groups: dict[tuple[str, ...], list[Message]] = {}
    for number, message in enumerate(messages):
        place = message.place
        alone = "" if place is not None and place.line else str(number)
        key = message.code, _kind(message.text), message.hint, place.path if place else "", alone
        groups.setdefault(key, []).append(message)
    return [_as_one(group) for group in groups.values()]


def _as_one(group: Sequence[Message]) -> Message:
    most = max(group, key=lambda message: _size(message.text))
    if len(group) == 1:
        return most
    lines = sorted({message.place.line for message in group if message.place})
    shown = "" if all(message.text == most.text for message in group) else "; the largest is shown"
    return replace(most, text=f"{most.text} ({len(group)} times, {named(lines)}{shown})")


def _kind(text: str) -> str:
    """A text without its figure; one with several figures is a kind of its own."""
    found = FIGURE.findall(text)
    return FIGURE.sub("", text) if len(found) == 1 else text


def _size(text: str) -> float:
    """The figure of a text, 0 without one."""
    found = FIGURE.search(text)
    return float(found[0]) if found else 0.0


def named(lines: Sequence[int]) -> str:
    """Line numbers in words, those that follow each other as stretches: "lines 3 to 5, 9"."""
    begins = [line for before, line in zip((None, *lines), lines, strict=False) if before is None or line > before + 1]
    ends = [line for line, after in zip(lines, (*lines[1:], None), strict=True) if after is None or after > line + 1]
    if len(begins) > FEW:
        return f"between lines {lines[0]} and {lines[-1]}"
    parts = [str(a) if a == b else f"{a} to {b}" for a, b in zip(begins, ends, strict=True)]
    return f"line{'s' if len(lines) > 1 else ''} {', '.join(parts)}"
