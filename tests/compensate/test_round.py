"""Arcs made of arcs: on the path, as few as it takes, and never so short that a control could mistake them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from compensate.machines_at_random import SMOOTH, TOPOLOGIES, perfect, random_machine
from compensate.motions import Arc, dense_errors, motions, plan
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_program
from ncfix.compensate.plan.arcs import Closure
from ncfix.compensate.plan.splitting import SHORTEST, WIDEST
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.control.moves import Moves
from ncfix.control.setup import Setup
from ncfix.machine import Effect, Machine, load
from ncfix.machine.basis import Polynomial
from ncfix.text.reader import read

TOLERANCE = 1e-3
TURN = 2 * np.pi


def oval(scale: float = 3e-4) -> Machine:
    """X is too long, Y too short: circles become ellipses."""
    effects = (
        Effect("EXX", (scale * 250,), Polynomial((1,)), 10.0, 250.0),
        Effect("EYY", (-scale * 250,), Polynomial((1,)), 10.0, 250.0),
    )
    return perfect("w F X Y Z t").replace(effects=effects)


def circle(machine: Machine, sweep: float = TURN, rise: float = 0.0, radius: float = 60.0) -> Moves:
    start = np.zeros(len(machine.axes))
    start[machine.axis_names.index("X")] = radius
    return motions(machine, start, [start, Arc((0, 0, 0), (0, 0, 1), sweep, rise)])


def pieces_of(machine: Machine, moves: Moves, round_: bool, **options: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Arc flags and fractions of the pieces of the last motion, and the largest error along it, mm."""
    result = plan(machine, moves, get_strategy("position"), TOLERANCE, arc_pieces=round_, **options)
    assert not result.pieces.unchanged.any()
    last = result.pieces.move == len(moves) - 1
    errors = dense_errors(machine, moves, result, 60)[last]
    return result.pieces.arc[last], result.pieces.fraction[last], float(np.nanmax(errors))


@pytest.mark.parametrize(("sweep", "rise"), [(TURN, 0.0), (-TURN, 0.0), (3.0, 12.0), (-5.5, -8.0), (3 * TURN, 30.0)])
def test_an_ellipse_is_a_few_arcs(sweep: float, rise: float) -> None:
    machine = oval()
    moves = circle(machine, sweep, rise)
    lines, _, _ = pieces_of(machine, moves, False)
    arcs, _, worst = pieces_of(machine, moves, True)
    assert worst < TOLERANCE
    assert arcs.all()
    assert len(arcs) * 10 < len(lines)


@pytest.mark.parametrize("kind", TOPOLOGIES)
def test_on_machines_with_all_errors(kind: str) -> None:
    rng = np.random.default_rng(len(kind))
    machine = random_machine(rng, TOPOLOGIES[kind], SMOOTH)
    turn = (0.3,) * int(machine.rotary.sum())
    arc = Arc((40, -9, 3), (0, 1, 0), 4.0, 2.0, turn)
    moves = motions(machine, np.zeros(len(machine.axes)), [np.full(len(machine.axes), 0.1), arc])
    lines, _, _ = pieces_of(machine, moves, False)
    arcs, _, worst = pieces_of(machine, moves, True)
    assert worst < TOLERANCE
    assert arcs.any()
    assert len(arcs) < len(lines)


@pytest.mark.parametrize("play", [6.0, 150.0])
def test_play_is_taken_up_by_straight_pieces_between_arcs(play: float) -> None:
    rng = np.random.default_rng(4)
    machine = random_machine(rng, TOPOLOGIES["three-axis"], ("polynomial",), 10.0, 10.0, backlash=play)
    moves = circle(machine)
    result = plan(machine, moves, get_strategy("position"), TOLERANCE, arc_pieces=True)
    errors = dense_errors(machine, moves, result, 60, with_play=True)[result.pieces.move == 1]
    assert np.nanmax(errors) < TOLERANCE
    assert (result.pieces.arc[1:].sum(), (~result.pieces.arc[1:]).sum()) == (4, 4)


def test_no_piece_is_so_wide_or_so_short_that_its_centre_is_in_doubt() -> None:
    machine = oval(2e-3)
    moves = circle(machine, TURN, 0.0, 100.0)
    result = plan(machine, moves, get_strategy("position"), TOLERANCE, arc_pieces=True)
    ends = np.vstack((result.start[1], result.pieces.end[1:]))
    chord = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    assert (chord[result.pieces.arc[1:]] >= SHORTEST).all()
    assert np.diff(result.pieces.fraction[1:], prepend=0.0).max() * TURN <= WIDEST


def test_where_rounding_could_break_the_closure_pieces_are_straight() -> None:
    machine = oval()
    result = plan(
        machine,
        circle(machine),
        get_strategy("position"),
        TOLERANCE,
        Closure(1e-3, 0.0),
        rounding_mm=4e-4,
        arc_pieces=True,
    )
    assert not result.pieces.arc[1:].any()


def test_a_short_piece_that_would_bend_the_other_way_is_straight(root: Path) -> None:
    """The error bends more than the arc does in so short a piece: as an arc, a control would go the long way round."""
    arc = "G2 I8.660254 J5.000000 X31.160254 Y1.000000 Z1.500000"
    text = f"G21 G90 G17 F100\nG0 X0 Y0 Z20\nG1 X19.500000 Y4.500000 Z8.000000\nG0 X22.5 Y6. Z5.\n{arc}\nM2\n"
    program = read(text.encode(), "a.ngc", "linuxcnc")
    machine = load(str(root / "examples/machines/wCBXFZYSt.toml"))
    fixed = fix_program(program, machine, Setup(assume_zero=True), FixOptions(tolerance_um=2.0))
    assert fixed.text.count(b"G1 ") == 2
    assert fixed.report.error_after_um["max"] < 2.0
