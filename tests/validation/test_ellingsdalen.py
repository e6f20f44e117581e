"""The numbers of S. H. Ellingsdalen's thesis (NTNU 2021): kinematics of the DMU 50, its error matrices, its curves.

Equation numbers are the thesis's. Matrices are written out here once more with sympy, as printed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy

from ncfix.machine import Effect, Machine, State, load, se3

D = 154.996
PRINTED_9 = 1.001e-9
"""Nine printed decimals, with the rounding of the sum."""


@pytest.fixture(scope="module")
def dmu50(root: Path) -> Machine:
    """The shipped machine."""
    return load(root / "examples/machines/dmu50.toml")


def joints(x: float, y: float, z: float, b: float, c: float) -> np.ndarray:
    """The thesis's (X, Y, Z, B, C) in mm and degree as axis positions C B X Y Z."""
    return np.array([np.deg2rad(c), np.deg2rad(b), x, y, z])


VECTORS = [
    ((100, 50, 30, 0, 40), (44.465063828, 102.580983125, 30), (0, 0, 1)),
    ((100, 50, 30, 60, 40), (-1.707202998, 8.373388194, -12.488243570), (0.629801404, 0.202114303, 0.75)),
    ((-120, 80, 200, 90, -90), (102.350813742, -88.391176075, 222.350813742), (-0.5, -0.707106781, 0.5)),
    ((50, -60, 250, 135, 200), (-22.513864797, 114.056006453, 195.122217116), (-0.761778763, 0.631067751, 0.146446609)),
    ((100, 50, 30, 180, 0), (-100, 124.996, 104.996), (0, -1, 0)),
    ((10, 20, 300, 1, 30), (0.490380576, 23.220124486, 299.864027396), (0.010725449, 0.006104408, 0.999923848)),
]


@pytest.mark.parametrize(("axes", "tip", "tool_axis"), VECTORS)
def test_forward_kinematics(dmu50: Machine, axes: tuple[float, ...], tip: tuple, tool_axis: tuple) -> None:
    q = joints(*axes)
    np.testing.assert_allclose(dmu50.tip(q), tip, rtol=0, atol=PRINTED_9)
    np.testing.assert_allclose(dmu50.nominal(q)[:3, 2], tool_axis, rtol=0, atol=PRINTED_9)


def test_table_pose_at_right_angles(dmu50: Machine) -> None:
    """T_r(90, 90), from base to workpiece coordinates and back."""
    a = 0.70710678
    printed = [[a, 0, -a, 109.598723], [-0.5, a, -0.5, 77.498], [0.5, a, 0.5, 77.498], [0, 0, 0, 1]]
    table = se3.inverse(dmu50.nominal(joints(0, 0, 0, 90, 90)))
    np.testing.assert_allclose(table[:3, :3], np.array(printed)[:3, :3], atol=5e-9)
    np.testing.assert_allclose(table[:3, 3], np.array(printed)[:3, 3], atol=5e-7)


def test_ideal_point_of_the_rotary_test(dmu50: Machine) -> None:
    """Section 5.3 of the digest: p = (179.009, 94.545, 143.533) at B = C = 90."""
    table = se3.inverse(dmu50.nominal(joints(0, 0, 0, 90, 90)))
    place = se3.apply(table, [179.009, 94.545, 143.533])
    np.testing.assert_allclose(place, [134.684043, -16.919589, 305.622411], atol=5e-7)


def test_screws(dmu50: Machine) -> None:
    c, b = dmu50.axes[:2]
    np.testing.assert_allclose(np.concatenate(b.screw), [109.598723, 0, 0, 0, -0.70710678, 0.70710678], atol=5e-7)
    np.testing.assert_allclose(np.concatenate(c.screw), [0, 0, 0, 0, 0, -1], atol=1e-15)


# -- the printed matrices ---------------------------------------------------------------------------------------------


def turned(axis: str, angle: sympy.Expr) -> sympy.Matrix:
    """A rotation about X, Y or Z, 4x4."""
    matrix = sympy.eye(4)
    i, j = {"X": (1, 2), "Y": (2, 0), "Z": (0, 1)}[axis]
    matrix[i, i] = matrix[j, j] = sympy.cos(angle)
    matrix[i, j], matrix[j, i] = -sympy.sin(angle), sympy.sin(angle)
    return matrix


def shifted(x: sympy.Expr, y: sympy.Expr, z: sympy.Expr) -> sympy.Matrix:
    """A translation, 4x4."""
    matrix = sympy.eye(4)
    matrix[:3, 3] = sympy.Matrix([x, y, z])
    return matrix


X, Y, Z, B, C = sympy.symbols("X Y Z B C", real=True)
QUARTER = sympy.pi / 4
T01, T12, T23 = shifted(0, 0, D), turned("X", QUARTER), turned("Z", B)
T34, T45, T5W = turned("X", -QUARTER), shifted(0, 0, -D), turned("Z", -C)
T_R = T01 * T12 * T23 * T34 * T45 * T5W
T_0T = shifted(X, Y, Z)


def numbers(expression: sympy.Matrix, poses: np.ndarray) -> np.ndarray:
    """A symbolic matrix at poses (n, 5) = C B X Y Z."""
    function = sympy.lambdify((C, B, X, Y, Z), expression)
    return np.array([function(*pose) for pose in poses], dtype=float)


@pytest.fixture
def poses() -> np.ndarray:
    """A hundred poses over the working space."""
    rng = np.random.default_rng(0)
    return rng.uniform([-4, 0.02, -300, -300, 0], [4, np.pi - 0.02, 300, 300, 400], (100, 5))


def test_the_chain_of_matrices(dmu50: Machine, poses: np.ndarray) -> None:
    """(3.30) to (3.37)."""
    expected = np.linalg.inv(numbers(T_R, poses)) @ numbers(T_0T, poses)
    np.testing.assert_allclose(dmu50.nominal(poses), expected, atol=1e-12 * 500)


def test_closed_forward_form(dmu50: Machine, poses: np.ndarray) -> None:
    """(3.19) to (3.24)."""
    c, b, x, y, z = poses.T
    cC, sC, cB, sB, r2, w = np.cos(c), np.sin(c), np.cos(b), np.sin(b), np.sqrt(2), y + z - D
    axis = [(r2 * cC * sB - sC * cB + sC) / 2, (r2 * sC * sB + cC * cB - cC) / 2, (1 + cB) / 2]
    tip = [
        r2 / 2 * (x * sC + w * cC) * sB + (-y + z - D - w * cB) * sC / 2 + x * cC * cB,
        r2 / 2 * (w * sC - x * cC) * sB + x * sC * cB + (w * cC * cB + (y - z + D) * cC) / 2,
        (-r2 * x * sB + w * cB - y + z + D) / 2,
    ]
    np.testing.assert_allclose(dmu50.tip(poses), np.transpose(tip), atol=1e-12 * 500)
    np.testing.assert_allclose(dmu50.nominal(poses)[:, :3, 2], np.transpose(axis), atol=1e-14)


def test_closed_inverse_form(dmu50: Machine, poses: np.ndarray) -> None:
    """(3.25) to (3.29) give the axis positions back; C within one turn."""
    x, y, z = dmu50.tip(poses).T
    i, j, k = dmu50.nominal(poses)[:, :3, 2].T
    q = np.sqrt(2 * (k - k**2))
    b, c = np.arccos(2 * k - 1), np.arctan2((1 - k) * i + q * j, q * i + (k - 1) * j)
    cC, sC = np.cos(c), np.sin(c)
    linear = [
        (-y * q - x + 2 * x * k) * cC + (x * q + 2 * y * k - y) * sC + (D - z) * q,
        (x * q + y * k) * cC + (y * q - x * k) * sC - z + D - D * k + z * k,
        (x * q + y * k - y) * cC + (y * q - x * k + x) * sC + D - D * k + z * k,
    ]
    np.testing.assert_allclose(b, poses[:, 1], atol=1e-10)
    np.testing.assert_allclose(np.angle(np.exp(1j * (c - poses[:, 0]))), 0, atol=1e-10)
    np.testing.assert_allclose(np.transpose(linear), poses[:, 2:], atol=1e-8)


# -- the error matrices -----------------------------------------------------------------------------------------------


def error_matrix(e: np.ndarray) -> np.ndarray:
    """The printed small-angle matrix of [EX EY EZ EA EB EC], (2.42) and (3.9)."""
    x, y, z, a, b, c = e
    return np.array([[1, -c, b, x], [c, 1, -a, y], [-b, a, 1, z], [0, 0, 0, 1]])


def erroneous(
    machine: Machine, joint: str, e: np.ndarray, reference: tuple[float, float, float] | None = None
) -> Machine:
    """The machine with one more joint that errs by these six constants."""
    effects = tuple(Effect(f"E{k}{joint}", (float(v),), reference=reference) for k, v in zip("XYZABC", e, strict=True))
    return machine.replace(effects=machine.effects + effects)


def test_linear_axes_err_in_their_moving_carriage(dmu50: Machine, poses: np.ndarray) -> None:
    """(3.40): P_actual = eT_X eT_Y eT_Z P, each error after its own motion. Exact but for squares of the angles."""
    rng = np.random.default_rng(1)
    errors = {name: rng.normal(size=6) * [0.02, 0.02, 0.02, 1e-4, 1e-4, 1e-4] for name in "XYZ"}
    machine = dmu50.replace(effects=())
    for name, e in errors.items():
        machine = erroneous(machine, name, e)
    still = poses * [0, 0, 1, 1, 1]
    expected = []
    for _, _, x, y, z in still:
        motions = [np.array(m, dtype=float) for m in (shifted(x, 0, 0), shifted(0, y, 0), shifted(0, 0, z))]
        tip = np.eye(4)
        for name, motion in zip("XYZ", motions, strict=True):
            tip = tip @ motion @ error_matrix(errors[name])
        expected.append(tip @ [0, 0, -100, 1])
    # half the square of 3e-4 rad over 700 mm
    np.testing.assert_allclose(machine.actual_tip(still, State(100.0)), np.array(expected)[:, :3], atol=5e-5)


def test_rotary_axes_err_in_their_own_frames(dmu50: Machine, poses: np.ndarray) -> None:
    """T_act = T01 T12 [E_B T23] T34 T45 [E_C T5w]: B in the tilted frame 2, C in frame 5, each about its own origin.

    This is (2.42) put where the errors were identified; frame 5 has its origin in the table surface.
    """
    rng = np.random.default_rng(2)
    e_b, e_c = rng.normal(size=(2, 6)) * [0.02, 0.02, 0.02, 1e-4, 1e-4, 1e-4]
    machine = erroneous(erroneous(dmu50.replace(effects=()), "B", e_b), "C", e_c, (0.0, 0.0, 0.0))
    inner, middle = numbers(T01 * T12, poses), numbers(T23 * T34 * T45, poses)
    table = inner @ error_matrix(e_b) @ middle @ error_matrix(e_c) @ numbers(T5W, poses)
    expected = (np.linalg.inv(table) @ numbers(T_0T, poses))[:, :3, 3]
    # half the square of 3e-4 rad over 700 mm
    np.testing.assert_allclose(machine.actual_tip(poses), expected, atol=5e-5)


def test_squareness_with_x_as_datum(dmu50: Machine) -> None:
    """(3.15): y E_C(0X)Y and z E_B(0X)Z in x, z E_A(0Y)Z in y, but with the signs of a turned axis.

    The thesis writes a positive shift for a positive angle; a right-handed turn of Y about C moves it towards -x, and
    of Z about A towards -y.
    """
    sizes = {"EC0Y": 30e-6, "EB0Z": -20e-6, "EA0Z": 10e-6}
    machine = dmu50.replace(effects=tuple(Effect(name, (size,)) for name, size in sizes.items()))
    y, z = 300.0, 200.0
    error = machine.error(joints(100, y, z, 0, 0))
    expected = [-y * sizes["EC0Y"] + z * sizes["EB0Z"], -z * sizes["EA0Z"], 0]
    np.testing.assert_allclose(error[:3], expected, atol=1e-6)


# -- the recovered curves ---------------------------------------------------------------------------------------------

FIGURE_3_11 = """
49.9956  -0.000949353  -0.00156385
99.9937  -0.000753776   0.000895042
149.993  -0.000362045  -0.00238055
199.992  -0.000215857  -0.00110904
249.99   -0.000387325   0.00149589
299.987  -0.000716486   0.000389921
349.984  -0.000948794  -0.000920075
399.981  -0.000872622   0.00182009
449.979  -0.000456766   0.000298728
499.981   1.20629e-05  -0.00292907
"""


def recovered(machine: Machine, x: np.ndarray) -> np.ndarray:
    """E_XX, E_YX, E_ZX at positions x, (n, 3) mm."""
    q = np.zeros((len(x), 5))
    q[:, 2] = x
    return machine.joint_errors(q)[:, 2, :3]


def test_the_curves_give_the_printed_correction(dmu50: Machine) -> None:
    """After = before - error, to every one of the six printed digits."""
    after = np.array([[float(word) for word in line.split()] for line in FIGURE_3_11.split("\n") if line])
    x = np.arange(50.0, 501.0, 50.0)
    corrected = np.column_stack([x, 0 * x, 0 * x]) - recovered(dmu50, x)
    assert [f"{value:.6g}" for value in corrected.ravel()] == [f"{value:.6g}" for value in after.ravel()]


def test_what_is_known_of_the_curves(dmu50: Machine) -> None:
    """Zero at the start, straightness without slope, E_XX with 0.0405 um/mm and 20.8 um at most near 454 mm.

    The slope of E_XX is known to the half micrometre that its printed digits leave, over 500 mm.
    """
    nodes, fine = np.arange(0.0, 501.0, 50.0), np.arange(0.0, 500.1, 0.5)
    assert (recovered(dmu50, np.zeros(1)) == 0).all()
    slopes = np.polyfit(nodes, recovered(dmu50, nodes), 1)[0] * 1e3
    assert slopes[0] == pytest.approx(0.0405, abs=0.5 / 500)
    np.testing.assert_allclose(slopes[1:], 0, atol=1e-8)
    curve = recovered(dmu50, fine) * 1e3
    assert curve[:, 0].max() == pytest.approx(20.8, abs=0.05)
    assert fine[curve[:, 0].argmax()] == pytest.approx(454, abs=5)
    assert recovered(dmu50, np.array([20.0]))[0, 2] * 1e3 == pytest.approx(5.9, abs=0.05), "degree 8 overshoots"
    assert np.abs(recovered(dmu50, nodes)[:, 2]).max() * 1e3 <= 2.9301


def test_the_shipped_machine_has_no_error_where_its_measurement_began(dmu50: Machine) -> None:
    assert np.abs(dmu50.error(np.zeros(5), State(100.0))).max() < 1e-12
