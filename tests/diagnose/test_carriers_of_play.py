"""Those that are named as carriers of play are those whose export takes it off, and no others."""

from __future__ import annotations

import pytest

from ncfix.diagnosis.assessment import carriers
from ncfix.machine import loads
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import export

MACHINE = """
ncfix = 1
name = "worn"
topology = "w C F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-200, 300] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-150, 250] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
axis.C = { type = "rotary", direction = [0, 0, 1], range = [-100, 120] }
"""
EFFECTS = {
    "play of X": 'name = "EXX", coefficients = [-0.006]',
    "play of X that changes along it": 'name = "EXX", degree = [0, 1], scale = 200, coefficients = [-0.006, -0.004]',
    "Y that moves as X reverses": 'name = "EYX", coefficients = [-0.006]',
    "play of C": 'name = "ECC", coefficients = [-0.00006]',
    "C that tilts as it reverses": 'name = "EAC", coefficients = [-0.00006]',
}
SETTINGS = {
    "linuxcnc": {},
    "isg": {},
    "fanuc": {"sign": "error"},
    "fanuc-rotary": {"sign": "error"},
    "fanuc-pitch": {"sign": "error"},
    "heidenhain": {"sign": "error", "backlash": "on"},
    "heidenhain-kinematics": {"sign": "error", "angle_unit": "deg", "backlash": "on"},
    "siemens": {"value_sign": "error", "product_terms": "only"},
}
TAKEN = 0.1
"""Of the error, rms, that may be left where a control is named."""


@pytest.mark.parametrize("effect", EFFECTS)
def test_it_is_so(effect: str) -> None:
    machine = loads(f'{MACHINE}effect = [{{ basis = "backlash", {EFFECTS[effect]} }}]')
    named = {name.removeprefix("export ") for name in carriers(machine, machine.effects)}
    taken = {"fix"}
    for name, settings in SETTINGS.items():
        control = get_control(name)
        request = Request(machine, ranges_of(machine), 100.0, 0.0005, control.settings(settings))
        figures = export(control, request, 500).left.figures()
        if figures["after"]["rms"] < TAKEN * figures["before"]["rms"]:
            taken.add(name)
    assert named == taken
