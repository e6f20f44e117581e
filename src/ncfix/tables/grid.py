"""A table over one or more axes: values at the nodes of a grid, linear between them, held beyond the ends.

One input makes an ordinary compensation table, three make the three-dimensional grid of a control; between the nodes
the values are multilinear. That is Fanuc's formula for eight vertices (Series 30i three-dimensional error compensation,
A-79351E) in any number of dimensions.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Grid:
    """Values of some axes over the positions of some axes.

    inputs   the axes whose positions are looked up
    nodes    the positions of the nodes along each input, strictly ascending, mm or rad
    outputs  the axes that the values belong to
    values   (*counts, n_outputs), mm or rad
    modulo   which inputs repeat after their last node, instead of holding its value
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
        """How many nodes there are along each input."""
        return tuple(len(line) for line in self.nodes)

    @property
    def points(self) -> int:
        """How many nodes there are."""
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

    def _place(self, index: int, column: Array) -> tuple[NDArray[np.intp], Array]:
        """In which cell along one input, and how far through it (0 ... 1)."""
        line = self.nodes[index]
        if len(line) == 1:
            return np.zeros(len(column), dtype=np.intp), np.zeros(len(column))
        if index < len(self.modulo) and self.modulo[index]:
            column = line[0] + np.mod(column - line[0], line[-1] - line[0])
        cell = np.clip(np.searchsorted(line, column, side="right") - 1, 0, len(line) - 2)
        part = (column - line[cell]) / (line[cell + 1] - line[cell])
        return cell, np.clip(part, 0.0, 1.0)
