"""What the defects of the thesis's machine model cost, each alone, on its own machine.

Left: the model as it is listed (Listings 3.2 to 3.4, appendix D.1), written out here. Right: ncfix's. The numbers are
residuals after a correction with the listed model of a machine that has the error that ncfix models.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ncfix.machine import Axis, Effect, Machine, load, se3

D = 154.996
UM, URAD = 1e-3, 1e-6


@pytest.fixture(scope="module")
def perfect(root: Path) -> Machine:
    """The DMU 50 without errors."""
    return load(root / "examples/machines/dmu50.toml").replace(effects=())


def turned(axis: int, angle: float) -> np.ndarray:
    """A right-handed rotation about a base axis, 4x4."""
    return se3.turn(angle * np.eye(3)[axis])


def table(machine: Machine, b: float, c: float) -> np.ndarray:
    """T_r(B, C): base from workpiece."""
    return se3.inverse(machine.nominal([c, b, 0, 0, 0]))


def listed(machine: Machine, b: float, c: float, e_b: np.ndarray, e_c: np.ndarray) -> np.ndarray:
    """T_er of Listing 3.3: everything in front, in the base frame, about its origin.

    rot_y has the wrong sign, and the angular positioning is read from the files of the tilt about Y.
    """
    motion = np.eye(4)
    for e in (e_b, e_c):
        motion = motion @ turned(0, e[3]) @ turned(1, -e[4]) @ turned(2, e[4])
    for e in (e_b, e_c):
        motion = motion @ se3.shift(e[:3])
    return motion @ table(machine, b, c)


def shift_added(
    machine: Machine, point: np.ndarray, b: float, c: float, e_b: np.ndarray, e_c: np.ndarray
) -> np.ndarray:
    """What the listed model adds to X Y Z for a point of the table: actual minus ideal."""
    return se3.apply(listed(machine, b, c, e_b, e_c), point) - se3.apply(table(machine, b, c), point)


def left_over(machine: Machine, point: np.ndarray, b: float, c: float, e_b: np.ndarray, e_c: np.ndarray) -> np.ndarray:
    """The tip error that the listed correction leaves, and the one without correction: (2, 3) mm, base axes."""
    effects = [
        Effect(f"E{k}{joint}", (float(v),), reference=(0.0, 0.0, 0.0) if joint == "C" else None)
        for joint, e in (("B", e_b), ("C", e_c))
        for k, v in zip("XYZABC", e, strict=True)
    ]
    real = machine.replace(effects=tuple(effects))
    ideal = se3.apply(table(machine, b, c), point)
    added = shift_added(machine, point, b, c, e_b, e_c)
    tips = [real.actual_tip([c, b, *(ideal + shift)]) - point for shift in (added, np.zeros(3))]
    turning = table(machine, b, c)[:3, :3]
    return np.array(tips) @ turning.T


def unit(component: str, size: float) -> np.ndarray:
    """One error motion."""
    return size * np.eye(6)["XYZABC".index(component)]


NONE = np.zeros(6)
P = np.array([179.009, 94.545, 143.533])


def test_the_listing_is_the_thesis_s(perfect: Machine) -> None:
    """Section 5.3: E_XB = 10 um and E_AB = 100 urad at B = C = 90 add (0.010000, -0.03056216, -0.00169349)."""
    e_b = unit("X", 10 * UM) + unit("A", 100 * URAD)
    added = shift_added(perfect, P, np.pi / 2, np.pi / 2, e_b, NONE)
    np.testing.assert_allclose(added, [0.010000, -0.03056216, -0.00169349], atol=5e-9)


def test_what_the_listing_does_right(perfect: Machine) -> None:
    """C at B = 0, radial and axial motion and the tilt about X: nothing is left but squares of small numbers."""
    for component in "XYZA":
        size = 10 * UM if component in "XYZ" else 100 * URAD
        after, before = left_over(perfect, P, 0.0, 0.7, NONE, unit(component, size))
        assert np.linalg.norm(before) > 9.9 * UM
        assert np.linalg.norm(after) < 2e-3 * UM


@pytest.mark.parametrize("joint", ["B", "C"])
def test_bug_1_angular_positioning_is_never_applied(perfect: Machine, joint: str) -> None:
    """E_CB and E_CC read the file of E_BB and E_BC: 100 urad stay, 20 um at 200 mm radius and more."""
    e_b, e_c = (unit("C", 100 * URAD), NONE) if joint == "B" else (NONE, unit("C", 100 * URAD))
    after, before = left_over(perfect, P, 0.6, 0.7, e_b, e_c)
    np.testing.assert_allclose(after, before, rtol=1e-12)
    assert np.linalg.norm(after) > 17 * UM


def test_bugs_1_and_2_together_on_a_tilt_of_c(perfect: Machine) -> None:
    """E_BC of 100 urad: turned the wrong way (bug 2) and taken for angular positioning too (bug 1): 51 um."""
    size, c = 100 * URAD, 0.7
    after, before = left_over(perfect, P, 0.0, c, NONE, unit("B", size))
    ideal = se3.apply(table(perfect, 0.0, c), P)
    np.testing.assert_allclose(before, -size * np.cross([0, 1, 0], ideal), atol=0.01 * UM)
    np.testing.assert_allclose(after, size * np.cross([0, -2, 1], ideal), atol=0.01 * UM)
    assert np.linalg.norm(before) == pytest.approx(24.4 * UM, abs=0.1 * UM)
    assert np.linalg.norm(after) == pytest.approx(50.5 * UM, abs=0.1 * UM)


def test_bug_2_the_tilt_about_y_has_the_wrong_sign(perfect: Machine) -> None:
    """Correcting with rot_y of -angle doubles the error instead of removing it."""
    size = 100 * URAD
    ideal = se3.apply(table(perfect, 0.0, 0.7), P)
    error = size * np.cross([0, 1, 0], ideal)
    wrong = se3.apply(turned(1, -size), ideal) - ideal
    real = perfect.replace(effects=(Effect("EBC", (size,), reference=(0.0, 0.0, 0.0)),))
    tip = real.actual_tip([0.7, 0.0, *(ideal + wrong)]) - P
    np.testing.assert_allclose(np.linalg.norm(tip), 2 * np.linalg.norm(error), rtol=1e-3)
    assert np.linalg.norm(error) > 20 * UM


def test_bug_3_errors_of_b_about_the_table_centre_cost_the_height_of_the_axes(perfect: Machine) -> None:
    """15.5 um per 100 urad: the tilt acts about the crossing of B and C, 154.996 mm above the table."""
    after, _ = left_over(perfect, P, 0.0, 0.0, unit("A", 100 * URAD), NONE)
    np.testing.assert_allclose(after, [0, -100 * URAD * D, 0], atol=0.01 * UM)
    assert np.linalg.norm(after) == pytest.approx(15.5 * UM, abs=0.01 * UM)


def test_bug_3_errors_of_b_are_meant_in_axes_tilted_by_45_degrees(perfect: Machine) -> None:
    """10 um of E_YB are 7.07 um in Y and 7.07 um in Z; taken for 10 um in Y they leave 7.7 um."""
    after, before = left_over(perfect, P, 0.0, 0.0, unit("Y", 10 * UM), NONE)
    half = 10 * UM * np.sqrt(0.5)
    np.testing.assert_allclose(before, [0, -half, -half], atol=1e-9)
    np.testing.assert_allclose(after, [0, 10 * UM - half, -half], atol=1e-9)
    assert np.linalg.norm(after) == pytest.approx(7.65 * UM, abs=0.01 * UM)


def test_bug_3_errors_of_c_ride_on_b(perfect: Machine) -> None:
    """10 um of E_ZC point along the C axis; at B = 180 that lies level, and the listing leaves 14 um."""
    after, before = left_over(perfect, P, np.pi, 0.0, NONE, unit("Z", 10 * UM))
    np.testing.assert_allclose(before, [0, 10 * UM, 0], atol=1e-9)
    assert np.linalg.norm(after) == pytest.approx(np.sqrt(2) * 10 * UM, abs=1e-9)


def test_bug_4_the_sum_of_two_slopes_is_not_a_squareness() -> None:
    """Straightness of X and Y measured with slopes m_YX and m_XY; the squareness is their signed difference of angles.

    Taking the sum leaves 2 m_XY y; here 30 um/m over 400 mm leave 24 um, after 28 um without any correction.
    """
    m_yx, m_xy, y = 40e-6, 30e-6, 400.0
    turn_of_x, turn_of_y = m_yx, -m_xy
    machine = three_axes(turn_of_x, turn_of_y)
    datum_x = machine.actual_tip([100.0, y, 0.0]) - machine.actual_tip([100.0, 0.0, 0.0])
    across = datum_x @ [np.cos(m_yx), np.sin(m_yx), 0]
    listed_squareness = turn_of_x + turn_of_y
    right_squareness = turn_of_x - turn_of_y
    assert across == pytest.approx(y * right_squareness, abs=1e-5)
    assert across - y * listed_squareness == pytest.approx(2 * m_xy * y, abs=1e-5)
    assert 2 * m_xy * y == pytest.approx(24 * UM)


def three_axes(turn_of_x: float, turn_of_y: float) -> Machine:
    """A machine with these location errors."""

    axes = tuple(
        Axis(name, False, False, way) for name, way in zip("XYZ", ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)), strict=True)
    )
    effects = (Effect("EC0X", (turn_of_x,)), Effect("EC0Y", (turn_of_y,)))
    return Machine("", "w F X Y Z t", axes, effects=effects)


def test_bug_6_seats_that_are_not_turned_with_the_table_give_wrong_angles(perfect: Machine) -> None:
    """Three seats on the table, measured at C = 180: a pure E_CC of 50 urad comes out as -50, translations right."""
    seats = np.array([[150.0, 20.0, 30.0], [-40.0, 130.0, 80.0], [-90.0, -110.0, 10.0]])
    c = np.pi
    truth = np.array([4 * UM, -3 * UM, 2 * UM, 0, 0, 50 * URAD])
    effects = [Effect(f"E{k}C", (float(v),), reference=(0.0, 0.0, 0.0)) for k, v in zip("XYZABC", truth, strict=True)]
    table_turned = se3.inverse(perfect.nominal([c, 0, 0, 0, 0]))
    table_real = se3.inverse(perfect.replace(effects=tuple(effects)).actual([c, 0, 0, 0, 0]))
    nominal = se3.apply(table_turned, seats)
    difference = se3.apply(table_real, seats) - nominal
    np.testing.assert_allclose(identified(nominal, difference), truth, atol=1e-7)
    wrong = identified(seats, difference)
    np.testing.assert_allclose(wrong[:3], truth[:3], atol=0.5 * UM)
    assert wrong[5] == pytest.approx(-50 * URAD, rel=1e-3)


def identified(places: np.ndarray, difference: np.ndarray) -> np.ndarray:
    """Zhang and Hu: six error motions from the displacements of three points, least squares over all nine."""
    rows = [np.hstack([np.eye(3), -se3.skew(place)]) for place in places]
    solution = np.linalg.lstsq(np.vstack(rows), difference.ravel(), rcond=None)[0]
    return np.asarray(solution)
