"""A Klartext program ready to be followed: the plans of its blocks, its labels, where it begins."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ncfix.control.faults import Fault
from ncfix.text.tree import Program, view
from ncfix_heidenhain.klartext.lane_tables import LaneTables
from ncfix_heidenhain.klartext.plans import Plan, plan_of

NO_BEGIN = "NCF275"
BEGIN = re.compile(r"BEGIN\s+PGM(?P<rest>.*)", re.IGNORECASE | re.DOTALL)
UNIT = re.compile(r"\b(MM|INCH)\s*\Z", re.IGNORECASE)
MM_PER_UNIT = {"MM": 1.0, "INCH": 25.4}


class Unit:
    """One program.

    name     the file's name, if it was called; empty for the main program
    axes     bit mask of the letters that the machine has
    numbers  the numbers of the program
    first    where those of each block begin
    labels   label -> its block, the first of that name
    begin    the block after BEGIN PGM
    mm       mm per unit of length
    """

    def __init__(self, program: Program, axes: int, name: str = "", before: Unit | None = None) -> None:
        self.program = program
        self.axes = axes
        self.name = name
        self.numbers: Sequence[float] = view(program.numbers)
        self.first: Sequence[int] = view(program.first_number)
        self.template: Sequence[int] = view(program.template)
        self._plans: list[Plan] = [] if before is None else before._plans
        self._plans += map(plan_of, program.templates[len(self._plans) :])
        self._lanes: LaneTables | None = None
        self._stops: NDArray[np.int64] | None = None
        self.labels = self._found_labels()
        self.begin: int = 0
        self.mm: float = 1.0 if before is None else before.mm
        if before is None:
            self.begin, self.mm = self._beginning()

    def followed_by(self, program: Program) -> Unit:
        """The next part of the same program: its templates are those of this one, and more."""
        return Unit(program, self.axes, self.name, self)

    def __len__(self) -> int:
        return len(self.template)

    def plan(self, block: int) -> Plan:
        """What a block does."""
        return self._plans[self.template[block]]

    def next_plan(self, block: int) -> Plan | None:
        """What the first block from there on does that does anything but set a pole."""
        plans = map(self.plan, range(block, len(self)))
        return next((plan for plan in plans if not plan.empty and plan.name != "cc"), None)

    # -- the fast lane ------------------------------------------------------------------------------------------------

    @property
    def lanes(self) -> LaneTables:
        """The shapes of the program as the fast lane sees them."""
        if self._lanes is None:
            self._lanes = LaneTables.of(self.program.templates, self._plans, self.axes)
        return self._lanes

    def lane_end(self, block: int) -> int:
        """The first block from `block` on that cannot go through the fast lane."""
        if self._stops is None:
            closed = ~self.lanes.open[self.program.template]
            self._stops = np.append(np.flatnonzero(closed), len(self))
        return int(self._stops[np.searchsorted(self._stops, block)])

    # -- labels, and where it begins ----------------------------------------------------------------------------------

    def _blocks_of(self, shapes: list[int]) -> list[int]:
        """The blocks of some shapes, in order."""
        return np.flatnonzero(np.isin(self.program.template, shapes)).tolist() if shapes else []

    def _found_labels(self) -> dict[str, int]:
        found: dict[str, int] = {}
        flows = [plan.flow for plan in self._plans]
        for block in self._blocks_of(
            [i for i, flow in enumerate(flows) if flow is not None and flow.keyword == "label"]
        ):
            flow = flows[self.template[block]]
            assert flow is not None
            found.setdefault(str(flow.label), block)
        return found

    def _beginning(self) -> tuple[int, float]:
        """The block after BEGIN PGM, and the unit that it names."""
        statements = [plan.statement for plan in self._plans]
        heads = [i for i, statement in enumerate(statements) if statement is not None and statement[0] == "program"]
        for block in self._blocks_of(heads):
            statement = statements[self.template[block]]
            assert statement is not None
            text = self.program.slice(block, statement[1])
            if found := BEGIN.match(text):
                return block + 1, self._unit(found["rest"])
        raise Fault(NO_BEGIN, "there is no BEGIN PGM: this is no Klartext program")

    def _unit(self, rest: str) -> float:
        found = UNIT.search(rest.strip().strip('"'))
        if found is None:
            raise Fault(NO_BEGIN, "BEGIN PGM names no unit", "it ends with MM or INCH")
        return MM_PER_UNIT[found[1].upper()]
