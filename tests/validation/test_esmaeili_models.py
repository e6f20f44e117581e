"""S. Esmaeili Marzdashti, Polytechnique Montreal 2021: the error models and their identification by probing a ball."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ncfix.machine import load
from ncfix.measure.calibrate import calibrate
from ncfix.measure.estimate import Problem
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.least_squares import solve
from ncfix.measure.measurement import Measurement
from ncfix.measure.selection import MODELS, select

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "machines"
AC = load(str(EXAMPLES / "wCAYFXZSt.toml")).replace(effects=())
BC = load(str(EXAMPLES / "wCBXFZYSt.toml")).replace(effects=())
# Table 5-3, (A, C) of the 42 calibration pairs
PAIRS = """
15,60 30,180 45,280 55,340 40,240 20,120 0,0 -20,-100 -40,250 -55,350 -50,-310 -25,-40 0,180 0,280 0,360 0,320 0,210
0,-160 0,-300 0,-220 0,-50 15,0 40,0 55,0 45,0 30,0 -20,0 -45,0 -55,0 -35,0 44,-30 53,-208 36,-318 30,45 21,326 9,290
-16,-12 -54,-304 -40,-10 -17,100 -38,197 -5,345
"""
BALLS = np.array([[60.0, 0.0, 37.5], [0.0, 60.0, 37.5], [-60.0, 0.0, 47.5], [0.0, -60.0, 47.5]])
LENGTH = 74.0
# Table 5-5, validation run S: mrad, EY0C in um; gains um/mm; backlash mrad
TABLE_5_5 = {
    "EB0A": 1.290e-3, "EC0A": -0.984e-3, "EY0C": 41.4e-3, "EA0C": 0.073e-3, "EB0C": 0.032e-3, "EC0X": 0.150e-3,
    "EA0Z": -0.480e-3, "EB0Z": 0.153e-3, "EYY": -0.642e-3, "EZZ": -0.253e-3, "EAA": -0.03e-3, "ECC": -0.056e-3,
}  # fmt: skip


def strategy() -> Measurement:
    """The pairs, each with all four places of the ball; rotary axes come from the side of the pair before."""
    pairs = np.array([[float(value) for value in pair.split(",")] for pair in PAIRS.split()])
    a, c = np.repeat(pairs, 4, axis=0).T
    ball = np.tile(np.arange(4), len(pairs))
    sides = [np.repeat(np.sign(np.diff(pairs[:, k], prepend=-400.0)), 4) for k in range(2)]
    columns = {"A": a, "C": c, "tool_length": np.full(len(a), LENGTH), "dir_A": sides[0], "dir_C": sides[1]}
    empty = Measurement("probe", (), columns, {"ball": tuple(map(str, ball))})
    q = empty.positions(AC)
    linear = [AC.axis_names.index(axis) for axis in "XYZ"]
    for _ in range(2):
        by_axes = np.linalg.inv(AC.axis_jacobian(q, LENGTH)[:, :3, linear])
        q[:, linear] -= np.einsum("nij,nj->ni", by_axes, AC.tip(q, LENGTH) - BALLS[ball])
    return empty.with_columns(dict(zip(("mx", "my", "mz"), q[:, linear].T, strict=True)))


@pytest.mark.parametrize(
    ("name", "machine", "size"),
    [
        ("esmaeili-10", AC, 10),
        ("esmaeili-12", AC, 12),
        ("esmaeili-13-ac", AC, 13),
        ("esmaeili-13-bc", BC, 13),
        ("esmaeili-81", AC, 81),
        ("esmaeili-84", BC, 84),
    ],
)
def test_the_models_have_as_many_errors_as_their_names_say(name, machine, size):
    assert len(select(machine, name).labels) == size


def test_the_model_of_12_with_27_unknowns_is_identified():
    selection = select(AC, "esmaeili-12")
    problem = Problem.of([strategy()], AC, selection)
    assert len(problem.design.T) + len(problem.start) == 27  # 12 errors, 4 balls, 1 stylus
    known = selection.machine(AC, [TABLE_5_5[effect.name] for effect in selection.estimated])
    data = simulate(strategy(), known, Faults(noise_um=1.8), seed=3)
    found = calibrate([data], AC, "esmaeili-12")
    truth = np.array([TABLE_5_5[effect.name] for effect in selection.estimated])
    error = (found.estimate.coefficients - truth) / found.sigma
    assert np.isfinite(error).all()
    assert np.abs(error).max() < 4.5
    assert 0.8 < found.chi_square < 1.25


def test_the_condition_is_no_worse_than_the_printed_one():
    """Column-normalised, errors and set-up together. 200 is printed; the places of its balls are not."""
    problem = Problem.of([strategy()], AC, select(AC, "esmaeili-12"))
    whole = np.concatenate([problem.design, problem.nuisance(problem.start)], axis=1)
    values = np.linalg.svd(whole / np.linalg.norm(whole, axis=0), compute_uv=False)
    assert values[0] / values[-1] < 200


def test_one_ball_has_no_length_standard_but_gains_are_relative():
    """With EXX free as well, the three gains are only known up to a common factor."""
    known = replace(select(AC, "esmaeili-13-ac").effects[-3], coefficients=(0.0,))
    assert known.name == "EXX"
    problem = Problem.of([strategy()], AC, select(AC, "EXX,EYY,EZZ"))
    found = solve(problem.design, problem.nuisance(problem.start), np.zeros(len(problem.values)))
    held = [problem.selection.labels[combination.held] for combination in found.combinations]
    assert any(label.endswith("u^1") for label in held)


def test_the_13_of_an_ac_table_have_no_error_along_the_spindle():
    """Chapter 7 calls the spindle's offsets EX0S and EZ0S in a tool frame with z along y of the base (section 7.2).

    Along the spindle an offset is the length of the stylus, which is never told from the set-up. With the spindle
    indexed all others are told; the gain of one linear axis has no length standard.
    """
    selection = select(AC, "esmaeili-13-ac")
    plan = strategy()
    indexed = plan.with_columns({"spindle_deg": 60.0 * (np.arange(len(plan)) % 6)})
    problem = Problem.of([indexed], AC, selection)
    found = solve(problem.design, problem.nuisance(problem.start), np.zeros(len(problem.values)))
    assert found.set_up == ()
    assert [selection.labels[each.held] for each in found.combinations] == ["EZZ u^1"]


def test_models_have_names():
    assert {"esmaeili-10", "esmaeili-12", "esmaeili-81", "esmaeili-84"} < set(MODELS)
