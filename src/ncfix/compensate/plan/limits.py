"""What a corrected program must not do: leave the travel, correct too much or too fast, go where nothing is known."""

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
"""mm or rad beyond a limit that count as on it: rounding of the arithmetic, a thousandth of any control's digit."""
RATE = 0.02
"""How much a correction may change per mm of way, mm/mm: ten times what 100 um per 50 mm makes."""
JUMP = 0.05
"""mm that a correction may change at one place: a large play."""
RATE_TURNING = 1.0
"""The same per rad of a rotary axis, mm/rad: 100 um in a tenth of a radian."""
LOOKS = 64
"""Places at which a curved motion is looked at for where an axis turns back."""
NEAR = 8
"""An axis whose highest look is less than an eighth of its travel below a limit may pass it in between (14 turns)."""
PLACES = 8
"""Places between two that each step of the search looks at: the bracket falls to 2 parts of 9."""
STEPS = 16
"""Steps of the search: where the highest place is, to 4e-11 of the bracket."""

Joints = Callable[[Index, Array], Array]


def findings(written: WrittenPieces) -> tuple[Finding, ...]:
    """Everything that is against correcting motions as they are written; only corrected ones are looked at."""
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
    """NCF405: motions that leave the range of an axis as programmed, or come back from beyond it in several blocks.

    NCF404: motions that stay within the range of every axis as programmed, and leave one when corrected. On the limit
    is within. Of a motion that both leaves a range and comes back from beyond one the first is said: how many blocks it
    has depends on what has been refused by then.
    """
    programmed, corrected = programmed_excess(written), _corrected_excess(written)
    if (corrected > FUZZ).any():
        each = np.flatnonzero((corrected > FUZZ).any(axis=1))
        begun = np.full(corrected.shape, -np.inf)  # how far motions begin beyond ranges, if they end there
        begun[each] = _beyond(written.intent.machine, written.intent.joints_at(each, np.zeros(len(each))))
        either = np.fmax(programmed, np.where(corrected > FUZZ, begun, -np.inf))
        corrected[either > FUZZ] = -np.inf
        programmed = np.where(some(programmed > FUZZ)[:, None], programmed, either)
    outside = "axis {axis} goes {value:.4g} {unit} beyond the range over which its errors are known, {range}"
    over = "the correction takes axis {axis} {value:.4g} {unit} beyond its range, {range}"
    return _of_axes(written, "NCF405", outside, programmed), _of_axes(written, "NCF404", over, corrected)


def increments_beyond_travel(written: WrittenPieces) -> Index:
    """Increments that are left as they are, and that leave the range of an axis because of where they begin."""
    pieces = written.pieces
    rows = np.flatnonzero(written.intent.moves.incremental & pieces.unchanged[pieces.first])
    if not rows.size:
        return rows
    beyond = _corrected_excess(written)
    if (beyond > FUZZ).any():
        beyond[programmed_excess(written) > FUZZ] = -np.inf
    return rows[(beyond[rows] > FUZZ).any(axis=1)]


def _corrected_excess(written: WrittenPieces) -> Array:
    """As `excess`, of the corrected program, (n, n_axes)."""
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
    """NCF406: corrections above the machine's `max_correction`: the linear axes together, each rotary axis alone."""
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
    """NCF407: corrections of the linear axes that change by more than the way in between accounts for."""
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
    """How far axes go beyond their ranges along motions, (k, n_axes) mm and rad; negative while within.

    joints  gives axis positions (j, n_axes) at fractions (j,) of motions (j,)
    motion  (k,) which motions
    curved  (k,) axes do not move linearly along it: looked at inside too, not only at the end
    ends    (k, n_axes) axis positions where they end, if known
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
    """The largest value of functions with one maximum between `low` and `high` (k,); where it is negative, a lower one.

    function  gives the values of functions (j,) at places (j,): many at a time, since few calls are what counts here
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
        rise = 2 * np.abs(np.diff(found, axis=1)).max(axis=1)  # between two places, with some to spare
        may = ~(highest[searched] + rise < 0)
        middle, step, searched = places[rows, best][may], step[may], searched[may]
        low, high = middle - step, middle + step
    highest[searched] = function(searched, (low + high) / 2)
    return highest


def _beyond(machine: Machine, q: Array) -> Array:
    """How far beyond the nearer end of its range each axis is, negative if within; -inf where there is no range."""
    result = np.empty_like(q)
    for axis, (low, high) in enumerate(machine.ranges.tolist()):
        np.maximum(low - q[:, axis], q[:, axis] - high, out=result[:, axis])
    return result


def programmed_excess(written: WrittenPieces) -> Array:
    """As `excess`, of the program as it is; (n, n_axes)."""
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
    """(k,) which motions under tool-centre-point control may leave a range on their way; see `excess`.

    begin, end  (k, n_axes) axis positions
    """
    longest = float(np.nanmax(intent.moves.tool_length, initial=0.0))
    return ~surely_within(intent.machine, begin, end, longest)


def _arcs_may_leave(machine: Machine, segments: Segments, tcp: Mask) -> Mask:
    """(n,) which motions are arcs that may leave a range on their way; see `excess`.

    tcp  (n,) under tool-centre-point control: these may
    """
    may_leave = segments.arc.copy()
    rows = np.flatnonzero(may_leave & ~tcp)
    may_leave[rows] = ~arcs_within(machine, segments.rows(rows))
    return may_leave


def _of_axes(written: WrittenPieces, code: str, text: str, beyond: Array) -> Finding:
    """A finding for each corrected motion with an axis beyond its range; values in mm or degrees."""
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
    """Each motion once, with its largest value."""
    rows = distinct(moves)
    most = np.zeros(len(rows))
    np.maximum.at(most, np.searchsorted(rows, moves), values)
    return rows, most
