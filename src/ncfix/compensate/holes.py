"""Where a path goes on over a hole of the other one, between two cuts of it: looked at, however short the hole is.

A straight cut is looked at where it begins, half-way and where it ends. A hole that lies in between is not seen there.
"""

from __future__ import annotations

import numpy as np

from ncfix.compensate.curve import Curve, Samples
from ncfix.compensate.findings import Array, Index
from ncfix.compensate.nearest import Nearest, Search
from ncfix.compensate.ragged import owners, places


def over_holes(search: Search, path: Curve, samples: Samples, before: Index, found: Nearest) -> tuple[Samples, Nearest]:
    """More samples of a path, where it goes over holes of the other one, and what is nearest to them.

    samples, found  (n,) those that there are
    before  (n,) the parabola of the other one that is nearest to the place before each sample
    """
    rows, middles = _crossed(search, samples, before, found.piece)
    piece, share = samples.piece[rows], _beside(path, samples, rows, middles)
    points = path.point(piece, share)
    back = (samples.share[rows] - share) * path.ways[piece]
    more = search.around(points, search.curve.way(found.piece, found.share)[rows] - back)
    return Samples(piece, share, points, np.zeros(len(rows))), more


def _crossed(search: Search, samples: Samples, before: Index, behind: Index) -> tuple[Index, Array]:
    """Samples (k,) before which holes are gone over, from parabolas (n,) to others (n,), and the middles (k, 3)."""
    curve = search.curve
    holes = np.flatnonzero(curve.gaps > search.near)
    passed = np.searchsorted(holes, np.stack([before, behind]), side="right")
    low = passed.min(axis=0)
    counts = np.where(samples.share > 0, passed.max(axis=0) - low, 0)
    rows = owners(counts)
    hole = holes[low[rows] + places(counts)]
    return rows, (curve.end[hole - 1] + curve.begin[hole]) / 2


def _beside(path: Curve, samples: Samples, rows: Index, points: Array) -> Array:
    """The shares of the parabolas that are beside points (k, 3), in the half of each before a sample (k,)."""
    piece, share = samples.piece[rows], samples.share[rows]
    begin = path.point(piece, share - 0.5)
    chord = samples.points[rows] - begin
    square = np.einsum("ij,ij->i", chord, chord)
    along = np.einsum("ij,ij->i", points - begin, chord) / np.where(square > 0, square, 1.0)
    found: Array = share - 0.5 + np.clip(along, 0.0, 1.0) / 2
    return found
