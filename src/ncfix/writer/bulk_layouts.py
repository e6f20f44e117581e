"""The layouts of all block shapes that can be written in bulk: `BulkLayout` as columns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ncfix.arrays import Bytes, Ints, Mask
from ncfix.control.moves import Moves
from ncfix.text.language import BulkLayout
from ncfix.text.layout import AXIS_LETTERS, CENTRE_LETTERS
from ncfix.text.spelling import Spelling
from ncfix.text.tree import START, Program
from ncfix.values import frozen
from ncfix.writer.language import WrittenLanguage

OPENING, CLOSING = 4, 8
"""Largest number of bytes before and after the axis words of a further piece."""
NONE = -1
"""Slot of an axis that has no word."""
VECTOR_HEAD = 1
"""In place of the letter: other words of the block move the axis."""


@frozen
class Layouts:
    """The layouts of a program's shapes, one row per template; columns by axis.

    known      (s,) blocks of the shape can be written in bulk
    further    (s,) so can further pieces of their motions
    slots      (s, n_axes) slot of each axis word's number in the block, or `NONE`
    by_place   (s, n_axes) the axes in the order of their words in the block, -1 after the last one
    by_letter  (n_axes,) the axes in the order in which programs write them
    anchors    (s, 2) slot and offset of the place where missing words go
    heads      (s, n_axes, 2) bytes before the number of a missing word: a blank, or 0 for none, and the letter. Letter
               0: the axis gets no word; `VECTOR_HEAD`: other words move it
    leads      (s, 2) slot and offset of the place up to which lines of further pieces repeat the beginning of the block
    openings   (s, k) bytes before the words of such lines, 0 for none
    closings   (s, k) bytes after these words
    round      (s,) arcs of the shape can be written in bulk, as long as they stay one arc
    centre     (s, 3) slots of I, J and K, or `NONE`
    fixed      (s, 3) which of these count from the origin
    centre_heads  (s, 3, 2) bytes before the number of a missing centre word, as `heads`
    radius     (s,) slot of R, or `NONE`
    alone      (s,) arcs of the shape are written by `BlockWriter`
    taken      (s, 2, 2) slot and offset of the beginning of R, with the blank before it, and of its end
    spelling   how numbers are written
    lined      whether lines of further pieces begin with more than axis words
    """

    known: Mask
    further: Mask
    slots: Ints
    by_place: Ints
    by_letter: Ints
    anchors: Ints
    heads: Bytes
    leads: Ints
    openings: Bytes
    closings: Bytes
    round: Mask
    centre: Ints
    fixed: Mask
    centre_heads: Bytes
    radius: Ints
    taken: Ints
    alone: Mask
    spelling: Spelling
    lined: bool = False

    @property
    def arrays(self) -> tuple[Ints, Ints, Ints, Ints, Bytes, Ints, Bytes, Bytes]:
        """The columns that the compiled core needs."""
        text = self.openings, self.closings
        return self.slots, self.by_place, self.by_letter, self.anchors, self.heads, self.leads, *text

    @classmethod
    def of(cls, language: WrittenLanguage, program: Program, moves: Moves) -> Layouts:
        """The layouts of all shapes in use that can be written in bulk."""
        n, axes = len(program.templates), moves.axes
        by_letter = np.array(sorted(range(len(axes)), key=lambda column: AXIS_LETTERS.index(axes[column])), np.int64)
        table = cls(
            np.zeros(n, np.bool_),
            np.zeros(n, np.bool_),
            np.full((n, len(axes)), -1, np.int64),
            np.full((n, len(axes)), -1, np.int64),
            by_letter,
            np.zeros((n, 2), np.int64),
            np.zeros((n, len(axes), 2), np.uint8),
            np.full((n, 2), (START, 0), np.int64),
            np.zeros((n, OPENING), np.uint8),
            np.zeros((n, CLOSING), np.uint8),
            np.zeros(n, np.bool_),
            np.full((n, 3), NONE, np.int64),
            np.zeros((n, 3), np.bool_),
            np.zeros((n, 3, 2), np.uint8),
            np.full(n, NONE, np.int64),
            np.zeros((n, 2, 2), np.int64),
            np.zeros(n, np.bool_),
            language.spelling(program),
        )
        if language.bulk is not None and len(moves):
            shapes = program.template.take(moves.block)
            for shape in np.flatnonzero(np.bincount(shapes)).tolist():
                layout = language.bulk(program, int(moves.block[np.argmax(shapes == shape)]))
                if layout is not None:
                    table.enter(shape, layout, moves)
                    table = replace(table, lined=layout.lead is not None)
        return table

    def enter(self, shape: int, layout: BulkLayout, moves: Moves) -> None:
        """Fill in the row of a shape."""
        axes = moves.axes
        present = sorted((layout.slots[letter], column) for column, letter in enumerate(axes) if letter in layout.slots)
        self.known[shape], self.further[shape] = True, layout.further
        for place, (slot, column) in enumerate(present):
            self.slots[shape, column], self.by_place[shape, place] = slot, column
        self.anchors[shape] = layout.words_at
        blank = ord(layout.blank) if layout.blank else 0
        self.heads[shape] = [(blank, ord(letter.lower() if layout.lower else letter)) for letter in axes]
        if layout.only_named_rotary:
            self.heads[shape, moves.rotary & (self.slots[shape] < 0), 1] = 0
        if layout.by_vector:
            self.heads[shape, moves.rotary, 1] = VECTOR_HEAD
        if layout.lead is not None:
            self.leads[shape] = layout.lead
        for table, text in ((self.openings, layout.opening), (self.closings, layout.closing)):
            table[shape, : len(text)] = list(text.encode("latin-1"))
        if (arc := layout.arc) is not None:
            self.round[shape], self.alone[shape] = True, arc.alone
            self.centre[shape] = [arc.centre.get(letter, NONE) for letter in CENTRE_LETTERS]
            self.fixed[shape] = [letter in arc.fixed for letter in CENTRE_LETTERS]
            letters = [letter.lower() if layout.lower else letter for letter in CENTRE_LETTERS]
            self.centre_heads[shape] = [(ord(layout.blank or "\0"), ord(letter)) for letter in letters]
            if arc.radius is not None:
                self.radius[shape], self.taken[shape] = arc.radius


def places_of(program: Program, blocks: Ints, anchors: Ints) -> Ints:
    """The bytes of `blocks` (k,) at the anchors (s, 2) of their shapes."""
    slot, offset = anchors[program.template[blocks]].T
    edges = program.blocks[blocks, np.where(slot == START, 0, 1)]
    behind = slot >= 0
    edges[behind] = program.number_spans[program.first_number[blocks[behind]] + slot[behind], 1]
    places: Ints = edges + offset
    return places
