"""Hazards 1 to 3 and 25: over-travel, corrections too large or too fast, poses where nothing is known, no numbers."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from compensate.machines_at_random import STROKE, TOPOLOGIES, perfect, random_machine
from compensate.motions import Arc, changed, findings, interpolated, motions, plan
from conftest import FULL
from ncfix.compensate.plan.findings import Finding, Notes
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.limits import FUZZ, LOOKS, excess, increments_beyond_travel
from ncfix.compensate.plan.path import Plan
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.compensate.plan.written import WrittenPieces
from ncfix.control.moves import Moves
from ncfix.machine import Effect, Machine, State
from ncfix.machine.basis import Backlash, Polynomial
from ncfix.text.reader import read
from ncfix.writer.pieces import Pieces

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
    count = 7_000 if FULL else 2_100
    moves = _near_the_limits(machine, rng, count)
    result = corrected(machine, moves)
    told = found(machine, moves, result)
    told_over, told_outside = set(told.get("NCF404", [])), set(told.get("NCF405", []))
    over, outside, unsure = _by_sampling(moves, result)
    assert min(len(over), len(outside)) > count // 35
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


@pytest.mark.parametrize("place", [0.3 / LOOKS, 0.5, 1 - 0.3 / LOOKS])
def test_a_summit_between_two_looks_is_found(place: float) -> None:
    """X rises to 1 um beyond its limit and falls again: next to an end of the motion, too."""
    machine, top = perfect("w F X Y Z t"), STROKE + 1e-3

    def joints(motion: np.ndarray, fraction: np.ndarray) -> np.ndarray:
        return (top - 40.0 * (fraction - place) ** 2)[:, None] * [1.0, 0.0, 0.0]

    far = excess(machine, joints, np.array([0]), np.array([True]))
    assert far[0, 0] == pytest.approx(1e-3, abs=1e-9)  # the search shrinks its bracket to 4e-11


@pytest.mark.parametrize(("beyond", "code"), [(0.005, "NCF404"), (-0.005, "NCF405"), (0.02, "")])
def test_inside_an_arc_under_tcp_axes_go_farther_than_at_its_ends(beyond: float, code: str) -> None:
    """Half a circle from Y- to Y+ about a centre 8 mm within the limit of X, which is corrected by 10 um."""
    machine = perfect("w F X Y Z B t")
    centre = np.array([STROKE - 8.0 - beyond, 0, 0])
    moves = motions(machine, (centre[0], -8, 0, 0), [Arc(centre, (0, 0, 1), np.pi)], tcp=True)
    shift, whole = np.array([0.01, 0, 0, 0]), np.ones(1, dtype=bool)
    pieces = Pieces(np.arange(1), np.ones(1), moves.end + shift, whole, moves.centre + shift[:3], ~whole)
    against = findings(machine, moves, pieces, moves.start + shift)
    assert [(each.code, each.moves.tolist()) for each in against] == ([(code, [0])] if code else [])


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


JUMP, PER_MM, PER_RAD = 0.05, 0.02, 1.0
"""mm: how much a correction may change at once, and besides that per mm and per rad of the way."""


def test_findings_are_what_their_definitions_say() -> None:
    """Random straight motions with random corrections, near all limits, against the definitions one by one.

    Each has one piece. Some are unchanged: nothing is said of these. Axes that get no word do not count as jumping.
    """
    rng = np.random.default_rng(22)
    machine = perfect("w C B F X Y Z S t").replace(max_correction=(0.5, 0.02))
    count = dict.fromkeys(("NCF404", "NCF405", "NCF406", "NCF407", "NCF408"), 0)
    for _ in range(150):
        moves, pieces, start = _near_all_limits(machine, rng, 12)
        told = {
            (each.code, row): (pytest.approx(value, rel=1e-9, nan_ok=True), *each.axes[k : k + 1])
            for each in findings(machine, moves, pieces, start)
            for k, (row, value) in enumerate(zip(each.moves.tolist(), each.values.tolist(), strict=True))
        }
        expected = _by_definition(machine, moves, pieces)
        assert told == expected
        for code, _ in expected:
            count[code] += 1
    assert min(count.values()) > 30


def _near_all_limits(machine: Machine, rng: np.random.Generator, n: int) -> tuple[Moves, Pieces, np.ndarray]:
    """Straight motions that end within, on and beyond limits, with corrections of all sizes."""
    low, high = (np.nan_to_num(side, posinf=7.0, neginf=-7.0) for side in np.array(machine.ranges).T)
    corner = np.choose(rng.choice(3, 5, p=(0.6, 0.2, 0.2)), (np.zeros(5), low, high))
    away = rng.uniform(-1.5, 1.5, (n, 5)) * np.where(machine.rotary, 0.03, 1.0)
    ends = corner + np.where(rng.random((n, 5)) < 0.2, rng.choice([-0.01, 0.0, 0.01], (n, 5)), away)
    moves = motions(machine, ends[0], ends)
    size = rng.choice([0.0, 1e-4, 0.03, 0.3, 0.6], (n, 1)) * np.where(machine.rotary, 0.04, 1.0)
    corrected = moves.end + size * rng.uniform(-1.0, 1.0, (n, 5))
    corrected[rng.random(n) < 0.03, rng.integers(5)] = np.nan
    silent = rng.random((n, 5)) < (0.3 if rng.random() < 0.5 else 0.0)
    moves = changed(moves, placed=~silent, programmed=moves.programmed & ~silent)
    unchanged = rng.random(n) < 0.2
    none = np.full((n, 3), np.nan)
    pieces = Pieces(np.arange(n), np.ones(n), corrected, np.zeros(n, dtype=bool), none, unchanged)
    return moves, pieces, np.vstack((moves.start[:1], corrected[:-1]))


def _by_definition(machine: Machine, moves: Moves, pieces: Pieces) -> dict[tuple[str, int], tuple[object, ...]]:
    """(code, motion) -> its figure, and its axis if the finding is about one."""
    found: dict[tuple[str, int], tuple[object, ...]] = {}
    low, high = np.array(machine.ranges).T
    shift = pieces.end - moves.end
    for row in np.flatnonzero(~pieces.unchanged).tolist():
        if not np.isfinite(pieces.end[row]).all():
            found["NCF408", row] = (0.0,)
        begun, ended, corrected = (
            np.nan_to_num(np.maximum(low - place, place - high), nan=-np.inf)
            for place in (moves.start[row], moves.end[row], pieces.end[row])
        )
        comes_back = np.where(corrected > FUZZ, begun, -np.inf)
        if max(ended.max(), comes_back.max()) > FUZZ:
            found["NCF405", row] = _worst_axis(machine, ended if ended.max() > FUZZ else comes_back)
        led = np.where(np.maximum(ended, comes_back) > FUZZ, -np.inf, corrected)
        if led.max() > FUZZ:
            found["NCF404", row] = _worst_axis(machine, led)
        linear, turns = shift[row, ~machine.rotary], np.abs(shift[row, machine.rotary])
        share = np.maximum(np.linalg.norm(linear) / 0.5, turns.max() / 0.02)
        if share > 1 + FUZZ:
            found["NCF406", row] = (share,)
        if row and not pieces.unchanged[row - 1]:
            way = np.abs(moves.end[row] - moves.start[row])
            change = np.where(moves.wordless[row - 1], 0.0, shift[row] - shift[row - 1])
            jump = np.linalg.norm(change[~machine.rotary])
            if jump > JUMP + PER_MM * way[~machine.rotary].sum() + PER_RAD * way[machine.rotary].sum():
                found["NCF407", row] = (jump,)
    return found


def test_increments_are_led_astray_where_they_stay_and_begin_elsewhere() -> None:
    """Of motions left as they are only increments end elsewhere because they begin elsewhere."""
    rng, count = np.random.default_rng(4), 0
    machine = perfect("w C B F X Y Z S t")
    low, high = np.array(machine.ranges).T
    for _ in range(60):
        moves, pieces, start = _near_all_limits(machine, rng, 12)
        moves = changed(moves, incremental=rng.random(12) < 0.6)
        beyond = [(np.maximum(low - places, places - high) > FUZZ) for places in (pieces.end, moves.end)]
        expected = np.flatnonzero(moves.incremental & pieces.unchanged & (beyond[0] & ~beyond[1]).any(axis=1))
        assert (
            increments_beyond_travel(WrittenPieces(Intent(machine, moves, State()), pieces, start)).tolist()
            == expected.tolist()
        )
        count += len(expected)
    assert count > 10


def _worst_axis(machine: Machine, beyond: np.ndarray) -> tuple[float, str]:
    axis = int(np.argmax(beyond))
    return beyond[axis] * (180 / np.pi if machine.rotary[axis] else 1.0), machine.axis_names[axis]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_no_number_gets_through(bad: float) -> None:
    machine = shifted(0.01)
    moves = motions(machine, (0, 0, 0), [(10.0, 0, 0), (20, 0, 0)])
    result = corrected(machine, moves)
    result.pieces.end[-1, 1] = bad
    assert 1 in found(machine, moves, result)["NCF408"]


def test_an_arc_needs_a_centre_and_a_line_none() -> None:
    machine = shifted(0.01)
    moves = motions(machine, (8, 0, 0), [Arc((0, 0, 0), (0, 0, 1), 1.0), (8, 1, 0), Arc((0, 1, 0), (0, 0, 1), 1.0)])
    arc = np.array([True, False, True])
    pieces = Pieces(np.arange(3), np.ones(3), moves.end, arc, moves.centre.copy(), np.zeros(3, dtype=bool))
    assert findings(machine, moves, pieces) == ()
    pieces.centre[2, 1] = np.nan
    assert [(each.code, each.moves.tolist()) for each in findings(machine, moves, pieces)] == [("NCF408", [2])]


def test_an_error_model_that_gives_no_number_is_refused_by_the_plan() -> None:
    machine = perfect("w F X Y Z t").replace(effects=(Effect("EXX", (np.nan,)),))
    moves = motions(machine, (0, 0, 0), [(10.0, 0, 0), (20, 0, 0)])
    result = corrected(machine, moves)
    assert result.pieces.unchanged.all()
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
    unchanged = plan(machine, moves, get_strategy("position"), 1e-3, keep=np.ones(2, dtype=bool))
    assert found(machine, moves, unchanged) == {}


def test_a_finding_names_axis_amount_and_place_and_counts_what_it_does_not_show() -> None:
    machine = shifted(0.01)
    moves = motions(machine, (0, 0, 0), [(STROKE - 0.002, y, 0) for y in range(30)])
    result = corrected(machine, moves)
    over = next(each for each in findings(machine, moves, result.pieces, result.start) if each.code == "NCF404")
    notes, program = Notes(), read(b"G0\n" * len(moves), "part.ngc", "linuxcnc")
    notes.add(over, program, moves)
    *shown, rest = notes.messages()
    assert [each.place and each.place.line for each in shown] == [row + 1 for row in range(20)]
    assert "axis X 0.008 " in shown[0].text
    assert "10 more" in rest.text


def test_findings_of_a_clean_program_are_none() -> None:
    machine = random_machine(np.random.default_rng(1), TOPOLOGIES["table-table"], ("polynomial",), 20.0, 20.0)
    poses = np.random.default_rng(2).uniform(-0.5, 0.5, (20, 5)) * np.where(machine.rotary, 1.0, 200.0)
    moves = motions(machine, poses[0], poses)
    assert found(machine, moves, corrected(machine, moves)) == {}
    assert dataclasses.is_dataclass(Finding)
    assert not changed(moves).tcp.any()
