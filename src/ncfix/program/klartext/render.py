"""The text of one corrected motion in Klartext: edits of its own block, and the blocks that come before and after it.

A word is rewritten only when its value moves by half an output step. What relies on a pole or on the element before it
(LP, CP, CT) is said anew in Cartesian words; arcs are put into words by `arc_text`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ncfix.program.klartext.arc_text import ArcText, PieceOfArc, arc_text
from ncfix.program.klartext.cycles import BY_DEPTH, FROM_START
from ncfix.program.klartext.layout import Layout, poles_move, tilts
from ncfix.program.klartext.number_text import Style, value_of
from ncfix.program.layout import AXIS_LETTERS
from ncfix.program.target import Rendered, Target
from ncfix.program.tree import Literal, Program, Span, Word

FloatArray = NDArray[np.float64]

STRAIGHT = frozenset({"", "l", "ln", "lp"})
BY_PATH = frozenset({"c", "ct", "ctp", "cp", "lp"})
"""Functions whose meaning depends on where the tool stands or comes from, or on a pole."""

SAID_BY_WORDS = ("", "l", "ln", "ct", "ctp")
"""Functions that are always gone through: by their words alone, or by the direction that they come from."""

CLOCKWISE = 20
VECTOR_DIGITS = 7
"""Of components of a direction: 1e-7 rad is 6e-6 degrees; the control takes eight."""
EXACT = 1e-9


def render(program: Program, block: int, layout: Layout, target: Target) -> Rendered:
    """Write a motion."""
    return Renderer(program, block, layout, target).render()


class Renderer:
    """Renders one motion of one block. A short-lived worker: `render()` is called once."""

    def __init__(self, program: Program, block: int, layout: Layout, target: Target) -> None:
        self.program = program
        self.block = block
        self.layout = layout
        self.target = target
        self.out = Rendered()
        self.half = 0.5 * 10.0 ** -target.decimals.astype(float)
        self.columns = sorted(enumerate(target.letters), key=lambda each: AXIS_LETTERS.index(each[1]))
        self.style = Style(layout.comma)
        self.added: list[str] = []
        self.own_pole = False

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
                position = self._further_line(position, target.ends[piece])
            self.out.ends.append(position)
        self._move_late_codes()
        if self.own_pole:
            self.out.lines.append(self._prefix() + self._old_pole())

    # -- what need not change -----------------------------------------------------------------------------------------

    def _as_it_is(self) -> bool:
        """The block says well enough what is wanted, and nothing that it relies on has moved."""
        target, name = self.target, self.layout.name
        if name in SAID_BY_WORDS or name.startswith(("appr", "dep")) or len(target.ends) > 1:
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

    def _straightened(self) -> None:
        """What is not straight by its words becomes an L, and an approach in polar words a Cartesian one."""
        name = self.layout.name
        if not name.startswith("dep"):
            self._function(name.upper().replace(" P", " ") if name.startswith("appr") else "L")
        self._drop(*self.layout.polar, None if name.startswith(("appr", "dep")) else self.layout.radius)
        if self.layout.sense is not None:
            self._drop_span(self.layout.sense)

    def _further_line(self, position: FloatArray, end: FloatArray) -> FloatArray:
        position = position.copy()
        words = ["L" if not self.layout.vector else "LN"]
        for column, letter in self.columns:
            bare = letter not in self.layout.axes and self._left_alone(column)
            if column in self._turning() or bare or not abs(end[column] - position[column]) >= self.half[column]:
                continue
            text = self._number(float(end[column]), column)
            words.append(letter + text)
            position[column] = value_of(text)
        if self.layout.vector:
            words += self._further_direction(position, end)
        if self.layout.rapid:
            words.append("FMAX")
        self._line(words)
        return position

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

        A rotary axis in a program with tilted planes: the control would not keep the tip where it is. The tool axis
        beside a corner that the control makes, which lies in the working plane, and in a departure.
        """
        layout, target = self.layout, self.target
        if target.rotary and target.rotary[column]:
            turned = any(letter in layout.axes for letter in "ABC")
            return not turned and tilts(self.program.source)
        return (layout.corner or layout.name.startswith("dep")) and column == target.spatial[2]

    def _present(self, position: FloatArray, column: int, end: float, word: Word) -> None:
        base = float(position[column]) if word.address[0] == "I" else 0.0
        original = float(self.target.nominal[column]) - base
        if isinstance(word.value, Literal):
            original = float(self.program.values_of(self.block)[word.value.slot])
        value = end - base
        whole = len(self.target.ends) == 1
        if np.isfinite(value) and (not whole or abs(value - original) >= self.half[column]):
            original = self._rewrite(word, value, int(self.target.decimals[column]))
        position[column] = base + original

    def _absent(self, position: FloatArray, column: int, end: float, always: bool) -> None:
        if not np.isfinite(end) or (not always and abs(end - position[column]) < self.half[column]):
            return
        text = self._number(end, column)
        self.added.append(self.layout.blank + self.target.letters[column] + text)
        position[column] = value_of(text)

    # -- cycles -------------------------------------------------------------------------------------------------------

    def _over_the_hole(self) -> None:
        """The position over a hole; its depth is left as it is."""
        target = self.target
        across = target.spatial[2]
        position = target.start.copy()
        polar = self._polar_columns()
        for column, letter in self.columns:
            word = self.layout.axes.get(letter)
            if column == across:
                position[column] = self._bottom(across)
            elif word is not None:
                self._present(position, column, target.ends[0][column], word)
            elif not self._left_alone(column):
                self._absent(position, column, target.ends[0][column], column in polar)
        if polar:
            self._straightened()
        self.out.ends.append(position)

    def _bottom(self, across: int) -> float:
        """Where the hole ends: as its depth says, or as far below the start as it was meant to be.

        Of holes one after another the start is given as the bottom of the one before.
        """
        target, word = self.target, self.layout.axes.get("Z")
        lower = float(target.nominal[across])
        if target.code != FROM_START or (word is not None and word.address[0] != "I"):
            return lower
        depth, shift = float(target.origin[2]) - lower, float(target.start[across] - target.origin[2])
        return lower + (shift + depth if abs(shift) > abs(depth) / 2 else shift)

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
        result = end.copy()
        for column, letter in self.columns:
            word = self.layout.axes.get(letter) if own else None
            base = float(begin[column]) if word is not None and word.address[0] == "I" else 0.0
            result[column] = base + round(float(end[column]) - base, int(self.target.decimals[column]))
            if word is not None and isinstance(word.value, Literal):
                original = base + float(self.program.values_of(self.block)[word.value.slot])
                if abs(end[column] - original) < self.half[column]:
                    result[column] = original
        return result

    def _own_arc(self, centre: FloatArray) -> FloatArray:
        """The block itself as an arc."""
        target, layout = self.target, self.layout
        found = arc_text(self._piece_of_arc(target.start, 0, centre), self.style)
        columns = tuple(target.spatial[index] for index in target.plane[:2])
        named = columns if layout.polar or found.function == "C" else ()
        position = self._words(found.end, named, columns if found.function == "CP" else ())
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

    def _radius(self, found: ArcText) -> None:
        """The R word of CR."""
        word = self.layout.radius
        if found.function != "CR":
            self._drop(word)
            return
        (text,) = found.words
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

    def _pole(self, found: ArcText) -> str:
        return "CC" + "".join(self.layout.blank + text for text in found.pole)

    def _old_pole(self) -> str:
        """The pole that was in force, which later blocks may rely on."""
        target = self.target
        pairs = sorted((index, float(target.original_centre[index])) for index in target.plane[:2])
        return "CC" + "".join(
            f"{self.layout.blank}{'XYZ'[index]}{self.style.number(value, 4)}" for index, value in pairs
        )

    # -- blocks -------------------------------------------------------------------------------------------------------

    def _line(self, words: list[str]) -> None:
        self.out.lines.append(self._prefix() + self.layout.blank.join(words))

    def _line_end(self) -> str:
        return "\r\n" if b"\r\n" in self.program.source else "\n"

    def _prefix(self) -> str:
        """What stands before the function: the block number, which inserted blocks repeat, and its blanks."""
        start = int(self.program.blocks[self.block, 0])
        at = self.program.position(self.block, self.layout.starts_at)
        text = self.program.source[start:at].decode("latin-1")
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
