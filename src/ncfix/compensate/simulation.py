"""What a real machine does with a program: where its tool tip is along the whole path, and where it should be.

Looked at are the motions that cut: feeds and arcs along their whole length, canned cycles at their end. Rapids are left
out, because how a control moves between their ends is its own affair, and so are motions that are passed by rule.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ncfix.compensate.budget import DENSITY
from ncfix.compensate.crew import Read
from ncfix.compensate.findings import Array, Index
from ncfix.compensate.intent import Intent
from ncfix.compensate.ragged import batches, owners
from ncfix.compensate.sampling import MOST_SHOWN, closely, even, merged, with_kinks
from ncfix.compensate.task import Task
from ncfix.compensate.units import Units
from ncfix.control.moves import Kind
from ncfix.diagnostics import Message
from ncfix.machine import State

LEAST = 4
"""Fewest samples between the ends of a motion."""
BATCH = 200_000
"""Samples worked on at a time."""

Tip = Callable[[Intent, Index, Array], Array]
"""Motions (k,) and how far they are done (k,) -> where the tip is, (k, 3) mm."""


@dataclass(frozen=True, slots=True)
class TipError:
    """The tool tip along a path, k samples in order.

    rows      (k,) the motion that is done there
    lines     (k,) the line in which it is
    fraction  (k,) how far it is done
    intended  (k, 3) where the tip should be, workpiece frame, mm
    actual    (k, 3) where it is
    """

    rows: Index
    lines: Index
    fraction: Array
    intended: Array
    actual: Array

    @classmethod
    def none(cls) -> TipError:
        """Of a path without a sample."""
        rows, places = np.zeros(0, dtype=np.intp), np.zeros((0, 3))
        return cls(rows, rows, np.zeros(0), places, places)

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


def tip_errors(intent: Intent, lines: Index, first: int = 0, made: Tip | None = None) -> Iterator[TipError]:
    """The error of a program as this machine runs it: against what a perfect one would do at the same instant.

    Of motions from row `first` on, in lines (n,), some at a time; tool lengths must be known. `made` gives the actual
    tip, if it is not that of the machine alone.
    """
    made = made or actual_tip
    for rows, fraction in samples(intent, first):
        yield TipError(rows, lines[rows], fraction, intent.tip(rows, fraction), made(intent, rows, fraction))


def tip_errors_on(task: Task, read: Read, said: list[Message]) -> Iterator[TipError]:
    """As `tip_errors`, of the text that is read; raises what following does, and `NotInPartsError`.

    said  gets what there is to say of following it, at the end
    """
    units = Units.of(task, read)
    for unit in units:
        if units.sided:
            intent, lines = unit.intent, unit.together.lines
            yield from tip_errors(intent, lines, int(unit.head is not None))
        else:
            yield from tip_errors(Intent(units.placed, unit.part.moves, State()), unit.part.lines)
    units.blocks_behind()
    said += units.messages


def samples(intent: Intent, first: int = 0) -> Iterator[tuple[Index, Array]]:
    """Where to look: motions and fractions, ends included, as densely as the error model may bend; some at a time."""
    moves = intent.moves
    known = np.isfinite(moves.end).all(axis=1) & moves.cuts
    known[:first] = False
    hole = moves.kind == Kind.CYCLE
    rows = np.flatnonzero(known & (hole | np.isfinite(moves.start).all(axis=1)))
    counts, along = np.zeros(len(rows), dtype=np.intp), np.flatnonzero(~hole[rows])
    counts[along] = closely(intent, rows[along], DENSITY, LEAST, MOST_SHOWN)
    for some in batches(counts + 2, BATCH):
        yield _samples(intent, rows[some], counts[some])


def _samples(intent: Intent, rows: Index, counts: Index) -> tuple[Index, Array]:
    """Motions and fractions: of motions `rows` (k,) both ends, `counts` (k,) places between them, and kinks."""
    along = np.flatnonzero(intent.moves.kind[rows] != Kind.CYCLE)
    on, inside = rows[along], counts[along]
    inside, between = with_kinks(intent, intent.segments, on, inside, even(inside))
    begins, ends = (along, np.zeros(len(along))), (np.arange(len(rows)), np.ones(len(rows)))
    counts, fraction = merged(len(rows), (along[owners(inside)], between), begins, ends)
    return rows[owners(counts)], fraction


def actual_tip(intent: Intent, rows: Index, fraction: Array) -> Array:
    """Where the tip of the real machine is at fractions of motions done as programmed, (k, 3) mm."""
    tip: Array = intent.machine.actual_tip(intent.joints_at(rows, fraction), intent.states(rows, fraction))
    return tip
