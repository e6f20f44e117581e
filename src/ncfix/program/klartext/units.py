"""A Klartext program ready to be followed: the plans of its blocks, its labels, where it begins."""

from __future__ import annotations

import re

from ncfix.program.klartext.plans import Plan, plan_of
from ncfix.program.rs274.faults import Fault
from ncfix.program.tree import Program

NO_BEGIN = "NCF275"
BEGIN = re.compile(r"BEGIN\s+PGM(?P<rest>.*)", re.IGNORECASE | re.DOTALL)
UNIT = re.compile(r"\b(MM|INCH)\s*\Z", re.IGNORECASE)
MM_PER_UNIT = {"MM": 1.0, "INCH": 25.4}


class Unit:
    """One program.

    name     the file's name, if it was called; empty for the main program
    numbers  the numbers of the program
    first    where those of each block begin
    plans    what each block does
    labels   label -> its block, the first of that name
    begin    the block after BEGIN PGM
    mm       mm per unit of length
    """

    def __init__(self, program: Program, name: str = "") -> None:
        self.program = program
        self.name = name
        self.numbers: list[float] = program.numbers.tolist()
        self.first: list[int] = program.first_number.tolist()
        shapes = [plan_of(template) for template in program.templates]
        self.plans: list[Plan] = [shapes[index] for index in program.template.tolist()]
        self.labels: dict[str, int] = {}
        for block, plan in enumerate(self.plans):
            if plan.flow is not None and plan.flow.keyword == "label":
                self.labels.setdefault(str(plan.flow.label), block)
        self.begin, self.mm = self._beginning()

    def __len__(self) -> int:
        return len(self.plans)

    def _beginning(self) -> tuple[int, float]:
        """The block after BEGIN PGM, and the unit that it names."""
        for block, plan in enumerate(self.plans):
            if plan.statement is None or plan.statement[0] != "program":
                continue
            text = self.program.slice(block, plan.statement[1])
            if found := BEGIN.match(text):
                return block + 1, self._unit(found["rest"])
        raise Fault(NO_BEGIN, "there is no BEGIN PGM: this is no Klartext program")

    def _unit(self, rest: str) -> float:
        found = UNIT.search(rest.strip().strip('"'))
        if found is None:
            raise Fault(NO_BEGIN, "BEGIN PGM names no unit", "it ends with MM or INCH")
        return MM_PER_UNIT[found[1].upper()]
