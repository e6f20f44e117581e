"""Errors as curves: the values that the error model itself has there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.machine import State, loads
from ncfix.machine.effects import effect_curves, tip_curves

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
