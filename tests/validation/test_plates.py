"""Real plates: holes drilled by a three-axis mill and measured on a CMM; what plain least squares say about them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ncfix.machine import Effect, Machine, load
from ncfix.machine.basis import Polynomial
from ncfix.measure.calibrate import calibrate
from ncfix.measure.estimate import Problem
from ncfix.measure.least_squares import orthonormal, without
from ncfix.measure.measurement import Measurement
from ncfix.measure.reader import read
from ncfix.measure.selection import Selection

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "machines"
# rms of both components in um: set-up only; with a scale difference and shear as well
PRINTED = {"D2130A1": (5.4, 4.1), "D1396A1": (4.5, 4.5), "D1597A_orig_meas_2003": (6.4, 5.7), "D8131_1": (5.9, 5.0)}


def wide() -> Machine:
    """The three-axis machine with travels as wide as the plates, without errors."""
    known = load(str(EXAMPLES / "three_axis.toml"))
    return known.replace(effects=(), axes=tuple(replace(axis, range=(-500.0, 500.0)) for axis in known.axes))


def affine(machine: Machine) -> Selection:
    """Both scales and the squareness."""
    line = Polynomial(degree=(1,))
    effects = (Effect("EC0Y", (0.0,)), Effect("EXX", (0.0,), line), Effect("EYY", (0.0,), line))
    return Selection(effects, (True,) * 3)


def rms_um(measurement: Measurement, machine: Machine, selection: Selection) -> tuple[float, float]:
    """About the set-up alone, and about set-up and selection."""
    problem = Problem.of([measurement], machine, selection)
    basis = orthonormal(problem.nuisance(problem.start))
    alone = without(basis, problem.values)
    whole = orthonormal(np.concatenate([problem.nuisance(problem.start), problem.design], axis=1))
    return tuple(float(1e3 * np.sqrt((left**2).mean())) for left in (alone, without(whole, problem.values)))


@pytest.mark.parametrize("name", PRINTED)
def test_the_plates_say_what_plain_least_squares_say(shared, name):
    machine = wide()
    found = read(str(shared("measurements") / f"{name}.csv"), machine)
    assert rms_um(found, machine, affine(machine)) == pytest.approx(PRINTED[name], abs=0.06)


def test_a_calibration_of_a_plate_finds_its_scale(shared):
    machine = wide()
    data = read(str(shared("measurements") / "D2130A1.csv"), machine)
    found = calibrate([data], machine, affine(machine), loss="none")
    assert found.after_um == pytest.approx(4.1, abs=0.06)
    scale = dict(zip(found.labels, found.estimate.coefficients, strict=True))
    # of either sign here: the tables of this machine move against the tool
    mean = (abs(scale["EXX u^1"]) + abs(scale["EYY u^1"])) / 2
    assert mean == pytest.approx(25e-6, rel=0.25)
