"""O-words: subprograms, branches and loops, and M98 and M99, followed as LinuxCNC's interpreter does.

The interpreter reads on from line to line. A branch not taken, a loop left, a subprogram being defined or looked for
make it skip: it passes over all lines but o-words with the label that it waits for.
Source: LinuxCNC documentation, "O codes"; what it leaves open was tried out on `rs274`.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, field

from ncfix.control.faults import Fault
from ncfix_iso.rs274.arithmetic import whole
from ncfix_iso.rs274.control import Control
from ncfix_iso.rs274.expressions import Evaluate
from ncfix_iso.rs274.labels import BAD_FLOW, Label, Labels, oword
from ncfix_iso.rs274.parameters import Store
from ncfix_iso.rs274.plans import FlowLine, RS274Unit
from ncfix_iso.rs274.settings import restore

MAX_CALLS = 10
"""How deep subprograms may be nested, the main program included (LinuxCNC)."""

NO_SUBPROGRAM = "NCF231"
TOO_DEEP = "NCF232"
GLOBAL = frozenset({"sub", "endsub", "call", "return", "program"})
ENDS_OF_LOOPS = {"endwhile": "while", "endrepeat": "repeat"}


@dataclass(slots=True)
class Call:
    """A subprogram call that has not returned.

    label       of the subprogram
    unit, block where to go on after it
    by_code     it was called with M98: #1 to #30 are shared with the caller
    saved       the caller's #1 to #30 otherwise
    remaining   how many more times M98 calls it
    """

    label: str
    unit: RS274Unit
    block: int
    by_code: bool = False
    saved: list[tuple[float, bool]] = field(default_factory=list)
    remaining: int = 0


class FlowControl:
    """Where execution stands, and where o-words take it: a `Course`.

    skipping_to_sub  what is waited for is the begin of a subprogram that has been called
    defining         the subprogram that is being defined and passed over; None outside of one
    executed_if      a branch of the `if` that was met last has been executed
    breaking         a `break` has been executed, and the end of its loop is waited for
    continuing       the same of a `continue`
    """

    def __init__(self, control: Control, main: RS274Unit, find: Callable[[str], RS274Unit | None]) -> None:
        self.control = control
        self.find = find
        self.unit = main
        self.block = 0
        self.calls: list[Call] = []
        self.skipping: str | None = None
        self.skipping_to_sub = False
        self.skipping_from: tuple[RS274Unit, int] = (main, 0)
        self.defining: str | None = None
        self.labels = Labels()
        self.executed_if = False
        self.breaking = False
        self.continuing = False
        self.handlers: dict[str, Callable[[FlowLine, str], None]] = {
            "sub": self.subprogram,
            "program": self.subprogram,
            "endsub": self.leave,
            "return": self.leave,
            "call": self.call,
            "do": self.do,
            "while": self.loop,
            "repeat": self.repeat,
            "if": self.branch,
            "elseif": self.otherwise_if,
            "else": self.otherwise,
            "endif": self.end_branch,
            "break": self.break_loop,
            "continue": self.continue_loop,
            "endwhile": self.end_loop,
            "endrepeat": self.end_loop,
        }

    # -- labels -------------------------------------------------------------------------------------------------------

    def name_of(self, flow: FlowLine) -> str:
        """The full name of a label: local ones carry the name of the subprogram that they stand in."""
        label = flow.label if isinstance(flow.label, str) else self.computed_label(flow.label)
        if flow.keyword in GLOBAL:
            return label
        scope = self.calls[-1].label if self.calls else self.defining or ""
        return f"{scope}#{label}"

    def computed_label(self, label: Evaluate) -> str:
        """A label given by an expression; where execution skips it may not have a value, and is none then."""
        try:
            return str(whole(label(self.control), "a label"))
        except Fault:
            if self.skipping is None:
                raise
            return "?"

    def enter_label(self, flow: FlowLine, name: str) -> Label:
        """Note where a label stands; raises `Fault` if it stands elsewhere too."""
        return self.labels.enter(name, flow.keyword, self.unit, self.block - 1)

    def skip_to(self, name: str) -> None:
        """Pass over what follows, up to o-words with this label."""
        self.skipping = name
        self.skipping_from = (self.unit, self.block - 1)

    def argument(self, flow: FlowLine) -> float:
        """The value of a condition or argument."""
        return self.control.deciding(flow.arguments[0])

    # -- the walk -----------------------------------------------------------------------------------------------------

    def arrive(self) -> bool:
        """See `Interpreter`; while skipping: go to the next o-word of this text."""
        if self.skipping is not None:
            at = bisect_left(self.unit.flows, self.block)
            if at == len(self.unit.flows):
                fault = self.missing_end()
                self.unit, self.block = self.skipping_from[0], self.skipping_from[1] + 1
                raise fault
            self.block = self.unit.flows[at]
        return self.block < self.unit.stop

    def follow(self, flow: FlowLine) -> None:
        """Do what an o-word says; `block` is already that of the next line."""
        name = self.name_of(flow)
        keyword = flow.keyword
        if keyword in ("sub", "program") and self.defining is not None:
            raise Fault(BAD_FLOW, f"{oword(name)} {keyword} stands inside the subprogram {oword(self.defining)}")
        if self.skipping is not None and self.skipping != name:
            return
        if self.skipping_to_sub and keyword not in ("sub", "program"):
            return
        if self.defining is not None and keyword not in ("endsub", "return"):
            return
        if keyword == "call" and self.skipping is not None:
            return
        self.handlers[keyword](flow, name)

    def unfinished(self) -> Fault | None:
        """What is wrong if the text ends here."""
        if self.skipping is not None:
            return self.missing_end()
        if self.calls:
            return Fault(
                BAD_FLOW, f"the file ends inside the subprogram {oword(self.calls[-1].label)}", "endsub is missing"
            )
        return None

    def missing_end(self) -> Fault:
        """The fault of a text that ends while something is still looked for."""
        label = oword(self.skipping or "")
        if self.skipping_to_sub:
            hint = "it is looked for further down, in files beside the program, and where --subprograms DIR says"
            return Fault(NO_SUBPROGRAM, f"there is no subprogram {label}", hint)
        what = "endsub" if self.defining is not None else "the end"
        return Fault(BAD_FLOW, f"the program ends and {what} of {label} is missing")

    # -- subprograms --------------------------------------------------------------------------------------------------

    def subprogram(self, flow: FlowLine, name: str) -> None:
        """`sub`, or a bare program number: it begins here, or is only defined here."""
        by_code = bool(self.calls) and self.calls[-1].by_code
        if self.calls and self.skipping is not None and by_code != (flow.keyword == "program"):
            raise Fault(
                BAD_FLOW,
                f"{oword(name)} is called with {'M98' if by_code else 'call'} and begins with the other's form",
            )
        if self.skipping is not None:
            self.enter_label(flow, name)
        self.skipping, self.skipping_to_sub = None, False
        if flow.keyword == "sub" and not self.calls:
            self.enter_label(flow, name)
            self.defining = name
            self.skip_to(name)

    def call(self, flow: FlowLine, name: str) -> None:
        """`call [..] [..]`: the arguments become #1, #2, ..."""
        parameters = self.control.parameters
        arguments = [self.control.value_of(argument) for argument in flow.arguments]
        saved = parameters.locals()
        self.begin(Call(name, self.unit, self.block, saved=saved))
        parameters.set_locals(arguments)

    def call_by_code(self, label: str, times: int) -> None:
        """M98 P.. L..: the subprogram shares #1 to #30 with its caller."""
        self.control.budget.foresee(times)
        if times > 0:
            self.begin(Call(label, self.unit, self.block, by_code=True, remaining=times - 1))

    def begin(self, call: Call) -> None:
        """Enter a subprogram: known already, in a file of its own, or further down."""
        if len(self.calls) + 1 >= MAX_CALLS:
            raise Fault(TOO_DEEP, f"subprograms are nested more than {MAX_CALLS - 1} deep at {oword(call.label)}")
        self.calls.append(call)
        self.control.parameters.scopes.append(Store())
        self.control.saved.append(None)
        known = self.labels.find(call.label)
        if known is not None:
            self.go_to(known)
            return
        self.skip_to(call.label)
        self.skipping_to_sub = True
        file = self.find(call.label)
        if file is not None:
            self.unit, self.block = file, 0
        elif not self.control.rules.strict:
            self.block = 0

    def leave(self, flow: FlowLine, name: str) -> None:
        """`endsub` and `return`."""
        if not self.calls:
            if self.defining is None:
                raise Fault(BAD_FLOW, f"{oword(name)} {flow.keyword} stands outside a subprogram")
            if flow.keyword == "endsub":
                self.defining = self.skipping = None
            return
        if self.calls[-1].by_code:
            raise Fault(BAD_FLOW, f"{oword(self.calls[-1].label)} was called with M98 and has to end with M99")
        parameters = self.control.parameters
        value = self.argument(flow) if flow.arguments else 0.0
        parameters.returned = (value, bool(flow.arguments))
        self.finish()

    def finish(self) -> None:
        """Return from a subprogram, or run it again if M98 asked for it several times."""
        call = self.calls[-1]
        self.skipping = None
        if call.remaining:
            call.remaining -= 1
            self.go_to(self.labels.entries[call.label])
            return
        self.calls.pop()
        self.control.parameters.scopes.pop()
        saved = self.control.saved.pop()
        if not call.by_code:
            self.control.parameters.set_locals(call.saved)
        self.unit, self.block = call.unit, call.block
        if saved is not None and saved.at_return:
            restore(self.control, saved.modal)

    def go_to(self, label: Label) -> None:
        """Go on at a label."""
        self.unit, self.block = label.unit, label.block

    def under_way(self) -> tuple[object, ...]:
        """The calls that have not returned, and how often each is still to be made."""
        return tuple((id(call.unit), call.block, call.remaining) for call in self.calls)

    # -- branches -----------------------------------------------------------------------------------------------------

    def branch(self, flow: FlowLine, name: str) -> None:
        """`if [..]`."""
        self.enter_label(flow, name)
        self.executed_if = self.argument(flow) != 0.0
        self.skipping = None
        if not self.executed_if:
            self.skip_to(name)

    def otherwise_if(self, flow: FlowLine, name: str) -> None:
        """`elseif [..]`."""
        self.labels.known(name, flow.keyword, "if")
        if self.executed_if:
            self.skip_to(name)
        elif self.argument(flow) != 0.0:
            self.skipping = None
            self.executed_if = True

    def otherwise(self, flow: FlowLine, name: str) -> None:
        """`else`."""
        self.labels.known(name, flow.keyword, "if")
        if self.executed_if:
            self.skip_to(name)
        elif self.skipping is not None:
            self.skipping = None
            self.executed_if = True

    def end_branch(self, flow: FlowLine, name: str) -> None:
        """`endif`."""
        self.labels.known(name, flow.keyword, "if")
        self.skipping = None
        self.executed_if = True

    # -- loops --------------------------------------------------------------------------------------------------------

    def do(self, flow: FlowLine, name: str) -> None:
        """`do`: a loop whose condition stands at its end."""
        self.skipping = None
        self.labels.entries.setdefault(name, Label(self.unit, self.block - 1, flow.keyword))

    def loop(self, flow: FlowLine, name: str) -> None:
        """`while [..]`: the begin of a loop, or the end of a `do`."""
        known = self.labels.find(name)
        self.skipping = None
        value = self.argument(flow)
        if known is not None and known.keyword == "do":
            if value != 0.0 and not self.breaking:
                self.go_to(known)
            self.breaking = False
            return
        self.enter_label(flow, name)
        if value == 0.0:
            self.skip_to(name)

    def repeat(self, flow: FlowLine, name: str) -> None:
        """`repeat [..]`."""
        label = self.enter_label(flow, name)
        self.skipping = None
        if label.repeats < 0:
            label.repeats = round(self.argument(flow))
        if label.repeats > 0:
            label.repeats -= 1
            self.control.parameters.changes += 1
        else:
            label.repeats = -1
            self.skip_to(name)

    def break_loop(self, flow: FlowLine, name: str) -> None:
        """`break`."""
        self.labels.known(name, flow.keyword, "while", "do")
        self.skip_to(name)
        self.breaking = True

    def continue_loop(self, flow: FlowLine, name: str) -> None:
        """`continue`."""
        self.labels.known(name, flow.keyword, "while", "do")
        if self.skipping is None:
            self.skip_to(name)
            self.continuing = True

    def end_loop(self, flow: FlowLine, name: str) -> None:
        """`endwhile`, `endrepeat`."""
        label = self.labels.known(name, flow.keyword, ENDS_OF_LOOPS[flow.keyword])
        if self.skipping is None or self.continuing:
            self.continuing = False
            self.skipping = None
            self.go_to(label)
        else:
            self.skipping = None
