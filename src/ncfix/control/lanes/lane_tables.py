"""The shapes of blocks that the fast lane takes: where their numbers are, one by one and as columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.control.coordinates import N_LETTERS


@dataclass(frozen=True, slots=True)
class Lane:
    """A block that is nothing but a straight motion, or an arc, with plain numbers.

    axes    pairs of letter index and slot
    feed    slot of F, -1 without
    motion  0, 10, 20, 30, or -1 if the code in force stays
    centre  slots of I, J and K, -1 without
    radius  slot of R, -1 without
    fixed   which of I, J and K count from the origin, whatever else is in force
    """

    axes: tuple[tuple[int, int], ...]
    feed: int
    motion: int
    centre: tuple[int, int, int] = (-1, -1, -1)
    radius: int = -1
    fixed: tuple[bool, bool, bool] = (False, False, False)

    @property
    def turns(self) -> bool:
        """Whether it is an arc."""
        return self.radius >= 0 or max(self.centre) >= 0


@dataclass(frozen=True, slots=True)
class LaneTables:
    """The lanes of all shapes as columns; -1 for what a shape lacks, and for all of a shape that has no lane.

    axes    (s, 9) which number of a block is the word of an axis
    feed    (s,) which one is F
    motion  (s,) motion code in tenths
    mask    (s,) axis words, as bits
    centre  (s, 3) which ones are I, J and K
    radius  (s,) which one is R
    fixed   (s, 3) which of I, J and K count from the origin
    turns   (s,) arcs
    """

    axes: NDArray[np.int64]
    feed: NDArray[np.int64]
    motion: NDArray[np.int64]
    mask: NDArray[np.int64]
    centre: NDArray[np.int64]
    radius: NDArray[np.int64]
    fixed: NDArray[np.bool_]
    turns: NDArray[np.bool_]

    @classmethod
    def of(cls, lanes: Sequence[Lane | None]) -> LaneTables:
        """The tables of some lanes."""
        n = len(lanes)
        nowhere, none = np.full((n, N_LETTERS), -1, dtype=np.int64), np.full(n, -1, dtype=np.int64)
        turns = np.array([lane is not None and lane.turns for lane in lanes], dtype=np.bool_)
        fixed = np.array([(False,) * 3 if lane is None else lane.fixed for lane in lanes], dtype=np.bool_).reshape(n, 3)
        mask, centre = np.zeros(n, dtype=np.int64), np.full((n, 3), -1, dtype=np.int64)
        tables = cls(nowhere, none, none.copy(), mask, centre, none.copy(), fixed, turns)
        for shape, lane in enumerate(lanes):
            if lane is not None:
                for letter, slot in lane.axes:
                    tables.axes[shape, letter] = slot
                tables.feed[shape], tables.motion[shape] = lane.feed, lane.motion
                tables.mask[shape] = sum(1 << letter for letter, _ in lane.axes)
                tables.centre[shape], tables.radius[shape] = lane.centre, lane.radius
        return tables
