"""Many programs at once: the same outputs however many work on them, and a batch that stopped goes on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from ncfix.batch.work import JOURNAL
from ncfix.diagnostics import ExitCode

COUNT = 6


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
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


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


def test_a_batch_that_is_over_leaves_no_journal(ncfix: Any, shop: Any, parts: Path) -> None:
    out = shop.folder / "out"
    (parts / "bad.ngc").write_bytes(b"G1 X1 Y..2\nM2\n")
    ncfix("fix", parts, "-m", shop.machine, "-o", out, "--assume-zero")
    assert len(contents(out)) == COUNT


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


def test_a_killed_batch_goes_on_to_the_same_bytes(ncfix: Any, shop: Any, parts: Path) -> None:
    whole, out = shop.folder / "whole", shop.folder / "out"
    ncfix("fix", parts, "-m", shop.machine, "-o", whole, "--assume-zero")
    command = ["fix", str(parts), "-m", str(shop.machine), "-o", str(out), "--assume-zero", "--json"]
    running = subprocess.Popen(
        [sys.executable, "-m", "ncfix", *command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    while running.poll() is None and not (out / JOURNAL).exists():
        time.sleep(0.001)
    os.kill(running.pid, signal.SIGKILL)
    running.wait()
    done = set(contents(out)) & set(contents(whole))
    assert all(contents(out)[name] == contents(whole)[name] for name in done)
    result = ncfix(*command, "--resume")
    assert result.code == ExitCode.DONE
    assert contents(out) == contents(whole)


def test_the_journal_says_what_need_not_be_done_again(ncfix: Any, shop: Any, parts: Path) -> None:
    from ncfix.batch.work import Journal

    out = shop.folder / "out"
    command = ("fix", parts, "-m", shop.machine, "-o", out, "--assume-zero", "--json")
    finish, Journal.finish = Journal.finish, lambda self: None  # type: ignore[method-assign]
    try:
        first = ncfix(*command).json()["files"]
    finally:
        Journal.finish = finish  # type: ignore[method-assign]
    assert len(Journal(str(out)).records()) == COUNT
    (out / "part0.ngc").unlink()
    (parts / "part2.ngc").write_bytes(shop.program.read_bytes())
    result = ncfix(*command, "--resume")
    again = result.json()["files"]
    assert [each.get("resumed", False) for each in again] == [False, False, True, True, True, True]
    assert again[2] == {**first[2], "resumed": True}
    assert "NCF004" in result.err  # part2 is another program now, and its old output is not replaced unasked
