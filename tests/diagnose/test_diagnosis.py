"""Effects that were put in are named, nothing is named where nothing is, and poor data are refused."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from measure.poses import machine, perfect, plan
from ncfix.diagnosis.assessment import ALONG
from ncfix.diagnosis.catalogue import catalogue, without
from ncfix.diagnosis.checks import remarks
from ncfix.diagnosis.constants import judged_constants
from ncfix.diagnosis.diagnosis import AMBIGUOUS, FOUND, NOTHING, Diagnosis, diagnose, weighed
from ncfix.diagnosis.noise import estimated_background
from ncfix.diagnosis.presentation import as_dict, text, with_provenance
from ncfix.diagnosis.residual_data import residual_data
from ncfix.diagnosis.residual_patterns import patterns
from ncfix.diagnostics import NcfixError
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Backlash
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import Measurement
from ncfix.measure.reader import reads
from ncfix.reports.diagnosis import document, measured_curves
from ncfix.reports.diagnosis_picture import picture
from ncfix.reports.rendering import html, markdown

NOISE_UM = 2.0


def measured(known: Machine, count: int = 150, seed: int = 1, noise_um: float = NOISE_UM) -> Measurement:
    return simulate(plan(known, "tcp", count, seed), known, Faults(noise_um), seed)


def lines(known: Machine) -> Machine:
    """The machine with its location errors only."""
    return known.replace(effects=tuple(effect for effect in known.effects if effect.location))


@pytest.fixture(scope="module")
def known() -> Machine:
    return lines(machine("wCBXFZYSt"))


@pytest.fixture(scope="module")
def backlash(known: Machine) -> Diagnosis:
    worn = known.replace(effects=(*known.effects, Effect("EXX", (0.016,), Backlash())))
    return diagnose([measured(worn)], known)


def test_a_backlash_is_named_and_added(backlash: Diagnosis) -> None:
    first = backlash.findings[0]
    assert (first.candidate.name, backlash.verdict) == ("backlash X", FOUND)
    assert backlash.machine is not None
    added = [effect for effect in backlash.machine.effects if isinstance(effect.basis, Backlash)]
    constant, _, bowed = added[0].coefficients
    assert abs(constant + bowed / 3 - 0.016) < 0.001  # mean over the travel; 2 um over 150 poses: 0.33 um, three sigma
    assert backlash.gap.holdout_after < 0.6 * backlash.gap.holdout_before
    assert backlash.gap.after < 1.15 * backlash.gap.floor


def test_the_result_has_the_fields_of_the_contract(backlash: Diagnosis) -> None:
    found = as_dict(backlash)
    assert {"verdict", "effects", "unknown", "gap_um", "where", "next_measurements", "machine"} <= set(found)
    gaps = {"given", "holdout_given", "before", "after", "floor", "holdout_before", "holdout_after"}
    assert set(found["gap_um"]) == gaps
    wanted = {"name", "title", "axis", "why", "coefficients", "sigma", "p_value", "aliases"}
    assert wanted <= set(found["effects"][0])
    assert found["findable_um"]["backlash X"] <= 3.0  # 150 poses, 2 um of noise
    assert found["effects"][0]["plausible"]["is"]
    assert found["effects"][0]["targets"] == ["fix", *(f"export {name}" for name in ALONG)]
    assert with_provenance(backlash).provenance["added"] == "backlash X"


def test_a_diagnosis_keeps_the_result_and_not_the_workings(backlash: Diagnosis) -> None:
    again = pickle.dumps(backlash)
    assert len(again) < 1e6  # bytes; with all candidates and covariances some tens of millions
    assert text(pickle.loads(again)) == text(backlash)


def test_constants_that_the_data_do_not_ask_to_change_stay(known: Machine, backlash: Diagnosis) -> None:
    assert backlash.machine is not None
    kept = backlash.machine.effects[: len(known.effects)]
    assert [each.coefficients for each in kept] == [each.coefficients for each in known.effects]
    assert backlash.moved == ()


@pytest.mark.parametrize("seed", range(3))
def test_constants_that_do_not_pay_for_being_off_together_stay(known: Machine, seed: int) -> None:
    """Each is off by half a micrometre or so: together more than chance makes of them, and no finding."""
    random = np.random.default_rng(seed)
    sizes = [random.choice((-1, 1)) * (2e-6 if effect.rotational else 4e-4) for effect in known.effects]
    days = known.replace(
        effects=tuple(
            replace(e, coefficients=(e.coefficients[0] + size,)) for e, size in zip(known.effects, sizes, strict=True)
        )
    )
    evidence = weighed([measured(days, 120, seed)], known)[1].evidence
    constants = judged_constants(evidence, (), evidence.share(()))
    assert constants.p_value < 1e-6
    assert constants.odds >= 0  # what is off pays, what does not is as the file has it
    assert not constants.whole


def test_constants_that_the_data_put_elsewhere_are_said_and_changed(known: Machine) -> None:
    index = next(k for k, effect in enumerate(known.effects) if effect.name == "EC0Y")
    true = known.effects[index].coefficients[0]
    off = replace(known.effects[index], coefficients=(true + 60e-6,))
    file = known.replace(effects=(*known.effects[:index], off, *known.effects[index + 1 :]))
    worn = known.replace(effects=(*known.effects, Effect("EXX", (0.016,), Backlash())))
    found = diagnose([measured(worn)], file)
    (moved,) = found.moved
    assert moved.name.startswith("EC0Y")
    assert abs(moved.data - true) < 4 * moved.sigma
    assert "EC0Y" in text(found)
    assert as_dict(found)["constants"][0]["file"] == pytest.approx(true + 60e-6)
    assert found.machine is not None
    assert abs(found.machine.effects[index].coefficients[0] - true) < 20e-6


def off_by(known: Machine, name: str, by: float) -> tuple[Machine, int]:
    """The machine file with one constant wrong, and which effect that is."""
    index = next(k for k, effect in enumerate(known.effects) if effect.name == name)
    wrong = replace(known.effects[index], coefficients=(known.effects[index].coefficients[0] + by,))
    return known.replace(effects=(*known.effects[:index], wrong, *known.effects[index + 1 :])), index


def test_a_constant_that_is_wrong_is_a_finding_with_a_machine_file(known: Machine) -> None:
    file, index = off_by(known, "EC0Y", 60e-6)
    found = diagnose([measured(known)], file)
    assert found.verdict == FOUND
    assert [each.candidate.name for each in found.findings] == ["constant EC0Y"]
    assert found.machine is not None
    right = known.effects[index].coefficients[0]
    assert abs(found.machine.effects[index].coefficients[0] - right) < 4 * found.moved[0].sigma
    kept = [k for k in range(len(known.effects)) if k != index]
    assert [found.machine.effects[k].coefficients for k in kept] == [file.effects[k].coefficients for k in kept]
    assert found.gap.given > 2 * found.gap.before
    assert found.gap.holdout_given > 2 * found.gap.holdout_after
    assert "file as given" in text(found)
    rungs = as_dict(found)["ladder"]
    assert [each["rung"] for each in rungs][:3] == ["file as given", "mistakes", "constants of the file"]
    assert rungs[2]["share"] > 0.7
    assert rungs[2]["found"] == ["constant EC0Y"]
    assert as_dict(found)["constants_together"]["p_value"] < 1e-9
    assert "constant EC0Y" in markdown(document(found)).decode()


def test_a_constant_that_the_set_up_hides_is_held_as_calibrate_holds_it(known: Machine) -> None:
    """Only the difference of EX0C and EX0B is seen: either is the name, the other its alias, and one is held."""
    file, _ = off_by(known, "EX0C", 0.3)
    found = diagnose([measured(known)], file)
    (first,) = found.findings
    assert {first.candidate.name, *first.aliases} == {"constant EX0C", "constant EX0B"}
    assert found.verdict == AMBIGUOUS
    assert "only their difference" in text(found)


def test_a_laser_says_the_direction_of_its_runs_by_a_column_of_its_own() -> None:
    """Kind `axis` has `direction`, not `dir_X`; play is seen all the same."""
    text = "# ncfix-measurement: 1\n# kind: axis\n# noise_um: 0.5\naxis,component,position,value,run,direction\n"
    rng = np.random.default_rng(4)
    rows = [
        (axis, x, way, run, (0.012 * way / 2 if axis == "X" else 0.0) + rng.normal(0, 0.0005))
        for axis in "XYZ"
        for run in range(1, 4)
        for way in (1, -1)
        for x in range(0, 301, 30)
    ]
    text += "".join(
        f"{axis},E{axis}{axis},{-x if axis == 'Z' else x},{value:.5f},{run},{way}\n"
        for axis, x, way, run, value in rows
    )
    bare = perfect(machine("three_axis")).replace(effects=())
    found = diagnose([reads(text.encode(), bare)], bare)
    assert found.verdict in (FOUND, AMBIGUOUS)
    assert "backlash X" in {name for each in found.findings for name in (each.candidate.name, *each.aliases)}


@pytest.mark.parametrize("kind", ["tcp6", "gauge", "bar", "tool", "table", "axis"])
def test_every_kind_of_measurement_can_be_diagnosed(kind: str) -> None:
    """A play of 20 um: named where the instrument sees it, and never taken for something else."""
    known = machine("three_axis")
    worn = known.replace(effects=(*known.effects, Effect("EXX", (0.02,), Backlash())))
    found = diagnose([simulate(plan(known, kind, 60, 1), worn, Faults(1.5), 1)], known)
    assert all("backlash X" in (each.candidate.name, *each.aliases) for each in found.findings)
    assert as_dict(found)["verdict"] in markdown(document(found)).decode()


def test_the_report_and_the_text_name_it(backlash: Diagnosis) -> None:
    assert "backlash X" in text(backlash)
    page, plain_page = (form(document(backlash)).decode() for form in (html, markdown))
    assert "backlash X" in page
    assert page.count("<svg") >= 5
    assert page.count("<circle") > 100
    assert "## backlash X" in plain_page


def test_what_was_measured_against_the_model(backlash: Diagnosis) -> None:
    """A play of its own sign for each direction, and the model within three bands of what was measured."""
    drawn = list(measured_curves(backlash, backlash.findings[0]))
    plus, minus = [each for each in drawn if each.component == "dx"]
    assert plus.title == "backlash X, X moving towards plus"
    assert minus.title == "backlash X, X moving towards minus"
    assert np.sign(plus.model).sum() == -np.sign(minus.model).sum() != 0
    assert all((np.abs(each.measured - each.model) < 3 * each.spread).all() for each in (plus, minus))


def test_a_picture_for_papers(backlash: Diagnosis) -> None:
    pytest.importorskip("matplotlib")
    drawn = picture(backlash, "svg")
    assert b"backlash X, X moving towards minus" in drawn
    assert drawn == picture(backlash, "svg")


def test_a_name_that_must_not_be_used_is_not_used(known: Machine) -> None:
    worn = known.replace(effects=(*known.effects, Effect("EXX", (0.016,), Backlash())))
    found = diagnose([measured(worn, 80)], known, ("backlash-x", "no such name"))
    assert all(each.candidate.name != "backlash X" for each in found.findings)
    assert found.case.unheard_of == ("no such name",)
    assert any(message.code == "NCF657" for message in found.messages)


def test_nothing_is_named_where_nothing_is(known: Machine) -> None:
    found = diagnose([measured(known, 100)], known)
    assert (found.verdict, found.findings, found.machine) == (NOTHING, (), None)


def test_the_catalogue_has_fifty_names_each_once(known: Machine) -> None:
    names = [each.name for each in catalogue(residual_data([measured(known, 40)], known).measured)]
    assert len(names) == len(set(names)) >= 50
    assert without(catalogue(residual_data([measured(known, 40)], known).measured), ["exx"])[0][0].name != "EXX"


def test_errors_with_the_sign_of_corrections_are_a_mistake(known: Machine) -> None:
    large = known.replace(effects=tuple(scaled(effect, 8.0) for effect in known.effects))
    turned = known.replace(effects=tuple(scaled(effect, -8.0) for effect in known.effects))
    found = diagnose([measured(large, 80)], turned)
    assert found.findings[0].candidate.name == "wrong sign"
    assert found.verdict in (FOUND, AMBIGUOUS)


def scaled(effect: Effect, factor: float) -> Effect:
    return replace(effect, coefficients=tuple(factor * c for c in effect.coefficients))


def refused(code: str, data: list[Measurement], known: Machine) -> None:
    with pytest.raises(NcfixError) as caught:
        diagnose(data, known)
    assert caught.value.messages[0].code == code


def test_one_pose_is_refused(known: Machine) -> None:
    refused("NCF651", [measured(known, 40).rows([0] * 40)], known)


def test_no_repeats_and_no_noise_are_refused(known: Machine) -> None:
    data = measured(known, 40)
    silent = replace(data, headers=tuple(pair for pair in data.headers if pair[0] != "noise_um"))
    refused("NCF652", [silent], known)


def test_too_few_values_are_refused(known: Machine) -> None:
    refused("NCF650", [measured(known, 7)], known)


def test_another_machine_is_refused(known: Machine) -> None:
    data = measured(known, 80)
    noise = np.random.default_rng(0).normal(scale=2.0, size=80)
    refused("NCF654", [data.with_columns({"dx": data.columns["dx"] + noise})], known)


def test_files_that_contradict_each_other_are_refused(known: Machine) -> None:
    first = measured(known, 80)
    worse = np.where(np.arange(80) % 2, 0.03, -0.03)
    second = replace(first.with_columns({"dy": first.columns["dy"] + worse}), path="second.csv")
    refused("NCF656", [first, second], known)
    changed = diagnose([first, second], known, since=True)  # whoever measures again goes to the same poses
    assert changed.case.since


def test_one_side_only_is_said(known: Machine) -> None:
    poses = plan(known, "tcp", 60)
    one = poses.with_columns({name: np.ones(60) for name in poses.columns if name.startswith("dir_")})
    seen = residual_data([simulate(one, known, Faults(NOISE_UM), 1)], known)
    [message] = remarks(seen, ())
    assert message.code == "NCF653"
    assert "C, B, X, Z, Y approached from one side only" in message.text
    assert not any("backlash" in each.name for each in catalogue(seen.measured))


def test_play_is_not_looked_for_where_a_file_does_not_say_from_where_the_axis_came(known: Machine) -> None:
    first, second = plan(known, "tcp", 60), plan(known, "tcp", 60, 1)
    silent = replace(second, columns={name: values for name, values in second.columns.items() if name != "dir_X"})
    silent = replace(silent, path="silent.csv")
    seen = residual_data([simulate(each, known, Faults(NOISE_UM), 1) for each in (first, silent)], known)
    [message] = remarks(seen, ())
    assert message.code == "NCF658"
    assert "silent.csv does not state the direction of approach of X" in message.text
    names = {each.name for each in catalogue(seen.measured)}
    assert "backlash X" not in names
    assert "backlash Y" in names


def test_of_a_file_worse_than_none_the_constants_are_off(known: Machine) -> None:
    random = np.random.default_rng(5)
    wild = [replace(e, coefficients=(random.uniform(-5e-4, 5e-4),)) for e in known.effects if e.rotational]
    bad = known.replace(effects=tuple(wild))
    bent = perfect(known).replace(effects=(Effect("EXX", (0.06,), Backlash()),))
    found = diagnose([measured(bent, 80)], bad)
    assert "constants of the file" in {each.candidate.name for each in found.findings}
    assert found.machine is not None
    assert found.gap.after < 0.2 * found.gap.given


def test_patterns_are_judged_by_what_the_others_leave(known: Machine) -> None:
    """Beside a large drift that no single pattern shows, none of hundreds fits a little and is taken for real."""
    plain = measured(known, noise_um=0.5)
    random = np.random.default_rng(3)
    # each pose is off by itself: 20 um, forty times the noise
    shaken = {name: plain.column(name) + 0.02 * random.normal(size=len(plain)) for name in ("dx", "dy", "dz")}
    seen = residual_data([plain.with_columns(shaken)], known)
    everything = np.zeros((len(seen.y), len(seen.y)))
    assert patterns(estimated_background(seen, everything, seen.relative), 0.5) == []


def test_a_noise_that_repeats_deny_is_said(known: Machine) -> None:
    poses = plan(known, "tcp", 40).rows(np.repeat(np.arange(40), 3))
    seen = simulate(poses, known, Faults(NOISE_UM), 5)
    honest, wrong = seen.with_header("noise_um", "2"), seen.with_header("noise_um", "0.2")
    assert remarks(residual_data([honest], known), ()) == []
    (said,) = remarks(residual_data([wrong], known), ())
    assert (said.code, said.text[:33]) == ("NCF659", "the files state a noise of 0.2 um")
