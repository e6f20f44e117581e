"""From the end of an iteration to a calibrated machine and what has to be said about it."""

from __future__ import annotations

import datetime
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from ncfix import __version__
from ncfix.diagnostics import Message
from ncfix.machine import Effect, Machine
from ncfix.measure import contradictions, suspects, words
from ncfix.measure.calibrate import UNLIKELY, Calibration, Estimate, Problem, noise_scale
from ncfix.measure.measurement import Array
from ncfix.measure.residuals import Residuals, place, residuals
from ncfix.measure.solve import orthonormal, without

NAMED = 20
"""Outliers that are named one by one."""


def result(problem: Problem, estimate: Estimate, loss: str) -> Calibration:
    """The calibrated machine, with covariances and provenance."""
    freedom = max(int((estimate.weight > 0).sum()) - estimate.solution.rank, 1)
    chi_square = estimate.reduced(problem.sigma, freedom)
    scale = noise_scale(problem, chi_square, freedom)
    found = residuals(problem, estimate)
    remarks = [each for seen in problem.observations for each in seen.measurement.remarks]
    remarks += words.remarks(estimate.solution, problem.selection.labels)
    remarks += _outliers(problem, estimate, found)
    remarks += _noise(problem, chi_square, freedom)
    remarks += contradictions.remarks(problem, estimate)
    remarks += suspects.suspected(problem)
    before, after = _rms_before(problem), _rms(problem, estimate.residual, estimate.weight > 0)
    machine = _machine(problem, estimate, scale, {"rms_before_um": before, "rms_after_um": after, "loss": loss})
    remarks += [message for seen in problem.observations for message in seen.doubts(machine)]
    return Calibration(machine, problem, estimate, scale, tuple(remarks), before, after)


def _machine(problem: Problem, estimate: Estimate, scale: float, figures: dict[str, Any]) -> Machine:
    machine = problem.selection.machine(problem.machine, estimate.coefficients.tolist())
    kept = estimate.solution.kept
    p = len(estimate.coefficients)
    covariance = np.full((p, p), np.nan)
    covariance[np.ix_(kept, kept)] = estimate.solution.covariance * scale**2
    effects, start = [], 0
    for effect, free in zip(machine.effects, problem.selection.free, strict=True):
        stop = start + (effect.basis.size if free else 0)
        effects.append(_known(effect, covariance[start:stop, start:stop]) if free else effect)
        start = stop
    sources = ", ".join(dict.fromkeys(each.measurement.path for each in problem.observations))
    notes = {"date": datetime.date.today(), "source": sources, "calibrated_from": problem.machine.hash}
    notes["calibrated_by"] = f"ncfix {__version__}"
    told = {key: value for key, value in figures.items() if value == value}
    rounded = {key: round(value, 3) if isinstance(value, float) else value for key, value in told.items()}
    return machine.replace(effects=tuple(effects), provenance={**problem.machine.provenance, **notes, **rounded})


def _known(effect: Effect, covariance: Array) -> Effect:
    """The effect with its covariance, if all of its coefficients were estimated."""
    if not np.isfinite(covariance).all():
        return replace(effect, covariance=None)
    even = (covariance + covariance.T) / 2
    return replace(effect, covariance=tuple(tuple(float(value) for value in row) for row in even))


def _outliers(problem: Problem, estimate: Estimate, residual: Residuals) -> Iterator[Message]:
    aside = np.flatnonzero(estimate.weight == 0)
    for index in aside[np.argsort(-np.abs(residual.studentised[aside]))][:NAMED]:
        text = f"{residual.component[index]} is {_size(residual, index)} from the model: an outlier, given no weight"
        yield Message("NCF633", text, place(problem, residual, int(index)), "look at that row; --loss none keeps it")
    if len(aside) > NAMED:
        yield Message("NCF633", f"{len(aside) - NAMED} more outliers")


def _size(residual: Residuals, index: int) -> str:
    angle = residual.turns[index]
    return f"{residual.value[index] * (1e6 if angle else 1e3):+.1f} {'urad' if angle else 'um'}"


def _noise(problem: Problem, chi_square: float, freedom: int) -> Iterator[Message]:
    if problem.noise_known and chdtrc(freedom, chi_square * freedom) < UNLIKELY:
        factor = np.sqrt(chi_square)
        times = f"{factor:.2f}" if factor < 100 else f"{factor:.0f}"
        text = f"the residuals are {times} times the noise: an effect is missing, or the noise is larger"
        yield Message("NCF634", text, hint="`ncfix diagnose` looks for what is missing")


def _rms(problem: Problem, values: Array, keep: NDArray[np.bool_]) -> float:
    """The rms of lengths, um; NaN if there are none."""
    turns = np.concatenate([each.turns for each in problem.observations])
    rows = np.concatenate([each.rows for each in problem.observations]) >= 0
    lengths = np.zeros(len(values), dtype=bool)
    lengths[np.flatnonzero(rows)] = ~turns
    chosen = values[lengths & keep]
    return float(1e3 * np.sqrt((chosen**2).mean())) if chosen.size else np.nan


def _rms_before(problem: Problem) -> float:
    """The same about the machine as it was, with the set-up fitted."""
    residual = problem.residual(problem.selection.start, problem.start) / problem.sigma
    basis = orthonormal(problem.nuisance(problem.start) / problem.sigma[:, None])
    return _rms(problem, without(basis, residual) * problem.sigma, np.ones(len(residual), dtype=bool))
