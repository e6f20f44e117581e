"""Where the vectors A3 B3 C3 of the blocks to come point the tool: the ways of the rotary axes, found for many at once.

Neither where the axes stand nor which way they take matters here: what has been found stays true whatever happens
meanwhile. Coordinates that are turned do not come here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ncfix.control.pointing import FloatArray, Pointing, Ways, to_each
from ncfix.text.tree import Program

NO_LENGTH = 1e-9
"""A shorter vector says nothing."""


class VectorText(Protocol):
    """A program text whose blocks give vectors."""

    @property
    def program(self) -> Program:
        """The program."""

    @property
    def vectors(self) -> NDArray[np.int64]:
        """(s, 3) the slots of A3 B3 C3 in the blocks of each shape, -1 for none."""


@dataclass(slots=True)
class Directions:
    """The ways to point the tool in blocks from `begin` on."""

    begin: int = 0
    ways: list[Ways] = field(default_factory=list)

    def known(self, pointing: Pointing, text: VectorText, block: int, stop: int, least: int) -> list[Ways]:
        """The ways from a block on: of so many blocks at least, unless one of them gives no direction, up to `stop`."""
        if not self.begin <= block <= self.begin + len(self.ways) - least:
            self.begin, self.ways = block, ways_of(pointing, vectors_of(text, block, stop))
        return self.ways[block - self.begin : stop - self.begin]


def vectors_of(text: VectorText, start: int, stop: int) -> FloatArray:
    """(n, 3) the components of the vectors of blocks; zero where one is not written."""
    program = text.program
    slots = text.vectors[program.template[start:stop]]
    values = program.numbers[program.first_number[start:stop, None] + np.maximum(slots, 0)]
    found: FloatArray = np.where(slots >= 0, values, 0.0)
    return found


def ways_of(pointing: Pointing, vectors: FloatArray) -> list[Ways]:
    """The two ways to each direction of vectors (n, 3), up to the first that has no length or is not reached."""
    x, y, z = vectors.T
    length = to_each(math.hypot, x, y, z)
    size = np.maximum(length, NO_LENGTH)
    reached, ways = pointing.ways_of_many((x / size, y / size, z / size))
    wrong = np.flatnonzero(~reached | (length < NO_LENGTH))
    return ways[: wrong[0]] if wrong.size else ways
