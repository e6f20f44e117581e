"""Builds the template of a block shape from the parser's tree, and checks rules that a grammar cannot express."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field
from math import isfinite
from typing import TYPE_CHECKING

from ncfix.text.faults import BlockError
from ncfix.text.grammar import UnspacedBlock
from ncfix.text.tree import (
    END,
    START,
    Anchor,
    Assignment,
    Binary,
    Comment,
    Constant,
    Exists,
    Expression,
    Item,
    Literal,
    NamedParameter,
    NumberedParameter,
    Opaque,
    OWordLine,
    Skip,
    Span,
    Tape,
    Template,
    Unary,
    Word,
)
from ncfix.values import frozen

if TYPE_CHECKING:
    from lark import Token, Tree
    from typing_extensions import TypeIs

    Branch = Tree[Token]
    Node = Branch | Token

NUMBERS = frozenset({"NUMBER", "UNSIGNED"})
"""The terminals that are numbers of the block; any other digit belongs to its shape."""

MAX_DEPTH = 150
"""Largest nesting depth of an expression, and largest number of chained operators; controls allow less."""


class TooDeepError(Exception):
    """An expression is nested deeper than `MAX_DEPTH`; `position`: where, in the squeezed block."""

    def __init__(self, position: int) -> None:
        super().__init__(position)
        self.position = position


@frozen
class Parsed:
    """The result of parsing one block.

    template  the meaning of its shape
    spans     start and stop of each number in the block
    values    the numbers
    comment   start of the comment that ends the block; -1 without one
    """

    template: Template
    spans: tuple[tuple[int, int], ...]
    values: tuple[float, ...]
    comment: int


def build(
    tree: Branch,
    text: str,
    squeezed: UnspacedBlock,
    maker: type[TreeBuilder] | None = None,
    keywords: Iterable[tuple[str, str]] = (),
) -> Parsed:
    """The template of a block from its tree, made by the builder of its language; raises `TooDeepError`.

    keywords  see `Dialect.keywords`
    """
    tokens = [token for token in tokens_of(tree) if kind(token) in NUMBERS]
    spans = tuple(squeezed.span(*edges(token)) for token in tokens)
    slots = {edges(token): slot for slot, token in enumerate(tokens)}
    stops = tuple(stop for _, stop in spans)
    items = (maker or TreeBuilder)(text, squeezed, slots, stops, dict(keywords)).items(tree)
    comment = final_comment(tree)
    place = squeezed.span(*edges(comment))[0] if comment else -1
    return Parsed(Template(items, len(tokens)), spans, tuple(map(float, tokens)), place)


def final_comment(tree: Branch) -> Token | None:
    """The comment that ends the block; None without one."""
    last = tree.children[-1] if tree.children else None
    return last if last is not None and is_token(last) and kind(last) == "COMMENT" else None


def is_token(node: Node) -> TypeIs[Token]:
    """Whether a node is a terminal. A terminal is a string, so Lark need not be imported for this."""
    return isinstance(node, str)


def kind(node: Node) -> str:
    """The name of a rule or terminal, without the prefix of the grammar it was imported from."""
    name = node.type if is_token(node) else str(node.data)
    return name.rpartition("__")[2]


def tokens_of(tree: Branch) -> Iterator[Token]:
    """All tokens of a tree, from left to right."""
    stack: list[Node] = [tree]
    while stack:
        node = stack.pop()
        if is_token(node):
            yield node
        else:
            stack.extend(reversed(node.children))


@frozen
class TreeBuilder:
    """Builds items from trees; knows the places of the block's numbers.

    slots  edges of a number in the squeezed block -> its slot
    stops  where each number ends in the block
    keywords  keyword -> the code or address that it stands for
    """

    text: str
    squeezed: UnspacedBlock
    slots: dict[tuple[int, int], int]
    stops: tuple[int, ...]
    keywords: Mapping[str, str] = field(default_factory=dict)

    # -- places -------------------------------------------------------------------------------------------------------

    def anchor(self, place: int) -> Anchor:
        """A place in the block, relative to the last number before it."""
        before = bisect_right(self.stops, place)
        return Anchor(before - 1, place - self.stops[before - 1]) if before else Anchor(START, place)

    def span(self, node: Node) -> Span:
        """The span of a rule or terminal."""
        return self.between(*edges(node))

    def between(self, start: int, stop: int) -> Span:
        """The span of a range of the squeezed block."""
        return Span(*map(self.anchor, self.squeezed.span(start, stop)))

    def span_to_end(self, token: Token) -> Span:
        """The span of the last terminal of a block, whose length may differ from block to block."""
        start, stop = self.squeezed.span(*edges(token))
        return Span(self.anchor(start), Anchor(END, stop - len(self.text)))

    # -- items --------------------------------------------------------------------------------------------------------

    def items(self, tree: Branch) -> tuple[Item, ...]:
        """The items of a block."""
        items = [self.item(node) for node in tree.children]
        if comment := final_comment(tree):
            items[-1] = Comment(self.span_to_end(comment))
        return tuple(items)

    def item(self, node: Node) -> Item:
        """One item of a block."""
        if is_token(node):
            return self.terminal(node)
        makers: dict[str, Callable[[Branch], Item]] = {
            "word": self.word,
            "line_number": self.word,
            "code": self.code,
            "assignment": self.assignment,
            "flow": self.flow,
            "program_number": self.program_number,
        }
        return makers[kind(node)](node)

    def terminal(self, token: Token) -> Item:
        """An item that is a single terminal; one of unknown name becomes `Opaque` of that kind."""
        span = self.span(token)
        match kind(token):
            case "COMMENT":
                return Comment(span)
            case "SKIP":
                return Skip(int(token[1:] or 1), span)
            case "TAPE":
                return Tape(span)
            case name:
                return Opaque(name.lower().replace("_", " "), span)

    def word(self, tree: Branch) -> Word:
        """An address and its value."""
        address, node = tree.children
        value = self.expression(node)
        if isinstance(value, Literal) and kind(node) == "bracket":
            value = Unary("+", value)
        name = str(address).upper()
        return Word(self.keywords.get(name, name), value, self.span(tree), self.span(node))

    def code(self, tree: Branch) -> Word:
        """A word of G or M with a plain number, which is part of the shape; or of a keyword that stands for one."""
        text = str(tree.children[0])
        start, stop = edges(tree)
        if meaning := self.keywords.get(text.upper()):
            return Word(meaning[0], Constant(float(meaning[1:])), self.span(tree), self.span(tree))
        return Word(
            text[0].upper(), Constant(float(text[1:])), self.between(start, stop), self.between(start + 1, stop)
        )

    def assignment(self, tree: Branch) -> Assignment:
        """A parameter and the expression assigned to it."""
        target, value = tree.children
        parameter = self.expression(target)
        assert isinstance(parameter, NumberedParameter | NamedParameter)
        return Assignment(parameter, self.expression(value), self.span(tree))

    def flow(self, tree: Branch) -> OWordLine:
        """A label, a keyword and its arguments; comments between them are ignored."""
        label, keyword, *arguments = tree.children
        values = tuple(self.expression(each) for each in arguments if kind(each) != "ARGUMENT_COMMENT")
        return OWordLine(self.label(label), str(keyword).lower(), values, self.span(tree))

    def program_number(self, tree: Branch) -> OWordLine:
        """A bare O-word."""
        (label,) = tree.children
        return OWordLine(self.label(label), "program", (), self.span(tree))

    def label(self, node: Node) -> str | Expression:
        """The label of an O-word."""
        match kind(node):
            case "NAME":
                return name_of(node)
            case "LABEL":
                return str(int(str(node)))
        return self.expression(node)

    # -- expressions --------------------------------------------------------------------------------------------------

    def expression(self, node: Node, depth: int = 0) -> Expression:
        """The expression of a tree or of a number terminal."""
        if is_token(node):
            return self.literal(node)
        if depth > MAX_DEPTH:
            raise TooDeepError(edges(node)[0])
        return self.compound(node, depth + 1)

    def literal(self, token: Token) -> Literal:
        """A number; languages may distinguish more kinds."""
        return Literal(self.slots[edges(token)])

    def compound(self, tree: Branch, depth: int) -> Expression:
        """The expression of a tree."""
        parts = tree.children
        match kind(tree):
            case "literal" | "bracket":
                return self.expression(parts[0], depth)
            case "parameter":
                return NumberedParameter(self.expression(parts[0], depth))
            case "named_parameter":
                return NamedParameter(name_of(parts[0]))
            case "unary":
                return Unary(str(parts[0]).lower(), self.expression(parts[1], depth))
            case "binary":
                left, operator, right = parts
                return self.binary(left, operator, right, depth)
            case "arc_tangent":
                function, left, _, right = parts
                return self.binary(left, function, right, depth)
            case "exists":
                return self.exists(parts[0], depth)
        raise AssertionError(f"the grammar has an expression {tree.data!r} that nobody builds")

    def binary(self, left: Node, operator: Node, right: Node, depth: int) -> Binary:
        """An operator with two operands; also `ATAN[left]/[right]`."""
        return Binary(str(operator).lower(), self.expression(left, depth), self.expression(right, depth))

    def exists(self, node: Node, depth: int) -> Exists:
        """`EXISTS[parameter]`."""
        parameter = self.expression(node, depth)
        assert isinstance(parameter, NumberedParameter | NamedParameter)
        return Exists(parameter)


def edges(node: Node) -> tuple[int, int]:
    """Start and stop of a rule or terminal in the squeezed block."""
    if is_token(node):
        return node.start_pos or 0, node.end_pos or 0
    return node.meta.start_pos, node.meta.end_pos


def name_of(node: Node) -> str:
    """The name between `<` and `>`, lower case and without blanks."""
    return str(node)[1:-1].lower()


G_WITH_E = frozenset({470, 700, 760, 1870})
M_WITH_E = frozenset({660, 670, 680})
"""G and M codes that take an E word, so that `H2E1` is two words: G70, G76, M66, M67, M68 of LinuxCNC ("G codes",
"M codes"), G47 and G187 of Haas. In tenths."""


def check_numbers(parsed: Parsed) -> None:
    """Refuse a number that is too large for a double."""
    for (start, _), value in zip(parsed.spans, parsed.values, strict=True):
        if not isfinite(value):
            raise BlockError("NCF115", "the number is too large", start)
    for word in parsed.template.words:
        if isinstance(word.value, Constant) and not isfinite(word.value.value):
            raise BlockError("NCF115", "the number is too large", start_of(word, parsed))


def check_exponents(parsed: Parsed, text: str) -> None:
    """Refuse `X1e-5`, which would be read as X1 and a word E."""
    template = parsed.template
    if not (G_WITH_E.isdisjoint(template.g_codes) and M_WITH_E.isdisjoint(template.m_codes)):
        return
    for word in template.words:
        start = start_of(word, parsed)
        if word.address == "E" and start and text[start - 1] in "0123456789.":
            hint = "write the number out; if a word E is meant, put a blank before it"
            raise BlockError("NCF116", "the number has an exponent", start, hint)


def start_of(word: Word, parsed: Parsed) -> int:
    """Start of a word in its block."""
    slot, offset = word.span.start
    return offset if slot < 0 else parsed.spans[slot][1] + offset
