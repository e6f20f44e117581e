"""Corrections of more than a millimetre, which the machine file allows: written and run, or refused in plain words.

Nobody is told to look at a line of a file that was never written.
"""

from __future__ import annotations

import pytest

from ncfix.diagnostics import RefusedError
from ncfix.machine import loads
from ncfix.tables.control import Request, controls, get_control
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import export

MACHINE = """
ncfix = 1
name = "bent"
topology = "w F X Y Z t"
max_correction = { linear = 50.0, rotary = 1.0 }
axis.X = { type = "linear", direction = [1, 0, 0], range = [-200, 300] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-150, 250] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
effect = [{ name = "EXX", basis = "polynomial", degree = [1], scale = 200, coefficients = [1.2] }]
"""
SETTINGS = {
    "fanuc": {"sign": "error"},
    "fanuc-pitch": {"sign": "error"},
    "fanuc-rotary": {"sign": "error"},
    "heidenhain": {"sign": "error"},
    "heidenhain-kinematics": {"sign": "error", "angle_unit": "deg"},
    "siemens": {"value_sign": "error", "product_terms": "only"},
}
HOLD = {"fanuc-rotary", "gcode", "siemens"}
"""Those whose files may hold 1.8 mm; of the others so much is taken for a unit that was mistaken."""


@pytest.mark.parametrize("name", sorted(controls()))
def test_it_is_written_or_refused(name: str) -> None:
    machine = loads(MACHINE)
    control = get_control(name)
    request = Request(machine, ranges_of(machine), 100.0, 0.01, control.settings(SETTINGS.get(name, {})))
    if name not in HOLD:
        with pytest.raises(RefusedError) as caught:
            export(control, request, 300)
        assert {message.code for message in caught.value.messages} == {"NCF484"}
        assert not any(message.place for message in caught.value.messages)
        assert "not um" not in str(caught.value)
        return
    made = export(control, request, 300)
    assert made.left.after.max() < 0.02
    assert {message.code for message in made.messages} <= {"NCF492"}
