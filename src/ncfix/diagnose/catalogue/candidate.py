"""A candidate: a named physical effect as a group of functions with a prior on their coefficients.

A group is never cut into columns: a curve, a set of harmonics, a sag with its slope is one candidate. Its coefficients
are `loading @ z`, z independent with variance one, so a loading carries what the physics says about them: how smooth a
curve is, how harmonics decay, which rotation comes with a deflection. Several loadings are several forms of one name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ncfix.machine import Effect, Machine
from ncfix.machine.axes import Axis
from ncfix.measure.measurement import Array

LETTERS = "XYZ"
TURNS = "ABC"
UNTOUCHED_MM, UNTOUCHED_DEG = 1.0, 5.0
"""An axis that moves less than this was not measured."""


@dataclass(frozen=True, repr=False)
class Candidate:
    """A physical effect that may be missing.

    name      as it is reported; `kind` is its first words, `axis` the letter of the axis it belongs to, or ""
    title     in words
    family    effects of one family are next of kin: one may stand for another
    effects   what it adds to a machine file, zero until estimated
    loadings  each (k, p) for the k coefficients of all effects: forms of the effect
    needs     state columns without which it cannot be seen
    remedy    what can be done about it besides compensation, in words
    grows     it belongs to the measurement: what stands on the table expands; `effects` then only say what drives it
    lead      how many of the effects are the effect itself, the rest only comes with it; 0: all
    constant  a constant of the machine that its file does not have: it goes before all that is not one
    """

    name: str
    title: str
    axis: str
    family: str
    effects: tuple[Effect, ...]
    loadings: tuple[Array, ...]
    needs: tuple[str, ...] = ()
    remedy: str = ""
    grows: bool = False
    lead: int = 0
    constant: bool = False

    @property
    def slow(self) -> bool:
        """Whether it is nothing but a course of time, wherever it acts."""
        signals = [effect.input or "" for effect in self.effects]
        return bool(signals) and all(signal == "time_s" or signal.startswith("temp_") for signal in signals)


@dataclass(frozen=True)
class Reach:
    """What was measured: where the axes were, and which state columns there are.

    spans    axis -> (low, high), mm or degree, of what was measured
    columns  state columns that every file has and that vary
    clock    (first, last) time, s
    warmth   temperature column -> (mean, standard deviation), K; what a thermal effect is at the mean is a constant
    """

    machine: Machine
    spans: Mapping[str, tuple[float, float]]
    columns: frozenset[str]
    clock: tuple[float, float] = (0.0, 0.0)
    warmth: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def moved(self, axis: Axis) -> bool:
        """Whether an axis was moved enough to say anything of it."""
        low, high = self.spans[axis.name]
        return high - low > (UNTOUCHED_DEG if axis.rotary else UNTOUCHED_MM)

    def scaled(self, axis: Axis) -> dict[str, Any]:
        """`center` and `scale` of an effect, so that u is -1 ... 1 over what was measured."""
        low, high = self.spans[axis.name]
        return {"center": (low + high) / 2, "scale": max((high - low) / 2, 1e-6)}

    def factor(self, axis: Axis) -> dict[str, Any]:
        """The same for an axis that multiplies."""
        found = self.scaled(axis)
        return {"times": axis.name, "times_center": found["center"], "times_scale": found["scale"]}

    @property
    def linear(self) -> tuple[Axis, ...]:
        """The linear axes that were moved."""
        return tuple(axis for axis in self.machine.axes if not axis.rotary and self.moved(axis))

    @property
    def rotary(self) -> tuple[Axis, ...]:
        """The rotary axes that were moved."""
        return tuple(axis for axis in self.machine.axes if axis.rotary and self.moved(axis))

    @property
    def sensors(self) -> tuple[str, ...]:
        """The temperatures that were logged."""
        return tuple(sorted(name for name in self.columns if name.startswith("temp_")))


def along(axis: Axis) -> int | None:
    """Which of its error axes lies along the axis itself (0, 1, 2); None if none does."""
    shares = np.abs(np.asarray(axis.error_axes) @ np.asarray(axis.direction))
    index = int(shares.argmax())
    return index if shares[index] > 1 - 1e-9 else None


def across(axis: Axis) -> tuple[int, ...]:
    """The other two; all three where none lies along."""
    own = along(axis)
    return tuple(k for k in range(3) if k != own)


def zero(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """The effects with as many zeros as their bases ask for."""
    from dataclasses import replace

    return tuple(replace(effect, coefficients=(0.0,) * effect.basis.size) for effect in effects)


def weighed(variances: Sequence[float] | Array) -> Array:
    """A loading of independent coefficients with these variances."""
    return np.diag(np.sqrt(np.asarray(variances, dtype=np.float64)))


def stacked(*parts: Array) -> Array:
    """Loadings of several effects that are independent of one another, one below the other."""
    from scipy.linalg import block_diag

    whole: Array = block_diag(*parts)
    return whole
