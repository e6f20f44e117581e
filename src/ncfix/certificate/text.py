"""The second reader: a program as lines, those of one shape taken apart at once.

Most lines of a program differ from others in their numbers only. So numbers are found in the whole text, and what is
left of a line is its shape, which is taken apart once. Lines are made when they are looked at; of the plain ones their
numbers also stand in columns.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from ncfix.certificate.reading import AXES, DECIMAL, NUMBER, PATH_WORDS, READERS, Family, TextLine, TextWord
from ncfix.values import frozen


@frozen
class Text:
    """A program as lines.

    read  its lines as they were read, of which the plain ones stand in columns; None if `lines` are others
    """

    family: Family
    lines: Sequence[TextLine]
    stamp: StampFound | None
    read: Lines | None = None

    @classmethod
    def of(cls, source: bytes, family: Family) -> Text:
        """Read a program; the line of its stamp, if it has one, is kept apart."""
        text = source.decode("latin-1")
        rows = text.removesuffix(end := "\n" if "\n" in text else "\r").split(end) if text else []
        numbers, stamp = list(range(1, len(rows) + 1)), None
        if b"ncfix" in source.lower() and (found := STAMP.search(text)):
            at = text.count(end, 0, found.start())
            stamp = StampFound(at + 1, found[1].lower(), found[2].lower(), float(found[3]))
            del rows[at], numbers[at]
        rows = [row.rstrip("\r") for row in rows] if "\r" in text else rows
        if MARK in text:
            return cls(family, [READERS[family](*each) for each in zip(numbers, rows, strict=True)], stamp)
        lines = Lines(family, rows, numbers)
        return cls(family, lines, stamp, lines)

    @property
    def block_numbers(self) -> list[int]:
        """The numbers of the blocks that have one."""
        found = (line.block or (BLOCK_NUMBER.match(line.rest) or [""] * 2)[1] for line in self.lines)
        return [int(number) for number in found if number]

    @property
    def is_renumbered(self) -> bool:
        """Whether its blocks have the numbers that `fix --block-numbers renumber` gives, in each program of a text."""
        if self.family not in RENUMBERED:
            return False
        numbers, (start, step) = self.block_numbers, RENUMBERED[self.family]
        pairs = list(zip([start - step, *numbers], numbers, strict=False))
        gaps = sum(number == before + 2 * step for before, number in pairs)  # there is the number of the stamp
        counted = all(number in (start, before + step, before + 2 * step) for before, number in pairs)
        return counted and gaps <= (self.stamp is not None)

    def without_block_numbers(self) -> Text:
        """The same program where nobody looks at block numbers, nor at those to which jumps go."""
        lines = [replace(line, block="", rest=ANY_BLOCK_NUMBER.sub("", line.rest)) for line in self.lines]
        return replace(self, lines=lines, read=None)


class StampFound(NamedTuple):
    """What a corrected program says of itself: the line, the hash of the machine, strategy and tolerance (um)."""

    line: int
    machine: str
    strategy: str
    tolerance_um: float


STAMP = re.compile(r"\bncfix \d\S* machine ([0-9a-f]+) strategy ([\w-]+) tolerance ([\d.e-]+) um", re.IGNORECASE)
RENUMBERED = {Family.KLARTEXT: (0, 1), Family.SINUMERIK: (10, 10)}
"""The first number that blocks get anew, and the step to the next."""
BLOCK_NUMBER = re.compile(r"[ \t]*/?[ \t]*N[ \t]*(\d+)", re.IGNORECASE)
ANY_BLOCK_NUMBER = re.compile(r"[ \t]*\bN[ \t]*\d+[ \t]*", re.IGNORECASE)


class PlainShape(NamedTuple):
    """What lines have in common that differ in their numbers only.

    path      names of the words that a correction may change, and which of the numbers of a line they have
    codes     the same of the other words
    rest      the other text, with {} for each number in it
    held      which numbers these are
    numbered  the first number is that of a block of Klartext
    """

    path: tuple[tuple[str, int], ...]
    codes: tuple[tuple[str, int], ...]
    rest: str
    held: tuple[int, ...]
    numbered: bool

    @property
    def is_straight(self) -> bool:
        """Whether such a line only brings axes straight to places, if its G is 0 or 1."""
        names = [name for name, _ in self.codes if name != "N"]
        return bool(self.path) and len(set(names)) == len(names) and STRAIGHT.issuperset(names)


PLAIN_NUMBER = re.compile(rf"({NUMBER})")
PLAIN_DECIMAL = re.compile(rf"(?<![Rr])({DECIMAL})")
"""Numbers of Klartext, but for that of R0."""
MARK = "\0"
PLAIN_SHAPES = {
    Family.WORDS: re.compile(rf"((?:[ \t]*[A-Za-z][ \t]*{MARK})+)[ \t]*(?:\([^(){MARK}]*\)|;[^{MARK}]*)?"),
    Family.SINUMERIK: re.compile(rf"((?:[ \t]*[A-Za-z]{MARK})+)[ \t]*(?:;[^{MARK}]*)?"),
    Family.KLARTEXT: re.compile(
        rf"([ \t]*{MARK}(?=[ \t]))?[ \t]*L((?:[ \t]+(?:I?[XYZABCUVW]|F|M){MARK}|[ \t]+(?:R0|RL|RR|FMAX))+)[ \t]*",
        re.IGNORECASE,
    ),
}
"""Shapes that are read at once: words of a letter and a number, a comment without numbers behind them."""
PLAIN_WORD = re.compile(rf"[ \t]*(?:([A-Za-z]+)[ \t]*{MARK}|(R0|RL|RR|FMAX))", re.IGNORECASE)


STRAIGHT = frozenset(("G", "F", "L", "FMAX"))
"""Words beside those of axes in lines that only bring axes straight to places, and N."""


class Lines(Sequence[TextLine]):
    """The lines of a program, taken apart when they are looked at.

    kinds    (n,) which of `shapes` each line has; a shape is None if it takes more than a look to read it
    digits   the numbers of the program as they are written; those of a line begin at `begins` (n,)
    """

    def __init__(self, family: Family, rows: Sequence[str], numbers: Sequence[int]) -> None:
        """Of the text of each line, and its number."""
        self.family, self.rows, self.numbers = family, rows, numbers
        self.klartext = family is Family.KLARTEXT
        pattern, text = PLAIN_DECIMAL if self.klartext else PLAIN_NUMBER, "\n".join(rows)
        parts = pattern.split(text)
        self.digits: list[str] = parts[1::2]
        keys = MARK.join(parts[::2]).split("\n") if rows else []
        known: dict[str, int] = {}
        self.kinds = np.fromiter((known.setdefault(key, len(known)) for key in keys), np.intp, len(rows))
        self.shapes = [self._shape(key) for key in known]
        counts = np.array([key.count(MARK) for key in known], dtype=np.intp)
        self.ends = np.cumsum(counts[self.kinds]) if rows else np.zeros(0, dtype=np.intp)
        self.begins = self.ends - counts[self.kinds] if rows else self.ends
        self._made: list[TextLine | None] = [None] * len(rows)

    def __len__(self) -> int:
        return len(self.rows)

    @overload
    def __getitem__(self, at: int) -> TextLine: ...

    @overload
    def __getitem__(self, at: slice) -> list[TextLine]: ...

    def __getitem__(self, at: int | slice) -> TextLine | list[TextLine]:
        if isinstance(at, slice):
            return [self[row] for row in range(len(self.rows))[at]]
        found = self._made[at]
        if found is None:
            found = self._made[at] = self._line(at)
        return found

    def _line(self, row: int) -> TextLine:
        number, text, shape = self.numbers[row], self.rows[row], self.shapes[self.kinds[row]]
        if shape is None:
            return READERS[self.family](number, text)
        digits = self.digits[self.begins[row] : self.ends[row]]
        rest, block = shape.rest.format(*(digits[k] for k in shape.held)) if shape.held else shape.rest, ""
        if self.klartext:
            block = digits[0] if shape.numbered else ""
            if shape.numbered and not block.isdecimal():
                return READERS[self.family](number, text)
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

    def _values(self) -> NDArray[np.float64]:
        """All numbers."""
        digits = [each.replace(",", ".") for each in self.digits] if self.klartext else self.digits
        return np.fromiter(map(float, digits), np.float64, len(digits))

    def straight(self, axes: Sequence[str]) -> StraightLines:
        """The lines that only bring these axes straight to places, in columns."""
        n = len(self.rows)
        found = StraightLines(
            np.zeros(n, dtype=bool),
            np.full((n, len(axes)), -1, dtype=np.intp),
            np.zeros((n, len(axes)), dtype=bool),
            self._values(),
            np.full(n, -1, dtype=np.intp),
            np.full(n, -1, dtype=np.intp),
            np.zeros(n, dtype=bool),
        )
        order = np.argsort(self.kinds, kind="stable")
        bounds = np.searchsorted(self.kinds[order], np.arange(len(self.shapes) + 1))
        for shape, first, stop in zip(self.shapes, bounds, bounds[1:], strict=False):
            if shape is None or not shape.is_straight or not all(name[-1] in axes for name, _ in shape.path):
                continue
            rows = order[first:stop]
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
                found.is_straight[rows] &= [self.digits[at].isdecimal() for at in begin.tolist()]
        return found

    def _shape(self, key: str) -> PlainShape | None:
        """The shape that a text has whose numbers are marks; None if it takes more than a look to read it."""
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


def same_but_axes(first: Lines, rows: NDArray[np.intp], second: Lines, others: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Which plain lines (n,) have the same words and texts as others (n,), but for numbers of axes and further axes."""
    kinds, theirs = first.kinds[rows], second.kinds[others]
    codes, inverse = np.unique(kinds * len(second.shapes) + theirs, return_inverse=True)
    found = np.zeros(len(rows), dtype=bool)
    digits, texts = np.array(first.digits, dtype=object), np.array(second.digits, dtype=object)
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
            same &= digits[here + k] == texts[there + j]
        found[each] = same
    return found


class StraightLines(NamedTuple):
    """Lines that only bring axes straight to places: n lines, a axes.

    is_straight  (n,) which lines these are
    word         (n, a) where the number of the word of an axis stands among `values`; -1: it has none
    counted      (n, a) this word is an increment, whatever the mode
    values       all numbers of the program
    code, feed   (n,) the same of G, 0 or 1, and of F
    rapid        (n,) with FMAX
    """

    is_straight: NDArray[np.bool_]
    word: NDArray[np.intp]
    counted: NDArray[np.bool_]
    values: NDArray[np.float64]
    code: NDArray[np.intp]
    feed: NDArray[np.intp]
    rapid: NDArray[np.bool_]
