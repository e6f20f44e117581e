"""How finely a path must be looked at: where, and over which distances, the errors of a machine may bend."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ncfix.machine.axis import Axis
from ncfix.machine.effect import SPINDLE, Effect
from ncfix.machine.error_model import signals_of
from ncfix.machine.se3 import Array
from ncfix.machine.signals import Signal

UNKNOWN_RANGE = 1000.0
"""The range of a linear axis that does not say its own, mm."""


def feature_lengths(axes: tuple[Axis, ...], effects: tuple[Effect, ...]) -> Array:
    """See `Machine.feature_lengths`."""
    lengths = np.full(len(axes), np.inf)
    for effect, index, signal, is_factor in _dependencies(axes, effects):
        span = _span(axes[index], signal) / abs(signal.scale)
        feature = span / 4 if is_factor else effect.basis.feature(span)
        length = feature * abs(signal.scale) * signal.unit
        lengths[index] = min(lengths[index], length)
    return lengths


def breakpoints(axes: tuple[Axis, ...], effects: tuple[Effect, ...], index: int) -> Array:
    """See `Machine.breakpoints`."""
    places: set[float] = set()
    ends = {limit / axes[index].unit for limit in axes[index].range}
    for effect, axis, signal, is_factor in _dependencies(axes, effects):
        if axis == index:
            held = {signal.low, signal.high} - ends
            kinks = () if is_factor else effect.basis.kinks
            places.update(x * signal.unit for x in held if np.isfinite(x))
            places.update((signal.center + signal.scale * u) * signal.unit for u in kinks)
    return np.array(sorted(places), dtype=np.float64)


def kinks(
    axes: tuple[Axis, ...], effects: tuple[Effect, ...], points: tuple[Array, ...]
) -> tuple[tuple[int, Array], ...]:
    """The axes (columns) with kinks or jumps of their errors, and where these are, ascending, mm and rad.

    That is at the breakpoints (`points`, of each axis), and at the ends of what a basis is given for, where its end
    values begin to hold.
    """
    places = {axis.name: set(own.tolist()) for axis, own in zip(axes, points, strict=True)}
    units = {axis.name: axis.unit for axis in axes}
    for effect in effects:
        if effect.active and effect.signal in places:
            ends = [end for end in effect.basis.domain if np.isfinite(end)]
            places[effect.signal].update((effect.center + effect.scale * end) * units[effect.signal] for end in ends)
    return tuple((j, np.array(sorted(places[axis.name]))) for j, axis in enumerate(axes) if places[axis.name])


def needs_tool_length(axes: tuple[Axis, ...], effect: Effect) -> bool:
    """Whether an effect moves the tip by an amount that depends on the tool's length.

    Angles do. Not those of where a straight axis points: its body is shifted, not turned.
    """
    if "tool_length" in (effect.input, effect.times):
        return True
    if effect.joint == SPINDLE:
        return effect.rotational
    axis = next(each for each in axes if each.name == effect.joint)
    return effect.rotational and (axis.rotary or effect.carried or not effect.location)


def _dependencies(axes: tuple[Axis, ...], effects: tuple[Effect, ...]) -> Iterator[tuple[Effect, int, Signal, bool]]:
    """Each effect that is not zero, with each axis whose position it depends on; the last says if it is a factor."""
    for effect in effects:
        if effect.active:
            for signal, is_factor in zip(signals_of(axes, effect), (False, True), strict=True):
                if signal is not None and signal.axis is not None:
                    yield effect, signal.axis, signal, is_factor


def _span(axis: Axis, signal: Signal) -> float:
    """The range in the unit of the machine file."""
    if np.isfinite(signal.low) and np.isfinite(signal.high):
        return signal.high - signal.low
    return 360.0 if axis.rotary else UNKNOWN_RANGE
