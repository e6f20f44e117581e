"""Flat SINUMERIK programs: blocks are written as they are executed.

A block is written unchanged but without number and labels. Expressions are replaced by their values. Definitions,
assignments to defined variables, control structures, calls of subprograms and their heads are dropped. R parameters,
global data and data of the control, which others may read, are still assigned.
"""

from __future__ import annotations

from collections.abc import Mapping

from ncfix.control.coordinates import LETTERS
from ncfix.control.expressions import Fault, Unknown, Value, number
from ncfix.control.flatten import Change, Flattener
from ncfix.control.interpreter import RUNTIME
from ncfix.text.spelling import decimals_for
from ncfix.text.tree import (
    Assignment,
    Command,
    Constant,
    Expression,
    FunctionCall,
    Literal,
    NamedParameter,
    NumberedParameter,
    Opaque,
    StringLiteral,
    Unary,
    Word,
)
from ncfix_siemens.sinumerik.cycles.drilling import PATTERNS
from ncfix_siemens.sinumerik.plans import AssignedVariable, Calling, has_value, names_in
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.statements import Turn
from ncfix_siemens.sinumerik.unit import SinumerikUnit
from ncfix_siemens.sinumerik.vocabulary import FORM, FORMS, HARMLESS
from ncfix_siemens.sinumerik.writing import BARE, OTHER_DECIMALS, argument

MORE_DECIMALS = 2
"""Decimals beyond the least increment, so that rounding errors of increments do not add up to one."""

ENDS = frozenset({2.0, 17.0, 30.0})
"""M codes with which a subprogram ends."""


class SinumerikFlattener(Flattener):
    """See `Flattener`.

    turn  the execution of the current block; main: it is in the main program
    """

    turn: Turn
    main: bool

    def __init__(self, control: Sinumerik, steps: Mapping[str, float], limit: int) -> None:
        super().__init__(steps, limit)
        self.control = control

    def record(self, unit: SinumerikUnit, block: int, turn: Turn, *, main: bool) -> None:
        """Write a block that is being executed."""
        self.watch(unit, block)
        self.turn, self.main = turn, main
        text = self.text(self.changes()).strip()
        if text.split(";")[0].strip() or (main and text):
            self.write(text)
        for point in self.control.pattern[1:]:
            self.write(self.place(point))
        self.control.pattern = ()

    def opaque(self, item: Opaque) -> Change | None:
        """The change of a head: those of subprograms are dropped."""
        leads = item.kind in ("program head", "external") and (not self.main or self.turn.plan.steps)
        return self.dropped(item) if leads else None

    def word(self, word: Word) -> Change | None:
        """The change of a word; None: it stays."""
        turn = self.turn
        repeats = any(getattr(step, "keyword", "").startswith("repeat") for step in turn.plan.steps)
        dropped = word.address in ("N", ":") or (word.address == "P" and (turn.subprogram is not None or repeats))
        dropped |= word.address == "L" and turn.subprogram is not None
        ends = isinstance(word.value, Constant) and word.value.value in ENDS
        if dropped or (word.address == "M" and not self.main and ends):
            return self.dropped(word)
        return None if is_plain(word.value) else self.replaced(word.value_span, self.number(word))

    def assignment(self, item: Assignment) -> Change | None:
        """The change of an assignment, whose variable already has its new value; None: it stays."""
        step = next(
            step for step in self.turn.plan.steps if isinstance(step, AssignedVariable) and step.span == item.span
        )
        variables = self.control.variables
        if variables.scope_of(step.name) is not None:
            return self.dropped(item)
        parts = indices(item.target)
        if is_plain(item.value) and all(map(is_index, parts)):
            return None
        places = [number(part(self.control)) for part in step.index]
        known = tuple(place for place in places if place is not None)
        value = variables.value((step.name, known) if known else step.name)
        if isinstance(value, Unknown) and not any(has_value(variables, name) for name in names_in(item.value)):
            return None
        if isinstance(value, Unknown) or len(known) < len(places) or step.value is None:
            raise Fault(RUNTIME, f"the value of {step.name.upper()} is known only at run time")
        return self.replaced(item.span, f"{self.target(step.name, known)}={assigned(value)}")

    def target(self, name: str, places: tuple[float, ...]) -> str:
        """The text of the target of an assignment."""
        if name == "r":
            return f"R{places[0]:.0f}"
        return name.upper() + (f"[{','.join(BARE.short(place, 0) for place in places)}]" if places else "")

    def number(self, word: Word) -> str:
        """The text of a computed word's value, within the brackets of its form if it has one."""
        words, text = self.turn.words, self.unit.program.slice(self.block, word.value_span)
        if word.address in words.texts:
            return f'"{words.texts[word.address]}"'
        value = words.values.get(word.address)
        if value is None:
            raise Fault(RUNTIME, f"the value of {word.address} is known only at run time")
        step = self.steps.get(word.address)
        digits = OTHER_DECIMALS if step is None else decimals_for(step) + MORE_DECIMALS
        shown = BARE.short(value, digits)
        found = FORM.match(text) if isinstance(word.value, FunctionCall) and word.value.name in FORMS else None
        return shown if found is None else text[: found.start("value")] + shown + text[found.end("value") :]

    def place(self, point: tuple[float, float]) -> str:
        """The rapid motion to a place of a pattern of holes."""
        plane = self.control.modal.plane
        letters = plane.of(LETTERS)
        digits = [decimals_for(self.steps[letter]) + MORE_DECIMALS for letter in letters]
        words = zip(letters, point, digits, strict=True)
        return " ".join(["G0", *(f"{letter}{BARE.short(value, places)}" for letter, value, places in words)])

    def command(self, command: Command) -> Change | None:
        """The change of a name; None: it stays."""
        turn, scope = self.turn, self.control
        if command.name in ("def", "ret") or (turn.called is not None and turn.called.span == command.span):
            return self.dropped(command)
        if command.name in PATTERNS and scope.pattern:
            return self.replaced(command.span, self.place(scope.pattern[0]))
        if all(part is None or is_plain(part) for part in command.arguments):
            return None
        step = next(step for step in turn.plan.steps if isinstance(step, Calling) and step.span == command.span)
        given = [
            "" if part is None else self.given(value(scope), part)
            for value, part in zip(step.arguments, step.written, strict=True)
        ]
        if all(text is not None for text in given):
            return self.replaced(command.span, f"{command.name.upper()}({','.join(map(str, given))})")
        if command.name in HARMLESS:
            return self.dropped(command)
        raise Fault(RUNTIME, f"an argument of {command.name.upper()} is known only at run time")

    def given(self, value: Value, written: Expression) -> str | None:
        """The text of an argument. A name that the program has not defined belongs to the control (_ORI_FINISH) and
        stays; None if the value is known only at run time.
        """
        if not isinstance(value, Unknown):
            return argument(value)
        if isinstance(written, NamedParameter) and self.control.variables.scope_of(written.name) is None:
            return written.name.upper()
        return None


def is_plain(value: Expression) -> bool:
    """Whether a value is a plain number or text, perhaps with sign or form."""
    match value:
        case Literal() | Constant() | StringLiteral():
            return True
        case Unary(operator, operand):
            return operator in "+-" and is_plain(operand)
        case FunctionCall(name, arguments, False):
            return name in FORMS and all(part is not None and is_plain(part) for part in arguments)
    return False


def indices(target: NumberedParameter | NamedParameter | FunctionCall) -> tuple[Expression | None, ...]:
    """The indices of the target of an assignment."""
    match target:
        case NumberedParameter(index):
            return (index,)
        case FunctionCall(_, arguments):
            return arguments
    return ()


def is_index(value: Expression | None) -> bool:
    """Whether an index needs no evaluation: a number, or a name such as that of an axis."""
    return value is not None and (is_plain(value) or isinstance(value, NamedParameter))


def assigned(value: float | str) -> str:
    """The text of an assigned value, with all digits."""
    return f'"{value}"' if isinstance(value, str) else f"{value:.15g}".replace("e", "EX")
