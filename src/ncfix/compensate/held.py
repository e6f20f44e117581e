"""Rotary axes that must stay as programmed, though the strategy would correct them.

One that must get no word stays where it stands. And in a plane that was swivelled without tool-centre-point control the
control moves linear axes as if the rotary axes stood still for good: turned by a correction, they would take the tip
along.
"""

from __future__ import annotations

import numpy as np

from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.intent import Intent
from ncfix.compensate.steer import Correction, steer
from ncfix.compensate.strategies import Strategy


def with_rotary_held(
    intent: Intent, strategy: Strategy, move: Index, fraction: Array, q: Array, found: Correction
) -> Correction:
    """The corrections `found` for poses q (k, n_axes) of motions `move`, but for rotary axes that are held."""
    if not strategy.corrects_orientation:
        return found
    held = held_axes(intent, move)
    rows = np.flatnonzero((held & (found.q != q)).any(axis=1))
    if not rows.size:
        return found
    target = intent.machine.tip(q[rows], intent.lengths(move[rows]))
    there = np.where(held[rows], q[rows], found.q[rows])
    corrected, converged, oriented = found.q.copy(), found.converged.copy(), found.oriented.copy()
    corrected[rows], arrived = steer(intent.machine, there, target, intent.states(move[rows], fraction[rows]))
    converged[rows] &= arrived
    oriented[rows] = False
    return Correction(corrected, converged, oriented)


def held_axes(intent: Intent, move: Index) -> Mask:
    """(k, n_axes) rotary axes that motions must not turn but as programmed."""
    held = np.zeros((len(move), len(intent.machine.axes)), dtype=bool)
    if intent.moves.held is not None:
        held |= intent.moves.held[move][:, None] & intent.machine.rotary
    if intent.wordless is not None:
        held |= intent.wordless[move] & intent.machine.rotary
    return held
