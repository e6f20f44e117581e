"""Parts of plain motions as text, and their tip errors before and after: mostly from what is known of their ends.

What the tip is off at an end was found when the end was corrected, and what is left is what the numbers that were
written differ from those that were meant (see `written.Known`). Motions over which the error may bend are looked at
inside, too, in the places at which `deviation` would look; the few that are made of pieces, or pass a kink, it looks at
itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ncfix import core
from ncfix.compensate.plain import PlainPlan
from ncfix.compensate.plan.arrays import (
    Array,
    Index,
    Mask,
    batches,
    greatest,
    lengths,
    owners,
    picked,
    places,
    squares,
    totals,
)
from ncfix.compensate.plan.deviation import BATCH, STRAIGHT, FigureTally, PathError, PathSamples, errors_at, samples
from ncfix.compensate.plan.sampling import DENSITY, MOST_SHOWN, bends_closely, even, features, passed
from ncfix.compensate.plan.segments import Segments
from ncfix.compensate.plan.written import TURNED, Known, WrittenPieces, standing_still
from ncfix.control.moves import MotionKind
from ncfix.writer.bulk import Bulk
from ncfix.writer.emit import Emission, emit
from ncfix.writer.language import WrittenLanguage
from ncfix.writer.pieces import Pieces


def written(language: WrittenLanguage, course: PlainPlan, position: Array, steps: Array) -> Emission | None:
    """Write a part; None if any of it cannot be written, or would not move.

    position  (n_axes,) the command at which the control stands
    steps     (n_axes,) what the control can resolve, mm and rad
    """
    program, moves, pieces = course.part.program, course.part.moves, course.pieces
    bulk = Bulk.among(language, program, moves, pieces, course.first, course.plain)
    if bulk is None:
        return None
    emission = emit(program, moves, pieces, steps, done=position, bulk=bulk)
    idle = not course.single and standing_still(pieces, emission.end, emission.start).any()
    return None if emission.conflicts or idle else emission


def largest_shift(course: PlainPlan, emission: Emission) -> float:
    """The largest shift of the linear axes at the end of a motion, mm."""
    moves = course.part.moves
    return float(np.sqrt(squares((course.last(emission.end) - moves.end)[:, ~moves.rotary]).max()))


def figures(course: PlainPlan, text: Emission, rapids: bool) -> PathError:
    """Tip errors over the motions that cut, and over rapids if the tolerance holds along them."""
    moves, written = course.part.moves, replace(course.real, start=text.start, end=course.last(text.end))
    shown = (moves.kind != MotionKind.DWELL) & (rapids | (moves.kind != MotionKind.RAPID))
    uneasy = course.uneasy
    apart = ~course.plain | uneasy | (np.diff(course.first) > 1)
    if moves.tcp[0]:
        apart |= bool(course.intent.kinks)
    else:
        apart[passed(course.intent, written.start, written.end)[0]] = True
    tally = FigureTally()
    counts = (_compiled if core.engaged() else _by_columns)(course, text, written, (shown, apart), tally)
    inside = np.flatnonzero(counts)
    for part in batches(counts[inside], BATCH):
        tally.add(_inside(course, written, inside[part], counts[inside[part]]))
    rows = np.flatnonzero(apart & shown)
    if rows.size:
        for found in _along(course, text, rows, uneasy):
            tally.add(found)
    return tally.result()


def _by_columns(
    course: PlainPlan, text: Emission, written: Segments, masks: tuple[Mask, Mask], tally: FigureTally
) -> Index:
    """Count the errors at the ends of motions that are shown, and not apart; at how many places inside to look, (n,).

    Those at the end of which the error is not known are put apart.
    """
    (shown, apart), moves, machine = masks, course.part.moves, course.intent.machine
    apart |= greatest(np.abs(written.end - course.real.end)[:, machine.rotary]) > TURNED
    bends = totals(np.abs(moves.end - moves.start) / features(machine))
    counts = _looks(course, shown & ~apart, _led_bends(course) if moves.tcp[0] else bends)
    rows = np.flatnonzero(shown & ~apart)
    if rows.size:
        tally.add(_at_ends(course, written, rows, counts))
    return counts


def _compiled(
    course: PlainPlan, text: Emission, written: Segments, masks: tuple[Mask, Mask], tally: FigureTally
) -> Index:
    """As `_by_columns`."""
    from ncfix.core import motions

    moves, machine, sums = course.part.moves, course.intent.machine, np.zeros(5)
    assert machine.linear_ways is not None
    places = np.array([0, -1, -1], dtype=np.int64)
    counts, (shown, apart), bending = np.zeros(len(moves), dtype=np.intp), masks, features(machine)
    if moves.tcp[0]:
        counts, bending = _looks(course, shown, _led_bends(course)), np.full_like(bending, np.inf)
    linear, followed = ~machine.rotary, moves.kind == MotionKind.FEED
    motions.at_ends(
        moves.start,
        moves.end,
        text.start[0],
        text.end,
        course.first,
        course.real.end,
        course.before,
        bending,
        np.ascontiguousarray(machine.linear_ways),
        course.intent.columns,
        linear.view(np.uint8),
        STRAIGHT,
        TURNED,
        DENSITY,
        MOST_SHOWN,
        shown.view(np.uint8),
        apart.view(np.uint8),
        followed.view(np.uint8),
        sums,
        places,
        counts,
    )
    way, *squares = sums[:3].tolist()
    count, *rows = places.tolist()
    counts[apart] = 0
    tally.take(way, count, squares, [(most, row, 1.0) for most, row in zip(sums[3:].tolist(), rows, strict=True)])
    return counts


def _led_bends(course: PlainPlan) -> Array:
    """About how many times the error may bend along each motion under TCP, (n,)."""
    return bends_closely(course.intent, np.arange(len(course.part.moves)))


def _looks(course: PlainPlan, among: Mask, bends: Array) -> Index:
    """At how many places inside of motions `among` (n,) to look, over which the error may bend so many times, (n,)."""
    bent = among & (course.part.moves.kind == MotionKind.FEED) & (bends >= STRAIGHT)
    return np.where(bent, np.minimum(np.ceil(DENSITY * bends), MOST_SHOWN), 0).astype(np.intp)


def _at_ends(course: PlainPlan, written: Segments, rows: Index, counts: Index) -> PathSamples:
    """The errors at the ends of motions `rows` (k,), each for its share of the way; `counts` (n,) places are inside."""
    ways, columns = course.intent.machine.linear_ways, course.intent.columns
    assert ways is not None
    chosen = slice(None) if len(rows) == len(counts) else rows
    off = (written.end[chosen] - course.real.end[chosen])[:, columns] @ ways.T
    way = lengths((written.end[chosen] - written.start[chosen])[:, ~course.intent.machine.rotary]) / (
        counts[chosen] + 1
    )
    return PathSamples(rows, np.ones(len(rows)), course.before[chosen], lengths(off), way, 0.0, 0.0)


def _inside(course: PlainPlan, written: Segments, rows: Index, counts: Index) -> PathSamples:
    """The errors inside of motions `rows` (k,), at `counts` (k,) places each."""
    intent, move, fraction = course.intent, np.repeat(rows, counts), even(counts)
    chord = (picked(written.end, rows) - picked(written.start, rows))[:, ~intent.machine.rotary]
    weight = np.repeat(lengths(chord) / (counts + 1), counts)
    return PathSamples(move, fraction, *errors_at(intent, move, fraction, written.at(move, fraction)), weight, 0.0, 0.0)


def _along(course: PlainPlan, text: Emission, rows: Index, uneasy: Mask) -> Iterator[PathSamples]:
    """The errors along motions `rows` (k,); `uneasy` (n,) as in `PlainPlan`."""
    counts = np.diff(course.first)[rows]
    own = np.repeat(course.first[:-1][rows], counts) + places(counts)
    whole, no = course.pieces, np.broadcast_to(False, len(own))
    pieces = Pieces(rows[owners(counts)], whole.fraction[own], text.end[own], whole.arc[own], text.centre[own], no)
    written = WrittenPieces(course.intent, pieces, text.start)
    known = Known(course.before, course.real.end)
    return samples(written, np.arange(len(own)), tilts=False, known=known, uneasy=uneasy)
