"""The closed forms against what they stand for."""

from __future__ import annotations

import numpy as np
from scipy.stats import multivariate_normal

from ncfix.diagnosis.effect_form import log_odds
from ncfix.diagnosis.forms import principal_rotation
from ncfix.diagnosis.joint_fit import pose_regions
from ncfix.diagnosis.residual_data import damped

ROUNDING = 1e-9
SIZES = (1.5, 3.0, 6.0, 12.0, 24.0)


def test_log_odds_are_those_of_two_normal_distributions() -> None:
    """With the noise all but known the odds are the ratio of densities of the data with and without the effect."""
    random = np.random.default_rng(3)
    columns, y = random.normal(size=(40, 3)), random.normal(size=40) * 1.3
    known = 1e9
    found = log_odds(columns.T @ columns, columns.T @ y, y @ y + known, 40 + known, SIZES)
    none = multivariate_normal(np.zeros(40), np.eye(40)).logpdf(y)
    for size, odds in zip(SIZES, found, strict=True):
        there = multivariate_normal(np.zeros(40), np.eye(40) + size**2 * columns @ columns.T).logpdf(y)
        assert abs(odds - (there - none)) < 1e-5  # freedom of 1e9 instead of infinite


def test_fewer_columns_carry_the_same_squares() -> None:
    random = np.random.default_rng(1)
    columns = random.normal(size=(50, 2)) @ random.normal(size=(2, 7))
    turned = principal_rotation(columns)
    assert turned.shape[1] <= 2
    assert abs(((columns @ turned) ** 2).sum() / (columns**2).sum() - 1) < 3e-3  # groups.NEGLIGIBLE


def test_damped_least_squares_leave_what_cannot_be_told() -> None:
    columns = np.array([[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]])
    found = damped(columns, np.array([2.0, 4.0, 6.0]))
    assert np.allclose(found, [1.0, 1.0], atol=ROUNDING)


def test_regions_are_equally_large_and_neighbourly() -> None:
    u = np.random.default_rng(0).uniform(-1, 1, (320, 2))
    label = pose_regions(u)
    assert sorted(np.bincount(label).tolist()) == [20] * 16
    inside = np.mean([np.ptp(u[label == k], axis=0).max() for k in range(16)])
    assert inside < 0.8
