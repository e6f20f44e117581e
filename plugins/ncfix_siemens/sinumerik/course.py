"""Where execution stands, and where control structures, jumps, repetitions and calls take it."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, field

from ncfix.control.faults import Fault
from ncfix.control.modal import Modal
from ncfix.text.tree import Expression, NamedParameter, Parameter
from ncfix_siemens.sinumerik.modes import Frames, Modes
from ncfix_siemens.sinumerik.plans import Branching, Letting
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.unit import BROKEN, CLOSING, SinumerikUnit
from ncfix_siemens.sinumerik.values import Evaluate, Key, Value, compiled, number
from ncfix_siemens.sinumerik.variables import Local

MAX_CALLS = 16
"""How deep subprograms may be nested."""
TOO_DEEP = "NCF232"
NO_LABEL = "NCF230"


class AtRuntimeError(Exception):
    """What is executed next is decided at run time."""


@dataclass(slots=True)
class Section:
    """A stretch of a program that REPEAT executes again."""

    start: int
    stop: int
    back: int
    left: int


@dataclass(slots=True)
class Call:
    """A subprogram that has not returned.

    unit, block  where to go on after it
    left         how many more times it is called
    results      variables of the caller that it may change: its own name -> theirs
    saved        what comes back when it returns, if it says SAVE
    """

    unit: SinumerikUnit
    block: int
    entered: SinumerikUnit
    left: int
    results: dict[str, Key]
    sections: list[Section]
    saved: tuple[Modal, Modes, Frames] | None


@dataclass(slots=True)
class Course:
    """Where execution stands: the block that comes next, and where to return to."""

    control: Sinumerik
    unit: SinumerikUnit
    block: int
    calls: list[Call] = field(default_factory=list)
    sections: list[Section] = field(default_factory=list)

    def under_way(self) -> tuple[object, ...]:
        """The calls that have not returned, and what is still to be repeated."""
        calls = tuple((id(call.unit), call.block, call.left) for call in self.calls)
        sections = [self.sections, *(call.sections for call in self.calls)]
        return calls, tuple((each.start, each.left) for level in sections for each in level)

    # -- repetitions --------------------------------------------------------------------------------------------------

    def arrive(self) -> bool:
        """See `Interpreter`; at the end of a repeated section: once more, or on after the REPEAT."""
        while self.sections and self.block == self.sections[-1].stop:
            section = self.sections[-1]
            section.left -= 1
            if section.left > 0:
                self.block = section.start
                break
            self.block = self.sections.pop().back
        return self.block < self.unit.stop

    def repeat(self, step: Branching, times: int) -> None:
        """`REPEAT label`, `REPEAT first last`, `REPEATB label`."""
        here = self.block - 1
        start = self.place_of(step.label, here)
        if step.keyword == "repeatb":
            stop = start + 1
        elif step.values:
            stop = self.place_of(str(step.values[0](self.control)), here) + 1
        else:
            ends = [block for block in self.unit.labelled("ENDLABEL") if block > start]
            stop = ends[0] if ends else here
        self.control.budget.foresee(times)
        if times > 0 and stop > start:
            self.sections.append(Section(start, stop, self.block, times))
            self.block = start

    def place_of(self, label: str, here: int) -> int:
        """The block of a label, wherever it is."""
        found = self.unit.find(label, here, "goto")
        if found is None:
            raise Fault(NO_LABEL, f"there is no label {label}")
        return found

    # -- branches and loops -------------------------------------------------------------------------------------------

    def truth(self, step: Branching) -> bool:
        """Whether a condition holds; raises `AtRuntimeError` where only the control knows."""
        value = number(step.values[0](self.control))
        if value is None:
            raise AtRuntimeError
        return value != 0.0

    def follow(self, step: Branching, steps: tuple[object, ...]) -> None:
        """Do what a control structure says; `block` is already that of the next line."""
        handlers: dict[str, Callable[[Branching], None]] = {
            "while": self.begin_while,
            "for": self.begin_for,
            "until": self.until,
            "endwhile": self.again,
            "endloop": self.again,
            "endfor": self.again_for,
            "else": self.otherwise,
        }
        keyword = step.keyword
        if keyword == "if":
            self.branch(step, steps)
        elif keyword == "case":
            self.choose(step, steps)
        elif keyword.startswith("goto"):
            self.jump(step)
        elif keyword == "repeat" and not step.label:
            self.unit.end_of(self.block - 1, keyword)
        elif keyword in handlers:
            handlers[keyword](step)

    def branch(self, step: Branching, steps: tuple[object, ...]) -> None:
        """`IF condition`, alone or with a jump behind it."""
        here, holds = self.block - 1, self.truth(step)
        jump = next((s for s in steps if isinstance(s, Branching) and s.keyword.startswith("goto")), None)
        if jump is not None:
            if holds:
                self.jump(jump)
            return
        end = self.unit.end_of(here, "if")
        if not holds:
            self.block = self.unit.others.get(here, end) + 1

    def otherwise(self, step: Branching) -> None:
        """`ELSE`, come to from above: the branch is over."""
        self.block = self.unit.end_of(self.block - 1, "else") + 1

    def begin_while(self, step: Branching) -> None:
        """`WHILE condition`."""
        here = self.block - 1
        end = self.unit.end_of(here, "while")
        if not self.truth(step):
            self.block = end + 1

    def begin_for(self, step: Branching) -> None:
        """`FOR name = first TO last`."""
        key, first = self.key_of(step.written[0]), number(step.values[1](self.control))
        if key is None or first is None:
            raise AtRuntimeError
        self.control.variables.assign(key, first)
        self.check_for(step, self.block - 1)

    def check_for(self, step: Branching, here: int) -> None:
        """Into the loop, or past it."""
        value, last = number(step.values[0](self.control)), number(step.values[2](self.control))
        end = self.unit.end_of(here, "for")
        if value is None or last is None:
            raise AtRuntimeError
        self.block = here + 1 if value <= last else end + 1

    def again_for(self, step: Branching) -> None:
        """`ENDFOR`: one more, and back."""
        begin = self.begin_of(step)
        self.control.first = self.unit.first[begin]
        loop = next(s for s in self.unit.branchings(begin) if s.keyword == "for")
        key, value = self.key_of(loop.written[0]), number(loop.values[0](self.control))
        if key is None or value is None:
            raise AtRuntimeError
        self.control.variables.assign(key, value + 1.0)
        self.check_for(loop, begin)

    def until(self, step: Branching) -> None:
        """`UNTIL condition`."""
        begin = self.begin_of(step)
        if not self.truth(step):
            self.block = begin + 1

    def again(self, step: Branching) -> None:
        """`ENDWHILE`, `ENDLOOP`: back to the begin."""
        self.block = self.begin_of(step)

    def begin_of(self, step: Branching) -> int:
        """Where the structure begins that ends here."""
        begin = self.unit.begins.get(self.block - 1)
        if begin is None:
            raise Fault(BROKEN, f"{step.keyword.upper()} without a {CLOSING[step.keyword].upper()} before it")
        return begin

    def choose(self, step: Branching, steps: tuple[object, ...]) -> None:
        """`CASE value OF ...`."""
        value = number(step.values[0](self.control))
        if value is None:
            raise AtRuntimeError
        for choice in (s for s in steps if isinstance(s, Branching)):
            if choice.keyword.startswith("of "):
                wanted = number(choice.values[0](self.control))
                if wanted is None:
                    raise AtRuntimeError
            if choice.keyword.startswith("default ") or (choice.keyword.startswith("of ") and wanted == value):
                self.jump(choice)
                return

    def jump(self, step: Branching) -> None:
        """`GOTOF label` and its like."""
        keyword = step.keyword.rpartition(" ")[2]
        if keyword == "gotos":
            self.block = self.unit.begin
            return
        if not step.label:
            raise AtRuntimeError
        found = self.unit.find(step.label, self.block - 1, keyword)
        if found is None and keyword == "gotoc":
            return
        if found is None:
            where = {"gotof": " further down", "gotob": " further up"}.get(keyword, "")
            raise Fault(NO_LABEL, f"there is no label {step.label}{where}")
        self.block = found
        self.sections = [section for section in self.sections if section.start <= found < section.stop]

    # -- variables ----------------------------------------------------------------------------------------------------

    def let(self, step: Letting) -> None:
        """Give a variable its value."""
        variables = self.control.variables
        if step.value is None:
            index: tuple[Value, ...] = tuple(part(self.control) for part in step.index)
            values = [part(self.control) for part in step.listed]
            variables.fill(step.name, index, values, repeated=step.repeated)
            return
        value = step.value(self.control)
        if not step.index:
            variables.assign(step.name, value)
            return
        places = tuple(number(part(self.control)) for part in step.index)
        if any(place is None for place in places):
            variables.forget(step.name)
            return
        variables.assign((step.name, tuple(place for place in places if place is not None)), value)

    def key_of(self, expression: Expression | None) -> Key | None:
        """The variable that an expression names, if it names one."""
        match expression:
            case NamedParameter(name):
                return name
            case Parameter(index):
                place = number(compiled(index)(self.control))
                return None if place is None else ("r", (place,))
        return None

    # -- calls --------------------------------------------------------------------------------------------------------

    def call(
        self,
        unit: SinumerikUnit,
        arguments: tuple[Evaluate, ...],
        written: tuple[Expression | None, ...],
        times: int = 1,
    ) -> None:
        """Enter a subprogram."""
        if len(self.calls) >= MAX_CALLS:
            raise Fault(TOO_DEEP, f"subprograms are nested more than {MAX_CALLS} deep")
        if times < 1:
            return
        self.control.budget.foresee(times)
        values: list[Value] = [argument(self.control) for argument in arguments]
        local, results = Local(), {}
        for place, parameter in enumerate(unit.parameters):
            local.kinds[parameter.name] = parameter.kind
            given = place < len(values) and written[place] is not None
            if parameter.kind == "axis":
                local.values[parameter.name] = values[place] if given else None
            else:
                local.values[parameter.name] = values[place] if given else 0.0
            key = self.key_of(written[place]) if given else None
            if parameter.by_reference and key is not None:
                results[parameter.name] = key
        self.calls.append(Call(self.unit, self.block, unit, times - 1, results, self.sections, self.saved(unit)))
        self.control.variables.scopes.append(local)
        self.unit, self.block, self.sections = unit, unit.begin, []

    def saved(self, unit: SinumerikUnit) -> tuple[Modal, Modes, Frames] | None:
        """What a subprogram with SAVE gives back."""
        control = self.control
        return (copy.copy(control.modal), copy.copy(control.modes), copy.copy(control.frames)) if unit.saves else None

    def finish(self) -> None:
        """Return from a subprogram, or execute it once more."""
        self.control.budget.spend(1)
        call = self.calls[-1]
        if call.left:
            call.left -= 1
            self.block = call.entered.begin
            return
        self.calls.pop()
        local = self.control.variables.scopes.pop()
        for name, key in call.results.items():
            self.control.variables.assign(key, local.values.get(name))
        self.unit, self.block, self.sections = call.unit, call.block, call.sections
        if call.saved is not None:
            self.control.restore(*call.saved)
