"""What fuzzing found: files whose mistakes were once taken for faults of ncfix."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ncfix.cli.main import run

MACHINE = """
topology = "w F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [0, 500] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [0, 500] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
[[effect]]
name = "EXX"
coefficients = [0.01]
"""
PROGRAM = "G21 G90 G54\nG0 X1\nM30\n"
LONG = "1" * 400
ENDLESS = "1" * 5000

ODD = {
    "an endless tool number": ("setup.toml", f"[tools]\n{ENDLESS} = 5\n", "NCF382"),
    "an endless offset": ("setup.toml", f"[work_offsets]\nG54 = [{ENDLESS}]\n", "NCF381"),
    "a long offset": ("setup.toml", f"[work_offsets]\nG54 = [{LONG}]\n", "NCF383"),
    "nested without end": ("setup.toml", "x = " + "[" * 5000, "NCF381"),
    "a table of nothing": ("tool.t", "BEGIN TOOL.T MM\n", "NCF385"),
    "a tool beyond all bounds": ("tools.csv", f"tool,length\n1,{LONG}\n", "NCF385"),
    "a tool a mile long": ("tools.tbl", "T1 P1 Z5000000\n", "NCF385"),
    "a long code": ("odd.nc", f"G21\nG{LONG} X1\nM30\n", "NCF115"),
    "a long M code": ("odd.nc", f"G21\nM{LONG}\nM30\n", "NCF115"),
    "a type that is not there": ("odd.mpf", "N0x1 DEF REAL SAFE_Z=60\nM30\n", "NCF110"),
    "functions nested without end": ("odd.mpf", f"R1={'ABS(' * 3000}1{')' * 3000}\nM30\n", "NCF118"),
    "a degree beyond all bounds": ("machine.toml", f'{MACHINE}basis = "polynomial"\ndegree = [{LONG}]\n', "NCF316"),
    "a number of thousands of digits": ("machine.toml", f"{MACHINE}center = {ENDLESS}\n", "NCF301"),
    "keys nested without end": ("machine.toml", f"{'.'.join('a' * 3000)} = 1\n", "NCF3"),
}


@pytest.mark.parametrize("name", ODD)
def test_a_mistake_of_a_file_is_no_fault(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kind, text, code = ODD[name]
    odd, program = tmp_path / kind, tmp_path / "part.nc"
    odd.write_text(text)
    program.write_text(PROGRAM)
    line = {
        "setup.toml": ["check", str(program), "--setup", str(odd)],
        "machine.toml": ["machine", "check", str(odd)],
    }.get(kind, ["check", str(program), "--tool-table", str(odd)] if kind.startswith("tool") else ["check", str(odd)])
    assert run([*line, "--json"]) == 3
    found = json.loads(capsys.readouterr().out)
    (error, *_) = found["errors"] if "errors" in found else found["files"][0]["errors"]
    assert error["code"].startswith(code), error
