"""Rotary words on their side of zero and of a full turn."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.control.setup import Setup, Tool
from ncfix.machine import load
from ncfix.text.reader import read
from ncfix_heidenhain.klartext.writing import extremes, on_its_side
from program.klartext.tnc import program

SETUP = Setup(work_offsets={"PRESET": {"Z": 120.0}}, initial=dict.fromkeys("XYZBC", 0.0), assume_zero=True)

BELOW, PAST = b"L C-5\nL B+1 C+10 F100", b"L C+400\nL C0"


def test_the_angles_that_a_program_writes() -> None:
    assert extremes(BELOW, "C") == (-5, 10)
    assert extremes(b"L C+0\nL IC-3 C 350,5", "C") == (0, 350.5)
    assert extremes(b"7 L X-5 B-3 C359.9 ;C-9", "C") == (359.9, 359.9)
    assert extremes(b"CC X-5\nC X-3 Y-2 DR+", "C") == (0, 0)


@pytest.mark.parametrize(
    ("source", "nominal", "angle", "kept"),
    [
        (b"L C+0\nL C+90", 0.0, -0.002, 0.0),
        (b"L C+0\nL C+90", 0.0, 0.002, 0.002),
        (b"L C+0\nL C+90", 90.0, 89.998, 89.998),
        (BELOW, 0.0, -0.002, -0.002),
        (b"L C+359.999", 359.999, 360.001, 359.999),
        (PAST, 359.999, 360.001, 360.001),
        (b"L C+360", 360.0, 360.001, 360.001),
    ],
)
def test_a_correction_does_not_cross_what_the_program_never_crosses(
    source: bytes, nominal: float, angle: float, kept: float
) -> None:
    assert on_its_side(source, "C", nominal, angle, 0.001) == pytest.approx(kept)


def test_pieces_of_a_motion_that_begins_below_zero_stay_there() -> None:
    """A direction (TX TY TZ) or an increment may lead a table below zero where no word of the program does."""
    machine = load(str(Path(__file__).parents[3] / "examples/machines/dmu50.toml"))
    body = "L X+0 Y+0 Z+100 B+0 C+0 R0 FMAX\nM128\nLN X+10 Y+3 Z+20 NX+0 NY+0 NZ+1 TX+0 TY-0.31 TZ+0.9507366 F500"
    source = program(body + "\nL X+12 Y+3 Z+20 B+30 C+45")
    done = fix_program(read(source, "t.h"), machine, SETUP, FixOptions(allow_refused=True))
    assert done.report.refused == ()
    turns = [float(found) for found in re.findall(r"C([+-][\d.]+)", done.text.decode().split("TZ+0.9507366")[-1])]
    assert len(turns) > 2
    assert turns[0] < -10
    assert sorted(turns) == turns
    assert turns[-1] == 45


def test_the_linear_axes_know_that_a_table_is_held_at_zero() -> None:
    """Under `full` B would go to -0.0006 degrees, and the program has no negative angle: X and Z are those of B+0."""
    machine = load(str(Path(__file__).parents[3] / "examples/machines/wCBXFZYSt.toml"))
    body = "L X+0 Y+0 Z+100 B+0 C+0 R0 FMAX\nL X+100 Y+50 Z+20 F500\nL X+120 Y+60 B+0 C+0\nL X+120 B+30 C+45"
    done = fix_program(read(program(body), "t.h"), machine, SETUP, FixOptions(strategy="full"))
    assert not re.search(rb"[BC]-", done.text)
    assert done.report.error_after_um["max"] <= 1.0  # the tolerance; 2.1 um where X and Z were those of the other angle


def test_axes_that_a_plane_has_turned_are_not_planned_to_turn_further() -> None:
    """They get no words where the program has none: what the linear axes make up for is where they stand."""
    machine = load(str(Path(__file__).parents[2] / "goldens/machines/table.toml"))
    setup = Setup(initial=dict.fromkeys("XYAC", 0.0) | {"Z": 350.0}, tools={1: Tool(80.0, 3.0)}, assume_zero=True)
    body = "TOOL CALL 1 Z\nL X+0 Y+0 Z+200 R0 FMAX\nPLANE SPATIAL SPA+32.5 SPB+5 SPC-69 STAY SEQ-\nL A+Q120 C+Q122 FMAX"
    ends = "\nL X+9 Y-12 Z+5 FMAX\nPLANE RESET STAY\nL X+40 Y+74 Z-7 F500\nL X+41\nL Y+88 Z-9\nL A+0 C+0 FMAX\nL X+3"
    source = read(program(body + ends), "t.h")
    texts = [
        fix_program(source, machine, setup, FixOptions(allow_refused=True, strategy=strategy)).text.decode()
        for strategy in ("full", "position")
    ]
    behind = [text.partition("PLANE RESET STAY")[2].partition("L A+0")[0] for text in texts]
    assert behind[0] == behind[1]


def test_an_arc_gets_no_rotary_word_and_x_y_z_know_it() -> None:
    """What A and C would be corrected by on the arc is left; 2.3 um were, where X Y Z took it for done."""
    machine = load(str(Path(__file__).parents[2] / "goldens/machines/table.toml"))
    setup = Setup(initial=dict.fromkeys("XYAC", 0.0) | {"Z": 350.0}, tools={1: Tool(80.0, 3.0)}, assume_zero=True)
    body = "TOOL CALL 1 Z\nL X+50 Y+200 Z+20 A+20 C+30 R0 FMAX\nL X+51 Y+200 F500\nCR X+50 Y+0 R+100 DR-\nL X-100 Y-100"
    done = fix_program(read(program(body), "t.h"), machine, setup, FixOptions(strategy="full"))
    assert done.report.error_after_um["max"] <= 1.0 + 0.2  # the tolerance, and half a digit of five axes
