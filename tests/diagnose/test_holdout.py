"""Predicting folds by blocks of one inverse is predicting each fold from the others."""

from __future__ import annotations

import numpy as np

from diagnose.worlds import World
from ncfix.diagnose.addition import WIDE
from ncfix.diagnose.background import everything_of
from ncfix.diagnose.evidence import Court, Member
from ncfix.diagnose.holdout import FOLDS, held_out
from ncfix.diagnose.view import view
from ncfix.diagnose.wandering import background
from ncfix.measure.measurement import Array

ROUNDING_UM = 1e-4
"""The constants are free with a variance 1e6 times that of the noise."""


def test_a_fold_is_predicted_from_the_others() -> None:
    world = World.of("three_axis", 2, 40)
    data = world.measured(np.zeros(len(world.view.y)), np.random.default_rng(0), stated=True)
    seen = view([data], world.machine)
    ground = background(seen, everything_of(seen, world.gathered.groups), seen.relative)
    court = Court(ground, world.gathered.groups, len(world.gathered.groups))
    member = Member(court.forms["EXX"][0], 6.0)
    found = held_out(court, [member], 0.4)
    columns = 6.0 * court.groups[member.group].columns
    assert np.allclose(found.with_all, _plainly(court, columns, found.cell), atol=ROUNDING_UM)
    assert np.allclose(found.without, found.less[0], atol=ROUNDING_UM)


def _plainly(court: Court, columns: Array, cell: Array) -> Array:
    """Base and effect are carried over to each fold; noise and everything else is not."""
    seen = court.background.view
    size = np.sqrt((seen.base**2).mean(axis=0))
    base = WIDE * seen.base[:, size > 0] / size[size > 0]
    signal = base @ base.T + columns @ columns.T
    whole = signal + np.linalg.inv(court.background.precision(0.4))
    error = np.empty(len(seen.y))
    for fold in range(FOLDS):
        test = cell % FOLDS == fold
        weights = np.linalg.solve(whole[np.ix_(~test, ~test)], seen.y[~test])
        error[test] = seen.y[test] - signal[np.ix_(test, ~test)] @ weights
    return error
