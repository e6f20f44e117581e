"""Parser of one SINUMERIK block: the tree of the grammar becomes the template of a shape.

A block that the grammar does not accept, but that contains a name, is kept as an opaque statement.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import reduce
from typing import TYPE_CHECKING

from ncfix.text.build import (
    MAX_DEPTH,
    NUMBERS,
    Parsed,
    TooDeepError,
    TreeBuilder,
    check_exponents,
    check_numbers,
    edges,
    is_token,
    kind,
    start_of,
    tokens_of,
)
from ncfix.text.dialect import Dialect
from ncfix.text.faults import BlockError
from ncfix.text.grammar import UnparsedError, UnspacedBlock, parse
from ncfix.text.tree import (
    END,
    START,
    Anchor,
    Assignment,
    Binary,
    Command,
    Comment,
    Constant,
    Expression,
    FunctionCall,
    Item,
    NamedParameter,
    NumberedParameter,
    Opaque,
    OWordLine,
    Skip,
    Span,
    StringLiteral,
    Template,
    Unary,
    Word,
)
from ncfix.values import frozen
from ncfix_siemens.sinumerik.vocabulary import SETTERS

if TYPE_CHECKING:
    from lark import Token

    from ncfix.text.build import Branch, Node

BRACKET = "("
"""The operator of a `Unary` that is a pair of brackets."""

BASES = {"H": 16, "B": 2, "D": 10}


def build(tree: Branch, text: str) -> Parsed:
    """Build the template of a block from its tree; raises `TooDeepError`."""
    tokens = [token for token in tokens_of(tree) if kind(token) in NUMBERS]
    spans = tuple(edges(token) for token in tokens)
    slots = {edges(token): slot for slot, token in enumerate(tokens)}
    whole = UnspacedBlock(text, list(range(len(text) + 1)))
    builder = SinumerikBuilder(text, whole, slots, tuple(stop for _, stop in spans))
    items = tuple(builder.block(tree))
    last = tree.children[-1] if tree.children else None
    comment = edges(last)[0] if last is not None and is_token(last) and kind(last) == "COMMENT" else -1
    return Parsed(Template(items, len(tokens)), spans, tuple(value_of(token) for token in tokens), comment)


def value_of(number: Token) -> float:
    """The value of a number, `1.5EX-3` included."""
    return float(str(number).upper().replace("EX", "E"))


@frozen
class SinumerikBuilder(TreeBuilder):
    """Builds the items of a block from its tree."""

    def block(self, tree: Branch) -> Iterator[Item]:
        """The items of a block in the order written."""
        for node in tree.children:
            if is_token(node):
                yield self.token(node)
            else:
                yield from self.statement(node)

    def token(self, token: Token) -> Item:
        """The item of a single terminal."""
        span = self.span(token)
        match kind(token):
            case "COMMENT":
                return Comment(self.span_to_end(token))
            case "SKIP":
                return Skip(int(token[1:] or 0), span)
            case "HEAD" | "PROCEDURE":
                return Opaque("program head", span)
            case name:
                return Opaque(name.lower(), span)

    def statement(self, tree: Branch) -> Iterator[Item]:
        """The items of one rule."""
        makers: dict[str, Callable[[Branch], Item]] = {
            "line_number": self.word,
            "word": self.word,
            "code": self.code,
            "assignment": self.setting,
            "command": self.command,
            "indirect": self.indirect,
            "element": self.bare_element,
            "label": self.label_here,
            "condition": self.condition,
            "plain": self.plain,
            "counted": self.counted,
            "jump": self.jump,
            "repetition": self.repetition,
            "declaration": self.declaration,
        }
        name = kind(tree)
        if name == "case":
            yield from self.case(tree)
        else:
            yield makers[name](tree)

    # -- words --------------------------------------------------------------------------------------------------------

    def setting(self, tree: Branch) -> Item:
        """A word, or an assignment to a variable."""
        *target, value = tree.children
        name = str(target[0])
        if len(target) == 1 and is_word(name):
            return Word(name.upper(), self.expression(value), self.span(tree), self.span(value))
        return Assignment(self.target(target), self.expression(value), self.span(tree))

    def target(self, nodes: list[Node]) -> NumberedParameter | NamedParameter | FunctionCall:
        """The target of an assignment: `R1`, `R[..]`, a variable, an element of an array."""
        name = str(nodes[0])
        if len(nodes) == 2:
            return self.array_element(name, nodes[1])
        if kind(nodes[0]) == "PARAMETER":
            return NumberedParameter(Constant(float(name[1:])))
        return NamedParameter(name.lower())

    def array_element(self, name: str, index: Node, depth: int = 0) -> NumberedParameter | FunctionCall:
        """`R[..]`, or an element of another array."""
        places = self.arguments(index, depth)
        if name.upper() == "R" and len(places) == 1 and places[0] is not None:
            return NumberedParameter(places[0])
        return FunctionCall(name.lower(), places, indexed=True)

    def command(self, tree: Branch) -> Item:
        """The item of a name, which may have arguments."""
        name, *rest = tree.children
        arguments = self.arguments(rest[0]) if rest else ()
        return Command(str(name).lower(), arguments, bool(rest), self.span(tree))

    def indirect(self, tree: Branch) -> Item:
        """The item of `CALL "NAME"`."""
        name, text = tree.children
        return Command(str(name).lower(), (StringLiteral(str(text)[1:-1]),), True, self.span(tree))

    def bare_element(self, tree: Branch) -> Item:
        """`NAME[..]` alone: an array macro, of unknown effect."""
        name, index = tree.children
        return Command(str(name).lower(), self.arguments(index), True, self.span(tree))

    def declaration(self, tree: Branch) -> Item:
        """`DEF type name, name = value`: a command with the type, and each name with its value or None."""
        parts: list[Expression | None] = []
        for node in tree.children:
            if is_token(node):
                if kind(node) == "TYPE":
                    parts.append(StringLiteral(str(node).split("[")[0].strip().lower()))
                continue
            name, *rest = node.children
            dimensions = [part for part in rest if kind(part) == "dimensions"]
            values = [part for part in rest if kind(part) != "dimensions"]
            parts += [self.target([name, *dimensions]), self.expression(values[0]) if values else None]
        return Command("def", tuple(parts), True, self.span(tree))

    # -- control structures -------------------------------------------------------------------------------------------

    def label_here(self, tree: Branch) -> Item:
        """The item of a label, `NAME:`."""
        return OWordLine(str(tree.children[0]).rstrip(": \t").upper(), "label", (), self.span(tree))

    def condition(self, tree: Branch) -> Item:
        """The item of `IF`, `WHILE` or `UNTIL` with its condition."""
        keyword, value = tree.children
        return OWordLine("", str(keyword).lower(), (self.expression(value),), self.span(tree))

    def plain(self, tree: Branch) -> Item:
        """The item of a keyword alone."""
        return OWordLine("", str(tree.children[0]).lower(), (), self.span(tree))

    def counted(self, tree: Branch) -> Item:
        """The item of `FOR name = first TO last`."""
        _, *target, first, _, last = tree.children
        values = (self.target(target), self.expression(first), self.expression(last))
        return OWordLine("", "for", values, self.span(tree))

    def jump(self, tree: Branch) -> Item:
        """`GOTOF`, `GOTOB`, ... with the label, which may be computed, `"MARK"<<R1`."""
        keyword, *where = tree.children
        label: str | Expression = ""
        if where and kind(where[0]) == "joined":
            parts = map(self.expression, where[0].children[::2])  # type: ignore[union-attr]
            label = reduce(lambda left, right: Binary("<<", left, right), parts)
        elif where:
            label = destination(where[0])
        return OWordLine(label, str(keyword).lower(), (), self.span(tree))

    def repetition(self, tree: Branch) -> Item:
        """`REPEAT` that begins a loop, or that repeats the blocks from a label on, or between two labels."""
        keyword, *labels = tree.children
        names = [str(label).upper() for label in labels]
        return OWordLine(
            names[0] if names else "", str(keyword).lower(), tuple(map(StringLiteral, names[1:])), self.span(tree)
        )

    def case(self, tree: Branch) -> Iterator[Item]:
        """`CASE value OF constant GOTOF label ... DEFAULT GOTOF label`: one item for each part."""
        keyword, value, of, *choices = tree.children
        head = self.between(edges(keyword)[0], edges(of)[1])
        yield OWordLine("", "case", (self.expression(value),), head)
        for choice in choices:
            *before, keyword, where = choice.children  # type: ignore[union-attr]
            values = tuple(self.expression(node) for node in before if not is_token(node))
            name = "of" if kind(choice) == "choice" else "default"
            yield OWordLine(destination(where), f"{name} {str(keyword).lower()}", values, self.span(choice))

    # -- expressions --------------------------------------------------------------------------------------------------

    def arguments(self, node: Node, depth: int = 0) -> tuple[Expression | None, ...]:
        """The arguments between brackets; None for an omitted one."""
        assert not is_token(node)
        values = tuple(None if kind(part) == "omitted" else self.expression(part, depth) for part in node.children)
        return () if values == (None,) else values

    def compound(self, tree: Branch, depth: int) -> Expression:
        """The expression that a parse tree stands for."""
        if depth > MAX_DEPTH:
            raise TooDeepError(edges(tree)[0])
        parts = tree.children
        first = parts[0]
        match kind(tree):
            case "bracket":
                return Unary(BRACKET, self.expression(first, depth))
            case "text":
                return StringLiteral(str(first)[1:-1])
            case "axis":
                return StringLiteral(str(first).upper())
            case "bits":
                return Constant(bits(str(first)))
            case "parameter":
                return NumberedParameter(Constant(float(str(first)[1:])))
            case "name":
                return NamedParameter(str(first).lower())
            case "element":
                return self.array_element(str(first), parts[1], depth)
            case "call":
                return FunctionCall(str(first).lower(), self.arguments(parts[1], depth))
            case "list":
                return FunctionCall(BRACKET, self.arguments(tree, depth))
        return TreeBuilder.compound(self, tree, depth)


def is_word(name: str) -> bool:
    """Whether a name with a value is an address: a letter, a letter with a number, or one of `SETTERS`."""
    if name[:1].upper() == "R" and name[1:].isdigit():
        return False
    return len(name) == 1 or name[1:].isdigit() or name.lower() in SETTERS


def destination(node: Node) -> str:
    """The target of a jump: a label or `N100`, also given as a string."""
    text = str(node)
    if kind(node) == "TEXT":
        return text[1:-1].upper()
    return "".join(text.split()).upper()


def bits(text: str) -> float:
    """The value of `'HFF'`, `'B1010'`, `'D12'`; NaN if it has none."""
    body = text.strip("'")
    try:
        return float(int(body[1:], BASES[body[0].upper()]))
    except ValueError:
        return float("nan")


STATEMENT = "statement"
"""The kind of an `Opaque` for a block that was not understood, for instance a call of an unknown cycle."""

NAME = re.compile(r"[A-Z_]{2}", re.IGNORECASE)
QUOTED = re.compile(r'"[^"]*"|;.*', re.DOTALL)
ONCE = frozenset("XYZABCUVWIJKF") | {"I1", "J1", "K1", "CR", "AR", "AP", "RP", "TURN"}
"""Addresses that a block may have only once."""

WHOLE = Span(Anchor(START, 0), Anchor(END, 0))


def parse_block(dialect: Dialect, text: str) -> Parsed:
    """Parse one block; raises `BlockError` for a fault, unless the block contains a name."""
    try:
        parsed = build(parse(dialect, text), text)
    except UnparsedError as error:
        if NAME.search(QUOTED.sub(" ", text)):
            return Parsed(Template((Opaque(STATEMENT, WHOLE),), 0), (), (), -1)
        raise explained(error.place, text) from None
    except TooDeepError as error:
        raise BlockError("NCF118", "the expression is nested too deep, or too long", error.position) from None
    check_numbers(parsed)
    check_exponents(parsed, text)
    check_repeats(parsed)
    return parsed


def check_repeats(parsed: Parsed) -> None:
    """Refuse a repeated word of a motion."""
    seen: set[str] = set()
    for word in parsed.template.words:
        if word.address in seen and word.address in ONCE:
            raise BlockError("NCF117", f"the word {word.address} appears twice", start_of(word, parsed))
        seen.add(word.address)


def explained(place: int, text: str) -> BlockError:
    """The error of a block at the place where the parser stopped."""
    before, at = text[:place].rstrip(), text[place : place + 1]
    if before.endswith("="):
        return BlockError("NCF114", "there is no value after =", place)
    if at == "." or (before.endswith(".") and at.isdigit()):
        return BlockError("NCF115", "the number is malformed", place)
    if at == "," and before[-1:].isdigit():
        return BlockError("NCF115", "the number has a decimal comma", place, "write a point")
    if at.isalpha():
        return BlockError("NCF114", f"the word {at.upper()} has no value", place)
    if not at:
        return BlockError("NCF110", "the block is not complete", place)
    shown = repr(at) if at.isprintable() and at.isascii() else f"byte 0x{ord(at):02X}"
    return BlockError("NCF110", f"{shown} is not expected here", place)
