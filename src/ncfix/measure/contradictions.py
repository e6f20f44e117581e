"""Measurements from which no machine file may be written: contradictory standards, too many outliers, a misfit.

A stated length is never treated as an outlier: if two of them contradict each other, only their owner knows which is
wrong. Outliers must be few: if they are many, or most of one set, it is unclear which part of the data is right. A
calibration is refused if its residuals are larger than any machine with such an instrument leaves.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import Message
from ncfix.machine.plausible import Doubt, functions, much
from ncfix.measure.estimate import HOPELESS, Calibration, Estimate, Problem, Residuals
from ncfix.measure.measurement import Measurement
from ncfix.measure.mistakes import ODD
from ncfix.measure.selection import candidate_effects

BEYOND = 1000.0
"""Residuals in units of the noise that mean a wrong unit, file or noise; missing effects leave some tens of it."""
MUCH_UM = 100.0
"""Smaller residuals, um rms, may come from a missing effect, however small the stated noise is."""
UM = 1e3
MAX_SIGMAS = 4.0
"""Largest deviation of a stated length from its prediction by all other data, in standard deviations."""
LACKING = 0.1
"""Standard deviation of each error that the model lacks, in units of a large error (`plausible.much`)."""
TOLD = 1e-6
"""Smallest precision, in units of the noise, at which the other values predict a value at all."""
MANY, FEW = 0.05, 4
"""Largest share of the values that may be outliers; this many are always allowed."""
ALL = 0.5
"""Largest share of the rows of a set that may be outliers."""
FEWEST = 4
"""Smallest number of rows for a test of a set, or of a column for equal values."""
LACK = 5.0
"""Residuals in units of the noise that are a large lack of fit."""
REFUSED = ("NCF617", "NCF621", "NCF622", "NCF623")
"""Remarks that forbid to write a machine file."""


def refusals(calibration: Calibration, odd: Sequence[Doubt]) -> tuple[Message, ...]:
    """Reasons why no machine file may be written: contradictory data, a misfit, or an impossible machine (`odd`)."""
    found = misfit(calibration)
    impossible = tuple(doubt.message for doubt in odd if doubt.impossible)
    return (*_contradictions(calibration), *(() if found is None else (found,)), *impossible)


def _contradictions(calibration: Calibration) -> tuple[Message, ...]:
    """The calibration's remarks that forbid a machine file; with a large lack of fit, also those on odd data."""
    codes = {*REFUSED, *(ODD if np.sqrt(calibration.chi_square) > LACK else ())}
    remarks = calibration.remarks
    return tuple(sorted((each for each in remarks if each.code in codes), key=lambda each: each.code in ODD))


def misfit(calibration: Calibration) -> Message | None:
    """NCF642 if the residuals exceed `max_correction`, or both `MUCH_UM` and `BEYOND` times the noise; else None."""
    factor = float(np.sqrt(calibration.chi_square)) if calibration.problem.noise_known else 0.0
    most_um = UM * float(calibration.machine.max_correction[0])
    beyond = factor > BEYOND and calibration.after_um > MUCH_UM
    if not beyond and not calibration.after_um > most_um:
        return None
    times = f", {factor:.0f} times the noise" if factor > 1 else ""
    rms = f" ({calibration.after_um:.4g} um rms of {calibration.before_um:.4g} um before)"
    text = f"the calibrated model does not describe these measurements: the residual{rms} is "
    text += f"{factor:.0f} times the noise" if beyond else f"larger than max_correction, {most_um:g} um{times}"
    problem, estimate = calibration.problem, calibration.estimate
    rest = Residuals.of(problem, estimate)
    worst = int(np.argmax(np.abs(estimate.residual / problem.sigma) * (estimate.weight > 0)))
    hint = "check this row, the units (mm, rad, degree), signs and columns, and whether it is this machine; "
    hint += "noise_um must be in um"
    return Message("NCF642", f"{text}; it is largest in {rest.component[worst]}", rest.place(worst), hint)


def conflicts(problem: Problem, estimate: Estimate) -> Iterator[Message]:
    """NCF621 and NCF622: stated lengths or sets of rows that contradict the other data."""
    yield from _standards(problem, estimate)
    yield from _outlying(problem, estimate)


def untouched(measurement: Measurement) -> Message | None:
    """NCF623 if nothing was measured: in every measured column all values are equal."""
    same = [name for name in measurement.measured if np.ptp(measurement.columns[name]) == 0]
    if len(measurement) < FEWEST or len(same) < len(measurement.measured) or not same:
        return None
    value = measurement.columns[same[0]][0]
    text = f"{', '.join(same)} {'is' if len(same) == 1 else 'are'} {value:g} in all rows, which no instrument reads"
    return Message("NCF623", text, measurement.place(0), "was the file filled in?")


def _standards(problem: Problem, estimate: Estimate) -> Iterator[Message]:
    """NCF621 if a stated length deviates too far from its prediction by all other data.

    Real machines have all errors of ISO 230-1, the model only some. A lacking error changes a distance more than the
    readings, since the balls move with it. So the lacking errors are included with a Gaussian prior of usual size.
    """
    stated = np.flatnonzero(problem.stated)
    if not stated.size:
        return
    root = np.sqrt(estimate.weight) / problem.sigma
    residual = estimate.residual * root
    free = np.concatenate([estimate.solution.orthogonal, estimate.solution.nuisance], axis=1)
    lacking = LACKING * _lacking(problem, estimate) * root[:, None]
    inner = np.linalg.inv(np.eye(lacking.shape[1]) + lacking.T @ lacking)
    sought = np.column_stack([residual, np.eye(len(residual))[:, stated]])
    solved_free = free - lacking @ (inner @ (lacking.T @ free))
    solved = sought - lacking @ (inner @ (lacking.T @ sought))
    solved -= solved_free @ np.linalg.solve(free.T @ solved_free, solved_free.T @ sought)
    pull, precision = solved[stated, 0], solved[stated, 1:]
    squares = float(residual @ solved[:, 0] - pull @ np.linalg.pinv(precision, rcond=TOLD) @ pull)
    freedom = max(int((estimate.weight > 0).sum()) - free.shape[1], 1)
    factor = max(1.0, float(np.sqrt(max(squares, 0.0) / (estimate.share * freedom))))
    told = np.maximum(np.diag(precision), TOLD)
    far = np.where(np.diag(precision) > TOLD, np.abs(pull) / (factor * np.sqrt(told)), 0.0)
    at = int(np.argmax(far))
    if far[at] <= MAX_SIGMAS:
        return
    missed = 1e3 * pull[at] / told[at] * problem.sigma[stated[at]]
    text = (
        f"the stated distances contradict each other: one differs by {missed:+.1f} um from the value that the others "
        f"and the readings give, which is {far[at]:.0f} standard deviations"
    )
    hint = "leave out the wrong standard, or estimate the errors that the model lacks: --effects"
    yield Message("NCF621", text, Residuals.of(problem, estimate).place(int(stated[at])), hint)


def _lacking(problem: Problem, estimate: Estimate) -> Array:
    """Design (m, k) of the errors that are not estimated, each scaled to a large error of this machine, mm or rad."""
    machine, selection = problem.machine, problem.selection
    there = {(effect.name, effect.basis) for effect in selection.estimated}
    others = [effect for effect in candidate_effects(machine) if (effect.name, effect.basis) not in there]
    sizes = [much(machine, each.name) / np.abs(functions(machine, each)).max(axis=1) for each in others]
    held = np.setdiff1d(np.arange(problem.design.shape[1]), estimate.solution.kept)
    parts = [np.concatenate([each.design(others) for each in problem.observations]), problem.design[:, held]]
    return np.concatenate(parts, axis=1) * np.concatenate([*sizes, problem.limits[held] / HOPELESS])


def _outlying(problem: Problem, estimate: Estimate) -> Iterator[Message]:
    """NCF622 if outliers are too many, in all data or in one set."""
    aside = estimate.weight == 0
    if not aside.any():
        return
    residuals = Residuals.of(problem, estimate)
    if aside.sum() > max(FEW, MANY * len(aside)):
        text = f"{int(aside.sum())} of {len(aside)} values are far from the model that fits the others"
        first = int(np.flatnonzero(aside)[0])
        yield Message("NCF622", text, residuals.place(first), "check which of them are right")
        return
    for file, each in enumerate(problem.observations):
        sets = np.array(each.measurement.sets)
        bad = residuals.row[aside & (residuals.observation == file) & (residuals.row >= 0)]
        for name in dict.fromkeys(each.measurement.sets):
            rows = np.flatnonzero(sets == name)
            count = len(np.intersect1d(rows, bad))
            if len(rows) >= FEWEST and count > ALL * len(rows):
                text = f"{count} of {len(rows)} rows of set {name} are far from the model that fits the other rows"
                yield Message(
                    "NCF622",
                    text,
                    each.measurement.place(int(rows[0])),
                    "check whether this set is right, or the others",
                )
