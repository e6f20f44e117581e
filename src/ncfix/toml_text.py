"""TOML files as people write them: decoded, parsed, written; and where a key stands, which the parser does not say.

Paths are tuples of keys and indices, `("effect", 2, "degree")`. Only keys that stand at the start of a line are
found; for others the line of the table that holds them is good enough.
"""

from __future__ import annotations

import datetime
import json
import math
import re
import tomllib
from collections.abc import Mapping
from typing import Any

from ncfix.diagnostics import ConfigError, Place

Path = tuple[str | int, ...]
BARE = r"[A-Za-z0-9_-]+"
KEY = rf"""(?:{BARE}|"[^"\n]*"|'[^'\n]*')"""
DOTTED = rf"{KEY}(?:\s*\.\s*{KEY})*"
HEADER = re.compile(rf"\s*(\[\[?)\s*({DOTTED})\s*\]")
ASSIGNMENT = re.compile(rf"\s*({DOTTED})\s*=")
QUOTES = re.compile(r'"""|\'\'\'')
OTHERS = {
    "a measurement": re.compile(r"# *ncfix-measurement"),
    "an NC program": re.compile(r"\s*(?:[%;(]|[NOG][\d.]++[ \t]*+(?!=)|\d*\s*BEGIN PGM)"),
}
"""How files begin that are named where TOML is meant."""
WIDTH = 120
"""Characters in a line that is written."""


def decoded(source: bytes, path: str, code: str) -> str:
    """The text of a file, without the mark that some editors put before it; raises `ConfigError` with this code."""
    try:
        return source.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = source[: error.start].decode("utf-8-sig")
        line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
        place = Place(path, line, column, _row(source.decode(errors="replace").removeprefix("\ufeff"), line))
        text = f"not a text in UTF-8: byte 0x{source[error.start]:02X}"
        raise ConfigError.of(code, text, place, "save it as UTF-8") from error


def parsed(text: str, path: str, code: str, hint: str = "") -> dict[str, Any]:
    """What a text says; raises `ConfigError` with this code and the place if it is not TOML."""
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
        text = "not TOML that can be read: a number has thousands of digits"
        raise ConfigError.of(code, text, Place(path), hint) from error
    except RecursionError as error:
        raise ConfigError.of(code, "not TOML that can be read: nested too deeply", Place(path), hint) from error


def place_of(line: int, text: str, path: str) -> Place:
    """A line, and in it the first character that is not a blank."""
    row = _row(text, line)
    return Place(path, line, len(row) - len(row.lstrip()) + 1 if row.strip() else 0, row)


def _row(text: str, line: int) -> str:
    rows = text.split("\n")
    return rows[line - 1].rstrip("\r") if line <= len(rows) else ""


def key_lines(text: str) -> Mapping[Path, int]:
    """Path -> line, from 1, of every table header and every key that stands at the start of a line."""
    lines: dict[Path, int] = {(): 1}
    counts: dict[Path, int] = {}
    table: Path = ()
    quote = ""
    for number, line in enumerate(text.split("\n"), start=1):
        if quote:
            quote = "" if line.count(quote) % 2 else quote
            continue
        if header := HEADER.match(line):
            table = _opened(_keys(header[2]), header[1] == "[[", counts)
            _note(table, 0, number, lines)
        elif assignment := ASSIGNMENT.match(line):
            _note(table + _keys(assignment[1]), len(table), number, lines)
        found = QUOTES.findall(line)
        quote = found[0] if len(found) % 2 else ""
    return lines


def _note(path: Path, known: int, number: int, lines: dict[Path, int]) -> None:
    """A path, and the tables that its dots make, beyond the `known` first of its keys."""
    for depth in range(known + 1, len(path) + 1):
        lines.setdefault(path[:depth], number)


def line_of(path: Path, lines: Mapping[Path, int]) -> int:
    """The line of this key, or of the nearest table around it."""
    while path not in lines:
        path = path[:-1]
    return lines[path]


def _opened(keys: Path, repeated: bool, counts: dict[Path, int]) -> Path:
    """The path of a table header; tables of an array are counted."""
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


def written(header: str, table: Mapping[str, Any]) -> str:
    """A table as text: its header, and a line a key; what is None is left out."""
    rows = [f"{_key(key)} = {_value(item, len(key) + 3)}" for key, item in table.items() if item is not None]
    return "\n".join([header, *rows])


def _key(key: str) -> str:
    plain = key and all(letter.isascii() and (letter.isalnum() or letter in "_-") for letter in key)
    return key if plain else json.dumps(key)


def _value(item: Any, indent: int = 0) -> str:
    """A value in TOML; long lists go over several lines."""
    if isinstance(item, bool):
        return "true" if item else "false"
    if isinstance(item, int):
        return str(item)
    if isinstance(item, float):
        return (
            repr(float(item)) if math.isfinite(item) else "nan" if math.isnan(item) else "inf" if item > 0 else "-inf"
        )
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
