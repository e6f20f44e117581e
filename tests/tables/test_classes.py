"""The class on the sheet is that of what was written, not of what a control could hold."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from conftest import FULL
from ncfix.machine import load, loads
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import emulate, export

CASES = {
    "linuxcnc": ("three_axis", {}, "L-POS"),
    "fanuc-pitch": ("three_axis", {"sign": "error"}, "L-POS"),
    "fanuc": ("three_axis", {"sign": "error"}, "L-VOL"),
    "fanuc-rotary": ("three_axis", {"sign": "error"}, "L-VOL"),
    "heidenhain": ("three_axis", {"sign": "error"}, "L-POS, L-STR, L-SQR and part of L-ANG"),
    "heidenhain-kinematics": ("three_axis", {"sign": "error", "angle_unit": "deg"}, "L-VOL"),
    "isg": ("three_axis", {}, "L-VOL"),
    "siemens": ("three_axis", {"value_sign": "error", "product_terms": "only"}, "L-VOL"),
    "gcode": ("three_axis", {}, "L-VOL"),
}
WITH_A_TABLE = {
    "linuxcnc": ({}, "L-POS and R-RAX"),
    "fanuc-rotary": ({"sign": "error"}, "L-VOL, and the position part of R-VOL of tables"),
    "heidenhain-kinematics": ({"sign": "error", "angle_unit": "deg"}, "L-VOL, and the position part of R-VOL"),
    "isg": ({}, "L-VOL and the position part of R-VOL"),
    "siemens": ({"value_sign": "error", "product_terms": "only"}, "L-VOL, part of R-VOL and R-RAX"),
    "gcode": ({}, "L-VOL+, R-VOL+"),
}


def made(root: Path, name: str, machine: str, settings: dict[str, str]) -> tuple[str, str]:
    """The class of an export, in words and on its sheet."""
    control = get_control(name)
    chosen = load(str(root / "examples" / "machines" / f"{machine}.toml"))
    request = Request(
        chosen, ranges_of(chosen), 120.0, 0.002 if machine == "three_axis" else 0.02, control.settings(settings)
    )
    found = export(control, request, 200)
    again = emulate(control, found.files, chosen, "folder", poses=200)
    assert again.reaches == found.reaches
    assert again.notes == found.notes
    assert (again.least is None) == (found.least is None)
    if again.least is not None and found.least is not None:
        assert again.least.value == pytest.approx(found.least.value)
    return found.reaches, found.files["hand-over.md"].decode()


@pytest.mark.parametrize("name", CASES)
def test_of_three_axes(root: Path, name: str) -> None:
    machine, settings, expected = CASES[name]
    reaches, sheet = made(root, name, machine, settings)
    assert reaches == expected
    assert f"Class (ISO/TR 16907): {expected}. " in sheet
    assert "R-VOL:" not in sheet


@pytest.mark.parametrize("name", WITH_A_TABLE)
def test_of_five_axes(root: Path, name: str) -> None:
    settings, expected = WITH_A_TABLE[name]
    assert made(root, name, "wCAYFXZSt", settings)[0] == expected


def test_two_tables_of_a_small_control_are_no_volume(root: Path) -> None:
    settings = {"value_sign": "error", "product_terms": "only", "model": "802D"}
    for machine in ("three_axis", "wCAYFXZSt") if FULL else ("three_axis",):
        reaches, sheet = made(root, "siemens", machine, settings)
        assert "L-VOL" not in reaches
        assert "L-VOL:" not in sheet


def test_one_error_of_one_axis_is_l_pos() -> None:
    """Whatever the control could hold: sums of one-axis tables, and pairs of them."""
    text = """
ncfix = 1
name = "one"
topology = "w F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-200, 300] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-150, 250] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
effect = [{ name = "EXX", basis = "polynomial", degree = [1, 2], scale = 200, coefficients = [0.02, 0.01] }]
"""
    machine = loads(text)
    for name, settings in {"heidenhain": {"sign": "error"}, "siemens": {"value_sign": "error"}}.items():
        control = get_control(name)
        request = Request(machine, ranges_of(machine), 0.0, 0.001, control.settings(settings))
        assert export(control, request, 100).reaches == "L-POS"


def test_emulate_says_in_json_what_export_says(root: Path, tmp_path: Path) -> None:
    from click.testing import CliRunner

    from ncfix.cli.main import cli

    machine = str(root / "examples" / "machines" / "three_axis.toml")
    out = str(tmp_path / "tables")
    arguments = ["-m", machine, "--json"]
    told = [
        json.loads(CliRunner().invoke(cli, line, standalone_mode=False).stdout)
        for line in (
            ["export", "fanuc", "-o", out, "--set", "sign=error", *arguments],
            ["emulate", "fanuc", out, *arguments],
        )
    ]
    assert told[0].keys() == told[1].keys()
    assert {key for key in told[0] if told[0][key] != told[1][key]} == set()
