"""Rotary axes that must stay as programmed, though the strategy would correct them.

One that must get no word stays where it stands. And in a plane that was swivelled without tool-centre-point control the
control moves linear axes as if the rotary axes stood still for good: turned by a correction, they would take the tip
along.

An axis whose angles a control may count from 0 to 360 degrees stays within them where the program does: on such a
control -0.001 is 359.999, and leads it round, or is an alarm, and the sign of a word may even be the sense of the turn.
Source: Siemens, "SINUMERIK 840D sl, axes and spindles", R2, MD30455; Fanuc 30i parameter manual, No. 1008.
"""

from __future__ import annotations

import math

import numpy as np

from ncfix.compensate.plan.arrays import Array, Index, Mask
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.kinematics import Correction, steer
from ncfix.compensate.plan.strategies import Strategy

FULL = 2 * math.pi
NO_ANGLE = 1e-9
"""rad"""


def with_rotary_held(
    intent: Intent, strategy: Strategy, move: Index, fraction: Array, q: Array, correction: Correction
) -> Correction:
    """The `correction` of poses q (k, n_axes) of motions `move`, but for rotary axes that are held."""
    if not strategy.corrects_orientation:
        return correction
    there = on_their_side(intent, move, q, np.where(held_axes(intent, move), q, correction.q))
    rows = np.flatnonzero((there != correction.q)[:, intent.machine.rotary].any(axis=1))
    if not rows.size:
        return correction
    target = intent.machine.tip(q[rows], intent.lengths(move[rows]))
    corrected, converged, oriented = correction.q.copy(), correction.converged.copy(), correction.oriented.copy()
    corrected[rows], arrived = steer(intent.machine, there[rows], target, intent.states(move[rows], fraction[rows]))
    converged[rows] &= arrived
    oriented[rows] = False
    return Correction(corrected, converged, oriented)


def on_their_side(intent: Intent, move: Index, q: Array, corrected: Array) -> Array:
    """Corrected positions (k, n_axes); not below zero or past a full turn where the program never is.

    Directions that are given as vectors lead the axes as the control thinks best.
    """
    moves = intent.moves
    if moves.angles is None or moves.pointing is not None:
        return corrected
    least, most = moves.angles.T
    zero = np.array([frame.offset for frame in moves.frames])[moves.frame[move]]
    low = np.where(least >= -NO_ANGLE, zero, -np.inf)
    high = np.where(most < FULL - NO_ANGLE, zero + FULL - intent.machine.least_increment[1], np.inf)
    return np.asarray(np.clip(corrected, np.minimum(low, q), np.maximum(high, q)))


def held_axes(intent: Intent, move: Index) -> Mask:
    """(k, n_axes) rotary axes that motions must not turn but as programmed."""
    held = np.zeros((len(move), len(intent.machine.axes)), dtype=bool)
    if intent.moves.held is not None:
        held |= intent.moves.held[move][:, None] & intent.machine.rotary
    if intent.wordless is not None:
        held |= intent.wordless[move] & intent.machine.rotary
    return held
