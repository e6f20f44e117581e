"""Time constants: how long after a temperature an effect follows, estimated with the coefficients (Soons 1993, 2.7).

An effect with a lag is linear in its coefficients once its time constant is known. So only the constants are searched
for, on a coarse scale of times first and then by descent, with all else solved for at each try (variable projection).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from ncfix.diagnostics import Message, UsageError
from ncfix.machine import Effect, Machine
from ncfix.measure import calibrate
from ncfix.measure.measurement import Array, Measurement
from ncfix.measure.selection import Selection
from ncfix.measure.solve import orthonormal, without

SCALE = 24
"""Time constants tried first, from the shortest step of time to three times the whole."""
STEP = 1e-3
"""Relative change of a time constant that is none."""


@dataclass(frozen=True)
class Lags:
    """The effects with the time constants found.

    selection   as before, with these constants
    remarks     the constants with their standard deviations, in words
    """

    selection: Selection
    remarks: tuple[Message, ...]


def found(measurements: Sequence[Measurement], machine: Machine, selection: Selection) -> Lags:
    """Estimate the time constants of the effects that are estimated and have one; effects that share one keep to it.

    Raises `UsageError` NCF639 if no effect lags, or nothing tells the time.
    """
    constants = sorted({effect.time_constant_s for effect in selection.estimated if effect.time_constant_s})
    if not constants:
        text = "no effect that is estimated has a time constant"
        raise UsageError.of("NCF639", text, hint="for example spindle-growth-late; `time_constant_s` in a machine file")
    low, high = _times(measurements)

    def left(logs: Array) -> float:
        return _left(measurements, machine, _with(selection, constants, np.exp(logs)))

    start = np.log(np.clip(constants, low, high))
    tried = np.linspace(np.log(low), np.log(high), SCALE)
    for k in range(len(start)):
        options = [np.concatenate([start[:k], [value], start[k + 1 :]]) for value in tried]
        start = min(options, key=left)
    bounds = [(np.log(low), np.log(high))] * len(start)
    best = minimize(left, start, method="Nelder-Mead", bounds=bounds, options={"xatol": STEP, "fatol": 1e-3})
    chosen = _with(selection, constants, np.exp(best.x))
    sigmas = [_sigma(left, best.x, k, float(best.fun)) for k in range(len(constants))]
    words = [_words(chosen, float(np.exp(x)), sigma, (low, high)) for x, sigma in zip(best.x, sigmas, strict=True)]
    return Lags(chosen, tuple(words))


def _times(measurements: Sequence[Measurement]) -> tuple[float, float]:
    """The shortest and longest time constants that measured times can tell."""
    times = [np.unique(each.columns["time_s"]) for each in measurements if "time_s" in each.columns]
    spans = [float(np.ptp(each)) for each in times if len(each) > 1]
    if not spans:
        raise UsageError.of("NCF639", "no column says the time", hint="a lag needs a column time_s")
    steps = [float(np.median(np.diff(each))) for each in times if len(each) > 1]
    return max(min(steps) / 3, 1e-3), 3 * max(spans)


def _with(selection: Selection, constants: Sequence[float], values: Array) -> Selection:
    """The selection with other time constants."""
    new = dict(zip(constants, values.tolist(), strict=True))
    effects = tuple(
        replace(effect, time_constant_s=new[effect.time_constant_s])
        if free and effect.time_constant_s in new
        else effect
        for effect, free in zip(selection.effects, selection.free, strict=True)
    )
    return Selection(effects, selection.free)


def _left(measurements: Sequence[Measurement], machine: Machine, selection: Selection) -> float:
    """The squares that are left, in units of the noise, all coefficients and the set-up solved for."""
    problem = calibrate.Problem.of(measurements, machine.replace(effects=selection.effects), selection)
    residual = problem.residual(selection.start, problem.start) / problem.sigma
    columns = np.concatenate([problem.design, problem.nuisance(problem.start)], axis=1) / problem.sigma[:, None]
    rest = without(orthonormal(columns), residual)
    return float(rest @ rest)


def _sigma(left, best: Array, k: int, least: float) -> float:  # type: ignore[no-untyped-def]
    """The relative standard deviation of a constant, from how the squares grow beside the minimum."""
    step = np.zeros(len(best))
    step[k] = 0.05
    curvature = (left(best + step) + left(best - step) - 2 * least) / 0.05**2
    return float(np.sqrt(2 / curvature)) if curvature > 0 else float("inf")


def _words(selection: Selection, constant: float, sigma: float, limits: tuple[float, float]) -> Message:
    names = [each.name for each in _lagging(selection.estimated, constant)]
    text = f"{', '.join(names)} follows {_lagging(selection.estimated, constant)[0].input} with a time constant of "
    if sigma > 0.5 or not limits[0] * 1.01 < constant < limits[1] / 1.01:
        text += f"about {constant:.3g} s, which these times do not tell"
        return Message("NCF639", text, hint="measure over several time constants, warming and cooling")
    return Message("NCF640", f"{text}{constant:.4g} s, sigma {constant * sigma:.2g} s")


def _lagging(effects: Sequence[Effect], constant: float) -> list[Effect]:
    return [effect for effect in effects if effect.time_constant_s == constant]
