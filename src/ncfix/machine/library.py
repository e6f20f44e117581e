"""Physical effects by name: what warms, bends, twists and plays, as effects of a machine file.

`spindle-growth`, `backlash-X`, ... stand for one or more components with the basis and the input that the physics asks
for, zero until they are estimated. `calibrate --effects` and the selection of effects take these names beside those of
ISO 230-1. Dead weight acts on an axis by the positions of axes that it carries, not of those that carry it (Soons 1993,
section 2.5, rule 1).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import nan
from typing import Protocol

import numpy as np

from ncfix.machine.axis import Axis
from ncfix.machine.effect import SPINDLE, Effect
from ncfix.machine.machine import Machine
from ncfix.machine.smooth import Backlash, Periodic, Polynomial
from ncfix.plugin_faults import called, handed
from ncfix.plugins import registry

WARM = 20.0
"""Degree C at which thermal effects are zero."""
HOUR = 3600.0
LEVER = 100.0
"""mm: an angle is much if it moves what is this far away by what is much."""
STATES_S = (900.0, 7200.0)
"""Time constants of thermal states, s: where their estimation begins."""
LINEAR = Polynomial(degree=(1,))


class PluginEffect(Protocol):
    """What a plugin registers with `register_effects`: a name, a title, and the effects of a machine, with zeros."""

    name: str
    title: str

    def effects(self, machine: Machine) -> Sequence[Effect]:
        """The effects that it is made of on this machine; none if the machine cannot have it."""


@dataclass(frozen=True, slots=True)
class Named:
    """A physical effect of one machine.

    largest      (mm or rad, over the travel) what would be much; NaN if nobody says
    instruments  kinds of measurement that see it
    needs        state columns without which it cannot be seen
    """

    name: str
    title: str
    effects: tuple[Effect, ...]
    largest: float
    instruments: tuple[str, ...]
    needs: tuple[str, ...] = ()


SEEN = ("tcp", "tcp6", "probe", "length")


def library(machine: Machine) -> dict[str, Named]:
    """Every physical effect that this machine can have, by name; those of plugins too."""
    found = [each for axis in machine.axes for each in _of_axis(axis)]
    found += [each for pair in _carried(machine) for each in _dead_weight(*pair)]
    found += _of_spindle(machine)
    return {each.name: each for each in (*found, *_of_plugins(machine, {each.name for each in found}))}


def _of_plugins(machine: Machine, taken: set[str]) -> Iterator[Named]:
    for name, plugin in registry("effects").items():
        effects = _brought(name, plugin, machine) if hasattr(plugin, "effects") else ()
        if effects and name not in taken:
            yield Named(name, plugin.title, effects, nan, (), tuple(getattr(plugin, "needs", ())))


def _brought(name: str, plugin: PluginEffect, machine: Machine) -> tuple[Effect, ...]:
    found = called("effects", name, plugin.effects, machine, gives=Iterable)
    return tuple(handed("effects", name, each, Effect) for each in found)


def _of_axis(axis: Axis) -> Iterator[Named]:
    component = _along(axis)
    if component is None:
        return
    name, q = f"E{component}{axis.name}", axis.name
    center, scale = _span(axis)
    sides, lever = (f"dir_{q}",), 1 / LEVER if axis.rotary else 1.0
    play = Effect(name, (0.0,), Backlash())
    yield Named(f"backlash-{q}", f"play of {q} when it reverses", (play,), 0.01 * lever, (*SEEN, "axis"), sides)
    worn = Effect(name, (0.0,) * 3, Backlash(degree=(0, 1, 2)), center=center, scale=scale)
    yield Named(f"worn-{q}", f"play of {q} that differs along it", (worn,), 0.01 * lever, (*SEEN, "axis"), sides)
    wound = Effect(name, (0.0,), Backlash(degree=(1,)), center=center, scale=scale)
    yield Named(
        f"wind-up-{q}", f"play of {q} that grows along its screw", (wound,), 0.005 * lever, (*SEEN, "axis"), sides
    )
    if axis.pitch is not None:
        screw = Effect(name, (0.0,) * 4, Periodic(order=(1, 2), period=axis.pitch))
        yield Named(f"screw-{q}", f"screw of {q}, once and twice a turn", (screw,), 0.003 * lever, (*SEEN, "axis"))
    if not axis.rotary:
        sensor = f"temp_{q.lower()}"
        warm = Effect(name, (0.0,), LINEAR, center, scale, times=sensor, times_center=WARM, times_scale=1.0)
        yield Named(f"expansion-{q}", f"scale of {q} that grows with {sensor}", (warm,), 0.02, SEEN, (sensor,))
    if axis.workpiece_side and not axis.rotary:
        for load, what in ("load_kg", "the workpiece"), ("load_kgm", "the workpiece's moment, mass times height"):
            tilts = tuple(_loaded(f"E{turn}{q}", center, scale, load) for turn in "ABC")
            kind = "load" if load == "load_kg" else "moment"
            yield Named(f"{kind}-{q}", f"guide of {q} that tilts under {what}", tilts, 1e-4, SEEN, (load,))


def _loaded(name: str, center: float, scale: float, load: str) -> Effect:
    """Linear in the load and along the axis (Soons, section 2.6)."""
    basis = Polynomial(degree=(0, 1))
    return Effect(name, (0.0, 0.0), basis, center, scale, times=load, times_center=0.0, times_scale=1.0)


def _dead_weight(own: Axis, carried: Axis) -> Iterator[Named]:
    """f(own) times the position of what it carries: the part that is not of either axis alone."""
    center, scale = _span(own)
    middle, half = _span(carried)
    for turn in "ABC":
        bent = Effect(
            f"E{turn}{own.name}",
            (0.0, 0.0),
            Polynomial(degree=(1, 2)),
            center,
            scale,
            times=carried.name,
            times_center=middle,
            times_scale=half,
        )
        name = f"weight-E{turn}{own.name}-{carried.name}"
        title = f"tilt of {own.name} about {'XYZ'['ABC'.index(turn)]} by the weight of {carried.name}"
        yield Named(name, title, (bent,), 5e-5, SEEN)


def _of_spindle(machine: Machine) -> Iterator[Named]:
    along = "XYZ"[int(np.abs(np.asarray(machine.tool.direction)).argmax())]
    warm, late = "temp_spindle", 1800.0
    grown = Effect(f"E{along}{SPINDLE}", (0.0,), LINEAR, center=WARM, input=warm)
    yield Named("spindle-growth", f"spindle that grows with {warm}", (grown,), 0.05, SEEN[:3], (warm,))
    lagged = Effect(f"E{along}{SPINDLE}", (0.0,), LINEAR, center=WARM, input=warm, time_constant_s=late)
    title = f"spindle that grows after {warm}, time constant {late:g} s"
    yield Named("spindle-growth-late", title, (lagged,), 0.05, SEEN[:3], (warm, "time_s"))
    for axis in "XYZ":
        moved = Effect(f"E{axis}{SPINDLE}", (0.0,), LINEAR, scale=HOUR, input="time_s")
        yield Named(
            f"drift-{axis}", f"structure that drifts in {axis}, per hour", (moved,), 0.03, SEEN[:3], ("time_s",)
        )
        states = tuple(
            Effect(f"E{axis}{SPINDLE}", (0.0,), LINEAR, center=WARM, input="temp_structure", time_constant_s=constant)
            for constant in STATES_S
        )
        hours = " and ".join(map(_hours, STATES_S))
        title = f"structure that moves in {axis} after temp_structure, two thermal states, {hours}"
        yield Named(f"warming-{axis}", title, states, 0.03, SEEN[:3], ("temp_structure", "time_s"))


def _hours(seconds: float) -> str:
    return f"{seconds / HOUR:g} h"


def _carried(machine: Machine) -> Iterator[tuple[Axis, Axis]]:
    """Pairs of linear axes of one branch: one, and one that it carries."""
    for held in (True, False):
        outward = [axis for axis in machine.axes if axis.workpiece_side == held and not axis.rotary]
        if held:
            outward.reverse()
        for index, own in enumerate(outward):
            yield from ((own, other) for other in outward[index + 1 :])


def runs_ahead(axis: Axis, effect: Effect) -> bool:
    """Whether a body is ahead of its axis on both ways. Lost motion leaves it behind, on either side of the chain."""
    component = _along(axis)
    if component is None or effect.name != f"E{component}{axis.name}" or not isinstance(effect.basis, Backlash):
        return False
    play = sum(size for size, power in zip(effect.coefficients, effect.basis.degree, strict=True) if power == 0)
    sense = np.asarray(axis.error_axes)["XYZABC".index(component) % 3] @ np.asarray(axis.direction)
    return bool(play * sense > 0)


def _along(axis: Axis) -> str | None:
    """The component along or about the axis itself; None if it is none of its error axes."""
    shares = np.abs(np.asarray(axis.error_axes) @ np.asarray(axis.direction))
    index = int(shares.argmax())
    return ("ABC" if axis.rotary else "XYZ")[index] if shares[index] > 1 - 1e-9 else None


def _span(axis: Axis) -> tuple[float, float]:
    """Centre and half of the travel, in the file's unit."""
    low, high = (limit / axis.unit for limit in axis.range)
    bounded = bool(np.isfinite([low, high]).all())
    return ((low + high) / 2, (high - low) / 2) if bounded else (0.0, 180.0 if axis.rotary else 100.0)
