"""The flow of a program of Macro B: GOTO, IF, WHILE, and the calls M98, G65 and G66, as operations.

Source: Fanuc 30i operator's manual, "Custom macro", "Branch and repetition", "Macro call", "Argument specification";
"Subprogram".

Programs of the machine's builder or of a probe's maker, O8000 to O9999, are in the control; their text is not given.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable
from functools import cached_property

import numpy as np

from ncfix.arrays import Array
from ncfix.control.coordinates import mask_of
from ncfix.control.expressions import Fault, Unknown, Value
from ncfix.control.flow import NO_SUBPROGRAM, Call, Jump, Let, OpenCall, Operation, ProgramFlow, Return
from ncfix.control.state import NO_MOTION
from ncfix.control.trace import NotInPartsError
from ncfix.text.tree import Comment, Literal, Opaque, Span, Template
from ncfix.text.tree import OWordLine as FlowItem
from ncfix_fanuc.macro.control import MacroControl
from ncfix_fanuc.macro.variables import number
from ncfix_iso.rs274.flow import NO_REPEATS
from ncfix_iso.rs274.parameters import Store
from ncfix_iso.rs274.plans import FlowLine, RS274Unit, has_words

LOCKED = range(8000, 10000)
NOT_AT_HAND = "NCF246"
AFTER = "the position of the axis {{}} after the program O{label} is not known: ncfix does not have its text"
TAKEN = (
    "ncfix does not have the program O{label}, and assumes that it does not change offsets, tool lengths or modal codes"
)


def ran(control: MacroControl, label: str) -> None:
    """Apply the assumed effect of a program whose text is not given: positions are lost, offsets and modes stay."""
    control.warn(
        NOT_AT_HAND,
        TAKEN.format(label=label),
        "check what it sets, or give the folder of its file with --subprograms DIR",
    )
    control.lose(control.axis_indices, AFTER.format(label=label))
    control.places.lose(mask_of(control.axis_indices))
    control.modal.motion, control.modal.feed, control.modal.cycle.initial = NO_MOTION, math.nan, None
    control.outside = label


BAD_JUMP = "NCF242"
OVER_BLOCKS = "ncfix does not support several blocks between THEN and ENDIF"

ONCE = dict(
    zip(
        "ABCIJKDEFHMQRSTUVWXYZ",
        (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 13, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26),
        strict=True,
    )
)
"""Argument specification I: one variable for each address."""

SETS = 10
"""Argument specification II: largest number of times that I J K may occur."""

LENGTHS = frozenset("ABCIJKQRUVWXYZ")
"""Arguments whose numbers count least increments of their address when they have no decimal point."""
BEHIND_TAPE = "the program O{} is after the % at which the control stops reading"


def local_variables(arguments: Iterable[tuple[str, Value]]) -> Store:
    """The local variables that arguments (address, value) set, in the order written."""
    store: Store = {}
    count, last = 1, 0
    for address, value in arguments:
        if address not in ONCE:
            raise Fault("NCF221", f"{address} cannot be an argument of a macro")
        number = ONCE[address]
        if address in "IJK":
            position = "IJK".index(address) + 1
            count += position <= last
            last = position
            number = 3 * count + position
            if count > SETS:
                raise Fault("NCF221", f"I, J and K may appear {SETS} times in a macro call")
        store[number] = Unknown(f"#{number}", value.nominal) if isinstance(value, Unknown) else value
    return store


def named_programs(unit: RS274Unit) -> dict[int, str]:
    """The blocks that begin a program with a name: `<NAME>` stands alone there."""
    program = unit.program
    heads = {shape: span for shape, t in enumerate(program.templates) if (span := head_of(t)) is not None}
    named = (block for block, shape in enumerate(unit.template) if shape in heads) if heads else ()
    return {block: program.slice(block, heads[unit.template[block]]).strip("<> \t") for block in named}


def head_of(template: Template) -> Span | None:
    """The span of the name that begins a program, if the block has nothing else; else None."""
    items = [item for item in template.items if not isinstance(item, Comment)]
    alone = len(items) == 1 and isinstance(items[0], Opaque) and items[0].kind == "text word"
    return items[0].span if alone else None


class Outline:
    """The targets of the control statements of one text.

    programs  number (or name) of each program -> block of its O-word
    starts    the blocks of O-words, ascending
    partner   block of a DO -> block of its END, and the reverse
    """

    def __init__(self, unit: RS274Unit) -> None:
        self.unit = unit
        self.programs: dict[str, int] = {}
        self.starts: list[int] = []
        self.partner: dict[int, int] = {}
        open_loops: list[tuple[str, int]] = []
        names = named_programs(unit)
        for block in sorted({*unit.flows, *names}):
            flow = next((item for item in unit.program.items_of(block) if isinstance(item, FlowItem)), None)
            if block in names or flow is None or flow.keyword == "program":
                self.programs.setdefault(names[block] if block in names or flow is None else str(flow.label), block)
                self.starts.append(block)
                open_loops = []
            elif flow.keyword in ("do", "end"):
                self._note_loop(flow, block, open_loops)

    def _note_loop(self, flow: FlowItem, block: int, open_loops: list[tuple[str, int]]) -> None:
        """Note the DO or END of a loop; `open_loops` are those begun so far in this program."""
        label = str(flow.label)
        if isinstance(flow.label, Literal):
            label = f"{self.unit.program.values_of(block)[flow.label.slot]:g}"
        if flow.keyword == "do":
            open_loops.append((label, block))
            return
        at = next((i for i in range(len(open_loops) - 1, -1, -1) if open_loops[i][0] == label), -1)
        if at >= 0:
            self.partner[block], self.partner[open_loops[at][1]] = open_loops[at][1], block
            del open_loops[at:]

    @cached_property
    def numbers(self) -> Array:
        """(n,) the N word of each block, NaN without."""
        return self.unit.program.column("N")

    def numbered(self, target: int, block: int) -> int:
        """The block with N word `target` in the program of `block`: the next one behind it, else the first."""
        at = bisect_right(self.starts, block)
        first = self.starts[at - 1] if at else 0
        stop = self.starts[at] if at < len(self.starts) else self.unit.stop
        found = first + np.flatnonzero(self.numbers[first:stop] == target)
        if not len(found):
            raise Fault(BAD_JUMP, f"there is no block N{target} in this program")
        later = found[found > block]
        return int(later[0] if len(later) else found[0])


class MacroFlow(ProgramFlow[RS274Unit]):
    """The state of execution.

    find      returns the text of a file by the number or name of its program
    in_parts  only a part of the text is known; `heads`: numbers and names of the program itself
    looked    a subprogram has been searched
    """

    most_calls = 15
    too_deep = f"calls are nested more than {most_calls} deep at O{{}}"
    """Ten of subprograms, five of macros."""

    def __init__(
        self, control: MacroControl, main: RS274Unit, find: Callable[[str], RS274Unit | None], *, in_parts: bool = False
    ) -> None:
        super().__init__(main, control.budget)
        self.control, self.main, self.find = control, main, find
        self.in_parts, self.looked = in_parts, False
        self.heads: frozenset[str] = frozenset()
        self.outlines: dict[int, Outline] = {}

    def outline_of(self, unit: RS274Unit) -> Outline:
        """The outline of a text."""
        if id(unit) not in self.outlines:
            self.outlines[id(unit)] = Outline(unit)
        return self.outlines[id(unit)]

    def begin_at_heads(self, main: RS274Unit) -> None:
        """Take the next part; raises `NotInPartsError` if another program begins in it."""
        self.main = main
        self.outlines.clear()
        outline = self.outline_of(main)
        if len(outline.starts) + len(self.heads) > 1:
            raise NotInPartsError("the text holds several programs")
        self.heads |= outline.programs.keys()

    def unfinished(self) -> Fault | None:
        """The fault if the text ends here, inside a subprogram without M99; None if there is none."""
        return Fault(BAD_JUMP, f"the program O{self.calls[-1].name} ends without M99") if self.calls else None

    # -- statements ---------------------------------------------------------------------------------------------------

    def lowered(self, line: FlowLine, unit: RS274Unit, block: int) -> tuple[Operation, ...]:
        """The operations of a statement."""
        outline = self.outline_of(unit)
        partner = outline.partner.get(block, -1)
        match line.keyword:
            case "program" if outline.starts and block != outline.starts[0]:
                return Let(self.check_returned), Jump(unit.stop)
            case "program":
                return (Let(self.check_returned),)
            case "goto":
                return (Jump(lambda: self.target(line)),)
            case "if goto":
                return (Jump(lambda: self.target(line), lambda: self.holds(line)),)
            case "if then" if not has_words(unit.plan(block)):
                return (Let(lambda: self.control.refuse_rest(OVER_BLOCKS)),)
            case "if then":
                return (Jump(block + 1, lambda: not self.holds(line)),)
            case "do" if partner < 0:
                return (Let(lambda: self.stop(f"DO{line.label} has no END{line.label}")),)
            case "do":
                return (Jump(partner + 1, lambda: not self.holds(line)),) if line.arguments else ()
            case "end" if partner < 0:
                return (Let(lambda: self.stop("this END has no DO before it")),)
            case "end":
                return (Jump(partner),)
        raise AssertionError("there are no other statements")

    def stop(self, text: str) -> None:
        """Raise the fault with which the control stops."""
        raise Fault(BAD_JUMP, text)

    def check_returned(self) -> None:
        """Raise a fault at an O-word inside a called program, which has not returned."""
        fault = self.unfinished()
        if fault is not None:
            raise fault

    def holds(self, line: FlowLine) -> bool:
        """Whether a condition is met."""
        return self.control.deciding(line.arguments[0]) != 0.0

    def target(self, line: FlowLine) -> int:
        """The block to which GOTO leads."""
        label = line.label
        return self.numbered(int(label) if isinstance(label, str) else round(number(self.control.deciding(label))))

    def numbered(self, target: int) -> int:
        """Block N of this program."""
        if target < 1:
            raise Fault(BAD_JUMP, f"there is no block N{target}")
        return self.outline_of(self.unit).numbered(target, self.block - 1)

    # -- calls --------------------------------------------------------------------------------------------------------

    def begin(self, label: str, times: int, arguments: Store | None) -> None:
        """Enter a program, in this text or in a file of its own: a macro with arguments, or a subprogram."""
        self.follow((Call(lambda: self.called(label, times, arguments)),))

    def called(self, label: str, times: int, arguments: Store | None) -> OpenCall[RS274Unit] | None:
        """The call of a program; None if it is not executed, or is one of the builder's whose text is not given."""
        if times < 1:
            self.control.refuse_rest(NO_REPEATS)
            return None
        self.check_depth(label)
        try:
            entry = self.entry(label)
        except Fault as fault:
            if fault.code != NO_SUBPROGRAM or not (label.isdigit() and int(label) in LOCKED):
                raise
            ran(self.control, label)
            return None
        self.budget.foresee(times - 1)
        if arguments is None:
            return OpenCall(label, entry, times - 1)
        scopes = self.control.parameters.scopes
        scopes.append(arguments.copy())

        def again() -> None:
            scopes[-1] = arguments.copy()

        return OpenCall(label, entry, times - 1, again=again, leave=scopes.pop)

    def entry(self, label: str) -> tuple[RS274Unit, int]:
        """The text and block at which a program begins, after its O-word."""
        self.looked = True
        if label in self.heads:
            raise NotInPartsError("the program calls itself")
        for unit in (self.unit, self.main):
            at = self.outline_of(unit).programs.get(label)
            if at is not None and has_words(unit.plan(at)):
                raise Fault(
                    BAD_JUMP, f"ncfix does not support words in the block with the number O{label} of a called program"
                )
            if at is not None:
                return unit, at + 1
        file = self.find(label)
        if file is None and self.in_parts:
            raise NotInPartsError("a subprogram may stand further down")
        if file is None:
            if re.search(rb"(?m)^[ \t]*[Oo:]0*%s(?!\d)" % label.encode(), self.main.program.source):
                hint = f"remove that %, or put O{label} in a file of its own"
                raise Fault(NO_SUBPROGRAM, BEHIND_TAPE.format(label), hint)
            hint = "ncfix searches the file, its folder and that of --subprograms DIR"
            raise Fault(NO_SUBPROGRAM, f"there is no program O{label}", hint)
        outline = self.outline_of(file)
        first = outline.starts[0] if outline.starts else -1
        return file, outline.programs.get(label, first) + 1

    def enter_local(self, target: int, times: int) -> None:
        """M97 of Haas: a subprogram that begins at a block N of this program."""
        found = self.outline_of(self.unit).numbered(target, self.block - 1)
        if times < 1:
            self.control.refuse_rest(NO_REPEATS)
            return
        self.budget.foresee(times - 1)
        self.enter(OpenCall(f"N{target}", (self.unit, found), times - 1))

    def come_back(self, target: int | None) -> None:
        """M99: return, to block N if one is named, or run again if the call has repeats left.

        In the main program: go to that block, or end (the control would start again).
        """
        if target is None:
            self.follow((Return(),))
            return
        if self.calls:
            self.finish(again=False)
        self.jump(self.numbered(target))
