"""Klartext programs corrected part by part come out, byte for byte, as they do as a whole."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from compensate.streaming import assert_alike, compared, streamed, whole
from conftest import require_core
from ncfix import core
from ncfix.control.trace import NotInPartsError
from ncfix.machine import Machine, load

ODDS = (
    "; point 3",
    "* - a part",
    "",
    "L Z+60 FMAX",
    "L X+20 Y+20 R0 FMAX M8",
    "M129\nTOOL CALL 2 Z S8000\nL X+20 Y+20 Z+5 B+10 C+30 R0 FMAX",
    "M128\nL X+20 Y+20 Z+5 B+10 C+30 F500",
    "M129\nL X+20 Y+20 Z+5 B+10 C+30 F500",
    "L X+20 Y+20 Z+5\nCC X+21 Y+20\nC X+22 Y+20 DR+",
    "CC X+22 Y+20\nL X+20 Y+20 Z+5\nCP IPA+90 DR+",
    "L X+20 Y+20 Z+5\nCR X+22 Y+22 R+2 DR+\nCT X+23 Y+24",
    "L X+20 Y+20 Z+5 RL\nRND R0.5\nL X+24 Y+21 R0",
    "L X+20 Y+20 Z+5\nRND R0.5\nCC X+22 Y+20\nC X+24 Y+20 DR+",
    "L IX+0.5 IY-0.25",
    "Q1 = 3.5\nL Z+Q1",
    "LN X+20 Y+20 Z+5 NX+0 NY+0 NZ+1",
    "M129\nL B+0 C+0 FMAX\nPLANE SPATIAL SPA+0 SPB+0 SPC+20 STAY\nL X+0 Y+0 Z+50 R0 FMAX\nPLANE RESET STAY\n"
    "L X+20 Y+20 Z+5 B+10 C+30 R0 FMAX",
    "CYCL DEF 200 DRILLING ~\nQ200=2 ;SAFETY CLEARANCE ~\nQ201=-2 ;DEPTH ~\nQ206=100 ~\nQ202=2 ~\nQ210=0 ~\n"
    "Q203=+5 ~\nQ204=20 ~\nQ211=0\nL X+20 Y+20 FMAX M99",
    "CYCL DEF 7.0 DATUM\nCYCL DEF 7.1 X+1",
    "L X+9000",
)
WHOLE = {
    "LBL 1\nL X+1\nLBL 0": "straight",
    "CALL LBL 1": "straight",
    "FN 9: IF +Q1 EQU +1 GOTO LBL 3": "straight",
    "CALL PGM OTHER.H": "calls|pole",
    "SEL PGM OTHER.H": "calls",
    "FL X+21 Y+20": "free",
    "L X+1,5": "commas",
    "CC IX+1": "pole",
}
"""What makes a program one that is taken as a whole, and why."""


def program(seed: int, lines: int, odd: float, *, comma: bool = False) -> bytes:
    """A path that winds about, with all words or only those that change, and now and then something else."""
    rng = Random(seed)
    full, numbered = rng.random() < 0.5, rng.random() < 0.5
    at = [20.0, 20.0, 5.0, 10.0, 30.0]
    out = ["BEGIN PGM P MM", "BLK FORM 0.1 Z X+0 Y+0 Z-20", "BLK FORM 0.2 X+50 Y+50 Z+0", "TOOL CALL 1 Z S5000"]
    out += ["M128"] * (seed % 2) + ["L X+20 Y+20 Z+5 B+10 C+30 R0 FMAX", "L Z+4.5 F800"]
    for _ in range(lines):
        if rng.random() < odd:
            out += rng.choice(ODDS).split("\n")
        at = [value + rng.uniform(-1, 1) * rng.choice((0.0, 0.3, 2.0)) for value in at]
        chosen = [i for i in range(5) if full or rng.random() < 0.5] or [0]
        words = " ".join(f"{'XYZBC'[i]}{at[i]:+.{rng.choice((3, 4))}f}" for i in chosen)
        out.append(f"L {words}" + " F900" * (rng.random() < 0.05))
    out += ["M129", "L Z+100 R0 FMAX M30", "END PGM P MM"]
    text = "\n".join(f"{n} {line}" for n, line in enumerate(out)) if numbered else "\n".join(out)
    text = text.replace(".", ",").replace("BLK FORM 0,", "BLK FORM 0.") if comma else text
    return (rng.choice((text, text.replace("\n", "\r\n"))) + "\n").encode()


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(root / "benchmarks" / "five_axis.toml")


@pytest.mark.parametrize("seed", range(3))
def test_plain_programs_are_done_in_parts(seed: int, machine: Machine) -> None:
    assert compared(program(seed, 40, 0.0, comma=seed % 3 == 0), machine, "heidenhain", 500) == ""


@pytest.mark.parametrize("seed", [14, 16, 20, 22, 24, 26])
def test_parts_as_the_whole(seed: int, machine: Machine) -> None:
    assert compared(program(seed, 70, 0.1), machine, "heidenhain", 700) == ""


@pytest.mark.parametrize("jobs", [2])
def test_several_processes_give_the_same_bytes(jobs: int, machine: Machine) -> None:
    source = program(jobs, 100, 0.0)
    one = streamed(source, machine, "heidenhain", 1500)
    assert_alike(streamed(source, machine, "heidenhain", 1500, jobs), one)


def test_the_compiled_core_gives_the_same_bytes(machine: Machine) -> None:
    require_core()
    source = program(4, 100, 0.0)
    plain = streamed(source, machine, "heidenhain", 4000)[0]
    core.use("compiled")
    assert streamed(source, machine, "heidenhain", 4000)[0] == plain
    assert whole(source, machine, "heidenhain")[0] == plain


@pytest.mark.parametrize("block", list(WHOLE))
@pytest.mark.parametrize("line", [5, 30])
def test_what_is_taken_as_a_whole(block: str, line: int, machine: Machine) -> None:
    lines = program(2, 40, 0.0).decode().splitlines()
    source = "\n".join([*lines[:line], block, *lines[line:], ""]).encode()
    with pytest.raises(NotInPartsError, match=WHOLE[block]):
        streamed(source, machine, "heidenhain", 800)


def test_an_arc_about_a_pole_of_an_earlier_part(machine: Machine) -> None:
    lines = [
        line.split(maxsplit=1)[1] if line[0].isdigit() else line for line in program(1, 60, 0.0).decode().splitlines()
    ]
    source = "\n".join([*lines[:6], "CC X+20 Y+20", *lines[6:-3], "L X+22 Y+20 Z+5", "CP IPA+90 DR+", *lines[-3:], ""])
    assert "pole" in compared(source.encode(), machine, "heidenhain", 400)


def test_a_rotary_axis_from_beyond_a_turn(machine: Machine) -> None:
    lines = [
        line.split(maxsplit=1)[1] if line[0].isdigit() else line for line in program(1, 40, 0.0).decode().splitlines()
    ]
    source = "\n".join([*lines[:6], "L C+365", *[f"L X+{n}.5" for n in range(20)], "L X+1 C+350 F500", *lines[-3:], ""])
    assert "turn" in compared(source.encode(), machine, "heidenhain", 100)
