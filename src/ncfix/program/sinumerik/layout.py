"""Where things stand in a motion block of SINUMERIK: which words may be rewritten, and where a missing one goes."""

from __future__ import annotations

from dataclasses import dataclass

from ncfix.program.layout import (
    AXIS_LETTERS,
    CENTRE_LETTERS,
    CODES_AFTER_MOTION,
    MOTION_CODES,
    PER_MINUTE,
    Layout,
    _code,
    _coded,
    _separator,
)
from ncfix.program.sinumerik.circles import VIA
from ncfix.program.sinumerik.orientation import ANGLES, VECTOR
from ncfix.program.sinumerik.poles import has_partial
from ncfix.program.sinumerik.vocabulary import HARMLESS, MOTIONS, POLAR
from ncfix.program.tree import Command, Constant, Flow, Opaque, Program, Skip, Tape, Word


@dataclass(frozen=True, slots=True, kw_only=True)
class SinumerikLayout(Layout):
    """The writable parts of a motion block.

    via     I1 J1 K1 by address
    angle   AR
    polar   AP and RP by address
    partial_polar  blocks of the program rely on such a word of a block before
    vector  A3 B3 C3 by address
    angles  A2 B2 C2 by address
    """

    via: dict[str, Word]
    angle: Word | None
    polar: dict[str, Word]
    partial_polar: bool
    vector: dict[str, Word]
    angles: dict[str, Word]

    @property
    def points(self) -> bool:
        """Whether the block says which way the tool points."""
        return bool(self.vector or self.angles)


def layout_of(program: Program, block: int) -> SinumerikLayout | None:
    """The layout of a motion block; None for control structures, calls, and what is not understood."""
    items = program.items_of(block)
    if not all((isinstance(item, Command) and is_quiet(item)) or may_stay(item) for item in items):
        return None
    words = [item for item in items if isinstance(item, Word)]
    numbered = [word for word in words if word.address not in ("N", ":")]
    axes = {word.address: word for word in words if word.address in AXIS_LETTERS}
    anchors = list(axes.values()) or numbered or words
    if not anchors:
        return None
    last = max(anchors, key=lambda word: program.position(block, word.span.stop))
    first = min(anchors, key=lambda word: program.position(block, word.span.start))
    by_address = {word.address: word for word in words}
    polar = {address: by_address[address] for address in sorted(POLAR) if address in by_address}
    return SinumerikLayout(
        axes=axes,
        centre={letter: by_address[letter] for letter in CENTRE_LETTERS if letter in by_address},
        radius=by_address.get("CR"),
        turns=by_address.get("TURN"),
        feed=by_address.get("F"),
        motion=_coded(program, block, words, "G", MOTION_CODES) or named_motion(program, block),
        feed_mode=_coded(program, block, words, "G", PER_MINUTE),
        after=tuple(word for word in words if acts_later(program, block, word)),
        words_at=last.span.stop,
        code_at=first.span.start,
        blank=_separator(program, block, last),
        prefix=next((item.span for item in items if isinstance(item, Skip)), None),
        via={address: by_address[address] for address in VIA if address in by_address},
        angle=by_address.get("AR"),
        polar=polar,
        partial_polar=bool(polar) and has_partial(program),
        vector={address: by_address[address] for address in VECTOR if address in by_address},
        angles={address: by_address[address] for address in ANGLES if address in by_address},
    )


def is_quiet(item: Command) -> bool:
    """Whether a name in the block neither calls anything nor changes coordinates."""
    return item.name in HARMLESS | {"cycle832"} or item.name in MOTIONS or item.name.startswith("ori")


def may_stay(item: object) -> bool:
    """Whether lines may be put after a block with this item."""
    if isinstance(item, Flow):
        return item.keyword == "label"
    return not isinstance(item, (Command, Opaque, Tape))


def named_motion(program: Program, block: int) -> Word | None:
    """CIP or another name in the group of G0 to G3, as a word."""
    for item in program.items_of(block):
        if isinstance(item, Command) and item.name in MOTIONS:
            return Word(item.name.upper(), Constant(MOTIONS[item.name] / 10), item.span, item.span)
    return None


def acts_later(program: Program, block: int, word: Word) -> bool:
    """Whether a word acts at the end of the motion."""
    return _code(program, block, word, "M") in CODES_AFTER_MOTION | {17.0}
