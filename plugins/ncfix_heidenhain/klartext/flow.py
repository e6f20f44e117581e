"""Labels, calls, repeats and jumps.

Source: TNC 640, "Subprograms and program section repeats". A section is repeated as often as REP says after it has
been executed once; LBL 0 returns from a subprogram and means nothing elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from ncfix.control.faults import Fault
from ncfix.control.recurrence import Budget
from ncfix_heidenhain.klartext.calculate import Parameters
from ncfix_heidenhain.klartext.units import KlartextUnit

NO_LABEL = "NCF276"
NO_PROGRAM = "NCF231"
TOO_DEEP = "NCF232"
MOST_CALLS = 64
"""How deep calls may be nested."""


@dataclass(frozen=True, slots=True)
class Call:
    """Where a call came from, whether it was to another program, and if so the QL parameters of the caller."""

    unit: KlartextUnit
    block: int
    outside: bool
    local: Mapping[str, tuple[float, bool]] = field(default_factory=dict)


@dataclass(slots=True)
class FlowControl:
    """Where the control is in the program.

    unit, block  the block that comes next
    parameters   the Q parameters
    budget       how much may still be executed
    calls        the calls that are open
    repeats      how often a repeat has still to be made
    selected     the program that CALL SELECTED PGM calls; empty where it is chosen at run time
    """

    unit: KlartextUnit
    find: Callable[[str], KlartextUnit | None]
    parameters: Parameters
    budget: Budget
    block: int = 0
    calls: list[Call] = field(default_factory=list)
    repeats: dict[tuple[int, int], int] = field(default_factory=dict)
    selected: str = ""

    def arrive(self) -> bool:
        """See `Interpreter`."""
        return self.block < self.unit.stop

    def jump(self, label: str) -> None:
        """Go on at a label."""
        if label not in self.unit.labels:
            raise Fault(NO_LABEL, f"there is no LBL {label}")
        self.block = self.unit.labels[label]

    def call(self, label: str, times: int | None) -> None:
        """CALL LBL: a subprogram, or with REP a section that is repeated."""
        if times is None:
            self.push(outside=False)
            self.jump(label)
            return
        key = id(self.unit), self.block
        left = self.repeats.get(key, times)
        self.budget.foresee(left)
        if left > 0:
            self.repeats[key] = left - 1
            self.jump(label)
        else:
            self.repeats.pop(key, None)

    def call_program(self, name: str) -> None:
        """CALL PGM."""
        found = self.find(name)
        if found is None:
            raise Fault(
                NO_PROGRAM,
                f"the program {name} is not found",
                "put its file beside the program, or say where it is: --subprograms DIR",
            )
        if found.mm != self.unit.mm:
            raise Fault(NO_PROGRAM, f"the program {name} is written in another unit of length")
        self.push(outside=True)
        self.unit, self.block = found, found.begin

    def push(self, *, outside: bool) -> None:
        """Note where to come back to."""
        if len(self.calls) >= MOST_CALLS:
            raise Fault(TOO_DEEP, f"more than {MOST_CALLS} calls are open")
        self.calls.append(Call(self.unit, self.block, outside, self.parameters.enter() if outside else {}))

    def under_way(self) -> tuple[object, ...]:
        """The calls that are open, and the repeats that have still to be made."""
        return tuple((id(call.unit), call.block) for call in self.calls), tuple(self.repeats.items())

    def end_of_subprogram(self) -> None:
        """LBL 0."""
        if self.calls and not self.calls[-1].outside:
            self.back()

    def end_of_program(self) -> bool:
        """END PGM: back to the program that called, if one did; True if it was the main program."""
        while self.calls and not self.calls[-1].outside:
            self.calls.pop()
        if not self.calls:
            return True
        self.back()
        return False

    def back(self) -> None:
        """Return from the last call."""
        call = self.calls.pop()
        if call.outside:
            self.parameters.leave(call.local)
        self.unit, self.block = call.unit, call.block
