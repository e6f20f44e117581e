"""What a real machine does with a program: where its tool tip is along the whole path, and where it should be.

Looked at are the motions that cut: feeds and arcs along their whole length, canned cycles at their end. Rapids are left
out, because how a control moves between their ends is its own affair, and so are motions that are passed by rule.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.budget import DENSITY
from ncfix.compensate.findings import Array, Index
from ncfix.compensate.intent import Intent
from ncfix.compensate.ragged import owners
from ncfix.compensate.sampling import MOST_SHOWN, interior, merged
from ncfix.machine import Machine, State
from ncfix.program.moves import Kind, Moves

LEAST = 4
"""Fewest samples between the ends of a motion."""
BATCH = 200_000
"""Samples worked on at a time."""


@dataclass(frozen=True, slots=True)
class TipError:
    """The tool tip along a path, k samples in order.

    rows      (k,) the motion that is done there
    fraction  (k,) how far it is done
    intended  (k, 3) where the tip should be, workpiece frame, mm
    actual    (k, 3) where it is
    """

    rows: Index
    fraction: Array
    intended: Array
    actual: Array

    @property
    def size(self) -> Array:
        """The distance between the two, (k,) mm."""
        gap = self.actual - self.intended
        size: Array = np.sqrt(np.einsum("ij,ij->i", gap, gap))
        return size

    @property
    def weight(self) -> Array:
        """The length of intended path that each sample stands for, (k,) mm."""
        step = np.linalg.norm(np.diff(self.intended, axis=0), axis=1) * (np.diff(self.rows) == 0)
        weight: Array = (np.concatenate([[0.0], step]) + np.concatenate([step, [0.0]])) / 2
        return weight

    @property
    def max_mm(self) -> float:
        """The largest error."""
        return float(self.size.max(initial=0.0))

    @property
    def rms_mm(self) -> float:
        """The root mean square along the path; over the samples where the path has no length."""
        if not len(self.rows):
            return 0.0
        weight = self.weight
        return float(np.sqrt(np.average(self.size**2, weights=weight if weight.sum() > 0 else None)))

    def rows_beyond(self, limit_mm: float) -> Index:
        """The motions with errors larger than a limit."""
        found: Index = np.unique(self.rows[self.size > limit_mm])
        return found

    @property
    def worst_row(self) -> int | None:
        """The motion with the largest error; None without any."""
        return int(self.rows[np.argmax(self.size)]) if len(self.rows) else None


def tip_error(machine: Machine, moves: Moves, state: State = State()) -> TipError:  # noqa: B008
    """The error of a program as this machine runs it: against what a perfect one would do at the same instant.

    state  what else the errors depend on: `inputs`; tool lengths (which must be known) and directions are the motions'
    """
    intent = Intent(machine, moves, state)
    rows, fraction = samples(intent)
    tips = [_tips(intent, rows[part], fraction[part]) for part in batches(len(rows))]
    intended, actual = (np.concatenate([each[k] for each in tips]) if tips else np.empty((0, 3)) for k in (0, 1))
    return TipError(rows, fraction, intended, actual)


def samples(intent: Intent) -> tuple[Index, Array]:
    """Where to look: motions and fractions, ends included, as densely as the error model may bend."""
    moves = intent.moves
    known = np.isfinite(moves.end).all(axis=1) & moves.cuts
    hole = moves.kind == Kind.CYCLE
    along = np.flatnonzero(known & ~hole & np.isfinite(moves.start).all(axis=1))
    at_end = np.flatnonzero(known & hole)
    counts, between = interior(intent, intent.segments, along, DENSITY, LEAST, MOST_SHOWN)
    each, ends = np.arange(len(along)), np.ones(len(along))
    counts, fraction = merged(len(along), (owners(counts), between), (each, 0 * ends), (each, ends))
    rows = np.concatenate([along[owners(counts)], at_end])
    order = np.argsort(rows, kind="stable")
    return rows[order], np.concatenate([fraction, np.ones(len(at_end))])[order]


def unseen(moves: Moves) -> Index:
    """The motions that cut and cannot be looked at, since where they begin or end is not known."""
    ends, starts = (np.isfinite(places).all(axis=1) for places in (moves.end, moves.start))
    lost = np.where(moves.kind == Kind.CYCLE, ~ends, ~(ends & starts))
    return np.flatnonzero(moves.cuts & lost)


def batches(n: int) -> list[slice]:
    """Samples 0 to n in runs of at most `BATCH`."""
    return [slice(start, start + BATCH) for start in range(0, n, BATCH)]


def actual_tip(intent: Intent, rows: Index, fraction: Array) -> Array:
    """Where the tip of the real machine is at fractions of motions done as programmed, (k, 3) mm."""
    tip: Array = intent.machine.actual_tip(intent.joints_at(rows, fraction), intent.states(rows, fraction))
    return tip


def _tips(intent: Intent, rows: Index, fraction: Array) -> tuple[Array, Array]:
    return intent.tip(rows, fraction), actual_tip(intent, rows, fraction)
