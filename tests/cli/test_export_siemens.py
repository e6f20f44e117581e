"""`ncfix export siemens`: what must be said, the probe that settles it, and the way there and back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from ncfix.diagnostics import ExitCode
from ncfix.tables.control import get_control
from ncfix_siemens.settings import PROBE_SHEET, PRODUCT_PROBE, SIGN_PROBE

SAID = ("--set", "value_sign=error", "--set", "product_terms=only")


def test_there_and_back(shop: Any, ncfix: Any) -> None:
    folder = shop.folder / "t"
    found = ncfix("export", "siemens", "-m", shop.machine, "-o", folder, *SAID, "--json").json()
    assert found["files"] == ["NC_CEC.INI", "hand-over.html", "hand-over.md", "ncfix-tables.json"]
    assert found["residual_um"]["after"]["max"] < 0.01  # 0.1 nm in the file, and the correction is a straight line
    assert found["limits"]["tables"] == 1
    again = ncfix("emulate", "siemens", folder, "-m", shop.machine, "--json")
    assert again.code == ExitCode.DONE
    assert again.json()["residual_um"] == found["residual_um"]


def test_what_must_be_said_is_asked_for(shop: Any, ncfix: Any) -> None:
    result = ncfix("export", "siemens", "-m", shop.machine, "-o", shop.folder / "t")
    assert (result.code, "value_sign" in result.err) == (ExitCode.USAGE, True)
    assert not (shop.folder / "t").exists()


def test_the_wrong_sign_would_double_the_error(shop: Any, ncfix: Any) -> None:
    """The sign in the file is what the control is told: turned by hand, the same tables do harm."""
    folder: Path = shop.folder / "t"
    assert ncfix("export", "siemens", "-m", shop.machine, "-o", folder, *SAID).code == ExitCode.DONE
    file = folder / "NC_CEC.INI"
    file.write_bytes(file.read_bytes().replace(b"value_sign=error", b"value_sign=correction"))
    result = ncfix("emulate", "siemens", folder, "-m", shop.machine, "--json")
    assert (result.code, "NCF488" in result.err) == (ExitCode.FINDINGS, True)
    sizes = result.json()["residual_um"]
    assert sizes["after"]["max"] == pytest.approx(2 * sizes["before"]["max"], rel=1e-3)


def test_the_probe_needs_no_settings_and_says_what_to_do(shop: Any, ncfix: Any) -> None:
    folder: Path = shop.folder / "probe"
    result = ncfix("export", "siemens", "-m", shop.machine, "-o", folder, "--probe")
    assert (result.code, result.out.decode().split()) == (
        ExitCode.DONE,
        sorted([PRODUCT_PROBE, SIGN_PROBE, PROBE_SHEET]),
    )
    assert sorted(path.name for path in folder.iterdir()) == sorted([PRODUCT_PROBE, SIGN_PROBE, PROBE_SHEET])
    sheet = (folder / PROBE_SHEET).read_text()
    for part in ("value_sign=error", "value_sign=correction", "product_terms=only", "0.32 mm", "AX1", "MD32710"):
        assert part in sheet
    control = get_control("siemens")
    for name in (SIGN_PROBE, PRODUCT_PROBE):
        remarks = control.lint({name: (folder / name).read_bytes()})
        assert all("no file states" in message.text for message in remarks)  # which is what the probe is for


def test_the_probe_as_json_with_other_axes(shop: Any, ncfix: Any) -> None:
    folder: Path = shop.folder / "probe"
    axes = "axes=X:X1,Y:Y1,Z:Z1"
    found = ncfix("export", "siemens", "-m", shop.machine, "-o", folder, "--probe", "--set", axes, "--json").json()
    assert found["files"] == sorted([PRODUCT_PROBE, SIGN_PROBE, PROBE_SHEET])
    assert b"$AN_CEC_OUTPUT_AXIS[0]=(X1)" in (folder / SIGN_PROBE).read_bytes()


def test_other_controls_have_nothing_to_probe(shop: Any, ncfix: Any) -> None:
    result = ncfix("export", "linuxcnc", "-m", shop.machine, "-o", shop.folder / "t", "--probe")
    assert (result.code, "no test on the machine" in result.err) == (ExitCode.USAGE, True)


def test_the_machine_of_the_thesis_takes_20_tables(root: Path, ncfix: Any, tmp_path: Path) -> None:
    """44 um, of which 40 tables left 9.1 there; and 8 tables of a 828D leave 2.6."""
    machine = root / "examples/siemens/tilted_ac.toml"
    common = ("-m", machine, "--tool-length", 200, *SAID, "--json")
    found = ncfix("export", "siemens", *common, "-o", tmp_path / "a", "--target-um", 0.1).json()
    assert found["residual_um"]["before"]["mean"] == pytest.approx(44, abs=1)
    assert found["residual_um"]["after"]["mean"] < 0.1
    assert found["limits"]["tables"] <= 20
    assert ncfix("emulate", "siemens", tmp_path / "a", "-m", machine).code == ExitCode.DONE
    few = ncfix("export", "siemens", *common, "-o", tmp_path / "b", "--set", "model=828D").json()
    assert few["limits"]["tables"] <= 8
    assert few["limits"]["largest"] <= 200
    assert few["residual_um"]["after"]["mean"] < 3


def test_the_sheet_has_machine_data_and_assumptions(shop: Any, ncfix: Any) -> None:
    folder: Path = shop.folder / "t"
    ncfix("export", "siemens", "-m", shop.machine, "-o", folder, *SAID)
    sheet = (folder / "hand-over.md").read_text()
    for part in ("MD18342", "MD32720 $MA_CEC_MAX_SUM, 1.5 times", "MD32710", "SD41300", "SIEMENS-1", "SIEMENS-7"):
        assert part in sheet
    side = json.loads((folder / "ncfix-tables.json").read_text())
    assert side["settings"]["product_terms"] == "only"
