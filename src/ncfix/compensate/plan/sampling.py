"""Where a motion must be looked at: as densely as the error model may bend, and at its kinks and jumps."""

from __future__ import annotations

import numpy as np

from ncfix.arrays import Array, Index, Mask, offsets, owners, picked, places, vector_product
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.segments import Segments, accelerations
from ncfix.machine import Machine

DENSITY = 4
"""Samples per shortest distance over which the error model bends."""
TURN = 2 * np.pi
EIGHTH = TURN / 8
"""rad; whatever the errors do, turning an axis bends their effect in the workpiece over an eighth of a turn."""
MOST = 1 << 19
"""Samples on one motion, so many that they take a second or two."""
MOST_SHOWN = 1 << 14
"""Samples on one motion for figures: of all motions of a program at once, and of programs that nobody checked."""
MOST_TURNS = MOST / DENSITY * EIGHTH
"""rad; a motion that turns an axis by more cannot be looked at."""
SHARES = 16
"""Of a motion that turns far, looked at each by itself."""
BISECTIONS = 40
"""How often the stretch in which an axis turns round is halved to find where."""


def features(machine: Machine) -> Array:
    """The way of each axis (n_axes,) over which the tip's error in the workpiece may bend, mm and rad."""
    return np.where(machine.rotary, np.minimum(machine.feature_lengths, EIGHTH), machine.feature_lengths)


def bends(intent: Intent, rows: Index) -> Array:
    """About how many times the error may bend along each motion, (k,).

    The ways of all axes, each in the lengths over which it bends the error, added up. Without tool-centre-point
    control the ways are those of the commands, on arcs those of the full arc. With it the linear axes also make the way
    of swinging the tip round: up to the distance of the tip from the rotary axes times the angle.
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
    """As `bends`, but under tool-centre-point control by what the linear axes have to go, and not by what they might.

    An axis whose acceleration is at most a, per motion squared, goes up and down by no more than a / 3 beside its way;
    of a k-th of the motion a is a k-th of a k-th. Motions that turn far are looked at in `SHARES` shares.
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
    """Motions (k,) on which the error may bend so often that they are not looked at closely enough."""
    return DENSITY * bends(intent, rows) >= MOST


def reach(intent: Intent, rows: Index) -> Array:
    """The distance of the tip from the rotary axes at the ends of motions, roughly and from above, (k,) mm."""
    machine, moves = intent.machine, intent.moves
    points = [float(np.linalg.norm(axis.point)) for axis in machine.axes if axis.rotary]
    fixed = max(points, default=0.0) + float(np.linalg.norm(machine.workpiece_offset))
    tip = np.maximum(*(np.linalg.norm(end[rows][:, intent.columns], axis=1) for end in (moves.start, moves.end)))
    return tip + fixed + np.abs(moves.tool_length[rows])


def arc_radii(intent: Intent, rows: Index) -> Array:
    """The radii of arcs where they start, (k,) mm."""
    start = intent.segments.start[rows[:, None], intent.columns] - intent.moves.centre[rows]
    return np.linalg.norm(vector_product(intent.moves.normal[rows], start), axis=1)


def even(counts: Index) -> Array:
    """Fractions that divide motions evenly, ends left out: `counts` (n,) of them each, flat."""
    return (places(counts) + 1) / np.repeat(counts + 1, counts)


def interior(
    intent: Intent, real: Segments, rows: Index, per_bend: float, least: int, often: Array | None = None
) -> tuple[Index, Array]:
    """Fractions at which to look at motions, ends left out: counts (k,) and flat fractions, ascending.

    `per_bend` samples for each time that the error may bend, from `least` to `MOST`, and one wherever an axis passes a
    kink or a jump of the error model, done as `real` has the motions. Those that are too long get the least. `often`:
    how many times it may bend, (k,), if that is known better than `bends` has it.
    """
    counts = closely(bends(intent, rows) if often is None else often, per_bend, least)
    return with_kinks(intent, real, rows, counts, even(counts))


def closely(often: Array, per_bend: float, least: int, most: int = MOST) -> Index:
    """At how many places inside of motions to look, along which the error may bend so often, (k,): see `interior`."""
    often = np.where(DENSITY * often >= MOST, 0.0, often)
    return np.clip(np.ceil(per_bend * often), least, most).astype(np.intp)


def with_kinks(
    intent: Intent, real: Segments, rows: Index, counts: Index, fraction: Array, beside: float = 0.0
) -> tuple[Index, Array]:
    """Fractions of motions, ends left out, and those at which an axis passes a kink or a jump of the error model.

    counts (k,) and flat `fraction`, ascending; `beside`: not there, but so far before and behind it.
    """
    if not intent.kinks:
        return counts, fraction
    owner, at = _nodes(intent.curved[rows], counts, fraction)
    q = intent.joints(rows[owner], real.at(rows[owner], at))
    where, found = crossed(intent, owner, at, q)
    if not where.size:
        return counts, fraction
    sides = [(where, found)] if not beside else [(where, np.clip(found + way, 0.0, 1.0)) for way in (-beside, beside)]
    return merged(len(rows), (owners(counts), fraction), *sides)


def merged(n: int, *lists: tuple[Index, Array]) -> tuple[Index, Array]:
    """Several flat lists of (owner, fraction) as one with counts (n,), ascending within each owner, none twice."""
    owner = np.concatenate([each[0] for each in lists])
    fraction = np.concatenate([each[1] for each in lists])
    order = np.lexsort((fraction, owner))
    owner, fraction = owner[order], fraction[order]
    new = np.ones(len(owner), dtype=bool)
    new[1:] = (np.diff(owner) != 0) | (np.diff(fraction) > 0)
    return np.bincount(owner[new], minlength=n).astype(np.intp), fraction[new]


def passed(intent: Intent, before: Array, after: Array) -> tuple[Index, Array]:
    """Where axes going from `before` to `after` (k, n_axes) pass a kink or a jump: which motion, share of its way."""
    found = [(np.zeros(0, dtype=np.intp), np.zeros(0))]
    for j, points in intent.kinks:
        begin, end = before[:, j], after[:, j]
        if intent.machine.axes[j].endless:
            begin, end, points = _unrolled(begin, end, points)
        found.append(_crossings(begin, end, points))
    return np.concatenate([each[0] for each in found]), np.concatenate([each[1] for each in found])


def crossed(intent: Intent, owner: Index, fraction: Array, q: Array) -> tuple[Index, Array]:
    """Where axes pass a kink or a jump on motions given by axis positions q (k, n_axes) at nodes, flat.

    Axes move nearly linearly from node to node. Returns owner and fraction, flat.
    """
    stretch, share = passed(intent, q[:-1], q[1:])
    inside = owner[stretch] == owner[stretch + 1]
    stretch, share = stretch[inside], share[inside]
    return owner[stretch], (1 - share) * fraction[stretch] + share * fraction[stretch + 1]


def _nodes(curved: Mask, counts: Index, fraction: Array) -> tuple[Index, Array]:
    """Samples and both ends of curved motions, the ends only of others: owner and fraction, flat."""
    many = np.where(curved, counts, 0) + 2
    owner, last = owners(many), offsets(many)[1:] - 1
    at, inside = np.zeros(len(owner)), np.ones(len(owner), dtype=bool)
    at[last], inside[last], inside[last - many + 1] = 1.0, False, False
    at[inside] = fraction[curved[owners(counts)]]
    return owner, at


def _unrolled(before: Array, after: Array, points: Array) -> tuple[Array, Array, Array]:
    """Ways (k,) of an endless axis, without the turns that lie behind both ends, and the kinks on them.

    Kinks come again with every turn. Of a motion with more than `MOST_TURNS` only the beginning is looked at.
    """
    after = before + np.clip(after - before, -MOST_TURNS, MOST_TURNS)
    behind = TURN * np.floor(np.minimum(before, after) / TURN)
    before, after = before - behind, after - behind
    ends = np.concatenate([before, after])
    low, high = np.nanmin(ends, initial=0.0), np.nanmax(ends, initial=0.0)
    turns = np.arange(np.floor((low - points[-1]) / TURN), np.ceil((high - points[0]) / TURN) + 1)
    return before, after, np.unique(points[None] + TURN * turns[:, None])


def _crossings(before: Array, after: Array, points: Array) -> tuple[Index, Array]:
    """Where values that go from `before` to `after` (k,) pass `points`: index and share of the way, ends left out."""
    low, high = np.minimum(before, after), np.maximum(before, after)
    first = np.searchsorted(points, low, side="right")
    counts = np.maximum(np.searchsorted(points, high, side="left") - first, 0)
    counts = np.where(np.isfinite(before + after), counts, 0)
    owner = owners(counts)
    passed = points[first[owner] + places(counts)]
    return owner, (passed - before[owner]) / (after[owner] - before[owner])


def reversals(intent: Intent, rows: Index, counts: Index, fraction: Array) -> tuple[Index, Array]:
    """Where axes of curved motions change direction, if that matters: owner and fraction, flat."""
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
