"""Files of instruments and controls that hold error motions: Renishaw `.rtl`, ISG VOLCOMP CSV, Etalon exchange.

Each becomes a measurement of kind `axis`; plugins add readers of other files, of any kind. Files are recognised by
what they look like, not by their names. Values of `.rtl` are micrometres of positioning of the axis that the
file names, in its own sense (actual minus target); those of the others are mm and rad, and already relative to their
zero, so nothing of a set-up is unknown.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ncfix.diagnostics import ConfigError, Message, Place
from ncfix.machine import Axis, Machine
from ncfix.measure import checks
from ncfix.measure import renishaw as rtl
from ncfix.measure.measurement import Measurement
from ncfix.measure.renishaw import number_of
from ncfix.plugins import called, registry

LINEAR = "XYZ"
SLANTED = 1e-6
GRID = re.compile(r"\[(\w+)\]")
ERROR = re.compile(r"E[XYZABC][A-Z]")

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
    if found is None:
        return None
    if reader is renishaw:
        found = _of_bodies(found, machine)
    elif reader is not None:
        found = replace(found, remarks=(*found.remarks, *_backwards(found, machine)))
    return checks.checked(found, machine)


def _of_bodies(measurement: Measurement, machine: Machine) -> Measurement:
    """Deviations count the way the number of the axis grows, errors along the base axes: a table axis goes against."""
    factor = np.ones(len(measurement))
    for axis in _measured(measurement, machine):
        along = _along(axis)
        if abs(along) < 1 - SLANTED:
            text = f"{axis.name} does not move along its error axis: what it is off is no E{axis.name}{axis.name} alone"
            raise ConfigError.of("NCF618", text, Place(measurement.path), "give the errors as kind axis")
        factor[np.array(measurement.labels["axis"]) == axis.name] = np.sign(along)
    return measurement.with_columns({"value": factor * measurement.columns["value"]})


def _backwards(measurement: Measurement, machine: Machine) -> Iterator[Message]:
    """A word on axes whose bodies go the other way than their numbers: of them nobody says how a table counts."""
    for axis in _measured(measurement, machine):
        if _along(axis) < 0:
            text = f"errors of {axis.name} are taken along the base axes, against which it moves as its number grows"
            yield Message(
                "NCF618", text, Place(measurement.path), f"if they count as {axis.name} does, their sign is wrong"
            )


def _measured(measurement: Measurement, machine: Machine) -> list[Axis]:
    """The linear axes of which there are readings."""
    named = set(measurement.labels.get("axis", ()))
    return [axis for axis in machine.axes if axis.name in named and axis.name in LINEAR and not axis.rotary]


def _along(axis: Axis) -> float:
    """The part of its motion that is along the error axis of its own positioning error."""
    return float(np.asarray(axis.error_axes[LINEAR.index(axis.name)]) @ np.asarray(axis.direction))


def _by_plugin(text: str, path: str) -> Measurement | None:
    """What the first reader of a plugin makes of it that knows it."""
    readers: dict[str, Reader] = registry("readers")
    gives = (Measurement, type(None))
    found = (called("readers", name, read, text, path, gives=gives) for name, read in readers.items())
    return next((each for each in found if each is not None), None)


def _reader(text: str) -> Callable[[str, str], Measurement] | None:
    if text.lstrip().startswith("HEADER::") and "DEVIATIONS::" in text:
        return renishaw
    if "Gridpoints" in text or re.search(r"^\[[ABC]0[A-Z]\]", text, re.MULTILINE):
        return etalon
    words = _first_words(text)
    return isg if len(words) > 1 and any(ERROR.fullmatch(word) for word in words) else None


def renishaw(text: str, path: str) -> Measurement:
    """A Renishaw `.rtl`: targets in mm, deviations in um by run and target; a run goes the way of its targets."""
    file = rtl.read(text, path)
    axis, rows = file.axis(), Rows(path)
    for way, readings in file.runs():
        if len(readings) < len(file.targets):
            said = f"run {readings[0].run} has {len(readings)} of {len(file.targets)} targets"
            rows.remarks.append(Message("NCF618", said, Place(path, readings[0].line), "was it cut off?"))
        for each in readings:
            rows.add(f"E{axis}{axis}", file.targets[each.target - 1], each.value, each.line, each.run, way)
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
        values = [number_of(word, path, number) for word in words]
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
            position, value = (number_of(word, path, number) for word in plain.split())
            rows.add(section, position, value, number)
    return rows.measurement("none", "Etalon exchange")


def _first_words(text: str) -> list[str]:
    """The words of the first line that is not a comment."""
    for line in text.splitlines():
        plain = line.split("//")[0].strip()
        if plain:
            return re.split(r"[\s;,]+", plain)
    return []
