"""What a block does, worked out once per shape: its words as functions of its numbers, its codes, its flow.

Q parameters: their values, and the formulas of Klartext.

Source: TNC 640 user's manual, "Q parameters"; angles are degrees. A parameter that the program has not set holds
whatever an earlier program left in it: it is known only at run time, and so is all that is computed from it.
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
"""The words with which a block begins, if it is not words alone."""

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
"""M code -> the addresses of words after it that are its own: limits of the handwheel, a feed, a distance."""

EQUAL = 1e-9
"""Two numbers are equal that differ by less."""


@frozen
class KlartextPlan:
    """One shape.

    name         what the block begins with: `l`, `cycl def 200`, `plane spatial`; empty for words alone
    words        address -> its value, of the words of the motion
    codes        M codes, each with the words that are its own
    flags        words without values: `fmax`, `r0`, `dr+`, `stay`; `axis c` of M94 and M138
    assignments  Q parameter -> its value
    flow         label, call or condition; `test` is the condition's value
    tool         the name of a tool, or the value of its number
    statement    the span of a statement that is not taken apart, and its kind
    spans        address -> where the word stands
    skip         the switches of block delete that it begins with: `/` is the only one
    moves        the block leads somewhere: by its words, or by its path function alone
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
"""Words that are a path function by themselves."""

STATEMENTS = frozenset({"program", "statement", UNREAD})
"""Kinds of text that is not taken apart."""

CARTESIAN = frozenset(letter for axis in "XYZABCUVW" for letter in (axis, "I" + axis))
POLAR = frozenset({"PA", "IPA", "PR", "IPR"})
VECTOR = frozenset({"TX", "TY", "TZ"})
MOVING = CARTESIAN | POLAR | VECTOR
"""The addresses that lead somewhere."""

SIZES = frozenset({"R", "LEN", "CCA"})
"""The radius of an arc, the length of a line of an approach, and the angle about the centre."""

ALWAYS_MOVING = frozenset({"c", "cp", "cr", "ct", "ctp", "ln"})
"""Path functions that move even where they name no end: `C DR-` is a full circle."""

LEADING = ("appr ", "dep ", "cycl call")
"""How other blocks begin that lead somewhere, or drill where the tool stands."""


def owners(items: Sequence[Item]) -> dict[int, int]:
    """Words that belong to an M code before them (`M118 X1 Y1`), not to the motion: place of the item -> that code."""
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
    """Whether a block begins with this, so that it is no block of words alone."""
    return name in PATH_FUNCTIONS or name.startswith(OPENING)


def own_words(items: Sequence[Item]) -> list[Word]:
    """The words of the block itself: not its number, and not what belongs to M codes."""
    owned = owners(items)
    return [w for place, w in enumerate(items) if isinstance(w, Word) and w.address != "N" and place not in owned]


def codes_of(items: Sequence[Item]) -> tuple[tuple[int, Mapping[str, Evaluate]], ...]:
    """The M codes, each with the words that are its own."""
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
    """The Q parameter that is set, and its value."""
    assert isinstance(item.target, NamedParameter), "this family has no arrays"
    return item.target.name, compiled(item.value)


def is_motion_word(word: Word) -> bool:
    """Whether a word is one of the motion: no M code, and not what TOOL CALL and TOOL DEF name."""
    return word.address != "TOOL" and not (word.address == "M" and isinstance(word.value, Constant))


def tool_of(words: Sequence[Word]) -> str | Evaluate | None:
    """The name of the tool that the block names, or the value of its number."""
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
    """The Q parameters; QL parameters belong to one program, the others to all.

    values   those that the program has set, or the setup gives
    read     those that the program has read or measured, so that no setup gives them
    changes  how often a parameter has got another value
    """

    values: dict[str, Value] = field(default_factory=dict)
    read: set[str] = field(default_factory=set)
    changes: int = 0

    def get(self, name: str) -> Value:
        """The value of a parameter; one that was never set is unknown."""
        return self.values.get(name, Unknown(name))

    def assign(self, name: str, value: Value) -> None:
        """Set a parameter."""
        unknown, number = isinstance(value, Unknown), nominal(value)
        self.changes += name not in self.values or nominal(self.values[name]) != number or unknown
        self.values[name] = number
        if isinstance(value, Unknown):
            self.read |= set() if value.why else {name}
            self.values[name] = Unknown(value.why or name, number)

    def enter(self) -> dict[str, Value]:
        """A program is called: it has QL parameters of its own. Returns those of the caller, for `leave`."""
        return {name: self.values.pop(name) for name in [name for name in self.values if name.startswith("QL")]}

    def leave(self, own: Mapping[str, Value]) -> None:
        """The called program is over."""
        self.enter()
        for name, value in own.items():
            self.assign(name, value)


@mutable
class FormulaScope:
    """What a formula may refer to: the numbers of the program, where those of the block begin, and the parameters."""

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
"""`a ANG b` is the angle whose sine side is `a` and whose cosine side is `b`."""

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
    impossible = "{} cannot be computed here"

    def text(self, text: str) -> Evaluate:
        """A string, or a word such as AUTO: no number."""
        return lambda scope: Unknown(text)

    def named(self, name: str) -> Evaluate:
        """A Q parameter."""
        return lambda scope: scope.parameters.get(name)


compiled = QExpressions().compiled
