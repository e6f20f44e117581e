"""Machine files: TOML to `Machine`, with all faults of the file reported at once.

docs/formats.md describes the file. Degrees in the file are rad in `Machine`. An [[effect]] has the name of an ISO 230-1
component, or of a physical effect (`backlash-X`, `spindle-growth`, one of a plugin), which stands for components, bases
and inputs: then the file gives the coefficients of all of its components in turn.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import Field, fields, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from ncfix.diagnostics import ConfigError, Place
from ncfix.files import reading_hint
from ncfix.inputs import MAX_CONFIG_BYTES, content_of
from ncfix.machine.axes import (
    BASE_AXES,
    DEGREE,
    NAME,
    ORIGIN,
    SPINDLE,
    Axis,
    Effect,
    GaugeLine,
    Matrix,
    Topology,
    Triad,
    Vector,
    component_names,
    parse_topology,
)
from ncfix.machine.basis import Basis, check_shapes
from ncfix.machine.effects import PhysicalEffect, at_the_ends, kinds, library
from ncfix.machine.machine import DEFAULT_CORRECTION, DEFAULT_INCREMENT, Machine
from ncfix.machine.state import SUM
from ncfix.plugins import working
from ncfix.toml_text import Report, TomlTable, decoded, did_you_mean, key_lines, parsed

SCHEMA = 1
TOP = ("ncfix", "name", "topology", "control", "least_increment", "max_correction", "workpiece_offset")
"""Keys above the tables."""
SETUP = {"work_offsets", "tools", "initial", "references", "variables"}
"""Tables that only a setup file has."""
EXACT = 1e-14
"""Deviation from unit length below which a vector is kept as written."""
TILTED = 1e-6
"""Deviation of error axes from an orthonormal triad above which they are refused."""
INPUT = re.compile(r"[a-z][a-z0-9_]*")
SMALLEST_SCALE = 1e-9
"""Smallest scale, in the unit of the scaled signal: mm, degree, K, s."""


def load(path: str | Path) -> Machine:
    """The machine of a machine file. Raises `ConfigError` with all faults found (NCF300 to NCF319)."""
    try:
        source = content_of(os.fspath(path), MAX_CONFIG_BYTES)
    except OSError as error:
        text = f"cannot read the machine file: {error.strerror}"
        raise ConfigError.of("NCF300", text, Place(str(path)), reading_hint(os.fspath(path), error)) from error
    return loads(source, str(path))


def loads(source: str | bytes, path: str = "<machine>") -> Machine:
    """The machine of the text of a machine file. Raises `ConfigError` with all faults found; `path` is for messages."""
    text = source if isinstance(source, str) else decoded(source, path, "NCF301")
    values = parsed(text, path, "NCF301", "docs/formats.md shows a machine file")
    if "topology" not in values and SETUP & values.keys():
        raise ConfigError.of(
            "NCF303", "this is a setup file, not a machine file", Place(path), "give a setup file with --setup"
        )
    report = Report(path, text, key_lines(text), top=set(TOP))
    machine = _machine(TomlTable(values, (), report))
    if machine is None or report.messages:
        order = sorted(report.messages, key=lambda message: message.place.line if message.place else 0)
        raise ConfigError.collected(order)
    return machine


def _machine(root: TomlTable) -> Machine | None:
    if root.integer("ncfix") not in (None, SCHEMA):
        text = f"version {root.values['ncfix']} of the machine file; this ncfix reads version {SCHEMA}"
        root.note("NCF317", "ncfix", text, "a newer ncfix may read it")
    name = root.text("name") or Path(root.report.path).stem
    order = None
    if (chain := root.text("topology", required=True)) is not None:
        order, wrong = parse_topology(chain)
        for fault in wrong:
            root.note("NCF306", "topology", f"{chain!r}: {fault}", 'write it like "w C B F X Y Z t"')
    axes, tool = _axes(root, order), GaugeLine()
    if (section := root.table("tool")) is not None:
        direction = _unit(section, required=False, default=(0.0, 0.0, 1.0))
        tool = GaugeLine(direction, _vector(section, "point", ORIGIN))
        section.close()

    def physical() -> Mapping[str, PhysicalEffect]:
        """The physical effects that this machine can have; none if its axes are incomplete."""
        if order is None or any(letter not in axes for letter in order.axes):
            return {}
        return library(Machine("", str(order), tuple(axes[letter] for letter in order.axes), tool))

    known = order.axes if order else tuple(axes)
    found = [_effects(section, known, axes, physical) for section in root.tables("effect")]
    control = root.text("control")
    increment = _pair(root, "least_increment", DEFAULT_INCREMENT)
    correction = _pair(root, "max_correction", DEFAULT_CORRECTION)
    offset = _vector(root, "workpiece_offset", ORIGIN)
    provenance = root.table("provenance")
    root.close()
    if root.report.messages or order is None:
        return None
    columns, effects = tuple(axes[letter] for letter in order.axes), tuple(effect for each in found for effect in each)
    notes = dict(provenance.values) if provenance else {}
    machine = Machine(name, str(order), columns, tool, effects, control, increment, correction, offset, notes)
    for index, each in enumerate(found):  # an effect that is not finite would spoil all arithmetic
        with np.errstate(all="ignore"):
            finite = [np.isfinite(at_the_ends(machine, effect)).all() for effect in each]
        if not all(finite):
            hint = "check center, scale and degree: a power of u = (x - center) / scale becomes too large"
            root.report.note("NCF305", ("effect", index), "the effect is not finite at the ends of the travel", hint)
    return machine


def _axes(root: TomlTable, order: Topology | None) -> dict[str, Axis]:
    """Letter -> axis. Axes that only the topology, or only the tables, name are reported (NCF307)."""
    tables = root.table("axis", required=True)
    if tables is None:
        return {}
    axes = {}
    for letter in tables.values:
        section = tables.table(letter)
        if section is not None:
            axes[letter] = _axis(section, letter, order is not None and letter in order.workpiece)
    for letter in order.axes if order else ():
        if letter not in tables.values:
            root.note("NCF307", "topology", f"axis {letter} has no table [axis.{letter}]")
    for letter in tables.values if order else ():
        if order and letter not in order.axes:
            hint = "S is the spindle, not an axis" if letter == "S" else did_you_mean(letter, order.axes)
            tables.note("NCF307", letter, f"axis {letter} is not in the topology {str(order)!r}", hint)
    return axes


def _axis(section: TomlTable, letter: str, workpiece_side: bool) -> Axis:
    rotary = section.choice("type", "linear", "rotary", required=True) == "rotary"
    direction = _unit(section, required=True, default=(1.0, 0.0, 0.0))
    point = _vector(section, "point", ORIGIN)
    low, high = section.range("range", "leave it out for an endless axis") or (-np.inf, np.inf)
    limits = (low * DEGREE, high * DEGREE) if rotary else (low, high)
    triad = _triad(section)
    moving = section.choice("error_frame", "fixed", "moving", hint="the default is fixed") == "moving"
    pitch = section.positive("pitch")
    section.close()
    return Axis(letter, rotary, workpiece_side, direction, point, limits, triad, moving, pitch)


def _vector(section: TomlTable, key: str, default: Vector) -> Vector:
    values = section.numbers(key, count=3)
    return default if values is None else (values[0], values[1], values[2])


def _unit(section: TomlTable, required: bool, default: Vector) -> Vector:
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


def _triad(section: TomlTable) -> Triad:
    rows = section.rows("error_axes", (3, 3))
    if rows is None:
        return BASE_AXES
    matrix = np.array(rows)
    off = np.abs(matrix @ matrix.T - np.eye(3)).max()
    if off > TILTED or np.linalg.det(matrix) < 0:
        text = "the rows are not a right-handed triad of perpendicular unit vectors"
        section.note("NCF313", "error_axes", text, "the third row is the cross product of the first and the second")
        return BASE_AXES
    if off > EXACT:
        left, _, right = np.linalg.svd(matrix)
        rows = tuple(tuple(float(value) for value in row) for row in left @ right)
    x, y, z = ((row[0], row[1], row[2]) for row in rows)
    return x, y, z


def _pair(root: TomlTable, key: str, default: tuple[float, float]) -> tuple[float, float]:
    """A table { linear, rotary } in mm and degree."""
    section = root.table(key)
    if section is None:
        return default
    linear, rotary = section.positive("linear"), section.positive("rotary")
    section.close()
    return default[0] if linear is None else linear, default[1] if rotary is None else rotary * DEGREE


# -- effects -----------------------------------------------------------------------------------------------------------


def _effects(
    section: TomlTable,
    letters: tuple[str, ...],
    axes: Mapping[str, Axis],
    physical: Callable[[], Mapping[str, PhysicalEffect]],
) -> tuple[Effect, ...]:
    """The effects of an [[effect]] table: one ISO 230-1 component, or all components of a physical effect.

    Empty if the table has a fault, which is then reported.
    """
    before = len(section.report.messages)
    name = section.values.get("name")
    if isinstance(name, str) and not NAME.fullmatch(name):
        named = physical()
        if name in named:
            return _of_physical(section, named[name])
        if near := get_close_matches(name, named, 1):
            text = f"{name!r} is not an effect of this machine"
            section.note("NCF309", "name", text, f"did you mean {near[0]!r}? `ncfix effects -m FILE` lists them")
            return ()
    name = _component(section, letters)
    kind = _kind(section)
    basis = _basis(section, kind) if kind is not None else None
    coefficients = section.numbers("coefficients", required=True)
    if basis is not None and coefficients is not None and len(coefficients) != basis.size:
        text = f"{len(coefficients)} coefficients, but the basis {basis.name} needs {basis.size}"
        section.note("NCF311", "coefficients", text, f"one each for {', '.join(basis.labels[:12])}")
    options = _options(section, letters, len(coefficients or ()))
    if name is not None and basis is not None and ("input" in options or not section.has("input")):
        _check_fit(section, Effect(name, coefficients or (), basis, **options), axes)
    if kind is not None:
        section.close()
    if name is None or basis is None or coefficients is None or len(section.report.messages) > before:
        return ()
    return (Effect(name, coefficients, basis, **options),)


def _component(section: TomlTable, letters: tuple[str, ...]) -> str | None:
    """The name of an ISO 230-1 component."""
    name = section.text("name", required=True)
    if name is None:
        return None
    match = NAME.fullmatch(name)
    if match and match[3] in (*letters, SPINDLE):
        return name
    text = f"{name!r} is not an effect of this machine"
    if match:
        hint = f"axes of this machine: {' '.join(letters)}, and {SPINDLE} for the spindle"
        section.note("NCF309", "name", f"{text}: it has no axis {match[3]}", hint)
    else:
        hint = did_you_mean(name, component_names((*letters, SPINDLE))) or "`ncfix effects` lists them"
        section.note("NCF309", "name", text, hint)
    return None


def _kind(section: TomlTable) -> type[Basis] | None:
    name = section.text("basis") if section.has("basis") else "constant"
    if name is None:
        return None
    kind = kinds().get(name)
    if kind is None:
        hint = did_you_mean(name, kinds()) or "`ncfix effects --bases` lists them"
        section.note("NCF310", "basis", f"there is no basis {name!r}", hint)
    return kind


def _basis(section: TomlTable, kind: type[Basis]) -> Basis | None:
    """The basis with its parameters, which are keys of the effect."""
    parameters = {each.name: _parameter(section, each) for each in fields(kind)}  # type: ignore[arg-type]
    if any(value is None for value in parameters.values()):
        return None
    with working("bases", kind.name):
        basis = kind(**parameters)
        faults = basis.complaints()
        if not faults and not kind.__module__.startswith("ncfix."):
            check_shapes(basis)
    for key, text in faults:
        section.note("NCF316", key, text)
    return None if faults else basis


def _parameter(section: TomlTable, parameter: Field[Any]) -> Any:
    """The value of a basis parameter; its default if it is not given; None if it is invalid."""
    if not section.has(parameter.name) and not parameter.metadata["required"]:
        return parameter.default
    readers: dict[str, Callable[..., Any]] = {
        "number": section.number,
        "numbers": section.numbers,
        "integer": section.integer,
        "integers": section.integers,
        "text": section.text,
    }
    return readers[parameter.metadata["kind"]](parameter.name, required=True)


def _options(section: TomlTable, letters: tuple[str, ...], size: int) -> dict[str, Any]:
    options = {
        "reference": section.numbers("reference", count=3),
        "covariance": _covariance(section, size),
        "range": section.range("range"),
        "input": _signal(section, "input", letters),
        "times": _signal(section, "times", letters),
        "time_constant_s": section.positive("time_constant_s"),
        "carried": section.flag("carried"),
        "center": section.number("center"),
        "scale": _scale(section, "scale"),
        "times_center": section.number("times_center"),
        "times_scale": _scale(section, "times_scale"),
    }
    return {key: value for key, value in options.items() if value is not None}


def _signal(section: TomlTable, key: str, letters: tuple[str, ...]) -> str | None:
    name = section.text(key)
    if name is None or name in letters or INPUT.fullmatch(name):
        return name
    if key == "input" and SUM in name and set(name.split(SUM)) <= set(letters):
        return name
    text = f"{name!r} is neither an axis of this machine nor the name of an input"
    section.note("NCF314", key, text, "inputs have names like temp_spindle, time_s, load_kg")
    return None


def _scale(section: TomlTable, key: str) -> float | None:
    value = section.number(key)
    if value is not None and abs(value) < SMALLEST_SCALE:
        section.note("NCF305", key, "the scale cannot be zero" if value == 0 else f"{value:g} is not a possible scale")
    return value


def _covariance(section: TomlTable, size: int) -> Matrix | None:
    rows = section.rows("covariance", (size, size)) if size else section.get("covariance")
    if rows is None or not size:
        return None
    matrix = np.array(rows)
    largest = float(np.abs(matrix).max())
    if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=1e-12 * largest):
        section.note("NCF312", "covariance", "the matrix is not symmetric")
    elif np.linalg.eigvalsh(matrix)[0] < -1e-9 * largest or math.isnan(largest):
        section.note("NCF312", "covariance", "a variance is negative (the matrix has a negative eigenvalue)")
    return rows


def _check_fit(section: TomlTable, effect: Effect, axes: Mapping[str, Axis]) -> None:
    """Report combinations of basis, options and component that are impossible (NCF315)."""

    def note(key: str, text: str, hint: str = "") -> None:
        section.note("NCF315", key if key in section.values else "name", text, hint)

    name, basis, source = effect.name, effect.basis, effect.input
    own = None if effect.location or effect.joint == SPINDLE else effect.joint
    if basis.needs_signal and source is None and own is None:
        note("basis", f"{name} has no position for {basis.name} to depend on", "give `input`")
    if basis.needs_direction and source not in axes and own is None:
        note("basis", f"{name} has no direction of motion", "give an axis as `input`")
    summed = (source or "").split(SUM) if SUM in (source or "") else []
    if summed and (basis.kinks or not all(axes[each].rotary for each in summed)):
        note(
            "input",
            f"{source} is not a sum of angles on which {basis.name} can depend",
            "a sum needs rotary axes, and a basis without kinks, so not `table`",
        )
    axis = axes.get(summed[0] if summed else source or effect.joint)
    if basis.rotary_only and (axis is None or not axis.rotary) and (axis is not None or source is not None):
        note("basis", f"{basis.name} needs the angle of a rotary axis", "use `periodic` with a `period`")
    if effect.carried and not effect.location:
        note("carried", f"{name} is not a location error", "`carried` is for names like EC0Y")
    if effect.time_constant_s is not None and source is None:
        note("time_constant_s", "a time constant needs an `input`, but none is given")


def _of_physical(section: TomlTable, named: PhysicalEffect) -> tuple[Effect, ...]:
    """The components of a physical effect with the coefficients of the table; empty if it has a reported fault."""
    before = len(section.report.messages)
    section.text("name")
    values = section.numbers("coefficients", required=True)
    constant = section.number("time_constant_s")
    reference = section.numbers("reference", count=3)
    size = sum(effect.basis.size for effect in named.effects)
    if values is not None and len(values) != size:
        parts = ", ".join(f"{e.name} {label}" for e in named.effects for label in e.basis.labels)
        text = f"{len(values)} coefficients, but {named.name} has {size}"
        section.note("NCF311", "coefficients", text, f"one each for {parts}")
    lagging = {effect.time_constant_s for effect in named.effects}
    if constant is not None and lagging == {None}:
        section.note("NCF315", "time_constant_s", f"{named.name} does not follow an input, so it has no time constant")
    elif constant is not None and len(lagging) > 1:
        text = f"{named.name} has several time constants"
        section.note(
            "NCF315", "time_constant_s", text, "write its components as single effects: `ncfix effects` lists them"
        )
    elif constant is not None and constant <= 0:
        section.note("NCF305", "time_constant_s", f"{constant:g} is not positive")
    section.close()
    if values is None or len(section.report.messages) > before:
        return ()
    point = None if reference is None else (reference[0], reference[1], reference[2])
    found, at = [], 0
    for effect in named.effects:
        own = values[at : at + effect.basis.size]
        at += effect.basis.size
        lag = effect.time_constant_s if constant is None else constant
        found.append(replace(effect, coefficients=own, time_constant_s=lag, reference=point))
    return tuple(found)
