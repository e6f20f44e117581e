"""The interpreter of the Fanuc family: it executes the blocks of a program in the order of the control."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from ncfix.control.coordinates import LETTERS, PLANES, Z, mask_of
from ncfix.control.expressions import Fault, Unknown, Value, nominal
from ncfix.control.interpreter import RUNTIME
from ncfix.control.setup import Run
from ncfix.control.trace import NotInPartsError
from ncfix.text.tree import Assignment, Constant, Literal, Opaque, Program, Span, Template, Word
from ncfix.values import frozen
from ncfix_fanuc.macro import coordinates, system, tilt
from ncfix_fanuc.macro.blocks import CORNER, G15, G16, is_angle, is_scaled
from ncfix_fanuc.macro.control import ANGLE, COMPONENTS, MacroControl
from ncfix_fanuc.macro.data import is_data
from ncfix_fanuc.macro.flow import BAD_JUMP, LENGTHS, MacroFlow, local_variables
from ncfix_fanuc.macro.lengths import LENGTH_IN_STEPS, lone_number
from ncfix_fanuc.macro.patterns import PATTERNS, check_points
from ncfix_fanuc.macro.rules import MACRO
from ncfix_fanuc.macro.variables import is_system, is_vacant, variable_number
from ncfix_iso.rs274.control import Block
from ncfix_iso.rs274.interpreter import LAST_PROGRAM, PROGRAM_ENDS, RS274Interpreter, calls_of
from ncfix_iso.rs274.order import MACHINE
from ncfix_iso.rs274.parameters import Store, whole
from ncfix_iso.rs274.plans import Codes, FlowLine, RS274Plan, RS274Unit, plan_of
from ncfix_iso.rs274.settings import units

G20, G21, G90, G91 = 200, 210, 900, 910
G65, G66_1, G67 = 650, 661, 670
SUBPROGRAM, LOCAL_SUBPROGRAM, RETURN = (980, 1980), 970, 990
BY_ANGLE = "ncfix does not support a line that is given by its angle (,A)"
AFTER_ANGLE = "the position of the axis {} after a line that is given by its angle (,A) is not known"
BEFORE_CALL = "GMFST"
"""Words that take effect before a macro is called if they stand before the call."""
BESIDE_CALL = "a code before G65 is calculated, so the program cannot be written out flat"
MODAL_CALL = "G66 calls the program O{}, which ncfix does not have, so the program cannot be written out flat"
COMPUTED_CALL = "the code of a macro call (G65, G66) is computed"
NAME = re.compile(r"<(?P<angle>[^<>]+)>|\"(?P<quoted>[^\"]+)\"")


def is_called(program: Program) -> bool:
    """Whether a text is a subprogram: it returns (M99) and never ends (M2, M30)."""
    codes = {code for template in program.templates for code in template.m_codes}
    return RETURN in codes and codes.isdisjoint(PROGRAM_ENDS)


@frozen
class ModalCall:
    """A macro that is called after every motion (G66)."""

    label: str
    times: int
    arguments: Store
    depth: int


class MacroInterpreter(RS274Interpreter):
    """Follows one program."""

    control: MacroControl
    flow: MacroFlow

    def __init__(self, control: MacroControl, program: Program, run: Run, *, in_parts: bool = False) -> None:
        super().__init__(control, program, run, in_parts=in_parts)
        self.modal_calls: list[ModalCall] = []
        self.reduced: dict[tuple[int, frozenset[Span]], RS274Plan] = {}
        self.moved = False
        self.cornered = False

    def prepared(self) -> MacroFlow:
        """Give the control its variables, and return the flow at the start of the program."""
        control = self.control
        control.parameters.persistent = lambda number: None
        control.parameters.live = system.positions(control) | system.modes(control) | system.offsets(control)
        control.parameters.position = lambda number: control.position_is_read(f"#{number}")
        control.parameters.unset = self.not_set
        control.parameters.inherits = is_called(self.main.program)
        control.coming = self.coming
        flow = MacroFlow(control, self.main, self.find, in_parts=self.in_parts)
        if self.in_parts:
            flow.begin_at_heads(self.main)
        return flow

    @property
    def to_the_last(self) -> bool:
        """See `Interpreter`: a subprogram that was sought in files may also stand behind the end of the program."""
        return self.flow.looked

    def next_part(self, program: Program, blocks: int) -> None:
        """See `Interpreter`."""
        super().next_part(program, blocks)
        self.flow.begin_at_heads(self.main)

    def coming(self) -> Iterator[Template]:
        """The shapes of the blocks that follow in the text."""
        unit = self.flow.unit
        yield from (unit.program.template_of(block) for block in range(self.flow.block, unit.stop))
        if unit is self.main and not self.last:
            raise NotInPartsError("what follows a tool length is in the next part")

    def lane_is_open(self, plan: RS274Plan) -> bool:
        """See `RS274Interpreter`; not during a modal macro call, with polar, scaled or vector words, or at a corner."""
        control = self.control
        special = control.polar is not None or control.scaling is not None or control.vectors or control.entering
        return super().lane_is_open(plan) and not (special or self.modal_calls or self.cornered)

    # -- one block ----------------------------------------------------------------------------------------------------

    def execute(self, plan: RS274Plan, unit: RS274Unit, block: int) -> bool:
        """Execute a block; True if the program ends there.

        Except while flattening, `set_in_doubt` handles blocks that set variables on a condition known at run time.
        """
        flow = plan.flow
        if flow is not None and flow.keyword == "if then" and not self.watcher and self.set_in_doubt(plan, flow):
            return False
        return super().execute(plan, unit, block)

    def set_in_doubt(self, plan: RS274Plan, flow: FlowLine) -> bool:
        """Handle a block that only sets variables if a condition holds that is known only at run time.

        The variables are not known from then on. False for any other block. Alarms and messages that depend on the
        condition are harmless: if the program goes on, none was raised.
        """
        alone = plan.assignments and not (plan.letters or plan.template.g_codes or plan.template.m_codes)
        if not alone or not isinstance(flow.arguments[0](self.control), Unknown):
            return False
        named = [target(self.control) if callable(target) else float(target) for target, _, _ in plan.assignments]
        numbers = [variable_number(nominal(each)) for each in named if not isinstance(each, Unknown)]
        if len(numbers) < len(named) or not all(map(system.is_harmless, numbers)):
            return False
        for number in numbers:
            self.control.parameters.check_writable(number)
            self.control.parameters.assign(number, Unknown())
        return True

    def beside_statement(self, plan: RS274Plan, index: int) -> bool:
        """Execute the words that stand beside a statement: behind THEN, or the number of a program."""
        if plan.flow is not None and plan.flow.keyword == "if then":
            return self.execute_words(plan, index)
        return super().beside_statement(plan, index)

    def execute_words(self, plan: RS274Plan, index: int) -> bool:
        """Execute a block of words and assignments."""
        self.moved = False
        if self.control.entering and is_data(plan):
            if self.watcher:
                self.watcher.whole(self.flow.unit, index)
            return False
        self.control.entering = False
        plan = self.without_vacant(plan)
        codes = plan.codes
        macro = codes.g.get(MACRO) if codes is not None and plan.fault is None else None
        if macro == G67:
            self.modal_calls = self.modal_calls[:-1]
            plan = self.without(plan, [word.span for word in plan.template.words if self.calls(word)])
        elif macro and codes is not None:
            self.macro(plan, codes, self.before_call(plan, index))
            return False
        refusal = self.control.refusal
        if ANGLE in plan.letters:
            self.control.refusal = refusal or BY_ANGLE
        self.control.whole = self.cornered or bool(plan.letters & CORNER)
        ended = super().execute_words(plan, index)
        if self.moved:
            self.cornered = bool(plan.letters & CORNER)
        self.control.whole = False
        if ANGLE in plan.letters:
            self.control.refusal = refusal
            plane = self.control.modal.plane  # the coordinate that the block leaves out is not followed
            self.control.lose([i for i in plane.pair if LETTERS[i] not in plan.letters], AFTER_ANGLE)
        return ended

    def without_vacant(self, plan: RS274Plan) -> RS274Plan:
        """The plan without words whose value is a vacant variable, which count as not written."""
        if not plan.computed and not plan.code_words:
            return plan
        spans = [span for _, function, span in plan.computed if is_vacant(function(self.control))]
        spans += [word.span for word, function in plan.code_words if is_vacant(function(self.control))]
        return self.without(plan, spans) if spans else plan

    def without(self, plan: RS274Plan, spans: list[Span]) -> RS274Plan:
        """The plan without some of its words."""
        key = id(plan), frozenset(spans)
        if key not in self.reduced:
            items = plan.template.items
            remaining = tuple(item for item in items if not (isinstance(item, Word) and item.span in spans))
            self.reduced[key] = plan_of(Template(remaining, plan.template.n_numbers), self.control.rules)
        return self.reduced[key]

    def evaluate(self, plan: RS274Plan, index: int) -> Block:
        """The values of a block, with the decimal-point rule applied, and polar and scaled words converted."""
        block = super().evaluate(plan, index)
        if plan.assignments:
            block.unknown |= {letter for letter, _, _ in plan.computed}  # whether they are set before is not certain
        said = plan.codes or self.computed_codes(plan)
        codes = set(said.g.values())
        self.at_once(codes)
        self.take_points(plan, block)
        if G16 in codes:
            coordinates.switch_polar(self.control, block, G16)
        if self.control.polar is not None and G15 not in codes and not said.takes:
            block = coordinates.cartesian(self.control, block)
        if coordinates.ON in codes and "P" in plan.pointless:
            block.unknown |= {"P"}  # thousandths or hundred-thousandths, as a parameter says
        for code in codes & PATTERNS.keys():
            check_points(self.control, plan, block, code)
        if plan.codes is None and MACRO in said.g:
            self.control.refuse_rest(COMPUTED_CALL)
        return coordinates.scaled(self.control, block, said)

    def take_points(self, plan: RS274Plan, block: Block) -> None:
        """Convert numbers without a decimal point as the setup says."""
        for letter in plan.pointless:
            if is_scaled(self.control, plan, letter):
                self.span = plan.span_of(letter)
                angle = is_angle(self.control, plan, letter)
                block.values[letter] = self.control.without_point(letter, block.values[letter], angle=angle)
        self.span = None

    def at_once(self, codes: set[int]) -> None:
        """Apply unit, plane, G90 and G91 of a block, which determine the meaning of its own numbers."""
        modal = self.control.modal
        if codes & {G20, G21}:
            units(self.control, None, G20 if G20 in codes else G21)
        if codes & {G90, G91}:
            modal.incremental = G91 in codes
        for code in codes & PLANES.keys():
            modal.plane = PLANES[code]

    def settings(self, codes: Codes, block: Block) -> None:
        """Apply the settings of a block before its motion, including an H word alone."""
        before = self.control.tools.vector[Z]
        super().settings(codes, block)
        lone_number(self.control, block, codes)
        if self.control.vectors and codes.takes and block.values.keys() & {*COMPONENTS}:
            self.control.lose(self.control.turning, tilt.AFTER_VECTOR)
        changed = self.control.tools.vector[Z] != before and not codes.takes
        if changed and self.control.modal.incremental and "Z" in block.values:
            self.control.lose((Z,), LENGTH_IN_STEPS)

    def assign(self, plan: RS274Plan) -> None:
        """Set the variables that a block sets, one after the other."""
        parameters = self.control.parameters
        for target, function, span in plan.assignments:
            self.span = span
            which = target(self.control) if callable(target) else float(target)
            number = variable_number(nominal(which))
            parameters.check_writable(number)
            value = function(self.control)
            value = Unknown("", nominal(value)) if isinstance(which, Unknown) else value
            parameters.assign(number, value)
            if is_system(number):
                system.was_set(self.control, number, value)

    def motion_of(self, plan: RS274Plan, codes: Codes) -> int | None:
        """The motion code that a block executes; a direction of the tool (G43.5) is a motion, too."""
        found = super().motion_of(plan, codes)
        vector = self.control.vectors and not plan.letters.isdisjoint(COMPONENTS)
        if found is None and vector and codes.motion is None and not codes.takes:
            return self.control.modal.motion if self.control.modal.motion in tilt.STRAIGHT else None
        return found

    def move(self, block: Block, codes: Codes, motion: int) -> None:
        """The motion of a block."""
        before = self.control.builder.count
        if tilt.turns_tables(self.control, block):
            self.control.suspend(tilt.DYNAMIC, tilt.TABLES_MOVED)
        if MACHINE not in codes.g.values() and tilt.turns_in_plane(self.control, block):
            self.in_plane(block, codes, motion)
        elif self.control.vectors:
            self.by_vector(block, codes, motion)
        else:
            super().move(block, codes, motion)
        self.moved = self.control.builder.count > before

    def in_plane(self, block: Block, codes: Codes, motion: int) -> None:
        """A block that turns rotary axes in a tilted plane; where others beside them lead is not known."""
        control = self.control
        if motion in tilt.STRAIGHT and not block.axes & ~mask_of(control.turning):
            tilt.turn_in_plane(control, block, motion)
        else:
            before, control.refusal = control.refusal, control.refusal or tilt.MIXED
            super().move(block, codes, motion)
            control.refusal = before
            control.lose(tilt.SPATIAL, tilt.AFTER_MIXED)
        tilt.look_square(control)

    def calls_behind(self, block: Block, codes: Codes) -> bool:
        """See `RS274Interpreter`; G66 calls a macro behind every motion."""
        modal = bool(self.modal_calls) and len(self.flow.calls) <= self.modal_calls[-1].depth
        return modal or super().calls_behind(block, codes)

    def by_vector(self, block: Block, codes: Codes, motion: int) -> None:
        """The motion of a block while I J K give the direction of the tool; rotary axes get no words of their own."""
        control, axes = self.control, self.control.turning
        before, why = control.refusal, "" if MACHINE in codes.g.values() else tilt.directed(control, block, motion)
        control.refusal = before or why
        super().move(block, codes, motion)
        if why:
            control.refusal = before
            control.lose(axes if why != tilt.ON_ARC or block.values.keys() & {*"IJK"} else (), tilt.AFTER_VECTOR)
        control.places.lose(mask_of(axes))

    # -- calls and ends -----------------------------------------------------------------------------------------------

    def after(self, codes: Codes, block: Block) -> bool:
        """Apply the end of a block: M2, M30, calls and returns. True if the program ends."""
        if codes.stop in PROGRAM_ENDS:
            return True
        if codes.call == RETURN:
            return self.returned(block)
        if codes.call in SUBPROGRAM:
            self.subprogram(block)
        elif codes.call == LOCAL_SUBPROGRAM and "P" in block.values:  # without P it ends interrupts (M96)
            self.flow.enter_local(whole(block.get("P"), "P of M97"), whole(block.get("L", 1.0), "L of M97"))
        else:
            self.call_modal()
        return False

    def returned(self, block: Block) -> bool:
        """M99: return to the caller; in the main program, go to block P, or end (instead of starting again)."""
        target = whole(block.get("P"), "P of M99") if "P" in block.values else None
        self.flow.come_back(target)
        return self.flow.ended

    def subprogram(self, block: Block) -> None:
        """M98 Pn Ln Qn; repeats may also precede the four digits of the program number; Q is the first block."""
        if "H" in block.values:
            raise Fault(BAD_JUMP, "the meaning of M98 with H depends on the control", "divide the subprogram into two")
        name, times = self.named_program(), calls_of(block)
        if not name:
            number = whole(block.get("P"), "P of M98")
            if "L" not in block.values and number > LAST_PROGRAM and not self.is_there(str(number)):
                times, number = divmod(number, LAST_PROGRAM + 1)
            name = str(number)
        self.flow.begin(name, times, None)
        if self.is_outside() and self.watcher:
            self.watcher.write(f"M98 P{name}" if times == 1 else f"M98 P{name} L{times}")
        if "Q" in block.values:
            if times != 1:
                raise Fault(BAD_JUMP, "M98 with both L and Q: at which block the repeats begin is not certain")
            self.flow.jump(self.flow.numbered(whole(block.values["Q"], "Q of M98")))

    def is_there(self, label: str) -> bool:
        """Whether there is a program with this number."""
        self.flow.looked = True
        outline = self.flow.outline_of(self.main)
        return label in outline.programs or self.find(label) is not None

    def named_program(self) -> str:
        """The name of a program that the block calls by name, `M98<NAME>`; "" without."""
        unit, block = self.flow.unit, self.flow.block - 1
        for item in unit.program.items_of(block):
            if isinstance(item, Opaque) and item.kind == "text word":
                found = NAME.search(unit.program.slice(block, item.span))
                return (found["angle"] or found["quoted"]) if found else ""
        return ""

    # -- macros -------------------------------------------------------------------------------------------------------

    def before_call(self, plan: RS274Plan, index: int) -> str:
        """Execute the codes and assignments before a macro call; behind the call, M is an argument.

        Returns the text of the codes, for a flat program; raises `Fault` while flattening if one is computed.
        """
        items = plan.template.items
        call = next(place for place, item in enumerate(items) if isinstance(item, Word) and self.calls(item))
        before = [item for item in items[:call] if not isinstance(item, Word) or item.address in BEFORE_CALL]
        words = [item for item in before if isinstance(item, Word)]
        if words or any(isinstance(item, Assignment) for item in before):
            watcher, self.watcher = self.watcher, None
            super().execute_words(plan_of(Template(tuple(before), plan.template.n_numbers), self.control.rules), index)
            self.watcher = watcher
        if self.watcher and not all(isinstance(word.value, (Constant, Literal)) for word in words):
            raise Fault(RUNTIME, BESIDE_CALL)
        return " ".join(self.flow.unit.program.slice(index, word.span) for word in words)

    def calls(self, word: Word) -> bool:
        """Whether a word is a code that calls a macro, or ends modal calls."""
        if word.address != "G" or not isinstance(word.value, Constant):
            return False
        return self.control.rules.g_groups.get(round(10 * word.value.value)) == MACRO

    def macro(self, plan: RS274Plan, codes: Codes, before: str) -> None:
        """G65 calls a macro once, G66 after every following motion; `before`: for a flat program."""
        code = codes.g[MACRO]
        if self.watcher and before and code != G65:
            self.watcher.write(before)
        values = {word.address: self.argument(word) for word in plan.template.words if word.address not in "GMN"}
        name = self.named_program()
        label = name or str(whole(nominal(values.get("P", 0.0)), f"P of G{code // 10}"))
        times = whole(nominal(values.get("L", 1.0)), "L")
        store = local_variables(self.arguments(plan))
        if code == G65:
            self.flow.begin(label, times, store)
            outside = self.is_outside()
            if self.watcher and outside:
                self.watcher.call(self.flow.unit, self.flow.block - 1)
            elif self.watcher and before:
                self.watcher.write(before)
            return
        if code == G66_1:
            self.control.refuse_rest("every block calls a macro (G66.1)")
        self.modal_calls.append(ModalCall(label, times, store, len(self.flow.calls)))

    def arguments(self, plan: RS274Plan) -> Iterator[tuple[str, Value]]:
        """The arguments of a macro call in the order written; vacant ones are not passed."""
        words = plan.template.words
        behind = next(place for place, word in enumerate(words) if self.calls(word)) + 1
        for place, word in enumerate(words):
            if word.address not in "NPL" and (place >= behind or word.address not in BEFORE_CALL):
                value = self.argument(word)
                if not math.isnan(nominal(value)):
                    yield word.address, value

    def argument(self, word: Word) -> Value:
        """The value of a word of a macro call."""
        if isinstance(word.value, Constant):
            return word.value.value
        value = self.control.rules.compiled(word.value, word.address)(self.control)
        if isinstance(word.value, Literal) and word.value.pointless and word.address in LENGTHS:
            return self.control.without_point(word.address, nominal(value))
        return value

    def call_modal(self) -> None:
        """After a motion, call the macro that G66 named, unless it is running."""
        if not self.moved or not self.modal_calls:
            return
        call = self.modal_calls[-1]
        if len(self.flow.calls) <= call.depth:
            self.flow.begin(call.label, call.times, call.arguments)
            if self.is_outside() and self.watcher:
                raise Fault(RUNTIME, MODAL_CALL.format(call.label))

    def is_outside(self) -> bool:
        """Whether the program called just now is in the control, so that a flat program must call it, too."""
        label, self.control.outside = self.control.outside, ""
        return bool(label)
