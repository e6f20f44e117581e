"""Hazards 1 to 3 and 25: over-travel, corrections too large or too fast, poses where nothing is known, no numbers."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from compensate.machines_at_random import STROKE, TOPOLOGIES, perfect, random_machine
from compensate.motions import Arc, changed, interpolated, motions
from ncfix.compensate.plan.findings import Finding
from ncfix.compensate.plan.limits import FUZZ, findings
from ncfix.compensate.plan.path import Plan, plan
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.control.moves import Moves
from ncfix.diagnostics import Place
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Backlash, Polynomial

XYZ = [0, 1, 2]


def corrected(machine: Machine, moves: Moves) -> Plan:
    return plan(machine, moves, get_strategy("position"), 1e-3)


def found(machine: Machine, moves: Moves, result: Plan) -> dict[str, list[int]]:
    return {each.code: each.moves.tolist() for each in findings(machine, moves, result.pieces, result.start)}


def shifted(size: float) -> Machine:
    """Every position of X is `size` mm too low."""
    return perfect("w F X Y Z t").replace(effects=(Effect("EXX", (-size,)),))


@pytest.mark.parametrize(("end", "beyond"), [(STROKE - 0.02, False), (STROKE - 0.01, False), (STROKE - 0.009, True)])
def test_on_the_limit_is_within_and_beyond_it_is_not(end: float, beyond: bool) -> None:
    """X is corrected by 10 um: from 249.99 exactly to the limit of 250."""
    machine = shifted(0.01)
    moves = motions(machine, (0, 0, 0), [(end, 0, 0)])
    assert found(machine, moves, corrected(machine, moves)) == ({"NCF404": [0]} if beyond else {})


def test_ten_thousand_motions_near_the_limits_none_missed(capsys: pytest.CaptureFixture[str]) -> None:
    """Lines and arcs that end, or bulge, within 50 um of a limit, against dense sampling of the corrected blocks.

    Where the sampled path comes within its own spacing of the limit, either answer is right; so it is for a motion that
    only comes back from where the one before it went too far.
    """
    rng = np.random.default_rng(0)
    machine = random_machine(rng, "w F X Y Z t", ("polynomial",), 20.0, 20.0)
    count = 7_000
    moves = _near_the_limits(machine, rng, count)
    result = corrected(machine, moves)
    told = found(machine, moves, result)
    told_over, told_outside = set(told.get("NCF404", [])), set(told.get("NCF405", []))
    over, outside, unsure = _by_sampling(moves, result)
    assert min(len(over), len(outside)) > 200
    assert over - unsure - outside <= told_over
    assert told_over <= (over | unsure) - outside
    assert outside - unsure <= told_outside <= outside | unsure
    with capsys.disabled():
        print(f"\nover travel: {len(over)} of {len(moves)} motions, {len(unsure)} cannot be told, none missed", end="")


def _near_the_limits(machine: Machine, rng: np.random.Generator, count: int) -> Moves:
    """Lines that end just within or beyond a limit, and arcs that bulge there, in turn with lines to their starts."""
    steps: list[np.ndarray | Arc] = []
    for k in range(count):
        axis, side = int(rng.integers(3)), float(rng.choice([-1.0, 1.0]))
        edge = side * (STROKE - rng.uniform(-0.002, 0.05))
        point = rng.uniform(-200, 200, 3)
        if k % 2:
            point[axis] = edge
            steps.append(point)
            continue
        centre = point.copy()
        centre[axis] = edge - side * 8.0
        point = centre.copy()
        point[(axis + 1) % 3] += 8.0
        normal = np.zeros(3)
        normal[(axis + 2) % 3] = -1.0
        steps += [point, Arc(centre, normal, side * float(rng.uniform(0.5, 3.0)))]
    return motions(machine, (0, 0, 0), steps)


def _by_sampling(moves: Moves, result: Plan) -> tuple[set[int], set[int], set[int]]:
    """Motions that leave the limits corrected, and as programmed, and those too near to tell; by 400 samples each."""
    f = np.linspace(0, 1, 401)[1:]
    over, outside, unsure = set(), set(), set()
    pieces, here = result.pieces, moves.start[0]
    for k, row in enumerate(pieces.move.tolist()):
        first = k == 0 or pieces.move[k - 1] != row
        here = result.start[row] if first else pieces.end[k - 1]
        arc = {"normal": moves.normal[row], "centre": moves.centre[row], "sweep": float(moves.sweep[row])}
        is_arc = np.isfinite(moves.sweep[row])
        paths = [(over, here, pieces.end[k], dict(arc, centre=pieces.centre[k]) if pieces.arc[k] else None)]
        if first:
            paths.append((outside, moves.start[row], moves.end[row], arc if is_arc else None))
        for flagged, start, end, given in paths:
            path = interpolated(start, end, XYZ, given, f)
            most = np.abs(path).max() - STROKE
            gap = 1e-3 if given is not None else 1e-9
            if most > FUZZ:
                flagged.add(row)
            begins_outside = np.abs(start).max() - STROKE > FUZZ
            if (abs(most - FUZZ) < gap and given is not None) or begins_outside:
                unsure.add(row)
    return over, outside, unsure


def test_inside_a_tcp_block_axes_go_farther_than_at_its_ends() -> None:
    """B swings through 0 with a tool of 100 mm and 100 mm of head: Z is highest in the middle of the block."""
    machine = perfect("w F X Y Z B t").replace(effects=(Effect("EZZ", (-0.01,)),))
    high = STROKE - 100.0 - 0.005
    moves = motions(machine, (0, 0, high, -0.2), [(0, 0, high, -0.2), (0, 0, high, 0.2)], tcp=True)
    result = corrected(machine, moves)
    q = result.pieces.end
    assert (q[:, 2] < STROKE).all()
    assert found(machine, moves, result) == {"NCF404": [1]}


def test_outside_the_calibrated_range_is_told_once_and_not_as_over_travel() -> None:
    machine = shifted(0.01)
    moves = motions(machine, (0, 0, 0), [(STROKE + 1.0, 0, 0), (0, 0, 0)])
    assert found(machine, moves, corrected(machine, moves)) == {"NCF405": [0]}


def test_what_comes_back_in_several_blocks_is_not_put_down_to_the_correction() -> None:
    """The bent guideway of Y splits the way back; its first blocks end where X is beyond the travel as programmed."""
    machine = perfect("w F X Y Z t").replace(effects=(Effect("EZY", (0.05 / STROKE**2,), Polynomial((2,))),))
    moves = motions(machine, (0, -STROKE, 0), [(1.5 * STROKE, -STROKE, 0), (-STROKE, STROKE, 0)])
    result = corrected(machine, moves)
    assert (result.pieces.end[result.pieces.move == 1][:-1, 0] > STROKE).any()
    assert found(machine, moves, result) == {"NCF405": [0, 1]}


def test_what_goes_beyond_from_nobody_knows_where_is_not_put_down_to_the_correction() -> None:
    machine = shifted(0.1)
    moves = motions(machine, (np.nan, np.nan, np.nan), [(1.5 * STROKE, 0, 0)])
    assert found(machine, moves, corrected(machine, moves)) == {"NCF405": [0]}


@pytest.mark.parametrize(("size", "refused"), [(0.499, False), (0.5, False), (0.501, True), (5.0, True)])
def test_a_correction_above_the_machines_limit_is_refused_never_cut_short(size: float, refused: bool) -> None:
    machine = shifted(size)
    moves = motions(machine, (0, 0, 0), [(10.0, 0, 0)])
    result = corrected(machine, moves)
    assert result.pieces.end[-1, 0] == pytest.approx(10.0 + size, abs=1e-9)
    assert found(machine, moves, result) == ({"NCF406": [0]} if refused else {})


@pytest.mark.parametrize("factor", [10.0, 100.0])
def test_a_table_in_the_wrong_unit_is_refused(factor: float) -> None:
    """100 um read as 1 mm or 10 mm."""
    machine = shifted(0.1 * factor)
    moves = motions(machine, (0, 0, 0), [(10.0, 0, 0), (20, 0, 0)])
    assert found(machine, moves, corrected(machine, moves)) == {"NCF406": [0, 1]}


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_no_number_gets_through(bad: float) -> None:
    machine = shifted(0.01)
    moves = motions(machine, (0, 0, 0), [(10.0, 0, 0), (20, 0, 0)])
    result = corrected(machine, moves)
    result.pieces.end[-1, 1] = bad
    assert 1 in found(machine, moves, result)["NCF408"]


def test_an_error_model_that_gives_no_number_is_refused_by_the_plan() -> None:
    machine = perfect("w F X Y Z t").replace(effects=(Effect("EXX", (np.nan,)),))
    moves = motions(machine, (0, 0, 0), [(10.0, 0, 0), (20, 0, 0)])
    result = corrected(machine, moves)
    assert result.pieces.kept.all()
    assert [(each.code, each.moves.tolist()) for each in result.findings] == [("NCF403", [0, 1])]


def test_a_play_of_a_tenth_is_a_jump_and_a_slope_of_a_twentieth_too_steep() -> None:
    play = perfect("w F X Y Z t").replace(effects=(Effect("EXX", (0.1,), Backlash()),))
    moves = motions(play, (0, 0, 0), [(10, 0, 0), (20, 0, 0), (10, 0, 0)])
    assert found(play, moves, corrected(play, moves)) == {"NCF407": [2]}
    steep = perfect("w F X Y Z t").replace(effects=(Effect("EXX", (0.2,), Polynomial((2,)), 100.0, 2.0),))
    moves = motions(steep, (99, 0, 0), [(99, 0, 0), (101.5, 0, 0)])
    assert "NCF407" not in found(steep, moves, corrected(steep, moves))


@pytest.mark.parametrize(("slope", "refused"), [(0.015, False), (0.05, True)])
def test_a_correction_that_changes_by_a_twentieth_of_the_way_is_too_fast(slope: float, refused: bool) -> None:
    machine = perfect("w F X Y Z t").replace(effects=(Effect("EXX", (slope,), Polynomial((1,)), 0.0, 1.0),))
    moves = motions(machine, (0, 0, 0), [(0, 0, 0), (9.0, 0, 0)])
    assert found(machine, moves, corrected(machine, moves)) == ({"NCF407": [1]} if refused else {})


def test_a_step_between_a_kept_motion_and_a_corrected_one_is_no_jump() -> None:
    machine = shifted(0.4)
    moves = motions(machine, (0, 0, 0), [(10.0, 0, 0), (10.5, 0, 0)])
    for keep in ([True, False], [False, True]):
        result = plan(machine, moves, get_strategy("position"), 1e-3, keep=np.array(keep))
        assert found(machine, moves, result) == {}


def test_kept_motions_are_not_looked_at() -> None:
    machine = shifted(5.0)
    moves = motions(machine, (0, 0, 0), [(10.0, 0, 0), (STROKE + 5, 0, 0)])
    kept = plan(machine, moves, get_strategy("position"), 1e-3, keep=np.ones(2, dtype=bool))
    assert found(machine, moves, kept) == {}


def test_a_finding_names_axis_amount_and_place_and_counts_what_it_does_not_show() -> None:
    machine = shifted(0.01)
    moves = motions(machine, (0, 0, 0), [(STROKE - 0.002, y, 0) for y in range(30)])
    result = corrected(machine, moves)
    over = next(each for each in findings(machine, moves, result.pieces, result.start) if each.code == "NCF404")
    messages = over.messages(lambda row: Place("part.ngc", row + 1), most=3)
    assert len(messages) == 4
    assert messages[1].place == Place("part.ngc", 2)
    assert "axis X 0.008 " in messages[0].text
    assert "27 more" in messages[3].text


def test_findings_of_a_clean_program_are_none() -> None:
    machine = random_machine(np.random.default_rng(1), TOPOLOGIES["table-table"], ("polynomial",), 20.0, 20.0)
    poses = np.random.default_rng(2).uniform(-0.5, 0.5, (20, 5)) * np.where(machine.rotary, 1.0, 200.0)
    moves = motions(machine, poses[0], poses)
    assert found(machine, moves, corrected(machine, moves)) == {}
    assert dataclasses.is_dataclass(Finding)
    assert not changed(moves).tcp.any()
