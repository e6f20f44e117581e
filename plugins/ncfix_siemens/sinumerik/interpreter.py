"""The interpreter of SINUMERIK programs, block by block as control structures and calls lead.

Also here: assignments to axes that move by themselves, to probing and to data of the control; branches decided at run
time, which are skipped if they do not matter, or after which all motions are refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING

import numpy as np

from ncfix.control.coordinates import INDEX, LETTERS, mask_of
from ncfix.control.expressions import number
from ncfix.control.flow import Call
from ncfix.control.interpreter import RUNTIME, Interpreter
from ncfix.control.moves import MotionEnd, MotionKind, Moves, Pass, Passing
from ncfix.control.setup import Run
from ncfix.control.trace import NotInPartsError
from ncfix.diagnostics import Place, RefusedError, SourceError
from ncfix.text.tree import Program
from ncfix_siemens.sinumerik.cycles.contour import mill_along
from ncfix_siemens.sinumerik.destination import destination
from ncfix_siemens.sinumerik.flow import AtRuntimeError, SinumerikFlow
from ncfix_siemens.sinumerik.framing import PROGRAMMABLE
from ncfix_siemens.sinumerik.motion import is_harmless, watch
from ncfix_siemens.sinumerik.orientation import leads_along, run_vectors
from ncfix_siemens.sinumerik.plans import (
    AssignedVariable,
    Branching,
    Calling,
    SinumerikPlan,
    has_value,
    is_statement,
    names_in,
)
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
    HARMLESS,
    MOTIONS,
    OF_THE_CONTROL,
    PROBING,
    RESULTS,
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
CONTOUR = "the contour that {} mills has to stay what it is, and cannot be written out flat"
PROGRAM_ENDS = frozenset({20, 300, 170})
TOOL_CHANGE = re.compile(rb"(?im)^[^;\n]*(?<![A-Z0-9_])M[ \t]*=[ \t]*0*6(?![\d.])")
PERHAPS = re.compile(rb"[Mm][ \t]*=[ \t]*0*6")
"""A part of every match of `TOOL_CHANGE`, whose search is faster."""

AFTER_POSITIONING = "where the axis {} stands after it was positioned by itself is not followed"
POLYNOMIAL, POLYNOMIALS = "po", UNFOLLOWED_MOTIONS[MOTIONS["poly"]]
GO_SOMEWHERE = frozenset({"pos", "posa", "posp", "ax"})
DESELECTED = frozenset({"tcarr", "cutmod"})
"""Names whose value zero deactivates what other values activate; activation is refused."""

BY_THEMSELVES = frozenset(ASYNCHRONOUS) | GO_SOMEWHERE | {POLYNOMIAL}
"""Names that, with an axis as index, move it by itself, `POS[X]=100`, or give its end, `PO[X]=(10,2)`."""


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
                raise NotInPartsError("a contour stands elsewhere in the program")
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
            why = f"the block {say(text)} is not understood, and may move axes or change coordinates"
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
        control.refuse_rest(f"{why} is not followed")


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
    elif step.name in PROBING:
        turn.special.add("meas")
    elif step.index and step.name.upper() in INDEX:
        control.refuse_rest(f"{step.name.upper()}[..] is not followed")
    elif step.name in UNSEEN and step.index:
        control.refuse_rest(f"{UNSEEN[step.name]} is not followed")


DECIDED_AT_RUNTIME = "which blocks are executed here is decided at run time"
GIVE = ', by {}: variables."{}" in the setup file gives it a value'
NO_MOTIONS = frozenset({40, 740, 750, 250, 260, 1100, 1110, 1120})
MACHINE = frozenset({530, 1530})


def decided_at_runtime(flow: SinumerikFlow) -> str:
    """Why the next block is undecided, naming the unknown variables of the branch."""
    conditions = (part for step in flow.unit.branchings(flow.block - 1) for part in step.written)
    named = dict.fromkeys(name for part in conditions for name in names_in(part))
    unknown = [name.upper() for name in named if not has_value(flow.control.variables, name)]
    return DECIDED_AT_RUNTIME + (GIVE.format(" and ".join(unknown), unknown[0]) if unknown else "")


def sweep(flow: SinumerikFlow, others: Sequence[SinumerikUnit], why: str) -> list[tuple[int, int]]:
    """Refuse the motions of all remaining blocks, and of the programs of the text that they may call.

    Returns the stretches of blocks that may be executed again.
    """
    control = flow.control
    control.refuse_rest(why)
    control.lose_all(why)
    places = [call.back for call in flow.calls] + [(flow.unit, flow.block - 1)]
    first = [found for unit, block in places if not unit.external if (found := earliest(unit, block)) is not None]
    called = callable_from(places, others)
    for unit, block in [*reversed(places), *((unit, unit.begin) for unit in called)]:
        for each in range(block, unit.stop):
            row = each if not unit.external else control.row_block
            refuse(control, unit.plan(each), row, why)
    return [*((block, len(flow.unit.program)) for block in first), *((unit.begin, unit.stop) for unit in called)]


NAME_IN_TEXT, NAMED_BY_TEXT = re.compile(r"\w+"), frozenset({"CALL", "PCALL", "EXTCALL"})


def callable_from(places: Iterable[tuple[SinumerikUnit, int]], others: Iterable[SinumerikUnit]) -> list[SinumerikUnit]:
    """The programs among `others` that blocks from these places on may call, directly or indirectly."""
    found: list[SinumerikUnit] = []
    pending = list(places)
    while pending:
        unit, block = pending.pop()
        lines = (unit.program.text_of(each).partition(";")[0].upper() for each in range(block, unit.stop))
        names = {name for line in lines for name in NAME_IN_TEXT.findall(line)}
        new = [each for each in others if each not in found and (each.name in names or names & NAMED_BY_TEXT)]
        found += new
        pending += [(each, each.begin) for each in new]
    return found


def refuse(control: Sinumerik, plan: SinumerikPlan, block: int, why: str) -> None:
    """Add the motion of a block, if it has one, with unknown end and as refused."""
    if not plan.axes or plan.names & PROGRAMMABLE or not NO_MOTIONS.isdisjoint(plan.g):
        return
    machine = "supa" in plan.names or not MACHINE.isdisjoint(plan.g)
    passing = Passing(Pass.MACHINE_COORDINATES, "machine coordinates") if machine else None
    control.row_block = block
    lost = dict.fromkeys(control.axis_indices, why)
    words = BlockWordValues(block, axes=plan.axes)
    control.go(MotionKind.RAPID, words, MotionEnd(control.position[:], lost, dict(lost)), 0, passing=passing)


def earliest(unit: SinumerikUnit, block: int) -> int | None:
    """The first block before `block` to which a later block may jump back; None if there is none."""
    found: list[int] = []
    for each in range(block, unit.stop):
        if each in unit.begins:
            found.append(unit.begins[each])
        for step in unit.branchings(each):
            found.extend(targets(unit, step, each))
    return min((place for place in found if place < block), default=None)


def targets(unit: SinumerikUnit, step: Branching, block: int) -> list[int]:
    """The blocks to which a jump or repetition may lead."""
    if step.keyword == "gotos":
        return [unit.begin]
    if "goto" not in step.keyword and step.keyword not in ("repeat", "repeatb"):
        return []
    return unit.labelled(step.label) or ([unit.begin] if "goto" in step.keyword else [])


LOUD_M = frozenset({20, 60, 170, 300})
"""M codes, in tenths, that end programs or change tools."""

QUIET_WORDS = frozenset("SH")
INNER = frozenset({"if", "else", "endif"})


def bypassed(control: Sinumerik, flow: SinumerikFlow, step: Branching, steps: Iterable[Branching]) -> bool:
    """Skip an undecided IF whose blocks do not matter; whether it was skipped. `flow.block` is the next block."""
    if step.keyword != "if":
        return False
    here, unit = flow.block - 1, flow.unit
    jump = next((each for each in steps if each.keyword.startswith("goto")), None)
    end = unit.ends.get(here) if jump is None else unit.find(jump.label, here, jump.keyword)
    if end is None or end <= here or not all(is_quiet(unit.plan(block)) for block in range(here + 1, end)):
        return False
    if unbalanced(unit, here, end, alone=jump is None):
        return False
    for block in range(here + 1, end):
        for each in unit.plan(block).steps:
            if isinstance(each, AssignedVariable):
                control.variables.forget(each.name)
    flow.block = end if jump is not None else end + 1
    return True


def is_quiet(plan: SinumerikPlan) -> bool:
    """Whether a block moves nothing, changes no coordinates, and does not jump."""
    if plan.opaque or plan.g or plan.functions or not LOUD_M.isdisjoint(plan.m):
        return False
    if any(setting.address not in QUIET_WORDS for setting in plan.settings):
        return False
    return all(is_quiet_step(step) for step in plan.steps)


def is_quiet_step(step: object) -> bool:
    """Whether an assignment, a name or a control structure moves nothing and changes no coordinates."""
    match step:
        case AssignedVariable(name):
            quiet = not name.startswith("$") and not OF_THE_CONTROL.match(name)
            return quiet and name not in BY_THEMSELVES | UNSEEN.keys() | PROBING
        case Calling(name):
            return name in HARMLESS - RESULTS.keys()
        case Branching(keyword):
            return keyword in INNER or keyword == "label"
    return False


def unbalanced(unit: SinumerikUnit, begin: int, end: int, *, alone: bool) -> bool:
    """Whether a control structure that begins between two blocks ends outside of them."""
    inner = range(begin + (0 if alone else 1), end)
    return any(each in inner and not begin <= last <= end for each, last in unit.ends.items())
