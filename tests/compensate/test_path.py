"""The whole path: `embed(compensate(path)) == path`, between programmed points too, by dense sampling of our own."""

from __future__ import annotations

import numpy as np
import pytest

from compensate.machines_at_random import SMOOTH, TOPOLOGIES, perfect, random_machine
from compensate.motions import SAMPLES, Arc, changed, dense_errors, motions, plan
from conftest import FULL, some
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.control.moves import MotionKind, Moves, Rule
from ncfix.machine import Effect, Machine, State
from ncfix.machine.basis import Polynomial

TOLERANCE = 1e-3
CONTROLS = [(kind, tcp) for kind in TOPOLOGIES for tcp in (False, True) if not (tcp and kind == "three-axis")]
"""Kinds of machines, without tool-centre-point control and with it where there are rotary axes."""
STRATEGIES = ("rotary-then-linear", "position", "full")


def walk(machine: Machine, rng: np.random.Generator, count: int, step: float, turn: float) -> np.ndarray:
    """Poses one near the other, within +-120 mm and +-1 rad, (count, n_axes)."""
    scale = np.where(machine.rotary, turn, step)
    here, poses = np.zeros(len(machine.axes)), []
    for move in rng.normal(size=(count, len(machine.axes))) * scale:
        limit = np.where(machine.rotary, 1.0, 120.0)
        here = np.where(np.abs(here + move) > limit, here - move, here + move)
        poses.append(here)
    return np.array(poses)


def worst_of(machine: Machine, moves: Moves, strategy: str, with_play: bool = False) -> tuple[float, int]:
    """The largest error in mm from the second motion on, and the number of pieces."""
    result = plan(machine, moves, get_strategy(strategy), TOLERANCE)
    assert not result.pieces.unchanged.any()
    errors = dense_errors(machine, moves, result, SAMPLES, with_play)[result.pieces.move > 0]
    return float(np.nanmax(errors)), len(result.pieces)


@pytest.mark.parametrize(("kind", "tcp"), CONTROLS)
def test_short_blocks_through_random_poses(kind: str, tcp: bool, capsys: pytest.CaptureFixture[str]) -> None:
    """100 um and 200 urad on every joint, all bases, 10,000 poses in all or a fifth, `SAMPLES` a piece."""
    rng = np.random.default_rng(len(kind) + 10 * tcp)
    machine = random_machine(rng, TOPOLOGIES[kind], SMOOTH)
    count = some(800 if tcp else 1900)
    poses = walk(machine, rng, count, 1.5, 0.01)
    worst, pieces = worst_of(machine, motions(machine, poses[0], poses, tcp=tcp), STRATEGIES[0])
    with capsys.disabled():
        print(f"\n{kind}{' tcp' * tcp}: {count} blocks, {pieces} pieces, worst {worst * 1e3:.4f} um", end="")
    assert worst < TOLERANCE


@pytest.mark.parametrize(
    ("kind", "tcp", "strategy"),
    [
        (*control, strategy)
        for at, control in enumerate(CONTROLS)
        for strategy in (STRATEGIES if FULL else STRATEGIES[at % 3 :][:1])
    ],
)
def test_long_blocks_and_arcs(kind: str, tcp: bool, strategy: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Blocks through half of the working space, with tables, splines and harmonics to be followed."""
    rng = np.random.default_rng(sum(map(ord, kind + strategy)) + tcp)
    machine = random_machine(rng, TOPOLOGIES[kind], SMOOTH)
    poses = walk(machine, rng, 6, 80.0, 0.5)
    arc = Arc(rng.uniform(-20, 20, 3), rng.normal(size=3), 0.6, 5.0)
    moves = motions(machine, poses[0], [*poses, arc], tcp=tcp)
    worst, pieces = worst_of(machine, moves, strategy)
    with capsys.disabled():
        print(f"\n{kind}{' tcp' * tcp}, {strategy}: {len(moves)} blocks, {pieces} pieces, {worst * 1e3:.4f} um", end="")
    assert worst < TOLERANCE


@pytest.mark.parametrize(("kind", "tcp"), CONTROLS)
def test_with_play_in_every_axis(kind: str, tcp: bool) -> None:
    rng = np.random.default_rng(len(kind) + tcp)
    machine = random_machine(rng, TOPOLOGIES[kind], ("polynomial", "fourier"), 10.0, 10.0, backlash=6.0)
    poses = walk(machine, rng, 12, 20.0, 0.1)
    arc = Arc(rng.uniform(-20, 20, 3), (0, 0, 1), 1.0)
    moves = motions(machine, poses[0], [*poses[:6], arc], tcp=tcp)
    worst, _ = worst_of(machine, moves, "rotary-then-linear", with_play=True)
    assert worst < TOLERANCE


# -- what is left alone -----------------------------------------------------------------------------------------------


def bent() -> Machine:
    """Errors that need splitting."""
    curve = Polynomial((1, 2, 3))
    effects = tuple(Effect(name, (0.03, 0.04, -0.02), curve, 10.0, 250.0) for name in ("EXX", "EYX", "EZY", "EXZ"))
    return perfect("w F X Y Z t").replace(effects=effects)


def test_a_perfect_machine_changes_nothing_not_even_the_last_bit() -> None:
    machine = bent().replace(effects=())
    moves = motions(machine, (0.1, 0.2, 0.3), [(1.1, 2.2, 3.3), Arc((5, 5, 3.3), (0, 0, 1), 1.0)])
    result = plan(machine, moves, get_strategy("full"), TOLERANCE)
    np.testing.assert_array_equal(result.pieces.end, moves.end)
    np.testing.assert_array_equal(result.pieces.centre, moves.centre)
    assert len(result.pieces) == 2


def test_rapids_are_corrected_at_their_ends_and_split_only_if_asked() -> None:
    machine = bent()
    moves = motions(machine, (-200, 0, 0), [(-200, 0, 0), (200, 100, 50)], MotionKind.RAPID)
    strategy = get_strategy("position")
    whole, split = (plan(machine, moves, strategy, TOLERANCE, split_rapids=asked) for asked in (False, True))
    assert len(whole.pieces) == 2
    assert len(split.pieces) > 4
    np.testing.assert_array_equal(whole.pieces.end[-1], split.pieces.end[-1])
    np.testing.assert_allclose(
        machine.actual_tip(whole.pieces.end[-1], State(100.0)), machine.tip(moves.end[-1], 100.0)
    )


def test_kept_and_ruled_motions_stay_and_the_others_start_from_them() -> None:
    machine = bent()
    moves = motions(machine, (0, 0, 0), [(10, 0, 0), (20, 10, 0), (30, 0, 5), (40, 0, 0)])
    rule = np.array([Rule.CORRECT, Rule.PASS, Rule.REFUSE, Rule.CORRECT], dtype=np.int8)
    keep = np.array([True, False, False, False])
    result = plan(machine, changed(moves, rule=rule), get_strategy("position"), TOLERANCE, keep=keep)
    assert result.pieces.unchanged.tolist()[:3] == [True, True, True]
    np.testing.assert_array_equal(result.pieces.end[:3], moves.end[:3])
    np.testing.assert_array_equal(result.start[3], moves.end[2])


def test_a_motion_to_an_unknown_place_is_kept_and_named() -> None:
    machine = bent()
    moves = motions(machine, (np.nan, np.nan, np.nan), [(10, 0, np.nan), (20, 10, 0), (30, 0, 0)])
    result = plan(machine, moves, get_strategy("position"), TOLERANCE)
    assert [(finding.code, finding.moves.tolist()) for finding in result.findings] == [("NCF408", [0])]
    assert result.pieces.unchanged.tolist() == [True, False, False]


def test_a_tool_of_unknown_length_stops_what_depends_on_it_only() -> None:
    table = random_machine(np.random.default_rng(0), TOPOLOGIES["table-table"])
    poses = walk(table, np.random.default_rng(1), 3, 1.0, 0.01)
    moves = changed(motions(table, poses[0], poses), tool_length=np.array([50.0, np.nan, 50.0]))
    result = plan(table, moves, get_strategy("position"), TOLERANCE)
    assert [(finding.code, finding.moves.tolist()) for finding in result.findings] == [("NCF414", [1])]
    plain = changed(motions(bent(), (0, 0, 0), [(1, 1, 1)]), tool_length=np.array([np.nan]))
    result = plan(bent(), plain, get_strategy("position"), TOLERANCE)
    assert not result.findings
    assert np.isfinite(result.pieces.end).all()


# -- budget -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("digit", [1e-4, 1e-3])
def test_rounded_to_the_controls_digits_the_path_keeps_tolerance_and_half_a_step_in_each_axis(digit: float) -> None:
    machine, rounding = bent(), 0.5 * digit * np.sqrt(3)
    points = np.round(np.random.default_rng(2).uniform(-200, 200, (8, 3)), 3)
    moves = motions(machine, points[0], points)
    result = plan(machine, moves, get_strategy("position"), 2e-3, rounding_mm=rounding)
    for columns in (result.pieces.end, result.start):
        columns[:] = np.round(columns / digit) * digit
    assert np.nanmax(dense_errors(machine, moves, result)[result.pieces.move > 0]) < 2e-3 + rounding
    assert not result.findings


def test_digits_too_coarse_for_the_tolerance_are_reported_and_take_nothing_of_it() -> None:
    machine = bent()
    moves = motions(machine, (-200, 0, 0), [(-200, 0, 0), (200, 0, 0)])
    strategy = get_strategy("position")
    coarse = plan(machine, moves, strategy, TOLERANCE, rounding_mm=5e-3)
    exact = plan(machine, moves, strategy, TOLERANCE)
    assert [finding.code for finding in coarse.findings] == ["NCF409"]
    assert len(coarse.pieces) == len(exact.pieces)


# -- metamorphic ------------------------------------------------------------------------------------------------------


def test_moving_program_and_errors_together_moves_the_correction() -> None:
    machine = bent()
    shift = np.array([13.0, -7.0, 29.0])
    moved = []
    for effect in machine.effects:
        by = shift["XYZ".index(effect.joint)]
        moved.append(Effect(effect.name, effect.coefficients, effect.basis, effect.center + by, effect.scale))
    points = np.random.default_rng(3).uniform(-100, 100, (6, 3))
    strategy = get_strategy("rotary-then-linear")
    here = plan(machine, motions(machine, points[0], points), strategy, TOLERANCE).pieces
    other = machine.replace(effects=tuple(moved))
    there = plan(other, motions(other, points[0] + shift, points + shift), strategy, TOLERANCE).pieces
    np.testing.assert_array_equal(here.move, there.move)
    np.testing.assert_allclose(here.end + shift, there.end, rtol=0, atol=1e-6)


def test_the_corrected_points_do_not_depend_on_where_the_program_came_from() -> None:
    """Without play, a corrected end is a function of the end alone: reversing a path visits the same points."""
    machine = bent()
    points = np.random.default_rng(4).uniform(-100, 100, (6, 3))
    strategy = get_strategy("position")
    there = plan(machine, motions(machine, points[0], points), strategy, 1.0).pieces
    back = plan(machine, motions(machine, points[-1], points[::-1]), strategy, 1.0).pieces
    np.testing.assert_allclose(there.end, back.end[::-1], rtol=0, atol=2e-6)


def test_inputs_may_be_one_number_for_each_motion() -> None:
    """A spindle that grows while the program runs."""
    growth = Effect("EZS", (0.001,), Polynomial((1,)), input="temp_spindle")
    machine = bent().replace(effects=(growth,))
    moves = motions(machine, (0, 0, 0), [(0, 0, 0), (10, 0, 0), (20, 0, 0)])
    inputs = {"temp_spindle": np.array([0.0, 10.0, 20.0])}
    ends = plan(machine, moves, get_strategy("position"), 1.0, state=State(inputs=inputs)).pieces.end
    np.testing.assert_allclose(ends[:, 2], [0.0, -0.010, -0.020], atol=1e-9)


def test_two_machines_of_one_name_are_told_apart_by_their_axes() -> None:
    moves = motions(perfect("w F X Y Z t"), (0, 0, 0), [(1, 1, 1)])
    other = perfect("w F X Z Y t").replace(effects=(Effect("EXX", (0.01,)),))
    with pytest.raises(ValueError, match="axes"):
        plan(other, moves, get_strategy("position"), TOLERANCE)


def test_programs_without_anything_to_correct() -> None:
    """No motion at all; and none whose end is known."""
    machine = bent()
    strategy = get_strategy("rotary-then-linear")
    assert len(plan(machine, motions(machine, (0, 0, 0), []), strategy, TOLERANCE).pieces) == 0
    lost = motions(machine, (0, 0, 0), [(np.nan, 0, 0), (np.nan, 1, 0)])
    for name in STRATEGIES:
        result = plan(machine, lost, get_strategy(name), TOLERANCE)
        assert result.pieces.unchanged.all()
        assert [finding.code for finding in result.findings] == ["NCF408"]
