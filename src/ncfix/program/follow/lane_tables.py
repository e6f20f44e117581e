"""The shapes of blocks that the fast lane takes: where their numbers are, one by one and as columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.program.follow.coordinates import N_LETTERS


@dataclass(frozen=True, slots=True)
class Lane:
    """A block that is nothing but a straight motion with plain numbers.

    axes    pairs of letter index and slot
    feed    slot of F, -1 without
    motion  0, 10, or -1 if the code in force stays
    """

    axes: tuple[tuple[int, int], ...]
    feed: int
    motion: int


@dataclass(frozen=True, slots=True)
class LaneTables:
    """The lanes of all shapes as columns; -1 for what a shape lacks, and for all of a shape that has no lane.

    axes    (s, 9) which number of a block is the word of an axis
    feed    (s,) which one is F
    motion  (s,) motion code in tenths
    mask    (s,) axis words, as bits
    """

    axes: NDArray[np.int64]
    feed: NDArray[np.int64]
    motion: NDArray[np.int64]
    mask: NDArray[np.int64]

    @classmethod
    def of(cls, lanes: Sequence[Lane | None]) -> LaneTables:
        """The tables of some lanes."""
        n = len(lanes)
        tables = cls(np.full((n, N_LETTERS), -1), np.full(n, -1), np.full(n, -1), np.zeros(n, dtype=np.int64))
        for shape, lane in enumerate(lanes):
            if lane is not None:
                for letter, slot in lane.axes:
                    tables.axes[shape, letter] = slot
                tables.feed[shape], tables.motion[shape] = lane.feed, lane.motion
                tables.mask[shape] = sum(1 << letter for letter, _ in lane.axes)
        return tables
