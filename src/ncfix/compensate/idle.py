"""Pieces that do not move once their numbers are rounded: they would be blocks without a word.

Where an error jumps, a motion is cut on both sides of the jump, 1e-7 of its length apart. What has to change there may
be less than the control's digits show; then both pieces end in the same place.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ncfix.compensate.plan.arrays import Array, Index, Mask
from ncfix.control.moves import Moves
from ncfix.writer.emit import Emission
from ncfix.writer.pieces import Pieces


def without_idle(moves: Moves, pieces: Pieces, emission: Emission, first: int = 0) -> Pieces:
    """The pieces without those that do not move as they were written; the same object if there are none.

    first  the motion from which on pieces were written
    """
    if len(pieces) == len(moves):
        return pieces
    drop = idle(pieces, emission, first)
    return _without(pieces, drop) if drop.any() else pieces


def idle(pieces: Pieces, emission: Emission, first: int = 0) -> Mask:
    """As `standing_still`, of what was written."""
    return standing_still(pieces, emission.end, emission.start, first)


def standing_still(pieces: Pieces, end: Array, start: Array, first: int = 0) -> Mask:
    """(m,) straight pieces that another one of their motion can stand for: it goes on from where they begin.

    end, start  (m, n_axes), (n, n_axes) commands at the ends of pieces and at the starts of motions, as written
    first       the motion from which on pieces were written
    """
    found = np.zeros(len(pieces), dtype=bool)
    goes_on = pieces.move[1:] == pieces.move[:-1]
    rows = np.flatnonzero(np.append(goes_on, False) | np.append(False, goes_on))
    if not rows.size:
        return found
    move, end = pieces.move[rows], end[rows]
    inner = move[1:] == move[:-1]
    plain = ~(pieces.arc[rows] | pieces.kept[rows]) & (move >= first)
    stays = np.zeros(len(rows), dtype=bool)
    stays[1:] = inner & (end[1:] == end[:-1]).all(axis=1)
    begins = np.flatnonzero(np.append(True, ~inner))
    stays[begins] = (end[begins] == start[move[begins]]).all(axis=1)
    last = np.append(~inner, True)
    before_last = np.append(last[1:] & stays[1:] & inner, False)
    found[rows] = plain & ((stays & ~last) | before_last)
    return found


def _without(pieces: Pieces, drop: Mask) -> Pieces:
    left = np.flatnonzero(~drop)
    columns = {name: getattr(pieces, name)[left] for name in ("move", "fraction", "end", "arc", "centre", "kept")}
    approach = None if pieces.approach is None else pieces.approach[left]
    return replace(pieces, **columns, share=_shares(pieces, left), approach=approach)


def _shares(pieces: Pieces, left: Index) -> Array | None:
    """The time of a piece that is dropped goes to the next one that is left, which is of the same motion."""
    if pieces.share is None:
        return None
    begins = np.append(0, left[:-1] + 1)
    result: Array = np.add.reduceat(pieces.share, begins)
    return result
