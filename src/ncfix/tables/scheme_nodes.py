"""Evenly spaced positions that a file can say exactly: the first one, the step, and a whole number of steps.

Functions are looked at in many fine steps; a table takes a number of steps that divides them, so that its nodes are
among the positions that are known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.tables.grid import Array

SCALE = 10**4
"""Positions and steps have four decimals, mm or degree."""
STEPS = ((120, 160, 200), (240, 320, 400), (720, 800, 640), (1440, 1600, 1280))
"""How many fine steps, from coarse to fine: numbers with many divisors. The first that divides the range is taken."""
PER_FEATURE = 3
"""Steps for each length within which the errors may bend."""


@dataclass(frozen=True, slots=True)
class Line:
    """The positions of an axis that tables cover, in its file unit (mm, degree).

    unit    mm or rad per file unit
    steps   into how many it is divided
    modulo  they repeat
    """

    name: str
    low: float
    high: float
    unit: float
    steps: int
    modulo: bool

    @classmethod
    def over(cls, name: str, low: float, high: float, unit: float, feature: float, modulo: bool) -> Line:
        """With steps small enough for errors that may bend within the length `feature` (file unit)."""
        wanted = PER_FEATURE * (high - low) / feature
        choices = next((some for some in STEPS if some[0] >= wanted), STEPS[-1])
        whole = round((high - low) * SCALE)
        steps = next((some for some in choices if whole % some == 0), choices[0])
        return cls(name, low, high, unit, steps, modulo)

    @property
    def fine(self) -> Array:
        """All positions (steps + 1,), from low to high or less than one part in a thousand beyond it, mm or rad."""
        first = np.floor(self.low * SCALE + 1e-6)
        step = np.ceil((self.high * SCALE - first) / self.steps - 1e-6)
        positions: Array = (first + step * np.arange(self.steps + 1)) / SCALE * self.unit
        return positions

    def stride(self, curve: Array, most: int, limit: float) -> int:
        """The widest step, in fine ones, with which straight lines stay within `limit` of a curve over `fine`.

        No more than `most` nodes. What repeats takes two steps at least.
        """
        strides = [s for s in range(self.steps, 0, -1) if self.steps % s == 0 and self.steps // s < most]
        for stride in strides[1:] if self.modulo else strides:
            if self._missed(curve, stride) <= limit:
                return stride
        return strides[-1]

    @staticmethod
    def _missed(curve: Array, stride: int) -> float:
        place = np.arange(len(curve))
        return float(np.abs(np.interp(place, place[::stride], curve[::stride]) - curve).max())
