"""A machine's errors as curves over the travel of its axes: for people, not for correction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.machine.effect import Effect
from ncfix.machine.error_model import signals_of
from ncfix.machine.linear import course_of
from ncfix.machine.machine import Machine
from ncfix.machine.se3 import Array
from ncfix.machine.state import State, flatten
from ncfix.machine.summary import travel


@dataclass(frozen=True, slots=True)
class Curve:
    """An effect over the axis that it depends on.

    axis       the axis
    x          (n,) positions, mm or degree
    value      (n,) mm or rad
    sigma      (n,) standard deviation by the effect's covariance, mm or rad; None if it has none
    direction  of approach: 1 or -1, 0 where that does not matter
    """

    axis: str
    x: Array
    value: Array
    sigma: Array | None
    direction: int = 0


@dataclass(frozen=True, slots=True)
class Drift:
    """How the error of the tool tip changes as one axis moves over its travel, the others in the middle of theirs.

    x      (n,) positions, mm or degree
    error  (n, 3) actual minus nominal position of the tip, workpiece frame, mm
    """

    axis: str
    x: Array
    error: Array


def curves(machine: Machine, effect: Effect) -> list[Curve]:
    """An effect over its travel, once for each direction of approach if that matters.

    None if it depends on no axis, on two things at once, or on an axis without a range.
    """
    signals = [signal for signal in signals_of(machine.axes, effect) if signal is not None]
    if len(signals) != 1 or signals[0].axis is None:
        return []
    q = _moved(machine, signals[0].axis)
    if q is None:
        return []
    return [
        _curve(machine, effect, q, signals[0].axis, way) for way in ((1, -1) if effect.basis.needs_direction else (0,))
    ]


def drifts(machine: Machine, tool_length: float = 0.0) -> list[Drift]:
    """The error of the tip along each axis; of approach from below, and with all inputs at zero."""
    found = []
    for index, axis in enumerate(machine.axes):
        q = _moved(machine, index)
        if q is not None and np.isfinite(q).all():
            state = State(tool_length=tool_length, direction=1, inputs=dict.fromkeys(machine.inputs, 0.0))
            error = machine.actual_tip(q, state) - machine.tip(q, tool_length)
            found.append(Drift(axis.name, q[:, index] / axis.unit, error))
    return found


def _curve(machine: Machine, effect: Effect, q: Array, axis: int, direction: int) -> Curve:
    _, poses = flatten(q, State(direction=direction), machine.axes, frozenset())
    rows = course_of(machine.axes, effect).rows(poses)
    value: Array = np.asarray(effect.coefficients) @ rows
    sigma = None
    if effect.covariance is not None:
        sigma = np.sqrt(np.maximum(np.einsum("kn,kl,ln->n", rows, np.asarray(effect.covariance), rows), 0.0))
    return Curve(machine.axis_names[axis], q[:, axis] / machine.axes[axis].unit, value, sigma, direction)


def _moved(machine: Machine, axis: int) -> Array | None:
    """(n, n_axes): one axis over its travel, in order, the others in the middle of theirs; None without a range."""
    x = travel(machine, axis)
    if not np.isfinite(x).all():
        return None
    q = np.tile([_middle(machine, index) for index in range(len(machine.axes))], (len(x), 1))
    q[:, axis] = np.sort(x)
    return q


def _middle(machine: Machine, axis: int) -> float:
    low, high = machine.ranges[axis]
    return float(low + high) / 2 if np.isfinite([low, high]).all() else 0.0
