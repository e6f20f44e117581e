"""What the residuals of a calibration say: their size per set, their order, and which values carry the result."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ncfix.diagnostics import Place
from ncfix.measure.measurement import Array, Index
from ncfix.measure.observation import Mask

if TYPE_CHECKING:
    from ncfix.measure.calibrate import Estimate, Problem


@dataclass(frozen=True)
class Residuals:
    """One entry per value, (m,).

    observation   which of the measurements, row of it (-1: a calibrated distance), and component
    turns         whether it is an angle
    value         mm or rad, actual minus predicted
    studentised   divided by its own standard deviation
    cook          Cook's distance: how far all estimates move if this value is left out
    """

    observation: Index
    row: Index
    component: tuple[str, ...]
    turns: Mask
    value: Array
    studentised: Array
    cook: Array


def residuals(problem: Problem, estimate: Estimate) -> Residuals:
    """The residuals with their diagnostics; those without weight are studentised as new values would be."""
    solution, weight = estimate.solution, estimate.weight
    freedom = max(int((weight > 0).sum()) - solution.rank, 1)
    size = estimate.residual / problem.sigma
    scale = np.sqrt(estimate.reduced(problem.sigma, freedom)) or 1.0
    leverage = np.where(weight > 0, solution.leverage, 0.0).clip(0.0, 1 - 1e-9)
    studentised = size / (scale * np.sqrt(1 - leverage))
    cook = studentised**2 * leverage / ((1 - leverage) * max(solution.rank, 1))
    which = np.repeat(np.arange(len(problem.observations)), [len(each.values) for each in problem.observations])
    rows = np.concatenate([each.rows for each in problem.observations])
    names: list[str] = []
    turns: list[bool] = []
    for each in problem.observations:
        names += [*each.value_names, *["distance"] * len(each.extra_values)]
        turns += [*each.turns.tolist(), *[False] * len(each.extra_values)]
    return Residuals(which, rows, tuple(names), np.array(turns, dtype=np.bool_), estimate.residual, studentised, cook)


def place(problem: Problem, residual: Residuals, index: int) -> Place:
    """Where a value stands in its file."""
    measurement = problem.observations[int(residual.observation[index])].measurement
    row = int(residual.row[index])
    return Place(measurement.path) if row < 0 else measurement.place(row)


def rms_by_set(problem: Problem, residual: Residuals) -> dict[str, float]:
    """The rms of lengths in um, per file and set."""
    sizes: dict[str, float] = {}
    for index, each in enumerate(problem.observations):
        mine = np.flatnonzero((residual.observation == index) & (residual.row >= 0) & ~residual.turns)
        for name in dict.fromkeys(each.measurement.sets):
            rows = np.flatnonzero(np.array(each.measurement.sets) == name)
            chosen = residual.value[mine[np.isin(residual.row[mine], rows)]]
            if chosen.size:
                sizes[f"{each.measurement.path} set {name}"] = float(1e3 * np.sqrt((chosen**2).mean()))
    return sizes
