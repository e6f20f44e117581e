"""Turns of rotary axes whose correction moves linear axes: they take as long as before."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ncfix.control.moves import FeedMode, MotionKind, Moves
from ncfix.control.setup import Setup
from ncfix.control.trace import trace
from ncfix.control.turns import UNTIMED
from ncfix.text.reader import read
from ncfix.text.tree import Program
from ncfix.text.writer import apply
from ncfix.writer.emit import emit
from ncfix.writer.pieces import Pieces

AXES = ("X", "Y", "Z", "A")
STEP = np.array([0.001, 0.001, 0.001, np.deg2rad(0.001)])
HEAD = "G0 X10 Y0 Z0 A0\n"


def traced(text: str, dialect: str) -> tuple[Program, Moves]:
    program = read((HEAD + text + "M2\n").encode(), "test.ngc", dialect)
    return program, trace(program, Setup(assume_zero=True, no_point="calculator"), AXES, frozenset("A")).moves


def corrected(text: str, dialect: str, pieces: int = 1, shift: float = 0.02) -> tuple[str, dict[int, str]]:
    """The text with every turn shifted along Y in proportion to its angle, in so many pieces."""
    program, moves = traced(text, dialect)
    move = np.repeat(np.arange(len(moves)), pieces)
    fraction = np.tile(np.arange(1, pieces + 1) / pieces, len(moves))
    end = moves.start[move] + fraction[:, None] * (moves.end - moves.start)[move]
    end[:pieces] = moves.end[0]
    end[:, 1] += shift * end[:, 3] / np.deg2rad(90)
    first = (move > 0) | (fraction == 1)
    n = int(first.sum())
    columns = Pieces(
        move[first], fraction[first], end[first], np.zeros(n, bool), np.full((n, 3), np.nan), np.zeros(n, bool)
    )
    emission = emit(program, moves, columns, STEP)
    return apply(program.source, emission.edits).decode()[len(HEAD) :], emission.conflicts


def minutes(text: str, dialect: str) -> float:
    """The time of the motions at feed, by LinuxCNC's rule: F is the speed of X Y Z where they move, else of A."""
    _, moves = traced(text.removesuffix("M2\n"), dialect)
    rows = np.flatnonzero(moves.kind == MotionKind.FEED)
    way = moves.end[rows] - moves.start[rows]
    linear, turn = np.linalg.norm(way[:, :3], axis=1), np.abs(np.rad2deg(way[:, 3]))
    inverse = moves.feed_mode[rows] == FeedMode.INVERSE_TIME
    length = np.where(inverse, 1.0, np.where(linear > 0, linear, turn))
    return float(np.sum(length / moves.feed[rows]))


@pytest.mark.parametrize("dialect", ["linuxcnc", "iso"])
@pytest.mark.parametrize("pieces", [1, 3])
def test_a_turn_takes_as_long_as_before(dialect: str, pieces: int) -> None:
    text = "G1 A90 F450\nX12\nA0\n"
    after, conflicts = corrected(text, dialect, pieces)
    assert not conflicts
    assert after.count("A") == 2 * pieces
    assert minutes(after, dialect) == pytest.approx(minutes(text, dialect), rel=1e-4)  # F has six digits; X2 its own


def test_where_the_control_goes_by_linear_axes_f_is_theirs() -> None:
    assert corrected("G1 A90 F450 M8\nX12\n", "linuxcnc") == ("G1 A90 Y0.020 F0.100000 M8\nF450\nX12\nM2\n", {})


def test_where_that_is_not_known_the_time_itself_is_written() -> None:
    assert corrected("/g94 g1 a90 f450\nx12\n", "iso") == (
        "/g93 g1 a90 y0.020 f5.00000\n/g94 f450\nx12\nm2\n".replace("m2", "M2"),
        {},
    )


def test_what_acts_after_the_motion_stays_after_it() -> None:
    text, _ = corrected("G1 A90 F450 M1\n", "linuxcnc", pieces=2)
    assert re.search(r"\nF450 M1\n", text)


@pytest.mark.parametrize("dialect", ["linuxcnc", "iso"])
def test_a_modal_feed_counts_up_to_a_change_of_inch_and_mm(dialect: str) -> None:
    """F450 is given in mm and in force in mm; that the program has inches, too, does not matter."""
    assert corrected("F450\nG1 A90\nG20\nX1 F10\n", dialect) == (
        corrected("F450\nG1 A90\n", dialect)[0].replace("M2\n", "G20\nX1 F10\nM2\n"),
        {},
    )


@pytest.mark.parametrize(
    "frame", ["SCALE X2 Y2 Z2\n", "SCALE X0.5 Y0.5 Z0.5\n", "MIRROR X0\n", "TRANS X5\n", "DIAMON\n"]
)
def test_no_frame_scales_a_feed(frame: str) -> None:
    """The time of the turn stays, and so does the feed behind it."""
    text, conflicts = corrected(f"G710\nG1 X11 F450\n{frame}A90\nX12\n", "siemens")
    assert not conflicts
    assert re.findall("G9[34]|F[0-9.]+", text) == ["F450", "G93", "F5.00000", "G94", "F450."]


def test_a_turn_that_needs_no_linear_motion_stays_as_it_is() -> None:
    assert corrected("G1 A90 F450\n", "iso", shift=0.0004) == ("G1 A90 F450\nM2\n", {})


@pytest.mark.parametrize(
    "text",
    ["G95 S100 M3 G1 A90 F1\n", "F450\nG20\nG1 A90\n", "G20 G1 A90 F450\n", "F450\nG20\nG21\nG1 A90\n"],
)
def test_a_turn_of_unknown_time_is_not_written(text: str) -> None:
    _, conflicts = corrected(text, "linuxcnc")
    assert list(conflicts.values()) == [UNTIMED]


def test_an_f_that_the_control_does_not_take_is_not_written() -> None:
    """Half a degree at 50000 degrees per minute takes a hundred-thousandth of a minute."""
    _, conflicts = corrected("G1 A0.5 F50000.\n", "fanuc", shift=4.0)
    assert ["larger than 9999.999" in why for why in conflicts.values()] == [True]
    _, conflicts = corrected("G93 G1 A90. F5000.\n", "fanuc", pieces=3)
    assert ["larger than 9999.999" in why for why in conflicts.values()] == [True]
    assert corrected("G93 G1 A90. F5000.\n", "fanuc") == ("G93 G1 A90. Y0.020 F5000.\nM2\n", {})


def test_a_turn_in_inverse_time_keeps_its_time_by_itself() -> None:
    assert corrected("G93 G1 A90 F5\n", "iso") == ("G93 G1 A90 Y0.020 F5\nM2\n", {})


@pytest.mark.parametrize(("pieces", "unit"), [(1, ""), (3, ""), (1, "G20\n"), (3, "G20\n")])
def test_a_turn_in_inverse_time_that_linuxcnc_would_hurry_has_its_time_by_a_feed_per_minute(
    pieces: int, unit: str
) -> None:
    """0.02 mm in half a minute is 0.04 mm a minute; LinuxCNC makes that 0.1, and the turn would be over too soon."""
    text = unit + "G93 G1 A90 F2\nX12 F2\n"
    after, conflicts = corrected(text, "linuxcnc", pieces)
    assert not conflicts
    assert minutes(after, "linuxcnc") == pytest.approx(minutes(text, "linuxcnc"), rel=1e-4)  # F has six digits
    assert corrected("G93 G1 A90 F6\n", "linuxcnc") == ("G93 G1 A90 Y0.020 F6\nM2\n", {})


def test_behind_such_a_turn_inverse_time_is_in_force_again() -> None:
    text, _ = corrected("G93 G1 A90 F0.05\nA0 F0.05 M8\n", "linuxcnc")
    assert text == "G94 G1 A90 Y0.020 F0.00100000\nG93\nG94 A0 Y0.000 F0.00100000 M8\nG93\nM2\n"


def test_a_turn_in_inverse_time_whose_time_is_not_known_is_not_written() -> None:
    _, conflicts = corrected("F[#5061]\nG93 G1 A90 F[#5399]\n", "linuxcnc")
    assert list(conflicts.values()) == [UNTIMED]
