"""Signals: units, end values, endless axes, state inputs, lags, direction, factors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from machine import chains
from ncfix.diagnostics import UsageError
from ncfix.machine import Axis, Effect, Machine, State
from ncfix.machine.basis import Backlash, Fourier, Polynomial
from ncfix.machine.piecewise import PiecewiseConstant, PiecewiseLinear, Spline
from ncfix.machine.state import lagged

MACHINE = chains.four_kinds()["w C B F X Y Z t"]
"""Columns C B X Y Z; C endless, linear axes within +-300 mm."""


def value(effect: Effect, q: np.ndarray, state: State = State()) -> np.ndarray:  # noqa: B008
    """The size of one effect at positions q (..., 5) of `MACHINE`."""
    joint = (*MACHINE.axis_names, "S").index(effect.joint)
    return MACHINE.replace(effects=(effect,)).joint_errors(q, state)[..., joint, effect.component]


def at(**positions: float | np.ndarray) -> np.ndarray:
    """Positions with the others at zero; rotary axes in degrees."""
    columns = [np.deg2rad(positions.get(n, 0.0)) if n in "BC" else positions.get(n, 0.0) for n in MACHINE.axis_names]
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def test_a_basis_sees_mm_and_degrees() -> None:
    assert value(Effect("EXX", (1.0,), Polynomial((1,)), 100.0, 50.0), at(X=250.0)) == pytest.approx(3.0)
    assert value(Effect("EZC", (1.0,), Polynomial((1,)), 90.0, 45.0), at(C=180.0)) == pytest.approx(2.0)
    assert value(Effect("EZC", (0.0, 1.0), Fourier((2,))), at(C=45.0)) == pytest.approx(1.0)


def test_end_values_are_held_outside_the_range_of_the_axis_and_of_the_effect() -> None:
    places = at(X=np.array([-500.0, -300.0, -100.0, 0.0, 200.0, 300.0, 500.0]))
    straight = Effect("EXX", (1.0,), Polynomial((1,)))
    np.testing.assert_allclose(value(straight, places), [-300, -300, -100, 0, 200, 300, 300])
    narrow = Effect("EXX", (1.0,), Polynomial((1,)), range=(0.0, 250.0))
    np.testing.assert_allclose(value(narrow, places), [0, 0, 0, 0, 200, 250, 250])


def test_an_endless_axis_comes_round_again() -> None:
    places = at(C=np.array([-350.0, 10.0, 370.0, 3610.0]))
    for effect in (
        Effect("EZC", (0.0, 1.0, 0.0), PiecewiseLinear((0.0, 90.0, 360.0))),
        Effect("EZC", (0.1, 0.2), Fourier((3,))),
        Effect("EZC", (1.0,), Polynomial((2,)), range=(0.0, 360.0)),
        Effect("EZC", (0.0, 1.0), PiecewiseConstant((5.0,)), range=(0.0, 360.0)),
    ):
        np.testing.assert_allclose(value(effect, places), value(effect, at(C=10.0)), rtol=1e-12)


def test_an_endless_axis_s_table_need_not_start_at_zero_nor_close() -> None:
    table = Effect("EZC", (1.0, 2.0), PiecewiseLinear((-90.0, 180.0)))
    np.testing.assert_allclose(
        value(table, at(C=np.array([-90.0, 180.0, 200.0, 224.0, 226.0, 270.0]))), [1, 2, 2, 2, 1, 1], atol=1e-9
    )


@pytest.mark.parametrize("turns", [0, -360, 3600])
def test_next_to_where_an_endless_axis_was_calibrated_the_nearer_end_holds(turns: int) -> None:
    """A thousandth below -30 degrees, which rounding and corrections bring, is not 30 degrees."""
    places = at(C=turns + np.array([-149.0, -30.001, -30.0 - 1e-12, -30.0, 30.0, 30.001, 149.0]))
    expected = [-1, -1, -1, -1, 1, 1, 1]
    for effect in (
        Effect("EZC", (-1.0, 1.0), PiecewiseLinear((-30.0, 30.0))),
        Effect("EZC", (1.0,), Polynomial((1,)), scale=30.0, range=(-30.0, 30.0)),
        Effect("EZC", (-1.0, 1.0), Spline((-1.0, -1.0, 1.0, 1.0), 1), scale=30.0),
    ):
        np.testing.assert_allclose(value(effect, places), expected, atol=1e-9)
        changed = MACHINE.replace(effects=(effect,))
        assert np.rad2deg(changed.breakpoints("C")).max() == pytest.approx(180.0)


def test_an_effect_may_follow_another_axis() -> None:
    sag = Effect("EZX", (2.0,), Polynomial((1,)), input="Y")
    assert value(sag, at(X=5.0, Y=7.0)) == pytest.approx(14.0)


def test_a_factor_multiplies_by_the_other_axis_s_u() -> None:
    q = at(X=40.0, Z=30.0)
    assert value(Effect("EAX", (2.0,), Polynomial((1,)), times="Z"), q) == pytest.approx(2 * 40 * 30)
    scaled = Effect("EAX", (2.0,), Polynomial((1,)), center=20.0, scale=10.0, times="Z")
    assert value(scaled, q) == pytest.approx(2 * 2.0 * 1.0), "center and scale are those of the effect"
    own = Effect("EAX", (2.0,), Polynomial((1,)), 20.0, 10.0, times="Z", times_center=0.0, times_scale=5.0)
    assert value(own, q) == pytest.approx(2 * 2.0 * 6.0)
    assert value(Effect("EAX", (2.0,), times="Z"), q) == pytest.approx(60.0), "a constant times an axis"


def test_a_factor_multiplies_a_constant_too() -> None:
    by_axis, by_input = Effect("EXX", (0.01,), times="Y"), Effect("EYX", (0.01,), times="temp_a", times_center=20.0)
    machine, state = MACHINE.replace(effects=(by_axis, by_input)), State(inputs={"temp_a": 25.0})
    q = at(Y=30.0)
    moved = machine.actual_tip(q, state) - machine.tip(q)
    np.testing.assert_allclose(moved, machine.error(q, state)[..., :3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.abs(moved), [0.3, 0.05, 0.0], rtol=0, atol=1e-9)


def test_state_inputs_and_the_tool_length_as_one() -> None:
    growth = Effect("EZS", (0.001,), Polynomial((1,)), center=20.0, input="temp_spindle")
    q = at(X=np.zeros(3))
    warm = State(inputs={"temp_spindle": np.array([20.0, 25.0, 30.0])})
    np.testing.assert_allclose(value(growth, q, warm), [0, 0.005, 0.01])
    np.testing.assert_allclose(value(growth, q, State(inputs={"temp_spindle": 30.0})), 0.01)
    droop = Effect("EAS", (1e-6,), Polynomial((1,)), input="tool_length")
    assert value(droop, at(), State(120.0)) == pytest.approx(120e-6)
    assert MACHINE.replace(effects=(growth, droop)).inputs == {"temp_spindle"}


def test_an_input_that_is_missing_is_named() -> None:
    growth = Effect("EZS", (0.001,), Polynomial((1,)), input="temp_spindle", time_constant_s=10.0)
    machine = MACHINE.replace(effects=(growth,))
    assert machine.inputs == {"temp_spindle", "time_s"}
    with pytest.raises(
        UsageError, match="NCF340: an error of the machine depends on 'temp_spindle', whose value is not given"
    ):
        machine.error(at(), State(inputs={"time_s": 0.0}))
    with pytest.raises(UsageError, match="'time_s'"):
        machine.actual_tip(at(), State(inputs={"temp_spindle": 0.0}))
    with pytest.raises(UsageError) as found:
        machine.error(at())
    assert [message.hint.split("=")[0] for message in found.value.messages] == [
        "--input temp_spindle",
        "--input time_s",
    ]


def test_direction_of_motion() -> None:
    play = Effect("EXX", (0.01,), Backlash())
    q = at(X=np.array([1.0, 2.0, 3.0]))
    assert (value(play, q) == 0).all(), "unknown"
    np.testing.assert_allclose(value(play, q, State(direction=-1)), -0.005)
    np.testing.assert_allclose(value(play, q, State(direction=[0, 0, 1, 0, 0])), 0.005)
    each = np.zeros((3, 5))
    each[:, 2] = [1, -1, 0]
    np.testing.assert_allclose(value(play, q, State(direction=each)), [0.005, -0.005, 0])


def test_play_of_one_axis_may_push_another() -> None:
    lateral = Effect("EYX", (0.01,), Backlash(), input="Z")
    assert value(lateral, at(), State(direction=[0, 0, -1, 0, 1])) == pytest.approx(0.005)


# -- lag --------------------------------------------------------------------------------------------------------------


def test_a_lag_is_the_solution_of_its_differential_equation() -> None:
    time = np.array([0.0, 10.0, 11.0, 50.0, 120.0, 121.0, 300.0])
    heat = np.array([20.0, 30.0, 30.0, 22.0, 22.0, 40.0, 41.0])
    rate = lambda t, y: (np.interp(t, time, heat) - y) / 40.0  # noqa: E731
    solution = solve_ivp(rate, (0, 300), [20.0], t_eval=time, rtol=1e-10, atol=1e-10, max_step=0.5)
    np.testing.assert_allclose(lagged(heat, time, 40.0), solution.y[0], atol=1e-6)


@given(st.lists(st.tuples(st.floats(0, 1e4), st.floats(-50, 50)), min_size=1, max_size=40), st.floats(0.1, 1e5))
def test_a_lag_stays_within_its_input_and_follows_time_not_order(samples: list, constant: float) -> None:
    time, values = np.array(samples).T
    time = np.unique(time)[: len(time)]
    values = values[: len(time)]
    after = lagged(values, time, constant)
    assert values.min() - 1e-9 <= after.min()
    assert after.max() <= values.max() + 1e-9
    mixed = np.random.default_rng(0).permutation(len(time))
    np.testing.assert_allclose(lagged(values[mixed], time[mixed], constant), after[mixed], atol=1e-9)


def test_lags_at_the_same_moment_and_of_a_single_sample() -> None:
    np.testing.assert_allclose(lagged(np.array([20.0, 30.0, 30.0]), np.array([5.0, 5.0, 5.0]), 10.0), 20.0)
    np.testing.assert_allclose(lagged(np.array(33.0), np.array(7.0), 10.0), 33.0)


def test_a_lag_in_a_machine_sees_all_poses_at_once() -> None:
    from ncfix.machine.state import CHUNK

    count = CHUNK + 10
    growth = Effect("EZS", (1.0,), Polynomial((1,)), input="temp_spindle", time_constant_s=500.0)
    time = np.linspace(0, 2000, count)
    heat = np.where(time > 300, 10.0, 0.0)
    got = value(growth, np.zeros((count, 5)), State(inputs={"temp_spindle": heat, "time_s": time}))
    np.testing.assert_allclose(got, lagged(heat, time, 500.0), atol=1e-12)
    tips = MACHINE.replace(effects=(growth,)).actual_tip(
        np.zeros((count, 5)), State(inputs={"temp_spindle": heat, "time_s": time})
    )
    np.testing.assert_allclose(tips[:, 2] - 80.0, lagged(heat, time, 500.0), atol=1e-12)


# -- how finely to look -----------------------------------------------------------------------------------------------


def test_feature_lengths_are_the_smallest_of_each_axis() -> None:
    effects = (
        Effect("EXX", (1.0,), Polynomial((3,)), scale=100.0),
        Effect("EYX", (1.0, 0.0), PiecewiseLinear((0.0, 20.0))),
        Effect("EZX", (0.0, 0.0), PiecewiseLinear((0.0, 1.0))),
        Effect("EAY", (1.0,), Polynomial((1,)), times="Z"),
        Effect("EZB", (1.0, 0.0), Fourier((3,))),
        Effect("EZS", (1.0,), Polynomial((5,)), input="temp_spindle"),
    )
    lengths = MACHINE.replace(effects=effects).feature_lengths
    np.testing.assert_allclose(lengths, [np.inf, np.deg2rad(15), 20.0, 600 / 4, 600 / 4])
    assert np.isinf(MACHINE.feature_lengths).all()


def test_an_endless_axis_has_a_turn_as_its_range() -> None:
    machine = MACHINE.replace(effects=(Effect("EZC", (1.0,), Polynomial((2,))),))
    assert machine.feature_lengths[0] == pytest.approx(2 * np.pi / 8)


def test_breakpoints_are_in_internal_units_and_sorted() -> None:
    effects = (
        Effect("EXX", (1.0, 2.0, 3.0), PiecewiseLinear((0.0, 20.0, 30.0)), center=5.0, scale=2.0),
        Effect("EYX", (1.0, 2.0), PiecewiseConstant((-7.0,))),
        Effect("EZX", (1.0,), Polynomial((1,)), range=(-100.0, 300.0)),
        Effect("EZB", (1.0, 2.0), PiecewiseLinear((0.0, 90.0))),
    )
    machine = MACHINE.replace(effects=effects)
    np.testing.assert_allclose(machine.breakpoints("X"), [-100, -7, 5, 45, 65])
    np.testing.assert_allclose(machine.breakpoints("B"), [0, np.pi / 2, 1.25 * np.pi])  # and between the turns
    assert machine.breakpoints("C").shape == (0,)


def test_a_machine_without_effects_depends_on_nothing() -> None:
    assert MACHINE.is_perfect
    assert not MACHINE.depends_on_tool_length
    assert MACHINE.inputs == frozenset()


@pytest.mark.parametrize(
    ("effect", "depends"),
    [
        (Effect("EXX", (1.0,)), False),
        (Effect("EAX", (1.0,)), True),
        (Effect("EAX", (0.0,)), False),
        (Effect("EC0Y", (1.0,)), False),
        (Effect("EA0Y", (1.0,), carried=True), True),
        (Effect("EX0C", (1.0,)), False),
        (Effect("EA0C", (1.0,)), True),
        (Effect("EX0S", (1.0,)), False),
        (Effect("EA0S", (1.0,)), True),
        (Effect("EZS", (1.0,), Polynomial((1,)), input="tool_length"), True),
    ],
)
def test_what_depends_on_the_tool_length(effect: Effect, depends: bool) -> None:
    """And it is so: the tip errors for two lengths differ, or not."""
    machine = MACHINE.replace(effects=(effect,) if not effect.active else (scaled_down(effect),))
    assert machine.depends_on_tool_length is depends
    q = at(C=30.0, B=50.0, X=10.0, Y=-20.0, Z=30.0)
    first, second = machine.error(q, State(0.0)), machine.error(q, State(100.0))
    assert bool(np.abs(first - second).max() > 1e-9) is depends


def scaled_down(effect: Effect) -> Effect:
    """One micrometre, or ten microradians."""
    from dataclasses import replace

    return replace(effect, coefficients=(1e-5 if effect.rotational else 1e-3,))


def test_ranges_and_names() -> None:
    machine = Machine("", "w F X t", (Axis("X", False, False, (1.0, 0.0, 0.0), range=(0.0, 5.0)),))
    assert machine.axis_names == ("X",)
    np.testing.assert_allclose(machine.ranges, [[0.0, 5.0]])
