"""The judge: crafted answers get the record they deserve, and the table counts them."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hidden import __main__ as entry
from hidden import promises, tally
from hidden.candidate import Answer, Program, Reported, ask, read_answer
from hidden.families import FAMILIES, Task
from hidden.intervals import bootstrap, wilson
from hidden.scenario import Scenario, after_um, scenario
from hidden.score import Record, as_row, from_row, judged, run

TASK = Task("single", 1, 11)


@pytest.fixture(scope="module")
def scene() -> Scenario:
    return scenario(11, "single", 1, effect="backlash Y", topology="wCAYFXZSt", kind="tcp", amplitude_um=10.0)


def found(*effects: Reported, verdict: str = "found") -> Answer:
    return Answer(verdict, effects)


def test_right_name_first(scene: Scenario) -> None:
    record = judged(TASK, scene, found(Reported("backlash", "", "Y", ("EYY",))), 1.4)
    assert (record.first_right, record.in_set, record.all_right, record.set_size, record.false_names) == (
        True,
        True,
        True,
        2,
        0,
    )


def test_right_name_among_the_aliases(scene: Scenario) -> None:
    record = judged(TASK, scene, found(Reported("EYY", "", "Y", ("backlash Y",)), verdict="ambiguous"), None)
    assert (record.first_right, record.in_set, record.all_right, record.false_names) == (False, True, False, 0)


def test_wrong_names_are_counted(scene: Scenario) -> None:
    record = judged(TASK, scene, found(Reported("backlash Y"), Reported("EXX"), Reported("drift Z")), None)
    assert (record.first_right, record.false_names) == (True, 2)


def test_unknown_by_verdict_or_by_size(scene: Scenario) -> None:
    assert judged(TASK, scene, found(verdict="unknown-effect"), None).unknown
    assert judged(TASK, scene, replace(found(Reported("EXX")), unknown_um=6.0), None).unknown
    assert not judged(TASK, scene, replace(found(Reported("EXX")), unknown_um=3.0), None).unknown


def test_null_has_nothing_to_be_right_about() -> None:
    record = judged(Task("clean", 0, 3), scenario(3, "clean", 0), found(Reported("EXX")), None)
    assert record.first_right is None
    assert record.false_names == 1


def test_gap_after_the_truth_itself_is_the_floor_and_after_nothing_is_the_gap(scene: Scenario) -> None:
    s, draft = scene.draft.situation, scene.draft
    known = draft.model.displacement(draft.world.machine, s.q, s.length)
    assert after_um(scene, scene.tips) == pytest.approx(0.0, abs=1e-6)
    assert after_um(scene, known) == pytest.approx(scene.truth.gaps_um["file"], rel=1e-9)
    perfect = judged(TASK, scene, found(Reported("backlash Y")), after_um(scene, scene.tips))
    nothing = judged(TASK, scene, found(), scene.truth.gaps_um["before"])
    assert tally.removed(perfect) == 1.0
    assert tally.removed(nothing) == pytest.approx(0.0)
    assert tally.worse(replace(nothing, gap_after_um=1.03 * nothing.gap_file_um))


def test_deleted_name_and_its_family() -> None:
    scene = scenario(5, "deleted", 1, effect="lateral play EYX", topology="wCAYFXZSt", kind="tcp")
    assert scene.truth.without == ("lateral play EYX",)
    task = Task("deleted", 1, 5)
    kin = judged(task, scene, found(Reported("angular play EAX")), None)
    stranger = judged(task, scene, found(Reported("worm C")), None)
    silent = judged(task, scene, found(verdict="unknown-effect"), None)
    assert [tally.family_or_unknown(r) for r in (kin, stranger, silent)] == [True, False, True]
    assert [tally.confident(r) for r in (kin, stranger, silent)] == [True, True, False]


@pytest.mark.parametrize(
    ("deleted", "topology", "said"), [("column nod Y", "wCBXFZYSt", "column nod Z"), ("EYY", "wCBXFZYSt", "ECY")]
)
def test_kin_need_not_be_hidden_anywhere(deleted: str, topology: str, said: str) -> None:
    scene = scenario(77, "deleted", effect=deleted, topology=topology)
    task = Task("deleted", 0, 77)
    near = judged(task, scene, found(Reported(said, "", said[-1])), None)
    assert near.closest > 0.7
    assert tally.family_or_unknown(near)
    assert not tally.family_or_unknown(judged(task, scene, found(Reported("wobble B", "", "B")), None))


def test_wilson_and_bootstrap() -> None:
    assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)  # Wilson 1927, as in any table
    assert wilson(0, 100) == pytest.approx((0.0, 0.0370), abs=1e-4)
    low, high = bootstrap(np.arange(1000.0).tolist(), 0.5)
    assert low < 499.5 < high
    assert high - low < 120  # 2 * 1.96 * 1000 / (2 sqrt(1000)) = 62 for the median of a uniform


def records(scene: Scenario) -> list[Record]:
    right = judged(TASK, scene, found(Reported("backlash Y")), 1.4)
    wrong = judged(TASK, scene, found(Reported("EXX")), 9.0)
    return [*(replace(right, seed=i) for i in range(3)), replace(wrong, seed=9)]


def test_table_counts_and_says_what_is_met(scene: Scenario) -> None:
    lines = {line.title: line for line in tally.lines(records(scene))}
    first = lines["one effect 5 to 20 um: first name right"]
    assert (first.count, first.value, first.met) == (4, 0.75, "no")
    assert lines["clean null: any name"].met == ""
    assert lines["no answer (fault, time out)"].met == "yes"
    text = tally.markdown(records(scene), "Development seeds.")
    assert "| one effect 5 to 20 um: first name right | 4 | 0.750 |" in text
    assert "- backlash Y: EXX" in text


def test_section_is_replaced_in_place(scene: Scenario) -> None:
    old = f"# Accuracy\n\n{tally.BEGIN}\nold\n{tally.END}\n\nafter\n"
    new = tally.replaced(old, tally.markdown(records(scene), "x"))
    assert "old" not in new
    assert new.startswith("# Accuracy")
    assert new.endswith("after\n")
    assert tally.replaced("# Accuracy\n", "S") == "# Accuracy\n\nS\n"


def test_record_survives_its_line(scene: Scenario) -> None:
    record = records(scene)[0]
    assert from_row(json.loads(json.dumps(as_row(record)))) == record


def test_answer_is_read_as_the_format_says(tmp_path: Path) -> None:
    said = {
        "schema": 1,
        "verdict": "ambiguous",
        "effects": [{"name": "EAY", "title": "pitch of Y", "axis": "Y", "aliases": ["EYY"]}],
        "unknown": {"share_um": 0.4, "where": []},
        "next_measurements": [{"X": 1.0, "B": 30, "tool_length": 300.0, "why": "lever"}, {"pose": {"X": 2.0}}, "text"],
    }
    answer = read_answer(said, tmp_path / "none.toml", 0.1)
    assert answer.effects == (Reported("EAY", "pitch of Y", "Y", ("EYY",)),)
    assert answer.next_poses == ({"X": 1.0, "B": 30.0, "tool_length": 300.0}, {"X": 2.0})
    assert answer.machine is None


FAKE = """
import json, sys
verb, rest = sys.argv[1], sys.argv[2:]
if verb == "diagnose":
    assert "--json" in rest and all("truth" not in word for word in rest)
    print(json.dumps({"schema": 1, "verdict": "nothing-missing", "effects": [], "next_measurements": [{"X": 10.0}]}))
elif verb == "simulate":
    plan, output = rest[rest.index("--plan") + 1], rest[rest.index("-o") + 1]
    rows = [line for line in open(plan) if line[0] != "#"][1:]
    open(output, "w").write("# kind: tcp\\ndx,dy,dz\\n" + "0,0,0\\n" * len(rows))
else:
    sys.exit(5)
"""


@pytest.fixture
def program(tmp_path: Path) -> Program:
    path = tmp_path / "fake.py"
    path.write_text(FAKE)
    return Program((sys.executable, str(path)))


def test_a_program_is_asked_and_its_prediction_judged(program: Program) -> None:
    record = run(Task("single", 2, 21), program)
    assert record.verdict == "nothing-missing"
    assert record.gap_after_um is not None
    assert record.first_right is False
    pair = run(Task("pair", 0, 5), program)
    assert (pair.resolved, pair.resolved_by_random) == (False, False)


def test_a_fault_is_an_answer_too(tmp_path: Path) -> None:
    scenario(3, "clean", 0).write(tmp_path / "handed", tmp_path / "truth")
    answer = ask(Program((sys.executable, "-c", "import sys; sys.exit(3)")), tmp_path / "handed")
    assert answer.error.startswith("RuntimeError: exit code 3")
    assert not answer.effects


def test_entry_runs_writes_and_resumes(program: Program, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--family", "clean", "--count", "clean=2", "--command", " ".join(program.command), "-j", "2"]
    arguments += ["--records", str(tmp_path / "r.jsonl"), "--table", str(tmp_path / "accuracy.md")]
    assert entry.main(arguments) == 0
    first = (tmp_path / "r.jsonl").read_text()
    assert entry.main(arguments) == 0
    assert (tmp_path / "r.jsonl").read_text() == first
    assert "| clean null: any name | 2 | 0.000 |" in capsys.readouterr().out
    assert (tmp_path / "accuracy.md").read_text().count(tally.BEGIN) == 1


def test_scenarios_can_be_written_out(tmp_path: Path) -> None:
    assert entry.main(["--family", "clutter", "--count", "1", "--write", str(tmp_path)]) == 0
    assert (tmp_path / "handed" / "clutter-000" / "machine.toml").exists()
    assert (tmp_path / "truth" / "clutter-000" / "truth.json").exists()
    assert set(FAMILIES) >= {"single", "clean", "mistake"}


def test_promises_are_counted_by_what_was_stated() -> None:
    rows = promises.table([(0.95, True), (0.92, True), (0.5, False)]).splitlines()[2:]
    assert [row.split("|")[1:5] for row in rows] == [
        [" 0.3 to 0.6 ", " 1 ", " 0.50 ", " 0 "],
        [" 0.9 to 1.0 ", " 2 ", " 0.94 ", " 2 "],
        [" all ", " 3 ", " 0.79 ", " 2 "],
    ]
