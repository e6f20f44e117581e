"""Many programs at once: the same outputs however many work on them, and a batch that stopped goes on."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from ncfix.batch.journal import JOURNAL, Journal
from ncfix.diagnostics import ExitCode

COUNT = 6
LIMIT_S = 6
"""Much longer than a program of these takes on a loaded computer."""


@pytest.fixture
def parts(shop: Any) -> Path:
    """A folder `parts` of programs, one of them a folder further down."""
    folder = shop.folder / "parts"
    for number in range(COUNT):
        path = folder / ("deep" if number % 2 else "") / f"part{number}.ngc"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(shop.program.read_bytes().replace(b"X110.000", b"X%d.000" % (111 + number)))
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    """All files but the journal."""
    found = (path for path in folder.rglob("*") if path.is_file() and path.name != JOURNAL)
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


def test_a_folder_keeps_its_shape(ncfix: Any, shop: Any, parts: Path) -> None:
    out = shop.folder / "out"
    result = ncfix("fix", parts, "-m", shop.machine, "-o", out, "--assume-zero", "--json")
    assert result.code == ExitCode.DONE
    assert set(contents(out)) == set(contents(parts))
    assert [Path(each["path"]).name for each in result.json()["files"]] == [
        f"part{number}.ngc" for number in (0, 2, 4, 1, 3, 5)
    ]


def test_outputs_and_messages_do_not_depend_on_the_jobs(ncfix: Any, shop: Any, parts: Path) -> None:
    said = {}
    (parts / "bad.ngc").write_bytes(b"G1 X1 Y..2\nM2\n")
    for jobs in (1, 2):
        out = shop.folder / f"out{jobs}"
        result = ncfix("fix", parts, "-m", shop.machine, "-o", out, "--assume-zero", "--jobs", jobs, "--json")
        assert result.code == ExitCode.UNREADABLE
        said[jobs] = (contents(out), (result.err + result.out.decode()).replace(str(out), "OUT"))
    assert said[1] == said[2]
    assert f"{COUNT + 1} programs: {COUNT} written, 1 not\n" in said[1][1]


def test_what_is_there_already_stays_if_it_is_right(ncfix: Any, shop: Any, parts: Path) -> None:
    out = shop.folder / "out"
    command = ("fix", parts, "-m", shop.machine, "-o", out, "--assume-zero")
    ncfix(*command)
    before = {path: path.stat().st_mtime_ns for path in out.rglob("*.ngc")}
    assert ncfix(*command).code == ExitCode.USAGE
    assert ncfix(*command, "--resume").code == ExitCode.DONE
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*.ngc")} == before


def test_what_is_there_and_different_is_not_replaced(ncfix: Any, shop: Any, parts: Path) -> None:
    out = shop.folder / "out"
    out.mkdir()
    (out / "part0.ngc").write_bytes(b"something else\n")
    result = ncfix("fix", parts, "-m", shop.machine, "-o", out, "--assume-zero", "--resume")
    assert result.code == ExitCode.USAGE
    assert "NCF004" in result.err
    assert (out / "part0.ngc").read_bytes() == b"something else\n"
    assert len(contents(out)) == COUNT


def test_resuming_needs_a_folder(ncfix: Any, shop: Any) -> None:
    result = ncfix("fix", shop.program, "-m", shop.machine, "-o", shop.folder / "new.ngc", "--resume")
    assert result.code == ExitCode.USAGE
    assert "NCF016" in result.err


@pytest.mark.parametrize("jobs", [1, 3])
def test_a_killed_batch_goes_on_to_the_same_bytes(ncfix: Any, shop: Any, parts: Path, jobs: int) -> None:
    """Killed at random moments until it is done, `NCFIX_MOMENTS` times at most; programs change meanwhile."""
    whole, out, chance = shop.folder / "whole", shop.folder / "out", random.Random(jobs)
    command = ["fix", str(parts), "-m", str(shop.machine), "-o", str(out), "--assume-zero", "--resume", "-j", str(jobs)]
    for _ in range(int(os.environ.get("NCFIX_MOMENTS", "4"))):
        running = subprocess.Popen([sys.executable, "-m", "ncfix", *command], stderr=subprocess.DEVNULL)
        while running.poll() is None and not (out / JOURNAL).exists():
            time.sleep(0.001)
        with suppress(subprocess.TimeoutExpired):
            running.wait(chance.random() * 0.8)
        running.kill()
        running.wait()
        changed = chance.choice(sorted(parts.rglob("*.ngc")))
        changed.write_bytes(changed.read_bytes().replace(b"M2", b"G1 X%d\r\nM2" % chance.randrange(100, 200)))
    assert ncfix(*command).code == ExitCode.DONE
    ncfix("fix", parts, "-m", shop.machine, "-o", whole, "--assume-zero")
    assert contents(out) == contents(whole)


@pytest.fixture
def night(ncfix: Any, shop: Any, parts: Path) -> Any:
    """Runs the batch of a night: its entries by the names of the programs, and the result."""

    def run(*more: object) -> tuple[dict[str, Any], Any]:
        options = ("-m", shop.machine, "-o", shop.folder / "out", "--resume", "--json", *more)
        result = ncfix("fix", parts, "--assume-zero", *options)
        return {Path(each["path"]).name: each for each in result.json()["files"]}, result

    return run


def resumed(entries: dict[str, Any]) -> set[str]:
    return {name.removesuffix(".ngc")[-1] for name, entry in entries.items() if entry.get("resumed")}


def test_the_next_night_does_what_has_changed(night: Any, shop: Any, parts: Path) -> None:
    first, _ = night()
    out = shop.folder / "out"
    assert resumed(first) == set()
    assert len(Journal(str(out)).records) == COUNT
    (out / "part0.ngc").unlink()
    (parts / "part2.ngc").write_bytes(shop.program.read_bytes())
    before = {path: path.stat().st_mtime_ns for path in out.rglob("*.ngc") if path.name != "part2.ngc"}
    again, result = night()
    assert result.code == ExitCode.DONE
    assert resumed(again) == set("1345")
    assert again["part1.ngc"] == {**first["part1.ngc"], "resumed": True}
    assert b"X109.989" in (out / "part2.ngc").read_bytes()
    assert {path: path.stat().st_mtime_ns for path in before} == before


def test_nothing_is_done_for_another_reason(night: Any, shop: Any) -> None:
    night()
    assert resumed(night()[0]) == set("012345")
    assert resumed(night("--tolerance-um", "2")[0]) == set()
    shop.machine.write_text(shop.machine.read_text().replace("1e-4", "2e-4"))
    assert resumed(night()[0]) == set()
    assert resumed(night()[0]) == set("012345")


def test_an_output_that_somebody_changed_is_never_trusted_nor_replaced(night: Any, shop: Any) -> None:
    night()
    output = shop.folder / "out" / "part0.ngc"
    mine = output.read_bytes()
    output.write_bytes(b"by hand\n")
    entries, result = night()
    assert result.code == ExitCode.USAGE
    assert resumed(entries) == set("12345")
    assert entries["part0.ngc"]["errors"][0]["code"] == "NCF004"
    assert output.read_bytes() == b"by hand\n"
    output.write_bytes(mine)
    assert resumed(night()[0]) == set("012345")


def test_a_program_of_the_same_name_does_not_take_the_place_of_another(night: Any, ncfix: Any, shop: Any) -> None:
    night()
    other = shop.folder / "elsewhere" / "part0.ngc"
    other.parent.mkdir()
    other.write_bytes(shop.program.read_bytes())
    before = contents(shop.folder / "out")
    result = ncfix("fix", other, "-m", shop.machine, "-o", shop.folder / "out", "--assume-zero", "--resume")
    assert "NCF004" in result.err
    assert contents(shop.folder / "out") == before


def test_a_failure_is_remembered_until_something_changes(night: Any, parts: Path) -> None:
    bad = parts / "bad.ngc"
    bad.write_bytes(b"G1 X1 Y..2\nM2\n")
    first, result = night()
    assert result.code == ExitCode.UNREADABLE
    again, result = night()
    assert result.code == ExitCode.UNREADABLE
    assert again["bad.ngc"] == {**first["bad.ngc"], "resumed": True}
    assert ", as before" in result.err
    assert "resumed" not in night("--retry")[0]["bad.ngc"]
    assert resumed(night("--retry")[0]) == set("012345")
    bad.write_bytes(b"G1 X1 Y.2 F100\nM2\n")
    assert night()[1].code == ExitCode.DONE


def test_a_disk_that_was_full_is_not_remembered(night: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from ncfix import files

    def full(*_: Any) -> None:
        raise files.unwritable("out", OSError(28, "No space left on device"))

    with monkeypatch.context() as broken:
        broken.setattr(files, "write_whole", full)
        entries, result = night("--jobs", 1)
    assert result.code == ExitCode.USAGE
    assert {entry["errors"][0]["code"] for entry in entries.values()} == {"NCF007"}
    entries, result = night()
    assert result.code == ExitCode.DONE
    assert resumed(entries) == set()


def test_the_output_of_an_earlier_state_is_named(night: Any, shop: Any, parts: Path) -> None:
    night()
    output = shop.folder / "out" / "part0.ngc"
    before = output.read_bytes()
    (parts / "part0.ngc").write_bytes(b"G1 X1 Y..2\nM2\n")
    for _ in range(2):
        entries, result = night()
        assert entries["part0.ngc"]["stale"]
        assert "the existing output is out of date: do not run it" in result.err
        assert output.read_bytes() == before


def test_a_subprogram_that_changed_counts(night: Any, parts: Path) -> None:
    (parts / "part0.ngc").write_bytes(b"G21 G90 G94 G0 X0 Y0 Z0\no<sub> call\nM2\n")
    (parts / "sub.ngc").write_bytes(b"o<sub> sub\nG1 X10 F100\no<sub> endsub\nM2\n")
    night("--flatten")
    assert "resumed" in night("--flatten")[0]["part0.ngc"]
    (parts / "sub.ngc").write_bytes(b"o<sub> sub\nG1 X20 F100\no<sub> endsub\nM2\n")
    assert "resumed" not in night("--flatten")[0]["part0.ngc"]


def test_what_is_said_of_many(ncfix: Any, shop: Any, parts: Path) -> None:
    (parts / "bad.ngc").write_bytes(b"G1 X1 Y..2\nM2\n")
    command = ("fix", parts, "-m", shop.machine, "--assume-zero", "-o")
    lines = ncfix(*command, shop.folder / "a").err.splitlines()
    of_machine, usual = lines[:2], lines[2:]
    assert "NCF320" in of_machine[0]
    assert "bad.ngc:1: NCF1" in usual[0]
    assert usual[1].split() == ["programs", "outcome", "reason"]
    assert usual[2].split() == [str(COUNT), "written"]
    assert usual[3].split()[:2] == ["1", "failed"]
    assert usual[-1] == f"{COUNT + 1} programs: {COUNT} written, 1 not"
    quiet = ncfix(*command, shop.folder / "b", "-q").err.splitlines()
    assert quiet == [*of_machine, usual[0]]
    full = ncfix(*command, shop.folder / "c", "-v").err
    assert full.count("largest correction") == COUNT
    assert full.endswith("\n".join(usual[1:]) + "\n")
    one = ("fix", parts / "part0.ngc", "-m", shop.machine, "--assume-zero", "-o", shop.folder / "d.ngc", "--force")
    assert "largest correction" in ncfix(*one).err
    assert ncfix(*one, "-q").err.splitlines() == of_machine


def test_a_reason_that_many_programs_have_is_counted(
    ncfix: Any, shop: Any, parts: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ncfix.cli import console

    monkeypatch.setattr(console, "MAX_MESSAGES_PER_CODE", 2)
    for number in range(5):
        (parts / f"bad{number}.ngc").write_bytes(b"G1 X1 Y..2\nM2\n")
    said = ncfix("fix", parts, "-m", shop.machine, "--assume-zero", "-o", shop.folder / "out", "-q").err.splitlines()[
        2:
    ]
    assert [Path(line.split(":")[0]).name for line in said[:2]] == ["bad0.ngc", "bad1.ngc"]
    assert len(said) == 3
    assert "are only counted" in said[2]


def test_json_lines(ncfix: Any, shop: Any, parts: Path) -> None:
    (parts / "bad.ngc").write_bytes(b"G1 X1 Y..2\nM2\n")
    result = ncfix("fix", parts, "-m", shop.machine, "-o", shop.folder / "out", "--assume-zero", "--json-lines", "-q")
    *found, last = [json.loads(line) for line in result.out.splitlines()]
    assert [each["outcome"] for each in found] == ["failed", *["written"] * COUNT]
    assert {each["schema"] for each in found} == {1}
    outcomes = [{"outcome": "written", "code": None, "programs": COUNT}]
    outcomes.append({"outcome": "failed", "code": found[0]["errors"][0]["code"], "programs": 1})
    remarks = last["summary"].pop("remarks")
    assert last == {"schema": 1, "summary": {"programs": COUNT + 1, "written": COUNT, "outcomes": outcomes}}
    assert remarks.keys() == {each["code"] for each in found[1]["warnings"]}


def test_json_lines_are_lines_where_the_verb_fails(ncfix: Any, shop: Any, parts: Path) -> None:
    for more in (("-m", "none.toml"), ("-m", shop.machine, "--diff"), ("-m", shop.machine, "--no-such-option")):
        result = ncfix("fix", parts, "-o", shop.folder / "out", "--assume-zero", "--json-lines", *more)
        assert result.code in (ExitCode.USAGE, ExitCode.UNREADABLE)
        assert [list(json.loads(line)) for line in result.out.splitlines()] == [["schema", "errors"]]


def test_retry_is_for_what_resume_leaves_out(ncfix: Any, shop: Any, parts: Path) -> None:
    result = ncfix("fix", parts, "-m", shop.machine, "-o", shop.folder / "out", "--assume-zero", "--retry")
    assert (result.code, "hint: --resume --retry" in result.err) == (ExitCode.USAGE, True)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_program_that_takes_too_long(
    ncfix: Any, shop: Any, parts: Path, jobs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ncfix.cli.shop.batch import FixJob

    fixed = FixJob.fixed

    def slow(job: FixJob, target: Any, *rest: Any) -> Any:
        end = time.monotonic() + (120 if target.source.endswith("part2.ngc") else 0)
        while time.monotonic() < end:
            time.sleep(0.01)
        return fixed(job, target, *rest)

    monkeypatch.setattr(FixJob, "fixed", slow)
    command = ("fix", parts, "-m", shop.machine, "-o", shop.folder / "out", "--assume-zero", "--json", "--resume")
    result = ncfix(*command, "--jobs", jobs, "--time-limit-s", LIMIT_S)
    assert result.code == ExitCode.FAULT
    failed = [each for each in result.json()["files"] if "errors" in each]
    assert [(Path(each["path"]).name, each["errors"][0]["code"]) for each in failed] == [("part2.ngc", "NCF030")]
    again = ncfix(*command, "--time-limit-s", LIMIT_S)
    assert again.code == ExitCode.FAULT
    assert all(each["resumed"] for each in again.json()["files"])
    monkeypatch.undo()
    assert ncfix(*command).code == ExitCode.DONE


def test_a_program_that_takes_too_much_memory(ncfix_process: Any, shop: Any) -> None:
    command = ("fix", shop.program, "-m", shop.machine, "-o", shop.folder / "out.ngc", "--assume-zero")
    result = ncfix_process(*command, "--memory-limit-mb", 5)
    assert result.code == ExitCode.FAULT
    assert "NCF024" in result.err
    assert ncfix_process(*command, "--memory-limit-mb", 1000).code == ExitCode.DONE
