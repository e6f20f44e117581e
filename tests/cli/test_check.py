"""`ncfix check`: findings and nothing else."""

from __future__ import annotations

import os
from typing import Any

import pytest

from ncfix.diagnostics import ExitCode


def test_a_sound_program_has_no_findings(shop: Any, ncfix: Any) -> None:
    result = ncfix("check", shop.program)
    assert (result.code, result.out) == (ExitCode.DONE, b"")
    assert "6 blocks, 3 motions, " in result.err
    assert "nothing found" in result.err


def test_json(shop: Any, ncfix: Any) -> None:
    (entry,) = ncfix("check", shop.program, "-m", shop.machine, "--assume-zero", "--json").json()["files"]
    assert (entry["path"], entry["blocks"], entry["moves"]) == (str(shop.program), 6, 3)
    assert {finding["code"] for finding in entry["findings"]} <= {"NCF205", "NCF409"}


def test_a_stamp_is_a_finding(shop: Any, ncfix: Any) -> None:
    ncfix("fix", shop.program, "-m", shop.machine, "-o", shop.folder / "out.ngc", "--assume-zero")
    result = ncfix("check", shop.folder / "out.ngc")
    assert result.code == ExitCode.FINDINGS
    assert "out.ngc:1" in result.err
    assert "NCF430" in result.err


@pytest.mark.parametrize("machine", ["machine", "perfect"])
def test_leaving_the_travel_is_a_finding(shop: Any, ncfix: Any, machine: str) -> None:
    shop.program.write_bytes(b"G21 G90 G94\nG0 X10 Y10 Z-1\nG1 X510 F600\nM2\n")
    result = ncfix("check", shop.program, "-m", getattr(shop, machine), "--assume-zero")
    assert result.code == ExitCode.FINDINGS
    assert "part.ngc:3: NCF405" in result.err


def test_an_arc_that_begins_where_nobody_knows_is_told_once(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(b"G21 G90 G17\nG0 X#3012 Y0 Z0\nG2 X10. Y0 R10. F100.\nM30\n")
    given = ("-m", shop.machine, "--assume-zero", "--dialect", "fanuc", "--no-point", "calculator")
    found = ncfix("check", shop.program, *given, "--json").json()["files"][0]["findings"]
    assert [each["code"] for each in found if each["line"] == 3] == ["NCF432"]


def test_what_cannot_be_read_is_no_finding_but_an_error(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(b"G21\nG1 X1,5\nM2\n")
    result = ncfix("check", shop.program, "--json")
    assert result.code == ExitCode.UNREADABLE
    assert result.json()["files"][0]["errors"][0]["line"] == 2


def test_nothing_is_written(shop: Any, ncfix: Any) -> None:
    before = sorted(os.listdir(shop.folder))
    ncfix("check", shop.program, "-m", shop.machine, "--assume-zero")
    assert sorted(os.listdir(shop.folder)) == before


def test_a_stamp_is_one_finding(shop: Any, ncfix: Any) -> None:
    out = shop.folder / "fixed.ngc"
    given = ("-m", shop.machine, "--offset", "G54=0,0,0", "--tool", "0=0")
    ncfix("fix", shop.program, *given, "-o", out)
    found = ncfix("check", out, *given, "--json").json()["files"][0]["findings"]
    codes = [each["code"] for each in found]
    assert codes.count("NCF430") == 1
    assert "NCF438" not in codes


def test_over_many_files_the_worst_counts(shop: Any, ncfix: Any) -> None:
    missing = shop.folder / "missing.ngc"
    result = ncfix("check", shop.program, missing, "--json")
    assert result.code == ExitCode.UNREADABLE
    assert [("errors" in entry) for entry in result.json()["files"]] == [False, True]


def test_a_folder_stands_for_the_programs_below_it(ncfix: Any, shop: Any) -> None:
    deep = shop.folder / "programs" / "deep"
    deep.mkdir(parents=True)
    (deep / "a.ngc").write_bytes(shop.program.read_bytes())
    (deep.parent / "b.ngc").write_bytes(b"G1 X1 Y..2\nM2\n")
    (deep.parent / "notes.txt").write_bytes(b"G1 X1 Y..2\nM2\n")
    result = ncfix("check", deep.parent, "--json")
    assert result.code == ExitCode.UNREADABLE
    assert [each["path"] for each in result.json()["files"]] == [str(deep.parent / "b.ngc"), str(deep / "a.ngc")]


def test_the_first_example_leaves_nothing_to_remark_on(ncfix: Any, examples: Any) -> None:
    """`./try` shows what a correction does, not what is wrong with its program."""
    programs, machines = examples / "programs", examples / "machines"
    result = ncfix(
        "check", programs / "blade.nc", "-m", machines / "wCBXFZYSt.toml", "--setup", programs / "blade.setup.toml"
    )
    assert (result.code, "nothing found" in result.err) == (ExitCode.DONE, True), result.err
