"""Values that neither the model nor any smooth effect explains: found by leaving each one out.

The model that is asked is the base with a generous amount of everything, so that an effect that is really there makes
no outliers. One that is many times the noise makes them all the same; so where more rows stand out than instruments
fail, the effect that explains the data best is taken to be there as well, and it is asked again. Rows beyond `GROSS`
are put aside and named; those beyond `TAIL` count less (long tails of the noise).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnose.background import in_noise
from ncfix.diagnose.evidence import SIZES, log_odds
from ncfix.diagnose.fields import slow
from ncfix.diagnose.groups import Group
from ncfix.diagnose.view import View
from ncfix.diagnose.weighing import MISSHAPEN
from ncfix.measure.measurement import Array
from ncfix.measure.solve import orthonormal

GROSS, TAIL = 5.0, 3.0
SHARE = 2.5
"""Size of everything, against the noise, that may be there."""
ASIDE = 1e3
"""Factor on the standard deviation of what is put aside."""
FAILED = 0.02
"""Share of the rows that an instrument may spoil; where more stand out, an effect may be why."""
LARGE = 8.0
"""The sizes of `SIZES` times this, in noise, are those of effects that make rows stand out."""
LIKELY = 10.0
"""Log odds that such an effect must have."""
MOST = 5
"""So many of them at most."""


def weighed(view: View, everything: Array, groups: Sequence[Group]) -> tuple[Array, NDArray[np.bool_]]:
    """Standard deviations against that of a plain value with outliers put aside, and which rows those are, (rows,).

    `everything` is the covariance of a little of everything, um^2; `groups` are all effects that may be there.
    """
    there = SHARE**2 * in_noise(everything, view.relative)
    z = np.abs(left_out(view, there))
    for _ in range(MOST):
        if _standing_out(view, z).mean() <= FAILED:
            break
        effect = _likeliest(view, there, np.maximum(1.0, z / TAIL), groups)
        if effect is None:
            break
        there = there + effect @ effect.T
        z = np.abs(left_out(view, there))
    gross, row = _standing_out(view, z), view.row
    relative = view.relative * np.maximum(1.0, z / TAIL)
    return np.where((row >= 0) & gross[np.maximum(row, 0)], ASIDE * view.relative, relative), gross


def left_out(view: View, there: Array) -> Array:
    """For every value: what it is, minus what all others predict of it, over its standard deviation; (m,).

    `there` is the covariance of what is there besides noise and base, in units of each value's noise, (m, m).
    """
    precision = _precision(view, np.eye(len(there)) + there)
    z = precision @ (view.y / view.relative) / np.sqrt(np.maximum(np.diag(precision), 1e-12))
    spread = float(np.median(np.abs(z))) / 0.6745
    scaled: Array = z / (spread or 1.0)
    return scaled


def _precision(view: View, covariance: Array) -> Array:
    """The inverse of a covariance in units of each value's noise, with the base free, (m, m)."""
    base = orthonormal(view.base / view.relative[:, None])
    precision = np.linalg.inv(covariance)
    solved = precision @ base
    return np.asarray(precision - solved @ np.linalg.solve(base.T @ solved, solved.T), dtype=np.float64)


def _standing_out(view: View, z: Array) -> NDArray[np.bool_]:
    """Rows with a value beyond `GROSS`."""
    gross = np.zeros(view.count, dtype=bool)
    gross[view.row[(z > GROSS) & (view.row >= 0)]] = True
    return gross


def _likeliest(view: View, there: Array, wide: Array, groups: Sequence[Group]) -> Array | None:
    """The likeliest effect in its likeliest size, and what it may differ in shape: columns in units of each value's
    noise, (m, k); None if none is likely.

    Values count less as their noise is `wide`: what stands out for other reasons shall not bring an effect.
    """
    precision, y = _precision(view, np.diag(wide**2) + there), view.y / view.relative
    total, count = float(y @ precision @ y), float(len(y) - view.base.shape[1])
    best, found = LIKELY, None
    for group in groups:
        columns = LARGE * group.columns / view.relative[:, None]
        solved = precision @ columns
        odds = log_odds(columns.T @ solved, solved.T @ y, total, count)
        if odds.max() > best:
            best, found = float(odds.max()), SIZES[int(odds.argmax())] * columns
    if found is None:
        return None
    solved = precision @ found
    shown = found @ np.linalg.solve(np.eye(found.shape[1]) + found.T @ solved, solved.T @ y)
    return np.concatenate([found, MISSHAPEN * shown[:, None] * slow(view)], axis=1)
