"""Which motions may be written all at once, as far as their own data say."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.control.moves import FeedMode, MotionKind, Moves, Rule
from ncfix.control.turns import turns_alone
from ncfix.text.tree import Program
from ncfix.writer.bulk_arcs import whole_arcs
from ncfix.writer.bulk_layouts import NONE, Layouts
from ncfix.writer.pieces import Pieces

IntArray = NDArray[np.int64]
Mask = NDArray[np.bool_]


def qualified(program: Program, moves: Moves, pieces: Pieces, first_piece: IntArray, layouts: Layouts) -> Mask:
    """(n,) straight motions and arcs that may be written in bulk; `first_piece` (n + 1,) as in `Bulk`."""
    first = first_piece[:-1]
    fit: Mask = ((moves.kind == MotionKind.RAPID) & (moves.modal == 0)) | (
        (moves.kind == MotionKind.FEED) & (moves.modal == 10)
    )
    fit &= ~turns_alone(moves) & _writable_pieces(program, moves, pieces, first_piece, layouts)
    fit |= whole_arcs(program, moves, pieces, first, layouts)
    fit &= layouts.known[program.template[moves.block]] & sound(moves, pieces, first_piece)
    rising = moves.block[1:] > moves.block[:-1]
    if not rising.all():
        fit &= np.bincount(moves.block, minlength=len(program))[moves.block] == 1
        fit[1:] &= rising
    return fit


def sound(moves: Moves, pieces: Pieces, first_piece: IntArray) -> Mask:
    """(n,) motions that are corrected, from absolute words to where all is known."""
    first = first_piece[:-1]
    fit: Mask = (moves.rule == Rule.CORRECT) & ~moves.incremental & ~pieces.unchanged[first] & pieces.known[first]
    wordless = moves.wordless
    if wordless.any():  # such axes must stand where the program believes them to be
        fit &= ~(wordless & (pieces.end.take(first_piece[1:] - 1, axis=0) != moves.end)).any(axis=1)
    return fit


def with_dwells(
    fit: Mask, program: Program, moves: Moves, pieces: Pieces, first_piece: IntArray, layouts: Layouts
) -> Mask:
    """Motions `fit` (n,), and dwells just behind them at which the axes shall stand where these leave them.

    Nothing is written of such a dwell: its block is its own, and none of its numbers is the place of an axis (times and
    motions that go with a dwell may have these letters).
    """
    rows = np.flatnonzero(moves.kind[1:] == MotionKind.DWELL) + 1
    at, block = first_piece[rows], moves.block[rows]
    alone = (block != moves.block[rows - 1]) & (block != np.append(moves.block, -1)[rows + 1])
    wordless = (layouts.slots[program.template[block]] == NONE).all(axis=1)
    stays = pieces.unchanged[at] & (pieces.end[at] == pieces.end[at - 1]).all(axis=1)
    rows = rows[fit[rows - 1] & stays & alone & wordless]
    found = fit.copy()
    found[rows] = True
    return found


def _writable_pieces(program: Program, moves: Moves, pieces: Pieces, first_piece: IntArray, layouts: Layouts) -> Mask:
    """(n,) motions in one straight piece; in several, if nothing but words goes with them."""
    single: Mask = (np.diff(first_piece) == 1) & ~pieces.arc[first_piece[:-1]]
    several = np.flatnonzero(~single)
    if len(several):
        straight = np.add.reduceat(pieces.arc, first_piece[:-1], dtype=np.int64)[several] == 0
        timed = (moves.feed_mode[several] == FeedMode.INVERSE_TIME) & (moves.modal[several] != 0)
        finite = np.logical_and.reduceat(pieces.known, first_piece[:-1])[several]
        single[several] = straight & ~timed & finite & layouts.further[program.template[moves.block[several]]]
    return single
