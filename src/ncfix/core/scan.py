# cython: boundscheck=False, cdivision=True
"""Scans a text: numbers, comments and shapes of its blocks in one pass over the bytes.

The result is that of the numpy code of `text.shapes.scan`, to the last bit; a test compares them. `Scanner` checks the
sizes of its tables, and `scan` those of blocks and results for each block; inner loops do not check them again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Bytes = NDArray[np.uint8]
    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]
    Rows = NDArray[np.int32]

UNTOUCHED, CRAMPED = -1, -2
"""Returned instead of the number of shapes: a block cannot be scanned; there is not enough room for the results."""
NONE, BROKEN = -1, -2
FREE, FIXED = 1, 2
"""A number that may differ between blocks of one shape, and one that is part of the shape."""
LITERAL, NUMERIC, SIGN, COMMENT, ODD = 0, 1, 2, 3, 4
"""Kinds of bytes: part of the shape, digit or point, sign, start of a comment, or not allowed in a scanned block."""
CHARACTER, CHILD, SIBLING, SHAPE = 0, 1, 2, 3
"""Columns of the tree of shapes, a prefix tree with a row for each prefix: its last character, its first child row (0:
none), the next child of the same parent, and the number of the shape that ends there (-1: none). Row 0 is the root."""
POINT, ZERO, NINE, MINUS, OPEN, CLOSE, TAIL = 46, 48, 57, 45, 40, 41, 59
"""The characters . 0 9 - ( ) ;"""


class Scanner:
    """The lexical rules of a language, as tables over the 256 byte values.

    kinds           LITERAL, NUMERIC, SIGN, COMMENT or ODD
    fixed           bytes after which a number is part of the shape
    unsigned_after  bytes after which a sign does not belong to the number that follows
    blank           blanks and tabs
    blanks, digits  `numbers.BLANKS` and `numbers.EXACT_DIGITS`
    powers          the powers of ten
    """

    def __init__(
        self, kinds: Bytes, fixed: Bytes, unsigned_after: Bytes, blank: Bytes, blanks: int, digits: int, powers: Floats
    ) -> None:
        self.kinds, self.fixed, self.unsigned_after, self.blank = kinds, fixed, unsigned_after, blank
        self.blanks, self.digits, self.powers = blanks, digits, powers
        self.start = self.past = self.size = 0
        self.pointed = False
        self.value = 0.0
        if min(len(kinds), len(fixed), len(unsigned_after), len(blank)) < 256 or len(powers) <= digits:
            raise IndexError("these are not the tables of a text")

    def scan(
        self,
        text: Bytes,
        blocks: Ints,
        number_mark: int,
        pointless_mark: int,
        comment_mark: int,
        group: Ints,
        comment: Ints,
        first: Ints,
        spans: Ints,
        values: Floats,
        shapes: Bytes,
        starts: Ints,
        behind: Ints,
        tree: Rows,
    ) -> int:
        """Scan the blocks, spans (n, 2), of a text; returns the number of shapes, or `UNTOUCHED`, or `CRAMPED`.

        In a shape the marks stand for a number, a number without a point, and the comment that ends a block.

        These arrays receive the results; numbers and tree may need as many rows as the text has bytes:

        group          (n,) the shape of each block
        comment        (n,) where the comment at the end of the block begins; unchanged if it has none
        first          (n + 1,) the first number of each block
        spans, values  spans and values of the numbers
        shapes         the shapes, one after the other
        starts         where each shape begins
        behind         (n + 1,) for each shape the one that followed it last time, the first guess for the next block;
                       -1: none, or one with a comment
        tree           the tree of shapes, see `CHARACTER`
        """
        count, known, end, latest, place, n = 0, 0, 0, 0, 0, blocks.shape[0]
        least = min(first.shape[0] - 1, starts.shape[0] - 1, behind.shape[0] - 1, group.shape[0], comment.shape[0])
        if least < n or blocks.shape[1] != 2 or tree.shape[0] < 1 or tree.shape[1] != 4 or spans.shape[1] != 2:
            raise IndexError("there is no room for what is found in a text")
        if shapes.shape[0] <= text.shape[0] or spans.shape[0] < values.shape[0]:
            raise IndexError("there is no room for what is found in a text")
        behind[0] = NONE
        self.size, starts[0] = 1, 0
        tree[0, CHILD], tree[0, SHAPE] = 0, NONE
        for block in range(n):
            if not place <= blocks[block, 0] <= blocks[block, 1] <= text.shape[0]:
                raise IndexError("blocks overlap, or lie outside the text")
            first[block], end, place, stop = count, starts[known], blocks[block, 0], blocks[block, 1]
            row, row_at_sign, end_at_sign = 0, 0, end
            if max(count - values.shape[0], self.size - tree.shape[0]) + stop - place > 0:
                return CRAMPED
            if known:
                guess = behind[latest]
                found = NONE
                if guess >= 0:
                    found = self.alike(
                        text, place, stop, shapes, starts[guess], starts[guess + 1], number_mark, pointless_mark,
                        count, spans, values,
                    )  # fmt: skip
                if found >= 0:
                    count, place, latest, group[block] = found, stop, guess, guess
                    continue
            commented = False
            while place < stop:
                character, past = text[place], place + 1
                kind = self.kinds[character]
                if kind == NUMERIC:
                    form = self.number(text, place, stop)
                    past = self.past
                    if form == BROKEN:
                        return UNTOUCHED
                    if form == FREE:
                        if self.start < place:
                            row, end = row_at_sign, end_at_sign
                        spans[count, 0], spans[count, 1], values[count] = self.start, past, self.value
                        count += 1
                        place, character = past - 1, number_mark if self.pointed else pointless_mark
                elif kind == COMMENT:
                    commented = True
                    close = self.comment_end(text, place, stop)
                    if close == BROKEN:
                        return UNTOUCHED
                    past = max(past, close)
                    if close > 0 and self.is_last(text, close, stop):
                        comment[block], place, character = place, close - 1, comment_mark
                elif kind == SIGN:
                    row_at_sign, end_at_sign = row, end
                elif kind == ODD:
                    return UNTOUCHED
                while True:
                    row = self.child_row(tree, row, character)
                    shapes[end] = character
                    place, end = place + 1, end + 1
                    if place >= past:
                        break
                    character = text[place]
            if tree[row, SHAPE] < 0:
                tree[row, SHAPE] = known
                behind[known] = NONE
                known += 1
                starts[known] = end
            group[block] = tree[row, SHAPE]
            if not commented:
                behind[latest] = group[block]
            latest = group[block]
        first[n] = count
        return known

    def alike(
        self,
        text: Bytes,
        begin: int,
        stop: int,
        shapes: Bytes,
        at: int,
        end: int,
        number_mark: int,
        pointless_mark: int,
        count: int,
        spans: Ints,
        values: Floats,
    ) -> int:
        """Read the numbers of a block if it has the shape from `at` to `end`, which has no comment.

        count  the numbers so far; those of the block are stored after them

        Returns the new count, or `NONE` if the block may have another shape.
        """
        place = begin
        while at < end and place < stop:
            mark = shapes[at]
            at += 1
            if mark != number_mark and mark != pointless_mark:
                if text[place] != mark:
                    return NONE
                place += 1
                continue
            signed = self.kinds[text[place]] == SIGN
            digits = place + 1 if signed else place
            if digits >= stop or self.kinds[text[digits]] != NUMERIC:
                return NONE
            if not signed and place > begin and self.kinds[text[place - 1]] == NUMERIC:
                return NONE
            if self.number(text, digits, stop) != FREE or self.start != place:
                return NONE
            if mark != (number_mark if self.pointed else pointless_mark):
                return NONE
            spans[count, 0], spans[count, 1], values[count] = place, self.past, self.value
            count, place = count + 1, self.past
        return count if at == end and place == stop else NONE

    def number(self, text: Bytes, place: int, stop: int) -> int:
        """Read the run of digits and points at a place; returns `FREE`, `FIXED` or `BROKEN`.

        `start` (of its sign, if it has one), `past` (its end), `pointed` and `value` receive what was read.
        """
        past, points, decimals, mantissa = place, 0, 0, 0
        while past < stop and ZERO <= text[past] <= NINE:
            mantissa = 10 * mantissa + (text[past] - ZERO)
            past += 1
        digits = past - place
        if past < stop and text[past] == POINT:
            point, points, past = past, 1, past + 1
            while past < stop and ZERO <= text[past] <= NINE:
                mantissa = 10 * mantissa + (text[past] - ZERO)
                past += 1
            decimals = past - point - 1
            digits += decimals
            while past < stop and (text[past] == POINT or ZERO <= text[past] <= NINE):
                points, past = 2, past + 1
        self.start, self.past, self.pointed, self.value = place, past, points > 0, 0.0
        at = self.before(text, place)
        leader = text[at] if at >= 0 else 0
        if self.fixed[leader]:
            return FIXED
        if points > 1 or digits == 0 or digits > self.digits:
            return BROKEN
        self.value = float(mantissa) / self.powers[decimals]
        if self.kinds[leader] == SIGN and at >= 0:
            further = self.before(text, at)
            if not self.unsigned_after[text[further] if further >= 0 else 0]:
                self.start = at
                if leader == MINUS:
                    self.value = -self.value
        return FREE

    def before(self, text: Bytes, place: int) -> int:
        """The last place before another that is not blank, as `numbers.last_before`."""
        at = place - 1
        least = max(at - self.blanks, 0)
        while at > least and self.blank[text[at]]:
            at -= 1
        return at

    def comment_end(self, text: Bytes, place: int, stop: int) -> int:
        """The end of the comment that begins at a place; `NONE` if it is none, `BROKEN` if it holds an ODD byte."""
        tail = text[place] == TAIL
        for at in range(place + 1, stop):
            character = text[at]
            if self.kinds[character] == ODD:
                return BROKEN
            if not tail and character == CLOSE:
                return at + 1
            if not tail and character == OPEN:
                return NONE
        return stop if tail else NONE

    def is_last(self, text: Bytes, place: int, stop: int) -> bool:
        """Whether only blanks follow in the block."""
        while place < stop and self.blank[text[place]]:
            place += 1
        return place == stop

    def child_row(self, tree: Rows, row: int, character: int) -> int:
        """The child of a row of the tree for a character; it is added if there is none."""
        at = tree[row, CHILD]
        while at and tree[at, CHARACTER] != character:
            at = tree[at, SIBLING]
        if at:
            return int(at)
        new = self.size
        tree[new, CHARACTER], tree[new, CHILD], tree[new, SHAPE] = character, 0, NONE
        tree[new, SIBLING] = tree[row, CHILD]
        tree[row, CHILD] = new
        self.size += 1
        return new
