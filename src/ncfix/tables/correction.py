"""The exact correction from which tables are made, the space that tables cover, and the residual that they leave.

The correction at a pose is exact by the forward model of the machine: linear axes correct the tool tip, rotary axes the
orientation of the tool as far as they can, including its spin. The residual is the error of the tool tip at random
poses, without tables and with them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.diagnostics import RefusedError, UsageError
from ncfix.machine import Machine, State
from ncfix.tables.compensation import Tables
from ncfix.tables.grid import full_grid
from ncfix.values import frozen

SPATIAL = ("X", "Y", "Z")
ARRIVED = 1e-7
"""Largest deviation from the intended tip at convergence, mm."""
NEWTON_PASSES = 20
ANEW = 5
"""Passes with one Jacobian: each reduces the deviation by a factor of about a thousand, the gradient of the errors."""
ROTARY_PASSES = 2
Ranges = Mapping[str, tuple[float, float]]
"""Axis -> lowest and highest position, mm or rad."""
POSES = 20_000
"""Number of random poses of a residual."""


def linear_axes(machine: Machine) -> list[int]:
    """Columns of the three linear axes that correct the tip: X, Y and Z if there are more than three.

    Raises `RefusedError` NCF481 if there are fewer, or more and X, Y or Z is not among them.
    """
    found = np.flatnonzero(~machine.rotary).tolist()
    if len(found) > 3:
        found = [column for column in found if machine.axis_names[column] in SPATIAL]
    if len(found) != 3:
        text = "tables need three linear axes (X, Y and Z if there are more) to move the tip"
        raise RefusedError.of("NCF481", text, hint="correct the programs instead: ncfix fix")
    return found


def exact_correction(machine: Machine, q: Array, state: State, start: Array | None = None) -> Array:
    """Correction (n, n_axes), added to commands q, that brings the tip to its nominal position at q.

    The linear axes are solved for by Newton's method; the rotary axes keep the correction `start` (default zero).
    Raises `RefusedError` NCF482 if no solution is found.
    """
    columns = linear_axes(machine)
    correction = np.zeros_like(q) if start is None else start.copy()
    target = machine.tip(q, state.tool_length)
    jacobian = np.empty((0, 3, 3))
    for number in range(NEWTON_PASSES):
        gap = target - machine.actual_tip(q + correction, state)
        if not np.isfinite(gap).all():
            break
        if np.abs(gap).max(initial=0.0) < ARRIVED:
            return correction
        if number % ANEW == 0:
            jacobian = machine.axis_jacobian(q + correction, state.tool_length)[..., :3, columns]
        correction[:, columns] += steps_towards(gap, jacobian)
    text = "no correction found that brings the tip to its nominal position"
    raise RefusedError.of("NCF482", text, hint="look for a jump in the errors of the machine file")


def steps_towards(gap: Array, jacobian: Array) -> Array:
    """Steps (n, 3) of three linear axes that move the tip by `gap` (n, 3); `jacobian` (n, 3, 3): by their columns.

    Raises `RefusedError` NCF482 if a rotary axis between them has turned two of the axes into one plane with the third.
    """
    try:
        return np.asarray(np.linalg.solve(jacobian, gap[..., None])[..., 0], dtype=np.float64)
    except np.linalg.LinAlgError:
        text = "a rotary axis turns the linear axes so that they do not span space"
        raise RefusedError.of("NCF482", text, hint="--range without this angle") from None


def own_rotary_correction(machine: Machine, q: Array, state: State) -> Array:
    """Correction (n, n_axes), rad, of the angular positioning error of every rotary axis about its own line."""
    correction = np.zeros_like(q)
    for axis in np.flatnonzero(machine.rotary).tolist():
        described = machine.axes[axis]
        along = np.asarray(described.error_axes) @ np.asarray(described.direction)
        correction[:, axis] = -(machine.joint_errors(q, state)[..., axis, 3:] @ along)
    return correction


def rotary_correction(machine: Machine, q: Array, state: State) -> Array:
    """Correction (n, n_rotary), rad, of the rotary axes at commands q (n, n_axes).

    It minimizes the three orientation errors of the tool, which two axes cannot remove completely: the angular part of
    S. Esmaeili Marzdashti (Polytechnique Montreal, 2021), Eq. 27 and 32. Linear axes remove the remaining displacement.
    """
    columns = np.flatnonzero(machine.rotary)
    meant = machine.nominal(q, state.tool_length)
    solver = np.linalg.pinv(machine.axis_jacobian(q, state.tool_length)[..., 3:, columns])
    correction = np.zeros((len(q), len(columns)))
    for _ in range(ROTARY_PASSES):
        corrected = q.copy()
        corrected[:, columns] += correction
        correction -= np.einsum("nij,jn->ni", solver, _turn(machine.actual(corrected, state), meant))
    return correction


def orientation_error(machine: Machine, q: Array, correction: Array, state: State) -> Array:
    """Orientation error of the tool (n,), rad, at commands q with a correction added."""
    turn = _turn(machine.actual(q + correction, state), machine.nominal(q, state.tool_length))
    return np.linalg.norm(turn, axis=0)


def _turn(actual: Array, meant: Array) -> Array:
    """The small rotation (3, n), rad, from intended frames (n, 4, 4) to actual ones."""
    turn = actual[..., :3, :3] @ np.swapaxes(meant[..., :3, :3], -1, -2)
    return (turn[:, [2, 0, 1], [1, 2, 0]] - turn[:, [1, 2, 0], [2, 0, 1]]).T / 2


def ranges_of(machine: Machine, given: Ranges | None = None) -> Array:
    """The space that the tables cover, (n_axes, 2), mm and rad: as given, else the travel, or one turn if endless.

    Raises `UsageError` NCF483 for an unknown axis, a range that is empty or beyond the travel, or a linear axis without
    a range.
    """
    space = np.array(machine.ranges)
    endless = machine.rotary & ~np.isfinite(space).all(axis=1)
    space[endless] = (-np.pi, np.pi)
    for name, limits in (given or {}).items():
        if name not in machine.axis_names:
            raise _wrong_range(f"the machine has no axis {name!r}", f"one of {', '.join(machine.axis_names)}")
        if len(limits) != 2:
            raise _wrong_range(f"the range of {name} is not two numbers", "LOW,HIGH")
        index = machine.axis_names.index(name)
        low, high = machine.ranges[index]
        if not limits[0] < limits[1]:
            raise _wrong_range(f"the range of {name} is empty", "give LOW,HIGH with the lower limit first")
        if limits[0] < low - 1e-9 or limits[1] > high + 1e-9:
            raise _wrong_range(f"the range of {name} exceeds its travel", "see the travel in the machine file")
        space[index] = limits
    for name, limits in zip(machine.axis_names, space, strict=True):
        if not np.isfinite(limits).all():
            raise _wrong_range(f"the machine file gives no range of {name}", f"--range {name}=LOW,HIGH")
    return space


def _wrong_range(text: str, hint: str) -> UsageError:
    return UsageError.of("NCF483", text, hint=hint)


def random_poses(space: Array, count: int, seed: int = 0) -> Array:
    """Uniformly random poses in the space, (count, n_axes); equal for equal seeds."""
    return np.random.default_rng(seed).uniform(space[:, 0], space[:, 1], size=(count, len(space)))


def random_ways(n_axes: int, count: int, seed: int = 1) -> Array:
    """Random directions of motion, (count, n_axes), -1 or 1."""
    return np.random.default_rng(seed).choice([-1.0, 1.0], size=(count, n_axes))


def even_poses(space: Array, count: int) -> Array:
    """Poses that fill the space evenly, (count, n_axes): a lattice with irrational steps."""
    dimensions = len(space)
    ratio = 2.0
    for _ in range(40):
        ratio = (1 + ratio) ** (1 / (dimensions + 1))
    steps = ratio ** -np.arange(1.0, dimensions + 1)
    share = np.mod(0.5 + np.arange(1, count + 1)[:, None] * steps, 1.0)
    return space[:, 0] + share * (space[:, 1] - space[:, 0])


def corners(space: Array) -> Array:
    """The corners of the space, (2 ** n_axes, n_axes)."""
    return full_grid(list(space))


def poses_along(axis: int, positions: Array, rest: Array) -> Array:
    """One axis at positions (n,), each with the other axes as in poses `rest` (m, n_axes): (n * m, n_axes)."""
    q = np.repeat(rest[None], len(positions), axis=0)
    q[:, :, axis] = positions[:, None]
    return q.reshape(-1, rest.shape[-1])


@frozen
class Residual:
    """Tip errors at poses q (n, n_axes), before and after (n,), mm, with the corrections there, (n, n_axes)."""

    names: tuple[str, ...]
    rotary: Mask
    q: Array
    before: Array
    after: Array
    correction: Array

    @property
    def largest(self) -> Array:
        """The largest correction of each axis, (n_axes,) mm and rad."""
        sizes: Array = np.abs(self.correction).max(axis=0)
        return sizes

    def pose(self, row: int) -> dict[str, float]:
        """A pose by axis letter, mm and degree."""
        pose = np.where(self.rotary, np.degrees(self.q[row]), self.q[row])
        return {name: round(float(value), 3) for name, value in zip(self.names, pose, strict=True)}

    def figures(self) -> dict[str, dict[str, Any]]:
        """Figures for `--json`, um; `at` is the pose with the largest error with tables, mm and degree."""
        at = self.pose(int(np.argmax(self.after)))
        return {"before": _size(self.before), "after": {**_size(self.after), "at": at}}


def _size(error: Array) -> dict[str, float]:
    rms = float(np.sqrt(np.mean(error**2)))
    return {"max": 1e3 * float(error.max()), "rms": 1e3 * rms, "mean": 1e3 * float(error.mean())}


def residual(machine: Machine, tables: Tables, space: Array, tool_length: float, count: int = POSES) -> Residual:
    """The residual of tables at `count` random poses of the space (n_axes, 2), with random directions of motion.

    The tables look up the commanded position, as controls with setpoint inputs do.
    """
    q = random_poses(space, count, seed=7)
    ways = random_ways(len(space), count, seed=8)
    state = State(tool_length, ways)
    correction = tables.for_tool(tool_length).at(machine.axis_names, q, ways)
    meant = machine.tip(q, tool_length)
    return Residual(
        machine.axis_names,
        machine.rotary,
        q,
        np.linalg.norm(machine.actual_tip(q, state) - meant, axis=-1),
        np.linalg.norm(machine.actual_tip(q + correction, state) - meant, axis=-1),
        correction,
    )
