"""Corrected rotary positions on the control's digits, and X Y Z to go with them.

A rotary axis resolves 0.001 degree, say: 1.7 um at 100 mm. Rounding its word after the correction would throw the tip
off by as much. So corrected rotary positions are put on the digits that will be written, and X Y Z are solved again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ncfix.compensate.plan.arrays import Array, Index, picked, some
from ncfix.compensate.plan.intent import Intent
from ncfix.control.moves import Moves
from ncfix.machine import Machine
from ncfix.text.number_style import decimals_for
from ncfix.writer.pieces import Pieces


def on_digits(intent: Intent, pieces: Pieces, among: Index | None = None) -> Pieces:
    """The pieces with rotary positions as they will be written; those that the program wrote stay as they are.

    among  (k,) pieces that may have others; all if not given
    """
    machine, moves = intent.machine, intent.moves
    rows = _newly_written(moves, pieces, np.arange(len(pieces)) if among is None else among)
    if not rows.size:
        return pieces
    move = pieces.move[rows]
    commands = picked(pieces.end, rows)
    offset = np.array([frame.offset for frame in moves.frames])[moves.frame[move]][:, moves.rotary]
    commands[:, moves.rotary] = offset + _rounded(commands[:, moves.rotary] - offset, machine)
    solved, arrived = intent.aimed(move, pieces.fraction[rows], commands)
    end = pieces.end.copy()
    solved = np.where(moves.wordless[move], end[rows], solved)
    end[rows[arrived]] = solved[arrived]
    return replace(pieces, end=end)


def _newly_written(moves: Moves, pieces: Pieces, among: Index) -> Index:
    """Straight pieces with a rotary position that the program does not have as a number of its own."""
    turned = some((picked(pieces.end, among) != picked(moves.end, pieces.move[among]))[:, moves.rotary])
    rows: Index = among[turned & ~pieces.kept[among] & ~pieces.arc[among]]
    return rows


def _rounded(angle: Array, machine: Machine) -> Array:
    """Angles (rad) rounded to the decimals (of degrees) that the least increment needs."""
    decimals = decimals_for(float(np.degrees(machine.least_increment[1])))
    result: Array = np.radians(np.round(np.degrees(angle), decimals))
    return result
