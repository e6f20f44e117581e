"""Machine files: `Machine` to TOML that reads back as the same machine."""

from __future__ import annotations

import datetime
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import Any

from ncfix.machine.axis import BASE_AXES, ORIGIN, Axis, Tool
from ncfix.machine.effect import Effect
from ncfix.machine.machine import DEFAULT_CORRECTION, DEFAULT_INCREMENT, Machine

DEGREE = math.pi / 180
WIDTH = 120


def dumps(machine: Machine) -> str:
    """The machine as the text of a machine file; `loads(dumps(machine)) == machine`."""
    blocks = ["\n".join(_head(machine))]
    blocks += ["\n".join([f"[axis.{axis.name}]", *_pairs(_axis(axis))]) for axis in machine.axes]
    if machine.tool != Tool():
        tool = {"direction": machine.tool.direction, "point": machine.tool.point}
        blocks.append("\n".join(["[tool]", *_pairs(tool)]))
    blocks += ["\n".join(["[[effect]]", *_pairs(effect_keys(effect))]) for effect in machine.effects]
    if machine.provenance:
        blocks.append("\n".join(["[provenance]", *_pairs(machine.provenance)]))
    return "\n\n".join(blocks) + "\n"


def _head(machine: Machine) -> Iterator[str]:
    yield "ncfix = 1"
    yield from _pairs({"name": machine.name, "topology": machine.topology, "control": machine.control})
    for key, pair, default in (
        ("least_increment", machine.least_increment, DEFAULT_INCREMENT),
        ("max_correction", machine.max_correction, DEFAULT_CORRECTION),
    ):
        if pair != default:
            yield f"{key} = {value({'linear': pair[0], 'rotary': degrees(pair[1])})}"
    if machine.workpiece_offset != ORIGIN:
        yield f"workpiece_offset = {value(machine.workpiece_offset)}"


def _axis(axis: Axis) -> dict[str, Any]:
    low, high = axis.range
    limits = None if math.isinf(low) else [degrees(low), degrees(high)] if axis.rotary else [low, high]
    return {
        "type": "rotary" if axis.rotary else "linear",
        "direction": axis.direction,
        "point": None if axis.point == ORIGIN else axis.point,
        "range": limits,
        "error_axes": None if axis.error_axes == BASE_AXES else axis.error_axes,
        "error_frame": "moving" if axis.moving_frame else None,
        "pitch": axis.pitch,
    }


def effect_keys(effect: Effect) -> dict[str, Any]:
    """The keys of an [[effect]], in the order in which people read them; None for those left out."""
    basis = effect.basis
    parameters = {each.name: getattr(basis, each.name) for each in fields(basis)}  # type: ignore[arg-type]
    return {
        "name": effect.name,
        "basis": None if basis.name == "constant" else basis.name,
        "input": effect.input,
        "time_constant_s": effect.time_constant_s,
        **parameters,
        "center": effect.center or None,
        "scale": None if effect.scale == 1 else effect.scale,
        "range": effect.range,
        "times": effect.times,
        "times_center": effect.times_center,
        "times_scale": effect.times_scale,
        "coefficients": effect.coefficients,
        "covariance": effect.covariance,
        "reference": effect.reference,
        "carried": effect.carried or None,
    }


def _pairs(table: Mapping[str, Any]) -> Iterator[str]:
    for key, item in table.items():
        if item is not None:
            yield f"{_key(key)} = {value(item, len(key) + 3)}"


def _key(key: str) -> str:
    plain = key and all(letter.isascii() and (letter.isalnum() or letter in "_-") for letter in key)
    return key if plain else json.dumps(key)


def value(item: Any, indent: int = 0) -> str:
    """A value in TOML; long lists go over several lines."""
    if isinstance(item, bool):
        return "true" if item else "false"
    if isinstance(item, int | float):
        return _number(item)
    if isinstance(item, str):
        return json.dumps(item, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(item, datetime.date | datetime.time):
        return item.isoformat()
    if isinstance(item, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {value(each)}" for key, each in item.items()) + " }" if item else "{}"
    parts = [value(each) for each in item]
    line = "[" + ", ".join(parts) + "]"
    if indent + len(line) <= WIDTH:
        return line
    return "[\n" + "".join(f"    {part},\n" for part in parts) + "]"


def _number(number: float) -> str:
    if isinstance(number, int):
        return str(number)
    if not math.isfinite(number):
        return "nan" if math.isnan(number) else "inf" if number > 0 else "-inf"
    return repr(float(number))


def degrees(angle: float) -> float:
    """An angle in degrees that reads back as exactly this many rad, as short as it can be."""
    near = math.degrees(angle)
    candidates = [round(near, 9), near, math.nextafter(near, math.inf), math.nextafter(near, -math.inf)]
    return next((each for each in candidates if each * DEGREE == angle), near)
