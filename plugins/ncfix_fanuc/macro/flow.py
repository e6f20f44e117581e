"""Where a program of Macro B goes on: GOTO, IF, WHILE, and the calls M98, G65 and G66.

Source: Fanuc 30i operator's manual, "Custom macro", "Branch and repetition", "Macro call"; "Subprogram".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ncfix.control.faults import Fault
from ncfix.control.parts import NotInPartsError
from ncfix_fanuc.macro import builder
from ncfix_fanuc.macro.arithmetic import number
from ncfix_fanuc.macro.outline import Outline
from ncfix_iso.rs274.control import Control
from ncfix_iso.rs274.flow import NO_SUBPROGRAM, TOO_DEEP
from ncfix_iso.rs274.parameters import Store
from ncfix_iso.rs274.plans import FlowLine, RS274Unit, has_words

MAX_CALLS = 15
"""Calls that may be nested: ten of subprograms, five of macros."""

BAD_JUMP = "NCF242"


@dataclass(slots=True)
class Call:
    """A call that has not returned.

    label       program that was called
    unit, block where to go on after it
    entry       the text and block where it begins
    remaining   how many more times it is to run
    arguments   local variables of a macro; None for a subprogram, which shares its caller's
    """

    label: str
    unit: RS274Unit
    block: int
    entry: tuple[RS274Unit, int]
    remaining: int
    arguments: Store | None


class MacroFlow:
    """Where execution stands, and where statements take it.

    unit, block  what is executed next
    passed       the condition of the last IF .. THEN held
    skipping     always None: nothing is looked for line by line here
    in_parts     only a part of the text is known; `heads`: numbers and names of the program itself
    looked       a subprogram has been looked for
    """

    skipping: str | None = None

    def __init__(
        self, control: Control, main: RS274Unit, find: Callable[[str], RS274Unit | None], *, in_parts: bool = False
    ) -> None:
        self.in_parts, self.looked = in_parts, False
        self.heads: frozenset[str] = frozenset()
        self.control = control
        self.main = main
        self.find = find
        self.unit = main
        self.block = 0
        self.calls: list[Call] = []
        self.passed = False
        self.outlines: dict[int, Outline] = {}
        self.handlers: dict[str, Callable[[FlowLine], None]] = {
            "program": self.program,
            "goto": self.jump,
            "if goto": self.branch,
            "if then": self.condition,
            "do": self.loop,
            "end": self.loop_end,
        }

    @property
    def outline(self) -> Outline:
        """The outline of the text that is executed."""
        return self.outline_of(self.unit)

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

    # -- what the interpreter asks ------------------------------------------------------------------------------------

    def arrive(self) -> bool:
        """See `Interpreter`."""
        return self.block < self.unit.stop

    def follow(self, flow: FlowLine) -> None:
        """Do what a statement says; `block` is already that of the next line."""
        self.handlers[flow.keyword](flow)

    def unfinished(self) -> Fault | None:
        """What is wrong if the text ends here."""
        return self.missing_end() if self.calls else None

    def missing_end(self) -> Fault:
        """The fault of a subprogram without M99."""
        return Fault(BAD_JUMP, f"the program O{self.calls[-1].label} ends without M99")

    # -- statements ---------------------------------------------------------------------------------------------------

    def program(self, flow: FlowLine) -> None:
        """An O-word: the head of the program that runs, or that of the next one."""
        here = self.block - 1
        if self.calls:
            raise self.missing_end()
        if here != self.outline.starts[0]:
            self.block = self.unit.stop

    def jump(self, flow: FlowLine) -> None:
        """GOTO n."""
        label = flow.label
        self.go_to(int(label) if isinstance(label, str) else round(number(self.control.deciding(label))))

    def go_to(self, target: int) -> None:
        """Go on at block N of this program."""
        if target < 1:
            raise Fault(BAD_JUMP, f"there is no block N{target}")
        found = self.outline.numbered(target, self.block - 1)
        if found is None:
            raise Fault(BAD_JUMP, f"there is no block N{target} in this program")
        self.block = found

    def branch(self, flow: FlowLine) -> None:
        """IF [..] GOTO n."""
        if self.control.deciding(flow.arguments[0]) != 0.0:
            self.jump(flow)

    def condition(self, flow: FlowLine) -> None:
        """IF [..] THEN: whether the rest of the block is done."""
        self.passed = self.control.deciding(flow.arguments[0]) != 0.0

    def loop(self, flow: FlowLine) -> None:
        """WHILE [..] DO m, and DO m, which never ends by itself."""
        end = self.outline.partner.get(self.block - 1)
        if end is None:
            raise Fault(BAD_JUMP, f"DO{flow.label} has no END{flow.label}")
        if flow.arguments and self.control.deciding(flow.arguments[0]) == 0.0:
            self.block = end + 1

    def loop_end(self, flow: FlowLine) -> None:
        """END m: back to its DO."""
        begin = self.outline.partner.get(self.block - 1)
        if begin is None:
            raise Fault(BAD_JUMP, "this END has no DO before it")
        self.block = begin

    # -- calls --------------------------------------------------------------------------------------------------------

    def call_by_code(self, label: str, times: int) -> None:
        """M98: the subprogram shares the local variables of its caller."""
        self.begin(label, times, None)

    def begin(self, label: str, times: int, arguments: Store | None) -> None:
        """Enter a program: in this text, or in a file of its own."""
        if times < 1:
            return
        if len(self.calls) >= MAX_CALLS:
            raise Fault(TOO_DEEP, f"calls are nested more than {MAX_CALLS} deep at O{label}")
        try:
            entry = self.entry(label)
        except Fault as fault:
            if fault.code != NO_SUBPROGRAM or not builder.is_builders(label):
                raise
            builder.ran(self.control, label)
            return
        self.enter(Call(label, self.unit, self.block, entry, times - 1, arguments))

    def enter(self, call: Call) -> None:
        """Go to where a call leads."""
        self.control.budget.foresee(call.remaining)
        self.calls.append(call)
        self.start(call)

    def start(self, call: Call) -> None:
        """Begin a call, for the first time or again."""
        if call.arguments is not None:
            fresh = Store(dict(call.arguments.values), set(call.arguments.runtime))
            self.control.parameters.scopes.append(fresh)
        self.unit, self.block = call.entry

    def entry(self, label: str) -> tuple[RS274Unit, int]:
        """The text and block at which a program begins, after its O-word."""
        self.looked = True
        if label in self.heads:
            raise NotInPartsError("the program calls itself")
        for unit in (self.unit, self.main):
            at = self.outline_of(unit).programs.get(label)
            if at is not None and has_words(unit.plan(at)):
                raise Fault(BAD_JUMP, f"words beside the number O{label} of a program that is called are not followed")
            if at is not None:
                return unit, at + 1
        file = self.find(label)
        if file is None and self.in_parts:
            raise NotInPartsError("a subprogram may stand further down")
        if file is None:
            hint = "it is looked for in the file, in files beside it, and where --subprograms DIR says"
            raise Fault(NO_SUBPROGRAM, f"there is no program O{label}", hint)
        outline = self.outline_of(file)
        first = outline.starts[0] if outline.starts else -1
        return file, outline.programs.get(label, first) + 1

    def under_way(self) -> tuple[object, ...]:
        """The calls that have not returned, and how often each is still to be made."""
        return tuple((id(call.unit), call.block, call.remaining) for call in self.calls)

    def enter_local(self, target: int, times: int) -> None:
        """M97 of Haas: a subprogram that begins at a block N of this program."""
        found = self.outline.numbered(target, self.block - 1)
        if found is None:
            raise Fault(BAD_JUMP, f"there is no block N{target} in this program")
        if times > 0:
            self.enter(Call(f"N{target}", self.unit, self.block, (self.unit, found), times - 1, None))

    def finish(self, target: int | None = None) -> None:
        """M99: return, to a block N if one is named, or run again if the call asked for several times."""
        call = self.calls[-1]
        if call.arguments is not None:
            self.control.parameters.scopes.pop()
        if call.remaining and target is None:
            call.remaining -= 1
            self.start(call)
            return
        self.calls.pop()
        self.unit, self.block = call.unit, call.block
        if target is not None:
            self.go_to(target)
