"""Outliers: what is gross is found, what noise makes is left alone, however few values there are for the unknowns."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.measure.least_squares import outliers, solve

SHAPES = ((27, 24), (60, 50), (60, 30), (150, 30))


def problem(m: int, p: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Columns of two entries a row, as measurements of one or two errors at a time have them, and noise of one."""
    random = np.random.default_rng(seed)
    columns = np.zeros((m, p))
    for row in columns:
        row[random.choice(p, 2, replace=False)] = random.normal(size=2)
    return columns, random.normal(size=m)


def outlying(columns: np.ndarray, values: np.ndarray) -> np.ndarray:
    return outliers(solve(columns, np.zeros((len(values), 0)), values))


@pytest.mark.parametrize(("m", "p"), SHAPES)
def test_noise_alone_has_no_outliers(m, p):
    """One of a thousand measurements may have one: of forty none is expected, and two would be 1 in 1300."""
    assert sum(bool(outlying(*problem(m, p, seed)).any()) for seed in range(40)) < 2


@pytest.mark.parametrize(("m", "p"), SHAPES[2:])
def test_gross_values_are_found_and_no_others(m, p):
    for seed in range(20):
        columns, values = problem(m, p, seed)
        spare = 1 - np.einsum("ij,ji->i", columns, np.linalg.pinv(columns))
        wrong = np.argsort(-spare)[:2]  # values that the others predict best
        values[wrong] += 60.0
        assert np.flatnonzero(outlying(columns, values)).tolist() == sorted(wrong.tolist())
