"""Files of instruments and controls that hold error motions: Renishaw `.rtl`, ISG VOLCOMP CSV, Etalon exchange.

Each becomes a measurement of kind `axis`; plugins add readers of other files, of any kind. Files are recognised by
what they look like, not by their names. Values of `.rtl` are taken as micrometres of positioning of the axis that the
file names; those of the others are mm and rad, and already relative to their zero, so nothing of a set-up is unknown.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ncfix.diagnostics import ConfigError, Message, Place
from ncfix.machine import Machine
from ncfix.measure import checks
from ncfix.measure.measurement import Measurement
from ncfix.plugins import registry

GRID = re.compile(r"\[(\w+)\]")
ERROR = re.compile(r"E[XYZABC][A-Z]")
MICROMETRE = 1e-3

Reader = Callable[[str, str], Measurement | None]
"""Makes a measurement of a text and its path, or None if the text is not of its kind."""


@dataclass
class Rows:
    """Direct readings as they are collected."""

    path: str
    component: list[str] = field(default_factory=list)
    position: list[float] = field(default_factory=list)
    value: list[float] = field(default_factory=list)
    run: list[float] = field(default_factory=list)
    direction: list[float] = field(default_factory=list)
    line: list[int] = field(default_factory=list)
    remarks: list[Message] = field(default_factory=list)

    def add(self, component: str, position: float, value: float, line: int, run: int = 1, direction: int = 0) -> None:
        """One reading."""
        self.component.append(component)
        self.position.append(position)
        self.value.append(value)
        self.line.append(line)
        self.run.append(run)
        self.direction.append(direction)

    def measurement(self, setup: str, instrument: str) -> Measurement:
        """All of them."""
        if not self.line:
            raise ConfigError.of("NCF609", f"{instrument}: there are no readings", Place(self.path))
        names = ("position", "value", "run", "direction")
        columns = {name: np.array(getattr(self, name), dtype=np.float64) for name in names}
        labels = {"axis": tuple(name[2] for name in self.component), "component": tuple(self.component)}
        headers = (("ncfix-measurement", "1"), ("kind", "axis"), ("setup", setup), ("instrument", instrument))
        lines = np.array(self.line, dtype=np.int64)
        return Measurement("axis", headers, columns, labels, lines, self.path, tuple(self.remarks))


def recognised(text: str, machine: Machine, path: str) -> Measurement | None:
    """The measurement in an instrument's file, or None; raises `ConfigError` NCF609 ... NCF618."""
    reader = _reader(text)
    found = reader(text, path) if reader is not None else _by_plugin(text, path)
    return None if found is None else checks.checked(found, machine)


def _by_plugin(text: str, path: str) -> Measurement | None:
    """What the first reader of a plugin makes of it that knows it."""
    readers: dict[str, Reader] = registry("readers")
    return next((found for read in readers.values() if (found := read(text, path)) is not None), None)


def _reader(text: str) -> Callable[[str, str], Measurement] | None:
    if text.startswith("HEADER::") and "DEVIATIONS::" in text:
        return renishaw
    if "Gridpoints" in text or re.search(r"^\[[ABC]0[A-Z]\]", text, re.MULTILINE):
        return etalon
    words = _first_words(text)
    return isg if len(words) > 1 and any(ERROR.fullmatch(word) for word in words) else None


def renishaw(text: str, path: str) -> Measurement:
    """A Renishaw `.rtl`: targets in mm, deviations in um by run and target; a run goes the way of its targets."""
    lines = text.splitlines()
    axis = next((line.split(":")[1].strip() for line in lines if line.startswith("Axis:")), "")
    start = next((k for k, line in enumerate(lines) if line.startswith("Targets:")), None)
    if start is None or len(axis) != 1 or start + 1 >= len(lines):
        raise ConfigError.of("NCF618", "there is no line `Axis:` or `Targets:`", Place(path))
    targets = [_number(word, path, start + 2) for word in lines[start + 1].split()]
    rows, first = Rows(path), lines.index(next(line for line in lines if line.startswith("DEVIATIONS::"))) + 1
    readings = []
    for number, line in enumerate(lines[first:], first + 1):
        words = line.split()
        if len(words) == 3 and words[0].isdigit():
            readings.append((int(words[0]), int(words[1]), _number(words[2], path, number), number))
    for run in dict.fromkeys(each[0] for each in readings):
        mine = [each for each in readings if each[0] == run]
        way = int(np.sign(targets[mine[-1][1] - 1] - targets[mine[0][1] - 1])) if len(mine) > 1 else 0
        for _, target, value, number in mine:
            if not 1 <= target <= len(targets):
                raise ConfigError.of("NCF618", f"target {target} of {len(targets)}", Place(path, number))
            rows.add(f"E{axis}{axis}", targets[target - 1], value * MICROMETRE, number, run, way)
    return rows.measurement("line", "Renishaw")


def isg(text: str, path: str) -> Measurement:
    """An ISG VOLCOMP CSV of one axis: its position, then the components that the first line names, mm and rad."""
    rows, names = Rows(path), _first_words(text)
    if ERROR.fullmatch(names[1]) is None:
        where = Place(path, 1)
        raise ConfigError.of("NCF618", "a grid over several axes is a table, not a measurement of one axis", where)
    seen = False
    for number, line in enumerate(text.splitlines(), 1):
        words = re.split(r"[\s;,]+", line.split("//")[0].strip())
        if not words[0] or not seen:
            seen = seen or bool(words[0])
            continue
        if len(words) != len(names):
            raise ConfigError.of("NCF606", f"{len(words)} cells, there are {len(names)} columns", Place(path, number))
        values = [_number(word, path, number) for word in words]
        for name, value in zip(names[1:], values[1:], strict=True):
            rows.add(name, values[0], value, number)
    return rows.measurement("none", "ISG VOLCOMP CSV")


def etalon(text: str, path: str) -> Measurement:
    """An Etalon exchange file: sections [EXY] with position and value, mm and rad. Squareness values are left out."""
    rows, section = Rows(path), ""
    for number, line in enumerate(text.splitlines(), 1):
        plain = line.split("//")[0].strip()
        match = GRID.match(plain)
        if match:
            section = match[1]
        elif plain.startswith("VALUE"):
            what = f"[{section}] is a location error, not an error motion: put E{section} into the machine file"
            rows.remarks.append(Message("NCF618", what, Place(path, number, 1, line)))
        elif section and len(plain.split()) == 2 and ERROR.fullmatch(section):
            position, value = (_number(word, path, number) for word in plain.split())
            rows.add(section, position, value, number)
    return rows.measurement("none", "Etalon exchange")


def _first_words(text: str) -> list[str]:
    """The words of the first line that is not a comment."""
    for line in text.splitlines():
        plain = line.split("//")[0].strip()
        if plain:
            return re.split(r"[\s;,]+", plain)
    return []


def _number(word: str, path: str, line: int) -> float:
    try:
        value = float(word)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ConfigError.of("NCF608", f"{word!r} is not a number", Place(path, line), "numbers have a decimal point")
    return value
