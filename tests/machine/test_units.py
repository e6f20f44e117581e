"""Coefficients are said in the units that people use."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.machine import Effect, State, load
from ncfix.machine.basis import Backlash, Polynomial
from ncfix.machine.effects import library, units

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "machines"
THREE, FIVE = (load(str(EXAMPLES / f"{name}.toml")) for name in ("three_axis", "wCBXFZYSt"))

GAIN = Polynomial(degree=(1,))


def only(effect: Effect, machine=FIVE) -> tuple[float, str]:
    [found] = units(machine, effect)
    return found


def test_a_gain_per_mm_is_said_in_um_per_m():
    factor, unit = only(Effect("EXX", (-17e-6,), GAIN))
    assert (factor * -17e-6, unit) == (pytest.approx(-17.0), "um/m")


def test_a_gain_over_half_the_travel_is_what_it_is_at_its_end():
    assert only(Effect("EXX", (0.005,), GAIN, center=250.0, scale=250.0)) == (1e3, "um")


@pytest.mark.parametrize(
    ("effect", "value", "said"),
    [
        (Effect("EC0Y", (12e-6,)), 12e-6, (12.0, "urad")),
        (Effect("EAX", (2e-8,), GAIN), 2e-8, (20.0, "urad/m")),
        (Effect("EYX", (1e-8,), Polynomial(degree=(2,))), 1e-8, (10.0, "um/m^2")),
        (Effect("ECC", (1e-7,), GAIN), 1e-7, (0.1, "urad/deg")),
        (Effect("EZZ", (0.015,), Backlash()), 0.015, (15.0, "um")),
        (Effect("EZS", (0.002,), GAIN, center=20.0, input="temp_spindle"), 0.002, (2.0, "um/K")),
        (Effect("EXS", (0.003,), GAIN, scale=3600.0, input="time_s"), 0.003, (3.0, "um/h")),
        (Effect("EXS", (1e-6,), GAIN, input="time_s"), 1e-6, (3.6, "um/h")),
        (Effect("EXS", (0.003,), GAIN, input="humidity"), 0.003, (3.0, "um")),
        (Effect("EXX", (1e-5,), GAIN, times="temp_x", times_scale=1.0), 1e-5, (10.0, "um/(m K)")),
    ],
)
def test_units_of_what_is_counted(effect, value, said):
    factor, unit = only(effect)
    assert (pytest.approx(factor * value), unit) == said


def test_physical_effects_have_units_of_their_physics():
    named = library(THREE)
    said = {name: units(THREE, named[name].effects[0])[0][1] for name in ("backlash-X", "expansion-X", "drift-Z")}
    assert said == {"backlash-X": "um", "expansion-X": "um/K", "drift-Z": "um/h"}
    assert [unit for _, unit in units(THREE, named["worn-X"].effects[0])] == ["um"] * 3


def test_the_unit_is_that_of_the_error():
    """100 mm on, a gain in um/m has added a tenth of it, in um."""
    effect = Effect("EXX", (-129e-6,), GAIN)
    machine = THREE.replace(effects=(effect,))
    [(factor, _)] = units(machine, effect)
    q = np.zeros((2, 3))
    q[1, machine.axis_names.index("X")] = 100.0
    first, last = machine.joint_errors(q, State())[:, machine.axis_names.index("X"), 0]
    assert 1e3 * (last - first) == pytest.approx(0.1 * factor * -129e-6)
