"""Heidenhain's TOOL.T."""

from __future__ import annotations

from pathlib import Path

import pytest

from ncfix.control.setup import Tool
from ncfix.control.tool_files.tables import load_tool_table
from ncfix.diagnostics import ConfigError

TABLE = """\
BEGIN TOOL .T {unit}
T      NAME             L          R          R2         DL      DR      TL
0      NULLWERKZEUG     +0         +0         +0         +0      +0
5      BALL_D8          +120.5     +4         +4         +0.02   -0.01
5.1    BALL_D8          +110       +4         +4
6
7      MILL D16         +90,25     +8
[END]
"""


def read(tmp_path: Path, text: str) -> dict[int, Tool]:
    path = tmp_path / "TOOL.T"
    path.write_text(text)
    return load_tool_table(str(path))


def test_lengths_and_radii_with_their_oversizes(tmp_path: Path) -> None:
    found = read(tmp_path, TABLE.format(unit="MM"))
    assert found.keys() == {0, 5, 7}
    assert found[5].length == pytest.approx(120.52)
    assert found[5].radius == pytest.approx(3.99)
    assert found[7] == Tool(90.25, 8.0)


def test_inches(tmp_path: Path) -> None:
    assert read(tmp_path, TABLE.format(unit="INCH"))[7].length == pytest.approx(90.25 * 25.4)


@pytest.mark.parametrize(
    "described",
    [
        "#STRUCTBEGIN\n   NAME = T\n     TYPE = N\n     WIDTH = 5\n     DEC = 0\n#STRUCTEND\n",
        'TableDescription (\n  columns:=[\n    CfgColumnDescription (\n      key:="L",\n      width:=9\n   )\n  ]\n)\n',
    ],
)
def test_newer_controls_describe_the_columns_above_their_names(tmp_path: Path, described: str) -> None:
    first, rest = TABLE.format(unit="MM Version: 'Update:110.24'").split("\n", 1)
    assert read(tmp_path, f"{first}\n{described}{rest}") == read(tmp_path, TABLE.format(unit="MM"))
    with pytest.raises(ConfigError, match="no columns T and L"):
        read(tmp_path, f"{first}\n{described[: described.rindex(chr(10), 0, -1)]}\n{rest}")


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("+90,25", "+9O,25", "L: '\\+9O,25' is not a number"),
        ("7      MILL", "X      MILL", "'X' is not a tool number"),
        ("T      NAME", "N      NAME", "no columns T and L"),
        ("BALL_D8          +120.5  ", "BALL_D8      +120.5  ", "not below the names"),
        ("5      BALL_D8          +120.5", "5 BALL +120.5", "'5 BALL' is not a tool number"),
        ("BALL_D8          +120.5", "BALL_D8\t+120.5", "not below the names"),
        (".T MM", ".T", "does not name the unit, MM or INCH"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, old: str, new: str, what: str) -> None:
    with pytest.raises(ConfigError, match=what):
        read(tmp_path, TABLE.format(unit="MM").replace(old, new))
