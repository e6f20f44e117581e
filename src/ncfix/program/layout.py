"""Where things stand in a motion block: which words may be rewritten, and where a missing word or code goes."""

from __future__ import annotations

from dataclasses import dataclass

from ncfix.program.language import BulkLayout
from ncfix.program.tree import Anchor, Constant, Flow, Literal, Opaque, Program, Skip, Span, Tape, Word

#: In the order in which programs write them.
AXIS_LETTERS = "XYZABCUVW"
MOTION_CODES = frozenset((0.0, 1.0, 2.0, 3.0))
PER_MINUTE = frozenset((94.0,))
CENTRE_LETTERS = ("I", "J", "K")
#: M codes that act after the motion of their block: they belong on its last piece.
CODES_AFTER_MOTION = frozenset((0.0, 1.0, 2.0, 30.0, 60.0, 99.0))


@dataclass(frozen=True, slots=True)
class Layout:
    """The writable parts of a motion block. Same for all blocks of a shape.

    axes      axis words by letter
    centre    I J K words by letter
    radius    the R word of an arc
    turns     its P word
    feed      the F word
    motion    the G0..G3 word
    feed_mode the G94 word
    after     words that act after the motion (M0, M1, M2, M30, M60, M99)
    words_at  where a missing axis word goes: after the last axis word
    code_at   where a missing motion code goes: before the first axis word
    blank     what separates words in this block
    prefix    the span of the block skip, which further pieces repeat
    allowed   axes that may get a word where they have none; None: all
    """

    axes: dict[str, Word]
    centre: dict[str, Word]
    radius: Word | None
    turns: Word | None
    feed: Word | None
    motion: Word | None
    feed_mode: Word | None
    after: tuple[Word, ...]
    words_at: Anchor
    code_at: Anchor
    blank: str
    prefix: Span | None
    allowed: frozenset[str] | None = None


def layout_of(program: Program, block: int) -> Layout:
    """The layout of a motion block."""
    items = program.items_of(block)
    words = [item for item in items if isinstance(item, Word)]
    axes = {word.address: word for word in words if word.address in AXIS_LETTERS}
    anchor_words = list(axes.values()) or words
    last = max(anchor_words, key=lambda word: program.position(block, word.span.stop))
    first = min(anchor_words, key=lambda word: program.position(block, word.span.start))
    by_letter = {word.address: word for word in words}
    return Layout(
        axes=axes,
        centre={letter: by_letter[letter] for letter in CENTRE_LETTERS if letter in by_letter},
        radius=by_letter.get("R"),
        turns=by_letter.get("P"),
        feed=by_letter.get("F"),
        motion=_coded(program, block, words, "G", MOTION_CODES),
        feed_mode=_coded(program, block, words, "G", PER_MINUTE),
        after=tuple(word for word in words if _code(program, block, word, "M") in CODES_AFTER_MOTION),
        words_at=last.span.stop,
        code_at=first.span.start,
        blank=_separator(program, block, last),
        prefix=next((item.span for item in items if isinstance(item, Skip)), None),
    )


def _code(program: Program, block: int, word: Word, address: str) -> float | None:
    if word.address != address:
        return None
    if isinstance(word.value, Constant):
        return word.value.value
    return float(program.values_of(block)[word.value.slot]) if isinstance(word.value, Literal) else None


def _coded(program: Program, block: int, words: list[Word], address: str, codes: frozenset[float]) -> Word | None:
    return next((word for word in words if _code(program, block, word, address) in codes), None)


def _separator(program: Program, block: int, word: Word) -> str:
    """The blank before the last axis word, if its block uses blanks between words."""
    at = program.position(block, word.span.start)
    start = int(program.blocks[block, 0])
    if at == start:
        return " "
    before = program.source[at - 1 : at]
    return before.decode("latin-1") if before in (b" ", b"\t") else ""


def has_free_text(program: Program, block: int) -> bool:
    """Whether the block holds anything but words, comments and block skip (flow, tape marks, opaque text)."""
    return any(isinstance(item, (Flow, Opaque, Tape)) for item in program.items_of(block))


def bulk_layout(program: Program, block: int, layout: Layout) -> BulkLayout | None:
    """The part of a layout that holds for all blocks of the shape; None if an axis word is no plain number."""
    slots = {letter: word.value.slot for letter, word in layout.axes.items() if isinstance(word.value, Literal)}
    if len(slots) < len(layout.axes):
        return None
    at = program.position(block, layout.code_at)
    return BulkLayout(slots, layout.words_at, layout.blank, program.source[at : at + 1].islower())
