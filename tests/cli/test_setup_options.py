"""What options say about the setup."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner

from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.control.setup import Setup, Tool


def given(*arguments: str) -> SetupOptions:
    """What a verb with the setup options gets."""
    found: list[SetupOptions] = []

    @click.command()
    @setup_options
    def verb(given: SetupOptions) -> None:
        found.append(given)

    result = CliRunner().invoke(verb, arguments)
    if result.exit_code:
        raise click.UsageError(result.output)
    return found[0]


def test_nothing_said_is_an_empty_setup() -> None:
    assert given().load() == Setup()


@pytest.mark.parametrize(
    ("option", "offsets"),
    [
        ("G54=0,0,-300", {"G54": {"X": 0.0, "Y": 0.0, "Z": -300.0}}),
        ("g55=1", {"G55": {"X": 1.0}}),
        ("G54.1P2=1", {"G54.1P2": {"X": 1.0}}),
        ("g54.1 P2 =1", {"G54.1P2": {"X": 1.0}}),
        ("G59.3=1,2,3,4,5,6", {"G59.3": dict(zip("XYZABC", (1.0, 2.0, 3.0, 4.0, 5.0, 6.0), strict=True))}),
        ("G54=Z-300, b45", {"G54": {"Z": -300.0, "B": 45.0}}),
    ],
)
def test_offsets(option: str, offsets: dict[str, dict[str, float]]) -> None:
    assert given("--offset", option).load().work_offsets == offsets


def test_tools_and_start() -> None:
    setup = given("--tool", "12=120.0", "--tool", "3=80.0,5", "--initial", "X=0,z=300", "--assume-zero").load()
    assert setup.tools == {12: Tool(120.0), 3: Tool(80.0, 5.0)}
    assert setup.initial == {"X": 0.0, "Z": 300.0}
    assert setup.assume_zero


def test_start_positions_may_be_given_one_by_one_as_messages_ask_for_them() -> None:
    setup = given("--initial", "X=1", "--initial", "A=2,C=3", "--initial", "X=4").load()
    assert setup.initial == {"X": 4.0, "A": 2.0, "C": 3.0}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--offset", "G54"], "no ="),
        (["--offset", "54=1,2,3"], "not a work offset"),
        (["--offset", "G54=1,2,3,4,5,6,7,8,9,10"], "at most 9"),
        (["--offset", "G54=1;2"], "1;2"),
        (["--offset", "G54="], "G54="),
        (["--offset", "G54=nan"], "'nan' is not a number"),
        (["--tool", "T12=3"], "neither a tool number"),
        (["--tool", "12=1,2,3"], "a length"),
        (["--tool", "12=120,5"], "decimal comma: 120.5 is a length, 120.0,5.0 a length and a radius"),
        (["--tool", "12=inf"], "'inf' is not a number"),
        (["--initial", "X0"], "not an axis and a number"),
        (["--initial", "XY=0"], "not an axis and a number"),
        (["--initial", "X=1,5"], "not an axis and a number"),
        (["--initial", "X=1,X=2"], "axis X is given twice"),
        (["--offset", "G54=X1,Z2,X3"], "an axis is named twice"),
    ],
)
def test_what_is_wrong_is_said(arguments: list[str], said: str) -> None:
    with pytest.raises(click.UsageError, match=said):
        given(*arguments)


def test_options_win_over_the_file(tmp_path: Path) -> None:
    file = tmp_path / "setup.toml"
    file.write_text(
        "tools.1 = { length = 50.0 }\ntools.2 = { length = 60.0 }\n[work_offsets]\nG54 = [1, 2, 3]\nG55 = [4, 5, 6]\n"
    )
    setup = given("--setup", str(file), "--tool", "2=70", "--offset", "G54=9").load()
    assert {number: tool.length for number, tool in setup.tools.items()} == {1: 50.0, 2: 70.0}
    assert setup.work_offsets["G54"] == {"X": 9.0}
    assert setup.work_offsets["G55"] == {"X": 4.0, "Y": 5.0, "Z": 6.0}


@pytest.mark.parametrize("option", ["--setup", "--tool-table"])
def test_a_file_that_is_not_there(ncfix: Any, option: str, tmp_path: Path) -> None:
    (tmp_path / "part.ngc").write_text("G1 X1 F100\nM2\n")
    result = ncfix("check", tmp_path / "part.ngc", option, tmp_path / "nosuch")
    assert result.code == 3
    assert "nosuch" in result.err


def test_tools_of_a_table_whose_lengths_are_not_what_they_seem(ncfix: Any, tmp_path: Path, root: Path) -> None:
    """One that may be in inches is remarked on; a tool beside the spindle axis has no length that is known."""
    part, table = tmp_path / "part.ngc", tmp_path / "tools.tbl"
    part.write_text("G21 G90 G54\nT1 M6\nG43 H1\nG0 X0 Y0 Z0\nG1 X5 F100\nM2\n")
    machine = root / "examples/machines/three_axis.toml"
    command = ("check", part, "-m", machine, "--dialect", "linuxcnc", "--offset", "G54=0,0,200", "--tool-table", table)
    table.write_text("T1 P1 Z3.5 D0.25 U1 ; mill\nT2 P2 Z4\n")
    assert "NCF386: no tool is longer than 4 mm: is the table in inches?" in ncfix(*command).err
    table.write_text("T1 P1 X2 Z100\n")
    found = ncfix(*command).err
    assert "NCF202: length of tool 1, which the tool table has at X2 as well, is used but not given" in found
