"""The layout of a Klartext motion block: which parts can be rewritten, and where missing words are put."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ncfix.arrays import Mask
from ncfix.text.layout import AXIS_LETTERS, INCREMENT, Layout
from ncfix.text.tree import (
    START,
    Anchor,
    Command,
    Comment,
    Constant,
    Item,
    Literal,
    Opaque,
    Program,
    Skip,
    Span,
    Template,
    Word,
)
from ncfix.values import frozen
from ncfix_heidenhain.klartext.arc_text import in_lines
from ncfix_heidenhain.klartext.plans import POLAR, VECTOR, opens_block, own_words

CORNERS = frozenset({"rnd", "chf"})
"""Path functions with which the control rounds or chamfers the corner between two motions."""

STRAIGHT = frozenset({"", "l", "ln", "lp"})

TURN_DEGREES = 360.0

AXIS_WORDS = frozenset({*AXIS_LETTERS, *(f"I{letter}" for letter in AXIS_LETTERS)})
LATE = frozenset({0, 1, 2, 5, 6, 9, 30, 111, 115, 117, 127, 129, 135, 137, 145, 149})
"""M codes that act at the end of their block, and so have to stand in its last piece."""

FALLBACK = Word("L", Constant(10.0), Span(Anchor(-1, 0), Anchor(-1, 0)), Span(Anchor(-1, 0), Anchor(-1, 0)))
"""The default of `KlartextLayout.motion`: every Klartext block says itself how it moves; words alone are straight."""

RELATIVE_POLE = re.compile(rb"(?im)\n[ \t]*/?[ \t]*\d*[ \t]*CC(?![A-Z])(?:[^\r\n;]*I[XYZ]|[ \t]*(?:;|\r?$))")
"""A CC whose pole counts from where the tool stands."""


@frozen(kw_only=True)
class KlartextLayout(Layout):
    """The parts of a motion block that can be rewritten; axis words may be incremental (IX), R is the radius of CR.

    prefix    block skip, and the block number if blocks that are put in get one, too
    name      path function, as in `KlartextPlan.name`
    function  where the path function is written; None in a block of words alone
    polar     the words PR, PA, IPR, IPA
    sense     where DR+ or DR- is written; None without
    corner    the block before or after it is a corner that the control makes (RND, CHF)
    motion    see `FALLBACK`
    """

    prefix: Span
    name: str
    function: Span | None
    polar: tuple[Word, ...]
    sense: Span | None
    corner: bool = False
    motion: Word = FALLBACK


def layout_of(program: Program, block: int) -> KlartextLayout | None:
    """The layout of a block; None if it cannot be rewritten: IPA from a Q parameter, or not all of TX TY TZ."""
    shape = Shape(program.template_of(block))
    found = _of_shape(shape)
    if found is None:
        return None
    corner = is_corner(program, block, -1) or is_corner(program, block, 1)
    numbered = program.dialect.block_numbers != "none"
    return _in_place(shape, separator(program, block, found[1]), corner, numbered)


class Shape:
    """A template as a dictionary key, compared by identity."""

    __slots__ = ("template",)

    def __init__(self, template: Template) -> None:
        self.template = template

    def __hash__(self) -> int:
        return id(self.template)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Shape) and other.template is self.template


@lru_cache(maxsize=4096)
def _in_place(shape: Shape, blank: str, corner: bool, numbered: bool) -> KlartextLayout | None:
    """The layout of blocks of a shape, with blanks, corner and block numbers as given."""
    found = _of_shape(shape)
    if found is None:
        return None
    number = next(filter(is_number, shape.template.items), None)
    lead = found[0].code_at if numbered or number is None else number.span.start
    return replace(found[0], blank=blank, corner=corner, prefix=Span(Anchor(START, 0), lead))


@lru_cache(maxsize=4096)
def _of_shape(shape: Shape) -> tuple[KlartextLayout, Word | None] | None:
    """The part of the layout that all blocks of a shape share, and the last axis or polar word; None as `layout_of`."""
    items = shape.template.items
    words, commands = own_words(items), [item for item in items if isinstance(item, Command)]
    function = next((command for command in commands if opens_block(command.name)), None)
    axes = {word.address.removeprefix("I"): word for word in among(words, AXIS_WORDS)}
    polar, vector = among(words, POLAR), {word.address: word for word in among(words, VECTOR)}
    computed = any(word.address == "IPA" and not isinstance(word.value, Literal) for word in polar)
    if computed or 0 < len(vector) < 3:
        return None
    last = max([*axes.values(), *polar], key=lambda word: word.span.stop, default=None)
    end = last or function
    layout = KlartextLayout(
        name=function.name if function else "",
        function=function.span if function else None,
        axes=axes,
        forms={word.address: INCREMENT for word in axes.values() if word.address[0] == "I"},
        polar=polar,
        radius=next(iter(among(words, {"R"})), None),
        sense=next((command.span for command in commands if command.name in ("dr+", "dr-")), None),
        vector=vector,
        after=tuple(filter(acts_late, words)),
        words_at=Anchor(-1, 0) if end is None else end.span.stop,
        code_at=start_of(items),
        blank=" ",
        prefix=Span(Anchor(START, 0), Anchor(START, 0)),
        closing="FMAX" if any(command.name == "fmax" for command in commands) else "",
    )
    return layout, last


def among(words: Sequence[Word], addresses: Collection[str]) -> tuple[Word, ...]:
    """The words with one of these addresses."""
    return tuple(word for word in words if word.address in addresses)


def acts_late(word: Word) -> bool:
    """Whether a word is an M code that acts at the end of its block."""
    return word.address == "M" and isinstance(word.value, Constant) and int(word.value.value) in LATE


def start_of(items: Sequence[Item]) -> Anchor:
    """Where the code of a block begins, after block skip and block number."""
    begins = (item.span.start for item in items if not (isinstance(item, Skip) or is_number(item)))
    return next(begins, Anchor(START, 0))


def is_corner(program: Program, block: int, way: int) -> bool:
    """Whether the next element of the path is RND or CHF; `way`: 1 after this block, -1 before it."""
    block += way
    while 0 <= block < len(program):
        between, corner = _in_path(Shape(program.template_of(block)))
        if not between:
            return corner
        block += way
    return False


def beside_corners(program: Program) -> Mask:
    """(n,) blocks directly before or after RND or CHF in the path (see `is_corner`)."""
    found = np.zeros(len(program), dtype=np.bool_)
    shapes = [_in_path(Shape(template)) for template in program.templates]
    if any(corner for _, corner in shapes):
        between, corner = np.array(shapes, dtype=np.bool_).T
        blocks = np.flatnonzero(~between[program.template])
        corners = corner[program.template[blocks]]
        found[blocks[:-1]] |= corners[1:]
        found[blocks[1:]] |= corners[:-1]
    return found


def words_alone_turn(program: Program) -> Mask:
    """(n,) blocks in which a rotary axis gets a word only if some rotary axis already has one.

    All blocks of a program with tilted planes are such: there the control would not keep the tip in place. In other
    programs all but straight motions are, and motions beside a corner.
    """
    if tilts(program.source):
        return np.ones(len(program), dtype=np.bool_)
    layouts = [_of_shape(Shape(template)) for template in program.templates]
    found = np.array([layout is not None and layout[0].name not in STRAIGHT for layout in layouts], dtype=np.bool_)
    return found[program.template] | beside_corners(program)


@lru_cache(maxsize=4096)
def _in_path(shape: Shape) -> tuple[bool, bool]:
    """Whether blocks of a shape are no elements of the path (poles, remarks), and whether they are corners."""
    items = shape.template.items
    names = (item.name if isinstance(item, Command) else getattr(item, "address", "") for item in items)
    pole = any(isinstance(item, Command) and item.name == "cc" for item in items)
    return pole or all(map(is_remark, items)), any(name.lower() in CORNERS for name in names)


def is_remark(item: Item) -> bool:
    """Whether an item moves nothing: a comment, a structuring remark, the block number, or block skip."""
    structure = isinstance(item, Opaque) and item.kind == "structure"
    return structure or is_number(item) or isinstance(item, (Comment, Skip))


def is_number(item: Item) -> bool:
    """Whether an item is the block number."""
    return isinstance(item, Word) and item.address == "N"


def separator(program: Program, block: int, word: Word | None) -> str:
    """The blanks before a word; one blank if there is no such word."""
    if word is None:
        return " "
    at = program.position(block, word.span.start)
    start = int(program.blocks[block, 0])
    before = program.source[start:at].decode("latin-1")
    blanks = before[len(before.rstrip(" \t")) :]
    return blanks or " "


def uses_comma(source: bytes) -> bool:
    """Whether more axis words of a program have decimal commas than points."""
    commas, points = axis_numbers(source)
    return commas > points


@lru_cache(maxsize=4)
def axis_numbers(source: bytes) -> tuple[int, int]:
    """The number of axis words with a decimal comma, and of those with a point; the latter is 0 if none has a comma."""
    commas = len(re.findall(rb"[XYZABCxyzabc][+-]?\d*,\d", source)) if b"," in source else 0
    return commas, len(re.findall(rb"[XYZABCxyzabc][+-]?\d*\.\d", source)) if commas else 0


@lru_cache(maxsize=4)
def tilts(source: bytes) -> bool:
    """Whether a program has tilted planes."""
    return re.search(rb"(?i)\bPLANE[ \t]+(?!RESET)|CYCL[ \t]*DEF[ \t]*19\b", source) is not None


@lru_cache(maxsize=4)
def poles_move(source: bytes) -> bool:
    """Whether any pole of a program counts from where the tool stands, and so moves when that is corrected."""
    return RELATIVE_POLE.search(b"\n" + in_lines(source)) is not None
