"""Points spread evenly: the same as another program draws, and even."""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from ncfix.measure.candidates import halton


def test_points_are_those_that_scipy_draws_from_the_same_numbers() -> None:
    for sides in range(1, 8):
        own = halton(200, sides, np.random.default_rng(sides))
        np.testing.assert_array_equal(own, qmc.Halton(sides, rng=np.random.default_rng(sides)).random(200))


def test_every_tenth_of_every_side_holds_a_tenth_of_the_points() -> None:
    points = halton(320, 5, np.random.default_rng(0))
    for side in points.T:
        counts = np.histogram(side, bins=10, range=(0.0, 1.0))[0]
        # Halton's discrepancy along one side: at most (base - 1) / log(base) log(count) + 1 points, base 11
        assert np.abs(counts - 32).max() <= 2 * (10 / np.log(11) * np.log(320) + 1)
