"""Sample points along motions: as dense as the bends of the error model require, and at its kinks and jumps."""

from __future__ import annotations

import numpy as np

from ncfix.arrays import Array, Index, Mask, offsets, owners, picked, places, vector_product
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.segments import Segments, accelerations
from ncfix.machine import Machine

DENSITY = 4
"""Number of samples per shortest distance over which the error model bends."""
TURN = 2 * np.pi
EIGHTH = TURN / 8
"""Feature length, rad, of any rotary axis: its turn bends the effect of errors in the workpiece over this angle."""
MOST = 1 << 19
"""Largest number of samples on one motion; so many take a second or two."""
MOST_SHOWN = 1 << 14
"""Largest number of samples on one motion for figures, which are taken of all motions of a program."""
MOST_TURNS = MOST / DENSITY * EIGHTH
"""Largest turn, rad, of an axis in a motion that can be sampled."""
SHARES = 16
"""Number of shares of a motion that turns far, whose bends are counted separately."""
BISECTIONS = 40
"""Number of bisections by which the place is found at which an axis reverses."""


def features(machine: Machine) -> Array:
    """(n_axes,) shortest way of each axis over which the tip error in the workpiece may bend, mm and rad."""
    return np.where(machine.rotary, np.minimum(machine.feature_lengths, EIGHTH), machine.feature_lengths)


def bends(intent: Intent, rows: Index) -> Array:
    """(k,) estimated number of bends of the error along each motion: the ways of all axes, each over its `features`.

    Without tool-centre-point control the ways are those of the commands; on arcs, those along the arc. With it, the
    linear axes also follow the swinging tip: by up to its distance from the rotary axes times the angle.
    """
    moves, machine = intent.moves, intent.machine
    way = np.abs(picked(moves.end, rows) - picked(moves.start, rows))
    swung = np.flatnonzero(moves.tcp[rows])
    if swung.size:
        angle = way[swung][:, machine.rotary].sum(axis=1)
        way[swung[:, None], intent.columns] += (reach(intent, rows[swung]) * angle)[:, None]
    arcs = np.flatnonzero(intent.segments.arc[rows])
    if arcs.size:
        on = rows[arcs]
        in_plane = np.sqrt(np.maximum(1 - moves.normal[on] ** 2, 0.0))
        along = arc_radii(intent, on) * np.abs(moves.sweep[on])
        way[arcs[:, None], intent.columns] += along[:, None] * in_plane
    way /= features(machine)
    count: Array = way.sum(axis=1)
    count[arcs] += np.abs(moves.sweep[rows[arcs]]) / EIGHTH
    return count


def bends_closely(intent: Intent, rows: Index) -> Array:
    """Like `bends`, but closer under tool-centre-point control, where it uses the real ways of the linear axes.

    An axis whose acceleration is at most a, mm per motion squared, goes to and fro by at most a / 3 beside the way from
    its start to its end. In one of k shares of the motion, a is smaller by k^2. Motions that turn far are taken in
    `SHARES` shares.
    """
    often, machine = bends(intent, rows), intent.machine
    tcp = np.flatnonzero(intent.moves.tcp[rows] & ~intent.segments.arc[rows])
    if not tcp.size:
        return often
    on = rows[tcp]
    begin, end = (intent.joints_at(on, np.full(len(on), place)) for place in (0.0, 1.0))
    longest = float(np.nanmax(np.abs(intent.lengths(on)), initial=0.0))
    acceleration = accelerations(machine, begin, end, longest)
    if acceleration is None:
        return often
    beside = np.where(machine.rotary, 0.0, acceleration[:, None] / 3) / features(machine)
    often[tcp] = np.fmin(often[tcp], (np.abs(end - begin) / features(machine) + beside).sum(axis=1))
    far = np.flatnonzero(often[tcp] > SHARES)
    if far.size:
        places = np.tile(np.arange(SHARES + 1) / SHARES, len(far))
        on_way = intent.joints_at(np.repeat(on[far], SHARES + 1), places).reshape(len(far), SHARES + 1, -1)
        way = np.abs(np.diff(on_way, axis=1)).sum(axis=1)
        often[tcp[far]] = np.fmin(often[tcp[far]], (way / features(machine) + beside[far] / SHARES).sum(axis=1))
    return often


def too_long(intent: Intent, rows: Index) -> Mask:
    """(k,) motions along which the error may bend too often for `MOST` samples."""
    return DENSITY * bends(intent, rows) >= MOST


def reach(intent: Intent, rows: Index) -> Array:
    """(k,) a rough upper bound of the distance of the tip from the rotary axes at the ends of motions, mm."""
    machine, moves = intent.machine, intent.moves
    points = [float(np.linalg.norm(axis.point)) for axis in machine.axes if axis.rotary]
    fixed = max(points, default=0.0) + float(np.linalg.norm(machine.workpiece_offset))
    tip = np.maximum(*(np.linalg.norm(end[rows][:, intent.columns], axis=1) for end in (moves.start, moves.end)))
    return tip + fixed + np.abs(moves.tool_length[rows])


def arc_radii(intent: Intent, rows: Index) -> Array:
    """(k,) the radii of arcs at their starts, mm."""
    start = intent.segments.start[rows[:, None], intent.columns] - intent.moves.centre[rows]
    return np.linalg.norm(vector_product(intent.moves.normal[rows], start), axis=1)


def even(counts: Index) -> Array:
    """Fractions that divide each motion evenly, without its ends: `counts` (n,) for each, flat."""
    return (places(counts) + 1) / np.repeat(counts + 1, counts)


def interior(
    intent: Intent, real: Segments, rows: Index, per_bend: float, least: int, often: Array | None = None
) -> tuple[Index, Array]:
    """The sample points inside motions `rows` (k,): counts (k,) and flat fractions, ascending, without the ends.

    real      the motions as done: an axis that passes a kink or jump of the error model in them gets a sample there
    per_bend  samples for each time that the error may bend, at least `least`, at most `MOST`
    often     (k,) how many times the error may bend; None: by `bends`

    A motion along which the error may bend too often for `MOST` samples gets `least`.
    """
    counts = closely(bends(intent, rows) if often is None else often, per_bend, least)
    return with_kinks(intent, real, rows, counts, even(counts))


def closely(often: Array, per_bend: float, least: int, most: int = MOST) -> Index:
    """(k,) number of samples inside motions along which the error may bend `often` (k,) times, see `interior`."""
    often = np.where(DENSITY * often >= MOST, 0.0, often)
    return np.clip(np.ceil(per_bend * often), least, most).astype(np.intp)


def with_kinks(
    intent: Intent, real: Segments, rows: Index, counts: Index, fraction: Array, beside: float = 0.0
) -> tuple[Index, Array]:
    """Sample points with those added at which an axis passes a kink or a jump of the error model.

    counts    (k,) number of sample points of each motion, and their flat `fraction`, ascending, without the ends
    beside    if not 0: fraction before and behind a kink or jump at which points are added, instead of one at it
    """
    if not intent.kinks:
        return counts, fraction
    owner, at = _nodes(intent.curved[rows], counts, fraction)
    q = intent.joints(rows[owner], real.at(rows[owner], at))
    where, kink = crossed(intent, owner, at, q)
    if not where.size:
        return counts, fraction
    sides = [(where, kink)] if not beside else [(where, np.clip(kink + way, 0.0, 1.0)) for way in (-beside, beside)]
    return merged(len(rows), (owners(counts), fraction), *sides)


def merged(n: int, *lists: tuple[Index, Array]) -> tuple[Index, Array]:
    """Several flat lists of (owner, fraction) as one: counts (n,) and fractions, ascending per owner, none twice."""
    owner = np.concatenate([each[0] for each in lists])
    fraction = np.concatenate([each[1] for each in lists])
    order = np.lexsort((fraction, owner))
    owner, fraction = owner[order], fraction[order]
    new = np.ones(len(owner), dtype=bool)
    new[1:] = (np.diff(owner) != 0) | (np.diff(fraction) > 0)
    return np.bincount(owner[new], minlength=n).astype(np.intp), fraction[new]


def passed(intent: Intent, before: Array, after: Array) -> tuple[Index, Array]:
    """Where axes going from `before` to `after` (k, n_axes) pass a kink or jump: motion and share of its way, flat."""
    found = [(np.zeros(0, dtype=np.intp), np.zeros(0))]
    for j, points in intent.kinks:
        begin, end = before[:, j], after[:, j]
        if intent.machine.axes[j].endless:
            begin, end, points = _unrolled(begin, end, points)
        found.append(_crossings(begin, end, points))
    return np.concatenate([each[0] for each in found]), np.concatenate([each[1] for each in found])


def crossed(intent: Intent, owner: Index, fraction: Array, q: Array) -> tuple[Index, Array]:
    """Where axes pass a kink or a jump, on motions given by axis positions q (k, n_axes) at nodes: owner, fraction.

    The axes are taken to move linearly from node to node. `owner`, `fraction` (k,): motion and place of each node.
    """
    stretch, share = passed(intent, q[:-1], q[1:])
    inside = owner[stretch] == owner[stretch + 1]
    stretch, share = stretch[inside], share[inside]
    return owner[stretch], (1 - share) * fraction[stretch] + share * fraction[stretch + 1]


def _nodes(curved: Mask, counts: Index, fraction: Array) -> tuple[Index, Array]:
    """The sample points and both ends of curved motions, only the ends of others: owner and fraction, flat."""
    many = np.where(curved, counts, 0) + 2
    owner, last = owners(many), offsets(many)[1:] - 1
    at, inside = np.zeros(len(owner)), np.ones(len(owner), dtype=bool)
    at[last], inside[last], inside[last - many + 1] = 1.0, False, False
    at[inside] = fraction[curved[owners(counts)]]
    return owner, at


def _unrolled(before: Array, after: Array, points: Array) -> tuple[Array, Array, Array]:
    """The ends of ways (k,) of an endless axis, with common full turns taken off, and the kinks on these ways.

    Kinks repeat with every turn. A way longer than `MOST_TURNS` is cut off there.
    """
    after = before + np.clip(after - before, -MOST_TURNS, MOST_TURNS)
    behind = TURN * np.floor(np.minimum(before, after) / TURN)
    before, after = before - behind, after - behind
    ends = np.concatenate([before, after])
    low, high = np.nanmin(ends, initial=0.0), np.nanmax(ends, initial=0.0)
    turns = np.arange(np.floor((low - points[-1]) / TURN), np.ceil((high - points[0]) / TURN) + 1)
    return before, after, np.unique(points[None] + TURN * turns[:, None])


def _crossings(before: Array, after: Array, points: Array) -> tuple[Index, Array]:
    """Where values going from `before` to `after` (k,) pass `points`: index and share of the way, without the ends."""
    low, high = np.minimum(before, after), np.maximum(before, after)
    first = np.searchsorted(points, low, side="right")
    counts = np.maximum(np.searchsorted(points, high, side="left") - first, 0)
    counts = np.where(np.isfinite(before + after), counts, 0)
    owner = owners(counts)
    passed = points[first[owner] + places(counts)]
    return owner, (passed - before[owner]) / (after[owner] - before[owner])


def reversals(intent: Intent, rows: Index, counts: Index, fraction: Array) -> tuple[Index, Array]:
    """Where axes reverse on curved motions, if an error depends on direction: owner and fraction, flat.

    counts (k,) and flat `fraction`: sample points between which a change of direction is searched.
    """
    bent = np.flatnonzero(intent.curved[rows])
    if intent.arrival is None or not bent.size:
        return np.zeros(0, dtype=np.intp), np.zeros(0)
    member = np.isin(owners(counts), bent)
    owner, at = owners(counts)[member], fraction[member]
    way = intent.heading(rows[owner], at)
    turns = (way[1:] * way[:-1] < 0) & (owner[1:] == owner[:-1])[:, None]
    place, axis = np.nonzero(turns)
    low, high, before = at[place], at[place + 1], way[place, axis]
    for _ in range(BISECTIONS if place.size else 0):
        middle = (low + high) / 2
        now = intent.heading(rows[owner[place]], middle)[np.arange(len(place)), axis]
        low, high = np.where(now == before, middle, low), np.where(now == before, high, middle)
    return owner[place], (low + high) / 2
