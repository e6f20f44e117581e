"""The levels from which canned cycles feed, and to which they may return (R), corrected.

A cycle has one place in its plane, that of the bottom of the hole; of the level only the height is its own.
"""

from __future__ import annotations

import numpy as np

from ncfix.compensate.plan.arrays import Array, Index, Mask
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.kinematics import commands_from_joints, steer
from ncfix.control.moves import Moves
from ncfix.writer.frames import FrameMap


def corrected_approaches(intent: Intent, wanted: Array, kept: Mask) -> Array | None:
    """(n, n_axes) where cycles that are not `kept` (n,) shall feed from, if they end at `wanted` (n, n_axes).

    NaN where there is no such level, or it cannot be corrected; None if there is none at all.
    """
    moves = intent.moves
    if moves.approach is None:
        return None
    rows = np.flatnonzero(~kept & np.isfinite(moves.approach).all(axis=1) & np.isfinite(wanted).all(axis=1))
    result = np.full(moves.approach.shape, np.nan)
    commands, arrived = _steered(intent, rows, moves.approach[rows], wanted[rows])
    result[rows[arrived]] = _over_the_hole(moves, rows[arrived], commands[arrived], wanted[rows[arrived]])
    return result


def _steered(intent: Intent, rows: Index, nominal: Array, wanted: Array) -> tuple[Array, Mask]:
    """Commands that bring the tip of the real machine to the level, rotary axes as at the bottom of the hole."""
    moves, machine = intent.moves, intent.machine
    meant = intent.joints(rows, nominal)
    q = np.where(machine.rotary, intent.joints(rows, wanted), meant)
    fit: Mask = np.asarray(np.isfinite(q).all(axis=1))
    good = rows[fit]
    arrived, commands = fit.copy(), nominal.copy()
    target = machine.tip(meant[fit], intent.lengths(good))
    solved, arrived[fit] = steer(machine, q[fit], target, intent.states(good, np.ones(len(good))))
    commands[fit] = commands_from_joints(machine, solved, moves.tcp[good], moves.tool_length[good])
    return commands, arrived


def _over_the_hole(moves: Moves, rows: Index, commands: Array, wanted: Array) -> Array:
    """Commands (k, n_axes) moved over the bottom of their hole, in the frame of the program."""
    assert moves.approach is not None
    result = commands.copy()
    for number in np.unique(moves.frame[rows]):
        part = np.flatnonzero(moves.frame[rows] == number)
        frame = FrameMap(moves.frames[number], moves.axes, moves.rotary)
        own = rows[part]
        depth = np.abs(frame.program(moves.end[own].copy()) - frame.program(moves.approach[own].copy()))
        across = depth == depth.max(axis=1, keepdims=True)
        over = np.where(across, frame.program(commands[part].copy()), frame.program(wanted[part].copy()))
        result[part] = frame.command(over)
    return result
