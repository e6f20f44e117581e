"""Two accounts: what was asked of the path before rounding, and what rounding to the control's digits does on top."""

from __future__ import annotations

from dataclasses import dataclass

SAMPLED = 0.02
"""Share of the tolerance held back for what happens between samples. Samples stand at least `DENSITY` to the shortest
distance over which the model bends, an eighth of a wave: a wave's peak between two of them rises above the higher by
less than 1 - cos(pi / 32) = 0.5 % of its height, and a parabola's over its chord by less than 1 / 64 of the arrow."""
DENSITY = 4
"""Samples per shortest distance over which the error model bends."""


@dataclass(frozen=True, slots=True)
class Closure:
    """What difference between an arc's radii at start and end a control accepts: any below `mm`, any below `relative`
    times the radius."""

    mm: float = 0.0283
    relative: float = 0.001

    def allowance(self, radius: float) -> float:
        """The accepted difference for that radius, mm."""
        return max(self.mm, self.relative * radius)


@dataclass(frozen=True, slots=True)
class Budget:
    """A path tolerance, and what rounding does besides.

    tolerance  what was asked of the path before rounding, mm
    rounding   how far the tip may be off because commands are rounded: the norm of half output steps, mm
    """

    tolerance: float
    rounding: float = 0.0

    @property
    def path(self) -> float:
        """What the path between emitted points may use."""
        return (1 - SAMPLED) * self.tolerance

    @property
    def fine(self) -> bool:
        """Whether the control's digits are fine enough for such a tolerance."""
        return self.rounding <= self.tolerance / 2
