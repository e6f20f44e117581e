"""J. A. Soons, Accuracy analysis of multi-axis machines, TU Eindhoven 1993: the designs of Table 4.1.

Six ball bars of 400 mm on a two-dimensional machine with a squareness and two scales. Printed are the covariances
times 2 L^2 / sigma^2, and the determinants and largest prediction variances of three designs.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from measure.poses import plan
from ncfix.machine import Effect, load
from ncfix.machine.basis import Polynomial
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
    2: ([[4, 0, 0], [0, 0.83, 0.17], [0, 0.17, 0.83]], 2.60, 4.00),
    3: ([[2.67, 0, 0], [0, 1, 0.33], [0, 0.33, 1]], 2.50, 3.00),
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
    covariance = np.linalg.inv(one.T @ one) * 2 * LENGTH**2
    # printed with two decimals; the signs depend on those of the errors
    assert np.abs(np.abs(covariance) - matrix).max() < 0.006
    every = rows(np.arange(0, 180, 1))
    variance = np.einsum("ni,ij,nj->n", every, np.linalg.inv(one.T @ one), every)
    assert len(DESIGNS[design]) * variance.max() == pytest.approx(largest, abs=0.005)


def test_determinants_compare_as_printed():
    roots = {k: np.linalg.det(np.linalg.inv(rows(a).T @ rows(a))) ** (1 / 3) for k, a in DESIGNS.items()}
    for design in (2, 3):
        # each printed with three digits
        assert roots[1] / roots[design] == pytest.approx(PRINTED[1][1] / PRINTED[design][1], rel=4e-3)


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


# -- chapter 2: which frame an error belongs to -----------------------------------------------------------------------


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
