"""The plan of a corrected program: the commands to write so that the whole path stays within the tolerance.

The ends of motions are corrected first. Then every motion is judged along its path: the tip of the real machine on the
corrected motion, straight or arc, is compared with the intended path at the same fraction. Most motions are within the
tolerance. Those that are not are split at the fewest places, arcs into arcs or straight pieces.

Rapids are corrected at their ends, and split only on request, because controls differ in how they go from end to end.
Canned cycles are corrected at their end. Nothing is split under cutter radius compensation.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ncfix.arrays import (
    Array,
    Index,
    Mask,
    every,
    finite,
    lengths,
    offsets,
    owners,
    picked,
    ranges,
    stacked,
    sums,
    vector_product,
)
from ncfix.compensate.plan.arcs import Closure, fitted
from ncfix.compensate.plan.deviation import beside as left_beside
from ncfix.compensate.plan.deviation import deviations, starts_to_check
from ncfix.compensate.plan.ends import (
    corrected,
    corrected_approaches,
    standing,
    with_closed_circles,
    with_rotary_as_it_stands,
)
from ncfix.compensate.plan.findings import Finding, FindingKind
from ncfix.compensate.plan.intent import Intent, crooked
from ncfix.compensate.plan.offset import OffsetPoints, beside_contours
from ncfix.compensate.plan.sampling import too_long
from ncfix.compensate.plan.segments import Segments
from ncfix.compensate.plan.splitting import INSTANT, Cutter, Split, may_be_round, reordered, split
from ncfix.compensate.plan.strategies import Strategy
from ncfix.compensate.plan.written import Known
from ncfix.control.moves import MotionKind, Moves, Rule
from ncfix.machine import Machine
from ncfix.values import frozen
from ncfix.writer.pieces import Pieces

LEAST_SHARE = 1e-6
"""Least share of a motion's time for a piece that only takes up a jump: inverse-time feed is divided by it."""


@frozen
class Plan:
    """The pieces to write, and the findings about the motions.

    pieces     the corrected path, one row or more per motion; `pieces.unchanged`: motions left as they were
    start      (n, n_axes) the command at which each motion really starts, NaN if not known
    deviation  (n,) largest deviation of the tip from the intended path, mm, before rounding; 0 if not examined
    oriented   (n,) the tool direction is corrected too, without damping or limits
    findings   problems and remarks, by motion
    known      tip errors known from the correction of the ends
    corners    effect of rounding at corners that the control offsets, in half output steps; 0 without such corners
    """

    pieces: Pieces
    start: Array
    deviation: Array
    oriented: Mask
    findings: tuple[Finding, ...]
    known: Known | None = None
    corners: float = 0.0


def untouched(moves: Moves, unchanged: Mask) -> Plan:
    """The plan that changes nothing."""
    n = len(moves)
    pieces = Pieces(
        np.arange(n), np.ones(n), moves.end.copy(), moves.kind == MotionKind.ARC, moves.centre.copy(), unchanged
    )
    return Plan(pieces, moves.start.copy(), np.zeros(n), np.ones(n, dtype=bool), ())


def assembled(
    moves: Moves,
    real: Segments,
    unchanged: Mask,
    rows: Index,
    parts: Split | None,
    deviation: Array,
    oriented: Mask,
    findings: tuple[Finding, ...],
) -> Plan:
    """The plan in which each motion is one piece as in `real`, but motions `rows` (k,) are split into `parts`."""
    counts = np.ones(len(moves), dtype=np.intp)
    if parts is not None:
        counts[rows] = parts.counts
    move = owners(counts)
    fraction, end, arc = np.ones(len(move)), picked(real.end, move), real.arc[move]
    centre = np.full((len(move), 3), np.nan)
    centre[arc] = real.centre[move[arc]]
    if parts is not None:
        at = ranges(offsets(counts)[rows], parts.counts)
        fraction[at], end[at], arc[at], centre[at] = parts.fraction, parts.end, parts.arc, parts.centre
    pieces = Pieces(move, fraction, end, arc, centre, unchanged[move])
    pieces = replace(pieces, share=_shares(pieces, real, counts))
    return Plan(pieces, real.start, deviation, oriented, findings)


def _shares(pieces: Pieces, real: Segments, counts: Index) -> Array:
    """(m,) share of each piece in the time of its motion: its fraction, or its share of the way at a jump."""
    span = pieces.fraction - pieces.begun
    jumps = span < 2 * INSTANT
    if not jumps.any():
        return span
    start = np.empty_like(pieces.end)
    start[1:] = pieces.end[:-1]
    start[pieces.first] = real.start
    way = lengths(pieces.end - start)
    whole = np.repeat(sums(way, counts), counts)
    share = np.where(jumps, np.maximum(way / np.maximum(whole, 1e-300), LEAST_SHARE), span)
    return share / np.repeat(sums(share, counts), counts)


SIDE = "{cuts} while the side of the backlash of {axis} is not known: the tip may be up to {value:.1f} um off there"
SIDE_HINT = (
    "before the first cut move these axes farther than their backlash, or give their positions at the start with "
    "--initial"
)

SAMPLED = 0.02
"""Share of the tolerance that is kept for errors between samples. There are at least `DENSITY` samples in the shortest
distance over which the model bends, an eighth of a wave. The peak of a wave between two samples exceeds the higher of
them by less than 1 - cos(pi / 32) = 0.5 % of its height, and that of a parabola its chord by less than 1 / 64 of the
parabola's height."""


@frozen
class PathTolerance:
    """A path tolerance, and the effect of rounding, which comes on top of it.

    tolerance  tolerance of the path before rounding, mm
    rounding   largest shift of the tip because commands are rounded: the norm of half output steps, mm
    """

    tolerance: float
    rounding: float = 0.0

    @property
    def path(self) -> float:
        """Tolerance at the sample points, mm: the tolerance without the share held back for what lies between them."""
        return (1 - SAMPLED) * self.tolerance

    @property
    def fine(self) -> bool:
        """Whether rounding to the control's digits uses at most half of the tolerance."""
        return self.rounding <= self.tolerance / 2


@frozen
class Requirements:
    """The requirements on the corrected program.

    budget        the tolerance, and the effect of rounding
    closure       the arcs that the control accepts
    split_rapids  the tolerance holds along rapids too
    arc_pieces    an arc may be split into several arcs
    """

    budget: PathTolerance
    closure: Closure
    split_rapids: bool
    arc_pieces: bool


def plan(
    intent: Intent, strategy: Strategy, required: Requirements, keep: Mask | None = None, before: Array | None = None
) -> Plan:
    """Correct the motions of a program.

    keep    (n,) motions to leave unchanged, besides those that must not be corrected by their rule
    before  (n_axes,) displacement of the axes at the start of the first motion, mm and rad; None: zero

    Motions that cannot be corrected stay unchanged and are named in the findings. Raises `RefusedError` NCF401 if the
    machine has no X, Y and Z.
    """
    machine, moves = intent.machine, intent.moves
    unchanged = (moves.rule != Rule.CORRECT) | (moves.kind == MotionKind.DWELL)
    unchanged |= keep if keep is not None else False
    if machine.is_perfect or unchanged.all():
        as_it_is = untouched(moves, unchanged)
        return as_it_is if before is None else _behind(machine, as_it_is, moves, before)
    return _plan(intent, strategy, required, unchanged, before)


def _behind(machine: Machine, as_it_is: Plan, moves: Moves, before: Array) -> Plan:
    """A plan that changes nothing, with the displacement `before` (n_axes,), mm and rad, at its start."""
    unchanged = as_it_is.pieces.unchanged
    where = standing(machine, moves, moves.end, unchanged, before)
    return replace(as_it_is, start=where.start, pieces=replace(as_it_is.pieces, end=where.end))


def _plan(intent: Intent, strategy: Strategy, required: Requirements, unchanged: Mask, before: Array | None) -> Plan:
    ends = corrected(intent, strategy, np.flatnonzero(~unchanged))
    unchanged = unchanged | ends.failed
    if strategy.corrects_orientation:
        ends = with_rotary_as_it_stands(intent, ends, unchanged, before)
    approaches = corrected_approaches(intent, ends.wanted, unchanged) if strategy.follows_path else None
    real, broken = _real(intent, ends.wanted, unchanged, required, before, approaches)
    bound = intent.moves.whole | crooked(intent) if strategy.follows_path else np.ones(len(unchanged), dtype=bool)

    def without(finding: Finding) -> Plan:
        """The plan in which the motions of a finding stay unchanged, too, with that finding."""
        also = unchanged.copy()
        also[finding.moves] = True
        planned = _plan(intent, strategy, required, also, before)
        return replace(planned, findings=(*ends.findings, finding, *planned.findings))

    text = "this arc needs to become straight pieces, but must not be split"
    if stuck := Finding.of("NCF415", np.flatnonzero(broken & bound), text):
        return without(stuck)
    beside = beside_contours(intent, real) if strategy.follows_path else None
    if worse := _worse_contours(intent, beside, unchanged, required):
        return without(worse)
    followed = _followed(intent, real, unchanged, strategy, required)
    deviation = _judged(intent, real, unchanged, broken, followed, required)
    limit = required.budget.path
    over = _not_far_off(intent, np.flatnonzero((deviation > limit) & ~bound))
    over = over[~too_long(intent, over)]
    parts = in_pieces(intent, real, over, deviation[over], strategy, required)
    deviation[over] = parts.worst
    unseen, hint = _not_far_off(intent, np.flatnonzero(np.isinf(deviation))), "divide it into several motions"
    text = "this motion is too long, or has too many turns, to be checked along its path"
    if too_far := Finding.of("NCF417", unseen, text, hint):
        return without(too_far)
    findings = (*ends.findings, *_remarks(intent, deviation, ends.oriented, unchanged, strategy, required))
    planned = assembled(intent.moves, real, unchanged, over, parts, deviation, ends.oriented, findings)
    known = Known(ends.before, ends.wanted, left_beside(intent, real, np.flatnonzero(followed)))
    corners = 0.0 if beside is None else float(beside.rounding[~unchanged[beside.move]].max(initial=0.0))
    pieces = planned.pieces
    if approaches is not None:
        pieces = replace(pieces, approach=approaches[pieces.move])
    return replace(planned, pieces=pieces, known=known, corners=corners)


def _worse_contours(intent: Intent, beside: OffsetPoints | None, unchanged: Mask, required: Requirements) -> Finding:
    """NCF454: contours with a corner at which the tool would be farther off with the correction than without it.

    That is, beyond the tolerance, and by more than before plus the effect of rounding. All corrected motions of such a
    contour are in the finding.
    """
    text = (
        "at a corner of this contour the offset tool would be up to {value:.1f} um off, farther than without the "
        "correction"
    )
    none = Finding.of("NCF454", np.zeros(0, dtype=np.intp), text)
    if beside is None:
        return none
    digits = 0.5 * intent.machine.least_increment[0] * beside.rounding
    worse = beside.corner & (beside.after > required.budget.tolerance) & (beside.after > beside.before + digits)
    if not worse.any():
        return none
    offset = np.nan_to_num(intent.moves.beside, nan=1.0) != 0
    contour = np.cumsum(np.diff(offset.astype(np.int8), prepend=0) == 1)
    most = np.zeros(int(contour[-1]) + 1)
    np.maximum.at(most, contour[beside.move[worse]], beside.after[worse])
    rows = np.flatnonzero(offset & (most[contour] > 0) & ~unchanged)
    return Finding("NCF454", rows, most[contour[rows]] * 1e3, text)


def _real(
    intent: Intent,
    wanted: Array,
    unchanged: Mask,
    required: Requirements,
    before: Array | None,
    approaches: Array | None,
) -> tuple[Segments, Mask]:
    """The corrected motions before any splitting, and (n,) the arcs that cannot stay arcs."""
    moves, programmed = intent.moves, intent.segments
    wanted = with_closed_circles(intent, wanted, unchanged, required.budget.path / 2, before, approaches)
    where = standing(intent.machine, moves, wanted, unchanged, before, approaches)
    real = replace(programmed, start=where.start, end=where.end)
    broken = np.zeros(len(moves), dtype=bool)
    rows = np.flatnonzero(programmed.arc & ~unchanged)
    if not rows.size:
        return real, broken
    fit = fitted(intent, real, rows, required.closure, required.budget.rounding)
    centre, sweep = programmed.centre.copy(), programmed.sweep.copy()
    centre[rows], sweep[rows] = fit.centre, fit.sweep
    broken[rows] = ~fit.sound
    return replace(real, centre=centre, sweep=sweep, arc=programmed.arc & ~broken), broken


def _followed(intent: Intent, real: Segments, unchanged: Mask, strategy: Strategy, required: Requirements) -> Mask:
    """(n,) motions that are examined along their way, not only at their end."""
    if not strategy.follows_path:
        return np.zeros(len(unchanged), dtype=bool)
    kind = intent.moves.kind
    followed = (
        (kind == MotionKind.FEED) | (kind == MotionKind.ARC) | ((kind == MotionKind.RAPID) & required.split_rapids)
    )
    return followed & ~unchanged & intent.moving(np.arange(len(unchanged))) & finite(real.start)


def _judged(
    intent: Intent, real: Segments, unchanged: Mask, broken: Mask, followed: Mask, required: Requirements
) -> Array:
    """(n,) largest deviation of the tip from the intended path along each motion, mm; 0 if not examined."""
    deviation = np.zeros(len(unchanged))
    rows = np.flatnonzero(followed & ~broken)
    deviation[rows] = deviations(intent, real, rows, starts_to_check(intent, unchanged), required.budget.path)
    deviation[followed & broken] = np.inf
    return deviation


def in_pieces(
    intent: Intent, real: Segments, rows: Index, deviation: Array, strategy: Strategy, required: Requirements
) -> Split:
    """Motions `rows` (k,) split: arcs into arcs if control and tolerance allow it, all others into straight pieces."""
    limit = required.budget.path
    round_ = np.zeros(len(rows), dtype=bool)
    if required.arc_pieces:
        round_ = may_be_round(intent, rows, required.closure, required.budget.rounding)
    arcs, parts = np.flatnonzero(round_), None
    if arcs.size:
        parts = split(intent, real, rows[arcs], _bows(deviation[arcs], limit), Cutter(strategy, limit, round=True))
        round_[arcs] = parts.worst <= limit
    lines = np.flatnonzero(~round_)
    straight = split(
        intent, real, rows[lines], _pieces(intent, real, rows[lines], deviation[lines], limit), Cutter(strategy, limit)
    )
    if parts is None:
        return straight
    return reordered(stacked([parts, straight]), np.argsort(np.append(arcs, lines)))


def _bows(deviation: Array, tolerance: float) -> Array:
    """(k,) about how many pieces motions with these deviations (k,), mm, will need: one per bow."""
    return np.sqrt(np.where(np.isfinite(deviation), deviation, 0.0) / tolerance) + 1


def _pieces(intent: Intent, real: Segments, rows: Index, deviation: Array, tolerance: float) -> Array:
    """(k,) about how many straight pieces motions will need: one per bow of the deviation, and the chords of an arc."""
    moves = intent.moves
    count = _bows(deviation, tolerance)
    arcs = np.flatnonzero(intent.segments.arc[rows])
    if arcs.size:
        on = rows[arcs]
        spoke = real.start[on[:, None], intent.columns] - moves.centre[on]
        radius = np.linalg.norm(vector_product(moves.normal[on], spoke), axis=1)
        angle = 2 * np.arccos(np.clip(1 - tolerance / np.maximum(radius, tolerance), 0.0, 1.0))
        count[arcs] += np.abs(moves.sweep[on]) / angle
    return count


def _not_far_off(intent: Intent, rows: Index) -> Index:
    """Motions `rows` (k,) without those that end farther beyond a range than it is wide; those are refused anyway."""
    low, high = intent.machine.ranges.T
    q = intent.joints_at(rows, np.ones(len(rows)))
    return rows[every((q > 2 * low - high) & (q < 2 * high - low))]


def not_split(rows: Index, deviation: Array) -> Finding:
    """NCF413: motions (k,) that would have to be split but must not be; `deviation` (k,) mm."""
    text = "the tool tip is up to {value:.1f} um from the intended path, but this motion must not be split"
    return Finding("NCF413", rows, deviation * 1e3, text, kind=FindingKind.REMARK)


def _remarks(
    intent: Intent, deviation: Array, oriented: Mask, unchanged: Mask, strategy: Strategy, required: Requirements
) -> list[Finding]:
    """Remarks: shortfalls of the plan for which no motion stays unchanged."""
    remarks = []
    budget = required.budget
    over = np.flatnonzero((deviation > budget.path) & (intent.moves.whole | crooked(intent)))
    if over.size:
        remarks.append(not_split(over, deviation[over]))
    unknown = _unknown_radius(intent, unchanged)
    if unknown.size:
        text = (
            "the radius of the tool is not known: the figures do not include what the control does at corners of the "
            "contour"
        )
        hint = "give it as --tool NUMBER=LENGTH,RADIUS"
        remarks.append(Finding.of("NCF455", unknown, text, hint, FindingKind.REMARK))
    done = np.flatnonzero(~unchanged)
    if intent.came is not None and (unsure := _sides_unknown(intent, done, budget.tolerance)):
        remarks.append(unsure)
    if not budget.fine and done.size:
        text = (
            "rounding to the control's digits moves the tool tip by up to {value:.2f} um, in addition to the tolerance"
        )
        figure = np.array([budget.rounding * 1e3])
        remarks.append(Finding("NCF409", done[:1], figure, text, kind=FindingKind.ONCE))
    held = done[~oriented[done]]
    if strategy.corrects_orientation and held.size:
        text = "the tool direction is not fully corrected here"
        remarks.append(Finding.of("NCF410", held, text, kind=FindingKind.REMARK))
    return remarks


def _sides_unknown(intent: Intent, rows: Index, tolerance: float) -> Finding:
    """NCF285: cuts among `rows` (k,) that begin with an axis of which nobody knows on which side of its play it is.

    The figure is how far the tip may be off there, as far as it is more than the tolerance, mm: between the two sides
    of an axis that moves, from the middle to a side for one that rests. A hole has its figure at its bottom.
    """
    assert intent.came is not None
    assert intent.arrival is not None
    holes = intent.moves.kind[rows] == MotionKind.CYCLE
    known = finite(intent.moves.end[rows]) & (holes | finite(intent.moves.start[rows]))
    rows, holes = rows[intent.moves.cutting[rows] & known], holes[intent.moves.cutting[rows] & known]
    place = holes.astype(np.float64)
    q = np.where(holes[:, None], intent.ends[1][rows], intent.ends[0][rows])
    off = np.zeros((len(rows), len(intent.machine.axes)))
    for axis in intent.machine.directed:
        rests = intent.arrival[rows, axis] == 0
        which = np.flatnonzero(np.where(holes, rests, intent.came[rows, axis] == 0))
        if not which.size:
            continue
        states, way = intent.states(rows[which], place[which]), np.zeros((len(which), off.shape[1]), dtype=np.int8)
        way[:, axis] = 1
        one, other = (intent.machine.actual_tip(q[which], replace(states, direction=each)) for each in (way, -way))
        off[which, axis] = lengths(other - one) * np.where(rests[which], 0.5, 1.0)
    far = np.where(off > tolerance, off, 0.0)
    which = np.flatnonzero(far.any(axis=1))
    axes = tuple("".join(np.array(intent.moves.axes)[row > 0]) for row in far[which])
    most = far[which].max(axis=1, initial=0.0) * 1e3
    return Finding("NCF285", rows[which], most, SIDE, axes, SIDE_HINT, kind=FindingKind.COUNTED)


def _unknown_radius(intent: Intent, unchanged: Mask) -> Index:
    """The first corrected motion of each stretch of a contour that the control offsets by an unknown tool radius."""
    beside = intent.moves.beside
    unknown = np.isnan(beside) & ~unchanged
    return np.flatnonzero(unknown & ~np.append(False, unknown[:-1]))
