"""Corrections of the rotary axes: what they can do for the orientation of the tool, spin about its axis included."""

from __future__ import annotations

import numpy as np

from ncfix.machine import Machine, State
from ncfix.tables.grid import Array

PASSES = 2


def rotary_correction(machine: Machine, q: Array, state: State) -> Array:
    """What to add to the rotary axes at commands q (n, n_axes), (n, n_rotary) rad.

    The least squares of the three angles that the tool is then wrong by: two axes cannot take off three. As in S.
    Esmaeili Marzdashti (Polytechnique Montreal, 2021), Eq. 27 and 32, of which it is the angular part: the linear axes
    can take off any displacement that is left.
    """
    columns = np.flatnonzero(machine.rotary)
    meant = np.swapaxes(machine.nominal(q, state.tool_length)[..., :3, :3], -1, -2)
    by_axes = machine.axis_jacobian(q, state.tool_length)[..., 3:, columns]
    solver = np.linalg.pinv(by_axes)
    correction = np.zeros((len(q), len(columns)))
    for _ in range(PASSES):
        corrected = q.copy()
        corrected[:, columns] += correction
        turn = machine.actual(corrected, state)[..., :3, :3] @ meant
        vector = np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]])
        correction -= np.einsum("nij,jn->ni", solver, vector / 2)
    return correction


def orientation_error(machine: Machine, q: Array, correction: Array, state: State) -> Array:
    """By what angle the tool is wrong at commands q that are corrected, (n,) rad."""
    meant = np.swapaxes(machine.nominal(q, state.tool_length)[..., :3, :3], -1, -2)
    turn = machine.actual(q + correction, state)[..., :3, :3] @ meant
    vector = np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]])
    angle: Array = np.linalg.norm(vector / 2, axis=0)
    return angle
