"""What `fix` and the second reader once followed in different ways: the tool before the first call, the tip, odd lines.

A disagreement is a fault of one of them, and looks like a fault of the program.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import pytest

from certificate.planting import machine
from ncfix.certificate.proof import prove
from ncfix.cli.shop.certificates import given_of
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.control.setup import Setup, Tool
from ncfix.machine import Machine
from ncfix.text.dialect import get
from ncfix.text.reader import read


class Shop(NamedTuple):
    """A program with the dialect and machine that it is for, and how many of its motions are proved."""

    dialect: str
    machine: str
    text: str
    proved: int
    tcp: bool = False


CASES = {
    "the setup says that X Y Z are those of the tip, and G49 does not change that": Shop(
        "linuxcnc", "table", "G21 G90 G17 G49 G54\nG0 X1 Y2 Z50 A0 C0\nG1 X30 Y40 A20 F500\nM2\n", 2, tcp=True
    ),
    "no TRAFOOF either": Shop(
        "siemens",
        "table",
        "G17 G71 G90\nT1 D1 M6\nTRAFOOF\nG0 X1 Y2 Z50 A0 C0\nG1 X30 Y40 A20 F500\nM30\n",
        2,
        tcp=True,
    ),
    "SINUMERIK begins with the tool in the spindle and its edge": Shop(
        "siemens", "three", "G1 X10 Y20 Z30 F500\nG71 G17\nT1 D1\nM6\nG0 X5 Y6 Z50\nM30\n", 2
    ),
    "a tool 0 that M6 brings has no edge": Shop(
        "siemens", "three", "G17 G71 G90\nM6\nG54\nG0 X1 Y2 Z200\nX50 Z9\nM30\n", 2
    ),
    "Klartext begins with the tool in the spindle": Shop(
        "heidenhain",
        "three",
        "BEGIN PGM A MM\nL X+5 Y+6 Z+70 F500\nTOOL CALL 1 Z S800\nL X+9 Y+9 Z+60\nEND PGM A MM\n",
        2,
    ),
    "a circle with M5 that becomes a CP with a pole of its own": Shop(
        "heidenhain",
        "three",
        "0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S800\n2 L X-16.117 Y+57.421 Z+2.168 F500\n3 CC X+0.073 Y+77.912\n"
        "4 C X+16.263 Y+98.403 DR- M5\n5 L X+9 Y+9 Z+60\n6 END PGM A MM\n",
        3,
    ),
    "a carriage return within a line": Shop(
        "siemens", "three", "G17 G71 G90\nT1 D1\nM6\nG0 X1 Y2 Z200\nG1 X50\r Z9 F500\nY3\nM30\n", 1
    ),
    "a work offset with block delete, and rotary axes": Shop(
        "iso", "table", "G21 G90 G17 G54\nG0 X-61 Y-22 Z41 A-65 C52\n/G55\nX6 Y-48 Z0\nG1 X40 C-43. F200\nM2\n", 3
    ),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_both_readers_follow_alike(case: Shop) -> None:
    tools = {number: Tool(length, 3.0) for number, length in ((0, 80.0), (1, 60.0))}
    setup, known, dialect = Setup(tools=tools, assume_zero=True, tcp=case.tcp), machine(case.machine), get(case.dialect)
    text = case.text.encode()
    options = FixOptions(verify=False, allow_refused=True, tolerance_um=5.0)
    fixed = fix_program(read(text, "part", dialect), known, setup, options).text
    proof = prove(text, fixed, known, given_of(setup, dialect), case.dialect)
    assert not proof.faults
    assert proof.proved_motions >= case.proved


PLAIN = "G21 G90 G17 G54\nG0 X10 Y20 Z30\nG1 X50 Y60 F500\nG93\nG1 X90 F2.\nM2\n"


def corrected() -> tuple[bytes, Machine]:
    """`PLAIN` for a machine whose corrections lead X a little below 10 mm."""
    known = machine("three")
    fixed = fix_program(read(PLAIN.encode(), "part", get("linuxcnc")), known, Setup(assume_zero=True), FixOptions())
    return fixed.text, known


def faults_of(text: bytes, known: Machine) -> list[str]:
    """What the second reader says of a correction of `PLAIN`."""
    given = given_of(Setup(assume_zero=True), get("linuxcnc"))
    return [fault.text for fault in prove(PLAIN.encode(), text, known, given, "linuxcnc").faults]


def test_corrections_within_the_limits_of_the_machine() -> None:
    text, known = corrected()
    small = known.replace(max_correction=(0.001, 1.0))
    short = known.replace(
        axes=tuple(replace(axis, range=(10.0, 1000.0)) if axis.name == "X" else axis for axis in known.axes)
    )
    assert not faults_of(text, known)
    assert "a correction is larger than the machine file allows" in faults_of(text, small)
    assert "the corrected motion leaves the travel of an axis" in faults_of(text, short)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (b"F500", b"F501", "words that are no axes have changed"),
        (b"F2.", b"F2.1", "the pieces take another time than the block"),
    ],
)
def test_feeds_are_those_of_the_original(old: bytes, new: bytes, fault: str) -> None:
    text, known = corrected()
    assert faults_of(text.replace(old, new), known) == [fault]
