"""O-words: subprograms, branches and loops, and M98 and M99, executed as by LinuxCNC's interpreter.

The interpreter reads line by line. After a branch that is not taken, at the end of a loop, and while a subprogram is
defined or looked for, it skips: it ignores all lines except o-words with the label that it waits for. Labels are known
only once they have been met, and may be computed: so the effect of an o-word is determined when it is executed.
Source: LinuxCNC documentation, "O codes"; what it leaves open was tested with `rs274`.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from functools import partial

from ncfix.control.expressions import Evaluate, Fault, nominal
from ncfix.control.flow import NO_LABEL, NO_SUBPROGRAM, Call, Jump, Let, OpenCall, Operation, ProgramFlow
from ncfix.values import mutable
from ncfix_iso.rs274.control import RS274Control
from ncfix_iso.rs274.parameters import whole
from ncfix_iso.rs274.plans import FlowLine, RS274Unit
from ncfix_iso.rs274.settings import restore

BAD_FLOW = NO_LABEL
MAX_CALLS = 9
"""Largest nesting depth of subprograms (LinuxCNC: 10, with the main program)."""

GLOBAL = frozenset({"sub", "endsub", "call", "return", "program"})
ENDS_OF_LOOPS = {"endwhile": "while", "endrepeat": "repeat"}
NO_REPEATS = "whether a call with L0 is executed depends on the control"
BY_CODE = "M98"
"""Kind of the calls that share #1 to #30 with the caller."""


@mutable
class Label:
    """Where an o-word was first met, its keyword, and the remaining runs of a `repeat`."""

    unit: RS274Unit
    block: int
    keyword: str
    repeats: int = -1


def oword(name: str) -> str:
    """A label as written, without the subprogram it is in: `o100`, `o<name>`."""
    label = name.rpartition("#")[2]
    return f"o{label}" if label.isdigit() else f"o<{label}>"


class OWords(ProgramFlow[RS274Unit]):
    """The program counter, and the effect of o-words on it.

    name             full name of the label of the o-word being executed
    labels           all labels met so far, by full name
    skipping         label for which execution waits; None while not skipping
    skipping_from    where skipping began
    skipping_to_sub  whether it waits for the beginning of a called subprogram
    defining         subprogram that is being defined and skipped; None outside of one
    executed_if      whether a branch of the last `if` has been executed
    breaking         whether a `break` was executed and the end of its loop is awaited
    continuing       whether a `continue` was executed and the end of its loop is awaited
    """

    most_calls = MAX_CALLS
    too_deep = f"subprograms are nested more than {MAX_CALLS} deep at {{}}"

    def __init__(self, control: RS274Control, main: RS274Unit, find: Callable[[str], RS274Unit | None]) -> None:
        super().__init__(main, control.budget)
        self.control = control
        self.find = find
        self.name = ""
        self.labels: dict[str, Label] = {}
        self.skipping: str | None = None
        self.skipping_to_sub = False
        self.skipping_from: tuple[RS274Unit, int] = (main, 0)
        self.defining: str | None = None
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
        """The full name of a label; local labels are prefixed by the subprogram they are in."""
        label = flow.label if isinstance(flow.label, str) else self.computed_label(flow.label)
        if flow.keyword in GLOBAL:
            return label
        scope = self.calls[-1].name if self.calls else self.defining or ""
        return f"{scope}#{label}"

    def computed_label(self, label: Evaluate) -> str:
        """A label given by an expression; `?` if it has no value while skipping."""
        try:
            return str(whole(nominal(label(self.control)), "a label"))
        except Fault:
            if self.skipping is None:
                raise
            return "?"

    def enter_label(self, flow: FlowLine, name: str) -> Label:
        """Record the place of a label; raises `Fault` if it is used elsewhere, too."""
        known = self.labels.setdefault(name, Label(self.unit, self.block - 1, flow.keyword))
        if known.block != self.block - 1 or known.unit is not self.unit:
            line = known.unit.program.line(known.block)
            raise Fault(BAD_FLOW, f"the label {oword(name)} is already used in line {line}")
        return known

    def known(self, name: str, keyword: str, *openings: str) -> Label:
        """The label of a line with this keyword; raises `Fault` if it was not met before as one of `openings`."""
        known = self.labels.get(name)
        if known is None or known.keyword not in openings:
            raise Fault(BAD_FLOW, f"{oword(name)} {keyword} has no {' or '.join(openings)} before it")
        return known

    def skip_to(self, name: str) -> None:
        """Skip lines up to o-words with this label."""
        self.skipping = name
        self.skipping_from = (self.unit, self.block - 1)

    def argument(self, flow: FlowLine) -> float:
        """The value of a condition or argument."""
        return self.control.deciding(flow.arguments[0])

    # -- the walk -----------------------------------------------------------------------------------------------------

    def arrive(self) -> bool:
        """See `ProgramFlow`; while skipping, go to the next o-word of this text."""
        if self.skipping is not None:
            at = bisect_left(self.unit.flows, self.block)
            if at == len(self.unit.flows):
                fault = self.missing_end()
                self.unit, self.block = self.skipping_from[0], self.skipping_from[1] + 1
                raise fault
            self.block = self.unit.flows[at]
        return self.block < self.unit.stop

    def lowered(self, line: FlowLine, unit: RS274Unit, block: int) -> tuple[Operation, ...]:
        """The operations of an o-word: it is ignored, or executed; then execution may skip."""
        handler = self.handlers[line.keyword]
        return (
            Jump(None, partial(self.passes_over, line)),
            Let(lambda: handler(line, self.name)),
            Jump(None, lambda: self.skipping is not None),
        )

    def passes_over(self, flow: FlowLine) -> bool:
        """Whether an o-word is ignored because another one is awaited or a subprogram is being defined."""
        name, keyword = self.name_of(flow), flow.keyword
        self.name = name
        if keyword in ("sub", "program") and self.defining is not None:
            raise Fault(BAD_FLOW, f"{oword(name)} {keyword} is inside the subprogram {oword(self.defining)}")
        if self.skipping is not None and (self.skipping != name or keyword == "call"):
            return True
        if self.skipping_to_sub and keyword not in ("sub", "program"):
            return True
        return self.defining is not None and keyword not in ("endsub", "return")

    def unfinished(self) -> Fault | None:
        """The error if the text ends here; None if it may."""
        if self.skipping is not None:
            return self.missing_end()
        if self.calls:
            return Fault(
                BAD_FLOW, f"the file ends inside the subprogram {oword(self.calls[-1].name)}", "endsub is missing"
            )
        return None

    def missing_end(self) -> Fault:
        """The error for a text that ends while something is still awaited."""
        label = oword(self.skipping or "")
        if self.skipping_to_sub:
            hint = "ncfix searches the rest of the file, the folder of the program and that of --subprograms DIR"
            return Fault(NO_SUBPROGRAM, f"there is no subprogram {label}", hint)
        what = "endsub" if self.defining is not None else "the end"
        return Fault(BAD_FLOW, f"the program ends and {what} of {label} is missing")

    # -- subprograms --------------------------------------------------------------------------------------------------

    def subprogram(self, flow: FlowLine, name: str) -> None:
        """`sub`, or a bare program number: the subprogram begins here, or is only defined."""
        by_code = bool(self.calls) and self.calls[-1].kind == BY_CODE
        if self.calls and self.skipping is not None and by_code != (flow.keyword == "program"):
            raise Fault(
                BAD_FLOW,
                f"{oword(name)} is called with {'M98' if by_code else 'call'}, but does not begin in the form for that",
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
        arguments = [argument(self.control) for argument in flow.arguments]
        saved = parameters.locals()
        self.begin(name, 0, "", lambda: parameters.set_locals(saved))
        parameters.set_locals(arguments)

    def call_by_code(self, label: str, times: int) -> None:
        """M98 P.. L..: the subprogram shares #1 to #30 with its caller."""
        self.budget.foresee(times)
        if times > 0:
            self.begin(label, times - 1, BY_CODE, lambda: None)
        elif not self.control.rules.strict:
            self.control.refuse_rest(NO_REPEATS)

    def begin(self, label: str, left: int, kind: str, restored: Callable[[], None]) -> None:
        """Enter a subprogram that is known, in a file of its own, or further down in the text."""
        self.check_depth(oword(label))
        control, known = self.control, self.labels.get(label)

        def leave() -> None:
            control.parameters.scopes.pop()
            saved = control.saved.pop()
            restored()
            if saved is not None and saved.at_return:
                restore(control, saved.modal)

        def again() -> None:
            call.entry = self.labels[label].unit, self.labels[label].block

        file = None if known else self.find(label)
        begin = self.block if control.rules.strict else 0
        entry = (known.unit, known.block) if known else (file, 0) if file else (self.unit, begin)
        call = OpenCall(label, entry, left, kind, again, leave)
        control.parameters.scopes.append({})
        control.saved.append(None)
        if known is None:
            self.skip_to(label)
            self.skipping_to_sub = True
        self.follow((Call(lambda: call),))

    def leave(self, flow: FlowLine, name: str) -> None:
        """`endsub` and `return`."""
        if not self.calls:
            if self.defining is None:
                raise Fault(BAD_FLOW, f"{oword(name)} {flow.keyword} is outside a subprogram")
            if flow.keyword == "endsub":
                self.defining = self.skipping = None
            return
        if self.calls[-1].kind == BY_CODE:
            raise Fault(BAD_FLOW, f"{oword(self.calls[-1].name)} was called with M98 and has to end with M99")
        value = self.argument(flow) if flow.arguments else 0.0
        self.control.parameters.returned = (value, bool(flow.arguments))
        self.finish()

    def finish(self, kind: str = "", *, again: bool = True) -> None:
        """See `ProgramFlow`."""
        self.skipping = None
        super().finish(kind, again=again)

    def go_to(self, label: Label) -> None:
        """Continue at a label."""
        self.unit, self.block = label.unit, label.block

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
        self.known(name, flow.keyword, "if")
        if self.executed_if:
            self.skip_to(name)
        elif self.argument(flow) != 0.0:
            self.skipping = None
            self.executed_if = True

    def otherwise(self, flow: FlowLine, name: str) -> None:
        """`else`."""
        self.known(name, flow.keyword, "if")
        if self.executed_if:
            self.skip_to(name)
        elif self.skipping is not None:
            self.skipping = None
            self.executed_if = True

    def end_branch(self, flow: FlowLine, name: str) -> None:
        """`endif`."""
        self.known(name, flow.keyword, "if")
        self.skipping = None
        self.executed_if = True

    # -- loops --------------------------------------------------------------------------------------------------------

    def do(self, flow: FlowLine, name: str) -> None:
        """`do`: the beginning of a loop with its condition at the end."""
        self.skipping = None
        self.labels.setdefault(name, Label(self.unit, self.block - 1, flow.keyword))

    def loop(self, flow: FlowLine, name: str) -> None:
        """`while [..]`: the beginning of a loop, or the end of a `do` loop."""
        known = self.labels.get(name)
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
        self.known(name, flow.keyword, "while", "do")
        self.skip_to(name)
        self.breaking = True

    def continue_loop(self, flow: FlowLine, name: str) -> None:
        """`continue`."""
        self.known(name, flow.keyword, "while", "do")
        if self.skipping is None:
            self.skip_to(name)
            self.continuing = True

    def end_loop(self, flow: FlowLine, name: str) -> None:
        """`endwhile`, `endrepeat`."""
        label = self.known(name, flow.keyword, ENDS_OF_LOOPS[flow.keyword])
        if self.skipping is None or self.continuing:
            self.continuing = False
            self.skipping = None
            self.go_to(label)
        else:
            self.skipping = None
