"""What a block does, worked out once per shape: its words as functions of its numbers, its codes, its flow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ncfix.program.klartext.calculate import Evaluate, compiled
from ncfix.program.reach import UNREAD
from ncfix.program.tree import (
    Assignment,
    Command,
    Constant,
    Flow,
    Item,
    Opaque,
    Skip,
    Span,
    Template,
    Text,
    Word,
)

FUNCTIONS = frozenset({"l", "lp", "ln", "c", "cp", "cr", "ct", "ctp", "cc", "rnd", "chf"})
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


@dataclass(frozen=True, slots=True)
class Plan:
    """One shape.

    name         what the block begins with: `l`, `cycl def 200`, `plane spatial`; empty for words alone
    words        address -> its value, of the words of the motion
    codes        M codes, each with the words that are its own
    flags        words without values: `fmax`, `r0`, `dr+`, `stay`
    assignments  Q parameter -> its value
    flow         label, call or condition; `test` is the condition's value
    tool         the name of a tool, or the value of its number
    statement    the span of a statement that is not taken apart, and its kind
    spans        address -> where the word stands
    skip         the block may be skipped
    moves        the block has words of axes or of polar coordinates
    """

    name: str = ""
    words: Mapping[str, Evaluate] = field(default_factory=dict)
    codes: tuple[tuple[int, Mapping[str, Evaluate]], ...] = ()
    flags: frozenset[str] = frozenset()
    assignments: tuple[tuple[str, Evaluate], ...] = ()
    flow: Flow | None = None
    test: Evaluate | None = None
    tool: str | Evaluate | None = None
    statement: tuple[str, Span] | None = None
    spans: Mapping[str, Span] = field(default_factory=dict)
    skip: bool = False
    moves: bool = False
    empty: bool = True


MOVING = frozenset(
    [letter for axis in "XYZABCUVW" for letter in (axis, "I" + axis)] + ["PA", "IPA", "PR", "IPR"],
)
"""The addresses that lead somewhere."""


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


def plan_of(template: Template) -> Plan:
    """Work out what the blocks of one shape do."""
    name, flags, assignments = "", set(), []
    words: dict[str, Evaluate] = {}
    spans: dict[str, Span] = {}
    codes: list[tuple[int, dict[str, Evaluate]]] = []
    rest: dict[str, object] = {}
    owner = owners(template.items)
    for place, item in enumerate(template.items):
        match item:
            case Skip():
                rest["skip"] = True
            case Command(text) if not name and (text in FUNCTIONS or text.startswith(OPENING)):
                name = text
            case Command(text):
                flags.add(text)
            case Word("N"):
                continue
            case Word("M", Constant(value)):
                codes.append((int(value), {}))
            case Word(address, value) if place in owner:
                codes[-1][1][address] = compiled(value)
            case Word("TOOL", value):
                rest["tool"] = value.value if isinstance(value, Text) else compiled(value)
            case Word(address, value):
                if address in ("RND", "CHF"):
                    name = address.lower()
                words[address] = compiled(value)
                spans.setdefault(address, item.span)
            case Assignment(parameter, value):
                assignments.append((parameter.name, compiled(value)))  # type: ignore[union-attr]
            case Flow(_, keyword, arguments):
                rest["flow"] = item
                if keyword == "if":
                    rest["test"] = compiled(arguments[0])
            case Opaque(kind, span) if kind in ("program", "statement", UNREAD):
                rest["statement"] = (kind, span)
    return Plan(
        name,
        words,
        tuple(codes),
        frozenset(flags),
        tuple(assignments),
        spans=spans,
        moves=not MOVING.isdisjoint(words),
        empty=not (name or words or codes or flags or assignments or rest),
        **rest,  # type: ignore[arg-type]
    )
