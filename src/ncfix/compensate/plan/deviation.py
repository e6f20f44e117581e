"""The deviation of a real machine from the intended path: for the plan, and as figures before and after a correction.

Actual and intended tip are compared at the same fraction of a motion (see `intent`). For the plan, motions are sampled
as densely as is needed to tell whether they stay within the tolerance. For figures, cycles and rapids are sampled at
their ends; all other motions as densely as the error model may bend, and at its kinks.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ncfix.arrays import (
    Array,
    Index,
    Mask,
    batches,
    every,
    farthest,
    finite,
    largest,
    lengths,
    owners,
    picked,
    places,
    slices,
    some,
    vector_product,
)
from ncfix.compensate.plan.figure_tally import FigureTally, PathError, PathSamples
from ncfix.compensate.plan.intent import Intent, correctable, lacking
from ncfix.compensate.plan.offset import beside_contours
from ncfix.compensate.plan.sampling import DENSITY, MOST, MOST_SHOWN, bends_closely, interior, merged, passed
from ncfix.compensate.plan.segments import Segments, accelerations
from ncfix.compensate.plan.splitting import INSTANT
from ncfix.compensate.plan.written import Known, WrittenPieces
from ncfix.control.moves import MotionKind, Rule
from ncfix.machine.aim import CLOSE
from ncfix.machine.error_model import DeviationBounds

SURE = 0.5
"""Share of the tolerance below which a motion counts as within it after the first, coarse sampling."""
FIRST = 2
"""Number of samples for each time that the error may bend, in the first sampling."""
LEAST = 9
"""Least number of samples in the second, dense sampling."""
CORNER = 3**0.5
"""Largest motion of the tip by the linear axes, per mm of their norm: that of three parallel axes."""
PLANNED_BATCH = 100_000
"""Number of samples worked on at a time."""


def deviations(intent: Intent, real: Segments, rows: Index, check_start: Mask, tolerance: float) -> Array:
    """(k,) the largest deviation of the tip along motions `rows` (k,) with the corrected ends of `real`, mm.

    check_start  (n,) motions that may not begin where they should: they are sampled there too

    A motion with a bound below half of the tolerance is not sampled. The others are sampled coarsely, short ones once
    in the middle, and if they are off by more than half of the tolerance there, as densely as the error model may bend.
    Infinite for motions that are too long for that.
    """
    worst = bounds(intent, real, rows, check_start)
    unknown = np.flatnonzero(~(worst <= SURE * tolerance))
    worst[unknown] = looked_at(intent, real, rows[unknown], check_start, tolerance)
    return worst


def looked_at(intent: Intent, real: Segments, rows: Index, check_start: Mask, tolerance: float) -> Array:
    """Like `deviations`, by samples alone, without bounds."""
    worst, often = np.full(len(rows), np.inf), bends_closely(intent, rows)
    samples = DENSITY * often + LEAST
    seen = np.flatnonzero(samples < MOST)
    for part in batches(np.ceil(samples[seen]).astype(np.intp), MOST):
        batch = seen[part]
        worst[batch] = deviations_seen(intent, real, rows[batch], check_start, FIRST, 1, often[batch])
        doubtful = batch[~(worst[batch] <= SURE * tolerance)]
        if doubtful.size:
            closer = deviations_seen(intent, real, rows[doubtful], check_start, DENSITY, LEAST, often[doubtful])
            worst[doubtful] = np.maximum(worst[doubtful], closer)
    return worst


def bounds(intent: Intent, real: Segments, rows: Index, check_start: Mask) -> Array:
    """(k,) upper bound of the deviation along motions `rows` (k,), mm; inf if no bound is known.

    A bound is known for straight motions from one corrected end to the next.
    """
    most, moves = np.full(len(rows), np.inf), intent.moves
    plain = ~((moves.kind == MotionKind.ARC)[rows] | check_start[rows])
    plain[lacking(intent, rows)] = plain[moves.beside_tip[rows]] = False
    if intent.machine.bow is None or intent.state.inputs or not plain.any():
        return most
    tcp = moves.tcp[rows]
    for chosen, found in ((plain & ~tcp, _bounds_of_axes), (plain & tcp, _bounds_of_tip)):
        if chosen.all():
            return found(intent, real, rows, intent.machine.bow)
        if chosen.any():
            most[chosen] = found(intent, real, rows[chosen], intent.machine.bow)
    return most


def _bounds_of_axes(intent: Intent, real: Segments, rows: Index, bow: DeviationBounds) -> Array:
    """`bounds` of motions without tool-centre-point control.

    The tip error leaves its chord by its bow. The correction of the linear axes is linear from end to end, but turns
    with the workpiece during the motion.
    """
    start, end, linear = picked(real.start, rows), picked(real.end, rows), ~intent.machine.rotary
    meant = picked(intent.moves.start, rows), picked(intent.moves.end, rows)
    shifts = (start - meant[0])[:, linear], (end - meant[1])[:, linear]
    most = straight_bounds(bow, start, end, shifts, intent.lengths(rows), linear)
    most[passed(intent, start, end)[0]] = np.inf
    return most


def _bounds_of_tip(intent: Intent, real: Segments, rows: Index, bow: DeviationBounds) -> Array:
    """`bounds` of motions under tool-centre-point control."""
    machine, longest = intent.machine, float(np.abs(intent.lengths(rows)).max())
    commands = picked(real.start, rows), picked(real.end, rows)
    start, end = intent.joints_of(rows, *commands)
    way = lengths(intent.meant(rows, commands[1]) - intent.meant(rows, commands[0]))
    acceleration = accelerations(machine, start, end, longest, way)
    if acceleration is None or intent.arrival is not None:
        return np.full(len(rows), np.inf)
    return tcp_bounds(intent, bow, start, end, acceleration, longest)


def tcp_bounds(
    intent: Intent, bow: DeviationBounds, start: Array, end: Array, acceleration: Array, tool_length: float
) -> Array:
    """`bounds` of motions under tool-centre-point control between corrected axis positions (k, n_axes).

    acceleration  (k,) bound of the acceleration of linear axes, see `accelerations`

    The correction of X Y Z is linear in the workpiece, so only the tip error can leave its chord.
    """
    rotary, most_far = intent.machine.rotary, np.maximum(farthest(start), farthest(end))
    most = bow.of(np.abs(end - start), most_far, tool_length, rotary, acceleration)[0] + CLOSE
    if intent.kinks:
        stray = np.where(rotary, 0.0, acceleration[:, None] / 8)
        most[passed(intent, np.minimum(start, end) - stray, np.maximum(start, end) + stray)[0]] = np.inf
    return most


def straight_bounds(
    bow: DeviationBounds, start: Array, end: Array, shifts: tuple[Array, Array], tool_lengths: Array, linear: Mask
) -> Array:
    """`bounds` of straight motions between corrected ends (k, n_axes); `shifts`: corrections of linear axes there."""
    most_far = np.maximum(farthest(start), farthest(end))
    least, angle = bow.of(np.abs(end - start), most_far, float(np.abs(tool_lengths).max()), ~linear)
    sizes = [lengths(each) for each in (*shifts, shifts[1] - shifts[0])]
    turned = (np.maximum(sizes[0], sizes[1]) * angle + 2 * sizes[2]) * angle
    return least + CORNER * turned / 8 + CLOSE


def deviations_seen(
    intent: Intent, real: Segments, rows: Index, check_start: Mask, per_bend: float, least: int, often: Array
) -> Array:
    """(k,) largest deviation by samples, mm: `per_bend` for each time that the error may bend, at least `least`.

    often  (k,) number of times that the error may bend along each motion
    """
    counts, fraction = interior(intent, real, rows, per_bend, least, often)
    starts = np.flatnonzero(check_start[rows])
    if starts.size:
        counts, fraction = merged(len(rows), (owners(counts), fraction), (starts, np.full(len(starts), INSTANT)))
    move, off = rows[owners(counts)], np.empty(len(fraction))
    for part in slices(len(move), PLANNED_BATCH):
        off[part] = distance(intent, real, move[part], fraction[part])
    return largest(off, counts)


def distance(intent: Intent, real: Segments, rows: Index, fraction: Array) -> Array:
    """(k,) deviation of the tip at fractions of corrected motions, mm, without the part that no word could correct."""
    commands = real.at(rows, fraction)
    gap = correctable(intent, rows, commands, intent.gap(rows, fraction, commands))
    return np.sqrt(np.einsum("ij,ij->i", gap, gap))


def beside(intent: Intent, real: Segments, rows: Index) -> Array | None:
    """(n, n_axes) largest distance of axes without a word from their intended places inside motions `rows` (k,), mm.

    0 for all other axes and motions; the ends of motions are not included. None if there are no such axes.
    """
    on = rows[lacking(intent, rows)]
    if not on.size:
        return None
    assert intent.wordless is not None
    counts, fraction = interior(intent, real, on, FIRST, 1)
    move, result = on[owners(counts)], np.zeros(intent.wordless.shape)
    for part in slices(len(move), PLANNED_BATCH):
        which, at = move[part], fraction[part]
        off = np.abs(intent.guessed(real, which, at) - real.at(which, at))
        np.maximum.at(result, which, np.where(intent.wordless[which], off, 0.0))
    return result


def starts_to_check(intent: Intent, unchanged: Mask) -> Mask:
    """(n,) motions that may not begin where they should, even if the motion before ends where it should.

    Reasons: that motion is unchanged, or ended with another tool length or elsewhere; an axis reverses; the state has
    an input for each motion.
    """
    moves = intent.moves
    check_start = np.ones(len(moves), dtype=bool)
    joined = every(moves.start[1:] == moves.end[:-1]) & (moves.tool_length[1:] == moves.tool_length[:-1])
    check_start[1:] = unchanged[:-1] | ~joined
    if intent.came is not None:
        rows = np.arange(1, len(moves))
        now = intent.direction(rows, np.full(len(rows), INSTANT))
        check_start[1:] |= some(now != intent.came[1:])
    if any(np.ndim(values) for values in intent.state.inputs.values()):
        check_start[:] = True
    return check_start


BATCH = 16_384
"""Number of samples worked on at a time."""
STRAIGHT = 0.05
"""Number of bends of the error below which a piece is sampled at its end only. One bend is an eighth of a wave, so
inside such a piece the error is within 0.0002 of itself of the straight line between those at the ends."""
START = 1e-6
"""Fraction of a motion at which its start is sampled."""


def path_error(written: WrittenPieces, rows: Mask | None = None, known: Known | None = None) -> PathError:
    """Tip errors of the real machine along the whole path, by simulation.

    written  pieces with the ends as the control will understand them (`Emission.end`, `.centre`)
    rows     (n,) motions to examine; None: all corrected ones
    known    tip errors at the ends of motions, so that these need not be computed again
    """
    pieces, moves = written.pieces, written.intent.moves
    chosen = ~pieces.unchanged if rows is None else rows[pieces.move]
    tally, which = FigureTally(), np.flatnonzero(chosen & (moves.kind != MotionKind.DWELL)[pieces.move])
    for part in samples(written, which, known):
        tally.add(part)
    if (found := _beside(written, chosen)) is not None:
        tally.add(found)
    return tally.result()


def _beside(written: WrittenPieces, chosen: Mask) -> PathSamples | None:
    """Samples of the offset path of the tool beside contours, for pieces `chosen` (m,).

    Their weight is 0: they count for the largest errors, not for the rms.
    """
    moves = written.intent.moves
    if not moves.beside.any():
        return None
    last = written.pieces.last
    found = beside_contours(written.intent, written.segments.rows(last))
    if found is None:
        return None
    shown = chosen[last][found.move]
    before, after, move = found.before[shown], found.after[shown], found.move[shown]
    return PathSamples(move, np.ones(len(move)), before, after, np.zeros(len(move))) if len(move) else None


def samples(
    written: WrittenPieces, which: Index, known: Known | None = None, check_start: Mask | None = None
) -> Iterator[PathSamples]:
    """The tip errors along pieces `which`, in batches; errors known at ends are not computed again.

    check_start  (n,) motions whose start is sampled, too; None: worked out here
    """
    counts, along = _counts(written, which)
    if check_start is None:
        check_start = _starts_to_check(written)
    for batch in batches(counts + 1, BATCH):
        piece, fraction = _places(written, which[batch], counts[batch], along[batch], check_start)
        yield _errors(written, piece, fraction, known)


def _counts(written: WrittenPieces, which: Index) -> tuple[Index, Mask]:
    """(k,) number of samples inside each piece, and whether it is sampled along its way, not only at its end."""
    intent, move, span = written.intent, written.pieces.move[which], written.span[which]
    wished, kind = bends_closely(intent, move) * span, intent.moves.kind[move]
    along = ((kind == MotionKind.FEED) | (kind == MotionKind.ARC)) & (span > 2 * INSTANT) & intent.moving(move)
    begun = picked(written.segments.start, which) + picked(written.start, move) + picked(intent.moves.start, move)
    along &= finite(begun)
    counts = np.minimum(np.nan_to_num(np.ceil(DENSITY * wished)), MOST_SHOWN)
    return np.where(along & (wished >= STRAIGHT), counts, 0).astype(np.intp), along


def _places(written: WrittenPieces, which: Index, counts: Index, along: Mask, check_start: Mask) -> tuple[Index, Array]:
    """Pieces and fractions of them to sample: evenly, at the end, at kinks, and at starts that may be off; flat."""
    many = counts + 1
    fraction = (places(many) + 1) / np.repeat(many, many)
    begins = np.flatnonzero(written.before[which] == 0)
    looked_at = check_start[written.pieces.move[which[begins]]] & along[begins]
    begun = begins[looked_at | _leaps(written, which[begins])]
    extra = [(begun, np.full(len(begun), START))]
    if written.intent.kinks:
        extra.append(_passed(written, which, along))
    if any(len(each) for each, _ in extra):
        many, fraction = merged(len(which), (owners(many), fraction), *extra)
    return which[owners(many)], fraction


def _starts_to_check(written: WrittenPieces) -> Mask:
    """(n,) motions whose start is to be sampled, because it is not shown by the end of the motion before.

    Motions behind rapids are added, except if an axis of the rapid was left where it stands: that is reported on its
    own (NCF439), and shows in a cut only if the cut has to be led to its start (`_leaps`).
    """
    moves = written.intent.moves
    unchanged = np.ones(len(moves), dtype=bool)
    unchanged[written.pieces.move] = written.pieces.unchanged
    found = starts_to_check(written.intent, unchanged)
    found[1:] |= (moves.kind[:-1] == MotionKind.RAPID) & ~some(moves.wordless[:-1])
    return found


def _leaps(written: WrittenPieces, which: Index) -> Mask:
    """(k,) whether a piece, with which a motion begins, leads a cut from a displaced place to where it should begin.

    The place is displaced because axes were left there, or because a cycle ended there: it is right at the bottom of
    the hole, not at the level to which the cycle returns.
    """
    moves, move = written.intent.moves, written.pieces.move[which]
    behind = (
        (moves.rule[move - 1] == Rule.PASS)
        | (moves.kind[move - 1] == MotionKind.CYCLE)
        | some(moves.wordless[move - 1])
    )
    leads = (written.span[which] <= 2 * INSTANT) | ~written.intent.moving(move)
    return (move > 0) & behind & leads & finite(picked(moves.start, move))


def _passed(written: WrittenPieces, which: Index, along: Mask) -> tuple[Index, Array]:
    """Where pieces `which` pass a kink or a jump: index in `which`, and fraction, flat."""
    long = np.flatnonzero(along)
    on, share = passed(written.intent, *(picked(each, which[long]) for each in written.ends))
    return long[on], share


def _errors(written: WrittenPieces, piece: Index, fraction: Array, known: Known | None) -> PathSamples:
    """The tip errors at fractions of pieces (k,); those known at ends are taken from `known`."""
    move, at = written.pieces.move[piece], written.before[piece] + fraction * written.span[piece]
    before, after = np.empty(len(piece)), np.empty(len(piece))
    unknown = np.ones(len(piece), dtype=bool)
    ends = np.flatnonzero(fraction == 1.0)
    if known is not None:
        is_known, *errors = known.at(written, piece[ends])
        before[ends], after[ends] = errors
        unknown[ends[is_known]] = False
    rows = np.flatnonzero(unknown)
    if rows.size:
        commands = written.segments.at(piece[rows], fraction[rows])
        before[rows], after[rows] = errors_at(written.intent, move[rows], at[rows], commands)
    return PathSamples(move, at, before, after, _way(written, piece))


def errors_at(intent: Intent, move: Index, fraction: Array, commands: Array) -> tuple[Array, Array]:
    """(k,) tip errors at fractions of motions as programmed, and with `commands` (k, n_axes) instead, mm."""
    programmed = intent.segments.at(move, fraction)
    done = [intent.joints(move, each) for each in (programmed, commands)]
    gaps = intent.gaps(move, programmed, done, intent.states(move, fraction))
    before, after = (lengths(correctable(intent, move, commands, gap)) for gap in gaps)
    return before, after


def _way(written: WrittenPieces, piece: Index) -> Array:
    """(k,) the way for which each sample stands, mm: the chord or arc length of its piece, divided by its samples."""
    segments = written.segments
    first = np.flatnonzero(np.diff(piece, prepend=-1))
    counts, own = np.diff(first, append=len(piece)), piece[first]
    chord = (picked(segments.end, own) - picked(segments.start, own))[:, ~written.intent.machine.rotary]
    way = lengths(np.nan_to_num(chord))
    on_arc = np.flatnonzero(segments.arc[own])
    if on_arc.size:
        arc = own[on_arc]
        spoke = picked(segments.start, arc)[:, segments.columns] - segments.centre[arc]
        radius = np.linalg.norm(vector_product(segments.normal[arc], spoke), axis=1)
        way[on_arc] = np.hypot(way[on_arc], radius * np.abs(segments.sweep[arc]))
    return np.repeat(way / counts, counts)
