"""What the blocks of each shape do: their words as functions of their numbers, M codes, flow; and Q parameters.

A parameter that the program has not set holds what an earlier program left in it. It is known only at run time, and so
is everything that is computed from it. Angles in formulas are degrees.

Source: TNC 640 user's manual, "Q parameters".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace

from ncfix.control.expressions import FUNCTIONS, SUMS, Evaluate, Expressions, Unknown, Value, nominal
from ncfix.text.reach import UNREAD, Deletable, deletable
from ncfix.text.tree import (
    Assignment,
    Command,
    Constant,
    Item,
    NamedParameter,
    Opaque,
    OWordLine,
    Span,
    StringLiteral,
    Template,
    Word,
)
from ncfix.values import frozen, mutable

PATH_FUNCTIONS = frozenset({"l", "lp", "ln", "c", "cp", "cr", "ct", "ctp", "cc", "rnd", "chf"})
OPENING = ("tool ", "cycl ", "plane ", "trans ", "appr ", "dep ")
"""How the names of other blocks begin that are no blocks of words alone."""

LETTERS = frozenset("XYZABCUVW")
OWN_WORDS = {
    103: frozenset("F"),
    112: frozenset("TAE"),
    118: LETTERS,
    120: frozenset({"LA"}),
    124: frozenset("T"),
    128: frozenset("F"),
    140: frozenset({"MB", "F"}),
}
"""M code -> the addresses of words after it that belong to it: limits of the handwheel, a feed, a distance."""

EQUAL = 1e-9
"""Two numbers that differ by less than this count as equal."""


@frozen
class KlartextPlan:
    """What the blocks of one shape do.

    name         what the block begins with: `l`, `cycl def 200`, `plane spatial`; empty for words alone
    words        address -> value, for the words of the motion
    codes        M codes, each with the words that belong to it
    flags        words without values: `fmax`, `r0`, `dr+`, `stay`; `axis c` of M94 and M138
    assignments  (Q parameter, its value) for each that the block sets
    flow         label, call or condition
    test         the value of the condition
    tool         the name of a tool, or the value of its number
    statement    kind and place of a statement whose text the grammar does not analyse
    spans        address -> where the word stands
    skip         block skip, `/`, at the beginning of the block
    moves        the block leads somewhere, by its words or by its path function alone
    empty        the block does nothing
    """

    name: str = ""
    words: Mapping[str, Evaluate] = field(default_factory=dict)
    codes: tuple[tuple[int, Mapping[str, Evaluate]], ...] = ()
    flags: frozenset[str] = frozenset()
    assignments: tuple[tuple[str, Evaluate], ...] = ()
    flow: OWordLine | None = None
    test: Evaluate | None = None
    tool: str | Evaluate | None = None
    statement: tuple[str, Span] | None = None
    spans: Mapping[str, Span] = field(default_factory=dict)
    skip: Deletable | None = None
    moves: bool = False
    empty: bool = False


CORNERS = frozenset({"RND", "CHF"})
"""Addresses of words that are path functions themselves."""

STATEMENTS = frozenset({"program", "statement", UNREAD})
"""Kinds of text that the grammar does not analyse."""

CARTESIAN = frozenset(letter for axis in "XYZABCUVW" for letter in (axis, "I" + axis))
POLAR = frozenset({"PA", "IPA", "PR", "IPR"})
VECTOR = frozenset({"TX", "TY", "TZ"})
MOVING = CARTESIAN | POLAR | VECTOR
"""The addresses that say where a motion leads."""

SIZES = frozenset({"R", "LEN", "CCA"})
"""Addresses of sizes: the radius of an arc, the length of a line (APPR, DEP), the angle about a centre."""

ALWAYS_MOVING = frozenset({"c", "cp", "cr", "ct", "ctp", "ln"})
"""Path functions that move even without words for their end: `C DR-` is a full circle."""

LEADING = ("appr ", "dep ", "cycl call")
"""How the names of other blocks begin that move the tool, if only to drill where it stands."""


def owners(items: Sequence[Item]) -> dict[int, int]:
    """Place of an item -> M code, for words that belong to an M code before them (`M118 X1 Y1`), not to the motion."""
    found: dict[int, int] = {}
    code = -1
    for place, item in enumerate(items):
        match item:
            case Word("M", Constant(value)):
                code = int(value)
            case Word(address) if address in OWN_WORDS.get(code, ()):
                found[place] = code
    return found


def opens_block(name: str) -> bool:
    """Whether a name is that of a block that is more than words alone."""
    return name in PATH_FUNCTIONS or name.startswith(OPENING)


def own_words(items: Sequence[Item]) -> list[Word]:
    """The words of a block without its number and those that belong to M codes."""
    owned = owners(items)
    return [w for place, w in enumerate(items) if isinstance(w, Word) and w.address != "N" and place not in owned]


def codes_of(items: Sequence[Item]) -> tuple[tuple[int, Mapping[str, Evaluate]], ...]:
    """The M codes of a block, each with the words that belong to it."""
    owned = owners(items)
    codes: list[tuple[int, dict[str, Evaluate]]] = []
    for place, item in enumerate(items):
        match item:
            case Word("M", Constant(value)):
                codes.append((int(value), {}))
            case Word(address, value) if place in owned:
                codes[-1][1][address] = compiled(value)
    return tuple(codes)


def assigned(item: Assignment) -> tuple[str, Evaluate]:
    """The Q parameter that an assignment sets, and the value."""
    assert isinstance(item.target, NamedParameter), "this family has no arrays"
    return item.target.name, compiled(item.value)


def is_motion_word(word: Word) -> bool:
    """Whether a word belongs to the motion: it is neither an M code nor the tool of TOOL CALL and TOOL DEF."""
    return word.address != "TOOL" and not (word.address == "M" and isinstance(word.value, Constant))


def tool_of(words: Sequence[Word]) -> str | Evaluate | None:
    """The name of the tool in a block, or the value of its number; None without a tool."""
    value = next((word.value for word in words if word.address == "TOOL"), None)
    if value is None:
        return None
    return value.value if isinstance(value, StringLiteral) else compiled(value)


def plan_of(template: Template) -> KlartextPlan:
    """Work out what the blocks of one shape do."""
    items = template.items
    names = [item.name for item in items if isinstance(item, Command)]
    opening = next(filter(opens_block, names), "")
    words = list(filter(is_motion_word, own_words(items)))
    flow = next((item for item in items if isinstance(item, OWordLine)), None)
    opaque = (item for item in items if isinstance(item, Opaque) and item.kind in STATEMENTS)
    plan = KlartextPlan(
        name=next((word.address.lower() for word in words if word.address in CORNERS), opening),
        words={word.address: compiled(word.value) for word in words},
        codes=codes_of(items),
        flags=frozenset(names) - {opening},
        assignments=tuple(assigned(item) for item in items if isinstance(item, Assignment)),
        flow=flow,
        test=compiled(flow.arguments[0]) if flow is not None and flow.keyword == "if" else None,
        tool=tool_of(template.words),
        statement=next(((item.kind, item.span) for item in opaque), None),
        spans={word.address: word.span for word in reversed(words)},
        skip=deletable(template, ""),
        moves=any(word.address in MOVING for word in words) or opening in ALWAYS_MOVING,
    )
    return replace(plan, empty=plan == KlartextPlan())


# -- Q parameters ------------------------------------------------------------------------------------------------------


@mutable
class QParameters:
    """The Q parameters; QL parameters belong to one program, the others to all programs.

    values   parameter -> value, for those that the program has set or the setup gives
    read     parameters that the program has read from the control or measured, so that no setup can give them
    changes  how often a parameter has changed its value
    """

    values: dict[str, Value] = field(default_factory=dict)
    read: set[str] = field(default_factory=set)
    changes: int = 0

    def get(self, name: str) -> Value:
        """The value of a parameter; one that was never set is unknown."""
        return self.values.get(name, Unknown(name))

    def assign(self, name: str, value: Value) -> None:
        """Set a parameter, and count and note what that changes."""
        unknown, number = isinstance(value, Unknown), nominal(value)
        self.changes += name not in self.values or nominal(self.values[name]) != number or unknown
        self.values[name] = number
        if isinstance(value, Unknown):
            self.read |= set() if value.why else {name}
            self.values[name] = Unknown(value.why or name, number)

    def enter(self) -> dict[str, Value]:
        """Enter a called program, which has QL parameters of its own; returns those of the caller, for `leave`."""
        return {name: self.values.pop(name) for name in [name for name in self.values if name.startswith("QL")]}

    def leave(self, own: Mapping[str, Value]) -> None:
        """Leave a called program; `own`: the QL parameters of the caller, from `enter`."""
        self.enter()
        for name, value in own.items():
            self.assign(name, value)


@mutable
class FormulaScope:
    """What a formula may refer to.

    numbers     the numbers of the program
    first       the place among them at which the numbers of the block begin
    parameters  the Q parameters
    """

    numbers: Sequence[float] = ()
    first: int = 0
    parameters: QParameters = field(default_factory=QParameters)


OPERATORS: dict[str, Callable[[float, float], float]] = {
    **SUMS,
    "/": lambda a, b: a / b,
    "div": lambda a, b: a / b,
    "%": math.fmod,
    "^": lambda a, b: a**b,
    "len": math.hypot,
    "ang": lambda a, b: math.degrees(math.atan2(a, b)) % 360.0,
    "equ": lambda a, b: float(abs(a - b) < EQUAL),
    "ne": lambda a, b: float(abs(a - b) >= EQUAL),
    "gt": lambda a, b: float(a > b),
    "lt": lambda a, b: float(a < b),
}
"""Operator -> what it computes; `a ANG b` is the angle whose opposite side is `a` and whose adjacent side is `b`."""

FUNCTIONS_OF_FORMULAS: dict[str, tuple[Callable[..., float], int]] = {
    **FUNCTIONS,
    "pi": (lambda: math.pi, 0),
    "neg": (lambda a: -a, 1),
    "asin": (lambda a: math.degrees(math.asin(a)), 1),
    "acos": (lambda a: math.degrees(math.acos(a)), 1),
    "atan": (lambda a: math.degrees(math.atan(a)), 1),
    "sqrt": (math.sqrt, 1),
    "sq": (lambda a: a * a, 1),
    "int": (lambda a: float(math.trunc(a)), 1),
    "frac": (lambda a: a - math.trunc(a), 1),
    "exp": (math.exp, 1),
    "ln": (math.log, 1),
    "log": (math.log10, 1),
    "sgn": (lambda a: float((a > 0) - (a < 0)), 1),
}


class QExpressions(Expressions):
    """Formulas of Q parameters."""

    operators = OPERATORS
    functions = FUNCTIONS_OF_FORMULAS
    impossible = "{} cannot be calculated here"

    def text(self, text: str) -> Evaluate:
        """The function that evaluates a string, or a word such as AUTO: it has no number."""
        return lambda scope: Unknown(text)

    def named(self, name: str) -> Evaluate:
        """The function that evaluates a Q parameter."""
        return lambda scope: scope.parameters.get(name)


compiled = QExpressions().compiled
