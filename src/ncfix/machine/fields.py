"""Reading a tree of plain values with all its faults: each wrong key is noted and the reading goes on.

A `TomlTable` is one table. Its readers return the value, or None if it is missing or wrong (then there is a message).
`close` notes the keys that nobody asked for.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any, TypeGuard

from ncfix.diagnostics import Message
from ncfix.toml_text import Path, line_of, place_of

LARGEST = 1e12
"""No quantity of a machine has a larger number, in whatever unit; beyond it arithmetic goes wrong."""


@dataclass(slots=True)
class Report:
    """The faults found so far, with their places in the text.

    top  keys that stand above all tables: one that stands below a header is in that table
    """

    path: str
    text: str
    lines: Mapping[Path, int]
    messages: list[Message] = field(default_factory=list)
    top: set[str] = field(default_factory=set)

    def note(self, code: str, where: Path, text: str, hint: str = "") -> None:
        """Note a fault of the value at `where`."""
        place = place_of(line_of(where, self.lines), self.text, self.path)
        head = f"{dotted(where)}: " if where else ""
        self.messages.append(Message(code, head + text, place, hint))


@dataclass(slots=True)
class TomlTable:
    """One table of the file, at `path`."""

    values: Mapping[str, Any]
    path: Path
    report: Report
    asked: set[str] = field(default_factory=set)

    def note(self, code: str, key: str, text: str, hint: str = "") -> None:
        """Note a fault of one key."""
        self.report.note(code, (*self.path, key), text, hint)

    def has(self, key: str) -> bool:
        """Whether the key is there."""
        self.asked.add(key)
        return key in self.values

    def get(self, key: str, required: bool = False) -> Any:
        """The raw value, or None; a required key that is missing is noted."""
        if not self.has(key):
            if required:
                hint = did_you_mean(key, [each for each in self.values if each not in self.asked])
                self.report.note("NCF303", self.path, f"key {key!r} is missing", hint)
            return None
        return self.values[key]

    def text(self, key: str, required: bool = False) -> str | None:
        """A string."""
        value = self.get(key, required)
        if value is None or isinstance(value, str):
            return value
        self._wrong(key, "a string", value)
        return None

    def flag(self, key: str) -> bool:
        """true or false; false if missing."""
        value = self.get(key)
        if value is not None and not isinstance(value, bool):
            self._wrong(key, "true or false", value)
        return value is True

    def number(self, key: str, required: bool = False) -> float | None:
        """A finite number."""
        value = self.get(key, required)
        if value is None:
            return None
        return float(value) if self._finite(key, value, "a number") else None

    def positive(self, key: str) -> float | None:
        """A number above zero; one that is not is noted, and returned."""
        value = self.number(key)
        if value is not None and value <= 0:
            self.note("NCF305", key, f"{value:g} is not positive")
        return value

    def range(self, key: str, hint: str = "") -> tuple[float, float] | None:
        """Two numbers, the lower one first; `hint` is for those that are not."""
        values = self.numbers(key, count=2)
        if values is None:
            return None
        low, high = values
        if low >= high:
            self.note("NCF308", key, f"empty range: {low:g} is not below {high:g}", hint)
        return low, high

    def choice(self, key: str, *options: str, required: bool = False, hint: str | None = None) -> str | None:
        """One of two words; without a `hint` the nearer one is named."""
        value = self.text(key, required)
        if value is not None and value not in options:
            meant = did_you_mean(value, options) if hint is None else hint
            self.note("NCF304", key, f"{value!r} is neither {' nor '.join(options)}", meant)
        return value

    def integer(self, key: str, required: bool = False) -> int | None:
        """A whole number."""
        value = self.get(key, required)
        if value is None:
            return None
        if _is_integer(value):
            return value
        self._wrong(key, "a whole number", value)
        return None

    def numbers(self, key: str, required: bool = False, count: int | None = None) -> tuple[float, ...] | None:
        """A list of finite numbers, `count` of them if given."""
        value = self.get(key, required)
        if value is None:
            return None
        wanted = f"a list of {count} numbers" if count is not None else "a list of numbers"
        if not isinstance(value, list) or (count is not None and len(value) != count):
            self._wrong(key, wanted, value)
            return None
        good = [self._finite(key, item, wanted) for item in value]
        return tuple(float(item) for item in value) if all(good) else None

    def integers(self, key: str, required: bool = False) -> tuple[int, ...] | None:
        """A list of whole numbers."""
        value = self.get(key, required)
        if value is None:
            return None
        if isinstance(value, list) and all(_is_integer(item) for item in value):
            return tuple(value)
        odd = next((item for item in value if not _is_integer(item)), value) if isinstance(value, list) else value
        self._wrong(key, "a list of whole numbers", odd)
        return None

    def rows(self, key: str, shape: tuple[int, int]) -> tuple[tuple[float, ...], ...] | None:
        """A matrix as a list of rows."""
        value = self.get(key)
        if value is None:
            return None
        wanted = f"{shape[0]} rows of {shape[1]} numbers"
        ragged = not isinstance(value, list) or any(not isinstance(row, list) or len(row) != shape[1] for row in value)
        if ragged or len(value) != shape[0]:
            self._wrong(key, wanted, value)
            return None
        good = [self._finite(key, item, wanted) for row in value for item in row]
        return tuple(tuple(float(item) for item in row) for row in value) if all(good) else None

    def table(self, key: str, required: bool = False) -> TomlTable | None:
        """A table in this one."""
        value = self.get(key, required)
        if value is None:
            return None
        if not isinstance(value, dict):
            self._wrong(key, f"a table [{dotted((*self.path, key))}]", value)
            return None
        return TomlTable(value, (*self.path, key), self.report)

    def tables(self, key: str) -> Iterator[TomlTable]:
        """The tables of an array [[key]]."""
        value = self.get(key)
        if value is None:
            return
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            self._wrong(key, f"tables [[{dotted((*self.path, key))}]]", value)
            return
        for index, item in enumerate(value):
            yield TomlTable(item, (*self.path, key, index), self.report)

    def close(self) -> None:
        """Note the keys that nobody asked for."""
        for key in self.values:
            if key in self.asked:
                continue
            if self.path and key in self.report.top:
                meant = f"it belongs above the first table; here it is a key of {dotted(self.path)}"
            else:
                meant = did_you_mean(key, self.asked - self.values.keys()) or did_you_mean(key, self.asked)
            self.note("NCF302", key, f"unknown key {key!r}", meant)

    def _finite(self, key: str, value: object, wanted: str) -> bool:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self._wrong(key, wanted, value)
            return False
        if isinstance(value, float) and not math.isfinite(value):
            self.note("NCF305", key, f"{value} is not a finite number")
            return False
        if abs(value) > LARGEST:
            self.note("NCF305", key, f"more than anything that a machine has, which is {LARGEST:g} at most")
            return False
        return True

    def _wrong(self, key: str, wanted: str, value: object) -> None:
        self.note("NCF304", key, f"expected {wanted}, found {shown(value)}")


def dotted(path: Path) -> str:
    """A path as people write it: effect[2].degree, entries counted from 0."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".")


def shown(value: object) -> str:
    """A value in a message: what it is, not all of it."""
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return "a table"
    return f"{str(value).lower() if isinstance(value, bool) else repr(value)}"


def _is_integer(value: object) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)


def did_you_mean(word: str, words: Iterable[str]) -> str:
    """A hint with the nearest of the words, whatever their case; empty if none is near."""
    small = {each.lower(): each for each in words}
    close = get_close_matches(word.lower(), small, 1, 0.6)
    return f"did you mean {small[close[0]]!r}?" if close else ""
