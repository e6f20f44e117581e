"""The tip errors of a part of plain motions, before and after: mostly from what is known of their ends.

Where a motion is so short that its error cannot bend, it is looked at where it ends only. What the tip is off there was
found when the end was corrected, and what is left is what the numbers that were written differ from those that were
meant (see `known`). All other motions are looked at along their way, as `verify` does.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.known import TURNED, Known
from ncfix.compensate.plain import Course
from ncfix.compensate.plain_text import PlainText
from ncfix.compensate.ragged import owners, places
from ncfix.compensate.rows import lengths
from ncfix.compensate.sampling import features, passed
from ncfix.compensate.verify import STRAIGHT, FigureTally, PathError, Samples, samples
from ncfix.compensate.written import Written
from ncfix.program.moves import Kind
from ncfix.program.pieces import Pieces


def figures(course: Course, text: PlainText, rapids: bool) -> PathError:
    """Tip errors over the motions that cut, and over rapids if the tolerance holds along them."""
    moves = course.part.moves
    start = np.concatenate([text.start[None], text.end[course.first[1:-1] - 1]])
    end = text.end if course.single else text.end[course.first[1:] - 1]
    shown = np.ones(len(moves), dtype=bool) if rapids else moves.kind == Kind.FEED
    along = shown & _to_be_followed(course, start, end)
    tally = FigureTally(len(moves))
    ends = np.flatnonzero(shown & ~along)
    if ends.size:
        tally.add(_at_ends(course, start, end, ends))
    rows = np.flatnonzero(along)
    if rows.size:
        for part in _along(course, text, start, rows):
            tally.add(part)
    return tally.result()


def _to_be_followed(course: Course, start: Array, end: Array) -> Mask:
    """(n,) motions of which more than the end is to be looked at, or at the end of which the errors are not known."""
    moves, machine = course.part.moves, course.intent.machine
    found: Mask = (np.abs(moves.end - moves.start) / features(machine)).sum(axis=1) >= STRAIGHT
    found |= np.abs(end - course.wanted)[:, machine.rotary].max(axis=1, initial=0.0) > TURNED
    found[passed(course.intent, start, end)[0]] = True
    return found if course.single else found | (np.diff(course.first) > 1)


def _at_ends(course: Course, start: Array, end: Array, rows: Index) -> Samples:
    """The errors at the ends of motions `rows` (k,), each for its whole way."""
    ways, columns = course.intent.machine.linear_ways, course.intent.columns
    assert ways is not None
    chosen = slice(None) if len(rows) == len(end) else rows
    off = (end[chosen] - course.wanted[chosen])[:, columns] @ ways.T
    way = lengths((end[chosen] - start[chosen])[:, ~course.intent.machine.rotary])
    return Samples(rows, np.ones(len(rows)), course.before[chosen], lengths(off), way, 0.0, 0.0)


def _along(course: Course, text: PlainText, start: Array, rows: Index) -> Iterator[Samples]:
    """The errors along motions `rows` (k,)."""
    counts = np.diff(course.first)[rows]
    own = np.repeat(course.first[:-1][rows], counts) + places(counts)
    whole, no = course.pieces, np.broadcast_to(False, len(own))
    nowhere = np.broadcast_to(np.nan, (len(own), 3))
    pieces = Pieces(rows[owners(counts)], whole.fraction[own], text.end[own], no, nowhere, no)
    written = Written(course.intent, pieces, start)
    known, easy = Known(course.before, course.wanted), np.zeros(len(start), dtype=bool)
    return samples(written, np.arange(len(own)), tilts=False, known=known, uneasy=easy)
