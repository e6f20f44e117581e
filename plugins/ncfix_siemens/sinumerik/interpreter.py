"""The walk through a program of SINUMERIK: block after block, as control structures and calls lead."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import reduce
from operator import or_

import numpy as np

from ncfix.control.coordinates import mask_of
from ncfix.control.expressions import number
from ncfix.control.flatten import RUNTIME
from ncfix.control.flow import Call
from ncfix.control.interpreter import Interpreter
from ncfix.control.moves import Moves
from ncfix.control.setup import Run
from ncfix.control.trace import NotInPartsError
from ncfix.diagnostics import Place, SourceError
from ncfix.text.tree import Program
from ncfix_siemens.sinumerik.flatten import SinumerikFlattener
from ncfix_siemens.sinumerik.flow import AtRuntimeError, SinumerikFlow
from ncfix_siemens.sinumerik.motion import is_harmless
from ncfix_siemens.sinumerik.orientation import leads_along, run_vectors
from ncfix_siemens.sinumerik.plans import Branching, Calling, Letting, SinumerikPlan, is_statement
from ncfix_siemens.sinumerik.scanning import all_or_none
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.statements import Turn, act, call_word, finish_block, ran_elsewhere, say
from ncfix_siemens.sinumerik.undecided import (
    BY_THEMSELVES,
    DECIDED_AT_RUNTIME,
    bypassed,
    demoted,
    let_axis_go,
    note_letting,
    sweep,
)
from ncfix_siemens.sinumerik.unit import HEAD, PROCEDURE, SinumerikUnit, units_of
from ncfix_siemens.sinumerik.values import BlockWordValues

NOT_UNDERSTOOD = "NCF250"
SYNCHRONOUS = "NCF251"
PROGRAM_ENDS = frozenset({20, 300, 170})
TOOL_CHANGE = re.compile(rb"(?im)^[^;\n]*(?<![A-Z0-9_])M[ \t]*=[ \t]*0*6(?![\d.])")
PERHAPS = re.compile(rb"[Mm][ \t]*=[ \t]*0*6")
"""What `TOOL_CHANGE` finds has this in it, which is found sooner."""


def changes_tools(plans: Iterable[SinumerikPlan], source: bytes) -> bool:
    """Whether a text has an M6, so that T by itself changes no tool."""
    return any(60 in plan.m for plan in plans) or bool(PERHAPS.search(source) and TOOL_CHANGE.search(source))


def begins_a_program(unit: SinumerikUnit) -> bool:
    """Whether a program or procedure begins in a text."""
    shapes = [shape for shape, plan in enumerate(unit.all_plans()) if "program head" in plan.opaque]
    texts = map(unit.program.text_of, unit.blocks_of(shapes))
    return any(HEAD.match(text) or PROCEDURE.search(text) for text in texts)


class SinumerikInterpreter(Interpreter[SinumerikUnit]):
    """Follows one program.

    at_once  T by itself changes the tool; `called`: one has been called
    again    the first block that may be executed again after a branch that is decided at run time
    """

    control: Sinumerik
    flow: SinumerikFlow
    watcher: SinumerikFlattener | None

    def __init__(self, control: Sinumerik, program: Program, run: Run, *, in_parts: bool = False) -> None:
        super().__init__(control, program, run, in_parts=in_parts)
        units = units_of(program)
        if in_parts and len(units) > 1:
            raise NotInPartsError("the text holds several programs")
        self.main = units[0]
        self.files |= {unit.name: unit for unit in units[1:] if unit.name}
        self.flow = SinumerikFlow(control, self.main)
        self.again: int | None = None
        self.at_once = not changes_tools(self.main.all_plans(), program.source)
        self.called = False
        control.solitary = frozenset(block for unit in units for block in unit.solitary())
        for parameter in self.main.parameters:
            control.variables.scopes[0].kinds[parameter.name] = ""

    def place(self) -> Place:
        """Where in the program we are."""
        unit, block = self.flow.unit, self.flow.block - 1
        return unit.program.place(max(block, unit.begin), self.span)

    def find(self, name: str) -> SinumerikUnit | None:
        """A subprogram: in this text, or in a file of its own."""
        key = name.upper()
        self.files[key] = found = self.files[key] if key in self.files else super().find(name)
        return found

    def spellings(self, name: str) -> Iterable[str]:
        """See `Interpreter`."""
        upper, lower = name.upper(), name.lower()
        return name, upper, lower, f"{upper}.SPF", f"{lower}.spf", f"{upper}.MPF"

    def text_of_file(self, source: bytes, name: str, spelling: str) -> SinumerikUnit:
        """See `Interpreter`."""
        return units_of(self.read(source, name), external=name)[0]

    @property
    def changes(self) -> int:
        """See `Interpreter`."""
        return self.control.variables.changes

    def end_of_text(self) -> bool:
        """The end of a subprogram returns, too."""
        if self.flow.calls:
            self.flow.finish()
            return True
        return False

    def next_part(self, program: Program, blocks: int) -> None:
        """See `Interpreter`."""
        super().next_part(program, blocks)
        if begins_a_program(self.main):
            raise NotInPartsError("the text holds several programs")
        if self.control.modes.modal_cycle is not None:
            raise NotInPartsError("a cycle (MCALL) goes on in the next part, whose motions are those of its block")
        if self.at_once and changes_tools(self.main.all_plans(), program.source):
            if self.called:
                raise NotInPartsError("there is an M6 only further down")
            self.at_once = False

    def walk(self) -> bool:
        """See `Interpreter`; what follows a branch that is decided at run time is refused."""
        try:
            return super().walk()
        except AtRuntimeError:
            if self.in_parts:
                raise NotInPartsError("what is executed is decided at run time") from None
            if self.watcher is not None:
                raise SourceError.of(RUNTIME, DECIDED_AT_RUNTIME, self.place()) from None
            self.again = sweep(self.flow)
            return True

    def moves(self) -> Moves:
        """The motions of the program, when it has been followed."""
        return all_or_none(demoted(self.control.moves(), self.again), self.main.program)

    def run_lane(self, unit: SinumerikUnit, block: int, plan: SinumerikPlan) -> int:
        """See `Interpreter`; blocks that point the tool go in a lane of their own."""
        if plan.vector is None:
            return super().run_lane(unit, block, plan)
        return run_vectors(self.control, unit, block, not unit.external)

    def lane_is_open(self, plan: SinumerikPlan) -> bool:
        """See `Interpreter`."""
        control = self.control
        if plan.lane is None or self.watcher is not None:
            return False
        if (control.modal.incremental and control.counted != control.footing) or control.cornered:
            return False
        modes = control.modes
        busy = control.at_start or modes.carried or modes.modal_cycle or modes.rounds or self.flow.sections
        return not (busy or control.lost or control.over or modes.diameter == "DIAM90" or leads_along(control))

    def note_stretch(self, unit: SinumerikUnit, block: int, done: int) -> None:
        """See `Interpreter`: the axes that these blocks have named have been brought somewhere."""
        control = self.control
        control.fresh_tool = False
        if control.counted != control.footing:
            shapes = np.unique(unit.program.template[block : block + done])
            plans = [unit.plan_of_shape(shape) for shape in shapes.tolist()]
            named = reduce(or_, (plan.axes for plan in plans))
            if any(plan.vector is not None for plan in plans):
                named |= mask_of(control.turning)
            control.count_from_here(named)
        control.head_as_latest()

    # -- one block ----------------------------------------------------------------------------------------------------

    def execute(self, plan: SinumerikPlan, unit: SinumerikUnit, block: int) -> bool:
        """Execute a block; True if the program ends there."""
        control, flow = self.control, self.flow
        if plan.opaque:
            self.opaque(plan, unit.program.text_of(block))
        words = self.evaluate(plan, block)
        control.enter_block(words.values)
        turn = Turn(words, plan, self.at_once)
        for step in plan.steps:
            self.span = step.span
            match step:
                case Letting(name) if name in BY_THEMSELVES:
                    let_axis_go(control, turn, step)
                case Letting():
                    note_letting(control, turn, step)
                    flow.let(step)
                case Calling():
                    act(control, turn, step, self.find)
                case Branching():
                    continue
        self.span = None
        if turn.subprogram is None:
            call_word(control, turn, self.find)
        if self.watcher is not None:
            self.watcher.record(unit, block, turn, main=not flow.calls)
        finish_block(control, turn)
        if turn.elsewhere:
            ran_elsewhere(control, turn.elsewhere, changes_tool=control.tools.selected != 0)
        return self.go_on(plan, turn, unit, block)

    def go_on(self, plan: SinumerikPlan, turn: Turn, unit: SinumerikUnit, block: int) -> bool:
        """Where the block leads: into a subprogram, to the end, by a jump, or on. True if the program ends."""
        flow, called = self.flow, turn.subprogram
        if called is not None:
            flow.follow((Call(lambda: flow.called(called, turn.arguments, turn.written, turn.times)),))
            return False
        steps = [step for step in plan.steps if isinstance(step, Branching)]
        if steps:
            if block not in unit.operations:
                unit.operations[block] = [flow.lowered(step, steps, block) for step in steps]
            flow.times = None if turn.words.runtime("P") else round(turn.words.get("P", 1.0))
        for step, lowered in zip(steps, unit.operations[block] if steps else (), strict=True):
            self.span = step.span
            try:
                goes_on = flow.follow(lowered)
            except AtRuntimeError:
                if self.watcher is not None or not bypassed(self.control, flow, step, steps):
                    raise
                goes_on = False
            if not goes_on or step.keyword in ("if", "case"):
                break
        if turn.ends or not PROGRAM_ENDS.isdisjoint(turn.m):
            flow.finish()
        return flow.ended

    def opaque(self, plan: SinumerikPlan, text: str) -> None:
        """Text that is no motion, or that nobody understands."""
        control = self.control
        if is_statement(plan):
            why = f"the block {say(text)} is not understood, and may move axes or change coordinates"
            control.refusal = control.refusal or why
            control.warn(NOT_UNDERSTOOD, control.refusal, "all motions after it are refused")
        if "synchronized" in plan.opaque and not is_harmless(text):
            why = f"the synchronized action {say(text)} may move axes"
            control.refusal = control.refusal or why
            control.warn(SYNCHRONOUS, control.refusal, "all motions after it are refused")

    def evaluate(self, plan: SinumerikPlan, index: int) -> BlockWordValues:
        """The values of the words of a block."""
        values: dict[str, float | None] = {}
        texts: dict[str, str] = {}
        forms: dict[str, str] = {}
        control = self.control
        for setting in plan.settings:
            self.span = setting.span
            value, address = setting.value(control), "T" if setting.address == "T1" else setting.address
            if isinstance(value, str) and address == "T":
                texts[address] = value
                continue
            values[address] = number(value)
            if setting.form:
                forms[address] = setting.form
        self.span = None
        self.called |= "T" in values or "T" in texts
        return BlockWordValues(index, values, forms, plan.axes, texts)
