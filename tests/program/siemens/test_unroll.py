"""Flat SINUMERIK programs set whatever others may read, as the program did."""

from __future__ import annotations

import pytest

from ncfix.control.flatten import flatten
from ncfix.diagnostics import RefusedError
from ncfix.text.reader import read
from program.siemens.following import KNOWN


def flat(text: str) -> list[str]:
    """The lines of the flat program."""
    program = read(f"{text}\nM30\n".encode(), "part.mpf", "siemens")
    found = flatten(program, KNOWN, ("X", "Y", "Z"), frozenset(), {"X": 1e-3, "Y": 1e-3, "Z": 1e-3})
    return found.program.source.decode().split("\n")[:-2]


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("CTOL=0.01 ACC[X]=50\n$A_OUT[1]=1", ["CTOL=0.01 ACC[X]=50", "$A_OUT[1]=1"]),
        ("FXS[X]=1\nG0 X1", ["FXS[X]=1", "G0 X1"]),
        ("R5=3\nR6=R5/2 R7=R6*1EX-9", ["R5=3", "R6=1.5 R7=1.5EX-09"]),
        ("DEF REAL DEEP=2\nDEEP=DEEP+1\nG0 Z=DEEP", ["G0 Z=3"]),
        ('_TXT="A"<<2\n_GUD=TRUE', ['_TXT="A2"', "_GUD=1"]),
        ("FOR R1=1 TO 2\n$A_OUT[R1]=R1*2\nR[R1+5]=R1\nENDFOR", ["$A_OUT[1]=2", "R6=1", "$A_OUT[2]=4", "R7=2"]),
        ("R8=$AA_IW[X]", ["R8=$AA_IW[X]"]),
    ],
)
def test_assignments(text: str, lines: list[str]) -> None:
    assert flat(text) == lines


def test_what_is_known_at_run_time_only_and_counts_on_others() -> None:
    with pytest.raises(RefusedError, match="the value of R is known only at run time"):
        flat("FOR R1=1 TO 2\nR8=$AA_IW[X]+R1\nENDFOR")


def test_blocks_of_a_subprogram_file_come_from_the_line_that_calls_it() -> None:
    program = read(b"G0 X1\n\nSUBX\nG0 X4\nM30\n", "part.mpf", "siemens")
    files = {"SUBX.SPF": b"; far from here\n\n\n\nG0 X2\nG0 X3\nM17\n"}
    found = flatten(program, KNOWN, ("X", "Y", "Z"), frozenset(), dict.fromkeys("XYZ", 1e-3), files.get)
    assert list(found.lines) == [1, 3, 3, 4, 5]


def test_what_is_handed_over_has_its_value_of_before() -> None:
    assert flat("R1=2\nR2=R1\nMYCYCLE(R1,R2+1)") == ["R1=2", "R2=2", "MYCYCLE(2,3)"]
    with pytest.raises(RefusedError, match="an argument of MYCYCLE is known only at run time"):
        flat("DEF REAL LIST[2]=(1,2)\nMYCYCLE(LIST)")


def test_names_of_the_control_are_handed_over_as_they_are() -> None:
    """Posts write `CYCLE832(tolerance,_ORI_FINISH,0.5)`: nothing in the program defines `_ORI_FINISH`."""
    text = "DEF REAL TOL\nTOL=0.02\nCYCLE832(TOL,_ori_finish,0.5)"
    assert flat(text) == ["CYCLE832(0.02,_ORI_FINISH,0.5)"]
    with pytest.raises(RefusedError, match="an argument of CYCLE832 is known only at run time"):
        flat("DEF REAL TOL\nTOL=$AA_IW[X]\nCYCLE832(TOL,_ORI_FINISH)")
