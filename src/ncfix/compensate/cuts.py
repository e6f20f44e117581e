"""What a program cuts, part after part: as it means it, and as a machine makes it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ncfix.compensate.bodies import Bodies
from ncfix.compensate.coverage import Why, not_looked_at
from ncfix.compensate.crew import Read
from ncfix.compensate.curve import Curve
from ncfix.compensate.direction import Signs, matters
from ncfix.compensate.findings import Array, Index
from ncfix.compensate.flanks import Flank
from ncfix.compensate.intent import Intent
from ncfix.compensate.rounding import rounding_of_arcs
from ncfix.compensate.simulation import actual_tip
from ncfix.compensate.stretches import Stretches
from ncfix.compensate.task import Task
from ncfix.compensate.units import Units
from ncfix.compensate.wordless import left_in_cuts
from ncfix.control.moves import Moves
from ncfix.control.parts import joined_moves, taken
from ncfix.diagnostics import Message
from ncfix.machine import Machine, State
from ncfix.text.tree import Program

BESIDE = 64
"""Motions on both sides of one that are looked at to find out whether an axis turns round near it."""


@dataclass(frozen=True, slots=True)
class Cut:
    """What a part of a program cuts; motions are called by their lines.

    actual    what the machine makes of it
    intended  what it means; None of a program of which that does not matter
    flank     where the tip is besides, with the play of axes, if there is any
    unseen    why motions at feed are not looked at -> their lines, one for each
    left      linear axis -> lines of motions that cannot be corrected along it
    last      nothing comes after it
    rounding  how far the tip may be off because numbers are rounded to the control's digits, mm
    sides     (n, n_axes) of the play on which axes are after each motion, those that do not count, too, if there is any
    """

    actual: Curve
    intended: Curve | None
    flank: Flank | None
    unseen: dict[Why, Index]
    left: dict[str, Index]
    last: bool
    rounding: float
    bodies: Bodies | None = None

    @classmethod
    def of(cls, intent: Intent, lines: Index, rows: slice, last: bool, meant: bool, first: Array | None = None) -> Cut:
        """Of motions, of which some `rows` count and others stand before and behind them; `meant`: with what they mean.

        lines  (n,) those of the motions
        first  (n_axes,) where the bodies of axes are before them, see `Bodies`
        """

        def counted(curve: Curve) -> slice:
            first, stop, _ = rows.indices(len(intent.moves))
            return slice(*np.searchsorted(curve.rows, [first, stop]).tolist())

        def in_lines(curve: Curve) -> Curve:
            found = curve.taken(counted(curve))
            return replace(found, rows=lines[found.rows])

        def lines_of(found: Index) -> Index:
            first, stop, _ = rows.indices(len(intent.moves))
            return lines[found[(found >= first) & (found < stop)]]

        stretches = Stretches.of(intent)
        bodies = Bodies.of(intent, stretches, first) if matters(intent.machine) else None
        stretches = bodies.divided() if bodies else stretches
        actual = Curve.through(stretches, bodies.tip if bodies else partial(actual_tip, intent))
        intended = in_lines(Curve.through(stretches, intent.tip)) if meant else None
        flank = Flank.of(bodies, actual).taken(counted(actual)) if bodies else None
        left = {axis: lines_of(found) for axis, found in left_in_cuts(intent.moves).items()}
        digits = rounding_of_arcs(intent.machine, np.nan_to_num(intent.moves.sweep[rows]))
        unseen = {why: lines_of(found) for why, found in not_looked_at(intent.moves).items()}
        return cls(in_lines(actual), intended, flank, unseen, left, last, digits, bodies)


def whole(machine: Machine, program: Program, moves: Moves, meant: bool = False) -> Iterator[Cut]:
    """What a program cuts, at once."""
    yield Cut.of(Intent(machine, moves, State()), program.lines(moves.block), slice(None), True, meant)


@dataclass(frozen=True, slots=True)
class Around:
    """The last motions of a part, where it matters which way axes go next.

    moves      up to twice `BESIDE`; the last `BESIDE` count when the next part is known
    lines      (n,) those in which they are
    direction  the way in which the axes came to the first of them
    sides      (n_axes,) where their bodies are there
    """

    moves: Moves
    lines: Index
    direction: Signs
    sides: Array

    @classmethod
    def behind(cls, bodies: Bodies, lines: Index) -> Around:
        """Those at the end of motions in lines (n,)."""
        start, moves = max(len(lines) - 2 * BESIDE, 0), bodies.intent.moves
        return cls(taken(moves, np.arange(start, len(lines))), lines[start:], bodies.came(start), bodies.before(start))


@dataclass(frozen=True, slots=True)
class Cuts:
    """What a program cuts, part after part while it is read.

    read   gives the next so many bytes of the text; none at its end
    meant  with what it means
    said   what there is to say of following it, once the last part is there
    """

    task: Task
    read: Read
    meant: bool
    said: list[Message] = field(default_factory=list)

    def __iter__(self) -> Iterator[Cut]:
        """The parts. Raises what reading and following do, and UsageError for what is not given."""
        task = self.task
        units = Units.of(task, self.read)
        machine = units.placed
        around = None
        for unit in units:
            moves, lines = unit.part.moves, unit.part.lines
            if unit.part.last:
                self.said.extend(units.messages)
            if not matters(machine):
                yield Cut.of(Intent(machine, moves, State()), lines, slice(None), unit.part.last, self.meant)
                continue
            intent, lines, counted = _with(around, machine, moves, lines)
            rows = slice(counted, None if unit.part.last else -BESIDE)
            cut = Cut.of(intent, lines, rows, unit.part.last, self.meant, around.sides if around else None)
            yield cut
            assert cut.bodies is not None
            around = Around.behind(cut.bodies, lines)


def _with(around: Around | None, machine: Machine, moves: Moves, lines: Index) -> tuple[Intent, Index, int]:
    """Motions behind those before them, the lines of all, and how many of them have been counted."""
    if around is None:
        return Intent(machine, moves, State()), lines, 0
    both = joined_moves([around.moves, moves], [0, 0])
    counted = max(len(around.lines) - BESIDE, 0)
    intent = Intent(machine, both, State(direction=around.direction))
    return intent, np.concatenate([around.lines, lines]), counted
