"""The text of one corrected motion: edits of its own block, and the lines of the pieces that follow it.

Everything here is in the numbers of the program: its units, its frame, degrees, diameters. A word is rewritten only
when its value moves by half an output step; a missing word is added only when its axis must stand elsewhere by as
much. What is returned as emitted is what the control will understand, digits and all.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ncfix.text.layout import CENTRE_LETTERS
from ncfix.text.tree import Word
from ncfix.writer.target import LINE, Rendered
from ncfix.writer.turn_words import TurnWriter

FloatArray = NDArray[np.float64]
#: F words of shares of a block in G93 keep the time of the block to this many decimals at least.
FEED_DECIMALS = 3
GRAIN = 1e-6
"""A number that is so much of an output step above a whole number of them is that number."""

STRAIGHT_AND_ARCS = (0, 10, 20, 30)
"""Motion codes, in tenths, that may be stated anew: G0 to G3."""

CLOSED, EXACT = 1e-6, 1e-9
"""Program units: an arc whose ends are nearer is a full circle, and positions that are nearer are the same."""
NEAR = 3.0
"""Half output steps: no more lies between the ends of a full circle, which are one point before they are rounded."""

FROM_NOWHERE = "an increment in turned coordinates, while where one of their axes stands is not known"
NO_TIME = "the block would become several, and in G93 no number behind its own F says how long it takes"


class BlockRenderer(TurnWriter):
    """Renders one motion of one block. A short-lived worker: `render()` is called once."""

    def render(self) -> Rendered:
        """Write the motion."""
        target = self.target
        position = self._first_piece(target.start.copy(), target.ends[0])
        self.out.ends.append(position)
        for piece in range(1, len(target.ends)):
            position = self._further_piece(position, piece)
            self.out.ends.append(position)
        if self.dragged:
            self._feed_as_before()
        self._move_late_words()
        if self.added:
            at = self.program.position(self.block, self.layout.words_at)
            self.out.edits.append((at, at, "".join(self.added)))
        self.out.edits.sort(key=lambda edit: edit[:2])
        return self.out

    # -- the block itself ---------------------------------------------------------------------------------------------

    def _first_piece(self, position: FloatArray, end: FloatArray) -> FloatArray:
        self._motion_code()
        base = position.copy()
        closed = self._closed(position, end)
        for column, letter in self.columns:
            word = self.layout.axes.get(letter)
            if closed[column]:
                self._stay(position, column, word)
            elif word is None:
                self._absent_axis(position, column, end[column])
            else:
                self._present_axis(position, column, end[column], word)
        if not (self.target.arc or self.layout.axes or self.added) and np.isfinite(self.target.original_centre).any():
            self.added += [self.layout.blank + word for word in self._named(position)]
        self._arc_words(base, position)
        self._level()
        if self.dragged:
            self._time_of_turn(base, position)
        elif self.target.inverse_time and len(self.target.ends) > 1:
            self._share_time()
        return position

    def _present_axis(self, position: FloatArray, column: int, end: float, word: Word) -> None:
        base = self._counted_from(position, column) if self.target.incremental else 0.0
        original = self._value(word, self.target.original[column])
        value = end - base
        whole = len(self.target.ends) == 1
        if np.isfinite(value) and (not whole or abs(value - original) >= self.half[column]):
            original = self._rewrite(word, value, int(self.target.decimals[column]))
        position[column] = base + original

    def _counted_from(self, position: FloatArray, column: int) -> float:
        """Where an increment counts from; in turned coordinates one axis that stands nowhere known hides them all."""
        if not np.isfinite(position[column]):
            self.out.conflict = self.out.conflict or FROM_NOWHERE
        return float(position[column])

    def _absent_axis(self, position: FloatArray, column: int, end: float) -> None:
        near = abs(end - position[column]) < self.half[column] and not self.target.must_name(column)
        still = near or not np.isfinite(end)
        if still or not self._has_words(column):
            return
        if self.layout.allowed is not None and self.target.letters[column] not in self.layout.allowed:
            return
        base = position[column] if self.target.incremental else 0.0
        text = f"{end - base:.{self.target.decimals[column]}f}"
        self._add(self.target.letters[column], text)
        position[column] = base + float(text)

    def _closed(self, position: FloatArray, end: FloatArray) -> NDArray[np.bool_]:
        """The axes of the plane of a full circle: it has to end where it starts to the last digit.

        An output step beside it, a control would make an arc of a thousandth of a degree of it.
        """
        target, closed = self.target, np.zeros(len(position), dtype=bool)
        if not target.arc or len(target.ends) > 1:
            return closed
        plane, nominal = [target.spatial[index] for index in target.plane[:2]], self._xyz(target.nominal)
        if -1 not in plane and all(abs(nominal[index] - target.origin[index]) < CLOSED for index in target.plane[:2]):
            closed[plane] = bool((np.abs(end - position)[plane] < NEAR * self.half[plane]).all())
        return closed

    def _stay(self, position: FloatArray, column: int, word: Word | None) -> None:
        """An axis that ends where it starts; a word that cannot say so to the last digit is left out."""
        if word is None:
            return
        start = float(position[column])
        self._present_axis(position, column, start, word)
        if abs(position[column] - start) > EXACT:
            first, last = self.program.span(self.block, word.span)
            self.out.edits = [edit for edit in self.out.edits if not first <= edit[0] < last]
            self._remove(word)
            position[column] = start

    def _motion_code(self) -> None:
        wanted, word = self.target.code, self.layout.motion
        if wanted not in STRAIGHT_AND_ARCS:
            return
        if word is not None:
            if round(self._value(word, np.nan) * 10) != wanted:
                self._rewrite(word, wanted / 10, 0)
        elif wanted != self.target.active_code:
            at = self.program.position(self.block, self.layout.code_at)
            self.out.edits.append((at, at, self._cased("G") + f"{wanted // 10}" + self.layout.blank))

    # -- canned cycles ------------------------------------------------------------------------------------------------

    def _level(self) -> None:
        """The level R of a canned cycle: its word, or one more where another level is in force."""
        level = self.target.level
        if level is None:
            return
        word = self.layout.levels.get(level.address)
        decimals, half, wanted = int(self.target.decimals[level.across]), self.half[level.across], level.wanted
        if wanted < level.least:
            wanted = float(np.ceil(level.least / (2 * half) - GRAIN) * 2 * half)
        self.out.level = level.before if word is None else self._value(word, level.nominal)
        if abs(wanted - self.out.level) < half and not self.out.level < level.least - 2 * GRAIN * half:
            return
        if word is not None:
            self.out.level = self._rewrite(word, wanted, decimals)
        else:
            text = f"{wanted:.{decimals}f}"
            self._add(level.address, text)
            self.out.level = float(text)

    # -- arcs ---------------------------------------------------------------------------------------------------------

    def _arc_words(self, start: FloatArray, end: FloatArray) -> None:
        if self.target.arc:
            self._kept_arc(start, end)
            return
        words = [*self.layout.centre.values(), self.layout.radius, self.layout.turns]
        if any(words) and np.isfinite(self.target.original_centre).any():
            for word in filter(None, words):
                self._remove(word)

    def _kept_arc(self, start: FloatArray, end: FloatArray) -> None:
        """Centre words of an arc that stays one; an R that no longer says which centre is meant gives way to I J K."""
        target = self.target
        centre = target.centre.copy()
        word, whole = self.layout.radius, len(target.ends) == 1
        if self.layout.turns is not None and not whole:
            self._remove(self.layout.turns)
        if word is not None:
            meant = self._centre_by_radius(word, start, end) if whole else None
            if meant is not None:
                self.out.centre = meant
                return
            self._remove(word)
        base = np.zeros(3) if target.centre_absolute else self._xyz(start)
        for index in target.plane[:2]:
            centre[index] = self._centre_word(index, float(base[index]), word is None)
        self.out.centre = centre

    def _centre_word(self, index: int, base: float, had_centre: bool) -> float:
        target = self.target
        column = target.spatial[index]
        original_base = 0.0 if target.centre_absolute else target.origin[index]
        value = target.centre[index] - base
        original = target.original_centre[index] - original_base
        word = self.layout.centre.get(CENTRE_LETTERS[index])
        if word is not None:
            original = self._value(word, original)
            if abs(value - original) >= self.half[column]:
                original = self._rewrite(word, value, int(target.decimals[column]))
        elif abs(value - (original if had_centre else 0.0)) >= self.half[column]:
            text = f"{value:.{target.decimals[column]}f}"
            self._add(CENTRE_LETTERS[index], text)
            original = float(text)
        elif not had_centre:
            original = 0.0
        return float(base + original)

    def _centre_by_radius(self, word: Word, start: FloatArray, end: FloatArray) -> FloatArray | None:
        """The centre that the radius as written means, if that is within an output step of where it belongs."""
        plane = list(self.target.plane[:2])
        radius = abs(self._value(word, np.nan))
        (x, y), (u, v), (a, b) = (
            point[plane].tolist() for point in (self._xyz(start), self._xyz(end), self.target.centre)
        )
        half_chord = float(np.hypot(u - x, v - y)) / 2
        if not radius > half_chord > 0:
            return None
        height = math.sqrt(radius**2 - half_chord**2)
        rise = height * -(v - y) / (2 * half_chord), height * (u - x) / (2 * half_chord)
        sides = [((x + u) / 2 + side * rise[0], (y + v) / 2 + side * rise[1]) for side in (1, -1)]
        off = [float(np.hypot(p - a, q - b)) for p, q in sides]
        nearest = sides[0] if not off[1] < off[0] else sides[1]
        if min(off) > 2 * self.half[self.target.spatial[plane[0]]]:
            return None
        centre = self.target.centre.copy()
        centre[plane] = nearest
        return centre

    def _xyz(self, position: FloatArray) -> FloatArray:
        """X Y Z of a position in the numbers in which centres are meant."""
        values = np.array([position[column] if column >= 0 else 0.0 for column in self.target.spatial])
        if self.target.diameter:
            values[0] /= 2
        return values

    # -- further pieces -----------------------------------------------------------------------------------------------

    def _further_piece(self, position: FloatArray, piece: int) -> FloatArray:
        target = self.target
        end = target.ends[piece]
        begin, position = position, position.copy()
        arc = target.arcs is not None and bool(target.arcs[piece])
        words = self._code_of_piece(target.arc_code if arc else LINE)
        in_plane = [target.spatial[index] for index in target.plane[:2]] if arc else []
        for column, letter in self.columns:
            still = not abs(end[column] - position[column]) >= self.half[column] and column not in in_plane
            if still or not self._has_words(column):
                continue
            base = position[column] if target.incremental else 0.0
            text = f"{end[column] - base:.{target.decimals[column]}f}"
            words.append(self._cased(letter) + text)
            position[column] = base + float(text)
        words += self._further_words(position, end)
        if arc:
            words += self._centre_of_piece(piece, begin)
        if self.dragged:
            words.append(self._cased("F") + self._turn_feed(piece, begin, position))
        elif target.inverse_time and not self.out.conflict:
            words.append(self._cased("F") + f"{self._feed_share(piece):.{FEED_DECIMALS}f}")
        prefix = self.program.slice(self.block, self.layout.prefix) if self.layout.prefix else ""
        self.out.lines.append(prefix + (self.layout.blank).join(words))
        return position

    def _named(self, position: FloatArray) -> list[str]:
        """A word for where an axis stands: the first line of what was an arc is a motion, even if it goes nowhere."""
        named = [each for each in self.columns if self._has_words(each[0]) and np.isfinite(position[each[0]])]
        return [
            self._cased(letter)
            + f"{0.0 if self.target.incremental else position[column]:.{self.target.decimals[column]}f}"
            for column, letter in named[:1]
        ]

    def _has_words(self, column: int) -> bool:
        """Whether an axis is told where to go by a word of its own."""
        return self.target.may_name(column)

    def _further_words(self, position: FloatArray, end: FloatArray) -> list[str]:
        """Words of a further piece besides those of axes; what they move is put into `position`."""
        return []

    def _code_of_piece(self, wanted: int) -> list[str]:
        """The motion code of a further piece, where pieces are arcs and lines and the one before was the other."""
        if self.target.arcs is None or wanted == self.code:
            return []
        self.code = wanted
        return [self._cased("G") + f"{wanted // 10}"]

    def _centre_of_piece(self, piece: int, begin: FloatArray) -> list[str]:
        """The centre words of a further piece that is an arc."""
        target, words = self.target, []
        assert target.centres is not None
        centre = target.centres[piece].copy()
        base = np.zeros(3) if target.centre_absolute else self._xyz(begin)
        for index in target.plane[:2]:
            text = f"{centre[index] - base[index]:.{target.decimals[target.spatial[index]]}f}"
            words.append(self._cased(CENTRE_LETTERS[index]) + text)
            centre[index] = base[index] + float(text)
        self.out.centres[piece] = centre
        return words

    def _share_time(self) -> None:
        """In G93 the pieces of a block take shares of its time, which its own F has to say in a plain number."""
        if self.layout.feed is None or not math.isfinite(self._feed_share(0)):
            self.out.conflict = NO_TIME
        else:
            self._rewrite(self.layout.feed, self._feed_share(0), FEED_DECIMALS)

    def _feed_share(self, piece: int) -> float:
        assert self.layout.feed is not None
        return self._value(self.layout.feed, np.nan) / float(self.target.shares[piece])

    # -- what belongs after the motion --------------------------------------------------------------------------------

    def _move_late_words(self) -> None:
        """M0, M1, M2, M30 and their like act after the motion: with several pieces they go to the last."""
        if not self.out.lines:
            return
        for word in self.layout.after:
            text = self.program.slice(self.block, word.span)
            self._remove(word)
            self.out.lines[-1] += self.layout.blank + text
