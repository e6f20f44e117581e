"""The signals that errors depend on: axis positions and state inputs in the file's units, and their lag."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ncfix.machine.axis import Axis
from ncfix.machine.se3 import Array
from ncfix.machine.state import Poses

TIME = "time_s"


@dataclass(frozen=True, slots=True)
class Signal:
    """One number per pose, made ready for a basis: u = (x - center) / scale, x held at the ends of the axis range.

    name        axis letter or input
    axis        index of the axis; None for a state input
    unit        internal units per unit of x
    low, high   the x beyond which the end values hold
    endless     x is an angle that may turn round and round
    center, scale   of u
    constant_s  time constant of a first-order lag; 0 for none
    """

    name: str
    axis: int | None = None
    unit: float = 1.0
    low: float = -np.inf
    high: float = np.inf
    endless: bool = False
    center: float = 0.0
    scale: float = 1.0
    constant_s: float = 0.0

    @property
    def inputs(self) -> frozenset[str]:
        """The state inputs that it is made of."""
        names = {self.name} if self.axis is None else set()
        return frozenset(names | {TIME} if self.constant_s else names)

    @property
    def lagged_name(self) -> str:
        """Where its values after the lag are kept."""
        return f"{self.name} after {self.constant_s!r} s"

    def raw(self, poses: Poses) -> Array:
        """x, (n,), not yet held, in the unit of the machine file."""
        if self.axis is None:
            return poses.inputs[self.name]
        position: Array = poses.positions[self.axis] / self.unit
        return position

    def u(self, poses: Poses, domain: tuple[float, float]) -> Array:
        """What the basis sees, (n,), without a unit; `domain` is the basis's own range of u."""
        x = poses.inputs[self.lagged_name] if self.constant_s else self.raw(poses)
        if self.endless:
            x = turned_back(x, self.low, self.high)
        if np.isfinite(self.low) or np.isfinite(self.high):
            x = np.clip(x, self.low, self.high)
        u = x if (self.center, self.scale) == (0.0, 1.0) else (x - self.center) / self.scale
        return turned_back(u, *domain, 360.0 / abs(self.scale)) if self.endless else u


def inputs_of(signals: Iterable[Signal]) -> frozenset[str]:
    """The state inputs that these are made of."""
    return frozenset(name for signal in signals for name in signal.inputs)


def axis_signal(axes: tuple[Axis, ...], index: int) -> Signal:
    """The position of an axis."""
    axis = axes[index]
    low, high = (limit / axis.unit for limit in axis.range)
    return Signal(axis.name, index, axis.unit, low, high, axis.endless)


def turned_back(angle: Array, low: float, high: float, turn: float = 360.0) -> Array:
    """Angles outside low ... high moved by whole turns to the first turn from `low`; infinite limits leave them."""
    if not np.isfinite(low):
        return angle
    outside = (angle < low) | (angle > high)
    return np.where(outside, low + np.mod(angle - low, turn), angle) if outside.any() else angle


def with_lags(poses: Poses, signals: Iterable[Signal]) -> Poses:
    """The poses with the lagged signals worked out, over all of them at once and in order of time."""
    late = {signal.lagged_name: signal for signal in signals if signal.constant_s}
    if not late:
        return poses
    time_s = poses.inputs[TIME]
    values = {name: lagged(signal.raw(poses), time_s, signal.constant_s) for name, signal in late.items()}
    return replace(poses, inputs={**poses.inputs, **values})


def lagged(values: Array, time_s: Array, constant_s: float) -> Array:
    """A signal after a first-order lag, taken as straight between samples and as settled before the first one.

    values, time_s  same shape; the samples may come in any order of time
    constant_s      time constant, s

    Between two samples a time step h apart, with e = exp(-h / constant), the lagged signal y follows
    y1 = e y0 + x1 - e x0 - (x1 - x0) (1 - e) constant / h exactly.
    """
    order = np.argsort(time_s, axis=None, kind="stable")
    x, t = values.ravel()[order], time_s.ravel()[order]
    step = np.diff(t) / constant_s
    decay = np.exp(-step)
    mean = np.where(step > 1e-12, -np.expm1(-step) / np.where(step > 1e-12, step, 1.0), 1.0)
    drive = x[1:] - decay * x[:-1] - np.diff(x) * mean
    settled = np.empty_like(x)
    settled[order] = _recursion(np.concatenate([[0.0], decay]), np.concatenate([x[:1], drive]))
    return settled.reshape(values.shape)


def _recursion(factor: Array, term: Array) -> Array:
    """y[i] = factor[i] y[i-1] + term[i] for all i in log2(n) passes over the arrays."""
    factor, term = factor.copy(), term.copy()
    reach = 1
    while reach < len(term):
        term[reach:] = term[reach:] + factor[reach:] * term[:-reach]
        factor[reach:] = factor[reach:] * factor[:-reach]
        reach *= 2
    return term
