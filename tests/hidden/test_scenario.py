"""Scenarios: the same every time, as large as asked, valid as files, and none of the truth in what is handed over."""

from __future__ import annotations

import ast
import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from conftest import FULL
from hidden import files, instruments, mistakes, remeasure, workshop
from hidden.families import FAMILIES, FINAL_RANGE, development_seed, final_seed, tasks
from hidden.scenario import Scenario, observe, scenario
from hidden.world import rms

HERE = Path(__file__).parent
CASES = [
    ("single", 0),
    *([("single", 3), ("single", 6)] if FULL else []),
    ("clutter", 1),
    ("mistake", 2),
    ("two", 2),
    ("foreign", 3),
    ("small", 1),
]


@pytest.fixture(scope="module")
def scenes() -> dict[tuple[str, int], Scenario]:
    return {case: scenario(development_seed(*case), *case) for case in CASES}


def sizes(scene: Scenario) -> list[tuple[float, float]]:
    s = scene.draft.situation.rows(np.flatnonzero(scene.given))
    lengths = [np.linalg.norm(scene.draft.world.of_hidden(s), axis=1)]
    return [(float(np.sqrt(np.mean(x**2))) * 1e3, float(np.max(x)) * 1e3) for x in lengths]


def test_nothing_here_imports_the_code_under_test() -> None:
    for path in sorted(HERE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not any(name.split(".")[0].startswith("ncfix") for name in names), path.name


def test_same_seed_same_bytes_other_seed_other_bytes() -> None:
    first, again, other = (scenario(seed, "single", 5) for seed in (77, 77, 78))
    assert first.handed == again.handed
    assert first.truth_json() == again.truth_json()
    assert first.plan == again.plan
    assert first.handed["measured-1.csv"] != other.handed["measured-1.csv"]


@pytest.mark.parametrize("wanted", [2.5, 5.0, 20.0] if FULL else [2.5, 20.0])
def test_magnitude_is_as_asked(wanted: float) -> None:
    scene = scenario(9, "single", 1, amplitude_um=wanted)
    [(measured, largest)] = sizes(scene)
    [effect] = scene.truth.effects
    assert measured == pytest.approx(wanted, rel=1e-4)  # a second-order remainder of 20 um with levers of 1000 mm
    assert effect["rms_um"] == pytest.approx(wanted, rel=1e-4)
    assert effect["max_um"] == pytest.approx(largest, rel=1e-3)
    assert effect["max_um"] > effect["rms_um"]


def test_effect_of_choice_is_hidden() -> None:
    scene = scenario(4, "single", effect="backlash X", topology="wXFYZSt", kind="tcp", amplitude_um=10.0)
    assert [e["name"] for e in scene.truth.effects] == ["backlash X"]
    assert (scene.truth.topology, scene.truth.kind) == ("wXFYZSt", "tcp")


def test_clutter_is_one_micrometre_in_total() -> None:
    scene = scenario(2, "clutter", 0)
    s, draft = scene.draft.situation, scene.draft
    left = draft.world.displacement(s) - draft.model.displacement(draft.world.machine, s.q, s.length)
    assert 1e3 * rms(left) == pytest.approx(1.0, rel=1e-3)
    assert len(draft.world.clutter) >= 50


@pytest.mark.parametrize(
    ("topology", "kind"), [("wCBXFZYSt", "tcp"), ("wCAYFXZSt", "probe"), ("wXFYZCBSt", "length"), ("wXFYZSt", "length")]
)
def test_silent_base_machine_leaves_nothing(topology: str, kind: str) -> None:
    """Data without noise of a machine that is as its file says: only the set-up is in it, and that is linear."""
    scene = scenario(6, "clean", topology=topology, kind=kind, silent=True)
    draft = scene.draft
    s = draft.situation.rows(np.flatnonzero(draft.given))
    known = instruments.Setup(
        {k: 0 * v for k, v in scene.setup.balls.items()}, {k: 0 * v for k, v in scene.setup.stylus.items()}
    )
    ours = observe(draft.world, s, kind, scene.setup) - observe(draft.world, s, kind, known)
    handed = np.concatenate([values(scene, name, kind) for name in measured(scene)])
    order = np.argsort(np.concatenate([files.read(scene.handed[n])["time_s"] for n in measured(scene)]), kind="stable")
    assert np.max(np.abs(handed[order] - observe(draft.world, s, kind, scene.setup))) < 6e-6  # five decimals
    left = draft.sight.left(as_displacement(scene, ours).reshape(-1))
    # products: offsets of 0.5 mm (probe) or 0.03 mm with angles of 40 urad, and for bars 0.03 mm squared over 100 mm
    assert np.max(np.abs(left)) < 2e-4


def as_displacement(scene: Scenario, difference: np.ndarray) -> np.ndarray:
    """Probed axis positions as tip displacements: what a tcp instrument would have shown, the other way round."""
    if scene.draft.kind != "probe":
        return difference
    s = scene.draft.situation.rows(np.flatnonzero(scene.given))
    letters = [j.name for j in s.machine.joints if not j.rotary]
    ordered = difference[:, ["XYZ".index(letter) for letter in letters]]
    result: np.ndarray = np.einsum("nij,nj->ni", s.machine.linear_jacobian(s.q, s.length), ordered)
    return result


def measured(scene: Scenario) -> list[str]:
    return sorted(name for name in scene.handed if name.startswith("measured"))


def values(scene: Scenario, name: str, kind: str) -> np.ndarray:
    columns = files.read(scene.handed[name])
    return np.stack([columns[c] for c in files.HEADS[kind]], axis=1)


@pytest.mark.parametrize("case", CASES)
def test_measurement_files_are_valid(scenes: dict[tuple[str, int], Scenario], case: tuple[str, int]) -> None:
    scene = scenes[case]
    machine = tomllib.loads(scene.handed["machine.toml"])
    ranges = {name: axis["range"] for name, axis in machine["axis"].items()}
    for name in measured(scene):
        comments = [line for line in scene.handed[name].splitlines() if line.startswith("#")]
        assert comments[:2] == ["# ncfix-measurement: 1", f"# kind: {scene.truth.kind}"]
        assert all(re.fullmatch(r"# (noise_um: [\d.]+|distance: \d+ \d+ [\d.]+ [\d.]+)", c) for c in comments[2:])
        columns = files.read(scene.handed[name])
        known = {
            "set",
            "ball",
            "time_s",
            "load_kg",
            "tool_length",
            "repeat",
            "radius",
            "cx",
            "cy",
            "cz",
        }
        known |= {*ranges, *(f"dir_{a}" for a in ranges), *files.HEADS[scene.truth.kind]}
        assert all(c in known or c.startswith("temp_") for c in columns)
        assert all(np.all(np.isfinite(v)) for v in columns.values())
        assert np.all(np.diff(columns["time_s"]) > 0)
        for axis, (low, high) in ranges.items():
            if axis in columns and case[0] != "mistake":
                assert low <= columns[axis].min()
                assert columns[axis].max() <= high
            assert set(np.unique(columns[f"dir_{axis}"])) <= {-1.0, 0.0, 1.0}


@pytest.mark.parametrize("case", CASES)
def test_machine_file_has_what_the_format_asks(scenes: dict[tuple[str, int], Scenario], case: tuple[str, int]) -> None:
    machine = tomllib.loads(scenes[case].handed["machine.toml"])
    letters = [part for part in machine["topology"].split() if part not in "wFSt"]
    assert sorted(letters) == sorted(machine["axis"])
    assert "".join(machine["topology"].split()) == scenes[case].truth.topology
    assert all(e["name"][2:].lstrip("0") in machine["axis"] for e in machine["effect"])


@pytest.mark.parametrize("case", CASES)
def test_truth_stays_out_of_what_is_handed_over(
    scenes: dict[tuple[str, int], Scenario], case: tuple[str, int], tmp_path: Path
) -> None:
    scene = scenes[case]
    scene.write(tmp_path / "handed", tmp_path / "truth")
    text = "\n".join([*(p.read_text() for p in (tmp_path / "handed").iterdir()), *scene.handed])
    named = {e["name"] for e in scene.truth.effects if e["kind"] != "curve"} | {e["kind"] for e in scene.truth.effects}
    words = named | {
        FAMILIES[case[0]].title,
        scene.truth.family,
        "seed",
        "hidden",
        "truth",
        "clutter",
        "outlier",
        "effect of",
    }
    assert not [word for word in words - {"pitch"} if re.search(rf"(?<![\w.]){re.escape(word)}(?![\w.])", text)]
    stated = [effect["name"] for effect in tomllib.loads(scene.handed["machine.toml"])["effect"]]
    assert stated == [term.name for term in scene.draft.handed_model.terms]
    assert json.loads((tmp_path / "truth" / "truth.json").read_text())["seed"] == scene.truth.seed
    with pytest.raises(ValueError, match="truth"):
        scene.write(tmp_path / "one", tmp_path / "one")


def test_held_out_poses_are_not_handed_over(scenes: dict[tuple[str, int], Scenario]) -> None:
    for scene in scenes.values():
        plan = files.read(scene.plan)
        given = np.concatenate([files.read(scene.handed[n])["time_s"] for n in measured(scene)])
        assert not set(given) & set(plan["time_s"][~scene.given])
        assert 0.1 < np.mean(~scene.given) < 0.35
        blocks = scene.draft.situation.block
        repeated = np.flatnonzero(scene.draft.situation.repeat > 0)
        alone = np.setdiff1d(np.flatnonzero(scene.given), np.r_[repeated, repeated - 1])
        assert not set(blocks[alone]) & set(blocks[~scene.given])


def test_seeds_of_both_runs_do_not_meet() -> None:
    work, last = (tasks(list(FAMILIES), final) for final in (False, True))
    assert len(work) == len(last) == sum(f.count for f in FAMILIES.values())
    assert len({t.seed for t in work}) == len(work)
    assert len({t.seed for t in last}) == len(last)
    assert max(t.seed for t in work) < 1_000_000 < FINAL_RANGE <= min(t.seed for t in last)
    assert final_seed("single", 0) == 1526685328458  # as long as the salt is the eleventh: final scenarios hang on it


def test_noise_has_the_size_that_is_stated_and_heavy_tails() -> None:
    time = np.arange(20000.0)
    noise = instruments.Noise(sigma_um=3.0, outliers=0.0, wander_um=0.0)
    drawn, bad = instruments.draw_noise(np.random.default_rng(0), noise, time, 3)
    assert 1e3 * np.std(drawn) == pytest.approx(3.0, rel=0.03)
    assert np.mean(np.abs(drawn) > 0.012) > 10 * 6.3e-5  # beyond four sigma: ten times as often as a normal's
    assert len(bad) == 0
    _, bad = instruments.draw_noise(np.random.default_rng(0), instruments.Noise(outliers=0.01), time, 3)
    assert np.mean(np.isin(np.arange(20000), bad)) == pytest.approx(0.01, rel=0.2)


def test_instruments_differ_and_have_three_micrometres_each() -> None:
    drawn = [instruments.draw_instrument(np.random.default_rng(seed), clean=False) for seed in range(40)]
    assert {noise.sigma_um for noise in drawn} == {3.0}
    assert len({(noise.tails, noise.memory, noise.wander_um, noise.outliers) for noise in drawn}) == 40
    assert all(noise.tails > 4 and 0.1 <= noise.wander_um <= 0.6 and noise.outliers < 0.02 for noise in drawn)
    clean = instruments.draw_instrument(np.random.default_rng(1), clean=True)
    assert (clean.wander_um, clean.outliers, clean.sigma_um) == (0.0, 0.0, 3.0)


def test_what_wanders_is_part_of_the_noise_that_is_stated() -> None:
    noise = instruments.Noise(sigma_um=3.0, tails=20.0, outliers=0.0, wander_um=2.0, memory=300.0)
    drawn, _ = instruments.draw_noise(np.random.default_rng(3), noise, np.arange(0, 3e6, 60.0), 1)
    assert 1e3 * np.std(drawn) == pytest.approx(3.0, rel=0.03)


def test_families_take_turns_and_can_be_cut_short() -> None:
    some = tasks(["single", "two", "clean"], counts={"": 2, "single": 4})
    assert [task.family for task in some[:3]] == ["single", "two", "clean"]
    assert [sum(task.family == name for task in some) for name in ("single", "two", "clean")] == [4, 2, 2]
    assert {task.seed for task in some} <= {task.seed for task in tasks(["single", "two", "clean"])}


def test_a_good_design_has_some_three_hundred_rows() -> None:
    given = [int(scenario(seed, "clean", seed).given.sum()) for seed in range(12)]
    assert all(250 < rows < 500 for rows in given)
    assert 270 < np.median(given) < 350


def test_no_two_machines_are_alike() -> None:
    drawn = [workshop.draw_machine(np.random.default_rng(seed), "wCAYFXZSt") for seed in range(20)]
    assert len({(m.size, m.lengths, m.joint("A").direction, m.joint("A").point) for m in drawn}) == 20
    for machine in drawn:
        axis = machine.joint("A")
        assert np.linalg.norm(axis.direction) == pytest.approx(1)
        assert axis.triad[0] == axis.direction  # its errors are named along and about it
        assert np.asarray(axis.triad) @ np.asarray(axis.triad).T == pytest.approx(np.eye(3))


def test_repeats_follow_each_other_with_the_same_approach(scenes: dict[tuple[str, int], Scenario]) -> None:
    s = scenes["single", 0].draft.situation
    again = np.flatnonzero(s.repeat > 0)
    assert len(again) >= 40
    assert np.array_equal(s.q[again], s.q[again - 1])
    assert np.array_equal(s.direction[again], s.direction[again - 1])
    assert s.time[again] - s.time[again - 1] == pytest.approx(15.0)


@pytest.mark.parametrize("kind", mistakes.KINDS)
def test_each_mistake_disagrees_with_the_file(kind: str) -> None:
    scene = scenario(31, "mistake", effect=kind)
    assert scene.truth.effects[0]["kind"] == kind
    assert scene.truth.topology != "wXFYZSt" or kind not in mistakes.NEEDS_ROTARY
    draft, m = scene.draft, scene.draft.mistake
    assert m is not None
    changed = m.machine != draft.world.machine or m.model != draft.model or m.control is not None or m.factors
    assert changed


def test_an_active_table_leaves_the_tip_where_it_should_be() -> None:
    scene = scenario(31, "mistake", effect="table active", topology="wCBXFZYSt")
    s, draft = scene.draft.situation, scene.draft
    known = draft.model.displacement(draft.world.machine, s.q, s.length)
    assert 1e3 * rms(known) > 10
    assert 1e3 * rms(scene.tips) < 2.0  # what is left is the clutter of 1 um, and the table's own slope


def test_measured_again_the_machine_is_the_same() -> None:
    scene = scenario(3, "single", topology="wCBXFZYSt", kind="tcp")
    s = scene.draft.situation
    poses = [
        dict(zip(s.machine.axes, row, strict=True)) | {"tool_length": 300.0} for row in (s.q[:5] / s.machine.units)
    ]
    text = remeasure.at_poses(scene, poses, 1)
    columns = files.read(text)
    assert text == remeasure.at_poses(scene, poses, 1)
    assert columns["X"] == pytest.approx(s.q[:5, s.machine.axes.index("X")], abs=1e-4)
    assert np.all(columns["tool_length"] == 300.0)
    assert np.all(columns["time_s"] > s.time[-1])
    assert len(files.read(remeasure.at_random(scene, 12, 1))["X"]) == 12


def test_wander_is_correlated_in_time() -> None:
    noise = instruments.Noise(sigma_um=1e-9, outliers=0.0, wander_um=1.0, memory=900.0)
    drawn, _ = instruments.draw_noise(np.random.default_rng(1), noise, np.arange(0, 3e6, 60.0), 1)
    near, far = (np.corrcoef(drawn[:-lag, 0], drawn[lag:, 0])[0, 1] for lag in (1, 100))
    assert near == pytest.approx(np.exp(-60 / 900), abs=0.02)
    assert abs(far) < 0.1
