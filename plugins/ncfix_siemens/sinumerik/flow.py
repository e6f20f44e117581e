"""Control structures, jumps, repetitions and calls of SINUMERIK as operations of a `ProgramFlow`."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from ncfix.control.expressions import Evaluate, Fault, Unknown, Value, number
from ncfix.control.flow import NO_LABEL, Jump, Let, OpenCall, Operation, ProgramFlow, Repeat, Section
from ncfix.text.tree import Expression, NamedParameter, NumberedParameter
from ncfix_siemens.sinumerik.expressions import Key, Local, compiled, name_of, of_kind, renamed
from ncfix_siemens.sinumerik.framing import set_length
from ncfix_siemens.sinumerik.plans import AssignedVariable, Branching
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.unit import BROKEN, SinumerikUnit

SKIPPED_PART = (
    "block delete (/) skips a part of this control structure: whether the control still finds it is not certain"
)


LABELS = re.compile(r"\s*((?!N\d+\b)[A-Z_]\w*)\s*:\s*((?!N\d+\b)[A-Z_]\w*)\s*", re.IGNORECASE)
"""Two labels `FIRST:LAST`; block numbers are not accepted, since they may change."""


class Stretch(NamedTuple):
    """The blocks of a unit from `start` up to, not including, `stop`."""

    unit: SinumerikUnit
    start: int
    stop: int


class AtRuntimeError(Exception):
    """Raised if the next block depends on a value known only at run time."""


def decided(value: Value) -> float:
    """A value that decides on the flow, as a number; raises `AtRuntimeError` if it is known only at run time."""
    found = number(value)
    if found is None:
        raise AtRuntimeError
    return found


def told(value: Value) -> str:
    """A value that names a label, in upper case; raises `AtRuntimeError` if it is known only at run time."""
    if not isinstance(value, str):
        raise AtRuntimeError
    return value.upper()


class SinumerikFlow(ProgramFlow[SinumerikUnit]):
    """The program flow of SINUMERIK.

    times  number of repetitions (P) of the current block; None if known only at run time
    """

    most_calls = 16
    too_deep = f"subprograms are nested more than {most_calls} deep"

    def __init__(self, control: Sinumerik, main: SinumerikUnit) -> None:
        super().__init__(main, control.budget)
        self.control = control
        self.times: int | None = 1

    # -- control structures -------------------------------------------------------------------------------------------

    def lowered(self, step: Branching, steps: Sequence[Branching], here: int) -> tuple[Operation, ...]:
        """The operations of a control structure or jump in block `here`; steps: all of that block."""
        unit, keyword = self.unit, step.keyword
        jump = next((each for each in steps if each.keyword.startswith("goto")), None)
        if keyword.startswith("goto"):
            return (self._goto(step, here),)
        if keyword == "if" and jump is not None:
            return (self._goto(jump, here, lambda: self.holds(step)),)
        if keyword == "case":
            value = step.values[0]
            choices = [each for each in steps if each.keyword.startswith(("of ", "default "))]
            chosen = (self._goto(each, here, partial(self._is_chosen, value, each)) for each in choices)
            return Let(lambda: decided(value(self.control))), *chosen
        if keyword in ("repeat", "repeatb") and step.label:
            return (self._section(step, here),)

        self._check_whole(here)

        def past() -> int:
            return unit.others.get(here, unit.end_of(here, keyword)) + 1

        match keyword:
            case "if" | "while":
                return (Jump(past, lambda: not self._goes_in(step, here)),)
            case "for":
                return (
                    Let(lambda: self._assign(step, step.values[1](self.control), 0.0)),
                    Jump(past, lambda: not self._goes_in(step, here)),
                )
            case "repeat":
                return (Let(lambda: unit.end_of(here, keyword)),)
            case "else":
                return (Jump(past),)
            case "endwhile" | "endloop":
                return (Jump(lambda: unit.begin_of(here, keyword)),)
            case "until":
                return (Jump(lambda: unit.begin_of(here, keyword) + 1, lambda: self._goes_on(step, here)),)
            case "endfor":
                return (Jump(lambda: unit.begin_of(here, keyword) + 1, lambda: self._next(here)),)
        return ()

    def _check_whole(self, here: int) -> None:
        """Raise `Fault` if a part of the block's structure is deleted by block skip: the control may not find it."""
        unit = self.unit
        for block in unit.parts_of(here) if unit.some_deletable else ():
            skip = unit.plan(block).skip
            if skip is not None and self.control.is_deleted(skip):
                raise Fault(BROKEN, SKIPPED_PART)

    def holds(self, step: Branching) -> bool:
        """Whether the condition of a step holds; raises `AtRuntimeError`."""
        return decided(step.values[0](self.control)) != 0.0

    def _goes_in(self, step: Branching, here: int) -> bool:
        """Whether the body of a structure is executed; FOR: while its variable does not exceed the last value."""
        if step.keyword == "for":
            value, last = step.values[0](self.control), step.values[2](self.control)
            self.unit.end_of(here, "for")
            return decided(value) <= decided(last)
        if step.keyword == "while":
            self.unit.end_of(here, "while")
        holds = self.holds(step)
        self.unit.end_of(here, step.keyword)
        return holds

    def _goes_on(self, step: Branching, here: int) -> bool:
        """Whether the loop of an UNTIL is repeated."""
        self.unit.begin_of(here, step.keyword)
        return not self.holds(step)

    def _next(self, here: int) -> bool:
        """At ENDFOR, increment the variable; whether the loop is repeated."""
        begin = self.unit.begin_of(here, "endfor")
        self.control.first = self.unit.first[begin]
        loop = next(each for each in self.unit.branchings(begin) if each.keyword == "for")
        self._assign(loop, loop.values[0](self.control), 1.0)
        return self._goes_in(loop, begin)

    def _assign(self, loop: Branching, value: Value, step: float) -> None:
        """Set the variable of a FOR loop to `value` plus `step`."""
        key = self.key_of(loop.written[0])
        if key is None:
            raise AtRuntimeError
        self.control.variables.assign(key, decided(value) + step)

    def _is_chosen(self, value: Evaluate, choice: Branching) -> bool:
        if choice.keyword.startswith("default "):
            return True
        return decided(choice.values[0](self.control)) == number(value(self.control))

    def _goto(self, step: Branching, here: int, when: Callable[[], bool] | None = None) -> Jump:
        """The jump of GOTO, GOTOF, GOTOB, GOTOC or GOTOS, under the condition `when`."""
        unit, keyword = self.unit, step.keyword.rpartition(" ")[2]

        def target() -> int | None:
            label = step.label if step.composed is None else told(step.composed(self.control))
            found = unit.find(label, here, keyword)
            if found is None and self.control.variables.scope_of(label.lower()) is not None:
                label = told(self.control.variables.value(label.lower()))
                found = unit.find(label, here, keyword)
            if found is None and keyword != "gotoc":
                where = {"gotof": " further down", "gotob": " further up"}.get(keyword, "")
                raise Fault(NO_LABEL, f"there is no label {label}{where}")
            return found

        return Jump(unit.begin, when) if keyword == "gotos" else Jump(target, when, out=True)

    def _section(self, step: Branching, here: int) -> Repeat:
        """The repetition of `REPEAT label`, `REPEAT first last` or `REPEATB label`."""
        unit = self.unit

        def start() -> int:
            return place(step.label)

        def place(label: str) -> int:
            found = unit.find(label, here, "goto")
            if found is None:
                raise Fault(NO_LABEL, f"there is no label {label}")
            return found

        def stop() -> int:
            if step.keyword == "repeatb":
                return start() + 1
            if step.values:
                return place(str(step.values[0](self.control))) + 1
            begin = start()
            return next((block for block in unit.labelled("ENDLABEL") if block > begin), here)

        def times() -> int:
            if self.times is None:
                raise AtRuntimeError
            return self.times

        return Repeat(start, times, stop)

    def stretch(self, name: str, find: Callable[[str], SinumerikUnit | None]) -> Stretch | None:
        """The blocks of a contour: a subprogram `NAME`, or those between labels `FIRST:LAST`; None if not found."""
        if labels := LABELS.fullmatch(name):
            here = self.block - 1
            start, last = (self.unit.find(label.upper(), here, "goto") for label in labels.groups())
            if start is None or last is None or start > last or start <= here <= last:
                return None
            return Stretch(self.unit, start, last + 1)
        unit = find(name) if name.isidentifier() else None
        return None if unit is None or unit is self.unit else Stretch(unit, unit.begin, unit.stop)

    def go_along(self, stretch: Stretch, name: str, leave: Callable[[], object]) -> None:
        """Execute a stretch of blocks like a subprogram; `leave` is called at its end."""
        self.enter(OpenCall(name, (stretch.unit, stretch.start), leave=leave))
        self.sections.append(Section(stretch.start, stretch.stop, stretch.unit.stop, 1))

    # -- variables ----------------------------------------------------------------------------------------------------

    def let(self, step: AssignedVariable) -> None:
        """Execute an assignment to a variable."""
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
        """The variable that an expression names; None if it names none."""
        match expression:
            case NamedParameter(name):
                return name
            case NumberedParameter(index):
                place = number(compiled(index)(self.control))
                return None if place is None else ("r", (place,))
        return None

    # -- calls --------------------------------------------------------------------------------------------------------

    def called(
        self, unit: SinumerikUnit, arguments: Sequence[Evaluate], written: Sequence[Expression | None], times: int
    ) -> OpenCall[SinumerikUnit] | None:
        """The call of a subprogram with arguments; None if it is executed no times."""
        self.check_depth(unit.name)
        if times < 1:
            return None
        self.budget.foresee(times)
        control = self.control
        values: list[Value] = [argument(control) for argument in arguments]
        variables, local = control.variables, Local()
        results: dict[str, Key] = {}
        for place, parameter in enumerate(unit.parameters):
            given = place < len(values) and written[place] is not None
            local.kinds[parameter.name] = parameter.kind
            local.values[parameter.name] = of_kind(parameter.kind, values[place] if given else parameter.left_out)
            key = self.key_of(written[place]) if given else None
            if parameter.is_array:
                name = key if isinstance(key, str) else ""
                source = variables.scope_of(name)
                local.kinds[parameter.name] = source.kinds[name] if source else ""
                local.sizes[parameter.name] = source.sizes.get(name, ()) if source else ()
                local.values |= renamed(source.values if source else {}, name, parameter.name)
            if parameter.by_reference and key is not None:
                results[parameter.name] = key
        saved = (copy.copy(control.modal), copy.copy(control.modes), control.frames) if unit.saves else None

        def leave() -> None:
            variables.scopes.pop()
            for name, theirs in results.items():
                if name not in local.sizes:
                    variables.assign(theirs, local.values.get(name, Unknown()))
                elif not local.kinds[name]:
                    variables.forget(name_of(theirs))
                else:
                    for key, value in renamed(local.values, name, name_of(theirs)).items():
                        variables.assign(key, value)
            if saved is not None:
                control.restore(*saved)
                set_length(control)

        variables.scopes.append(local)
        return OpenCall(unit.name, (unit, unit.begin), times - 1, leave=leave)

    def finish(self, kind: str = "", *, again: bool = True) -> None:
        """See `ProgramFlow`; a finished subprogram counts as one block of the budget."""
        self.budget.spend(1 if self.calls else 0)
        super().finish(kind, again=again)
