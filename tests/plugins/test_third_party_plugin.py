"""The control of the documents: its own tests pass, and it does what its manual would say."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.control.setup import Setup
from ncfix.machine import load
from ncfix.text.dialect import signature_rank
from ncfix.text.reader import read

PROGRAM = b"""O100
G21 G17 G90 G54
G100 T2 X10. Y20. Z100.
MSG["G0 X99. IS NO MOTION"]
G177 X30. Y30. Z-10. E2. Q3. F100.
X40. Y35.
G80
G168 X10. Y0. Z0. A0. B30. C0.
G53.1
G1 X5. Y5. Z0. F300.
G69
M30
"""


@pytest.fixture
def folder(root: Path) -> Path:
    return root / "examples" / "third_party_plugin"


def test_its_own_tests(folder: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(folder)]
    made = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=folder, check=False)
    assert made.returncode == 0, made.stdout


def test_a_program(folder: Path, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(folder)
    from ncfix_nakano import NAKANO

    program = read(PROGRAM, "part.nak", dialect=NAKANO)
    machine = load(root / "examples/machines/dmu50.toml")
    fixed = fix_program(program, machine, Setup(assume_zero=True), FixOptions(figures=False))
    text = fixed.text.decode()
    assert not fixed.report.refused
    assert 'MSG["G0 X99. IS NO MOTION"]' in text
    assert re.search(r"G100 T2 X[\d.]+ Y[\d.]+ Z[\d.]+\n", text)
    assert re.search(
        r"G177 X29\.\d+ Y29\.\d+ Z-10\.\d+ E1\.\d+ Q3\. F100\.\nX39\.\d+ Y34\.\d+ Z-10\.\d+ E\d\.\d+\n", text
    )
    assert "G168 X10. Y0. Z0. A0. B30. C0." in text


@pytest.mark.parametrize("line", [b"G100 T5 X1.", b"N10 G100T5", b"G168 X0. A0. B1. C0.", b"G177 X1. Z-5. E2. Q3."])
def test_a_text_shows_it(folder: Path, monkeypatch: pytest.MonkeyPatch, line: bytes) -> None:
    monkeypatch.syspath_prepend(folder)
    from ncfix_nakano import NAKANO

    assert signature_rank(NAKANO, b"G21 G90\n" + line + b"\n") == 0
    assert signature_rank(NAKANO, b"G100 X5.\nG1 (G100 T5)\nG1680 G177.1\n") is None


def test_it_is_shown_in_the_document_and_short(folder: Path, root: Path) -> None:
    page = (root / "docs/plugins.md").read_text()
    files = ("pyproject.toml", "ncfix_nakano/__init__.py", "ncfix_nakano/tables.py", "ncfix_nakano/nakano.lark")
    for name in (*files, "test_nakano.py"):
        assert f"\n{(folder / name).read_text()}```" in page, name
    assert sum(len((folder / name).read_text().splitlines()) for name in files) < 200
