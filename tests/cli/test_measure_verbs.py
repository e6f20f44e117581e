"""plan, simulate --plan and calibrate, one after another, as a user would."""

from __future__ import annotations

import pytest

from ncfix.machine import load


@pytest.fixture
def measured(ncfix, root, tmp_path):
    """A plan and the measurement simulated for it."""
    machine = root / "examples" / "machines" / "three_axis.toml"
    poses, data = tmp_path / "plan.csv", tmp_path / "data.csv"
    options = ("--kind", "tcp", "--count", "60", "--tool-length", "100", "--effects", "E?0?,EXX,EYY,EZZ")
    done = ncfix("plan", "-m", machine, *options, "-o", poses, "--gcode", tmp_path / "plan.nc")
    assert done.code == 0, done.err
    done = ncfix("simulate", "-m", machine, "--plan", poses, "--noise-um", "1", "--seed", "3", "-o", data)
    assert done.code == 0, done.err
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
    done = ncfix("calibrate", data, "-m", machine, "-o", tmp_path / "m.toml", "--effects", "EXQ")
    assert done.code == 2
    assert "NCF635" in done.err
    done = ncfix("calibrate", data, "-m", machine, "-o", tmp_path / "m.toml", "--effects", "esmaeili-12")
    assert done.code == 2
