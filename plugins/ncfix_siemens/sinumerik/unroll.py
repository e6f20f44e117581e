"""Blocks of SINUMERIK written down as they are executed, for a flat program.

A block goes out as it stands, without its number and labels. Expressions give way to their values; definitions,
assignments to what they define, control structures, calls of subprograms and their heads fall away. What others may
read, R parameters, global data and those of the control, is set as it was.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from ncfix.control.coordinates import LETTERS
from ncfix.control.faults import Fault
from ncfix.control.flat_lines import Change, FlatLines, changed
from ncfix.control.flatten import RUNTIME
from ncfix.text.number_style import decimals_for
from ncfix.text.tree import (
    Assignment,
    Call,
    Command,
    Constant,
    Expression,
    Flow,
    Item,
    Literal,
    NamedParameter,
    Opaque,
    Parameter,
    Span,
    Text,
    Unary,
    Word,
)
from ncfix_siemens.sinumerik.patterns import PATTERNS
from ncfix_siemens.sinumerik.plans import ANY_PARAMETER, Calling, Letting, names_in
from ncfix_siemens.sinumerik.render import FORM
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.statements import Turn
from ncfix_siemens.sinumerik.unit import SinumerikUnit
from ncfix_siemens.sinumerik.values import number
from ncfix_siemens.sinumerik.variables import Variables, key_of
from ncfix_siemens.sinumerik.vocabulary import FORMS, HARMLESS

OTHER_DECIMALS = 5
"""Of words that are no axes."""

MORE_DECIMALS = 2
"""More than the least increment needs, so that increments do not add up to one."""

ENDS = frozenset({2.0, 17.0, 30.0})
"""M codes with which a subprogram ends."""


@dataclass(slots=True)
class Recorder:
    """Writes blocks down.

    steps  axis letter -> least increment of its axis, mm or degree
    out    the lines so far
    """

    steps: Mapping[str, float]
    out: FlatLines

    def record(self, scope: Sinumerik, unit: SinumerikUnit, block: int, turn: Turn, *, main: bool, line: int) -> None:
        """Write a block down as it is executed."""
        changes = []
        for item in unit.plan(block).template.items:
            new = self.rewritten(scope, item, turn, main=main)
            if new is not None:
                first, last = unit.program.span(block, new[0])
                words = new[1]
                if words is None:
                    words = self.number(item, turn, unit.program.slice(block, new[0]))
                changes.append(Change(first, last, words))
        text = changed(unit.program, block, changes).strip()
        if text.split(";")[0].strip() or (main and text):
            self.out.write(text, line)
        for point in scope.pattern[1:]:
            self.out.write(self.place(scope, point), line)
        scope.pattern = ()

    def rewritten(self, scope: Sinumerik, item: Item, turn: Turn, *, main: bool) -> tuple[Span, str | None] | None:
        """The stretch of an item that changes and what it becomes (None: a number); None where the item stays."""
        match item:
            case Flow():
                return item.span, ""
            case Assignment():
                return self.assignment(scope, item, turn)
            case Word():
                return self.word(item, turn, main=main)
            case Command():
                return self.command(scope, item, turn)
            case Opaque() if item.kind in ("program head", "external") and not (main and is_head(turn)):
                return item.span, ""
        return None

    def word(self, word: Word, turn: Turn, *, main: bool) -> tuple[Span, str | None] | None:
        """What becomes of a word."""
        repeats = any(getattr(step, "keyword", "").startswith("repeat") for step in turn.plan.steps)
        dropped = word.address in ("N", ":") or (word.address == "P" and (turn.subprogram is not None or repeats))
        dropped |= word.address == "L" and turn.subprogram is not None
        dropped |= word.address == "M" and not main and isinstance(word.value, Constant) and word.value.value in ENDS
        if dropped:
            return word.span, ""
        return None if is_plain(word.value) else (word.value_span, None)

    def assignment(self, scope: Sinumerik, item: Assignment, turn: Turn) -> tuple[Span, str | None] | None:
        """What becomes of an assignment; the block has been executed, so the variable has its value already."""
        step = next(step for step in turn.plan.steps if isinstance(step, Letting) and step.span == item.span)
        variables = scope.variables
        if variables.scope_of(step.name) is not None:
            return item.span, ""
        parts = indices(item.target)
        if is_plain(item.value) and all(map(is_index, parts)):
            return None
        places = [number(part(scope)) for part in step.index]
        known = tuple(place for place in places if place is not None)
        value = variables.value((step.name, known) if known else step.name)
        if value is None and not any(has_value(variables, name) for name in names_in(item.value)):
            return None
        if value is None or len(known) < len(places) or step.value is None:
            raise Fault(RUNTIME, f"what {step.name.upper()} is set to is known only at run time")
        return item.span, f"{self.target(step.name, known)}={assigned(value)}"

    def target(self, name: str, places: tuple[float, ...]) -> str:
        """What gets a value, as it is written."""
        if name == "r":
            return f"R{places[0]:.0f}"
        return name.upper() + (f"[{','.join(written(place, 0) for place in places)}]" if places else "")

    def number(self, item: Item, turn: Turn, text: str) -> str:
        """The value of a computed word as it is written, within its brackets if it has a form."""
        assert isinstance(item, Word)
        if item.address in turn.words.texts:
            return f'"{turn.words.texts[item.address]}"'
        value = turn.words.values.get(item.address)
        if value is None:
            raise Fault(RUNTIME, f"the value of {item.address} is known only at run time")
        step = self.steps.get(item.address)
        digits = OTHER_DECIMALS if step is None else decimals_for(step) + MORE_DECIMALS
        shown = written(value, digits)
        found = FORM.match(text) if isinstance(item.value, Call) and item.value.name in FORMS else None
        return shown if found is None else text[: found.start("value")] + shown + text[found.end("value") :]

    def place(self, scope: Sinumerik, point: tuple[float, float]) -> str:
        """The rapid to a place of a pattern of holes."""
        letters = [LETTERS[index] for index in (scope.modal.plane.first, scope.modal.plane.second)]
        digits = [decimals_for(self.steps[letter]) + MORE_DECIMALS for letter in letters]
        words = zip(letters, point, digits, strict=True)
        return " ".join(["G0", *(f"{letter}{written(value, places)}" for letter, value, places in words)])

    def command(self, scope: Sinumerik, command: Command, turn: Turn) -> tuple[Span, str | None] | None:
        """What becomes of a name."""
        if command.name in ("def", "ret") or (turn.called is not None and turn.called.span == command.span):
            return command.span, ""
        if command.name in PATTERNS and scope.pattern:
            return command.span, self.place(scope, scope.pattern[0])
        if all(part is None or is_plain(part) for part in command.arguments):
            return None
        step = next(step for step in turn.plan.steps if isinstance(step, Calling) and step.span == command.span)
        values = [
            None if part is None else value(scope) for value, part in zip(step.arguments, step.written, strict=True)
        ]
        if all(value is not None or part is None for value, part in zip(values, step.written, strict=True)):
            return command.span, f"{command.name.upper()}({','.join(map(argument, values))})"
        if command.name in HARMLESS:
            return command.span, ""
        raise Fault(RUNTIME, f"an argument of {command.name.upper()} is known only at run time")


def is_plain(value: Expression) -> bool:
    """Whether a value is written as a number or text, in brackets perhaps."""
    match value:
        case Literal() | Constant() | Text():
            return True
        case Unary(operator, operand):
            return operator in "+-" and is_plain(operand)
        case Call(name, arguments, False):
            return name in FORMS and all(part is not None and is_plain(part) for part in arguments)
    return False


def indices(target: Parameter | NamedParameter | Call) -> tuple[Expression | None, ...]:
    """The indices of what gets a value."""
    match target:
        case Parameter(index):
            return (index,)
        case Call(_, arguments):
            return arguments
    return ()


def has_value(variables: Variables, name: str) -> bool:
    """Whether a name in an expression is, or may be, that of a variable whose value is known."""
    return name == ANY_PARAMETER or variables.value(key_of(name)) is not None


def is_index(value: Expression | None) -> bool:
    """Whether an index is written as it is: a number, or a name, as that of an axis."""
    return value is not None and (is_plain(value) or isinstance(value, NamedParameter))


def is_head(turn: Turn) -> bool:
    """Whether the block is the first line of a program of an archive, and no PROC."""
    return not turn.plan.steps


def argument(value: float | str | None) -> str:
    """An argument as it is written."""
    if value is None:
        return ""
    return f'"{value}"' if isinstance(value, str) else written(value, OTHER_DECIMALS)


def assigned(value: float | str) -> str:
    """A value that a variable gets, to all digits."""
    return f'"{value}"' if isinstance(value, str) else f"{value:.15g}".replace("e", "EX")


def written(value: float, digits: int) -> str:
    """A number without superfluous zeros."""
    text = re.sub(r"\.?0+$", "", f"{value:.{digits}f}") if digits else f"{value:.0f}"
    return "0" if text in ("-0", "") else text
