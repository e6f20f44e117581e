"""The text of parts of plain motions, and their tip errors before and after the correction.

The tip error at the end of a motion is known from its correction; the error that is left is the difference between
written and meant commands (see `written.Known`). Motions over which the error may bend are sampled inside too, at the
same places as in `deviation`. The few motions that are split, or pass a kink, are sampled by `deviation` itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ncfix.arrays import Array, Index, Mask, batches, lengths, owners, picked, ranges, squares
from ncfix.compensate.plain import PlainPlan
from ncfix.compensate.plan.deviation import BATCH, STRAIGHT, errors_at, samples
from ncfix.compensate.plan.figure_tally import FigureTally, PathError, PathSamples
from ncfix.compensate.plan.sampling import DENSITY, MOST_SHOWN, bends_closely, even, features, passed
from ncfix.compensate.plan.segments import Segments
from ncfix.compensate.plan.written import TURNED, Known, WrittenPieces, standing_still
from ncfix.control.moves import MotionKind
from ncfix.writer.bulk import Bulk
from ncfix.writer.emit import Emission, emit
from ncfix.writer.language import WrittenLanguage
from ncfix.writer.pieces import Pieces


def written(language: WrittenLanguage, plan: PlainPlan, position: Array, steps: Array) -> Emission | None:
    """Write a part; None if a block cannot be written, or a piece would not move.

    position  (n_axes,) the command at which the control stands before the part
    steps     (n_axes,) least increments of the control, mm and rad
    """
    program, moves, pieces = plan.part.program, plan.part.moves, plan.pieces
    bulk = Bulk.among(language, program, moves, pieces, plan.first, plan.plain)
    if bulk is None:
        return None
    emission = emit(program, moves, pieces, steps, done=position, bulk=bulk)
    idle = not plan.single and standing_still(pieces, emission.end, emission.start).any()
    return None if emission.conflicts or idle else emission


def largest_shift(plan: PlainPlan, emission: Emission) -> float:
    """The largest shift of the linear axes at the end of a motion, mm."""
    moves = plan.part.moves
    return float(np.sqrt(squares((plan.last(emission.end) - moves.end)[:, ~moves.rotary]).max()))


def figures(plan: PlainPlan, text: Emission, rapids: bool) -> PathError:
    """Tip errors along the motions that cut and, with `rapids`, along rapids."""
    moves, written = plan.part.moves, replace(plan.real, start=text.start, end=plan.last(text.end))
    shown = (moves.kind != MotionKind.DWELL) & (rapids | (moves.kind != MotionKind.RAPID))
    check_start = plan.check_start
    apart = ~plan.plain | check_start | (np.diff(plan.first) > 1)
    if moves.tcp[0]:
        apart |= bool(plan.intent.kinks)
    else:
        apart[passed(plan.intent, written.start, written.end)[0]] = True
    tally = FigureTally()
    counts = _at_ends(plan, text, written, (shown, apart), tally)
    inside = np.flatnonzero(counts)
    for part in batches(counts[inside], BATCH):
        tally.add(_inside(plan, written, inside[part], counts[inside[part]]))
    rows = np.flatnonzero(apart & shown)
    if rows.size:
        for found in _along(plan, text, rows, check_start):
            tally.add(found)
    return tally.result()


def _at_ends(plan: PlainPlan, text: Emission, written: Segments, masks: tuple[Mask, Mask], tally: FigureTally) -> Index:
    """Add the errors at the ends of motions to the tally, and return (n,) the number of samples inside each motion.

    masks  `shown` (n,): the motions to count; `apart` (n,): motions to leave out, because `deviation` samples them.
           Motions whose error at the end is not known are added to `apart`.
    """
    from ncfix.core import motions

    moves, machine, sums = plan.part.moves, plan.intent.machine, np.zeros(5)
    assert machine.linear_ways is not None
    places = np.array([0, -1, -1], dtype=np.int64)
    counts, (shown, apart), bending = np.zeros(len(moves), dtype=np.intp), masks, features(machine)
    if moves.tcp[0]:
        bends = bends_closely(plan.intent, np.arange(len(moves)))
        bent = shown & (moves.kind == MotionKind.FEED) & (bends >= STRAIGHT)
        counts = np.where(bent, np.minimum(np.ceil(DENSITY * bends), MOST_SHOWN), 0).astype(np.intp)
        bending = np.full_like(bending, np.inf)
    linear, followed = ~machine.rotary, moves.kind == MotionKind.FEED
    motions.at_ends(
        moves.start,
        moves.end,
        text.start[0],
        text.end,
        plan.first,
        plan.real.end,
        plan.before,
        bending,
        np.ascontiguousarray(machine.linear_ways),
        plan.intent.columns,
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


def _inside(plan: PlainPlan, written: Segments, rows: Index, counts: Index) -> PathSamples:
    """The errors inside motions `rows` (k,), at `counts` (k,) even samples each."""
    intent, move, fraction = plan.intent, np.repeat(rows, counts), even(counts)
    chord = (picked(written.end, rows) - picked(written.start, rows))[:, ~intent.machine.rotary]
    weight = np.repeat(lengths(chord) / (counts + 1), counts)
    return PathSamples(move, fraction, *errors_at(intent, move, fraction, written.at(move, fraction)), weight)


def _along(plan: PlainPlan, text: Emission, rows: Index, check_start: Mask) -> Iterator[PathSamples]:
    """The errors along motions `rows` (k,); `check_start` (n,) as in `PlainPlan`."""
    counts = np.diff(plan.first)[rows]
    own = ranges(plan.first[rows], counts)
    whole, no = plan.pieces, np.broadcast_to(False, len(own))
    pieces = Pieces(rows[owners(counts)], whole.fraction[own], text.end[own], whole.arc[own], text.centre[own], no)
    written = WrittenPieces(plan.intent, pieces, text.start)
    known = Known(plan.before, plan.real.end)
    return samples(written, np.arange(len(own)), known, check_start=check_start)
