# cython: boundscheck=False, cdivision=True
"""Writes the words of corrected motions: numbers are replaced in the text, missing words and further lines added.

The bytes are those that `writer.block.BlockWriter` writes block by block; a test compares them. A number is *certain*
if a product of doubles decides its digits, see `NumberRules`; others are left to `BlockWriter`. `WordPrinter` checks
the bounds of its tables, `write` and `write_centres` those of a motion before they write it.
"""

from __future__ import annotations

from math import copysign, inf, sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ncfix.core.edits import EditBuffer

    Bytes = NDArray[np.uint8]
    Ints = NDArray[np.int64]
    Rows = NDArray[np.int32]
    Floats = NDArray[np.float64]

POINT, ZERO, MINUS, PLUS = 46, 48, 45, 43
"""The characters . 0 - +"""
VECTOR_HEAD = 1
"""As in `writer.bulk_layouts`."""
MOST_STEPS = 18
"""Largest number of decimals that is written here."""
ROOM = 16 + MOST_STEPS + 4
"""Largest number of bytes of a word: blank, letter, sign, and digits before and after the point."""


SEMICIRCLE = 1e-6
"""Program units: with a radius this close to half the chord, the two possible centres are too close to tell apart."""
CLOSE_CALL = 1e-4
"""Share of half an output step: a centre this close to the largest permitted distance is left to `BlockWriter`."""


class NumberRules:
    """The limits of numbers that are written here; see `ncfix.text.spelling.rules`.

    powers    the powers of ten
    longest   largest number of bytes, without the sign, of a number that is rewritten
    decimals  largest number of decimals of such a number
    largest   output steps from which on a value is not certain
    tie       relative distance from the middle between two outputs within which a value is not certain
    rounded   half output steps by which rounding alone may displace an axis
    room      largest number of bytes of a word
    """

    def __init__(self, powers: Floats, longest: int, decimals: int, largest: float, tie: float, rounded: float) -> None:
        self.powers, self.longest, self.decimals = powers, longest, decimals
        self.largest, self.tie, self.rounded, self.room = largest, tie, rounded, ROOM
        if len(powers) <= MOST_STEPS or longest + MOST_STEPS + 4 > ROOM:
            raise IndexError("these are not the rules of numbers that are written here")


class CentreWords:
    """The words for centres: `centre`, `centre_heads`, `radius` and `taken` of `writer.bulk_layouts.Layouts`.

    Raises IndexError for tables of different sizes.
    """

    def __init__(self, slots: Ints, heads: Bytes, radius: Ints, taken: Ints) -> None:
        self.slots, self.heads, self.radius, self.taken = slots, heads, radius, taken
        right = slots.shape[0] == heads.shape[0] == radius.shape[0] == taken.shape[0]
        right = right and slots.shape[1] == heads.shape[1] == 3
        if not right or not heads.shape[2] == taken.shape[1] == taken.shape[2] == 2:
            raise IndexError("these are not the words of the centres of arcs")


class WordPrinter:
    """Writes the edits of motions of a program.

    into       receives the edits
    text       text of the program
    edges, first, template  spans (n, 2) of its blocks; first number and template of each block
    values, spans  values and spans of its numbers
    slots, by_place, by_letter, anchors, heads, leads, openings, closings  those of `writer.bulk_layouts.Layouts`
    line_end   bytes that end a line
    offset     (axes,), as `scale`: a command is `offset + scale * number`
    least      (axes,) decimals of the output step
    half       (axes,) half an output step, program units
    signed     positive numbers have a plus sign
    here       (axes,) current command of the control
    wanted, now, told  (axes,) scratch space: numbers wanted at the end of a piece, numbers that the text gives there,
               and whether a word gives them
    """

    def __init__(
        self,
        rules: NumberRules,
        into: EditBuffer,
        text: Bytes,
        edges: Ints,
        first: Ints,
        template: Rows,
        values: Floats,
        spans: Ints,
        slots: Ints,
        by_place: Ints,
        by_letter: Ints,
        anchors: Ints,
        heads: Bytes,
        leads: Ints,
        openings: Bytes,
        closings: Bytes,
        line_end: Bytes,
        offset: Floats,
        scale: Floats,
        least: Ints,
        half: Floats,
        signed: bool,
        here: Floats,
        wanted: Floats,
        now: Floats,
        told: Ints,
    ) -> None:
        self.rules, self.into, self.text, self.edges = rules, into, text, edges
        self.first, self.template = first, template
        self.values, self.spans, self.slots, self.by_place, self.by_letter = values, spans, slots, by_place, by_letter
        self.anchors, self.heads, self.leads, self.openings, self.closings = anchors, heads, leads, openings, closings
        self.line_end, self.offset, self.scale, self.least, self.half = line_end, offset, scale, least, half
        self.signed, self.here, self.wanted, self.now, self.told = signed, here, wanted, now, told
        self.own = self.whole = 0
        self.point = self.plus = False
        self.read = 0.0
        axes, shapes = len(here), len(slots)
        sizes: tuple[int, ...] = (
            edges.shape[1] - 2,
            spans.shape[1] - 2,
            len(spans) - len(values),
            len(by_letter) - axes,
        )
        for table in (by_place, anchors, heads, leads, openings, closings):
            sizes += (len(table) - shapes,)
        for table in (slots, by_place, heads):
            sizes += (table.shape[1] - axes,)
        for row in (offset, scale, least, half, wanted, now, told):
            sizes += (len(row) - axes,)
        sizes += (anchors.shape[1] - 2, leads.shape[1] - 2, heads.shape[2] - 2)
        right = not any(sizes) and len(first) >= len(edges) and len(template) >= len(edges)
        for k in range(axes if right else 0):
            right = right and 0 <= by_letter[k] < axes and least[k] >= 0
            for shape in range(shapes):
                right = right and -1 <= by_place[shape, k] < axes
        if not right:
            raise IndexError("these are not the tables of a program")

    def write(self, rows: Rows, ends: Floats, pieces: Ints, commands: Floats) -> int:
        """Write motions up to the first one that is not certain; returns the number of pieces written.

        rows      (k,) the block of each motion
        ends      (m, axes) wanted commands at the ends of their pieces
        pieces    (k + 1,) first piece of each motion, and m
        commands  receives the commands at the ends of the pieces, as written
        """
        done, axes = 0, self.here.shape[0]
        if pieces.shape[0] <= rows.shape[0] or ends.shape[1] != axes or commands.shape[1] != axes:
            raise IndexError("there is no room for what is written")
        for row in range(rows.shape[0]):
            block, count, size = rows[row], self.into.count, self.into.size
            first_piece, last_piece = pieces[row], pieces[row + 1] - 1
            if not 0 <= block < self.edges.shape[0]:
                raise IndexError("there is no such block")
            if not 0 <= first_piece <= last_piece < min(ends.shape[0], commands.shape[0]):
                raise IndexError("there is no such piece")
            shape, number, several = self.template[block], self.first[block], first_piece < last_piece
            if not self.fits(block, shape, number):
                raise IndexError("there is no room for a block")
            if not self.into.has_room(axes + 1, self.most(block, shape, number, last_piece - first_piece)):
                raise IndexError("there is no room for a block")
            for axis in range(self.here.shape[0]):
                self.now[axis] = (self.here[axis] - self.offset[axis]) / self.scale[axis]
                self.wanted[axis] = (ends[first_piece, axis] - self.offset[axis]) / self.scale[axis]
                self.told[axis] = 0
            clear = self.rewrite_words(number, shape, several)
            if clear:
                place = self.place_of(self.anchors[shape, 0], self.anchors[shape, 1], block, number)
                clear = self.add_words(place, shape)
            if clear:
                self.arrive(commands, first_piece)
            if clear and several:
                begun = self.into.size
                lead = self.place_of(self.leads[shape, 0], self.leads[shape, 1], block, number)
                for piece in range(first_piece + 1, last_piece + 1):
                    for axis in range(self.here.shape[0]):
                        self.wanted[axis] = (ends[piece, axis] - self.offset[axis]) / self.scale[axis]
                    clear = clear and self.put_line(self.edges[block, 0], lead, shape)
                    if clear:
                        self.arrive(commands, piece)
                if clear:
                    self.into.note(self.edges[block, 1], self.edges[block, 1], self.into.size - begun)
            if not clear:
                self.into.back_to(count, size)
                break
            done = last_piece + 1
            for axis in range(self.here.shape[0]):
                self.here[axis] = commands[last_piece, axis]
        return done

    def fits(self, block: int, shape: int, number: int) -> bool:
        """Whether a block, its axis words, and the places for added words are within the text."""
        text, begin, end = self.text.shape[0], self.edges[block, 0], self.edges[block, 1]
        if not (0 <= begin <= end <= text and 0 <= shape < self.slots.shape[0] and number >= 0):
            return False
        for axis in range(self.here.shape[0]):
            word = number + self.slots[shape, axis]
            if self.slots[shape, axis] < 0:
                continue
            if word >= self.values.shape[0] or not 0 <= self.spans[word, 0] < self.spans[word, 1] <= text:
                return False
        first, last = self.anchors[shape, 0], self.leads[shape, 0]
        return bool(min(first, last) >= -2 and number + max(first, last) < self.spans.shape[0])

    def most(self, block: int, shape: int, number: int, further: int) -> int:
        """Largest number of bytes of the motion of a block and its `further` pieces."""
        lead = self.place_of(self.leads[shape, 0], self.leads[shape, 1], block, number) - self.edges[block, 0]
        around = self.line_end.shape[0] + self.openings.shape[1] + self.closings.shape[1]
        return int((further + 1) * (self.here.shape[0] * ROOM + around) + further * max(lead, 0))

    def arrive(self, commands: Floats, piece: int) -> None:
        """Store the command at the end of a piece: axes with a word are where it says, the others stay `here`."""
        for axis in range(self.here.shape[0]):
            if self.told[axis]:
                commands[piece, axis] = self.now[axis] * self.scale[axis] + self.offset[axis]
            else:
                commands[piece, axis] = self.here[axis]

    def place_of(self, slot: int, beyond: int, block: int, number: int) -> int:
        """The byte of an anchor (slot and offset `beyond`) of a block; `number` is the first number of the block."""
        place = self.spans[number + slot, 1] if slot >= 0 else self.edges[block, -1 - slot]
        return int(beyond + place)

    def rewrite_words(self, number: int, shape: int, several: bool) -> bool:
        """Rewrite words whose values change, or all if there are `several` pieces; returns whether they are certain."""
        for k in range(self.by_place.shape[1]):
            axis = self.by_place[shape, k]
            if axis < 0:
                break
            word, begun = number + self.slots[shape, axis], self.into.size
            self.now[axis], self.told[axis] = self.values[word], 1
            if abs(self.wanted[axis] - self.now[axis]) >= self.half[axis] or several:
                begin, end = self.spans[word, 0], self.spans[word, 1]
                if not self.put_in_style(begin, end, self.wanted[axis], self.least[axis]):
                    return False
                self.now[axis] = self.read
                self.into.note(begin, end, self.into.size - begun)
        return True

    def add_words(self, place: int, shape: int) -> bool:
        """Add words at `place` for axes that must move and have none; returns whether they are certain."""
        for k in range(self.by_letter.shape[0]):
            axis, begun = self.by_letter[k], self.into.size
            if self.heads[shape, axis, 1] == VECTOR_HEAD:
                self.now[axis], self.told[axis] = self.wanted[axis], 1
            off = abs(self.wanted[axis] - self.now[axis])
            if self.told[axis] or off < self.half[axis]:
                continue
            if self.heads[shape, axis, 1] == 0:
                if not off <= self.rules.rounded * self.half[axis]:
                    return False
                continue
            blank, letter = self.heads[shape, axis, 0], self.heads[shape, axis, 1]
            if not self.put_new(self.wanted[axis], self.least[axis], blank, letter):
                return False
            self.now[axis], self.told[axis] = self.read, 1
            self.into.note(place, place, self.into.size - begun)
        return True

    def put_line(self, lead_from: int, lead_to: int, shape: int) -> bool:
        """Write a further piece of a motion on a line of its own; returns whether it is certain.

        The line repeats the bytes from `lead_from` to `lead_to` of the text. A piece that moves no axis is left to
        `BlockWriter`.
        """
        for k in range(self.line_end.shape[0]):
            self.into.put(self.line_end[k])
        for at in range(lead_from, lead_to):
            self.into.put(self.text[at])
        for k in range(self.openings.shape[1]):
            if self.openings[shape, k]:
                self.into.put(self.openings[shape, k])
        moved = False
        for k in range(self.by_letter.shape[0]):
            axis = self.by_letter[k]
            off = abs(self.wanted[axis] - self.now[axis])
            if not off >= self.half[axis]:
                continue
            if self.heads[shape, axis, 1] == 0:
                if not off <= self.rules.rounded * self.half[axis]:
                    return False
                continue
            blank = self.heads[shape, axis, 0] if moved or self.openings[shape, 0] else 0
            letter = self.heads[shape, axis, 1]
            if not self.put_new(self.wanted[axis], self.least[axis], blank, letter):
                return False
            self.now[axis], self.told[axis], moved = self.read, 1, True
        for k in range(self.closings.shape[1]):
            if self.closings[shape, k]:
                self.into.put(self.closings[shape, k])
        return moved

    # -- centres of arcs ----------------------------------------------------------------------------------------------

    def write_centres(
        self, rows: Rows, plane: Ints, spatial: Ints, places: Floats, words: CentreWords, centre: Floats, clear: Bytes
    ) -> int:
        """Write the centre words of arcs whose axis words are written already.

        rows     (k,) their blocks
        plane    (k, 2) the axes of their planes, X Y Z being 0 1 2
        spatial  (3,) the columns of X, Y and Z
        places   (k, 4, 2) in the plane, program units: start, end, wanted centre, and what the centre words count from
        words    the words for centres in blocks of each shape
        centre   (k, 2) receives the centre that the text means, program units
        clear    (k,) receives 1, or 0 for an arc that is not certain: nothing is written of it
        """
        n = rows.shape[0]
        right = words.slots.shape[0] >= self.slots.shape[0] and spatial.shape[0] == 3
        right = right and min(plane.shape[0], places.shape[0], centre.shape[0], clear.shape[0]) >= n
        right = right and plane.shape[1] == centre.shape[1] == places.shape[2] == 2 and places.shape[1] == 4
        if not right or not self.into.has_room(3 * n, 2 * ROOM * n):
            raise IndexError("there is no room for the centres of arcs")
        for row in range(n):
            block, count, size = rows[row], self.into.count, self.into.size
            if not 0 <= block < self.edges.shape[0]:
                raise IndexError("there is no such block")
            shape, number = self.template[block], self.first[block]
            right = self.fits(block, shape, number) and self.is_number(number, words.radius[shape])
            right = right and words.taken[shape, 0, 0] >= -2 and number + words.taken[shape, 0, 0] < self.spans.shape[0]
            right = right and words.taken[shape, 1, 0] >= -2 and number + words.taken[shape, 1, 0] < self.spans.shape[0]
            for k in range(2):
                right = right and 0 <= plane[row, k] < 3 and 0 <= spatial[plane[row, k]] < self.here.shape[0]
                right = right and self.is_number(number, words.slots[shape, plane[row, k]])
            if not right:
                raise IndexError("these are not the words of an arc")
            kept, certain = False, True
            if words.radius[shape] >= 0:
                limit = 2 * self.half[spatial[plane[row, 0]]]
                off = self.centre_by_radius(abs(self.values[number + words.radius[shape]]), places, row, centre)
                kept, certain = off <= limit, not (off < 0 or abs(off - limit) < CLOSE_CALL * limit / 2)
            for k in range(0 if kept or not certain else 2):
                axis = spatial[plane[row, k]]
                word, base = words.slots[shape, plane[row, k]], places[row, 3, k]
                wanted, self.read = places[row, 2, k] - base, self.values[number + word] if word >= 0 else 0.0
                if abs(wanted - self.read) >= self.half[axis]:
                    begun = self.into.size
                    if word >= 0:
                        first, last = self.spans[number + word, 0], self.spans[number + word, 1]
                        certain = certain and self.put_in_style(first, last, wanted, self.least[axis])
                    else:
                        first = self.place_of(self.anchors[shape, 0], self.anchors[shape, 1], block, number)
                        last, blank = first, words.heads[shape, plane[row, k], 0]
                        letter = words.heads[shape, plane[row, k], 1]
                        certain = certain and self.put_new(wanted, self.least[axis], blank, letter)
                    self.into.note(first, last, self.into.size - begun)
                centre[row, k] = base + self.read
            if certain and not kept and words.radius[shape] >= 0:
                first = self.place_of(words.taken[shape, 0, 0], words.taken[shape, 0, 1], block, number)
                last = self.place_of(words.taken[shape, 1, 0], words.taken[shape, 1, 1], block, number)
                self.into.note(first, last, 0)
            clear[row] = certain
            if not certain:
                self.into.back_to(count, size)
        return 0

    def is_number(self, number: int, slot: int) -> bool:
        """Whether a slot of a block is a number in the text, or -1 for none; `number` is the first one of the block."""
        word = number + slot
        if slot < 0:
            return bool(slot == -1)
        if word >= self.values.shape[0]:
            return False
        return bool(0 <= self.spans[word, 0] < self.spans[word, 1] <= self.text.shape[0])

    def centre_by_radius(self, radius: float, places: Floats, row: int, centre: Floats) -> float:
        """The centre that a radius means: of the two possible ones the one nearer to the wanted centre.

        Returns its distance from that, program units; infinite if the radius is less than half the chord, and -1 if it
        is so close to it that the centre is not certain. As `block.BlockWriter._centre_by_radius`.
        """
        x, y = places[row, 1, 0] - places[row, 0, 0], places[row, 1, 1] - places[row, 0, 1]
        half_chord = sqrt(x * x + y * y) / 2
        if abs(radius - half_chord) < SEMICIRCLE:
            return -1.0
        if not radius > half_chord > 0:
            return inf
        rise, nearest = sqrt(radius * radius - half_chord * half_chord) / (2 * half_chord), inf
        for side in range(2):
            sign = 1.0 - 2.0 * side
            u = (places[row, 0, 0] + places[row, 1, 0]) / 2 - sign * rise * y
            v = (places[row, 0, 1] + places[row, 1, 1]) / 2 + sign * rise * x
            off_x, off_y = u - places[row, 2, 0], v - places[row, 2, 1]
            off = sqrt(off_x * off_x + off_y * off_y)
            if off < nearest:
                nearest, centre[row, 0], centre[row, 1] = off, u, v
        return nearest

    # -- single numbers -----------------------------------------------------------------------------------------------

    def put_new(self, value: float, decimals: int, blank: int, letter: int) -> bool:
        """Append a new word: blank (0 for none), letter and value; returns whether it is certain. Sets `read` to it."""
        steps = self.steps_of(value, decimals)
        if steps < 0:
            return False
        if blank:
            self.into.put(blank)
        self.into.put(letter)
        negative = copysign(1.0, value) < 0
        sign = MINUS if negative else 0
        if self.signed:
            sign = MINUS if value < 0 and steps != 0 else PLUS
        self.put(steps, decimals, sign, 1, False)
        self.read = copysign(steps / self.rules.powers[decimals], value)
        return True

    def put_in_style(self, start: int, stop: int, value: float, least: int) -> bool:
        """Append a value in the style of the number at a span, as `NumberStyle.write`; returns whether it is certain.

        `read` receives the value that the text means.
        """
        if not self.style_of(start, stop):
            return False
        most = max(self.own, least)
        steps = self.steps_of(value, most)
        if steps < 0:
            return False
        self.read = copysign(steps / self.rules.powers[most], value) + 0.0
        while most > self.own and steps % 10 == 0:
            steps //= 10
            most -= 1
        sign = MINUS if value < 0 and steps != 0 else PLUS if self.plus else 0
        digits = 1 if self.whole else -1
        if self.whole > 1 and self.text[stop - self.own - (1 if self.point else 0) - self.whole] == ZERO:
            digits = self.whole
        self.put(steps, most, sign, digits, self.point)
        return True

    def style_of(self, start: int, stop: int) -> bool:
        """Determine the style of the number at a span; returns whether it consists of sign, digits and point only.

        `own` (decimals), `point`, `plus` and `whole` (digits before the point) receive it. In signed numbers a minus
        counts as a plus, so that the new number keeps a sign.
        """
        head, first, point = self.text[start], start, -1
        if head in (PLUS, MINUS):
            first = start + 1
        for place in range(first, stop):
            character = self.text[place]
            if character == POINT and point < 0:
                point = place
            elif character < ZERO or character > ZERO + 9:
                return False
        self.point, self.own = point >= 0, stop - point - 1 if point >= 0 else 0
        self.plus = head == PLUS or (self.signed and head == MINUS)
        self.whole = stop - first - self.own - (1 if point >= 0 else 0)
        return stop - first <= self.rules.longest and self.own <= self.rules.decimals

    def steps_of(self, value: float, decimals: int) -> int:
        """The absolute value in output steps, rounded; -1 if it is too large, or too close to a tie of rounding."""
        if decimals > MOST_STEPS:
            return -1
        size = abs(value) * self.rules.powers[decimals]
        if not size < self.rules.largest:
            return -1
        steps = int(size)
        rest = size - steps
        if not abs(rest - 0.5) > self.rules.tie * size:
            return -1
        return steps + 1 if rest > 0.5 else steps

    def put(self, steps: int, decimals: int, sign: int, least: int, point: bool) -> None:
        """Append a number of output steps with at least `least` digits before the point; -1: none if it is zero."""
        if sign:
            self.into.put(sign)
        at, count, rest = self.into.size, 0, steps
        while rest:
            rest //= 10
            count += 1
        digits = max(count - decimals, least, 1 if least >= 0 or decimals == 0 else 0)
        pointed = point or decimals > 0
        length = digits + decimals + (1 if pointed else 0)
        rest = steps
        self.into.data[at + length - 1] = ZERO  # there is room for all
        for k in range(decimals):
            self.into.data[at + length - 1 - k] = ZERO + rest % 10
            rest //= 10
        if pointed:
            self.into.data[at + digits] = POINT
        for k in range(digits):
            self.into.data[at + digits - 1 - k] = ZERO + rest % 10
            rest //= 10
        self.into.size = at + length
