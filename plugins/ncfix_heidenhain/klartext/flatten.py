"""Writing out a Klartext program flat: the blocks as they are executed, without formulas, labels, calls or jumps.

Blocks with only plain words are copied, without their block number. A formula whose value is known only at run time
stays; a jump that depends on such a value cannot be written out.
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

MIN_DECIMALS = 4
"""The fewest decimals of positions; more where the least increment of an axis is smaller."""

OTHER_DECIMALS = 6
"""Decimals of all other numbers: angles of planes, factors, Q parameters."""

UNSIGNED = "FS"
"""First letters of addresses whose numbers are written without a sign."""

PATTERN_CYCLES = (f"cycl def {ON_CIRCLE}", f"cycl def {ON_LINES}")
SHARED = ("Q200", "Q203", "Q204")
"""Parameters of the drilling cycle that a pattern cycle overwrites: clearance, surface, second clearance."""

NOT_WRITTEN = ("CALL PGM", "SEL PGM", "CALL SELECTED", "FN 14")


class KlartextFlattener(Flattener):
    """See `Flattener`; `style` says how numbers are written."""

    def __init__(self, control: KlartextControl, steps: Mapping[str, float], limit: int, style: Spelling) -> None:
        super().__init__(steps, limit)
        self.control, self.style = control, style

    def note(self, unit: KlartextUnit, block: int) -> None:
        """Write out a block that is about to be executed."""
        self.watch(unit, block)
        plan, control = unit.plan(block), self.control
        if plan.flow is not None or (plan.statement is not None and self.is_left_out(plan.statement)):
            return
        holes = self.holes(plan, control) or written_out(control, unit, block, self.point)
        text = "\n".join(holes) if holes else self.text(self.changes()).lstrip(" \t")
        for offset, part in enumerate(text.splitlines()):
            self.write(part.rstrip(), offset if not unit.external and not holes else 0)

    def holes(self, plan: KlartextPlan, control: KlartextControl) -> list[str]:
        """Blocks for the holes of a pattern, one by one; empty for other blocks, and where the holes are not known."""
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
        values = (self.style.short(nominal(parameters.get(name)), OTHER_DECIMALS) for name in shared)
        set_anew = [f"FN 0: {name} = {value}" for name, value in zip(shared, values, strict=True)]
        return [*set_anew, *(f"L {self.place(place)} R0 FMAX M99" for place in places)] if places else []

    def point(self, place: complex) -> str:
        """The words X and Y of a point of the working plane."""
        return f"X{self.written(place.real, 'X')} Y{self.written(place.imag, 'Y')}"

    def place(self, place: HolePosition) -> str:
        """The words X and Y of a hole."""
        return self.point(complex(place.x, place.y))

    def written(self, value: float, address: str) -> str:
        """A number as it is written after an address."""
        return self.style.number(value, self.digits(address))

    def is_left_out(self, statement: tuple[str, Span]) -> bool:
        """Whether a statement is not written out: BEGIN and END PGM, calls of programs, and FN 14."""
        text = " ".join(self.unit.program.slice(self.block, statement[1]).upper().split())
        return statement[0] == "program" or text.startswith(NOT_WRITTEN)

    def word(self, word: Word) -> Change | None:
        """Replace the formula of a word by its number; drop the block number."""
        if word.address == "N":
            return self.dropped(word)
        if isinstance(word.value, (Literal, Constant, StringLiteral)):
            return None
        text = self.number(word.value, self.digits(word.address))
        if text is None:
            return None
        return self.replaced(word.value_span, text.lstrip("+") if word.address[0] in UNSIGNED else text)

    def assignment(self, item: Assignment) -> Change | None:
        """Replace the formula of an assignment by its value."""
        text = None if isinstance(item.value, (Literal, StringLiteral)) else self.number(item.value, OTHER_DECIMALS)
        name = self.unit.program.slice(self.block, item.span).split("=")[0].strip()
        return None if text is None else self.replaced(item.span, f"{name} = {text}")

    def digits(self, address: str) -> int:
        """The decimals with which the number of a word is written."""
        step = self.steps.get(address.removeprefix("I"))
        return OTHER_DECIMALS if step is None else max(MIN_DECIMALS, decimals_for(step))

    def number(self, value: Expression, digits: int) -> str | None:
        """The value of a formula as text; None where it is known only at run time."""
        found = compiled(value)(self.control.scope)
        if isinstance(found, Unknown):
            return None
        write = self.style.short if digits == OTHER_DECIMALS else self.style.number
        return write(nominal(found), digits)
