"""Words for axes that nobody has named rest on what is known of the start; if that was assumed, it is said."""

from __future__ import annotations

from pathlib import Path

import pytest

from ncfix.compensate.fix import fix_program
from ncfix.machine import load
from ncfix.program.reader import read
from ncfix.program.setup import Setup, Tool

BLIND = "G21 G90 G94\nG0 X10 Y10\nG0 Z50\nG1 X20 Z-1 F300\nM2\n"
NAMED = "G21 G90 G94\nG0 X10 Y10 Z50\nG1 X20 F300\nM2\n"
GIVEN = Setup(work_offsets={"G54": {}}, initial=dict.fromkeys("XYZBC", 0.0), tools={0: Tool(0.0)})


def warned(root: Path, program: str, setup: Setup) -> list[tuple[int, str]]:
    machine = load(root / "examples/machines/wCBXFZYSt.toml")
    report = fix_program(read(program.encode(), "part.ngc", "linuxcnc"), machine, setup).report
    return [(each.place.line, each.text[0]) for each in report.warnings if each.code == "NCF439" and each.place]


@pytest.mark.parametrize(
    ("program", "setup", "found"),
    [(BLIND, Setup(assume_zero=True), [(2, "Z")]), (BLIND, GIVEN, []), (NAMED, Setup(assume_zero=True), [])],
)
def test_a_word_on_trust_is_said(root: Path, program: str, setup: Setup, found: list[tuple[int, str]]) -> None:
    assert warned(root, program, setup) == found
