"""Files that are no programs: subprograms in a folder, and texts in which nothing that is followed moves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

HEAD = "G21 G90 G17 G54 G0 X0. Y0. Z50.\n"
CUT = "G1 X20. F500.\nY20.\n"


@pytest.fixture
def machine(root: Path) -> Path:
    return root / "examples/machines/three_axis.toml"


@pytest.mark.parametrize(
    ("name", "text", "is_left_out"),
    [
        ("a.nc", f"%\nO2\n{CUT}M99\n%\n", True),
        ("a.nc", f"%\nO2 (M30)\n{CUT}N90 M99 (BACK)\n\n%\n(END)\n", True),
        ("a.nc", f"O1\n{HEAD}M98 P2\nM30\nO2\n{CUT}M99\n%\n", False),
        ("a.nc", f"O1\n{HEAD}{CUT}(M99)\n", False),
        ("a.spf", f"{CUT}M17\n", True),
        ("a.spf", f"PROC A\r\n{CUT}RET ; back\r\n", True),
        ("a.mpf", f"{HEAD}{CUT}M30\nSUB:\n{CUT}RET\n", False),
        ("a.mpf", f"{HEAD}{CUT}STOPRET=1\n", False),
        ("a.ngc", f"o<a> sub\n{CUT}o<a> endsub\n", True),
        ("a.h", "BEGIN PGM A MM\nL X+1 R0 FMAX M99\nEND PGM A MM\n", False),
    ],
)
def test_a_subprogram_in_a_folder_is_left_out(
    ncfix: Any, machine: Path, tmp_path: Path, name: str, text: str, is_left_out: bool
) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / name).write_bytes(text.encode())
    (folder / "main.nc").write_text(f"O1\n{HEAD}{CUT}M30\n")
    common = ("-m", machine, "--assume-zero", "--json")
    for verb in (("fix", folder, "-o", tmp_path / "out"), ("check", folder), ("fix", folder, "--diff")):
        done = ncfix(*verb, *common)
        entries = {Path(each["path"]).name: each for each in done.json()["files"]}
        assert entries[name].get("left_out", False) == is_left_out
        assert ("NCF258" in done.err) == is_left_out
    assert (tmp_path / "out" / "main.nc").exists()
    if is_left_out:
        assert not (tmp_path / "out" / name).exists()


def test_one_that_is_named_is_corrected_with_a_remark(ncfix: Any, machine: Path, tmp_path: Path) -> None:
    program = tmp_path / "a.nc"
    program.write_text(f"%\nO2\n{CUT}M99\n%\n")
    done = ncfix("fix", program, "-m", machine, "--assume-zero", "-o", tmp_path / "out.nc")
    assert done.code == 0
    assert f"{program}:5: NCF258" in done.err


@pytest.mark.parametrize("flatten", [(), ("--flatten",)])
@pytest.mark.parametrize(
    "text",
    [
        f"MACHINE: MILL 7\nFILE: PART\n%\nO1\n{HEAD}{CUT}M30\n%\n",
        f"O1\nM30\nO2\n{HEAD}{CUT}M30\n",
        f"O1\nGOTO 9\n{HEAD}{CUT}N9 M30\n",
        f"O1\nG21 G91 G28 Z0.\n:0030 T1 M6\nG90\n{HEAD}{CUT}M30\n",
    ],
)
def test_a_text_of_which_nothing_is_corrected_that_is_followed_is_refused(
    ncfix: Any, machine: Path, tmp_path: Path, text: str, flatten: tuple[str, ...]
) -> None:
    """Written out flat it would lose all its blocks."""
    program, output = tmp_path / "part.nc", tmp_path / "out.nc"
    program.write_text(text)
    common = ("fix", program, "-m", machine, "--assume-zero", "--dialect", "fanuc", "-o", output, "--json", *flatten)
    refused = ncfix(*common)
    assert refused.code == 4
    assert [each["code"] for each in refused.json()["files"][0]["refused"]] == ["NCF249"]
    assert not output.exists()
    assert ncfix(*common, "--allow-refused").code == 0
    assert output.read_text() == text


def test_check_finds_what_is_refused_though_it_is_flat(ncfix: Any, root: Path) -> None:
    guide = root / "examples/guide"
    common = ("check", guide / "shop/grid.nc", "--setup", guide / "setup.toml")
    assert "NCF433" in ncfix(*common, "-m", guide / "mill.toml").err
    flat = ncfix(*common, "-m", guide / "mill.toml", "--flatten")
    assert flat.code == 0, flat.err
    assert ncfix(*common, "--flatten").code == 2
