"""The five-axis Klartext programs that ship: corrected on their machine, within the figures of docs/dialects.md."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.following import follow, with_workpiece
from ncfix.compensate.plan.kinematics import joints_from_commands
from ncfix.control.moves import MotionKind, Moves, Rule, Trace
from ncfix.control.setup_file import load as load_setup
from ncfix.machine import State, load
from ncfix.text.dialect import detect
from ncfix.text.reader import read

PROGRAMS = ("klartext_tcp.h", "klartext_tilted.h")


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("strategy", ["rotary-then-linear", "full"])
def test_a_shipped_program_is_corrected(root: Path, name: str, strategy: str) -> None:
    machine = load(str(root / "examples/machines/dmu50.toml"))
    setup = load_setup(str(root / "examples/programs/klartext.setup.toml"))
    source = (root / "examples/programs" / name).read_bytes()
    assert detect(source, name, machine.control or "").name == "heidenhain"
    fixed = fix_program(read(source, name), machine, setup, FixOptions(strategy=strategy))
    assert fixed.report.refused == ()
    before, after = fixed.report.error_before_um["max"], fixed.report.error_after_um["max"]
    assert before is not None
    assert after is not None
    assert after < before / 2
    if strategy == "full":
        return
    row = next(line for line in (root / "docs/dialects.md").read_text().splitlines() if f"`{name}`" in line)
    assert f"| {before:.1f} um | {after:.2f} um |" in row


def moves_of(root: Path, text: str) -> Moves:
    """A program on the machine of the examples."""
    return trace_of(root, text).moves


def trace_of(root: Path, text: str) -> Trace:
    """The same, with what is said."""
    machine = load(str(root / "examples/machines/dmu50.toml"))
    setup = load_setup(str(root / "examples/programs/klartext.setup.toml"))
    return follow(read(text.encode(), "t.h"), machine, setup).trace


def xyz(moves: Moves) -> np.ndarray:
    """Ends in X Y Z."""
    return moves.end[:, [moves.axes.index(letter) for letter in "XYZ"]]


def test_in_the_tilted_plane_the_drill_stands_on_its_holes(root: Path) -> None:
    """A hole 15 mm from the datum at 45 degrees, 12 mm deep, in a plane tilted by 30 degrees about X."""
    moves = moves_of(root, (root / "examples/programs/klartext_tilted.h").read_text())
    hole = xyz(moves)[moves.kind == MotionKind.CYCLE][0]
    side, cosine, sine = 15 * math.sqrt(0.5), math.sqrt(0.75), 0.5
    assert hole == pytest.approx([side, side * cosine + 12 * sine, 120 + side * sine - 12 * cosine])


HEAD = "BEGIN PGM P MM\nTOOL CALL 7 Z\nL Z+200 R0 FMAX\nL X+0 Y+0 FMAX\n"


def program(*blocks: str) -> str:
    return HEAD + "\n".join(blocks) + "\nEND PGM P MM\n"


def test_all_ways_to_say_a_plane_turn_the_axes_alike(root: Path) -> None:
    ways = [
        "PLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN SEQ+ FMAX",
        "PLANE PROJECTED PROPR+0 PROMIN+30 ROT+0 TURN SEQ+ FMAX",
        "PLANE EULER EULPR+0 EULNU+30 EULROT+0 TURN SEQ+ FMAX",
        "PLANE VECTOR BX+1 BY+0 BZ+0 NX+0 NY-0.5 NZ+0.8660254037844386 TURN SEQ+ FMAX",
        "PLANE POINTS P1X+0 P1Y+0 P1Z+0 P2X+9 P2Y+0 P2Z+0 P3X+0 P3Y+8.660254037844386 P3Z+5 TURN SEQ+ FMAX",
        "PLANE SPATIAL SPA+10 SPB+0 SPC+0 STAY\nPLANE RELATIV SPA+20 TURN SEQ+ FMAX",
        "PLANE SPATIAL SPA+30 SPB+0 SPC+0 STAY SEQ+\nL B+Q121 C+Q122 FMAX",
    ]
    ends = [moves_of(root, program(way, "L X+5 Y+6 Z+7 FMAX")).end[-1] for way in ways]
    assert np.abs(np.array(ends) - ends[0]).max() < 1e-9


def test_with_and_without_a_tilted_plane_the_tool_goes_to_the_same_place(root: Path) -> None:
    """The axes turned by numbers and M128 with the turned coordinates, against PLANE with its own."""
    tilted = moves_of(root, program("PLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN SEQ+ FMAX", "L X+5 Y+6 Z+7 FMAX"))
    c, b = (math.degrees(tilted.end[-1, tilted.axes.index(letter)]) for letter in "CB")
    y, z = 6 * math.cos(math.pi / 6) - 7 * 0.5, 6 * 0.5 + 7 * math.cos(math.pi / 6)
    turned = moves_of(root, program(f"L B{b:+.9f} C{c:+.9f} FMAX", "M128", f"L X+5 Y{y:+.9f} Z{z:+.9f} FMAX"))
    assert tilted.tcp[-1]
    assert turned.tcp[-1]
    assert np.abs(tilted.end[-1] - turned.end[-1]).max() < 1e-8


def test_a_direction_of_the_tool_is_the_rotary_axes_that_point_it(root: Path) -> None:
    moves = moves_of(root, program("L B+30 C+40 F1000", "M128", "L X+5 Y+6 Z+7 F500"))
    pointing = moves_of(root, program("M128", "LN X+5 Y+6 Z+7 TX+0 TY+0 TZ+1 F500")).pointing
    assert pointing is not None
    x, y, z = pointing.direction(moves.end[-1])
    text = f"LN X+5 Y+6 Z+7 NX+0 NY+0 NZ+1 TX{x:+.9f} TY{y:+.9f} TZ{z:+.9f} F500"
    found = moves_of(root, program("L B+30 C+40 F1000", "L B+29 C+41", "M128", text))
    assert np.abs(found.end[-1] - moves.end[-1]).max() < 1e-6


def test_a_direction_of_the_tool_is_corrected_by_the_strategy_full(root: Path) -> None:
    machine = load(str(root / "examples/machines/dmu50.toml"))
    setup = load_setup(str(root / "examples/programs/klartext.setup.toml"))
    points = [(x, 0.5 * x, 5 + 0.1 * x, 0.3, -0.2 + 0.01 * x, 0.9) for x in range(0, 30, 5)]
    lines = [
        f"LN X{x:+.3f} Y{y:+.3f} Z{z:+.3f} NX+0 NY+0 NZ+1 TX{a:+.7f} TY{b:+.7f} TZ{c:+.7f} F500"
        for x, y, z, a, b, c in points
    ]
    first = lines[0].replace("F500", "FMAX")
    source = read(program("L B+30 C+40 FMAX", "M128", first, *lines[1:]).encode(), "t.h")
    fixed = fix_program(source, machine, setup, FixOptions(strategy="full"))
    assert fixed.report.refused == ()
    assert fixed.report.error_after_um["max"] is not None
    assert fixed.report.error_after_um["max"] < 1.0
    old, new = ([line for line in text.decode().splitlines() if "LN" in line] for text in (source.source, fixed.text))
    assert all(line.split("TX")[1] not in {other.split("TX")[1] for other in old} for line in new)


def test_a_plane_that_the_axes_do_not_stand_square_to_is_refused(root: Path) -> None:
    moves = moves_of(root, program("PLANE SPATIAL SPA+30 SPB+0 SPC+0 STAY", "L X+5 Y+6 Z+7 FMAX"))
    assert "square" in moves.reasons[moves.reason[-1]] or "normal" in moves.reasons[moves.reason[-1]]


@pytest.mark.parametrize(("b", "c"), [(40, 180), (0, 30), (0, -200)])
def test_plane_axial_turns_the_axes_to_what_it_says(root: Path, b: int, c: int) -> None:
    moves = moves_of(root, program("L B+10 C-170 FMAX", f"PLANE AXIAL B{b:+} C{c:+} TURN FMAX", "L X+5 Y+6 Z+7 FMAX"))
    turned = np.degrees(moves.end[-1, [moves.axes.index("B"), moves.axes.index("C")]])
    assert moves.rule[-1] == 0
    assert np.abs(turned - (b, c)).max() < 1e-9


def test_cycle_19_is_understood_by_where_the_axes_stand(root: Path) -> None:
    by_plane = moves_of(root, program("PLANE AXIAL B+40 C+30 TURN", "L B+40 C+30 FMAX", "L X+5 Y+6 Z+7 FMAX"))
    by_axes = moves_of(
        root, program("L B+40 C+30 FMAX", "CYCL DEF 19.0 W", "CYCL DEF 19.1 B+40 C+30", "L X+5 Y+6 Z+7 FMAX")
    )
    assert by_axes.rule[-1] == 0
    assert np.abs(by_plane.end[-1] - by_axes.end[-1]).max() < 1e-9


@pytest.mark.parametrize(
    ("before", "angles", "said"),
    [
        ("L B+40 C+30 FMAX", "B+40 C+30", False),  # the axes stand so
        ("L B+0 C+0 FMAX", "B+40 C+30", True),
        ("L B+0 C+0 FMAX", "A+40 C+30", False),  # the machine has no A
        ("L B+0 C+0 FMAX", "B+0 C+0", False),  # one plane either way
        ("L B+0 C+0 FMAX", "", False),
    ],
)
def test_it_is_said_how_the_angles_of_cycle_19_are_taken(root: Path, before: str, angles: str, said: bool) -> None:
    body = (before, "CYCL DEF 19.0 W", f"CYCL DEF 19.1 {angles}", "L B+Q121 C+Q122 FMAX", "L X+5 Y+6 Z+7 FMAX")
    codes = [message.code for message in trace_of(root, program(*body)).messages]
    assert codes.count("NCF284") == said


@pytest.mark.parametrize(
    ("way", "known"),
    [
        ("PLANE SPATIAL SPA+0 SPB+0 SPC+30 TURN FMAX", True),
        ("PLANE SPATIAL SPA+0 SPB+0 SPC+30 TURN FMAX COORD ROT", True),
        ("PLANE SPATIAL SPA+0 SPB+0 SPC+30 TURN FMAX TABLE ROT", False),
        ("L C+10 FMAX\nPLANE SPATIAL SPA+0 SPB+0 SPC+30 TURN FMAX", False),
        ("L C+10 FMAX\nPLANE RESET TURN FMAX", True),
        ("L C+10 FMAX\nPLANE RESET STAY\nL B+0 C+0 FMAX\nL X+5 Y+6 Z+7 FMAX", True),
    ],
)
def test_an_axis_that_is_free_to_turn_stands_where_nobody_knows(root: Path, way: str, known: bool) -> None:
    moves = moves_of(root, program(way, "L X+5 Y+6 Z+7 FMAX"))
    assert bool(moves.rule[-1] == 0) is known


@pytest.mark.parametrize("word", ["TURN FMAX", "MOVE DIST50 F1000", "TURN MB MAX FMAX"])
def test_the_rotary_axes_go_to_zero_where_plane_reset_turns_them(root: Path, word: str) -> None:
    moves = moves_of(root, program("L B+40 C+30 FMAX", f"PLANE RESET {word}", "L X+5 Y+6 Z+7 FMAX"))
    assert moves.rule[-1] == 0
    assert moves.end[-1][moves.rotary].tolist() == [0, 0]


def test_the_holes_of_the_shipped_program_are_right_down_to_their_bottom(root: Path) -> None:
    machine = load(str(root / "examples/machines/dmu50.toml"))
    setup = load_setup(str(root / "examples/programs/klartext.setup.toml"))
    source = (root / "examples/programs/klartext_tilted.h").read_bytes()
    fixed = fix_program(read(source, "k.h"), machine, setup, FixOptions())

    def bottoms(text: bytes) -> tuple[np.ndarray, np.ndarray]:
        moves = follow(read(text, "k.h"), machine, setup).trace.moves
        holes = moves.kind == MotionKind.CYCLE
        lengths = moves.tool_length[holes]
        there = with_workpiece(machine, setup)
        return joints_from_commands(there, moves.end[holes], moves.tcp[holes], lengths), lengths

    meant, lengths = bottoms(source)
    done, _ = bottoms(fixed.text)
    real = with_workpiece(machine, setup).actual_tip(done, State(tool_length=lengths))
    wanted = with_workpiece(machine, setup).tip(meant, lengths)
    assert len(meant) == 4
    assert np.linalg.norm(real - wanted, axis=1).max() < 0.5e-3


def test_after_a_retract_of_plane_axes_of_the_plane_may_be_named_one_after_another(root: Path) -> None:
    """X and Y of a tilted plane are made of all three axes of the machine; what is known of them is not lost."""
    lines = ("L X+5 Y+6 FMAX", "L Z+20 FMAX", "L Z+7 F500", "L X+8 F500")
    moves = moves_of(root, program("PLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN MB MAX FMAX SEQ+", *lines))
    at_once = moves_of(root, program("PLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN FMAX SEQ+", "L X+5 Y+6 Z+7 FMAX"))
    assert moves.rule[-4:].tolist() == [1, 0, 0, 0]
    assert np.abs(moves.end[-2] - at_once.end[-1]).max() < 1e-9


def test_of_two_ways_to_turn_one_within_the_travel_is_taken(root: Path) -> None:
    """B of this machine goes from 0 to 180 degrees: the nearer of the two ways would lead it below zero."""
    vector = "TX+0 TY-0.3 TZ+0.9539392014"
    moves = moves_of(root, program("L B+5 C+180 FMAX", "M128", f"LN X+5 Y+6 Z+7 NX+0 NY+0 NZ+1 {vector} F500"))
    assert moves.axes[:2] == ("C", "B")
    assert moves.rule[-1] == 0
    assert np.degrees(moves.end[-1][:2]) == pytest.approx([278.832, 24.786], abs=1e-3)


@pytest.mark.parametrize("words", ["MB50 F1000", "MB MAX FMAX"])
def test_after_a_retract_of_plane_the_position_has_to_be_said(root: Path, words: str) -> None:
    moves = moves_of(
        root, program(f"PLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN {words} SEQ+", "L X+5 F500", "L X+5 Y+6 Z+7 FMAX")
    )
    assert moves.rule[-2:].tolist() == [2, 0]


def test_directions_are_followed_whatever_the_letters_of_axes_mean(root: Path) -> None:
    """FUNCTION TCPM AXIS SPAT makes spatial angles of A B C; TX TY TZ are no angles."""
    lines = ("LN X+10 Y+5 Z+160 TX+0.1 TY+0.05 TZ+0.99 F900", "LN X+20 Y+9 Z+158 NX+0 NY+0 NZ+1 TX+0.2 TY+0 TZ+0.98")
    by_position, by_angle = (
        moves_of(root, program("L B+0 C+0 FMAX", f"FUNCTION TCPM F TCP AXIS {axis} PATHCTRL AXIS", *lines, "L Z+170"))
        for axis in ("POS", "SPAT")
    )
    np.testing.assert_array_equal(by_angle.end[:-1], by_position.end[:-1])
    assert by_angle.rule[:-1].tolist() == by_position.rule[:-1].tolist()
    assert by_angle.rule[-3:].tolist() == [Rule.CORRECT, Rule.CORRECT, Rule.REFUSE]
