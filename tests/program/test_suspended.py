"""Motions under something that is not followed may lead anywhere: behind it their axes are not known until named."""

from __future__ import annotations

import pytest

from ncfix.control.moves import Rule
from ncfix.control.setup import Setup
from ncfix.control.trace import trace
from ncfix.text.reader import read

HEADS = {
    "siemens": "G54 G71 G17 G90\nT1 D1\nG0 X1 Y1 Z50",
    "heidenhain": "BEGIN PGM A MM\nTOOL CALL 1 Z S100\nL X+1 Y+1 Z+50 FMAX\nFN 18: SYSREAD Q150 = ID270 NR1 IDX1",
    "fanuc": "G21 G54 G90 G17\nT1 M6\nG43 H1 Z50.\nG0 X1. Y1.",
}
MOTIONS = {
    "siemens": ("G1 X10 Y10 F100", "G1 Y20", "G0 X5 Y20 Z40"),
    "heidenhain": ("L X+10 Y+10 F100", "L Y+20 F100", "L X+5 Y+20 Z+40 FMAX"),
    "fanuc": ("G1 X10. Y10. F100.", "G1 Y20.", "G0 X5. Y20. Z40."),
}


@pytest.mark.parametrize(
    ("dialect", "begin", "end"),
    [
        ("siemens", "SCALE X2", "SCALE"),
        ("siemens", "ROTS X10 Y20", "ROT"),
        ("siemens", "R1=$AA_IM[X]\nROT Z=R1", "TRANS"),
        ("siemens", "R1=$AA_IM[X]\nATRANS X=R1", "ROT"),
        ("siemens", 'R1=$AA_IM[X]\nCYCLE800(0,"T",200000,57,0,0,0,R1,0,0,0,0,0,-1)', "CYCLE800()"),
        ("heidenhain", "CYCL DEF 10.0 R\nCYCL DEF 10.1 ROT+Q150", "CYCL DEF 10.0 R\nCYCL DEF 10.1 ROT+0"),
        ("heidenhain", "CYCL DEF 26.0 S\nCYCL DEF 26.1 X1.4 Y0.6", "CYCL DEF 26.0 S\nCYCL DEF 26.1 X1 Y1"),
        ("heidenhain", "CYCL DEF 247 D Q339=+Q150", "CYCL DEF 247 D Q339=+1"),
        ("fanuc", "G51 X0 Y0 I2. J1.", "G50"),
        ("fanuc", "G68 X0 Y0 R#139", "G69"),
    ],
)
def test_an_axis_that_was_moved_meanwhile_has_to_be_named(dialect: str, begin: str, end: str) -> None:
    under, one, all_three = MOTIONS[dialect]
    text = "\n".join([HEADS[dialect], begin, under, end, one, all_three, "END PGM A MM" if "CYCL" in begin else "M30"])
    found = trace(read(f"{text}\n".encode(), "a", dialect), Setup(assume_zero=True), tuple("XYZ"), frozenset())
    assert found.moves.rule[-3:].tolist() == [Rule.REFUSE, Rule.REFUSE, Rule.CORRECT]
    assert found.moves.reasons[found.moves.reason[-2]].startswith("the position of the axis X after")
