"""What users get wrong: each with a coded message that names the place, and nothing written."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from typing import Any

import pytest

from ncfix.diagnostics import ExitCode

UNREADABLE = {
    "binary": (b"\x7fELF\x02\x01\x01\0\0\0\0\0", 1, "NCF101"),
    "UTF-16": ("G1 X1\n".encode("utf-16"), 1, "NCF101"),
    "empty": (b"\n", 0, "NCF102"),
    "long line": (b"G21\nG1 X1 F100 (" + b"0" * 300 + b")\nM2\n", 2, "NCF105"),
    "nested comment": (b"G21 (a (b) c)\nM2\n", 1, "NCF112"),
    "exponent": (b"G21\nG1 X1e-5 F100\nM2\n", 2, "NCF116"),
    "word twice": (b"G21\nG1 X1 X2 F100\nM2\n", 2, "NCF117"),
    "decimal comma": (b"G21\nG1 X1,5 F100\nM2\n", 2, "NCF115"),
    "open arc": (b"G21 G17 G90 G94\nG0 X0 Y0 Z0\nG2 X10 Y0 I3 J0 F100\nM2\n", 3, "NCF220"),
    "ends in a subprogram": (b"G21\no100 sub\nG1 X1 F100\n", 2, "NCF230"),
    "truncated in a word": (b"G21 G90 G94\nG0 X1 Y1 Z-1\nG1 X", 3, "NCF114"),
    "truncated in a comment": (b"G21 G90 G94\nG0 X1 Y1 Z-1\n(finish", 3, "NCF111"),
}
"""What is wrong -> the program, the line that is named, the code."""


@pytest.mark.parametrize("case", UNREADABLE)
@pytest.mark.parametrize("machine", ["machine", "perfect"])
def test_a_program_that_cannot_be_followed(shop: Any, ncfix: Any, case: str, machine: str) -> None:
    text, line, code = UNREADABLE[case]
    shop.program.write_bytes(text)
    checked = ncfix("check", shop.program, "-m", getattr(shop, machine), "--assume-zero")
    assert checked.code == ExitCode.UNREADABLE
    place = f"{shop.program}:{line}" if line else f"{shop.program}"
    assert re.search(rf"^{re.escape(place)}(:\d+)?: {code}: ", checked.err)
    out = shop.folder / "out.ngc"
    fixed = ncfix("fix", shop.program, "-m", shop.machine, "-o", out, "--assume-zero")
    assert fixed.code == ExitCode.UNREADABLE
    assert code in fixed.err
    assert not out.exists()


def test_a_truncated_program_is_a_finding_even_if_it_can_be_read(shop: Any, ncfix: Any) -> None:
    shop.program.write_bytes(b"G21 G90 G94\nG0 X1 Y1 Z-1\nG1 X2 F1")
    result = ncfix("check", shop.program)
    assert result.code == ExitCode.FINDINGS
    assert "NCF234" in result.err


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full")
def test_a_full_disk_under_standard_output(shop: Any) -> None:
    command = [sys.executable, "-m", "ncfix", "fix", str(shop.program), "-m", str(shop.perfect), "-o", "-"]
    with open("/dev/full", "wb") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, check=False, text=True)
    assert done.returncode == ExitCode.USAGE
    assert "NCF007: cannot be written: No space left on device" in done.stderr


def test_a_full_disk_under_an_output_file(shop: Any, ncfix: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(handle: int, data: Any) -> int:
        raise OSError(28, "No space left on device")

    before = sorted(path.name for path in shop.folder.iterdir())
    monkeypatch.setattr(os, "write", full)
    result = ncfix("fix", shop.program, "-m", shop.perfect, "-o", shop.folder / "out.ngc")
    monkeypatch.undo()
    assert result.code == ExitCode.USAGE
    assert "NCF007" in result.err
    assert sorted(path.name for path in shop.folder.iterdir()) == before


def test_inch_programs_are_corrected_in_inches(shop: Any, ncfix: Any) -> None:
    """The same cut in both units gives the same path to half a step, 1 um and 1e-4 inch = 2.54 um."""
    metric, inch = shop.folder / "metric.ngc", shop.folder / "inch.ngc"
    metric.write_bytes(b"G21 G90 G94\nG0 X25.4 Y25.4 Z-2.54\nG1 X254.000 F254\nM2\n")
    inch.write_bytes(b"G20 G90 G94\nG0 X1.0000 Y1.0000 Z-0.1000\nG1 X10.0000 F10\nM2\n")
    said = ncfix("verify", metric, inch, "-m", shop.perfect, "--json").json()
    assert said["error_after_um"]["max"] < 1e-6
    out = shop.folder / "out"
    assert ncfix("fix", metric, inch, "-m", shop.machine, "-o", out, "--assume-zero").code == ExitCode.DONE
    both = ["verify", metric, out / "inch.ngc", "-m", shop.machine, "--assume-zero", "--tolerance-um", "2", "--json"]
    assert ncfix(*both).code == ExitCode.DONE
