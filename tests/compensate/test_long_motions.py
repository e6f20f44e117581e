"""Motions of many turns, or of many times the travel: followed as closely as others, or refused, and soon."""

from __future__ import annotations

import numpy as np
import pytest

from compensate.machines_at_random import perfect
from compensate.motions import Arc, dense_errors, findings, motions, plan
from ncfix.compensate.figures.simulation import samples
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.path import Plan
from ncfix.compensate.plan.sampling import MOST_SHOWN
from ncfix.compensate.plan.splitting import STRETCH, PathNodes, fewest
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.control.moves import Moves
from ncfix.machine import Effect, Machine, State
from ncfix.machine.basis import Polynomial
from ncfix.machine.piecewise import PiecewiseLinear

TOLERANCE = 1e-3
TURN = 2 * np.pi
SCALED = perfect("w F X Y Z t").replace(effects=(Effect("EXX", (0.05,), Polynomial((3,)), 0.0, 250.0),))
"""X is too long, and ever more so: no circle stays one."""
KINKED = perfect("w C F X Y Z t").replace(
    effects=(Effect("EXC", (0.0, 0.02, 0.0), PiecewiseLinear((-180.0, 0.0, 180.0))),)
)


def planned(machine: Machine, moves: Moves, arc_pieces: bool = True) -> Plan:
    return plan(machine, moves, get_strategy("position"), TOLERANCE, arc_pieces=arc_pieces)


def helix(turns: float) -> Moves:
    return motions(SCALED, (100, 0, 0), [(100, 0, 0), Arc((0, 0, 0), (0, 0, 1), turns * TURN, 50.0)])


@pytest.mark.parametrize("arc_pieces", [True, False])
def test_a_helix_of_many_turns_is_followed(arc_pieces: bool) -> None:
    moves = helix(100 if arc_pieces else 15)
    result = planned(moves=moves, machine=SCALED, arc_pieces=arc_pieces)
    assert not result.pieces.unchanged.any()
    assert len(result.pieces) > 200
    assert np.nanmax(dense_errors(SCALED, moves, result, 20)[result.pieces.move > 0]) < TOLERANCE


@pytest.mark.parametrize("turns", [30_000, 99_999_999])
def test_turns_without_end_are_refused(turns: int) -> None:
    result = planned(SCALED, helix(turns))
    assert result.pieces.unchanged.tolist() == [False, True]
    assert [(each.code, each.moves.tolist()) for each in result.findings] == [("NCF417", [1])]


@pytest.mark.parametrize("way", [1e7, 1e12, 1e100])
def test_far_off_the_travel_is_said_to_be_that(way: float) -> None:
    moves = motions(SCALED, (0, 0, 0), [(10, 0, 0), (way, 0, 0), (0, 0, 0)])
    result = planned(SCALED, moves)
    found = {each.code: each.moves.tolist() for each in findings(SCALED, moves, result.pieces, result.start)}
    assert 1 in found["NCF405"]


def test_figures_of_a_program_in_the_wrong_unit_do_not_fill_the_memory() -> None:
    moves = motions(SCALED, (0, 0, 0), [((-1) ** k * 1e6, 0, 0) for k in range(40)])
    count = sum(len(rows) for rows, _ in samples(Intent(SCALED, moves, State())))
    assert count <= len(moves) * (MOST_SHOWN + 2)


@pytest.mark.parametrize("turns", [3.0, 1e6, 1e12])
def test_an_axis_that_turns_without_end(turns: float) -> None:
    """There is a kink each turn, of which no list can be made; far from zero a single turn has no more than near it."""
    machine = KINKED
    far = motions(machine, (turns * TURN, 50, 0, 0), [(turns * TURN, 50, 0, 1), ((turns + 0.6) * TURN, 50, 0, 2)])
    assert not planned(machine, far).pieces.unchanged.any()
    moves = motions(machine, (0, 50, 0, 0), [(0, 50, 0, 1), (turns * TURN, 50, 0, 2)])
    assert planned(machine, moves).pieces.unchanged.tolist()[-1] == (turns > 3)


@pytest.mark.parametrize("nodes", [STRETCH, 2 * STRETCH, 2 * STRETCH + 1, 5 * STRETCH + 7])
def test_motions_with_many_nodes_are_cut_in_stretches(nodes: int) -> None:
    fraction = np.linspace(0, 1, nodes)
    command = np.stack([1000 * fraction, 0.2 * np.sin(300 * fraction)], axis=1)
    follow = np.broadcast_to(np.eye(3)[:, :2], (nodes, 3, 2)).copy()
    grid = PathNodes(np.array([nodes]), fraction, command, follow)
    ends, worst = fewest(grid, TOLERANCE)
    stretches = max((nodes - 1) // STRETCH, 1)
    assert ends[[*range(STRETCH, stretches * STRETCH, STRETCH), nodes - 1]].all()
    assert 0 < worst[0] <= TOLERANCE
