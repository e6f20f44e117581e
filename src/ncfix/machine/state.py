"""The state on which errors depend: axis positions, tool length, direction, inputs, and signals made of these."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace

import numpy as np
from numpy.typing import ArrayLike

from ncfix import core
from ncfix.arrays import Array, Index
from ncfix.diagnostics import Message, UsageError
from ncfix.machine.axes import Axis
from ncfix.values import frozen

CHUNK = 8192
"""Number of poses handled at a time, so that intermediate columns stay in the processor's cache."""
LARGE = 1 << 15
"""The same for compiled loops, which work on few poses at a time anyway."""


@frozen
class State:
    """The state besides the axis positions. All values broadcast with the leading dimensions of the positions.

    tool_length  mm, gauge line to tip, shape ()
    direction    direction in which each axis came to its position: -1, 1, or 0 if unknown; shape (..., n_axes), or 0
    inputs       other signals by name: `temp_spindle`, `time_s`, `load_kg`, ...; shape () each
    """

    tool_length: ArrayLike = 0.0
    direction: ArrayLike = 0
    inputs: Mapping[str, ArrayLike] = field(default_factory=dict)


@frozen
class Poses:
    """Poses with their leading dimensions flattened and their axes first: columns of n numbers.

    positions    (n_axes, n) mm, rad
    tool_length  (n,) or (1,) mm
    direction    (n_axes, n) or (n_axes, 1)
    inputs       name -> (n,)
    """

    positions: Array
    tool_length: Array
    direction: Array
    inputs: Mapping[str, Array]

    def chunks(self) -> Iterator[tuple[slice, Poses]]:
        """The poses in chunks, each with its slice."""
        size = LARGE if core.engaged() else CHUNK
        for start in range(0, self.positions.shape[1], size):
            part = slice(start, start + size)
            yield part, self.part(part)

    def evaluated(self, function: Callable[[Poses, slice], Array], *shape: int) -> Array:
        """(*shape, n) the values of a function of poses and their slice, evaluated chunk by chunk."""
        out = np.empty((*shape, self.positions.shape[1]))
        for part, chunk in self.chunks():
            out[..., part] = function(chunk, part)
        return out

    def part(self, part: slice | Index) -> Poses:
        """The poses `part`."""
        inputs = {name: values[part] for name, values in self.inputs.items()}
        length, direction = some(self.tool_length, part), some(self.direction, part)
        return Poses(self.positions[:, part], length, direction, inputs)


def behind_each_other(kinds: Sequence[Poses]) -> Poses:
    """Several sets of poses as one, with the same inputs and the same shapes of the other columns."""
    if len(kinds) == 1:
        return kinds[0]
    return Poses(
        np.concatenate([each.positions for each in kinds], axis=1),
        _columns([each.tool_length for each in kinds]),
        _columns([each.direction for each in kinds]),
        {name: np.concatenate([each.inputs[name] for each in kinds]) for name in kinds[0].inputs},
    )


def _columns(values: Sequence[Array]) -> Array:
    """State columns with one value per pose, joined; a single value for all poses is passed through unchanged."""
    return values[0] if values[0].shape[-1] == 1 else np.concatenate(values, axis=-1)


def flatten(q: ArrayLike, state: State, axes: tuple[Axis, ...], names: frozenset[str]) -> tuple[tuple[int, ...], Poses]:
    """The common leading shape, and the poses with the inputs `names`.

    Raises `UsageError` NCF340 if an input is missing, and ValueError if the shapes do not match.
    """
    q = np.asarray(q, dtype=np.float64)
    if q.shape[-1:] != (len(axes),):
        raise ValueError(f"axis positions have shape {q.shape}, expected (..., {len(axes)})")
    length = np.asarray(state.tool_length, dtype=np.float64)
    direction = np.asarray(state.direction, dtype=np.float64)
    values = {**state.inputs, "tool_length": state.tool_length}
    if missing := sorted(name for name in names if values.get(name) is None):
        raise UsageError.collected(
            Message(
                "NCF340",
                f"an error of the machine depends on {name!r}, whose value is not given",
                hint=f"--input {name}=VALUE or [inputs] in the setup file; with measurements, a column of that name",
            )
            for name in missing
        )
    inputs = {name: np.asarray(values[name], dtype=np.float64) for name in sorted(names)}
    parts = {q.shape[:-1], length.shape, direction.shape[:-1], *(values.shape for values in inputs.values())}
    shape = q.shape[:-1]
    if not parts <= {shape, ()}:
        shape = np.broadcast_shapes(*parts)
        q = np.broadcast_to(q, (*shape, len(axes)))
    columns = np.ascontiguousarray(q.reshape(-1, len(axes)).T)
    flat = {name: np.broadcast_to(values, shape).reshape(-1) for name, values in inputs.items()}
    return shape, Poses(
        columns,
        length.reshape(1) if length.size == 1 else np.broadcast_to(length, shape).reshape(-1),
        _directions(direction, shape, len(axes)),
        flat,
    )


def _directions(values: Array, shape: tuple[int, ...], n_axes: int) -> Array:
    if values.ndim <= 1:
        same: Array = np.empty((n_axes, 1))
        same[:, 0] = values
        return same
    return np.broadcast_to(values, (*shape, n_axes)).reshape(-1, n_axes).T


def some(values: Array, part: slice | Index) -> Array:
    """Values (..., n) of the poses `part`; a single value for all poses is passed through unchanged."""
    return values if values.shape[-1] == 1 else values[..., part]


def poses_first(values: Array, shape: tuple[int, ...]) -> Array:
    """From (..., n) to (*shape, ...), contiguous."""
    return np.ascontiguousarray(np.moveaxis(values, -1, 0)).reshape((*shape, *values.shape[:-1]))


TIME = "time_s"
SUM = "+"
"""Sign between the letters of rotary axes whose angles are added: B+C is the lean of an arm behind two parallel joints.
"""


@frozen
class Signal:
    """A quantity, one number per pose, and its argument for a basis: u = (x - center) / scale, x held in its range.

    name        axis letter, letters of rotary axes whose angles are added (B+C), or name of an input
    axis        index of the axis; None for a sum or a state input
    summed      indices of the axes of a sum
    unit        internal units per unit of x
    low, high   range of x; outside it, x is held at the nearer end
    endless     x is the angle of an axis without limits, so that full turns are equivalent
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
    summed: tuple[int, ...] = ()

    @property
    def axes(self) -> tuple[int, ...]:
        """The indices of all axes on which the signal depends."""
        return self.summed if self.axis is None else (self.axis,)

    @property
    def inputs(self) -> frozenset[str]:
        """The state inputs on which the signal depends."""
        names = set() if self.axes else {self.name}
        return frozenset(names | {TIME} if self.constant_s else names)

    @property
    def lagged_name(self) -> str:
        """The name of its values after the lag in `Poses.inputs`."""
        return f"{self.name} after {self.constant_s!r} s"

    def raw(self, poses: Poses) -> Array:
        """(n,) x before it is held in its range, in the unit of the machine file."""
        if not self.axes:
            return poses.inputs[self.name]
        if self.axis is None:
            return poses.positions[list(self.summed)].sum(axis=0) / self.unit
        return poses.positions[self.axis] / self.unit

    def u(self, poses: Poses, domain: tuple[float, float]) -> Array:
        """(n,) the argument u of the basis, without a unit; `domain`: the basis's own range of u."""
        x = poses.inputs[self.lagged_name] if self.constant_s else self.raw(poses)
        if self.endless:
            x = turned_back(x, self.low, self.high)
        if np.isfinite(self.low) or np.isfinite(self.high):
            x = np.clip(x, self.low, self.high)
        u = x if (self.center, self.scale) == (0.0, 1.0) else (x - self.center) / self.scale
        return turned_back(u, *domain, 360.0 / abs(self.scale)) if self.endless else u


def inputs_of(signals: Iterable[Signal]) -> frozenset[str]:
    """The state inputs on which these signals depend."""
    return frozenset(name for signal in signals for name in signal.inputs)


def signal_called(axes: tuple[Axis, ...], name: str) -> Signal:
    """The position of the axis with this letter, the sum of the angles of several (B+C), or a state input."""
    for index, axis in enumerate(axes):
        if axis.name == name:
            low, high = (limit / axis.unit for limit in axis.range)
            return Signal(name, index, axis.unit, low, high, axis.endless)
    if SUM in name:
        names = [axis.name for axis in axes]
        summed = tuple(names.index(each) for each in name.split(SUM))
        return Signal(name, unit=axes[summed[0]].unit, summed=summed)
    return Signal(name)


def turned_back(angle: Array, low: float, high: float, turn: float = 360.0) -> Array:
    """Angles moved by full turns into low ... high, or next to its nearer end; with infinite limits unchanged.

    So an angle that rounding puts a little below `low` stays there, and gets the value at `low`.
    """
    if not np.isfinite(low):
        return angle
    outside = (angle < low) | (angle > high)
    if not outside.any():
        return angle
    moved = low + np.mod(angle - low, turn)
    return np.where(outside, np.where(moved > middle_of_gap(low, high, turn), moved - turn, moved), angle)


def middle_of_gap(low: float, high: float, turn: float = 360.0) -> float:
    """Middle of the gap from `high` to the next turn of `low`, where the nearer end changes; `high` without a gap."""
    return max(high, (high + low + turn) / 2)


def with_lags(poses: Poses, signals: Iterable[Signal]) -> Poses:
    """The poses with the values of lagged signals, which are computed over all poses in order of time."""
    late = {signal.lagged_name: signal for signal in signals if signal.constant_s}
    if not late:
        return poses
    time_s = poses.inputs[TIME]
    values = {name: lagged(signal.raw(poses), time_s, signal.constant_s) for name, signal in late.items()}
    return replace(poses, inputs={**poses.inputs, **values})


def lagged(values: Array, time_s: Array, constant_s: float) -> Array:
    """A signal after a first-order lag; it is taken as linear between samples, and as settled before the first one.

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
