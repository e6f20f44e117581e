"""What further poses would show: the columns are those of the old rows, and values drawn are as likely as said."""

from __future__ import annotations

import numpy as np
import pytest

from measure.poses import machine, plan
from ncfix.diagnosis.catalogue import catalogue
from ncfix.diagnosis.effect_form import EffectForm
from ncfix.diagnosis.evidence import Comparison, Evidence
from ncfix.diagnosis.forms import shape_variations_with, visible_forms
from ncfix.diagnosis.noise import estimated_background, everything_at, everything_covariance
from ncfix.diagnosis.preposterior import PredictedValues, _Predictor, prospect, shown_at
from ncfix.diagnosis.residual_data import ResidualData, residual_data
from ncfix.diagnosis.selection import Selected
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Polynomial
from ncfix.measure.estimate import Problem
from ncfix.measure.instruments import Faults, observe, simulate
from ncfix.measure.measurement import Measurement

ROWS, NEW, NOISE_UM = 60, 12, 2.0
SINGLE = 1e-6
"""Columns of some um are kept in single precision: 24 bits."""


def bowed() -> Machine:
    """A mill whose Z bows: one length of tool shows a tilt of Z alike."""
    known = machine("three_axis")
    z = known.axes[known.axis_names.index("Z")]
    bow = Effect("EYZ", (0.012,), Polynomial(degree=(2,)), center=sum(z.range) / 2, scale=np.ptp(z.range) / 2)
    return known.replace(effects=(*known.effects, bow))


def measured(tool: float, count: int, seed: int) -> Measurement:
    """Poses with a tool of this length, measured on it."""
    poses = plan(machine("three_axis"), "tcp", count, seed)
    poses = poses.with_columns({"tool_length": np.full(count, tool)})
    return simulate(poses, bowed(), Faults(NOISE_UM), seed)


@pytest.fixture(scope="module")
def data() -> ResidualData:
    """What one tool showed."""
    return residual_data([measured(150.0, ROWS, 1)], machine("three_axis"))


@pytest.fixture(scope="module")
def groups(data: ResidualData) -> tuple[EffectForm, ...]:
    """Names that act with Z."""
    return visible_forms(data, [each for each in catalogue(data.measured) if each.axis == "Z"]).groups


def test_poses_that_were_measured_show_what_they_did(data: ResidualData, groups: tuple[EffectForm, ...]) -> None:
    again = observe(data.measurements[0], data.machine)
    shown = shown_at(again, groups)
    for group, own in zip(groups, shown, strict=True):
        assert own == pytest.approx(group.columns, abs=SINGLE)
    covariance = everything_covariance(data, groups)
    among, across = everything_at(data, groups, shown)
    assert among == pytest.approx(covariance, abs=SINGLE)
    assert across == pytest.approx(covariance, abs=SINGLE)
    before, after = shape_variations_with(data, again)
    assert after == pytest.approx(before, abs=1e-9)


def test_values_drawn_have_the_likelihood_of_a_normal_distribution() -> None:
    random = np.random.default_rng(2)
    factor = np.tril(random.normal(size=(5, 5))) + 3 * np.eye(5)
    said = PredictedValues("EYZ", 0.0, random.normal(size=5), factor)
    drawn = said.drawn(random, 40_000)
    assert np.cov(drawn) == pytest.approx(factor @ factor.T, abs=0.6)
    # the mean log likelihood of what it predicts is minus half of its numbers, less the determinant
    expected = -2.5 - np.log(np.diag(factor)).sum()
    assert said.likelihood(drawn).mean() == pytest.approx(expected, abs=0.05)


def test_the_true_name_predicts_another_tool_and_the_chance_is_high(
    data: ResidualData, groups: tuple[EffectForm, ...]
) -> None:
    background = estimated_background(data, everything_covariance(data, groups), data.relative, groups)
    scale = Comparison(Evidence(background, groups, len(groups)))
    member = scale.candidate_odds({}).likeliest(scale.evidence.forms["EYZ"])[0]
    chosen = Selected({"EYZ": member}, {"EYZ": 50.0}, {"EYZ": {"EAZ": 49.0}}, acting_alike={"EYZ": frozenset({"EAZ"})})
    later = measured(300.0, NEW, 3)
    new = observe(later, data.machine)
    predictor = _Predictor(scale, new, NOISE_UM)
    problem = Problem.of([later], data.machine, data.problem.selection)
    values = 1e3 * problem.residual(data.coefficients, problem.start)[:, None]
    right, wrong = (max(said.likelihood(values)[0] for said in predictor.predictions({}, n)) for n in ("EYZ", "EAZ"))
    assert right > wrong + 3.0
    found = prospect(scale, chosen, ("EYZ", "EAZ"), new, NOISE_UM)
    assert found.weights.sum() == pytest.approx(1.0)
    assert found.chance > 0.9
    vague = prospect(scale, chosen, ("EYZ", "EAZ"), new, 20 * NOISE_UM)
    assert vague.chance < found.chance - 0.2  # the noise of the new rows is counted


def test_a_slope_for_which_the_file_has_no_constant_is_part_of_the_curve(data: ResidualData) -> None:
    """With the squareness in the file the curve has none; where the file has no squareness at all, that goes before."""
    known = machine("wCAYFXZSt")
    known = known.replace(effects=tuple(effect for effect in known.effects if effect.name != "EA0Z"))
    assert "EB0Z" in {effect.name for effect in known.effects}
    seen = residual_data([simulate(plan(known, "tcp", ROWS, 1), known, Faults(NOISE_UM), 1)], known)
    assert [leans(seen, name) for name in ("EYZ", "EXZ", "EZZ", "EAZ")] == [True, False, False, False]
    assert not leans(data, "EYZ")


def leans(seen: ResidualData, name: str) -> bool:
    """Whether a slope is a part of the curve itself."""
    own = next(each for each in catalogue(seen.measured) if each.name == name)
    first = own.loadings[-1][: own.effects[0].basis.size]
    straight = np.linspace(-1, 1, len(first))
    return name[1] in "XYZ" and float(np.linalg.norm(straight @ first)) > 0.1 * float(np.linalg.norm(first))
