"""The benchmark's own kinematics: against pytransform3d, against signs worked out by hand, against itself."""

from __future__ import annotations

import numpy as np
import pytest
from pytransform3d.rotations import matrix_from_compact_axis_angle
from pytransform3d.transformations import concat, invert_transform, transform_from

from hidden import workshop
from hidden.chain import COMPONENTS, Machine
from hidden.climate import draw_climate
from hidden.designs import BALLS, BARS, FREE, lay_out
from hidden.model import Model, Term
from hidden.motion import Array, about, inverse, rotation
from hidden.situation import Situation
from hidden.visibility import base_columns, first_order, sensitivities

TOPOLOGIES = workshop.TOPOLOGIES


def machine_of(topology: str, seed: int = 1) -> Machine:
    return workshop.draw_machine(np.random.default_rng(seed), topology)


def poses(machine: Machine, n: int, seed: int = 2) -> Array:
    rng = np.random.default_rng(seed)
    low, high = np.array([(j.low, j.high) for j in machine.joints]).T
    return rng.uniform(low, high, (n, len(low))) * machine.units


def situation(topology: str, seed: int = 3) -> Situation:
    rng = np.random.default_rng(seed)
    machine = workshop.draw_machine(rng, topology)
    design = FREE if topology == "wXFYZSt" else BALLS
    return lay_out(rng, machine, topology, draw_climate(rng), machine.lengths, design)


def turned_about(point: Array, vector: Array) -> Array:
    """pytransform3d: there, turn, back."""
    there = transform_from(np.eye(3), point)
    turn = transform_from(matrix_from_compact_axis_angle(vector), np.zeros(3))
    return concat(concat(invert_transform(there), turn), there)


def moved_by(twist: Array, point: Array) -> Array:
    return concat(turned_about(point, twist[3:]), transform_from(np.eye(3), twist[:3]))


def reference_tip(machine: Machine, q: Array, length: float, model: Model) -> Array:
    """The chain of docs/formats.md, one joint after the other, scalar, with another package's matrices."""
    branch = {False: np.eye(4), True: np.eye(4)}
    for side in (False, True):
        for joint in [j for j in machine.joints if j.tool_side == side][:: 1 if side else -1]:
            value = q[machine.axes.index(joint.name)]
            way = value * np.asarray(joint.direction)
            motion = turned_about(np.asarray(joint.point), way) if joint.rotary else transform_from(np.eye(3), way)
            line, error = np.zeros(6), np.zeros(6)
            for term in model.terms:
                if term.axis == joint.name:
                    axes = np.asarray(joint.triad)[term.component % 3]
                    part = slice(0, 3) if term.component < 3 else slice(3, 6)
                    size = (
                        term.coefficients[0] if term.located else float(term.value(np.array([value / joint.unit]))[0])
                    )
                    (line if term.located else error)[part] += size * axes
            carried = (motion @ [*joint.point, 1])[:3]
            located = moved_by(line, np.asarray(joint.point))
            for step in (located, moved_by(error, carried), motion, np.linalg.inv(located)):
                branch[side] = concat(step, branch[side])
    tip = np.asarray(machine.tool_point) - length * np.asarray(machine.tool_direction)
    result: Array = (np.linalg.inv(branch[False]) @ branch[True] @ [*tip, 1])[:3]
    return result


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_chain_agrees_with_pytransform3d(topology: str) -> None:
    rng = np.random.default_rng(5)
    machine = machine_of(topology)
    model = workshop.draw_model(rng, machine, topology, rich=True)
    q = poses(machine, 40)
    length = rng.uniform(80, 300, len(q))
    ours = machine.tips(q, length, model.errors(machine, q))[0]
    theirs = np.array([reference_tip(machine, *pair, model) for pair in zip(q, length, strict=True)])
    assert np.max(np.abs(ours - theirs)) < 1e-9  # coordinates of some 1000 mm in double precision: 1e-12 a product


def test_rotation_is_good_at_any_angle() -> None:
    vectors = np.random.default_rng(0).normal(size=(50, 3)) * np.geomspace(1e-12, 6, 50)[:, None]
    theirs = np.array([matrix_from_compact_axis_angle(v) for v in vectors])
    assert np.max(np.abs(rotation(vectors) - theirs)) < 1e-12
    assert np.array_equal(rotation(np.zeros(3)), np.eye(3))


def test_inverse_undoes() -> None:
    motions = about(np.ones(3), np.random.default_rng(1).normal(size=(9, 3)), (1.0, 2.0, 3.0))
    assert np.max(np.abs(inverse(motions) @ motions - np.eye(4))) < 1e-14


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_perfect_machine_has_no_error(topology: str) -> None:
    machine = machine_of(topology)
    q = poses(machine, 30)
    length = np.full(30, 150.0)
    whole, short = machine.tips(q, length, machine.no_errors(30)), machine.nominal(q, length)
    assert np.max(np.abs(whole[0] - short[0])) < 1e-9
    assert np.max(np.abs(whole[1] - short[1])) < 1e-12


def only(name: str, value: float) -> Model:
    return Model((Term(name, (value,)),))


def shift_of(topology: str, name: str, value: float, q: dict[str, float], length: float = 100.0) -> Array:
    machine = {"wXFYZSt": workshop.THREE_AXES, "wCBXFZYSt": workshop.HORIZONTAL, "wXFYZCBSt": workshop.HEAD}[topology]
    row = np.array([[q.get(a, 0.0) for a in machine.axes]]) * machine.units
    result: Array = only(name, value).displacement(machine, row, np.array([length]))[0]
    return result


def test_positioning_error_keeps_its_sign_on_the_tool_side_and_turns_it_on_the_workpiece_side() -> None:
    assert shift_of("wXFYZSt", "EYY", 0.010, {"Y": -100}) == pytest.approx([0, 0.010, 0], abs=1e-12)
    assert shift_of("wXFYZSt", "EXX", 0.010, {"X": -100}) == pytest.approx([-0.010, 0, 0], abs=1e-12)
    assert shift_of("wXFYZSt", "EZY", 0.010, {}) == pytest.approx([0, 0, 0.010], abs=1e-12)


def test_yaw_acts_with_the_lever_from_the_carried_reference_to_the_tip() -> None:
    # EBZ on the tool: tip 300 mm below the reference that Z carries, so dx = b * (-300)
    assert shift_of("wXFYZSt", "EBZ", 1e-6, {"Z": -200}, 300.0) == pytest.approx([-3e-4, 0, 0], abs=1e-9)
    # ECX on the table: its reference is at +400 with X = -400, the tip at 0: a lever of -400, a minus for the workpiece
    assert shift_of("wXFYZSt", "ECX", 1e-6, {"X": -400}) == pytest.approx([0, 4e-4, 0], abs=1e-9)


def test_squareness_turns_the_direction_of_travel_only() -> None:
    # the cosine of 20 urad takes 5e-8 of 250 mm
    assert shift_of("wXFYZSt", "EC0Y", 20e-6, {"Y": -250}) == pytest.approx([20e-6 * 250, 0, 0], abs=1e-7)
    assert shift_of("wXFYZSt", "EC0Y", 20e-6, {"X": -300, "Z": -100}) == pytest.approx([0, 0, 0], abs=1e-12)


def test_line_of_a_table_axis_moves_the_workpiece_but_not_at_zero() -> None:
    assert shift_of("wCBXFZYSt", "EX0B", 0.05, {}) == pytest.approx([0, 0, 0], abs=1e-12)
    # half a turn about a line 0.05 to the right throws the workpiece 0.1 to the right; it has turned: the tip is +0.1
    assert shift_of("wCBXFZYSt", "EX0C", 0.05, {"C": 180}) == pytest.approx([0.1, 0, 0], abs=1e-9)


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_sensitivities_are_the_slopes_of_the_exact_chain(topology: str) -> None:
    s = situation(topology)
    analytic, step = sensitivities(s), 1e-6
    for frame in range(len(s.machine.frames)):
        for part in range(len(COMPONENTS)):
            errors = s.machine.no_errors(len(s))
            errors.twists[:, frame, part] = step
            slope = (s.machine.tips(s.q, s.length, errors)[0] - s.ball()) / step
            # half the step times a lever of 1000 mm, and the rounding of 1000 mm over the step
            assert np.max(np.abs(slope - analytic[:, :, frame, part])) < 1e-3


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_base_columns_are_the_slopes_of_the_exact_model(topology: str) -> None:
    s, rng = situation(topology), np.random.default_rng(6)
    model = workshop.draw_model(rng, s.machine, topology, rich=True)
    columns = iter(np.moveaxis(base_columns(s, model, sensitivities(s)), 2, 0))
    for i, term in enumerate(model.terms):
        for k in range(len(term.coefficients)):
            slope = model.scaled(0).with_coefficient(i, k, 1e-6).displacement(s.machine, s.q, s.length) / 1e-6
            assert np.max(np.abs(slope - next(columns))) < 1e-2  # 1e-6 squared with levers of 1000 mm, over 1e-6


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_first_order_is_first_order(topology: str) -> None:
    s = situation(topology)
    twists = np.random.default_rng(4).normal(size=(len(s), len(s.machine.frames), 6)) * np.r_[[1e-2] * 3, [2e-5] * 3]
    exact = s.machine.tips(s.q, s.length, s.machine.no_errors(len(s)).plus(twists))[0] - s.ball()
    # products of 20 urad with each other and with 10 um, levers of 1000 mm: some 1e-6 mm
    assert np.max(np.abs(exact - first_order(sensitivities(s), twists))) < 2e-5


@pytest.mark.parametrize(
    ("topology", "design"), [("wCBXFZYSt", BALLS), ("wCAYFXZSt", BALLS), ("wXFYZCBSt", BALLS), ("wXFYZSt", BARS)]
)
def test_linear_axes_follow_to_the_target(topology: str, design: object) -> None:
    rng = np.random.default_rng(8)
    machine = machine_of(topology)
    q = poses(machine, 20)
    target = rng.uniform(-100, 100, (20, 3))
    solved = machine.linear_solve(q, np.full(20, 120.0), target)
    assert np.max(np.abs(machine.nominal_tip(solved, np.full(20, 120.0)) - target)) < 1e-9
