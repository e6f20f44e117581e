"""Corrected blocks of SINUMERIK, as they are written: each keeps its manner. The machine is off by a constant shift."""

from __future__ import annotations

import random
import re
from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import traced
from ncfix.control.moves import MotionKind, Moves
from ncfix.control.setup import Setup, Tool
from ncfix.machine import load
from ncfix.testing.judging import SETUP, shifted_machine
from ncfix.text.reader import read


def written(body: str) -> str:
    """The body of a program, corrected by -12.4, 21.3 and 8.5 um."""
    source = f"G54 G0 X1 Y2 Z50\n{body}\nM30\n".encode()
    fixed = fix_program(
        read(source, "part.mpf", "siemens"), shifted_machine(), SETUP, FixOptions(tolerance_um=50, figures=False)
    )
    assert not fixed.report.refused
    lines = [line for line in fixed.text.decode().splitlines() if "ncfix" not in line]
    return "\n".join(lines[1:-1])


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("G1 X5 Y6 Z7 F100", "G1 X4.988 Y6.021 Z7.008 F100"),
        ("G1X5Y6.Z-.5F100", "G1X4.988Y6.021Z-.492F100"),
        ("g1 x5 y6", "g1 x4.988 y6.021"),
        ("G1 X=5 Y=-6.50 Z = 7", "G1 X=4.988 Y=-6.479 Z = 7.008"),
        ("G1 X=IC(5) Y=AC(3.)", "G1 X=IC(5) Y=AC(3.021)"),
        ("G91 G1 X5", "G91 G1 X5"),
        ("R1=5\nG1 X=R1*2 Y1", "R1=5\nG1 X=9.988 Y1.021"),
        ("G2 X11 Y12 CR=10", "G2 X10.988 Y12.021 CR=10"),
        ("G2 X11 Y12 I=AC(11) J=AC(2)", "G2 X10.988 Y12.021 I=AC(10.988) J=AC(2.021)"),
        ("G3 X11 Y12 AR=90", "G3 X10.988 Y12.021 J10.000"),
        ("G3 I0 J10 AR=90", "G3 I0 J10 X10.988 Y12.021"),
        ("CIP X21 Y2 I1=11 J1=12", "CIP X20.988 Y2.021 I1=10.988 J1=12.021"),
        ("G111 X5 Y5\nG1 AP=30 RP=10", "G111 X5 Y5\nG1 X13.648 Y10.021"),
        ("G1 X5 RND=2", "G1 X4.988 RND=2"),
        ("N10 G1 X5 ; note X5", "N10 G1 X4.988 ; note X5"),
        ("/G1 X5 Y5", "/G1 X4.988 Y5.021"),
        ("TRANS X3\nG1 X5", "TRANS X3\nG1 X4.988"),
        ("ROT RPL=90\nG1 X5", "ROT RPL=90\nG1 X5.021"),
        ("MIRROR X0\nG1 X5", "MIRROR X0\nG1 X5.012"),
        ("G700\nG1 X1", "G700\nG1 X0.99951 Y0.07958 Z1.96884"),
        ("SUPA G0 Z0", "SUPA G0 Z0"),
        ("LABEL: G1 X5 M8", "LABEL: G1 X4.988 M8"),
        (
            "MCALL CYCLE81(50,0,2,-20)\nX5\nMCALL",
            "MCALL CYCLE81(50,0,2,-20)\nMCALL CYCLE81(50,0,2,-19.991)\nX4.988\nMCALL CYCLE81(50,0,2,-20)\nMCALL",
        ),
        ("CYCLE82(50,0,2,-20.5,,0.3)", "CYCLE82(50,0,2,-20.491,,0.3)"),
        ("CYCLE82(50,0,2,,20)", "CYCLE82(50,0,2,,19.991)"),
        ("R1=-20\nCYCLE82(50,0,2,R1,,0.3)", "R1=-20\nCYCLE82(50,0,2,-19.991,,0.3)"),
        ("CYCLE83(50,0,2,-20,,-5,,2,0,0,1,0)", "CYCLE83(50,0,2,-19.991,,-4.991,,2,0,0,1,0)"),
    ],
)
def test_a_corrected_block_keeps_its_manner(body: str, expected: str) -> None:
    assert written(body) == expected


CRADLE = Path(__file__).parents[3] / "examples" / "machines" / "wCAYFXZSt.toml"


@pytest.mark.parametrize("turn", ["ACN(20)", "ACP(5)", "DC(350)"])
def test_a_turn_past_zero_is_not_split(turn: str) -> None:
    """The control counts from 0 to 360 degrees again after it: pieces in plain degrees would turn once more."""
    source = f"G54 G0 X10 Y0 Z100 A0 C10\nG1 F2000 X12 C={turn}\nX20 C=IC(90)\nM30\n".encode()
    program = read(source, "part.mpf", "siemens")
    text = fix_program(program, load(CRADLE), Setup(assume_zero=True), FixOptions(figures=False)).text.decode()
    after = text.split(f"C={turn}")[1].splitlines()
    assert "C=IC(" in after[1]
    (step,) = re.findall(r"C=IC\(([\d.]+)\)", text)
    assert 0 < float(step) <= 90


def test_a_motion_with_a_feed_of_its_own_is_not_split() -> None:
    source = b"G54 G0 X10 Y0 Z100 A0 C0\nG1 X12 F2000\nX20 FB=100\nX30\nM30\n"
    moves = traced(read(source, "part.mpf", "siemens"), load(CRADLE), Setup(assume_zero=True)).moves
    assert moves.whole.tolist() == [False, False, True, False]


def on_the_cradle(body: str) -> tuple[str, Moves]:
    """A corrected program, the direction of the tool included, and its motions."""
    source = f"T1 D1 M6\nG54\nTRAORI\nORIAXES\n{body}\nM30\n".encode()
    cradle, setup = load(CRADLE), Setup(tools={1: Tool(80.0)}, assume_zero=True)
    options = FixOptions(strategy="full", figures=False)
    fixed = fix_program(read(source, "part.mpf", "siemens"), cradle, setup, options)
    assert not fixed.report.refused
    again = read(fixed.text, "part.mpf", "siemens")
    return fixed.text.decode(), traced(again, cradle, setup).moves


def test_a_full_circle_ends_where_it_starts() -> None:
    """An output step beside its start it would be next to nothing; in a turned frame no number says where that is."""
    chance = random.Random(3)
    lines = []
    for code in (2, 3, 2, 2, 3, 3, 2, 3):
        x, y, turn, i, j = (
            round(chance.uniform(*limits), 2) for limits in (*[(-20, 20)] * 2, (-60, 60), *[(2, 5)] * 2)
        )
        words = f"X{x} Y{y}" if code == 2 else ""
        lines += [f"ROT RPL={turn}", f"G0 X{x} Y{y} Z20 A{x} C{y}", f"G{code} {words} I{i} J{j} F500"]
    _, moves = on_the_cradle("\n".join(lines))
    turns = moves.sweep[moves.kind == MotionKind.ARC]
    assert np.allclose(np.abs(turns), 2 * np.pi, atol=1e-9)
    assert len(turns) == 8


def test_a_turn_that_hardly_turns_does_not_go_the_other_way_round() -> None:
    text, moves = on_the_cradle("G0 X0 Y0 Z40 A20 C30\nG1 X20 C=ACN(30) F100\nX-5 C=ACP(30)\nX7 C=DC(30)")
    assert "C=IC(" in text
    assert np.abs(np.degrees(moves.end[:, moves.axes.index("C")]) - 30).max() < 0.01


@pytest.mark.parametrize(
    ("block", "given", "why"),
    [
        ("G1 X5 A2=10 B2=20 F100", {}, "ORIEULER"),
        ("G1 X5 A2=10 B2=20 F100", {"$MC_ORIENTATION_IS_EULER": 1.0}, ""),
        ("ORIRPY2\nG1 X5 A2=10 B2=20 F100", {}, ""),
        ("ORIVIRT1\nG1 X5 A2=10 B2=20 F100", {}, "ORIEULER"),
        ("ORIRPY\nG1 X5 A2=10 A3=0 C3=1 F100", {}, "more than one way"),
        ("ORICONCW\nG1 X5 A3=0.1 C3=1 F100", {}, "cone"),
        ("G1 X5 LEAD=5 F100", {}, "LEAD"),
    ],
)
def test_directions_are_taken_or_refused_in_words(block: str, given: dict[str, float], why: str) -> None:
    source = f"T1 D1 M6\nG54\nTRAORI\nG0 X0 Y0 Z40 A5 C5\n{block}\nG0 Z50 A5 C5\nM30\n".encode()
    setup = Setup(tools={1: Tool(80.0)}, variables=given, assume_zero=True)
    fixed = fix_program(read(source, "part.mpf", "siemens"), load(CRADLE), setup, FixOptions(figures=False))
    reasons = [refusal.reason for refusal in fixed.report.refused]
    assert all(why in reason for reason in reasons)
    assert bool(reasons) == bool(why)
