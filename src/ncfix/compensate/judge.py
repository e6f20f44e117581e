"""How far the real machine leaves the intended path on corrected pieces, looked at as closely as is needed."""

from __future__ import annotations

import numpy as np

from ncfix.compensate.budget import DENSITY
from ncfix.compensate.findings import Array, Index, Mask
from ncfix.compensate.grids import INSTANT
from ncfix.compensate.intent import Intent
from ncfix.compensate.ragged import largest, owners, slices
from ncfix.compensate.sampling import interior, merged
from ncfix.compensate.segments import Segments

SURE = 0.5
"""A motion whose deviation at a first look is under this share of the tolerance is within it."""
FIRST = 2
"""Samples for each time that the error may bend, at a first look."""
LEAST = 9
"""Fewest samples at a second look."""
BATCH = 100_000
"""Samples worked on at a time."""


def deviations(intent: Intent, real: Segments, rows: Index, uneasy: Mask, tolerance: float) -> Array:
    """The largest deviation of the tip along motions `rows` (k,) done as `real` has them, mm.

    uneasy  (n,) motions that may not begin where they should: they are looked at there too

    Short motions get one sample in the middle at first. Those that are off by over half of the tolerance are looked
    at again, as closely as the error model may bend.
    """
    worst = _look(intent, real, rows, uneasy, FIRST, 1)
    doubtful = np.flatnonzero(~(worst <= SURE * tolerance))
    if doubtful.size:
        closer = _look(intent, real, rows[doubtful], uneasy, DENSITY, LEAST)
        worst[doubtful] = np.maximum(worst[doubtful], closer)
    return worst


def _look(intent: Intent, real: Segments, rows: Index, uneasy: Mask, per_bend: float, least: int) -> Array:
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
    """How far the tip is from where it should be at fractions of motions done as `real` has them, (k,) mm."""
    gap = intent.gap(rows, fraction, real.at(rows, fraction))
    size: Array = np.sqrt(np.einsum("ij,ij->i", gap, gap))
    return size


def uneasy_starts(intent: Intent, kept: Mask) -> Mask:
    """Motions that may not begin where they should, though the one before ended where it should, (n,).

    Because that one is kept, or ended with another tool, or elsewhere, or because an axis reverses.
    """
    moves = intent.moves
    uneasy = np.ones(len(moves), dtype=bool)
    joined = (moves.start[1:] == moves.end[:-1]).all(axis=1)
    same = moves.tool_length[1:] == moves.tool_length[:-1]
    uneasy[1:] = kept[:-1] | ~joined | ~same
    if intent.arrival is not None:
        rows = np.arange(1, len(moves))
        now = intent.direction(rows, np.full(len(rows), INSTANT))
        uneasy[1:] |= (now != intent.arrival[:-1]).any(axis=1)
    if any(np.ndim(values) for values in intent.state.inputs.values()):
        uneasy[:] = True
    return uneasy
