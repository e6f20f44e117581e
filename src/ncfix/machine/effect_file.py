"""One [[effect]] of a machine file."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import Field, fields
from difflib import get_close_matches
from typing import Any

import numpy as np

from ncfix.machine.axis import Axis
from ncfix.machine.basis import Basis, check_shapes, kinds
from ncfix.machine.effect import COMPONENTS, NAME, SPINDLE, Effect, Matrix
from ncfix.machine.fields import Section, did_you_mean
from ncfix.machine.library import Named
from ncfix.machine.named_effect import read_named
from ncfix.plugin_faults import working

INPUT = re.compile(r"[a-z][a-z0-9_]*")
SMALLEST_SCALE = 1e-9
"""In the unit of what is scaled: mm, degree, K, s."""


def read_effects(
    section: Section,
    letters: tuple[str, ...],
    axes: Mapping[str, Axis],
    physical: Callable[[], Mapping[str, Named]],
) -> tuple[Effect, ...]:
    """The effects that a table stands for: one of an ISO 230-1 component, those of a physical effect by its name."""
    name = section.values.get("name")
    if isinstance(name, str) and not NAME.fullmatch(name):
        named = physical()
        if name in named:
            return read_named(section, named[name])
        if near := get_close_matches(name, named, 1):
            text = f"{name!r} is not an effect of this machine"
            section.note("NCF309", "name", text, f"did you mean {near[0]!r}? `ncfix effects -m FILE` lists them")
            return ()
    found = read_effect(section, letters, axes)
    return () if found is None else (found,)


def read_effect(section: Section, letters: tuple[str, ...], axes: Mapping[str, Axis]) -> Effect | None:
    """The effect, or None if something is wrong with it (then it is noted)."""
    before = len(section.report.messages)
    name = _name(section, letters)
    kind = _kind(section)
    basis = _basis(section, kind) if kind is not None else None
    coefficients = section.numbers("coefficients", required=True)
    if basis is not None and coefficients is not None:
        _count(section, basis, coefficients)
    size = len(coefficients) if coefficients is not None else 0
    options = _options(section, letters, size)
    if name is not None and basis is not None and ("input" in options or not section.has("input")):
        _fits(section, Effect(name, coefficients or (), basis, **options), axes)
    if kind is not None:
        section.close()
    if name is None or basis is None or coefficients is None or len(section.report.messages) > before:
        return None
    return Effect(name, coefficients, basis, **options)


def _name(section: Section, letters: tuple[str, ...]) -> str | None:
    name = section.text("name", required=True)
    if name is None:
        return None
    match = NAME.fullmatch(name)
    if match and (match[3] in letters or match[3] == SPINDLE):
        return name
    joints = (*letters, SPINDLE)
    if match:
        hint = f"axes of this machine: {' '.join(letters)}, and {SPINDLE} for the spindle"
        section.note("NCF309", "name", f"{name!r} is not an effect of this machine: it has no axis {match[3]}", hint)
        return None
    names = [f"E{component}{zero}{joint}" for joint in joints for zero in ("", "0") for component in COMPONENTS]
    hint = did_you_mean(name, names) or "`ncfix effects` lists them"
    section.note("NCF309", "name", f"{name!r} is not an effect of this machine", hint)
    return None


def _kind(section: Section) -> type[Basis] | None:
    name = section.text("basis") if section.has("basis") else "constant"
    if name is None:
        return None
    kind = kinds().get(name)
    if kind is None:
        hint = did_you_mean(name, kinds()) or "`ncfix effects --bases` lists them"
        section.note("NCF310", "basis", f"there is no basis {name!r}", hint)
    return kind


def _basis(section: Section, kind: type[Basis]) -> Basis | None:
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


def _parameter(section: Section, parameter: Field[Any]) -> Any:
    """The value of a basis parameter; its default if it is not there; None if it is wrong."""
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


def _count(section: Section, basis: Basis, coefficients: tuple[float, ...]) -> None:
    if len(coefficients) != basis.size:
        text = f"{len(coefficients)} coefficients, the basis {basis.name} has {basis.size}"
        section.note("NCF311", "coefficients", text, f"one each for {', '.join(basis.labels[:12])}")


def _options(section: Section, letters: tuple[str, ...], size: int) -> dict[str, Any]:
    reference = section.numbers("reference", count=3)
    options = {
        "covariance": _covariance(section, size),
        "reference": reference,
        "range": _range(section),
        "input": _signal(section, "input", letters),
        "times": _signal(section, "times", letters),
        "time_constant_s": _positive(section, "time_constant_s"),
        "carried": section.flag("carried"),
        "center": section.number("center"),
        "scale": _scale(section, "scale"),
        "times_center": section.number("times_center"),
        "times_scale": _scale(section, "times_scale"),
    }
    return {key: value for key, value in options.items() if value is not None}


def _range(section: Section) -> tuple[float, float] | None:
    limits = section.numbers("range", count=2)
    if limits is None:
        return None
    low, high = limits
    if low >= high:
        section.note("NCF308", "range", f"empty range: {low:g} is not below {high:g}")
    return low, high


def _signal(section: Section, key: str, letters: tuple[str, ...]) -> str | None:
    name = section.text(key)
    if name is None or name in letters or INPUT.fullmatch(name):
        return name
    text = f"{name!r} is neither an axis of this machine nor the name of an input"
    section.note("NCF314", key, text, "inputs are called like temp_spindle, time_s, load_kg")
    return None


def _scale(section: Section, key: str) -> float | None:
    value = section.number(key)
    if value is not None and abs(value) < SMALLEST_SCALE:
        section.note("NCF305", key, "the scale cannot be zero" if value == 0 else f"{value:g} is no scale")
    return value


def _positive(section: Section, key: str) -> float | None:
    value = section.number(key)
    if value is not None and value <= 0:
        section.note("NCF305", key, f"{value:g} is not positive")
    return value


def _covariance(section: Section, size: int) -> Matrix | None:
    if not size:
        section.get("covariance")
        return None
    rows = section.rows("covariance", (size, size))
    if rows is None:
        return None
    matrix = np.array(rows)
    largest = float(np.abs(matrix).max())
    if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=1e-12 * largest):
        section.note("NCF312", "covariance", "the matrix is not symmetric")
    elif np.linalg.eigvalsh(matrix)[0] < -1e-9 * largest or math.isnan(largest):
        section.note("NCF312", "covariance", "a variance is negative (the matrix has a negative eigenvalue)")
    return rows


def _fits(section: Section, effect: Effect, axes: Mapping[str, Axis]) -> None:
    """Note what this basis and these options cannot do for this component."""
    name, basis, source = effect.name, effect.basis, effect.input
    own = None if effect.location or effect.joint == SPINDLE else effect.joint
    if basis.needs_signal and source is None and own is None:
        _misfit(section, "basis", f"{name} has no position for {basis.name} to depend on", "give `input`")
    if basis.needs_direction and source not in axes and own is None:
        _misfit(section, "basis", f"{name} has no direction of motion", "give an axis as `input`")
    axis = axes.get(source or effect.joint)
    if basis.rotary_only and (axis is None or not axis.rotary) and (axis is not None or source is not None):
        _misfit(section, "basis", f"{basis.name} needs the angle of a rotary axis", "use `periodic` with a `period`")
    if effect.carried and not effect.location:
        _misfit(section, "carried", f"{name} is not a location error", "`carried` is for names like EC0Y")
    if effect.time_constant_s is not None and source is None:
        _misfit(section, "time_constant_s", "a lag acts on an `input`, and there is none")


def _misfit(section: Section, key: str, text: str, hint: str = "") -> None:
    section.note("NCF315", key if key in section.values else "name", text, hint)
