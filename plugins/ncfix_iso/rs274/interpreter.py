"""Executes a program block by block, as flow control leads, and decides which motion each block makes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING

from ncfix.control.coordinates import LETTERS, mask_of
from ncfix.control.expressions import Fault, Unknown, Value, nominal
from ncfix.control.flow import NEVER_ENDS, WAITS, ProgramFlow
from ncfix.control.interpreter import NO_END, Interpreter
from ncfix.control.setup import Run
from ncfix.control.state import NO_MOTION
from ncfix.text.tree import Comment, Constant, Program, Span, Word
from ncfix_iso.rs274 import predefined, systems
from ncfix_iso.rs274.control import LENGTH_CODE, POLAR, RUNTIME_BRANCH, Block, RS274Control
from ncfix_iso.rs274.cycles import BAD_CYCLE
from ncfix_iso.rs274.flow import OWords
from ncfix_iso.rs274.groups import ARCS, DYNAMIC_OFFSETS, LENGTH, NON_MODAL, TURNING_CYCLES
from ncfix_iso.rs274.motion import BAD_MOTION, NO_CODE, in_machine_coordinates
from ncfix_iso.rs274.order import DWELL, MACHINE, MOTIONS
from ncfix_iso.rs274.parameters import number_of, whole
from ncfix_iso.rs274.plans import Codes, RS274Plan, RS274Unit, check_words, grouped_codes, has_words
from ncfix_iso.rs274.settings import tool_offset, unknown_code

if TYPE_CHECKING:
    from ncfix_iso.rs274.flatten import RS274Flattener


WITHOUT_AXES = frozenset((0, 10, *ARCS, 52, NO_MOTION, *TURNING_CYCLES))
"""Motion codes that need no axis word."""


def explicit_motion(control: RS274Control, codes: Codes, motion: int, has_axes: bool) -> int | None:
    """The motion code named in a block, or None if it is not executed there."""
    if codes.takes and motion != NO_MOTION:
        only_modal(control, motion, "two G codes of the block both use its axis words")
        return None
    if motion == NO_MOTION and has_axes and not codes.takes and control.rules.strict:
        raise Fault(BAD_MOTION, "axis words are not allowed with G80")
    if not has_axes and motion not in WITHOUT_AXES:
        only_modal(control, motion, f"G{motion / 10:g} needs an axis word")
        return None
    return motion


def only_modal(control: RS274Control, motion: int, fault: str) -> None:
    """Bring a motion code into force without a motion; LinuxCNC refuses that."""
    if control.rules.strict:
        raise Fault(BAD_MOTION, fault)
    control.modal.motion = motion


CALL, RETURN = 980, 990
DRILLING = 810
"""G81: own drilling cycles of a dialect are followed like it."""
PROGRAM_ENDS = (20, 300)
LAST_PROGRAM = 9999
"""Larger P words of M98 on ISO controls contain the repeat count before the four digits of the program."""

POLAR_WORDS = "polar coordinates (@ ^); --flatten writes them in X and Y"
COMPUTED_ALIAS = "the code {} is calculated, and its words have other addresses than those of the code that it replaces"
MACHINE_MOVED = "the position of the axis {} after a command to the control is not known"
UNREADABLE = "NCF236"
NOT_SET = "NCF244"
BAD_CALL = "NCF242"
REPEATS = "whether K in a block with M98 repeats the call depends on the control"
HARMLESS_COMMAND = re.compile(r"\$(?:[$#GINX]?|N\d*=.*|\d{1,2}=.*|\w+\.MIN%?)(?=[;(]|$)")
"""Harmless commands: Grbl's `$$`, `$X`, `$10=3`, but not steps per mm (`$100=`); and the head of Okuma's files."""
NOT_KNOWN = "the command {} is unknown and may move axes or change coordinates"
DWELL_TIME = "PUX"
"""Words of G4 on ISO controls; besides P, X is a motion on some."""

INCREMENTS = " If U V W are increments of X Y Z, as on lathes: these are not followed"


def calls_of(block: Block) -> int:
    """How often M98 calls."""
    if "K" in block.values:
        raise Fault(BAD_CALL, REPEATS, "write the number of repeats in L")
    return whole(block.get("L", 1.0), "L of M98")


class RS274Interpreter(Interpreter[RS274Unit]):
    """Follows one program."""

    control: RS274Control
    watcher: RS274Flattener | None

    def __init__(self, control: RS274Control, program: Program, run: Run, *, in_parts: bool = False) -> None:
        super().__init__(control, program, run, in_parts=in_parts)
        self.axes = mask_of(control.axis_indices)
        control.set_length = control.rules.steps.get(LENGTH_CODE, tool_offset)
        self.main = RS274Unit(program, control.rules, self.axes)
        self.flow = self.prepared()
        systems.load_setup(control)

    def prepared(self) -> ProgramFlow[RS274Unit]:
        """Install the control's own parameters; returns the flow at the beginning of the program."""
        control = self.control
        flow = OWords(control, self.main, self.find)
        control.parameters.persistent = lambda number: systems.before_persistent(control, number)
        if not control.rules.strict:
            control.parameters.unset = self.not_set
        predefined.install(control, flow)
        return flow

    def not_set(self, number: int) -> Value:
        """Report a variable that the program reads and has not set; its value is known only at run time."""
        text = f"the program reads #{number} without setting it: its value is known only at run time"
        self.control.warn(NOT_SET, text, f'variables."#{number}" in the setup file')
        return Unknown(f"#{number}")

    @property
    def to_the_last(self) -> bool:
        """See `Interpreter`; programs with o-words are not read in parts."""
        return False

    def spellings(self, name: str) -> Iterable[str]:
        """See `Interpreter`."""
        return (name, f"O{name:0>4}", f"O{name}") if name.isdigit() else (name,)

    def text_of_file(self, source: bytes, name: str, spelling: str) -> RS274Unit:
        """See `Interpreter`."""
        return RS274Unit(self.read(source, spelling), self.control.rules, self.axes, spelling)

    @property
    def changes(self) -> int:
        """See `Interpreter`."""
        return self.control.parameters.changes

    @property
    def why_endless(self) -> str:
        """See `Interpreter`."""
        return WAITS if self.control.refusal == RUNTIME_BRANCH else NEVER_ENDS

    def lane_is_open(self, plan: RS274Plan) -> bool:
        """See `Interpreter`; closed while axes of a switched rotation have not been named."""
        return plan.lane is not None and not self.control.unnamed

    def note_stretch(self, unit: RS274Unit, block: int, done: int) -> None:
        """See `Interpreter`."""
        if self.watcher:
            self.watcher.stretch(unit, block, done)

    def end_of_text(self) -> bool:
        """See `Interpreter`: the text ends without M2, M30 or `%`."""
        fault = self.flow.unfinished()
        if fault is not None:
            raise fault
        self.control.warn(NO_END, "the program does not end with M2 or M30", "some controls refuse such a program")
        return False

    # -- one block ----------------------------------------------------------------------------------------------------

    def execute(self, plan: RS274Plan, unit: RS274Unit, block: int) -> bool:
        """Execute a block; returns whether the program ends there."""
        if plan.unknown_text is not None:
            self.note_unknown(plan.unknown_text)
        if plan.tape:
            if self.watcher:
                self.watcher.whole(unit, block)
            return self.at_tape(unit, block)
        if plan.flow is not None:
            self.span = plan.flow.span
            if self.watcher and not self.flow.calls:
                self.watcher.head(unit, block, plan.flow.keyword)
            operations = unit.operations.get(block)
            if operations is None:
                operations = unit.operations[block] = self.flow.lowered(plan.flow, unit, block)
            return self.flow.follow(operations) and self.beside_statement(plan, block)
        return self.execute_words(plan, block)

    def beside_statement(self, plan: RS274Plan, index: int) -> bool:
        """Execute words beside the program number with which a program begins (not in LinuxCNC)."""
        begins = plan.flow is not None and plan.flow.keyword == "program"
        if self.control.rules.strict or not begins or not has_words(plan):
            return False
        written, self.watcher = self.watcher, None  # the line has been written as it stands
        ended = self.execute_words(plan, index)
        self.watcher = written
        return ended

    def at_tape(self, unit: RS274Unit, block: int) -> bool:
        """`%`: the first line of a tape, or its end; controls other than LinuxCNC ignore comments before the first."""
        leading = [item for before in range(block) for item in unit.plan(before).template.items]
        if self.first and all(isinstance(item, Comment) and not self.control.rules.strict for item in leading):
            return False
        fault = self.flow.unfinished()
        if fault is not None:
            raise fault
        return True

    def execute_words(self, plan: RS274Plan, index: int) -> bool:
        """Execute a block of words and assignments; returns whether the program ends there."""
        control = self.control
        if plan.unread:
            raise Fault(UNREADABLE, "this line cannot be read, and the program executes it")
        if plan.fault is not None:
            raise plan.fault
        control.enter_block(plan.letters)
        block = self.evaluate(plan, index)
        codes = plan.codes or self.computed_codes(plan)
        if codes.unknown:
            self.unknown_codes(plan, codes)
        motion, dwells = self.motion_of(plan, codes), codes.g.get(NON_MODAL) == DWELL
        if codes.takes or (motion is None and codes.g.get(LENGTH) in DYNAMIC_OFFSETS):
            control.claim_words(None if not dwells else "P" if "P" in plan.letters else DWELL_TIME)
        check_words(plan, codes, motion, control.rules)
        if plan.command is not None:
            self.command(plan.command)
        if not dwells:
            self.note_foreign(plan)
        self.settings(codes, block)
        if motion is not None:
            self.move(block, codes, motion)
        if self.watcher:
            self.watcher.words(self.flow.unit, index, plan, codes, block)
        return self.after(codes, block)

    def motion_of(self, plan: RS274Plan, codes: Codes) -> int | None:
        """The motion code that a block executes; None if none. Raises `Fault` if its axis words have no code."""
        control, has_axes, modal = self.control, plan.axes != 0, self.control.modal.motion
        if codes.motion is not None:
            return explicit_motion(control, codes, codes.motion, has_axes)
        if codes.takes or (has_axes and codes.g.get(LENGTH) in DYNAMIC_OFFSETS):
            return None
        if has_axes and modal in (NO_MOTION, -1):
            if control.rules.strict:
                raise Fault(
                    BAD_MOTION, "the block has axis words, but no motion code is in force", "G0 or G1 is missing"
                )
            return NO_CODE
        if has_axes:
            return modal
        level = control.dialect.cycle_of(modal).level
        if not control.rules.strict and level in plan.letters and control.modal.cycle.initial is not None:
            return modal if modal in control.rules.cycles else None
        return modal if plan.letters & {"I", "J", "K"} and modal in ARCS else None

    def settings(self, codes: Codes, block: Block) -> None:
        """Execute the settings of a block, before its motion."""
        for step, code in codes.steps:
            step(self.control, block, code)

    def evaluate(self, plan: RS274Plan, index: int) -> Block:
        """The values of a block's words; its assignments take effect after all have been evaluated."""
        control = self.control
        numbers, first = control.numbers, control.first
        values = {letter: numbers[first + slot] for letter, slot in plan.literals}
        values |= plan.fixed
        unknown = []
        for letter, function, span in plan.computed:
            self.span = span
            value = function(control)
            values[letter] = nominal(value)
            if isinstance(value, Unknown):
                unknown.append(letter)
        if plan.assignments:
            self.assign(plan)
        self.span = None
        return Block(index, values, frozenset(unknown), plan.axes)

    def assign(self, plan: RS274Plan) -> None:
        """Assign the parameters of a block, all at once."""
        parameters = self.control.parameters
        pending = []
        for target, function, span in plan.assignments:
            self.span = span
            which = target(self.control) if callable(target) else target
            key = number_of(which) if callable(target) else target
            parameters.check_writable(key)
            value = function(self.control)
            pending.append((key, Unknown("", nominal(value)) if isinstance(which, Unknown) else value))
        for key, value in pending:
            parameters.assign(key, value)

    def computed_codes(self, plan: RS274Plan) -> Codes:
        """The codes of a block in which some are computed."""
        unknown = False
        pairs: list[tuple[Word, int]] = []
        for word, function in plan.code_words:
            value = function(self.control)
            tenths, unknown = 10 * nominal(value), unknown or isinstance(value, Unknown)
            if abs(tenths - round(tenths)) > 0.001:
                raise Fault(BAD_MOTION, f"{word.address}{tenths / 10:g} is not a code", span=word.span)
            pairs.append((word, round(tenths)))
            like = self.control.rules.aliases.get((word.address, round(tenths)))
            if like is not None and like.words:
                self.control.refuse_rest(COMPUTED_ALIAS.format(f"{word.address}{tenths / 10:g}"))
        if unknown:
            self.control.refuse_rest("a G or M code is known only at run time")
        return grouped_codes(pairs, plan.letters, self.control.rules)

    def unknown_codes(self, plan: RS274Plan, codes: Codes) -> None:
        """Handle unknown G codes."""
        spans = {
            w.value.value: w.span for w in plan.template.words if w.address == "G" and isinstance(w.value, Constant)
        }
        for code in codes.unknown:
            self.span = spans.get(code / 10)
            unknown_code(self.control, code, moving=bool(plan.axes) or "H" in plan.letters)
        self.span = None

    def note_foreign(self, plan: RS274Plan) -> None:
        """Record axes that the program moves and the machine lacks."""
        control = self.control
        for index, letter in enumerate(LETTERS):
            if plan.axes >> index & 1 and index not in control.axis_indices and letter not in control.foreign:
                self.span = plan.span_of(letter)
                lathe = letter in "UVW" and not control.rules.strict
                control.note_foreign(letter, INCREMENTS if lathe else "")
        self.span = None

    def note_unknown(self, span: Span) -> None:
        """Refuse all motions after a machine's own command or unknown text of a plugin's grammar."""
        if not self.control.refusal:
            text = self.flow.unit.program.slice(self.flow.block - 1, span).strip()
            self.control.refusal = NOT_KNOWN.format(text.split()[0][:30])
            self.control.warn("NCF228", self.control.refusal, "all motions after it are refused")

    def command(self, span: Span) -> None:
        """Execute a command to Grbl itself: homing and jogging move the machine, unknown ones may do anything."""
        text = self.flow.unit.program.slice(self.flow.block - 1, span).upper().replace(" ", "")
        if text.startswith(("$H", "$J=")):
            self.control.lose(self.control.axis_indices, MACHINE_MOVED)
        elif not HARMLESS_COMMAND.match(text):
            self.note_unknown(span)

    @contextmanager
    def polar_words(self, block: Block) -> Iterator[None]:
        """Context for a motion with @ or ^: it is followed but refused, because it can only be written with X and Y."""
        polar = bool(block.values.keys() & POLAR)
        if polar:
            self.control.suspend(POLAR_WORDS, POLAR_WORDS, followed=True)
        try:
            yield
        finally:
            if polar:
                self.control.resume(POLAR_WORDS)

    def calls_behind(self, block: Block, codes: Codes) -> bool:
        """Whether a call follows the motion of the block, or P of M99 says where to continue."""
        return codes.call is not None and (codes.call != RETURN or "P" in block.values)

    def move(self, block: Block, codes: Codes, motion: int) -> None:
        """Make the motion of a block; it stays whole if a call follows, which would be executed after its first piece.

        It also stays whole if P of an arc, which its pieces lack, may belong to an M code, too.
        """
        shared = motion in ARCS and "P" in block.values and self.flow.unit.plan(self.flow.block - 1).template.m_codes
        with self.control.in_one_piece() if shared or self.calls_behind(block, codes) else nullcontext():
            self.move_axes(block, codes, motion)

    def move_axes(self, block: Block, codes: Codes, motion: int) -> None:
        """Make the motion of a block."""
        if MACHINE in codes.g.values():
            in_machine_coordinates(self.control, block, motion)
        else:
            table, before = self.control.rules.tables.get(motion), self.control.modal.motion
            missing = [] if table is None or codes.motion is None else [x for x in table.needs if x not in block.values]
            if missing:
                name = f"G{(codes.motion or 0) / 10:g}"
                raise Fault(BAD_CYCLE, f"{missing[0]} is missing: {name} needs it")
            code = motion if table is None else DRILLING
            step = self.control.rules.steps.get(code) or MOTIONS[code]
            with self.polar_words(block):
                step(self.control, block, motion)
            if table is not None and not table.modal:
                self.control.modal.motion, self.control.modal.cycle.initial = before, None
        if motion not in self.control.rules.cycles:
            self.control.modal.cycle.initial = None

    def after(self, codes: Codes, block: Block) -> bool:
        """Execute the last actions of a block: M2, M30, M98, M99; returns whether the program ends."""
        if codes.stop in PROGRAM_ENDS:
            return True
        if codes.call == CALL:
            number, times = whole(block.get("P"), "P of M98"), calls_of(block)
            if not self.control.rules.strict and "L" not in block.values and number > LAST_PROGRAM:
                times, number = divmod(number, LAST_PROGRAM + 1)
            self.flow.call_by_code(str(number), times)
        if codes.call == RETURN:
            self.flow.finish()
        return bool(self.flow.ended)
