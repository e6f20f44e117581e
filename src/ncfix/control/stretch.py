"""Motions as they are gathered: many that came together as columns, single ones in lists that become columns later."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ncfix.control.coordinates import N_LETTERS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(slots=True)
class Stretch:
    """Consecutive motions as columns; `programmed` and `adrift` are bit masks by letter, `start` and `end` (n, 9).

    path  (n + 1, 9) what both are views of, where each motion begins where the one before it ends
    """

    block: IntArray
    programmed: IntArray
    style: IntArray
    feed: FloatArray
    start: FloatArray
    end: FloatArray
    adrift: IntArray
    path: FloatArray | None = None

    def ends(self, columns: list[int]) -> tuple[FloatArray, FloatArray]:
        """Where the motions start and end, by some of the letters; views of one path where they go on."""
        if self.path is None:
            start, end = (each.take(columns, axis=1, mode="clip") for each in (self.start, self.end))
            return start, end
        path = self.path.take(columns, axis=1, mode="clip")
        return path[:-1], path[1:]


@dataclass(slots=True)
class Buffer:
    """Motions that came one by one."""

    block: list[int] = field(default_factory=list)
    programmed: list[int] = field(default_factory=list)
    style: list[int] = field(default_factory=list)
    feed: list[float] = field(default_factory=list)
    start: list[float] = field(default_factory=list)
    end: list[float] = field(default_factory=list)
    adrift: list[int] = field(default_factory=list)

    def stretch(self) -> Stretch:
        """The motions as columns."""
        return Stretch(
            np.array(self.block, dtype=np.int64),
            np.array(self.programmed, dtype=np.int64),
            np.array(self.style, dtype=np.int64),
            np.array(self.feed, dtype=np.float64),
            np.array(self.start, dtype=np.float64).reshape(-1, N_LETTERS),
            np.array(self.end, dtype=np.float64).reshape(-1, N_LETTERS),
            np.array(self.adrift, dtype=np.int64),
        )
