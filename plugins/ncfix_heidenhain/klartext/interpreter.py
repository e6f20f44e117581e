"""Following a Klartext program block by block, through its labels, calls and jumps."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ncfix.control.coordinates import INDEX, mask_of
from ncfix.control.expressions import Evaluate, Fault, Unknown, nominal
from ncfix.control.flow import Return
from ncfix.control.interpreter import NO_END, RUNTIME, Interpreter
from ncfix.control.moves import Moves
from ncfix.control.setup import Run
from ncfix.control.trace import NotInPartsError
from ncfix.diagnostics import Place, SourceError
from ncfix.text.reach import UNREAD
from ncfix.text.tree import Command, Opaque, Program, Template
from ncfix_heidenhain.klartext import cycles, lines, planes, transformations
from ncfix_heidenhain.klartext.arc_text import relies_at_once
from ncfix_heidenhain.klartext.arcs import Step, circular, circular_by_radius, circular_polar, tangential
from ncfix_heidenhain.klartext.blocks import unread_line
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.lane import run_lane
from ncfix_heidenhain.klartext.layout import CORNERS, TURN_DEGREES, axis_numbers, poles_move, words_alone_turn
from ncfix_heidenhain.klartext.lines import straight, straight_polar
from ncfix_heidenhain.klartext.plans import CARTESIAN, MOVING, POLAR, VECTOR, KlartextPlan
from ncfix_heidenhain.klartext.statements import (
    PROGRAM,
    KlartextFlow,
    after_motion,
    before_motion,
    call_tool,
    define_tool,
    statement,
)
from ncfix_heidenhain.klartext.targets import MotionWords, set_pole
from ncfix_heidenhain.klartext.units import KlartextUnit, unit_of_feed

if TYPE_CHECKING:
    from ncfix_heidenhain.klartext.flatten import KlartextFlattener


PATHS = {
    "": straight,
    "l": straight,
    "ln": straight,
    "lp": straight_polar,
    "c": circular,
    "cr": circular_by_radius,
    "cp": circular_polar,
    "ct": tangential,
    "ctp": tangential,
}
"""Path function -> what executes it; "" is a block of words alone."""

TAKES = {
    **dict.fromkeys(("l", "ln"), CARTESIAN | VECTOR),
    **dict.fromkeys(("", "c", "cr", "ct"), CARTESIAN),
    **dict.fromkeys(("lp", "cp", "ctp"), CARTESIAN | POLAR),
    **dict.fromkeys(("appr lt", "appr ln", "appr ct", "appr lct", "dep lct"), CARTESIAN),
    **dict.fromkeys(("appr plt", "appr pln", "appr pct", "appr plct", "dep plct"), CARTESIAN | POLAR),
    **dict.fromkeys(("dep lt", "dep ln", "dep ct"), frozenset[str]()),
    **dict.fromkeys(("cycl call", "cycl call pos"), CARTESIAN),
}
"""Path function -> the words of `MOVING` that it accepts."""

TURNING = frozenset({"c", "cp", "cr"})
"""Path functions that accept a sense of rotation, DR+ or DR-."""

CALLING = frozenset({"", "l", "ln", "lp", "cycl call", "cycl call pos"})
"""Blocks that may execute a cycle at their end; after an arc there would be two motions in one block."""

NOT_TAKEN = "{} does not allow the word {}: the control would stop, or make a path that ncfix does not support"
TWICE = "{} with a word {} in the plane of its pole: the end position is not certain"
CALLED_BY_ARC = "a cycle that is called in a block with {}: two motions in one block are not supported"
CALLED_AT_MACHINE = "a cycle that is called in a block with M91 or M92: in which coordinates it drills is not certain"
NO_FIRST_POINT = "{} without the start point of the contour"
NO_HEIGHT = "CYCL CALL POS without Z: the manuals require all three axes, and the height of the call is not certain"
COUNTED_HEIGHT = "CYCL CALL POS with an incremental height (IZ): from which position it counts is not certain"


def astray(control: KlartextControl, step: Step, *, called: bool) -> str:
    """Why a block cannot be followed because of words that it has or lacks; empty if it can be followed.

    called  the block executes a cycle at its end
    """
    name, words = step.name, step.words.values
    said = name.upper() or "a block of words alone"
    if called and name not in CALLING:
        return CALLED_BY_ARC.format(said)
    if (called or name.startswith("cycl call")) and step.codes & {91, 92}:
        return CALLED_AT_MACHINE
    other = next((word for word in words if word in MOVING and word not in TAKES.get(name, MOVING)), "")
    if step.flags & {"dr+", "dr-"} and name in TAKES and name not in TURNING:
        other = "DR"
    if other:
        return NOT_TAKEN.format(said, other)
    if name in ("lp", "cp", "ctp") or words.keys() & POLAR:
        plane = control.path.plane.pair
        twice = next((word for word in words if word in CARTESIAN and "XYZ".find(word[-1]) in plane), "")
        return TWICE.format(said, twice) if twice else ""
    if name.startswith("appr ") and not words.keys() & MOVING:
        return NO_FIRST_POINT.format(said)
    if name == "cycl call pos" and "Z" not in words:
        return COUNTED_HEIGHT if "IZ" in words else NO_HEIGHT
    return ""


AT_RUN_TIME = "NCF277"
READ = "the program reads or measures it: for the correction, set it with FN 0 in the program"
RADIUS = "Q108 is the tool radius: give it as --tool NUMBER=LENGTH,RADIUS"
ENDS_INSIDE = "a called program has M2 or M30, which the manuals do not allow"
SUFFIX = re.compile(r"\.h\Z", re.IGNORECASE)
ELSEWHERE = re.compile(r"CALL\b|SEL\s+PGM\b|F(LT?|CT?)(?=\s|$)", re.IGNORECASE)
"""Statements that rule out reading in parts: calls of other programs, and free contours (FK), which depend on later
blocks."""

NOT_OF_MOTION = frozenset({"F", "FU", "FZ", "FT", "S", "T", "ANG", "NX", "NY", "NZ"})
"""Addresses in motion blocks that do not change where the motion leads."""

POLES = frozenset({"c", "cc", "cp", "ctp", "lp"})
"""Path functions that set a pole or depend on one; polar approaches and departures do so, too."""


def has_to_do_with_poles(template: Template) -> bool:
    """Whether blocks of a shape set a pole or depend on one."""
    names = (item.name for item in template.items if isinstance(item, Command))
    return any(name in POLES or name.startswith(("appr p", "dep p")) for name in names)


class KlartextInterpreter(Interpreter[KlartextUnit]):
    """Follows one program.

    comma    whether the parts read so far have decimal commas; None before the first part
    shapes   the number of shapes that have been searched for poles
    polar    the shapes, among those, that have to do with poles
    no_lane  a unit, and those of its blocks at which the fast lane is not worth a try
    """

    control: KlartextControl
    flow: KlartextFlow
    watcher: KlartextFlattener | None

    def __init__(self, control: KlartextControl, program: Program, run: Run, *, in_parts: bool = False) -> None:
        super().__init__(control, program, run, in_parts=in_parts)
        self.axes = mask_of(control.axis_indices)
        self.comma: bool | None = None
        self.shapes = 0
        self.polar: list[int] = []
        self.no_lane: tuple[KlartextUnit | None, range] = None, range(0)
        control.locate = lambda: Place(program.path, 1)
        try:
            self.main = KlartextUnit(program, self.axes)
        except Fault as fault:
            raise SourceError.of(fault.code, fault.text, control.locate(), fault.hint) from None
        self.flow = KlartextFlow(control, self.main, self.find)
        control.locate = self.place
        control.modal.unit, control.modal.per_feed = self.main.mm, unit_of_feed(self.main.mm)
        control.unit_said = True
        control.recompose()

    def moves(self) -> Moves:
        """See `Interpreter`; in some blocks rotary axes get no words unless they have one (`words_alone_turn`)."""
        moves = super().moves()
        return replace(moves, words_alone_turn=words_alone_turn(self.main.program)[moves.block])

    def spellings(self, name: str) -> Iterable[str]:
        """See `Interpreter`: file names beside this program, with any folders taken off."""
        base = re.split(r"[\\/:]", name.strip().strip('"'))[-1]
        return base, SUFFIX.sub("", base), base + ".h", base + ".H", base.lower(), base.upper()

    def text_of_file(self, source: bytes, name: str, spelling: str) -> KlartextUnit:
        """See `Interpreter`."""
        return KlartextUnit(self.read(source, spelling), self.axes, spelling)

    @property
    def changes(self) -> int:
        """See `Interpreter`."""
        return self.control.scope.parameters.changes

    def end_of_text(self) -> bool:
        """See `Interpreter`: warn that the text ends without END PGM."""
        self.control.warn(NO_END, "the program does not end with END PGM", "check that the file is complete")
        return False

    def take_stretch(self, plan: KlartextPlan) -> bool:
        """See `Interpreter`; blocks that do nothing are skipped, too."""
        if super().take_stretch(plan):
            return True
        self.flow.block += plan.empty
        return plan.empty

    def lane_is_open(self, plan: KlartextPlan) -> bool:
        """See `Interpreter`."""
        unit, closed = self.no_lane
        return self.watcher is None and not (unit is self.flow.unit and self.flow.block in closed)

    def run_lane(self, unit: KlartextUnit, block: int, plan: KlartextPlan) -> int:
        """See `Interpreter`."""
        done, worth = run_lane(self.control, unit, block)
        self.no_lane = unit, range(block + done, worth)
        return done

    # -- one block ----------------------------------------------------------------------------------------------------

    def execute(self, plan: KlartextPlan, unit: KlartextUnit, block: int) -> bool:
        """Execute a block; True if the program ends there."""
        control, flow = self.control, self.flow
        control.scope.numbers, control.scope.first = unit.numbers, unit.first[block]
        if self.watcher is not None:
            self.watcher.note(unit, block)
        if plan.statement is not None:
            return self.state(plan, flow)
        if plan.flow is not None:
            operations = unit.operations.get(block)
            if operations is None:
                operations = unit.operations[block] = flow.operations(plan, partial(self.holds, plan))
            flow.follow(operations)
            return False
        self.assign(plan)
        words = self.evaluated(plan.words)
        name = plan.name
        if name.startswith("tool "):
            (call_tool if name == "tool call" else define_tool)(control, self.tool_of(plan), words, plan.flags)
        elif name.startswith("cycl def "):
            cycles.define(control, name.removeprefix("cycl def "), words, self.names(plan, flow))
        elif name.startswith("plane "):
            planes.plane(control, name.removeprefix("plane "), words, plan.flags)
        elif name.startswith("trans datum"):
            if name.endswith("reset"):
                transformations.reset_datum(self.control)
            transformations.shift(self.control, words, "")
        else:
            return self.motion(plan, words, flow)
        return False

    def state(self, plan: KlartextPlan, flow: KlartextFlow) -> bool:
        """Execute a statement whose text the grammar does not analyse; True if the program ends there."""
        assert plan.statement is not None
        kind, span = plan.statement
        text = flow.unit.program.slice(flow.block - 1, span)
        if self.in_parts and ELSEWHERE.match(text):
            raise NotInPartsError("the program calls others, or has free contours")
        if kind == UNREAD:
            unread_line(self.control, flow.unit.program.text_of(flow.block - 1))
        elif kind == "program":
            flow.follow((Return(kind=PROGRAM),) if text.upper().startswith("END") else ())
        else:
            statement(self.control, flow, text)
        return flow.ended

    def holds(self, plan: KlartextPlan) -> bool:
        """Whether a condition is met; raises `Fault` if that is known only at run time."""
        assert plan.test is not None
        value = plan.test(self.control.scope)
        if isinstance(value, Unknown):
            code = AT_RUN_TIME if self.watcher is None else RUNTIME
            lacking = value.why
            text = f"a jump depends on {lacking}, which is known only at run time"
            read = READ if lacking in self.control.scope.parameters.read else ""
            hint = RADIUS if lacking == "Q108" else read
            raise Fault(code, text, hint or f'give its value as variables."{lacking}" in the setup file')
        return value != 0.0

    def assign(self, plan: KlartextPlan) -> None:
        """Assign the Q parameters that a block sets."""
        scope = self.control.scope
        for name, value in plan.assignments:
            scope.parameters.assign(name, value(scope))

    def evaluated(self, words: Mapping[str, Evaluate]) -> MotionWords:
        """The words of a block with their values."""
        scope = self.control.scope
        values = {address: value(scope) for address, value in words.items()}
        unknown = frozenset(address for address, value in values.items() if isinstance(value, Unknown))
        return MotionWords({address: nominal(value) for address, value in values.items()}, unknown)

    def tool_of(self, plan: KlartextPlan) -> str | float | Unknown | None:
        """The number or name of the tool that a block names; None without one."""
        if plan.tool is None or isinstance(plan.tool, str):
            return plan.tool
        return plan.tool(self.control.scope)

    def names(self, plan: KlartextPlan, flow: KlartextFlow) -> str:
        """The texts of a cycle definition that are no words with values, joined by blanks."""
        program, block = flow.unit.program, flow.block - 1
        items = program.items_of(block)
        return " ".join(program.slice(block, item.span) for item in items if isinstance(item, Opaque))

    # -- motions ------------------------------------------------------------------------------------------------------

    def motion(self, plan: KlartextPlan, words: MotionWords, flow: KlartextFlow) -> bool:
        """Execute a block with a path function, axis words or M codes; True if it ends the program."""
        control = self.control
        codes = frozenset(code for code, _ in plan.codes)
        control.enter_block((*words.values, plan.name))
        self.feed(words, plan)
        values = {address: value for address, value in words.values.items() if address not in NOT_OF_MOTION}
        step = Step(plan.name, MotionWords(values, words.unknown & values.keys()), plan.flags, codes)
        self.note_foreign(plan, step)
        before_motion(control, step)
        following = flow.unit.next_plan(flow.block)
        control.path.ahead = following is not None and following.name in CORNERS
        control.path.doubtful = 127 in codes and control.shortest
        self.move(plan, step)
        for code, own in plan.codes:
            after_motion(control, code, self.evaluated(own), plan.flags)
        if codes & {2, 30} and control.external:
            control.refuse_rest(ENDS_INSIDE)
        return bool(codes & {2, 30}) and not control.external

    def note_foreign(self, plan: KlartextPlan, step: Step) -> None:
        """Note axes that the program moves but the machine does not have."""
        control = self.control
        for letter in step.words.letters:
            if control.path.spatial and letter in "ABC":
                continue
            if INDEX[letter] not in control.axis_indices and letter not in control.foreign:
                self.span = plan.spans.get(letter) or plan.spans.get("I" + letter)
                control.note_foreign(letter)
                self.span = None

    def feed(self, words: MotionWords, plan: KlartextPlan) -> None:
        """Set the feed: F per minute or (M136) per revolution, FU per revolution, FAUTO that of TOOL CALL.

        Per minute it counts in mm or tenths of an inch, per revolution in mm or inches.

        FZ (per tooth) and FT (by time) leave it unknown. The feed of RND and CHF is only that of the corner.
        """
        modal = self.control.modal
        if plan.name in CORNERS:
            return
        revolving = self.control.per_revolution or any(code == 136 for code, _ in plan.codes)
        for address, mode in (("F", 95 if revolving else 94), ("FU", 95), ("FZ", 95), ("FT", 94)):
            if address in words.values:
                known = address not in words.unknown and address in ("F", "FU")
                unit = unit_of_feed(modal.unit) if mode == 94 else modal.unit
                if unit != modal.per_feed:
                    modal.per_feed = unit
                    self.control.recompose()
                modal.feed = words.values[address] * unit if known else math.nan
                modal.feed_mode = mode
        if "fauto" in plan.flags:
            modal.feed = self.control.auto_feed

    def move(self, plan: KlartextPlan, step: Step) -> None:
        """Execute the motion of a block, if it has one."""
        control = self.control
        if step.name == "cc":
            set_pole(control, step.words)
            if step.codes & {91, 92}:
                control.path.pole = None  # in coordinates of the machine
            control.claim_words()
            return
        if step.name in CORNERS:
            control.path.corner = True
            return
        calls = step.name.startswith("cycl call")
        called = not calls and cycles.executes(control, step) and (plan.moves or 99 in step.codes)
        if calls and step.name.endswith("pat"):
            cycles.pattern(control, control.cycle.places, "CYCL CALL PAT")
        elif why := astray(control, step, called=called):
            control.refuse_here(why)
        elif plan.moves and step.codes & {91, 92}:
            lines.at_machine(control, step)
        elif calls or called:
            cycles.call(control, step)
        elif step.name.startswith("appr "):
            lines.approach(control, step)
        elif step.name.startswith("dep "):
            lines.departure(control, step)
        elif plan.moves:
            PATHS[step.name](control, step)
        else:
            return
        control.path.corner = False

    # -- a part of a program -----------------------------------------------------------------------------------------

    def check_part(self, program: Program) -> None:
        """See `Interpreter`: how a block is written depends on commas and poles elsewhere in the text."""
        self._check_manner(program.source)
        self._check_poles(program)

    def _check_manner(self, source: bytes) -> None:
        """Raise `NotInPartsError` if some numbers have decimal points and others commas."""
        commas, points = axis_numbers(source)
        if (commas and points) or self.comma not in (None, bool(commas)):
            raise NotInPartsError("the program has decimal points and commas")
        self.comma = bool(commas)

    def _check_poles(self, program: Program) -> None:
        """Raise `NotInPartsError` if a block depends on a pole of an earlier part, or a pole on the tool's position."""
        templates = program.templates
        self.polar += [shape for shape in range(self.shapes, len(templates)) if has_to_do_with_poles(templates[shape])]
        self.shapes = len(templates)
        blocks = np.flatnonzero(np.isin(program.template, self.polar)) if self.polar else np.empty(0, np.int64)
        if not len(blocks):
            return
        relies = not self.first and relies_at_once(program.text_of(int(blocks[0])).encode("latin-1"))
        if relies or poles_move(program.source):
            raise NotInPartsError("what a pole is depends on an earlier part")

    def check_motions(self, program: Program, moves: Moves) -> None:
        """See `Interpreter`: a part is refused if a rotary axis starts beyond its limits and then stays within them.

        The limits are 0 and a full turn. How its words are corrected (`on_its_side`) depends on the other parts.
        """
        for column in np.flatnonzero(moves.rotary).tolist() if len(moves) else ():
            words = program.column(moves.axes[column])
            words = words[~np.isnan(words)]
            offset = moves.frames[int(moves.frame[0])].offset[column]
            began = math.degrees(moves.start[0, column] - offset)
            if len(words) and (began < 0.0 <= words.min() or words.max() < TURN_DEGREES <= began):
                raise NotInPartsError(f"{moves.axes[column]} comes back from beyond a turn")
