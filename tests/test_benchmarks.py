"""The benchmarks run: what they time and call is there."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import require_core


@pytest.mark.parametrize("program", ["blade.nc", "klartext_tcp.h"])
def test_the_stages_of_a_program(root: Path, program: str) -> None:
    require_core()
    command = [sys.executable, root / "benchmarks/stages.py", root / "examples/programs" / program]
    done = subprocess.run(command, capture_output=True, check=False, text=True)
    assert done.returncode == 0, done.stderr
    *stages, whole = [re.findall(r"(-?\d+) %", line) for line in done.stdout.splitlines()[2:]]
    assert whole == ["100", "100"]
    for shares in zip(*stages, strict=True):
        assert sum(map(int, shares)) == pytest.approx(100, abs=len(stages) / 2)  # each is rounded to 1 %
        assert max(map(int, shares)) < 100


def test_the_table_of_other_verbs(root: Path, tmp_path: Path) -> None:
    require_core()
    page = tmp_path / "performance.md"
    before = (root / "docs/performance.md").read_text()
    page.write_text(before)
    code = "import pathlib, run, sys; run.PAGE = pathlib.Path(sys.argv[1]); run.other_verbs([300])"
    subprocess.run([sys.executable, "-c", code, page], cwd=root / "benchmarks", check=True)
    one, other = (re.split("<!-- (?:end of )?other verbs.*-->", text) for text in (before, page.read_text()))
    assert (one[0], one[2]) == (other[0], other[2])
    assert re.findall(r"\| 300 \| `(.+)` \|", other[1]) == ["verify", "check", "simulate", "simulate -o", "trace -o"]
