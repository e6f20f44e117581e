"""How far the real machine leaves the intended path on corrected pieces, looked at as closely as is needed."""

from __future__ import annotations

import numpy as np

from ncfix.compensate.grids import INSTANT
from ncfix.compensate.plan.arrays import (
    Array,
    Index,
    Mask,
    batches,
    every,
    farthest,
    largest,
    lengths,
    owners,
    picked,
    slices,
    some,
)
from ncfix.compensate.plan.intent import Intent, correctable, lacking
from ncfix.compensate.plan.sampling import DENSITY, MOST, bends, interior, merged, passed
from ncfix.compensate.plan.segments import Segments, accelerations
from ncfix.control.moves import Kind
from ncfix.machine.aim import CLOSE
from ncfix.machine.error_model import Bow

SURE = 0.5
"""A motion whose deviation at a first look is under this share of the tolerance is within it."""
FIRST = 2
"""Samples for each time that the error may bend, at a first look."""
LEAST = 9
"""Fewest samples at a second look."""
CORNER = 3**0.5
"""How far the linear axes together may take the tip, per mm of their norm: three that are no more than parallel."""
BATCH = 100_000
"""Samples worked on at a time."""


def deviations(intent: Intent, real: Segments, rows: Index, uneasy: Mask, tolerance: float) -> Array:
    """The largest deviation of the tip along motions `rows` (k,) done as `real` has them, mm.

    uneasy  (n,) motions that may not begin where they should: they are looked at there too

    Motions that cannot be off by over half of the tolerance, by a bound, need no look. Short ones of the others get one
    sample in the middle at first. Those that are off by so much are looked at again, as closely as the error model may
    bend. Of those that are too long for it the deviation is infinite.
    """
    worst = bounds(intent, real, rows, uneasy)
    unknown = np.flatnonzero(~(worst <= SURE * tolerance))
    worst[unknown] = looked_at(intent, real, rows[unknown], uneasy, tolerance)
    return worst


def looked_at(intent: Intent, real: Segments, rows: Index, uneasy: Mask, tolerance: float) -> Array:
    """As `deviations`, of motions that no bound speaks for."""
    worst = np.full(len(rows), np.inf)
    samples = DENSITY * bends(intent, rows) + LEAST
    seen = np.flatnonzero(samples < MOST)
    for part in batches(np.ceil(samples[seen]).astype(np.intp), MOST):
        now = seen[part]
        worst[now] = deviations_seen(intent, real, rows[now], uneasy, FIRST, 1)
        doubtful = now[~(worst[now] <= SURE * tolerance)]
        if doubtful.size:
            closer = deviations_seen(intent, real, rows[doubtful], uneasy, DENSITY, LEAST)
            worst[doubtful] = np.maximum(worst[doubtful], closer)
    return worst


def bounds(intent: Intent, real: Segments, rows: Index, uneasy: Mask) -> Array:
    """What the deviation along motions `rows` (k,) does not exceed, mm; inf where that is not known.

    Known it is for straight motions from one corrected end to the next.
    """
    most, moves = np.full(len(rows), np.inf), intent.moves
    plain = ~((moves.kind == Kind.ARC)[rows] | uneasy[rows])
    plain[lacking(intent, rows)] = False
    if intent.machine.bow is None or intent.state.inputs or not plain.any():
        return most
    led = moves.tcp[rows]
    for chosen, found in ((plain & ~led, _bounds_of_axes), (plain & led, _bounds_of_tip)):
        if chosen.all():
            return found(intent, real, rows, intent.machine.bow)
        if chosen.any():
            most[chosen] = found(intent, real, rows[chosen], intent.machine.bow)
    return most


def _bounds_of_axes(intent: Intent, real: Segments, rows: Index, bow: Bow) -> Array:
    """As `bounds`, of motions in axis positions.

    The tip's error leaves its chord by its bow; what is added to the linear axes goes straight from end to end, but
    turns with the workpiece meanwhile.
    """
    start, end, linear = picked(real.start, rows), picked(real.end, rows), ~intent.machine.rotary
    meant = picked(intent.moves.start, rows), picked(intent.moves.end, rows)
    shifts = (start - meant[0])[:, linear], (end - meant[1])[:, linear]
    most = straight_bounds(bow, start, end, shifts, intent.lengths(rows), linear)
    most[passed(intent, start, end)[0]] = np.inf
    return most


def _bounds_of_tip(intent: Intent, real: Segments, rows: Index, bow: Bow) -> Array:
    """As `bounds`, of motions under tool-centre-point control."""
    machine, longest = intent.machine, float(np.abs(intent.lengths(rows)).max())
    commands = picked(real.start, rows), picked(real.end, rows)
    start, end = (intent.joints(rows, each) for each in commands)
    way = lengths(intent.meant(rows, commands[1]) - intent.meant(rows, commands[0]))
    acceleration = accelerations(machine, start, end, longest, way)
    if acceleration is None or intent.arrival is not None:
        return np.full(len(rows), np.inf)
    return led_bounds(intent, bow, start, end, acceleration, longest)


def led_bounds(intent: Intent, bow: Bow, start: Array, end: Array, acceleration: Array, tool_length: float) -> Array:
    """As `bounds`, of motions under tool-centre-point control between corrected axis positions (k, n_axes).

    acceleration  (k,) of linear axes, as `accelerations` has it

    What is added to X Y Z goes straight in the workpiece, so that only the tip's error can leave its chord.
    """
    rotary, most_far = intent.machine.rotary, np.maximum(farthest(start), farthest(end))
    most = bow.of(np.abs(end - start), most_far, tool_length, rotary, acceleration)[0] + CLOSE
    if intent.kinks:
        stray = np.where(rotary, 0.0, acceleration[:, None] / 8)
        most[passed(intent, np.minimum(start, end) - stray, np.maximum(start, end) + stray)[0]] = np.inf
    return most


def straight_bounds(
    bow: Bow, start: Array, end: Array, shifts: tuple[Array, Array], tool_lengths: Array, linear: Mask
) -> Array:
    """As `bounds`, of straight motions (k, n_axes) between corrected ends, with `shifts` of their linear axes there."""
    most_far = np.maximum(farthest(start), farthest(end))
    least, angle = bow.of(np.abs(end - start), most_far, float(np.abs(tool_lengths).max()), ~linear)
    before, after = shifts
    sizes = [lengths(each) for each in (before, after, after - before)]
    turned = (np.maximum(sizes[0], sizes[1]) * angle + 2 * sizes[2]) * angle
    most: Array = least + CORNER * turned / 8 + CLOSE
    return most


def deviations_seen(intent: Intent, real: Segments, rows: Index, uneasy: Mask, per_bend: float, least: int) -> Array:
    """As `deviations`, (k,) mm, by samples alone: at least so many, and so many for each time the error may bend."""
    counts, fraction = interior(intent, real, rows, per_bend, least)
    starts = np.flatnonzero(uneasy[rows])
    if starts.size:
        extra = starts, np.full(len(starts), INSTANT)
        counts, fraction = merged(len(rows), (owners(counts), fraction), extra)
    move = rows[owners(counts)]
    off = np.empty(len(move))
    for part in slices(len(move), BATCH):
        off[part] = distance(intent, real, move[part], fraction[part])
    return largest(off, counts)


def distance(intent: Intent, real: Segments, rows: Index, fraction: Array) -> Array:
    """How far the tip is from where it could be at fractions of motions done as `real` has them, (k,) mm."""
    commands = real.at(rows, fraction)
    gap = correctable(intent, rows, commands, intent.gap(rows, fraction, commands))
    size: Array = np.sqrt(np.einsum("ij,ij->i", gap, gap))
    return size


def beside(intent: Intent, real: Segments, rows: Index) -> Array | None:
    """How far axes that get no word are at most from where they should be on the way of motions `rows` (k,).

    (n, n_axes) mm, 0 for other axes and motions, without the ends of motions; None if there are no such axes.
    """
    on = rows[lacking(intent, rows)]
    if not on.size:
        return None
    assert intent.wordless is not None
    counts, fraction = interior(intent, real, on, FIRST, 1)
    move = on[owners(counts)]
    result = np.zeros(intent.wordless.shape)
    for part in slices(len(move), BATCH):
        which, at = move[part], fraction[part]
        off = np.abs(intent.guessed(real, which, at) - real.at(which, at))
        np.maximum.at(result, which, np.where(intent.wordless[which], off, 0.0))
    return result


def uneasy_starts(intent: Intent, kept: Mask) -> Mask:
    """Motions that may not begin where they should, though the one before ended where it should, (n,).

    Because that one is kept, or ended with another tool, or elsewhere, or because an axis reverses.
    """
    moves = intent.moves
    uneasy = np.ones(len(moves), dtype=bool)
    joined = every(moves.start[1:] == moves.end[:-1])
    same = moves.tool_length[1:] == moves.tool_length[:-1]
    uneasy[1:] = kept[:-1] | ~joined | ~same
    if intent.arrival is not None:
        rows = np.arange(1, len(moves))
        now = intent.direction(rows, np.full(len(rows), INSTANT))
        uneasy[1:] |= some(now != intent.arrival[:-1])
    if any(np.ndim(values) for values in intent.state.inputs.values()):
        uneasy[:] = True
    return uneasy
