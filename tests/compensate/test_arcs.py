"""Arcs that stay arcs: in all planes, both senses, full circles, helices; and those that had better not."""

from __future__ import annotations

import numpy as np
import pytest

from compensate.machines_at_random import TOPOLOGIES, perfect, random_machine
from compensate.motions import SAMPLES, Arc, changed, dense_errors, motions, plan, sweep_of
from conftest import FULL
from ncfix.compensate.plan.arcs import Closure, turns_begun
from ncfix.compensate.plan.path import Plan
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.control.moves import MotionKind, Moves
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Polynomial

TOLERANCE = 1e-3
DIGIT = 1e-3
ROUNDING = 0.5 * DIGIT * np.sqrt(3)
NORMALS = [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 0, -1), (0, 0.6, 0.8), (1, 2, 3)]


def planned(machine: Machine, moves: Moves, rounding: float = 0.0, closure: Closure | None = None) -> Plan:
    strategy = get_strategy("rotary-then-linear")
    return plan(machine, moves, strategy, TOLERANCE, closure or Closure(), rounding_mm=rounding)


def gentle(seed: int = 0, topology: str = "three-axis") -> Machine:
    """A good machine: some micrometres."""
    return random_machine(np.random.default_rng(seed), TOPOLOGIES[topology], ("polynomial",), 6.0, 6.0)


def worst(machine: Machine, moves: Moves, result: Plan) -> float:
    """The largest error from the second motion on: the first one begins uncorrected."""
    errors = dense_errors(machine, moves, result, 2 * SAMPLES)[result.pieces.move > 0]
    return float(np.nanmax(errors))


SWEEPS = (0.4, -1.5, np.pi, -5.9, 2 * np.pi, -2 * np.pi)
ARCS = [(normal, sweep, rise) for rise in (0.0, 8.0) for sweep in SWEEPS for normal in NORMALS]


@pytest.mark.parametrize(("normal", "sweep", "rise"), ARCS if FULL else ARCS[::5])
def test_arcs_stay_arcs_on_a_good_machine(normal: tuple[float, ...], sweep: float, rise: float) -> None:
    machine = gentle()
    begin = np.array([12.0, -7.0, 20.0])
    centre = begin + 30.0 * np.cross(np.asarray(normal) / np.linalg.norm(normal), [0.8, 0.36, 0.48])
    moves = motions(machine, begin, [begin, Arc(centre, normal, sweep, rise), (0, 0, 0)])
    result = planned(machine, moves)
    arc = np.flatnonzero(result.pieces.move == 1)
    assert result.pieces.arc[arc].tolist() == [True]
    assert worst(machine, moves, result) < TOLERANCE


def test_the_radii_at_both_ends_agree_to_rounding_and_after_rounding_to_half_of_what_is_accepted() -> None:
    rng = np.random.default_rng(1)
    machine = gentle(1)
    steps: list = [(0, 0, 0)]
    for _ in range(60):
        here = motions(machine, (0, 0, 0), steps).end[-1]
        centre = here + rng.uniform(-25, 25, 3) * [1, 1, 0]
        steps.append(Arc(centre, (0, 0, 1), float(rng.uniform(-6, 6))))
        steps.append(rng.uniform(-50, 50, 3))
    moves = motions(machine, (0, 0, 0), steps)
    result = planned(machine, moves, ROUNDING)
    pieces, arcs = result.pieces, np.flatnonzero(result.pieces.arc)
    assert len(arcs) > 50
    xyz = [machine.axis_names.index(name) for name in "XYZ"]
    start, end, centre = pieces.end[arcs - 1][:, xyz], pieces.end[arcs][:, xyz], pieces.centre[arcs]
    radii = [np.linalg.norm((point - centre)[:, :2], axis=1) for point in (start, end)]
    np.testing.assert_allclose(radii[0], radii[1], rtol=0, atol=1e-9)
    start, end, centre = (np.round(points / DIGIT) * DIGIT for points in (start, end, centre))
    radii = [np.linalg.norm((point - centre)[:, :2], axis=1) for point in (start, end)]
    assert np.abs(radii[0] - radii[1]).max() < Closure().mm / 2
    for k, row in enumerate(pieces.move[arcs]):
        like = float(moves.sweep[row])
        sweep = sweep_of(start[k], end[k], centre[k], moves.normal[row], like)
        assert abs(sweep - like) < 0.02 * max(1.0, abs(like)), "rounding turns no arc into another"


def test_a_full_circle_ends_exactly_where_it_starts_and_so_do_many_after_each_other() -> None:
    """In their plane; a helix climbs. To the last bit, so that rounding treats both ends alike."""
    machine = gentle(2)
    circle, helix = Arc((20, 0, 0), (0, 0, 1), 2 * np.pi), Arc((20, 0, 0), (0, 0, 1), -2 * np.pi, -3.0)
    moves = motions(machine, (0, 0, 0), [(0, 0, 0), circle, circle, helix, helix, helix, (5, 5, 5)])
    result = planned(machine, moves, ROUNDING)
    assert result.pieces.arc.tolist() == [False, *[True] * 5, False]
    in_plane = result.pieces.end[:6, [machine.axis_names.index(name) for name in "XY"]]
    np.testing.assert_allclose(in_plane, np.broadcast_to(in_plane[0], in_plane.shape), rtol=0, atol=1e-12)
    assert worst(machine, moves, result) < TOLERANCE


def test_several_turns_keep_their_number() -> None:
    machine = gentle(3)
    moves = motions(machine, (0, 0, 0), [(0, 0, 0), Arc((15, 0, 0), (0, 0, 1), 6 * np.pi + 1.0, 9.0)])
    result = planned(machine, moves)
    assert result.pieces.arc.tolist() == [False, True]
    assert worst(machine, moves, result) < TOLERANCE


def test_arcs_turn_rotary_axes_too() -> None:
    machine = gentle(4, "table-table")
    start = (0.1, 0.2, 10, 20, 30)
    moves = motions(machine, start, [start, Arc((20, 20, 30), (0, 0, 1), 1.0, 0.0, (0.01, 0.005))])
    result = planned(machine, moves)
    assert result.pieces.arc.tolist() == [False, True]
    assert worst(machine, moves, result) < TOLERANCE


def test_an_arc_that_is_no_longer_round_becomes_straight_pieces() -> None:
    rng = np.random.default_rng(5)
    machine = random_machine(rng, TOPOLOGIES["table-table"], ("polynomial",))
    start = (0.1, 0.5, 10, 20, 30)
    moves = motions(machine, start, [start, Arc((60, 20, 30), (0, 0, 1), 1.5)])
    result = planned(machine, moves)
    assert not result.pieces.arc.any()
    assert len(result.pieces) > 20
    assert worst(machine, moves, result) < TOLERANCE


@pytest.mark.parametrize(("sweep", "arcs"), [(1e-5, False), (2 * np.pi - 1e-5, False), (0.01, True), (6.2, True)])
def test_an_arc_whose_ends_could_be_rounded_onto_each_other_is_not_risked(sweep: float, arcs: bool) -> None:
    """A control takes equal ends for a full circle: 0.2 um of arc would become 126 mm."""
    machine = perfect("w F X Y Z t").replace(effects=(Effect("EXX", (0.003,), Polynomial((2,)), 0.0, 250.0),))
    moves = motions(machine, (0, 0, 0), [(0, 0, 0), Arc((20, 0, 0), (0, 0, 1), sweep)])
    result = planned(machine, moves, ROUNDING)
    assert result.pieces.arc.any() == arcs
    assert worst(machine, moves, result) < TOLERANCE


def test_an_arc_from_a_kept_motion_fits_its_own_start() -> None:
    """The machine stands where the unchanged motion left it, uncorrected: the arc is refused, pieces take that up."""
    machine = random_machine(np.random.default_rng(7), TOPOLOGIES["three-axis"], ("polynomial",), 30.0, 20.0)
    moves = motions(machine, (80, 60, 40), [(80, 60, 40), Arc((60, 60, 40), (0, 0, 1), 2.0), (0, 0, 0)])
    keep = np.array([True, False, False])
    result = plan(machine, moves, get_strategy("position"), TOLERANCE, keep=keep)
    np.testing.assert_array_equal(result.start[1], moves.start[1])
    assert not result.pieces.arc.any()
    assert worst(machine, moves, result) < TOLERANCE


def test_arcs_that_programmers_round_are_taken_as_the_control_takes_them() -> None:
    """Radii that differ by a hundredth: the intended path has a changing radius, which an arc may follow nearly."""
    machine = gentle(8)
    moves = motions(machine, (0, 0, 0), [(0, 0, 0), Arc((20, 0, 0), (0, 0, 1), 1.0), (0, 0, 0)])
    moves.end[1, :2] += 0.0005
    moves.start[2] = moves.end[1]
    result = planned(machine, moves)
    assert worst(machine, moves, result) < TOLERANCE


def test_all_planes_are_treated_alike() -> None:
    """Axes and errors turned in a cycle, X to Y to Z: the same pieces, turned in a cycle."""
    base = perfect("w F X Y Z t")
    seen = []
    for turn in range(3):
        names = "XYZ"[turn:] + "XYZ"[:turn]
        letter = dict(zip("XYZ", names, strict=True)) | dict(zip("ABC", "ABC"[turn:] + "ABC"[:turn], strict=True))
        curve = Polynomial((1, 2, 3))
        effects = [
            Effect(f"E{letter[component]}{letter[axis]}", (0.004, 0.006, -0.003), curve, 20.0, 250.0)
            for component, axis in ("XX", "YX", "ZY", "YZ")
        ]
        machine = base.replace(effects=tuple(effects))
        place = ["XYZ".index(name) for name in names]

        def turned(vector: tuple[float, ...], place: list[int] = place) -> np.ndarray:
            result = np.zeros(3)
            result[place] = vector
            return result

        arc = Arc(turned((30, 10, 5)), turned((0, 0, 1)), -2.0, 4.0)
        moves = motions(machine, turned((0, 0, 5)), [turned((0, 0, 5)), arc, turned((90, -20, 10))])
        pieces = planned(machine, moves).pieces
        seen.append((pieces.move, pieces.fraction, pieces.end[:, place], pieces.arc, pieces.centre[:, place]))
    for other in seen[1:]:
        for mine, theirs in zip(seen[0], other, strict=True):
            np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-9)


def test_under_cutter_compensation_an_arc_stays_one_or_is_kept_and_named() -> None:
    rng = np.random.default_rng(9)
    machine = random_machine(rng, TOPOLOGIES["three-axis"], ("polynomial",))
    moves = motions(machine, (0, 0, 0), [(0, 0, 0), Arc((20, 0, 0), (0, 0, 1), 1e-5), Arc((20, 0, 0), (0, 0, 1), 1.0)])
    moves = changed(moves, whole=np.array([False, True, True]))
    result = planned(machine, moves, ROUNDING)
    assert len(result.pieces) == 3
    assert result.pieces.unchanged.tolist() == [False, True, False]
    first = result.findings[0]
    assert (first.code, first.moves.tolist()) == ("NCF415", [1])
    assert result.pieces.arc[2]
    assert moves.kind[2] == MotionKind.ARC


@pytest.mark.parametrize(("rise", "unchanged"), [(2.0, False), (60.0, True)])
def test_a_full_circle_whose_ends_come_apart_does_not_get_another_centre(rise: float, unchanged: bool) -> None:
    """Z leads X off by 0.4 and 12 um; the bisector of ends so near to each other leads away from the centre."""
    machine = perfect("w F X Y Z t").replace(effects=(Effect("EXZ", (0.05,), Polynomial((1,)), 0.0, 250.0),))
    circle = Arc((20, 20, 0), (0, 0, 1), -2 * np.pi, rise)
    moves = motions(machine, (27, 27, 0), [(27, 27, 0), circle])
    whole = planned(machine, changed(moves, whole=np.array([False, True])), ROUNDING / 10).pieces
    assert whole.unchanged.tolist() == [False, unchanged]
    assert np.linalg.norm((whole.centre[1] - moves.centre[1])[:2]) < 0.02
    assert worst(machine, moves, planned(machine, moves, ROUNDING / 10)) < TOLERANCE


def test_a_little_more_than_a_turn_is_a_turn_more() -> None:
    sweeps = np.array([2 * np.pi, 2 * np.pi + 1e-4, -2 * np.pi + 1e-4, -4 * np.pi, 4 * np.pi + 1e-12, 0.1])
    assert turns_begun(sweeps).tolist() == [1, 2, 1, 2, 2, 1]
