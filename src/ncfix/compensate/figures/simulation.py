"""Simulation of a program on the real machine: actual and intended tool tip along the whole path.

Motions that cut are simulated: feeds and arcs along their whole length, canned cycles at their end. Rapids are left
out, because controls differ in how they move between their ends; so are motions that are passed by rule. The control
may correct by compensation tables; then the tip is that with the tables active.
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
    """Tip errors along a path. The result does not depend on how the path is divided into parts.

    limit   error, mm, above which lines are noted in `beyond`; it may be raised later
    max     largest error, mm; NaN once an error is not known
    where   line of the largest error
    squares, way          sum of squares times way, mm^3, and length of the path, mm
    plain_squares, count  sum of squares, mm^2, and number of samples
    beyond  for each part: lines with errors beyond the limit, and the largest error of each, mm; a line may recur
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
        """Add errors (k,), mm, in lines (k,), each with the way (k,), mm, for which it stands."""
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
        """The errors of all samples of a path."""
        along = cls()
        deque(along.adding(errors), maxlen=0)
        return along

    def adding(self, errors: Iterable[TipError]) -> Iterator[TipError]:
        """Pass the samples on, and add each."""
        for each in errors:
            self.add(each.lines, each.size, each.weight)
            yield each

    @property
    def rms(self) -> float:
        """The root mean square along the path, mm; over the samples if the path has no length."""
        if not self.count:
            return 0.0
        return float(np.sqrt(self.squares / self.way if self.way else self.plain_squares / self.count))

    def figures(self) -> dict[str, Any]:
        """The figures "max" and "rms", um, and the line "where" the error is largest; None without samples."""
        if not self.count:
            return {"max": None, "rms": None, "where": None}
        return {"max": 1e3 * self.max, "rms": 1e3 * self.rms, "where": self.where}

    @property
    def lines_beyond(self) -> list[int]:
        """The lines with errors beyond the limit, in order."""
        return lines_of([lines[error > self.limit] for lines, error in self.beyond])


def lines_of(parts: list[Index]) -> list[int]:
    """The lines that occur in any of the parts, once each, in order."""
    return distinct(np.concatenate([np.zeros(0, dtype=np.intp), *parts])).tolist()


def _added(total: float, values: Array) -> float:
    """A total plus values (k,), added one by one, so that the sum is the same to the last bit for any division."""
    return float(np.add.accumulate(np.concatenate([[total], values]))[-1])


LEAST = 4
"""Least number of samples between the ends of a motion."""
BATCH = 200_000
"""Number of samples worked on at a time."""

Tip = Callable[[Intent, Index, Array], Array]
"""(program, (k,) motions, (k,) fractions) -> (k, 3) tip, mm."""


@frozen
class TipError:
    """Actual and intended tool tip along a path, k samples in order.

    rows      (k,) the motion
    lines     (k,) the line of the motion
    fraction  (k,) the fraction of the motion
    intended  (k, 3) intended tip, workpiece frame, mm
    actual    (k, 3) actual tip, workpiece frame, mm
    """

    rows: Index
    lines: Index
    fraction: Array
    intended: Array
    actual: Array

    @classmethod
    def none(cls) -> TipError:
        """A path without samples."""
        rows, places = np.zeros(0, dtype=np.intp), np.zeros((0, 3))
        return cls(rows, rows, np.zeros(0), places, places)

    @property
    def size(self) -> Array:
        """(k,) the distance between actual and intended tip, mm."""
        gap = self.actual - self.intended
        return np.sqrt(np.einsum("ij,ij->i", gap, gap))

    @property
    def weight(self) -> Array:
        """(k,) the length of intended path for which each sample stands, mm."""
        step = np.linalg.norm(np.diff(self.intended, axis=0), axis=1) * (np.diff(self.rows) == 0)
        return (np.concatenate([[0.0], step]) + np.concatenate([step, [0.0]])) / 2


def tip_errors(intent: Intent, lines: Index, first: int = 0, made: Tip | None = None) -> Iterator[TipError]:
    """The tip errors of a program on this machine, against a perfect machine at the same fraction, in batches.

    lines  (n,) lines of the motions; tool lengths must be known
    first  the row of the first motion to simulate
    made   returns the actual tip, if it is not that of the machine alone
    """
    made = made or actual_tip
    for rows, fraction in samples(intent, first):
        yield TipError(rows, lines[rows], fraction, intent.tip(rows, fraction), made(intent, rows, fraction))


def tip_errors_of(program: Program, followed: Followed, made: Tip | None = None) -> Iterator[TipError]:
    """Like `tip_errors`, for a whole program that was followed on its machine."""
    moves = followed.trace.moves
    return tip_errors(Intent(followed.machine, moves, State()), program.lines(moves.block), made=made)


def tip_errors_on(task: Task, read: Read, said: list[Message]) -> Iterator[TipError]:
    """Like `tip_errors`, for the text that `read` returns; raises what following raises, and `NotInPartsError`.

    said  the messages from following the program are added to it at the end
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
    """Motions and fractions to sample, with their ends, as densely as the error model may bend; in batches."""
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
    """Motions and fractions: both ends of motions `rows` (k,), `counts` (k,) places between them, and kinks."""
    along = np.flatnonzero(intent.moves.kind[rows] != MotionKind.CYCLE)
    on, inside = rows[along], counts[along]
    inside, between = with_kinks(intent, intent.segments, on, inside, even(inside))
    begins, ends = (along, np.zeros(len(along))), (np.arange(len(rows)), np.ones(len(rows)))
    counts, fraction = merged(len(rows), (along[owners(inside)], between), begins, ends)
    return rows[owners(counts)], fraction


def actual_tip(intent: Intent, rows: Index, fraction: Array) -> Array:
    """(k, 3) tip of the real machine at fractions of motions, mm."""
    return intent.machine.actual_tip(intent.joints_at(rows, fraction), intent.states(rows, fraction))


Correct = Callable[[Array, Array, float], Array]
"""(positions (k, n_axes), mm and rad; directions (k, n_axes); tool length, mm) -> corrections (k, n_axes)."""


def tip_with(correct: Correct) -> Tip:
    """The function like `actual_tip` for a control that adds the corrections of `correct`, such as those of tables."""

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
    """Raise RefusedError NCF438 if a program seems to have been corrected for this machine (see `suspected`)."""
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
