"""Values that neither the model nor any smooth effect explains: found by leaving each one out.

The model that is asked is the base with a generous amount of everything, so that an effect that is really there makes
no outliers. Rows beyond `GROSS` are put aside and named; those beyond `TAIL` count less (long tails of the noise).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnose.background import in_noise
from ncfix.diagnose.view import View
from ncfix.measure.measurement import Array
from ncfix.measure.solve import orthonormal

GROSS, TAIL = 5.0, 3.0
SHARE = 2.5
"""Size of everything, against the noise, that may be there."""
ASIDE = 1e3
"""Factor on the standard deviation of what is put aside."""


def left_out(view: View, everything: Array) -> Array:
    """For every value: what it is, minus what all others predict of it, over its standard deviation; (m,)."""
    base = orthonormal(view.base / view.relative[:, None])
    precision = np.linalg.inv(np.eye(len(base)) + SHARE**2 * in_noise(everything, view.relative))
    solved = precision @ base
    precision -= solved @ np.linalg.solve(base.T @ solved, solved.T)
    z = precision @ (view.y / view.relative) / np.sqrt(np.maximum(np.diag(precision), 1e-12))
    spread = float(np.median(np.abs(z))) / 0.6745
    scaled: Array = z / (spread or 1.0)
    return scaled


def weighed(view: View, everything: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Standard deviations against that of a plain value with outliers put aside, and which rows those are, (rows,)."""
    z, row = np.abs(left_out(view, everything)), view.row
    gross = np.zeros(view.count, dtype=bool)
    gross[row[(z > GROSS) & (row >= 0)]] = True
    relative = view.relative * np.maximum(1.0, z / TAIL)
    relative = np.where((row >= 0) & gross[np.maximum(row, 0)], ASIDE * view.relative, relative)
    return relative, gross
