"""Holes in the flow of a program: where the calls with depths of their own go, and what may not have one.

The machine is off by a constant shift (-12.4, 21.3 and 8.5 um are its corrections), so a hole is 9 um less deep.
"""

from __future__ import annotations

import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Fixed, fix_flat, fix_program
from ncfix.testing.judging import SETUP, shifted_machine
from ncfix.text.reader import read

MODAL = "MCALL CYCLE81(50,0,2,-20)"
OWN = "MCALL CYCLE81(50,0,2,-19.991)"


def fixed(body: str, flat: bool = False) -> Fixed:
    """A body, behind a rapid to X1 Y2 Z50, corrected."""
    source = f"G54 G0 X1 Y2 Z50\n{body}\nG0 Z60\nM30\n".encode()
    program = read(source, "part.mpf", "siemens")
    return (fix_flat if flat else fix_program)(
        program, shifted_machine(), SETUP, FixOptions(tolerance_um=50, figures=False)
    )


def written(body: str) -> str:
    """What becomes of the body."""
    found = fixed(body)
    assert not found.report.refused
    lines = [line for line in found.text.decode().splitlines() if "ncfix" not in line]
    return "\n".join(lines[1:-2])


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("MARK: X5\nX9 Y9", f"MARK: {OWN}\nX4.988\n{OWN}\nX8.988 Y9.021"),
        ("N70 X5 M8 ; one", f"N70 {OWN}\nX4.988 M8 ; one"),
        ("/2 N70 X5", f"/2 N70 {OWN}\n/2 X4.988"),
        ("x=ic(5) y7", f"{OWN}\nx=ic(5) y7.021"),
        ("X5 Z30", f"{OWN}\nX4.988 Z30"),
        ("X5 M0", f"{OWN}\nX4.988 M0"),
        ("G91 X5\nX5", f"{OWN}\nG91 X5\n{OWN}\nX5"),
        ("X5\n; between\nX9", f"{OWN}\nX4.988\n{MODAL}\n; between\n{OWN}\nX8.988"),
    ],
)
def test_under_mcall(body: str, expected: str) -> None:
    """The call comes before the motion, behind number and label; behind the last hole that of the program is back."""
    skip = "/2 " if body.startswith("/") else ""
    assert written(f"{MODAL}\n{body}\nMCALL") == f"{MODAL}\n{expected}\n{skip}{MODAL}\nMCALL"


def test_arguments_that_were_computed_are_numbers() -> None:
    body = "R1=-20\nR2=1.5\nMCALL CYCLE83(50,0,R2+0.5,R1,,R1/4,,2)\nR1=7\nX5\nMCALL"
    assert written(body).splitlines()[4:-1] == [
        "MCALL CYCLE83(50,0,2,-19.991,,-4.991,,2)",
        "X4.988",
        "MCALL CYCLE83(50,0,2,-20,,-5,,2)",
    ]


@pytest.mark.parametrize(("depth", "value"), [("-20/3", -20 / 3), ("-6.427817", -6.427817)])
def test_the_call_behind_the_holes_has_the_depth_of_the_program(depth: str, value: float) -> None:
    back = written(f"MCALL CYCLE81(50,0,2,{depth})\nX5\nMCALL").splitlines()[-2]
    assert float(back.split(",")[-1].strip(")")) == pytest.approx(value, abs=1e-9)


def test_an_argument_that_nobody_knows_stays_and_so_does_the_depth() -> None:
    body = "MCALL CYCLE83(50,0,2,-20,,-5,,R9)\nX5\nMCALL"
    assert written(body) == body.replace("X5", "X4.988")


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (f"{MODAL}\nMARK: X5\nREPEATB MARK\nMCALL", "REPEAT would not execute it"),
        (f"{MODAL}\nSUPA G0 X5\nMCALL", "without G0 or G1 in force"),
        (f"{MODAL}\nG2 X5 Y6 CR=5\nMCALL", "without G0 or G1 in force"),
        ("MCALL CYCLE81(50,0,2,R9)\nX5\nMCALL", "known only at run time"),
        ("CYCLE81(50,0,2,-20,21)", "gives its depth twice"),
        ("CYCLE81(50,0,2,8,,0,1)", "a diameter"),
        ("CYCLE82(50,0,2,-8,,0,0,12,10)", "another plane"),
        ("MCALL CYCLE83(50,0,2,-8,,-3,,2,0,0,1,0,,1,1,0,0,0,3,0)\nX5\nMCALL", "another plane"),
        ("CYCLE83(50,0,2,-8,,-3,,2,0,0,1,0,2)", "an axis of the plane"),
        ("CYCLE840(50,0,2,-8,,0.5,4,3,1,8,,1)", "an axis of the plane"),
        ("X5 CYCLE81(50,0,2,-20)", "in one block"),
        (f"{MODAL}\nPLACES\nMCALL\nMCALL CYCLE82(50,0,2,-5)\nPLACES\nMCALL\nM30\n%_N_PLACES_SPF\nX5\nM17", "several"),
        (f"{MODAL}\nPLACES\nMCALL\nM30\n%_N_PLACES_SPF\nX5 M17", "the subprogram ends"),
    ],
)
def test_what_is_refused(body: str, why: str) -> None:
    reasons = [each.reason for each in fixed(body).report.refused]
    assert any(why in reason for reason in reasons), reasons


@pytest.mark.parametrize(
    "call",
    [
        "CYCLE81(50,0,2,{},,0,0,11,12)",
        "CYCLE83(50,0,2,{},,-3,,2,0,0,1,0,3,1,1,0,0,0,1,0)",
        "CYCLE83(50,0,2,{},,-3,,0,,0,1,0,,3,1,0,0,0,0,1001110)",
        "CYCLE84(50,0,2,{},,,3,,1.25,0,200,200,0,0,0,1,2,1)",
        "CYCLE86(50,0,2,{},,0,3,0,0,0,0,0,0,10)",
    ],
)
def test_calls_with_all_arguments_that_stay_in_the_plane(call: str) -> None:
    assert "-19.991" in written(call.format(-20))


@pytest.mark.parametrize(
    "body",
    [
        f"{MODAL}\nMARK: X5\nX9\nREPEATB MARK\nMCALL",
        f"{MODAL}\nPLACES\nMCALL\nMCALL CYCLE82(50,0,2,-5)\nPLACES\nMCALL\nM30\n%_N_PLACES_SPF\nX5\nM17",
        f"{MODAL}\nPLACES\nMCALL\nM30\n%_N_PLACES_SPF\nX5\nX9 M17",
        f"{MODAL}\nFOR R1=1 TO 3\nX=R1*5\nENDFOR\nMCALL",
    ],
)
def test_what_is_refused_as_it_stands_is_corrected_flat(body: str) -> None:
    assert fixed(body).report.refused
    assert not fixed(body, flat=True).report.refused


def test_a_hole_that_is_refused_finds_the_depth_that_it_knew() -> None:
    """One that leads nowhere known, between two that are corrected."""
    text = fixed(f"{MODAL}\nX5\nX=R9\nX7 Y8\nMCALL").text.decode()
    assert f"{OWN}\nX4.988\n{MODAL}\nX=R9\n{OWN}\nX6.988 Y8.021\n{MODAL}\nMCALL" in text
