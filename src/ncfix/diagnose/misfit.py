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


@dataclass(frozen=True)
class Misfit:
    """Root mean squares of residual values, um, without the largest.

    tight   constants nearly fixed, what they moved counted as misfit; free: constants free; noise: of the instrument
    loose   coefficients of the effects that were free besides
    """

    tight: float
    free: float
    noise: float
    loose: Array


def misfit(
    measurements: Sequence[Measurement], machine: Machine, loose: Sequence[Effect] = (), tight_um: float = TIGHT_UM
) -> Misfit:
    """Fit and look."""
    selection = Selection((*machine.effects, *loose), tuple(map(is_free, (*machine.effects, *loose))))
    problem = Problem.of(measurements, machine, selection)
    free = sum(effect.basis.size for effect in loose)
    known = [each.sigma for each in problem.observations if each.noise_known]
    sigma = UM * float(np.median(np.concatenate(known) if known else problem.sigma))
    relative = relative_noise(problem)
    tight, coefficients = _fitted(problem, relative, sigma, tight_um, free)
    wide, _ = _fitted(problem, relative, sigma, FREE_UM, free)
    return Misfit(tight, wide, sigma, coefficients[len(coefficients) - free :] if free else np.zeros(0))


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
    y = np.abs(UM * problem.residual(coefficients, unknowns) / relative)
    y = np.sort(np.where(np.isfinite(y), y, 1e12))[: int(TRIM * len(y))]
    moved = (pull * size * np.concatenate([np.zeros(k), coefficients - start]))[k:]
    return float(np.sqrt(((y**2).sum() + (moved**2).sum()) / len(y))), coefficients
