"""Every basis: its functions, their derivatives, end values, places of kinks; and what holds for all of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import BSpline

from ncfix.machine.basis import Backlash, Basis, ConstantBasis, Fourier, Periodic, Polynomial
from ncfix.machine.effects import kinds
from ncfix.machine.piecewise import PiecewiseConstant, PiecewiseLinear, Spline, Truncated

KNOTS = (0.0, 0.0, 0.0, 0.0, 20.0, 50.0, 60.0, 60.0, 60.0, 60.0)
EXAMPLES = [
    ConstantBasis(),
    Polynomial((0, 1, 4)),
    Polynomial((3, 1)),
    Backlash(),
    Backlash((0, 1, 2)),
    Fourier((1, 3)),
    Periodic((1, 2, 5), 17.0),
    PiecewiseLinear((0.0, 10.0, 15.0, 60.0)),
    PiecewiseLinear((0.0, 10.0, 15.0, 60.0), "negative"),
    Spline(KNOTS, 3),
    Spline((0.0, 0.0, 10.0, 60.0, 60.0), 1),
    PiecewiseConstant((10.0, 30.0)),
    PiecewiseConstant((10.0, 30.0), "positive"),
    Truncated((10.0, 20.0, 45.0)),
    Truncated((10.0, 30.5), 3, (2,), (0.0, 60.0)),
]
U = np.array([-7.0, 0.5, 9.9, 12.0, 29.0, 44.0, 59.0, 71.0])
UP = np.ones_like(U)


def test_every_builtin_kind_has_an_example() -> None:
    assert {basis.name for basis in EXAMPLES} == set(kinds())


@pytest.mark.parametrize("basis", EXAMPLES, ids=str)
def test_shapes_and_labels(basis: Basis) -> None:
    assert basis.complaints() == []
    assert len(set(basis.labels)) == basis.size
    assert basis.design(U.reshape(2, 4), 1.0).shape == (2, 4, basis.size)
    assert basis.derivative(U.reshape(2, 4), 1.0).shape == (2, 4, basis.size)
    assert basis.design(3.0).shape == (basis.size,)


@pytest.mark.parametrize("basis", EXAMPLES, ids=str)
@pytest.mark.parametrize("direction", [-1.0, 0.0, 1.0])
def test_derivatives_are_central_differences(basis: Basis, direction: float) -> None:
    step = 1e-4
    difference = (basis.design(U + step, direction) - basis.design(U - step, direction)) / (2 * step)
    scale = np.abs(basis.derivative(U, direction)).max() + 1
    np.testing.assert_allclose(basis.derivative(U, direction), difference, atol=1e-6 * scale)


@pytest.mark.parametrize("basis", EXAMPLES, ids=str)
def test_several_sums_at_once_are_the_sums(basis: Basis) -> None:
    gains = np.random.default_rng(0).normal(size=(3, basis.size))
    np.testing.assert_allclose(basis.combine(gains, U, UP), gains @ basis.rows(U, UP), rtol=1e-13)


@pytest.mark.parametrize("basis", EXAMPLES, ids=str)
def test_merging_with_itself_changes_nothing(basis: Basis) -> None:
    assert set(basis.merged(basis).labels) == set(basis.labels)
    assert basis.merged(basis).family == basis.family


def test_polynomials_and_harmonics_merge_to_the_union() -> None:
    assert Polynomial((3, 1)).merged(Polynomial((0, 3))) == Polynomial((0, 1, 3))
    assert Periodic((2,), 5.0).merged(Periodic((1,), 5.0)) == Periodic((1, 2), 5.0)
    assert Periodic((1,), 5.0).family != Periodic((1,), 6.0).family
    assert Backlash((1,)).family != Polynomial((1,)).family


def test_powers() -> None:
    np.testing.assert_allclose(Polynomial((0, 2, 5)).design(3.0), [1, 9, 243])


def test_harmonics_are_cos_and_sin_in_turn() -> None:
    np.testing.assert_allclose(Fourier((1, 2)).design(30.0), [np.sqrt(3) / 2, 0.5, 0.5, np.sqrt(3) / 2])
    np.testing.assert_allclose(Periodic((1,), 10.0).design(2.5), [0, 1], atol=1e-15)


def test_backlash_is_half_the_play_on_either_side() -> None:
    assert [float(Backlash().design(5.0, way)[0]) for way in (-1, 0, 1)] == [-0.5, 0.0, 0.5]


def test_tables_are_straight_between_and_held_outside() -> None:
    table = PiecewiseLinear((0.0, 10.0, 30.0))
    values = np.array([1.0, 3.0, -1.0])
    places = np.array([-5.0, 0.0, 2.5, 10.0, 20.0, 30.0, 99.0])
    np.testing.assert_allclose(table.design(places) @ values, np.interp(places, table.positions, values))
    assert table.kinks == table.positions


def test_splines_are_scipy_s_and_held_outside() -> None:
    spline = Spline(KNOTS, 3)
    values = np.random.default_rng(1).normal(size=spline.size)
    reference = BSpline(np.array(KNOTS), values, 3)
    np.testing.assert_allclose(spline.design(U) @ values, reference(np.clip(U, 0, 60)), atol=1e-14)


def test_cubic_splines_are_smooth_and_linear_ones_have_kinks() -> None:
    assert Spline(KNOTS, 3).kinks == ()
    assert Spline((0.0, 0.0, 10.0, 60.0, 60.0), 1).kinks == (10.0,)
    assert Spline((0.0,) * 4 + (30.0,) * 3 + (60.0,) * 4, 3).kinks == (30.0,)


def test_steps_have_the_upper_value_where_they_jump() -> None:
    step = PiecewiseConstant((10.0, 30.0))
    values = np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(step.design(np.array([9.0, 10.0, 29.0, 30.0])) @ values, [1, 2, 2, 3])


@pytest.mark.parametrize(
    "kind", [lambda way: PiecewiseConstant((10.0,), way), lambda way: PiecewiseLinear((10.0, 20.0), way)]
)
def test_what_acts_for_one_direction_is_half_there_when_the_direction_is_unknown(kind: Callable[[str], Basis]) -> None:
    for way, sign in (("positive", 1), ("negative", -1)):
        basis = kind(way)
        assert basis.needs_direction
        assert [float(basis.design(20.0, sign * d)[1]) for d in (1, 0, -1)] == [1.0, 0.5, 0.0]
    assert kind("down").complaints()[0][0] == "direction"


@pytest.mark.parametrize(
    ("basis", "feature"),
    [
        (ConstantBasis(), np.inf),
        (Polynomial((0,)), np.inf),
        (Polynomial((1, 5)), 400 / 20),
        (Fourier((1, 3)), 15.0),
        (Periodic((2,), 8.0), 0.5),
        (PiecewiseLinear((0.0, 10.0, 15.0)), 5.0),
        (Spline(KNOTS, 3), 10.0),
        (PiecewiseConstant((10.0,)), np.inf),
        (PiecewiseConstant((10.0, 13.0)), 3.0),
    ],
)
def test_feature_lengths(basis: Basis, feature: float) -> None:
    assert basis.feature(400.0) == feature


@pytest.mark.parametrize(
    ("basis", "key", "part"),
    [
        (Polynomial(()), "degree", "is empty"),
        (Polynomial((-1,)), "degree", "-1 is below 0"),
        (Polynomial((1, 1)), "degree", "twice"),
        (Fourier((0,)), "order", "0 is below 1"),
        (Periodic((1,), 0.0), "period", "not a positive length"),
        (PiecewiseLinear((1.0,)), "positions", "at least two"),
        (PiecewiseLinear((1.0, 3.0, 3.0)), "positions", "3 is followed by 3"),
        (Spline((0.0, 1.0), 0), "degree", "degree 1 or more"),
        (Spline((0.0, 1.0), 3), "knots", "needs at least 8 knots"),
        (Spline((0.0, 0.0, 2.0, 1.0, 3.0, 3.0), 1), "knots", "2 is followed by 1"),
        (Spline((0.0, 1.0, 1.0, 2.0), 1), "knots", "enclose no range"),
        (PiecewiseConstant((1.0,), "up"), "direction", "'up' is none of both, positive, negative"),
    ],
)
def test_what_cannot_be_is_complained_of(basis: Basis, key: str, part: str) -> None:
    complaints = basis.complaints()
    assert [name for name, _ in complaints] == [key]
    assert part in complaints[0][1]


def test_truncated_powers_are_once_smooth_with_one_coefficient_a_knot() -> None:
    basis = Truncated((10.0, 20.0), 2, (1, 2))
    np.testing.assert_allclose(basis.design(25.0), [25, 625, 225, 25])
    near = basis.derivative(np.array([20 - 1e-9, 20 + 1e-9]))
    np.testing.assert_allclose(near[0], near[1], atol=1e-6)
    assert basis.without_knots(np.array([True, False, True, False])) == Truncated((10.0,), 2, (1,))


def test_detrended_functions_have_neither_mean_nor_slope() -> None:
    """Soons, Eq. 3.8: the integrals of p and of p u over the travel vanish."""
    basis = Truncated((10.0, 30.0, 55.0), 2, (2, 3), (-20.0, 60.0))
    place, weight = np.polynomial.legendre.leggauss(400)
    u = 20 + 40 * place
    values = basis.design(u)
    scale = np.abs(values).max(axis=0)
    assert (np.abs(40 * weight @ values) < 1e-5 * scale * 80).all()
    assert (np.abs(40 * (weight * u) @ values) < 1e-5 * scale * 80 * 60).all()


def test_truncated_powers_say_what_is_wrong() -> None:
    assert Truncated((3.0, 1.0)).complaints()[0][0] == "knots"
    assert Truncated((3.0,), detrended=(5.0, 1.0)).complaints()[0][0] == "detrended"
    assert Truncated((9.0,), detrended=(0.0, 5.0)).complaints()[0][0] == "knots"
    assert Truncated((9.0,), degree=0).complaints()[0][0] == "degree"
