"""TOML files written by people: decoding, parsing, reading with all errors reported, and writing.

The parser does not report the places of keys, so they are found in the text. Paths are tuples of keys and indices,
`("effect", 2, "degree")`. Only keys at the start of a line are found; for others the line of their table is used.

A `TomlTable` is one table. Its readers return the value, or None if it is missing or wrong: then a message is recorded,
and reading continues. `close` reports keys that were never read.
"""

from __future__ import annotations

import datetime
import json
import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from difflib import get_close_matches
from typing import Any, NamedTuple, TypeGuard

from ncfix.diagnostics import ConfigError, Message, Place
from ncfix.values import mutable

Path = tuple[str | int, ...]
BARE = r"[A-Za-z0-9_-]+"
KEY = rf"""(?:{BARE}|"[^"\n]*"|'[^'\n]*')"""
DOTTED = rf"{KEY}(?:\s*\.\s*{KEY})*"
HEADER = re.compile(rf"\s*(\[\[?)\s*({DOTTED})\s*\]")
ASSIGNMENT = re.compile(rf"\s*({DOTTED})\s*=")
LONG_TEXTS = ('"""', "'''")
"""Delimiters of multi-line strings."""
QUOTED = re.compile(r'"""|\'\'\'|"(?:[^"\\]|\\.)*"|\'[^\']*\'|#.*')
"""Such a delimiter, a string in one line, or a comment."""
OTHERS = {
    "a measurement": re.compile(r"# *ncfix-measurement"),
    "an NC program": re.compile(r"\s*(?:[%;(]|[NOG][\d.]++[ \t]*+(?!=)|\d*\s*BEGIN PGM)"),
}
"""Beginnings of other files that may be given instead of TOML."""
WIDTH = 120
"""Largest number of characters of a written line."""
MAX_NUMBER = 1e12
"""Largest absolute value of a number, in any unit: no quantity of a machine is larger, and arithmetic stays safe."""


def decoded(source: bytes, path: str, code: str) -> str:
    """The text of a file, without a byte order mark; raises `ConfigError` with the given code."""
    try:
        return source.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = source[: error.start].decode("utf-8-sig")
        line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
        place = Place(path, line, column, _row(source.decode(errors="replace").removeprefix("\ufeff"), line))
        text = f"not a text in UTF-8: byte 0x{source[error.start]:02X}"
        raise ConfigError.of(code, text, place, "save it as UTF-8") from error


def parsed(text: str, path: str, code: str, hint: str = "") -> dict[str, Any]:
    """The content of a TOML text; raises `ConfigError` with the given code and the place if it is not TOML."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        found = re.search(r"line (\d+), column (\d+)", str(error))
        line, column = (int(found[1]), int(found[2])) if found else (text.count("\n") + 1, 0)
        what = re.sub(r"\s*\(at [^)]*\)$", "", str(error))
        place = Place(path, line, column, _row(text, line))
        other = next((f"this looks like {kind}" for kind, sign in OTHERS.items() if sign.match(text)), hint)
        raise ConfigError.of(code, f"not TOML: {what}", place, other) from error
    except ValueError as error:  # Python reads whole numbers of up to 4300 digits
        text = "cannot be read as TOML: a number has thousands of digits"
        raise ConfigError.of(code, text, Place(path), hint) from error
    except RecursionError as error:
        raise ConfigError.of(code, "cannot be read as TOML: nested too deeply", Place(path), hint) from error


def place_of(line: int, text: str, path: str) -> Place:
    """A line, with the column of its first character that is not a blank."""
    row = _row(text, line)
    return Place(path, line, len(row) - len(row.lstrip()) + 1 if row.strip() else 0, row)


def _row(text: str, line: int) -> str:
    rows = text.split("\n")
    return rows[line - 1].rstrip("\r") if line <= len(rows) else ""


def key_lines(text: str) -> Mapping[Path, int]:
    """Path -> line number, from 1, of every table header and every key at the start of a line."""
    lines: dict[Path, int] = {(): 1}
    counts: dict[Path, int] = {}
    table: Path = ()
    quote = ""
    for number, line in enumerate(text.split("\n"), start=1):
        before, quote = quote, _left_open(line, quote)
        if before:
            continue
        if header := HEADER.match(line):
            table = _opened(_keys(header[2]), header[1] == "[[", counts)
            _note(table, 0, number, lines)
        elif assignment := ASSIGNMENT.match(line):
            _note(table + _keys(assignment[1]), len(table), number, lines)
    return lines


def _left_open(line: str, quote: str) -> str:
    """The delimiter of the string that is still open after a line, or ""; `quote`: that of one open before it."""
    at = 0
    while True:
        if quote:
            end = line.find(quote, at)
            if end < 0:
                return quote
            at = end + len(quote)
        mark = next((each for each in QUOTED.finditer(line, at) if each[0] in LONG_TEXTS), None)
        if mark is None:
            return ""
        quote, at = mark[0], mark.end()


def _note(path: Path, known: int, number: int, lines: dict[Path, int]) -> None:
    """Record the line of a path and of the tables that its dots create, beyond the first `known` keys."""
    for depth in range(known + 1, len(path) + 1):
        lines.setdefault(path[:depth], number)


def line_of(path: Path, lines: Mapping[Path, int]) -> int:
    """The line of a key, or of the nearest enclosing table."""
    while path not in lines:
        path = path[:-1]
    return lines[path]


def _opened(keys: Path, repeated: bool, counts: dict[Path, int]) -> Path:
    """The path of a table header; the tables of an array are numbered."""
    path: Path = ()
    for depth, name in enumerate(keys):
        path = (*path, name)
        if repeated and depth == len(keys) - 1:
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path = (*path, counts[path])
    return path


def _keys(dotted: str) -> Path:
    return tuple(key.strip("\"'") for key in re.findall(KEY, dotted))


# -- tables, key by key ------------------------------------------------------------------------------------------------


class KeyCodes(NamedTuple):
    """Message codes for errors that any key can have, see `Report`."""

    unknown: str
    missing: str
    kind: str
    number: str
    range: str


MACHINE_FILE = KeyCodes("NCF302", "NCF303", "NCF304", "NCF305", "NCF308")


@mutable
class Report:
    """The errors found so far, with their places in the text.

    top    keys that belong above all tables; below a header they belong to that table
    codes  of errors: unknown key, missing key, wrong type, impossible number, empty range
    """

    path: str
    text: str
    lines: Mapping[Path, int]
    messages: list[Message] = field(default_factory=list)
    top: set[str] = field(default_factory=set)
    codes: KeyCodes = MACHINE_FILE

    def note(self, code: str, where: Path, text: str, hint: str = "") -> None:
        """Record an error of the value at `where`."""
        place = place_of(line_of(where, self.lines), self.text, self.path)
        head = f"{dotted(where)}: " if where else ""
        self.messages.append(Message(code, head + text, place, hint))


@mutable
class TomlTable:
    """One table of the file, at `path`."""

    values: Mapping[str, Any]
    path: Path
    report: Report
    asked: set[str] = field(default_factory=set)

    def note(self, code: str, key: str, text: str, hint: str = "") -> None:
        """Record an error of one key."""
        self.report.note(code, (*self.path, key), text, hint)

    def has(self, key: str) -> bool:
        """Whether the key is present; it then counts as read."""
        self.asked.add(key)
        return key in self.values

    def get(self, key: str, required: bool = False) -> Any:
        """The raw value, or None; a missing required key is recorded as an error."""
        if not self.has(key):
            if required:
                hint = did_you_mean(key, [each for each in self.values if each not in self.asked])
                self.report.note(self.report.codes.missing, self.path, f"key {key!r} is missing", hint)
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
        """A number above zero; any other is recorded as an error, and returned."""
        value = self.number(key)
        if value is not None and value <= 0:
            self.note(self.report.codes.number, key, f"{value:g} is not positive")
        return value

    def range(self, key: str, hint: str = "") -> tuple[float, float] | None:
        """Two numbers, the lower one first; `hint` is used if they are not."""
        values = self.numbers(key, count=2)
        if values is None:
            return None
        low, high = values
        if low >= high:
            self.note(self.report.codes.range, key, f"empty range: {low:g} is not below {high:g}", hint)
        return low, high

    def choice(self, key: str, *options: str, required: bool = False, hint: str | None = None) -> str | None:
        """One of the `options`; without a `hint` the most similar one is named."""
        value = self.text(key, required)
        if value is not None and value not in options:
            meant = did_you_mean(value, options) if hint is None else hint
            self.note(self.report.codes.kind, key, f"{value!r} is neither {' nor '.join(options)}", meant)
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
        """The table under a key."""
        value = self.get(key, required)
        if value is None:
            return None
        if not isinstance(value, dict):
            self._wrong(key, f"a table [{dotted((*self.path, key))}]", value)
            return None
        return TomlTable(value, (*self.path, key), self.report)

    def tables(self, key: str) -> Iterator[TomlTable]:
        """The tables of an array `[[key]]`."""
        value = self.get(key)
        if value is None:
            return
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            self._wrong(key, f"tables [[{dotted((*self.path, key))}]]", value)
            return
        for index, item in enumerate(value):
            yield TomlTable(item, (*self.path, key, index), self.report)

    def close(self) -> None:
        """Report the keys that were never read."""
        for key in self.values:
            if key in self.asked:
                continue
            if self.path and key in self.report.top:
                meant = f"move it above the first table; here it is a key of {dotted(self.path)}"
            else:
                meant = did_you_mean(key, self.asked - self.values.keys()) or did_you_mean(key, self.asked)
            self.note(self.report.codes.unknown, key, f"unknown key {key!r}", meant)

    def _finite(self, key: str, value: object, wanted: str) -> bool:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self._wrong(key, wanted, value)
            return False
        if isinstance(value, float) and not math.isfinite(value):
            self.note(self.report.codes.number, key, f"{value} is not a finite number")
            return False
        if abs(value) > MAX_NUMBER:
            self.note(
                self.report.codes.number, key, f"larger than any value of a machine, which is at most {MAX_NUMBER:g}"
            )
            return False
        return True

    def _wrong(self, key: str, wanted: str, value: object) -> None:
        self.note(self.report.codes.kind, key, f"expected {wanted}, found {shown(value)}")


def dotted(path: Path) -> str:
    """A path as people write it: effect[2].degree, with entries counted from 0."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".")


def shown(value: object) -> str:
    """A value for a message; lists and tables only by their kind."""
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return "a table"
    return f"{str(value).lower() if isinstance(value, bool) else repr(value)}"


def _is_integer(value: object) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)


def did_you_mean(word: str, words: Iterable[str]) -> str:
    """A hint with the most similar word, ignoring case; empty if none is similar."""
    small = {each.lower(): each for each in words}
    close = get_close_matches(word.lower(), small, 1, 0.6)
    return f"did you mean {small[close[0]]!r}?" if close else ""


# -- written -----------------------------------------------------------------------------------------------------------


def written(header: str, table: Mapping[str, Any]) -> str:
    """A table as text: its header, and one line per key; values None are left out."""
    rows = [f"{_key(key)} = {_value(item, len(key) + 3)}" for key, item in table.items() if item is not None]
    return "\n".join([header, *rows])


def _key(key: str) -> str:
    plain = key and all(letter.isascii() and (letter.isalnum() or letter in "_-") for letter in key)
    return key if plain else json.dumps(key)


def _value(item: Any, indent: int = 0) -> str:
    """A value in TOML, also of numpy types; long lists take several lines."""
    if hasattr(item, "tolist"):
        item = item.tolist()
    if isinstance(item, bool):
        return "true" if item else "false"
    if isinstance(item, int):
        return str(item)
    if isinstance(item, float):
        return repr(item)
    if isinstance(item, str):
        return json.dumps(item, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(item, datetime.date | datetime.time):
        return item.isoformat()
    if isinstance(item, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(each)}" for key, each in item.items()) + " }" if item else "{}"
    parts = [_value(each) for each in item]
    line = "[" + ", ".join(parts) + "]"
    if indent + len(line) <= WIDTH:
        return line
    return "[\n" + "".join(f"    {part},\n" for part in parts) + "]"
