"""Corrected motions as geometry: each piece with where it starts, on which motion and over which part of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ncfix.compensate.plan.arrays import Array, Index, Mask, finite, picked, put
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.segments import Segments, sweep_between
from ncfix.writer.pieces import Pieces


@dataclass(frozen=True)
class Written:
    """Pieces on a program on a machine.

    start  (n, n_axes) the command at which each motion really starts; NaN where not known
    """

    intent: Intent
    pieces: Pieces
    start: Array

    @cached_property
    def opens(self) -> Mask:
        """Pieces with which a motion begins, (m,)."""
        opens = np.ones(len(self.pieces), dtype=bool)
        opens[1:] = np.diff(self.pieces.move) != 0
        return opens

    @cached_property
    def before(self) -> Array:
        """The fraction of the motion at which each piece starts, (m,)."""
        before = np.zeros(len(self.pieces))
        before[1:] = self.pieces.fraction[:-1]
        return np.where(self.opens, 0.0, before)

    @cached_property
    def span(self) -> Array:
        """The part of the motion that each piece covers, (m,)."""
        span: Array = self.pieces.fraction - self.before
        return span

    @cached_property
    def segments(self) -> Segments:
        """The pieces as the control interpolates them."""
        pieces, moves = self.pieces, self.intent.moves
        start = np.empty_like(pieces.end)
        start[1:] = pieces.end[:-1]
        opens = np.flatnonzero(self.opens)
        put(start, opens, picked(self.start, pieces.move[opens]))
        normal, sweep = picked(moves.normal, pieces.move), moves.sweep[pieces.move] * self.span
        arc = pieces.arc.copy()
        arc[arc] = finite(pieces.centre[arc])
        columns = self.intent.columns
        found = sweep.copy()
        found[arc] = sweep_between(
            start[arc][:, columns], pieces.end[arc][:, columns], pieces.centre[arc], normal[arc], sweep[arc]
        )
        return Segments(start, pieces.end, arc, pieces.centre, normal, found, columns)

    def fraction_of_motion(self, piece: Index, fraction: Array) -> Array:
        """Where on its motion a fraction of a piece is, (k,)."""
        result: Array = self.before[piece] + fraction * self.span[piece]
        return result

    def joints(self, piece: Index, fraction: Array) -> Array:
        """Axis positions at fractions of pieces, (k, n_axes)."""
        return self.intent.joints(self.pieces.move[piece], self.segments.at(piece, fraction))

    @cached_property
    def programmed(self) -> Array:
        """The axis positions of the program at the end of each piece, (m, n_axes) mm and rad."""
        return self.intent.joints_at(self.pieces.move, self.pieces.fraction)

    @cached_property
    def done(self) -> Array:
        """The axis positions at the end of each piece, (m, n_axes) mm and rad."""
        return self.intent.joints(self.pieces.move, self.pieces.end)

    @cached_property
    def correction(self) -> Array:
        """What is added to the axis positions of the program at the end of each piece, (m, n_axes) mm and rad."""
        added: Array = self.done - self.programmed
        return added
