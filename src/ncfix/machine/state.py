"""What an erroneous machine's error depends on besides its axis positions, and poses laid out for fast arithmetic."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ncfix import fast
from ncfix.diagnostics import UsageError
from ncfix.machine.axis import Axis
from ncfix.machine.se3 import Array

CHUNK = 8192
"""Poses handled at a time: few enough that the intermediate columns stay in the processor's cache."""
LARGE = 1 << 15
"""The same where compiled loops go through them, which take them by the handful."""


@dataclass(frozen=True, slots=True)
class State:
    """The rest of the state. Everything broadcasts with the leading dimensions of the axis positions.

    tool_length  mm, gauge line to tip, shape ()
    direction    -1, 0 (unknown) or 1 per axis: the way in which it came to its position; shape (..., n_axes), or 0
    inputs       other signals by name: `temp_spindle`, `time_s`, `load_kg`, ...; shape () each
    """

    tool_length: ArrayLike = 0.0
    direction: ArrayLike = 0
    inputs: Mapping[str, ArrayLike] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
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
        """The poses in runs."""
        size = LARGE if fast.engaged() else CHUNK
        for start in range(0, self.positions.shape[1], size):
            part = slice(start, start + size)
            yield part, self.part(part)

    def part(self, part: slice) -> Poses:
        """Some of the poses."""
        return Poses(
            self.positions[:, part],
            _part(self.tool_length, part),
            _part(self.direction, part),
            {name: values[part] for name, values in self.inputs.items()},
        )


def behind_each_other(kinds: Sequence[Poses]) -> Poses:
    """Poses in several positions, all else of which is alike in form, as one."""
    if len(kinds) == 1:
        return kinds[0]
    return Poses(
        np.concatenate([each.positions for each in kinds], axis=1),
        _columns([each.tool_length for each in kinds]),
        _columns([each.direction for each in kinds]),
        {name: np.concatenate([each.inputs[name] for each in kinds]) for name in kinds[0].inputs},
    )


def _columns(values: Sequence[Array]) -> Array:
    """What is known of each pose behind each other; of one for all as it is."""
    return values[0] if values[0].shape[-1] == 1 else np.concatenate(values, axis=-1)


def flatten(q: ArrayLike, state: State, axes: tuple[Axis, ...], names: frozenset[str]) -> tuple[tuple[int, ...], Poses]:
    """The common leading shape, and the poses with the inputs called `names`.

    Raises `UsageError` NCF340 if an input is missing and ValueError if the shapes do not fit.
    """
    q = np.asarray(q, dtype=np.float64)
    if q.shape[-1:] != (len(axes),):
        raise ValueError(f"axis positions have shape {q.shape}, expected (..., {len(axes)})")
    length = np.asarray(state.tool_length, dtype=np.float64)
    direction = np.asarray(state.direction, dtype=np.float64)
    inputs = {name: _input(state, name) for name in sorted(names)}
    parts = {q.shape[:-1], length.shape, direction.shape[:-1], *(values.shape for values in inputs.values())}
    shape = q.shape[:-1]
    if not parts <= {shape, ()}:
        shape = np.broadcast_shapes(*parts)
        q = np.broadcast_to(q, (*shape, len(axes)))
    columns = np.ascontiguousarray(q.reshape(-1, len(axes)).T)
    flat = {name: np.broadcast_to(values, shape).reshape(-1) for name, values in inputs.items()}
    return shape, Poses(columns, _column(length, shape), _directions(direction, shape, len(axes)), flat)


def _input(state: State, name: str) -> Array:
    values = state.tool_length if name == "tool_length" else state.inputs.get(name)
    if values is None:
        raise UsageError.of(
            "NCF340",
            f"the machine's errors depend on {name!r}, which is not given",
            hint=f"--input {name}=VALUE or [inputs] in the setup file; with measurements, a column of that name",
        )
    return np.asarray(values, dtype=np.float64)


def _column(values: Array, shape: tuple[int, ...]) -> Array:
    return values.reshape(1) if values.size == 1 else np.broadcast_to(values, shape).reshape(-1)


def _directions(values: Array, shape: tuple[int, ...], n_axes: int) -> Array:
    if values.ndim <= 1:
        same: Array = np.empty((n_axes, 1))
        same[:, 0] = values
        return same
    return np.broadcast_to(values, (*shape, n_axes)).reshape(-1, n_axes).T


def _part(values: Array, part: slice) -> Array:
    return values if values.shape[-1] == 1 else values[..., part]


def poses_first(values: Array, shape: tuple[int, ...]) -> Array:
    """From (..., n) to (*shape, ...), contiguous."""
    first: Array = np.ascontiguousarray(np.moveaxis(values, -1, 0)).reshape((*shape, *values.shape[:-1]))
    return first
