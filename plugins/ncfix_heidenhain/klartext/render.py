"""The text of one corrected motion in Klartext: edits of its own block, and the blocks that come before and after it.

A word is rewritten only when its value moves by half an output step. What relies on a pole or on the element before it
(LP, CP, CT) is said anew in Cartesian words; arcs are put into words by `arc_text`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.control.arcs import CLOCKWISE
from ncfix.text.spelling import value_of
from ncfix.text.tree import Literal, Program
from ncfix.writer.target import Rendered, Target
from ncfix_heidenhain.klartext.arc_text import POLE_DIGITS, ArcText, PieceOfArc, arc_text
from ncfix_heidenhain.klartext.control import BY_DEPTH, FROM_START
from ncfix_heidenhain.klartext.holes_text import HoleWriter
from ncfix_heidenhain.klartext.layout import KlartextLayout, poles_move
from ncfix_heidenhain.klartext.poles import is_relied_on, pole_in_force

FloatArray = NDArray[np.float64]

STRAIGHT = frozenset({"", "l", "ln", "lp"})
BY_PATH = frozenset({"c", "ct", "ctp", "cp", "lp"})
"""Functions whose meaning depends on where the tool stands or comes from, or on a pole."""

SAID_BY_WORDS = ("", "l", "ln", "ct", "ctp")
"""Functions that are always gone through: by their words alone, or by the direction that they come from."""

WHICH_POLE = "the arc needs a pole of its own, and which one was in force before it the text does not tell"
NEAR = 3.0
"""Half output steps: no more lies between the ends of a full circle, which are one point before they are rounded."""
NOT_CLOSED = "the full circle begins at a place that its own words have too few digits to name"
CLOSED, EXACT = 1e-6, 1e-9
"""Program units: an arc whose ends are nearer is a full circle, and positions that are nearer are the same."""


def render(program: Program, block: int, layout: KlartextLayout, target: Target) -> Rendered:
    """Write a motion."""
    return Renderer(program, block, layout, target).render()


class Renderer(HoleWriter):
    """Renders one motion of one block. A short-lived worker: `render()` is called once."""

    def render(self) -> Rendered:
        """Write the motion."""
        target = self.target
        if target.code in (BY_DEPTH, FROM_START):
            self._over_the_hole()
        elif self._as_it_is():
            self.out.ends.append(np.where(np.isnan(target.nominal), target.start, target.nominal))
            self.out.centre = target.original_centre
        else:
            self._write()
        if self.added:
            at = self.program.position(self.block, self.layout.words_at)
            self.out.edits.append((at, at, "".join(self.added)))
        self.out.edits.sort(key=lambda edit: edit[:2])
        return self.out

    def _write(self) -> None:
        target = self.target
        arcs = np.full(len(target.ends), target.arc) if target.arcs is None else target.arcs
        centres = target.centre[None] if target.centres is None else target.centres
        position = self._own_arc(centres[0]) if arcs[0] else self._own_line()
        self.out.ends.append(position)
        for piece in range(1, len(target.ends)):
            if arcs[piece]:
                position = self._further_arc(position, piece, centres[piece])
            else:
                position = self._further_line(position, piece)
            self.out.ends.append(position)
        self._move_late_codes()
        if not self.own_pole or not is_relied_on(self.program.source, int(self.program.blocks[self.block, 1])):
            return
        old_pole = self._old_pole()
        if old_pole is None:
            self.out.conflict = WHICH_POLE
        elif old_pole:
            self.out.lines.append(self._prefix() + old_pole)

    # -- what need not change -----------------------------------------------------------------------------------------

    def _as_it_is(self) -> bool:
        """The block says well enough what is wanted, and nothing that it relies on has moved."""
        target, name = self.target, self.layout.name
        if name in SAID_BY_WORDS or name.startswith(("appr", "dep")) or len(target.ends) > 1 or any(target.spelled):
            return False
        arc = name not in STRAIGHT
        if arc != target.arc or (np.abs(target.ends[0] - target.nominal) >= self.half).any():
            return False
        if arc and (np.abs(target.centre - target.original_centre) >= self.half[target.spatial[0]]).any():
            return False
        began = np.array([target.start[column] if column >= 0 else 0.0 for column in target.spatial])
        if (np.abs(began - target.origin) >= EXACT).any():
            return False
        return name not in BY_PATH or not poles_move(self.program.source)

    # -- straight pieces ----------------------------------------------------------------------------------------------

    def _own_line(self) -> FloatArray:
        """The block itself as a straight piece."""
        position = self._words(self.target.ends[0], self._polar_columns())
        if self.layout.vector:
            self._direction(position, self.target.ends[0])
        if self.layout.name not in ("", "l", "ln") or self.layout.polar:
            self._straightened()
        return position

    def _further_line(self, position: FloatArray, piece: int) -> FloatArray:
        position, end = position.copy(), self.target.ends[piece]
        words = ["L" if not self.layout.vector else "LN"]
        for column, letter in self.columns:
            bare = letter not in self.layout.axes and self._left_alone(column)
            if column in self._turning() or bare or not abs(end[column] - position[column]) >= self.half[column]:
                continue
            text = self._number(self._turned(column, float(end[column]), piece), column)
            words.append(letter + text)
            position[column] = value_of(text)
        if self.layout.vector:
            words += self._further_direction(position, end)
        if self.layout.rapid:
            words.append("FMAX")
        self._line(words)
        return position

    # -- arcs ---------------------------------------------------------------------------------------------------------

    def _piece_of_arc(self, begin: FloatArray, piece: int, centre: FloatArray) -> PieceOfArc:
        target = self.target
        turn = self.layout.turn(self.program, self.block)
        return PieceOfArc(
            begin=begin,
            end=self._as_written(begin, target.ends[piece], own=piece == 0),
            centre=centre,
            plane=target.plane,
            spatial=target.spatial,
            clockwise=target.arc_code == CLOCKWISE,
            turn=None if turn is None else turn * float(target.shares[piece]),
            decimals=target.decimals,
        )

    def _as_written(self, begin: FloatArray, end: FloatArray, *, own: bool) -> FloatArray:
        """An end on the digits that will be written; `own`: by the words of the block itself."""
        result, decimals, values = end.tolist(), self.target.decimals.tolist(), self.program.values_of(self.block)
        for column, letter in self.columns:
            word = self.layout.axes.get(letter) if own else None
            base = float(begin[column]) if word is not None and word.address[0] == "I" else 0.0
            result[column] = base + round(result[column] - base, decimals[column])
            if word is not None and isinstance(word.value, Literal):
                original = base + float(values[word.value.slot])
                if abs(result[column] - original) < self.half[column]:
                    result[column] = original
        return np.array(result)

    def _own_arc(self, centre: FloatArray) -> FloatArray:
        """The block itself as an arc."""
        target, layout = self.target, self.layout
        arc, closed = self._piece_of_arc(target.start, 0, centre), self._should_close()
        if closed:
            arc.end[arc.columns] = target.start[arc.columns]
        found = arc_text(arc, self.style)
        columns = tuple(target.spatial[index] for index in target.plane[:2])
        named = columns if layout.polar or found.function == "C" else ()
        position = self._words(found.end, named, columns if found.function == "CP" else ())
        if closed and (np.abs(position - target.start)[arc.columns] > EXACT).any():
            self.out.conflict = NOT_CLOSED
        self._function(" ".join([found.function, *found.words]) if found.function == "CP" else found.function)
        self._drop(*layout.polar)
        self._radius(found)
        if layout.sense is None:
            self.added.append(layout.blank + found.sense)
        if found.pole:
            start = int(self.program.blocks[self.block, 0])
            self.out.edits.append((start, start, self._prefix() + self._pole(found) + self._line_end()))
            self.own_pole = True
        self.out.centre = found.centre
        return position

    def _should_close(self) -> bool:
        """Whether the block is a full circle, and stays one: it has to end where it begins to the last digit."""
        target = self.target
        pairs = [(target.spatial[index], index) for index in target.plane[:2]]
        if len(target.ends) > 1 or any(column < 0 for column, _ in pairs):
            return False
        if any(abs(target.nominal[column] - target.origin[index]) >= CLOSED for column, index in pairs):
            return False
        return all(abs(target.ends[0, c] - target.start[c]) < NEAR * self.half[c] for c, _ in pairs)

    def _radius(self, arc: ArcText) -> None:
        """The R word of CR."""
        word = self.layout.radius
        if arc.function != "CR":
            self._drop(word)
            return
        (text,) = arc.words
        if word is None:
            self.added.append(self.layout.blank + text)
            return
        start, stop = self.program.span(self.block, word.value_span)
        if self.program.source[start:stop].decode("latin-1") != text[1:]:
            self.out.edits.append((start, stop, text[1:]))

    def _further_arc(self, position: FloatArray, piece: int, centre: FloatArray) -> FloatArray:
        target = self.target
        found = arc_text(self._piece_of_arc(position, piece, centre), self.style)
        columns = tuple(target.spatial[index] for index in target.plane[:2])
        position = position.copy()
        words = [found.function, *(found.words if found.function == "CP" else ())]
        for column, letter in self.columns:
            if column in columns and found.function == "CP":
                position[column] = found.end[column]
            elif self._left_alone(column) and letter not in self.layout.axes:
                continue
            elif column in columns or abs(found.end[column] - position[column]) >= self.half[column]:
                text = self._number(float(found.end[column]), column)
                words.append(letter + text)
                position[column] = value_of(text)
        if found.pole:
            self._line([self._pole(found)])
            self.own_pole = True
        self._line([*words, *(found.words if found.function == "CR" else ()), found.sense])
        self.out.centres[piece] = found.centre
        return position

    def _pole(self, arc: ArcText) -> str:
        return "CC" + "".join(self.layout.blank + text for text in arc.pole)

    def _old_pole(self) -> str | None:
        """The pole that was in force, which later blocks may rely on; empty if there was none, None if nobody knows."""
        target = self.target
        if self.layout.name not in ("c", "cp"):
            words = pole_in_force(self.program.source, int(self.program.blocks[self.block, 0]))
            return f"CC{self.layout.blank}{words}" if words else words
        digits = max(POLE_DIGITS, int(target.decimals[target.spatial[target.plane[0]]]))
        pairs = sorted((index, float(target.original_centre[index])) for index in target.plane[:2])
        return "CC" + "".join(
            f"{self.layout.blank}{'XYZ'[index]}{self.style.number(value, digits)}" for index, value in pairs
        )
