"""Fanuc's grid with angles: records, any tool length, and broken files."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from ncfix.diagnostics import ConfigError, RefusedError
from ncfix.machine import Effect, GaugeLine, loads
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import ranges_of, residual
from ncfix.tables.export import export
from ncfix.testing import check_control, single_error

CONTROL = get_control("fanuc-rotary")
SETTINGS = CONTROL.settings({"sign": "correction"})
CORNER = CONTROL.settings({"sign": "correction", "reference": "X-200,Y-150,Z-300"})
"""With the reference position at the lowest corner of the travel, so that two points an axis will do."""


def test_the_contract() -> None:
    check_control(CONTROL, {"sign": "error"})


def test_golden_record() -> None:
    """The spindle is tilted by 20 um/m about X: -1.146 thousandths of a degree, eleven units, at every point."""
    machine = single_error("EXX").replace(effects=(Effect("EA0S", (20e-6,)),))
    made = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, CORNER), 100)
    found = json.loads(made.native["rotary.json"])
    assert found["counts"] == [2, 2, 2]
    assert (found["reference_mm"], found["reference_points"]) == ([-200.0, -150.0, -300.0], [1, 1, 1])
    assert found["records"][0] == {"no": 1, "lin": [0, 0, 0], "rot": [-11, 0, 0]}


@pytest.mark.parametrize("length", [0.0, 80.0, 250.0])
def test_one_grid_holds_for_tools_of_any_length(length: float) -> None:
    machine = single_error("EAX", 40e-6)
    space = ranges_of(machine)
    tables = CONTROL.read(CONTROL.write(Request(machine, space, 100.0, 0.001, SETTINGS)).files)
    left = residual(machine, tables, space, length, 300)
    assert left.after.max() < 0.002  # the target, and 0.9 urad of rounding at 250 mm
    assert left.before.max() > 0.008


def test_a_tool_that_is_not_along_z_is_refused() -> None:
    machine = single_error("EXX").replace(tool=GaugeLine((1.0, 0.0, 0.0)))
    with pytest.raises(RefusedError, match="not along Z"):
        CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.001, SETTINGS))


TABLE = """
ncfix = 1
name = "table"
topology = "w C A F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-200, 300] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-150, 250] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
axis.A = { type = "rotary", direction = [-1, 0, 0], point = [0, 0, -350], range = [-60, 90] }
axis.C = { type = "rotary", direction = [0, 0, -1], point = [0, 0, -350], range = [0, 120] }
effect = [{ name = "EBC", coefficients = [50e-6] }, { name = "EXA", coefficients = [0.02] }]
"""


@pytest.mark.parametrize("length", [0.0, 250.0])
@pytest.mark.parametrize("sign", ["correction", "error"])
def test_a_lattice_over_the_rotary_axes_takes_off_what_a_table_is_wrong_by(length: float, sign: str) -> None:
    """EBC, a tilt that turns with C on a table that tilts, moves the tip by 50 urad times up to half a metre."""
    machine = loads(TABLE)
    space = ranges_of(machine)
    options = CONTROL.settings({"sign": sign})
    files = CONTROL.write(Request(machine, space, 100.0, 0.001, options)).files
    assert set(files) == {"rotary.json", "rotary-axes.json"}
    assert not CONTROL.lint(files)
    left = residual(machine, CONTROL.read(files), space, length, 2000)
    assert left.before.max() > 0.03
    assert left.after.max() < 0.0015  # the target, and 0.9 urad of rounding at half a metre


def test_golden_record_of_a_table() -> None:
    """The table stands 0.02 mm too far in X at any angle: at rest the first lattice has it, and the second nothing."""
    machine = loads(TABLE).replace(effects=(Effect("EXA", (0.02,)),))
    made = CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.001, SETTINGS)).files
    assert set(made) == {"rotary.json"}
    assert json.loads(made["rotary.json"])["records"][0] == {"no": 1, "lin": [100, 0, 0], "rot": [0, 0, 0]}
    turned = loads(TABLE).replace(effects=(Effect("EZC", (0.01,)),))
    second = json.loads(
        CONTROL.write(Request(turned, ranges_of(turned), 0.0, 0.0005, SETTINGS)).files["rotary-axes.json"]
    )
    assert (second["axes"], second["centre_mm"]) == (["A"], [0.0, 0.0, -350.0])
    (first,), (step,), (point,) = (second[key] for key in ("first_deg", "interval_deg", "reference_points"))
    assert first + (point - 1) * step == 0  # A at its reference position
    assert first <= -60 < first + step
    assert first + (second["counts"][0] - 1) * step == 90
    at_90 = second["records"][-1]
    assert at_90["rot"] == [0, 0, 0]
    assert [abs(value) * second["magnification"] for value in at_90["lin"]] == pytest.approx([0, 100, 100], abs=2)


def test_without_the_second_lattice_it_is_said_that_more_is_left() -> None:
    machine = loads(TABLE)
    made = CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.001, {**SETTINGS, "rotary": "no"}))
    assert set(made.files) == {"rotary.json"}
    assert any("at zero; at other angles the remaining error is larger" in note for note in made.notes)


BROKEN_TABLES: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "another sign": (lambda found: found.update(sign="error"), "differs from that of rotary.json"),
    "no centre": (lambda found: found.update(centre_mm=[0, 0]), "not 3 numbers"),
    "a linear axis": (lambda found: found.update(axes=["A", "X"]), "the axes are ['A', 'X']"),
    "no interval": (lambda found: found.update(interval_deg=[0]), "interval_deg is 0, not a number"),
    "a record gone": (lambda found: found["records"].pop(), "expected of"),
}


@pytest.mark.parametrize("case", BROKEN_TABLES)
def test_broken_second_lattices(case: str) -> None:
    change, expected = BROKEN_TABLES[case]
    machine = loads(TABLE)
    files = dict(CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.01, SETTINGS)).files)
    found = json.loads(files["rotary-axes.json"])
    change(found)
    files["rotary-axes.json"] = json.dumps(found).encode()
    assert any(expected in message.text for message in CONTROL.lint(files)), CONTROL.lint(files)
    with pytest.raises(ConfigError):
        CONTROL.read(files)


def damaged(change: Callable[[dict[str, Any]], object]) -> dict[str, bytes]:
    machine = single_error("EXX").replace(effects=(Effect("EXX", (0.01,)),))
    files = CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.001, CORNER)).files
    found = json.loads(files["rotary.json"])
    change(found)
    return {"rotary.json": json.dumps(found).encode()}


BROKEN: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "a record gone": (lambda found: found["records"].pop(), "7 records, 8 expected"),
    "a number twice": (lambda found: found["records"][1].update(no=1), "not numbered 1, 2, 3"),
    "two lengths": (lambda found: found["records"][1]["lin"].pop(), "three lengths and three angles"),
    "too large": (lambda found: found["records"][1].update(rot=[128, 0, 0]), "beyond -127 to 127"),
    "too many points": (lambda found: found.update(counts=[26, 2, 2]), "2 to 25 points"),
    "no sign": (lambda found: found.update(sign="plus"), "the sign is"),
    "a key gone": (lambda found: found.pop("angle_magnification"), "angle_magnification"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files(case: str) -> None:
    change, expected = BROKEN[case]
    files = damaged(change)
    assert any(expected in message.text for message in CONTROL.lint(files)), CONTROL.lint(files)
    with pytest.raises(ConfigError):
        CONTROL.read(files)
