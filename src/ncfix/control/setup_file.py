"""The setup file (TOML): work offsets, tool lengths, start position and the rest that a program cannot know."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

from ncfix.control.coordinates import LETTERS
from ncfix.control.setup import CALCULATOR, POINTLESS, Setup, Tool
from ncfix.diagnostics import ConfigError, Message, Place
from ncfix.files import read_bytes
from ncfix.inputs import MOST_SAID
from ncfix.toml_text import Path, decoded, key_lines, parsed, place_of

NOT_TOML = "NCF381"
UNKNOWN_KEY = "NCF382"
WRONG_VALUE = "NCF383"

SYSTEM = re.compile(r"G5[4-9]|G59\.[1-3]|G54\.1P\d+|G500|G5(?:0[5-9]|[1-9]\d)|PRESET\d*")
"""Names of work offsets: G54 to G59.3, G54.1 P1 and so on; those of SINUMERIK, G500, G505 to G599; and of the TNC:
PRESET, the one that is active when the program starts, PRESET1 and so on."""

LARGEST = 1e12
"""No length, angle, time or parameter is larger."""

VARIABLE = re.compile(r"#\d+|#<[^<>]*>|[A-Z_$][A-Z\d_$]*(?:\[[-\d, ]+\])?")
"""Parameters and variables: of RS274 and Fanuc with #, of other controls in upper case (R1, Q5, _DEPTH, LIST[2])."""

G_CODE = re.compile(r"G(\d{1,4})(?:\.(\d))?")
"""A G code as a program has it."""

TOOL = re.compile(r"\d{1,9}$|(?!T\d+$|\d+$).{2,}")
"""A tool is called by its number or by a name."""


def load(path: str) -> Setup:
    """The setup in a file. Raises SourceError NCF002, ConfigError NCF38x with all that is wrong in it."""
    return loads(decoded(read_bytes(path, MOST_SAID), path, NOT_TOML), path)


def loads(text: str, path: str = "<setup>") -> Setup:
    """The setup in a text; raises ConfigError NCF38x with all that is wrong in it."""
    content = parsed(text, path, NOT_TOML, "docs/formats.md shows a setup file")
    if "topology" in content:
        raise ConfigError.of(UNKNOWN_KEY, "this is a machine file, not a setup file", Place(path), "-m is for machines")
    reading = SetupReading(path, text, key_lines(text))
    values = {key: reading.entry(key, value) for key, value in content.items()}
    if reading.faults:
        raise ConfigError.collected(reading.faults)
    tools: dict[str, Tool] = values.pop("tools", {})
    numbered = {int(name): tool for name, tool in tools.items() if name.isdigit()}
    named = {name: tool for name, tool in tools.items() if not name.isdigit()}
    rest = {key: value for key, value in values.items() if key != "ncfix"}
    return Setup(tools=numbered, named_tools=named, **rest)


@dataclass(slots=True)
class SetupReading:
    """A setup file while it is read; faults are collected."""

    path: str
    source: str
    lines: Mapping[Path, int]
    faults: list[Message] = field(default_factory=list)

    def fault(self, code: str, key: str, text: str, hint: str = "") -> None:
        """Note what is wrong with a key."""
        place = place_of(self._line(key), self.source, self.path)
        self.faults.append(Message(code, f"{key}: {text}", place, hint))

    def _line(self, key: str) -> int:
        """The line of a key, or of the nearest one around it; names of tools and offsets may have dots themselves."""
        around = {".".join(map(str, path)): line for path, line in self.lines.items() if path}
        return around[max((name for name in around if f"{key}.".startswith(f"{name}.")), key=len)]

    def entry(self, key: str, value: Any) -> Any:
        """The value of a top-level key as `Setup` wants it."""
        readers: dict[str, Callable[[str, Any], Any]] = {
            "ncfix": self.schema,
            "work_offsets": lambda name, table: self.each(name, table, self.offset),
            "tools": self.tools,
            "initial": self.position,
            "references": lambda name, table: self.each(name, table, self.reference),
            "variables": lambda name, table: self.each(name, table, self.variable),
            "inputs": lambda name, table: self.each(name, table, self.number),
            "workpiece_offset": self.triple,
            "tcp": self.flag,
            "assume_zero": self.flag,
            "block_skip": self.switches,
            "no_point": self.no_point,
            "most_blocks": self.count,
            "passed_codes": self.codes,
            "subprograms": self.folders,
            "probed": self.position,
        }
        if key not in readers:
            close = get_close_matches(key, readers, 1)
            hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(readers)}"
            self.fault(UNKNOWN_KEY, key, "unknown key", hint)
            return None
        return readers[key](key, value)

    def each(self, key: str, table: Any, reader: Callable[[str, Any], Any]) -> dict[str, Any]:
        """A table whose values are all of one kind."""
        if not isinstance(table, Mapping):
            self.fault(WRONG_VALUE, key, "expected a table")
            return {}
        return {name: reader(f"{key}.{name}", value) for name, value in flattened(table).items()}

    def codes(self, key: str, value: Any) -> frozenset[int]:
        """A list of G codes, in tenths."""
        found = [G_CODE.fullmatch(each) for each in value if isinstance(each, str)] if isinstance(value, list) else []
        codes = frozenset(10 * int(match[1]) + int(match[2] or 0) for match in found if match)
        if not isinstance(value, list) or len(found) < len(value) or None in found:
            self.fault(WRONG_VALUE, key, f'expected a list of G codes such as ["G332"], found {value!r}')
        return codes

    def folders(self, key: str, value: Any) -> tuple[str, ...]:
        """A list of folders that there are; a relative path counts from that of the setup file."""
        if not isinstance(value, list) or not all(isinstance(each, str) for each in value):
            self.fault(WRONG_VALUE, key, f"expected a list of folders, found {value!r}")
            return ()
        found = tuple(os.path.join(os.path.dirname(self.path), each) for each in value)
        for folder in found:
            if not os.path.isdir(folder):
                self.fault(WRONG_VALUE, key, f"there is no folder {folder}")
        return found

    # -- single values ------------------------------------------------------------------------------------------------

    def schema(self, key: str, value: Any) -> None:
        """The version of the schema."""
        if value != 1:
            self.fault(WRONG_VALUE, key, f"schema version {value!r}, this ncfix reads 1")

    def number(self, key: str, value: Any) -> float:
        """A finite number."""
        if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
            self.fault(WRONG_VALUE, key, f"expected a number, found {value!r}")
            return 0.0
        if abs(value) > LARGEST:
            said = value if isinstance(value, float) else "a larger one"
            self.fault(WRONG_VALUE, key, f"expected a number of {LARGEST:g} at most, found {said}")
            return 0.0
        return float(value)

    def flag(self, key: str, value: Any) -> bool:
        """True or false."""
        if not isinstance(value, bool):
            self.fault(WRONG_VALUE, key, f"expected true or false, found {value!r}")
        return value is True

    def switches(self, key: str, value: Any) -> bool | frozenset[int] | None:
        """How the switches of block delete stand: all on or off, those that are on, or "both" for all positions."""
        if isinstance(value, bool):
            return value
        if isinstance(value, list) and all(type(each) is int and 0 <= each <= 9 for each in value):
            return frozenset(value)
        if value != "both":
            said = 'true, false, "both", or the numbers of the switches that are on, such as [2, 3]'
            self.fault(WRONG_VALUE, key, f"expected {said}, found {value!r}")
        return None

    def no_point(self, key: str, value: Any) -> str:
        """What numbers without a decimal point mean."""
        if value not in (CALCULATOR, *POINTLESS):
            self.fault(WRONG_VALUE, key, f"expected {CALCULATOR} or {', '.join(POINTLESS)}, found {value!r}")
        return str(value)

    def count(self, key: str, value: Any) -> int:
        """A whole number above zero."""
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            self.fault(WRONG_VALUE, key, f"expected a whole number above zero, found {value!r}")
            return 1
        return value

    def triple(self, key: str, value: Any) -> tuple[float, float, float]:
        """Three numbers."""
        if not isinstance(value, list) or len(value) != 3:
            self.fault(WRONG_VALUE, key, "expected three numbers [x, y, z], mm")
            return 0.0, 0.0, 0.0
        x, y, z = (self.number(key, part) for part in value)
        return x, y, z

    def position(self, key: str, value: Any) -> dict[str, float]:
        """A table from axis letter to position."""
        if not isinstance(value, Mapping):
            self.fault(WRONG_VALUE, key, "expected a table like { X = 0.0, Z = 300.0 }")
            return {}
        for letter in value:
            if str(letter).upper() not in tuple(LETTERS):
                self.fault(UNKNOWN_KEY, f"{key}.{letter}", "no axis letter", f"they are {' '.join(LETTERS)}")
        return {str(letter).upper(): self.number(f"{key}.{letter}", part) for letter, part in value.items()}

    def offset(self, key: str, value: Any) -> dict[str, float]:
        """A work offset: numbers in the order X Y Z A B C, or a table by axis letter."""
        name = key.partition(".")[2]
        if not SYSTEM.fullmatch(name):
            self.fault(UNKNOWN_KEY, key, "no work offset", "they are G54 ... G59.3, and G54.1P1 ...")
        if isinstance(value, list):
            if not 1 <= len(value) <= len(LETTERS):
                self.fault(WRONG_VALUE, key, f"expected 1 to {len(LETTERS)} numbers, found {len(value)}")
            return {letter: self.number(key, part) for letter, part in zip(LETTERS, value, strict=False)}
        return self.position(key, value)

    def reference(self, key: str, value: Any) -> dict[str, float]:
        """The position of a reference point."""
        if key.partition(".")[2] not in ("G28", "G30"):
            self.fault(UNKNOWN_KEY, key, "no reference point", "they are G28 and G30")
        return self.position(key, value)

    def variable(self, key: str, value: Any) -> float:
        """The value of a parameter or variable, `"#100"`, `"#<name>"`, `R1`, `NAME`."""
        if not VARIABLE.fullmatch(key.partition(".")[2]):
            self.fault(UNKNOWN_KEY, key, "no parameter", 'they are written "#100" or "#<name>"')
        return self.number(key, value)

    def tools(self, key: str, value: Any) -> dict[str, Tool]:
        """Tools by number, or by name."""
        if not isinstance(value, Mapping):
            self.fault(WRONG_VALUE, key, "expected a table like 12 = { length = 120.0 }")
            return {}
        called = {name: self.tool(f"{key}.{name}", part) for name, part in value.items() if self.is_tool(key, name)}
        return {name.strip().upper(): tool for name, tool in called.items()}

    def is_tool(self, key: str, name: str) -> bool:
        """Whether a key can be what a tool is called."""
        if not TOOL.match(name):
            self.fault(UNKNOWN_KEY, f"{key}.{name[:20]}", "no tool number")
        return TOOL.match(name) is not None

    def tool(self, key: str, value: Any) -> Tool:
        """Length and radius of a tool; a plain number is the length."""
        if not isinstance(value, Mapping):
            return Tool(self.number(key, value))
        for name in value:
            if name not in ("length", "radius"):
                close = get_close_matches(name, ("length", "radius"), 1)
                self.fault(UNKNOWN_KEY, f"{key}.{name}", "unknown key", f"did you mean {close[0]}?" if close else "")
        length, radius = (
            self.number(f"{key}.{name}", value[name]) if name in value else None for name in ("length", "radius")
        )
        return Tool(length, radius)


def flattened(table: Mapping[str, Any]) -> dict[str, Any]:
    """A table in which `G59.1 = ..`, which TOML takes for a table in a table, has its key back.

    `work_offsets.G59.1 = [0, 0, 0]` is {"G59": {"1": [0, 0, 0]}} to TOML.
    """
    flat: dict[str, Any] = {}
    for key, value in table.items():
        inner = value if isinstance(value, Mapping) else {}
        flat |= {f"{key}.{name}": part for name, part in inner.items() if str(name).isdigit()}
        rest = {name: part for name, part in inner.items() if not str(name).isdigit()}
        if rest or not inner:
            flat[key] = rest or value
    return flat
