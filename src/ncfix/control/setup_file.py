"""The setup file (TOML): work offsets, tool lengths, start position and other data that a program cannot contain."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from typing import Any

from ncfix.arguments import WORK_OFFSET
from ncfix.control.coordinates import LETTERS
from ncfix.control.setup import CALCULATOR, POINTLESS, Setup, Tool
from ncfix.diagnostics import ConfigError, Place
from ncfix.files import read_bytes
from ncfix.inputs import MAX_CONFIG_BYTES
from ncfix.toml_text import KeyCodes, Report, TomlTable, decoded, key_lines, parsed

NOT_TOML = "NCF381"
UNKNOWN_KEY = "NCF382"
WRONG_VALUE = "NCF383"
CODES = KeyCodes(UNKNOWN_KEY, *4 * (WRONG_VALUE,))

VARIABLE = re.compile(r"#\d+|#<[^<>]*>|[A-Z_$][A-Z\d_$]*(?:\[[-\d, ]+\])?")
"""Names of variables: with # for RS274 and Fanuc, in upper case for other controls (R1, Q5, _DEPTH, LIST[2])."""

G_CODE = re.compile(r"G(\d{1,4})(?:\.(\d))?")
"""A G code as written in a program."""

TOOL = re.compile(r"\d{1,9}$|(?!T\d+$|\d+$).{2,}")
"""A tool number or a tool name."""


def load(path: str) -> Setup:
    """Read a setup file. Raises SourceError NCF002, or ConfigError NCF38x with everything that is wrong in it."""
    return loads(decoded(read_bytes(path, MAX_CONFIG_BYTES), path, NOT_TOML), path)


def loads(text: str, path: str = "<setup>") -> Setup:
    """The setup described by a text; raises ConfigError NCF38x with everything that is wrong in it."""
    content = parsed(text, path, NOT_TOML, "docs/formats.md shows a setup file")
    if "topology" in content:
        raise ConfigError.of(UNKNOWN_KEY, "this is a machine file, not a setup file", Place(path), "-m is for machines")
    report = Report(path, text, key_lines(text), top=set(READERS), codes=CODES)
    root = TomlTable(content, (), report)
    if root.integer("ncfix") not in (None, 1):
        root.note(WRONG_VALUE, "ncfix", f"schema version {content['ncfix']}, this ncfix reads 1")
    values = {key: reader(root, key) for key, reader in READERS.items() if root.has(key)}
    root.close()
    if report.messages:
        raise ConfigError.collected(sorted(report.messages, key=lambda each: each.place.line if each.place else 0))
    tools: dict[str, Tool] = values.pop("tools", {})
    numbered = {int(name): tool for name, tool in tools.items() if name.isdigit()}
    named = {name: tool for name, tool in tools.items() if not name.isdigit()}
    return Setup(tools=numbered, named_tools=named, **values)


def _each(
    pattern: re.Pattern[str], wrong: str, hint: str, reader: Callable[[TomlTable, str], Any]
) -> Callable[[TomlTable, str], dict[str, Any]]:
    """A reader of a table whose values are all read by `reader`; `wrong`: message for a name that is not allowed.

    Names may have blanks as in a program: `G54.1 P5` is G54.1P5.
    """

    def read(root: TomlTable, key: str) -> dict[str, Any]:
        found = {}
        for name, table, own in _entries(root.table(key)):
            plain = name if pattern.fullmatch(name) else "".join(name.split())
            if not pattern.fullmatch(plain):
                table.note(UNKNOWN_KEY, own, wrong, hint)
            elif plain in found:
                table.note(UNKNOWN_KEY, own, f"{plain} appears twice")
            found[plain] = reader(table, own)
        return found

    return read


def _entries(table: TomlTable | None) -> Iterator[tuple[str, TomlTable, str]]:
    """The entries of a table: name, and the table and the key that hold the value.

    `work_offsets.G59.1 = [0, 0, 0]` is {"G59": {"1": [0, 0, 0]}} to TOML: its name is G59.1.
    """
    if table is None:
        return
    for name, value in table.values.items():
        inner = TomlTable(value if isinstance(value, dict) else {}, (*table.path, name), table.report)
        rest = {part: each for part, each in inner.values.items() if not part[:1].isdigit()}
        yield from ((f"{name}.{part}", inner, part) for part in inner.values if part not in rest)
        if rest or not inner.values:
            yield name, TomlTable({name: rest or value}, table.path, table.report), name


def _codes(root: TomlTable, key: str) -> frozenset[int]:
    """A list of G codes, in tenths."""
    value = root.get(key)
    found = [G_CODE.fullmatch(each) for each in value if isinstance(each, str)] if isinstance(value, list) else []
    if not isinstance(value, list) or len(found) < len(value) or None in found:
        root.note(WRONG_VALUE, key, f'expected a list of G codes such as ["G332"], found {value!r}')
    return frozenset(10 * int(match[1]) + int(match[2] or 0) for match in found if match)


def _folders(root: TomlTable, key: str) -> tuple[str, ...]:
    """A list of existing folders; relative paths start from the folder of the setup file."""
    value = root.get(key)
    if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
        root.note(WRONG_VALUE, key, f"expected a list of folders, found {value!r}")
        return ()
    found = tuple(os.path.join(os.path.dirname(root.report.path), each) for each in value)
    for folder in found:
        if not os.path.isdir(folder):
            root.note(WRONG_VALUE, key, f"there is no folder {folder}")
    return found


def _switches(root: TomlTable, key: str) -> bool | frozenset[int] | None:
    """Position of the block delete switches: all on or off, the numbers of those on, or "both" for all positions."""
    value = root.get(key)
    if isinstance(value, bool):
        return value
    if isinstance(value, list) and all(type(each) is int and 0 <= each <= 9 for each in value):
        return frozenset(value)
    if value != "both":
        said = 'true, false, "both", or the numbers of the switches that are on, such as [2, 3]'
        root.note(WRONG_VALUE, key, f"expected {said}, found {value!r}")
    return None


def _count(root: TomlTable, key: str) -> int | None:
    """A positive integer."""
    value = root.integer(key)
    if value is not None and value < 1:
        root.note(WRONG_VALUE, key, f"expected a whole number above zero, found {value}")
    return value


def _position(table: TomlTable, key: str) -> dict[str, float | None]:
    """A table from axis letter to position."""
    axes = table.table(key)
    if axes is None:
        return {}
    for letter in axes.values:
        if letter.upper() not in tuple(LETTERS):
            axes.note(UNKNOWN_KEY, letter, "not an axis letter", f"they are {' '.join(LETTERS)}")
    return {letter.upper(): axes.number(letter) for letter in axes.values}


def _offset(table: TomlTable, key: str) -> dict[str, Any]:
    """A work offset: numbers in the order X Y Z A B C, or a table by axis letter."""
    value = table.get(key)
    if not isinstance(value, list):
        return _position(table, key)
    if not 1 <= len(value) <= len(LETTERS):
        table.note(WRONG_VALUE, key, f"expected 1 to {len(LETTERS)} numbers, found {len(value)}")
    return dict(zip(LETTERS, table.numbers(key) or (), strict=False))


def _tools(root: TomlTable, key: str) -> dict[str, Tool]:
    """Tools by number, or by name."""
    table = root.table(key)
    if table is None:
        return {}
    for name in table.values:
        if not TOOL.match(name):
            table.note(UNKNOWN_KEY, name, "not a tool number")
    return {name.strip().upper(): _tool(table, name) for name in table.values}


def _tool(table: TomlTable, key: str) -> Tool:
    """Length and radius of a tool; a plain number is the length."""
    if not isinstance(table.get(key), dict):
        return Tool(table.number(key))
    own = table.table(key)
    assert own is not None
    found = Tool(own.number("length"), own.number("radius"))
    own.close()
    return found


READERS: dict[str, Callable[[TomlTable, str], Any]] = {
    "work_offsets": _each(WORK_OFFSET, "not a work offset", "they are G54 ... G59.3, and G54.1P1 ...", _offset),
    "tools": _tools,
    "initial": _position,
    "references": _each(re.compile("G28|G30|M92"), "not a reference point", "they are G28, G30 and M92", _position),
    "variables": _each(VARIABLE, "not a parameter", 'they are written "#100" or "#<name>"', TomlTable.number),
    "inputs": _each(re.compile(".*", re.DOTALL), "", "", TomlTable.number),
    "workpiece_offset": lambda root, key: root.numbers(key, count=3),
    "tcp": TomlTable.flag,
    "assume_zero": TomlTable.flag,
    "block_skip": _switches,
    "no_point": lambda root, key: root.choice(key, CALCULATOR, *POINTLESS),
    "most_blocks": _count,
    "passed_codes": _codes,
    "subprograms": _folders,
    "probed": _position,
}
"""Readers of the top-level keys, which are fields of `Setup`."""
