"""Contours that the control offsets by the radius of the tool: how far the tool is off along its own path.

With cutter radius compensation the program says the contour, and the tool goes beside it. What the control makes of
corrected points at a corner is not what was added to them: the lines beside the contour turn with their ends, and where
they meet moves by that over the cosine of half the turn. So the tool is followed here where it goes: beside each
motion, and at each corner, inside it where the lines beside it meet, outside it round the corner and, in turns of less
than a right angle, where controls lead the lines on until they meet.

Distances are those of curves: at a place of a motion across it; at a corner from either path to the nearest of the two
rays of the other one.
"""

from __future__ import annotations

import numpy as np

from ncfix.arrays import Array, Index, Mask, lengths, owners, picked, stacked, taken, vector_product
from ncfix.compensate.plan.intent import Intent, correctable
from ncfix.compensate.plan.sampling import interior
from ncfix.compensate.plan.segments import Segments
from ncfix.control.moves import MotionKind, Moves
from ncfix.values import frozen

NO_WAY = 1e-9
"""mm in the plane; a motion that goes no farther makes no corner."""
SMOOTH = 0.02
"""rad; where two motions turn by less, the lines beside them are taken to meet over the corner."""
SHARPEST = 0.05
"""Cosine of half the turn: in sharper corners the lines beside meet far away, and are looked at so far at most."""
STEPS = 12
"""Newton steps to where curves beside two motions meet."""
MET = 1e-6
"""mm"""
LOOKS = 4
"""Places for each time that the error may bend; at least `LEAST`."""
LEAST = 5


@frozen
class OffsetPoints:
    """Places of the tool beside a contour, flat.

    move      (k,) the motion, or the one that ends at the corner
    before    (k,) mm: how far the tool is off without a correction
    after     (k,) mm: with it
    corner    (k,) at a corner at which the contour turns
    rounding  (k,) what there half a step in each word may do, in half steps
    """

    move: Index
    before: Array
    after: Array
    corner: Mask
    rounding: Array


@frozen
class ContactPath:
    """A path of tool contact in columns: rows are those motions of a program that make a way beside a contour.

    start, end  (k, 3) of the contour, mm
    arc         (k,)
    centre      (k, 3), and `turn` (k,) the sense in which arcs go about `up`: 1 or -1
    up          (k, 3) unit normals of the planes
    radius      (k,) mm to the left of the way
    """

    start: Array
    end: Array
    arc: Mask
    centre: Array
    turn: Array
    up: Array
    radius: Array

    @classmethod
    def of(cls, segments: Segments, rows: Index, up: Array, radius: Array) -> ContactPath:
        """Of motions `rows` done as `segments` have them."""
        columns = segments.columns
        sense = np.sign(np.nan_to_num(segments.sweep[rows]) * _dot(np.nan_to_num(segments.normal[rows]), up))
        ends = picked(segments.start, rows)[:, columns], picked(segments.end, rows)[:, columns]
        arc = segments.arc[rows] & (sense != 0)
        return cls(*ends, arc, np.nan_to_num(segments.centre[rows]), sense, up, radius)

    def heading(self, points: Array) -> Array:
        """The way in the plane at points (k, 3) of the motions, unit vectors."""
        straight = _flat(self.end - self.start, self.up)
        spoke = _flat(points - self.centre, self.up)
        way = np.where(self.arc[:, None], self.turn[:, None] * vector_product(self.up, spoke), straight)
        return _unit(way)

    def left(self, points: Array) -> Array:
        """The way to the left at points (k, 3) of the motions, unit vectors in the plane."""
        return vector_product(self.up, self.heading(points))

    def beside(self, points: Array, way: Array) -> Array:
        """Where the tool is, (k, 3), gone on by `way` (k,) mm in the plane from beside points of the motions."""
        here = points + self.radius[:, None] * self.left(points)
        straight = here + way[:, None] * self.heading(points)
        spoke = _flat(here - self.centre, self.up)
        size = np.maximum(lengths(spoke), NO_WAY)
        angle = (self.turn * way / size)[:, None]
        turned = np.cos(angle) * spoke + np.sin(angle) * vector_product(self.up, spoke)
        return np.where(self.arc[:, None], here - spoke + turned, straight)

    def beside_heading(self, at: Array) -> Array:
        """The way of the tool at places beside motions, unit vectors."""
        spoke = _flat(at - self.centre, self.up)
        sign = self.turn * np.sign(
            1 - self.turn * self.radius / np.maximum(lengths(_flat(self.end - self.centre, self.up)), NO_WAY)
        )
        way = np.where(self.arc[:, None], sign[:, None] * vector_product(self.up, spoke), self.heading(self.end))
        return _unit(way)


def is_offset(moves: Moves) -> Mask:
    """(n,) motions beside which the control takes the tool by a radius that is known."""
    if moves.beside is None:
        return np.zeros(len(moves), dtype=bool)
    return np.nan_to_num(moves.beside) != 0


def beside_contours(intent: Intent, real: Segments) -> OffsetPoints | None:
    """How far the tool is off beside contours of which its radius is known; None if there are none.

    real  all motions as they are done
    """
    moves = intent.moves
    if moves.beside is None or moves.across is None:
        return None
    rows = np.flatnonzero(is_offset(moves) & (moves.kind != MotionKind.DWELL) & (moves.kind != MotionKind.CYCLE))
    known = np.isfinite(np.hstack([table[rows] for table in (moves.start, moves.end, real.start, real.end)]))
    rows = rows[known.all(axis=1)]
    if not rows.size:
        return None
    up = np.array([frame.rotation for frame in moves.frames])[moves.frame[rows], :, moves.across[rows]]
    meant, done = (ContactPath.of(each, rows, up, moves.beside[rows]) for each in (intent.segments, real))
    makes = np.flatnonzero((lengths(_flat(meant.end - meant.start, up)) > NO_WAY) | meant.arc)
    rows, meant, done = rows[makes], taken(meant, makes), taken(done, makes)
    if not rows.size:
        return None
    parts = [_along(intent, real, rows, meant, done)]
    # two that follow each other beside one contour, but for motions between them that go nowhere in the plane
    moving = np.zeros(len(moves), dtype=bool)
    moving[rows] = True
    off = np.flatnonzero(np.nan_to_num(moves.beside, nan=1.0) == 0)
    first, second = np.arange(len(rows) - 1), np.arange(1, len(rows))
    joined = np.searchsorted(off, rows[first]) == np.searchsorted(off, rows[second])
    joined &= (meant.radius[first] * meant.radius[second] > 0) & (
        np.abs(_dot(meant.up[first], meant.up[second])) > 1 - NO_WAY
    )
    joined &= lengths(_flat(meant.end[first] - meant.start[second], meant.up[first])) < MET
    first = first[joined]
    if first.size:
        pairs = [(taken(course, first), taken(course, first + 1)) for course in (meant, done)]
        leads_in = np.zeros(len(first), dtype=bool)
        before = rows[first] - 1
        leads_in[:] = (before < 0) | (np.nan_to_num(moves.beside, nan=1.0)[np.maximum(before, 0)] == 0)
        parts += _at_corners(intent, real, rows[first], pairs, leads_in)
    return stacked(parts)


def _along(intent: Intent, real: Segments, rows: Index, meant: ContactPath, done: ContactPath) -> OffsetPoints:
    """Beside the motions, from begin to end."""
    counts, fraction = interior(intent, real, rows, LOOKS, LEAST)
    own, fraction = owners(counts), fraction
    own = np.concatenate([own, np.arange(len(rows)), np.arange(len(rows))])
    fraction = np.concatenate([fraction, np.zeros(len(rows)), np.ones(len(rows))])
    move = rows[own]
    places = [each.at(move, fraction) for each in (intent.segments, real)]
    ways = [taken(course, own) for course in (meant, done)]
    for place, course in zip(places, ways, strict=True):
        points = place[:, intent.columns]
        place[:, intent.columns] = course.beside(points, np.zeros(len(points)))
    heading = ways[0].heading(intent.segments.at(move, fraction)[:, intent.columns])
    rise = _dot(ways[0].end - ways[0].start, ways[0].up)
    way = lengths(_flat(ways[0].end - ways[0].start, ways[0].up))
    heading = _unit(
        heading * np.where(ways[0].arc, 1.0, way)[:, None] + np.where(ways[0].arc, 0.0, rise)[:, None] * ways[0].up
    )
    before, after = _gaps(intent, move, fraction, *places)
    tangent = _in_tip(intent, move, places[0], heading)
    found = [_across(gap, tangent) for gap in (before, after)]
    none = np.zeros(len(move), dtype=bool)
    return OffsetPoints(move, found[0], found[1], none, np.full(len(move), 3**0.5))


def _at_corners(
    intent: Intent, real: Segments, rows: Index, pairs: list[tuple[ContactPath, ContactPath]], leads_in: Mask
) -> list[OffsetPoints]:
    """At corners between motions `rows` (k,) and the next ones of the contour."""
    first, second = pairs[0]
    ones = np.ones(len(rows))
    ends = [each.at(rows, ones) for each in (intent.segments, real)]
    ways = first.heading(first.end), second.heading(second.start)
    turn = np.arctan2(_dot(vector_product(ways[0], ways[1]), first.up), _dot(ways[0], ways[1]))
    inner, sharp = turn * first.radius > 0, np.abs(turn) >= SMOOTH
    half = np.maximum(np.cos(turn / 2), SHARPEST)
    shortest = np.minimum(lengths(first.end - first.start), lengths(second.end - second.start))
    beyond = np.where(inner, 0.0, 2 * np.abs(first.radius) * np.sin(np.abs(turn) / 2) / half)
    lever = 1 + beyond / np.maximum(shortest, NO_WAY)
    digits = np.hypot(2**0.5 * lever / half, 1.0)
    found = []
    # where the curves beside them meet: inside, and outside in turns of less than a right angle
    meet = ~leads_in & (inner | (np.abs(turn) <= np.pi / 2))
    points, arrived = zip(*(_meeting(one, other, turn) for one, other in pairs), strict=True)
    wedge = np.flatnonzero(meet & arrived[0] & arrived[1])
    places = [end.copy() for end in ends]
    for place, point in zip(places, points, strict=True):
        place[:, intent.columns] = point
    if wedge.size:
        before, after = _gaps(intent, rows[wedge], ones[wedge], *(place[wedge] for place in places))
        at = points[0][wedge]
        rays = [
            _in_tip(intent, rows[wedge], places[0][wedge], taken(each, wedge).beside_heading(at)) for each in pairs[0]
        ]
        sizes = _from_wedge(before, *rays), _from_wedge(after, *rays)
        found.append(OffsetPoints(rows[wedge], *sizes, sharp[wedge], digits[wedge]))
    # round it, and where the tool comes from and goes on; all the more where nothing meets
    round_ = np.flatnonzero(~inner | leads_in | ~(arrived[0] & arrived[1]))
    for share in (0.0, 0.5, 1.0):
        if not round_.size:
            break
        angle = (turn * np.where(leads_in, 1.0, share))[round_, None]
        left, up = first.left(first.end)[round_], first.up[round_]
        way = np.cos(angle) * left + np.sin(angle) * vector_product(up, left)
        places = [end[round_].copy() for end in ends]
        for place in places:
            place[:, intent.columns] += first.radius[round_, None] * way
        before, after = _gaps(intent, rows[round_], ones[round_], *places)
        tangent = _in_tip(intent, rows[round_], places[0], vector_product(way, up))
        sizes = _across(before, tangent), _across(after, tangent)
        found.append(OffsetPoints(rows[round_], *sizes, sharp[round_], np.full(len(round_), 3**0.5)))
    return found


def _meeting(one: ContactPath, other: ContactPath, turn: Array) -> tuple[Array, Mask]:
    """Where the curves beside two motions meet that meet at a corner, (k, 3), and whether they do."""
    corner = one.radius * np.tan(np.clip(turn, -3.0, 3.0) / 2)
    most = np.abs(one.radius) / SHARPEST
    back, on = np.clip(-corner, -most, most), np.clip(corner, -most, most)
    over = (one.left(one.end) + other.left(other.start)) * one.radius[:, None]
    smooth = np.abs(turn) < SMOOTH
    flat = one.end + over / np.where(smooth, 1 + np.cos(turn), 1.0)[:, None]
    for _ in range(STEPS):
        here, there = one.beside(one.end, back), other.beside(other.start, on)
        miss = _flat(there - here, one.up)
        a, b = one.beside_heading(here), other.beside_heading(there)
        across = _dot(vector_product(a, b), one.up)
        safe = np.where(np.abs(across) < 1e-6, 1.0, across)
        back = back + np.where(smooth, 0.0, _dot(vector_product(miss, b), one.up) / safe)
        on = on + np.where(smooth, 0.0, _dot(vector_product(miss, a), one.up) / safe)
        back, on = np.clip(back, -most, most), np.clip(on, -most, most)
    here, there = one.beside(one.end, back), other.beside(other.start, on)
    arrived = lengths(_flat(there - here, one.up)) < MET
    result: Array = np.where(smooth[:, None], flat, here)
    return result, smooth | arrived


def _gaps(intent: Intent, move: Index, fraction: Array, meant: Array, done: Array) -> tuple[Array, Array]:
    """Actual minus intended tip, (k, 3) mm, under the commands of the program and under others (k, n_axes)."""
    joints = [intent.joints(move, each) for each in (meant, done)]
    gaps = intent.gaps(move, meant, joints, intent.states(move, fraction))
    before, after = (correctable(intent, move, each, gap) for each, gap in zip((meant, done), gaps, strict=True))
    return before, after


def _in_tip(intent: Intent, move: Index, commands: Array, ways: Array) -> Array:
    """Unit vectors (k, 3) of commands as the tip makes them in the workpiece."""
    return _unit(np.einsum("kij,kj->ki", np.broadcast_to(intent.follows(move, commands), (len(move), 3, 3)), ways))


def _across(gap: Array, tangent: Array) -> Array:
    """The size of gaps (k, 3) across a way."""
    along = _dot(gap, tangent)
    return lengths(gap - along[:, None] * tangent)


def _from_wedge(gap: Array, come: Array, go: Array) -> Array:
    """The distance between two corners alike, a gap (k, 3) apart, to which one comes and goes by unit vectors."""
    square = _dot(gap, gap)
    by_come, by_go = (_dot(gap, way) for way in (come, go))

    def to_rays(sign: float) -> Array:
        rays = [np.maximum(sign * by_come, 0.0), np.maximum(-sign * by_go, 0.0)]
        return np.sqrt(np.maximum(square - np.maximum(*rays) ** 2, 0.0))

    return np.maximum(to_rays(1.0), to_rays(-1.0))


def _dot(vectors: Array, others: Array) -> Array:
    return np.einsum("ij,ij->i", vectors, others)


def _flat(vectors: Array, up: Array) -> Array:
    """The parts of vectors (k, 3) in planes."""
    return vectors - _dot(vectors, up)[:, None] * up


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(lengths(vectors), 1e-300)[:, None]
