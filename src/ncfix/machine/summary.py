"""How large the effects of a machine are over the travel of its axes: for people, not for correction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ncfix.machine import catalogue
from ncfix.machine.axis import Axis
from ncfix.machine.effect import Effect
from ncfix.machine.error_model import signals_of
from ncfix.machine.linear import course_of
from ncfix.machine.machine import Machine
from ncfix.machine.se3 import Array
from ncfix.machine.state import State, flatten

SAMPLES = 361
"""Positions looked at along an axis."""


def extent(machine: Machine, effect: Effect) -> tuple[float, float] | None:
    """Lowest and highest value of an effect over the travel, mm or rad.

    None where that has no answer: it depends on a signal that is no axis, or on an axis without a range.
    """
    signals = [signal for signal in signals_of(machine.axes, effect) if signal is not None]
    if any(signal.axis is None for signal in signals):
        return None
    axes = sorted({signal.axis for signal in signals if signal.axis is not None})
    q = _grid(machine, axes)
    if not np.isfinite(q).all():
        return None
    values = [_values(machine, effect, q, way) for way in ((-1, 1) if effect.basis.needs_direction else (0,))]
    return float(np.min(values)), float(np.max(values))


def at_the_ends(machine: Machine, effect: Effect) -> Array:
    """Values of an effect with all axes at their lowest and at their highest positions, mm or rad.

    None of them where it depends on a signal that is no axis.
    """
    if any(signal is not None and signal.axis is None for signal in signals_of(machine.axes, effect)):
        return np.empty(0)
    ranges = machine.ranges
    return _values(machine, effect, np.where(np.isfinite(ranges), ranges, [0.0, 2 * np.pi]).T, 1)


def with_unit(machine: Machine, name: str) -> str:
    """The name of an axis with the unit of its positions; that of a signal as it is."""
    units = {axis.name: "degree" if axis.rotary else "mm" for axis in machine.axes}
    return f"{name}, {units[name]}" if name in units else name


def _values(machine: Machine, effect: Effect, q: Array, direction: int) -> Array:
    _, poses = flatten(q, State(direction=direction), machine.axes, frozenset())
    found: Array = np.asarray(effect.coefficients) @ course_of(machine.axes, effect).rows(poses)
    return found


def _grid(machine: Machine, axes: list[int]) -> Array:
    """Positions over the travel of these axes, the others at zero, shape (n, n_axes)."""
    columns = [travel(machine, axis) for axis in axes]
    places = np.stack([each.ravel() for each in np.meshgrid(*columns)], axis=-1) if columns else np.empty((1, 0))
    q = np.zeros((len(places), len(machine.axes)))
    q[:, axes] = places
    return q


def travel(machine: Machine, axis: int) -> Array:
    """(n,) positions of an axis over its travel, with its kinks, mm or rad; NaN if it has no end."""
    low, high = (0.0, 2 * np.pi) if machine.axes[axis].endless else machine.ranges[axis]
    kinks = machine.breakpoints(machine.axis_names[axis])
    inside = kinks[(kinks >= low) & (kinks <= high)]
    return np.concatenate([np.linspace(low, high, SAMPLES), inside]) if np.isfinite(high - low) else np.array([np.nan])


def vector(values: Sequence[float]) -> str:
    """Three numbers for people."""
    return f"({', '.join(f'{value:.6g}' for value in values)})"


def facts(machine: Machine) -> dict[str, str]:
    """What a machine file says besides chain and errors."""
    sizes = {"least increment": machine.least_increment, "largest correction": machine.max_correction}
    said = {"topology": machine.topology, "control": machine.control or ""}
    said |= {name: f"{linear:g} mm, {np.degrees(rotary):g} deg" for name, (linear, rotary) in sizes.items()}
    said |= {str(name): str(value) for name, value in machine.provenance.items()}
    return {name: value for name, value in said.items() if value}


def travel_of(axis: Axis) -> str:
    """The range of an axis for people."""
    low, high = (limit / axis.unit for limit in axis.range)
    return f"{low:g} ... {high:g} {'deg' if axis.rotary else 'mm'}" if np.isfinite(high - low) else "no limits"


def title_of(machine: Machine, effect: Effect) -> str:
    """What an effect is."""
    return catalogue.title(effect.name, {axis.name: axis for axis in machine.axes}.get(effect.joint))


def depends_on(effect: Effect) -> str:
    """What an effect is a function of, for people."""
    signals = [signal for signal in (effect.signal, effect.times) if signal is not None]
    return f"{effect.basis.name} of {', '.join(signals)}" if signals else "constant"
