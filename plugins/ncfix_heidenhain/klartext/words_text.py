"""The words of a Klartext motion block: put right, added, taken out; and the blocks that are put after it."""

from __future__ import annotations

import math
import re

import numpy as np
from numpy.typing import NDArray

from ncfix.text.number_text import ROUNDED
from ncfix.text.spelling import Spelling, value_of
from ncfix.text.tree import Literal, Program, Span, Word
from ncfix.writer.block_words import BlockWriter
from ncfix.writer.target import Target
from ncfix_heidenhain.klartext.layout import KlartextLayout, tilts
from ncfix_heidenhain.klartext.turns import UNCORRECTED, on_its_side

FloatArray = NDArray[np.float64]

VECTOR_DIGITS = 7
"""Of components of a direction: 1e-7 rad is 6e-6 degrees; the control takes eight."""


class WordWriter(BlockWriter[KlartextLayout]):
    """Puts the words of one block right."""

    def __init__(self, program: Program, block: int, layout: KlartextLayout, target: Target) -> None:
        super().__init__(program, block, layout, target)
        self.style = Spelling(signed=True, comma=layout.comma)
        self.own_pole = False

    def _polar_columns(self) -> tuple[int, ...]:
        """The columns that polar words stood for: they are named from now on."""
        return tuple(self.target.spatial[index] for index in self.target.plane[:2]) if self.layout.polar else ()

    # -- words of axes ------------------------------------------------------------------------------------------------

    def _words(self, end: FloatArray, always: tuple[int, ...], left_out: tuple[int, ...] = ()) -> FloatArray:
        """Put the words of the axes right; those of `always` are named in any case. Returns the position."""
        position = self.target.start.copy()
        for column, letter in self.columns:
            word = self.layout.axes.get(letter)
            if column in self._turning() or (word is None and self._left_alone(column)):
                continue
            if column in left_out:
                position[column] = end[column]
                self._drop(word)
            elif word is not None:
                self._present(position, column, end[column], word)
            else:
                self._absent(position, column, end[column], column in always)
        return position

    def _left_alone(self, column: int) -> bool:
        """An axis that must not get a word.

        One of which the program has not said where it stands.

        A rotary axis that is not corrected and stands where it should, but for the digits of its last word.

        A rotary axis in a program with tilted planes: the control would not keep the tip where it is; and on paths that
        are made in a plane, or lead to or away from one. The tool axis beside a corner that the control makes, which
        lies in the working plane, and in a departure.
        """
        layout, target = self.layout, self.target
        if not target.may_name(column):
            return True
        if target.rotary and target.rotary[column]:
            if self._stands(column):
                return True
            turned = any(letter in layout.axes for letter in "ABC")
            bare = layout.corner or layout.name not in ("", "l", "ln", "lp")
            return not turned and (bare or tilts(self.program.source))
        return (layout.corner or layout.name.startswith("dep")) and column == target.spatial[2]

    def _stands(self, column: int) -> bool:
        """A rotary axis stands where it should in all pieces, but for rounding."""
        target = self.target
        ends, nominal = target.ends[:, column].tolist(), float(target.nominal[column])
        here = abs(ends[0] - float(target.start[column]))
        return here <= ROUNDED * self.half[column] and all(abs(end - nominal) < UNCORRECTED for end in ends)

    def _turned(self, column: int, end: float, piece: int = 0) -> float:
        """The end of a piece, of a rotary axis on its side of zero and of a full turn."""
        target = self.target
        if not target.rotary or not target.rotary[column] or not np.isfinite(end):
            return end
        nominal = float(target.nominal[column])
        if piece < len(target.ends) - 1:
            done = float(target.shares[: piece + 1].sum())
            nominal = float(target.start[column]) * (1 - done) + nominal * done
        step = 10.0 ** -float(target.decimals[column])
        return on_its_side(self.program.source, target.letters[column], nominal, end, step)

    def _present(self, position: FloatArray, column: int, end: float, word: Word) -> None:
        base = float(position[column]) if word.address[0] == "I" else 0.0
        original = self._said(column, word)
        value = (end if base else self._turned(column, end)) - base
        whole = len(self.target.ends) == 1
        if np.isfinite(value) and not (whole and abs(value - original) < self.half[column]):
            original = self._rewrite(word, value, int(self.target.decimals[column]))
        position[column] = base + original

    def _said(self, column: int, word: Word) -> float:
        """What a word says as programmed; NaN where that is not known."""
        target = self.target
        if isinstance(word.value, Literal):
            return float(self.program.values_of(self.block)[word.value.slot])
        if word.address[0] != "I":
            return float(target.nominal[column])
        if target.incremental:
            return float(target.original[column])
        began = target.origin[target.spatial.index(column)] if column in target.spatial else np.nan
        return float(target.nominal[column] - began)

    def _absent(self, position: FloatArray, column: int, end: float, always: bool) -> None:
        end = self._turned(column, end)
        always |= self.target.must_name(column)
        if not np.isfinite(end) or (not always and abs(end - position[column]) < self.half[column]):
            return
        text = self._number(end, column)
        self.added.append(self.layout.blank + self.target.letters[column] + text)
        position[column] = value_of(text)

    def _straightened(self) -> None:
        """What is not straight by its words becomes an L, an approach or departure in polar words a Cartesian one."""
        name, leads = self.layout.name, self.layout.name.startswith(("appr", "dep"))
        self._function(name.upper().replace(" P", " ") if leads else "L")
        self._drop(*self.layout.polar, None if leads else self.layout.radius)
        if self.layout.sense is not None:
            self._drop_span(self.layout.sense)

    # -- the direction of the tool ------------------------------------------------------------------------------------

    def _turning(self) -> tuple[int, ...]:
        """The columns of the rotary axes that a vector says where to turn; none without one."""
        pointing = self.target.pointing
        return pointing.columns if self.layout.vector and pointing is not None else ()

    def _direction(self, position: FloatArray, end: FloatArray) -> None:
        """Put TX TY TZ right, and `position` where they take the rotary axes."""
        target, pointing = self.target, self.target.pointing
        assert pointing is not None
        turning = list(pointing.columns)
        vector = self._pointed(target.nominal)
        if (np.abs(end[turning] - target.nominal[turning]) >= self.half[turning]).any() or len(target.ends) > 1:
            vector = self._pointed(end)
            for (address, word), part in zip(sorted(self.layout.vector.items()), vector, strict=True):
                assert address[0] == "T"
                self._rewrite(word, float(part), VECTOR_DIGITS)
            vector = np.round(vector, VECTOR_DIGITS)
            near = math.radians(end[turning[0]]), math.radians(end[turning[1]])
            outer, inner = pointing.angles(self._rotation() @ vector / float(np.linalg.norm(vector)), near)[0]
            position[turning] = math.degrees(outer), math.degrees(inner)
        else:
            position[turning] = target.nominal[turning]

    def _rotation(self) -> FloatArray:
        assert self.target.rotation is not None
        return self.target.rotation

    def _pointed(self, end: FloatArray) -> FloatArray:
        """The direction of the tool at a position, in the program's coordinates."""
        assert self.target.pointing is not None
        found: FloatArray = self._rotation().T @ self.target.pointing.direction(np.radians(end))
        return found

    def _further_direction(self, position: FloatArray, end: FloatArray) -> list[str]:
        """TX TY TZ of a further piece; its normal is that of the block."""
        pointing = self.target.pointing
        assert pointing is not None
        turning = list(pointing.columns)
        vector = np.round(self._pointed(end), VECTOR_DIGITS)
        near = math.radians(end[turning[0]]), math.radians(end[turning[1]])
        outer, inner = pointing.angles(self._rotation() @ vector / float(np.linalg.norm(vector)), near)[0]
        position[turning] = math.degrees(outer), math.degrees(inner)
        normals = [w for w in self.program.items_of(self.block) if isinstance(w, Word) and w.address[0] == "N"]
        kept = [self.program.slice(self.block, word.span) for word in normals if len(word.address) == 2]
        return kept + [
            f"T{letter}{self.style.number(float(part), VECTOR_DIGITS)}"
            for letter, part in zip("XYZ", vector, strict=True)
        ]

    # -- blocks -------------------------------------------------------------------------------------------------------

    def _line(self, words: list[str]) -> None:
        self.out.lines.append(self._prefix() + self.layout.blank.join(words))

    def _line_end(self) -> str:
        return self.program.line_end.decode()

    def _prefix(self) -> str:
        """What stands before the function: the block number, which inserted blocks repeat, and its blanks."""
        start = int(self.program.blocks[self.block, 0])
        at = self.program.position(self.block, self.layout.starts_at)
        text = self.program.source[start:at].decode("latin-1")
        if self.program.dialect.block_numbers == "none":
            text = re.sub(r"\d+[ \t]*", "", text)
        return "" if "\n" in text else text

    def _move_late_codes(self) -> None:
        """What acts at the end of the block goes to its last piece."""
        if len(self.target.ends) < 2:
            return
        for word in self.layout.late:
            text = self.program.slice(self.block, word.span)
            self._drop(word)
            self.out.lines[-1] += self.layout.blank + text

    # -- text ---------------------------------------------------------------------------------------------------------

    def _function(self, name: str) -> None:
        span = self.layout.function
        if span is not None and self.program.slice(self.block, span).upper() != name:
            self.out.edits.append((*self.program.span(self.block, span), name))

    def _number(self, value: float, column: int) -> str:
        return self.style.number(value, int(self.target.decimals[column]))

    def _rewrite(self, word: Word, value: float, decimals: int) -> float:
        """Give a word another value in its own style; a formula gives way to a number. Returns what is written."""
        start, stop = self.program.span(self.block, word.value_span)
        was = self.program.source[start:stop].decode("latin-1")
        literal = isinstance(word.value, Literal)
        text = self.style.like(was, value, decimals) if literal else self.style.number(value, decimals)
        self.out.edits.append((start, stop, text))
        return value_of(text)

    def _drop(self, *words: Word | None) -> None:
        for word in words:
            if word is not None:
                self._drop_span(word.span)

    def _drop_span(self, span: Span) -> None:
        start, stop = self.program.span(self.block, span)
        while self.program.source[start - 1 : start] in (b" ", b"\t") and start > self.program.blocks[self.block, 0]:
            start -= 1
        self.out.edits.append((start, stop, ""))
