"""Writing corrected Klartext blocks: path functions and poles, the limits of rotary words, and holes.

A motion that depends on a pole or on the element before it (LP, CP, CT) is rewritten in Cartesian words; `arc_text`
writes arcs. Cycles of the 200s count their depth from a surface, Q203: it is moved for one hole and moved back. The old
cycles count their depth from where the tool stands, so that height is written in the block.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache

import numpy as np

from ncfix.arrays import Array
from ncfix.control.arcs import CLOCKWISE
from ncfix.text.spelling import MAX_ROUNDING_HALF_STEPS, Spelling, value_of
from ncfix.text.tree import Program, Word
from ncfix.writer.block import EQUALITY_TOLERANCE, BlockWriter
from ncfix.writer.target import Target
from ncfix_heidenhain.klartext.arc_text import POLE_DIGITS, ArcText, PieceOfArc, arc_text, is_relied_on, pole_in_force
from ncfix_heidenhain.klartext.control import BY_DEPTH, FROM_START
from ncfix_heidenhain.klartext.layout import STRAIGHT, TURN_DEGREES, KlartextLayout, poles_move, uses_comma
from ncfix_heidenhain.klartext.plans import VECTOR

BY_PATH = frozenset({"c", "ct", "ctp", "cp", "lp"})
"""Path functions whose meaning depends on a pole, or on where the tool comes from."""

SAID_BY_WORDS = ("", "l", "ln", "ct", "ctp")
"""Path functions whose words are always compared one by one with what is wanted: `_as_it_is` leaves them out."""

WHICH_POLE = "the arc needs a pole of its own, but the text does not show which pole was in force before it"
NOT_CLOSED = "the start of the full circle cannot be written with the digits of its own words"

SURFACE = "Q203"
"""The parameter of cycles of the 200s for the height of the surface."""

UNCORRECTED = 1e-9
"""Degrees by which an angle may differ through rounding of doubles alone: it counts as not corrected."""


def spelling_of(program: Program) -> Spelling:
    """How numbers are written: signed, with commas if the program has commas, TX TY TZ with 7 decimals."""
    return Spelling(
        signed=True,
        comma=uses_comma(program.source),
        trimmed=False,
        modal=False,
        all_blanks=True,
        vector=tuple(sorted(VECTOR)),
        vector_digits=7,
    )


class KlartextWriter(BlockWriter):
    """Writes one motion into one block.

    in_plane  columns of the two axes of the working plane
    named     columns of axes that get a word in any case, such as those whose polar words are replaced
    own_pole  a CC has been written before the block or before one of its pieces
    """

    layout: KlartextLayout

    def __init__(
        self, program: Program, block: int, layout: KlartextLayout, target: Target, spelling: Spelling
    ) -> None:
        super().__init__(program, block, layout, target, spelling)
        self.in_plane = tuple(target.spatial[index] for index in target.plane[:2])
        self.named = self.in_plane if layout.polar else ()
        self.own_pole = False

    def _write(self) -> None:
        target = self.target
        if target.code in (BY_DEPTH, FROM_START):
            self._over_the_hole()
            return
        if self._as_it_is():
            self.out.ends.append(np.where(np.isnan(target.nominal), target.start, target.nominal))
            self.out.centre = target.original_centre
            return
        super()._write()
        if self.own_pole and is_relied_on(self.program.source, int(self.program.blocks[self.block, 1])):
            old_pole = self._old_pole()
            if old_pole is None:
                self.out.conflict = WHICH_POLE
            elif old_pole:
                self.out.lines.append(self.prefix + old_pole)

    def _as_it_is(self) -> bool:
        """Whether the block can stay as it is: it leads where it should, and nothing that it depends on has moved."""
        target, name = self.target, self.layout.name
        if name in SAID_BY_WORDS or name.startswith(("appr", "dep")) or len(target.ends) > 1 or any(target.spelled):
            return False
        arc = name not in STRAIGHT
        if arc != target.arc or (np.abs(target.ends[0] - target.nominal) >= self.half).any():
            return False
        if arc and (np.abs(target.centre - target.original_centre) >= self.half[target.spatial[0]]).any():
            return False
        began = np.array([target.start[column] if column >= 0 else 0.0 for column in target.spatial])
        if (np.abs(began - target.origin) >= EQUALITY_TOLERANCE).any():
            return False
        return name not in BY_PATH or not poles_move(self.program.source)

    # -- words --------------------------------------------------------------------------------------------------------

    def _cased(self, address: str) -> str:
        return address

    def _must_name(self, column: int) -> bool:
        return column in self.named or super()._must_name(column)

    def _may_add(self, column: int) -> bool:
        """Whether an axis without a word may get one.

        No: a rotary axis that is not corrected and already stands where it should but for rounding, and the tool axis
        in a departure or beside a corner that the control makes, since that corner lies in the working plane.
        """
        layout = self.layout
        if self._is_rotary(column):
            if self._stands(column):
                return False
        elif (layout.corner or layout.name.startswith("dep")) and column == self.target.spatial[2]:
            return False
        return super()._may_add(column)

    def _is_rotary(self, column: int) -> bool:
        return bool(self.target.rotary) and self.target.rotary[column]

    def _stands(self, column: int) -> bool:
        """Whether a rotary axis starts, and stays in all pieces, where it should be but for rounding."""
        target = self.target
        ends, nominal = target.ends[:, column].tolist(), float(target.nominal[column])
        here = abs(ends[0] - float(target.start[column]))
        return here <= MAX_ROUNDING_HALF_STEPS * self.half[column] and all(
            abs(end - nominal) < UNCORRECTED for end in ends
        )

    def _reachable(self, column: int, end: float, piece: int = 0) -> float:
        """The position of an axis at the end of a piece; for a rotary axis as `on_its_side` limits it."""
        target = self.target
        if not self._is_rotary(column) or not np.isfinite(end):
            return end
        nominal = float(target.nominal[column])
        if piece < len(target.ends) - 1:
            done = float(target.shares[: piece + 1].sum())
            nominal = float(target.start[column]) * (1 - done) + nominal * done
        step = 10.0 ** -float(target.decimals[column])
        return on_its_side(self.program.source, target.letters[column], nominal, end, step)

    def _function(self, name: str) -> None:
        span = self.layout.function
        if span is not None and self.program.slice(self.block, span).upper() != name:
            self.out.edits.append((*self.program.span(self.block, span), name))

    def _motion_code(self) -> None:
        """Write the path function of a straight piece: L; approaches and departures keep theirs, in Cartesian form."""
        layout, name = self.layout, self.layout.name
        if name in ("", "l", "ln") and not layout.polar:
            return
        leads = name.startswith(("appr", "dep"))
        self._function(name.upper().replace(" P", " ") if leads else "L")
        for word in (*layout.polar, None if leads else layout.radius):
            self._remove(word)
        if layout.sense is not None:
            self._remove_span(layout.sense)

    def _arc_words(self, start: Array, end: Array) -> None:
        """Nothing: `_first_piece` writes arcs."""

    def _opening(self, wanted: int) -> list[str]:
        return ["LN" if self.layout.vector else "L"]

    def _direction_words(self, end: Array) -> list[str]:
        """The words NX NY NZ of the block, and TX TY TZ of a further piece."""
        normals = [w for w in self.program.items_of(self.block) if isinstance(w, Word) and w.address[0] == "N"]
        words = [self.program.slice(self.block, word.span) for word in normals if len(word.address) == 2]
        return words + super()._direction_words(end)

    # -- arcs ---------------------------------------------------------------------------------------------------------

    def _first_piece(self, position: Array, end: Array) -> Array:
        """Write the first piece into the block; an arc as C, CR or CP, with a CC before it where it needs one."""
        target, layout = self.target, self.layout
        if not target.arc:
            return super()._first_piece(position, end)
        closed = self._closed(position, end)[self.in_plane[0]]
        arc = self._piece_of_arc(position, 0, target.centre)
        if closed:
            arc.end[arc.columns] = target.start[arc.columns]
        found = arc_text(arc, self.spelling)
        self.named = self.in_plane if layout.polar or found.function == "C" else ()
        if found.function == "CP":
            self._axis_words(position, found.end, skipped=self.in_plane)
            for column in self.in_plane:
                position[column] = found.end[column]
                self._remove(layout.axes.get(target.letters[column]))
            self._function(" ".join([found.function, *found.words]))
        else:
            self._axis_words(position, found.end)
            self._function(found.function)
        if closed and (np.abs(position - target.start)[arc.columns] > EQUALITY_TOLERANCE).any():
            self.out.conflict = NOT_CLOSED
        for word in layout.polar:
            self._remove(word)
        self._radius(found)
        if layout.sense is None:
            self.added.append(layout.blank + found.sense)
        if found.pole:
            self._line_before(self._pole(found))
            self.own_pole = True
        self.out.centre = found.centre
        return position

    def _further_piece(self, position: Array, piece: int) -> Array:
        target = self.target
        if target.arcs is None or not target.arcs[piece]:
            return super()._further_piece(position, piece)
        assert target.centres is not None
        found = arc_text(self._piece_of_arc(position, piece, target.centres[piece]), self.spelling)
        position, helix = position.copy(), found.function == "CP"
        words = [found.function, *(found.words if helix else ())]
        for column, letter in self.columns:
            if column in self.in_plane and helix:
                position[column] = found.end[column]
            elif letter not in self.layout.axes and not self._may_add(column):
                continue
            elif column in self.in_plane or abs(found.end[column] - position[column]) >= self.half[column]:
                words.append(letter + self._step(position, column, float(found.end[column])))
        if found.pole:
            self._line([self._pole(found)])
            self.own_pole = True
        self._line([*words, *(found.words if found.function == "CR" else ()), found.sense])
        self.out.centres[piece] = found.centre
        return position

    def _piece_of_arc(self, begin: Array, piece: int, centre: Array) -> PieceOfArc:
        target = self.target
        word = next((word for word in self.layout.polar if word.address == "IPA"), None)
        angle = math.nan if word is None or self.layout.name != "cp" else self._value(word, math.nan)
        turn = math.radians(angle) if math.isfinite(angle) else None
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

    def _as_written(self, begin: Array, end: Array, *, own: bool) -> Array:
        """The end of a piece, rounded to the digits that will be written; `own`: the words of the block are used."""
        result, decimals = end.tolist(), self.target.decimals.tolist()
        for column, letter in self.columns:
            word = self.layout.axes.get(letter) if own else None
            increment = word is not None and word.address in self.layout.forms
            base = float(begin[column]) if increment else 0.0
            result[column] = base + round(result[column] - base, decimals[column])
            if word is not None:
                original = base + self._value(word, self._meant(column, word, increment=increment))
                if abs(result[column] - original) < self.half[column]:
                    result[column] = original
        return np.array(result)

    def _radius(self, arc: ArcText) -> None:
        """Write the word R of a CR; remove it for other arcs."""
        word = self.layout.radius
        if arc.function != "CR":
            self._remove(word)
            return
        (text,) = arc.words
        if word is None:
            self.added.append(self.layout.blank + text)
        elif self.program.slice(self.block, word.value_span) != text[1:]:
            self.out.edits.append((*self.program.span(self.block, word.value_span), text[1:]))

    def _pole(self, arc: ArcText) -> str:
        return "CC" + "".join(self.layout.blank + text for text in arc.pole)

    def _old_pole(self) -> str | None:
        """The CC that sets the pole which was in force again; empty without such a pole, None if it is not known."""
        target = self.target
        if self.layout.name not in ("c", "cp"):
            words = pole_in_force(self.program.source, int(self.program.blocks[self.block, 0]))
            return f"CC{self.layout.blank}{words}" if words else words
        digits = max(POLE_DIGITS, int(target.decimals[target.spatial[target.plane[0]]]))
        pairs = sorted((index, float(target.original_centre[index])) for index in target.plane[:2])
        return "CC" + "".join(
            f"{self.layout.blank}{'XYZ'[index]}{self.spelling.number(value, digits)}" for index, value in pairs
        )

    def _line_before(self, text: str) -> None:
        """Put a line before the block."""
        start = int(self.program.blocks[self.block, 0])
        self.out.edits.append((start, start, self.prefix + text + self.program.line_end.decode()))

    # -- holes --------------------------------------------------------------------------------------------------------

    def _over_the_hole(self) -> None:
        """Write the position over a hole, and correct its depth."""
        target, called = self.target, self.layout.name == "cycl call"
        across, position = target.spatial[2], target.start.copy()
        rotary = [column for column, _ in self.columns if called and self._is_rotary(column)]
        self._axis_words(position, target.ends[0], skipped=(across, *rotary))
        lower = float(target.nominal[across])
        off = float(target.ends[0][across]) - lower
        position[across] = lower + (self._sunk if target.code == BY_DEPTH else self._lifted)(off, across)
        if self.layout.polar:
            self._motion_code()
        if called and self.added:
            words = [text.strip() for text in self.added]  # CYCL CALL acts where the block before led to
            self._function(" ".join(["L", *words, self.layout.closing or "FMAX", "M99"]))
            self.added.clear()
        self.out.ends.append(position)

    def _sunk(self, off: float, across: int) -> float:
        """Move the surface from which the cycle counts its depth, for this hole only; returns by how much, mm.

        A new value of Q203 takes effect at the next call of the cycle (TNC 640, "Cycle programming": define the
        parameter of the cycle directly). After the block the old value is restored for other holes and for formulas.
        """
        if abs(off) < self.half[across] or SURFACE in self.program.text_of(self.block):
            return 0.0
        text = self.spelling.number(off, int(self.target.decimals[across]))
        self._line_before(f"FN 1: {SURFACE} = +{SURFACE} + {text}")
        self._line([f"FN 2: {SURFACE} = +{SURFACE} - {text}"])
        return value_of(text)

    def _lifted(self, off: float, across: int) -> float:
        """Call an old cycle from a height that makes its depth right; returns by how much the height changes.

        A block without Z would start from the height of the hole before, which was corrected for that hole. So Z is
        written for each hole.
        """
        word, decimals = self.layout.axes.get("Z"), int(self.target.decimals[across])
        if word is None:
            height = float(self.target.origin[2])
            return self._add(self.target.letters[across], height + off, decimals) - height
        if abs(off) < self.half[across]:
            return 0.0
        height = self._value(word, self._meant(across, word, increment=word.address in self.layout.forms))
        return self._rewrite(word, height + off, decimals) - height


# -- rotary words -----------------------------------------------------------------------------------------------------
# A rotary table that counts from 0 to 360 degrees takes -0.001 as 359.999, and may then turn the long way round to the
# next word. So where a program never writes an angle below zero (or of a full turn and more), a correction does not
# write one either. The angle stays at the limit, the linear axes are worked out for that angle
# (`WrittenLanguage.held_angle`), and the direction of the tool keeps the rest of its error. Rotary words are corrected
# under `--strategy full` only.


@lru_cache(maxsize=16)
def extremes(source: bytes, letter: str) -> tuple[float, float]:
    """The smallest and the largest angle that a program writes for a rotary axis, degrees; both 0 if it writes none."""
    code = re.sub(rb";[^\r\n]*", b"", source)
    found = re.findall(rb"(?i)(?<![A-Z0-9])" + letter.encode() + rb"[ \t]*([+-]?[ \t]*[\d.,]*\d)", code)
    angles = [value_of(text) for text in map(bytes.decode, found) if text.count(".") + text.count(",") < 2]
    return min(angles, default=0.0), max(angles, default=0.0)


def on_its_side(source: bytes, letter: str, nominal: float, angle: float, step: float) -> float:
    """A corrected angle, degrees, held at 0 or just below 360 where the program itself never goes beyond.

    step  the smallest change that the digits of the word can express, degrees
    """
    if abs(angle - nominal) < UNCORRECTED:
        return angle
    if nominal >= 0.0 > angle and extremes(source, letter)[0] >= 0.0:
        return 0.0
    if nominal < TURN_DEGREES <= angle and extremes(source, letter)[1] < TURN_DEGREES:
        return TURN_DEGREES - step
    return angle
