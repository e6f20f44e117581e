"""Measurements that contradict themselves or each other, so that no calibration can be right.

A stated standard is never an outlier: where two of them cannot both be true, nobody but their owner knows which one is
wrong. Outliers are few; where they are many, or all of one set, it is no longer said which part of the data is right.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ncfix.diagnostics import Message
from ncfix.machine.plausible import functions, much
from ncfix.measure.calibrate import HOPELESS, Calibration, Estimate, Problem
from ncfix.measure.measurement import Array, Measurement
from ncfix.measure.residuals import place, residuals
from ncfix.measure.selection import candidates

FAR = 4.0
"""Standard deviations that a stated length may be from what all others say."""
LACKING = 0.1
"""Of what is much: the standard deviation of each error that machines have and the model lacks."""
TOLD = 1e-6
"""Of a value: what of it is less than this is told by no other value."""
MANY, FEW = 0.05, 4
"""Share of the values that may be outliers; so many may be in any file."""
ALL = 0.5
"""Share of the rows of a set that may be outliers."""
ROWS = 4
"""Rows that make a set of which something can be said, and a column that cannot be all the same."""
SUSPECTED = {"NCF614", "NCF615", "NCF616"}
"""Remarks that are mistakes where the model does not describe the data."""
LACK = 5.0
"""Times the noise: a large lack of fit."""
REFUSED = ("NCF617", "NCF621", "NCF622", "NCF623")
"""Remarks with which no machine is written."""


def contradictions(calibration: Calibration) -> tuple[Message, ...]:
    """Why no machine may be made of this calibration: NCF617, NCF621, NCF622, and what is suspected of data that do
    not fit.
    """
    found = [message for message in calibration.remarks if message.code in REFUSED]
    factor = float(np.sqrt(calibration.chi_square)) if calibration.problem.noise_known else calibration.scale
    if factor > LACK:
        found += [message for message in calibration.remarks if message.code in SUSPECTED]
    return tuple(found)


def remarks(problem: Problem, estimate: Estimate) -> Iterator[Message]:
    """What of these data cannot all be true."""
    yield from _standards(problem, estimate)
    yield from _outlying(problem, estimate)


def untouched(measurement: Measurement) -> Message | None:
    """NCF623 if nothing was measured: all values of a column are the very same."""
    same = [name for name in measurement.measured if np.ptp(measurement.columns[name]) == 0]
    if len(measurement) < ROWS or len(same) < len(measurement.measured) or not same:
        return None
    value = measurement.columns[same[0]][0]
    text = f"{', '.join(same)} {'is' if len(same) == 1 else 'are'} {value:g} in all rows: no instrument reads that"
    return Message("NCF623", text, measurement.place(0), "was the file filled in?")


def _standards(problem: Problem, estimate: Estimate) -> Iterator[Message]:
    """NCF621 if the others and the readings deny a stated length, by what is predicted of it without it.

    Real machines have all errors of ISO 230-1, a model some of them. What it lacks bends a distance more than it
    shows in the readings, since the balls move with it. So the errors that it lacks may be there, too, in the sizes
    that machines have, and readings that show one tell how much it bends a distance: a Gaussian prior on them.
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
    if far[at] <= FAR:
        return
    missed = 1e3 * pull[at] / told[at] * problem.sigma[stated[at]]
    text = (
        f"the stated distances cannot all be true: one is {missed:+.1f} um from what the others and the readings say, "
        f"{far[at]:.0f} standard deviations of that"
    )
    hint = "which standard is right? Leave the other out, or estimate what the model lacks: --effects"
    yield Message("NCF621", text, place(problem, residuals(problem, estimate), int(stated[at])), hint)


def _lacking(problem: Problem, estimate: Estimate) -> Array:
    """What errors do that machines have and that are not estimated, each as large as what is much of it: (m, k), mm."""
    machine, selection = problem.machine, problem.selection
    there = {(effect.name, effect.basis) for effect in selection.estimated}
    others = [effect for effect in candidates(machine) if (effect.name, effect.basis) not in there]
    sizes = [much(machine, each.name) / np.abs(functions(machine, each)).max(axis=1) for each in others]
    held = np.setdiff1d(np.arange(problem.design.shape[1]), estimate.solution.kept)
    parts = [np.concatenate([each.design(others) for each in problem.observations]), problem.design[:, held]]
    errors: Array = np.concatenate(parts, axis=1) * np.concatenate([*sizes, problem.limits[held] / HOPELESS])
    return errors


def _outlying(problem: Problem, estimate: Estimate) -> Iterator[Message]:
    """Outliers that are too many to be outliers."""
    aside = estimate.weight == 0
    if not aside.any():
        return
    found = residuals(problem, estimate)
    if aside.sum() > max(FEW, MANY * len(aside)):
        text = f"{int(aside.sum())} of {len(aside)} values are far from the model that the others make"
        first = int(np.flatnonzero(aside)[0])
        yield Message("NCF622", text, place(problem, found, first), "which of them are right?")
        return
    for file, each in enumerate(problem.observations):
        sets = np.array(each.measurement.sets)
        bad = found.row[aside & (found.observation == file) & (found.row >= 0)]
        for name in dict.fromkeys(each.measurement.sets):
            rows = np.flatnonzero(sets == name)
            count = len(np.intersect1d(rows, bad))
            if len(rows) >= ROWS and count > ALL * len(rows):
                text = f"{count} of {len(rows)} rows of set {name} are far from the model that the others make"
                yield Message("NCF622", text, each.measurement.place(int(rows[0])), "is that set right, or the others?")
