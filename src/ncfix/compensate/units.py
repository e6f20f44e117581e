"""The parts of a program, read and followed one after the other, each behind the last motion of the one before."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ncfix.compensate.crew import Read
from ncfix.compensate.following import placed, with_tool_lengths
from ncfix.compensate.partition import Part, Parts
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.kinematics import Signs, matters
from ncfix.compensate.task import Task
from ncfix.control.moves import Moves, Trace
from ncfix.control.parts import NotInPartsError, PartReader, joined, joined_moves, last_of
from ncfix.control.setup import Setup
from ncfix.diagnostics import Message, UsageError
from ncfix.machine import Machine, State


@dataclass(frozen=True)
class Unit:
    """A part, and the last motion of the one before, which is written already.

    head       that motion and its block; None for the first part
    direction  (n_axes,) the way in which the axes came to where that motion begins
    machine    with the workpiece in its place
    """

    part: Part
    head: Part | None
    direction: Signs
    machine: Machine

    @cached_property
    def together(self) -> Part:
        """The part behind that motion."""
        if self.head is None:
            return self.part
        program = joined([self.head.program, self.part.program])
        moves = joined_moves([self.head.moves, self.part.moves], [1, len(self.part.program)])
        return Part(program, moves, self.part.last)

    @cached_property
    def intent(self) -> Intent:
        """The part behind that motion on the machine."""
        return Intent(self.machine, self.together.moves, State(direction=self.direction))


@dataclass(slots=True, kw_only=True)
class Units(Parts):
    """The parts of a program on a machine, with every tool length known. Gone through once.

    machine  as it is; `placed` with the workpiece where the setup has it
    count    parts so far
    tools    what was taken as zero of tool lengths, in words
    notes    what there is to say about them
    lacking  what of them is not known
    units    of length, so far
    look     is shown each part
    """

    machine: Machine
    placed: Machine
    setup: Setup
    count: int = 0
    tools: dict[str, str] = field(default_factory=dict)
    notes: dict[tuple[str, str], Message] = field(default_factory=dict)
    lacking: dict[str, Message] = field(default_factory=dict)
    units: set[float] = field(default_factory=set)
    look: Callable[[Part], object] | None = None

    @classmethod
    def of(cls, task: Task, read: Read) -> Units:
        """The parts of a program that is read."""
        return cls(
            task.options,
            PartReader(task.path, task.dialect, task.head),
            task.follower(),
            read,
            task.size,
            matters(task.machine),
            machine=task.machine,
            placed=placed(task.machine, task.setup),
            setup=task.setup,
        )

    @property
    def assumed(self) -> tuple[str, ...]:
        """What was taken as zero so far, in words."""
        return (*self.follower.assumed, *self.tools)

    @property
    def messages(self) -> tuple[Message, ...]:
        """What there is to say of following the program, so far."""
        return (*self.follower.messages, *self.notes.values())

    def __iter__(self) -> Iterator[Unit]:
        """The parts; none any more once something is lacking.

        Raises what reading and following do, and at last UsageError for what the setup does not give.
        """
        head, direction = None, np.zeros(len(self.machine.axes), dtype=np.int8)
        for found in self.parts():
            part = replace(found, moves=self._known(found))
            if self.follower.lacking or self.lacking:
                continue
            if self.look is not None:
                self.look(part)
            unit = Unit(part, head, direction, self.placed)
            self._check_units(part.moves, head is None)
            if not part.last:
                head, direction = self._head(unit)
            self.count += 1
            yield unit
        if missing := (*self.follower.lacking,) or (*self.lacking.values(),):
            raise UsageError.collected(missing)

    def _known(self, part: Part) -> Moves:
        """The motions of a part with every tool length known; notes what is lacking."""
        try:
            found = with_tool_lengths(part.program, Trace(part.moves), self.machine, self.setup)
        except UsageError as error:
            self.lacking |= {message.text: message for message in error.messages if message.text not in self.lacking}
            return part.moves
        for name, message in zip(found.assumed, found.messages, strict=True):
            self.tools.setdefault(name, name)
            self.notes.setdefault((message.code, message.text), message)
        return found.moves

    def _check_units(self, moves: Moves, first: bool) -> None:
        units = {frame.unit for frame in moves.frames}
        if not units <= self.units and not first:
            raise NotInPartsError("the program changes between inch and mm")
        self.units |= units

    def _head(self, unit: Unit) -> tuple[Part, Signs]:
        """The last motion with its block, and the way in which the axes came there."""
        part, direction = unit.part, unit.direction
        head = Part(*last_of(part.program, part.moves), False)
        if self.sided:
            arrival = unit.intent.arrival
            assert arrival is not None
            direction = arrival[-2] if len(arrival) > 1 else direction
        return head, direction
