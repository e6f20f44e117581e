"""What would have been found: the mean of the odds that effects of a size really have, and said in words."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from ncfix.diagnosis.selection import findable_in_words, mean_odds, shows_hardly_anything

DRAWS = 4000
SIZES = (1.5, 3.0, 6.0, 12.0, 24.0)


@pytest.mark.parametrize("size", [0.3, 1.0, 3.0])
def test_odds_are_the_mean_of_those_of_effects_of_that_size(size: float) -> None:
    random = np.random.default_rng(2)
    columns = random.normal(size=(30, 4)) * [1.0, 0.5, 0.2, 0.0]
    there = np.eye(30) + size**2 * columns @ columns.T
    y = random.multivariate_normal(np.zeros(30), there, DRAWS)
    odds = multivariate_normal(np.zeros(30), there).logpdf(y) - multivariate_normal(np.zeros(30), np.eye(30)).logpdf(y)
    wanted = mean_odds(size**2 * np.linalg.eigvalsh(columns.T @ columns).clip(0.0))
    assert wanted == pytest.approx(odds.mean(), abs=4 * odds.std() / np.sqrt(DRAWS))  # four standard errors


def test_sizes_are_said_once_and_names_that_cannot_show_count() -> None:
    sizes = {"EXX": 1.5, "EYX": 1.5, "EZX": 6.0, "drift X": np.inf}
    assert (
        findable_in_words(sizes, 5, SIZES)
        == "these data would have shown: from 1.5 um rms on 2 of 5 effects, from 6 um rms on 3"
    )
    assert not shows_hardly_anything(sizes, SIZES)  # of any number in the catalogue
    assert shows_hardly_anything({**sizes, "EZX": np.inf, "drift Y": np.inf}, SIZES)
    assert shows_hardly_anything({}, SIZES)
    assert (
        findable_in_words({"EXX": np.inf}, 9, SIZES) == "none of 9 effects would have been found, even with 24 um rms"
    )
