"""Time constants and knots are found again from measurements that see them."""

from __future__ import annotations

import numpy as np
import pytest

from measure.poses import machine, plan
from ncfix.diagnostics import UsageError
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Polynomial
from ncfix.machine.piecewise import Truncated
from ncfix.measure.calibrate import calibrate
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import Measurement

THREE = machine("three_axis").replace(effects=())


def warmed(known: Machine, rows: int = 200) -> Measurement:
    """Poses over six hours in which the spindle runs for three; 1 um of noise."""
    time = np.linspace(0, 6 * 3600, rows)
    warm = 20 + 15 * np.where(time < 3 * 3600, 1 - np.exp(-time / 600), np.exp(-(time - 3 * 3600) / 600))
    poses = plan(known, "tcp", rows).with_columns({"time_s": time, "temp_spindle": warm}).with_header("setup", "rigid")
    return simulate(poses, known, Faults(noise_um=1.0), seed=3)


def late(constant: float, size: float = 0.003) -> Effect:
    """EZS, mm per degree, after the temperature of the spindle."""
    line = Polynomial(degree=(1,))
    return Effect("EZS", (size,), line, center=20.0, input="temp_spindle", time_constant_s=constant)


def test_a_time_constant_comes_back():
    data = warmed(THREE.replace(effects=(late(2400.0),)))
    found = calibrate([data], THREE, "spindle-growth-late", time_constants=True)
    (effect,) = found.machine.effects
    assert effect.time_constant_s == pytest.approx(2400, rel=0.02)
    assert effect.coefficients[0] == pytest.approx(0.003, rel=0.02)
    said = [str(message) for message in found.remarks if message.code == "NCF640"]
    assert len(said) == 1
    assert "EZS follows temp_spindle with a time constant of 2" in said[0]
    assert 0.8 < found.chi_square < 1.2
    # with the constant of the library, half an hour, what is left is more than noise
    assert "NCF634" in {message.code for message in calibrate([data], THREE, "spindle-growth-late").remarks}


def test_what_does_not_lag_has_no_time_constant():
    data = warmed(THREE.replace(effects=(late(2400.0),)))
    with pytest.raises(UsageError, match="none of the estimated effects has a time constant"):
        calibrate([data], THREE, "spindle-growth", time_constants=True)
    timeless = Measurement("tcp", (), {n: v for n, v in data.columns.items() if n != "time_s"}, data.labels)
    with pytest.raises(UsageError, match="there is no column time_s"):
        calibrate([timeless], THREE, "spindle-growth-late", time_constants=True)


def test_knots_that_do_not_matter_go():
    """A kinked guide: of 9 knots few stay, and the curve comes back within its noise (Soons, section 2.1)."""
    curve = Truncated((0.2, 0.6), 2, (1, 2))
    known = THREE.replace(effects=(Effect("EXX", (0.01, 0.0, -0.08, 0.2), curve, 0.0, 400.0),))
    data = simulate(plan(known, "tcp", 200), known, Faults(noise_um=0.5), seed=1)
    found = calibrate([data], THREE, "EXX,EYX", knots=9, prune=0.9999)
    by_name = {effect.name: effect for effect in found.machine.effects}
    assert "EYX" not in by_name
    basis = by_name["EXX"].basis
    assert isinstance(basis, Truncated)
    assert 1 <= len(basis.knots) <= 4
    places = np.linspace(-1, 1, 50)
    difference = (
        basis.design(places) @ by_name["EXX"].coefficients - curve.design(places) @ known.effects[0].coefficients
    )
    assert np.abs(difference - difference.mean()).max() < 1e-3


def test_straightness_has_neither_mean_nor_slope_by_construction():
    from ncfix.measure.selection import select

    chosen = {effect.name: effect.basis for effect in select(THREE, "EYX,EXX", knots=3).estimated}
    assert chosen["EYX"] == Truncated((-0.5, 0.0, 0.5), 2, (2,), (-1.0, 1.0))
    assert chosen["EXX"] == Truncated((-0.5, 0.0, 0.5), 2, (1, 2))


def test_two_thermal_states_come_back():
    """The structure follows its temperature fast one way and slowly the other (Soons, section 2.7)."""
    line = Polynomial(degree=(1,))
    states = tuple(
        Effect("EXS", (size,), line, center=20.0, input="temp_structure", time_constant_s=constant)
        for size, constant in ((0.004, 600.0), (-0.006, 6000.0))
    )
    time = np.linspace(0, 10 * 3600, 300)
    warm = 20 + 8 * ((time // 5400) % 2) + 3 * np.sin(time / 4000)
    poses = plan(THREE, "tcp", 300).with_columns({"time_s": time, "temp_structure": warm}).with_header("setup", "rigid")
    data = simulate(poses, THREE.replace(effects=states), Faults(noise_um=0.5), seed=1)
    found = calibrate([data], THREE, "warming-X", time_constants=True)
    for effect, true in zip(found.machine.effects, states, strict=True):
        assert effect.time_constant_s == pytest.approx(true.time_constant_s, rel=0.03)
        assert effect.coefficients[0] == pytest.approx(true.coefficients[0], rel=0.03)
