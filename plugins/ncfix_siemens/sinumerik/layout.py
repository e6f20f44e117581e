"""Where things stand in a motion block of SINUMERIK: which words may be rewritten, and where a missing one goes."""

from __future__ import annotations

from dataclasses import dataclass

from ncfix.text.layout import (
    CENTRE_LETTERS,
    CODES_AFTER_MOTION,
    FEED_MODES,
    MOTION_CODES,
    BlockWords,
    Layout,
)
from ncfix.text.tree import (
    START,
    Anchor,
    Command,
    Comment,
    Constant,
    FunctionCall,
    Item,
    Opaque,
    OWordLine,
    Program,
    Skip,
    Span,
    Tape,
    Word,
)
from ncfix_siemens.sinumerik.circles import VIA
from ncfix_siemens.sinumerik.scanning import has_partial
from ncfix_siemens.sinumerik.vocabulary import ANGLES, DRILLING, FORM, FORMS, HARMLESS, MOTIONS, POLAR, VECTOR

END_OF_SUBPROGRAM = frozenset({17.0})
"""M17."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SinumerikLayout(Layout):
    """The writable parts of a motion block.

    formed  the values of words with a form, brackets and all
    via     I1 J1 K1 by address
    angle   AR
    polar   AP and RP by address
    partial_polar  blocks of the program rely on such a word of a block before
    cycle   the call of a drilling cycle, where the block holds nothing else
    begins  where its words begin, behind block skip, number and label
    """

    formed: dict[str, Span]
    via: dict[str, Word]
    angle: Word | None
    polar: dict[str, Word]
    partial_polar: bool
    cycle: Span | None
    begins: Anchor

    @property
    def points(self) -> bool:
        """Whether the block says which way the tool points."""
        return bool(self.vector or self.angles)


def layout_of(program: Program, block: int) -> SinumerikLayout | None:
    """The layout of a motion block; None for control structures, calls, and what is not understood."""
    words = BlockWords(program, block)
    cycle = drilling_call(words)
    if cycle is None and not all(
        (isinstance(each, Command) and is_quiet(each)) or may_stay(each) for each in words.items
    ):
        return None
    numbered = [word for word in words.words if word.address not in ("N", ":")]
    anchors = list(words.axes.values()) or numbered or words.words
    content = [item.span for item in words.items if not is_prefix(item)]
    if not (anchors or cycle) or not content:
        return None
    words_at, code_at, blank = words.beside(anchors) if anchors else (content[0].stop, content[0].start, " ")
    polar = words.some(sorted(POLAR))
    formed = {word.address: word for word in words.words if form_of(word)}

    def bare(some: dict[str, Word]) -> dict[str, Word]:
        return {address: without_form(program, block, word) for address, word in some.items()}

    return SinumerikLayout(
        axes=bare(words.axes),
        forms={address: form_of(word) for address, word in formed.items()},
        formed={address: word.value_span for address, word in formed.items()},
        centre=bare(words.some(CENTRE_LETTERS)),
        radius=words.by_address.get("CR"),
        turns=words.by_address.get("TURN"),
        feed=words.by_address.get("F"),
        motion=words.first_coded("G", MOTION_CODES) or named_motion(program, block),
        feed_mode=words.first_coded("G", FEED_MODES),
        after=words.coded("M", CODES_AFTER_MOTION | END_OF_SUBPROGRAM),
        words_at=words_at,
        code_at=code_at,
        blank=blank,
        prefix=words.skip,
        via=bare(words.some(VIA)),
        angle=words.by_address.get("AR"),
        polar=polar,
        partial_polar=bool(polar) and has_partial(program),
        vector=words.some(VECTOR),
        angles=words.some(ANGLES),
        cycle=cycle,
        begins=min((span.start for span in content), key=lambda anchor: program.position(block, anchor)),
    )


def form_of(word: Word) -> str:
    """How a word is meant, if it says so: `ac`, `ic`, `dc`, ..."""
    return word.value.name if isinstance(word.value, FunctionCall) and word.value.name in FORMS else ""


def without_form(program: Program, block: int, word: Word) -> Word:
    """A word whose value is what stands in the brackets of its form: `X=IC(10)` as `X=10`."""
    start, stop = program.span(block, word.value_span)
    found = FORM.match(program.source[start:stop].decode("latin-1")) if form_of(word) else None
    if found is None or not isinstance(word.value, FunctionCall):
        return word
    first, last = (start - int(program.blocks[block, 0]) + place for place in found.span("value"))
    value = word.value.arguments[0] if word.value.arguments else None
    span = Span(Anchor(START, first), Anchor(START, last))
    return word if value is None else Word(word.address, value, word.span, span)


def drilling_call(words: BlockWords) -> Span | None:
    """The call of a drilling cycle, if that is all that a block holds besides its number."""
    items = [item for item in words.items if not (is_prefix(item) or isinstance(item, Comment))]
    match items:
        case [Command(name) as call] if name in DRILLING:
            return call.span
    return None


def is_prefix(item: Item) -> bool:
    """Block skip, block number, or label."""
    numbered = isinstance(item, Word) and item.address in ("N", ":")
    return numbered or isinstance(item, Skip) or (isinstance(item, OWordLine) and item.keyword == "label")


def is_quiet(item: Command) -> bool:
    """Whether a name in the block neither calls anything nor changes coordinates."""
    return item.name in HARMLESS | {"cycle832"} or item.name in MOTIONS or item.name.startswith("ori")


def may_stay(item: object) -> bool:
    """Whether lines may be put after a block with this item."""
    if isinstance(item, OWordLine):
        return item.keyword == "label"
    return not isinstance(item, (Command, Opaque, Tape))


def named_motion(program: Program, block: int) -> Word | None:
    """CIP or another name in the group of G0 to G3, as a word."""
    for item in program.items_of(block):
        if isinstance(item, Command) and item.name in MOTIONS:
            return Word(item.name.upper(), Constant(MOTIONS[item.name] / 10), item.span, item.span)
    return None
