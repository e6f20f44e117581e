"""Bringing the tool tip of an erroneous machine to a point with its linear axes: Newton on the exact model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.kinematics import linear_columns
from ncfix.machine import Machine, State


@dataclass(frozen=True, slots=True)
class Correction:
    """Corrected axis positions.

    q          (n, n_axes) what to command, mm and rad
    converged  (n,) the tip is where it should be, to 1 nm
    oriented   (n,) the tool orientation is corrected too, without damping or limits
    before     (n,) mm: how far the tip is off without a correction; None if that was not looked at
    """

    q: Array
    converged: Mask
    oriented: Mask
    before: Array | None = None


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


def steer(machine: Machine, q: Array, target: Array | None, state: State) -> tuple[Array, Mask]:
    """Move X Y Z until the erroneous machine's tip is at `target`; None: where a perfect machine has it at q.

    q       (n, n_axes) where to begin; only X Y Z are changed
    target  (n, 3) tool tip in the workpiece frame, mm

    See `Machine.aim`. Returns the positions and which of them have arrived: the gap, falling by the ratio that the last
    two passes show, will be under 1 nm.
    """
    found = steered(machine, q, target, state)
    return found.q, found.converged


def steered(machine: Machine, q: Array, target: Array | None, state: State) -> Correction:
    """As `steer`; how far off the tip was tells something about the program if that is where it began."""
    columns = linear_columns(machine)
    x, y, z = columns.tolist()
    aim = machine.aim(q, (x, y, z), state, target)
    result = q.copy()
    result[:, columns] = aim.place
    return Correction(result, aim.arrived, np.zeros(len(q), dtype=bool), aim.off)
