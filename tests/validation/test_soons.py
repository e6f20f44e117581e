"""J. A. Soons, Accuracy analysis of multi-axis machines, TU Eindhoven 1993: what it prints in numbers and formulas.

Table 4.1: six ball bars of 400 mm on a two-dimensional machine with a squareness and two scales. Printed are the
covariances times 2 L^2 / sigma^2, and the determinants and largest prediction variances of three designs, which count
for one bar. Chapter 2: the error of the tool from those of all joints. Chapter 3: a load, and a wave that is an alias.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from measure.poses import plan
from ncfix.machine import Effect, Machine, State, load, se3
from ncfix.machine.axes import BASE_AXES
from ncfix.machine.basis import Periodic, Polynomial
from ncfix.machine.piecewise import PiecewiseLinear
from ncfix.measure.estimate import Problem
from ncfix.measure.instruments import observe
from ncfix.measure.least_squares import solve
from ncfix.measure.measurement import Measurement
from ncfix.measure.plan import Pool, choose
from ncfix.measure.selection import Selection

THREE = load(str(Path(__file__).resolve().parents[2] / "examples" / "machines" / "three_axis.toml"))
LINE = Polynomial(degree=(1,))
EFFECTS = (Effect("EC0Y", (0.0,)), Effect("EXX", (0.0,), LINE), Effect("EYY", (0.0,), LINE))
LENGTH = 400.0
DESIGNS = {1: (0, 0, 45, 45, 90, 90), 2: (0, 0, 45, 315, 90, 90), 3: (45, 45, 105, 105, 165, 165)}
PRINTED = {
    1: ([[6, 1, 1], [1, 1, 0], [1, 0, 1]], 2.98, 9.00),
    2: ([[4, 0, 0], [0, 0.83, -0.17], [0, -0.17, 0.83]], 2.60, 4.00),
    3: ([[2.67, 0, 0], [0, 1, -0.33], [0, -0.33, 1]], 2.50, 3.00),
}


def rows(angles) -> np.ndarray:
    """The design of bars at these angles."""
    way = np.deg2rad(np.asarray(angles, dtype=float))
    x, y, zero = LENGTH / 2 * np.cos(way), LENGTH / 2 * np.sin(way), np.zeros(len(way))
    ends = {"ax": -x, "ay": -y, "az": zero, "bx": x, "by": y, "bz": zero}
    return observe(Measurement("length", (), ends), THREE).design(EFFECTS)


@pytest.mark.parametrize("design", PRINTED)
def test_covariance_and_largest_variance(design):
    matrix, _, largest = PRINTED[design]
    one = rows(DESIGNS[design])
    # his squareness has the other sign: ex = y beta_1 (Eq. 4.18)
    sign = np.diag([-1, 1, 1])
    covariance = sign @ np.linalg.inv(one.T @ one) @ sign * 2 * LENGTH**2
    # printed with two decimals
    assert np.abs(covariance - matrix).max() < 0.006
    every = rows(np.arange(0, 180, 1))
    variance = np.einsum("ni,ij,nj->n", every, np.linalg.inv(one.T @ one), every)
    assert len(DESIGNS[design]) * variance.max() == pytest.approx(largest, abs=0.005)
    # over even angles; the printed 4.35, 3.20, 3.00 are over bars that are not stated
    assert len(DESIGNS[design]) * variance.mean() == pytest.approx({1: 4.5, 2: 3.25, 3: 3.0}[design], abs=1e-9)


@pytest.mark.parametrize("design", PRINTED)
def test_determinants_as_printed(design):
    """The third root, in 1e-5."""
    one = rows(DESIGNS[design])
    root = np.linalg.det(np.linalg.inv(one.T @ one / len(one))) ** (1 / 3)
    # printed with three digits
    assert root * 1e5 == pytest.approx(PRINTED[design][1], abs=0.005)


def test_the_exchange_finds_the_best_design():
    """Any triangle of directions is D-optimal: with six bars no plan has a lower worst variance than 3 / 6."""
    angles = np.repeat(np.arange(0, 180, 15), 2)
    every = rows(angles)
    scale = np.linalg.norm(every, axis=0)
    pool = Pool((every / scale)[:, None, :], rows(np.arange(0, 180, 5)) / scale)
    chosen = every[choose(pool, 6)]
    far = rows(np.arange(0, 180, 5))
    variance = np.einsum("ni,ij,nj->n", far, np.linalg.inv(chosen.T @ chosen), far)
    assert variance.max() == pytest.approx(0.5, abs=1e-6)


# -- chapter 2: the error of the tool, and which frame an error belongs to ---------------------------------------------


def arm_matrix(k_from_tool: np.ndarray) -> np.ndarray:
    """F of Eq. 2.22 to 2.24 for errors [rotations, translations] of frame k: (6, 6), in tool axes."""
    turned, arm = k_from_tool[:3, :3], k_from_tool[:3, 3]
    return np.block([[turned.T, np.zeros((3, 3))], [np.cross(arm, turned.T), turned.T]])


def frames(machine: Machine, q: np.ndarray, fixed: bool) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """The frame of each joint in the base, with its origin at the joint's point, those of both last bodies.

    fixed  a rotary axis's frame stays where it is while the joint turns; else it turns with it
    """
    found, ends = {}, []
    for held in (True, False):
        base_from_body = np.eye(4)
        branch = [k for k, axis in enumerate(machine.axes) if axis.workpiece_side == held]
        for k in branch[::-1] if held else branch:
            axis = machine.axes[k]
            way = q[k] * np.asarray(axis.direction)
            motion = se3.turn(way, axis.point) if axis.rotary else se3.shift(way)
            still = np.eye(4) if axis.rotary and fixed else motion
            found[axis.name] = base_from_body @ still @ se3.shift(axis.point)
            base_from_body = base_from_body @ motion
        ends.append(base_from_body)
    return found, *ends


@pytest.mark.parametrize("fixed", [True, False])
@pytest.mark.parametrize("name", ["three_axis", "wCBXFZYSt", "wCAYFXZSt", "dmu50", "angle_head"])
def test_equation_2_24_sums_the_errors_of_all_joints(root: Path, name: str, fixed: bool) -> None:
    """Of the workpiece's branch with a minus; frames that turn with a rotary axis are `error_frame = "moving"`."""
    machine = load(root / "examples" / "machines" / f"{name}.toml").replace(effects=())
    moving = [axis.rotary and not fixed for axis in machine.axes]
    axes = [replace(a, error_axes=BASE_AXES, moving_frame=m) for a, m in zip(machine.axes, moving, strict=True)]
    machine, length = machine.replace(axes=tuple(axes)), 80.0
    size = np.where(machine.rotary, 2.5, 200.0)
    for q in np.random.default_rng(4).uniform(-size, size, (5, len(size))):
        joints, workpiece, body = frames(machine, q, fixed)
        tool = body @ se3.shift(machine.tip(0 * q, length))
        turned = (se3.inverse(workpiece) @ tool)[:3, :3].T
        for axis in axes:
            errors = tuple(Effect(f"E{k}{axis.name}", (1.0,), reference=axis.point) for k in "ABCXYZ")
            found = machine.design(q, State(length), errors)
            seen = np.concatenate([turned @ found[3:], turned @ found[:3]])
            sign = -1 if axis.workpiece_side else 1
            expected = sign * arm_matrix(se3.inverse(joints[axis.name]) @ tool)
            np.testing.assert_allclose(seen, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["three_axis", "wCBXFZYSt", "wCAYFXZSt", "dmu50", "angle_head"])
def test_constants_that_can_be_told_are_6_and_4_for_each_turning_and_2_for_each_sliding_joint(
    root: Path, name: str
) -> None:
    """Appendix B; Esmaeili counts the same, 20 for five axes. All frames are off, those of part and tool, too."""
    machine = load(root / "examples" / "machines" / f"{name}.toml").replace(effects=())
    joints = [(f"0{axis.name}", True) for axis in machine.axes] + [("0S", False)]
    constants = tuple(Effect(f"E{k}{joint}", (1.0,), carried=held) for joint, held in joints for k in "XYZABC")
    size = np.where(machine.rotary, 2.5, 200.0)
    q = np.random.default_rng(1).uniform(-size, size, (100, len(size)))
    zero, one = np.zeros((3, 3)), np.eye(3)
    set_up = [np.block([[one, -se3.skew(tip)], [zero, one]]) for tip in machine.tip(q, 80.0)]
    seen = np.concatenate([machine.design(q, State(80.0), constants), set_up], axis=2)
    seen[:, 3:] *= 200  # mm, and rad at 200 mm
    values = np.linalg.svd((seen / np.linalg.norm(seen, axis=(0, 1))).reshape(-1, seen.shape[2]), compute_uv=False)
    rotary = int(machine.rotary.sum())
    assert (values > 1e-9 * values[0]).sum() == 6 + 4 * rotary + 2 * (len(machine.axes) - rotary)


def test_a_guide_that_stands_still_is_an_effect_times_the_position():
    """A ram in a fixed bearing (Soons's fixed frame): its tilt acts with an arm that grows as it comes out.

    ncfix's frames move with the body. A tilt e about a point that stays is one about the point that moves, and a shift
    of it by e x q: `EYZ` with the same functions, `times = "Z"`.
    """
    tilt = 2e-5
    standing = (
        Effect("EAZ", (tilt,), reference=(0.0, 0.0, 0.0)),
        Effect("EYZ", (-tilt,), times="Z"),
    )
    known = THREE.replace(effects=standing)
    moving = THREE.replace(effects=standing[:1])
    for z in (0.0, 150.0, 400.0):
        q = np.array([0.0, 0.0, 0.0])
        q[THREE.axis_names.index("Z")] = z
        tip = THREE.tip(q)
        assert known.error(q)[1] == pytest.approx(-tilt * tip[2], abs=1e-9)
        assert moving.error(q)[1] == pytest.approx(-tilt * (tip[2] - z), abs=1e-9)


def test_reference_alignment_takes_off_what_does_not_vary():
    """A part that was aligned on the machine shows the variation of errors only (Soons, section 1.3): rigid set-up."""
    known = THREE.replace(effects=(Effect("EX0S", (0.01,)), Effect("EC0Y", (2e-5,))))
    poses = plan(THREE, "tcp", 40).with_header("setup", "rigid")
    problem = Problem.of([poses], THREE, Selection(known.effects, (True,) * 2))
    found = solve(problem.design, problem.nuisance(problem.start), np.zeros(len(problem.values)))
    assert [known.effects[k].name for k in found.set_up] == ["EX0S"]


# -- chapter 3: a load, and an alias -----------------------------------------------------------------------------------


def test_torsion_of_a_guide_under_a_workpiece_as_equation_3_20_has_it(root: Path) -> None:
    """xrx(X, Fw, z) = xrx(X, 4900 N, 0) Fw / 4900 (375 mm - z) / 375: a curve of X, times the moment of the load.

    The curve is not printed; it has its least value at the middle of the stroke, X = 350.
    """
    g, at_4900 = 9.81, (12e-6, 4e-6, 2e-6, 5e-6, 14e-6)
    places = (0.0, 175.0, 350.0, 525.0, 700.0)
    moment = 4900 / g * 0.375  # kg m
    table = PiecewiseLinear(places)
    effect = Effect("EAX", at_4900, table, times="load_kgm", times_center=0.0, times_scale=moment)
    machine = load(root / "examples" / "machines" / "three_axis.toml")
    axes = tuple(replace(axis, range=(0.0, 700.0)) if axis.name == "X" else axis for axis in machine.axes)
    known = machine.replace(axes=axes, effects=(effect,))
    x = known.axis_names.index("X")
    for force, z in ((2600.0, 208.0), (2600.0, -208.0), (3500.0, -189.0)):
        state = State(inputs={"load_kgm": force / g * (375 - z) / 1000})
        q = np.zeros((len(places), len(known.axes)))
        q[:, x] = places
        expected = np.array(at_4900) * force / 4900 * (375 - z) / 375
        np.testing.assert_allclose(known.joint_errors(q, state)[:, x, 3], expected, rtol=1e-12)


def test_a_scale_read_every_10_mm_shows_a_wave_of_40_mm_instead_of_its_own(root: Path) -> None:
    """635.025 um, section 3.2.3: on even steps both waves are one. Poses of a plan tell them apart."""
    short, long = Periodic(order=(1,), period=0.635025), Periodic(order=(1,), period=1 / abs(1 / 0.635025 - 16 / 10))
    assert long.period == pytest.approx(39.59, abs=0.005)

    def alike(x: np.ndarray) -> float:
        """The smallest angle between what both can be, as a cosine."""
        one, other = (np.linalg.qr(wave.design(x))[0] for wave in (short, long))
        return float(np.linalg.svd(one.T @ other, compute_uv=False)[0])

    assert alike(np.arange(0.0, 701.0, 10.0)) == pytest.approx(1, abs=1e-9)
    assert alike(plan(load(root / "examples" / "machines" / "three_axis.toml"), "tcp", 71).columns["X"]) < 0.6
