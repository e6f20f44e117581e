"""Blocks behind the end of a program: what is said of them does not depend on the parts in which it is corrected."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from ncfix.cli.main import cli

MOTIONS = [f"G1 X{k % 90}.{k % 7} Y{k % 80}. F500" for k in range(2000)]
TAILS = {
    "motions": ["M30", *(f"X{k % 90}.5" for k in range(300))],
    "far on": ["M30", *["(remark)"] * 3000, "G0 X5", "Y6"],
    "behind the tape": ["M30", "%", "X5"],
    "nothing": ["M30"],
}


@pytest.mark.parametrize("tail", TAILS)
def test_the_same_in_parts(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tail: str) -> None:
    program, output = tmp_path / "part.ngc", tmp_path / "fixed.ngc"
    program.write_text("\n".join(["%", "G21 G90 G54 G0 X0 Y0 Z50 B0 C0", *MOTIONS, *TAILS[tail], ""]))
    said = []
    for size in ("100000000", "20000"):
        monkeypatch.setenv("NCFIX_PART_BYTES", size)
        machine = str(root / "benchmarks" / "five_axis.toml")
        arguments = ["fix", str(program), "-m", machine, "-o", str(output), "--force", "--assume-zero", "--jobs", "1"]
        result = CliRunner().invoke(cli, arguments)
        assert result.exit_code == 0, result.output
        said.append(([line for line in result.output.splitlines() if "NCF249" in line], output.read_bytes()))
    assert said[0] == said[1]
    assert len(said[0][0]) == (tail != "nothing")
