"""What `fix` and the second reader once followed in different ways: the tool before the first call, the tip, odd lines.

A disagreement is a fault of one of them, and looks like a fault of the program.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import pytest

from certificate.planting import SETUP, machine
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
    "another tool in rotated coordinates, whose length is not turned": Shop(
        "siemens",
        "table",
        "G17 G71 G90\nT1 D1 M6\nG54\nG0 X0 Y0 Z60 A0 C0\nAROT X32 Z12\nT2 D1 M6\nG0 X0 Y0 Z60\nG1 X40 Z50 F500\nM30\n",
        3,
    ),
    "another length in coordinates that are turned about Y": Shop(
        "fanuc",
        "table",
        "G21 G18 G90 G54\nG43 H1\nG0 X10. Y5. Z30. A0. C0.\nG68 X10. Z5. R20.\nG43 H2\nG0 X10. Y6. Z30.\n"
        "G1 X22. Z20. F500.\nG69\nG0 X0. Y0. Z60.\nM30\n",
        4,
    ),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_both_readers_follow_alike(case: Shop) -> None:
    tools = {number: Tool(length, 3.0) for number, length in ((0, 80.0), (1, 60.0), (2, 95.0))}
    setup, known, dialect = Setup(tools=tools, assume_zero=True, tcp=case.tcp), machine(case.machine), get(case.dialect)
    text = case.text.encode()
    options = FixOptions(figures=False, allow_refused=True, tolerance_um=5.0)
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
        (b"F500", b"F501", "words other than axis words have changed"),
        (b"F2.", b"F2.1", "the pieces have another duration than the block"),
    ],
)
def test_feeds_are_those_of_the_original(old: bytes, new: bytes, fault: str) -> None:
    text, known = corrected()
    assert faults_of(text.replace(old, new), known) == [fault]


KLARTEXT = "BEGIN PGM A MM\nTOOL CALL 1 Z S800\nL X+0 Y+0 Z+100 FMAX\n{}END PGM A MM\n"
DIGITS = {
    "a word of finer digits that is left, for the control rounds it": (
        "three",
        FixOptions(figures=False),
        "heidenhain",
        "L X-5.9013 Y+6.2 Z+38.32 FMAX\nL X-17.933 Y+17.6069 F500\nCC X-21.308 Y+16.6778\nC X-22.5326 Y+19.9572 DR-\n",
    ),
    "an axis that finer digits have brought to its place": (
        "three",
        FixOptions(figures=False, tolerance_um=2.0),
        "heidenhain",
        "L X-16.3434 Y+8.8125 FMAX\nL Z+40.0000 FMAX\nL Z+39.3173 F1000\n"
        "CC X-19.6132 Y+20.7746\nC X-31.8124 Y+18.5467 DR-\n",
    ),
    "finer digits in rotated coordinates": (
        "three",
        FixOptions(figures=False, strategy="position", tolerance_um=5.0),
        "heidenhain",
        "CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+90\nL X+2.011 Y-0.2777 FMAX\nL Z+36.91 F640\nL X+21.6242 F640\n",
    ),
    "a piece near the end of its block where rotary axes are corrected, too": (
        "table",
        FixOptions(figures=False, strategy="full"),
        "iso",
        "G21 G17 G40 G90 G94\nT1 M6\nG54\nG43 H1\nG0 X2.85 Y-2.8 Z30.57 A12. C41.\nG1 Z26.63 F1000.\n"
        "G3 X-6.82 Y4.02 Z26.48 I-5.13 J2.99\nG1 X-6.42 Y6.51\nG3 X-4.51 Y-18.64 I2.73 J-12.44\nG0 Z90.\nM2\n",
    ),
}


@pytest.mark.parametrize(("name", "options", "dialect", "text"), DIGITS.values(), ids=DIGITS)
def test_digits_and_near_ends_are_no_alarm(name: str, options: FixOptions, dialect: str, text: str) -> None:
    """Each was one in a program as a CAM system writes it."""
    source = (KLARTEXT.format(text) if dialect == "heidenhain" else text).encode()
    known, language = machine(name), get(dialect)
    fixed = fix_program(read(source, "part", language), known, SETUP, options).text
    proof = prove(source, fixed, known, given_of(SETUP, language), dialect)
    assert not proof.faults
    assert proof.proved_motions == proof.motions


def test_a_word_that_acts_at_the_end_of_a_split_block() -> None:
    """It goes to the last piece, and may be written without a blank before it."""
    text = b"G21 G17 G90 G94 G54\nG0 X0. Y0. Z50.\nG1 X80. Y70. F500.\nG1 X-80.G9Y-70.\nX-61. Y32. G09\nM2\n"
    fixed = fix_program(read(text, "part", get("iso")), machine("three"), Setup(assume_zero=True), FixOptions()).text
    given = given_of(Setup(assume_zero=True), get("iso"))
    assert fixed.count(b"\n") > text.count(b"\n") + 1  # besides the stamp
    assert not prove(text, fixed, machine("three"), given, "iso").faults
    assert prove(text, fixed.replace(b" G09", b""), machine("three"), given, "iso").faults


CONTROLS = {
    "G28 of Haas ends the length": (
        "haas",
        "G43 H1 Z90.\nG91 G28 Z0.\nG90 G0 X10. Y10.\nZ95.\nG1 Z92. F300.\nX30.\n",
        True,
    ),
    "G54 P2 is no G54": ("fanuc", "G54 P2\nG0 X10. Y10.\nG1 X30. F300.\nG54\nX20. Y20.\n", False),
    "G54 beside a dwell": ("fanuc", "G54 G4 P200\nG0 X10. Y10.\nG1 X30. F300.\n", True),
    "G30 P3 is not the second point": ("fanuc", "G91 G30 P3 Z0.\nG90 G0 Z60.\nG1 X30. F300.\n", True),
    "H alone is another length": ("fanuc", "G43 H1 Z90.\nH2\nG0 Z80.\nG1 X30. F300.\nX10.\n", False),
    "H0 is no length": ("fanuc", "G43 H0 Z90.\nG1 X30. F300.\nX10.\n", False),
    "H0 beside G49": ("fanuc", "G49 H0\nZ90.\nG1 X30. F300.\nX10.\n", True),
    "G43 without H is the last one": ("fanuc", "G43 H1 Z90.\nT2 M6\nG43 Z80.\nG1 X30. F300.\nX10.\n", False),
    "G5 P10001 moves axes": ("fanuc", "G5 P10001\nG1 X30. F300.\nG0 X10. Y10. Z60.\nG1 X20. F300.\n", False),
    "G5 P10000 moves none": ("fanuc", "G5 P10000\nG1 X30. F300.\nG0 X10. Y10. Z60.\nG1 X20. F300.\nG5 P0\n", True),
}


@pytest.mark.parametrize(("dialect", "text", "all_of_it"), CONTROLS.values(), ids=CONTROLS)
def test_what_controls_of_one_family_do_differently_is_no_alarm(dialect: str, text: str, all_of_it: bool) -> None:
    places = {"G54": {"X": 5.0, "Y": 6.0, "Z": 7.0}, "G54.1P2": {"X": -20.0, "Y": 3.0, "Z": 9.0}}
    tools = {0: Tool(60.0), 1: Tool(80.0), 2: Tool(45.5)}
    setup = replace(SETUP, tools=tools, work_offsets=places, references={"G28": {"Z": 150.0}, "G30": {"Z": 120.0}})
    source = f"%\nO1\nG21 G17 G40 G49 G80 G90 G94 G54\nT1 M6\nG0 X0. Y0. Z80.\n{text}M30\n%\n".encode()
    known, language = machine("three"), get(dialect)
    fixed = fix_program(read(source, "part", language), known, setup, FixOptions(allow_refused=True)).text
    proof = prove(source, fixed, known, given_of(setup, language), language.variant_of or dialect)
    assert not proof.faults
    assert (proof.proved_motions >= proof.motions - 2) is all_of_it, dict(proof.reasons)
