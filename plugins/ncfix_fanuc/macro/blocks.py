"""One block of Fanuc by the grammar, and by the rules that a grammar cannot say."""

from __future__ import annotations

import re

from lark import Token, UnexpectedInput

from ncfix.text.build import (
    Branch,
    Node,
    Parsed,
    TooDeepError,
    TreeBuilder,
    build,
    check_exponents,
    check_numbers,
    edges,
    kind,
)
from ncfix.text.dialect import Dialect
from ncfix.text.faults import BlockError, explain
from ncfix.text.grammar import Squeezed, parse
from ncfix.text.tree import Binary, Expression, Item, Literal, OWordLine
from ncfix_iso.rs274.blocks import check_repeats

PIECE = re.compile(r"\([^()]*(?:\([^()]*\)[^()]*)*\)|;.*|[^ \t]", re.DOTALL)
"""What squeezing keeps: comments whole, parentheses inside them included, and characters that are not blank."""

CALLS = frozenset({650, 660, 661})
"""G65, G66 and G66.1: I, J and K may stand there several times, and E is an argument like any other."""


def squeeze(text: str) -> Squeezed:
    """Take out the blanks outside comments."""
    kept = [match.span() for match in PIECE.finditer(text)]
    code = "".join(text[start:stop] for start, stop in kept)
    return Squeezed(code, [place for span in kept for place in range(*span)])


def parse_block(dialect: Dialect, text: str) -> Parsed:
    """One block; raises `BlockError`."""
    squeezed = squeeze(text)
    try:
        parsed = build(parse(dialect, squeezed.code), text, squeezed, MacroBuilder)
    except UnexpectedInput as error:
        raise explain(error, text, squeezed) from None
    except TooDeepError as error:
        place = squeezed.places[error.position]
        raise BlockError("NCF118", "the expression is nested too deep, or too long", place) from None
    check_numbers(parsed)
    if CALLS.isdisjoint(parsed.template.g_codes):
        check_exponents(parsed, text)
        check_repeats(parsed)
    return parsed


class MacroBuilder(TreeBuilder):
    """Makes items of the trees of Macro B, too. Every number remembers whether it has a point."""

    def literal(self, token: Token) -> Literal:
        """A number."""
        return Literal(self.slots[edges(token)], pointless="." not in token)

    def item(self, node: Node) -> Item:
        """One item of a block."""
        if isinstance(node, Token) or kind(node) not in STATEMENTS:
            return super().item(node)
        return self.statement(node, STATEMENTS[kind(node)])

    def statement(self, tree: Branch, keyword: str) -> OWordLine:
        """A control statement: what it tests, and where it leads."""
        branches = [node for node in tree.children if not isinstance(node, Token)]
        label: str | Expression = next((str(int(str(n))) for n in tree.children if is_label(n)), "")
        tests = branches[:1] if keyword in ("if goto", "if then", "do") else []
        if not label and len(branches) > len(tests):
            label = self.expression(branches[-1])
        return OWordLine(label, keyword, tuple(map(self.expression, tests)), self.span(tree))

    def compound(self, tree: Branch, depth: int) -> Expression:
        """The expression that a tree stands for."""
        if kind(tree) != "two_arguments":
            return super().compound(tree, depth)
        function, left, right = tree.children
        return Binary(str(function).lower(), self.expression(left, depth), self.expression(right, depth))


STATEMENTS = {"branch": "if goto", "condition": "if then", "jump": "goto", "loop": "do", "loop_end": "end"}
"""Rules of the grammar and the keywords that they get."""


def is_label(node: Node) -> bool:
    """Whether a node is a number that says where to go, and belongs to the shape."""
    return isinstance(node, Token) and kind(node) == "LABEL"
