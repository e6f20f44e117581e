"""Writes one corrected motion into its block: the words that change, and the lines of further pieces after it.

All numbers are those of the program: its units, its frame, degrees, diameters. A word is rewritten only if its value
changes by half an output step; a missing word is added only if its axis must move by that much. The ends returned are
what the control will read, rounded to the written digits. The style of numbers and words is the control's `Spelling`;
their places are the block's `Layout`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.text.layout import ABSOLUTE, CENTRE_LETTERS, INCREMENT, Layout
from ncfix.text.spelling import Spelling, value_of
from ncfix.text.tree import Literal, Program, Word
from ncfix.writer.block_text import BlockText
from ncfix.writer.target import LINE, TANGENTIAL, Rendered, Target, feed_number, feed_way

FEED_DECIMALS = 3
"""F words of the pieces of a block in G93 have at least this many decimals."""
WHOLE_STEP_TOLERANCE = 1e-6
"""Tolerance, in output steps, within which a number counts as a whole number of output steps."""

STRAIGHT_AND_ARCS = (0, 10, 20, 30)
"""Motion codes, in tenths, that may be restated: G0 to G3."""

MAX_CLOSED_GAP, EQUALITY_TOLERANCE = 1e-6, 1e-9
"""Program units: ends of full circles are nearer than the first; positions nearer than the second are equal."""
FULL_CIRCLE_STEPS = 2.0
"""Distance of start and end, in steps of the control: full circles have less than this, other arcs more."""

INVERSE_TIME, PER_MINUTE = "93", "94"

FROM_NOWHERE = "an increment in rotated coordinates, while the position of one of their axes is not known"
TOO_SHORT = "the motion is so short that its F in inverse time (G93) would be larger than {:.10g}"
OTHER_WAY = "from a corrected start the control would turn the rotary axes another way to this tool direction"
NO_TIME = "the block must be split, and in G93 this needs an F word with a plain number in the block"


class BlockWriter(BlockText):
    """Writes one motion into one block: `write()` is called once. A subclass adds what only its language has.

    incremental  axis words without a form of their own are increments
    code     the motion code in force after what has been written, tenths
    dragged  the motion turns only rotary axes and gets a linear motion, so its time must be stated
    turning  columns of the rotary axes that are moved by words of the tool direction: they have no words of their own
    """

    def __init__(self, program: Program, block: int, layout: Layout, target: Target, spelling: Spelling) -> None:
        super().__init__(program, block, layout, target, spelling)
        self.incremental = target.incremental and spelling.modal
        self.code = TANGENTIAL.get(target.code, target.code)
        self.dragged = math.isfinite(target.turn_minutes) and target.is_dragged
        self.turning = target.pointing.columns if target.pointing is not None and self._says_direction() else ()

    def write(self) -> Rendered:
        """Write the motion."""
        self._write()
        if self.added:
            at = self.program.position(self.block, self.layout.words_at)
            self.out.edits.append((at, at, "".join(self.added)))
        self.out.edits.sort(key=lambda edit: edit[:2])
        return self.out

    def _write(self) -> None:
        position = self._first_piece(self.target.start.copy(), self.target.ends[0])
        self.out.ends.append(position)
        for piece in range(1, len(self.target.ends)):
            position = self._further_piece(position, piece)
            self.out.ends.append(position)
        if self.dragged:  # back to the feed that was in force, for what follows; in inverse time each has its own
            words = [] if self.target.turn_by_feed else [self._code(PER_MINUTE)]
            words.append(self._cased("F") + self._feed_in_force())
            self._line([self._code(INVERSE_TIME)] if self.target.back_to_inverse_time else words)
        self._move_late_words()

    # -- the block itself ---------------------------------------------------------------------------------------------

    def _first_piece(self, position: Array, end: Array) -> Array:
        self._motion_code()
        base = position.copy()
        self._axis_words(position, end, self._closed(position, end))
        if not (self.target.arc or self.layout.axes or self.added) and np.isfinite(self.target.original_centre).any():
            self._name_a_place(position)
        self._arc_words(base, position)
        self._level()
        if self.turning:
            self._point(position, end)
        if self.dragged:
            self._time_of_turn(base, position)
        elif self.target.inverse_time and len(self.target.ends) > 1:
            # In G93 the pieces take shares of the time of the block, which its F has to say in a plain number.
            if self.layout.feed is None or not math.isfinite(self._feed_share(0)):
                self.out.conflict = NO_TIME
            else:
                self._rewrite(self.layout.feed, self._feed_share(0), FEED_DECIMALS)
        return position

    def _motion_code(self) -> None:
        wanted, word = self.target.code, self.layout.motion
        in_force = self.target.active_code if word is None else round(self._value(word, np.nan) * 10)
        if wanted not in STRAIGHT_AND_ARCS or wanted == in_force:
            return
        if word is not None:
            self._restate(word, f"{wanted // 10}")
        else:
            self._put_code(f"{wanted // 10}")

    def _put_code(self, number: str) -> None:
        """Insert a G code before the first axis word."""
        at = self.program.position(self.block, self.layout.code_at)
        self.out.edits.append((at, at, self._code(number) + self.layout.blank))

    def _code(self, number: str) -> str:
        """A G code as the language writes it."""
        return self._cased("G") + number

    # -- axis words ---------------------------------------------------------------------------------------------------

    def _axis_words(
        self,
        position: Array,
        end: Array,
        closed: Mask | None = None,
        skipped: Sequence[int] = (),
    ) -> None:
        """Correct the axis words, and move `position` to where they lead; `closed`: (n_axes,) axes that stay."""
        for column, letter in self.columns:
            if column in skipped:
                continue
            word = self.layout.axes.get(letter)
            if closed is not None and closed[column]:
                self._stay(position, column, word)
            elif word is not None:
                self._present_axis(position, column, end[column], word)
            elif self._may_add(column):
                self._absent_axis(position, column, end[column])

    def _present_axis(self, position: Array, column: int, end: float, word: Word) -> None:
        start, turns = float(position[column]), 0.0
        form = self.layout.forms.get(word.address, "")
        increment = form == INCREMENT or (not form and self.incremental)
        if form not in ("", ABSOLUTE, INCREMENT):
            turns = float(np.floor(end / 360.0 + 1e-12)) * 360.0
        base = self._counted_from(position, column) if increment else turns
        written = self._value(word, self._meant(column, word, increment=increment) - turns)
        value = (end if increment else self._reachable(column, end)) - base
        if np.isfinite(value) and not (len(self.target.ends) == 1 and abs(value - written) < self.half[column]):
            written = self._rewrite(word, value, int(self.target.decimals[column]))
        position[column] = base + written
        self._arrive(position, column, start, end, word)

    def _meant(self, column: int, word: Word, *, increment: bool) -> float:
        """The programmed value of a word that is not a plain number; NaN if it is not known."""
        target = self.target
        if target.incremental or not increment:
            return float(target.original[column] if increment == target.incremental else target.nominal[column])
        began = target.origin[target.spatial.index(column)] if column in target.spatial else np.nan
        return float(target.nominal[column] - began)

    def _counted_from(self, position: Array, column: int) -> float:
        """The base of an increment; in a rotated frame, one axis of unknown position makes it unknown for all."""
        if not np.isfinite(position[column]):
            self.out.conflict = self.out.conflict or FROM_NOWHERE
        return float(position[column])

    def _reachable(self, column: int, end: float, piece: int = 0) -> float:
        """The coordinate nearest to `end` that an absolute word can reach."""
        return end

    def _arrive(self, position: Array, column: int, start: float, end: float, word: Word) -> None:
        """Hook: ensure that the word just written moves the axis as intended."""

    def _absent_axis(self, position: Array, column: int, end: float) -> None:
        end = self._reachable(column, end)
        near = abs(end - position[column]) < self.half[column] and not self._must_name(column)
        if near or not np.isfinite(end):
            return
        base = position[column] if self.incremental else 0.0
        position[column] = base + self._add(self.target.letters[column], end - base, int(self.target.decimals[column]))

    def _step(self, position: Array, column: int, end: float) -> str:
        """The number of a new axis word that leads to `end`; sets `position`."""
        base = position[column] if self.incremental else 0.0
        text = self.spelling.number(end - base, int(self.target.decimals[column]))
        position[column] = base + value_of(text)
        return text

    def _may_add(self, column: int) -> bool:
        """Whether an axis without a word may get one."""
        allowed = self.layout.allowed is None or self.target.letters[column] in self.layout.allowed
        return allowed and column not in self.turning and not self.target.wordless[column]

    def _must_name(self, column: int) -> bool:
        """Whether an axis gets a word even if the word does not move it."""
        return bool(self.target.spelled) and self.target.spelled[column]

    def _name_a_place(self, position: Array) -> None:
        """Add a word that keeps an axis at its place: the first line of a former arc must be a motion in any case."""
        for column, letter in self.columns:
            if self._may_add(column) and np.isfinite(position[column]):
                base = position[column] if self.incremental else 0.0
                position[column] = base + self._add(letter, position[column] - base, int(self.target.decimals[column]))
                return

    def _closed(self, position: Array, end: Array) -> Mask:
        """The axes of the plane of a full circle, which must end exactly where it starts.

        One output step beside its start, a control would make an arc of a thousandth of a degree of it.
        """
        target, closed = self.target, np.zeros(len(position), dtype=bool)
        if not target.arc or len(target.ends) > 1:
            return closed
        plane, nominal = [target.spatial[index] for index in target.plane[:2]], self._xyz(target.nominal)
        if -1 not in plane and all(
            abs(nominal[index] - target.origin[index]) < MAX_CLOSED_GAP for index in target.plane[:2]
        ):
            closed[plane] = np.linalg.norm(((end - position) / target.resolved)[plane]) < FULL_CIRCLE_STEPS
        return closed

    def _stay(self, position: Array, column: int, word: Word | None) -> None:
        """Make an axis end where it starts; its word is removed if it cannot express that exactly."""
        if word is None:
            return
        start = float(position[column])
        self._present_axis(position, column, start, word)
        if abs(position[column] - start) > EQUALITY_TOLERANCE:
            self._take_back(word.span)
            self._remove(word)
            position[column] = start

    # -- canned cycles ------------------------------------------------------------------------------------------------

    def _level(self) -> None:
        """Write the level R of a canned cycle: rewrite its word, or add one if another level is in force."""
        level = self.target.level
        if level is None:
            return
        word = self.layout.levels.get(level.address)
        decimals, half, wanted = int(self.target.decimals[level.across]), self.half[level.across], level.wanted
        if wanted < level.least:
            wanted = float(np.ceil(level.least / (2 * half) - WHOLE_STEP_TOLERANCE) * 2 * half)
        self.out.level = level.before if word is None else self._value(word, level.nominal)
        if abs(wanted - self.out.level) < half and not self.out.level < level.least - 2 * WHOLE_STEP_TOLERANCE * half:
            return
        if word is None:
            self.out.level = self._add(level.address, wanted, decimals)
        else:
            self.out.level = self._rewrite(word, wanted, decimals)

    # -- arcs ---------------------------------------------------------------------------------------------------------

    def _arc_words(self, start: Array, end: Array) -> None:
        if self.target.arc:
            self._kept_arc(start, end)
        elif np.isfinite(self.target.original_centre).any():
            for word in (*self.layout.centre.values(), self.layout.radius, self.layout.turns):
                self._remove(word)

    def _kept_arc(self, start: Array, end: Array) -> None:
        """Write the centre of an arc that stays one; an R that no longer defines its centre is replaced by I J K."""
        target = self.target
        centre = target.centre.copy()
        word, whole = self.layout.radius, len(target.ends) == 1
        if not whole:
            self._remove(self.layout.turns)
        if word is not None:
            meant = self._centre_by_radius(word, start, end) if whole and not self.layout.centre else None
            if meant is not None:
                self.out.centre = meant
                return
            self._remove(word)
            self._remove(self.layout.centre.get(CENTRE_LETTERS[target.plane[2]]))
        for index in target.plane[:2]:
            centre[index] = self._centre_word(index, float(self._xyz(start)[index]))
        self.out.centre = centre

    def _has_centre(self) -> bool:
        """Whether the centre is given by words, where an omitted one is zero; with an R it is not."""
        return self.layout.radius is None

    def _centre_word(self, index: int, begin: float) -> float:
        target, letter, had_centre = self.target, CENTRE_LETTERS[index], self._has_centre()
        column = target.spatial[index]
        absolute = target.centre_absolute or self.layout.forms.get(letter) == ABSOLUTE
        base, original_base = (0.0, 0.0) if absolute else (begin, target.origin[index])
        value = float(target.centre[index]) - base
        original = float(target.original_centre[index] - original_base)
        word = self.layout.centre.get(letter)
        if word is not None:
            original = self._value(word, original)
            if abs(value - original) >= self.half[column]:
                original = self._rewrite(word, value, int(target.decimals[column]))
        elif abs(value - (original if had_centre else 0.0)) >= self.half[column]:
            original = self._add(letter, value, int(target.decimals[column]))
        elif not had_centre:
            original = 0.0
        return float(base + original)

    def _centre_by_radius(self, word: Word, start: Array, end: Array) -> Array | None:
        """The centre defined by the radius as written; None if it is over an output step from the intended centre."""
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

    def _xyz(self, position: Array) -> Array:
        """X Y Z of a position in the numbers used for centres: X is never a diameter."""
        values = np.array([position[column] if column >= 0 else 0.0 for column in self.target.spatial])
        if self.target.diameter:
            values[0] /= 2
        return values

    # -- the direction of the tool ------------------------------------------------------------------------------------

    def _says_direction(self) -> bool:
        """Whether words of the block give the tool direction; I J K do so only in straight motions."""
        if self.spelling.vector[:1] != CENTRE_LETTERS[:1]:
            return bool(self.layout.vector or self.layout.angles)
        is_arc = np.isfinite(self.target.original_centre).any()
        return self.target.code in (0, LINE) and bool(self.layout.centre) and not is_arc

    def _point(self, position: Array, end: Array) -> None:
        """Correct the words of the tool direction, and turn the rotary axes of `position` to where they lead."""
        turning, target = list(self.turning), self.target
        if len(target.ends) == 1 and (np.abs(end - target.nominal)[turning] < self.half[turning]).all():
            self._turn(position, target.nominal)
            position[turning] = target.nominal[turning]
            return
        for angle in self.layout.angles.values():
            self._remove(angle)
        words: Mapping[str, Word] = {**self.layout.centre, **self.layout.vector}
        for address, value in zip(self.spelling.vector, self._vector(end), strict=True):
            word = words.get(address.rstrip("="))
            if word is not None:
                pointless = isinstance(word.value, Literal) and word.value.pointless
                self._replace(word, value, self.vector_digits, anew=pointless)
            elif value:
                self.added.append(self._component(address, value, self.layout.blank or " " * ("=" in address)))
        self._turn(position, end)

    def _component(self, address: str, value: float, blank: str = "") -> str:
        return blank + self._cased(address) + self.spelling.number(value, self.vector_digits)

    @cached_property
    def vector_length(self) -> float:
        """The length of the direction vector as written."""
        values = (self._value(word, math.nan) for word in self.layout.centre.values())
        return (math.hypot(*filter(math.isfinite, values)) if self.spelling.vector_length else 0.0) or 1.0

    @property
    def vector_digits(self) -> int:
        """Number of decimals needed for the components of the direction."""
        return max(self.spelling.vector_digits - math.floor(math.log10(self.vector_length)), 1)

    def _vector(self, end: Array) -> list[float]:
        """The tool direction at an end, in program coordinates, scaled and rounded as it is written."""
        target = self.target
        assert target.pointing is not None
        direction = np.linalg.solve(target.rotation, target.pointing.direction(np.radians(end) + target.offset))
        return [round(float(part) * self.vector_length, self.vector_digits) for part in direction]

    def _direction_words(self, end: Array) -> list[str]:
        """The direction words of a further piece."""
        return list(map(self._component, self.spelling.vector, self._vector(end)))

    def _turn(self, position: Array, end: Array) -> None:
        """Turn the rotary axes of `position` to where the direction as written leads them; an axis that is free stays.

        Sets a conflict if another way there is about as near as the intended one, and the control would take that.
        """
        target, turning = self.target, list(self.turning)
        assert target.pointing is not None
        vector = target.rotation @ np.array(self._vector(end))
        here, there = (np.radians(each[turning]) + target.offset[turning] for each in (position, end))
        near = float(here[0]), float(here[1])
        ways = target.pointing.angles(vector / np.linalg.norm(vector), near)
        found = min(ways, key=lambda way: float(np.abs(np.array(way) - there).sum()))
        if found is not ways[0] and target.pointing.is_close(near, ways):
            self.out.conflict = self.out.conflict or OTHER_WAY
        position[turning] = np.degrees(np.array(found) - target.offset[turning])

    # -- further pieces -----------------------------------------------------------------------------------------------

    def _further_piece(self, position: Array, piece: int) -> Array:
        target = self.target
        end, begin, position = target.ends[piece], position, position.copy()
        arc = target.arcs is not None and bool(target.arcs[piece])
        words = self._opening(target.arc_code if arc else LINE)
        in_plane = [target.spatial[index] for index in target.plane[:2]] if arc else []
        for column, letter in self.columns:
            still = not abs(end[column] - position[column]) >= self.half[column] and column not in in_plane
            if not still and column not in self.turning and (letter in self.layout.axes or self._may_add(column)):
                text = self._step(position, column, self._reachable(column, end[column], piece))
                words.append(self._cased(letter) + text)
        if self.turning:
            words += self._direction_words(end)
            self._turn(position, end)
        if arc:
            words += self._centre_of_piece(piece, begin)
        if self.dragged:
            words.append(self._cased("F") + self._turn_feed(piece, begin, position))
        elif target.inverse_time and not self.out.conflict:
            words.append(self._cased("F") + f"{self._feed_share(piece):.{FEED_DECIMALS}f}")
        self._line([*words, self.layout.closing] if self.layout.closing else words)
        return position

    def _opening(self, wanted: int) -> list[str]:
        """The motion code with which a further piece begins, if it differs from that of the piece before."""
        if self.target.arcs is None or wanted == self.code:
            return []
        self.code = wanted
        return [self._code(f"{wanted // 10}")]

    def _centre_of_piece(self, piece: int, begin: Array) -> list[str]:
        """The centre words of a further piece that is an arc."""
        target, words = self.target, []
        assert target.centres is not None
        centre = target.centres[piece].copy()
        base = np.zeros(3) if target.centre_absolute else self._xyz(begin)
        for index in target.plane[:2]:
            digits = int(target.decimals[target.spatial[index]])
            text = self.spelling.number(float(centre[index] - base[index]), digits)
            words.append(self._cased(CENTRE_LETTERS[index]) + text)
            centre[index] = base[index] + value_of(text)
        self.out.centres[piece] = centre
        return words

    def _move_late_words(self) -> None:
        """Move M0, M1, M2, M30 and similar words to the last piece, since they act after the motion."""
        if not self.out.lines:
            return
        for word in self.layout.after:
            text = self.program.slice(self.block, word.span)
            self._remove(word)
            self.out.lines[-1] += self.layout.blank + text

    # -- feeds --------------------------------------------------------------------------------------------------------

    def _feed_share(self, piece: int) -> float:
        assert self.layout.feed is not None
        return self._inverse_time(self._value(self.layout.feed, np.nan) / float(self.target.shares[piece]))

    def _inverse_time(self, rate: float) -> float:
        """The F of a piece in G93; sets a conflict if it is larger than the control accepts."""
        if 0 < (most := self.program.dialect.most_inverse_time) < rate:
            self.out.conflict = TOO_SHORT.format(most)
        return rate

    def _time_of_turn(self, begin: Array, end: Array) -> None:
        """State the time of a rotation of rotary axes alone in its block; the feed in force is restored after it."""
        if not self.target.turn_by_feed:
            self._feed_mode(INVERSE_TIME)
        elif self.target.back_to_inverse_time:
            self._feed_mode(PER_MINUTE)
        feed, text = self.layout.feed, self._turn_feed(0, begin, end)
        if feed is None:
            self.added.append(self.layout.blank + self._cased("F") + text)
        else:
            self.out.edits.append((*self.program.span(self.block, feed.value_span), text))

    def _feed_mode(self, number: str) -> None:
        code = self.layout.feed_mode
        if code is None:
            self._put_code(number)
        else:
            self.out.edits.append((*self.program.span(self.block, code.value_span), number))

    def _turn_feed(self, piece: int, begin: Array, end: Array) -> str:
        """The F number that gives a piece of a rotation its share of the time."""
        minutes = self.target.turn_minutes * float(self.target.shares[piece])
        reach = feed_way(self.target.letters, begin, end, self.target.diameter) if self.target.turn_by_feed else 1.0
        return feed_number(self._inverse_time(reach / minutes)) if reach > 0 else self._feed_in_force()

    def _feed_in_force(self) -> str:
        feed = self.layout.feed
        if feed is not None and isinstance(feed.value, Literal):
            return self.program.slice(self.block, feed.value_span)
        return f"{self.target.feed:.6f}".rstrip("0")
