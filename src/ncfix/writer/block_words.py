"""The words of one block: read, put right in their own style, added, taken out."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from ncfix.control.turns import is_dragged
from ncfix.text.layout import AXIS_LETTERS, CENTRE_LETTERS, Layout
from ncfix.text.spelling import NumberStyle
from ncfix.text.tree import Constant, Literal, Program, Word
from ncfix.writer.target import TANGENTIAL, Rendered, Target

LENGTHS = frozenset((*CENTRE_LETTERS, "R"))


LayoutT = TypeVar("LayoutT")


@lru_cache(maxsize=32)
def columns_of(letters: tuple[str, ...]) -> tuple[tuple[int, str], ...]:
    """The axes with their columns, in the order in which words are added."""
    return tuple(sorted(enumerate(letters), key=lambda each: AXIS_LETTERS.index(each[1])))


@lru_cache(maxsize=32)
def half_steps(decimals: tuple[int, ...]) -> NDArray[np.float64]:
    """(n_axes,) half an output step of axes with so many digits behind the point; not to be written to."""
    return np.asarray(0.5 * 10.0 ** -np.array(decimals, dtype=float))


class BlockWriter(Generic[LayoutT]):
    """One block in any language, and what its motion is to become; what is written is gathered in `out` and `added`.

    columns  the axes in the order in which words are added
    half     (n_axes,) half an output step of each
    """

    def __init__(self, program: Program, block: int, layout: LayoutT, target: Target) -> None:
        self.program = program
        self.block = block
        self.layout = layout
        self.target = target
        self.out = Rendered()
        self.added: list[str] = []
        self.columns = columns_of(target.letters)
        self.half = half_steps(tuple(target.decimals.tolist()))


class WordWriter(BlockWriter[Layout]):
    """Puts the words of one block right."""

    def __init__(self, program: Program, block: int, layout: Layout, target: Target) -> None:
        super().__init__(program, block, layout, target)
        self.code = TANGENTIAL.get(target.code, target.code)
        self.dragged = math.isfinite(target.turn_minutes) and is_dragged(target)

    def _value(self, word: Word, otherwise: float) -> float:
        if isinstance(word.value, Constant):
            return word.value.value
        if isinstance(word.value, Literal):
            return float(self.program.values_of(self.block)[word.value.slot]) * self._increment(word)
        return otherwise

    def _increment(self, word: Word) -> float:
        """What the word's number counts: other than 1 only for a length or angle without a decimal point."""
        if not (isinstance(word.value, Literal) and word.value.pointless):
            return 1.0
        if word.address in self.target.letters:
            return self.target.increments[1 if self.target.rotary[self.target.letters.index(word.address)] else 0]
        return self.target.increments[0] if word.address in LENGTHS else 1.0

    def _rewrite(self, word: Word, value: float, decimals: int) -> float:
        """Give a word another value in its own style; an expression gives way to a number, unless it is computed from
        what was measured. Returns what is written."""
        start, stop = self.program.span(self.block, word.value_span)
        if self.target.measured and word.address in self.target.letters:
            column = self.target.letters.index(word.address)
            if self.target.measured[column]:
                return float(self.target.original[column])
        literal = isinstance(word.value, (Literal, Constant))
        style = NumberStyle.of(self.program.source[start:stop].decode("latin-1")) if literal else NumberStyle()
        increment = self._increment(word)
        text = style.write(value / increment, decimals if increment == 1.0 else 0)
        self.out.edits.append((start, stop, text))
        return float(text) * increment

    def _remove(self, word: Word) -> None:
        """Take a word out with the blank before it, if nothing has been put between them."""
        start, stop = self.program.span(self.block, word.span)
        blank = self.program.source[start - 1 : start] in (b" ", b"\t") and start > self.program.blocks[self.block, 0]
        if blank and all(edit[:2] != (start, start) for edit in self.out.edits):
            start -= 1
        self.out.edits.append((start, stop, ""))

    def _add(self, letter: str, text: str) -> None:
        self.added.append(self.layout.blank + self._cased(letter) + text)

    def _cased(self, letter: str) -> str:
        """The letter in the case in which the block writes its addresses."""
        at = self.program.position(self.block, self.layout.code_at)
        return letter.lower() if self.program.source[at : at + 1].islower() else letter
