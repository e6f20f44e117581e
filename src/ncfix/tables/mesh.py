"""How many nodes along each axis a grid takes.

A grid that is linear between nodes misses about the sum of what it misses along each axis alone, and that is quickly
looked up on random lines. So for every number of nodes in all the best way to share them out among the axes is known
beforehand; the fewest that really are within the target are then looked for among those.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.tables.grid import Array, Grid
from ncfix.tables.volume import Volume

FINE = 1 / 8
"""Share of the target from which an axis alone is good enough."""
AIM = 0.95
"""Share of a target that is aimed at: poses that were not looked at may miss a little more than those that were."""
LAST = 3
"""Of the largest grids, how many are tried."""

Counts = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Mesh:
    """A grid that was searched for.

    grid     the table
    left     largest correction that it misses at random poses, mm
    reached  whether that is within the target
    """

    grid: Grid
    left: float
    reached: bool


def search(volume: Volume, target: float, most: Sequence[int], points: int, equal: bool = False) -> Mesh:
    """The grid with the fewest nodes found that misses at most `target` (mm) of the correction anywhere.

    At most `most` nodes along each input and `points` in all. `equal` adds one along every input at a time, from two
    on, as Esmaeili (2021), Fig. 4.4.
    """
    if equal:
        side = int(min(min(most), np.floor(points ** (1 / len(most)) + 1e-9)))
        fewest = max(volume.least(axis) for axis in range(len(most)))
        ladder = np.repeat(np.arange(fewest, side + 1)[:, None], len(most), axis=1)
        return _first(volume, target, ladder)
    found = _bisected(
        volume, target, _frontier([_along(volume, axis, target, n) for axis, n in enumerate(most)], points)
    )
    return _thinned(volume, found, target) if found.reached else found


def _along(volume: Volume, axis: int, target: float, most: int) -> tuple[Counts, Array]:
    """Counts along one input, and what each misses there."""
    counts, missed = [], []
    for count in volume.counts(axis, most):
        counts.append(count)
        missed.append(volume.bending(axis, count))
        if missed[-1] <= FINE * target:
            break
    return np.array(counts, dtype=np.intp), np.array(missed)


def _frontier(axes: Sequence[tuple[Counts, Array]], points: int) -> Counts:
    """The counts (k, n_inputs) of which none has more nodes and misses more than another, by their number of nodes."""
    counts, missed = np.zeros((1, 0), dtype=np.intp), np.zeros(1)
    for index, (line, part) in enumerate(axes):
        rest = int(np.prod([line[0] for line, _ in axes[index + 1 :]]))
        grown = np.concatenate([np.repeat(counts, len(line), axis=0), np.tile(line, len(counts))[:, None]], axis=1)
        total = (missed[:, None] + part).reshape(-1)
        allowed = grown.prod(axis=1) * rest <= points
        counts, missed = _undominated(grown[allowed], total[allowed])
    return counts


def _undominated(counts: Counts, missed: Array) -> tuple[Counts, Array]:
    order = np.lexsort((missed, counts.prod(axis=1)))
    sorted_missed = missed[order]
    before = np.minimum.accumulate(np.concatenate([[np.inf], sorted_missed[:-1]]))
    kept = order[sorted_missed < before]
    return counts[kept], missed[kept]


def _at(volume: Volume, counts: Counts, target: float) -> Mesh:
    grid = volume.grid(counts.tolist())
    left = volume.left(grid)
    return Mesh(grid, left, left <= target)


def _first(volume: Volume, target: float, ladder: Counts) -> Mesh:
    """The first of a ladder that is good enough, or the best of them."""
    best = _at(volume, ladder[0], target)
    for counts in ladder[1:]:
        if best.reached:
            break
        best = min(_at(volume, counts, target), best, key=lambda mesh: mesh.left)
    return best


def _bisected(volume: Volume, target: float, ladder: Counts) -> Mesh:
    """The first of a ladder that is good enough, if they get better and better; or the best of the last few."""
    low, high = 0, len(ladder) - 1
    best = min((_at(volume, counts, target) for counts in ladder[-LAST:]), key=lambda mesh: mesh.left)
    while best.reached and low < high:
        middle = (low + high) // 2
        found = _at(volume, ladder[middle], target)
        if found.reached:
            best, high = found, middle
        else:
            low = middle + 1
    return best


def _thinned(volume: Volume, mesh: Mesh, target: float) -> Mesh:
    """Take nodes away as long as the target still holds."""
    counts = np.array(mesh.grid.counts, dtype=np.intp)
    for axis in np.argsort(counts):
        while counts[axis] > volume.least(int(axis)):
            fewer = counts.copy()
            fewer[axis] = volume.fewer(int(axis), int(counts[axis]))
            found = _at(volume, fewer, target)
            if not found.reached:
                break
            counts, mesh = fewer, found
    return mesh
