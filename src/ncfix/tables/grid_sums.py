"""A correction over many axes as a sum of grids over a few axes each.

A grid over five axes has the product of five numbers of nodes. But no error needs all five at once: angular errors of
the table move the tip by an angle times a distance, so each linear axis needs functions of two rotary axes and one
linear axis, and functions of the linear axes. Which sets of axes interact need not be known: the correction is
decomposed into interactions of sets of axes (`interactions`), and the sets that matter are assigned to a few grids
(`faces`). The first grid holds the correction with the other axes in the middle of their ranges, the second what the
first lacks there, and so on. The sum is exact if the correction is such a sum.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from ncfix.arrays import Array, Index
from ncfix.tables.correction import random_poses
from ncfix.tables.grid import Grid, on_full_grid
from ncfix.tables.volume import CHECKS, Volume, search
from ncfix.values import frozen

COARSE = 6
"""Number of positions of each axis at which the correction is decomposed."""
SHARE = 0.05
"""Largest share of the target, rms, of interactions that no face holds."""
LIKELY = 10
"""Assumed number of nodes along an axis, to compare faces before the search."""
ROUNDS = 5
"""Largest number of rounds of the search."""
TIGHTER = 0.95
"""Factor on the tolerance that the last round suggests."""
LOOSER = 1.1
"""Factor on the increase of the tolerance that an excess of nodes suggests."""
EVEN = 0.3
"""Power of the number of nodes of a face in its share of the tolerance: larger faces get more, which saves nodes."""
SAME = 1 << 20
"""Largest number of distinct combinations of positions for which duplicates are sought."""
MANY = 8
"""Largest number of interacting sets that are assigned to faces."""
Set = frozenset[int]
"""A set of axes, by their indices among the inputs."""


@frozen
class Face:
    """A set of inputs, and the outputs that have a grid over it; both by index.

    owner  the input that owns the face: an output has at most one face of each owner
    """

    owner: int
    inputs: tuple[int, ...]
    outputs: tuple[int, ...]


@frozen
class Sum:
    """Grids whose sum is the correction.

    left     largest correction that they miss at random poses, mm; reached: whether that is within the target
    """

    faces: tuple[Face, ...]
    grids: tuple[Grid, ...]
    left: float
    reached: bool

    @property
    def points(self) -> int:
        """Number of nodes of all grids."""
        return sum(grid.points for grid in self.grids)


def interactions(values: Array, n_inputs: int) -> dict[Set, Array]:
    """The rms of each interaction of a set of axes, (n_outputs,), of values (*counts, n_outputs) on a full grid.

    The interactions are orthogonal: their squares add up to the mean square of the values.
    """
    parts: dict[Set, Array] = {}
    for size in range(n_inputs + 1):
        for chosen in combinations(range(n_inputs), size):
            key = frozenset(chosen)
            others = tuple(axis for axis in range(n_inputs) if axis not in key)
            mean = values.mean(axis=others, keepdims=True)
            parts[key] = mean - sum((parts[less] for less in parts if less < key), np.zeros(1))
    return {key: np.sqrt(np.mean(part**2, axis=tuple(range(n_inputs)))) for key, part in parts.items()}


def faces(volume: Volume, owners: Sequence[int], target: float) -> tuple[Face, ...] | None:
    """The faces that hold the correction to within `SHARE` of the target (mm rms), or None if there are too many sets.

    owners  the inputs (by index) that may own a face; the owner is one of the face's inputs
    """
    lines = [_coarse(low, high, number) for number, (low, high) in enumerate(volume.ranges.tolist())]
    values = on_full_grid(volume.exact, lines)
    sizes = interactions(values, len(lines))
    found: dict[tuple[int, Set], list[int]] = {}
    for output in range(values.shape[-1]):
        chosen = _shared_out(_largest_sets({key: float(size[output]) for key, size in sizes.items()}, target), owners)
        if chosen is None:
            return None
        for owner, axes in chosen.items():
            found.setdefault((owner, axes), []).append(output)
    ordered = sorted(found, key=lambda key: (len(key[1]), sorted(key[1]), key[0]))
    return tuple(Face(owner, tuple(sorted(axes)), tuple(found[owner, axes])) for owner, axes in ordered)


def _coarse(low: float, high: float, number: int) -> Array:
    """Positions over a range, slightly uneven so that the period of a screw cannot be missed."""
    shift = 0.3 * (np.mod((np.arange(COARSE) + number) * 0.618034, 1.0) - 0.5)
    return low + (high - low) * (np.arange(COARSE) + 0.5 + shift) / COARSE


def _largest_sets(sizes: Mapping[Set, float], target: float) -> list[Set]:
    """The maximal sets that matter; the smallest ones, together below `SHARE` of the target, are left out."""
    remaining = dict(sizes)
    total = 0.0
    for key in sorted(sizes, key=lambda key: sizes[key]):
        total += sizes[key] ** 2
        if total > (SHARE * target) ** 2:
            break
        del remaining[key]
    return [key for key in sorted(remaining, key=sorted) if not any(key < other for other in remaining)]


def _shared_out(sets: Sequence[Set], owners: Sequence[int]) -> dict[int, Set] | None:
    """The cheapest assignment of the sets to owners: owner -> its face, the union of its sets; None if too many."""
    if len(sets) > MANY:
        return None
    choices = []
    for given in product(owners, repeat=len(sets)):
        share: dict[int, Set] = {}
        for owner, one in zip(given, sets, strict=True):
            share[owner] = share.get(owner, frozenset({owner})) | one
        choices.append((sum(LIKELY ** len(axes) for axes in share.values()), sorted(share), share))
    return min(choices, key=lambda choice: choice[:2])[2]


def searched(volume: Volume, found: Sequence[Face], target: float, points: int) -> Sum:
    """Grids for the faces with few nodes, at most `points` in all, that together miss at most `target`, mm."""
    parts = [_part(volume, face, found[:number]) for number, face in enumerate(found)]
    shares = np.full(len(parts), target / np.sqrt(len(parts)))
    positions = random_poses(volume.ranges, CHECKS, seed=3)
    exact = volume.exact(positions)
    best: Sum | None = None
    for _ in range(ROUNDS):
        pairs = zip(parts, shares.tolist(), strict=True)
        grids = tuple(search(part, share, [points] * len(part.inputs), points).grid for part, share in pairs)
        left = float(np.linalg.norm(exact - _total(volume, grids, positions), axis=1).max())
        made = Sum(tuple(found), grids, left, left <= target)
        if made.points > points:
            shares *= LOOSER * (made.points / points) ** (2 / 3)
        elif best is None or left < best.left:
            best = made
        if best is made and not made.reached:
            shares *= max(TIGHTER * target / left, 1 / 4)
        elif best is not None:
            break
        sizes = np.array([grid.points for grid in grids], dtype=np.float64) ** EVEN
        shares *= sizes / sizes.mean()
    return best or made


def _total(volume: Volume, grids: Sequence[Grid], positions: Array) -> Array:
    total = np.zeros((len(positions), len(volume.outputs)))
    for grid in grids:
        columns = [volume.outputs.index(name) for name in grid.outputs]
        total[:, columns] += grid.at(positions[:, [volume.inputs.index(name) for name in grid.inputs]])
    return total


def _part(volume: Volume, face: Face, before: Sequence[Face]) -> Volume:
    """The volume of one face: the correction with the other axes in the middle, less what earlier faces hold."""
    recipe = _recipe(face, before)
    middle = volume.ranges.mean(axis=1)

    def exact(positions: Array) -> Array:
        total = np.zeros((len(positions), len(face.outputs)))
        for axes, factors in recipe.items():
            columns = [column for column, axis in enumerate(face.inputs) if axis in axes]
            different, places = _different(positions[:, columns])
            q = np.tile(middle, (len(different), 1))
            q[:, [face.inputs[column] for column in columns]] = different
            total += volume.exact(q)[places][:, face.outputs] * factors
        return total

    chosen = list(face.inputs)
    return replace(
        volume,
        inputs=tuple(volume.inputs[axis] for axis in chosen),
        ranges=volume.ranges[chosen],
        covered=volume.covered[chosen],
        units=tuple(volume.units[axis] for axis in chosen),
        outputs=tuple(volume.outputs[number] for number in face.outputs),
        exact=exact,
        kinks=tuple(volume.kinks[axis] for axis in chosen) if volume.kinks else (),
    )


def _different(positions: Array) -> tuple[Array, Index]:
    """The distinct rows (m, k) of positions (n, k), and for each row its index among these, (n,)."""
    codes, count = np.zeros(len(positions), dtype=np.intp), 1
    for column in positions.T:
        values, place = np.unique(column, return_inverse=True)
        if count * len(values) > SAME:
            return positions, np.arange(len(positions))
        codes, count = codes * len(values) + place, count * len(values)
    _, first, places = np.unique(codes, return_index=True, return_inverse=True)
    return positions[first], places


def _recipe(face: Face, before: Sequence[Face]) -> dict[Set, Array]:
    """A face as a sum of corrections that depend on some axes, the others in the middle: axes -> factor per output.

    An earlier face holds the correction with all axes in the middle that it does not have; this is subtracted.
    """
    recipe: dict[Set, Array] = {}
    for number, output in enumerate(face.outputs):
        terms = {frozenset(face.inputs): 1}
        for other in (each for each in before if output in each.outputs):
            taken = [(axes & frozenset(other.inputs), factor) for axes, factor in terms.items()]
            for axes, factor in taken:
                terms[axes] = terms.get(axes, 0) - factor
        for axes, factor in terms.items():
            recipe.setdefault(axes, np.zeros(len(face.outputs)))[number] = factor
    return {axes: factors for axes, factors in recipe.items() if factors.any()}
