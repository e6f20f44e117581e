"""Limits that a corrected program must keep: travel, size and rate of corrections, range of calibration."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ncfix.arrays import Array, Index, Mask, distinct, finite, greatest, lengths, picked, some
from ncfix.compensate.plan.findings import Finding
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.segments import Segments, arcs_within, surely_within
from ncfix.compensate.plan.written import WrittenPieces
from ncfix.machine import Machine

FUZZ = 1e-9
"""Distance beyond a limit, mm or rad, that still counts as on it: rounding of the arithmetic, far below any least
increment."""
RATE = 0.02
"""Largest change of a correction per way, mm/mm: ten times 100 um per 50 mm."""
JUMP = 0.05
"""Largest change of a correction at one place, mm: a large play."""
RATE_TURNING = 1.0
"""Largest change of a correction per turn of a rotary axis, mm/rad: 100 um in a tenth of a radian."""
LOOKS = 64
"""Number of stretches into which a curved motion is divided to find the places where an axis turns back."""
NEAR = 8
"""If a sample is closer to a limit than the travel of the axis in the motion divided by this, the axis may pass the
limit between samples. That holds for motions of up to 14 turns."""
PLACES = 8
"""Number of inner points per step of the search: each step shrinks the bracket to 2/9."""
STEPS = 16
"""Number of steps of the search: the place of the maximum is found to 4e-11 of the bracket."""

Joints = Callable[[Index, Array], Array]


def findings(written: WrittenPieces) -> tuple[Finding, ...]:
    """All violations of limits by corrected motions."""
    found = [not_a_number(written), *beyond_ranges(written), too_large(written), too_fast(written)]
    return tuple(finding for finding in found if len(finding))


def not_a_number(written: WrittenPieces) -> Finding:
    """NCF408: motions with a corrected end that is not finite."""
    pieces = written.pieces
    bad = ~finite(pieces.end)
    bad[pieces.arc] |= ~finite(pieces.centre[pieces.arc])
    rows = distinct(pieces.move[bad & ~pieces.unchanged])
    return Finding.of("NCF408", rows, "the corrected position is not a finite number")


def beyond_ranges(written: WrittenPieces) -> tuple[Finding, Finding]:
    """Motions that leave the range of an axis.

    NCF405: as programmed, or by pieces that end beyond a range on the way back from a start beyond it. NCF404: only
    when corrected. A position on the limit is within the range. For a motion that leaves one range and comes back from
    beyond another, the former is reported, because it does not depend on how the motion is split.
    """
    programmed, corrected = programmed_excess(written), _corrected_excess(written)
    if (corrected > FUZZ).any():
        each = np.flatnonzero((corrected > FUZZ).any(axis=1))
        begun = np.full(corrected.shape, -np.inf)  # excess at the starts of motions
        begun[each] = _beyond(written.intent.machine, written.intent.joints_at(each, np.zeros(len(each))))
        either = np.fmax(programmed, np.where(corrected > FUZZ, begun, -np.inf))
        corrected[either > FUZZ] = -np.inf
        programmed = np.where(some(programmed > FUZZ)[:, None], programmed, either)
    outside = "axis {axis} moves {value:.4g} {unit} beyond the range in which its errors are known, {range}"
    over = "the correction moves axis {axis} {value:.4g} {unit} beyond its range, {range}"
    return _of_axes(written, "NCF405", outside, programmed), _of_axes(written, "NCF404", over, corrected)


def increments_beyond_travel(written: WrittenPieces) -> Index:
    """The unchanged incremental motions that leave the range of an axis because their start is displaced."""
    pieces = written.pieces
    rows = np.flatnonzero(written.intent.moves.incremental & pieces.unchanged[pieces.first])
    if not rows.size:
        return rows
    beyond = _corrected_excess(written)
    if (beyond > FUZZ).any():
        beyond[programmed_excess(written) > FUZZ] = -np.inf
    return rows[(beyond[rows] > FUZZ).any(axis=1)]


def _corrected_excess(written: WrittenPieces) -> Array:
    """(n, n_axes) `excess` of the corrected motions: the largest of their pieces."""
    pieces = written.pieces
    each = np.arange(len(pieces))
    tcp = written.intent.moves.tcp[pieces.move]
    curved = tcp.copy()
    if tcp.any():
        curved[curved] = _may_leave(written.intent, *(end[curved] for end in written.ends))
    if pieces.arc.any():
        curved |= _arcs_may_leave(written.intent.machine, written.segments, tcp)
    found = excess(written.intent.machine, written.joints, each, curved, written.done)
    beyond = np.full((len(written.intent.moves), len(written.intent.moves.axes)), -np.inf)
    if (found > FUZZ).any():
        np.maximum.at(beyond, pieces.move, found)
    return beyond


def too_large(written: WrittenPieces) -> Finding:
    """NCF406: corrections above the machine's `max_correction`: norm of the linear axes, and each rotary axis."""
    machine = written.intent.machine
    shift = written.correction
    linear = lengths(shift[:, ~machine.rotary]) / machine.max_correction[0]
    rotary = greatest(np.abs(shift[:, machine.rotary])) / machine.max_correction[1]
    share = np.maximum(linear, rotary)
    over = (share > 1 + FUZZ) & ~written.pieces.unchanged
    rows, values = _worst(written.pieces.move[over], share[over])
    text = "the correction is {value:.3g} times as large as the machine file allows"
    return Finding("NCF406", rows, values, text)


def too_fast(written: WrittenPieces) -> Finding:
    """NCF407: corrections of the linear axes that change by more than `JUMP` plus what the rates allow."""
    machine, pieces = written.intent.machine, written.pieces
    change = np.diff(written.correction[:, ~machine.rotary], axis=0)
    if written.intent.wordless is not None:
        change[written.intent.wordless[pieces.move[:-1]][:, ~machine.rotary]] = 0.0
    change = lengths(change)
    over = np.flatnonzero((change > JUMP) & ~pieces.unchanged[1:] & ~pieces.unchanged[:-1])
    way = np.abs(written.programmed[over + 1] - written.programmed[over])
    allowed = JUMP + RATE * way[:, ~machine.rotary].sum(axis=1) + RATE_TURNING * way[:, machine.rotary].sum(axis=1)
    over = over[change[over] > allowed]
    rows, values = _worst(pieces.move[over + 1], change[over])
    return Finding("NCF407", rows, values, "the correction changes by {value:.4f} mm at once")


def excess(machine: Machine, joints: Joints, motion: Index, curved: Mask, ends: Array | None = None) -> Array:
    """(k, n_axes) how far axes go beyond their ranges along motions, mm and rad; negative within.

    joints  returns axis positions (j, n_axes) at fractions (j,) of motions (j,)
    motion  (k,) the motions
    curved  (k,) axes do not move linearly along the motion: it is sampled inside too, not only at its end
    ends    (k, n_axes) axis positions at the ends of the motions, if known
    """
    result = _beyond(machine, joints(motion, np.ones(len(motion))) if ends is None else ends)
    rows = np.flatnonzero(curved)
    if not rows.size:
        return result
    looks = np.arange(LOOKS + 1) / LOOKS
    q = joints(np.repeat(motion[rows], LOOKS + 1), np.tile(looks, len(rows)))
    inside = _beyond(machine, q).reshape(len(rows), LOOKS + 1, -1)
    travel = np.ptp(q.reshape(inside.shape), axis=1)
    best = inside.max(axis=1)
    near, axis = np.nonzero(best > -travel / NEAR)
    place = inside[near, :, axis].argmax(axis=1)
    low, high = looks[np.maximum(place - 1, 0)], looks[np.minimum(place + 1, LOOKS)]

    def beyond(which: Index, fraction: Array) -> Array:
        q = joints(motion[rows[near[which]]], fraction)
        return _beyond(machine, q)[np.arange(len(which)), axis[which]]

    found = _highest(beyond, low, high)
    best[near, axis] = np.maximum(best[near, axis], found)
    result[rows] = np.maximum(result[rows], best)
    return result


def _highest(function: Callable[[Index, Array], Array], low: Array, high: Array) -> Array:
    """(k,) maximum of k functions, each with one maximum between `low` and `high` (k,); a negative one may be too low.

    function  returns the values of functions (j,) at places (j,); many at a time, so that it is called seldom
    """
    highest, searched = np.full(len(low), -np.inf), np.arange(len(low))
    inner = np.arange(1, PLACES + 1)
    for _ in range(STEPS):
        if not searched.size:
            return highest
        step = (high - low) / (PLACES + 1)
        places = low[:, None] + inner * step[:, None]
        found = function(np.repeat(searched, PLACES), places.ravel()).reshape(places.shape)
        rows, best = np.arange(len(found)), found.argmax(axis=1)
        highest[searched] = np.maximum(highest[searched], found[rows, best])
        rise = 2 * np.abs(np.diff(found, axis=1)).max(axis=1)  # bound of the rise between two places
        may = ~(highest[searched] + rise < 0)
        middle, step, searched = places[rows, best][may], step[may], searched[may]
        low, high = middle - step, middle + step
    highest[searched] = function(searched, (low + high) / 2)
    return highest


def _beyond(machine: Machine, q: Array) -> Array:
    """(k, n_axes) how far each axis is beyond the nearer end of its range; negative within, -inf without a range."""
    result = np.empty_like(q)
    for axis, (low, high) in enumerate(machine.ranges.tolist()):
        np.maximum(low - q[:, axis], q[:, axis] - high, out=result[:, axis])
    return result


def programmed_excess(written: WrittenPieces) -> Array:
    """(n, n_axes) `excess` of the programmed motions."""
    intent = written.intent
    each = np.arange(len(intent.moves))
    ends = written.programmed if len(each) == len(written.pieces) else None
    tcp = intent.moves.tcp
    curved, tcp_rows = (
        tcp | _arcs_may_leave(intent.machine, intent.segments, tcp),
        np.flatnonzero(tcp & ~intent.segments.arc),
    )
    if tcp_rows.size:
        curved[tcp_rows] = _may_leave(intent, *(picked(end, tcp_rows) for end in intent.ends))
    return excess(intent.machine, intent.joints_at, each, curved, ends)


def _may_leave(intent: Intent, begin: Array, end: Array) -> Mask:
    """(k,) motions under tool-centre-point control that may leave a range between their ends.

    begin, end  (k, n_axes) axis positions at their ends
    """
    longest = float(np.nanmax(intent.moves.tool_length, initial=0.0))
    return ~surely_within(intent.machine, begin, end, longest)


def _arcs_may_leave(machine: Machine, segments: Segments, tcp: Mask) -> Mask:
    """(n,) arcs that may leave a range between their ends; `tcp` (n,): under tool-centre-point control, all may."""
    may_leave = segments.arc.copy()
    rows = np.flatnonzero(may_leave & ~tcp)
    may_leave[rows] = ~arcs_within(machine, segments.rows(rows))
    return may_leave


def _of_axes(written: WrittenPieces, code: str, text: str, beyond: Array) -> Finding:
    """The finding of all corrected motions with an axis beyond its range; `beyond` (n, n_axes), see `excess`."""
    machine, pieces = written.intent.machine, written.pieces
    if not (beyond > FUZZ).any():
        return Finding.of(code, np.zeros(0, dtype=np.intp), text)
    unchanged = pieces.unchanged[pieces.first]
    axis = np.where(np.isnan(beyond), -np.inf, beyond).argmax(axis=1)
    most = beyond[np.arange(len(beyond)), axis]
    rows = np.flatnonzero((most > FUZZ) & ~unchanged)
    units = np.where(machine.rotary, 180 / np.pi, 1.0)[axis[rows]]
    letters = machine.axis_names
    names = tuple(letters[j] for j in axis[rows].tolist())
    ends = np.where(machine.rotary[:, None], np.degrees(machine.ranges), machine.ranges).tolist()
    ranges = {letter: f"{low:.10g} to {high:.10g}" for letter, (low, high) in zip(letters, ends, strict=True)}
    turns = tuple(machine.rotary[axis[rows]].tolist())
    return Finding(code, rows, most[rows] * units, text, names, turns=turns, ranges=ranges)


def _worst(moves: Index, values: Array) -> tuple[Index, Array]:
    """The distinct motions, and the largest value of each."""
    rows = distinct(moves)
    most = np.zeros(len(rows))
    np.maximum.at(most, np.searchsorted(rows, moves), values)
    return rows, most
