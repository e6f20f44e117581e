"""Machine files: TOML to `Machine`, with every fault of the file named at once.

docs/formats.md describes the file. Millimetres and degrees there are mm and rad here.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ncfix.diagnostics import ConfigError, Place
from ncfix.files import READING
from ncfix.inputs import MOST_SAID, taken
from ncfix.machine import topology
from ncfix.machine.axis import BASE_AXES, ORIGIN, Axis, Tool, Triad, Vector
from ncfix.machine.effect import Effect
from ncfix.machine.effect_file import read_effects
from ncfix.machine.fields import Report, Section, did_you_mean
from ncfix.machine.library import Named, library
from ncfix.machine.machine import DEFAULT_CORRECTION, DEFAULT_INCREMENT, Machine
from ncfix.machine.summary import at_the_ends
from ncfix.machine.topology import Topology
from ncfix.toml_text import decoded, key_lines, parsed

SCHEMA = 1
TOP = ("ncfix", "name", "topology", "control", "least_increment", "max_correction", "workpiece_offset")
"""Keys that stand above the tables."""
SETUP = {"work_offsets", "tools", "initial", "references", "variables"}
"""Tables that only a setup file has."""
DEGREE = np.pi / 180
EXACT = 1e-14
"""A vector this near to unit length is left as it is written."""
TILTED = 1e-6
"""Error axes that are this far from orthonormal are a mistake."""


def load(path: str | Path) -> Machine:
    """The machine that a file describes. Raises `ConfigError` with every fault found (NCF300 to NCF319)."""
    try:
        source = taken(os.fspath(path), MOST_SAID)
    except OSError as error:
        text = f"cannot read the machine file: {error.strerror}"
        hint = READING.get(error.errno or 0, "give an existing file's path")
        raise ConfigError.of("NCF300", text, Place(str(path)), hint) from error
    return loads(source, str(path))


def loads(source: str | bytes, path: str = "<machine>") -> Machine:
    """The machine that a text describes. Raises `ConfigError` with every fault found; `path` is for messages."""
    text = source if isinstance(source, str) else decoded(source, path, "NCF301")
    values = parsed(text, path, "NCF301")
    if "topology" not in values and SETUP & values.keys():
        raise ConfigError.of("NCF303", "this is a setup file, not a machine file", Place(path), "--setup is for setups")
    report = Report(path, text, key_lines(text), top=set(TOP))
    machine = _machine(Section(values, (), report))
    if machine is None or report.messages:
        order = sorted(report.messages, key=lambda message: message.place.line if message.place else 0)
        raise ConfigError.collected(order)
    return machine


def _machine(root: Section) -> Machine | None:
    _schema(root)
    name = root.text("name") or Path(root.report.path).stem
    order = _topology(root)
    axes = _axes(root, order)
    tool = _tool(root)
    known = order.axes if order else tuple(axes)
    physical = _physical(order, axes, tool)
    found = [read_effects(section, known, axes, physical) for section in root.tables("effect")]
    effects = tuple(effect for each in found for effect in each)
    control = root.text("control")
    increment = _pair(root, "least_increment", DEFAULT_INCREMENT)
    correction = _pair(root, "max_correction", DEFAULT_CORRECTION)
    offset = _vector(root, "workpiece_offset", ORIGIN)
    provenance = root.table("provenance")
    root.close()
    if root.report.messages or order is None:
        return None
    columns = tuple(axes[letter] for letter in order.axes)
    notes = dict(provenance.values) if provenance else {}
    machine = Machine(name, str(order), columns, tool, effects, control, increment, correction, offset, notes)
    _check_sizes(machine, found, root.report)
    return machine


def _check_sizes(machine: Machine, tables: list[tuple[Effect, ...]], report: Report) -> None:
    """Note effects that are not finite at the ends of the travel: no machine has them, no arithmetic survives them."""
    for index, effects in enumerate(tables):
        with np.errstate(all="ignore"):
            finite = [np.isfinite(at_the_ends(machine, effect)).all() for effect in effects]
        if not all(finite):
            hint = "see center, scale and degree: a power of u = (x - center) / scale grows beyond all numbers"
            report.note("NCF305", ("effect", index), "the effect is not finite at the ends of the travel", hint)


def _physical(order: Topology | None, axes: dict[str, Axis], tool: Tool) -> Callable[[], Mapping[str, Named]]:
    """The physical effects that this machine can have, once somebody asks; none if it cannot be built yet."""

    def found() -> Mapping[str, Named]:
        if order is None or any(letter not in axes for letter in order.axes):
            return {}
        return library(Machine("", str(order), tuple(axes[letter] for letter in order.axes), tool))

    return found


def _schema(root: Section) -> None:
    version = root.integer("ncfix")
    if version is not None and version != SCHEMA:
        root.note(
            "NCF317", "ncfix", f"schema version {version}, this ncfix reads {SCHEMA}", "a newer ncfix may read it"
        )


def _topology(root: Section) -> Topology | None:
    text = root.text("topology", required=True)
    if text is None:
        return None
    order, wrong = topology.parse(text)
    for fault in wrong:
        root.note("NCF306", "topology", f"{text!r}: {fault}", 'it reads like "w C B F X Y Z t"')
    return order


def _axes(root: Section, order: Topology | None) -> dict[str, Axis]:
    """The axes by letter; those that the topology and the tables do not both name are noted."""
    tables = root.table("axis", required=True)
    if tables is None:
        return {}
    axes = {}
    for letter in tables.values:
        section = tables.table(letter)
        if section is not None:
            axes[letter] = _axis(section, letter, order is not None and letter in order.workpiece)
    if order is not None:
        _same_axes(root, tables, order)
    return axes


def _same_axes(root: Section, tables: Section, order: Topology) -> None:
    for letter in order.axes:
        if letter not in tables.values:
            root.note("NCF307", "topology", f"axis {letter} has no table [axis.{letter}]")
    for letter in tables.values:
        if letter not in order.axes:
            hint = "S is the spindle, not an axis" if letter == "S" else did_you_mean(letter, order.axes)
            tables.note("NCF307", letter, f"axis {letter} is not in the topology {str(order)!r}", hint)


def _axis(section: Section, letter: str, workpiece_side: bool) -> Axis:
    rotary = _rotary(section)
    direction = _unit(section, required=True, default=(1.0, 0.0, 0.0))
    point = _vector(section, "point", ORIGIN)
    limits = _range(section, rotary)
    triad = _triad(section)
    moving = _moving(section)
    pitch = _positive(section, "pitch")
    section.close()
    return Axis(letter, rotary, workpiece_side, direction, point, limits, triad, moving, pitch)


def _rotary(section: Section) -> bool:
    kind = section.text("type", required=True)
    if kind not in (None, "linear", "rotary"):
        section.note(
            "NCF304", "type", f"{kind!r} is neither linear nor rotary", did_you_mean(kind, ["linear", "rotary"])
        )
    return kind == "rotary"


def _moving(section: Section) -> bool:
    frame = section.text("error_frame")
    if frame not in (None, "fixed", "moving"):
        section.note("NCF304", "error_frame", f"{frame!r} is neither fixed nor moving", "fixed is the default")
    return frame == "moving"


def _range(section: Section, rotary: bool) -> tuple[float, float]:
    limits = section.numbers("range", count=2)
    if limits is None:
        return -np.inf, np.inf
    low, high = limits
    if low >= high:
        section.note("NCF308", "range", f"empty range: {low:g} is not below {high:g}", "omit it for an endless axis")
    return (low * DEGREE, high * DEGREE) if rotary else (low, high)


def _tool(root: Section) -> Tool:
    section = root.table("tool")
    if section is None:
        return Tool()
    tool = Tool(_unit(section, required=False, default=(0.0, 0.0, 1.0)), _vector(section, "point", ORIGIN))
    section.close()
    return tool


def _vector(section: Section, key: str, default: Vector) -> Vector:
    values = section.numbers(key, count=3)
    return default if values is None else (values[0], values[1], values[2])


def _unit(section: Section, required: bool, default: Vector) -> Vector:
    """The key `direction`, made a unit vector."""
    values = section.numbers("direction", required, count=3)
    if values is None:
        return default
    length = math.hypot(*values)
    if length < EXACT:
        section.note("NCF313", "direction", "a direction cannot be zero")
        return default
    x, y, z = values if abs(length - 1) < EXACT else (value / length for value in values)
    return x, y, z


def _triad(section: Section) -> Triad:
    rows = section.rows("error_axes", (3, 3))
    if rows is None:
        return BASE_AXES
    matrix = np.array(rows)
    if np.abs(matrix @ matrix.T - np.eye(3)).max() > TILTED or np.linalg.det(matrix) < 0:
        text = "the rows are not a right-handed triad of perpendicular unit vectors"
        section.note("NCF313", "error_axes", text, "the third row is the first cross the second")
        return BASE_AXES
    if np.abs(matrix @ matrix.T - np.eye(3)).max() > EXACT:
        left, _, right = np.linalg.svd(matrix)
        rows = tuple(tuple(float(value) for value in row) for row in left @ right)
    x, y, z = ((row[0], row[1], row[2]) for row in rows)
    return x, y, z


def _positive(section: Section, key: str) -> float | None:
    value = section.number(key)
    if value is not None and value <= 0:
        section.note("NCF305", key, f"{value:g} is not positive")
    return value


def _pair(root: Section, key: str, default: tuple[float, float]) -> tuple[float, float]:
    """A table { linear, rotary } in mm and degree."""
    section = root.table(key)
    if section is None:
        return default
    linear, rotary = _positive(section, "linear"), _positive(section, "rotary")
    section.close()
    return default[0] if linear is None else linear, default[1] if rotary is None else rotary * DEGREE
