"""Block numbers of SINUMERIK, all anew."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import traced
from ncfix.control.setup import Setup, Tool
from ncfix.diagnostics import RefusedError
from ncfix.machine import load
from ncfix.text.reader import read
from ncfix_siemens.sinumerik.scanning import renumbered


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("N5 G0 X1\nX2\nN7 Y3\n", "N10 G0 X1\nN20 X2\nN30 Y3\n"),
        ("N5G0X1\r\nX2\r\n", "N10G0X1\r\nN20X2\r\n"),
        ("G0 X1\nX2\n", "G0 X1\nX2\n"),
        ("; N5\nN5 DEF REAL Q=1 ; N5\nDOWN: X5\nMSG(1)\n", "; N5\nN10 DEF REAL Q=1 ; N5\nDOWN: X5\nMSG(1)\n"),
        ("/N5 X1\n/1 X2\n:7 X3\n", "/N10 X1\n/1 N20 X2\n:7 X3\n"),
        ("N5 X1\nN6 IF R1 GOTOF N9 ; N9\nX2\nN9 Y1\n", "N10 X1\nN20 IF R1 GOTOF N40 ; N9\nN30 X2\nN40 Y1\n"),
        ("N5 X1\nN6 X2\nREPEAT N5 N6 P=2\n", "N10 X1\nN20 X2\nREPEAT N10 N20 P=2\n"),
        (
            "N1 CASE R1 OF 1 GOTOF N3 DEFAULT GOTOF N4\nN3 X\nN4 Y",
            "N10 CASE R1 OF 1 GOTOF N20 DEFAULT GOTOF N30\nN20 X\nN30 Y",
        ),
        ("%_N_A_MPF\nN5 X1\n%_N_B_SPF\nN5 X1\nGOTOB N5\n", "%_N_A_MPF\nN10 X1\n%_N_B_SPF\nN10 X1\nGOTOB N10\n"),
        ("N5 GOTOF NEXT5\nN6 X1\n", "N10 GOTOF NEXT5\nN20 X1\n"),
    ],
)
def test_numbers(before: str, after: str) -> None:
    assert renumbered(before.encode()).decode() == after


@pytest.mark.parametrize("text", ["N5 X1\nN5 X2\nGOTOB N5\n", 'N5 X1\nGOTOB "N"<<R1\n', 'N5 X1\nTO="N5"\nGOTOB TO\n'])
def test_jumps_to_nobody_knows_where_are_refused(text: str) -> None:
    with pytest.raises(RefusedError, match="NCF256"):
        renumbered(text.encode())


def test_a_corrected_program_jumps_where_it_did(root: Path) -> None:
    text = "N1 T1 D1 M6\nN2 G54\nN3 G0 X-90 Y0 Z60 F500\nN4 GOTOF N7\nN5 G1 X0\nN6 M30\nN7 G1 X90 Y50\nN8 GOTOB N5\n"
    machine, setup = (
        load(str(root / "examples/machines/wCAYFXZSt.toml")),
        Setup(tools={1: Tool(80.0)}, assume_zero=True),
    )
    program = read(text.encode(), "part.mpf", "siemens")
    both = [
        fix_program(program, machine, setup, FixOptions(block_numbers=numbers, tolerance_um=0.3, figures=False)).text
        for numbers in ("none", "renumber")
    ]
    assert both[0].count(b"\n") > text.count("\n") + 1, "blocks are put in"
    ways = [traced(read(each, "part.mpf", "siemens"), machine, setup).moves.end for each in both]
    assert np.array_equal(*ways)
    lines = [line for line in both[1].decode().splitlines() if "ncfix" not in line]
    assert [line.split()[0] for line in lines] == [f"N{10 * n}" for n in range(1, len(lines) + 1)]
