"""The second reader works out formulas of known values; those that controls take differently get none."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from certificate.planting import SETUP, machine
from ncfix.certificate.coordinates import Given
from ncfix.certificate.findings import BlockProof
from ncfix.certificate.formulas import LONGEST, value_of
from ncfix.certificate.proof import prove
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat, fix_program
from ncfix.control.setup import Tool
from ncfix.text.dialect import get
from ncfix.text.reader import read

KNOWN = {"#1": 8.0, "#<DEPTH>": -2.5, "Q5": 3.0, "R12": 0.5, "#2": None}


@pytest.mark.parametrize(
    ("formula", "value"),
    [
        ("[#1*-5.0]", -40.0),
        ("-[#1 - 3 - 2]", -3.0),
        ("#1/2/2", 2.0),
        ("[#<depth>+#1]", 5.5),
        ("#<De pth>", -2.5),
        ("SQRT[#1*2]", 4.0),
        ("2*SIN[30]+COS [60.]", 1.5),
        ("( Q5 + 1 ) * +Q5", 12.0),
        ("Q5 ^ 2", 9.0),
        ("SQ Q5 + 1", 10.0),
        ("SQRT ( Q5 * Q5 + 16 )", 5.0),
        ("-R12*4+POT(3)", 7.0),
        ("+.5", 0.5),
        # not known, or not alike on all controls
        ("#2", None),
        ("#3", None),
        ("##1", None),
        ("#[1]", None),
        ("-#1**2", None),
        ("SIN 30 ^ 2", None),
        ("ROUND[#1]", None),
        ("ATAN[1]/[2]", None),
        ("[#1 EQ 8]", None),
        ("#1 MOD 3", None),
        ("IC(R12)", None),
        # no formulas
        ("", None),
        ("[#1", None),
        ("#1]", None),
        ("(#1]", None),
        ("#1 #1", None),
        ("1E5", None),
        ("#1/0", None),
        ("SQRT[-1]", None),
        ("[-8]**.5", None),
        ("9**9**9**9", None),
        ("[" * LONGEST, None),
        ("1+" * LONGEST + "1", None),
    ],
)
def test_values(formula: str, value: float | None) -> None:
    found = value_of(formula, KNOWN)
    assert found == value or (value is not None and found is not None and math.isclose(found, value, rel_tol=1e-15))


HEAD = {
    "linuxcnc": "G21 G90 G94\nG54\n#3=4.\n#<wide>=[#3*5]\nG0 X0. Y0. Z50.",
    "fanuc": "%\nO1\nG21 G90 G94\nG54\n#3=4.\n#5=#3*5.\nG0 X0. Y0. Z50.",
    "siemens": "G71 G90 G94\nG54\nR3=4 R4=R3*5\nG0 X0 Y0 Z50",
    "heidenhain": "0 BEGIN PGM A MM\n1 FN 4: Q3 = +8 DIV +2\n2 Q5 = Q3 * 5,0\n3 L X+0 Y+0 Z+50 R0 FMAX",
}
CUT = {
    "linuxcnc": "G1 X[#<wide>+.5] Y[-#3] Z-1. F500\nX#<wide> Y-#3\nG2 X[#<wide>+10] Y[-#3] I5. J0.",
    "fanuc": "G1 X[#5+.5] Y[-#3] Z-1. F500\nX#5 Y-#3\nG2 X[#5+10.] Y[-#3] I5. J0.",
    "siemens": "G1 X=R4+.5 Y=-R3 Z-1 F500\nX=R4 Y=-R3\nG2 X=R4+10 Y=-R3 I5 J0",
    "heidenhain": "4 Q6 = Q5 + ,5\n5 L X+Q6 Y-Q3 Z-1 F500\n6 L X+Q5 Y-Q3\n7 L IX+Q3 IY-Q3",
}
END = {"heidenhain": "8 END PGM A MM", "fanuc": "M30\n%"}


def proof_of(dialect: str, more: str = "", change: tuple[bytes, bytes] = (b"", b"")) -> BlockProof:
    """The proof of a correction; `more` stands before what cuts."""
    lines = [HEAD[dialect], *([more] if more else []), CUT[dialect], END.get(dialect, "M30"), ""]
    source, three = "\n".join(lines).encode(), machine("three")
    setup = replace(SETUP, tools={0: Tool(80.0, 3.0)})
    given = Given(SETUP.work_offsets, {0: 80.0}, SETUP.initial)
    fixed = fix_program(read(source, "part", get(dialect)), three, setup, FixOptions(allow_refused=True)).text
    assert fixed.replace(*change, 1) != source
    return prove(source, fixed.replace(*change, 1), three, given, dialect)


@pytest.mark.parametrize("dialect", HEAD)
def test_motions_of_known_formulas_are_proved(dialect: str) -> None:
    proof = proof_of(dialect)
    assert (proof.faults, proof.left) == ([], {})
    assert proof.proved_motions == proof.motions == 4


@pytest.mark.parametrize(
    ("dialect", "change"),
    [
        ("linuxcnc", (b"#3=4.", b"#3=4.1")),
        ("fanuc", (b"#3*5.", b"#3*4.")),
        ("siemens", (b"R4=R3*5", b"R4=R3*6")),
        ("heidenhain", (b"+8 DIV", b"+9 DIV")),
        ("heidenhain", (b"Q5 + ,5", b"Q5 - ,5")),
    ],
)
def test_a_formula_that_has_changed_is_found(dialect: str, change: tuple[bytes, bytes]) -> None:
    assert proof_of(dialect, change=change).faults


@pytest.mark.parametrize(
    ("dialect", "more"),
    [
        ("linuxcnc", "#3=#8"),
        ("linuxcnc", "#3=[ROUND[4.2]]"),
        ("linuxcnc", "#3=4. #<wide>=20."),
        ("linuxcnc", "#5221=10."),
        ("fanuc", "#3=#8"),
        ("fanuc", "#2001=80."),
        ("siemens", "R3=TRUNC(4.2)"),
    ],
)
def test_what_is_not_known_is_not_proved(dialect: str, more: str) -> None:
    proof = proof_of(dialect, more)
    assert proof.faults == []
    assert proof.proved_motions < proof.motions


def test_every_block_of_a_loop_that_was_written_out_is_counted_once() -> None:
    loop = "#8=0\nWHILE [#8 LE 30.] DO1\nG0 X[#8] Y0.\nG1 Z-3. F300\nY15.\nG0 Z5.\n#8=[#8+10.]\nEND1"
    source, three = f"%\nO1\nG21 G90 G94 G54\nG0 X0. Y0. Z50.\n{loop}\nM30\n%\n".encode(), machine("three")
    setup = replace(SETUP, tools={0: Tool(80.0, 3.0)})
    fixed = fix_flat(read(source, "part", get("fanuc")), three, setup, FixOptions(flatten=True)).text
    proof = prove(source, fixed, three, Given(SETUP.work_offsets, {0: 80.0}, SETUP.initial), "fanuc")
    assert proof.faults == []
    assert proof.blocks == proof.proved + proof.unproved
