"""Coefficients in the units that people use: a gain in um/m, growth in um/K, play in um.

A coefficient belongs to a power of u = (x - center) / scale. Where u is a share of an axis' travel it is said as it
stands, um at u = 1: the end of the travel. Where u counts mm, degrees, kelvins, hours or kilograms the unit says so.
"""

from __future__ import annotations

import numpy as np

from ncfix.machine import Effect, Machine
from ncfix.machine.smooth import Backlash, Polynomial

UM, URAD = 1e3, 1e6
METRE = 1000.0
COUNTED = {"time_s": ("h", 3600.0), "load_kg": ("kg", 1.0), "load_kgm": ("kg m", 1.0), "tool_length": ("m", METRE)}
"""Signals that are no positions: unit, and how much of the signal it is."""
KELVIN = ("K", 1.0)

Unit = tuple[float, str]
"""What mm or rad is multiplied with, and the name of what comes out."""


def units(machine: Machine, effect: Effect) -> tuple[Unit, ...]:
    """The unit of each coefficient of an effect."""
    size, name = (URAD, "urad") if effect.rotational else (UM, "um")
    factor, times = _per(machine, effect.times, effect.times_scale or effect.scale)
    found = []
    for power in _powers(effect):
        each, signal = _per(machine, effect.signal, effect.scale) if power else (1.0, "")
        below = [_power(signal, power), times]
        found.append((size * each**power * factor, _ratio(name, [part for part in below if part])))
    return tuple(found)


def _powers(effect: Effect) -> tuple[int, ...]:
    """To which power of u each coefficient belongs; 0 where it is of the size of the function itself."""
    if isinstance(effect.basis, Polynomial | Backlash):
        return effect.basis.degree
    return (0,) * effect.basis.size


def _per(machine: Machine, signal: str | None, scale: float) -> Unit:
    """From "per u" to "per unit of the signal"; no unit where u is a share of a travel, or of who knows what."""
    if signal is None:
        return 1.0, ""
    unit, size = _unit_of(machine, signal, scale)
    return (size / scale, unit) if unit else (1.0, "")


def _unit_of(machine: Machine, signal: str, scale: float) -> tuple[str, float]:
    if signal in machine.axis_names:
        rotary = bool(machine.rotary[machine.axis_names.index(signal)])
        return (("deg", 1.0) if rotary else ("m", METRE)) if np.isclose(scale, 1.0) else ("", 1.0)
    return KELVIN if signal.startswith("temp_") else COUNTED.get(signal, ("", 1.0))


def _power(unit: str, power: int) -> str:
    return f"{unit}^{power}" if unit and power > 1 else unit


def _ratio(name: str, below: list[str]) -> str:
    """um, um/m, um/(m K)."""
    if not below:
        return name
    joined = " ".join(below)
    return f"{name}/({joined})" if " " in joined else f"{name}/{joined}"
