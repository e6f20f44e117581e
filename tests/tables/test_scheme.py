"""The automatic scheme on machines: exact where pairs can say it, within limits, with ways and turns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import qmc

from conftest import FULL
from ncfix.machine import Effect, Machine, State, load
from ncfix.machine.basis import Backlash, Fourier, Polynomial
from ncfix.tables import scheme_tables
from ncfix.tables.correction import Residual, orientation_error, random_poses, ranges_of, residual, rotary_correction
from ncfix.tables.scheme import Limits, Scheme, SchemeTask, automatic, lines_of
from ncfix.tables.scheme_tables import AxisPositions
from ncfix.testing import single_error

MACHINES = Path(__file__).resolve().parents[2] / "examples" / "machines"
CRADLE = load(str(MACHINES / "wCAYFXZSt.toml")).replace(effects=())


PLENTY = Limits(40, 1000)


def solved(
    machine: Machine, target: float = 1e-4, limits: Limits = PLENTY, rotary: bool = True
) -> tuple[Scheme, Residual]:
    space = ranges_of(machine)
    found = automatic(SchemeTask(machine, space, 120.0, target, limits), rotary)
    return found, residual(machine, found.tables, space, 120.0, 1000)


def test_21_errors_of_three_axes_take_19_tables() -> None:
    """9 sums, 6 angles and 4 helpers: the count of the expansion to first order."""
    found, left = solved(load(str(MACHINES / "three_axis.toml")), 1e-3)
    assert len(found.tables.grids) == 19
    assert left.after.max() < 1e-3
    assert found.rest < 1e-6


@pytest.mark.parametrize("tables", [1, 3, 8, 12])
def test_tables_are_never_more_than_the_control_has(tables: int) -> None:
    found, left = solved(load(str(MACHINES / "three_axis.toml")), 1e-3, Limits(tables, 200))
    assert len(found.tables.grids) <= tables
    assert max(grid.points for grid in found.tables.grids) <= 200
    assert np.mean(left.after**2) < np.mean(left.before**2)


def test_few_points_are_kept_and_what_they_miss_is_said() -> None:
    """A screw's period of 12 mm over 800 mm needs more than 20 points."""
    found, _ = solved(load(str(MACHINES / "three_axis.toml")), 1e-4, Limits(40, 20))
    assert max(grid.points for grid in found.tables.grids) <= 20
    assert found.missed > 1e-4


EFFECTS = {
    "EXC": Effect("EXC", (0.003, 0.002), Fourier((2,))),
    "EZC": Effect("EZC", (0.003, 0.002), Fourier((1,))),
    "EAA": Effect(
        "EAA",
        (40e-6,),
        Polynomial(
            (1,),
        ),
        scale=120,
    ),
    "ECC": Effect("ECC", (30e-6, 10e-6), Fourier((1,))),
    "EYA": Effect("EYA", (0.004,), Polynomial((2,)), scale=120),
    "EB0A": Effect("EB0A", (40e-6,)),
    "EX0S": Effect("EX0S", (0.01,)),
}


@pytest.mark.parametrize("name", EFFECTS if FULL else [name for name in EFFECTS if name != "ECC"])
def test_single_errors_of_a_five_axis_machine(name: str) -> None:
    """Each is a sum of pairs once the rotary axes have taken off what they can."""
    _, left = solved(CRADLE.replace(effects=(EFFECTS[name],)), 1e-3)
    assert left.before.max() > 0.003
    assert left.after.max() < 0.0015


def test_ways_of_a_rotary_axis_become_its_own_tables() -> None:
    machine = CRADLE.replace(effects=(Effect("ECC", (60e-6,), Backlash((0,))),))
    found, left = solved(machine, 1e-4)
    assert [(term.outputs, term.way) for term in found.tables.terms] == [(("C",), ("C", 1)), (("C",), ("C", -1))]
    assert left.after.max() < 1e-6
    assert left.before.max() > 0.005


def test_tables_of_an_endless_axis_repeat() -> None:
    found, _ = solved(CRADLE.replace(effects=(EFFECTS["EZC"],)), 1e-4)
    turning = [grid for grid in found.tables.grids if grid.inputs == ("C",)]
    assert turning
    for grid in turning:
        assert grid.modulo == (True,)
        assert grid.values[0] == grid.values[-1]
        assert np.degrees(grid.nodes[0][-1] - grid.nodes[0][0]) == pytest.approx(360)


@pytest.mark.parametrize(
    ("low", "high", "repeats"), [(0, 360, True), (-180, 540, True), (-10, 370, False), (0, 90, False)]
)
def test_tables_of_a_turn_and_a_part_of_one_do_not_repeat(low: int, high: int, repeats: bool) -> None:
    """The control would repeat them every 380 degrees."""
    space = ranges_of(CRADLE)
    space[CRADLE.axis_names.index("C")] = np.radians([low, high])
    lines = lines_of(SchemeTask(CRADLE, space, 120.0, 1e-4, Limits(40, 1000)))
    assert [line.modulo for line in lines if line.name == "C"] == [repeats]


def test_rotary_axes_take_off_what_they_can_of_the_orientation() -> None:
    """The angular positioning error of C wholly; of a tilt about Y nothing at A = 0, where no axis turns that way."""
    q, state = random_poses(ranges_of(CRADLE), 50), State(120.0)
    machine = CRADLE.replace(effects=(EFFECTS["ECC"],))
    correction = np.zeros_like(q)
    correction[:, machine.rotary] = rotary_correction(machine, q, state)
    assert orientation_error(machine, q, correction, state).max() < 1e-9
    assert orientation_error(machine, q, 0 * correction, state).max() > 20e-6
    tilted, level = CRADLE.replace(effects=(Effect("EB0Z", (40e-6,), carried=True),)), np.zeros((1, 5))
    correction = np.zeros_like(level)
    correction[:, tilted.rotary] = rotary_correction(tilted, level, state)
    assert orientation_error(tilted, level, correction, state)[0] == pytest.approx(40e-6, rel=1e-3)


def test_rotary_axes_keep_their_values_if_asked() -> None:
    found, left = solved(CRADLE.replace(effects=(EFFECTS["EB0A"],)), 1e-4, rotary=False)
    assert {term.outputs[0] for term in found.tables.terms} <= set("XYZ")
    assert left.after.max() < 1e-3


TRIPLES = {
    "EBC": Effect("EBC", (40e-6, 0.0), Fourier((1,))),
    "EA0C": Effect("EA0C", (40e-6,)),
    "ECY": Effect("ECY", (30e-6,), Polynomial((1,)), scale=210),
}


@pytest.mark.parametrize("name", TRIPLES if FULL else ("EBC", "ECY"))
def test_what_pairs_cannot_say_is_said_to_be_left(name: str) -> None:
    """A tilt that turns with C moves the tip by Z times a function of C times one of A.

    No sums and products of pairs leave less at the worst than is proved; what is left is near that, and never more than
    before. Of EBC the proof says that nothing can be gained at the worst; least squares would make it worse there.
    """
    found, left = solved(CRADLE.replace(effects=(TRIPLES[name],)), 1e-4)
    assert found.rest > 1e-4
    before, after = (float(np.sqrt(np.mean(values**2))) for values in (left.before, left.after))
    assert after == pytest.approx(np.hypot(found.rest, found.dropped), rel=0.3)
    assert left.after.max() <= 1.1 * found.bound
    assert left.after.max() <= left.before.max()
    assert after <= before


def test_the_same_machine_gives_the_same_tables() -> None:
    one, other = (solved(single_error("ECX", 20e-6))[0] for _ in range(2))
    for first, second in zip(one.tables.grids, other.tables.grids, strict=True):
        assert (first.values == second.values).all()
        assert (first.nodes[0] == second.nodes[0]).all()


@pytest.mark.parametrize(("low", "high"), [(-200.0, 300.0), (0.0, 457.3), (-0.00005, 33.33333)])
def test_positions_have_four_decimals_and_cover_the_range(low: float, high: float) -> None:
    line = AxisPositions.over("X", low, high, 1.0, np.inf, False)
    fine = line.fine
    assert np.allclose(fine * 1e4, np.round(fine * 1e4), atol=1e-6)
    assert fine[0] <= low
    assert high <= fine[-1] + 1e-9
    assert fine[-1] - high <= 1e-4 * line.steps
    assert np.ptp(np.diff(fine)) < 1e-9


def test_strides_are_the_widest_that_do() -> None:
    line = AxisPositions.over("X", 0.0, 120.0, 1.0, np.inf, False)
    assert line.stride(2 * line.fine, 100, 1e-9) == line.steps
    kinked = np.abs(line.fine - 40.0)
    assert line.steps // line.stride(kinked, 100, 1e-9) == 3
    assert line.steps // line.stride(np.sin(line.fine), 20, 1e-9) <= 19


@pytest.mark.parametrize("dimensions", range(1, 13))
def test_the_net_of_combinations_is_that_of_scipy(dimensions: int) -> None:
    net = qmc.Sobol(dimensions, scramble=False).random_base2(scheme_tables.SAMPLES)
    assert (scheme_tables._sobol_net(dimensions) == net).all()
