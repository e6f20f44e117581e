"""The text of one corrected motion of the Fanuc family: as in RS274, and the direction of the tool as I J K (G43.5)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ncfix.text.layout import CENTRE_LETTERS, Layout
from ncfix.text.spelling import NumberStyle
from ncfix.text.tree import Literal, Program, Word
from ncfix.writer.render import BlockRenderer
from ncfix.writer.target import Rendered, Target

FloatArray = NDArray[np.float64]

STRAIGHT = (0, 10)
DECIMALS = 6
"""Of a component of a unit vector, at least: 1e-6 rad is 6e-5 degrees."""


def render(program: Program, block: int, layout: Layout, target: Target) -> Rendered:
    """The text of a corrected motion."""
    straight = target.code in STRAIGHT and not np.isfinite(target.original_centre).any()
    directed = target.pointing is not None and straight and bool(layout.centre)
    return (VectorRenderer if directed else BlockRenderer)(program, block, layout, target).render()


class VectorRenderer(BlockRenderer):
    """Renders one straight motion that has a vector; rotary axes have no words of their own there."""

    def _first_piece(self, position: FloatArray, end: FloatArray) -> FloatArray:
        position = super()._first_piece(position, end)
        turning = np.array(self.target.rotary)
        if len(self.target.ends) == 1 and (np.abs(end - self.target.nominal)[turning] < self.half[turning]).all():
            position[turning] = self.target.nominal[turning]
            return position
        for letter, value in zip(CENTRE_LETTERS, self._vector(end), strict=True):
            word = self.layout.centre.get(letter)
            if word is not None:
                self._component(word, value)
            elif value:
                self._add(letter, f"{value:.{self.digits}f}")
        self._turn(position, end)
        return position

    def _has_words(self, column: int) -> bool:
        return super()._has_words(column) and not self.target.rotary[column]

    def _further_words(self, position: FloatArray, end: FloatArray) -> list[str]:
        self._turn(position, end)
        pairs = zip(CENTRE_LETTERS, self._vector(end), strict=True)
        return [self._cased(letter) + f"{value:.{self.digits}f}" for letter, value in pairs]

    def _component(self, word: Word, value: float) -> None:
        """Give a component another value, with a decimal point: without one it might count thousandths."""
        start, stop = self.program.span(self.block, word.value_span)
        pointed = isinstance(word.value, Literal) and not word.value.pointless
        style = NumberStyle.of(self.program.source[start:stop].decode("latin-1")) if pointed else NumberStyle()
        self.out.edits.append((start, stop, style.write(value, self.digits)))

    @property
    def length(self) -> float:
        """The length of the vector as programmed."""
        words = self.layout.centre.values()
        size = math.hypot(*(value for word in words if math.isfinite(value := self._value(word, math.nan))))
        return size or 1.0

    @property
    def digits(self) -> int:
        """Decimals that say the direction well enough."""
        return max(DECIMALS - math.floor(math.log10(self.length)), 1)

    def _vector(self, end: FloatArray) -> list[float]:
        """The vector at an end, in the program's coordinates, as long as the one programmed, as it is written."""
        pointing, rotation, offset = self.target.pointing, self.target.rotation, self.target.offset
        assert pointing is not None
        assert rotation is not None
        assert offset is not None
        direction = np.linalg.solve(rotation, pointing.direction(np.radians(end) + offset))
        return [round(float(part) * self.length, self.digits) for part in direction]

    def _turn(self, position: FloatArray, end: FloatArray) -> None:
        """Put the rotary axes of `position` where the vector as written takes them."""
        pointing, rotation, offset = self.target.pointing, self.target.rotation, self.target.offset
        assert pointing is not None
        assert rotation is not None
        assert offset is not None
        outer, inner = (math.radians(float(end[column])) + float(offset[column]) for column in pointing.columns)
        vector = rotation @ np.array(self._vector(end))
        ways = pointing.angles(vector / np.linalg.norm(vector), (outer, inner))
        for column, angle in zip(pointing.columns, ways[0], strict=True):
            position[column] = math.degrees(angle - float(offset[column]))
