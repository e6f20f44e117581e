"""A program text while it is executed: the main program, or the file of a subprogram."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ncfix.control.ahead import Ahead
from ncfix.control.lane_tables import LaneTables
from ncfix.text.tree import Comment, Flow, Program, view
from ncfix_iso.rs274.groups import Rules
from ncfix_iso.rs274.plans import Plan, plan_of


@dataclass(slots=True, eq=False)
class Unit:
    """A program with the plans of its shapes.

    axes      bit mask of the letters that the machine has
    name      of a subprogram file; empty for the main program
    template  index of each block's shape
    first     where the numbers of each block begin
    numbers   all numbers
    flows     the blocks that are flow control, ascending
    ahead     what the fast lane has seen of the blocks to come
    """

    program: Program
    rules: Rules
    axes: int
    name: str = ""
    template: Sequence[int] = field(init=False)
    first: Sequence[int] = field(init=False)
    numbers: Sequence[float] = field(init=False)
    flows: list[int] = field(init=False)
    ahead: Ahead = field(init=False, default_factory=Ahead)
    _plans: list[Plan | None] = field(default_factory=list)
    _lane_stops: NDArray[np.int64] | None = field(init=False, default=None)
    _lanes: LaneTables | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        program = self.program
        self.template = view(program.template)
        self.first = view(program.first_number)
        self.numbers = view(program.numbers)
        self._plans += [None] * (len(program.templates) - len(self._plans))
        shapes = {index for index, t in enumerate(program.templates) if any(isinstance(i, Flow) for i in t.items)}
        self.flows = [block for block, shape in enumerate(self.template) if shape in shapes] if shapes else []

    def followed_by(self, program: Program) -> Unit:
        """The next part of the same program: its templates are those of this one, and more."""
        return Unit(program, self.rules, self.axes, self.name, _plans=self._plans)

    def __len__(self) -> int:
        return len(self.template)

    def plan(self, block: int) -> Plan:
        """The plan of a block."""
        shape = self.template[block]
        return self._plans[shape] or self.plan_of_shape(shape)

    def plan_of_shape(self, shape: int) -> Plan:
        """The plan of a shape."""
        plan = self._plans[shape]
        if plan is None:
            plan = self._plans[shape] = plan_of(self.program.templates[shape], self.rules)
            if plan.axes & ~self.axes:
                plan.lane = None
        return plan

    def lane_end(self, block: int) -> int:
        """The first block from `block` on that cannot go through the fast lane."""
        if self._lane_stops is None:
            lanes = [self.plan_of_shape(shape).lane is not None for shape in range(len(self._plans))]
            closed = ~np.array(lanes, dtype=np.bool_).take(self.program.template)
            self._lane_stops = np.append(np.flatnonzero(closed), len(self))
        return int(self._lane_stops[np.searchsorted(self._lane_stops, block)])

    @property
    def lanes(self) -> LaneTables:
        """The lanes of all shapes as columns."""
        if self._lanes is None:
            lanes = [self.plan_of_shape(shape).lane for shape in range(len(self._plans))]
            self._lanes = LaneTables.of(lanes)
        return self._lanes

    def begins_with_tape(self) -> bool:
        """Whether the first block that is not blank is a `%`; controls but LinuxCNC pass over comments before it."""
        for block in range(len(self)):
            plan = self.plan(block)
            leader = not self.rules.strict and all(isinstance(item, Comment) for item in plan.template.items)
            if plan.tape or (plan.template.items and not leader):
                return plan.tape
        return False
