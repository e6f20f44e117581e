"""A Klartext program ready to be followed: the plans of its blocks, its labels, where it begins."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from ncfix.control.expressions import Fault
from ncfix.control.interpreter import TextUnit
from ncfix.text.tree import Program
from ncfix_heidenhain.klartext.lane_tables import KlartextLaneTables
from ncfix_heidenhain.klartext.plans import KlartextPlan, plan_of

NO_BEGIN = "NCF275"
BEGIN = re.compile(r"BEGIN\s+PGM(?P<rest>.*)", re.IGNORECASE | re.DOTALL)
UNIT = re.compile(r"\b(MM|INCH)\s*\Z", re.IGNORECASE)
MM_PER_UNIT = {"MM": 1.0, "INCH": 25.4}


class KlartextUnit(TextUnit[KlartextPlan]):
    """One program.

    axes     bit mask of the letters that the machine has
    labels   label -> its block, the first of that name
    mm       mm per unit of length
    """

    def __init__(self, program: Program, axes: int, external: str = "") -> None:
        self.axes = axes
        super().__init__(program, plan_of, external)
        self.begin, self.mm = self._beginning()

    def take(self, program: Program, begin: int, stop: int) -> None:
        """See `TextUnit.take`."""
        super().take(program, begin, stop)
        self.labels = self._found_labels()

    def tables(self) -> KlartextLaneTables:
        """See `TextUnit.tables`."""
        return KlartextLaneTables.of(self.program.templates, self.all_plans(), self.axes)

    def closed(self) -> NDArray[np.bool_]:
        """See `TextUnit.closed`."""
        closed: NDArray[np.bool_] = ~self.lanes.open
        return closed

    def next_plan(self, block: int) -> KlartextPlan | None:
        """What the first block from there on does that does anything but set a pole."""
        plans = map(self.plan, range(block, self.stop))
        return next((plan for plan in plans if not plan.empty and plan.name != "cc"), None)

    def _found_labels(self) -> dict[str, int]:
        found: dict[str, int] = {}
        flows = [plan.flow for plan in self.all_plans()]
        for block in self.blocks_of(
            [i for i, flow in enumerate(flows) if flow is not None and flow.keyword == "label"]
        ):
            flow = flows[self.template[block]]
            assert flow is not None
            found.setdefault(str(flow.label), block)
        return found

    def _beginning(self) -> tuple[int, float]:
        """The block after BEGIN PGM, and the unit that it names."""
        statements = [plan.statement for plan in self.all_plans()]
        heads = [i for i, statement in enumerate(statements) if statement is not None and statement[0] == "program"]
        for block in self.blocks_of(heads):
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
