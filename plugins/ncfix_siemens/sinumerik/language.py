"""SINUMERIK as a `WrittenLanguage`."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ncfix.arrays import Ints, Mask
from ncfix.control.interpreter import FlatLine
from ncfix.control.moves import Moves
from ncfix.text import reach
from ncfix.text.language import ArcLayout, BulkLayout
from ncfix.text.layout import CENTRE_LETTERS, arc_layout, bulk_layout
from ncfix.text.reach import whole_text
from ncfix.text.shapes import split_blocks
from ncfix.text.tree import Program, Template, Word
from ncfix.writer.language import WrittenLanguage
from ncfix.writer.pieces import Pieces
from ncfix_siemens.sinumerik.blocks import parse_block
from ncfix_siemens.sinumerik.interpreter import SinumerikInterpreter
from ncfix_siemens.sinumerik.plans import fixed_centre, in_form
from ncfix_siemens.sinumerik.scanning import polar_words, renumbered, scan
from ncfix_siemens.sinumerik.state import Sinumerik
from ncfix_siemens.sinumerik.vocabulary import SHORTEST_WAY, VECTOR
from ncfix_siemens.sinumerik.writing import SPELLING, SinumerikLayout, SinumerikWriter, form_of, layout_of

SPATIAL = frozenset("XYZ")
SAME_ANGLE = 1e-9
"""rad"""


def runs_straight_on(template: Template) -> bool:
    """Whether blocks of this shape do not depend on distant blocks of the text.

    If a block has only one of AP and RP, all blocks with these words depend on each other.
    """
    return reach.runs_straight_on(template) and len(polar_words(template)) != 1


def unroll(interpreter: SinumerikInterpreter, steps: Mapping[str, float], limit: int) -> Sequence[FlatLine]:
    """See `FollowedLanguage`."""
    from ncfix_siemens.sinumerik.flatten import SinumerikFlattener

    interpreter.watcher = SinumerikFlattener(interpreter.control, steps, limit)
    interpreter.run()
    return interpreter.watcher.lines


def in_bulk(program: Program, block: int) -> BulkLayout | None:
    """The layout to write many motions of a block's shape at once; None if they need `BlockWriter`."""
    layout = layout_of(program, block)
    if layout is None or not layout.axes or layout.polar or layout.angles:
        return None
    forms = {layout.forms[letter] for letter in layout.forms.keys() & layout.axes.keys()}
    if not forms <= {SHORTEST_WAY}:
        return None
    if layout.points and not layout.axes.keys() <= SPATIAL:
        return None
    found = bulk_layout(program, block, layout)
    further = not (layout.after or layout.prefix or layout.points or forms)
    return found and replace(found, further=further, by_vector=layout.points, arc=arc_in_bulk(program, block, layout))


def arc_in_bulk(program: Program, block: int, layout: SinumerikLayout) -> ArcLayout | None:
    """The layout of arc words to write many arcs of a block's shape at once; None if they need `BlockWriter`."""
    fixed = fixed_centre(program.template_of(block))
    if layout.via or layout.angle is not None or layout.forms.keys() & set(CENTRE_LETTERS) - fixed.keys():
        return None
    found = arc_layout(program, block, replace(layout, centre=without(layout.centre, fixed)))
    return found and replace(found, centre={**found.centre, **fixed}, fixed=frozenset(fixed))


def without(words: Mapping[str, Word], addresses: Container[str]) -> dict[str, Word]:
    """Words without those of some addresses."""
    return {address: word for address, word in words.items() if address not in addresses}


def one_by_one(program: Program, moves: Moves, pieces: Pieces, first_piece: Ints) -> Mask:
    """Mask (n,) of the motions for `BlockWriter`, among those with a tool vector or DC.

    These are motions with corrected rotary axes or several pieces, and those in which DC leads past a full turn. An
    unchanged vector in one piece leads the rotary axes where the program has them.
    """
    shapes = [
        any(word.address in VECTOR or form_of(word) == SHORTEST_WAY for word in template.words)
        for template in program.templates
    ]
    pointed: Mask = np.array(shapes, dtype=np.bool_)[program.template[moves.block]]
    if not pointed.any():
        return pointed
    last = first_piece[1:] - 1
    turned = (pieces.end[last] != moves.end)[:, moves.rotary].any(axis=1)
    return pointed & (turned | (np.diff(first_piece) > 1) | past_a_turn(program, moves))


def past_a_turn(program: Program, moves: Moves) -> Mask:
    """Mask (n,) of the motions in which DC leads to another number than its own, past a full turn."""
    found, shapes = np.zeros(len(moves), dtype=np.bool_), program.template[moves.block]
    for shape, template in enumerate(program.templates):
        for letter, slot in in_form(template, moves.axes, SHORTEST_WAY).items():
            rows, column = np.flatnonzero(shapes == shape), moves.axes.index(letter)
            angle = np.radians(program.numbers[program.first_number[moves.block[rows]] + slot])
            offset = np.array([frame.offset[column] for frame in moves.frames])[moves.frame[rows]]
            found[rows] |= np.abs(moves.end[rows, column] - offset - angle) > SAME_ANGLE
    return found


SINUMERIK = WrittenLanguage(
    split=split_blocks,
    end=whole_text,
    scan=scan,
    parse=parse_block,
    control=Sinumerik,
    interpreter=SinumerikInterpreter,
    layout=layout_of,
    writer=SinumerikWriter,
    spelling=lambda _program: SPELLING,
    arc_pieces=True,
    unroll=unroll,
    bulk=in_bulk,
    one_by_one=one_by_one,
    renumber=renumbered,
    straight=runs_straight_on,
)
