"""Sizes and signs of constants that no machine has are said; who can carry an effect."""

from __future__ import annotations

import pytest

from measure.poses import machine, plan
from ncfix.diagnosis.assessment import BOUNDS, carriers, catalogue_row, conditions, plausibility
from ncfix.diagnosis.catalogue import Candidate, catalogue
from ncfix.diagnosis.residual_data import ResidualData, residual_data
from ncfix.machine import Effect
from ncfix.machine.basis import Backlash, Fourier, Polynomial
from ncfix.measure.instruments import Faults, simulate


@pytest.fixture(scope="module")
def seen() -> ResidualData:
    known = machine("wCBXFZYSt")
    return residual_data([simulate(plan(known, "tcp", 40), known, Faults(2.0), 1)], known)


def play(lost: float, name: str = "EXX") -> tuple[Effect, ...]:
    return (Effect(name, (lost,), Backlash()),)


BACKLASH = Candidate("backlash X", "lost motion", "X", "X reversal", (), ())


def test_usual_play_is_plausible(seen: ResidualData) -> None:
    judged = plausibility(seen, BACKLASH, play(0.016))
    assert judged is not None
    assert judged.plausible
    assert judged.largest == (pytest.approx(8.0), 0.0)  # half of 16 um either way


def test_too_large_and_negative_play_is_not(seen: ResidualData) -> None:
    judged = plausibility(seen, BACKLASH, play(-0.5))
    assert judged is not None
    assert len(judged.remarks) == 2


@pytest.mark.parametrize(("name", "lost"), [("EXX", 0.006), ("EYY", -0.006), ("ECC", 30e-6), ("EBB", 30e-6)])
def test_a_body_that_lags_is_plausible_on_either_side_of_the_chain(seen: ResidualData, name: str, lost: float) -> None:
    """X, B and C of this machine move the workpiece towards minus as their numbers grow, Y the tool towards plus."""
    candidate = Candidate(f"backlash {name[2]}", "lost motion", name[2], f"{name[2]} reversal", (), ())
    found = [plausibility(seen, candidate, play(size, name)) for size in (lost, -lost)]
    assert [judged is not None and judged.plausible for judged in found] == [True, False]


def test_every_row_of_the_catalogue_has_bounds(seen: ResidualData) -> None:
    kinds = {catalogue_row(each) for each in catalogue(seen.measured) if not each.kept_out}
    assert kinds <= set(BOUNDS)


def test_who_can_carry(seen: ResidualData) -> None:
    known = seen.machine
    bow = Effect("EXX", (0.01,), Polynomial(degree=(2,)))
    assert "export heidenhain" in carriers(known, [bow])
    assert "export linuxcnc" not in carriers(known, [Effect("EYX", (0.01,), Polynomial(degree=(2,)))])
    turning = carriers(known, [Effect("EXC", (0.01, 0.0), Fourier(order=(1,)))])
    assert turning == ("fix", "export siemens", "export isg", "export heidenhain-kinematics", "export fanuc-rotary")
    warm = Effect("EZS", (0.001,), Polynomial(degree=(1,)), input="temp_spindle")
    assert (carriers(known, [warm]), conditions(known, [warm])) == (("fix",), ("temp_spindle",))
    assert carriers(known, []) == ()
