"""The exact chain against an independent one (pytransform3d), the signs of every component, reference points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import some
from machine import chains, oracle
from ncfix.machine import Axis, Effect, GaugeLine, Machine, State, se3
from ncfix.machine.state import CHUNK

UM, URAD = 1e-3, 1e-6
EXACT = 1e-12
"""Relative to a working volume of about 1 m: the rounding of a dozen products in double precision."""


@settings(max_examples=some(60), deadline=None)
@given(seed=st.integers(0, 10**6), joints=st.integers(2, 7))
def test_nominal_chain_of_any_joints(seed: int, joints: int) -> None:
    rng = np.random.default_rng(seed)
    machine = chains.random_chain(rng, joints)
    q, length = chains.random_positions(rng, machine, 3), rng.uniform(0, 300, 3)
    expected = np.array([oracle.nominal(machine, *pose) for pose in zip(q, length, strict=True)])
    np.testing.assert_allclose(machine.nominal(q, length), expected, rtol=0, atol=1000 * EXACT)
    np.testing.assert_allclose(machine.tip(q, length), expected[:, :3, 3], rtol=0, atol=1000 * EXACT)


@settings(max_examples=some(60), deadline=None)
@given(seed=st.integers(0, 10**6), joints=st.integers(1, 7), size=st.sampled_from([1.0, 300.0]))
def test_actual_chain_of_any_joints_and_errors(seed: int, joints: int, size: float) -> None:
    """Errors of 50 um and 100 urad, and of 15 mm and 30 mrad: the composition is exact, not of first order."""
    rng = np.random.default_rng(seed)
    machine = chains.random_errors(rng, chains.random_chain(rng, joints), size)
    q, length = chains.random_positions(rng, machine, 3), rng.uniform(0, 300, 3)
    expected = np.array([oracle.actual(machine, *pose) for pose in zip(q, length, strict=True)])
    state = State(length)
    np.testing.assert_allclose(machine.actual(q, state), expected, rtol=0, atol=1000 * EXACT)
    np.testing.assert_allclose(machine.actual_tip(q, state), expected[:, :3, 3], rtol=0, atol=1000 * EXACT)


@pytest.mark.parametrize("frame", [False, True])
def test_error_axes_and_moving_error_frames(frame: bool) -> None:
    rng = np.random.default_rng(5)
    for _ in range(10):
        plain = chains.random_chain(rng, 4)
        triads = [chains.triad(rng) for _ in plain.axes]
        axes = [
            Axis(a.name, a.rotary, a.workpiece_side, a.direction, a.point, a.range, triad, frame)
            for a, triad in zip(plain.axes, triads, strict=True)
        ]
        machine = chains.random_errors(rng, plain.replace(axes=tuple(axes)))
        q = chains.random_positions(rng, machine, 4)
        expected = np.array([oracle.actual(machine, pose, 50.0) for pose in q])
        np.testing.assert_allclose(machine.actual(q, State(50.0)), expected, rtol=0, atol=1000 * EXACT)


def test_everything_is_a_proper_rigid_motion() -> None:
    rng = np.random.default_rng(1)
    machine = chains.random_errors(rng, chains.random_chain(rng, 6), 200.0)
    rotation = machine.actual(chains.random_positions(rng, machine, 50))[:, :3, :3]
    np.testing.assert_allclose(
        rotation @ np.swapaxes(rotation, -1, -2), np.broadcast_to(np.eye(3), (50, 3, 3)), atol=1e-14
    )
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0, atol=1e-14)


def test_batches_of_any_shape_and_size_agree_with_single_poses() -> None:
    rng = np.random.default_rng(2)
    machine = chains.random_errors(rng, chains.random_chain(rng, 5))
    q = chains.random_positions(rng, machine, 2 * CHUNK + 6).reshape(2, CHUNK + 3, 5)
    length = np.array([[100.0], [120.0]])
    tips, poses = machine.actual_tip(q, State(length)), machine.actual(q, State(length))
    assert tips.shape == (2, CHUNK + 3, 3)
    assert poses.shape == (2, CHUNK + 3, 4, 4)
    np.testing.assert_allclose(tips, poses[..., :3, 3], atol=1e-11)
    for row, column in ((0, 0), (1, CHUNK), (1, CHUNK + 2)):
        alone = machine.actual_tip(q[row, column], State(length[row, 0]))
        assert alone.shape == (3,)
        np.testing.assert_allclose(tips[row, column], alone, atol=1e-11)
    assert machine.actual_tip(np.empty((0, 5))).shape == (0, 3)
    assert machine.error(np.empty((0, 5))).shape == (0, 6)


def test_one_pose_under_many_tool_lengths() -> None:
    machine = chains.four_kinds()["w C B F X Y Z t"]
    tips = machine.tip(np.zeros(5), [0.0, 10.0, 20.0])
    np.testing.assert_allclose(tips, [[0, 0, 80], [0, 0, 70], [0, 0, 60]], atol=1e-12)


def test_positions_of_the_wrong_width_are_refused() -> None:
    machine = chains.four_kinds()["w C B F X Y Z t"]
    with pytest.raises(ValueError, match=r"shape \(4, 3\), expected \(\.\.\., 5\)"):
        machine.tip(np.zeros((4, 3)))


def test_without_errors_actual_is_nominal_to_the_last_bit() -> None:
    rng = np.random.default_rng(3)
    machine = chains.random_chain(rng, 5)
    zeros = machine.replace(effects=(Effect("EXX", (0.0,)), Effect("EA0Y", (0.0,))))
    q = chains.random_positions(rng, machine, 20)
    assert zeros.is_perfect
    assert (zeros.actual(q) == machine.nominal(q)).all()
    assert (zeros.error(q) == 0).all()


# -- signs ------------------------------------------------------------------------------------------------------------

TOOL_SIDE = Machine("", "w F X t", (Axis("X", False, False, (1.0, 0.0, 0.0)),), GaugeLine(point=(0.0, 0.0, 0.0)))
TABLE = Machine("", "w X F t", (Axis("X", False, True, (-1.0, 0.0, 0.0)),), GaugeLine(point=(0.0, 0.0, 0.0)))
HEAD = Machine("", "w F C t", (Axis("C", True, False, (0.0, 0.0, 1.0)),), GaugeLine(point=(100.0, 20.0, 0.0)))
ROUND_TABLE = Machine("", "w C F t", (Axis("C", True, True, (0.0, 0.0, -1.0)),), GaugeLine(point=(100.0, 20.0, 0.0)))


@pytest.mark.parametrize("component", "XYZABC")
@pytest.mark.parametrize(("machine", "sign"), [(TOOL_SIDE, 1), (TABLE, -1), (HEAD, 1), (ROUND_TABLE, -1)])
def test_the_sign_of_every_component_on_both_branches(machine: Machine, sign: int, component: str) -> None:
    """A body that errs by +e moves the tool by +e if it carries the tool, by -e if it carries the workpiece."""
    axis = machine.axes[0]
    tip = np.array([40.0, 30.0, -25.0])
    machine = machine.replace(tool=GaugeLine(point=tuple(tip.tolist())))
    size = 1e-6
    error = machine.replace(effects=(Effect(f"E{component}{axis.name}", (size,)),)).error(np.zeros(1))
    expected = np.zeros(6)
    index = "XYZABC".index(component)
    unit = np.eye(3)[index % 3]
    expected[:3] = unit if index < 3 else np.cross(unit, tip)
    expected[3:] = 0 if index < 3 else unit
    second_order = 100 * size**2
    np.testing.assert_allclose(error, sign * size * expected, rtol=0, atol=second_order)


def test_a_longer_screw_moves_the_tool_further_and_a_table_s_workpiece_too() -> None:
    """EXX > 0 is a body that goes too far towards +X: the table then brings the tool to smaller x."""
    q = np.array([100.0])
    for machine, sign in ((TOOL_SIDE, 1), (TABLE, -1)):
        assert machine.tip(q)[0] == pytest.approx(100.0)
        longer = machine.replace(effects=(Effect("EXX", (10 * UM,)),))
        assert longer.error(q)[0] == pytest.approx(sign * 10 * UM, abs=1e-12)


@pytest.mark.parametrize(
    ("effect", "axes_apart"),
    [("EC0Y", ("X", "Y", 1)), ("EC0X", ("X", "Y", -1)), ("EB0X", ("X", "Z", 1)), ("EB0Z", ("X", "Z", -1)),
     ("EA0Z", ("Y", "Z", 1)), ("EA0Y", ("Y", "Z", -1))],
)  # fmt: skip
def test_the_sense_of_squareness(effect: str, axes_apart: tuple[str, str, int]) -> None:
    """The angle between the axes as they really run: 90 degrees plus or minus the location error."""
    machine = chains.four_kinds()["w C F X Y Z B t"].replace(effects=(Effect(effect, (1e-5,)),))
    first, second, sign = axes_apart
    ways = []
    for name in (first, second):
        q = np.zeros((2, 5))
        q[1, machine.axis_names.index(name)] = 100.0
        start, stop = machine.actual_tip(q)
        ways.append((stop - start) / 100.0)
    assert np.arccos(ways[0] @ ways[1]) - np.pi / 2 == pytest.approx(sign * 1e-5, rel=1e-4)


def test_location_errors_move_the_axis_line_and_nothing_else() -> None:
    rng = np.random.default_rng(8)
    for _ in range(10):
        machine = chains.random_chain(rng, 3)
        direction = np.eye(6)
        for axis in machine.axes:
            for k, component in enumerate("XYZABC"):
                part = direction[k][3:] if axis.rotary else direction[k][:3]
                effect = Effect(f"E{component}0{axis.name}", (1e-4,))
                error = machine.replace(effects=(effect,)).error(np.zeros(3))
                offset = 1e-4 * abs(part @ axis.direction)
                assert (np.abs(error).max() < 1e-12) == (offset < 1e-9)


def test_zero_offset_is_the_component_along_or_about_the_axis_itself() -> None:
    q = np.array([[0.0], [0.3]])
    for machine, name, size in ((HEAD, "EC0C", 50 * URAD), (TOOL_SIDE, "EX0X", 20 * UM)):
        error = machine.replace(effects=(Effect(name, (size,)),)).actual(q)
        np.testing.assert_allclose(error, machine.nominal(q + size), atol=1e-13)


def test_zero_offset_is_added_to_the_position_also_where_the_axis_turns_about_minus_z() -> None:
    """The file says M(q + offset); a body that is turned by +e about +z (ECC) has come e short."""
    q = np.array([[0.0], [0.3]])
    wrong = ROUND_TABLE.replace(effects=(Effect("EC0C", (50 * URAD,)),))
    np.testing.assert_allclose(wrong.actual(q), ROUND_TABLE.nominal(q + 50 * URAD), atol=1e-13)


def test_a_shifted_axis_line() -> None:
    """EX0C: C turns about a line at x = e instead of x = 0."""
    size = 0.02
    machine = HEAD.replace(effects=(Effect("EX0C", (size,)),))
    moved = HEAD.replace(axes=(Axis("C", True, False, (0.0, 0.0, 1.0), (size, 0.0, 0.0)),))
    q = np.linspace(-3, 3, 7)[:, None]
    np.testing.assert_allclose(machine.actual(q), moved.nominal(q), atol=1e-13)


def test_a_tilted_axis_line() -> None:
    """EA0C: C turns about a line tilted about X, through the reference point."""
    turn, through = 1e-4, (0.0, 0.0, 300.0)
    machine = HEAD.replace(effects=(Effect("EA0C", (turn,), reference=through),))
    tilted = se3.turn((turn, 0.0, 0.0), through)
    direction, place = tilted[:3, :3] @ [0.0, 0.0, 1.0], se3.apply(tilted, np.zeros(3))
    axis = Axis("C", True, False, tuple(direction.tolist()), tuple(place.tolist()))
    q = np.linspace(-3, 3, 7)[:, None]
    np.testing.assert_allclose(machine.actual(q), HEAD.replace(axes=(axis,)).nominal(q), atol=1e-13)


def test_carried_location_errors_turn_the_body_too() -> None:
    """The inter-axis sense: with the axis at zero the body is already turned, and shifted by EX0C."""
    line, body = (HEAD.replace(effects=(Effect("EX0C", (0.02,), carried=carried),)) for carried in (False, True))
    np.testing.assert_allclose(line.error(np.zeros(1)), 0, atol=1e-15)
    np.testing.assert_allclose(body.error(np.zeros(1)), [0.02, 0, 0, 0, 0, 0], atol=1e-15)
    half = np.array([np.pi])
    np.testing.assert_allclose(line.error(half)[:2], [0.04, 0], atol=1e-12)
    np.testing.assert_allclose(body.error(half)[:2], [0.02, 0], atol=1e-12)


# -- reference points, tool length, spindle ---------------------------------------------------------------------------


def test_rotations_leave_the_reference_point_where_it_is() -> None:
    """An Abbe point: measured at z = -275.86, the pitch EBX moves a tip there not at all, one above it by the lever."""
    place = (0.0, 0.0, -275.86)
    effect = Effect("EBX", (1e-4,), reference=place)
    q = np.array([[0.0], [200.0]])
    for height, shift in ((-275.86, 0.0), (-175.86, 100.0)):
        machine = TOOL_SIDE.replace(tool=GaugeLine(point=(0.0, 0.0, height)), effects=(effect,))
        np.testing.assert_allclose(machine.error(q)[:, 0], np.sin(1e-4) * shift, atol=1e-12)


def test_the_reference_point_of_a_linear_axis_rides_on_it() -> None:
    machine = TOOL_SIDE.replace(effects=(Effect("ECX", (1e-4,)),))
    np.testing.assert_allclose(machine.error(np.array([[0.0], [300.0]]))[:, :3], 0, atol=1e-13)


def test_the_reference_point_of_a_rotary_axis_turns_with_it() -> None:
    place = (100.0, 20.0, 0.0)
    machine = HEAD.replace(effects=(Effect("ECC", (1e-4,), reference=place),))
    np.testing.assert_allclose(machine.error(np.array([[0.0], [1.2]]))[:, :3], 0, atol=1e-13)


def test_tilt_costs_in_proportion_to_the_tool_length() -> None:
    machine = TOOL_SIDE.replace(effects=(Effect("EBX", (1e-4,)),))
    error = machine.error(np.zeros(1), State(tool_length=np.array([0.0, 100.0, 200.0])))
    np.testing.assert_allclose(error[:, 0], [0.0, -100 * np.sin(1e-4), -200 * np.sin(1e-4)], atol=1e-12)
    assert machine.depends_on_tool_length
    assert not TOOL_SIDE.replace(effects=(Effect("EXX", (1e-4,)), Effect("EC0X", (1e-4,)))).depends_on_tool_length


def test_the_spindle_shifts_and_tilts_the_tool_about_its_gauge_line() -> None:
    machine = HEAD.replace(effects=(Effect("EX0S", (0.01,)), Effect("EA0S", (1e-4,)), Effect("EZS", (-0.02,))))
    error = machine.error(np.zeros(1), State(tool_length=150.0))
    arm = 150.02
    expected = [0.01, arm * np.sin(1e-4), 150 - arm * np.cos(1e-4), 1e-4, 0, 0]
    np.testing.assert_allclose(error, expected, atol=1e-12)


def test_the_workpiece_offset_shifts_the_frame_that_results_are_in() -> None:
    machine = chains.four_kinds()["w C B F X Y Z t"]
    q = np.array([0.4, 0.5, 10.0, 20.0, 30.0])
    moved = machine.replace(workpiece_offset=(1.0, 2.0, 3.0))
    np.testing.assert_allclose(moved.tip(q), machine.tip(q) - [1, 2, 3], atol=1e-12)
    np.testing.assert_allclose(moved.nominal(q)[:3, :3], machine.nominal(q)[:3, :3], atol=0)
