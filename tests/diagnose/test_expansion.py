"""Forms of effects as columns of the data."""

from __future__ import annotations

import numpy as np

from ncfix.diagnosis.forms import HOLD_POINTS, HOLD_SPREAD, expansion_loadings


def test_what_grows_moves_all_ways_by_one_course() -> None:
    """Variances: the growth's own, and of each shift the same course times the place, and a course of its own."""
    course = np.array([[2.0, 0.0], [1.0, 0.5]])
    forms = list(expansion_loadings([course]))
    assert len(forms) == len(HOLD_POINTS)
    for form, place in zip(forms, HOLD_POINTS, strict=True):
        covariance, own = form @ form.T, course @ course.T
        assert np.allclose(covariance[:2, :2], own)
        for k, where in enumerate(place, 1):
            shift = slice(2 * k, 2 * k + 2)
            assert np.allclose(covariance[shift, :2], where * own)
            assert np.allclose(covariance[shift, shift], (where**2 + HOLD_SPREAD**2) * own)


def test_on_average_it_is_held_anywhere_within_its_size() -> None:
    """A place drawn evenly from -1 ... 1 has a variance of a third."""
    assert np.allclose(np.mean(np.square(HOLD_POINTS), axis=0) + HOLD_SPREAD**2, 1 / 3)
