"""A program on a control that corrects by tables: the error of the tool tip along the path, with the tables active."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ncfix.compensate.double import looks_corrected, numbers_of
from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.intent import Intent
from ncfix.compensate.kinematics import commands_from_joints
from ncfix.compensate.options import FixOptions
from ncfix.compensate.ragged import slices
from ncfix.compensate.simulation import BATCH, Tip
from ncfix.compensate.strategies import get_strategy
from ncfix.control.moves import Moves, Rule
from ncfix.machine import Machine, State

Correct = Callable[[Array, Array, float], Array]
"""Positions of all axes (k, n_axes) [mm, rad], ways (k, n_axes), tool length [mm] -> what the control adds to them."""


def tip_with(correct: Correct) -> Tip:
    """Where the tip of the real machine is with tables active: see `simulation.actual_tip`, which is without them."""

    def tip(intent: Intent, rows: Index, fraction: Array) -> Array:
        q, states = intent.joints_at(rows, fraction), intent.states(rows, fraction)
        lengths = np.broadcast_to(np.asarray(states.tool_length, dtype=np.float64), (len(q),))
        ways = np.broadcast_to(np.asarray(states.direction, dtype=np.float64), q.shape)
        corrected = q.copy()
        for length in np.unique(lengths):
            some = lengths == length
            corrected[some] += correct(q[some], ways[some], float(length))
        actual: Array = intent.machine.actual_tip(corrected, states)
        return actual

    return tip


@dataclass(frozen=True, slots=True)
class _Ends:
    """What a correction would change at the ends of motions."""

    moves: Moves
    kept: Mask
    shift: Array


def seems_corrected(machine: Machine, moves: Moves) -> bool:
    """Whether the numbers of a program look as if it had been corrected for this machine already (`double`)."""
    kept: Mask = (moves.rule != Rule.CORRECT) | ~np.isfinite(moves.end).all(axis=1)
    shift = np.zeros_like(moves.end)
    intent = Intent(machine, moves, State())
    rows = np.flatnonzero(~kept)
    for part in slices(len(rows), BATCH):
        some = rows[part]
        ends = np.ones(len(some))
        corrected = get_strategy(FixOptions().strategy).correct(
            machine, intent.joints_at(some, ends), intent.states(some, ends)
        )
        commands = commands_from_joints(machine, corrected, moves.tcp[some], moves.tool_length[some])
        shift[some] = commands - moves.end[some]
    step = machine.least_increment[0]
    return looks_corrected(numbers_of(_Ends(moves, kept, shift), step), step)
