"""The proof of the path agrees with dense sampling of the tests' own, and says where and how much."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compensate.machines_at_random import SMOOTH, TOPOLOGIES, perfect, random_machine
from compensate.motions import Arc, changed, dense_errors, motions, path_error, plan
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.plan import deviation
from ncfix.compensate.plan.figure_tally import FigureTally, PathSamples
from ncfix.compensate.plan.path import untouched
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.control.moves import MotionKind, Rule
from ncfix.control.setup import Setup
from ncfix.machine import Effect, Machine, load
from ncfix.machine.basis import Polynomial
from ncfix.text.reader import read

TOLERANCE = 1e-3


def bow(size: float = 0.05) -> Machine:
    return perfect("w F X Y Z t").replace(effects=(Effect("EXX", (size,), Polynomial((2,)), 0.0, 250.0),))


@pytest.mark.parametrize("tcp", [False, True], ids=["plain", "tcp"])
def test_it_finds_what_dense_sampling_finds(tcp: bool) -> None:
    rng = np.random.default_rng(3 + tcp)
    machine = random_machine(rng, TOPOLOGIES["table-head"], SMOOTH, 30.0, 30.0)
    poses = rng.uniform(-0.6, 0.6, (6, 5)) * np.where(machine.rotary, 1.0, 120.0)
    moves = motions(machine, poses[0], [*poses, Arc((0, 0, 0), (1, 2, 2), 0.8)], tcp=tcp)
    result = plan(machine, moves, get_strategy("position"), TOLERANCE)
    rows = np.arange(len(moves)) > 0
    error = path_error(machine, moves, result.pieces, result.start, rows=rows)
    after = np.nanmax(dense_errors(machine, moves, result)[result.pieces.move > 0])
    before = np.nanmax(dense_errors(machine, moves, untouched(moves, ~rows))[1:])
    assert error.before.max == pytest.approx(before, rel=0.01)
    assert error.after.max == pytest.approx(after, rel=0.02)
    assert error.after.max < TOLERANCE
    assert error.after.rms < error.after.max


def test_figures_of_a_case_that_can_be_worked_out_by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    """An error of `size` u^2 along X from -250 to 250: at most `size` at the ends, rms size / sqrt(5)."""
    monkeypatch.setattr(deviation, "DENSITY", 400)
    machine, size = bow(), 0.05
    moves = motions(machine, (-250, 0, 0), [(250, 0, 0)])
    error = path_error(machine, moves, untouched(moves, np.zeros(1, dtype=bool)).pieces)
    assert error.before.max == pytest.approx(size, rel=1e-9)
    assert error.before.rms == pytest.approx(size / np.sqrt(5), rel=2e-3)
    assert error.after == error.before
    assert error.before.move == 0


def test_the_start_of_a_cut_behind_a_rapid_is_looked_at() -> None:
    """An error of `size` u^2 from -250 to 250: the largest is where the rapid ends."""
    machine, size = bow(), 0.05
    moves = motions(machine, (0, 0, 0), [(250, 0, 0), (0, 0, 0)], [MotionKind.RAPID, MotionKind.FEED])
    pieces = untouched(moves, np.zeros(2, dtype=bool)).pieces
    error = path_error(machine, moves, pieces, rows=np.array([False, True]))
    assert error.before.max == pytest.approx(size, rel=1e-4)
    assert error.before.move == 1


def test_ways_count_by_their_length() -> None:
    """A millimetre with a large error and 99 with none: the square mean is a tenth of the large one."""
    step = Effect("EXX", (0.01,), Polynomial((1,)), 0.0, 1.0)
    machine = perfect("w F X Y Z t").replace(effects=(Effect("EYX", (0.01,)),))
    assert step.active
    moves = motions(machine, (0, 0, 0), [(1, 0, 0), (100, 0, 0)])
    pieces = untouched(moves, np.zeros(2, dtype=bool)).pieces
    pieces.end[1, 1] = -0.01
    start = moves.start.copy()
    start[1, 1] = -0.01
    error = path_error(machine, moves, pieces, start)
    assert error.after.max == pytest.approx(0.01)
    assert error.after.rms == pytest.approx(0.001, rel=1e-6)
    assert error.before.rms == pytest.approx(0.01)


def test_it_says_where() -> None:
    machine = bow()
    moves = motions(machine, (0, 0, 0), [(0, 10, 0), (200, 10, 0), (0, 10, 0)])
    error = path_error(machine, moves, untouched(moves, np.zeros(3, dtype=bool)).pieces)
    assert error.before.move == 1
    assert error.before.fraction == 1.0
    assert error.before.max == pytest.approx(0.05 * (200 / 250) ** 2)


def test_rapids_cycles_and_kept_motions() -> None:
    """Rapids and cycles count where they end, kept motions not at all unless asked for, dwells never."""
    machine = bow()
    kinds = [MotionKind.RAPID, MotionKind.FEED, MotionKind.CYCLE, MotionKind.DWELL]
    moves = motions(machine, (-200, 0, 0), [(100, 0, 0), (200, 0, 0), (0, 0, 0), (0, 0, 0)], kinds)
    moves = changed(moves, rule=np.array([Rule.CORRECT, Rule.REFUSE, Rule.CORRECT, Rule.CORRECT], dtype=np.int8))
    result = plan(machine, moves, get_strategy("position"), TOLERANCE)
    error = path_error(machine, moves, result.pieces, result.start)
    assert error.samples == 2
    assert error.before.max == pytest.approx(0.05 * (100 / 250) ** 2)
    assert error.after.max < 1e-6
    everything = path_error(machine, moves, result.pieces, result.start, rows=np.ones(4, dtype=bool))
    assert everything.after.max == pytest.approx(0.05 * (200 / 250) ** 2)
    assert everything.after.move == 1


def test_a_start_that_is_off_is_seen() -> None:
    """After a kept motion the next block begins uncorrected; without a piece to take that up, that is its error."""
    machine = bow()
    moves = motions(machine, (-200, 0, 0), [(-200, 0, 0), (-200, 50, 0)])
    keep = np.array([True, False])
    result = plan(machine, moves, get_strategy("position"), TOLERANCE, keep=keep)
    assert path_error(machine, moves, result.pieces, result.start).after.max < TOLERANCE
    naive = untouched(moves, keep)
    naive.pieces.end[1] = result.pieces.end[-1]
    assert path_error(machine, moves, naive.pieces).after.max == pytest.approx(0.05 * 0.8**2, rel=1e-4)


def test_an_empty_selection_has_no_error() -> None:
    machine = bow()
    moves = motions(machine, (0, 0, 0), [(1, 0, 0)])
    error = path_error(machine, moves, untouched(moves, np.ones(1, dtype=bool)).pieces)
    assert (error.before.max, error.before.move, error.samples) == (0.0, -1, 0)


def test_a_cut_that_begins_where_a_passed_rapid_ends(root: Path) -> None:
    """Before the first cut nobody knows where A and C stand: X and Y are brought to their places when it has begun."""
    lines = (
        "BEGIN PGM A MM",
        "TOOL CALL 6 Z",
        "L X+38 Y-17 FMAX",
        "L Z+5 FMAX",
        "L Z+3 F200",
        "L X+19",
        "END PGM A MM",
    )
    program = read("\n".join([*lines, ""]).encode(), "a.h", "heidenhain")
    machine = load(str(root / "examples/machines/wCAYFXZSt.toml"))
    report = fix_program(program, machine, Setup(assume_zero=True)).report
    assert report.passed == 2
    assert report.error_after_um["max"] == pytest.approx(report.error_before_um["max"], rel=0.02)
    assert report.error_after_um["where"] == 5
    assert "NCF416" in [message.code for message in report.warnings]


@pytest.mark.parametrize(("first", "left_um"), [("G1 X6 Y0 Z5 F500", 16.61), ("G1 X0 Y0 Z5 F500", 15.90)])
def test_a_cut_that_begins_where_a_rapid_has_left_axes(root: Path, first: str, left_um: float) -> None:
    """Nobody has said where X and Y stand when Z comes down: the cut begins there, and leads them to their places.

    X is 14.9 um off and Y 5.6; with its play X is 0.7 um more off where the program moves it.
    """
    lines = ("G21 G90 G94 G17", "G0 Z5", first, "X9", "M2", "")
    program = read("\n".join(lines).encode(), "a.nc", "iso")
    machine = load(str(root / "examples/machines/wCBXFZYSt.toml"))
    report = fix_program(program, machine, Setup(assume_zero=True)).report
    assert report.error_after_um["max"] == pytest.approx(left_um, abs=0.01)
    assert report.error_after_um["where"] == 3
    assert {"NCF416", "NCF439"} <= {message.code for message in report.warnings}


def test_errors_that_grow_below_the_tolerance_are_said(root: Path) -> None:
    """X is 0.5 um off at both ends of a cut, and as much to the other side between them, which is within 1 um."""
    program = read(b"G21 G90 G94\nG0 X0 Y0 Z5\nG1 X10 Y2.5 F500\nM2\n", "a.ngc", "linuxcnc")
    machine = load(str(root / "examples/machines/three_axis.toml"))
    finer = replace(machine, least_increment=(0.0001, 0.0001))
    for tolerance, each, grows in ((1.0, machine, True), (1.0, finer, True), (0.2, finer, False)):
        report = fix_program(program, each, Setup(assume_zero=True), FixOptions(tolerance_um=tolerance)).report
        assert ("NCF418" in {message.code for message in report.warnings}) == grows
        assert (report.error_after_um["max"] > report.error_before_um["max"]) == grows


def test_a_sample_whose_error_is_not_known_has_no_part_in_the_mean() -> None:
    error, weight = np.array([3.0, np.nan, 3.0]), np.array([1.0, 5.0, 1.0])
    tally = FigureTally()
    tally.add(PathSamples(np.arange(3), np.ones(3), error, error, weight))
    found = tally.result()
    assert (found.before.rms, found.after.rms, found.way, found.samples) == (3.0, 3.0, 2.0, 2)


def test_of_equal_errors_the_first_on_the_path_is_named() -> None:
    """In whatever order they come: of a part of plain motions those at ends come before those along the way."""
    tally, one = FigureTally(), np.ones(1)
    for move in (3, 2, 4):
        tally.add(PathSamples(np.array([move]), one, one, one, one))
    found = tally.result()
    assert (found.before.move, found.after.move) == (2, 2)
