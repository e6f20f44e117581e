"""All effects of a machine, compiled: from poses to the small motions that they make at each joint.

Effects that see the same signal through bases of one family are evaluated together: one table of functions, one
matrix product. What comes out is a *slot*: the six components of a small motion of one joint, of one sort, about one
reference point.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np

from ncfix.machine.axis import BASE_AXES, Axis, Tool, Vector
from ncfix.machine.basis import Basis
from ncfix.machine.effect import SPINDLE, Effect
from ncfix.machine.se3 import Array
from ncfix.machine.signals import Signal, axis_signal, inputs_of
from ncfix.machine.state import Poses


class Sort(Enum):
    """What a small motion does to its joint."""

    MOTION = "moves the body"
    LOCATION = "moves the axis line"
    CARRIED = "moves the axis line and what it carries"


@dataclass(frozen=True, slots=True)
class Slot:
    """Where contributions are summed. `joint` is an index (n_axes: the spindle); `reference`: base frame, at zero."""

    joint: int
    sort: Sort
    reference: Vector


@dataclass(frozen=True, slots=True)
class Group:
    """Effects evaluated together: `gains[s, 6, k] @ basis(u)` is added to slot `slots[s]`, times the factor's u.

    A gain takes a coefficient's function to the small motion [x y z a b c] along and about the base axes (the axis's
    own zero position frame, if its error frame moves with it).
    """

    basis: Basis
    signal: Signal | None
    factor: Signal | None
    direction_axis: int
    slots: tuple[Slot, ...]
    gains: Array

    def add_to(self, slots: dict[Slot, Array], poses: Poses) -> None:
        """Evaluate at n poses and add to the six components (6, n), mm and rad, of each slot."""
        values = self.basis.combine(self.gains.reshape(-1, self.gains.shape[-1]), *self.arguments(poses))
        if self.factor is not None:
            values = values * self.factor.u(poses, (-np.inf, np.inf))
        for slot, value in zip(self.slots, values.reshape(len(self.slots), 6, -1), strict=True):
            slots[slot] = slots[slot] + value if slot in slots else value

    def arguments(self, poses: Poses) -> tuple[Array, Array]:
        """u and the direction of motion (-1, 0, 1), as the basis sees them: (n,), or (1,) where neither varies."""
        if self.signal is None:
            return np.zeros(1), np.zeros(1)
        u = self.signal.u(poses, self.basis.domain)
        way = poses.direction[self.direction_axis] if self.basis.needs_direction else 0.0
        return u, np.broadcast_to(way, u.shape)


@dataclass(frozen=True)
class ErrorModel:
    """The compiled effects of a machine."""

    groups: tuple[Group, ...]

    @cached_property
    def signals(self) -> frozenset[Signal]:
        """Every signal that matters."""
        found = [signal for group in self.groups for signal in (group.signal, group.factor)]
        return frozenset(signal for signal in found if signal is not None)

    @property
    def inputs(self) -> frozenset[str]:
        """The state inputs that must be given."""
        return inputs_of(self.signals)

    def small_motions(self, poses: Poses) -> Mapping[Slot, Array]:
        """The small motions at each slot, (6, n) or (6, 1): mm along, rad about."""
        slots: dict[Slot, Array] = {}
        for group in self.groups:
            group.add_to(slots, poses)
        return slots

    def rotates(self, slot: Slot) -> bool:
        """Whether any effect at this slot is an angle."""
        return any(group.gains[group.slots.index(slot), 3:].any() for group in self.groups if slot in group.slots)


def compile_effects(axes: tuple[Axis, ...], tool: Tool, effects: Iterable[Effect]) -> ErrorModel:
    """Sort the effects that are not zero into groups."""
    together: dict[tuple[object, ...], list[Effect]] = {}
    for effect in effects:
        if effect.active:
            key = (*signals_of(axes, effect), direction_axis(axes, effect), effect.basis.family)
            together.setdefault(key, []).append(effect)
    return ErrorModel(tuple(_group(axes, tool, members) for members in together.values()))


def _group(axes: tuple[Axis, ...], tool: Tool, members: list[Effect]) -> Group:
    basis = members[0].basis
    for effect in members[1:]:
        basis = basis.merged(effect.basis)
    slots = tuple(dict.fromkeys(slot_of(axes, tool, effect) for effect in members))
    gains = np.zeros((len(slots), 6, basis.size))
    places = {label: index for index, label in enumerate(basis.labels)}
    for effect in members:
        columns = [places[label] for label in effect.basis.labels]
        unit = unit_motion(axes, effect)
        gains[slots.index(slot_of(axes, tool, effect))][:, columns] += np.outer(unit, effect.coefficients)
    signal, factor = signals_of(axes, members[0])
    return Group(basis, signal, factor, direction_axis(axes, members[0]), slots, gains)


def joint_index(axes: tuple[Axis, ...], effect: Effect) -> int:
    """The index of the effect's joint: that of its axis, or the number of axes for the spindle."""
    names = [axis.name for axis in axes]
    return len(axes) if effect.joint == SPINDLE else names.index(effect.joint)


def slot_of(axes: tuple[Axis, ...], tool: Tool, effect: Effect) -> Slot:
    """Where the effect's small motion belongs. The spindle has no motion of its own: its body is what is carried."""
    joint = joint_index(axes, effect)
    default = tool.point if joint == len(axes) else axes[joint].reference
    sort = Sort.MOTION
    if effect.location:
        sort = Sort.CARRIED if effect.carried or joint == len(axes) else Sort.LOCATION
    return Slot(joint, sort, effect.reference if effect.reference is not None else default)


def unit_motion(axes: tuple[Axis, ...], effect: Effect) -> Array:
    """The small motion [x y z a b c] of an effect of 1 mm or 1 rad along the base axes, shape (6,)."""
    joint = joint_index(axes, effect)
    triad = BASE_AXES if joint == len(axes) else axes[joint].error_axes
    unit = np.zeros(6)
    start = 3 if effect.rotational else 0
    unit[start : start + 3] = triad[effect.component % 3]
    return unit


def signals_of(axes: tuple[Axis, ...], effect: Effect) -> tuple[Signal | None, Signal | None]:
    """The signal that the effect's basis sees, and the one that multiplies it."""
    signal = factor = None
    if effect.signal is not None:
        lag = effect.time_constant_s or 0.0
        plain = _plain(axes, effect.signal)
        low, high = effect.range or (plain.low, plain.high)
        low, high = max(low, plain.low), min(high, plain.high)
        signal = replace(plain, low=low, high=high, center=effect.center, scale=effect.scale, constant_s=lag)
    if effect.times is not None:
        center = effect.center if effect.times_center is None else effect.times_center
        scale = effect.scale if effect.times_scale is None else effect.times_scale
        factor = replace(_plain(axes, effect.times), center=center, scale=scale)
    return signal, factor


def _plain(axes: tuple[Axis, ...], name: str) -> Signal:
    names = [axis.name for axis in axes]
    return axis_signal(axes, names.index(name)) if name in names else Signal(name)


def direction_axis(axes: tuple[Axis, ...], effect: Effect) -> int:
    """The axis whose direction of motion counts: that of the input if it is an axis, else the effect's own."""
    names = [axis.name for axis in axes]
    if not effect.basis.needs_direction:
        return -1
    return names.index(effect.input) if effect.input in names else names.index(effect.joint)
