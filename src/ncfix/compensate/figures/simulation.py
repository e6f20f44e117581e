"""What a real machine does with a program: where its tool tip is along the whole path, and where it should be.

Looked at are the motions that cut: feeds and arcs along their whole length, canned cycles at their end. Rapids are left
out, because how a control moves between their ends is its own affair, and so are motions that are passed by rule. The
machine may have a control that corrects by tables: then the tip is where it is with the tables active.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import field
from typing import Any

import numpy as np

from ncfix.arrays import Array, Index, Mask, batches, distinct, owners, slices
from ncfix.compensate import FixOptions
from ncfix.compensate.following import Followed, Task, numbers_of, suspected
from ncfix.compensate.parts import MachineParts
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.kinematics import commands_from_joints
from ncfix.compensate.plan.sampling import DENSITY, MOST_SHOWN, bends, closely, even, merged, with_kinks
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.compensate.workers import Read
from ncfix.control.moves import MotionKind, Moves, Rule
from ncfix.diagnostics import Message
from ncfix.machine import Machine, State
from ncfix.text.tree import Program
from ncfix.values import frozen, mutable


@mutable
class SimulatedErrors:
    """Errors along a path; of as many parts as there may be, the same.

    limit   mm; where the error is larger is noted; may become larger
    max     mm; NaN once one is not known
    where   the line of the largest
    beyond  lines with errors beyond the limit, and the largest there, by parts; some twice
    """

    limit: float = np.inf
    max: float = 0.0
    where: int | None = None
    squares: float = 0.0
    way: float = 0.0
    plain_squares: float = 0.0
    count: int = 0
    beyond: list[tuple[Index, Array]] = field(default_factory=list)

    def add(self, lines: Index, error: Array, weight: Array) -> None:
        """Add errors (k,) mm in lines (k,), with the way (k,) that each stands for."""
        if not len(error):
            return
        worst = int(np.argmax(error))
        if self.where is None or not (error[worst] <= self.max or np.isnan(self.max)):
            self.max, self.where = float(error[worst]), int(lines[worst])
        squares = error**2
        self.squares = _added(self.squares, squares * weight)
        self.way = _added(self.way, weight)
        self.plain_squares = _added(self.plain_squares, squares)
        self.count += len(error)
        if self.max > self.limit:
            over = np.flatnonzero(error > self.limit)
            first = np.flatnonzero(np.diff(lines[over], prepend=-1))
            if over.size:
                self.beyond.append((lines[over[first]], np.maximum.reduceat(error[over], first)))

    @classmethod
    def of(cls, errors: Iterable[TipError]) -> SimulatedErrors:
        """Of all samples of a path."""
        along = cls()
        deque(along.adding(errors), maxlen=0)
        return along

    def adding(self, errors: Iterable[TipError]) -> Iterator[TipError]:
        """Add samples as they are asked for."""
        for each in errors:
            self.add(each.lines, each.size, each.weight)
            yield each

    @property
    def rms(self) -> float:
        """The root mean square along the path, mm; over the places where the path has no length."""
        if not self.count:
            return 0.0
        return float(np.sqrt(self.squares / self.way if self.way else self.plain_squares / self.count))

    def figures(self) -> dict[str, Any]:
        """The error along the path in two figures, um, and the line of the worst; None where nothing was looked at."""
        if not self.count:
            return {"max": None, "rms": None, "where": None}
        return {"max": 1e3 * self.max, "rms": 1e3 * self.rms, "where": self.where}

    @property
    def lines_beyond(self) -> list[int]:
        """The lines with errors beyond the limit, in order."""
        return lines_of([lines[error > self.limit] for lines, error in self.beyond])


def lines_of(parts: list[Index]) -> list[int]:
    """The lines that occur in parts, each once, in order."""
    return distinct(np.concatenate([np.zeros(0, dtype=np.intp), *parts])).tolist()


def _added(total: float, values: Array) -> float:
    """A total and values (k,), added one by one: in whatever parts they come, the sum is the same to the last bit."""
    return float(np.add.accumulate(np.concatenate([[total], values]))[-1])


LEAST = 4
"""Fewest samples between the ends of a motion."""
BATCH = 200_000
"""Samples worked on at a time."""

Tip = Callable[[Intent, Index, Array], Array]
"""Motions (k,) and how far they are done (k,) -> where the tip is, (k, 3) mm."""


@frozen
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
        return np.sqrt(np.einsum("ij,ij->i", gap, gap))

    @property
    def weight(self) -> Array:
        """The length of intended path that each sample stands for, (k,) mm."""
        step = np.linalg.norm(np.diff(self.intended, axis=0), axis=1) * (np.diff(self.rows) == 0)
        return (np.concatenate([[0.0], step]) + np.concatenate([step, [0.0]])) / 2


def tip_errors(intent: Intent, lines: Index, first: int = 0, made: Tip | None = None) -> Iterator[TipError]:
    """The error of a program as this machine runs it: against what a perfect one would do at the same instant.

    Of motions from row `first` on, in lines (n,), some at a time; tool lengths must be known. `made` gives the actual
    tip, if it is not that of the machine alone.
    """
    made = made or actual_tip
    for rows, fraction in samples(intent, first):
        yield TipError(rows, lines[rows], fraction, intent.tip(rows, fraction), made(intent, rows, fraction))


def tip_errors_of(program: Program, followed: Followed, made: Tip | None = None) -> Iterator[TipError]:
    """As `tip_errors`, of a whole program that its machine has followed."""
    moves = followed.trace.moves
    return tip_errors(Intent(followed.machine, moves, State()), program.lines(moves.block), made=made)


def tip_errors_on(task: Task, read: Read, said: list[Message]) -> Iterator[TipError]:
    """As `tip_errors`, of the text that is read; raises what following does, and `NotInPartsError`.

    said  gets what there is to say of following it, at the end
    """
    parts = MachineParts.of(task, read)
    for continued in parts:
        if parts.sided:
            intent, lines = continued.intent, continued.joined.lines
            yield from tip_errors(intent, lines, int(continued.head is not None))
        else:
            yield from tip_errors(Intent(parts.set_up, continued.part.moves, State()), continued.part.lines)
    parts.check_behind()
    said += parts.messages


def samples(intent: Intent, first: int = 0) -> Iterator[tuple[Index, Array]]:
    """Where to look: motions and fractions, ends included, as densely as the error model may bend; some at a time."""
    moves = intent.moves
    known = np.isfinite(moves.end).all(axis=1) & moves.cutting
    known[:first] = False
    hole = moves.kind == MotionKind.CYCLE
    rows = np.flatnonzero(known & (hole | np.isfinite(moves.start).all(axis=1)))
    counts, along = np.zeros(len(rows), dtype=np.intp), np.flatnonzero(~hole[rows])
    counts[along] = closely(bends(intent, rows[along]), DENSITY, LEAST, MOST_SHOWN)
    for some in batches(counts + 2, BATCH):
        yield _samples(intent, rows[some], counts[some])


def _samples(intent: Intent, rows: Index, counts: Index) -> tuple[Index, Array]:
    """Motions and fractions: of motions `rows` (k,) both ends, `counts` (k,) places between them, and kinks."""
    along = np.flatnonzero(intent.moves.kind[rows] != MotionKind.CYCLE)
    on, inside = rows[along], counts[along]
    inside, between = with_kinks(intent, intent.segments, on, inside, even(inside))
    begins, ends = (along, np.zeros(len(along))), (np.arange(len(rows)), np.ones(len(rows)))
    counts, fraction = merged(len(rows), (along[owners(inside)], between), begins, ends)
    return rows[owners(counts)], fraction


def actual_tip(intent: Intent, rows: Index, fraction: Array) -> Array:
    """Where the tip of the real machine is at fractions of motions done as programmed, (k, 3) mm."""
    return intent.machine.actual_tip(intent.joints_at(rows, fraction), intent.states(rows, fraction))


Correct = Callable[[Array, Array, float], Array]
"""Positions of all axes (k, n_axes) [mm, rad], ways (k, n_axes), tool length [mm] -> what the control adds to them."""


def tip_with(correct: Correct) -> Tip:
    """Where the tip of the real machine is with tables active: see `simulation.actual_tip`, which is without them."""

    def tip(intent: Intent, rows: Index, fraction: Array) -> Array:
        q, states = intent.joints_at(rows, fraction), intent.states(rows, fraction)
        lengths = np.broadcast_to(np.asarray(states.tool_length, dtype=np.float64), (len(q),))
        ways = np.broadcast_to(np.asarray(states.direction, dtype=np.float64), q.shape)
        corrected = q.copy()
        for length in np.unique(lengths):
            some = lengths == length
            corrected[some] += correct(q[some], ways[some], float(length))
        return intent.machine.actual_tip(corrected, states)

    return tip


def refuse_corrected(machine: Machine, moves: Moves, path: str, hint: str) -> None:
    """Raise RefusedError NCF438 for a program that seems to have been corrected for this machine (see `suspected`)."""
    correctable: Mask = (moves.rule == Rule.CORRECT) & np.isfinite(moves.end).all(axis=1)
    shift = np.zeros_like(moves.end)
    intent = Intent(machine, moves, State())
    rows = np.flatnonzero(correctable)
    for part in slices(len(rows), BATCH):
        some = rows[part]
        ends = np.ones(len(some))
        corrected = get_strategy(FixOptions().strategy).correct(
            machine, intent.joints_at(some, ends), intent.states(some, ends)
        )
        commands = commands_from_joints(machine, corrected, moves.tcp[some], moves.length_under_tcp[some])
        shift[some] = commands - moves.end[some]
    step = machine.least_increment[0]
    suspected(numbers_of(moves, shift, correctable, step), step, path, False, hint)
