"""`--flatten`, `--no-point` and `ncfix dialects NAME` from the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

LOOP = "O1\nG90 G54 G0 X0. Y0. Z50.\n#1=0\nWHILE[#1LT3]DO1\nG0 X[10.*#1] Y5000\n#1=#1+1\nEND1\nM30\nO2\nX7.\nM30\n"


def test_a_loop_is_refused_and_with_flatten_written_out(ncfix: Any, root: Path, tmp_path: Path) -> None:
    program, machine = tmp_path / "loop.nc", root / "examples/machines/three_axis.toml"
    program.write_text(LOOP)
    common = ("-m", machine, "--assume-zero", "--no-point", "IS-B", "-o", tmp_path / "out.nc", "--json")
    refused = ncfix("fix", program, *common)
    assert refused.code == 4
    assert [each["line"] for each in refused.json()["files"][0]["refused"]] == [5]
    fixed = ncfix("fix", program, *common, "--flatten")
    assert fixed.code == 0
    warnings = {each["code"]: each for each in fixed.json()["files"][0]["warnings"]}
    assert "NCF445" in warnings
    assert "the flat program does not have them" in warnings["NCF249"]["hint"]
    text = (tmp_path / "out.nc").read_text()
    assert "WHILE" not in text
    assert text.startswith("O1\n(NCFIX ")
    assert text.count("Y5") == 3


def test_numbers_without_a_point_are_asked_for(ncfix: Any, root: Path, tmp_path: Path) -> None:
    program, machine = tmp_path / "part.nc", root / "examples/machines/three_axis.toml"
    program.write_text("G90 G54 G0 X50 Y5. Z50.\nM30\n")
    arguments = ("fix", program, "-m", machine, "--dialect", "fanuc", "--assume-zero", "-o", tmp_path / "out.nc")
    asked = ncfix(*arguments)
    assert asked.code == 2
    assert "NCF240" in asked.err
    assert ncfix(*arguments, "--no-point", "calculator").code == 0


def test_a_dialect_says_what_becomes_of_its_blocks(ncfix: Any) -> None:
    said = ncfix("dialects", "fanuc").out.decode()
    assert said.index("corrected") < said.index("passed by rule") < said.index("refused")
    entry = ncfix("dialects", "haas", "--json").json()["dialects"][0]
    assert entry["understands"]
    assert entry["refuses"]
    assert ncfix("dialects", "fanux").code == 2
