"""Heidenhain Klartext as a `WrittenLanguage`, and which of its motions can be written many at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ncfix.arrays import Ints, Mask
from ncfix.control.interpreter import FlatLine
from ncfix.control.moves import Moves
from ncfix.text.language import ArcLayout, BulkLayout
from ncfix.text.reach import whole_text
from ncfix.text.spelling import Spelling
from ncfix.text.tree import Assignment, Literal, Opaque, OWordLine, Program, Skip
from ncfix.writer.language import WrittenLanguage
from ncfix.writer.pieces import Pieces
from ncfix_heidenhain.klartext.blocks import parse_block, renumbered, scan, split
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.interpreter import KlartextInterpreter
from ncfix_heidenhain.klartext.layout import TURN_DEGREES, beside_corners, layout_of, uses_comma
from ncfix_heidenhain.klartext.units import STRAIGHT
from ncfix_heidenhain.klartext.writing import KlartextWriter, on_its_side, spelling_of

ARCS = frozenset({"c", "cr"})
LIMIT_DEGREES = 1e-6
"""`BlockWriter` writes motions whose corrected angle comes this near to zero or to a full turn."""


def unrolled(interpreter: KlartextInterpreter, steps: Mapping[str, float], limit: int) -> Sequence[FlatLine]:
    """The lines of a program that is written out flat; raises SourceError NCF237 and NCF238."""
    from ncfix_heidenhain.klartext.flatten import KlartextFlattener

    style = Spelling(signed=True, comma=uses_comma(interpreter.main.program.source), point=False)
    flattener = KlartextFlattener(interpreter.control, steps, limit, style)
    interpreter.watcher = flattener
    interpreter.run()
    program = interpreter.main.program
    first = next(block for block in program if "BEGIN" in program.text_of(block).upper())
    last = len(program) - 1
    names = [
        program.slice(block, item.span)
        for block in (first, last)
        for item in program.items_of(block)
        if isinstance(item, Opaque) and item.kind == "program"
    ]
    head = FlatLine(names[0], program.line(first))
    tail = FlatLine(names[0].upper().replace("BEGIN", "END", 1), program.line(last))
    return [head, *flattener.lines, tail]


def in_bulk(program: Program, block: int) -> BulkLayout | None:
    """The layout for writing motions like that of a block many at a time; None if they need `BlockWriter`."""
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
        only_named_rotary=True,
        arc=ArcLayout({}, alone=True) if layout.name in ARCS else None,
    )


def one_by_one(program: Program, moves: Moves, pieces: Pieces, first_piece: Ints) -> Mask:
    """(n,) motions that have to be written one by one, with `BlockWriter`.

    They are the motions beside a corner that the control makes, and motions with a corrected rotary axis if it has no
    word, if the motion is split, or if the angle comes to zero or a full turn.
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
    low, high = LIMIT_DEGREES, TURN_DEGREES - LIMIT_DEGREES
    found |= (corrected & (before > -low) & (after < low)).any(axis=1)
    found |= (corrected & (before < TURN_DEGREES + LIMIT_DEGREES) & (after > high)).any(axis=1)
    return found


KLARTEXT = WrittenLanguage(
    split=split,
    end=whole_text,
    scan=scan,
    parse=parse_block,
    control=KlartextControl,
    interpreter=KlartextInterpreter,
    layout=layout_of,
    writer=KlartextWriter,
    spelling=spelling_of,
    arc_pieces=True,
    held_angle=on_its_side,
    bulk=in_bulk,
    one_by_one=one_by_one,
    renumber=renumbered,
    unroll=unrolled,
)
