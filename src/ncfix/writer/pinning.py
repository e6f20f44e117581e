"""Which motions have to be left as they were because one that follows is: an arc that keeps its words needs its start.

A refused line, increment or hole that starts a little elsewhere is the same path a little elsewhere, no farther from
what is meant than an uncorrected one. So is an arc whose end and centre both count from its start. But an arc with
an end or centre of its own no longer closes, so what is before it must end where it did, along the axes of its plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.control.moves import MotionKind, Moves, Rule

Mask = NDArray[np.bool_]

PINNED = "a refused arc that follows starts from its end"
LED = "a refused increment that follows would leave the travel"
STILL = 1e-9
"""A component of a unit normal so near to 1 is 1."""


@dataclass(frozen=True, slots=True)
class Refusals:
    """Motions that have to be left as they were.

    kept      (n,) all of them
    added     those that others need: row -> the row that needs it
    unmoored  something before the first motion would have to stay, too
    """

    kept: Mask
    added: dict[int, int]
    unmoored: bool


def closure_of_refusals(moves: Moves, kept: Mask, bound: Mask | None = None) -> Refusals:
    """Extend `kept` (n,) so that refused arcs begin where they began.

    bound  (n,) other motions that must begin where they began, along the axes that they name
    """
    walk = _Walk(moves, kept.copy(), np.zeros(len(moves), dtype=bool) if bound is None else bound)
    for row in np.flatnonzero(kept & walk.anchored)[::-1].tolist():
        walk.back_from(row)
    return Refusals(walk.kept, walk.added, walk.unmoored)


class _Walk:
    """Goes back from refused arcs to motions that name all axes in question."""

    def __init__(self, moves: Moves, kept: Mask, bound: Mask) -> None:
        self.moves = moves
        self.kept = kept
        self.bound = bound
        self.added: dict[int, int] = {}
        self.unmoored = False
        self.reached = len(moves)
        self.columns = [moves.axes.index(letter) if letter in moves.axes else -1 for letter in "XYZ"]
        self.passed = moves.rule == Rule.PASS
        self.said = moves.programmed & ~moves.increments
        arcs = np.flatnonzero(moves.kind == MotionKind.ARC)
        self.anchored = bound & ~self.passed
        self.anchored[arcs] |= ~self._floating(arcs) & ~self.passed[arcs]

    def _floating(self, arcs: NDArray[np.intp]) -> Mask:
        """Which arcs (k,) have both end and centre that count from where they start, full circles among them."""
        moves = self.moves
        named = [self.said[arcs, column] for column in self.columns if column >= 0]
        in_plane = np.abs(moves.normal[arcs]) < 1 - STILL
        own = np.stack(named, axis=1) & in_plane[:, [k for k, column in enumerate(self.columns) if column >= 0]]
        return np.asarray(~moves.about_fixed_point[arcs] & ~own.any(axis=1))

    def back_from(self, arc: int) -> None:
        """Keep the motions before an arc until every axis of its plane has been named by one.

        The cause that is noted for a motion is the next arc behind it.
        """
        if arc >= self.reached:
            return
        self.reached, needed, cause = arc, self._plane(arc), arc
        while needed.any() and self.reached > 0:
            self.reached -= 1
            row = self.reached
            if self.moves.tcp[row] != self.moves.tcp[row + 1]:
                needed[:] = True
            if not self.passed[row] and not self.kept[row]:
                self.kept[row] = True
                self.added[row] = cause
            needed &= ~self._decided(row)
            if self.anchored[row]:
                needed |= self._plane(row)
                cause = row
        self.unmoored |= bool(needed.any())

    def _plane(self, row: int) -> Mask:
        """The axes of an arc's plane; of other motions those that they name."""
        if self.bound[row]:
            return np.asarray(self.moves.programmed[row].copy())
        axes = np.zeros(len(self.moves.axes), dtype=bool)
        for column, across in zip(self.columns, np.abs(self.moves.normal[row]).tolist(), strict=True):
            if column >= 0 and across < 1 - STILL:
                axes[column] = True
        return axes

    def _decided(self, row: int) -> Mask:
        """The axes that stand behind a motion where it says, wherever it began."""
        moves = self.moves
        if self.passed[row]:
            return np.asarray(moves.moved[row])
        decided = self.said[row] & (moves.end[row] == moves.start[row + 1])
        turned = [
            column
            for column, own in zip(self.columns, moves.frames[moves.frame[row]].rotation, strict=True)
            if column >= 0 and np.abs(own).max() < 1 - STILL
        ]
        if turned and not decided[turned].all():
            decided[turned] = False
        return np.asarray(decided)
