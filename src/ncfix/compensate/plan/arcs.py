"""Arcs that stay arcs: the circle through the corrected ends that follows the corrected path best.

The centre lies on the perpendicular bisector of the corrected ends, so that the radii at both ends always agree. Its
place on the bisector is found by least squares over the corrected path, starting from the programmed centre plus the
mean correction.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ncfix.arrays import Array, Index, Mask, picked, slices, stacked, vector_product
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.segments import ArcColumns, Segments, sweep_between
from ncfix.values import frozen

LOOKS = np.arange(1, 13) / 13
"""Fractions of each arc at which the corrected path is sampled to find the centre."""
BATCH = 1024
"""Number of arcs worked on at a time, so that their samples stay in the processor's cache."""
NUDGE = 1e-3
"""Step of the centre, mm, for the derivative of the points by its place."""
CLOSED = 1e-6
"""Distance, mm, below which both ends of an arc are one point."""
TURNED = 1e-9
"""Fraction of a turn up to which a sweep beyond whole turns is none."""
APART = 4.0
"""Least distance between the ends of an arc that is not a full circle, as a multiple of the rounding: ends that are
rounded onto each other would make it one."""


Pair = tuple[Array, Array]


@frozen
class Closure:
    """The difference of start and end radius that a control accepts for an arc: up to `mm`, or `relative` times the
    radius, whichever is larger."""

    mm: float = 0.0283
    relative: float = 0.001

    def allowance(self, radius: float) -> float:
        """The accepted difference for a radius, mm."""
        return max(self.mm, self.relative * radius)


@frozen
class Fitted:
    """Corrected arcs.

    centre  (k, 3) mm
    sweep   (k,) rad
    sound   (k,) whether the control will accept the arc and understand it as meant
    """

    centre: Array
    sweep: Array
    sound: Mask


def fitted(intent: Intent, standing: Segments, rows: Index, closure: Closure, rounding: float) -> Fitted:
    """Fit arcs `rows` (k,) to the corrected path between their corrected ends.

    standing  all motions, with the starts and ends at which they really start and end
    closure   the difference of radii that the control accepts; half of it is used
    rounding  largest shift of a point by rounding to the control's digits, mm
    """
    return stacked([_fitted(intent, standing, rows[part], closure, rounding) for part in slices(len(rows), BATCH)])


def _fitted(intent: Intent, standing: Segments, rows: Index, closure: Closure, rounding: float) -> Fitted:
    arcs = standing.rows(rows)
    ends = arcs.start[:, intent.columns], arcs.end[:, intent.columns]
    programmed, wanted = _corrected_path(intent, standing, rows)
    mean = intent.moves.centre[rows] + (wanted - programmed).mean(axis=1).T
    centre = arcs.centre + across(mean - arcs.centre, arcs.normal)  # along the normal, it has no meaning
    closed = full_circles(intent, rows) & (np.linalg.norm(across(ends[1] - ends[0], arcs.normal), axis=1) < CLOSED)
    centre = np.where(closed[:, None], centre, _onto_bisector(*ends, arcs.normal, centre))
    best = _best_on_bisector(arcs, ends, centre, wanted)
    centre = np.where(closed[:, None], centre, best)
    sweep = np.where(closed, arcs.sweep, sweep_between(*ends, centre, arcs.normal, arcs.sweep))
    sound = _sound(arcs, ends, centre, sweep, closed, closure, rounding)
    off = wanted - _points(arcs, ends, centre)
    before = wanted - programmed, (ends[0] - picked(intent.moves.start, rows)[:, intent.columns]).T[:, None]
    sound &= _farthest(off) <= np.maximum(closure.mm / 2, sum(map(_farthest, before)))
    return Fitted(centre, sweep, sound)


def full_circles(intent: Intent, rows: Index) -> Mask:
    """(k,) whether arcs `rows` are full circles: they end in their plane where they started, after whole turns."""
    moves = intent.moves
    turns = moves.sweep[rows] / (2 * np.pi)
    whole = (np.abs(turns) > 0.5) & (np.abs(turns - np.round(turns)) < 1e-6)
    chord = (picked(moves.end, rows) - picked(moves.start, rows))[:, intent.columns]
    return whole & (np.linalg.norm(across(chord, moves.normal[rows]), axis=1) < CLOSED)


def _corrected_path(intent: Intent, real: Segments, rows: Index) -> tuple[Array, Array]:
    """(3, looks, k) X Y Z as programmed at `LOOKS` of each arc, and as the correction should place them, mm.

    An axis that gets no word should be where it is without a correction: on its programmed way, from where it stands.
    """
    each, at = np.tile(rows, len(LOOKS)), np.repeat(LOOKS, len(rows))
    commands, chords = (
        table.reshape(len(at), -1) for table in (intent.segments.evenly(rows, LOOKS), real.chords(rows, LOOKS))
    )
    programmed = commands[:, intent.columns]
    wanted = intent.improved(each, at, commands, chords)[:, intent.columns]
    if intent.mute is not None:
        off = (picked(real.start, each) - picked(intent.moves.start, each))[:, intent.columns]
        wanted = np.where(intent.mute[each], programmed + off, wanted)
    shape = 3, len(LOOKS), len(rows)
    return programmed.T.reshape(shape), wanted.T.reshape(shape)


def across(vectors: Array, normal: Array) -> Array:
    """(k, 3) the components of vectors (k, 3) across the normals (k, 3)."""
    return vectors - np.einsum("ij,ij->i", vectors, normal)[:, None] * normal


def _onto_bisector(start: Array, end: Array, normal: Array, centre: Array) -> Array:
    """(k, 3) centres moved within their plane onto the perpendicular bisector of both ends."""
    chord = across(end - start, normal)
    length = np.linalg.norm(chord, axis=1, keepdims=True)
    along = chord / np.where(length > 0, length, 1.0)
    off = np.einsum("ij,ij->i", centre - (start + end) / 2, along)[:, None]
    return centre - off * along


def _best_on_bisector(arcs: Segments, ends: Pair, centre: Array, wanted: Array) -> Array:
    """(k, 3) centres moved along the bisector so that the arcs are closest to the wanted points, by least squares."""
    chord = across(ends[1] - ends[0], arcs.normal)
    way = vector_product(arcs.normal, chord)
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
    here = _points(arcs, ends, centre)
    slope = (_points(arcs, ends, centre + NUDGE * way) - here) / NUDGE
    off = wanted - here
    squares, share = (np.einsum("ijk,ijk->k", slope, each) for each in (slope, off))
    amount = share / np.maximum(squares, 1e-12)
    limit = 10 * _farthest(off) + NUDGE
    return centre + np.clip(amount, -limit, limit)[:, None] * way


def _farthest(off: Array) -> Array:
    """(k,) length of the longest of the vectors (3, looks, k) of each arc."""
    return np.sqrt((off * off).sum(axis=0).max(axis=0))


def _points(arcs: Segments, ends: Pair, centre: Array) -> Array:
    """(3, looks, k) X Y Z at `LOOKS` of the arcs with other ends and centres, mm."""
    sweep = sweep_between(*ends, centre, arcs.normal, arcs.sweep)
    return ArcColumns.of(replace(arcs, centre=centre, sweep=sweep), np.arange(len(centre))).at(LOOKS[:, None])


def _sound(
    arcs: Segments, ends: Pair, centre: Array, sweep: Array, closed: Mask, closure: Closure, rounding: float
) -> Mask:
    """(k,) whether radii agree to half of what the control accepts, after rounding, and the arc cannot be misread."""
    radii = [np.linalg.norm(across(point - centre, arcs.normal), axis=1) for point in ends]
    allowed = np.maximum(closure.mm, closure.relative * np.minimum(*radii)) / 2
    agree = np.abs(radii[0] - radii[1]) + 4 * rounding <= allowed
    chord = np.linalg.norm(across(ends[1] - ends[0], arcs.normal), axis=1)
    clear = closed | (chord > APART * rounding + CLOSED)
    same = np.abs(sweep - arcs.sweep) < 0.1 + 0.1 * np.abs(arcs.sweep)
    same &= closed | (turns_begun(sweep) == turns_begun(arcs.sweep))
    return agree & clear & same & np.isfinite(sweep)


def turns_begun(sweep: Array) -> Array:
    """Number of turns of a sweep, counting the last, incomplete one; a remainder below `TURNED` is not counted."""
    return np.ceil(np.abs(sweep) / (2 * np.pi) - TURNED)
