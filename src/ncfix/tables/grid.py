"""A table over one or more axes: values at the nodes of a grid, linear between them, constant beyond the ends.

One input is an ordinary compensation table, three inputs the three-dimensional grid of a control. Values between nodes
are multilinear: Fanuc's formula for eight vertices (Series 30i three-dimensional error compensation, A-79351E) in any
number of dimensions.

Values: exact values at the nodes leave an error of one sign in both adjacent cells; values fitted to the surroundings
(least squares) share that error out, and leave about half of the maximum.

Nodes: `Bending` evaluates the correction on random lines along an axis in fine steps. From these follows the error of
any number of evenly spaced nodes. If a format allows uneven nodes, they are placed as far apart as the bending allows:
on the kinks of a table, and close together within the period of a screw.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from itertools import product

import numpy as np

from ncfix.arrays import Array, Index
from ncfix.values import frozen, mutable

WITHIN = 4
"""Number of positions in each cell along each axis for the least-squares fit."""
STEPS = (128, 256, 512, 1024)
"""Numbers of fine steps that are tried until they suffice."""
TRIED = 40
"""Number of positions between them at which that is checked."""
RIGHT = 2e-5
"""Largest error of interpolation between fine steps, mm."""
SAME = 1e-7
"""Positions closer than this share of the range are one."""
BETWEEN = 4
"""Number of positions between two nodes at which the error of a line is evaluated."""
GOLDEN = 0.6180339887498949
"""Shift of these positions from cell to cell, as a share of a cell, so that no screw pitch is missed."""
FINER = 0.8
"""Ratio of the tolerances of consecutive choices of uneven nodes."""
LEAST = 2e-5
"""Smallest tolerance of uneven nodes, mm."""
MANY = 200
"""Largest number of uneven nodes."""


@frozen
class Grid:
    """Values of some axes over the positions of some axes.

    inputs   the axes whose positions are looked up
    nodes    the positions of the nodes along each input, strictly ascending, mm or rad
    outputs  the axes that the values belong to
    values   (*counts, n_outputs), mm or rad
    modulo   for each input, whether it repeats after its last node instead of staying constant
    """

    inputs: tuple[str, ...]
    nodes: tuple[Array, ...]
    outputs: tuple[str, ...]
    values: Array
    modulo: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        shape = (*(len(line) for line in self.nodes), len(self.outputs))
        if len(self.inputs) != len(self.nodes) or self.values.shape != shape:
            raise ValueError(f"a grid of shape {self.values.shape} over {self.inputs} should have {shape}")
        if any(len(line) > 1 and not (np.diff(line) > 0).all() for line in self.nodes):
            raise ValueError("the nodes of a grid must ascend")

    @property
    def counts(self) -> tuple[int, ...]:
        """Number of nodes along each input."""
        return tuple(len(line) for line in self.nodes)

    @property
    def points(self) -> int:
        """Number of nodes."""
        return int(np.prod(self.counts))

    def at(self, positions: Array) -> Array:
        """The values at positions (n, n_inputs) [mm or rad], shape (n, n_outputs)."""
        if positions.shape[-1:] != (len(self.inputs),):
            raise ValueError(f"positions {positions.shape} of a grid with {len(self.inputs)} inputs")
        places = [self._place(index, column) for index, column in enumerate(positions.T)]
        total = np.zeros((len(positions), len(self.outputs)))
        for corner in product((0, 1), repeat=len(places)):
            weight = np.ones(len(positions))
            for side, (_, part) in zip(corner, places, strict=True):
                weight = weight * (part if side else 1 - part)
            cells = tuple(
                np.minimum(cell + side, count - 1)
                for side, (cell, _), count in zip(corner, places, self.counts, strict=True)
            )
            total += weight[:, None] * self.values[cells]
        return total

    def _place(self, index: int, column: Array) -> tuple[Index, Array]:
        """Index of the cell of each position along one input, and the share of the cell (0 ... 1)."""
        line = self.nodes[index]
        if len(line) == 1:
            return np.zeros(len(column), dtype=np.intp), np.zeros(len(column))
        if index < len(self.modulo) and self.modulo[index]:
            column = line[0] + np.mod(column - line[0], line[-1] - line[0])
        cell = np.clip(np.searchsorted(line, column, side="right") - 1, 0, len(line) - 2)
        part = (column - line[cell]) / (line[cell + 1] - line[cell])
        return cell, np.clip(part, 0.0, 1.0)


def full_grid(lines: Sequence[Array]) -> Array:
    """Every combination of the positions on some lines, the last one fastest, (n, n_lines)."""
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))


def on_full_grid(function: Callable[[Array], Array], lines: Sequence[Array]) -> Array:
    """The values of a function of positions (n, n_lines) on a full grid, (*counts, n_outputs)."""
    return function(full_grid(lines)).reshape(*map(len, lines), -1)


def hats(places: Array, nodes: Array) -> Array:
    """Weights (n, m) of m nodes at n places: linear between nodes, constant beyond the ends."""
    return np.stack([np.interp(places, nodes, row) for row in np.eye(len(nodes))], axis=1)


def spline_weights(nodes: Array, places: Array, turn: float | None = None) -> Array:
    """Weights (n, m) of m >= 2 nodes at n places for a cubic spline through the values at the nodes.

    It is a not-a-knot spline that extrapolates; with `turn` it is periodic. SciPy has the same, but its import is slow.
    """
    count, eye = len(nodes), np.eye(len(nodes))
    line = nodes if turn is None else np.append(nodes, nodes[0] + turn)
    values = eye if turn is None else np.concatenate([eye, eye[:1]])
    steps = np.diff(line)
    rises = np.diff(values, axis=0) / steps[:, None]
    slopes, wanted = np.zeros((count, count)), np.zeros((count, count))
    for k in range(1 if turn is None else 0, count - 1 if turn is None else count):
        before, after = steps[k - 1], steps[k]
        for other, share in ((k - 1, after), (k, 2 * (before + after)), ((k + 1) % count, before)):
            slopes[k, other] += share
        wanted[k] = 3 * (after * rises[k - 1] + before * rises[k])
    if turn is None:
        for end, inner, sense in ((0, 1, 1), (count - 1, count - 2, -1)):
            first, second = (0, min(1, count - 2)) if sense > 0 else (count - 2, max(count - 3, 0))
            if count < 4:  # a straight line, or one parabola
                slopes[end, [end, inner]], wanted[end] = (1.0, 1.0), 2 * rises[first]
                if count == 2:
                    slopes[end, inner], wanted[end] = 0.0, rises[first]
                continue
            near, far = steps[first], steps[second]
            slopes[end, [end, inner]] = far, near + far
            wanted[end] = ((3 * near + 2 * far) * far * rises[first] + near**2 * rises[second]) / (near + far)
    tangents = np.linalg.solve(slopes, wanted)
    if turn is not None:
        tangents, places = np.concatenate([tangents, tangents[:1]]), line[0] + np.mod(places - line[0], turn)
    cell = np.clip(np.searchsorted(line, places, side="right") - 1, 0, len(steps) - 1)
    width = steps[cell][:, None]
    t = (places - line[cell])[:, None] / width
    found: Array = (1 + 2 * t) * (1 - t) ** 2 * values[cell] + t**2 * (3 - 2 * t) * values[cell + 1]
    found += width * (t * (1 - t) ** 2 * tangents[cell] + t**2 * (t - 1) * tangents[cell + 1])
    return found


def projector(places: Array, nodes: Array) -> Array:
    """The least-squares operator (m, n) from values at n places to values at m nodes."""
    return np.asarray(np.linalg.pinv(hats(places, nodes)), dtype=np.float64)


def between(nodes: Array, within: int = WITHIN) -> Array:
    """The n nodes and `within - 1` even places in each cell between them, ascending: (within (n - 1) + 1,)."""
    share = np.arange(within) / within
    inner = nodes[:-1, None] + share * np.diff(nodes)[:, None]
    return np.append(inner.reshape(-1), nodes[-1])


def fitted(values: Array, places: Sequence[Array], nodes: Sequence[Array]) -> Array:
    """Least-squares fit of a table: values (*places, k) on a grid of places -> values (*nodes, k).

    The weights of a multilinear table are products over its axes, so the axes are fitted one after another.
    """
    for axis, (line, knots) in enumerate(zip(places, nodes, strict=True)):
        summed = np.tensordot(projector(line, knots), values, axes=(1, axis))
        values = np.moveaxis(summed, 0, axis)
    return values


@mutable
class Bending:
    """Corrections on random lines along one axis, and the errors of tables over it.

    places  (n_places,) positions of the axis, ascending
    values  (n_lines, n_places, n_outputs) corrections, mm
    """

    places: Array
    values: Array
    _uneven: dict[int, tuple[Array, float]] = field(default_factory=dict)

    @classmethod
    def over(cls, low: float, high: float, kinks: Array, along: Callable[[Array], Array]) -> Bending:
        """Evaluate `along`, positions (n,) -> corrections (n_lines, n, n_outputs), in sufficiently fine steps.

        kinks  positions at which the corrections may have a corner
        """
        tried = low + (high - low) * np.mod(GOLDEN * np.arange(1, TRIED + 1), 1.0)
        meant = along(tried)
        gap = SAME * (high - low)
        inner = kinks[(kinks > low + gap) & (kinks < high - gap)]
        for steps in STEPS:
            places = np.union1d(np.linspace(low, high, steps + 1), inner)
            places = places[np.append(np.diff(places) > gap, True)]
            found = cls(places, along(places))
            if np.abs(found.at(tried) - meant).max() < RIGHT:
                break
        return found

    def at(self, positions: Array) -> Array:
        """The corrections at positions (n,), (n_lines, n, n_outputs)."""
        cell = np.clip(np.searchsorted(self.places, positions, side="right") - 1, 0, len(self.places) - 2)
        part = ((positions - self.places[cell]) / np.diff(self.places)[cell])[:, None]
        return self.values[:, cell] * (1 - part) + self.values[:, cell + 1] * part

    def missed(self, nodes: Array) -> float:
        """The largest correction that evenly spaced nodes (n,) miss, mm; the outermost may lie beyond the ends."""
        count = len(nodes)
        part = np.mod(np.arange(BETWEEN) / BETWEEN + GOLDEN * np.arange(count - 1)[:, None], 1.0)
        inside = (nodes[:-1, None] + part * (nodes[1] - nodes[0])).reshape(-1)
        ends, values = self.at(nodes), self.at(inside)
        share = part.reshape(-1)[:, None]
        chord = np.repeat(ends[:, :-1], BETWEEN, axis=1) * (1 - share) + np.repeat(ends[:, 1:], BETWEEN, axis=1) * share
        seen = (inside >= self.places[0]) & (inside <= self.places[-1])
        return float(np.linalg.norm(values - chord, axis=2)[:, seen].max(initial=0.0))

    def ends(self, allowed: float) -> tuple[float, float]:
        """The positions between which corrections change; outside they vary by at most `allowed`, mm."""
        low, high = (self._level(values, allowed) for values in (self.values, self.values[:, ::-1]))
        if low + high >= len(self.places) - 1:
            return float(self.places[0]), float(self.places[-1])
        return float(self.places[low]), float(self.places[len(self.places) - 1 - high])

    @staticmethod
    def _level(values: Array, allowed: float) -> int:
        """Index of the last place up to which all corrections are within `allowed` of each other, mm."""
        last = 0
        for place in range(1, values.shape[1]):
            change = np.linalg.norm(values[:, :place] - values[:, place : place + 1], axis=2)
            if change.max() > allowed:
                break
            last = place
        return last

    def uneven(self) -> dict[int, tuple[Array, float]]:
        """Number n of nodes -> their best positions (n,), and the largest correction that they miss, mm."""
        if not self._uneven:
            ends = np.array([0, len(self.places) - 1])
            allowed = self._chord(0, len(self.places) - 1)
            self._uneven[2] = self.places[ends], allowed
            while allowed > LEAST and len(ends) < MANY:
                allowed *= FINER
                ends = self._as_far_as(allowed)
                self._uneven[len(ends)] = self.places[ends], allowed
        return self._uneven

    def _as_far_as(self, allowed: float) -> Array:
        """Indices of places as far apart as possible with straight lines between them within `allowed`, mm."""
        last = len(self.places) - 1
        chosen = [0]
        while chosen[-1] < last:
            start, step = chosen[-1], 1
            while start + 2 * step <= last and self._chord(start, start + 2 * step) <= allowed:
                step *= 2
            low, high = start + step, min(start + 2 * step, last)
            while low < high:
                middle = (low + high + 1) // 2
                if self._chord(start, middle) <= allowed:
                    low = middle
                else:
                    high = middle - 1
            chosen.append(low)
        return np.array(chosen)

    def _chord(self, start: int, stop: int) -> float:
        if stop - start < 2:
            return 0.0
        inner = slice(start + 1, stop)
        part = ((self.places[inner] - self.places[start]) / (self.places[stop] - self.places[start]))[:, None]
        chord = self.values[:, start, None] * (1 - part) + self.values[:, stop, None] * part
        return float(np.sqrt(((self.values[:, inner] - chord) ** 2).sum(axis=2).max()))
