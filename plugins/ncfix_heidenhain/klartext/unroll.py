"""A Klartext program written out flat: every block as it is executed, numbers for formulas, no labels, calls or jumps.

Blocks that hold nothing but plain words go out as they stand, without their number. What is known only at run time
stays as it is; a jump that depends on it cannot be written out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ncfix.control.flat_lines import Change, FlatLines, changed
from ncfix.control.flatten import FlatLine
from ncfix.text.number_style import decimals_for
from ncfix.text.tree import Assignment, Constant, Expression, Literal, Opaque, Program, Span, Text, Word
from ncfix_heidenhain.klartext.calculate import Scope, compiled
from ncfix_heidenhain.klartext.contours import written_out
from ncfix_heidenhain.klartext.control import Control
from ncfix_heidenhain.klartext.cycles import DRILLING, MILLING
from ncfix_heidenhain.klartext.interpreter import KlartextInterpreter
from ncfix_heidenhain.klartext.number_text import Style
from ncfix_heidenhain.klartext.patterns import ON_CIRCLE, ON_LINES, Place, pattern_of_cycle
from ncfix_heidenhain.klartext.plans import Plan
from ncfix_heidenhain.klartext.units import KlartextUnit

LEAST = 4
"""Digits after the point of positions, as the control takes them; more where the least increment asks for it."""

OTHERS = 6
"""Of angles of planes, factors and Q parameters."""

UNSIGNED = "FS"
"""Addresses whose numbers have no sign."""

PATTERN_CYCLES = (f"cycl def {ON_CIRCLE}", f"cycl def {ON_LINES}")
SHARED = ("Q200", "Q203", "Q204")
"""What a pattern says anew of the cycle whose holes it makes: clearance, surface, second clearance."""

NOT_WRITTEN = ("CALL PGM", "SEL PGM", "CALL SELECTED", "FN 14")


@dataclass(slots=True)
class Recorder:
    """Writes down blocks as they are executed.

    main   the program that is written out
    steps  axis letter -> least increment
    style  of numbers
    out    the lines so far
    """

    main: Program
    steps: Mapping[str, float]
    style: Style
    out: FlatLines

    def note(self, unit: KlartextUnit, block: int, control: Control, row: int) -> None:
        """Write down a block that is about to be executed; `row` is the block of the main program that led to it."""
        plan = unit.plan(block)
        if plan.flow is not None or (plan.statement is not None and self.is_left_out(unit, block)):
            return
        holes = self.holes(plan, control) or written_out(control, unit, block, self.point)
        text = "\n".join(holes) if holes else self.flat_text(unit.program, block, control.scope)
        line = unit.program.line(block) if not unit.external else self.line_of_call(row)
        for offset, part in enumerate(text.splitlines()):
            self.out.write(part.rstrip(), line + (offset if not unit.external and not holes else 0))

    def holes(self, plan: Plan, control: Control) -> list[str]:
        """The holes of a pattern one by one; empty for other blocks, and where they are not known."""
        if plan.name == "cycl call pat" and control.cycle.places is not None:
            rate = "FMAX" if "fmax" in plan.flags else ""
            codes = " ".join(f"M{code}" for code, _ in plan.codes)
            texts = [
                f"CYCL CALL POS {self.place(place)} Z{self.written(place.height, 'Z')} {rate}"
                for place in control.cycle.places
            ]
            return [f"{texts[0]} {codes}".rstrip(), *texts[1:]]
        if plan.name not in PATTERN_CYCLES or control.cycle.number not in DRILLING | MILLING:
            return []
        parameters = replace(control.scope.parameters, values=dict(control.scope.parameters.values))
        scope = replace(control.scope, parameters=parameters)
        for name, value in plan.assignments:
            parameters.assign(name, value(scope))
        places = pattern_of_cycle(int(plan.name.removeprefix("cycl def ")), parameters) or ()
        shared = [name for name, _ in plan.assignments if name in SHARED]
        set_anew = [f"FN 0: {name} = {self.short(parameters.get(name))}" for name in shared]
        return [*set_anew, *(f"L {self.place(place)} R0 FMAX M99" for place in places)] if places else []

    def point(self, place: complex) -> str:
        """A point of the working plane as words."""
        return f"X{self.written(place.real, 'X')} Y{self.written(place.imag, 'Y')}"

    def place(self, place: Place) -> str:
        """Where a hole is, as words."""
        return self.point(complex(place.x, place.y))

    def written(self, value: float, address: str) -> str:
        """A number of a word."""
        return self.style.number(value, self.digits(address))

    def short(self, value: float) -> str:
        """A number without zeros at its end."""
        return self.style.number(value, OTHERS).rstrip("0").rstrip(".,")

    def line_of_call(self, row: int) -> int:
        """The line of the main program from which another one was called."""
        return self.main.line(row)

    def is_left_out(self, unit: KlartextUnit, block: int) -> bool:
        """Whether a statement is not written: program ends, and what only makes sense with labels and calls."""
        statement = unit.plan(block).statement
        assert statement is not None
        text = " ".join(unit.program.slice(block, statement[1]).upper().split())
        return statement[0] == "program" or text.startswith(NOT_WRITTEN)

    def flat_text(self, program: Program, block: int, scope: Scope) -> str:
        """The text of a block with numbers for its formulas, and without its number."""
        edits: list[Change] = []
        for item in program.items_of(block):
            if isinstance(item, Word) and item.address == "N":
                edits.append(Change(*program.span(block, item.span)))
            elif isinstance(item, Word) and not isinstance(item.value, (Literal, Constant, Text)):
                found = self.number(program, block, item.value_span, item.value, scope, self.digits(item.address))
                unsigned = item.address[0] in UNSIGNED
                edits += [each._replace(text=each.text.lstrip("+")) if unsigned else each for each in found]
            elif isinstance(item, Assignment) and not isinstance(item.value, (Literal, Text)):
                found = self.number(program, block, item.span, item.value, scope, OTHERS)
                name = program.slice(block, item.span).split("=")[0].strip()
                edits += [each._replace(text=f"{name} = {each.text}") for each in found]
        return changed(program, block, edits).lstrip(" \t")

    def digits(self, address: str) -> int:
        """Digits after the point of a word."""
        step = self.steps.get(address.removeprefix("I"))
        return OTHERS if step is None else max(LEAST, decimals_for(step))

    def number(
        self, program: Program, block: int, span: Span, value: Expression, scope: Scope, digits: int
    ) -> list[Change]:
        """The change that puts a number in the place of a formula; none where it is known only at run time."""
        found, at_runtime = scope.value_of(compiled(value))
        if at_runtime:
            return []
        text = self.short(found) if digits == OTHERS else self.style.number(found, digits)
        return [Change(*program.span(block, span), text)]


def unrolled(
    interpreter: KlartextInterpreter, steps: Mapping[str, float], limit: int, comma: bool
) -> Sequence[FlatLine]:
    """Follow a program and write down its blocks; raises SourceError NCF237 and NCF238."""
    recorder = Recorder(interpreter.main.program, steps, Style(comma), FlatLines(limit))
    interpreter.recorder = recorder
    interpreter.run()
    program = interpreter.main.program
    first = next(block for block in program if "BEGIN" in program.text_of(block).upper())
    last = len(program) - 1
    names = [
        program.slice(block, item.span)
        for block in (first, last)
        for item in program.items_of(block)
        if isinstance(item, Opaque) and item.kind == "program"
    ]
    head = FlatLine(names[0], program.line(first))
    tail = FlatLine(names[0].upper().replace("BEGIN", "END", 1), program.line(last))
    return [head, *recorder.out.lines, tail]
