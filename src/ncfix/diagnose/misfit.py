"""How well a machine file as it stands agrees with data: its constants nearly fixed, only the set-up free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ncfix.diagnose.view import UM, is_free, relative_noise
from ncfix.machine import Effect, Machine
from ncfix.measure.calibrate import Problem
from ncfix.measure.measurement import Array, Measurement
from ncfix.measure.selection import Selection

TIGHT_UM = 4.0
"""How far each constant of a machine file may have moved since, at the tool tip."""
FREE_UM = 500.0
"""The same where they are free: no more, or what cannot be told runs away."""
WIDE_UM = 1e5
TRIM = 0.97
"""Share of the values that count: the rest may be outliers."""
STEPS = 4
"""Most steps of least squares on the exact model."""
SETTLED_UM = 0.05
"""A step that changes no prediction by so much is the last one."""


@dataclass(frozen=True)
class Misfit:
    """A machine file against data.

    problem   what is fitted: the set-up, constants of the file, and effects that are `loose` besides
    relative  (m,) standard deviation of each value against that of a plain one
    noise     of the instrument, um
    loose     how many coefficients are free besides
    """

    problem: Problem
    relative: Array
    noise: float
    loose: int

    def left(self, prior_um: float = TIGHT_UM) -> float:
        """Root mean square of residual values, um, without the largest; what constants moved is counted as misfit."""
        return _fitted(self.problem, self.relative, self.noise, prior_um, self.loose)[0]

    @property
    def count(self) -> int:
        """How many values count."""
        return int(TRIM * len(self.relative))

    @property
    def free(self) -> float:
        """The same with constants free."""
        return self.left(FREE_UM)

    @property
    def coefficients(self) -> Array:
        """Those that are loose."""
        every = _fitted(self.problem, self.relative, self.noise, TIGHT_UM, self.loose)[1]
        return every[len(every) - self.loose :]


def misfit(measurements: Sequence[Measurement], machine: Machine, loose: Sequence[Effect] = ()) -> Misfit:
    """Ready to be asked."""
    selection = Selection((*machine.effects, *loose), tuple(map(is_free, (*machine.effects, *loose))))
    problem = Problem.of(measurements, machine, selection)
    known = [each.sigma for each in problem.observations if each.noise_known]
    sigma = UM * float(np.median(np.concatenate(known) if known else problem.sigma))
    return Misfit(problem, relative_noise(problem), sigma, sum(effect.basis.size for effect in loose))


def _fitted(problem: Problem, relative: Array, sigma: float, prior_um: float, free: int) -> tuple[float, Array]:
    """Least squares with a prior on the constants, on the exact model."""
    start, unknowns = problem.selection.start, problem.start
    coefficients, k = start.copy(), len(unknowns)
    for _ in range(STEPS):
        columns = UM * np.concatenate([problem.nuisance(unknowns), problem.design], axis=1) / relative[:, None]
        size = np.sqrt((columns**2).mean(axis=0))
        size = np.where(size > 0, size, 1.0)
        allowed = np.full(columns.shape[1], WIDE_UM)
        allowed[k : len(allowed) - free] = prior_um
        pull = sigma / allowed
        y = UM * problem.residual(coefficients, unknowns) / relative
        back = -pull * size * np.concatenate([np.zeros(k), coefficients - start])
        stacked = np.concatenate([columns / size, np.diag(pull)])
        change = np.linalg.lstsq(stacked, np.concatenate([y, back]), rcond=1e-9)[0] / size
        unknowns, coefficients = unknowns + change[:k], coefficients + change[k:]
        if np.abs(columns @ change).max(initial=0.0) < SETTLED_UM:
            break
    y = np.abs(UM * problem.residual(coefficients, unknowns) / relative)
    y = np.sort(np.where(np.isfinite(y), y, 1e12))[: int(TRIM * len(y))]
    moved = (pull * size * np.concatenate([np.zeros(k), coefficients - start]))[k:]
    return float(np.sqrt(((y**2).sum() + (moved**2).sum()) / len(y))), coefficients
