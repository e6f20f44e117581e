"""Corrected motions as columns: new commands, one row per piece of a block; and how a control read an earlier attempt
to write them.

It also decides which motions must stay unchanged because a refused arc follows, which keeps its words and so needs its
original start. A refused line, increment or hole that starts slightly elsewhere is the same path slightly displaced, no
farther from the intended one than without correction; so is an arc whose end and centre both count from its start. But
an arc with an absolute end or centre would no longer close, so the motion before it must end at its original place,
along the axes of the arc's plane.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array, Index, Ints, Mask
from ncfix.control.moves import Frame, MotionKind, Moves, Rule
from ncfix.values import frozen


@frozen
class Pieces:
    """The corrected path as a struct of arrays; m rows in order, at least one per motion.

    A motion that is not split has one row; an unchanged motion has one row with its original end.

    move       (m,) index of the motion in `Moves`
    fraction   (m,) position of the piece's end on the original motion, in (0, 1]; 1 for the last piece of a motion
    end        (m, n_axes) the command at the end of the piece, mm and rad, before rounding to the control's digits
    arc        (m,) whether the piece is an arc (part of an arc that stays one), else straight
    centre     (m, 3) centre of an arc piece in command coordinates, mm, NaN elsewhere
    unchanged  (m,) the motion is not changed
    share      (m,) the piece's share of its motion's time, for inverse-time feed; None: in proportion to the fraction.
               It differs for pieces that take up a jump (play, a step): their fraction is almost zero, but not their
               length
    approach   (m, n_axes) of canned cycles: the command at level R, as `Moves.approach`; None: nowhere
    """

    move: Ints
    fraction: Array
    end: Array
    arc: Mask
    centre: Array
    unchanged: Mask
    share: Array | None = None
    approach: Array | None = None

    def __len__(self) -> int:
        return len(self.move)

    def rows(self, rows: Index) -> Pieces:
        """Some of the pieces."""
        columns: dict[str, Any] = {each.name: getattr(self, each.name) for each in fields(self)}
        return replace(self, **{name: column[rows] for name, column in columns.items() if column is not None})

    @property
    def first(self) -> Index:
        """(n,) the first piece of each motion."""
        return np.flatnonzero(np.diff(self.move, prepend=-1))

    @property
    def last(self) -> Index:
        """(n,) the last piece of each motion."""
        return np.flatnonzero(np.diff(self.move, append=self.move[-1:] + 1))

    @property
    def begun(self) -> Array:
        """(m,) position of each piece's beginning on its motion, as `fraction` for its end."""
        begun = np.append(0.0, self.fraction)[:-1]
        begun[self.first] = 0.0
        return begun

    @property
    def known(self) -> Mask:
        """(m,) whether the command at the end is known in all axes."""
        finite = np.isfinite(self.end)
        return np.ones(len(self), dtype=np.bool_) if finite.all() else np.asarray(finite.all(axis=1))


@frozen
class SecondReading:
    """How a control read an earlier attempt; one row per motion of the original.

    A program may set its frames from the machine's position (G92, G10 L20): then they move with the corrections.

    frame, frames  (n,) index into `frames`: the frame in which each motion is actually read
    start, end     (n, n_axes) actual start and end of unchanged motions; None before any attempt
    """

    frame: NDArray[np.int32]
    frames: tuple[Frame, ...]
    start: Array | None = None
    end: Array | None = None

    @classmethod
    def of(cls, moves: Moves, pieces: Pieces) -> SecondReading:
        """From the motions read from the text to which `pieces` were written (same rows)."""
        last = pieces.last
        return cls(moves.frame[last], moves.frames, moves.start[pieces.first], moves.end[last])


PINNED = "a refused arc after it starts from its end"
BEYOND_TRAVEL = "a refused increment after it would leave the travel"
UNIT_NORMAL_TOLERANCE = 1e-9
"""Distance from 1 within which a component of a unit normal counts as 1."""


@frozen
class Refusals:
    """Motions that must stay unchanged.

    unchanged  (n,) all of them
    added      those required by others: row -> the row that requires it
    reaches_back  whether a motion before the first one would have to stay, too
    """

    unchanged: Mask
    added: dict[int, int]
    reaches_back: bool


def closure_of_refusals(moves: Moves, unchanged: Mask, bound: Mask | None = None) -> Refusals:
    """Extend `unchanged` (n,) so that refused arcs begin at their original start.

    bound  (n,) other motions that must begin at their original start, along the axes that they name
    """
    walk = _Walk(moves, unchanged.copy(), np.zeros(len(moves), dtype=bool) if bound is None else bound)
    for row in np.flatnonzero(unchanged & walk.anchored)[::-1].tolist():
        walk.back_from(row)
    return Refusals(walk.unchanged, walk.added, walk.reaches_back)


class _Walk:
    """Steps back from refused arcs to motions that position all axes concerned."""

    def __init__(self, moves: Moves, unchanged: Mask, bound: Mask) -> None:
        self.moves = moves
        self.unchanged = unchanged
        self.bound = bound
        self.added: dict[int, int] = {}
        self.reaches_back = False
        self.reached = len(moves)
        self.columns = [moves.axes.index(letter) if letter in moves.axes else -1 for letter in "XYZ"]
        self.passed = moves.rule == Rule.PASS
        self.absolute = moves.programmed & ~moves.increments
        arcs = np.flatnonzero(moves.kind == MotionKind.ARC)
        self.anchored = bound & ~self.passed
        self.anchored[arcs] |= ~self._floating(arcs) & ~self.passed[arcs]

    def _floating(self, arcs: Index) -> Mask:
        """Which arcs (k,) have both end and centre relative to their start; full circles are among them."""
        moves = self.moves
        named = [self.absolute[arcs, column] for column in self.columns if column >= 0]
        in_plane = np.abs(moves.normal[arcs]) < 1 - UNIT_NORMAL_TOLERANCE
        own = np.stack(named, axis=1) & in_plane[:, [k for k, column in enumerate(self.columns) if column >= 0]]
        return np.asarray(~moves.about_fixed_point[arcs] & ~own.any(axis=1))

    def back_from(self, arc: int) -> None:
        """Keep the motions before an arc until each axis of its plane has been positioned by one of them.

        The cause recorded for a motion is the next such arc after it.
        """
        if arc >= self.reached:
            return
        self.reached, needed, cause = arc, self._plane(arc), arc
        while needed.any() and self.reached > 0:
            self.reached -= 1
            row = self.reached
            if self.moves.tcp[row] != self.moves.tcp[row + 1]:
                needed[:] = True
            if not self.passed[row] and not self.unchanged[row]:
                self.unchanged[row] = True
                self.added[row] = cause
            needed &= ~self._decided(row)
            if self.anchored[row]:
                needed |= self._plane(row)
                cause = row
        self.reaches_back |= bool(needed.any())

    def _plane(self, row: int) -> Mask:
        """The axes of an arc's plane; for other motions, the axes that they name."""
        if self.bound[row]:
            return np.asarray(self.moves.programmed[row].copy())
        axes = np.zeros(len(self.moves.axes), dtype=bool)
        for column, across in zip(self.columns, np.abs(self.moves.normal[row]).tolist(), strict=True):
            if column >= 0 and across < 1 - UNIT_NORMAL_TOLERANCE:
                axes[column] = True
        return axes

    def _decided(self, row: int) -> Mask:
        """The axes whose position after a motion does not depend on where it began."""
        moves = self.moves
        if self.passed[row]:
            return np.asarray(moves.moved[row])
        decided = self.absolute[row] & (moves.end[row] == moves.start[row + 1])
        turned = [
            column
            for column, own in zip(self.columns, moves.frames[moves.frame[row]].rotation, strict=True)
            if column >= 0 and np.abs(own).max() < 1 - UNIT_NORMAL_TOLERANCE
        ]
        if turned and not decided[turned].all():
            decided[turned] = False
        return np.asarray(decided)
