"""The second reader: the lines of the corrected program that replace each line of the original.

A correction changes numbers, adds words of axes behind others, and adds lines behind the line of a motion that it
splits. Everything else must stay. So a line that holds more than a path is found again by its other words; between such
lines, motions are assigned by the places to which they lead.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import field
from typing import NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from ncfix.certificate.findings import BlockFault
from ncfix.certificate.holes import HoleCall, calls_only, hole_text, puts_back
from ncfix.certificate.reading import NUMBER, Family, TextLine
from ncfix.certificate.text import Text, hash_of
from ncfix.values import mutable

AHEAD = 8
"""Number of lines that are searched for the last piece of a motion."""
FAR = 30
"""Number of lines that are searched for the place at which two programs agree again."""
SEVERAL = 3
"""Number of lines that must agree one by one before the following ones are compared in columns."""
MOTION = {
    Family.WORDS: re.compile(r"[ \t]*(?<![A-Z])G[ \t]*0?[0-3](?![\d.])", re.IGNORECASE),
    Family.KLARTEXT: re.compile(
        rf"[ \t]*(?<![\w.])(?:(?:LN|L|CC|CP|CR|C|DR[+-])(?![\w.+-])|T[XYZ][ \t]*{NUMBER})", re.IGNORECASE
    ),
}
STOPS = re.compile(r"[ \t]*(?<![A-Z])(?:M[ \t]*0*(?:0|1|2|30|60)|G[ \t]*0*9)(?![\d.])", re.IGNORECASE)
"""Words that stop the program or the motion at the end of a block."""
LATE = {
    Family.WORDS: re.compile(rf"{STOPS.pattern}|[ \t]*(?<![A-Z])M[ \t]*0*(?:5|9|99)(?![\d.])", re.IGNORECASE),
    Family.SINUMERIK: re.compile(rf"{STOPS.pattern}|[ \t]*(?<![A-Z])M[ \t]*0*17(?![\d.])", re.IGNORECASE),
    Family.KLARTEXT: re.compile(
        rf"{STOPS.pattern}|[ \t]*(?<![A-Z])M[ \t]*0*(?:5|6|9|111|115|117|127|129|135|137|145|149)(?![\d.])",
        re.IGNORECASE,
    ),
}
"""Words that act at the end of a motion, including `STOPS`; the last of its pieces may have them."""
ARCS = ("C", "CP", "CR")
"""Arcs of Klartext."""
SKIP = re.compile(r"[ \t]*/\d?")
PACE = re.compile(
    r"[ \t]*(?:(?<![A-Z])(?:F(?:[ \t]*=)?[ \t]*(?:[\d.]+|MAX)|(?:G9[34]|P[ \t]*\d+)(?![\d.]))"
    r"|(?<![\w.])R[0LR](?![\w.]))",
    re.IGNORECASE,
)


class LinePair(NamedTuple):
    """An original line, and the first and last corrected line that replace it (indices from 0)."""

    row: int
    first: int
    last: int


class LinePairs(Sequence[LinePair]):
    """Pairs of lines in the order of the original."""

    def __init__(self, numbers: Iterable[int] = ()) -> None:
        self._numbers = array("i", numbers)

    @property
    def columns(self) -> NDArray[np.int32]:
        """(n, 3) the pairs as rows, with the columns of `LinePair`."""
        return np.array(self._numbers, dtype=np.int32).reshape(-1, 3)

    def __len__(self) -> int:
        return len(self._numbers) // 3

    @overload
    def __getitem__(self, at: int) -> LinePair: ...

    @overload
    def __getitem__(self, at: slice) -> list[LinePair]: ...

    def __getitem__(self, at: int | slice) -> LinePair | list[LinePair]:
        if isinstance(at, slice):
            return [self[k] for k in range(len(self))[at]]
        first = 3 * (at + len(self) if at < 0 else at)
        return LinePair(*self._numbers[first : first + 3])

    def append(self, row: int, first: int, last: int) -> None:
        """Add a pair."""
        self._numbers.extend((row, first, last))

    def append_run(self, row: int, at: int, count: int) -> None:
        """Add `count` consecutive pairs in which one line replaces one line, from lines `row` and `at` on."""
        both = np.arange(count, dtype=np.int32)[:, None] + np.array([row, at, at], dtype=np.int32)
        self._numbers.frombytes(both.tobytes())

    def pop(self) -> LinePair:
        """Remove and return the last pair."""
        last = self[-1]
        del self._numbers[-3:]
        return last


BLOCK = re.compile(rf"N({NUMBER})")
NO_KEY, EMPTY_KEY = 0, 1
"""Keys of lines that hold only a path, and of empty lines."""


@mutable
class Pairing:
    """Assigns the lines of a corrected program to those of its original.

    nearness  (original line, corrected line) -> whether the latter leads where the former's correction should
    run_of    (original line, corrected line, count) -> number of following lines of which that surely holds one by one
    moves     whether an original line is a motion
    followed  whether it is known where an original line leads
    foreign   whether a correction may rewrite an original line in a form unknown to this reader
    holes     lines at which a drilling cycle is called, of the original and of the corrected program
    unsure    original lines among which the assignment of added lines is not clear
    """

    original: Text
    corrected: Text
    nearness: Callable[[int, int], bool]
    run_of: Callable[[int, int, int], int]
    moves: Callable[[int], bool]
    followed: Callable[[int], bool]
    foreign: Callable[[int], bool]
    holes: tuple[Collection[int], Collection[int]] = ((), ())
    pairs: LinePairs = field(default_factory=LinePairs)
    faults: list[BlockFault] = field(default_factory=list)
    unsure: set[int] = field(default_factory=set)

    def run(self) -> None:
        """Find `pairs` and `faults`."""
        ours, theirs = self.original.lines, self.corrected.lines
        own, other = self._keys(self.original, self.holes[0]), self._keys(self.corrected, self.holes[1])
        i = j = 0
        while i < len(ours) or j < len(theirs):
            if i < len(ours) and j < len(theirs) and own[i] == other[j] != NO_KEY:
                self.pairs.append(i, j, j)
                i, j = i + 1, j + 1
            elif (i < len(ours) and own[i] == NO_KEY) or (j < len(theirs) and other[j] == NO_KEY):
                i, j = self._stretch(own, other, i, j)
            else:
                i, j = self._apart(own, other, i, j)

    def _keys(self, text: Text, holes: Collection[int]) -> Sequence[int]:
        """The keys of the lines of a program: a number for the words besides path and feed, equal for equal words.

        holes  lines at which a cycle is called: their key is `NO_KEY`, because a correction may divide their words
        """
        lines = text.read
        if lines is None:
            return [NO_KEY if row in holes else _number(self._key(line)) for row, line in enumerate(text.lines)]
        found = np.full(len(lines), NO_KEY)
        for shape, rows in lines.by_shape():
            begins = lines.begins[rows]
            if shape is None or (shape.numbered and not lines.are_whole(begins).all()):
                found[rows] = [_number(self._key(lines[row])) for row in rows.tolist()]
            elif shape.rest or not shape.path:
                blocks, held = np.zeros(len(rows), dtype=np.intp), shape.held
                if shape.rest.startswith("N{}"):
                    blocks, held = lines.hashes(len(rows), begins + held[0]), held[1:]
                _, some, which = np.unique(
                    lines.hashes(len(rows), *(begins + k for k in held)), return_index=True, return_inverse=True
                )
                keys = [self._key(lines[row]) for row in rows[some].tolist()]
                found[rows] = np.array([_number(key) for key in keys])[which] ^ blocks[some][which] ^ blocks
        found[list(holes)] = NO_KEY
        return array("q", found)

    def _key(self, line: TextLine) -> str | None:
        """The text of a line besides its path and feed; None if there is none."""
        if line.odd:
            return line.rest
        if line.plain and line.path and not line.rest:
            return None
        if calls_only(self.original.family, line):
            return None
        motion = MOTION.get(self.original.family, MOTION[Family.WORDS])
        rest = SKIP.sub("", line.rest, 1) if line.skipped else line.rest
        bare = motion.sub("", LATE[self.original.family].sub("", rest)) if line.path else line.rest
        if not PACE.sub("", bare).strip() and (line.path or PACE.search(line.rest)):
            return None
        return PACE.sub("", bare) if line.path else bare

    def _stretch(self, own: Sequence[int], other: Sequence[int], i: int, j: int) -> tuple[int, int]:
        """Pair a stretch of lines that hold only a path, from lines i and j on; the line before may be split, too.

        Returns the lines behind the stretch.
        """
        end, stop = _end_of_paths(own, i), _end_of_paths(other, j)
        if self.pairs and self.pairs[-1].row == i - 1 and self.original.lines[i - 1].path:
            i, j = i - 1, self.pairs.pop().first
        more = (stop - j) - (end - i)  # number of lines added from here on
        row, astray = i, False
        while row < end:
            count = min(end - row, stop - j) - 1
            near = count > SEVERAL and all(self.nearness(row + k, j + k) for k in range(SEVERAL))
            if near and (count := self.run_of(row, j, count)):  # one line each, from here on
                self.pairs.append_run(row, j, count)
                row, j, astray = row + count, j + count, False
            unfollowed = more > 0 and not self.followed(row)
            if unfollowed and not (j < stop and self.original.lines[row].says(self.corrected.lines[j])):
                astray = True  # until a line leads where it should
            if astray:
                self.unsure.add(row)
            whole = row == end - 1 and not (more > 0 and end < len(own) and self.foreign(end))
            if j >= stop or (not whole and self._is_gone(row, j, end)):
                self._lost(row)
                more += 1
            else:
                last = stop - 1 if whole else self._last_piece(row, j, more, stop)
                self.pairs.append(row, j, last)
                astray = astray and not (self.moves(row) and self.followed(row) and self.nearness(row, last))
                more -= last - j
                j = last + 1
            row += 1
        if i == end or more > 0:
            self._extra(j, stop)
        return end, stop

    def _last_piece(self, row: int, first: int, more: int, stop: int) -> int:
        """The last of the lines that replace line `row`: its last piece, or a line that restores feed or pole."""
        last = self._last(row, first, first + max(more, 0), min(stop, first + AHEAD))
        if last + 1 >= stop or more <= last - first:
            return last
        ours, behind = self.original.lines, self.corrected.lines[last + 1]
        following = ours[min(row + 1, len(ours) - 1)]
        if calls_only(self.original.family, behind):
            return last + (self.moves(row) and self._puts_back(last + 1, following))
        feed = not behind.path and following.path != []
        pole = _begins(behind, "CC") and _begins(ours[row], *ARCS)
        return last + (feed or (pole and not _begins(following, "CC", *ARCS)))  # a pole before an arc is the arc's

    def _puts_back(self, at: int, following: TextLine) -> bool:
        """Whether line `at`, which calls a hole or sets its depth, restores the state behind the hole before it."""
        line, lines = self.corrected.lines[at], self.corrected.lines
        if self.original.family is Family.KLARTEXT:
            return line.rest.strip().upper().startswith("FN 2") and not following.says(line)
        leads = at + 1 < len(lines) and bool(lines[at + 1].path)
        return not (leads and "CYCLE" in line.rest.upper()) and not following.says(line)

    def _is_gone(self, row: int, at: int, end: int) -> bool:
        """Whether original line `row` is missing: corrected line `at` fits the next original line, but not this one."""
        return (
            row + 1 < end
            and self.followed(row)
            and self.followed(row + 1)
            and self.moves(row + 1)
            and not self.original.lines[row].says(self.corrected.lines[at])
            and not self.nearness(row, at)
            and self.nearness(row + 1, at)
        )

    def _last(self, row: int, first: int, most: int, stop: int) -> int:
        """The first line from `first` on that leads where the correction of original line `row` should.

        most  last line that it can be by the number of added lines; if a line is lost elsewhere, up to before `stop`

        If there is none, the line itself has changed, and `first` is returned.
        """
        ours, theirs = self.original.lines[row], self.corrected.lines[first]
        if (ours.rest, ours.path) == (theirs.rest, theirs.path):
            return first  # left as programmed; a later line brings the tool back
        found = next((at for at in range(first, most + 1) if self.nearness(row, at)), None)
        if found is None and self.followed(row) and not self.nearness(row + 1, most + 1):
            found = next((at for at in range(most + 1, stop) if self.nearness(row, at)), None)
        return first if found is None else found

    def _apart(self, own: Sequence[int], other: Sequence[int], i: int, j: int) -> tuple[int, int]:
        """Handle different lines that hold more than a path: one is lost, added, or changed. Returns the next lines."""
        here = other[j] if j < len(other) else NO_KEY
        there = own[i] if i < len(own) else NO_KEY
        lost, more = _ahead(own, i, here), _ahead(other, j, there)
        if j >= len(other) or (lost < FAR and lost <= more):
            count = len(own) - i if j >= len(other) else lost
            for row in range(i, i + count):
                self._lost(row)
            return i + count, j
        if i >= len(own) or more < FAR:
            count = len(other) - j if i >= len(own) else more
            self._extra(j, j + count)
            return i, j + count
        self.pairs.append(i, j, j)
        return i + 1, j + 1

    def _lost(self, row: int) -> None:
        if self.original.lines[row].rest.strip() or self.original.lines[row].path:
            line = self.original.lines[row].number
            self.faults.append(BlockFault("a line is missing", self._line(), line))

    def _line(self) -> int:
        return self.corrected.lines[self.pairs[-1].last].number if self.pairs else 1

    def _extra(self, first: int, stop: int) -> None:
        for line in self.corrected.lines[first:stop]:
            if line.rest.strip() or line.path:
                self.faults.append(BlockFault("the original does not have this line", line.number, 0))


def _number(key: str | None) -> int:
    """The key for a text besides path and feed, equal for equal texts; a chance collision is harmless."""
    if not key:
        return NO_KEY if key is None else EMPTY_KEY
    block = BLOCK.match(key)
    return hash(key[block.end() :]) ^ hash_of(block[1]) if block else hash(key)


def _end_of_paths(keys: Sequence[int], at: int) -> int:
    """The first line from `at` on that holds more than a path."""
    while at < len(keys) and keys[at] == NO_KEY:
        at += 1
    return at


def _ahead(keys: Sequence[int], at: int, wanted: int) -> int:
    """The distance from line `at` to the next line with key `wanted`; `FAR` if there is none near."""
    if wanted in (NO_KEY, EMPTY_KEY):
        return FAR
    return next((k for k in range(1, FAR) if at + k < len(keys) and keys[at + k] == wanted), FAR)


def _begins(line: TextLine, *names: str) -> bool:
    """Whether a line of Klartext begins with one of these words."""
    return bool(line.codes) and line.codes[0].name in names


def hole_faults(pairing: Pairing, pair: LinePair, call: HoleCall) -> list[str]:
    """The faults of the text of the lines that replace a hole whose cycle is called."""
    family, line = pairing.original.family, pairing.original.lines[pair.row]
    pieces = pairing.corrected.lines[pair.first : pair.last + 1]
    led, names = [piece for piece in pieces if piece.path], [word.name for word in line.path]
    found = []
    if any(piece.skipped != line.skipped for piece in pieces):
        found.append("a line of the block has another mark of block delete")
    if len(led) > 1 or any(piece.doubled() for piece in led):
        found.append("two lines or two words give the position of a hole")
    if names != [word.name for piece in led for word in piece.path][: len(names)]:
        found.append("the axis words of a hole have changed")
    if family is Family.KLARTEXT and any(piece.block != line.block for piece in pieces):
        found.append("the block has another number")
    ours, theirs = (hole_text(family, lines) for lines in ([line], pieces))
    if not line.path:  # then the tool is led there by a line that was added
        theirs = [word for word in theirs if word.upper() not in ("L", "G0", "FMAX", "/")]
    if ours != theirs:
        found.append("words other than axis words have changed")
    if not puts_back(call, pieces):
        found.append("the change for the hole is not cancelled after it")
    return found


def text_faults(pairing: Pairing, pair: LinePair, arc: bool, timed: bool) -> list[str]:
    """The faults of the text of the lines that replace a line.

    arc    the motion is an arc: its pieces may be straight, and a radius may have become a centre
    timed  its F is an inverse time, so that its pieces have other values
    """
    family, line = pairing.original.family, pairing.original.lines[pair.row]
    pieces = pairing.corrected.lines[pair.first : pair.last + 1]
    head, split = pieces[0], len(pieces) > 1
    if line.odd or (not split and _has_only_more_axes(line, head)):
        return []
    found: list[str] = []
    if any(piece.skipped != line.skipped for piece in pieces):
        found.append("a line of the block has another mark of block delete")
    twice = "" if line.doubled() else next((piece.doubled() for piece in pieces if piece.doubled()), "")
    if line.path and twice:
        found.append(f"two words {twice} in a block")
    if split:
        found += _late_faults(line, pieces, LATE[family])
    klartext = family is Family.KLARTEXT
    turned = _begins(head, "CC") or (_begins(head, "CP") and not _begins(line, "CP"))
    if klartext and arc and (split or turned):
        return found  # its words may differ from the original ones
    free = [LATE[family]] if split else []
    if arc or (klartext and _begins(line, "CC")):
        free.append(MOTION.get(family, MOTION[Family.WORDS]))
    ours, theirs = line.rest, head.rest
    for words in free:
        ours, theirs = words.sub("", ours), words.sub("", theirs)
    if ours.rstrip() != theirs.rstrip() and not _paced(ours, theirs, line, timed):
        found.append("words other than axis words have changed")
    names = [word.name for word in line.path if not arc or word.name in "XYZABCUVW"]
    left = [word.name for word in head.path]
    lost = [f"the word {name} is missing" for name in names if name not in left]
    if not (found or lost) and [name for name in left if name in names] != names:
        lost = ["words have changed their order"]
    number = ["the block has another number"] if klartext and head.block != line.block else []
    return [*found, *lost, *number]


def _has_only_more_axes(line: TextLine, other: TextLine) -> bool:
    """Whether plain line `other` has the words of plain line `line` in order, and at most more axes behind them."""
    if not (line.plain and other.plain and (line.rest, line.block) == (other.rest, other.block)):
        return False
    return [word.name for word in other.path[: len(line.path)]] == [word.name for word in line.path]


def _late_faults(line: TextLine, pieces: Sequence[TextLine], late: re.Pattern[str]) -> list[str]:
    """The faults of pieces in words that act at the end of a block."""
    if _words(STOPS, line.rest) != _words(STOPS, pieces[-1].rest):
        return ["a stop is not at the end of the pieces of its block"]
    if sorted(_words(late, line.rest)) != sorted(word for piece in pieces for word in _words(late, piece.rest)):
        return ["a word that acts at the end of the block is missing or appears twice"]
    return []


def _words(which: re.Pattern[str], text: str) -> list[str]:
    return [found.strip() for found in which.findall(text)]


def _paced(ours: str, theirs: str, line: TextLine, timed: bool) -> bool:
    """Whether the texts differ in the feed only, and it may change: a turn of rotary axes alone, or inverse time."""
    turn = bool(line.path) and all(word.name in "ABC" for word in line.path)
    return (turn or timed) and PACE.sub("", ours).strip() == PACE.sub("", theirs).strip()
