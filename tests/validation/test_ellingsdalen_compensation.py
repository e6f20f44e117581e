"""The thesis's compensation: its only printed sample, its order made sound, and what each of its short cuts costs.

S. H. Ellingsdalen, NTNU 2021. Section numbers of the procedure are the thesis's: 3.5 and 3.6, listings 3.3 and 3.4.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from ncfix.compensate.plan.kinematics import affine_tip, moved, solve
from ncfix.compensate.plan.strategies import RotaryThenLinear, get_strategy, linear_columns, rotary_shift
from ncfix.diagnostics import UsageError
from ncfix.machine import Effect, Machine, State, load
from ncfix.machine.basis import Polynomial

D = 154.996
UM, URAD = 1e-3, 1e-6
NANOMETRE = 1e-6

FIGURE_3_11 = """
1   49.9956  -0.000949353  -0.00156385
2   99.9937  -0.000753776   0.000895042
3  149.993   -0.000362045  -0.00238055
4  199.992   -0.000215857  -0.00110904
5  249.99    -0.000387325   0.00149589
6  299.987   -0.000716486   0.000389921
7  349.984   -0.000948794  -0.000920075
8  399.981   -0.000872622   0.00182009
9  449.979   -0.000456766   0.000298728
10 499.981    1.20629e-05  -0.00292907
"""


@pytest.fixture(scope="module")
def dmu50(root: Path) -> Machine:
    """The shipped machine, with the curves recovered from the figure."""
    return load(root / "examples/machines/dmu50.toml")


@pytest.fixture(scope="module")
def perfect(dmu50: Machine) -> Machine:
    """The same without errors."""
    return dmu50.replace(effects=())


def at(x: float = 0, y: float = 0, z: float = 0, b: float = 0, c: float = 0) -> np.ndarray:
    """One pose in the thesis's order and degrees, as axis positions C B X Y Z, (1, 5)."""
    return np.array([[np.deg2rad(c), np.deg2rad(b), x, y, z]])


def left(machine: Machine, corrected: np.ndarray, wanted: np.ndarray, length: float = 0.0) -> np.ndarray:
    """The tip error that is left, (n, 3) mm."""
    return machine.actual_tip(corrected, State(length)) - machine.tip(wanted, length)


# -- the printed sample -----------------------------------------------------------------------------------------------


def x_line() -> np.ndarray:
    """The NC data of the figure: X = 0, 50, ..., 500."""
    q = np.zeros((11, 5))
    q[:, 2] = np.arange(0.0, 501.0, 50.0)
    return q


def test_figure_3_11_to_the_printed_digits(dmu50: Machine) -> None:
    """The strategy `thesis` on the X line; the first row is never touched."""
    printed = np.array([[float(word) for word in line.split()] for line in FIGURE_3_11.split("\n") if line])
    after = get_strategy("thesis").correct(dmu50, x_line(), State())
    assert [f"{value:.6g}" for value in after[1:, 2:].ravel()] == [f"{value:.6g}" for value in printed[:, 1:].ravel()]
    assert (after[0] == x_line()[0]).all()
    assert (after[:, :2] == 0).all(), "B and C are unchanged"


def test_the_corrected_points_lie_where_the_program_wants_them(dmu50: Machine) -> None:
    """Before: the error curves themselves. After: nothing that a tool of no length would show."""
    before = left(dmu50, x_line(), x_line())
    after = left(dmu50, get_strategy("thesis").correct(dmu50, x_line(), State()), x_line())
    assert before[:, 0].max() == pytest.approx(20.8 * UM, abs=0.6 * UM), "the peak of E_XX lies between two points"
    assert (np.sign(before[1:, 0]) == 1).all()
    assert np.abs(after).max() < 0.02 * UM
    exact = get_strategy("rotary-then-linear").correct(dmu50, x_line(), State())
    assert np.abs(left(dmu50, exact, x_line())).max() < NANOMETRE
    assert np.abs(exact - get_strategy("thesis").correct(dmu50, x_line(), State())).max() < 0.02 * UM


def test_the_printed_correction_is_too_small_for_what_it_is_said_to_have_done(dmu50: Machine) -> None:
    """E_YX fell from 6.6 to 1.3 um after Y commands that changed by 0.95 um at most: their frames were two."""
    changed = np.abs(get_strategy("thesis").correct(dmu50, x_line(), State()) - x_line()).max(axis=0) / UM
    assert changed[3] == pytest.approx(0.95, abs=0.005)
    assert changed[3] < 6.6 - 1.3


def test_section_5_3_from_the_listing(perfect: Machine) -> None:
    """p = (179.009, 94.545, 143.533), B = C = 90, E_XB = 10 um, E_AB = 100 urad."""
    errors = np.zeros((2, 1, 6))
    errors[0, 0, [0, 3]] = 10 * UM, 100 * URAD
    ideal = np.array([[134.684043, -16.919589, 305.622411]])
    added = rotary_shift(list(errors), ideal)
    np.testing.assert_allclose(added, [[0.010000, -0.03056216, -0.00169349]], rtol=0, atol=5e-9)


def test_it_is_for_machines_of_that_kind_only(root: Path) -> None:
    with pytest.raises(UsageError) as raised:
        get_strategy("thesis").correct(load(root / "examples/machines/wCBXFZYSt.toml"), np.zeros((2, 5)), State())
    assert raised.value.code == "NCF412"


# -- the order of the thesis with its defects removed -----------------------------------------------------------------


def rigid(rotation: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """A 4x4 matrix."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, shift
    return matrix


def turn_x(angle: float) -> np.ndarray:
    """A rotation about X, 4x4."""
    c, s = np.cos(angle), np.sin(angle)
    return rigid(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), np.zeros(3))


def turn_z(angle: float) -> np.ndarray:
    """A rotation about Z, 4x4."""
    c, s = np.cos(angle), np.sin(angle)
    return rigid(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.zeros(3))


def small(e: np.ndarray) -> np.ndarray:
    """The small-angle matrix of six errors, 4x4."""
    x, y, z, a, b, c = e
    return rigid(np.array([[1, -c, b], [c, 1, -a], [-b, a, 1]]), np.array([x, y, z]))


def table(b: float, c: float, e_b: np.ndarray, e_c: np.ndarray) -> np.ndarray:
    """T01 T12 [E_B Rz(B)] T34 T45 [E_C Rz(-C)]: base from workpiece, each error about the crossing of the axes."""
    up, down = (rigid(np.eye(3), np.array([0, 0, height])) for height in (D, -D))
    swivel = up @ turn_x(np.pi / 4) @ small(e_b) @ turn_z(b) @ turn_x(-np.pi / 4)
    return swivel @ small(e_c) @ down @ turn_z(-c)


def random_poses() -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Poses and six errors of each joint."""
    rng = np.random.default_rng(0)
    for _ in range(30):
        q = np.array([*rng.uniform([-3, 0.1], [3, 3.0]), *rng.uniform([0, -200, 0], [400, 200, 400])])
        yield q, rng.normal(size=(5, 6)) * [0.02, 0.02, 0.02, 5e-5, 5e-5, 5e-5]


def one_pass(machine: Machine, q: np.ndarray, state: State) -> np.ndarray:
    """The thesis's single pass, by the exact model: to where the rotary axes alone bring the tip to the target."""
    rotary = {axis.name for axis in machine.axes if axis.rotary}
    turning = machine.replace(effects=tuple(effect for effect in machine.effects if effect.joint in rotary))
    rest = machine.replace(effects=tuple(effect for effect in machine.effects if effect.joint not in rotary))
    columns, maps = linear_columns(machine), affine_tip(machine, q, state.tool_length)[0]
    target = machine.tip(q, state.tool_length)
    shift = -solve(maps, turning.actual_tip(q, state) - target)
    shifted = moved(q, columns, shift)
    nominal = target + np.einsum("...ij,...j->...i", maps, shift)
    return moved(shifted, columns, -solve(maps, rest.actual_tip(shifted, state) - nominal))


def test_one_pass_is_the_corrected_reference_algorithm(perfect: Machine) -> None:
    """e_rot = (T_act - T_r) p_w is added, e_lin read there taken off; written out with matrices of small angles."""
    for q, errors in random_poses():
        e_c, e_b, e_x, e_y, e_z = errors
        effects = [
            Effect(f"E{k}{joint}", (float(v),))
            for joint, six in zip("CBXYZ", errors, strict=True)
            for k, v in zip("XYZABC", six, strict=True)
        ]
        machine = perfect.replace(effects=tuple(effects))
        c, b, xyz = q[0], q[1], q[2:]
        ideal = table(b, c, np.zeros(6), np.zeros(6))
        tool = np.array([0, 0, -80.0])
        workpiece = np.linalg.inv(ideal) @ [*(xyz + tool), 1.0]
        turned = xyz + ((table(b, c, e_b, e_c) - ideal) @ workpiece)[:3]
        carriages = np.eye(4)
        for axis, six in enumerate((e_x, e_y, e_z)):
            carriages = carriages @ rigid(np.eye(3), turned * np.eye(3)[axis]) @ small(six)
        e_lin = (carriages @ [*tool, 1.0])[:3] - (turned + tool)
        expected = turned - e_lin
        found = one_pass(machine, q[None], State(80.0))[0]
        # squares of 2e-4 rad over 700 mm: matrices of small angles are no rotations
        np.testing.assert_allclose(found[2:], expected, rtol=0, atol=1e-4)
        assert (found[:2] == q[:2]).all()


def test_iterated_nothing_is_left_and_one_pass_leaves_products(dmu50: Machine) -> None:
    """What the thesis's single pass costs on the shipped machine: below a tenth of a micrometre."""
    rng = np.random.default_rng(1)
    q = rng.uniform([-3, 0.1, 0, -200, 0], [3, 3.0, 480, 400, 450], (500, 5))
    state = State(120.0)
    once, iterated = one_pass(dmu50, q, state), RotaryThenLinear().correct(dmu50, q, state)
    leave = [np.linalg.norm(left(dmu50, each, q, 120.0), axis=1).max() for each in (q, once, iterated)]
    assert leave[0] > 100 * UM
    assert 0.005 * UM < leave[1] < 0.2 * UM
    assert leave[2] < NANOMETRE


# -- what each short cut of the procedure costs -----------------------------------------------------------------------


def test_the_sign_of_the_rotary_deviation_taken_literally_doubles_the_error(perfect: Machine) -> None:
    """The text says "deviation with reversed sign" for both; for a table that is wrong, and the listing does not."""
    machine = perfect.replace(effects=(Effect("EXC", (15 * UM,), Polynomial((1,)), 0.0, 40.0),))
    q = np.concatenate([at(), at(100, 50, 30, 0, 40)])
    right = get_strategy("thesis").correct(machine, q, State())
    literal = 2 * q - right
    sizes = [np.linalg.norm(left(machine, each, q)[1]) for each in (q, right, literal)]
    np.testing.assert_allclose(sizes, [15 * UM, 0, 30 * UM], atol=NANOMETRE)


def test_constants_that_are_dropped_stay(perfect: Machine) -> None:
    """The fitted curve without its constant is zero at zero and off by that constant everywhere."""
    machine = perfect.replace(effects=(Effect("EXX", (5 * UM, 8 * UM), Polynomial((0, 1)), 0.0, 500.0),))
    q = np.concatenate([at(), at(250)])
    after = get_strategy("thesis").correct(machine, q, State())
    np.testing.assert_allclose(left(machine, after, q)[1], [5 * UM, 0, 0], atol=1e-3 * UM)


def test_reading_tables_at_whole_millimetres_costs_half_a_slope(dmu50: Machine) -> None:
    """E_ZX falls by 0.5 um in a millimetre near X = 0: at 0.5 mm the table gives the value of 0."""
    x = np.arange(0.0, 40.0, 0.1)
    q = np.zeros((len(x), 5))
    q[:, 2] = x
    after = left(dmu50, get_strategy("thesis").correct(dmu50, q, State()), q)
    sound = left(dmu50, get_strategy("rotary-then-linear").correct(dmu50, q, State()), q)
    assert 0.2 * UM < np.abs(after[1:, 2]).max() < 0.4 * UM
    assert np.abs(sound).max() < NANOMETRE


def test_whole_degrees_cost_more(perfect: Machine) -> None:
    """40 um in 10 degrees: half a degree is 2 um."""
    machine = perfect.replace(effects=(Effect("EZC", (40 * UM,), Polynomial((1,)), 0.0, 10.0),))
    q = np.concatenate([at(), at(0, 0, 100, 0, 3.5), at(0, 0, 100, 0, 4.0)])
    after = left(machine, get_strategy("thesis").correct(machine, q, State()), q)
    assert np.linalg.norm(after[1]) == pytest.approx(2 * UM, rel=1e-3)
    assert np.linalg.norm(after[2]) < 1e-3 * UM


def test_angles_of_linear_axes_cost_their_lever(perfect: Machine) -> None:
    """700 urad and a tool of 100 mm: the 70 um of the thesis's own machine stay."""
    machine = perfect.replace(effects=(Effect("EAZ", (700 * URAD,), Polynomial((1,)), 0.0, 100.0),))
    q = np.concatenate([at(), at(0, 0, 100)])
    state = State(100.0)
    after = left(machine, get_strategy("thesis").correct(machine, q, state), q, 100.0)
    assert np.linalg.norm(after[1]) == pytest.approx(70 * UM, rel=1e-3)
    sound = left(machine, get_strategy("rotary-then-linear").correct(machine, q, state), q, 100.0)
    assert np.linalg.norm(sound[1]) < NANOMETRE


def test_squareness_as_a_sum_leaves_twice_the_slope_of_the_second_axis(perfect: Machine) -> None:
    """Listing 3.2 adds two signed inclinations where ISO 230-1 takes their difference.

    Inclinations of 40 and 30 urad: the machine errs by their difference of turns, 70 urad; the listing corrects 10.
    """
    m_yx, m_xy, y = 40 * URAD, 30 * URAD, 400.0
    real = perfect.replace(effects=(Effect("EC0Y", (-(m_yx + m_xy),)),))
    believed = perfect.replace(effects=(Effect("EC0Y", (-(m_yx - m_xy),)),))
    q = np.concatenate([at(), at(100, y)])
    for model, stays in ((real, 0.0), (believed, 2 * m_xy * y)):
        after = get_strategy("thesis").correct(model, q, State())
        np.testing.assert_allclose(left(real, after, q)[1], [stays, 0, 0], atol=1e-3 * UM)
    np.testing.assert_allclose(left(real, q, q)[1], [(m_yx + m_xy) * y, 0, 0], atol=1e-3 * UM)


def test_the_two_slips_of_the_listing_on_one_tilt(perfect: Machine) -> None:
    """E_B. of 100 urad of the inner table, 300 mm out, 100 mm up: turned the wrong way, and taken for positioning."""
    errors = np.zeros((2, 1, 6))
    errors[1, 0, 4] = 100 * URAD
    point = np.array([[300.0, 0.0, 100.0]])
    printed, right = (rotary_shift(list(errors), point, as_printed) for as_printed in (True, False))
    np.testing.assert_allclose(right, [[10 * UM, 0, -30 * UM]], atol=0.01 * UM)
    np.testing.assert_allclose(printed, [[-10 * UM, 30 * UM, 30 * UM]], atol=0.01 * UM)


def test_the_first_point_is_never_corrected(dmu50: Machine) -> None:
    """A program that begins at X = 450 keeps 20 um there; the same point later in the program does not."""
    q = np.concatenate([at(450), at(450)])
    after = left(dmu50, get_strategy("thesis").correct(dmu50, q, State()), q)
    assert np.linalg.norm(after[0]) > 20 * UM
    assert np.linalg.norm(after[1]) < 0.02 * UM
