"""Readers of other files with error motions: Renishaw `.rtl`, ISG VOLCOMP CSV, Etalon exchange.

Each file becomes a measurement of kind `axis`. Plugins add readers of further files, of any kind. Files are recognised
by their content, not by their names. Values of `.rtl` are positioning deviations in micrometres, in the sense of the
axis (actual minus target); values of the others are mm and rad relative to a known zero, so no set-up is unknown.

The maker does not publish the format `.rtl`; public readers and writers agree on its sections and keys: `Targets` in
mm, over several lines until the next key; lines of run, target and deviation in micrometres. The file does not state
which error was measured, except in free texts: it is read as positioning, and refused if these say otherwise.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import field, replace
from itertools import pairwise
from pathlib import PurePath

import numpy as np

from ncfix.diagnostics import ConfigError, Message, Place
from ncfix.machine import Axis, Machine
from ncfix.machine.axes import COMPONENTS
from ncfix.measure import checks
from ncfix.measure.measurement import Measurement, component_of
from ncfix.plugins import called, registry
from ncfix.values import frozen, mutable

LINEAR = "XYZ"
SLANTED = 1e-6
GRID = re.compile(r"\[(\w+)\]")
ERROR = re.compile(r"E[XYZABC][A-Z]")
LOCATION = re.compile(r"E[XYZABC]0[A-Z]")

SECTION = re.compile(r"([A-Z][A-Z -]*)::")
KEY = re.compile(r"([A-Za-z][\w -]*?)\s*:(.*)")
LETTER = re.compile(
    r"(?<![0-9a-z\u00c0-\u024f])([a-z])(?:[\s_-]*(?:axis|achse))?(?![0-9a-z\u00c0-\u024f])", re.IGNORECASE
)
"""A single letter as a word, in any language: `X-axis`, `Eje X`, `X\u8f74`."""
OTHER = re.compile(r"straight|square|angular|flatness|diagonal|(?<![a-z])(?:pitch|yaw|roll)(?![a-z])", re.IGNORECASE)
"""Words of a title that mean another error than positioning."""
ANOTHER_ERROR = re.compile(r"\.rt[a-km-z]")
"""Suffixes of files of other errors, such as angles (.rta) and straightness (.rts), with the sections of `.rtl`."""
MICROMETRE = 1e-3
"""mm per micrometre."""
METRIC = re.compile(
    r"(?:[\W\d]|mm|metric|millimet(?:re|er)s?|[u\u00b5\u03bc]m|microns?|micromet(?:re|er)s?)*", re.IGNORECASE
)
"""A line of an `.rtl` about units that names those in which it is read."""
ONCE = ("axis", "targets", "target-count", "run-count", "run target data")
"""Keys of an `.rtl` that stand there once."""

Reader = Callable[[str, str], Measurement | None]
"""A function of text and path that returns a measurement, or None if it does not know the format."""


@mutable(slots=False)
class Rows:
    """A list of direct readings that a reader collects."""

    path: str
    component: list[str] = field(default_factory=list)
    position: list[float] = field(default_factory=list)
    value: list[float] = field(default_factory=list)
    run: list[float] = field(default_factory=list)
    direction: list[float] = field(default_factory=list)
    line: list[int] = field(default_factory=list)
    remarks: list[Message] = field(default_factory=list)

    def add(self, component: str, position: float, value: float, line: int, run: int = 1, direction: int = 0) -> None:
        """Add one reading; `position` in mm or degree, `value` in mm or rad."""
        self.component.append(component)
        self.position.append(position)
        self.value.append(value)
        self.line.append(line)
        self.run.append(run)
        self.direction.append(direction)

    def measurement(self, setup: str, instrument: str) -> Measurement:
        """The readings as a measurement; raises `ConfigError` NCF609 if there are none."""
        if not self.line:
            raise ConfigError.of("NCF609", f"{instrument}: there are no readings", Place(self.path))
        names = ("position", "value", "run", "direction")
        columns = {name: np.array(getattr(self, name), dtype=np.float64) for name in names}
        labels = {"axis": tuple(name[2] for name in self.component), "component": tuple(self.component)}
        headers = (("ncfix-measurement", "1"), ("kind", "axis"), ("setup", setup), ("instrument", instrument))
        lines = np.array(self.line, dtype=np.int64)
        return Measurement("axis", headers, columns, labels, lines, self.path, tuple(self.remarks))


def recognised(text: str, machine: Machine, path: str) -> Measurement | None:
    """The measurement in an instrument's file; None if no reader knows it. Raises `ConfigError` NCF606 ... NCF618."""
    reader = _reader(text)
    found = reader(text, path) if reader is not None else _by_plugin(text, path)
    if found is None:
        return None
    if reader is renishaw:
        found = of_bodies(found, machine)
    elif reader is not None:
        hint = "if they are in the counting direction of the axis, their sign is wrong"
        found = replace(found, remarks=(*found.remarks, *backwards(found, machine, "NCF618", hint)))
    return checks.checked(found, machine)


def of_bodies(measurement: Measurement, machine: Machine) -> Measurement:
    """Convert positioning deviations from the sense of the axis to errors of the body along the base axes.

    The sign of a table axis, whose body moves against its positive direction, is reversed. Raises `ConfigError` NCF618
    for an axis that is not parallel to its error axis.
    """
    factor = np.ones(len(measurement))
    for axis, component, rows in _positioned(measurement, machine):
        along = axis.along(component)
        if abs(along) < 1 - SLANTED:
            text = (
                f"{axis.name} does not move along its error axis, so its deviations are not E{component}{axis.name} "
                "alone"
            )
            raise ConfigError.of("NCF618", text, Place(measurement.path), "give the errors as kind axis")
        factor[rows] = np.sign(along)
    return measurement.with_columns({"value": factor * measurement.columns["value"]})


def backwards(measurement: Measurement, machine: Machine, code: str, hint: str) -> Iterator[Message]:
    """Remarks, with this code and hint, on positioning of axes whose bodies move against their positive direction."""
    for axis, component, rows in _positioned(measurement, machine):
        if axis.along(component) < 0:
            own = f"E{component}{axis.name}"
            text = f"{own} is taken along the base axis, but {axis.name} moves against it as its number grows"
            yield Message(code, text, measurement.place(rows[0]), hint)


def _positioned(measurement: Measurement, machine: Machine) -> Iterator[tuple[Axis, str, list[int]]]:
    """The axes whose positioning was read: (axis, component, indices of the rows)."""
    read = list(map(component_of, measurement.labels["axis"], measurement.labels["component"]))
    for axis in machine.axes:
        for component in filter(axis.owns, COMPONENTS):
            rows = [row for row, name in enumerate(read) if name == f"E{component}{axis.name}"]
            if rows:
                yield axis, component, rows


def _by_plugin(text: str, path: str) -> Measurement | None:
    """The measurement by the first plugin reader that knows the format; None if there is none."""
    readers: dict[str, Reader] = registry("readers")
    gives = (Measurement, type(None))
    found = (called("readers", name, read, text, path, gives=gives) for name, read in readers.items())
    return next((each for each in found if each is not None), None)


def _reader(text: str) -> Callable[[str, str], Measurement] | None:
    if text.lstrip().startswith("HEADER::"):
        return renishaw
    if "Gridpoints" in text or re.search(r"^\[[ABC]0[A-Z]\]", text, re.MULTILINE):
        return etalon
    words = _first_words(text)
    return isg if len(words) > 1 and any(ERROR.fullmatch(word) for word in words) else None


def renishaw(text: str, path: str) -> Measurement:
    """The measurement in a Renishaw `.rtl`: targets in mm, deviations in um by run and target.

    The direction of approach of a target is that from the target before it in its run. At a reversal, where two
    consecutive targets are equal, it is that of the next motion.
    """
    file = _rtl(text, path)
    axis, rows = file.axis(), Rows(path)
    for readings in file.runs():
        if len(readings) < len(file.targets):
            said = f"run {readings[0].run} has only {len(readings)} of {len(file.targets)} targets"
            rows.remarks.append(Message("NCF618", said, Place(path, readings[0].line), "was it cut off?"))
        places = [file.targets[each.target - 1] for each in readings]
        ways = np.sign(np.diff(places))
        came = [*ways[:1], *(back or on for back, on in pairwise([*ways, 0.0]))] if len(ways) else [0.0]
        for each, place, way in zip(readings, places, came, strict=True):
            rows.add(f"E{axis}{axis}", place, each.value, each.line, each.run, int(way))
    return rows.measurement("line", "Renishaw")


def isg(text: str, path: str) -> Measurement:
    """The measurement in an ISG VOLCOMP CSV of one axis: position, then the errors named in the first line, mm, rad."""
    rows, names = Rows(path), _first_words(text)
    where = Place(path, next(n for n, line in enumerate(text.splitlines(), 1) if line.split("//")[0].strip()))
    axis, *components = names
    _check_isg_names(axis, components, where)
    for number, line in enumerate(text.splitlines(), 1):
        words = re.split(r"[\s;,]+", line.split("//")[0].strip())
        if not words[0] or number <= where.line:
            continue
        hint = "numbers have a decimal point" if re.search(r"\d,\d", line) else ""
        if len(words) != len(names) or (hint and ";" in line):
            same = len(words) == len(names)
            said = "a decimal comma" if same else f"{len(words)} cells, but {len(names)} columns"
            raise ConfigError.of("NCF606", said, Place(path, number, 0, line), hint)
        values = [number_of(word, path, number) for word in words]
        for name, value in zip(components, values[1:], strict=True):
            if ERROR.fullmatch(name):
                rows.add(name, values[0], value, number)
    for name in components:
        if not ERROR.fullmatch(name):
            rows.remarks.append(Message("NCF618", _located(name), where))
    return rows.measurement("none", "ISG VOLCOMP CSV")


def _check_isg_names(axis: str, components: Sequence[str], where: Place) -> None:
    """Raise `ConfigError` NCF618 unless these are the columns of one axis."""
    text = ""
    if len(axis) > 1:
        text = f"the first column is {axis!r}, not the position of an axis: X"
    elif components[0] in LINEAR + "ABC":
        text = "a grid over several axes is a table, not a measurement of one axis"
    elif len(set(components)) < len(components):
        text = f"a column appears twice: {' '.join(components)}"
    elif others := [name for name in components if ERROR.fullmatch(name) and name[2] != axis]:
        text = f"{others[0]} is not an error of {axis}, whose positions are in the first column"
    elif strangers := [name for name in components if not ERROR.fullmatch(name) and not LOCATION.fullmatch(name)]:
        text = f"{strangers[0]!r} is not an error of {axis}, such as EX{axis}"
    if text:
        raise ConfigError.of(
            "NCF618", text, where, "ncfix reads mm, degree and rad; other readings need a file of kind axis"
        )


def etalon(text: str, path: str) -> Measurement:
    """The measurement in an Etalon exchange file: sections [EXY] of position and value, mm and rad.

    Squareness values are skipped with a remark.
    """
    rows, section, seen = Rows(path), "", set[str]()
    for number, line in enumerate(text.splitlines(), 1):
        plain = line.split("//")[0].strip()
        words = re.sub(r"^Gridpoints\s*=\s*\{|\}$", "", plain).split()
        if match := GRID.fullmatch(plain):
            section = match[1]
            if section in seen:
                hint = "give each measurement as a file of its own"
                raise ConfigError.of("NCF618", f"[{section}] appears twice", Place(path, number, 1, line), hint)
            seen.add(section)
        elif section and re.match(r"VALUE\s*=", plain):
            rows.remarks.append(Message("NCF618", _located(f"E{section}", section), Place(path, number, 1, line)))
        elif len(words) == 2 and ERROR.fullmatch(section):
            position, value = (number_of(word, path, number) for word in words)
            rows.add(section, position, value, number)
        elif words:
            said = (
                f"invalid line: expected [EXY], or position and value of such an error, or VALUE of {section or 'C0B'}"
            )
            raise ConfigError.of("NCF618", said, Place(path, number, 1, line))
    return rows.measurement("none", "Etalon exchange")


def _located(name: str, called: str = "") -> str:
    """The remark on a location error in a file of error motions."""
    return f"[{called or name}] is a location error, not an error motion: enter {name} in the machine file"


def _first_words(text: str) -> list[str]:
    """The words of the first line that is not a comment."""
    for line in text.splitlines():
        plain = line.split("//")[0].strip()
        if plain:
            return re.split(r"[\s;,]+", plain)
    return []


# -- Renishaw ----------------------------------------------------------------------------------------------------------


@frozen
class Deviation:
    """One deviation of an `.rtl`: run and target, counted from 1; value, mm; line of the file."""

    run: int
    target: int
    value: float
    line: int


@mutable
class Rtl:
    """The content of an `.rtl`: key -> (text, line), targets (mm), and readings."""

    path: str
    texts: dict[str, tuple[str, int]] = field(default_factory=dict)
    targets: list[float] = field(default_factory=list)
    readings: list[Deviation] = field(default_factory=list)

    def axis(self) -> str:
        """The letter of the axis; raises `ConfigError` NCF618 if it is missing or another error was measured."""
        text, line = self.texts.get("axis", ("", 0))
        letters = {match[1].upper() for match in LETTER.finditer(text)}
        if len(letters) != 1:
            raise self.odd(f"the axis is {text!r}" if line else "there is no line `Axis:`", line, "a letter: Axis: X")
        letter = letters.pop()
        if letter in "ABC":
            said = (
                "the unit of the deviations of a rotary axis in such files is not published: give them in a file of "
                "kind axis, in rad"
            )
            raise self.odd(said, line, "docs/formats.md, Measurement file")
        if ANOTHER_ERROR.fullmatch(suffix := PurePath(self.path).suffix.lower()):
            said = f"a {suffix} file contains another error than positioning, in a unit that is not published"
            raise self.odd(said, line, "give the readings in a file of kind axis, with their component")
        for key in ("title", "filetype", "location"):
            other, where = self.texts.get(key, ("", 0))
            if OTHER.search(other):
                said = (
                    f"{other!r} names another error than positioning; the file states neither its component nor its "
                    "unit"
                )
                raise self.odd(said, where, "give the readings in a file of kind axis, with their component")
        return letter

    def checked(self) -> Rtl:
        """The file, checked for consistent counts and targets; raises `ConfigError` NCF609, NCF618."""
        for key, (text, line) in self.texts.items():
            if (key == "unit" or key.endswith("units")) and not METRIC.fullmatch(text):
                raise self.odd(f"{key} {text!r}: targets are read as mm, deviations as um", line, "convert the numbers")
        counts = {"target-count": len(self.targets), "run-count": len({each.run for each in self.readings})}
        if not self.targets:
            raise self.odd("there is no line `Targets:`, or nothing below it", 0)
        for each in self.readings:
            if not 1 <= each.target <= len(self.targets):
                raise self.odd(f"target {each.target} of {len(self.targets)}", each.line)
        for key, count in counts.items():
            text, line = self.texts.get(key, ("", 0))
            if text.isdecimal() and int(text) != count and self.readings:
                raise self.odd(f"{key} is {text}, but the file has {count}: is a part of the file missing?", line)
        return self

    def runs(self) -> Iterator[list[Deviation]]:
        """The readings of each run, as they were taken."""
        for run in dict.fromkeys(each.run for each in self.readings):
            yield [each for each in self.readings if each.run == run]

    def odd(self, text: str, line: int, hint: str = "") -> ConfigError:
        """The error NCF618."""
        return ConfigError.of("NCF618", text, Place(self.path, line), hint)


def _rtl(text: str, path: str) -> Rtl:
    """The content of a file; raises `ConfigError` NCF608 and NCF618."""
    found, section, key = Rtl(path), "", ""
    for number, line in enumerate(text.splitlines(), 1):
        plain = line.strip()
        if match := SECTION.fullmatch(plain):
            section, key = match[1], ""
        elif match := KEY.match(plain):
            key = match[1].lower()
            if key in ONCE and key in found.texts:
                raise found.odd(f"`{match[1]}:` appears twice", number, "one measurement in a file")
            found.texts.setdefault(key, (match[2].strip(), number))
            plain = match[2]
        if key == "targets":
            found.targets += [number_of(word, path, number) for word in plain.split()]
        elif section == "DEVIATIONS" and plain.strip() and (not match or key == "run target data"):
            found.readings.append(_deviation(found, plain.split(), number))
    return found.checked()


def _deviation(file: Rtl, words: list[str], line: int) -> Deviation:
    if len(words) != 3 or not words[0].isdecimal() or not words[1].isdecimal():
        raise file.odd("not a line with run, target and deviation", line, "three numbers: 1 12 -0.8")
    return Deviation(int(words[0]), int(words[1]), number_of(words[2], file.path, line) * MICROMETRE, line)


def number_of(word: str, path: str, line: int) -> float:
    """A finite number from text; raises `ConfigError` NCF608."""
    try:
        value = float(word)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ConfigError.of("NCF608", f"{word!r} is not a number", Place(path, line), "numbers have a decimal point")
    return value
