"""Sums of B-splines against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from ncfix.machine.piecewise import spline_slopes, splines


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
@pytest.mark.parametrize("inside", [[], [1.0, 2.5, 2.75], [2.0, 2.0, 3.0], [1.0] * 3])
def test_values_and_slopes(degree: int, inside: list[float]) -> None:
    inside = [knot for knot in inside if inside.count(knot) <= degree]
    knots = np.array([0.0] * (degree + 1) + inside + [4.0] * (degree + 1))
    coefficients = np.random.default_rng(degree).normal(size=(3, len(knots) - degree - 1))
    u = np.concatenate([np.linspace(0, 4, 201), inside])
    reference = BSpline(knots, coefficients.T, degree)
    assert np.allclose(splines(knots, degree, coefficients, u), reference(u).T, rtol=0, atol=1e-13)
    apart = u[~np.isin(u, inside)]
    found = spline_slopes(knots, degree, coefficients, apart)
    assert np.allclose(found, reference(apart, nu=1).T, rtol=0, atol=1e-11)
