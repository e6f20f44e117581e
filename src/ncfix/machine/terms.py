"""What the small motions on a route are made of: functions of the pose, each times a gain.

Powers and harmonics of axis positions are worked out on the way (`steps`). All other functions come from their bases as
columns, whatever they are, and are added up with the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.machine.axis import Axis
from ncfix.machine.error_model import Group, Slot
from ncfix.machine.piecewise import Spline, Step, Table
from ncfix.machine.se3 import Array
from ncfix.machine.signals import Signal
from ncfix.machine.smooth import Constant, Fourier, Polynomial
from ncfix.machine.state import Poses
from ncfix.machine.steps import GIVEN, PARTS, POWERS, WAVES, Functions

SUMS = (Table, Spline, Step)
"""Bases that add up their functions themselves, each sum on its own."""
ANY = (1.0, -np.inf, np.inf, 0.0, 1.0)
"""A signal that is the position as it is."""
Held = tuple[int, float, float]
"""An axis whose harmonics are held at the ends of a range, and these, rad."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a small motion is done: the slots whose sum it is, and the rotation from base axes to those of the step."""

    slots: tuple[Slot, ...]
    turn: Array


@dataclass(frozen=True, slots=True)
class Terms:
    """What has to be given besides the positions.

    groups  whose bases work out functions, or sums with these gains (m, k)
    held    axes whose harmonics are held at the ends of a range, rad
    """

    groups: tuple[tuple[Group, Array | None], ...]
    held: tuple[Held, ...]

    def see(self, axes: Sequence[int]) -> bool:
        """Whether any of these functions changes with one of the axes."""
        return any(changes_with(group, axes) for group, _ in self.groups)

    def given(self, poses: Poses) -> list[Array]:
        """The functions that bases work out, (n,) or (1,) each, in order."""
        found: list[Array] = []
        for group, gains in self.groups:
            u, way = group.arguments(poses)
            values = group.basis.rows(u, way) if gains is None else group.basis.combine(gains, u, way)
            if group.factor is not None:
                values = values * group.factor.u(poses, (-np.inf, np.inf))
            found += list(values)
        return found


def changes_with(group: Group, axes: Sequence[int]) -> bool:
    """Whether the functions of a group change with one of the axes."""
    return any(signal is not None and signal.axis in axes for signal in (group.signal, group.factor))


@dataclass(frozen=True, slots=True)
class _Part:
    """A group as numbers: its functions, and the gains (parts, functions) by which they add to the small motions."""

    family: int
    axis: int
    signal: tuple[float, ...]
    orders: tuple[int, ...]
    gains: Array


def terms_of(
    axes: tuple[Axis, ...], groups: Sequence[Group], places: Sequence[Place], held: list[Held]
) -> tuple[Functions, Terms]:
    """The functions of the small motions at `places`, and what has to be given for them; `held` is added to."""
    parts: list[_Part] = []
    given: list[tuple[Group, Array | None]] = []
    for group in groups:
        gains = _gains(group, places)
        if not gains.any():
            continue
        signal, basis = group.signal, group.basis
        if isinstance(basis, Constant):
            parts.append(_Part(POWERS, 0, ANY, (0,), gains))
        elif signal is not None and isinstance(basis, Polynomial) and _is_power(group, signal):
            numbers = signal.unit, signal.low, signal.high, signal.center, signal.scale
            parts.append(_sorted(_Part(POWERS, signal.axis or 0, numbers, basis.degree, gains), 1))
        elif signal is not None and isinstance(basis, Fourier) and _is_wave(axes, group, signal):
            parts.append(_sorted(_Part(WAVES, _row(axes, signal, held), ANY, basis.order, gains), 2))
        else:
            parts.append(_given(group, gains, given))
    return _numbers(parts), Terms(tuple(given), tuple(held))


def _is_power(group: Group, signal: Signal) -> bool:
    """Powers of an axis position that does not turn back."""
    plain = signal.axis is not None and not signal.endless and not signal.constant_s
    return type(group.basis) is Polynomial and plain and group.factor is None


def _is_wave(axes: tuple[Axis, ...], group: Group, signal: Signal) -> bool:
    """Harmonics of the angle of a rotary axis."""
    plain = (signal.center, signal.scale, signal.constant_s) == (0.0, 1.0, 0.0) and group.factor is None
    return type(group.basis) is Fourier and plain and signal.axis is not None and axes[signal.axis].rotary


def _row(axes: tuple[Axis, ...], signal: Signal, held: list[Held]) -> int:
    """The row of the sine that a wave is made of: its axis's, or one held at the ends of a range."""
    assert signal.axis is not None
    if not np.isfinite([signal.low, signal.high]).any():
        return signal.axis
    hold = signal.axis, signal.low * signal.unit, signal.high * signal.unit
    if hold not in held:
        held.append(hold)
    return len(axes) + held.index(hold)


def _gains(group: Group, places: Sequence[Place]) -> Array:
    """By which the functions of a group add to the numbers of all small motions, (PARTS * places, functions)."""
    gains = np.zeros((len(places), PARTS, group.gains.shape[-1]))
    for total, place in zip(gains, places, strict=True):
        for slot in place.slots:
            if slot in group.slots:
                way, turn = np.split(group.gains[group.slots.index(slot)], 2)
                arm = np.subtract(slot.reference, place.slots[0].reference)
                total += np.concatenate(
                    [place.turn @ each for each in (way, turn, np.cross(arm, turn, axisb=0, axisc=0))]
                )
    return gains.reshape(-1, gains.shape[-1])


def _sorted(part: _Part, width: int) -> _Part:
    """The functions in ascending order, `width` of them with each order."""
    order = np.argsort(part.orders, kind="stable")
    take = (width * order[:, None] + np.arange(width)).ravel()
    orders = tuple(part.orders[i] for i in order.tolist() for _ in range(width))
    return _Part(part.family, part.axis, part.signal, orders, part.gains[:, take])


def _given(group: Group, gains: Array, given: list[tuple[Group, Array | None]]) -> _Part:
    """A group whose basis works out its functions, or its sums."""
    if not isinstance(group.basis, SUMS):
        given.append((group, None))
        return _Part(GIVEN, 0, ANY, (0,) * gains.shape[1], gains)
    rows = np.flatnonzero(gains.any(axis=1))
    given.append((group, np.ascontiguousarray(gains[rows])))
    return _Part(GIVEN, 0, ANY, (0,) * len(rows), (np.arange(len(gains))[:, None] == rows).astype(np.float64))


def _numbers(parts: list[_Part]) -> Functions:
    """All groups as arrays."""
    first = np.cumsum([0, *(len(part.orders) for part in parts)])
    gains = np.concatenate([part.gains for part in parts], axis=1) if parts else np.zeros((0, 0))
    to, function = np.nonzero(gains)
    return Functions(
        np.array([part.family for part in parts], dtype=np.int64),
        np.array([part.axis for part in parts], dtype=np.int64),
        np.array([part.signal for part in parts], dtype=np.float64).ravel(),
        first.astype(np.int64),
        np.array([order for part in parts for order in part.orders], dtype=np.int64),
        to.astype(np.int64),
        function.astype(np.int64),
        gains[to, function],
    )
