"""Esmaeili's models of 81 and 84 errors: their printed coefficients simulated with her strategies and estimated back.

Her error motions of a rotary axis are given in axes that turn with it: `error_frame = "moving"`. In axes that stand
still the constant of EYA is a shift of the whole table, which the unknown places of the balls take up.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from ncfix.machine import Machine
from ncfix.measure.calibrate import calibrate
from ncfix.measure.estimate import Problem
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.least_squares import solve
from ncfix.measure.measurement import Measurement
from ncfix.measure.selection import Selection, select
from tables.table_4_2 import coefficients
from validation.esmaeili import HU40, TABLE_4_3
from validation.test_esmaeili_models import AC, strategy

# Appendix, calibration: mm, mm/mm, ...; rad, rad/mm, rad/rad, ...; b: backlash
APPENDIX = """
XX2 6.09E-06 XX3 1.29E-07 YX1 1.18E-03 YX2 -1.25E-05 YX3 -3.08E-07 ZX2 8.84E-06 ZX3 3.65E-08 AX0 -1.20E-02
AX1 1.71E-05 AX2 -1.05E-07 AX3 -3.43E-09 BX0 -1.60E-03 BX1 3.39E-06 BX2 -1.01E-07 BX3 -1.73E-09 XY2 -2.85E-08
XY3 -9.54E-08 YY1 1.16E-04 YY2 1.01E-05 YY3 -2.00E-08 ZY2 -5.46E-06 ZY3 1.05E-07 AY1 4.33E-06 AY2 1.05E-07
AY3 -2.21E-11 BY0 2.63E-04 BY1 -2.69E-06 BY2 -1.36E-08 BY3 1.63E-10 CY0 1.65E-02 CY1 1.30E-06 CY2 6.68E-08
CY3 -6.86E-10 XZ2 1.60E-05 XZ3 -4.16E-08 YZ2 -1.05E-04 YZ3 2.78E-07 ZZ1 -4.00E-03 ZZ2 3.09E-05 ZZ3 -5.77E-08
XA1 1.59E-02 XA2 1.40E-03 XA3 2.75E-02 YA0 1.59E-01 YA1 -7.04E-02 YA2 -7.30E-01 YA3 1.53E-02 ZA1 -1.55E-01
ZA2 3.24E-02 ZA3 2.35E-01 AA0 1.82E-04 AA1 2.34E-04 AA2 -2.45E-04 AA3 -7.92E-05 AAb 3.11E-07 BA0 9.85E-04
BA1 -1.73E-02 BA2 -2.53E-04 BA3 2.91E-03 CA1 -7.50E-04 CA2 8.21E-03 CA3 2.04E-04 XC1 -8.48E-04 XC2 5.45E-04
XC3 1.14E-04 YC1 -9.21E-04 YC2 1.74E-04 YC3 6.40E-05 ZC1 -9.57E-04 ZC2 2.83E-04 ZC3 8.51E-05 AC1 2.12E-06
AC2 2.07E-06 AC3 4.48E-07 BC1 1.45E-05 BC2 -6.32E-06 BC3 -1.51E-06 CC1 -3.25E-06 CC2 -2.66E-06 CC3 -1.09E-08
CCb -2.17E-04
"""
# Table 4-1: spindle, B, C; balls 1 and 2 are the scale bar's
SAMBA = """
0,10,30:345 0,30,90:345 0,50,150:345 0,70,210:345 0,90,270:3456 0,60,180:345 0,40,120:346 0,20,60:346 0,-10,-30:345
0,-30,-90:345 0,-50,-150:345 0,-70,-210:345 0,-90,-270:3456 0,-60,-180:345 0,-40,-120:346 0,-20,-60:346
0,0,90:123456 0,0,240:345 0,0,300:345 0,0,180:123456 0,0,45:123456 0,0,-45:123456 0,0,-180:123456 0,0,-300:345
0,0,-240:345 0,0,-90:123456 0,0,0:123456 60,0,0:3 120,0,0:3 180,0,0:3 240,0,0:3 300,0,0:3
"""
BAR = 304.6686
BALLS = {
    "1": (-BAR / 2, 90.0, 60.0), "2": (BAR / 2, 90.0, 60.0), "3": (110.0, 0.0, 90.0), "4": (-70.0, 90.0, 140.0),
    "5": (-70.0, -90.0, 60.0), "6": (30.0, -40.0, 180.0),
}  # fmt: skip
LENGTH = 275.86


def turning(machine: Machine) -> Machine:
    """The machine without errors, error motions of its rotary axes in axes that turn with them."""
    axes = tuple(replace(axis, moving_frame=axis.rotary) for axis in machine.axes)
    return machine.replace(axes=axes, effects=())


def values_of(selection: Selection, printed: dict[str, float]) -> np.ndarray:
    """The printed coefficients in the order of the selection; her backlash is half the play."""
    found = []
    for effect in selection.estimated:
        if effect.basis.name == "backlash":
            found.append(2 * printed[f"{effect.name[1:]}b"])
        else:
            found += [printed[f"{effect.name[1:]}{degree}"] for degree in effect.basis.degree]
    return np.array(found)


def samba() -> Measurement:
    """Table 4-1: 109 probings. Balls are made up; rotary axes come from the side of the row before."""
    rows = [(*map(float, head.split(",")), ball) for head, _, balls in
            (each.partition(":") for each in SAMBA.split()) for ball in balls]  # fmt: skip
    spindle, b, c = np.array([row[:3] for row in rows]).T
    sides = {f"dir_{axis}": np.sign(np.diff(turn, prepend=turn[0] - 1)) for axis, turn in (("B", b), ("C", c))}
    columns = {"B": b, "C": c, "spindle_deg": spindle, "tool_length": np.full(len(rows), LENGTH), **sides}
    labels = {"ball": tuple(row[3] for row in rows)}
    empty = Measurement("probe", (("distance", f"1 2 {BAR} 0.0012"),), columns, labels)
    machine = turning(HU40)
    linear = [machine.axis_names.index(axis) for axis in "XYZ"]
    places = np.array([BALLS[ball] for ball in labels["ball"]])
    q = empty.positions(machine)
    by_axes = np.linalg.inv(machine.axis_jacobian(q, LENGTH)[:, :3, linear])
    q[:, linear] -= np.einsum("nij,nj->ni", by_axes, machine.tip(q, LENGTH) - places)
    return empty.with_columns(dict(zip(("mx", "my", "mz"), q[:, linear].T, strict=True)))


def condition(problem: Problem) -> tuple[int, float]:
    """Rank and condition of errors and set-up together, columns of length one."""
    whole = np.concatenate([problem.design, problem.nuisance(problem.start)], axis=1)
    values = np.linalg.svd(whole / np.linalg.norm(whole, axis=0), compute_uv=False)
    return int((values > 1e-10 * values[0]).sum()), float(values[0] / values[-1])


def test_81_errors_and_15_unknowns_of_the_set_up_come_back(figures):
    """Printed: 96 unknowns, all of them determined, condition 3900; the places of the balls are not printed."""
    machine = turning(AC)
    selection = select(machine, "esmaeili-81")
    rank, size = condition(Problem.of([strategy()], machine, selection))
    figures(f"Esmaeili, 81 errors and 15 unknowns: rank {rank}, condition {size:.0f} (printed 96, 3900)")
    assert rank == 96
    assert size < 3900
    truth = values_of(selection, {n: float(v) for n, v in re.findall(r"(\w\w[\db]) (-?[\d.]+E[-+]\d+)", APPENDIX)})
    data = simulate(strategy(), selection.machine(machine, truth.tolist()), Faults(noise_um=1.8), seed=3)
    found = calibrate([data], machine, selection)
    error = (found.estimate.coefficients - truth) / found.sigma
    assert np.isfinite(error).all()
    assert np.abs(error).max() < 4.5
    assert 0.8 < found.chi_square < 1.25


def test_in_axes_that_stand_still_two_of_the_81_are_lost():
    problem = Problem.of([strategy()], AC, select(AC, "esmaeili-81"))
    found = solve(problem.design, problem.nuisance(problem.start), np.zeros(len(problem.values)))
    assert [problem.selection.labels[k] for k in found.set_up] == ["EYA u^0"]
    assert len(found.kept) == 79


def test_table_4_3_by_table_4_1():
    """13 errors of the BC table, three absolute gains among them, by the balls with the scale bar: all are told."""
    machine = HU40.replace(effects=())
    selection = select(machine, "esmaeili-13-bc")
    truth = np.array([TABLE_4_3[effect.name] for effect in selection.estimated])
    data = simulate(samba(), selection.machine(machine, truth.tolist()), Faults(noise_um=1.0), seed=6)
    found = calibrate([data], machine, selection, loss="none")
    error = (found.estimate.coefficients - truth) / found.sigma
    assert np.isfinite(error).all()
    assert np.abs(error).max() < 4.5
    assert found.chi_square == pytest.approx(1, abs=0.25)


def test_table_4_2_by_table_4_1(figures):
    """84 errors by 109 probings of six balls with a scale bar: all are told.

    The printed values have frames in them, some mrad. Here they are a twentieth: the derivatives of a calibration are
    those of the machine without errors, and with a condition of 5e4 a turn of the frame by mrad would show.
    """
    machine = turning(HU40)
    selection = select(machine, "esmaeili-84")
    truth = values_of(selection, coefficients()) / 20
    data = simulate(samba(), selection.machine(machine, truth.tolist()), Faults(noise_um=1.0), seed=2)
    found = calibrate([data], machine, selection, loss="none")
    error = (found.estimate.coefficients - truth) / found.sigma
    size = found.estimate.solution.condition
    figures(f"Esmaeili, Table 4-2 by Table 4-1: {np.isfinite(error).sum()} of 84 told, condition {size:.0f}")
    assert len(samba()) == 109
    assert np.abs(error).max() < 4.5
    assert found.chi_square == pytest.approx(1, abs=0.25)
    assert "NCF638" in {message.code for message in found.remarks}
