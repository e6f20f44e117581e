"""Motions whose rotary axes must stay as programmed, though the strategy would correct them.

A rotary axis that must get no word stays where it stands.

And in a plane that was swivelled without tool-centre-point control the control moves linear axes as if the rotary axes
stood still for good: turned by a correction, they would take the tip along.
"""

from __future__ import annotations

import numpy as np

from ncfix.compensate.findings import Array, Index
from ncfix.compensate.intent import Intent
from ncfix.compensate.steer import Correction
from ncfix.compensate.strategies import Position, Strategy


def with_rotary_held(
    intent: Intent, strategy: Strategy, move: Index, fraction: Array, q: Array, found: Correction
) -> Correction:
    """The corrections `found` for poses q (k, n_axes) of motions `move`, of the tip only where rotary axes are held."""
    if not strategy.corrects_orientation:
        return found
    held = np.zeros(len(move), dtype=bool) if intent.moves.held is None else intent.moves.held[move]
    if intent.wordless is not None:
        held = held | intent.wordless[move][:, intent.machine.rotary].any(axis=1)
    if not held.any():
        return found
    rows = np.flatnonzero(held)
    states = intent.states(move[rows], fraction[rows])
    tip_only = Position().solve(intent.machine, q[rows], states)
    corrected, converged, oriented = found.q.copy(), found.converged.copy(), found.oriented.copy()
    corrected[rows], converged[rows], oriented[rows] = tip_only.q, tip_only.converged, tip_only.oriented
    return Correction(corrected, converged, oriented)
