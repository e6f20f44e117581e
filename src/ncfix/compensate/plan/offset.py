"""Contours that the control offsets by the tool radius: the error of the tool on its own, offset path.

With cutter radius compensation the program gives the contour, and the tool goes beside it. At a corner, the offset of
corrected points is not the offset of the programmed points plus the correction: the offset lines turn with their ends,
and their intersection moves by that over the cosine of half the turn. So the tool is followed on its own path: beside
each motion and at each corner. At an inner corner it goes to the intersection of the offset lines; at an outer corner,
round the corner and, in turns of less than a right angle, to the intersection of the extended offset lines, too.

Distances are those of curves: beside a motion, across its path; at a corner, from the corner of either path to the
nearest of the two rays of the other path.
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
"""Way in the plane, mm, up to which a motion makes no corner."""
SMOOTH = 0.02
"""Turn, rad, below which the offset lines of two motions are taken to meet beside the corner."""
SHARPEST = 0.05
"""Least cosine of half the turn: the intersection of the offset lines at sharper corners is limited to that here."""
STEPS = 12
"""Number of Newton steps to the intersection of the offset curves of two motions."""
MET = 1e-6
"""Largest distance, mm, of two points that are the same."""
LOOKS = 4
"""Number of samples for each time that the error may bend; at least `LEAST`."""
LEAST = 5


@frozen
class OffsetPoints:
    """Samples of the offset path of the tool, flat.

    move      (k,) the motion, or the one that ends at the corner
    before    (k,) error of the tool without a correction, mm
    after     (k,) error of the tool with the correction, mm
    corner    (k,) whether the sample is at a corner at which the contour turns
    rounding  (k,) effect of rounding all words by half an output step, in half steps
    """

    move: Index
    before: Array
    after: Array
    corner: Mask
    rounding: Array


@frozen
class ContactPath:
    """The motions of a contour that the control offsets by the tool radius.

    start, end  (k, 3) ends of the motions on the contour, mm
    arc         (k,) whether the motion is an arc
    centre      (k, 3) centre of an arc, mm; `turn` (k,): its sense about `up`, 1 or -1
    up          (k, 3) unit normal of the plane of compensation
    radius      (k,) offset to the left of the direction of motion, mm
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
        """The motions `rows` (k,) of `segments`."""
        columns = segments.columns
        sense = np.sign(np.nan_to_num(segments.sweep[rows]) * _dot(np.nan_to_num(segments.normal[rows]), up))
        ends = picked(segments.start, rows)[:, columns], picked(segments.end, rows)[:, columns]
        arc = segments.arc[rows] & (sense != 0)
        return cls(*ends, arc, np.nan_to_num(segments.centre[rows]), sense, up, radius)

    def heading(self, points: Array) -> Array:
        """(k, 3) direction of motion in the plane at points (k, 3) of the motions, unit vectors."""
        straight = _flat(self.end - self.start, self.up)
        spoke = _flat(points - self.centre, self.up)
        way = np.where(self.arc[:, None], self.turn[:, None] * vector_product(self.up, spoke), straight)
        return _unit(way)

    def left(self, points: Array) -> Array:
        """(k, 3) direction to the left in the plane at points (k, 3) of the motions, unit vectors."""
        return vector_product(self.up, self.heading(points))

    def beside(self, points: Array, way: Array) -> Array:
        """(k, 3) the tool on the offset path, `way` (k,) mm farther in the plane than beside points (k, 3), mm."""
        here = points + self.radius[:, None] * self.left(points)
        straight = here + way[:, None] * self.heading(points)
        spoke = _flat(here - self.centre, self.up)
        size = np.maximum(lengths(spoke), NO_WAY)
        angle = (self.turn * way / size)[:, None]
        turned = np.cos(angle) * spoke + np.sin(angle) * vector_product(self.up, spoke)
        return np.where(self.arc[:, None], here - spoke + turned, straight)

    def beside_heading(self, at: Array) -> Array:
        """(k, 3) direction of the tool at places `at` (k, 3) of the offset path, unit vectors."""
        spoke = _flat(at - self.centre, self.up)
        sign = self.turn * np.sign(
            1 - self.turn * self.radius / np.maximum(lengths(_flat(self.end - self.centre, self.up)), NO_WAY)
        )
        way = np.where(self.arc[:, None], sign[:, None] * vector_product(self.up, spoke), self.heading(self.end))
        return _unit(way)


def is_offset(moves: Moves) -> Mask:
    """(n,) whether the control offsets the motion by a known tool radius."""
    return np.nan_to_num(moves.beside) != 0


def beside_contours(intent: Intent, real: Segments) -> OffsetPoints | None:
    """Errors of the tool on its offset path, beside contours with a known tool radius; None if there are none.

    real  all motions, as corrected
    """
    moves = intent.moves
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
    # consecutive motions of one contour; motions between them without way in the plane do not count
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
    """Errors of the tool beside the motions, from their start to their end."""
    counts, fraction = interior(intent, real, rows, LOOKS, LEAST)
    own = np.concatenate([owners(counts), np.arange(len(rows)), np.arange(len(rows))])
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
    """Errors of the tool at corners between motions `rows` (k,) and the next motions of the contour.

    pairs     both motions of each corner, as programmed and as corrected
    leads_in  (k,) the contour begins with the first motion, so the tool comes straight to it
    """
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
    # the intersection of the offset curves: at inner corners, and at outer ones of less than a right angle
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
    # round an outer corner: at its begin, middle and end; also where the offset curves do not meet
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
    """(k, 3) intersection of the offset curves of two motions that meet at a corner, mm, and whether there is one."""
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
    """(k, 3) actual minus intended tip, mm, under programmed commands `meant` and corrected ones `done` (k, n_axes)."""
    joints = [intent.joints(move, each) for each in (meant, done)]
    gaps = intent.gaps(move, meant, joints, intent.states(move, fraction))
    before, after = (correctable(intent, move, each, gap) for each, gap in zip((meant, done), gaps, strict=True))
    return before, after


def _in_tip(intent: Intent, move: Index, commands: Array, ways: Array) -> Array:
    """(k, 3) unit vectors of X Y Z of commands, as directions of the tip in the workpiece."""
    return _unit(np.einsum("kij,kj->ki", np.broadcast_to(intent.follows(move, commands), (len(move), 3, 3)), ways))


def _across(gap: Array, tangent: Array) -> Array:
    """(k,) size of gaps (k, 3) across the directions `tangent` (k, 3)."""
    along = _dot(gap, tangent)
    return lengths(gap - along[:, None] * tangent)


def _from_wedge(gap: Array, come: Array, go: Array) -> Array:
    """(k,) distance between two equal corners that are a gap (k, 3) apart, with directions `come` and `go` (k, 3)."""
    square = _dot(gap, gap)
    by_come, by_go = (_dot(gap, way) for way in (come, go))

    def to_rays(sign: float) -> Array:
        rays = [np.maximum(sign * by_come, 0.0), np.maximum(-sign * by_go, 0.0)]
        return np.sqrt(np.maximum(square - np.maximum(*rays) ** 2, 0.0))

    return np.maximum(to_rays(1.0), to_rays(-1.0))


def _dot(vectors: Array, others: Array) -> Array:
    return np.einsum("ij,ij->i", vectors, others)


def _flat(vectors: Array, up: Array) -> Array:
    """(k, 3) the components of vectors (k, 3) in the planes with normals `up`."""
    return vectors - _dot(vectors, up)[:, None] * up


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(lengths(vectors), 1e-300)[:, None]
