"""The interpreter of SINUMERIK programs, block by block as control structures and calls lead.

Also here: assignments to axes that move by themselves, to probing and to data of the control.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING

import numpy as np

from ncfix.control.coordinates import INDEX, LETTERS, mask_of
from ncfix.control.expressions import number
from ncfix.control.flow import Call
from ncfix.control.interpreter import RUNTIME, Interpreter
from ncfix.control.moves import MotionKind, Moves
from ncfix.control.setup import Run
from ncfix.control.trace import NotInPartsError
from ncfix.diagnostics import Place, RefusedError, SourceError
from ncfix.text.tree import Program
from ncfix_siemens.sinumerik.cycles.contour import mill_along
from ncfix_siemens.sinumerik.destination import destination
from ncfix_siemens.sinumerik.flow import AtRuntimeError, SinumerikFlow
from ncfix_siemens.sinumerik.motion import is_harmless, watch
from ncfix_siemens.sinumerik.orientation import leads_along, run_vectors
from ncfix_siemens.sinumerik.plans import (
    AssignedVariable,
    Branching,
    Calling,
    SinumerikPlan,
    is_statement,
)
from ncfix_siemens.sinumerik.runtime_branches import DECIDED_AT_RUNTIME, bypassed, decided_at_runtime, sweep
from ncfix_siemens.sinumerik.scanning import all_or_none
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.statements import (
    Turn,
    act,
    call_word,
    finish_block,
    function,
    lose_arguments,
    ran_elsewhere,
    say,
)
from ncfix_siemens.sinumerik.unit import HEAD, PROCEDURE, SinumerikUnit, units_of
from ncfix_siemens.sinumerik.vocabulary import (
    ASYNCHRONOUS,
    BY_THEMSELVES,
    COUPLING,
    GO_SOMEWHERE,
    MOTIONS,
    OF_THE_CONTROL,
    POLYNOMIAL,
    PROBING,
    UNFOLLOWED_MOTIONS,
    UNSEEN,
    BlockWordValues,
)

if TYPE_CHECKING:
    from ncfix_siemens.sinumerik.flatten import SinumerikFlattener

NOT_UNDERSTOOD = "NCF250"
SYNCHRONOUS = "NCF251"
MAIN = frozenset({"", "MPF"})
"""Kinds of main programs; SPF are subprograms, CYC and INI no programs to follow."""
CONTOUR = "the contour that {} mills must stay unchanged and cannot be written out flat"
PROGRAM_ENDS = frozenset({20, 300, 170})
TOOL_CHANGE = re.compile(rb"(?im)^[^;\n]*(?<![A-Z0-9_])M[ \t]*=[ \t]*0*6(?![\d.])")
PERHAPS = re.compile(rb"[Mm][ \t]*=[ \t]*0*6")
"""A part of every match of `TOOL_CHANGE`, whose search is faster."""

AFTER_POSITIONING = "the position of the axis {} after positioning by itself (POS) is not known"
POLYNOMIALS = UNFOLLOWED_MOTIONS[MOTIONS["poly"]]
SPINDLE = re.compile(r"S\d+")
DESELECTED = frozenset({"tcarr", "cutmod"})
"""Names whose value zero deactivates what other values activate; activation is refused."""


def changes_tools(plans: Iterable[SinumerikPlan], source: bytes) -> bool:
    """Whether a text has an M6, so that T alone does not change the tool."""
    return any(60 in plan.m for plan in plans) or bool(PERHAPS.search(source) and TOOL_CHANGE.search(source))


def begins_a_program(unit: SinumerikUnit) -> bool:
    """Whether a program or procedure begins in a text."""
    shapes = [shape for shape, plan in enumerate(unit.all_plans()) if "program head" in plan.opaque]
    texts = map(unit.program.text_of, unit.blocks_of(shapes))
    return any(HEAD.match(text) or PROCEDURE.search(text) for text in texts)


class SinumerikInterpreter(Interpreter[SinumerikUnit]):
    """The interpreter of one program.

    main     the program that is followed: the first main program of the text; others: its other programs
    at_once  T alone changes the tool; called: a tool has been called
    again    stretches of blocks that may be executed again after a branch decided at run time; why: its reason
    """

    control: Sinumerik
    flow: SinumerikFlow
    watcher: SinumerikFlattener | None

    def __init__(self, control: Sinumerik, program: Program, run: Run, *, in_parts: bool = False) -> None:
        super().__init__(control, program, run, in_parts=in_parts)
        units = units_of(program)
        if in_parts and len(units) > 1:
            raise NotInPartsError("the text holds several programs")
        self.main = next((unit for unit in units if unit.kind in MAIN), units[0])
        self.others = [unit for unit in units if unit is not self.main and unit.name]
        self.files |= {unit.name: unit for unit in self.others}
        self.flow = SinumerikFlow(control, self.main)
        self.again: list[tuple[int, int]] = []
        self.why = ""
        self.at_once = not changes_tools(self.main.all_plans(), program.source)
        self.called = False
        control.solitary = frozenset(block for unit in units for block in unit.solitary())
        for parameter in self.main.parameters:
            control.variables.scopes[0].kinds[parameter.name] = ""

    def place(self) -> Place:
        """The place of the current block in its program."""
        unit, block = self.flow.unit, self.flow.block - 1
        return unit.program.place(max(block, unit.begin), self.span)

    def find(self, name: str) -> SinumerikUnit | None:
        """The subprogram `name`, in this text or in a file of its own; None if there is none."""
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
        """See `Interpreter`: the end of the text of a subprogram returns to its caller."""
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
        """See `Interpreter`; after a branch decided at run time all motions are refused."""
        try:
            return super().walk()
        except AtRuntimeError:
            if self.in_parts:
                raise NotInPartsError("what is executed is decided at run time") from None
            if self.watcher is not None:
                raise SourceError.of(RUNTIME, DECIDED_AT_RUNTIME, self.place()) from None
            self.why = decided_at_runtime(self.flow)
            self.again = sweep(self.flow, self.others, self.why)
            return True

    def moves(self) -> Moves:
        """The motions of the program, when it has been followed."""
        moves = self.control.moves()
        for first, stop in self.again:  # these may be executed again from another state
            moves = moves.refused((first <= moves.block) & (moves.block < stop), self.why)
        return all_or_none(moves, self.main.program)

    def run_lane(self, unit: SinumerikUnit, block: int, plan: SinumerikPlan) -> int:
        """See `Interpreter`; blocks with tool vectors have a lane of their own."""
        if plan.vector is not None:
            return run_vectors(self.control, unit, block, not unit.external)
        control, first = self.control, self.control.builder.count
        ways = dict(unit.shortest_ways(block, unit.lane_end(block)))
        if not all(control.goes_to_number(letter, angle) for letter, angle in ways.items()):
            return 0
        done = super().run_lane(unit, block, plan)
        if ways and done:
            control.builder.says_the_way(mask_of(ways), control.builder.count - first, first)
        return done

    def lane_is_open(self, plan: SinumerikPlan) -> bool:
        """See `Interpreter`."""
        control = self.control
        if plan.lane is None or self.watcher is not None:
            return False
        if (control.modal.incremental and control.counted != control.footing) or control.cornered:
            return False
        modes = control.modes
        busy = control.at_start or modes.carried or modes.modal_cycle or modes.rounds or self.flow.sections
        by_block = control.acting or control.contour or modes.by_block
        return not (
            busy or by_block or control.unknown or control.over or modes.diameter == "DIAM90" or leads_along(control)
        )

    def note_stretch(self, unit: SinumerikUnit, block: int, done: int) -> None:
        """See `Interpreter`: increments of the axes named in these blocks now count from the frames in force."""
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
        """Execute a block; whether the program ends there."""
        control, flow = self.control, self.flow
        if plan.opaque:
            self.opaque(plan, unit.program.text_of(block))
        words = self.evaluate(plan, block)
        control.enter_block(words.values)
        turn = Turn(words, plan, self.at_once)
        for step in plan.steps:
            self.span = step.span
            match step:
                case AssignedVariable(name) if name in BY_THEMSELVES:
                    let_axis_go(control, turn, step)
                case AssignedVariable():
                    note_letting(control, turn, step)
                    flow.let(step)
                case Calling():
                    act(control, turn, step, self.find)
                case Branching():
                    continue
        for called in plan.functions:
            function(control, turn, called)
        self.span = None
        if turn.subprogram is None:
            call_word(control, turn, self.find)
        if self.watcher is not None:
            self.watcher.record(unit, block, turn, main=not flow.calls)
        lose_arguments(control, turn.handed)
        finish_block(control, turn)
        if turn.elsewhere:
            ran_elsewhere(control, turn.elsewhere, changes_tool=control.tools.selected != 0)
        return self.go_on(plan, turn, unit, block)

    def go_on(self, plan: SinumerikPlan, turn: Turn, unit: SinumerikUnit, block: int) -> bool:
        """Continue after a block: into a subprogram, by a jump, or with the next block. Whether the program ends."""
        flow, called = self.flow, turn.subprogram
        if called is not None:
            flow.follow((Call(lambda: flow.called(called, turn.arguments, turn.written, turn.times)),))
            return False
        if turn.contour is not None:
            if self.in_parts:
                raise NotInPartsError("a contour is elsewhere in the program")
            if self.watcher is not None:
                from ncfix.control.flatten import NOT_FLAT

                raise RefusedError.of(NOT_FLAT, CONTOUR.format(turn.contour.name.upper()), self.place())
            mill_along(self.control, flow, turn.contour, turn.words, block, self.find, self.evaluate)
            return False
        steps = [step for step in plan.steps if isinstance(step, Branching)]
        if steps:
            if block not in unit.operations:
                unit.operations[block] = [flow.lowered(step, steps, block) for step in steps]
            flow.times = None if turn.words.unknown("P") else round(turn.words.get("P", 1.0))
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
        """Execute text that is not parsed: a block not understood, a macro, a synchronized action."""
        control = self.control
        if is_statement(plan) or "macro" in plan.opaque:
            why = f"the block {say(text)} is unknown and may move axes or change coordinates"
            control.refuse_rest(why)
            control.warn(NOT_UNDERSTOOD, control.refusal, "all motions after it are refused")
        if "synchronized" in plan.opaque and is_harmless(text):
            watch(control, text)
        elif "synchronized" in plan.opaque:
            why = f"the synchronized action {say(text)} may move axes"
            control.refuse_rest(why)
            control.warn(SYNCHRONOUS, control.refusal, "all motions after it are refused")

    def evaluate(self, plan: SinumerikPlan, index: int) -> BlockWordValues:
        """Evaluate the words of a block."""
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


# -- what the run decides ----------------------------------------------------------------------------------------------


def let_axis_go(control: Sinumerik, turn: Turn, step: AssignedVariable) -> None:
    """Execute `POS[X]=..` and the like: an axis moves by itself, and its end position is not followed."""
    name = step.index[0](control) if step.index else None
    known = isinstance(name, str) and name in INDEX and INDEX[name] in control.axis_indices
    if step.name == POLYNOMIAL:
        follow_polynomial(control, turn, step, str(name) if known else None)
        return
    gone = (INDEX[str(name)],) if known else () if isinstance(name, str) else control.axis_indices
    if not gone:
        return
    why = ASYNCHRONOUS.get(step.name, "a positioning axis (POS)")
    if step.name in GO_SOMEWHERE:
        still = BlockWordValues(turn.words.block, axes=mask_of(gone))
        lost = control.lost_in_frame() | control.along_frame(dict.fromkeys(gone, AFTER_POSITIONING))
        control.go(MotionKind.RAPID, still, control.here(lost), 0, refusal=why)
    else:
        control.refuse_rest(f"{why} is not supported")


def follow_polynomial(control: Sinumerik, turn: Turn, step: AssignedVariable, letter: str | None) -> None:
    """Execute `PO[X]=(end, a2, a3)`: the motion is refused, the axis ends at the first number if that is known."""
    first = next(iter(step.listed), step.value)
    value = first(control) if first is not None and letter is not None else None
    letters = LETTERS if letter is None else letter
    axes = [each for each in letters if INDEX[each] in control.axis_indices]
    ends: dict[str, float | None] = dict.fromkeys(axes, None if value is None else number(value))
    words = BlockWordValues(turn.words.block, ends, axes=mask_of(INDEX[each] for each in axes))
    control.go(MotionKind.FEED, words, destination(control, words), MOTIONS["poly"], refusal=POLYNOMIALS)


def note_letting(control: Sinumerik, turn: Turn, step: AssignedVariable) -> None:
    """Note an assignment that is not to a variable of the program, or that changes the control itself."""
    if step.name in DESELECTED and step.value is not None and step.value(control) == 0.0:
        return
    if OF_THE_CONTROL.match(step.name):
        why = f"the program sets {step.name.upper()}, which may change coordinates or tool lengths"
        control.refuse_rest(why)
    elif COUPLING.match(step.name):
        named = [each(control) for each in step.index or step.listed or filter(None, [step.value])]
        if not all(isinstance(each, str) and SPINDLE.fullmatch(each) for each in named):
            control.refuse_rest(f"an axis that follows another ({step.name.upper()}) is not followed")
    elif step.name in PROBING:
        turn.special.add("meas")
    elif step.index and step.name.upper() in INDEX:
        control.refuse_rest(f"{step.name.upper()}[..] is not supported")
    elif step.name in UNSEEN and step.index:
        control.refuse_rest(f"{UNSEEN[step.name]} is not supported")
