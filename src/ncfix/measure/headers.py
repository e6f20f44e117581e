"""The head of a measurement file: lines `# key: value`."""

from __future__ import annotations

import math

from ncfix.machine.fields import did_you_mean
from ncfix.measure.kinds import CHOICES, COMMON, KINDS
from ncfix.measure.lines import Cell, Text

VERSION = 1
NUMBERS = {"noise_um": 1, "noise_urad": 1, "point": 3}
"""Header lines that are so many numbers."""
ONCE = ("ncfix-measurement", "kind", "noise_um", "noise_urad", "point", "frame", "setup", "carried_by")
"""Header lines of which there can only be one."""
NAMED = {"distance": (2, 2), "target": (1, 3)}
"""Header lines that are names and then numbers: `distance: 1 2 304.6686 0.0012`."""


def read(text: Text) -> list[tuple[Cell, Cell]]:
    """The header lines before the columns; a comment without a colon is one for people."""
    pairs = []
    for number, line in enumerate(text.lines, 1):
        if line.strip() and not line.startswith("#"):
            break
        key, colon, value = line.removeprefix("#").partition(":")
        if colon:
            at = line.index(":") + 2 + len(value) - len(value.lstrip())
            pairs.append((Cell(key.strip(), number, line.index(key.strip()) + 1), Cell(value.strip(), number, at)))
    return pairs


def stray(text: Text, start: int, kind: str) -> None:
    """Note header lines after the first `start` lines: there they would be taken for a comment."""
    for number, line in enumerate(text.lines[start:], start + 1):
        key, colon, _ = line.removeprefix("#").partition(":")
        if line.startswith("#") and colon and key.strip() in (*COMMON, *KINDS[kind].headers):
            hint = "header lines stand above the columns"
            text.note("NCF602", f"header line {key.strip()!r} below the columns", number, 1, hint)


def kind_of(text: Text, pairs: list[tuple[Cell, Cell]]) -> str:
    """The kind; what is wrong with version and kind is noted."""
    found = {key.text: value for key, value in pairs}
    version = found.get("ncfix-measurement")
    if version is None:
        text.note("NCF600", "there is no line `# ncfix-measurement: 1`", 1 if text.lines else 0)
    elif version.text != str(VERSION):
        text.note("NCF600", f"version {version.text!r}, this ncfix reads {VERSION}", version.line, version.column)
    kind = found.get("kind")
    if kind is None:
        text.note("NCF601", "there is no line `# kind: ...`", 1 if text.lines else 0, 0, f"one of {', '.join(KINDS)}")
        return ""
    if kind.text not in KINDS:
        hint = did_you_mean(kind.text, KINDS) or f"one of {', '.join(KINDS)}"
        text.note("NCF601", f"there is no kind {kind.text!r}", kind.line, kind.column, hint)
    return kind.text


def check(text: Text, pairs: list[tuple[Cell, Cell]], kind: str) -> None:
    """Note unknown keys and values that cannot be."""
    known = (*COMMON, *KINDS[kind].headers)
    said: set[str] = set()
    for key, value in pairs:
        if key.text in said and key.text in ONCE:
            text.note("NCF602", f"header line {key.text!r} is there twice", key.line, key.column)
        said.add(key.text)
        if key.text not in known:
            hint = did_you_mean(key.text, known) or f"notes go under {', '.join(COMMON[4:])}"
            text.note("NCF602", f"unknown header line {key.text!r}", key.line, key.column, hint)
        elif key.text in NUMBERS:
            _numbers(text, value, key.text, NUMBERS[key.text])
        elif key.text in NAMED:
            _named(text, value, key.text, *NAMED[key.text])
        elif kind in CHOICES.get(key.text, {}) and value.text not in CHOICES[key.text][kind]:
            one = " or ".join(CHOICES[key.text][kind])
            text.note("NCF603", f"{key.text} is {one}, not {value.text!r}", value.line, value.column)


def _numbers(text: Text, value: Cell, key: str, count: int) -> None:
    found = [_number(part) for part in value.text.split()]
    if len(found) != count or any(number is None for number in found):
        wanted = "a number" if count == 1 else f"{count} numbers"
        text.note("NCF603", f"{key} is {wanted}, not {value.text!r}", value.line, value.column)
    elif key.startswith("noise") and (found[0] or 0.0) <= 0:
        text.note("NCF603", f"{key} is above zero, not {value.text}", value.line, value.column)


def _named(text: Text, value: Cell, key: str, names: int, numbers: int) -> None:
    parts = value.text.split()
    if len(parts) != names + numbers or any(_number(part) is None for part in parts[names:]):
        wanted = f"{names} names and {numbers} numbers"
        text.note("NCF603", f"{key} is {wanted}, not {value.text!r}", value.line, value.column)
    elif key == "distance" and min(float(part) for part in parts[names:]) <= 0:
        text.note("NCF603", "a distance and its uncertainty are above zero", value.line, value.column)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
