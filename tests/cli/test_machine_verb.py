"""`ncfix machine` and `ncfix effects`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ncfix.diagnostics import ExitCode
from ncfix.machine import load


def test_check_says_that_it_is_in_order(shop: Any, ncfix: Any) -> None:
    result = ncfix("machine", "check", shop.machine)
    assert (result.code, result.out) == (ExitCode.DONE, b"")
    assert "no faults, 3 axes, 1 effect\n" in result.err
    assert ncfix("machine", "check", shop.machine, "--json").json()["hash"] == load(shop.machine).hash


def test_check_names_every_fault_with_its_place(shop: Any, ncfix: Any) -> None:
    text = shop.machine.read_text().replace("degree", "degre").replace('name = "EXX"', 'name = "EXQ"')
    shop.machine.write_text(text)
    result = ncfix("machine", "check", shop.machine)
    assert result.code == ExitCode.UNREADABLE
    assert result.err.count(f"{shop.machine}:") >= 2
    assert "did you mean" in result.err
    assert len(ncfix("machine", "check", shop.machine, "--json").json()["errors"]) >= 2


def test_show_prints_the_chain_and_the_errors(shop: Any, ncfix: Any) -> None:
    page = ncfix("machine", "show", shop.machine).out.decode()
    assert "w F X Y Z t" in page
    assert "X  linear  0 ... 500 mm          along (1, 0, 0)" in page
    assert "positioning of X" in page
    assert "+0 ... +50 um" in page
    assert "no errors" in ncfix("machine", "show", shop.perfect).out.decode()


def test_show_as_json(shop: Any, ncfix: Any) -> None:
    found = ncfix("machine", "show", shop.machine, "--json").json()
    assert [axis["name"] for axis in found["axes"]] == ["X", "Y", "Z"]
    (effect,) = found["effects"]
    assert (effect["name"], effect["unit"], effect["range"]) == ("EXX", "um", [0.0, pytest.approx(50.0)])


def test_a_machine_from_standard_input(shop: Any, ncfix: Any) -> None:
    assert ncfix("machine", "check", "-", stdin=shop.machine.read_bytes()).code == ExitCode.DONE
    result = ncfix("machine", "check", "-", stdin=b"nonsense")
    assert result.code == ExitCode.UNREADABLE
    assert "<stdin>" in result.err


def test_every_shipped_machine_is_shown(examples: Path, ncfix: Any) -> None:
    machines = sorted((examples / "machines").glob("*.toml"))
    assert len(machines) >= 4
    for path in machines:
        page = ncfix("machine", "show", path).out.decode()
        assert load(path).name in page
        assert "errors of " in page


def test_effects_lists_the_iso_names(ncfix: Any) -> None:
    names = {entry["name"]: entry for entry in ncfix("effects", "--json").json()["effects"]}
    assert {"EXX", "EC0Y", "EA0C", "EZS"} <= names.keys()
    assert names["EC0Y"]["squareness"] == "+X to +Y is 90 deg + EC0Y"
    assert "straightness of X in Y" in ncfix("effects").out.decode()


def test_bases_lists_all_kinds_with_their_keys(ncfix: Any) -> None:
    bases = {entry["name"]: entry for entry in ncfix("effects", "--bases", "--json").json()["bases"]}
    assert {"constant", "polynomial", "fourier", "spline", "table", "periodic", "backlash", "step"} <= bases.keys()
    assert bases["spline"]["keys"] == "knots, degree"


def test_dialects_and_plugins_are_listed(ncfix: Any) -> None:
    assert {"iso", "linuxcnc"} <= {entry["name"] for entry in ncfix("dialects", "--json").json()["dialects"]}
    assert "linuxcnc" in ncfix("dialects").out.decode()
    assert "linuxcnc" in ncfix("plugins").out.decode()


def test_a_control_that_nobody_knows_is_remarked_on(shop: Any, ncfix: Any) -> None:
    shop.machine.write_text('control = "simens"\n' + shop.machine.read_text())
    result = ncfix("machine", "check", shop.machine, "--json")
    assert result.code == 0
    *_, remark = result.json()["remarks"]
    assert (remark["code"], "siemens" in remark["hint"]) == ("NCF318", True)


@pytest.mark.parametrize(("effect", "remarked"), [("EYY", [0.006]), ("EXX", [-0.006])])
def test_play_with_the_sign_of_too_much_compensation_is_remarked_on(
    root: Path, ncfix: Any, tmp_path: Path, effect: str, remarked: list[float]
) -> None:
    """Y moves the tool towards plus as its number grows, X the workpiece towards minus."""
    file = tmp_path / "machine.toml"
    text = (root / "examples/stories/worn_table/machine.toml").read_text()
    for size in (0.006, -0.006):
        file.write_text(f'{text}\n[[effect]]\nname = "{effect}"\nbasis = "backlash"\ncoefficients = [{size}]\n')
        said = [remark["code"] for remark in ncfix("machine", "check", file, "--json").json()["remarks"]]
        assert said == ["NCF319"] * (size in remarked)
