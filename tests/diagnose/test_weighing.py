"""One account of evidence: noise rarely weighs more than nothing, what is in no catalogue is said to be so."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp

from diagnose.worlds import World
from ncfix.diagnosis.diagnosis import FOUND, UNKNOWN, diagnose
from ncfix.diagnosis.evidence import (
    FALSE_ALARM,
    FURTHER,
    PRIOR,
    SHARES,
    SURE,
    UNNAMED,
    Comparison,
    Evidence,
    Member,
    entry_price,
    marginal,
)
from ncfix.diagnosis.forms import unnamed_alternatives
from ncfix.diagnosis.noise import estimated_background, everything_covariance
from ncfix.diagnosis.residual_data import residual_data
from ncfix.diagnosis.selection import (
    MAX_ALIAS_LAG,
    TOLD_APART,
    TRIED,
    Selected,
    lead_needed,
    likeliest,
    select,
    untold,
    with_alternatives,
)
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import Array

DRAWS = 150
LINE = re.compile("E[ABC]0[XYZ]")
SIZE_UM = 10.0


@pytest.fixture(scope="module")
def world() -> World:
    return World.of("three_axis", 1, 80)


@pytest.fixture(scope="module")
def five() -> World:
    return World.of("wCBXFZYSt", 1, 80)


def evidence_of(world: World, shown: Array, seed: int = 0) -> Evidence:
    """The named groups before data with this in them."""
    seen = residual_data([world.measured(shown, np.random.default_rng(seed), stated=True)], world.machine)
    background = estimated_background(seen, everything_covariance(seen, world.visible.groups), seen.relative)
    return Evidence(background, world.visible.groups, len(world.visible.groups))


@pytest.fixture(scope="module")
def evidence(world: World) -> Evidence:
    return evidence_of(world, np.zeros(len(world.data.y)))


def test_noise_alone_rarely_weighs_more_than_nothing(evidence: Evidence) -> None:
    """Markov: at most one of a hundred; five of 150 would have a probability of 2 % at that rate."""
    random, alarms = np.random.default_rng(1), 0
    for _ in range(DRAWS):
        evidence.y, evidence.inner = random.normal(size=len(evidence.y)), {}
        scale = Comparison(evidence)
        best = max(scale.weight({name: each}) for name, each in likeliest(scale, evidence.names, {}).items())
        alarms += best > scale.weight({})
    assert alarms <= 4
    assert pytest.approx(np.exp(-SURE)) == FALSE_ALARM


def test_the_likelihood_of_a_set_is_that_of_one_normal_distribution(evidence: Evidence) -> None:
    """From inner products of pairs, the same as with the covariance written out; its scale is integrated out."""
    members = [Member(evidence.forms["EXX"][0], 6.0), Member(evidence.forms["drift Y"][0], 3.0)]
    beside = np.random.default_rng(2).normal(size=(len(evidence.y), 3))
    found, parts = evidence.likelihood(members, beside), []
    known = [evidence.columns[:, evidence.part(each.group)] * each.size for each in members]
    for share, prior in zip(SHARES, PRIOR, strict=True):
        whole = np.diag(evidence.background.variance(share))
        whole += sum((each @ each.T for each in [*known, beside]), np.zeros_like(whole))
        squares = float(evidence.y @ np.linalg.solve(whole, evidence.y))
        determinant = float(np.linalg.slogdet(whole)[1])
        parts.append(marginal(squares, determinant, len(evidence.y), evidence.background.freedom) + np.log(prior))
    assert found == pytest.approx(float(logsumexp(parts)), abs=1e-4)  # evidence.FALLEN: exp(-12) is left away


def test_every_further_name_pays_less_than_the_first() -> None:
    assert [entry_price(count) for count in range(4)] == [0.0, SURE, SURE + FURTHER, SURE + 2 * FURTHER]
    assert 0 < FURTHER < SURE


def test_a_name_pays_for_what_it_was_chosen_from(world: World, evidence: Evidence) -> None:
    every = (*evidence.groups, *unnamed_alternatives(world.data, evidence.groups))
    scale = Comparison(Evidence(evidence.background, every, evidence.named))
    names, shapes = len(scale.names), len(scale.evidence.forms["EXX"]) * 5
    assert scale.price("EXX") == pytest.approx(np.log(names * shapes))
    first = scale.evidence.alternatives[0]
    assert scale.price(first) > UNNAMED
    assert scale.free == ()


def test_what_only_comes_with_an_effect_stands_in_no_names_place(five: World) -> None:
    """The middle of a play may lie off the zero, which shows as a squareness does: without play it is none."""
    bare = five.machine.replace(effects=())
    world = replace(five, machine=bare, plain=simulate(five.plain, bare, Faults(0.0), 1))
    lacking = {group.owner.name: group for group in world.visible.groups if LINE.fullmatch(group.owner.name)}
    assert lacking
    for name, group in lacking.items():
        evidence = evidence_of(world, SIZE_UM * group.columns[:, 0])
        chosen = Selected({name: Member(evidence.forms[name][0], 12.0)}, {name: 100.0}, {name: {}})
        plays = [each for each in evidence.names if each.startswith("angular play")]
        assert min(untold(Comparison(evidence), chosen, name, play) for play in plays) > TOLD_APART


def test_what_data_tell_counts_in_full_and_what_is_assumed_a_third() -> None:
    assert [lead_needed(told) for told in (-1.0, 0.0, 4.0, TOLD_APART)] == [9.0, 9.0, 11.0, 3.0]


def test_all_names_that_come_near_one_are_weighed_in_its_place(evidence: Evidence) -> None:
    """Not only the likeliest few: in noise alone all are near each other."""
    scale = Comparison(evidence)
    odds = scale.candidate_odds({})
    first = {name: odds.of(evidence.forms[name]) for name in scale.names}
    near = {name for name, value in first.items() if value > first["EXX"] - MAX_ALIAS_LAG}
    assert len(near) > TRIED
    assert near <= set(likeliest(scale, scale.names, {}, beside="EXX"))


def test_members_that_are_free_are_no_names(evidence: Evidence) -> None:
    freed = Comparison(evidence, (Member(evidence.forms["EXX"][0], 300.0),))
    assert "EXX" not in freed.names
    assert len(freed.all({})) == 1


def test_an_effect_is_selected_with_its_runners_up(world: World) -> None:
    scale = Comparison(evidence_of(world, world.effect("lateral play EZX", SIZE_UM, np.random.default_rng(3))))
    found = with_alternatives(scale, select(scale, scale.names))
    assert found.named == ["lateral play EZX"]
    assert max(found.runners_up["lateral play EZX"].values()) < found.odds["lateral play EZX"]
    assert found.p_value("lateral play EZX") < 1e-6


def test_an_error_that_a_name_holds_is_no_rival_to_it(five: World) -> None:
    groups = five.visible.groups
    titles = {group.owner.title for group in unnamed_alternatives(five.data, groups)}
    less = unnamed_alternatives(five.data, [group for group in groups if group.owner.name != "ECX"])
    (new,) = {group.owner.title for group in less} - titles
    assert new.startswith("ECX by its position")


@pytest.mark.parametrize("name", ["ECX", "angular play EAY"])
def test_what_is_taken_out_of_the_catalogue_is_unknown(five: World, name: str) -> None:
    """And it is said of which error it is."""
    random = np.random.default_rng(5)
    data = five.measured(five.effect(name, SIZE_UM, random), random)
    known = diagnose([data], five.machine)
    assert (known.verdict, [each.candidate.name for each in known.findings]) == (FOUND, [name])
    found = diagnose([data], five.machine, (name,))
    assert found.verdict == UNKNOWN
    assert name.split()[-1] in found.rest.kind


def test_warmth_far_from_twenty_degrees_hides_nothing(world: World) -> None:
    """What a thermal effect is at the mean temperature is a constant, and does not count."""
    warm = world.plain.with_columns(
        {name: values + 15 for name, values in world.plain.columns.items() if name.startswith("temp_")}
    )
    hidden = {candidate.name for candidate, _ in replace(world, plain=warm).visible.invisible}
    assert not hidden & {"spindle growth", "drift X", "thermal scale X", "artefact growth"}


@pytest.mark.parametrize(("seed", "name"), [(2, "thermal bend EBX"), (3, "drift X")])
def test_what_warms_is_named_by_where_it_acts_whatever_the_sensors_say(world: World, seed: int, name: str) -> None:
    """Sensors that are late and sit on other bodies: the course is the effect's own."""
    random = np.random.default_rng(seed)
    found = diagnose([world.measured(world.effect(name, SIZE_UM, random), random)], world.machine)
    assert len(found.findings) == 1
    assert name in (found.findings[0].candidate.name, *found.findings[0].aliases)


def test_what_happens_in_three_directions_is_no_three_drifts(five: World) -> None:
    random = np.random.default_rng(4)
    found = diagnose([five.measured(five.foreign("walk", SIZE_UM, random), random)], five.machine)
    assert (found.verdict, found.findings) == (UNKNOWN, ())


def test_an_artefact_that_grows_is_named(world: World) -> None:
    """About a point away from the middle of what was measured: 25 um/m K, with the temperature of the column."""
    seen = world.data
    warm = world.plain.columns["temp_column"] - world.plain.columns["temp_column"].mean()
    tip = world.machine.nominal(seen.q, world.plain.columns["tool_length"])[:, :3, 3]
    grown = -25e-3 * warm[:, None] * (tip - tip.mean(axis=0) - [60.0, -40.0, -90.0])
    random = np.random.default_rng(7)
    found = diagnose([world.measured(grown.ravel(), random)], world.machine)
    assert [each.candidate.name for each in found.findings] == ["artefact growth"]
    assert found.machine is None
