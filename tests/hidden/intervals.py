"""Confidence intervals: Wilson's for shares, the bootstrap's for quantiles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Z95 = 1.959963984540054


def wilson(hits: int, count: int, z: float = Z95) -> tuple[float, float]:
    """Wilson's score interval of a share (Wilson 1927), 95 % unless told."""
    if count == 0:
        return 0.0, 1.0
    share, w = hits / count, z * z / count
    middle = (share + w / 2) / (1 + w)
    half = z / (1 + w) * np.sqrt(share * (1 - share) / count + w / (4 * count))
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


def bootstrap(values: Sequence[float], quantile: float, draws: int = 2000) -> tuple[float, float]:
    """Percentile bootstrap of a quantile, 95 %, always with the same draws."""
    if len(values) == 0:
        return float("nan"), float("nan")
    rng = np.random.default_rng(0)
    picked = np.asarray(values)[rng.integers(len(values), size=(draws, len(values)))]
    low, high = np.quantile(np.quantile(picked, quantile, axis=1), (0.025, 0.975))
    return float(low), float(high)
