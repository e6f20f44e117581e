"""Calibration gives back what was put in, and says what it cannot tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from measure.poses import machine, perfect, plan
from ncfix.diagnostics import UsageError
from ncfix.machine import Effect, dumps, loads
from ncfix.machine.basis import Polynomial
from ncfix.measure.calibrate import calibrate, deviations, guesses, over_the_travels
from ncfix.measure.estimate import Calibration
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import Measurement
from ncfix.measure.selection import Selection

KINDS = ("tcp", "tcp6", "probe", "gauge", "bar", "tool", "axis")


def identifiable(known, kind, count):
    """The machine, with only those coefficients free that this measurement can tell."""
    first = calibrate([simulate(plan(known, kind, count), known, Faults(noise_um=0.01))], perfect(known))
    kept = set(np.flatnonzero(np.isfinite(first.sigma)).tolist())
    free, at = [], 0
    for effect in known.effects:
        free.append(all(at + k in kept for k in range(effect.basis.size)))
        at += effect.basis.size
    return Selection(known.effects, tuple(free))


def coefficients(effects) -> np.ndarray:
    return np.array([value for effect in effects for value in effect.coefficients])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["three_axis", "wCBXFZYSt"])
def test_estimates_are_within_their_uncertainty(name, kind):
    known = machine(name)
    chosen = identifiable(known, kind, 250)
    start = chosen.machine(known, np.zeros(len(chosen.start)).tolist())
    data = simulate(plan(known, kind, 250), known, Faults(noise_um=1.0), seed=7)
    found = calibrate([data], start, Selection(start.effects, chosen.free))
    error = (found.estimate.coefficients - coefficients(chosen.estimated)) / found.sigma
    assert np.isfinite(error).all()
    # normal errors: 4.5 sigma is passed once in 2,000 draws of 80 parameters; chi-square has 150 and more freedoms
    assert np.abs(error).max() < 4.5
    assert 0.7 < found.chi_square < 1.4


def test_without_noise_the_machine_comes_back():
    known = machine("wCBXFZYSt")
    chosen = identifiable(known, "tcp6", 200)
    start = chosen.machine(known, np.zeros(len(chosen.start)).tolist())
    data = simulate(plan(known, "tcp6", 200), known, Faults(), seed=1).with_header("noise_um", "1")
    found = calibrate([data], start, Selection(start.effects, chosen.free))
    gap = found.machine.error(data.positions(known), data.state(known)) - known.error(
        data.positions(known), data.state(known)
    )
    # what differs is a rigid shift of ball and stylus at most; the model of tilts is first order: 1e-4 squared x 300 mm
    assert np.abs(gap - gap.mean(axis=0)).max() < 2e-4


def test_the_result_reads_back_with_its_covariance():
    known = machine("three_axis")
    data = simulate(plan(known, "tcp", 150), known, Faults(noise_um=1.0), seed=3)
    found = calibrate([data], perfect(known))
    again = loads(dumps(found.machine))
    assert again.effects == found.machine.effects
    assert again.provenance["source"] == data.path
    assert any(effect.covariance for effect in again.effects)


def test_no_source_is_forgotten():
    """Each calibration may find other errors: the machine says where those that it leaves alone came from."""
    known = loads(
        dumps(machine("three_axis").replace(provenance={}).known_from({"date": "2025-03-01", "source": "laser.csv"}))
    )
    assert "earlier" not in known.provenance
    for source in ("bar.csv", "bar.csv", "plate.csv"):
        known = loads(dumps(known.known_from({"date": "2026-01-01", "source": source})))
    assert known.provenance["source"] == "plate.csv"
    assert known.provenance["earlier"] == ["2025-03-01 laser.csv", "2026-01-01 bar.csv"]


def test_squarenesses_of_two_axes_are_one_angle():
    known = machine("three_axis").replace(effects=())
    data = simulate(plan(known, "tcp", 60), known, Faults(noise_um=1.0), seed=3)
    data = data.with_header("setup", "rigid")
    found = calibrate([data], known, "EC0X,EC0Y")
    assert any("only their" in str(message) for message in found.remarks if message.code == "NCF631")
    assert np.isnan(found.sigma).sum() == 1


def test_what_is_not_seen_is_said():
    known = machine("three_axis").replace(effects=())
    poses = plan(known, "tcp", 60)
    flat = poses.with_columns({"Z": np.zeros(60)})
    data = simulate(flat, known, Faults(noise_um=1.0), seed=3)
    found = calibrate([data], known, "EZZ,EC0Y")
    held = [str(message) for message in found.remarks if message.code == "NCF632"]
    assert any("EZZ" in text for text in held)
    assert not any("EC0Y" in text for text in held)


def test_what_is_not_seen_is_said_once():
    known = machine("three_axis").replace(effects=())
    flat = plan(known, "tcp", 60).with_columns({"Z": np.zeros(60)})
    data = simulate(flat, known, Faults(noise_um=1.0), seed=3)
    [said] = [str(message) for message in calibrate([data], known, "EXX,EZZ,EXZ").remarks if message.code == "NCF632"]
    assert "EZZ, EXZ keep the value of the machine file: the unknown set-up has the same effect as them" in said


def test_one_setting_of_an_axis_hides_its_location():
    known = machine("wCBXFZYSt").replace(effects=())
    poses = plan(known, "tcp", 60)
    still = poses.with_columns({"B": np.zeros(60), "C": np.zeros(60)})
    found = calibrate([simulate(still, known, Faults(noise_um=1.0))], known, "EX0C,EC0Y")
    codes = {message.code for message in found.remarks}
    assert "NCF632" in codes
    assert np.isnan(found.sigma).tolist() == [True, False]


@pytest.mark.parametrize("kind", ["tcp", "probe"])
def test_each_tool_has_a_stylus_of_its_own_also_where_nothing_turns(kind):
    """Two tools of a three-axis machine never sit alike in the spindle; that is no error of the machine."""
    known = perfect(machine("three_axis"))
    data = simulate(plan(known, kind, 120), known, Faults(noise_um=1.0), seed=2)
    second = data.column("tool_length") == data.column("tool_length").max()
    first, *others = data.measured
    moved = data.with_columns({first: data.columns[first] + 0.02 * second})
    found = calibrate([moved], known, "EC0Y,EB0Z,EA0Z,EXX,EYY,EZZ")
    assert others
    assert 0.7 < found.chi_square < 1.3
    told = np.isfinite(found.sigma)
    assert (np.abs(found.estimate.coefficients[told]) < 4.5 * found.sigma[told]).all()


def test_too_few_rows_are_refused():
    known = machine("three_axis")
    data = simulate(plan(known, "tcp", 10), known, Faults(noise_um=1.0))
    with pytest.raises(UsageError) as caught:
        calibrate([data], known)
    assert caught.value.code == "NCF630"
    assert "30 values" in str(caught.value)


def outlying(size_mm: float) -> tuple[Calibration, Calibration, Measurement]:
    known = machine("three_axis")
    clean = simulate(plan(known, "tcp", 150), known, Faults(noise_um=1.0), seed=4)
    wrong = clean.columns["dy"].copy()
    wrong[42] += size_mm
    spoilt = replace(clean.with_columns({"dy": wrong}), lines=np.arange(150) + 5)
    return calibrate([clean], perfect(known)), calibrate([spoilt], perfect(known)), spoilt


@pytest.mark.parametrize("size_mm", [0.5, -0.05])
def test_an_outlier_is_named_and_has_no_weight(size_mm):
    clean, spoilt, _ = outlying(size_mm)
    named = [message for message in spoilt.remarks if message.code == "NCF633"]
    assert len(named) == 1
    assert named[0].place is not None
    assert named[0].place.line == 47
    assert not [message for message in clean.remarks if message.code == "NCF633"]
    moved = np.abs(spoilt.estimate.coefficients - clean.estimate.coefficients) / clean.sigma
    assert np.nanmax(moved) < 1.0


def test_loss_none_keeps_an_outlier():
    _, _, data = outlying(0.5)
    found = calibrate([data], perfect(machine("three_axis")), loss="none")
    assert (found.estimate.weight == 1).all()
    assert found.after_um > 10


@pytest.mark.parametrize("loss", ["huber", "tukey"])
def test_robust_losses_hold_an_outlier_down(loss):
    clean, _, data = outlying(0.5)
    found = calibrate([data], perfect(machine("three_axis")), loss=loss)
    moved = np.abs(found.estimate.coefficients - clean.estimate.coefficients) / clean.sigma
    assert np.nanmax(moved) < 2.0


@pytest.mark.parametrize("loss", ["none", "huber", "tukey"])
def test_robust_weights_do_not_make_the_noise_look_smaller(loss):
    """Of 1 um of noise that no header states; the spread of a scale from 2400 values is 0.014, Huber's was 0.9."""
    known = perfect(machine("three_axis"))
    data = replace(simulate(plan(known, "tcp", 800), known, Faults(noise_um=1.0), seed=4), headers=())
    found = calibrate([data], known, "EC0Y,EB0Z,EA0Z", loss)
    assert abs(found.scale - 1) < 4 * 0.014


def test_exchanged_columns_are_suspected():
    known = machine("wCBXFZYSt")
    data = simulate(plan(known, "tcp", 150), known, Faults(noise_um=0.5, setup=0.1), seed=4)
    swapped = data.with_columns({"dx": data.columns["dy"], "dy": data.columns["dx"]})
    assert "NCF617" in {message.code for message in calibrate([swapped], perfect(known)).remarks}
    assert "NCF617" not in {message.code for message in calibrate([data], perfect(known)).remarks}


def test_more_than_noise_is_said_and_widens_uncertainty():
    known = machine("three_axis")
    data = simulate(plan(known, "tcp", 150), known, Faults(noise_um=1.0), seed=4)
    optimist = data.with_header("noise_um", "0.3")
    found = calibrate([optimist], perfect(known))
    assert "NCF634" in {message.code for message in found.remarks}
    honest = calibrate([data], perfect(known))
    ratio = found.sigma / honest.sigma
    assert np.nanmax(np.abs(ratio - ratio[np.isfinite(ratio)][0])) < 1e-6
    assert 0.8 < ratio[np.isfinite(ratio)][0] < 1.25


def test_pruning_leaves_what_matters():
    known = machine("three_axis").replace(effects=())
    known = calibrate([simulate(plan(known, "tcp", 200), known, Faults(noise_um=1.0))], known, "EXX,EC0Y,EYY").machine
    values = {"EXX": (0.02, 0.0, 0.0), "EYY": (0.0, 0.0, 0.0), "EC0Y": (5e-5,)}
    real = known.replace(effects=tuple(replace(e, coefficients=values[e.name]) for e in known.effects))
    data = simulate(plan(real, "tcp", 200), real, Faults(noise_um=1.0), seed=2)
    found = calibrate([data], perfect(real), prune=0.9999)
    assert set(found.labels) == {"EXX u^1", "EC0Y"}


def test_pruning_keeps_what_the_measurement_cannot_tell():
    """With an unknown set-up an R-test does not see where this machine's C stands: that stays as the file has it."""
    known, unseen = machine("wCBXFZYSt"), ("EX0C", "EY0C", "EX0S", "EY0S")
    found = calibrate([simulate(plan(known, "tcp", 200), known, Faults(noise_um=0.5), seed=4)], known, prune=0.99)
    before, after = (
        {e.name: e.coefficients for e in each.effects if e.name in unseen} for each in (known, found.machine)
    )
    assert set(before) == set(unseen)
    assert after == before
    assert "NCF632" in {message.code for message in found.remarks}
    places = plan(known, "tcp", 100, seed=7)
    q, state = places.positions(known), places.state(known)
    off = found.machine.error(q, state)[:, :3] - known.error(q, state)[:, :3]
    assert np.linalg.norm(off, axis=1).max() < 3e-3  # 0.5 um of noise at 200 poses; without them it is 10 to 20 um


def test_the_uncertainty_of_a_prediction_covers_its_error():
    """Errors of predictions that differ between measurements are as large as their sigmas say, at any pose."""
    known, places = machine("three_axis"), plan(machine("three_axis"), "tcp", 50, seed=99)
    q, state = places.positions(known), places.state(known)
    poses, predicted, sigma = plan(known, "tcp", 200).with_header("setup", "none"), [], np.zeros(0)
    for seed in range(20):
        data = simulate(poses, known, Faults(noise_um=1.0), seed=seed)
        found = calibrate([data], perfect(known), loss="none")
        sigma = deviations(found, q, state)
        predicted.append(found.machine.error(q, state)[:, :3])
    scatter = np.std(predicted, axis=0, ddof=1) / sigma
    # of 20 draws a standard deviation has an error of 16 %
    assert 0.9 < np.sqrt((scatter**2).mean()) < 1.1
    assert scatter.max() < 2


def test_the_worst_prediction_over_the_travels_is_found():
    known = machine("wCBXFZYSt")
    found = calibrate([simulate(plan(known, "tcp", 200), known, Faults(noise_um=1.0))], perfect(known))
    worst = over_the_travels(found)
    assert 0.2 < worst.rms_um < worst.worst_um < 20
    assert set(worst.at) == {*known.axis_names, "tool_length"}
    assert guesses(found, worst) == ()


def test_a_model_that_follows_the_noise_is_said_to_be_a_guess():
    """As many unknowns as values, nearly: the fit is perfect, and means nothing between the poses."""
    known = machine("wCBXFZYSt")
    found = calibrate([simulate(plan(known, "tcp", 40), known, Faults(noise_um=1.0), seed=3)], perfect(known), "all")
    worst = over_the_travels(found)
    (message,) = guesses(found, worst)
    assert message.code == "NCF641"
    assert f"{worst.worst_um:.1f} um" in message.text
    assert found.after_um < 1.0 < found.before_um < worst.worst_um


def test_pruning_says_what_it_left_out():
    known = machine("three_axis").replace(effects=())
    data = simulate(plan(known, "tcp", 200), known, Faults(noise_um=1.0), seed=3)
    found = calibrate([data], known, "EXX,EC0Y", prune=0.9999)
    (said,) = (message for message in found.remarks if message.code == "NCF644")
    assert "EXX, EC0Y;" in said.text


def test_held_effects_keep_their_covariance():
    """One axis measured again: what the others are known to stays in the file."""
    known = machine("three_axis").replace(effects=())
    first = calibrate([simulate(plan(known, "tcp", 200), known, Faults(noise_um=1.0))], known, "EC0Y,EA0Z").machine
    columns = {"position": np.linspace(-300.0, 300.0, 9), "value": np.array([0.001, -0.001, 0.0] * 3)}
    lasers = Measurement("axis", (), columns, labels={"axis": ("Y",) * 9, "component": ("ECY",) * 9})
    again = calibrate([lasers], first, "EC0Y,EA0Z,ECY")
    kept = {effect.name: effect.covariance for effect in again.machine.effects}
    assert all(kept[effect.name] == effect.covariance is not None for effect in first.effects)


def test_an_axis_measured_again_at_one_temperature_keeps_its_expansion():
    """Of a scale and its growth only the sum is seen at one temperature: the growth is held, whatever comes first."""
    scale = Effect("EXX", (20e-6,), Polynomial(degree=(1,)))
    growth = replace(scale, coefficients=(-11e-6,), times="temp_x", times_center=20.0, times_scale=1.0)
    position = np.linspace(-300.0, 300.0, 13)
    columns = {"position": position, "value": 9e-6 * position, "temp_x": np.full(13, 22.0)}
    laser = Measurement("axis", (), columns, labels={"axis": ("X",) * 13, "component": ("EXX",) * 13})
    for effects in ((growth, scale), (scale, growth)):
        found = calibrate([laser], machine("three_axis").replace(effects=effects)).machine.effects
        values = {effect.times: effect.coefficients[0] for effect in found}
        assert values == pytest.approx({"temp_x": -11e-6, None: 31e-6})


@pytest.mark.parametrize("seed", range(4))
def test_a_sigma_counts_in_what_was_pruned(seed: int) -> None:
    """With A near zero the tilts of A and C about Y act alike: one goes, the other carries it and its sigma says so."""
    known = machine("wCAYFXZSt")
    tilts = {"EB0A": 60e-6, "EB0C": 0.0, "EA0C": 17e-6, "EC0X": 15e-6, "EB0Z": -20e-6}
    known = known.replace(effects=tuple(Effect(name, (tilt,)) for name, tilt in tilts.items()))
    poses = plan(known, "tcp", 900, seed)
    poses = poses.rows(np.flatnonzero(np.abs(poses.columns["A"]) < 4)[:60])
    data = simulate(poses, known, Faults(noise_um=3.0), seed)
    found = calibrate([data], perfect(known), prune=0.99)
    assert "NCF644" in {message.code for message in found.remarks}
    true = np.array([tilts[label] for label in found.labels])
    assert (np.abs(found.estimate.coefficients - true) < 4 * found.sigma).all()
    anywhere = plan(known, "tcp", 50, 99)
    q, state = anywhere.positions(known), anywhere.state(known)
    error = [of.design(q, state, of.effects) @ [e.coefficients[0] for e in of.effects] for of in (known, found.machine)]
    missed = np.sqrt(((error[0] - error[1])[:, :3] ** 2).mean())
    # all of it comes from one combination that hardly shows: four sigma of a single number
    assert missed < 4 * np.sqrt((deviations(found, q, state) ** 2).mean())


def test_what_was_held_and_pruning_frees_has_a_sigma():
    """An R-test sees how far two axes are apart: the one that stays carries the other, and its sigma says so."""
    known = machine("wCBXFZYSt").replace(effects=(Effect("EX0B", (0.0,)), Effect("EX0C", (0.05,))))
    data = simulate(plan(known, "tcp", 80), known, Faults(noise_um=1.0), seed=1)
    assert np.isnan(calibrate([data], known).sigma).tolist() == [False, True]
    found = calibrate([data], known, prune=0.99)
    assert found.labels == ("EX0C",)
    assert found.sigma[0] > 0.01  # a third of what is much, 0.1 mm


def test_a_plan_is_proposed_where_more_poses_would_tell_apart():
    """One tool shows only a sum of a shift and a tilt of the spindle; a longer one tells them."""
    known = machine("three_axis").replace(effects=(Effect("EX0S", (0.01,)), Effect("EB0S", (3e-5,))))
    poses = plan(known, "tcp", 60).with_header("setup", "none").with_columns({"tool_length": np.full(60, 120.0)})
    (hint,) = hints_of_combinations(known, poses)
    assert "plan --separate" in hint


def test_no_plan_is_proposed_where_none_would_tell_apart():
    """An R-test sees where one table stands over the other, whatever is measured."""
    known = machine("wCBXFZYSt")
    known = known.replace(effects=tuple(effect for effect in known.effects if effect.location))
    hints = hints_of_combinations(known, plan(known, "tcp", 100))
    assert hints
    assert not any("plan --separate" in hint for hint in hints)


def hints_of_combinations(known, poses) -> list[str]:
    found = calibrate([simulate(poses, known, Faults(noise_um=1.0), 1)], perfect(known))
    return [message.hint for message in found.remarks if message.code == "NCF631"]
