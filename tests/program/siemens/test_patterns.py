"""Rows and circles of holes: places worked out by hand, written out flat; what else a pattern may say is refused."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat, fix_program
from ncfix.control.flatten import flatten
from ncfix.control.setup import Setup, Tool
from ncfix.machine import Machine, load
from ncfix.text.reader import read

SETUP = Setup(assume_zero=True, tools={0: Tool(80.0, 3.0), 1: Tool(80.0, 3.0)})
HEAD = "G710 G17 G90 G94 G54\nT1 D1 M6\nG0 X0 Y0 Z40 A0 C0\nMCALL CYCLE81(10,0,2,-5)\n"
TAIL = "MCALL\nG0 X1 Y1 Z40\nM30\n"
STEPS = dict.fromkeys("XYZAC", 1e-4)


@pytest.fixture(scope="module")
def machine(root: Path) -> Machine:
    return load(str(root / "examples/machines/wCAYFXZSt.toml"))


def places(body: str, head: str = HEAD) -> list[tuple[float, ...]]:
    """The coordinates of the rapids of the flat program that stand for its body."""
    program = read(f"{head}{body}\n{TAIL}".encode(), "part.mpf", "siemens")
    flat = flatten(program, SETUP, tuple("CAYXZ"), frozenset("AC"), STEPS).program.source.decode()
    lines = flat[flat.index("-5)") : flat.rindex("MCALL")].splitlines()[1:]
    return [tuple(float(word[1:]) for word in line.split(";")[0].split()[1:]) for line in lines]


def test_a_circle_of_holes() -> None:
    """Six holes on a circle of 20 about X10 Y-5, the first at 30 degrees: 60 degrees from one to the next."""
    found = places("N10 HOLES2(10,-5,20,30,0,6) ; six")
    wide = 20 * math.sqrt(3) / 2
    wanted = [(10 + wide, 5), (10, 15), (10 - wide, 5), (10 - wide, -15), (10, -25), (10 + wide, -15)]
    assert sum(found, ()) == pytest.approx(sum(wanted, ()), abs=1e-5)


def test_part_of_a_circle_clockwise() -> None:
    assert sum(places("HOLES2(0,0,10,90,-90,3)"), ()) == pytest.approx([0, 10, 10, 0, 0, -10], abs=1e-5)


def test_a_row_from_its_nearer_end() -> None:
    """Holes at 5, 13 and 21 along 30 degrees, twice: the second time from where the first ended."""
    found = places("HOLES1(0,0,30,5,8,3)\nHOLES1(0,0,30,5,8,3)")
    far = [(way * math.sqrt(3) / 2, way / 2) for way in (5, 13, 21)]
    assert sum(found, ()) == pytest.approx(sum(far + far[::-1], ()), abs=1e-5)


def test_places_one_by_one() -> None:
    listed = "CYCLE802(111111111,111111111,10,20,-5,6.5,0,0,,,,,,,,,,,,,0,,,1)"
    assert places(listed) == [(10, 20), (-5, 6.5), (0, 0)]


def test_pockets_at_places_of_a_pattern(machine: Machine) -> None:
    head = HEAD.replace("CYCLE81(10,0,2,-5)", "POCKET4(10,0,2,-5,8)")
    program = read(f"{head}HOLES2(0,0,20,0,0,3)\n{TAIL}".encode(), "part.mpf", "siemens")
    fixed = fix_flat(program, machine, SETUP, FixOptions(figures=False, flatten=True))
    assert not fixed.report.refused
    assert fixed.text.count(b"\nG0 X") == 5  # before, at three places, and behind
    assert b"HOLES2" not in fixed.text


@pytest.mark.parametrize("tail", ["", ",1000", ",1000,0,,,1", ',,,"",0,111'])
def test_what_the_last_arguments_may_say(tail: str) -> None:
    """A full circle, in the plane in force, of which no hole is left out."""
    assert len(places(f"HOLES2(0,0,10,0,0,4{tail})")) == 4


def test_in_another_plane() -> None:
    """The first axis of G18 is Z."""
    head = HEAD.replace("G17", "G18").replace("T1 D1 M6", "T1 D0 M6")
    flat = flatten(
        read(f"{head}HOLES1(50,2,0,5,8,2)\n{TAIL}".encode(), "part.mpf", "siemens"),
        SETUP,
        tuple("CAYXZ"),
        frozenset("AC"),
        STEPS,
    ).program.source.decode()
    assert "G0 Z55 X2\nG0 Z63 X2\n" in flat


@pytest.mark.parametrize(
    ("head", "body"),
    [
        (HEAD, "HOLES2(0,0,10,0,0,6,1010)"),
        (HEAD, "HOLES2(0,0,10,0,30,6,1000)"),
        (HEAD, "HOLES2(0,0,10,0,0,6,,,,,2)"),
        (HEAD, "CYCLE802(111111111,111111112,0,0,5,5)"),
        (HEAD, "CYCLE802(111111111,111111111,0,0,,,5,5)"),
        (HEAD, "CYCLE802(111111111,111111111,0,0,5)"),
        (HEAD, 'CYCLE802(111111111,111111111,0,0,5,5,,,,,,,,,,,,,,,0,"2",,1)'),
        (HEAD, 'HOLES1(0,0,0,5,5,3,,,"2")'),
        (HEAD, "HOLES1(0,0,0,5,5)"),
        (HEAD + "G1 F100\n", "HOLES1(0,0,0,5,5,3)"),
        (HEAD + "G91\n", "HOLES1(0,0,0,5,5,3)"),
        (HEAD + "MCALL\n", "HOLES1(0,0,0,5,5,3)"),
    ],
)
def test_patterns_that_are_refused(head: str, body: str, machine: Machine) -> None:
    program = read(f"{head}{body}\n{TAIL}".encode(), "part.mpf", "siemens")
    fixed = fix_flat(program, machine, SETUP, FixOptions(figures=False, flatten=True))
    assert any("positions the control calculates" in refusal.reason for refusal in fixed.report.refused)


def test_as_it_stands_it_is_refused_and_what_follows_must_name_its_axes(machine: Machine) -> None:
    program = read(f"{HEAD}HOLES2(0,0,10,0,0,3)\nMCALL\nG1 X3 F100\nG1 X3 Y4\nM30\n".encode(), "part.mpf", "siemens")
    refused = fix_program(program, machine, SETUP, FixOptions(figures=False)).report.refused
    assert [each.line for each in refused if "--flatten" in each.reason] == [5]
    assert {each.line for each in refused} >= {5, 7}
