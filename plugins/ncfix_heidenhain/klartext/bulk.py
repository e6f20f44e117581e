"""Which straight motions of Klartext are written many at a time, and how their blocks and further pieces look."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.control.moves import Moves
from ncfix.text.language import ArcLayout, BulkLayout
from ncfix.text.tree import (
    Assignment,
    Command,
    Item,
    Literal,
    Opaque,
    OWordLine,
    Program,
    Skip,
    Template,
    Word,
)
from ncfix.writer.pieces import Pieces
from ncfix_heidenhain.klartext.layout import CORNERS, TURN_DEGREES, is_between, layout_of

Mask = NDArray[np.bool_]

STRAIGHT = frozenset({"", "l", "ln"})
ARCS = frozenset({"c", "cr"})
FEW = 1e-6
"""Degrees from zero or a full turn at which a corrected angle is looked at by `BlockWriter`."""


def in_bulk(program: Program, block: int) -> BulkLayout | None:
    """What is needed to write motions like that of a block many at a time; None if they need `BlockWriter`."""
    items = program.items_of(block)
    if any(isinstance(item, Skip | Opaque | OWordLine | Assignment) for item in items):
        return None
    layout = layout_of(program, block)
    if layout is None or layout.polar or layout.vector or len(layout.blank) != 1:
        return None
    if not (layout.axes if layout.name in STRAIGHT else layout.name in ARCS and layout.axes.keys() >= {"X", "Y"}):
        return None
    slots = {letter: w.value.slot for letter, w in layout.axes.items() if isinstance(w.value, Literal)}
    if len(slots) < len(layout.axes) or layout.forms:
        return None
    return BulkLayout(
        slots,
        layout.words_at,
        layout.blank,
        lower=False,
        further=not layout.after,
        lead=layout.prefix.stop,
        opening="L",
        closing=layout.closing and layout.blank + layout.closing,
        turns_named=True,
        arc=ArcLayout({}, alone=True) if layout.name in ARCS else None,
    )


# -- motions that need `BlockWriter` -----------------------------------------------------------------------------------


def one_by_one(program: Program, moves: Moves, pieces: Pieces, first_piece: NDArray[np.int64]) -> Mask:
    """(n,) motions that `BlockWriter` has to look at.

    Those beside a corner that the control makes; and where rotary axes are corrected, those in which one has no word,
    or comes to zero or a full turn.
    """
    found = beside_corners(program)[moves.block]
    last = first_piece[1:] - 1
    end, nominal = pieces.end[last][:, moves.rotary], moves.end[:, moves.rotary]
    corrected = end != nominal
    if not corrected.any():
        return found
    found |= (corrected & ~moves.programmed[:, moves.rotary]).any(axis=1)
    found |= corrected.any(axis=1) & (np.diff(first_piece) > 1)
    offset = np.array([frame.offset for frame in moves.frames])[moves.frame][:, moves.rotary]
    before, after = np.degrees(nominal - offset), np.degrees(end - offset)
    found |= (corrected & (before > -FEW) & (after < FEW)).any(axis=1)
    found |= (corrected & (before < TURN_DEGREES + FEW) & (after > TURN_DEGREES - FEW)).any(axis=1)
    return found


def beside_corners(program: Program) -> Mask:
    """(n,) blocks next to RND or CHF, remarks and poles left out: as `KlartextLayout.corner`."""
    found = np.zeros(len(program), dtype=np.bool_)
    corner = np.array([is_corner(each) for each in program.templates], dtype=np.bool_)
    if corner.any():
        said = np.array([not is_between(each.items) for each in program.templates], dtype=np.bool_)
        blocks = np.flatnonzero(said[program.template])
        corners = corner[program.template[blocks]]
        found[blocks[:-1]] |= corners[1:]
        found[blocks[1:]] |= corners[:-1]
    return found


def is_corner(template: Template) -> bool:
    """RND or CHF."""
    return any(name_of(item).lower() in CORNERS for item in template.items)


def name_of(item: Item) -> str:
    """The name of a command, or the address of a word."""
    return item.name if isinstance(item, Command) else item.address if isinstance(item, Word) else ""
