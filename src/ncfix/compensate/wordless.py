"""Axes that must get no word, because only the machine knows where they stand: what that leaves to be corrected.

Such an axis stays where it stands, and what its correction would do is left undone until the program names it. All
other corrections are those of the exact solution, so what is left at the tip lies along the axes without words, but
for the error times how it changes over so small a way. Deviations are taken without that part: no splitting, and no
other word, could take it away.
"""

from __future__ import annotations

import numpy as np

from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.intent import Intent
from ncfix.compensate.kinematics import solve
from ncfix.control.moves import Moves, Rule

SQUARE = 1 - 1e-9
"""An axis that makes no smaller a component of a unit normal is square to its plane."""


def stays(moves: Moves, kept: Mask, shift: Array, before: Array | None) -> Mask:
    """(n, n_axes) axes of corrected motions that stay where they stand, and would not without this rule.

    shift   (n, n_axes) wanted corrections
    before  (n_axes,) how far off the axes stand at the start of the first motion
    """
    moving = (shift != 0).any(axis=0)
    if before is not None:
        moving |= before != 0
    result: Mask = moves.wordless & ~kept[:, None] & moving
    return result


def left_in_cuts(moves: Moves) -> dict[str, Index]:
    """Axis letter -> motions that cut and may be corrected, but not along that linear axis."""
    lacking = moves.wordless & (moves.cuts & (moves.rule == Rule.CORRECT))[:, None]
    columns = np.flatnonzero(lacking.any(axis=0) & ~moves.rotary)
    return {moves.axes[column]: np.flatnonzero(lacking[:, column]) for column in columns}


def crooked(intent: Intent) -> Mask:
    """(n,) arcs along an axis that must get no word: their pieces would need some."""
    arcs = intent.segments.arc
    if intent.mute is None or not arcs.any():
        return np.zeros(len(arcs), dtype=bool)
    in_plane = np.abs(intent.moves.normal) < SQUARE
    result: Mask = arcs & (in_plane & intent.mute).any(axis=1)
    return result


def lacking(intent: Intent, rows: Index) -> Index:
    """Places (j,) in `rows` (k,) of motions of which X, Y or Z must get no word."""
    return np.flatnonzero(intent.mute[rows].any(axis=1)) if intent.mute is not None else np.zeros(0, dtype=np.intp)


def correctable(intent: Intent, rows: Index, commands: Array, gap: Array) -> Array:
    """What of a gap (k, 3) mm between tips words could take away, where motions `rows` (k,) have `commands`."""
    on = lacking(intent, rows)
    if not on.size:
        return gap
    assert intent.mute is not None
    follows = intent.follows(rows[on], commands[on])
    ways = solve(follows, gap[on])
    result = gap.copy()
    result[on] = np.einsum("kij,kj->ki", follows, np.where(intent.mute[rows[on]], 0.0, ways))
    return result
