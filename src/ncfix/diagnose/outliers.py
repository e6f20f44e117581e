"""Values that neither the model nor any smooth effect explains: found by leaving each one out.

The model that is asked is the base with a generous amount of everything, so that an effect that is really there makes
no outliers. Rows beyond `GROSS` are put aside and named; those beyond `TAIL` count less (long tails of the noise).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnose.background import PRIOR, SHARES, Background, marginal
from ncfix.measure.measurement import Array

GROSS, TAIL = 5.0, 3.0
ASIDE = 1e3
"""Factor on the standard deviation of what is put aside."""


def left_out(ground: Background) -> Array:
    """For every value: what it is, minus what all others predict of it, over its standard deviation; (m,)."""
    y = ground.seen(ground.view.y)
    variance = ground.variance(_share(ground, y))
    inverse = ground.rotation / variance
    precision = np.einsum("mn,mn->m", ground.rotation, inverse)
    z = inverse @ y / np.sqrt(np.maximum(precision, 1e-300))
    spread = float(np.median(np.abs(z))) / 0.6745
    scaled: Array = z / (spread or 1.0)
    return scaled


def _share(ground: Background, y: Array) -> float:
    """The likeliest share of everything."""
    found = []
    for share, prior in zip(SHARES, PRIOR, strict=True):
        variance = ground.variance(share)
        squares, determinant = float((y**2 / variance).sum()), float(np.log(variance).sum())
        found.append(marginal(squares, determinant, len(y), ground.freedom) + np.log(prior))
    return SHARES[int(np.argmax(found))]


def weighed(ground: Background) -> tuple[Array, NDArray[np.bool_]]:
    """Standard deviations against that of a plain value with outliers put aside, and which rows those are, (rows,)."""
    z = np.abs(left_out(ground))
    row = ground.view.row
    gross = np.zeros(ground.view.count, dtype=bool)
    gross[row[(z > GROSS) & (row >= 0)]] = True
    relative = ground.relative * np.maximum(1.0, z / TAIL)
    relative = np.where((row >= 0) & gross[np.maximum(row, 0)], ASIDE * ground.relative, relative)
    return relative, gross
