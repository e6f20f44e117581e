"""Physical effects by name are found again from measurements that see them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from measure.poses import machine, plan
from ncfix.machine import GaugeLine, dumps, loads
from ncfix.machine.effects import library
from ncfix.measure.calibrate import calibrate
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.selection import select

THREE = machine("three_axis").replace(effects=())
NAMES = (
    "backlash-X",
    "wind-up-Y",
    "screw-Z",
    "expansion-X",
    "spindle-growth",
    "spindle-growth-late",
    "drift-Y",
    "load-X",
    "worn-Y",
    "moment-X",
    "weight-EAY-X",
    "warming-Z",
)


def test_names_are_of_the_machine():
    five = library(machine("wCBXFZYSt"))
    assert "backlash-B" in five
    assert "weight-EAZ-Y" in five  # Z carries Y
    assert "weight-EAY-Z" not in five
    assert all(not effect.active for each in five.values() for effect in each.effects)


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_comes_back(name):
    named = library(THREE)[name]
    random = np.random.default_rng(5)
    poses = plan(THREE, "tcp", 200)
    state = {column: random.uniform(20, 35, 200) for column in ("temp_x", "temp_spindle")}
    state |= {"time_s": np.sort(random.uniform(0, 2e4, 200)), "load_kg": random.uniform(0, 300, 200)}
    state |= {"load_kgm": random.uniform(0, 100, 200), "temp_structure": random.uniform(20, 30, 200)}
    size = 1e-3 if not named.effects[0].rotational else 1e-7
    known = THREE.replace(effects=tuple(replace(e, coefficients=(size,) * e.basis.size) for e in named.effects))
    data = simulate(poses.with_columns(state), known, Faults(noise_um=0.5), seed=2).with_header("setup", "rigid")
    found = calibrate([data], THREE.replace(effects=named.effects))
    told = np.isfinite(found.sigma)
    assert told.any()
    start = known.replace(effects=tuple(_held(e, told, named.effects) for e in known.effects))
    again = calibrate([data], start)
    error = (again.estimate.coefficients - size)[told] / again.sigma[told]
    assert np.abs(error).max() < 4.5


def _held(effect, told, effects):
    """The effect at zero where it can be told, and at its true value where it cannot."""
    first = sum(each.basis.size for each in effects[: [each.name for each in effects].index(effect.name)])
    kept = told[first : first + effect.basis.size]
    values = tuple(0.0 if known else value for value, known in zip(effect.coefficients, kept, strict=True))
    return replace(effect, coefficients=values)


def test_they_are_selected_by_name_and_survive_the_file():
    chosen = select(THREE, "EC0Y,spindle-growth-late,weight-EAY-X")
    assert [effect.name for effect in chosen.estimated] == ["EZS", "EAY", "EC0Y"]
    known = chosen.machine(THREE, [1e-3, 1e-6, 2e-6, 1e-5])
    assert loads(dumps(known)).effects == known.effects


@pytest.mark.parametrize(("way", "names"), [((0, 0, 1), "XYAB"), ((0, -1, 0), "XZAC"), ((1, 0, 0), "YZBC")])
def test_the_spindle_is_off_and_tilted_across_itself(way, names):
    """Along it an offset is the length of the tool, and a turn is nothing."""
    lying = THREE.replace(tool=GaugeLine(tuple(map(float, way)), (0.0, 0.0, 0.0)))
    chosen = [effect.name for effect in select(lying, "E?0S").estimated]
    assert chosen == [f"E{name}0S" for name in names]
