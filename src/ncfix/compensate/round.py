"""Arcs made of arcs: pieces of a circle that bends, each from one exactly corrected point to another.

A corrected arc need not be an arc: scales that differ make an ellipse of it, play a step where an axis reverses. Short
arcs follow it with far fewer blocks than straight pieces, and as smoothly. The centre of a piece lies on the
perpendicular bisector of its ends, so that the radii agree; where along the bisector is found by least squares over
the nodes between. Pieces too short for a control to tell their centre are straight, and so are those that bend the
other way than the arc turns: a control would go the long way round.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ncfix.compensate.arcs import APART, NUDGE, Closure, across
from ncfix.compensate.plan.arrays import Array, Index, Mask, largest, owners, places, sums
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.segments import Segments, sweep_between
from ncfix.compensate.split import Grid
from ncfix.writer.target import TANGENTIAL

WIDEST = 0.95 * np.pi
"""A piece turns by less than this: ends on opposite sides of a circle would not tell where its centre is."""
SHORTEST = 0.05
"""mm between the ends of the shortest arc that is written."""

JUMP = 2.0
"""Times the way along the arc: a piece that is longer only takes up a jump (play, a step), which is no circle."""


OTHER_CODES = 1000
"""Motion codes in tenths from here on are no G codes."""


def may_be_round(intent: Intent, rows: Index, closure: Closure, rounding: float) -> Mask:
    """Motions `rows` (k,) that may be made of arcs: radii off by rounding are within half of what the control takes.

    Arcs that are not given by a centre or radius (CIP, whose code is none of G0 to G99) stay whole or become straight,
    unless they are written as others.
    """
    moves, radius = intent.moves, radii(intent, rows)
    allowed = np.maximum(closure.mm, closure.relative * radius) / 2
    enough: Mask = intent.segments.arc[rows] & (radius > SHORTEST) & (4 * rounding <= allowed)
    enough &= (moves.modal[rows] < OTHER_CODES) | np.isin(moves.modal[rows], list(TANGENTIAL))
    return enough if APART * rounding < SHORTEST else np.zeros(len(rows), dtype=bool)


def radii(intent: Intent, rows: Index) -> Array:
    """The radius of each arc (k,), mm."""
    moves = intent.moves
    spoke = moves.end[rows[:, None], intent.columns] - moves.centre[rows]
    radius: Array = np.linalg.norm(across(spoke, moves.normal[rows]), axis=1)
    return radius


@dataclass(frozen=True, slots=True)
class RoundGrid:
    """Nodes of arcs, as `Grid` has them, between which pieces are arcs.

    normal   (k, 3) of each node's motion
    sweep    (k,) of each node's motion, rad
    radius   (k,) of each node's motion, mm
    columns  (3,) of X, Y and Z
    """

    grid: Grid
    normal: Array
    sweep: Array
    radius: Array
    columns: Index

    @classmethod
    def of(cls, grid: Grid, intent: Intent, rows: Index) -> RoundGrid:
        """Nodes of motions `rows`, which are arcs."""
        move, moves = rows[owners(grid.counts)], intent.moves
        return cls(grid, moves.normal[move], moves.sweep[move], radii(intent, move), intent.columns)

    @property
    def counts(self) -> Index:
        """Nodes of each motion."""
        return self.grid.counts

    def deviations(self, first: Index, last: Index) -> Array:
        """The largest deviation of pieces from nodes `first` to nodes `last`, (p,) mm; infinite for too wide a turn."""
        inner = last - first - 1
        arcs, share = self._between(first, last)
        off = self._off(arcs, first + 1, inner, share)
        straight = np.sqrt(np.einsum("ki,ki->k", off, off))
        worst = largest(straight, inner)
        wide = np.abs(self._turn(first, last)) > WIDEST
        return np.where(wide & (inner > 0), np.inf, worst)

    def shape(self, first: Index, last: Index) -> tuple[Mask, Array]:
        """Which pieces are arcs (p,), and their centres (p, 3)."""
        arcs, _ = self._between(first, last)
        return arcs.arc, arcs.centre

    def _turn(self, first: Index, last: Index) -> Array:
        turn: Array = self.sweep[first] * (self.grid.fraction[last] - self.grid.fraction[first])
        return turn

    def _between(self, first: Index, last: Index) -> tuple[Segments, Array]:
        """The pieces, and the shares (flat) of each at which its inner nodes are."""
        command, fraction = self.grid.command, self.grid.fraction
        inner = last - first - 1
        piece = owners(inner)
        node = first[piece] + 1 + places(inner)
        share = (fraction[node] - fraction[first[piece]]) / (fraction[last[piece]] - fraction[first[piece]])
        start, end, normal = command[first], command[last], self.normal[first]
        turn = self._turn(first, last)
        ends = start[:, self.columns], end[:, self.columns]
        chord = across(ends[1] - ends[0], normal)
        length = np.linalg.norm(chord, axis=1)
        arc = (length >= SHORTEST) & (np.abs(turn) <= WIDEST) & (length < JUMP * self.radius[first] * np.abs(turn))
        way = np.cross(normal, chord) / np.maximum(length, 1e-300)[:, None]
        height = length / 2 / np.tan(np.where(arc, turn, 1.0) / 2)
        pieces = _on_bisector(Segments(start, end, arc, ends[0], normal, turn, self.columns), way, height)
        here = pieces.at(piece, share)
        nudged = _on_bisector(pieces, way, height + NUDGE).at(piece, share)
        slope = (nudged - here)[:, self.columns] / NUDGE
        squares = sums(np.einsum("ki,ki->k", slope, slope), inner)
        miss = (command[node] - here)[:, self.columns]
        amount = sums(np.einsum("ki,ki->k", slope, miss), inner) / np.maximum(squares, 1e-12)
        best = _on_bisector(pieces, way, height + np.where(squares > 0, amount, 0.0))
        same = best.sweep * turn > 0
        return replace(best, arc=best.arc & same, centre=np.where(same[:, None], best.centre, np.nan)), share

    def _off(self, pieces: Segments, first: Index, inner: Index, share: Array) -> Array:
        piece = owners(inner)
        node = first[piece] + places(inner)
        command = pieces.at(piece, share) - self.grid.command[node]
        follow = self.grid.follow
        off: Array = np.einsum("kij,kj->ki", follow[node] if len(follow) > 1 else follow, command)
        return off


def _on_bisector(pieces: Segments, way: Array, height: Array) -> Segments:
    """Pieces with the centre so far (p,) mm from the middle of the chord along `way` (p, 3), unit vectors."""
    start, end = pieces.start[:, pieces.columns], pieces.end[:, pieces.columns]
    rise = np.einsum("ij,ij->i", end - start, pieces.normal)[:, None] * pieces.normal
    centre = (start + end - rise) / 2 + height[:, None] * way
    sweep = sweep_between(start, end, centre, pieces.normal, pieces.sweep)
    return Segments(
        pieces.start,
        pieces.end,
        pieces.arc,
        np.where(pieces.arc[:, None], centre, np.nan),
        pieces.normal,
        sweep,
        pieces.columns,
    )
