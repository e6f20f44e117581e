"""Edits to the text of one block: reading words, rewriting them in their own style, adding and removing them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache

import numpy as np

from ncfix.arrays import Array
from ncfix.text.layout import AXIS_LETTERS, CENTRE_LETTERS, Layout
from ncfix.text.spelling import Spelling, value_of
from ncfix.text.tree import Constant, Literal, Program, Span, Word
from ncfix.writer.target import Rendered, Target

LENGTHS = frozenset((*CENTRE_LETTERS, "R"))


@lru_cache(maxsize=32)
def columns_of(letters: tuple[str, ...]) -> tuple[tuple[int, str], ...]:
    """The axes with their columns, in the order in which words are added."""
    return tuple(sorted(enumerate(letters), key=lambda each: AXIS_LETTERS.index(each[1])))


@lru_cache(maxsize=32)
def half_steps(decimals: tuple[int, ...]) -> Array:
    """(n_axes,) half an output step of axes with these numbers of decimals; read-only."""
    return np.asarray(0.5 * 10.0 ** -np.array(decimals, dtype=float))


class BlockText:
    """A block whose motion is rewritten; edits and lines are collected in `out`, added words in `added`.

    columns  the axes in the order in which words are added
    half     (n_axes,) half an output step of each axis
    """

    def __init__(self, program: Program, block: int, layout: Layout, target: Target, spelling: Spelling) -> None:
        self.program, self.block, self.layout, self.target, self.spelling = program, block, layout, target, spelling
        self.out = Rendered()
        self.added: list[str] = []
        self.columns: Sequence[tuple[int, str]] = columns_of(target.letters)
        self.half = half_steps(tuple(target.decimals.tolist()))

    def _value(self, word: Word, otherwise: float) -> float:
        """The value of a word that is a plain number; else `otherwise`."""
        if isinstance(word.value, Constant):
            return word.value.value
        if isinstance(word.value, Literal):
            return float(self.program.values_of(self.block)[word.value.slot]) * self._increment(word)
        return otherwise

    def _increment(self, word: Word) -> float:
        """The weight of the word's number: other than 1 only for a length or angle without a decimal point."""
        if not (isinstance(word.value, Literal) and word.value.pointless):
            return 1.0
        if word.address in self.target.letters:
            return self.target.increments[1 if self.target.rotary[self.target.letters.index(word.address)] else 0]
        return self.target.increments[0] if word.address in LENGTHS else 1.0

    def _rewrite(self, word: Word, value: float, decimals: int) -> float:
        """Give a word another value in its own style; an expression is replaced by a number, unless it uses measured
        values. Returns the value as written."""
        if self.target.measured and word.address in self.target.letters:
            column = self.target.letters.index(word.address)
            if self.target.measured[column]:
                return float(self.target.original[column])
        increment = self._increment(word)
        return self._replace(word, value / increment, decimals if increment == 1.0 else 0) * increment

    def _replace(self, word: Word, value: float, decimals: int, *, anew: bool = False) -> float:
        """Replace the number of a word, in its style or in a new one (`anew`); returns the number as written."""
        start, stop = self.program.span(self.block, word.value_span)
        if anew or not isinstance(word.value, (Literal, Constant)):
            text = self.spelling.instead(value, decimals)
        else:
            text = self.spelling.like(self.program.source[start:stop].decode("latin-1"), value, decimals)
        self.out.edits.append((start, stop, text))
        return value_of(text)

    def _restate(self, word: Word, number: str) -> None:
        """Replace the number of a G code."""
        self._rewrite(word, float(number), 0)

    def _add(self, letter: str, value: float, decimals: int) -> float:
        """Add a word; returns the number as written."""
        text = self.spelling.number(value, decimals)
        self.added.append(self.layout.blank + self._cased(letter) + text)
        return value_of(text)

    def _remove(self, word: Word | None) -> None:
        """Remove a word with the blanks before it, unless something has been inserted between them."""
        if word is not None:
            self._remove_span(word.span)

    def _remove_span(self, span: Span) -> None:
        start, stop = self.program.span(self.block, span)
        begin = int(self.program.blocks[self.block, 0])
        first = begin if self.spelling.all_blanks else max(begin, start - 1)
        while self.program.source[start - 1 : start] in (b" ", b"\t") and start > first:
            if any(edit[:2] == (start, start) for edit in self.out.edits):
                break
            start -= 1
        self.out.edits.append((start, stop, ""))

    def _take_back(self, span: Span) -> None:
        """Discard the edits within a span, except insertions before it."""
        first, last = self.program.span(self.block, span)
        self.out.edits = [edit for edit in self.out.edits if not first <= edit[0] < last or edit[1] == first]

    def _cased(self, address: str) -> str:
        """A letter in the case of the block's addresses; longer addresses are in upper case."""
        at = self.program.position(self.block, self.layout.code_at)
        lower = len(address) == 1 and self.program.source[at : at + 1].islower()
        return address.lower() if lower else address

    @cached_property
    def prefix(self) -> str:
        """The beginning of inserted lines."""
        text = self.program.slice(self.block, self.layout.prefix) if self.layout.prefix else ""
        return "" if "\n" in text else text

    def _line(self, words: Sequence[str]) -> None:
        """Add a line after the block."""
        self.out.lines.append(self.prefix + self.layout.blank.join(words))
