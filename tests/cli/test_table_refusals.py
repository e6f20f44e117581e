"""Bad input of `ncfix export` and `ncfix emulate`: what is said, and which exit code there is."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from ncfix.diagnostics import ExitCode

SIGN = ("--set", "sign=error")
SIEMENS = ("--set", "value_sign=error", "--set", "product_terms=only")
KINEMATICS = (*SIGN, "--set", "angle_unit=deg")
ROLL = '[[effect]]\nname = "EAX"\nbasis = "polynomial"\ndegree = [1]\nscale = 100\ncoefficients = [40e-6]\n'


def with_effect(shop: Any, effect: str) -> Path:
    shop.machine.write_text(shop.perfect.read_text() + effect)
    machine: Path = shop.machine
    return machine


def constant(name: str, value: float) -> str:
    return f'[[effect]]\nname = "{name}"\ncoefficients = [{value}]\n'


@pytest.mark.parametrize(
    ("control", "options", "said"),
    [
        ("linuxcnc", (), "straightness, squareness, angular errors"),
        ("fanuc-pitch", SIGN, "With tables of this kind, at least"),
        ("heidenhain", SIGN, "cannot follow angular errors"),
    ],
)
def test_a_model_that_the_format_cannot_express(
    shop: Any, ncfix: Any, control: str, options: tuple[str, ...], said: str
) -> None:
    machine = with_effect(shop, ROLL)
    result = ncfix("export", control, "-m", machine, "-o", shop.folder / "t", "--tool-length", "80", *options)
    assert result.code == ExitCode.DONE
    assert said in result.err
    assert "With tables of this kind, at least" in (shop.folder / "t" / "hand-over.md").read_text()


REFUSED = {
    "a range beyond the travel": (
        "isg",
        ("--range", "X=-1:500"),
        constant("EXX", 0.01),
        2,
        "NCF483",
        "exceeds its travel",
    ),
    "too many points": ("heidenhain", (*SIGN, "--set", "points=257"), constant("EXX", 0.01), 2, "NCF485", "256"),
    "too many tables": ("siemens", (*SIEMENS, "--set", "tables=129"), constant("EXX", 0.01), 2, "NCF485", "128"),
    "no sign": ("fanuc", (), constant("EXX", 0.01), 2, "NCF485", "needs the setting 'sign'"),
    "beyond what the machine allows": (
        "isg",
        ("--force",),
        constant("EXX", 0.7),
        4,
        "NCF489",
        "larger than this machine allows",
    ),
    "no such control": ("okuma", (), constant("EXX", 0.01), 2, "NCF480", "no tables for a control 'okuma'"),
    "not a number": ("isg", ("--tool-length", "nan"), constant("EXX", 0.01), 2, "NCF001", "not a length from 0"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals_of_export(shop: Any, ncfix: Any, case: str) -> None:
    control, options, effect, code, number, said = REFUSED[case]
    machine = with_effect(shop, effect)
    result = ncfix("export", control, "-m", machine, "-o", shop.folder / "t", *options)
    assert result.code == code, result.err
    assert number in result.err
    assert said in result.err
    assert not (shop.folder / "t").exists()


@pytest.mark.parametrize("control", ["fanuc", "heidenhain"])
def test_values_beyond_the_format(shop: Any, ncfix: Any, control: str) -> None:
    machine = with_effect(shop, constant("EXX", 15.0))
    machine.write_text("max_correction = { linear = 50, rotary = 1 }\n" + machine.read_text())
    result = ncfix("export", control, "-m", machine, "-o", shop.folder / "t", "--force", *SIGN)
    assert (result.code, "NCF484" in result.err) == (ExitCode.REFUSED, True), result.err
    assert "check that the error is in mm" in result.err


def exported(shop: Any, ncfix: Any, control: str, *options: str) -> Path:
    machine = with_effect(shop, ROLL + constant("EXX", 0.01))
    folder: Path = shop.folder / control
    assert ncfix("export", control, "-m", machine, "-o", folder, "--tool-length", "80", *options).code == ExitCode.DONE
    return folder


def edit_siemens(folder: Path) -> str:
    """One value more than MIN, MAX and STEP say, as in the thesis's Fig. 7.3."""
    file = folder / "NC_CEC.INI"
    text = file.read_text()
    file.write_text(text.replace("$AN_CEC_INPUT_AXIS[0]", "$AN_CEC[0,99]=0.0\n$AN_CEC_INPUT_AXIS[0]", 1))
    return "this one is ignored"


def edit_fanuc(folder: Path) -> str:
    file = folder / "volume.json"
    found = json.loads(file.read_text())
    found["records"][0]["data"].append(0)
    file.write_text(json.dumps(found))
    return "values, but states"


def edit_isg(folder: Path) -> str:
    file = folder / "volcomp0.csv"
    file.write_text("\n".join(file.read_text().splitlines()[:-1]) + "\n")
    return "no regular grid"


def edit_heidenhain(folder: Path) -> str:
    file = folder / "AXIS_X.COM"
    rows = file.read_text().splitlines(keepends=True)
    file.write_text("".join([*rows[:3], *rows[4:]]))
    return "1 points"  # of the two that a straight line takes


def edit_kinematics(folder: Path) -> str:
    file = folder / "kinematics.tab"
    file.write_text(file.read_text().replace("[END]\n", ""))
    return "[END] is missing"


EDITED: dict[str, tuple[Any, tuple[str, ...]]] = {
    "siemens": (edit_siemens, SIEMENS),
    "fanuc": (edit_fanuc, SIGN),
    "isg": (edit_isg, ()),
    "heidenhain": (edit_heidenhain, SIGN),
    "heidenhain-kinematics": (edit_kinematics, KINEMATICS),
}


@pytest.mark.parametrize("control", EDITED)
def test_a_hand_edited_file_with_a_wrong_count(shop: Any, ncfix: Any, control: str) -> None:
    edit, options = EDITED[control]
    folder = exported(shop, ncfix, control, *options)
    said = edit(folder)
    result = ncfix("emulate", control, folder, "-m", shop.machine)
    assert (result.code, "NCF491" in result.err) == (ExitCode.UNREADABLE, True), result.err
    assert said in result.err
    assert result.err.startswith(f"{folder}/")
    assert "Traceback" not in result.err


def test_tables_of_another_machine_and_of_another_control(shop: Any, ncfix: Any) -> None:
    folder = exported(shop, ncfix, "isg")
    other = with_effect(shop, constant("EXX", 0.02))
    result = ncfix("emulate", "isg", folder, "-m", other)
    assert (result.code, "another machine, or for other errors of it" in result.err) == (ExitCode.REFUSED, True)
    result = ncfix("emulate", "linuxcnc", folder, "-m", other)
    assert (result.code, "tables are for the control isg, not linuxcnc" in result.err) == (ExitCode.REFUSED, True)


def test_a_folder_that_is_none(shop: Any, ncfix: Any) -> None:
    result = ncfix("emulate", "isg", shop.folder / "nowhere", "-m", shop.machine)
    assert (result.code, "NCF002" in result.err) == (ExitCode.UNREADABLE, True)
    result = ncfix("emulate", "isg", shop.program, "-m", shop.machine)
    assert result.code == ExitCode.UNREADABLE


def test_tables_that_cover_less_than_the_travel_say_so(shop: Any, ncfix: Any) -> None:
    machine = with_effect(shop, ROLL)
    result = ncfix(
        "export", "isg", "-m", machine, "-o", shop.folder / "t", "--range", "X=100:200", "--tool-length", "80"
    )
    assert result.code == ExitCode.DONE
    assert "The tables cover X from 100 to 200, of a travel from 0 to 500" in result.err


def test_the_sheet_says_what_must_be_seen_at_the_machine(shop: Any, ncfix: Any) -> None:
    """Half-way to the corners the roll of X turns the tip by up to 40 urad times three quarters of the travel."""
    folder = exported(shop, ncfix, "isg")
    text = (folder / "hand-over.md").read_text()
    for said in ("Before you begin", "No axis may move by more than this", "What the control must then add"):
        assert said in text
    assert "Positions count from: machine coordinates" in text
    assert ": X -10.0 um" in text
