"""The layout of a motion block: which words may be rewritten, and where a missing word or code goes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field

from ncfix.text.language import ArcLayout, BulkLayout
from ncfix.text.tree import Anchor, Constant, Literal, Opaque, OWordLine, Program, Skip, Span, Tape, Word
from ncfix.values import frozen

#: In the usual order of words in programs.
AXIS_LETTERS = "XYZABCUVW"
MOTION_CODES = frozenset((0.0, 1.0, 2.0, 3.0))
CONTROL_CHARACTER = "control character"
"""Kind of an `Opaque` that moves nothing and may stand anywhere (DC1, Grbl's `?`)."""
ABSOLUTE, INCREMENT = "ac", "ic"
"""Forms of axis words, see `Layout.forms`."""

FEED_MODES = frozenset((93.0, 94.0))
CENTRE_LETTERS = ("I", "J", "K")
#: M codes that act after the motion of their block: they belong on its last piece.
CODES_AFTER_MOTION = frozenset((0.0, 1.0, 2.0, 30.0, 60.0, 99.0))
EXACT_STOP = frozenset((9.0,))
"""G9: the control stops at the end of the block; after splitting, at the end of its last piece."""


@frozen(kw_only=True)
class Layout:
    """The writable parts of a motion block; empty where the control has none.

    axes      axis words by letter
    forms     forms stated by words themselves, by address: "ac" an absolute value, "ic" an increment, others an angle
              that a rotary axis approaches in a given direction, whole turns left out
    centre    I J K words by letter
    radius    word of the arc's radius
    turns     word of its number of turns
    feed      the F word
    motion    the G0..G3 word
    feed_mode the G93 or G94 word
    vector    words of the tool direction, by address
    angles    words that give the tool direction as angles; a vector replaces them
    after     words that act at the end of the motion (M0, M1, M2, M30, M60, M99, G9)
    words_at  place for a missing axis word: after the last axis word
    code_at   place for a missing motion code: before the first axis word
    blank     separator of words in this block
    prefix    span of the block skip, which inserted blocks repeat
    levels    words that may give the level of a canned cycle, by address
    closing   additional text at the end of inserted blocks
    allowed   axes that may get a word if they have none; None: all
    """

    axes: dict[str, Word]
    words_at: Anchor
    code_at: Anchor
    blank: str
    prefix: Span | None
    forms: Mapping[str, str] = field(default_factory=dict)
    centre: dict[str, Word] = field(default_factory=dict)
    radius: Word | None = None
    turns: Word | None = None
    feed: Word | None = None
    motion: Word | None = None
    feed_mode: Word | None = None
    vector: dict[str, Word] = field(default_factory=dict)
    angles: dict[str, Word] = field(default_factory=dict)
    after: tuple[Word, ...] = ()
    levels: dict[str, Word] = field(default_factory=dict)
    closing: str = ""
    allowed: frozenset[str] | None = None


class BlockWords:
    """The words of one block, by address and by code."""

    def __init__(self, program: Program, block: int) -> None:
        self.program, self.block = program, block
        self.items = program.items_of(block)
        self.words = [item for item in self.items if isinstance(item, Word)]
        self.by_address = {word.address: word for word in self.words}
        self.axes = {word.address: word for word in self.words if word.address in AXIS_LETTERS}

    def some(self, addresses: Iterable[str]) -> dict[str, Word]:
        """Those of `addresses` that the block has, with their words, in the order given."""
        return {address: self.by_address[address] for address in addresses if address in self.by_address}

    def coded(self, address: str, codes: frozenset[float]) -> tuple[Word, ...]:
        """The words with this address and one of these codes."""
        return tuple(word for word in self.words if word.address == address and self._code(word) in codes)

    def g_code(self, codes: frozenset[float]) -> Word | None:
        """The first G word with one of these codes."""
        return next(iter(self.coded("G", codes)), None)

    @property
    def skip(self) -> Span | None:
        """The span of the block skip; None without one."""
        return next((item.span for item in self.items if isinstance(item, Skip)), None)

    def beside(self, words: Sequence[Word]) -> tuple[Anchor, Anchor, str]:
        """The places after and before some words, and the separator before the last of them: a blank or nothing."""
        last = max(words, key=lambda word: self.program.position(self.block, word.span.stop))
        first = min(words, key=lambda word: self.program.position(self.block, word.span.start))
        at = self.program.position(self.block, last.span.start)
        before = b" " if at == self.program.blocks[self.block, 0] else self.program.source[at - 1 : at]
        return last.span.stop, first.span.start, before.decode("latin-1") if before in (b" ", b"\t") else ""

    def _code(self, word: Word) -> float | None:
        if isinstance(word.value, Constant):
            return word.value.value
        values = self.program.values_of(self.block)
        return float(values[word.value.slot]) if isinstance(word.value, Literal) else None


def layout_of(program: Program, block: int) -> Layout:
    """The layout of a motion block."""
    words = BlockWords(program, block)
    numbered = [word for word in words.words if word.address != "N"]
    words_at, code_at, blank = words.beside(list(words.axes.values()) or numbered or words.words)
    return Layout(
        axes=words.axes,
        centre=words.some(CENTRE_LETTERS),
        radius=words.by_address.get("R"),
        turns=words.by_address.get("P"),
        feed=words.by_address.get("F"),
        motion=words.g_code(MOTION_CODES),
        feed_mode=words.g_code(FEED_MODES),
        after=(*words.coded("M", CODES_AFTER_MOTION), *words.coded("G", EXACT_STOP)),
        words_at=words_at,
        code_at=code_at,
        blank=blank,
        prefix=words.skip,
        levels=words.some(("R", *(table.level for _, table in program.dialect.cycles))),
    )


def has_free_text(program: Program, block: int) -> bool:
    """Whether the block holds items that may mean more than words: flow control, tape marks, opaque text."""
    return any(
        isinstance(item, (OWordLine, Tape)) or (isinstance(item, Opaque) and item.kind != CONTROL_CHARACTER)
        for item in program.items_of(block)
    )


def bulk_layout(program: Program, block: int, layout: Layout) -> BulkLayout | None:
    """The part of a layout that is the same for all blocks of the shape; None if an axis word is no plain number."""
    slots = {letter: word.value.slot for letter, word in layout.axes.items() if isinstance(word.value, Literal)}
    if len(slots) < len(layout.axes):
        return None
    at = program.position(block, layout.code_at)
    return BulkLayout(slots, layout.words_at, layout.blank, program.source[at : at + 1].islower())


def arc_layout(program: Program, block: int, layout: Layout) -> ArcLayout | None:
    """Places of the words of an arc; None if one of them is no plain number, or if R and a centre are both given."""
    slots = {letter: word.value.slot for letter, word in layout.centre.items() if isinstance(word.value, Literal)}
    word = layout.radius
    if len(slots) < len(layout.centre) or (word is not None and (slots or not isinstance(word.value, Literal))):
        return None
    if word is None or not isinstance(word.value, Literal):
        return ArcLayout(slots)
    at, (slot, offset) = program.position(block, word.span.start), word.span.start
    blank = at > program.blocks[block, 0] and program.source[at - 1 : at] in (b" ", b"\t")
    return ArcLayout(slots, (word.value.slot, Span(Anchor(slot, offset - blank), word.span.stop)))
