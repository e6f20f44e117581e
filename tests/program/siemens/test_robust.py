"""Random programs: each is followed or refused with a coded error, and what may be corrected is known."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from conftest import some
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import kinematics_of
from ncfix.control.moves import MotionKind, Rule
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine, load
from ncfix.text.reader import read
from program.siemens.following import SYSTEMS, ZERO

SETUP = Setup(
    work_offsets=dict.fromkeys(SYSTEMS, ZERO),
    tools={number: Tool(100.0, 5.0) for number in range(3)},
    initial={**ZERO, "Z": 200.0},
)
BLOCKS = """G0 X10 Y20 Z5|G1 X=IC(5) F100|G2 X20 Y3 CR=7.5|G3 I5 J0|X30 Y40|X1 Y1 Z1 A1 C1|G91|G90|G700|G710|G41|G40
TRANS X10|AROT Z30|MIRROR X0|SCALE X2 Y2 Z2|ATRANS|G58 X1|G54|G500|G18|G17|DIAMON|DIAMOF|SUPA G0 Z0|G75 Z0
TRAORI|TRAFOOF|A3=0.1 B3=0.2 C3=1|A3=0 B3=0 C3=1 X5|CYCLE800(0,"T",200000,57,15,0,0,0,30,0,0,0,0,-1)|CYCLE800()
MCALL CYCLE81(50,0,2,-20)|MCALL|HOLES1(1,2)|AP=30 RP=10|G111 X1 Y1|CIP X10 I1=5 J1=5|C=DC(30)|A=IC(10)|T1 D1 M6
R1=R1+1|IF R1>2 GOTOF DOWN|DOWN: X5|IF NOBODY==1 GOTOF DOWN|X=NOBODY|DEF REAL QQ=5|X=QQ|POS[X]=5|RND=2 X5|G4 F1|SUB1
RNDM=2|HOLES2(1,2,9,0,0,5)|TURN=1 I5 J0|X10..5|=|MSG("x")|OTHER "x" 5|%|/X7|N10|;|BSPLINE X5|G64"""
CHOICE = [block for line in BLOCKS.split("\n") for block in line.split("|")]
SEEDS = some(150)


def text_of(seed: int) -> str:
    """Some blocks in a row."""
    chance = random.Random(seed)
    return "\n".join(chance.choice(CHOICE) for _ in range(chance.randint(3, 20))) + "\nM30\n"


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/wCAYFXZSt.toml"))


def test_what_may_be_corrected_is_known(machine: Machine) -> None:
    followed = 0
    for seed in range(SEEDS):
        try:
            program = read(text_of(seed).encode(), "part.mpf", "siemens")
            kinematics = kinematics_of(machine)
            setup = replace(SETUP, most_blocks=3000)
            moves = trace(program, setup, machine.axis_names, frozenset("AC"), None, kinematics).moves
        except NcfixError:
            continue
        followed += 1
        free = moves.rule == Rule.CORRECT
        cut = free & (moves.kind != MotionKind.RAPID) & (moves.kind != MotionKind.DWELL)
        assert not np.isnan(moves.end[free]).any(), seed
        assert not np.isnan(moves.start[cut]).any(), seed
        assert not np.isnan(moves.centre[free & (moves.kind == MotionKind.ARC)]).any(), seed
    assert followed > SEEDS / 3


@pytest.mark.parametrize("strategy", ["rotary-then-linear", "full"])
def test_what_is_written_is_read_as_meant(machine: Machine, strategy: str) -> None:
    """The product reads its own text again and would raise a fault of its own if it meant something else."""
    fixed = 0
    for seed in range(SEEDS, SEEDS + some(40)):
        try:
            program = read(text_of(seed).encode(), "part.mpf", "siemens")
            fix_program(program, machine, SETUP, FixOptions(strategy=strategy, figures=False))
        except NcfixError:
            continue
        fixed += 1
    assert fixed > some(40) / 4


ODD = {
    "no length under TRAORI": (
        "G54\nT1 D1 M6\nTRAORI\nG0 X1 Y2 Z30\nD0\nSUPA G0 A0 C0\nHEAD_CLEAN\nSUPA G0 A0 C0\nCYCLE81(50,0,2,2)"
    ),
    "rotary axes that nobody knows": (
        "G54\nTRAORI\nG0 X1 Y2 Z30\nD0\nX=$AA_IM[X]\nORIMKS\nC=ACN(200)\nTRAFOOF\nCT X5 Y5\nG3 I5 J0"
    ),
    "an axis that is known at run time only": (
        "G54\nT1\nTRAORI\nG0 X0 Y0 Z40\nG1 X10 A20 C30 F100\nX20 A=$AA_IM[A]\nG1 X5\nTRAFOOF\nX1"
    ),
    "a circle after a hole": (
        "G54\nT1 D1 M6\nTRAORI\nG0 X1 Y2 Z30 A5 C6\nMCALL CYCLE81(50,0,2,-20)\nCYCLE81(50,0,2,2)\nG3 I5 J0 F100"
    ),
    "inverse time without F": ("G54\nT1 D1 M6\nG0 X0 Y0 Z80 A0 C0\nG93 F5\nG1 X90 A20 C30\nX1 Y1 Z1 A1 C1"),
    "expressions that stay": ("G54\nT1 D1 M6\nG0 X0 Y0 Z80 A0 C0\nG1 X=AC(0.001*3) Y=AC(1/3) C=AC(3*5) F100"),
}
"""Programs after whose correction the control once would not have stood where the book said."""


@pytest.mark.parametrize("strategy", ["position", "rotary-then-linear", "full"])
@pytest.mark.parametrize("name", ODD)
def test_odd_programs_are_followed_to_their_end(name: str, strategy: str, machine: Machine) -> None:
    program = read(f"{ODD[name]}\nM30\n".encode(), "part.mpf", "siemens")
    setup = replace(SETUP, initial={}, assume_zero=True)
    fixed = fix_program(program, machine, setup, FixOptions(strategy=strategy, figures=False))
    assert fixed.changed or fixed.report.refused  # what a refused CT begins from stays as it is
