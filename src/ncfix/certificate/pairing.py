"""The second reader: which lines of the corrected program stand for which line of the original.

A correction changes numbers, adds words of axes behind others, and puts further lines behind the line of a motion that
it splits. All else has to stay. So lines that hold more than a path are found again by their other words; between them,
lines are told apart by where they lead.
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
"""Lines that are looked at for where a line that should be here has gone."""
FAR = 30
"""Lines that are looked at for where two programs agree again."""
SEVERAL = 3
"""So many lines are looked at one by one before those behind them are compared at once."""
MOTION = {
    Family.WORDS: re.compile(r"[ \t]*(?<![A-Z])G[ \t]*0?[0-3](?![\d.])", re.IGNORECASE),
    Family.KLARTEXT: re.compile(r"[ \t]*(?<![\w.])(?:L|CC|CP|CR|C|DR[+-])(?![\w.+-])", re.IGNORECASE),
}
STOPS = re.compile(r"[ \t]*(?<![A-Z])(?:M[ \t]*0*(?:0|1|2|30|60)|G[ \t]*0*9)(?![\d.])", re.IGNORECASE)
"""Words that hold the program or the tool at the end of a motion."""
LATE = {
    Family.WORDS: re.compile(rf"{STOPS.pattern}|[ \t]*(?<![A-Z])M[ \t]*0*(?:5|9|99)(?![\d.])", re.IGNORECASE),
    Family.SINUMERIK: re.compile(rf"{STOPS.pattern}|[ \t]*(?<![A-Z])M[ \t]*0*17(?![\d.])", re.IGNORECASE),
    Family.KLARTEXT: re.compile(
        rf"{STOPS.pattern}|[ \t]*(?<![A-Z])M[ \t]*0*(?:5|6|9|111|115|117|127|129|135|137|145|149)(?![\d.])",
        re.IGNORECASE,
    ),
}
"""Words that act at the end of a motion, with those of `STOPS`: the last of its pieces may have them."""
ARCS = ("C", "CP", "CR")
"""Arcs of Klartext."""
SKIP = re.compile(r"[ \t]*/\d?")
PACE = re.compile(
    r"[ \t]*(?:(?<![A-Z])(?:F(?:[ \t]*=)?[ \t]*(?:[\d.]+|MAX)|(?:G9[34]|P[ \t]*\d+)(?![\d.]))"
    r"|(?<![\w.])R[0LR](?![\w.]))",
    re.IGNORECASE,
)


class LinePair(NamedTuple):
    """An original line, and the first and the last of the lines in its place (indices)."""

    row: int
    first: int
    last: int


class LinePairs(Sequence[LinePair]):
    """Pairs in the order of their lines."""

    def __init__(self, numbers: Iterable[int] = ()) -> None:
        self._numbers = array("i", numbers)

    @property
    def columns(self) -> NDArray[np.int32]:
        """(n, 3) as in `LinePair`."""
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
        """One more pair."""
        self._numbers.extend((row, first, last))

    def append_run(self, row: int, at: int, count: int) -> None:
        """So many lines with one line each in their place."""
        both = np.arange(count, dtype=np.int32)[:, None] + np.array([row, at, at], dtype=np.int32)
        self._numbers.frombytes(both.tobytes())

    def pop(self) -> LinePair:
        """Take the last one out."""
        last = self[-1]
        del self._numbers[-3:]
        return last


BLOCK = re.compile(rf"N({NUMBER})")
NO_KEY, EMPTY_KEY = 0, 1
"""Of lines that hold only a path, and of those that hold nothing."""


@mutable
class Pairing:
    """Two programs, and how near a corrected line leads to where the correction of an original one should."""

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
    """Original lines among which nobody can say which added line belongs to which."""

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
        """What the lines of a program hold besides a path and its pace, as a number; alike lines have the same.

        holes  lines at which a cycle is called: other lines may say what they hold
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
        """What a line holds besides a path and its pace; None for a line that holds nothing else."""
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
        """Lines that hold a path only, from here on in both; the line before may have been split, too."""
        end, stop = _end_of_paths(own, i), _end_of_paths(other, j)
        if self.pairs and self.pairs[-1].row == i - 1 and self.original.lines[i - 1].path:
            i, j = i - 1, self.pairs.pop().first
        more = (stop - j) - (end - i)  # lines that must have been put in from here on
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
        """The last of the lines that stand for one; what puts a feed or a pole back stands behind its last piece."""
        last = self._last(row, first, first + max(more, 0), min(stop, first + AHEAD))
        if last + 1 >= stop or more <= last - first:
            return last
        ours, behind = self.original.lines, self.corrected.lines[last + 1]
        following = ours[min(row + 1, len(ours) - 1)]
        if calls_only(self.original.family, behind):
            return last + (self.moves(row) and self._puts_back(last + 1, following))
        feed = not behind.path and following.path != []
        pole = _begins(behind, "CC") and _begins(ours[row], *ARCS)
        return last + (feed or (pole and not _begins(following, "CC", *ARCS)))  # a pole before an arc belongs to that

    def _puts_back(self, at: int, following: TextLine) -> bool:
        """Whether a line that calls a hole, or gives it another depth, ends what was put round the hole before it."""
        line, lines = self.corrected.lines[at], self.corrected.lines
        if self.original.family is Family.KLARTEXT:
            return line.rest.strip().upper().startswith("FN 2") and not following.says(line)
        leads = at + 1 < len(lines) and bool(lines[at + 1].path)
        return not (leads and "CYCLE" in line.rest.upper()) and not following.says(line)

    def _is_gone(self, row: int, at: int, end: int) -> bool:
        """Whether a line is not there any more: the next one leads where its correction should, and it does not."""
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
        """The first of these lines that leads where the correction of an original line should.

        most  as many lines are there more than in the original; if a line is lost elsewhere, it may be a later one

        If none does, the line itself has changed.
        """
        ours, theirs = self.original.lines[row], self.corrected.lines[first]
        if (ours.rest, ours.path) == (theirs.rest, theirs.path):
            return first  # left as it was programmed; what follows brings the tool back
        found = next((at for at in range(first, most + 1) if self.nearness(row, at)), None)
        if found is None and self.followed(row) and not self.nearness(row + 1, most + 1):
            found = next((at for at in range(most + 1, stop) if self.nearness(row, at)), None)
        return first if found is None else found

    def _apart(self, own: Sequence[int], other: Sequence[int], i: int, j: int) -> tuple[int, int]:
        """Lines that hold more than a path and differ: one is lost, added, or changed."""
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
            self.faults.append(BlockFault("a line is not there any more", self._line(), line))

    def _line(self) -> int:
        return self.corrected.lines[self.pairs[-1].last].number if self.pairs else 1

    def _extra(self, first: int, stop: int) -> None:
        for line in self.corrected.lines[first:stop]:
            if line.rest.strip() or line.path:
                self.faults.append(BlockFault("a line that the original does not have", line.number, 0))


def _number(key: str | None) -> int:
    """A number for what a line holds, the same for the same; that two texts have one by chance is harmless."""
    if not key:
        return NO_KEY if key is None else EMPTY_KEY
    block = BLOCK.match(key)
    return hash(key[block.end() :]) ^ hash_of(block[1]) if block else hash(key)


def _end_of_paths(keys: Sequence[int], at: int) -> int:
    """The first line from here on that holds more than a path."""
    while at < len(keys) and keys[at] == NO_KEY:
        at += 1
    return at


def _ahead(keys: Sequence[int], at: int, wanted: int) -> int:
    """How far behind a line there is one with this key, `FAR` if there is none near."""
    if wanted in (NO_KEY, EMPTY_KEY):
        return FAR
    return next((k for k in range(1, FAR) if at + k < len(keys) and keys[at + k] == wanted), FAR)


def _begins(line: TextLine, *names: str) -> bool:
    """Whether a line of Klartext begins with one of these words."""
    return bool(line.codes) and line.codes[0].name in names


def hole_faults(pairing: Pairing, pair: LinePair, call: HoleCall) -> list[str]:
    """What is wrong with the text of the lines that stand for a hole whose cycle is called."""
    family, line = pairing.original.family, pairing.original.lines[pair.row]
    pieces = pairing.corrected.lines[pair.first : pair.last + 1]
    led, names = [piece for piece in pieces if piece.path], [word.name for word in line.path]
    found = []
    if any(piece.skipped != line.skipped for piece in pieces):
        found.append("a line of the block has another mark of block delete")
    if len(led) > 1 or any(piece.doubled() for piece in led):
        found.append("two lines or two words lead to a hole")
    if names != [word.name for piece in led for word in piece.path][: len(names)]:
        found.append("the words of axes that lead to a hole have changed")
    if family is Family.KLARTEXT and any(piece.block != line.block for piece in pieces):
        found.append("the block has another number")
    ours, theirs = (hole_text(family, lines) for lines in ([line], pieces))
    if not line.path:  # then the tool is led there by a line that was added
        theirs = [word for word in theirs if word.upper() not in ("L", "G0", "FMAX", "/")]
    if ours != theirs:
        found.append("words that are no axes have changed")
    if not puts_back(call, pieces):
        found.append("what was changed for the hole is not put back behind it")
    return found


def text_faults(pairing: Pairing, pair: LinePair, arc: bool, timed: bool) -> list[str]:
    """What is wrong with the text of the lines that stand for one.

    arc    the motion is an arc: it may have become straight, and its radius a centre
    timed  its F is an inverse time, and its pieces have parts of it
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
        return found  # of other words than before
    free = [LATE[family]] if split else []
    if arc or (klartext and _begins(line, "CC")):
        free.append(MOTION.get(family, MOTION[Family.WORDS]))
    ours, theirs = line.rest, head.rest
    for words in free:
        ours, theirs = words.sub("", ours), words.sub("", theirs)
    if ours.rstrip() != theirs.rstrip() and not _paced(ours, theirs, line, timed):
        found.append("words that are no axes have changed")
    names = [word.name for word in line.path if not arc or word.name in "XYZABCUVW"]
    left = [word.name for word in head.path]
    lost = [f"the word {name} is not there any more" for name in names if name not in left]
    if not (found or lost) and [name for name in left if name in names] != names:
        lost = ["words have changed their places"]
    number = ["the block has another number"] if klartext and head.block != line.block else []
    return [*found, *lost, *number]


def _has_only_more_axes(line: TextLine, other: TextLine) -> bool:
    """Whether a plain line has the words of another in their order, and perhaps more axes behind them."""
    if not (line.plain and other.plain and (line.rest, line.block) == (other.rest, other.block)):
        return False
    return [word.name for word in other.path[: len(line.path)]] == [word.name for word in line.path]


def _late_faults(line: TextLine, pieces: Sequence[TextLine], late: re.Pattern[str]) -> list[str]:
    """What is wrong with the words of pieces that act at the end of their block."""
    if _words(STOPS, line.rest) != _words(STOPS, pieces[-1].rest):
        return ["a stop is not at the end of the pieces of its block"]
    if sorted(_words(late, line.rest)) != sorted(word for piece in pieces for word in _words(late, piece.rest)):
        return ["a word that acts at the end of the block is lost, or there twice"]
    return []


def _words(which: re.Pattern[str], text: str) -> list[str]:
    return [found.strip() for found in which.findall(text)]


def _paced(ours: str, theirs: str, line: TextLine, timed: bool) -> bool:
    """Whether only a feed was put in or changed, for a turn of rotary axes alone, or an inverse time."""
    turn = bool(line.path) and all(word.name in "ABC" for word in line.path)
    return (turn or timed) and PACE.sub("", ours).strip() == PACE.sub("", theirs).strip()
