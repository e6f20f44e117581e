"""The walk through a program of SINUMERIK: block after block, as control structures and calls lead."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import partial, reduce
from operator import or_

import numpy as np

from ncfix.control.arc_lane import turned
from ncfix.control.faults import Fault
from ncfix.control.flatten import RUNTIME, FlatLine
from ncfix.control.lane import run_lane
from ncfix.control.moves import Moves
from ncfix.control.places import mask_of
from ncfix.control.recurrence import ENDLESS, NEVER_ENDS, Recurrence
from ncfix.diagnostics import Place, SourceError
from ncfix.text.reader import read
from ncfix.text.tree import Program, Span
from ncfix_siemens.sinumerik.bypass import bypassed
from ncfix_siemens.sinumerik.calling import call_word, ran_elsewhere
from ncfix_siemens.sinumerik.course import AtRuntimeError, Course
from ncfix_siemens.sinumerik.destination import Words
from ncfix_siemens.sinumerik.heading import note_stretch
from ncfix_siemens.sinumerik.increments import stand
from ncfix_siemens.sinumerik.lettings import BY_THEMSELVES, let_axis_go, note_letting
from ncfix_siemens.sinumerik.orientation import leads_along
from ncfix_siemens.sinumerik.plans import Branching, Calling, Letting, Plan, is_statement
from ncfix_siemens.sinumerik.poles import all_or_none
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.statements import Turn, act, finish_block, say
from ncfix_siemens.sinumerik.sweep import DECIDED_AT_RUNTIME, demoted, sweep
from ncfix_siemens.sinumerik.synchronous import is_harmless
from ncfix_siemens.sinumerik.unit import Unit, units_of
from ncfix_siemens.sinumerik.unroll import Recorder
from ncfix_siemens.sinumerik.vectors import run_vectors

NOT_UNDERSTOOD = "NCF250"
SYNCHRONOUS = "NCF251"
PROGRAM_ENDS = frozenset({20, 300, 170})
TOOL_CHANGE = re.compile(rb"(?im)^[^;\n]*(?<![A-Z0-9_])M[ \t]*=[ \t]*0*6(?![\d.])")
PERHAPS = re.compile(rb"[Mm][ \t]*=[ \t]*0*6")
"""What `TOOL_CHANGE` finds has this in it, which is found sooner."""


def changes_tools(plans: Iterable[Plan], source: bytes) -> bool:
    """Whether a text has an M6, so that T by itself changes no tool."""
    return any(60 in plan.m for plan in plans) or bool(PERHAPS.search(source) and TOOL_CHANGE.search(source))


class Interpreter:
    """Follows one program."""

    def __init__(
        self, control: Sinumerik, program: Program, resolve: Callable[[str], bytes | None] | None, max_blocks: int
    ) -> None:
        self.control = control
        self.resolve = resolve
        control.budget.left = max_blocks
        self.recurrence = Recurrence()
        self.units = units_of(program)
        self.files: dict[str, Unit | None] = {unit.name: unit for unit in self.units[1:] if unit.name}
        self.course = Course(control, self.units[0], self.units[0].begin)
        self.span: Span | None = None
        self.again: int | None = None
        self.recorder: Recorder | None = None
        control.locate = self.place
        self.at_once = not changes_tools(self.units[0].text.plans, program.source)
        control.solitary = frozenset(block for unit in self.units for block in unit.solitary())
        for parameter in self.units[0].parameters:
            control.variables.scopes[0].kinds[parameter.name] = ""

    def place(self) -> Place:
        """Where in the program we are."""
        unit, block = self.course.unit, self.course.block - 1
        return unit.program.place(max(block, unit.begin), self.span)

    def find(self, name: str) -> Unit | None:
        """A subprogram: in this text, or in a file of its own."""
        key = name.upper()
        if key not in self.files:
            self.files[key] = None
            spellings = dict.fromkeys((name, key, name.lower(), f"{key}.SPF", f"{name.lower()}.spf", f"{key}.MPF"))
            sources = (source for each in spellings if self.resolve and (source := self.resolve(each)))
            source = next(sources, None)
            if source:
                program = read(source, name, self.units[0].program.dialect)
                self.files[key] = units_of(program, external=name)[0]
        return self.files[key]

    def run(self) -> Moves:
        """Follow the program to its end; raises SourceError where the control would stop."""
        try:
            self.walk()
        except AtRuntimeError:
            self.again = sweep(self.course)
        except Fault as fault:
            raise self.error(fault) from None
        return all_or_none(demoted(self.control.moves(), self.again), self.units[0].program)

    def error(self, fault: Fault) -> SourceError:
        """What is wrong, with the place where it is."""
        self.span = fault.span or self.span
        return SourceError.of(fault.code, fault.text, self.place(), fault.hint)

    def unrolled(self, recorder: Recorder) -> list[FlatLine]:
        """The blocks of the program as they are executed; raises SourceError NCF237 where that is not known before."""
        self.recorder = recorder
        try:
            self.walk()
        except AtRuntimeError:
            raise SourceError.of(RUNTIME, DECIDED_AT_RUNTIME, self.place()) from None
        except Fault as fault:
            raise self.error(fault) from None
        return recorder.out.lines

    def walk(self) -> bool:
        """Block after block; whether the program ends before its text does."""
        course, control = self.course, self.control
        while True:
            course.turn_back()
            if course.block >= course.unit.stop:
                if not course.calls:
                    return False
                course.finish()
                continue
            plan, control.external = course.unit.plan(course.block), course.unit.external
            if plan.lane is not None and self.lane_is_open() and self.take_stretch(plan):
                continue
            unit, block = course.unit, course.block
            course.block += 1
            control.budget.spend(1)
            if self.execute(plan):
                return True
            if course.unit is unit and course.block <= block:
                self.look_round(block)

    def take_stretch(self, plan: Plan) -> bool:
        """Follow the plain motions that begin with a block of this plan many at once; whether there are any."""
        control, course = self.control, self.course
        unit, main = course.unit, not course.unit.external
        if plan.vector is None:
            done = run_lane(control, unit, course.block, main, partial(turned, control, unit))
        else:
            done = run_vectors(control, unit, course.block, main)
        if done:
            self.stand(done)
            course.block += done
            note_stretch(control)
            control.budget.spend(done)
        return done > 0

    def look_round(self, block: int) -> None:
        """A block has led back: raises `Fault` if the program goes round for ever."""
        course = self.course
        jump = id(course.unit), block, course.block, *course.under_way()
        if self.recurrence.seen(jump, self.control.variables.changes):
            course.block = block + 1
            raise Fault(ENDLESS, NEVER_ENDS)

    def lane_is_open(self) -> bool:
        """Whether plain motions may go many at a time."""
        control = self.control
        if self.recorder is not None or (control.modal.incremental and control.counted != control.footing):
            return False
        if control.cornered or control.modes.rounds:
            return False
        busy = control.at_start or control.modes.carried or control.modes.modal_cycle or self.course.sections
        return not (busy or control.lost or control.over or control.modes.diameter == "DIAM90" or leads_along(control))

    def stand(self, blocks: int) -> None:
        """The axes that these blocks have named have been brought somewhere."""
        control, unit, block = self.control, self.course.unit, self.course.block
        control.fresh_tool = False
        if control.counted != control.footing:
            shapes = np.unique(unit.program.template[block : block + blocks])
            plans = [unit.plan_of_shape(shape) for shape in shapes.tolist()]
            named = reduce(or_, (plan.axes for plan in plans))
            if any(plan.vector is not None for plan in plans):
                named |= mask_of(control.turning)
            stand(control, named, by_machine=False)

    # -- one block ----------------------------------------------------------------------------------------------------

    def execute(self, plan: Plan) -> bool:
        """Execute the block before `course.block`; True if the program ends there."""
        control, course = self.control, self.course
        unit, index = course.unit, course.block - 1
        control.numbers, control.first = unit.text.numbers, unit.text.first[index]
        self.span = None
        if not unit.external:
            control.row_block = index
        if plan.skip is not None and control.is_deleted(plan.skip):
            return False
        if plan.opaque:
            self.opaque(plan, unit.program.text_of(index))
        words = self.evaluate(plan, index)
        turn = Turn(words, plan, self.at_once)
        for step in plan.steps:
            self.span = step.span
            match step:
                case Letting(name) if name in BY_THEMSELVES:
                    let_axis_go(control, turn, step)
                case Letting():
                    note_letting(control, turn, step)
                    course.let(step)
                case Calling():
                    act(control, turn, step, self.find)
                case Branching():
                    continue
        self.span = None
        if turn.subprogram is None:
            call_word(control, turn, self.find)
        if self.recorder is not None:
            main, line = not course.calls, self.place().line
            self.recorder.record(control, unit, index, turn, main=main, line=line)
        finish_block(control, turn)
        if turn.elsewhere:
            ran_elsewhere(control, turn.elsewhere, changes_tool=control.tools.selected != 0)
        return self.go_on(plan, turn)

    def go_on(self, plan: Plan, turn: Turn) -> bool:
        """Where the block leads: into a subprogram, to the end, by a jump, or on. True if the program ends."""
        course = self.course
        if turn.subprogram is not None:
            course.call(turn.subprogram, turn.arguments, turn.written, turn.times)
            return False
        branchings = [step for step in plan.steps if isinstance(step, Branching)]
        for step in branchings:
            self.span = step.span
            if step.keyword in ("repeat", "repeatb") and step.label:
                if turn.words.runtime("P"):
                    raise AtRuntimeError
                course.repeat(step, round(turn.words.get("P", 1.0)))
            else:
                self.follow(step, plan)
            if step.keyword in ("if", "case"):
                break
        if turn.ends or not PROGRAM_ENDS.isdisjoint(turn.m):
            if not course.calls:
                return True
            course.finish()
        return False

    def follow(self, step: Branching, plan: Plan) -> None:
        """Do what a control structure says; raises `AtRuntimeError` where only the control knows, and it matters."""
        try:
            self.course.follow(step, plan.steps)
        except AtRuntimeError:
            if self.recorder is not None or not bypassed(self.control, self.course, step, plan.steps):
                raise

    def opaque(self, plan: Plan, text: str) -> None:
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

    def evaluate(self, plan: Plan, index: int) -> Words:
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
            values[address] = None if isinstance(value, str) else value
            if setting.form:
                forms[address] = setting.form
        self.span = None
        return Words(index, values, forms, plan.axes, texts)
