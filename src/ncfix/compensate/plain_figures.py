"""The tip errors of a part of plain motions, before and after: mostly from what is known of their ends.

Where a motion is so short that its error cannot bend, it is looked at where it ends only. What the tip is off there was
found when the end was corrected, and what is left is what the numbers that were written differ from those that were
meant (see `known`). All other motions are looked at along their way, as `verify` does.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ncfix import fast
from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.known import TURNED, Known
from ncfix.compensate.plain import Course
from ncfix.compensate.ragged import owners, places
from ncfix.compensate.rows import greatest, lengths
from ncfix.compensate.sampling import features, passed
from ncfix.compensate.verify import STRAIGHT, FigureTally, PathError, Samples, samples
from ncfix.compensate.written import Written
from ncfix.program.emit import Emission
from ncfix.program.moves import Kind
from ncfix.program.pieces import Pieces


def figures(course: Course, text: Emission, rapids: bool) -> PathError:
    """Tip errors over the motions that cut, and over rapids if the tolerance holds along them."""
    moves, start, end = course.part.moves, text.start, course.last(text.end)
    shown = (moves.kind != Kind.DWELL) & (rapids | (moves.kind != Kind.RAPID))
    tally, along = FigureTally(len(moves)), _in_pieces_or_kinked(course, start, end)
    along |= ~course.plain | course.behind_dwells
    (_compiled if fast.engaged() else _by_columns)(course, text, (start, end), (shown, along), tally)
    rows = np.flatnonzero(along & shown)
    if rows.size:
        for part in _along(course, text, rows):
            tally.add(part)
    return tally.result()


def _in_pieces_or_kinked(course: Course, start: Array, end: Array) -> Mask:
    """(n,) motions in several pieces, or with a kink of the error on their way."""
    found: Mask = np.diff(course.first) > 1
    found[passed(course.intent, start, end)[0]] = True
    return found


def _by_columns(
    course: Course, text: Emission, ends: tuple[Array, Array], masks: tuple[Mask, Mask], tally: FigureTally
) -> None:
    """Count the errors at the ends of motions that need no more; the others are marked."""
    shown, along = masks
    along |= _to_be_followed(course, ends[1])
    rows = np.flatnonzero(shown & ~along)
    if rows.size:
        tally.add(_at_ends(course, *ends, rows))


def _compiled(
    course: Course, text: Emission, ends: tuple[Array, Array], masks: tuple[Mask, Mask], tally: FigureTally
) -> None:
    """As `_by_columns`."""
    from ncfix.compensate import plain_kernels

    moves, machine, sums, places = course.part.moves, course.intent.machine, np.zeros(5), np.full(3, -1)
    assert machine.linear_ways is not None
    places[0] = 0
    plain_kernels.at_ends(
        (moves.start, moves.end),
        (text.start[0], text.end, course.first),
        (course.real.end, course.before),
        (features(machine), np.ascontiguousarray(machine.linear_ways), course.intent.columns, ~machine.rotary),
        (STRAIGHT, TURNED),
        masks,
        (sums, places),
    )
    way, *squares = sums[:3].tolist()
    count, *rows = places.tolist()
    tally.take(way, count, squares, [(most, row, 1.0) for most, row in zip(sums[3:].tolist(), rows, strict=True)])


def _to_be_followed(course: Course, end: Array) -> Mask:
    """(n,) motions along which the error may bend, or at the end of which it is not known."""
    moves, machine = course.part.moves, course.intent.machine
    found: Mask = (np.abs(moves.end - moves.start) / features(machine)).sum(axis=1) >= STRAIGHT
    found |= greatest(np.abs(end - course.real.end)[:, machine.rotary]) > TURNED
    return found


def _at_ends(course: Course, start: Array, end: Array, rows: Index) -> Samples:
    """The errors at the ends of motions `rows` (k,), each for its whole way."""
    ways, columns = course.intent.machine.linear_ways, course.intent.columns
    assert ways is not None
    chosen = slice(None) if len(rows) == len(end) else rows
    off = (end[chosen] - course.real.end[chosen])[:, columns] @ ways.T
    way = lengths((end[chosen] - start[chosen])[:, ~course.intent.machine.rotary])
    return Samples(rows, np.ones(len(rows)), course.before[chosen], lengths(off), way, 0.0, 0.0)


def _along(course: Course, text: Emission, rows: Index) -> Iterator[Samples]:
    """The errors along motions `rows` (k,)."""
    counts = np.diff(course.first)[rows]
    own = np.repeat(course.first[:-1][rows], counts) + places(counts)
    whole, no = course.pieces, np.broadcast_to(False, len(own))
    pieces = Pieces(rows[owners(counts)], whole.fraction[own], text.end[own], whole.arc[own], text.centre[own], no)
    written = Written(course.intent, pieces, text.start)
    known = Known(course.before, course.real.end)
    return samples(written, np.arange(len(own)), tilts=False, known=known, uneasy=course.behind_dwells)
