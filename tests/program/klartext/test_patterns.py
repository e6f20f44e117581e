"""Patterns of holes: where they are, worked out by hand, and written out flat."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat
from ncfix.control.moves import MotionKind, Rule
from ncfix.text.reader import read
from program.klartext.tnc import KNOWN, THREE, follow, program

DRILL = "CYCL DEF 200 D Q200=2 Q201=-15 Q203=+1 Q204=10\nL X+0 Y+0 Z+50 FMAX\n"
HALF = 0.5 * math.sqrt(3)

PATTERNS = {
    "POS1 (X+25 Y+33.5 Z+2) ~\n POS2 (X+15 IY+6.5 Z+0)": [(25, 33.5, -12), (15, 40, -14)],
    "ROW1 (X+5 Y+3 D+8 NUM3 ROT+90 Z+0)": [(5, 3, -14), (5, 11, -14), (5, 19, -14)],
    "PAT1 (X+0 Y+1 DX+2 DY+3 NUMX2 NUMY2 ROT+0 ROTX+0 ROTY+0 Z-1)": [
        (0, 1, -15),
        (2, 1, -15),
        (0, 4, -15),
        (2, 4, -15),
    ],
    "CIRC1 (X+1 Y+2 D20 START+90 NUM2 Z+0)": [(1, 12, -14), (1, -8, -14)],
    "PITCHCIRC1 (X+0 Y+0 D20 START+0 STEP30 NUM3 Z+0)": [(10, 0, -14), (10 * HALF, 5, -14), (5, 10 * HALF, -14)],
    "ROW1 (X+Q1 Y-Q1 D+8 NUM1 ROT+0 Z+0)": [(7, -7, -14)],
}


@pytest.mark.parametrize("text", PATTERNS)
def test_pattern_definitions(text: str) -> None:
    moves = follow(f"Q1 = 7\n{DRILL}PATTERN DEF {text}\nCYCL CALL PAT FMAX M3").moves
    holes = moves.kind == MotionKind.CYCLE
    assert moves.end[holes] == pytest.approx(np.array(PATTERNS[text]))
    assert (moves.rule[holes] == Rule.REFUSE).all()


def test_the_frame_of_a_pattern_is_its_outer_holes() -> None:
    moves = follow(DRILL + "PATTERN DEF FRAME1 (X+0 Y+0 DX+1 DY+1 NUMX4 NUMY3 ROT+0 Z+0)\nCYCL CALL PAT").moves
    assert np.count_nonzero(moves.kind == MotionKind.CYCLE) == 10


CIRCLE = (
    "CYCL DEF 220 POLAR PATTERN Q216=+10 Q217=+5 Q244=+80 Q245=+0 Q246=+{} Q247=+{} Q241=+{} Q200=+3 Q203=+2 Q204=+50\n"
)
LINES = (
    "CYCL DEF 221 CARTESIAN PATTERN Q225=+15 Q226=+5 Q237=+10 Q238=+8 Q242=+2 Q243=+2 Q224=+90 Q200=2 Q203=+2 Q204=50\n"
)


@pytest.mark.parametrize(
    ("cycle", "holes"),
    [
        (CIRCLE.format(360, 0, 4), [(50, 5), (10, 45), (-30, 5), (10, -35)]),
        (CIRCLE.format(90, 0, 2), [(50, 5), (10, 45)]),
        (CIRCLE.format(0, 90, 2), [(50, 5), (10, 45)]),
        (LINES, [(15, 5), (15, 15), (7, 5), (7, 15)]),
    ],
)
def test_cycles_of_patterns_drill_where_they_are_defined(cycle: str, holes: list[tuple[float, float]]) -> None:
    moves = follow(DRILL + cycle + "L X+1 FMAX").moves
    assert moves.end[1:-1] == pytest.approx(np.array([(*hole, -13) for hole in holes]))
    assert moves.end[-1].tolist() == pytest.approx([1, holes[-1][1], 52])


@pytest.mark.parametrize(
    "body",
    [
        DRILL + "PATTERN DEF POS1 (X+25 Y+33.5 Z+2) POS2 (X-15 IY+6.5 Z+0)\nCYCL CALL PAT FMAX M3\nL Z+80 FMAX",
        DRILL + CIRCLE.format(360, 0, 5) + "L X+1 FMAX M99\nL Z+80 FMAX",
        DRILL + LINES + "L X+1 FMAX",
    ],
)
def test_flat_patterns_are_corrected(body: str) -> None:
    source = read(program(body), "t.h")
    report = fix_flat(source, THREE, KNOWN, FixOptions()).report
    assert report.refused == ()
    assert report.error_after_um["max"] is not None
    assert report.error_after_um["max"] < 1.0


@pytest.mark.parametrize(
    "body",
    [
        "PATTERN DEF PAT1 (X+0 Y+0 DX+1 DY+1 NUMX4 NUMY3 ROT+0 ROTX+5 Z+0)\nCYCL CALL PAT",
        'SEL PATTERN "TNC:\\HOLES.PNT"\nCYCL CALL PAT',
        "PATTERN DEF ROW1 (X+Q99 Y+0 D+8 NUM1 ROT+0 Z+0)\nCYCL CALL PAT",
        "CYCL CALL PAT",
        "PATTERN DEF FRAME1 (X+0 Y+0 DX+1 DY+1 NUMX99999 NUMY99999 ROT+0 Z+0)\nCYCL CALL PAT",
        "CYCL DEF 221 LINES Q225=+0 Q226=+0 Q237=+1 Q238=+1 Q242=99999 Q243=99999 Q224=+0",
    ],
)
def test_patterns_that_are_not_known(body: str) -> None:
    moves = follow(DRILL + body + "\nL X+1 F100").moves
    assert moves.rule.tolist() == [Rule.CORRECT, Rule.REFUSE, Rule.REFUSE]
