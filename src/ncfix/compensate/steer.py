"""Bringing the tool tip of an erroneous machine to a point with its linear axes: Newton on the exact model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.kinematics import affine_tip, linear_columns, regular, solve
from ncfix.machine import Machine, State

CLOSE = 1e-6
"""mm; a tip that is expected to be closer to its target than 1 nm has arrived."""
PASSES = 40
WHOLE_STEPS = 8
"""After so many passes the steps are halved: whole steps jump to and fro where the error has a jump or a kink."""


@dataclass(frozen=True, slots=True)
class Correction:
    """Corrected axis positions.

    q          (n, n_axes) what to command, mm and rad
    converged  (n,) the tip is where it should be, to 1 nm
    oriented   (n,) the tool orientation is corrected too, without damping or limits
    """

    q: Array
    converged: Mask
    oriented: Mask


def rows_of(state: State, rows: Index | slice) -> State:
    """The state of some rows; what is given for all rows together stays."""
    inputs = {name: _rows(np.asarray(values), rows, 0) for name, values in state.inputs.items()}
    length = _rows(np.asarray(state.tool_length, dtype=np.float64), rows, 0)
    return State(length, _rows(np.asarray(state.direction), rows, 1), inputs)


def _rows(values: Array, rows: Index | slice, trailing: int) -> Array:
    return values[rows] if values.ndim > trailing else values


def moved(q: Array, columns: Index, step: Array) -> Array:
    """Axis positions with `step` (n, 3) mm added to X Y Z."""
    result = q.copy()
    result[:, columns] += step
    return result


def steer(machine: Machine, q: Array, target: Array, state: State) -> tuple[Array, Mask]:
    """Move X Y Z until the erroneous machine's tip is at `target`.

    q       (n, n_axes) where to begin; only X Y Z are changed
    target  (n, 3) tool tip in the workpiece frame, mm

    Newton's method with the analytic Jacobian of the perfect machine: the errors change it by parts in ten thousand
    only, so each pass gains about as many digits. A pose has arrived when the gap, falling by the ratio that the last
    two passes show, will be under 1 nm.

    Returns the positions and which of them have arrived.
    """
    q = q.copy()
    columns = linear_columns(machine)
    maps, fine = regular(affine_tip(machine, q, state.tool_length)[0])
    arrived = np.zeros(len(q), dtype=bool)
    active = np.flatnonzero(np.isfinite(target).all(axis=1) & np.isfinite(q).all(axis=1) & fine)
    before = np.zeros(len(q))
    for number in range(PASSES):
        if not active.size:
            break
        everyone = active.size == len(q)
        rows: Index | slice = slice(None) if everyone else active
        gap = machine.actual_tip(q[rows], rows_of(state, rows)) - target[rows]
        step = solve(maps if len(maps) == 1 else maps[rows], gap)
        q[active[:, None], columns] -= step if number < WHOLE_STEPS else step / 2
        size = np.sqrt(np.einsum("ij,ij->i", gap, gap))
        done = (size < CLOSE) | (size * size < CLOSE * before[active])
        before[active] = size
        arrived[active[done]] = True
        active = active[~done]
    return q, arrived
