"""The text of one corrected motion in SINUMERIK: `X=`, `X=AC(..)`, CR=, AR=, CIP, AP= and RP=, packed words."""

from __future__ import annotations

import math
import re

import numpy as np
from numpy.typing import NDArray

from ncfix.control.pointing import Pointing
from ncfix.text.layout import CENTRE_LETTERS
from ncfix.text.spelling import NumberStyle
from ncfix.text.tree import FunctionCall, Literal, Word
from ncfix.writer.render import BlockRenderer
from ncfix.writer.target import TANGENTIAL
from ncfix_siemens.sinumerik.circles import VIA, circle_through
from ncfix_siemens.sinumerik.destination import turned
from ncfix_siemens.sinumerik.layout import SinumerikLayout
from ncfix_siemens.sinumerik.vocabulary import ABSOLUTE, FORMS, INCREMENTAL, MOTIONS, VECTOR

FloatArray = NDArray[np.float64]

FORM = re.compile(r"\s*(?P<form>[A-Z]+)\s*\(\s*(?P<value>.*?)\s*\)\s*\Z", re.IGNORECASE | re.DOTALL)
CIP = MOTIONS["cip"]
ARCS = frozenset({20, 30})
VECTOR_DECIMALS = 7
"""Of components of a direction: 1e-7 rad is 6e-6 degrees."""


class SinumerikRenderer(BlockRenderer):
    """Renders one motion of one block."""

    layout: SinumerikLayout

    # -- axes ---------------------------------------------------------------------------------------------------------

    def _first_piece(self, position: FloatArray, end: FloatArray) -> FloatArray:
        if self.layout.polar and self._polar_stays(end):
            kept = super()._first_piece(position, np.where(self._plane_columns(), position, end))
            return np.where(self._plane_columns(), self.target.nominal, kept)
        for word in self.layout.polar.values():
            self._remove(word)
        position = super()._first_piece(position, end)
        if self.layout.polar and not self.added and not self.layout.axes:
            self._stay_in_words(position)
        if self.layout.points:
            self._turned_tool(position, end)
        return position

    def _stay_in_words(self, position: FloatArray) -> None:
        """A motion that leads nowhere keeps a word, since the modal code alone moves nothing."""
        column = self.target.letters.index("X")
        self._add("X", f"{0.0 if self.target.incremental else position[column]:.{self.target.decimals[column]}f}")

    def _polar_stays(self, end: FloatArray) -> bool:
        if self.layout.partial_polar or self.target.code in ARCS:
            return False
        near = np.abs(end - self.target.nominal) < self.half
        return len(self.target.ends) == 1 and bool(near[self._plane_columns()].all())

    def _plane_columns(self) -> NDArray[np.bool_]:
        """The columns that no word of the block names while it has polar coordinates."""
        return np.array([letter in "XYZ" and letter not in self.layout.axes for letter in self.target.letters])

    def _present_axis(self, position: FloatArray, column: int, end: float, word: Word) -> None:
        form = self._form(word)
        if not form:
            super()._present_axis(position, column, end, word)
        elif form in (ABSOLUTE, INCREMENTAL):
            self._formed(position, column, end, word, 0.0)
        else:
            start = float(position[column])
            self._formed(position, column, end, word, float(np.floor(end / 360.0 + 1e-12)) * 360.0)
            if abs(arrival(form, start, float(position[column])) - position[column]) > 180.0:
                position[column] = self._by_increment(start, column, end, word)

    def _formed(self, position: FloatArray, column: int, end: float, word: Word, turns: float) -> None:
        """A word that says how it is meant; `turns`, in degrees, are not written."""
        incremental = self._form(word) == INCREMENTAL
        base = self._counted_from(position, column) if incremental else turns
        if not np.isfinite(base):
            return
        value, written = end - base, self._value(word, np.nan if incremental else self.target.nominal[column] - turns)
        if len(self.target.ends) > 1 or not abs(value - written) < self.half[column]:
            written = self._rewrite(word, value, int(self.target.decimals[column]))
        position[column] = base + written

    def _by_increment(self, start: float, column: int, end: float, word: Word) -> float:
        """Where a rotary axis stands after IC instead of DC, ACP or ACN, which would lead it the other way round."""
        first, last = self.program.span(self.block, word.value_span)
        self.out.edits = [edit for edit in self.out.edits if not first <= edit[0] < last]
        text = f"{end - start:.{self.target.decimals[column]}f}"
        self.out.edits.append((first, last, f"{self._cased(INCREMENTAL.upper())}({text})"))
        return start + float(text)

    def _has_words(self, column: int) -> bool:
        """With a vector for the direction of the tool, rotary axes have no words of their own."""
        return super()._has_words(column) and not (self.layout.points and self.target.rotary[column])

    # -- the direction of the tool ------------------------------------------------------------------------------------

    def _turned_tool(self, position: FloatArray, end: FloatArray) -> None:
        """The vector of the first piece if it is another, and where the rotary axes then stand, as the control will.

        It also takes the place of angles.
        """
        turning = np.array(self.target.rotary)
        if len(self.target.ends) == 1 and np.all(np.abs(end - self.target.nominal)[turning] < self.half[turning]):
            position[turning] = self.target.nominal[turning]
            return
        for angle in self.layout.angles.values():
            self._remove(angle)
        for address, value in zip(VECTOR, self._vector(end), strict=True):
            word = self.layout.vector.get(address)
            if word is not None:
                self._rewrite(word, value, VECTOR_DECIMALS)
            elif abs(value) >= 0.5 * 10.0**-VECTOR_DECIMALS:
                self.added.append(f"{self.layout.blank or ' '}{address}={value:.{VECTOR_DECIMALS}f}")
        self._settle_turn(position, end)

    def _vector(self, end: FloatArray) -> list[float]:
        """The direction of the tool at an end, in the program's coordinates, as it is written."""
        pointing, rotation, offset = self._way_of_tool()
        direction = rotation.T @ pointing.direction(np.radians(end) + offset)
        return [round(float(part), VECTOR_DECIMALS) for part in direction]

    def _settle_turn(self, position: FloatArray, end: FloatArray) -> None:
        """Put the rotary axes of `position` where the written vector takes them."""
        pointing, rotation, offset = self._way_of_tool()
        vector = np.array(self._vector(end))
        outer, inner = (math.radians(float(position[column])) + float(offset[column]) for column in pointing.columns)
        ways = pointing.angles(rotation @ (vector / np.linalg.norm(vector)), (outer, inner))
        for column, angle in zip(pointing.columns, ways[0], strict=True):
            position[column] = math.degrees(angle - float(offset[column]))

    def _way_of_tool(self) -> tuple[Pointing, FloatArray, FloatArray]:
        target = self.target
        assert target.pointing is not None
        assert target.rotation is not None
        assert target.offset is not None
        return target.pointing, target.rotation, target.offset

    def _further_words(self, position: FloatArray, end: FloatArray) -> list[str]:
        """The direction of the tool in a further piece."""
        if not self.layout.points:
            return []
        vector = self._vector(end)
        self._settle_turn(position, end)
        return [f"{address}={value:.{VECTOR_DECIMALS}f}" for address, value in zip(VECTOR, vector, strict=True)]

    # -- numbers in brackets ------------------------------------------------------------------------------------------

    def _form(self, word: Word) -> str:
        """How the word is meant, if it says so: `ac`, `ic`, `dc`, ..."""
        return word.value.name if isinstance(word.value, FunctionCall) and word.value.name in FORMS else ""

    def _value(self, word: Word, otherwise: float) -> float:
        if self._form(word):
            assert isinstance(word.value, FunctionCall)
            inner = word.value.arguments[0] if word.value.arguments else None
            if isinstance(inner, Literal):
                return float(self.program.values_of(self.block)[inner.slot])
            return otherwise
        return super()._value(word, otherwise)

    def _rewrite(self, word: Word, value: float, decimals: int) -> float:
        start, stop = self.program.span(self.block, word.value_span)
        found = FORM.match(self.program.source[start:stop].decode("latin-1")) if self._form(word) else None
        if found is None:
            return super()._rewrite(word, value, decimals)
        inner = found["value"]
        literal = bool(re.fullmatch(r"[-+]?\d*\.?\d*", inner)) and any(each.isdigit() for each in inner)
        text = (NumberStyle.of(inner) if literal else NumberStyle()).write(value, decimals)
        self.out.edits.append((start + found.start("value"), start + found.end("value"), text))
        return float(text)

    # -- codes and arcs -----------------------------------------------------------------------------------------------

    def _motion_code(self) -> None:
        wanted, word = TANGENTIAL.get(self.target.code, self.target.code), self.layout.motion
        if word is None and wanted != self.target.code:
            at = self.program.position(self.block, self.layout.code_at)
            self.out.edits.append((at, at, self._cased("G") + f"{wanted // 10}{self.layout.blank}"))
        elif word is not None and word.address != "G" and wanted != CIP:
            self.out.edits.append((*self.program.span(self.block, word.span), self._cased("G") + f"{wanted // 10}"))
        elif wanted == CIP and word is None and self.target.active_code != CIP:
            at = self.program.position(self.block, self.layout.code_at)
            self.out.edits.append((at, at, "CIP "))
        else:
            super()._motion_code()

    def _arc_words(self, start: FloatArray, end: FloatArray) -> None:
        if not self.target.arc:
            for word in (*self.layout.via.values(), self.layout.angle):
                if word is not None:
                    self._remove(word)
        super()._arc_words(start, end)

    def _kept_arc(self, start: FloatArray, end: FloatArray) -> None:
        if self.layout.via:
            self._via(start, end)
            return
        if self.layout.angle is not None:
            self._remove(self.layout.angle)
        super()._kept_arc(start, end)

    def _centre_word(self, index: int, base: float, had_centre: bool) -> float:
        """Centre words count from the start, but for those that say `AC`."""
        word = self.layout.centre.get(CENTRE_LETTERS[index])
        if word is None or self._form(word) != ABSOLUTE:
            bare = self.layout.angle is not None or bool(self.layout.polar) or self.target.code in TANGENTIAL
            return super()._centre_word(index, base, (had_centre and not bare) or word is not None)
        value, column = float(self.target.centre[index]), self.target.spatial[index]
        written = self._value(word, float(self.target.original_centre[index]))
        if abs(value - written) >= self.half[column]:
            written = self._rewrite(word, value, int(self.target.decimals[column]))
        return float(written)

    def _via(self, start: FloatArray, end: FloatArray) -> None:
        """The intermediate point of CIP, moved as the ends are."""
        target = self.target
        begin, finish = self._xyz(start), self._xyz(end)
        nominal_end = self._xyz(target.nominal)
        incremental = {address: self._is_incremental(word) for address, word in self.layout.via.items()}
        via = target.origin.copy()
        for index, address in enumerate(VIA):
            if address in self.layout.via:
                written = self._value(self.layout.via[address], np.nan)
                via[index] = written + (target.origin[index] if incremental[address] else 0.0)
        known = np.where(np.isfinite(via), via, target.origin)
        before, after = (float(np.linalg.norm(arm)) for arm in (known - target.origin, nominal_end - known))
        share = before / max(before + after, 1e-9)
        wanted = known + (1 - share) * (begin - target.origin) + share * (finish - nominal_end)
        for index, address in enumerate(VIA):
            wanted[index] = self._via_word(address, index, wanted, begin, incremental.get(address, False))
        circle = circle_through(tuple(begin), tuple(wanted), tuple(finish))
        self.out.centre = np.array(circle.centre)

    def _via_word(self, address: str, index: int, wanted: FloatArray, begin: FloatArray, incremental: bool) -> float:
        """One word of the intermediate point; what the control will read."""
        column = self.target.spatial[index]
        word = self.layout.via.get(address)
        if column < 0:
            return float(wanted[index])
        base = float(begin[index]) if incremental or (word is None and self.target.incremental) else 0.0
        value, digits = float(wanted[index]) - base, int(self.target.decimals[column])
        if word is not None:
            written = self._value(word, np.nan)
            if np.isfinite(written) and abs(written - value) < self.half[column]:
                return base + written
            return base + self._rewrite(word, value, digits)
        if abs(float(wanted[index]) - float(begin[index])) < self.half[column]:
            return float(begin[index])
        text = f"{value:.{digits}f}"
        self.added.append(f"{self.layout.blank or ' '}{address}={text}")
        return base + float(text)

    def _is_incremental(self, word: Word) -> bool:
        form = self._form(word)
        return form == INCREMENTAL or (not form and self.target.incremental)


def arrival(form: str, start: float, angle: float) -> float:
    """Where DC, ACP or ACN lead a rotary axis, degrees."""
    return math.degrees(turned(form, math.radians(start), math.radians(angle), known=math.isfinite(start)))
