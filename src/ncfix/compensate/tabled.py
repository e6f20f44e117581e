"""A program on a control that corrects by tables: the error of the tool tip along the path, with the tables active."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ncfix.compensate.findings import Array
from ncfix.compensate.intent import Intent
from ncfix.compensate.simulation import TipError, batches, samples
from ncfix.machine import Machine, State
from ncfix.program.moves import Moves

Correct = Callable[[Array, Array, float], Array]
"""Positions of all axes (k, n_axes) [mm, rad], ways (k, n_axes), tool length [mm] -> what the control adds to them."""


def tip_error_with(machine: Machine, moves: Moves, correct: Correct, state: State = State()) -> TipError:  # noqa: B008
    """The error of a program as this machine runs it with tables: see `tip_error`, which is that without them."""
    intent = Intent(machine, moves, state)
    rows, fraction = samples(intent)
    intended, actual = np.empty((len(rows), 3)), np.empty((len(rows), 3))
    for part in batches(len(rows)):
        q = intent.joints_at(rows[part], fraction[part])
        states = intent.states(rows[part], fraction[part])
        lengths = np.broadcast_to(np.asarray(states.tool_length, dtype=np.float64), (len(q),))
        ways = np.broadcast_to(np.asarray(states.direction, dtype=np.float64), q.shape)
        corrected = q.copy()
        for length in np.unique(lengths):
            some = lengths == length
            corrected[some] += correct(q[some], ways[some], float(length))
        intended[part] = intent.tip(rows[part], fraction[part])
        actual[part] = machine.actual_tip(corrected, states)
    return TipError(rows, fraction, intended, actual)
