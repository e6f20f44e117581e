"""Labels, calls, repeats and jumps of Klartext as operations.

Source: TNC 640, "Subprograms and program section repeats". A section is repeated as often as REP says after it has
been executed once; LBL 0 returns from a subprogram and means nothing elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable

from ncfix.control.expressions import Fault
from ncfix.control.flow import NO_SUBPROGRAM, Call, Jump, OpenCall, Operation, ProgramFlow, Repeat, Return
from ncfix.text.tree import Constant
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.plans import KlartextPlan
from ncfix_heidenhain.klartext.units import KlartextUnit

NO_LABEL = "NCF276"
PROGRAM = "program"
"""The kind of calls of other programs."""


class KlartextFlow(ProgramFlow[KlartextUnit]):
    """Where the control is in the program.

    find      gives a program by its name
    selected  the program that CALL SELECTED PGM calls; empty where it is chosen at run time
    """

    most_calls = 64
    too_deep = f"more than {most_calls} calls are open"

    def __init__(
        self, control: KlartextControl, main: KlartextUnit, find: Callable[[str], KlartextUnit | None]
    ) -> None:
        super().__init__(main, control.budget)
        self.parameters = control.scope.parameters
        self.find = find
        self.selected = ""

    def operations(self, plan: KlartextPlan, holds: Callable[[], bool]) -> tuple[Operation, ...]:
        """What a label, a call or a condition comes down to; `holds`: the condition is met."""
        assert plan.flow is not None
        label, unit = str(plan.flow.label), self.unit

        def place() -> int:
            if label not in unit.labels:
                raise Fault(NO_LABEL, f"there is no LBL {label}")
            return unit.labels[label]

        match plan.flow.keyword, plan.flow.arguments:
            case "label", _ if label == "0":
                return (Return(lambda: bool(self.calls) and self.calls[-1].kind != PROGRAM),)
            case "call", (Constant(times),):
                return (Repeat(place, lambda: int(times)),)
            case "call", _:
                return (Call(lambda: OpenCall(label, (unit, place()))),)
            case "if", _:
                return (Jump(place, holds),)
        return ()

    def call_program(self, name: str) -> None:
        """CALL PGM: another program, with QL parameters of its own."""
        found = self.find(name)
        if found is None:
            hint = "put its file beside the program, or say where it is: --subprograms DIR"
            raise Fault(NO_SUBPROGRAM, f"the program {name} is not found", hint)
        if found.mm != self.unit.mm:
            raise Fault(NO_SUBPROGRAM, f"the program {name} is written in another unit of length")
        self.check_depth(name)
        local = self.parameters.enter()
        self.enter(OpenCall(name, (found, found.begin), kind=PROGRAM, leave=lambda: self.parameters.leave(local)))
