"""The measurement protocol of Freeman and Ford (2003), section 5 and Table 4, and what can be identified at all.

Tests 6 to 8 cannot do what their note says: the correct statement is shown, and what believing them would cost.
"""

from __future__ import annotations

from collections import Counter
from functools import cache

import numpy as np
import pytest
import sympy as sp

from ncfix.machine.symbolic import Equation, derive, equations, identifiable, loads_chain, protocol
from ncfix.machine.symbolic.identification import simplest
from ncfix.machine.symbolic.printing import compiled
from validation.freeman_ford_head import (
    ARCSEC,
    DEGREE,
    ROOT,
    ROUNDING,
    SMALLS,
    UM,
    G,
    OAs,
    OCx,
    OCy,
    ThetaAs,
    ThetaAv,
    ThetaCh,
    ThetaCv,
    cot,
    cY,
    dYp,
    e,
    equal,
    first_order,
    sY,
)

# -- Table 4 ----------------------------------------------------------------------------------------------------------

TABLE_4 = [
    (1, "x", (90, 0), (270, 180), 2 * OCx),
    (2, "x", (90, 0), (270, 0), 2 * OAs * cY + 2 * G * sY),
    (3, "x", (0, 270), (0, 90), 2 * OAs + 2 * OCy - 2 * e),
    (4, "z", (0, 270), (0, 90), 2 * e * ThetaCh),
    (5, "z", (0, 0), (0, 180), 2 * e * ThetaCv),
    (6, "x", (0, 0), (0, 180), 2 * G * ThetaAs - 2 * G * cY * ThetaAv + 2 * OCx),
    (7, "y", (90, 180), (270, 180), 2 * G * cY * ThetaAs - 2 * G * cY**2 * ThetaAv),
    (8, "x", (0, 0), (0, 180), 2 * G * ThetaAs - 2 * G * cY * ThetaAv + 2 * OCx),
]


@cache
def all_equations() -> tuple[Equation, ...]:
    return equations(first_order(), zero=["dYp"])


def difference(coordinate: str, first: tuple[int, ...], second: tuple[int, ...]) -> sp.Expr:
    """First pose minus second pose; the pairs are listed once, in either order."""
    for equation in all_equations():
        if equation.coordinate == coordinate and equation.sign < 0:
            if (equation.first, equation.second) == (first, second):
                return equation.expression
            if (equation.first, equation.second) == (second, first):
                return -equation.expression
    raise AssertionError(f"no equation for {coordinate}{first} - {coordinate}{second}")


@pytest.mark.parametrize(("test", "coordinate", "first", "second", "formula"), TABLE_4)
def test_table_4(test: int, coordinate: str, first: tuple[int, ...], second: tuple[int, ...], formula: sp.Expr) -> None:
    assert equal(difference(coordinate, first, second), formula), test


def test_sixteen_poses_give_720_equations() -> None:
    differences = Counter(len(equation.unknowns) for equation in all_equations() if equation.sign < 0)
    sums = Counter(len(equation.unknowns) for equation in all_equations() if equation.sign > 0)
    assert len(all_equations()) == 720
    assert differences == {1: 12, 2: 52, 3: 28, 4: 76, 5: 144, 6: 48}
    assert sums == {0: 2, 1: 18, 2: 36, 3: 40, 4: 64, 5: 104, 6: 96}


def test_what_single_readings_pairs_identify() -> None:
    """ThetaAs and ThetaAv never come alone; A = 180 gives the angles of C a longer lever than the paper's choice."""
    single = simplest(equation for equation in all_equations() if equation.sign < 0)
    found = [str(next(iter(equation.unknowns))) for equation in single]
    assert {name: found.count(name) for name in set(found)} == {"OCx": 4, "OAs": 4, "ThetaCv": 2, "ThetaCh": 2}
    assert equal(difference("z", (180, 0), (180, 180)), (4 * G * sY * cY + 2 * e) * ThetaCv)
    absolute = simplest((eq for eq in all_equations() if eq.sign > 0), wanted=ThetaCh)
    assert any(equal(equation.expression, -2 * (G + e * cot) * ThetaCh) for equation in absolute)


def test_6_7_and_8_cannot_separate_thetaas_and_thetaav() -> None:
    """Test 7 is cos(Yp) (Test 6 - 2 OCx), Test 8 is Test 6: the simultaneous equations of the note are singular."""
    six, seven, eight = (row[-1] for row in TABLE_4[5:])
    assert equal(seven, cY * (six - 2 * OCx))
    assert eight == six
    matrix = sp.Matrix([[row.coeff(unknown) for unknown in (ThetaAs, ThetaAv)] for row in map(sp.expand, (six, seven))])
    assert matrix.det() == 0


def test_what_believing_test_7_costs() -> None:
    """100 arcsec of ThetaAv taken for ThetaAs: the tip is right everywhere, the tool's direction is not."""
    _, error = compiled(first_order())
    angles = np.arange(0, 360, 10) * DEGREE
    size = 100 * ARCSEC
    true = error(angles[:, None], angles, ThetaAv=size)
    taken = error(angles[:, None], angles, ThetaAs=-np.cos(50 * DEGREE) * size)
    np.testing.assert_allclose(taken[..., :3], true[..., :3], rtol=0, atol=ROUNDING)
    turned = np.linalg.norm((true - taken)[..., 3:], axis=-1) / ARCSEC
    assert turned.max() == pytest.approx(100 * np.sin(50 * DEGREE), abs=0.01)  # 76.6 arcsec
    longer = error(angles[:, None], angles, G=150.0, ThetaAv=size) - error(angles[:, None], angles, G=150.0)
    again = error(angles[:, None], angles, G=150.0, ThetaAs=-np.cos(50 * DEGREE) * size)
    np.testing.assert_allclose(longer[..., :3], again[..., :3], rtol=0, atol=10 * ROUNDING)


def test_what_believing_dy_zero_costs_with_another_tool() -> None:
    """OAs and dYp act as OAs - G dYp: identified with 20 mm, a dYp of 100 arcsec is 63 um wrong with 150 mm."""
    _, error = compiled(first_order())
    angles = np.arange(0, 360, 10) * DEGREE
    size = 100 * ARCSEC
    as_offset = {"OAs": -20 * size}
    same = error(angles[:, None], angles, G=20.0, dYp=size) - error(angles[:, None], angles, G=20.0, **as_offset)
    other = error(angles[:, None], angles, G=150.0, dYp=size) - error(angles[:, None], angles, G=150.0, **as_offset)
    np.testing.assert_allclose(same[..., :3], 0, atol=ROUNDING)
    assert np.linalg.norm(other[..., :3], axis=-1).max() / UM == pytest.approx(63.0, abs=0.05)


# -- what can be identified at all ------------------------------------------------------------------------------------


def test_rank_6_of_8_with_one_tool_length_and_7_with_two() -> None:
    one, two = identifiable(first_order()), identifiable(first_order(), ["Ap", "Cp", "G"])
    assert (one.rank, two.rank, len(one.unknowns)) == (6, 7, 8)
    assert set(one.inseparable) == {ThetaAs - cY * ThetaAv, OAs - G * dYp}
    assert set(two.inseparable) == {ThetaAs - cY * ThetaAv}
    assert identifiable(first_order(), absolute=False).rank == 6
    tool_direction_too = ("dx", "dy", "dz", "rx", "ry", "rz")
    assert identifiable(first_order(), components=tool_direction_too).rank == 8


def test_the_rank_by_numbers() -> None:
    """The same on a grid of 30 degrees, by singular values."""
    _, error = compiled(first_order())
    angles = np.arange(0, 360, 30) * DEGREE

    def design(length: float) -> np.ndarray:
        columns = [error(angles[:, None], angles, G=length, **{name: 1.0})[..., :3].ravel() for name in SMALLS]
        return np.stack(columns, axis=1)

    def rank(matrix: np.ndarray) -> int:
        return int(np.linalg.matrix_rank(matrix / np.linalg.norm(matrix, axis=0), tol=1e-9))

    assert rank(design(20.0)) == 6
    assert rank(np.vstack([design(20.0), design(60.0)])) == 7


def test_the_protocol_identifies_all_that_can_be() -> None:
    found = protocol([equation for equation in all_equations() if equation.sign < 0])
    assert {step.identifies for step in found} == {ThetaCv, ThetaCh, OCx, OAs, OCy, ThetaAs - cY * ThetaAv}
    assert all(len(step.equations) == 1 for step in found)
    with_dy = protocol(equations(first_order(), signs=(-1,)))
    assert {step.identifies for step in with_dy} == {ThetaCv, ThetaCh, OCx, OCy, OAs - G * dYp, ThetaAs - cY * ThetaAv}


def test_a_tilt_of_the_spindle_about_x_is_absorbed_by_dyp() -> None:
    """As the paper has it: only the tilt about y needs a parameter of its own."""
    text = (ROOT / "examples/chains/angle_head.toml").read_text()
    text = text.replace('"Ry(ThetaAs)",', '"Ry(ThetaAs)",\n    "Rx(ThetaAx)",')
    text = text.replace("\nOAs = ", '\nThetaAx = { size = "small", angle = true }\nOAs = ')
    tilt = sp.Symbol("ThetaAx", real=True)
    combinations = identifiable(derive(loads_chain(text))).combinations
    merged = next(combination for combination in combinations if combination.has(tilt))
    assert equal(merged.coeff(dYp), merged.coeff(tilt))
