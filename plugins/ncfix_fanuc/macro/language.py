"""The Fanuc family as a `WrittenLanguage`."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ncfix.arrays import Ints, Mask
from ncfix.control.moves import MotionKind, Moves
from ncfix.text.language import BulkLayout
from ncfix.text.layout import CENTRE_LETTERS, BlockWords, Layout
from ncfix.text.shapes import scan
from ncfix.text.spelling import Spelling
from ncfix.text.tree import Literal, OWordLine, Program, Template
from ncfix.writer.pieces import Pieces
from ncfix_fanuc.macro.blocks import CORNER, axes_of_corner, letters_of, parse_block
from ncfix_fanuc.macro.control import MacroControl
from ncfix_fanuc.macro.interpreter import MacroInterpreter
from ncfix_fanuc.macro.rules import RULES
from ncfix_iso.rs274.language import RS274, writable

if TYPE_CHECKING:
    from ncfix.writer.language import WrittenLanguage


SPELLING = Spelling(vector=CENTRE_LETTERS, vector_length=True)
"""I J K of G43.5 are written with the length that the program gives the vector."""

STOPPING = frozenset({5.0, 9.0})
STOPS = frozenset({50, 90})
"""M5 and M9: with a motion in their block many controls execute them at its end; the tool must not cut without them."""

ELSEWHERE = frozenset({970, 990})
"""M97 calls a block of the same text, M99 may end a subprogram in it."""


def runs_straight_on(template: Template) -> bool:
    """Whether a block of this shape does not depend on blocks elsewhere in the text, as jumps and corners do."""
    flows = [item.keyword for item in template.items if isinstance(item, OWordLine)]
    free = ELSEWHERE.isdisjoint(template.m_codes) and CORNER.isdisjoint(letters_of(template))
    return free and all(keyword == "program" for keyword in flows)


def in_bulk(program: Program, block: int) -> BulkLayout | None:
    """The layout for writing blocks of this shape in bulk; None for shapes with a number without a point."""
    words = program.template_of(block).words
    if any(isinstance(word.value, Literal) and word.value.pointless for word in words if word.address not in "NFS"):
        return None
    assert RS274.bulk is not None
    corners = any(CORNER & letters_of(template) for template in program.templates)
    found = None if corners else RS274.bulk(program, block)
    stops = not STOPS.isdisjoint(program.template_of(block).m_codes)
    return replace(found, further=False) if found is not None and stops else found


def one_by_one(program: Program, moves: Moves, _pieces: Pieces, _first_piece: Ints) -> Mask:
    """(n,) motions that are not written in bulk: straight ones with I J K, the direction of the tool (G43.5)."""
    shapes = [any(word.address in CENTRE_LETTERS for word in template.words) for template in program.templates]
    pointed: Mask = np.array(shapes, dtype=np.bool_)[program.template[moves.block]]
    pointed &= moves.kind != MotionKind.ARC
    return pointed


def layout(program: Program, block: int) -> Layout | None:
    """The layout of a block; at a corner that the control rounds or breaks, axes outside its plane get no words."""
    found = writable(program, block)
    if found is None:
        return None
    after = (*found.after, *BlockWords(program, block).coded("M", STOPPING))
    return replace(found, allowed=axes_of_corner(program, block), after=after)


FANUC: WrittenLanguage = replace(
    RS274,
    scan=partial(scan, pointless=True),
    parse=parse_block,
    control=lambda run, dialect: MacroControl(run, dialect, RULES[dialect.semantics]),
    interpreter=MacroInterpreter,
    layout=layout,
    same_per_shape=False,
    spelling=lambda _program: SPELLING,
    bulk=in_bulk,
    one_by_one=one_by_one,
    straight=runs_straight_on,
    semantics=frozenset(RULES),
)
