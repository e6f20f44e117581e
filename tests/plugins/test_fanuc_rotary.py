"""Fanuc's grid with angles: records, any tool length, and broken files."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from ncfix.diagnostics import ConfigError, RefusedError
from ncfix.machine import Effect, Tool
from ncfix.tables.control import Request, get_control
from ncfix.tables.export import export
from ncfix.tables.poses import ranges_of
from ncfix.tables.residual import residual
from ncfix.testing import check_control, single_error

CONTROL = get_control("fanuc-rotary")
SETTINGS = CONTROL.settings({"sign": "correction"})


def test_the_contract() -> None:
    check_control(CONTROL, {"sign": "error"})


def test_golden_record() -> None:
    """The spindle is tilted by 20 um/m about X: -1.146 thousandths of a degree, eleven units, at every point."""
    machine = single_error("EXX").replace(effects=(Effect("EA0S", (20e-6,)),))
    made = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, SETTINGS), 100)
    found = json.loads(made.native["rotary.json"])
    assert found["counts"] == [2, 2, 2]
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
    machine = single_error("EXX").replace(tool=Tool((1.0, 0.0, 0.0)))
    with pytest.raises(RefusedError, match="not along Z"):
        CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.001, SETTINGS))


def damaged(change: Callable[[dict[str, Any]], object]) -> dict[str, bytes]:
    machine = single_error("EXX").replace(effects=(Effect("EXX", (0.01,)),))
    files = CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.001, SETTINGS)).files
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
