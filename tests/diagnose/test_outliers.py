"""Rows are put aside for what the instrument did, not for what the machine lacks, however large that is."""

from __future__ import annotations

import numpy as np
import pytest

from diagnose.worlds import World
from ncfix.diagnosis.forms import unnamed_alternatives, visible_forms
from ncfix.diagnosis.noise import FAILED, downweighted, everything_covariance
from ncfix.diagnosis.residual_data import residual_data
from ncfix.measure.measurement import Array

POSES, SIGMA_UM = 48, 3.0
SPOILT, BY = (7, 40), 12.0
"""Rows with an outlier, and of how many standard deviations."""


def put_aside(name: str, sizes: float, spoilt: tuple[int, ...]) -> set[int]:
    """The rows that are put aside where an effect is so many times the noise."""
    world, random = World.of("three_axis", 1, POSES), np.random.default_rng(1)
    shown: Array = world.effect(name, sizes * SIGMA_UM, random) + random.normal(scale=SIGMA_UM, size=len(world.data.y))
    for row in spoilt:
        shown[3 * row] += BY * SIGMA_UM
    every = shown.reshape(-1, 3) / 1e3
    seen = residual_data(
        [world.plain.with_columns({n: world.plain.columns[n] + every[:, k] for k, n in enumerate(("dx", "dy", "dz"))})],
        world.machine,
    )
    named = visible_forms(seen, world.candidates).groups
    _, outlying = downweighted(seen, everything_covariance(seen, named), (*named, *unnamed_alternatives(seen, named)))
    return set(np.flatnonzero(outlying).tolist())


@pytest.mark.parametrize(("name", "sizes"), [("EXX", 20.0), ("backlash X", 20.0), ("pitch X", 7.0)])
def test_a_large_effect_makes_no_outliers(name: str, sizes: float) -> None:
    """Before the effect was taken to be there, 8 to 19 of these 96 rows were put aside."""
    assert len(put_aside(name, sizes, ())) <= FAILED * 2 * POSES


@pytest.mark.parametrize("sizes", [2.0, 20.0])
def test_outliers_are_found_beside_it(sizes: float) -> None:
    found = put_aside("EAY", sizes, SPOILT)
    assert found >= set(SPOILT)
    assert len(found) <= len(SPOILT) + FAILED * 2 * POSES
