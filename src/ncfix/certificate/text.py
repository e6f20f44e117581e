"""The second reader: a program as lines, with all lines of one shape parsed at once.

Most lines of a program differ from others in their numbers only. So the numbers are found in the whole text; the rest
of a line is its shape, which is parsed once. Line objects are made on access; the numbers of plain lines are also kept
in columns.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array, Index, Mask, Signs
from ncfix.certificate.reading import AXES, DECIMAL, NUMBER, PATH_WORDS, READERS, Family, TextLine, TextWord
from ncfix.values import frozen

Indices = NDArray[np.signedinteger[Any]]
PART = 4096
"""Number of lines parsed at once."""
MOST_DIGITS = 99
"""Largest number of decimals that is counted."""
KEPT = 1000
"""Number of line objects that are cached."""


@frozen
class Text:
    """A program as lines.

    source   its text without the stamp
    numbers  (n,) line numbers, from 1
    read     the lines with the numbers of plain ones in columns; None if `lines` were made in another way
    """

    family: Family
    source: bytes
    numbers: NDArray[np.int32]
    lines: Sequence[TextLine]
    stamp: StampFound | None
    read: Lines | None = None

    @classmethod
    def of(cls, source: bytes, family: Family) -> Text:
        """Read a program; the line of its stamp, if it has one, is taken out."""
        text = source
        if b"\r" in text:
            text = RETURNS.sub(b"", text) if b"\n" in text else text.replace(b"\r", b"\n")
        count = text.count(b"\n") + (not text.endswith(b"\n")) if text else 0
        numbers, stamp = np.arange(1, count + 1, dtype=np.int32), None
        if found := STAMP.search(text):
            at = text.count(b"\n", 0, found.start())
            machine, strategy, tolerance = (group.decode().lower() for group in found.groups())
            stamp = StampFound(at + 1, machine, strategy, float(tolerance))
            before, behind = text.rfind(b"\n", 0, found.start()), text.find(b"\n", found.start())
            text = text[: max(before, 0)] if behind < 0 else text[: before + 1] + text[behind + 1 :]
            numbers = np.delete(numbers, at)
        if MARK.encode() in text:
            rows = text.decode("latin-1").split("\n")[: len(numbers)]
            lines = [READERS[family](*each) for each in zip(numbers.tolist(), rows, strict=True)]
            return cls(family, text, numbers, lines, stamp)
        read = Lines(family, text, numbers)
        return cls(family, text, numbers, read, stamp, read)

    def says(self, other: Text) -> bool:
        """Whether both have equal words, line by line."""
        return len(self.lines) == len(other.lines) and all(map(TextLine.says, self.lines, other.lines))

    def apart(self) -> Iterator[tuple[int, TextLine]]:
        """(index, line) of each line that is not plain."""
        lines = self.read
        rows = range(len(self.lines)) if lines is None else np.flatnonzero(~lines.plain).tolist()
        return ((row, self.lines[row]) for row in rows)

    @property
    def is_renumbered(self) -> bool:
        """Whether the blocks of each program in the text are numbered as by `fix --block-numbers renumber`."""
        if self.family not in RENUMBERED:
            return False
        numbers, (start, step) = self.block_numbers, RENUMBERED[self.family]
        ahead = np.diff(numbers, prepend=start - step)
        gaps = int((ahead == 2 * step).sum())  # the number of the stamp
        counted = bool(((ahead == step) | (ahead == 2 * step) | (numbers == start)).all())
        return counted and gaps <= (self.stamp is not None)

    @property
    def block_numbers(self) -> Array:
        """The numbers of the blocks that have one."""
        pattern = LEADING_NUMBER if self.family is Family.KLARTEXT else BLOCK_NUMBER
        return np.array(pattern.findall(self.source), dtype=np.float64)

    def without_block_numbers(self) -> Text:
        """The program without block numbers, including those to which jumps go."""
        lines = [replace(line, block="", rest=ANY_BLOCK_NUMBER.sub("", line.rest)) for line in self.lines]
        return replace(self, lines=lines, read=None)


class StampFound(NamedTuple):
    """The stamp of a corrected program: its line, the hash of the machine, strategy and tolerance, um."""

    line: int
    machine: str
    strategy: str
    tolerance_um: float


STAMP = re.compile(rb"\bncfix \d\S* machine ([0-9a-f]+) strategy ([\w-]+) tolerance ([\d.e-]+) um", re.IGNORECASE)
RETURNS = re.compile(rb"\r+(?=\n|\Z)")
RENUMBERED = {Family.KLARTEXT: (0, 1), Family.SINUMERIK: (10, 10)}
"""First block number and step after renumbering."""
BLOCK_NUMBER = re.compile(rb"^[ \t]*/?[ \t]*N[ \t]*(\d+)", re.IGNORECASE | re.MULTILINE)
LEADING_NUMBER = re.compile(rb"^[ \t]*(?:/[ \t]*)?(\d+)(?=[ \t]|$)", re.MULTILINE)
ANY_BLOCK_NUMBER = re.compile(r"[ \t]*\bN[ \t]*\d+[ \t]*", re.IGNORECASE)


class PlainShape(NamedTuple):
    """The common part of lines that differ in their numbers only.

    path      (name, index of its number in the line) of each word that a correction may change
    codes     the same for all other words
    rest      the other text, with {} for each number in it
    held      the indices of these numbers
    numbered  the first number is a block number of Klartext
    """

    path: tuple[tuple[str, int], ...]
    codes: tuple[tuple[str, int], ...]
    rest: str
    held: tuple[int, ...]
    numbered: bool

    @property
    def is_straight(self) -> bool:
        """Whether such lines are straight motions and nothing else, if their G is 0 or 1."""
        names = [name for name, _ in self.codes if name != "N"]
        return bool(self.path) and len(set(names)) == len(names) and STRAIGHT.issuperset(names)


PLAIN_NUMBER = re.compile(rf"({NUMBER})")
PLAIN_DECIMAL = re.compile(rf"(?<![Rr])({DECIMAL})")
"""Numbers of Klartext, except that of R0."""
NUMBER_RUN, DECIMAL_RUN = re.compile("([-+.0-9]+)"), re.compile("([-+.,0-9]+)")
"""Faster patterns, for texts in which all of their matches are numbers."""
AFTER_R = re.compile("[Rr][-+.,0-9]")
SHOWN = {0x100 + ord(character): character for character in "-+.,0123456789"}
"""Characters behind an R, which are replaced while numbers of Klartext are searched, by their replacements."""
MARK = "\0"
PLAIN_SHAPES = {
    Family.WORDS: re.compile(rf"((?:[ \t]*[A-Za-z][ \t]*{MARK})+)[ \t]*(?:\([^(){MARK}]*\)|;[^{MARK}]*)?"),
    Family.SINUMERIK: re.compile(rf"((?:[ \t]*[A-Za-z]{MARK})+)[ \t]*(?:;[^{MARK}]*)?"),
    Family.KLARTEXT: re.compile(
        rf"([ \t]*{MARK}(?=[ \t]))?[ \t]*L((?:[ \t]+(?:I?[XYZABCUVW]|F|M){MARK}|[ \t]+(?:R0|RL|RR|FMAX))+)[ \t]*",
        re.IGNORECASE,
    ),
}
"""Shapes that can be parsed: words of a letter and a number, and a comment without numbers behind them."""
PLAIN_WORD = re.compile(rf"[ \t]*(?:([A-Za-z]+)[ \t]*{MARK}|(R0|RL|RR|FMAX))", re.IGNORECASE)


STRAIGHT = frozenset(("G", "F", "L", "FMAX"))
"""Words, besides those of axes and N, that a straight motion may have."""


class Lines(Sequence[TextLine]):
    """The lines of a program; line objects are made on access.

    kinds     (n,) index in `shapes` of the shape of each line; a shape is None if its lines are read one by one
    plain     (n,) whether the line has a shape that is not None
    begins    (n + 1,) index of the first number of each line, and at last the number of numbers
    values    all numbers of the program; `decimals`: their decimals, -1 for numbers without a point
    """

    def __init__(self, family: Family, source: bytes, numbers: Indices) -> None:
        """The lines of a text; `numbers` (n,): their line numbers."""
        self.family, self.numbers, self.source = family, numbers, source
        self.klartext = family is Family.KLARTEXT
        self.text = np.frombuffer(source, dtype=np.uint8)
        ends = np.append(np.flatnonzero(self.text == ord("\n")), len(source))[: len(numbers)]
        self.starts = np.append(0, ends + 1).astype(np.int32)
        known: dict[str, int] = {}
        parts = [self._part(first, known) for first in range(0, max(len(numbers), 1), PART)]
        kinds, places, sizes, values, decimals = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        self.kinds, self.places, self.sizes, self.values, self.decimals = kinds, places, sizes, values, decimals
        self.shapes = [self._shape(key) for key in known]
        self.plain = np.array([shape is not None for shape in self.shapes], dtype=bool)[kinds]
        counts = np.array([key.count(MARK) for key in known], dtype=np.int32)
        self.begins = np.append(0, np.cumsum(counts[kinds])).astype(np.int32)
        self._made: dict[int, TextLine] = {}

    def __len__(self) -> int:
        return len(self.numbers)

    @overload
    def __getitem__(self, at: int) -> TextLine: ...

    @overload
    def __getitem__(self, at: slice) -> list[TextLine]: ...

    def __getitem__(self, at: int | slice) -> TextLine | list[TextLine]:
        if isinstance(at, slice):
            return [self[row] for row in range(len(self))[at]]
        row = at + len(self) if at < 0 else at
        found = self._made.get(row)
        if found is None:
            if len(self._made) >= KEPT:
                self._made.clear()
            found = self._made[row] = self._line(row)
        return found

    def digits(self, number: int) -> str:
        """Number `number` as written."""
        place = int(self.places[number])
        return self.source[place : place + int(self.sizes[number])].decode("latin-1")

    def _line(self, row: int) -> TextLine:
        number, shape = int(self.numbers[row]), self.shapes[self.kinds[row]]
        digits: list[str] = []
        if shape is not None:
            digits = [self.digits(at) for at in range(self.begins[row], self.begins[row + 1])]
        if shape is None or (shape.numbered and not digits[0].isdecimal()):
            text = self.source[self.starts[row] : self.starts[row + 1] - 1]
            return READERS[self.family](number, text.decode("latin-1"))
        rest, block = shape.rest.format(*(digits[k] for k in shape.held)) if shape.held else shape.rest, ""
        if self.klartext:
            block = digits[0] if shape.numbered else ""
            words = [
                TextWord(name[-1], (it := digits[k]), float(it.replace(",", ".")), "+" if len(name) > 1 else "=")
                for name, k in shape.path
            ]
            codes = [
                TextWord(name, (it := digits[k]), float(it.replace(",", "."))) if k >= 0 else TextWord(name, "", None)
                for name, k in shape.codes
            ]
        else:
            words = [TextWord(name, (it := digits[k]), float(it)) for name, k in shape.path]
            codes = [TextWord(name, (it := digits[k]), float(it)) for name, k in shape.codes]
        return TextLine(number, words, codes, rest, block, plain=True)

    def _part(self, first: int, known: dict[str, int]) -> tuple[Indices, Indices, Indices, Array, Signs]:
        """Parse a batch of lines from `first` on: kinds of the lines; places, sizes, values and decimals of numbers.

        known  key of a shape -> its kind; new keys are added
        """
        count = min(PART, len(self) - first)
        start, end = int(self.starts[first]), max(int(self.starts[first + count]) - 1, 0)
        text = self.source[start:end].decode("latin-1")
        pieces, values = self._numbers(AFTER_R.sub(_hide, text) if self.klartext else text)
        left = MARK.join(pieces[::2])
        keys = (left if left.isascii() else left.translate(SHOWN)).split("\n")[:count]
        kinds = np.fromiter((known.setdefault(key, len(known)) for key in keys), np.int32, count)
        lengths = np.fromiter(map(len, pieces), np.int32, len(pieces))
        ends, sizes = np.cumsum(lengths, dtype=np.int32)[1::2] + np.int32(start), lengths[1::2].copy()
        decimals = np.full(len(ends), -1, dtype=np.int8)
        if len(ends):
            inside = self.text[start:end]
            points = np.flatnonzero((inside == ord(".")) | (inside == ord(","))) + start
            which = np.minimum(np.searchsorted(ends, points, side="right"), len(ends) - 1)
            points, which = (
                each[(points >= (ends - sizes)[which]) & (points < ends[which])] for each in (points, which)
            )
            decimals[which] = np.minimum(ends[which] - points - 1, MOST_DIGITS)
        return kinds, ends - sizes, sizes, values, decimals

    def _numbers(self, text: str) -> tuple[list[str], Array]:
        """A text split at its numbers, which are every second piece, and their values."""
        fast, thorough = (DECIMAL_RUN, PLAIN_DECIMAL) if self.klartext else (NUMBER_RUN, PLAIN_NUMBER)
        for pattern in (fast, thorough):
            pieces = pattern.split(text)
            digits = pieces[1::2]
            if self.klartext and "," in text:
                digits = [each.replace(",", ".") for each in digits]
            try:
                return pieces, np.fromiter(map(float, digits), np.float64, len(digits))
            except ValueError:  # some matches are not numbers: a sign or a point alone
                continue
        raise AssertionError("what these patterns match are numbers")

    def are_whole(self, numbers: Indices) -> Mask:
        """(k,) whether numbers consist of digits only."""
        return (self.decimals[numbers] < 0) & (self.text[self.places[numbers]] >= ord("0"))

    def by_shape(self) -> Iterator[tuple[PlainShape | None, Indices]]:
        """(shape, indices of its lines) of each shape."""
        order = np.argsort(self.kinds, kind="stable")
        bounds = np.searchsorted(self.kinds[order], np.arange(len(self.shapes) + 1))
        return zip(self.shapes, (order[begin:end] for begin, end in pairwise(bounds.tolist())), strict=True)

    def hashes(self, lines: int, *numbers: Indices) -> Index:
        """(lines,) a hash of the written forms of several numbers (lines,) each; for one number, equal to `hash_of`."""
        found = np.zeros(lines, dtype=np.uint64)
        for each in numbers:
            sizes, places = self.sizes[each], self.places[each]
            for k in range(int(sizes.max(initial=0))):
                here = np.flatnonzero(sizes > k)
                found[here] = found[here] * np.uint64(FACTOR) + self.text[places[here] + k]
            found += np.uint64(len(numbers) > 1)
        return found.view(np.intp)

    def same(self, numbers: Indices, other: Lines, others: Indices) -> Mask:
        """(k,) whether numbers (k,) have the same written form as numbers (k,) of another program."""
        sizes = self.sizes[numbers]
        found: Mask = sizes == other.sizes[others]
        for size in np.unique(sizes[found]).tolist():
            at = np.flatnonzero(found & (sizes == size))
            here, there = (
                lines.text[lines.places[each[at]][:, None] + np.arange(size)]
                for lines, each in ((self, numbers), (other, others))
            )
            found[at] = (here == there).all(axis=1)
        return found

    def straight(self, axes: Sequence[str]) -> StraightLines:
        """The straight motions of these axes, in columns."""
        n = len(self)
        found = StraightLines(
            np.zeros(n, dtype=bool),
            np.full((n, len(axes)), -1, dtype=np.int32),
            np.zeros((n, len(axes)), dtype=bool),
            self.values,
            self.decimals,
            np.full(n, -1, dtype=np.int32),
            np.full(n, -1, dtype=np.int32),
            np.zeros(n, dtype=bool),
        )
        for shape, rows in self.by_shape():
            if shape is None or not shape.is_straight or not all(name[-1] in axes for name, _ in shape.path):
                continue
            begin = self.begins[rows]
            for name, k in shape.path:
                found.word[rows, axes.index(name[-1])] = begin + k
                found.counted[rows, axes.index(name[-1])] = len(name) > 1
            found.is_straight[rows] = True
            for name, k in shape.codes:
                if name == "G":
                    found.code[rows] = begin + k
                    found.is_straight[rows] = np.isin(found.values[begin + k], (0.0, 1.0))
                elif name == "F":
                    found.feed[rows] = begin + k
                elif name == "FMAX":
                    found.rapid[rows] = True
            if shape.numbered:
                found.is_straight[rows] &= self.are_whole(begin)
        return found

    def _shape(self, key: str) -> PlainShape | None:
        """The shape of a line whose numbers are replaced by marks; None if its lines must be read one by one."""
        found = PLAIN_SHAPES[self.family].fullmatch(key)
        if found is None or "{" in key or "}" in key:
            return None
        path: list[tuple[str, int]] = []
        codes: list[tuple[str, int]] = [("L", -1)] if self.klartext else []
        held: list[int] = []
        head = found.end(1) if self.klartext and found[1] else 0
        begin, end = found.span(found.re.groups)
        count, pieces, literal = int(head > 0), list[str](), key[head:begin]
        for word in PLAIN_WORD.finditer(key, begin, end):
            name = (word[1] or word[2]).upper()
            if word[1] and name[-1] in AXES and (self.klartext or len(name) == 1):
                path.append((name, count))
                literal = literal.rstrip(" \t")
                pieces.append(literal)
                literal = ""
            else:
                literal += word[0].replace(MARK, "{}")
                codes.append((name, count if word[1] else -1))
                held += [count] if word[1] else []
            count += bool(word[1])
        pieces.append(literal + key[end:])
        names = [name[-1] for name, _ in path]
        if len(set(names)) < len(names):
            return None
        other = PATH_WORDS if not self.klartext else frozenset("R")
        if any(name in other for name, _ in codes):
            return None
        return PlainShape(tuple(path), tuple(codes), "".join(pieces), tuple(held), head > 0)


def _hide(found: re.Match[str]) -> str:
    return found[0][0] + chr(0x100 + ord(found[0][1]))


FACTOR = 0x9E3779B97F4A7C15


def hash_of(digits: str) -> int:
    """A hash of 64 bits for the written form of a number."""
    found = 0
    for digit in digits.encode("latin-1"):
        found = (found * FACTOR + digit) & (2**64 - 1)
    return found - (found >> 63 << 64)


def same_but_axes(first: Lines, rows: Index, second: Lines, others: Index) -> Mask:
    """(n,) whether plain lines have the same text as `others`, except for numbers of axes, and further axes there."""
    kinds, theirs = first.kinds[rows], second.kinds[others]
    codes, inverse = np.unique(kinds * len(second.shapes) + theirs, return_inverse=True)
    found = np.zeros(len(rows), dtype=bool)
    order = np.argsort(inverse, kind="stable")
    bounds = np.searchsorted(inverse[order], np.arange(len(codes) + 1))
    for code, begin, end in zip(codes.tolist(), bounds, bounds[1:], strict=False):
        one, other = first.shapes[code // len(second.shapes)], second.shapes[code % len(second.shapes)]
        if one is None or other is None or (one.rest, one.numbered) != (other.rest, other.numbered):
            continue
        if [name for name, _ in one.path] != [name for name, _ in other.path[: len(one.path)]]:
            continue
        each = order[begin:end]
        here, there = first.begins[rows[each]], second.begins[others[each]]
        same = np.ones(len(each), dtype=bool)
        blocks = [(0, 0)] if one.numbered else []
        for k, j in (*zip(one.held, other.held, strict=True), *blocks):
            same &= first.same(here + k, second, there + j)
        found[each] = same
    return found


class StraightLines(NamedTuple):
    """Straight motions in columns: n lines of the program, a axes.

    is_straight  (n,) whether the line is a straight motion and nothing else; the other columns are for such lines
    word         (n, a) index in `values` of the number of the axis; -1: it has no word
    counted      (n, a) the word is an increment, whatever the mode
    values       all numbers of the program; `decimals`: their decimals, -1 for numbers without a point
    code, feed   (n,) index in `values` of the numbers of G (0 or 1) and of F; -1: no such word
    rapid        (n,) whether the line has FMAX
    """

    is_straight: Mask
    word: Indices
    counted: Mask
    values: Array
    decimals: Signs
    code: Indices
    feed: Indices
    rapid: Mask
