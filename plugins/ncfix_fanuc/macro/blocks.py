"""The parsing of a Fanuc block: by the grammar, and by rules that a grammar cannot express.

Decimal-point rule: the words whose numbers count least increments if they have no point.

Corners that the control rounds (,R) or breaks (,C): the corner itself is corrected, the control inserts the rest. The
two motions that meet must lie in one plane, and neither may be split. The axes that they name are that plane, so words
of other axes are not added to them.
Source: Fanuc 30i operator's manual (machining centre), "Optional chamfering and corner R".
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

from ncfix.control.coordinates import LETTERS
from ncfix.text.build import Parsed, TreeBuilder, check_exponents, check_numbers, edges, is_token, kind
from ncfix.text.dialect import Dialect
from ncfix.text.grammar import squeeze
from ncfix.text.layout import AXIS_LETTERS, CENTRE_LETTERS
from ncfix.text.tree import Binary, Expression, Item, Literal, OWordLine, Program, Template, Word
from ncfix_iso.rs274.groups import NON_MODAL, ROTATION
from ncfix_iso.rs274.language import check_repeats, parsed_words
from ncfix_iso.rs274.order import DWELL

if TYPE_CHECKING:
    from lark import Token

    from ncfix.text.build import Branch, Node
    from ncfix_fanuc.macro.control import MacroControl
    from ncfix_iso.rs274.plans import Codes, RS274Plan

G15, G16 = 150, 160
SCALED = frozenset("XYZABCUVWIJKRQ")
"""Addresses whose numbers count least increments when they have no point."""
DRILLING = frozenset("KLQ")
"""K and L may be the repeats of a cycle, Q is the depth of its pecks."""
ANGLES = frozenset("IJKR")
"""Addresses of the angles of a rotation (G68, G68.2)."""

CORNER = frozenset((",R", ",C"))
AXES = frozenset(AXIS_LETTERS)
MOTION = AXES | frozenset(CENTRE_LETTERS)


def is_scaled(control: MacroControl, plan: RS274Plan, letter: str) -> bool:
    """Whether the number of a word counts least increments if it has no point."""
    codes = plan.codes
    motion = control.modal.motion if codes is None else motion_in_force(control, codes)
    if motion in control.rules.tables and letter == control.dialect.cycle_of(motion).level:
        return True
    if letter not in SCALED or (letter == "R" and is_level(control, plan)):
        return False
    if codes is None:
        return letter not in DRILLING
    if codes.g.get(NON_MODAL) == DWELL:
        return False
    cycle = motion_in_force(control, codes) in control.rules.cycles
    return letter not in DRILLING or (letter == "K" and not cycle) or (letter == "Q" and cycle)


def is_level(control: MacroControl, plan: RS274Plan) -> bool:
    """Whether R of a block is the level of a mode (G5.1 Q1 R3, G332 R1), so not a length for axes, cycles or planes."""
    if plan.axes or plan.codes is None or not plan.codes.g.keys().isdisjoint((NON_MODAL, ROTATION)):
        return False
    return motion_in_force(control, plan.codes) not in control.rules.cycles


def is_angle(control: MacroControl, plan: RS274Plan, letter: str) -> bool:
    """Whether the number of a word counts degrees although its address is not that of a rotary axis."""
    groups = {} if plan.codes is None else plan.codes.g
    if ROTATION in groups:
        return letter in ANGLES
    codes = groups.values()
    polar = (control.polar is not None or G16 in codes) and G15 not in codes
    return polar and letter == LETTERS[control.modal.plane.second]


def motion_in_force(control: MacroControl, codes: Codes) -> int:
    """The motion code of a block: its own, or the one in force."""
    return control.modal.motion if codes.motion is None else codes.motion


PIECE = re.compile(r"\([^()]*(?:\([^()]*\)[^()]*)*\)|;.*|[^ \t]", re.DOTALL)
"""The text that squeezing keeps: whole comments, with parentheses inside them, and characters that are not blank."""

CALLS = frozenset({650, 660, 661})
"""G65, G66 and G66.1: there I, J and K may occur several times, and E is an argument like any other."""


def parse_block(dialect: Dialect, text: str) -> Parsed:
    """One block; raises `BlockError`."""
    squeezed = squeeze(text, PIECE)
    parsed = parsed_words(dialect, text, squeezed, MacroBuilder)
    check_numbers(parsed)
    if CALLS.isdisjoint(parsed.template.g_codes):
        check_exponents(parsed, text)
        check_repeats(parsed)
    return parsed


class MacroBuilder(TreeBuilder):
    """Builds items from syntax trees, including those of Macro B. Every number remembers whether it has a point."""

    def literal(self, token: Token) -> Literal:
        """A number."""
        return Literal(self.slots[edges(token)], pointless="." not in token)

    def item(self, node: Node) -> Item:
        """One item of a block."""
        if is_token(node) or kind(node) not in STATEMENTS:
            return super().item(node)
        return self.statement(node, STATEMENTS[kind(node)])

    def statement(self, tree: Branch, keyword: str) -> OWordLine:
        """A control statement: its condition, and its target."""
        branches = [node for node in tree.children if not is_token(node)]
        label: str | Expression = next(
            (str(int(str(n))) for n in tree.children if is_token(n) and kind(n) == "LABEL"), ""
        )
        tests = branches[:1] if keyword in ("if goto", "if then", "do") else []
        if not label and len(branches) > len(tests):
            label = self.expression(branches[-1])
        return OWordLine(label, keyword, tuple(map(self.expression, tests)), self.span(tree))

    def compound(self, tree: Branch, depth: int) -> Expression:
        """The expression of a syntax tree."""
        if kind(tree) != "two_arguments":
            return super().compound(tree, depth)
        function, left, right = tree.children
        return Binary(str(function).lower(), self.expression(left, depth), self.expression(right, depth))


STATEMENTS = {"branch": "if goto", "condition": "if then", "jump": "goto", "loop": "do", "loop_end": "end"}
"""Rule of the grammar -> keyword of the statement."""


# -- corners that the control rounds or breaks -------------------------------------------------------------------------


def letters_of(template: Template) -> frozenset[str]:
    """The addresses of the words of a shape."""
    return frozenset(item.address for item in template.items if isinstance(item, Word))


def axes_of_corner(program: Program, block: int) -> frozenset[str] | None:
    """The axes that a block at a corner may name; None for other blocks."""
    own = letters_of(program.template_of(block))
    before = neighbour(program, range(block - 1, -1, -1))
    named = own | before if CORNER & before else frozenset()
    if CORNER & own:
        named |= own | neighbour(program, range(block + 1, len(program)))
    return named & AXES if named else None


def neighbour(program: Program, blocks: Iterable[int]) -> frozenset[str]:
    """The addresses of the first of these blocks that has a motion."""
    found = (letters_of(program.template_of(each)) for each in blocks)
    return next((letters for letters in found if letters & MOTION), frozenset())
