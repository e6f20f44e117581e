"""Drilling cycles of SINUMERIK and Klartext: each hole is proved, and a fault in what stands round it is found."""

from __future__ import annotations

import pytest

from certificate.planting import GIVEN, SETUP, machine
from ncfix.certificate.findings import BlockProof
from ncfix.certificate.holes import HoleCall, assign
from ncfix.certificate.proof import prove
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.text.dialect import get
from ncfix.text.reader import read

SINUMERIK = """G17 G40 G90 G94 G71
T1 D1
M6
G54
G0 X0 Y0 Z200
MCALL CYCLE83(60,30,2,12.5,,25,,2,0.5,0,1,0) ; deep
X10 Y10
X20 Y10 ; the second
MCALL
G0 Z100
X50 Y50
CYCLE82(40,30,2,,17.5,0.4) ; one more
G0 X60 Z90
M30
"""
KLARTEXT = """BEGIN PGM PART MM
TOOL CALL 1 Z S8000
L X+0 Y+0 Z+200 R0 FMAX M3
CYCL DEF 200 DRILLING ~
    Q200=+2 ;SET-UP CLEARANCE ~
    Q201=-17.5 ;DEPTH ~
    Q206=+150 ;FEED ~
    Q202=+5 ;PECKING ~
    Q210=+0 ;DWELL ~
    Q203=+30 ;SURFACE ~
    Q204=+50 ;2ND CLEARANCE ~
    Q211=+0 ;DWELL
L X+10 Y+10 R0 FMAX M99
L X+20 R0 FMAX
CYCL CALL ; the second
L X+30 Y+15 R0 FMAX M99 ; the third
L Z+150 R0 FMAX
END PGM PART MM
"""


def numbered(text: str, dialect: str) -> str:
    """The program with a number for each block."""
    head, klartext = 0, dialect == "heidenhain"
    lines = []
    for line in text.splitlines():
        lines.append(line if line.startswith(" ") else f"{head} {line}" if klartext else f"N{10 * head + 10} {line}")
        head += not line.startswith(" ")
    return "\n".join([*lines, ""])


def corrected(text: str, dialect: str) -> str:
    options = FixOptions(figures=False)
    return fix_program(read(text.encode(), "part", get(dialect)), machine("three"), SETUP, options).text.decode()


def judged(text: str, other: str, dialect: str) -> BlockProof:
    return prove(text.encode(), other.encode(), machine("three"), GIVEN, dialect)


@pytest.mark.parametrize("number", [False, True], ids=["bare", "numbered"])
@pytest.mark.parametrize(("text", "dialect"), [(SINUMERIK, "siemens"), (KLARTEXT, "heidenhain")])
def test_every_hole_is_proved(text: str, dialect: str, number: bool) -> None:
    text = numbered(text, dialect) if number else text
    found = judged(text, corrected(text, dialect), dialect)
    assert not found.faults
    assert not found.reasons
    assert found.proved_motions == found.motions >= 6


@pytest.mark.parametrize("number", [False, True], ids=["bare", "numbered"])
@pytest.mark.parametrize(
    ("text", "dialect", "right", "wrong"),
    [
        (SINUMERIK, "siemens", "12.5", "12.6"),  # how deep a hole is
        (SINUMERIK, "siemens", ",,25", ",,26"),  # how deep it goes first
        (SINUMERIK, "siemens", "(60,30", "(62,30"),  # where it ends
        (SINUMERIK, "siemens", "2,0.5,0,1,0", "2,0.5,0,2,0"),
        (SINUMERIK, "siemens", "MCALL CYCLE82", "CYCLE82"),
        (SINUMERIK, "siemens", "CYCLE83", "CYCLE82"),
        (SINUMERIK, "siemens", "; the second", ""),
        (KLARTEXT, "heidenhain", "FN 1: Q203 = +Q203 + +", "FN 1: Q203 = +Q203 + -"),
        (KLARTEXT, "heidenhain", "FN 2: Q203 = +Q203 - +", "FN 2: Q203 = +Q203 - +1"),
        (KLARTEXT, "heidenhain", "Q201=-17.5", "Q201=-17.6"),
        (KLARTEXT, "heidenhain", "CYCL CALL", ""),
        (KLARTEXT, "heidenhain", " M99", ""),
    ],
)  # fmt: skip
def test_what_stands_round_a_hole_is_compared(text: str, dialect: str, right: str, wrong: str, number: bool) -> None:
    text = numbered(text, dialect) if number else text
    good = corrected(text, dialect)
    at = good.rindex(right) if right in good else good.rindex(right := right[:-1])
    bad = good[:at] + wrong + good[at + len(right) :]
    assert judged(text, bad, dialect).faults, bad


@pytest.mark.parametrize(
    ("call", "bottom"),
    [
        ("CYCLE81(50,10,2,-5)", -5.0),
        ("CYCLE81(50,10,2,,5)", 5.0),
        ("CYCLE81(-50,10,2,,5)", 15.0),
        ("CYCLE81(50,10,2,-5,5)", None),  # two depths
        ("CYCLE81(50,10,2,-5,,0,1)", None),  # down to a diameter
        ("CYCLE83(50,10,2,-5,,5,,1,0,0,1,0,1)", None),  # along another axis
        ("CYCLE82(,10,2,-5)", None),
    ],
)
def test_a_call_says_where_its_hole_ends(call: str, bottom: float | None) -> None:
    found = HoleCall.of_arguments(call)
    assert (None if found is None else found.bottom) == bottom


def test_parameters_are_known_where_they_get_known_numbers() -> None:
    parameters: dict[str, float | None] = {}
    for line in (
        "CYCL DEF 200 DRILLING Q200=+2 Q201=-20,5 Q203=+1 ~",
        "Q204=+Q9 ;CLEARANCE",
        "Q200 = +3 * +2",
        "Q100=+1",
    ):
        assign(line, parameters)
    assert parameters == {"Q200": 6.0, "Q201": -20.5, "Q203": 1.0, "Q204": None, "Q100": None}
    assign("FN 1: Q203 = +Q203 + -0.25", parameters)
    assert parameters["Q203"] == 0.75
    assign("FN 2: Q203 = +Q203 - -0.25", parameters)
    assert parameters["Q203"] == 1.0
