"""Predicting folds by blocks of one inverse is predicting each fold from the others."""

from __future__ import annotations

import numpy as np

from diagnose.worlds import World
from ncfix.diagnosis.evidence import Evidence, Member
from ncfix.diagnosis.joint_fit import FOLDS, WIDE, held_out
from ncfix.diagnosis.noise import estimated_background, everything_covariance
from ncfix.diagnosis.residual_data import residual_data
from ncfix.measure.measurement import Array

ROUNDING_UM = 1e-4
"""The constants are free with a variance 1e6 times that of the noise."""


def test_a_fold_is_predicted_from_the_others() -> None:
    world = World.of("three_axis", 2, 40)
    data = world.measured(np.zeros(len(world.data.y)), np.random.default_rng(0), stated=True)
    seen = residual_data([data], world.machine)
    background = estimated_background(seen, everything_covariance(seen, world.visible.groups), seen.relative)
    evidence = Evidence(background, world.visible.groups, len(world.visible.groups))
    member = Member(evidence.forms["EXX"][0], 6.0)
    found = held_out(evidence, [member], 0.4)
    columns = 6.0 * evidence.groups[member.group].columns
    assert np.allclose(found.with_all, _plainly(evidence, columns, found.cell), atol=ROUNDING_UM)
    assert np.allclose(found.without, found.less[0], atol=ROUNDING_UM)


def _plainly(evidence: Evidence, columns: Array, cell: Array) -> Array:
    """Base and effect are carried over to each fold; noise and everything else is not."""
    seen = evidence.background.data
    size = np.sqrt((seen.base**2).mean(axis=0))
    base = WIDE * seen.base[:, size > 0] / size[size > 0]
    signal = base @ base.T + columns @ columns.T
    whole = signal + np.linalg.inv(evidence.background.precision(0.4))
    error = np.empty(len(seen.y))
    for fold in range(FOLDS):
        test = cell % FOLDS == fold
        weights = np.linalg.solve(whole[np.ix_(~test, ~test)], seen.y[~test])
        error[test] = seen.y[test] - signal[np.ix_(test, ~test)] @ weights
    return error
