"""plan, simulate --plan and calibrate, one after another, as a user would."""

from __future__ import annotations

import numpy as np
import pytest

from measure.poses import machine, plan
from ncfix.diagnostics import ExitCode
from ncfix.machine import load
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import dumps


@pytest.fixture(scope="module")
def written() -> dict[str, bytes]:
    """What the first test that asks for it has planned and simulated: choosing poses takes seconds."""
    return {}


@pytest.fixture
def measured(ncfix, root, tmp_path, written):
    """A plan and the measurement simulated for it."""
    machine = root / "examples" / "machines" / "three_axis.toml"
    poses, data, program = tmp_path / "plan.csv", tmp_path / "data.csv", tmp_path / "plan.nc"
    if not written:
        options = ("--kind", "tcp", "--count", "60", "--tool-length", "100", "--effects", "E?0?,EXX,EYY,EZZ")
        done = ncfix("plan", "-m", machine, *options, "-o", poses, "--gcode", program)
        assert done.code == 0, done.err
        done = ncfix("simulate", "-m", machine, "--plan", poses, "--noise-um", "1", "--seed", "3", "-o", data)
        assert done.code == 0, done.err
        written.update({path.name: path.read_bytes() for path in (poses, data, program)})
    for path in (poses, data, program):
        path.write_bytes(written[path.name])
    return machine, poses, data


def test_from_a_plan_to_a_machine(ncfix, measured, tmp_path):
    machine, poses, data = measured
    assert poses.read_text().splitlines()[3].endswith(",,,")
    assert (tmp_path / "plan.nc").read_text().count("(PROBE HERE)") == 60
    found = ncfix("calibrate", data, "-m", machine, "-o", tmp_path / "m.toml", "--json").json()
    assert 0.5 < found["chi_square"] < 1.7
    assert found["rms_um"]["after"] < 1.1
    assert {each["name"] for each in found["parameters"]} >= {"EC0Y", "EYX u^2"}
    assert load(str(tmp_path / "m.toml")).provenance["source"] == str(data)


def test_the_same_seed_gives_the_same_measurement(ncfix, measured, tmp_path):
    machine, poses, data = measured
    again = ncfix("simulate", "-m", machine, "--plan", poses, "--noise-um", "1", "--seed", "3", "-o", "-")
    assert again.out == data.read_bytes()
    other = ncfix("simulate", "-m", machine, "--plan", poses, "--noise-um", "1", "--seed", "4", "-o", "-")
    assert other.out != data.read_bytes()


def test_the_table_of_coefficients(ncfix, measured, tmp_path):
    machine, _, data = measured
    done = ncfix("calibrate", data, "-m", machine, "-o", tmp_path / "m.toml", "--effects", "EC0Y")
    assert done.code == 0
    assert done.out.decode().splitlines()[1].split()[0] == "EC0Y"
    assert "reduced chi-square" in done.err


def test_inputs_are_never_changed(ncfix, measured):
    machine, _, data = measured
    assert ncfix("calibrate", data, "-m", machine, "-o", data, "--force").code == 2
    assert ncfix("calibrate", data, "-m", machine, "-o", machine, "--force").code == 2


def test_a_bad_measurement_is_unreadable(ncfix, measured, tmp_path):
    machine, _, data = measured
    bad = tmp_path / "bad.csv"
    bad.write_text(data.read_text().replace("set,", "sett,"))
    done = ncfix("calibrate", bad, "-m", machine, "-o", tmp_path / "m.toml")
    assert done.code == 3
    assert "NCF604" in done.err
    assert not (tmp_path / "m.toml").exists()


def test_wrong_use(ncfix, measured, tmp_path):
    machine, _, data = measured
    assert ncfix("simulate", "-m", machine).code == 2
    assert ncfix("plan", "-m", machine, "--range", "Q=0,1").code == 2
    done = ncfix("plan", "-m", machine, "--range", "X=0,5000")
    assert (done.code, "the travel of X is only" in done.err) == (2, True)
    for options in (("--program", data, "--noise-um", "1"), ("--plan", data, "--input", "temp_spindle=24")):
        assert ncfix("simulate", "-m", machine, *options).code == 2
    done = ncfix("calibrate", data, "-m", machine, "-o", tmp_path / "m.toml", "--effects", "EXQ")
    assert done.code == 2
    assert "NCF635" in done.err
    done = ncfix("calibrate", data, "-m", machine, "-o", tmp_path / "m.toml", "--effects", "esmaeili-12")
    assert done.code == 2


def test_a_plan_says_what_it_cannot_do(ncfix, root, tmp_path):
    machine = root / "examples" / "machines" / "three_axis.toml"
    plan = ("plan", "-m", machine, "--count", "12", "-o", tmp_path / "p.csv")
    done = ncfix(*plan, "--effects", "spindle-growth-late")
    assert (done.code, "NCF636" in done.err, "follows temp_spindle with a time constant" in done.err) == (2, True, True)
    assert ncfix(*plan, "--reach", "u=0,1").code == 2
    assert ncfix(*plan, "--input", "load_kg=5,1").code == 2
    limits = ("--reach", "z=-100,0", "--input", "load_kg=0,200", "--tool-length", "80", "--tool-length", "160")
    done = ncfix(*plan, "--effects", "load-X,EXX", *limits)
    assert done.code == 0, done.err
    assert ",load_kg" in (tmp_path / "p.csv").read_text()
    done = ncfix(*plan, "--kind", "length", "--force")
    assert (done.code, "hardly determined is a combination of" in done.err) == (0, True)


def test_ball_bars_and_direct_readings_have_figures_of_their_standards(ncfix, root, tmp_path):
    path = root / "examples" / "machines" / "three_axis.toml"
    known = machine("three_axis")
    for kind, key, said in (("bar", "ball_bar", "ball-bar set 1: size"), ("axis", "positioning", "ISO 230-2: ")):
        data = tmp_path / f"{kind}.csv"
        data.write_text(dumps(simulate(plan(known, kind, 120), known, Faults(noise_um=1.0))))
        found = ncfix(
            "calibrate", data, "-m", path, "-o", tmp_path / f"{kind}.toml", "--effects", "EXX", "--json"
        ).json()
        assert found[key]
        assert found["prediction"]["worst_um"] > found["prediction"]["rms_um"] > 0
        done = ncfix("calibrate", data, "-m", path, "-o", tmp_path / f"{kind}.toml", "--effects", "EXX", "--force")
        assert said in done.err
        assert "standard deviation of the predicted tip error over the travels" in done.err


def test_the_sigma_over_the_travels_says_if_anything_is_held(ncfix, root, tmp_path):
    """A measurement with B at zero says nothing of where its axis lies; that of the linear axes it says."""
    path, known = root / "examples" / "machines" / "wCBXFZYSt.toml", machine("wCBXFZYSt")
    poses = plan(known, "tcp", 120)
    poses = poses.with_columns({name: 0.0 * poses.columns[name] for name in "BC"})
    data = tmp_path / "tcp.csv"
    data.write_text(dumps(simulate(poses, known, Faults(noise_um=1.0))))
    for effects, held in (("EC0Y", False), ("EC0Y,EX0B", True)):
        done = ncfix("calibrate", data, "-m", path, "-o", tmp_path / "m.toml", "--effects", effects, "--force")
        assert ("um rms; held coefficients count as known" in done.err) is held


def scattered(tmp_path, size_mm, noise_um):
    """Readings of EXX that are nothing but scatter."""
    values = np.random.default_rng(1).normal(0.0, size_mm, 25)
    head = f"# ncfix-measurement: 1\n# kind: axis\n# noise_um: {noise_um}\naxis,component,position,value\n"
    path = tmp_path / "scatter.csv"
    path.write_text(head + "".join(f"X,EXX,{16 * k},{value:.6f}\n" for k, value in enumerate(values)))
    return path


@pytest.mark.parametrize(
    ("size_mm", "noise_um", "said"), [(35.0, 0.5, "times the noise"), (0.8, 5.0, "larger than max_correction, 200 um")]
)
def test_a_machine_that_does_not_describe_its_measurements_is_not_written(
    ncfix, root, tmp_path, size_mm, noise_um, said
):
    machine, target = root / "examples" / "machines" / "three_axis.toml", tmp_path / "m.toml"
    options = ("-m", machine, "--effects", "EXX", "-o", target)
    refused = ncfix("calibrate", scattered(tmp_path, size_mm, noise_um), *options)
    assert refused.code == 4
    assert "scatter.csv:" in refused.err
    assert "NCF642" in refused.err
    assert said in refused.err
    assert not target.exists()
    assert ncfix("calibrate", tmp_path / "scatter.csv", *options, "--allow-misfit").code == 0
    assert load(str(target)).effects


def test_what_is_small_is_written_however_small_the_stated_noise(ncfix, root, tmp_path):
    machine, data = root / "examples" / "machines" / "three_axis.toml", scattered(tmp_path, 0.02, 0.001)
    done = ncfix("calibrate", data, "-m", machine, "--effects", "EXX", "-o", tmp_path / "m.toml")
    assert done.code == 0
    assert "NCF634" in done.err


def test_a_missing_effect_of_tens_of_the_noise_is_written_with_a_warning(ncfix, root, tmp_path):
    machine = root / "examples" / "machines" / "three_axis.toml"
    done = ncfix(
        "calibrate", scattered(tmp_path, 0.02, 0.5), "-m", machine, "--effects", "EXX", "-o", tmp_path / "m.toml"
    )
    assert done.code == 0
    assert "NCF634" in done.err


def test_readings_that_lead_nowhere_are_remarked_with_the_failure(ncfix, measured, tmp_path):
    """Micrometres instead of millimetres: the iteration fails, and what looks odd in the file is said all the same."""
    machine, _, data = measured
    rows = data.read_text().splitlines()
    start = next(index for index, row in enumerate(rows) if row.startswith("set,"))
    rows[start + 1 :] = [
        ",".join([*cells[:-3], *(f"{1000 * float(value)}" for value in cells[-3:])])
        for cells in (row.split(",") for row in rows[start + 1 :])
    ]
    (tmp_path / "um.csv").write_text("\n".join(rows) + "\n")
    done = ncfix("calibrate", tmp_path / "um.csv", "-m", machine, "-o", tmp_path / "m.toml")
    assert done.code in (2, 4)
    assert "NCF616" in done.err


def test_knots_and_time_constants_are_options(ncfix, measured, tmp_path):
    path, _, data = measured
    options = ("-m", path, "-o", tmp_path / "m.toml", "--force")
    bare = tmp_path / "bare.toml"
    bare.write_text(path.read_text()[: path.read_text().index("[[effect]]")])
    knotted = ncfix(
        "calibrate", data, "-m", bare, "-o", tmp_path / "k.toml", "--effects", "EXX", "--knots", "2", "--json"
    )
    assert [row["name"] for row in knotted.json()["parameters"]][2:] == ["EXX above -0.333333", "EXX above 0.333333"]
    done = ncfix("calibrate", data, *options, "--effects", "EXX", "--time-constants")
    assert (done.code, "NCF639" in done.err) == (2, True)


@pytest.mark.parametrize(
    ("call", "both"),
    [
        (("simulate", "--plan", "{poses}", "-o", "-", "--json"), "the measurement and the JSON object"),
        (("calibrate", "{data}", "-o", "-", "--json"), "the machine and the JSON object"),
        (("diagnose", "{data}", "-o", "-"), "the machine and what was found"),
        (("diagnose", "{data}", "--next", "-", "--json"), "the poses and what was found"),
        (("plan", "--gcode", "-"), "the program and the poses"),
        (("plan", "--gcode", "-", "--json"), "the program and the JSON object"),
    ],
)
def test_two_outputs_do_not_share_a_stream(ncfix, measured, call, both):
    machine, poses, data = measured
    result = ncfix(*(each.format(poses=poses, data=data) for each in call), "-m", machine)
    assert result.code == ExitCode.USAGE
    said = result.json()["errors"][0]["text"] if "--json" in call else result.err
    assert f"{both} would both go to standard output" in said
