"""The correction that tables are made from: exact, at any pose, by the forward model of the machine."""

from __future__ import annotations

import numpy as np

from ncfix.diagnostics import RefusedError
from ncfix.machine import Machine, State
from ncfix.tables.grid import Array

ARRIVED = 1e-7
"""mm: nearer to the intended tip than any control can resolve."""
PASSES = 20
ANEW = 5
"""Passes for which a Jacobian is good: each takes the gap down by the gradient of the errors, a thousandth or so."""


def linear_axes(machine: Machine) -> list[int]:
    """The columns of the three linear axes; raises `RefusedError` NCF481 if there are not exactly three."""
    found = np.flatnonzero(~machine.rotary).tolist()
    if len(found) != 3:
        text = f"tables need exactly three linear axes, this machine has {len(found)}"
        raise RefusedError.of("NCF481", text, hint="correct its programs instead: ncfix fix")
    return found


def exact_correction(machine: Machine, q: Array, state: State, start: Array | None = None) -> Array:
    """What to add to commands q (n, n_axes) so that the tip goes where a perfect machine has it at q, (n, n_axes).

    The linear axes are solved for by Newton's method; the rotary axes keep `start`, the correction that they have
    already (none if not given). Raises `RefusedError` NCF482 where no such command is found.
    """
    columns = linear_axes(machine)
    correction = np.zeros_like(q) if start is None else start.copy()
    target = machine.tip(q, state.tool_length)
    jacobian = np.empty((0, 3, 3))
    for number in range(PASSES):
        gap = target - machine.actual_tip(q + correction, state)
        if not np.isfinite(gap).all():
            break
        if np.abs(gap).max(initial=0.0) < ARRIVED:
            return correction
        if number % ANEW == 0:
            jacobian = machine.axis_jacobian(q + correction, state.tool_length)[..., :3, columns]
        correction[:, columns] += np.linalg.solve(jacobian, gap[..., None])[..., 0]
    raise RefusedError.of(
        "NCF482", "no correction found that brings the tip where it should be", hint="the error model may have a jump"
    )


def own_rotary_error(machine: Machine, q: Array, state: State, axis: int) -> Array:
    """The angular positioning error of one rotary axis about its own line, (n,) [rad]."""
    described = machine.axes[axis]
    along = np.asarray(described.error_axes) @ np.asarray(described.direction)
    error: Array = machine.joint_errors(q, state)[..., axis, 3:] @ along
    return error
