"""Errors as curves: the values that the error model itself has there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ncfix.machine import State, load, loads
from ncfix.machine.effects import at_inputs, effect_curves, library, rest_of, tip_curves

MACHINE = """
ncfix = 1
name = "survey"
topology = "w C F X Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-100, 300] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [0, 200] }
axis.C = { type = "rotary", direction = [0, 0, -1], point = [0, 0, 0] }

[[effect]]
name = "EXX"
basis = "polynomial"
degree = [1, 2]
center = 100.0
scale = 200.0
coefficients = [0.010, 0.004]
covariance = [[1e-6, 0.0], [0.0, 4e-6]]

[[effect]]
name = "EXX"
basis = "backlash"
coefficients = [0.006]

[[effect]]
name = "EZC"
basis = "fourier"
order = [2]
coefficients = [0.002, 0.0]

[[effect]]
name = "EC0X"
coefficients = [20e-6]
"""


def test_a_curve_has_the_values_of_its_effect_and_its_band() -> None:
    machine = loads(MACHINE)
    (curve,) = effect_curves(machine, machine.effects[0])
    u = (curve.x - 100.0) / 200.0
    assert (curve.axis, curve.x[0], curve.x[-1]) == ("X", -100.0, 300.0)
    assert np.all(np.diff(curve.x) >= 0)
    assert curve.value == pytest.approx(0.010 * u + 0.004 * u**2, abs=1e-12)
    assert curve.sigma == pytest.approx(np.sqrt(1e-6 * u**2 + 4e-6 * u**4), abs=1e-12)


def test_play_has_a_curve_for_each_direction() -> None:
    machine = loads(MACHINE)
    up, down = effect_curves(machine, machine.effects[1])
    assert (up.direction, down.direction) == (1, -1)
    assert up.value == pytest.approx(0.003)
    assert down.value == pytest.approx(-0.003)


def test_an_endless_axis_is_shown_over_one_turn_and_a_constant_not_at_all() -> None:
    machine = loads(MACHINE)
    (curve,) = effect_curves(machine, machine.effects[2])
    assert (curve.x[0], curve.x[-1]) == (0.0, 360.0)
    assert effect_curves(machine, machine.effects[3]) == []


def test_drifts_are_what_the_machine_does(root: Path) -> None:
    machine = loads((root / "examples/machines/wCBXFZYSt.toml").read_text())
    found = tip_curves(machine, tool_length=50.0)
    assert [each.axis for each in found] == list(machine.axis_names)
    middle = np.array([np.mean(limits) for limits in machine.ranges])
    for index, drift in enumerate(found):
        q = np.tile(middle, (2, 1))
        q[:, index] = [limit * machine.axes[index].unit for limit in (drift.x[0], drift.x[-1])]
        error = machine.actual_tip(q, State(tool_length=50.0, direction=1)) - machine.tip(q, 50.0)
        assert drift.error[[0, -1]] == pytest.approx(error, abs=1e-12)


def test_a_machine_at_given_inputs_has_the_same_errors(root: Path) -> None:
    """Every physical effect that follows a signal: at a fixed value it is the same error without the signal."""
    start = load(root / "examples/machines/wCAYFXZSt.toml")
    effects = [effect for each in library(start).values() for effect in each.effects]
    rng = np.random.default_rng(1)
    sized = [replace(each, coefficients=tuple(1e-5 * rng.standard_normal(each.basis.size))) for each in effects]
    following = [each for each in sized if start.replace(effects=(each,)).inputs]
    assert len(following) > 10
    known = start.replace(effects=tuple(following))
    values = {name: float(20 + 5 * rng.random()) for name in sorted(known.inputs)}
    fixed = at_inputs(known, values)
    assert not fixed.inputs
    low, high = np.nan_to_num(known.ranges, posinf=3.0, neginf=-3.0).T
    q = low + (high - low) * rng.random((50, len(low)))
    way = rng.integers(-1, 2, q.shape).astype(float)
    expected = known.error(q, State(120.0, way, {name: np.full(50, value) for name, value in values.items()}))
    assert np.abs(fixed.error(q, State(120.0, way)) - expected).max() < 1e-12
    assert at_inputs(start, values) is start


def test_curves_are_drawn_where_thermal_effects_rest(root: Path) -> None:
    start = load(root / "examples/machines/three_axis.toml").replace(effects=())
    warm = start.replace(effects=library(start)["expansion-X"].effects)
    warm = warm.replace(effects=tuple(replace(each, coefficients=(1e-5,)) for each in warm.effects))
    assert rest_of(warm) == {"temp_x": 20.0}
    assert max(float(np.abs(each.error).max()) for each in tip_curves(warm)) == 0
