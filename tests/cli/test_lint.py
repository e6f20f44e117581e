"""`ncfix lint`: tables from elsewhere, known by what they hold."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conftest import FULL
from ncfix.diagnostics import ExitCode

CEC = """%_N_NC_CEC_INI
CHANDATA(1)
$AN_CEC[0,0]=0
$AN_CEC[0,1]=0.01
$AN_CEC[0,2]=0.02
$AN_CEC_INPUT_AXIS[0]=(AX2)
$AN_CEC_OUTPUT_AXIS[0]=(AX1)
$AN_CEC_STEP[0]=10.0
$AN_CEC_MIN[0]=0.0
$AN_CEC_MAX[0]=20.0
$AN_CEC_DIRECTION[0]=0
$AN_CEC_MULT_BY_TABLE[0]=0
$AN_CEC_IS_MODULO[0]=0
M17
"""
FILES = {
    "cec.ini": ("siemens", CEC, CEC.replace("MAX[0]=20.0", "MAX[0]=15.0"), "not a whole number"),
    "x.comp": ("linuxcnc", "0 0.001 0.002\n10 0.003 0.002\n", "0 0.001 0.002\n\n10 0.003 0.002\n", "stops reading"),
    "AXIS_X.COM": (
        "heidenhain",
        "BEGIN AXIS_X.COM MM\nNR   AXISPOS       X\n0    -10.0000      +0.0012\n1    +10.0000      +0.0010\n[END]\n",
        "BEGIN AXIS_X.COM MM\nNR   AXISPOS       X\n0    +10.0000      +0.0012\n1    -10.0000      +0.0010\n[END]\n",
        "must ascend",
    ),
    "grid.csv": ("isg", "X Y EXX\n0 0 0\n0 1 0\n1 0 0\n1 1 0\n", "X Y EXX\n0 0 0\n0 1 0\n1 0 0\n", "no regular grid"),
    "pitch.csv": ("fanuc-pitch", "no,value\n33,2\n34,1\n", "no,value\n33,2\n35,1\n", "point 35 after point 33"),
    "COMP.ERR": ("hexagon", "STARTX\n10.0=10.002\n20.0=20.002\nEND\n", "", ""),
}


@pytest.mark.parametrize("name", FILES)
def test_a_sound_table_is_known_and_a_broken_one_is_named(name: str, tmp_path: Path, ncfix: Any) -> None:
    owner, sound, broken, words = FILES[name]
    path = tmp_path / name
    path.write_text(sound)
    result = ncfix("lint", path, "--json")
    assert result.code == ExitCode.DONE, result.err
    (entry,) = json.loads(result.out)["files"]
    assert (entry["path"], entry["form"], entry["findings"]) == (str(path), owner, [])
    if broken:
        path.write_text(broken)
        result = ncfix("lint", path)
        assert result.code == ExitCode.FINDINGS
        assert words in result.err
        assert str(path) in result.err
        assert "export again" not in result.err  # whoever made it, ncfix did not


def test_files_that_are_no_tables_end_with_3(tmp_path: Path, ncfix: Any) -> None:
    (tmp_path / "notes.txt").write_text("call the service on Monday\n")
    (tmp_path / "x.comp").write_text("0 0 0\n10 0 0\n")
    result = ncfix("lint", tmp_path)
    assert result.code == ExitCode.UNREADABLE
    assert "notes.txt: NCF509" in result.err
    assert "x.comp: LinuxCNC" in result.err
    assert ncfix("lint", tmp_path / "absent").code == ExitCode.UNREADABLE
    assert ncfix("lint", tmp_path / "x.comp", "--control", "nobody").code == ExitCode.USAGE


def test_a_folder_of_export_is_its_controls(tmp_path: Path, ncfix: Any, shop: Any) -> None:
    out = tmp_path / "tables"
    machine = Path(__file__).parents[2] / "examples" / "machines" / "three_axis.toml"
    for control, settings in {"linuxcnc": (), "heidenhain": ("--set", "sign=error")}.items():
        assert ncfix("export", control, "-m", machine, "-o", out / control, *settings).code == ExitCode.DONE
        result = ncfix("lint", out / control, "--json")
        entries = json.loads(result.out)["files"]
        assert result.code == ExitCode.DONE, result.err
        assert {entry["form"] for entry in entries} == {control}
        assert not {"ncfix-tables.json", "hand-over.md"} & {Path(entry["path"]).name for entry in entries}


def test_the_defects_of_printed_examples_are_found(shared: Callable[[str], Path], ncfix: Any) -> None:
    """The thesis's Fig. 7.3 has a value beyond the end of its table, and the manual's own step fits no whole number."""
    folder = shared("tables")
    result = ncfix("lint", folder / "siemens", "--json")
    said = {Path(e["path"]).name: [each["text"] for each in e["findings"]] for e in json.loads(result.out)["files"]}
    assert any("this one is ignored" in text for text in said["cec_fig73_seed001.ini"])
    assert any("118.871, not a whole number" in text for text in said["cec_802Dsl_manual_example.ini"])


def test_every_sample_is_known(shared: Callable[[str], Path], ncfix: Any) -> None:
    folder = shared("tables")
    paths = [path for path in sorted(folder.glob("*/*")) if path.is_file()]
    result = ncfix("lint", *paths, "--json")
    entries = json.loads(result.out)["files"]
    assert len(entries) == len(paths) > 20
    assert [entry["path"] for entry in entries if entry["form"] is None] == []
    owners = {Path(entry["path"]).parent.name: set[str]() for entry in entries}
    for entry in entries:
        owners[Path(entry["path"]).parent.name].add(entry["form"])
    assert owners["siemens"] == {"siemens"}
    assert owners["linuxcnc"] == {"linuxcnc"}
    assert "heidenhain" in owners["heidenhain"]
    assert result.code == ExitCode.FINDINGS


def test_the_same_file_twice_is_one(tmp_path: Path, ncfix: Any) -> None:
    path = tmp_path / "x.comp"
    path.write_text("0 0 0\n10 0 0\n")
    assert len(json.loads(ncfix("lint", path, path, "--json").out)["files"]) == 1


SETTINGS = [(), ("grids=one", "negate=XZ"), ("steps=even", "fit=area")]


@pytest.mark.parametrize(
    ("name", "settings"),
    [*(("angle_head", each) for each in SETTINGS), *(("three_axis", each) for each in SETTINGS[: 3 if FULL else 1])],
)
def test_nothing_is_said_of_what_export_has_written_for_isg(
    tmp_path: Path, ncfix: Any, root: Path, name: str, settings: tuple[str, ...]
) -> None:
    """No hint about its own file, neither of `lint` nor of `emulate`, whatever is set."""
    out, machine = tmp_path / "tables", root / "examples" / "machines" / f"{name}.toml"
    given = [word for setting in settings for word in ("--set", setting)]
    assert ncfix("export", "isg", "-m", machine, "-o", out, *given).code == ExitCode.DONE
    result = ncfix("lint", out, "--json")
    entries = json.loads(result.out)["files"]
    assert (result.code, {entry["form"] for entry in entries}) == (ExitCode.DONE, {"isg"})
    assert [entry["findings"] for entry in entries] == [[]] * len(entries)
    run = ncfix("emulate", "isg", out, "-m", machine)
    assert (run.code, "volcomp" in run.err) == (ExitCode.DONE, False), run.err
