"""Measurements that contradict themselves or each other, so that no calibration can be right.

A stated standard is never an outlier: where two of them cannot both be true, nobody but their owner knows which one is
wrong. Outliers are few; where they are many, or all of one set, it is no longer said which part of the data is right.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ncfix.diagnostics import Message
from ncfix.measure.calibrate import Calibration, Estimate, Problem
from ncfix.measure.measurement import Measurement
from ncfix.measure.residuals import place, residuals

FAR = 3.5
"""Standard deviations that a stated length may be from what all others say."""
MODEL = 0.25
"""Of the noise of a reading: what small effects that the model lacks may do to a distance, which many readings tell."""
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
    """Stated lengths that the others and the readings deny, by what is predicted without them."""
    stated = np.flatnonzero(problem.stated)
    if not stated.size:
        return
    read = ~problem.stated & (estimate.weight > 0)
    size = estimate.residual / problem.sigma
    leverage = estimate.solution.leverage
    free = max(float((1 - leverage)[read].sum()), 1.0)
    factor = max(1.0, float(np.sqrt((estimate.weight * size**2)[read].sum() / (estimate.share * free))))
    rest = 1 - leverage[stated]
    model = MODEL * factor * float(np.median(problem.sigma[read]))
    known = rest > 1e-6
    missed = np.where(known, estimate.residual[stated], 0.0) / np.where(known, rest, 1.0)
    deviation = factor * problem.sigma[stated] / np.sqrt(np.where(known, rest, 1.0))
    far = np.abs(missed) > FAR * np.hypot(deviation, model)
    if not far.any():
        return
    at = int(np.argmax(np.abs(missed) / deviation))
    found = residuals(problem, estimate)
    text = (
        f"the stated distances cannot all be true: one is {1e3 * missed[at]:+.1f} um from what the others and the "
        f"readings say, {abs(missed[at]) / deviation[at]:.0f} times what is stated"
    )
    hint = "which standard is right? Leave the other out, or estimate what the model lacks: --effects"
    yield Message("NCF621", text, place(problem, found, int(stated[at])), hint)


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
