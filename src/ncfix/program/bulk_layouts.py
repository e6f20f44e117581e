"""Where things stand in the blocks of all shapes that are written in bulk: `BulkLayout` as columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.program.language import BulkLayout, Language
from ncfix.program.layout import AXIS_LETTERS
from ncfix.program.moves import Moves
from ncfix.program.tree import START, Program

IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Layouts:
    """The layouts of a program's shapes, one row for each template; columns by axis.

    known      (s,) blocks of the shape may be written in bulk
    further    (s,) further pieces of their motions, too
    slots      (s, n_axes) which of the block's numbers an axis has, -1 for none
    by_place   (s, n_axes) the axes as their words stand in the block, -1 behind the last one
    by_letter  (n_axes,) the axes in the order in which programs write them
    anchors    (s, 2) slot and offset of the place where missing words go
    heads      (s, n_axes, 2) what stands before the number of a missing word: a blank, or 0 for nothing, and the letter
    """

    known: NDArray[np.bool_]
    further: NDArray[np.bool_]
    slots: IntArray
    by_place: IntArray
    by_letter: IntArray
    anchors: IntArray
    heads: NDArray[np.uint8]

    @classmethod
    def of(cls, language: Language, program: Program, moves: Moves) -> Layouts:
        """The layouts of the shapes that occur and can be written in bulk."""
        n, axes = len(program.templates), moves.axes
        by_letter = np.array(sorted(range(len(axes)), key=lambda column: AXIS_LETTERS.index(axes[column])), np.int64)
        table = cls(
            np.zeros(n, np.bool_),
            np.zeros(n, np.bool_),
            np.full((n, len(axes)), -1),
            np.full((n, len(axes)), -1),
            by_letter,
            np.zeros((n, 2), np.int64),
            np.zeros((n, len(axes), 2), np.uint8),
        )
        if language.bulk is not None and len(moves):
            shapes, at = np.unique(program.template[moves.block], return_index=True)
            for shape, row in zip(shapes.tolist(), at.tolist(), strict=True):
                layout = language.bulk(program, int(moves.block[row]))
                if layout is not None:
                    table.enter(shape, layout, axes)
        return table

    def enter(self, shape: int, layout: BulkLayout, axes: tuple[str, ...]) -> None:
        """Fill in the row of a shape."""
        present = sorted((layout.slots[letter], column) for column, letter in enumerate(axes) if letter in layout.slots)
        self.known[shape], self.further[shape] = True, layout.further
        for place, (slot, column) in enumerate(present):
            self.slots[shape, column], self.by_place[shape, place] = slot, column
        self.anchors[shape] = layout.words_at
        blank = ord(layout.blank) if layout.blank else 0
        self.heads[shape] = [(blank, ord(letter.lower() if layout.lower else letter)) for letter in axes]

    def places(self, program: Program, blocks: IntArray) -> IntArray:
        """The bytes of `blocks` (k,) at which missing words go."""
        slot, offset = self.anchors[program.template[blocks]].T
        edges = program.blocks[blocks, np.where(slot == START, 0, 1)]
        behind = slot >= 0
        edges[behind] = program.number_spans[program.first_number[blocks[behind]] + slot[behind], 1]
        places: IntArray = edges + offset
        return places
