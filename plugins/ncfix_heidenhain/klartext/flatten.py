"""A Klartext program written out flat: every block as it is executed, numbers for formulas, no labels, calls or jumps.

Blocks that hold nothing but plain words go out as they stand, without their number. What is known only at run time
stays as it is; a jump that depends on it cannot be written out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ncfix.control.expressions import Unknown, nominal
from ncfix.control.flatten import Change, Flattener
from ncfix.text.spelling import Spelling, decimals_for
from ncfix.text.tree import Assignment, Constant, Expression, Literal, Span, StringLiteral, Word
from ncfix_heidenhain.klartext.contours import written_out
from ncfix_heidenhain.klartext.control import HolePosition, KlartextControl
from ncfix_heidenhain.klartext.cycles import DRILLING, MILLING, OLD, ON_CIRCLE, ON_LINES, pattern_of_cycle
from ncfix_heidenhain.klartext.plans import KlartextPlan, compiled
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


class KlartextFlattener(Flattener):
    """See `Flattener`; `style`: how numbers are written."""

    def __init__(self, control: KlartextControl, steps: Mapping[str, float], limit: int, style: Spelling) -> None:
        super().__init__(steps, limit)
        self.control, self.style = control, style

    def note(self, unit: KlartextUnit, block: int) -> None:
        """Write down a block that is about to be executed."""
        self.watch(unit, block)
        plan, control = unit.plan(block), self.control
        if plan.flow is not None or (plan.statement is not None and self.is_left_out(plan.statement)):
            return
        holes = self.holes(plan, control) or written_out(control, unit, block, self.point)
        text = "\n".join(holes) if holes else self.text(self.changes()).lstrip(" \t")
        for offset, part in enumerate(text.splitlines()):
            self.write(part.rstrip(), offset if not unit.external and not holes else 0)

    def holes(self, plan: KlartextPlan, control: KlartextControl) -> list[str]:
        """The holes of a pattern one by one; empty for other blocks, and where they are not known."""
        if plan.name == "cycl call pat" and control.cycle.places is not None:
            rate = "FMAX" if "fmax" in plan.flags else ""
            codes = " ".join(f"M{code}" for code, _ in plan.codes)
            texts = [
                f"CYCL CALL POS {self.place(place)} Z{self.written(place.height, 'Z')} {rate}"
                for place in control.cycle.places
            ]
            return [f"{texts[0]} {codes}".rstrip(), *texts[1:]]
        if plan.name not in PATTERN_CYCLES or control.cycle.number not in (DRILLING | MILLING) - OLD:
            return []
        parameters = replace(control.scope.parameters, values=dict(control.scope.parameters.values))
        scope = replace(control.scope, parameters=parameters)
        for name, value in plan.assignments:
            parameters.assign(name, value(scope))
        places = pattern_of_cycle(int(plan.name.removeprefix("cycl def ")), parameters) or ()
        shared = [name for name, _ in plan.assignments if name in SHARED]
        set_anew = [f"FN 0: {name} = {self.style.short(nominal(parameters.get(name)), OTHERS)}" for name in shared]
        return [*set_anew, *(f"L {self.place(place)} R0 FMAX M99" for place in places)] if places else []

    def point(self, place: complex) -> str:
        """A point of the working plane as words."""
        return f"X{self.written(place.real, 'X')} Y{self.written(place.imag, 'Y')}"

    def place(self, place: HolePosition) -> str:
        """Where a hole is, as words."""
        return self.point(complex(place.x, place.y))

    def written(self, value: float, address: str) -> str:
        """A number of a word."""
        return self.style.number(value, self.digits(address))

    def is_left_out(self, statement: tuple[str, Span]) -> bool:
        """Whether a statement is not written: program ends, and what only makes sense with labels and calls."""
        text = " ".join(self.unit.program.slice(self.block, statement[1]).upper().split())
        return statement[0] == "program" or text.startswith(NOT_WRITTEN)

    def word(self, word: Word) -> Change | None:
        """Numbers for formulas; the block's own number falls away."""
        if word.address == "N":
            return self.dropped(word)
        if isinstance(word.value, (Literal, Constant, StringLiteral)):
            return None
        text = self.number(word.value, self.digits(word.address))
        if text is None:
            return None
        return self.replaced(word.value_span, text.lstrip("+") if word.address[0] in UNSIGNED else text)

    def assignment(self, item: Assignment) -> Change | None:
        """The value for the formula."""
        text = None if isinstance(item.value, (Literal, StringLiteral)) else self.number(item.value, OTHERS)
        name = self.unit.program.slice(self.block, item.span).split("=")[0].strip()
        return None if text is None else self.replaced(item.span, f"{name} = {text}")

    def digits(self, address: str) -> int:
        """Digits after the point of a word."""
        step = self.steps.get(address.removeprefix("I"))
        return OTHERS if step is None else max(LEAST, decimals_for(step))

    def number(self, value: Expression, digits: int) -> str | None:
        """The number that a formula comes to; None where it is known only at run time."""
        found = compiled(value)(self.control.scope)
        if isinstance(found, Unknown):
            return None
        write = self.style.short if digits == OTHERS else self.style.number
        return write(nominal(found), digits)
