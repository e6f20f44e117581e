"""What a program cuts, part after part: as it means it, and as a machine makes it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from ncfix.compensate.comparison import as_made
from ncfix.compensate.crew import Read
from ncfix.compensate.curve import Curve
from ncfix.compensate.direction import matters
from ncfix.compensate.findings import Index
from ncfix.compensate.flanks import Flank
from ncfix.compensate.following import placed
from ncfix.compensate.intent import Intent
from ncfix.compensate.simulation import unseen
from ncfix.compensate.task import Task
from ncfix.compensate.units import Part, Units
from ncfix.compensate.wordless import left_in_cuts
from ncfix.machine import Machine, State
from ncfix.program.moves import Moves
from ncfix.program.parts import NotInPartsError, PartReader
from ncfix.program.tree import Program


@dataclass(frozen=True, slots=True)
class Cut:
    """What a part of a program cuts; motions are called by their lines.

    actual    what the machine makes of it
    intended  what it means; None of a program of which that does not matter
    flank     the other side of the play, if there is any
    unseen    lines of motions that cut nobody knows where
    left      linear axis -> lines of motions that cannot be corrected along it
    last      nothing comes after it
    """

    actual: Curve
    intended: Curve | None
    flank: Flank | None
    unseen: Index
    left: dict[str, Index]
    last: bool

    @classmethod
    def of(cls, machine: Machine, part: Part, meant: bool) -> Cut:
        """Of a part of a program; `meant`: with what it means."""
        intent, lines = Intent(machine, part.moves, State()), part.program.lines(part.moves.block)
        actual = as_made(intent)

        def in_lines(curve: Curve) -> Curve:
            return replace(curve, rows=lines[curve.rows])

        intended = in_lines(Curve.of(intent, intent.tip)) if meant else None
        left = {axis: lines[rows] for axis, rows in left_in_cuts(part.moves).items()}
        flank = Flank.of(intent, actual)
        return cls(in_lines(actual), intended, flank, lines[unseen(part.moves)], left, part.last)


def whole(machine: Machine, program: Program, moves: Moves, meant: bool = False) -> Iterator[Cut]:
    """What a program cuts, at once."""
    yield Cut.of(machine, Part(program, moves, True), meant)


@dataclass(frozen=True, slots=True)
class Cuts:
    """What a program cuts, part after part while it is read.

    read   gives the next so many bytes of the text; none at its end
    meant  with what it means
    """

    task: Task
    read: Read
    meant: bool

    def __iter__(self) -> Iterator[Cut]:
        """The parts. Raises what reading and following do, `NotInPartsError`, and UsageError for what is not given."""
        task = self.task
        if matters(task.machine):
            raise NotInPartsError("which side of its play an axis is on is found out for the whole path")
        machine, reader = placed(task.machine, task.setup), PartReader(task.path, task.dialect)
        units = Units(task.machine, machine, task.setup, task.options, reader, task.follower(), self.read, task.size)
        for unit in units:
            yield Cut.of(machine, unit.part, self.meant)
        if error := units.missing():
            raise error
