"""Putting two programs side by side: which motions of the corrected program are pieces of which original motion.

Motions only ever become several, in place. A motion of the corrected program ends an original one if the real machine
then has its tip where the original wants it, or if both have the same command; it is a piece of it if the tip is on
its path. What neither is, but is close, is taken for a motion that was left as it was.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.intent import Intent
from ncfix.diagnostics import Message, RefusedError
from ncfix.machine import Machine, State
from ncfix.program.moves import Kind, Moves, Rule
from ncfix.program.pieces import Pieces

WITHIN = 0.004
"""mm: tolerance and rounding of a correction together are less."""
SAME = 1e-7
"""mm and rad: a command that was not changed, after reading it again."""
TURNING = 1e-3
"""mm per rad: enough to tell where a motion is that turns about the tip, too little to matter elsewhere."""
LOOKS = 64
THIRDS = 50
WINDOW = 64
MOST_PIECES = 1 << 15


@dataclass(frozen=True, slots=True)
class Aligned:
    """The corrected program as pieces of the original's motions.

    pieces  ends as read from the corrected program; motions left as they were are `kept`
    start   (n, n_axes) where each original motion starts in the corrected program
    rows    (m,) the motion of the corrected program that each piece is
    """

    pieces: Pieces
    start: Array
    rows: Index


class MisfitError(RefusedError):
    """The programs do not belong together; `row` is the original motion that is not found."""

    row: int = -1


def align(
    machine: Machine,
    original: Moves,
    fixed: Moves,
    state: State = State(),  # noqa: B008
    within: float = WITHIN,
) -> Aligned:
    """Find the pieces of each original motion in the corrected program.

    within  how far a corrected end may be from where it should be, mm

    Raises `MisfitError` NCF420 if a motion of the original is not found where it should be, or motions are left over.
    """
    sides = _Sides(Intent(machine, original, state), Intent(machine, fixed, state), within)
    ends = sides.ends()
    counts = np.diff(ends, prepend=-1)
    owner = np.repeat(sides.first_rows, counts)
    rows = sides.second_rows[: len(owner)]
    fraction = sides.fractions(owner, rows, np.repeat(ends, counts) == np.arange(len(owner)))
    move_kept = sides.left_alone(sides.first_rows, sides.second_rows[ends])
    pieces = Pieces(
        owner,
        fraction,
        fixed.end[rows],
        fixed.kind[rows] == Kind.ARC,
        fixed.centre[rows],
        np.repeat(move_kept, counts),
    )
    start = original.start.copy()
    start[sides.first_rows] = fixed.start[sides.second_rows[ends - counts + 1]]
    return Aligned(pieces, start, rows)


@dataclass(frozen=True)
class _Sides:
    """Both programs, and where their motions end."""

    first: Intent
    second: Intent
    within: float

    @cached_property
    def first_rows(self) -> Index:
        """The motions of the original that move."""
        return np.flatnonzero(self.first.moves.kind != Kind.DWELL)

    @cached_property
    def second_rows(self) -> Index:
        """The motions of the corrected program that move."""
        return np.flatnonzero(self.second.moves.kind != Kind.DWELL)

    @cached_property
    def wanted(self) -> Array:
        """Where the original wants the tip at the end of each motion, (n, 3) mm."""
        rows = np.arange(len(self.first.moves))
        return self.first.tip(rows, np.ones(len(rows)))

    @cached_property
    def reached(self) -> Array:
        """Where the real machine has its tip at the end of each motion of the corrected program, (n, 3) mm."""
        rows = np.arange(len(self.second.moves))
        ones = np.ones(len(rows))
        tip: Array = self.second.machine.actual_tip(self.second.joints_at(rows, ones), self.second.states(rows, ones))
        return tip

    # -- comparing motions (k,) of the original with motions (k,) of the corrected program ----------------------------

    def same(self, rows: Index, others: Index) -> Mask:
        """Both have the same command."""
        first, second = self.first.moves.end[rows], self.second.moves.end[others]
        return _all_axes((np.abs(first - second) <= SAME) | (np.isnan(first) & np.isnan(second)))

    def arrives(self, rows: Index, others: Index) -> Mask:
        """The corrected motion ends where the original wants to be."""
        near: Mask = np.linalg.norm(self.reached[others] - self.wanted[rows], axis=1) <= self.within
        near &= self._turned_alike(rows, others)
        return near | self.same(rows, others)

    def close(self, rows: Index, others: Index) -> Mask:
        """Commands differ by no more than a correction."""
        machine = self.first.machine
        limit = np.where(machine.rotary, machine.max_correction[1], machine.max_correction[0]) + SAME
        first, second = self.first.moves.end[rows], self.second.moves.end[others]
        return _all_axes((np.abs(first - second) <= limit) | (np.isnan(first) & np.isnan(second)))

    def left_alone(self, rows: Index, others: Index) -> Mask:
        """The original must not be corrected, or was not."""
        ruled: Mask = self.first.moves.rule[rows] != Rule.CORRECT
        return ruled | ~(self.arrives(rows, others) & ~self.same(rows, others))

    def ends_it(self, rows: Index, others: Index) -> Mask:
        """The corrected motion is the last or only piece of the original."""
        done = self.arrives(rows, others)
        rest = np.flatnonzero(~done & self.close(rows, others))
        if rest.size:
            ruled = self.first.moves.rule[rows[rest]] != Rule.CORRECT
            done[rest] = ruled | (self.nearest(rows[rest], others[rest])[1] > self.within)
        return done

    def _turned_alike(self, rows: Index, others: Index) -> Mask:
        machine = self.first.machine
        turn = self.first.moves.end[rows] - self.second.moves.end[others]
        return _all_axes(np.abs(turn[:, machine.rotary]) <= machine.max_correction[1] + SAME)

    # -- the walk -----------------------------------------------------------------------------------------------------

    def ends(self) -> Index:
        """The place (in `second_rows`) of the last piece of each original motion (of `first_rows`)."""
        n, m = len(self.first_rows), len(self.second_rows)
        ends = np.zeros(n, dtype=np.intp)
        i = k = 0
        while i < n:
            fit = self._fitting(i, k)
            ends[i : i + fit] = k + np.arange(fit)
            i, k = i + fit, k + fit
            if i < n:
                ends[i] = k + self._pieces(i, k) - 1
                i, k = i + 1, int(ends[i]) + 1
        if k != m:
            raise self._misfit(int(self.first_rows[-1]) if n else 0, f"{m - k} motions are left over")
        return ends

    def _fitting(self, i: int, k: int) -> int:
        """How many motions in a row are one to one from places i and k on."""
        total, step = 0, WINDOW
        while True:
            length = min(step, len(self.first_rows) - i - total, len(self.second_rows) - k - total)
            if length <= 0:
                return total
            rows = self.first_rows[i + total : i + total + length]
            others = self.second_rows[k + total : k + total + length]
            wrong = np.flatnonzero(~self.ends_it(rows, others))
            if wrong.size:
                return total + int(wrong[0])
            total, step = total + length, 2 * step

    def _pieces(self, i: int, k: int) -> int:
        """How many motions of the corrected program from place k on are pieces of original motion i."""
        row, width = self.first_rows[i], WINDOW
        while width <= MOST_PIECES:
            others = self.second_rows[k : k + width]
            rows = np.full(len(others), row)
            arrived = np.flatnonzero(self.arrives(rows, others))
            if arrived.size:
                count = int(arrived[0]) + 1
                off = self.nearest(rows[: count - 1], others[: count - 1])[1]
                if not (off > self.within).any():
                    return count
                break
            if k + width >= len(self.second_rows):
                break
            width *= 4
        here = self.second_rows[k : k + 1]
        if len(here) and self.close(np.array([row]), here)[0]:
            return 1
        raise self._misfit(int(row), "the second program does not come to where this motion ends")

    def _misfit(self, row: int, text: str) -> MisfitError:
        error = MisfitError((Message("NCF420", f"the programs do not belong together: {text}"),))
        error.row = row
        return error

    # -- places on motions --------------------------------------------------------------------------------------------

    def nearest(self, rows: Index, others: Index) -> tuple[Array, Array]:
        """Where on original motions `rows` (k,) the ends of corrected motions `others` are: fraction and distance."""
        if not len(rows):
            return np.zeros(0), np.zeros(0)
        looks = np.arange(LOOKS + 1) / LOOKS
        each = np.repeat(np.arange(len(rows)), LOOKS + 1)
        size = self._distance(rows[each], np.tile(looks, len(rows)), others[each]).reshape(len(rows), -1)
        place = np.where(np.isnan(size), np.inf, size).argmin(axis=1)
        low, high = looks[np.maximum(place - 1, 0)], looks[np.minimum(place + 1, LOOKS)]
        for _ in range(THIRDS):
            first, second = low + (high - low) / 3, high - (high - low) / 3
            falling = self._distance(rows, first, others) > self._distance(rows, second, others)
            low, high = np.where(falling, first, low), np.where(falling, high, second)
        fraction = (low + high) / 2
        return fraction, self._distance(rows, fraction, others)

    def _distance(self, rows: Index, fraction: Array, others: Index) -> Array:
        """How far the tip of a corrected motion's end is from places on original motions, mm."""
        commands = self.first.segments.at(rows, fraction)
        turn = (commands - self.second.moves.end[others])[:, self.first.machine.rotary]
        tip = self.first.machine.tip(self.first.joints(rows, commands), self.first.lengths(rows))
        off = tip - self.reached[others]
        distance: Array = np.sqrt((off**2).sum(axis=1) + TURNING**2 * (turn**2).sum(axis=1))
        return distance

    def fractions(self, owner: Index, rows: Index, last: Mask) -> Array:
        """The fraction of the original at which each piece ends, (m,): 1 for the last, never descending."""
        fraction = np.ones(len(owner))
        inner = np.flatnonzero(~last)
        fraction[inner] = self.nearest(owner[inner], rows[inner])[0]
        starts = np.flatnonzero(np.diff(owner, prepend=-1))
        ramp = np.repeat(np.arange(len(starts)) * 2.0, np.diff([*starts, len(owner)]))
        return np.maximum.accumulate(fraction + ramp) - ramp


def _all_axes(fits: Mask) -> Mask:
    """Whether all axes fit, (k, n_axes) -> (k,)."""
    return np.asarray(fits.all(axis=1))
